//! What a run shows to whoever watches it, while it goes.

use crate::geometry::Pose2;
use crate::scene::Placement;
use crate::world::WheelSnapshot;

/// Watches a run: a recording, a progress bar, a test. Called at [`SNAPSHOT_RATE`] from the run's own thread; the
/// snapshot lives in the run's buffers, so watching costs what the watcher does.
pub trait Observer {
    /// One moment of the run.
    fn observe(&mut self, snapshot: &Snapshot<'_>);
}

/// How often observers are called, and encoders logged \[Hz\].
pub const SNAPSHOT_RATE: f64 = 50.0;

/// One moment of a run, in the room frame (x, y in the floor, z its normal).
#[derive(Debug, Clone)]
pub struct Snapshot<'a> {
    /// Since the run began \[s\].
    pub time: f64,
    /// room_from_base of the chassis.
    pub base: Placement,
    /// True planar pose of the base in the frame of its true start pose.
    pub truth: Pose2,
    /// Dead-reckoned pose in the frame of the start pose, as the robot believes it.
    pub odometry: Pose2,
    /// The wheels, in the order of [`crate::scene::Robot::wheels`].
    pub wheels: &'a [WheelSnapshot],
    /// room_from_fork of the casters that swivel, x ahead, in the order of [`crate::scene::Robot::casters`].
    pub forks: &'a [Placement],
}
