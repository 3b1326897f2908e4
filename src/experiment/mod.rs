//! Where simulation and inference are put together, and where the simulation is held against what is known.

pub mod bench;
pub mod certify;
mod challenge;
mod score;
mod simulator;
mod squares;
mod stage;
pub mod sweep;

pub use challenge::{CampaignKind, Challenge, DataKind, Draw, EffectsKind};
pub use score::{Score, ScoreError, Scored, Tally, score};
pub use simulator::Simulator;
pub use squares::{Experiment, ExperimentError, MethodResult, Plan, squares};
pub use stage::{SideResult, Stage, StageRun, Watch, campaign};
