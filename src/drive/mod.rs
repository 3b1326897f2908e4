//! Drives protocols.

mod observe;

pub use observe::{CELLS_ACROSS, CELLS_ALONG, Observer, PatchSnapshot, SNAPSHOT_RATE, Snapshot, WheelSnapshot};
