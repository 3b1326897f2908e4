//! Planar poses and twists, SE(2). The only place where an angle is wrapped.
//!
//! x forward, y left, headings counter-clockwise positive and *unwrapped*: a robot that has made a full clockwise
//! turn is at −2π, not at 0. That is what encoders, surveys of whole runs and the dataset files speak.

use std::f64::consts::{PI, TAU};

/// A planar pose `a_from_b`: where frame b stands in frame a. `x`, `y` \[m\], `heading` \[rad, unwrapped\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose2 {
    /// Forward \[m\].
    pub x: f64,
    /// Left \[m\].
    pub y: f64,
    /// Counter-clockwise \[rad\], unwrapped.
    pub heading: f64,
}

/// A planar body twist: the velocity of a body in its own frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Twist2 {
    /// Forward speed \[m/s\].
    pub forward: f64,
    /// Leftward speed \[m/s\].
    pub left: f64,
    /// Yaw rate, counter-clockwise \[rad/s\].
    pub yaw_rate: f64,
}

impl Pose2 {
    /// The origin.
    pub const IDENTITY: Pose2 = Pose2 { x: 0.0, y: 0.0, heading: 0.0 };

    /// A pose from its parts \[m, m, rad\].
    pub const fn new(x: f64, y: f64, heading: f64) -> Self {
        Pose2 { x, y, heading }
    }

    /// `a_from_c = a_from_b.compose(b_from_c)`. Headings add without wrapping.
    ///
    /// ```
    /// # use treadmark::geometry::Pose2;
    /// let quarter_turn = Pose2::new(1.0, 0.0, std::f64::consts::FRAC_PI_2);
    /// let end = quarter_turn.compose(Pose2::new(2.0, 0.0, 0.0));
    /// assert!((end.x - 1.0).abs() < 1e-15 && (end.y - 2.0).abs() < 1e-15);
    /// ```
    pub fn compose(self, b_from_c: Pose2) -> Pose2 {
        let (sin, cos) = self.heading.sin_cos();
        Pose2 {
            x: self.x + cos * b_from_c.x - sin * b_from_c.y,
            y: self.y + sin * b_from_c.x + cos * b_from_c.y,
            heading: self.heading + b_from_c.heading,
        }
    }

    /// `b_from_a` of `a_from_b`.
    pub fn inverse(self) -> Pose2 {
        let (sin, cos) = self.heading.sin_cos();
        Pose2 { x: -cos * self.x - sin * self.y, y: sin * self.x - cos * self.y, heading: -self.heading }
    }

    /// `b_from_c` of `self = a_from_b` and `other = a_from_c`: the other pose as seen from this one.
    pub fn relative(self, other: Pose2) -> Pose2 {
        self.inverse().compose(other)
    }

    /// Moves along the twist `(forward, left, yaw)` held for one unit of time: the exponential map of SE(2), exact for
    /// an arc of constant curvature.
    ///
    /// `forward`, `left` \[m\] and `yaw` \[rad\] are in the frame of this pose.
    pub fn moved(self, forward: f64, left: f64, yaw: f64) -> Pose2 {
        // sin(θ)/θ and (1 − cos θ)/θ; the series to θ⁴ is exact in f64 below 1e-3.
        let (a, b) = if yaw.abs() < 1e-3 {
            let y2 = yaw * yaw;
            (1.0 - y2 / 6.0 * (1.0 - y2 / 20.0), yaw / 2.0 * (1.0 - y2 / 12.0 * (1.0 - y2 / 30.0)))
        } else {
            (yaw.sin() / yaw, (1.0 - yaw.cos()) / yaw)
        };
        self.compose(Pose2::new(a * forward - b * left, b * forward + a * left, yaw))
    }

    /// Distance of the two origins \[m\].
    pub fn distance(self, other: Pose2) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }
}

/// Where a body was over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trace {
    /// Ascending \[s\].
    pub time: Vec<f64>,
    /// room_from_body at each time; headings unwrapped.
    pub poses: Vec<Pose2>,
}

impl Trace {
    /// The pose at `time` \[s\], between its neighbours along an arc; at rest before the first and after the last.
    pub fn at(&self, time: f64) -> Pose2 {
        let after = self.time.partition_point(|&t| t <= time);
        if after == 0 {
            return self.poses[0];
        }
        let (before, Some(&next)) = (after - 1, self.poses.get(after)) else {
            return *self.poses.last().expect("a trace has its start");
        };
        let part = (time - self.time[before]) / (self.time[after] - self.time[before]);
        let step = self.poses[before].relative(next);
        // A step of a trace is short: its chord stands for its arc to second order in the step's turn.
        self.poses[before].compose(Pose2::new(step.x * part, step.y * part, step.heading * part))
    }
}

/// An angle wrapped to (−π, π] \[rad\].
///
/// ```
/// # use treadmark::geometry::wrap_angle;
/// assert!((wrap_angle(-std::f64::consts::TAU) - 0.0).abs() < 1e-15);
/// assert_eq!(wrap_angle(std::f64::consts::PI), std::f64::consts::PI);
/// ```
pub fn wrap_angle(angle: f64) -> f64 {
    let wrapped = angle - TAU * (angle / TAU).round();
    if wrapped <= -PI { wrapped + TAU } else { wrapped }
}

/// `angle` brought to the turn nearest to `reference`, so that their difference lies in (−π, π] \[rad\].
pub fn unwrap_near(angle: f64, reference: f64) -> f64 {
    reference + wrap_angle(angle - reference)
}
