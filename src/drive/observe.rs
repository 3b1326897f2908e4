//! What a run shows to whoever watches it, while it goes.

use crate::geometry::Pose2;
use crate::scene::Placement;

/// Bristle cells along a patch.
pub const CELLS_ALONG: usize = 8;
/// Bristle cells across a patch.
pub const CELLS_ACROSS: usize = 4;

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
}

/// One wheel at one moment.
#[derive(Debug, Clone)]
pub struct WheelSnapshot {
    /// room_from_wheel.
    pub placement: Placement,
    /// Rotation against the chassis since the run began, positive forward \[rad\].
    pub angle: f64,
    /// Its rate \[rad/s\].
    pub speed: f64,
    /// What the driver asks for \[rad/s\].
    pub commanded_speed: f64,
    /// What the encoder has counted since the run began.
    pub ticks: i64,
    /// Motor torque at the wheel \[N m\].
    pub motor_torque: f64,
    /// Vertical load on the tyre \[N\], summed over its patches.
    pub load: f64,
    /// Force on the wheel along its rolling direction \[N\].
    pub force_along: f64,
    /// Force on the wheel to its left \[N\].
    pub force_across: f64,
    /// Velocity of the tread over the ground at the patch centre, along \[m/s\].
    pub slip_along: f64,
    /// The same, to the left \[m/s\].
    pub slip_across: f64,
    /// The main contact patch; `None` when the wheel is off the ground or has no patch model.
    pub patch: Option<PatchSnapshot>,
}

/// A contact patch at one moment.
#[derive(Debug, Clone)]
pub struct PatchSnapshot {
    /// Its centre in the room \[m\].
    pub centre: [f64; 3],
    /// Unit vector along the rolling direction, in the room.
    pub along: [f64; 3],
    /// Unit vector to the left, in the room.
    pub across: [f64; 3],
    /// a, half its length \[m\].
    pub half_length: f64,
    /// w \[m\].
    pub width: f64,
    /// Shear traction on the tyre (along, across) \[Pa\] of each cell, `[cell along, from the rear][cell across, from the right]`.
    pub tractions: [[[f64; 2]; CELLS_ACROSS]; CELLS_ALONG],
}

impl PatchSnapshot {
    /// Centre of a cell in the room \[m\].
    pub fn cell_centre(&self, i: usize, j: usize) -> [f64; 3] {
        let xi = self.half_length * ((2 * i + 1) as f64 / CELLS_ALONG as f64 - 1.0);
        let eta = 0.5 * self.width * ((2 * j + 1) as f64 / CELLS_ACROSS as f64 - 1.0);
        std::array::from_fn(|k| self.centre[k] + xi * self.along[k] + eta * self.across[k])
    }
}
