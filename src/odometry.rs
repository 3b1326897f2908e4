//! Dead reckoning: wheel radii, track width and encoder ticks → pose.
//!
//! The differential-drive equations [Siegwart, Nourbakhsh & Scaramuzza, *Introduction to Autonomous Mobile Robots*,
//! 2nd ed., ch. 5.2.4], integrated along exact arcs, so that nothing depends on how often the encoders were read while
//! both speeds were constant.

use crate::geometry::Pose2;
use std::f64::consts::TAU;

/// What an on-board controller believes about its robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometryParameters {
    /// Rolling radius of the left wheels \[m\].
    pub left_wheel_radius: f64,
    /// Rolling radius of the right wheels \[m\].
    pub right_wheel_radius: f64,
    /// Effective track width that wheel speed differences are divided by \[m\].
    #[doc(alias = "b")]
    #[doc(alias = "wheelbase")]
    pub track_width: f64,
    /// Encoder ticks a wheel revolution; a real number, as gears make it. `None`: the encoders speak radians.
    pub ticks_per_revolution: Option<f64>,
}

/// Corrections to what an odometry believes, as every calibration method states them; 1 is no correction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OdometryCorrection {
    /// E_d = D_R / D_L, true over believed.
    #[doc(alias = "E_d")]
    pub diameter_ratio: f64,
    /// E_b = b_true / b_believed.
    #[doc(alias = "E_b")]
    pub track_ratio: f64,
    /// E_s = D_mean,true / D_mean,believed.
    #[doc(alias = "E_s")]
    pub distance_scale: f64,
}

impl OdometryCorrection {
    /// No correction.
    pub const IDENTITY: Self = OdometryCorrection { diameter_ratio: 1.0, track_ratio: 1.0, distance_scale: 1.0 };

    /// Factors on the left and right wheel radius that have this diameter ratio and this mean:
    /// c_L = 2/(E_d + 1), c_R = 2/(1/E_d + 1) [Borenstein & Feng 1996, eqs 20–21], times E_s.
    pub fn wheel_factors(&self) -> (f64, f64) {
        let left = 2.0 / (self.diameter_ratio + 1.0);
        let right = 2.0 / (1.0 / self.diameter_ratio + 1.0);
        (left * self.distance_scale, right * self.distance_scale)
    }
}

impl OdometryParameters {
    /// These parameters with a calibration's correction applied.
    pub fn corrected(&self, correction: &OdometryCorrection) -> Self {
        let (left, right) = correction.wheel_factors();
        OdometryParameters {
            left_wheel_radius: self.left_wheel_radius * left,
            right_wheel_radius: self.right_wheel_radius * right,
            track_width: self.track_width * correction.track_ratio,
            ..*self
        }
    }

    /// Wheel rotation that `ticks` stand for \[rad\].
    pub fn angle_of_ticks(&self, ticks: f64) -> f64 {
        ticks * (TAU / self.ticks_per_revolution.unwrap_or(TAU))
    }

    /// The pose after the wheels have turned by `left`, `right` \[rad\] from `pose`, along an arc.
    pub fn advance(&self, pose: Pose2, left: f64, right: f64) -> Pose2 {
        let left = left * self.left_wheel_radius;
        let right = right * self.right_wheel_radius;
        pose.moved(0.5 * (left + right), 0.0, (right - left) / self.track_width)
    }
}

/// Running dead reckoning on accumulated wheel angles.
#[derive(Debug, Clone)]
pub struct DeadReckoning {
    parameters: OdometryParameters,
    pose: Pose2,
    last: Option<[f64; 2]>,
}

impl DeadReckoning {
    /// Starts at the origin; the first reading only sets the zero of the counters.
    pub fn new(parameters: OdometryParameters) -> Self {
        DeadReckoning { parameters, pose: Pose2::IDENTITY, last: None }
    }

    /// Takes the accumulated rotation of the left and right wheels \[rad\] and returns the new pose.
    pub fn update(&mut self, left: f64, right: f64) -> Pose2 {
        if let Some([last_left, last_right]) = self.last {
            self.pose = self.parameters.advance(self.pose, left - last_left, right - last_right);
        }
        self.last = Some([left, right]);
        self.pose
    }

    /// The pose so far, in the frame of the first reading.
    pub fn pose(&self) -> Pose2 {
        self.pose
    }
}
