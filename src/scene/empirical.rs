//! Motion that no physical part of the scene explains: a sparse formula of the body's twist, as a diagnosis found it.

use crate::geometry::{Pose2, Twist2};
use serde::{Deserialize, Serialize};

/// One term: `coefficient` times `feature`, added to one part of the body's twist.
///
/// Units of the coefficient are those of the part over those of the feature, in SI.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EmpiricalTerm {
    /// What it adds to.
    pub part: TwistPart,
    /// What it is proportional to.
    pub feature: Feature,
    /// By how much.
    pub coefficient: f64,
}

/// A part of a planar body twist.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TwistPart {
    /// Forward speed \[m/s\].
    Forward,
    /// Leftward speed \[m/s\].
    Left,
    /// Yaw rate \[rad/s\].
    Yaw,
}

/// What a term can be proportional to: features of the body's own motion v, ω, of its heading θ and place x, y in the
/// room, of the time t since the run began, and of its acceleration a.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Feature {
    /// v
    Speed,
    /// |v|
    AbsSpeed,
    /// v |v|
    SpeedSquared,
    /// ω
    YawRate,
    /// |ω|
    AbsYawRate,
    /// ω |ω|
    YawRateSquared,
    /// v cos θ
    SpeedCosHeading,
    /// v sin θ
    SpeedSinHeading,
    /// v cos 2θ: what a floor with a grain does, alike on the way there and back
    SpeedCosTwiceHeading,
    /// v sin 2θ
    SpeedSinTwiceHeading,
    /// |ω| cos θ
    YawRateCosHeading,
    /// |ω| sin θ
    YawRateSinHeading,
    /// v x
    SpeedX,
    /// v y
    SpeedY,
    /// v t
    SpeedTime,
    /// a
    Acceleration,
    /// |a|
    AbsAcceleration,
}

/// The motion that features are made of.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motion {
    /// In the body's frame.
    pub twist: Twist2,
    /// In the room.
    pub pose: Pose2,
    /// Since the run began \[s\].
    pub time: f64,
    /// Forward \[m/s²\].
    pub acceleration: f64,
}

impl TwistPart {
    /// All of them.
    pub const ALL: [TwistPart; 3] = [TwistPart::Forward, TwistPart::Left, TwistPart::Yaw];

    /// Its symbol in a formula.
    pub fn symbol(self) -> &'static str {
        match self {
            TwistPart::Forward => "δv",
            TwistPart::Left => "δu",
            TwistPart::Yaw => "δω",
        }
    }
}

impl Feature {
    /// All of them.
    pub const ALL: [Feature; 17] = [
        Feature::Speed,
        Feature::AbsSpeed,
        Feature::SpeedSquared,
        Feature::YawRate,
        Feature::AbsYawRate,
        Feature::YawRateSquared,
        Feature::SpeedCosHeading,
        Feature::SpeedSinHeading,
        Feature::SpeedCosTwiceHeading,
        Feature::SpeedSinTwiceHeading,
        Feature::YawRateCosHeading,
        Feature::YawRateSinHeading,
        Feature::SpeedX,
        Feature::SpeedY,
        Feature::SpeedTime,
        Feature::Acceleration,
        Feature::AbsAcceleration,
    ];

    /// Its value in a motion, in SI units.
    pub fn value(self, motion: &Motion) -> f64 {
        let (v, w) = (motion.twist.forward, motion.twist.yaw_rate);
        let (sin, cos) = motion.pose.heading.sin_cos();
        match self {
            Feature::Speed => v,
            Feature::AbsSpeed => v.abs(),
            Feature::SpeedSquared => v * v.abs(),
            Feature::YawRate => w,
            Feature::AbsYawRate => w.abs(),
            Feature::YawRateSquared => w * w.abs(),
            Feature::SpeedCosHeading => v * cos,
            Feature::SpeedSinHeading => v * sin,
            Feature::SpeedCosTwiceHeading => v * (cos * cos - sin * sin),
            Feature::SpeedSinTwiceHeading => v * 2.0 * sin * cos,
            Feature::YawRateCosHeading => w.abs() * cos,
            Feature::YawRateSinHeading => w.abs() * sin,
            Feature::SpeedX => v * motion.pose.x,
            Feature::SpeedY => v * motion.pose.y,
            Feature::SpeedTime => v * motion.time,
            Feature::Acceleration => motion.acceleration,
            Feature::AbsAcceleration => motion.acceleration.abs(),
        }
    }

    /// Its symbol in a formula.
    pub fn symbol(self) -> &'static str {
        match self {
            Feature::Speed => "v",
            Feature::AbsSpeed => "|v|",
            Feature::SpeedSquared => "v|v|",
            Feature::YawRate => "ω",
            Feature::AbsYawRate => "|ω|",
            Feature::YawRateSquared => "ω|ω|",
            Feature::SpeedCosHeading => "v cos θ",
            Feature::SpeedSinHeading => "v sin θ",
            Feature::SpeedCosTwiceHeading => "v cos 2θ",
            Feature::SpeedSinTwiceHeading => "v sin 2θ",
            Feature::YawRateCosHeading => "|ω| cos θ",
            Feature::YawRateSinHeading => "|ω| sin θ",
            Feature::SpeedX => "v x",
            Feature::SpeedY => "v y",
            Feature::SpeedTime => "v t",
            Feature::Acceleration => "a",
            Feature::AbsAcceleration => "|a|",
        }
    }
}

impl EmpiricalTerm {
    /// The twist that `terms` add to a body that moves with `motion`.
    pub fn twist(terms: &[EmpiricalTerm], motion: &Motion) -> Twist2 {
        terms.iter().fold(Twist2::default(), |mut sum, term| {
            let value = term.coefficient * term.feature.value(motion);
            match term.part {
                TwistPart::Forward => sum.forward += value,
                TwistPart::Left => sum.left += value,
                TwistPart::Yaw => sum.yaw_rate += value,
            }
            sum
        })
    }
}

impl std::fmt::Display for EmpiricalTerm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} = {:+.4e} {}", self.part.symbol(), self.coefficient, self.feature.symbol())
    }
}
