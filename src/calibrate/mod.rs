//! Dataset → corrections to what the robot believes. One file a published method, its letters and equation numbers
//! beside the code.
//!
//! Methods see a [`Dataset`](crate::dataset::Dataset) and nothing of the simulation (invariant 1).

mod check;
mod end_points;
mod error;
mod umbmark;

pub use check::{Suspicion, SuspicionKind, check};
pub use end_points::{CentreOfGravity, SquareErrors};
pub use error::CalibrateError;
pub use umbmark::umbmark;
