//! Motion that no physical part of the scene explains: a sparse formula of the body's twist, or of a potential that
//! pulls it, as a diagnosis found it.

use crate::geometry::{Pose2, Twist2};
use serde::{Deserialize, Serialize};

/// One term: `coefficient` times `feature`, added to one part of the body's twist, or to the potential of a force on
/// its mass centre.
///
/// Units of the coefficient are those of the part over those of the feature, in SI.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EmpiricalTerm {
    /// What it adds to.
    pub part: TermPart,
    /// What it is proportional to.
    pub feature: Feature,
    /// By how much.
    pub coefficient: f64,
}

/// What a term is a part of: a planar body twist, or a potential in the room.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TermPart {
    /// Forward speed \[m/s\].
    Forward,
    /// Leftward speed \[m/s\].
    Left,
    /// Yaw rate \[rad/s\].
    Yaw,
    /// Energy U \[J\] of where the robot is, which pulls it by −∇U.
    Potential,
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
    /// x²
    XSquared,
    /// x y
    XY,
    /// y²
    YSquared,
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

impl TermPart {
    /// Those of a twist.
    pub const TWIST: [TermPart; 3] = [TermPart::Forward, TermPart::Left, TermPart::Yaw];

    /// Its symbol in a formula.
    pub fn symbol(self) -> &'static str {
        match self {
            TermPart::Forward => "δv",
            TermPart::Left => "δu",
            TermPart::Yaw => "δω",
            TermPart::Potential => "U",
        }
    }
}

impl Feature {
    /// Those that a part of the twist is asked for: where the robot stands it does not creep.
    pub const OF_MOTION: [Feature; 17] = [
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

    /// Those that a potential is asked for: the first order of how a pull changes from place to place, as a rope's or a cable's does.
    /// One that is the same everywhere is a slope's.
    pub const OF_PLACE: [Feature; 3] = [Feature::XSquared, Feature::XY, Feature::YSquared];

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
            Feature::XSquared => motion.pose.x * motion.pose.x,
            Feature::XY => motion.pose.x * motion.pose.y,
            Feature::YSquared => motion.pose.y * motion.pose.y,
            Feature::SpeedX => v * motion.pose.x,
            Feature::SpeedY => v * motion.pose.y,
            Feature::SpeedTime => v * motion.time,
            Feature::Acceleration => motion.acceleration,
            Feature::AbsAcceleration => motion.acceleration.abs(),
        }
    }

    /// How it grows along x and y of the room; `None` of what is no matter of place alone.
    pub fn slope(self, pose: Pose2) -> Option<[f64; 2]> {
        match self {
            Feature::XSquared => Some([2.0 * pose.x, 0.0]),
            Feature::XY => Some([pose.y, pose.x]),
            Feature::YSquared => Some([0.0, 2.0 * pose.y]),
            _ => None,
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
            Feature::XSquared => "x²",
            Feature::XY => "x y",
            Feature::YSquared => "y²",
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
                TermPart::Forward => sum.forward += value,
                TermPart::Left => sum.left += value,
                TermPart::Yaw => sum.yaw_rate += value,
                TermPart::Potential => {}
            }
            sum
        })
    }

    /// The force that `terms` put on a body's mass centre at `pose`, −∇U along x and y of the room \[N\].
    pub fn force(terms: &[EmpiricalTerm], pose: Pose2) -> [f64; 2] {
        let potentials = terms.iter().filter(|term| term.part == TermPart::Potential);
        potentials.fold([0.0; 2], |sum, term| {
            let slope = term.feature.slope(pose).unwrap_or_default();
            [0, 1].map(|along| sum[along] - term.coefficient * slope[along])
        })
    }

    /// Whether it can be: a potential is one of where the robot is.
    pub fn is_sound(&self) -> bool {
        self.coefficient.is_finite()
            && (self.part != TermPart::Potential || self.feature.slope(Pose2::default()).is_some())
    }
}

impl std::fmt::Display for EmpiricalTerm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} = {:+.4e} {}", self.part.symbol(), self.coefficient, self.feature.symbol())
    }
}
