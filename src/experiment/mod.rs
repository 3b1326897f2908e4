//! Where simulation and inference are put together.

mod squares;
mod stage;

pub use squares::{Experiment, ExperimentError, MethodResult, Plan, squares};
pub use stage::{SideResult, Stage, StageRun, Watch, campaign};
