//! Where simulation and inference are put together, and where the simulation is held against what is known.

pub mod bench;
pub mod certify;
mod squares;
mod stage;

pub use squares::{Experiment, ExperimentError, MethodResult, Plan, squares};
pub use stage::{SideResult, Stage, StageRun, Watch, campaign};
