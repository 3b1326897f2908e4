//! How poses are measured, and what differs from run to run.

use crate::geometry::Pose2;
use serde::{Deserialize, Serialize};

/// How poses are measured: the noise of one reading, 1 σ (the start of a run is a reading like its end), and what is
/// systematically off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Survey {
    /// Noise of each coordinate \[m\].
    pub position_std: f64,
    /// \[rad\]
    pub heading_std: f64,
    /// Time over which the noise of poses on the way remembers itself \[s\]; 0: every reading is fresh.
    pub correlation_time: f64,
    /// Tracked frame in the robot's base: where the tracked point is \[m\] and how its axis is turned \[rad\].
    pub base_from_tracked: Pose2,
    /// How far the robot's start heading was off the mark that poses are stated in \[rad\].
    pub start_heading_error: f64,
    /// Lengths as read over true lengths \[–\].
    pub scale: f64,
    /// Stamp of a pose less the encoders' clock at that moment \[s\].
    pub time_offset: f64,
    /// The same from run to run, 1 σ \[s\].
    pub time_offset_std: f64,
    /// Rate of the survey's clock over the encoders' \[–\].
    pub clock_rate: f64,
}

impl Survey {
    /// Readings without noise, by a tape that is true and a clock that agrees.
    pub const PERFECT: Survey = Survey {
        position_std: 0.0,
        heading_std: 0.0,
        correlation_time: 0.0,
        base_from_tracked: Pose2::IDENTITY,
        start_heading_error: 0.0,
        scale: 1.0,
        time_offset: 0.0,
        time_offset_std: 0.0,
        clock_rate: 1.0,
    };

    /// The same survey without noise: what is left is systematic.
    pub fn noise_free(self) -> Survey {
        Survey { position_std: 0.0, heading_std: 0.0, time_offset_std: 0.0, ..self }
    }

    /// What is read of a base at `pose` after a start at `start`, both in the room: tracked frame relative to tracked
    /// frame, scaled, turned by the start heading's error.
    pub fn reading(&self, start: Pose2, pose: Pose2) -> Pose2 {
        self.readings_from(start)(pose)
    }

    /// The same of many poses after one start: what hangs on the start alone is worked out once.
    pub fn readings_from(&self, start: Pose2) -> impl Fn(Pose2) -> Pose2 {
        let Survey { base_from_tracked: frame, scale, start_heading_error: turned, .. } = *self;
        let is_aside = frame.x != 0.0 || frame.y != 0.0;
        let tracked = move |base: Pose2| match is_aside {
            true => base.compose(frame),
            false => Pose2 { heading: base.heading + frame.heading, ..base },
        };
        let start = tracked(start);
        let (sin, cos) = (turned - start.heading).sin_cos();
        move |pose| {
            let pose = tracked(pose);
            let (x, y) = (scale * (pose.x - start.x), scale * (pose.y - start.y));
            Pose2::new(cos * x - sin * y, sin * x + cos * y, pose.heading - start.heading + turned)
        }
    }

    /// A tracked pose relative to the tracked start, as it is stated.
    pub fn stated(&self, tracked: Pose2) -> Pose2 {
        Survey { base_from_tracked: Pose2::IDENTITY, ..*self }.reading(Pose2::IDENTITY, tracked)
    }

    /// Stamp of a pose at `time` of the encoders' clock \[s\].
    pub fn stamp(&self, time: f64) -> f64 {
        self.clock_rate * time + self.time_offset
    }

    /// Inverse of [`Survey::stamp`].
    pub fn time_of(&self, stamp: f64) -> f64 {
        (stamp - self.time_offset) / self.clock_rate
    }
}

impl Default for Survey {
    /// A tape measure and a straight edge: 2 mm, 3 mrad.
    fn default() -> Self {
        Survey { position_std: 2e-3, heading_std: 3e-3, ..Survey::PERFECT }
    }
}

/// What an uneven floor does to real runs that encoders cannot see, 1 σ, drawn run by run.
///
/// A bump under one wheel lengthens its way; the body ends up turned or short against what the wheels rolled. The
/// simulation imposes that twist as a motion of the floor under the tyres, in proportion to the body's own motion, so
/// that the tyres work as they do and only the outcome scatters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    /// Heading a quarter turn on the spot \[rad\].
    pub heading_per_corner: f64,
    /// Heading over the square root of distance \[rad/√m\].
    pub heading_per_sqrt_metre: f64,
    /// Distance, relative \[–\].
    pub distance: f64,
}

impl Scatter {
    /// An even floor.
    pub const NONE: Scatter = Scatter { heading_per_corner: 0.0, heading_per_sqrt_metre: 0.0, distance: 0.0 };
}

impl Default for Scatter {
    fn default() -> Self {
        Scatter { heading_per_corner: 2.5e-3, heading_per_sqrt_metre: 1e-3, distance: 1e-3 }
    }
}
