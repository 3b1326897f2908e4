//! Drives protocols: the driver that closes the loop on ticks, and one run from mark to mark.
//!
//! The driver receives ticks, never poses (invariant 2): [`Driver::decide`] is its only way in.

mod beside;
mod driver;
mod error;
mod observe;
mod overrun;
mod replay;
mod run;
mod smooth;

pub use crate::world::{CELLS_ACROSS, CELLS_ALONG, PatchSnapshot, WheelSnapshot};
pub use beside::{replay_beside, run_beside};
pub use driver::{Command, Driver};
pub use error::DriveError;
pub use observe::{Observer, SNAPSHOT_RATE, Snapshot};
pub use replay::replay;
pub use run::{SimulatedRun, Task, derived_seed, run};
