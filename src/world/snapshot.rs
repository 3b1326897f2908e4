//! What a wheel and its patch look like at one moment, for whoever watches.

use super::patch::{CELLS_ACROSS, CELLS_ALONG};
use crate::scene::Placement;

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
