//! Where simulation and inference are put together, and where the simulation is held against what is known.

pub mod bench;
pub mod certify;
mod challenge;
mod predict;
mod simulator;
mod squares;
mod stage;
pub mod sweep;
mod table_one;

pub use challenge::{
    Call, CampaignKind, Challenge, DataKind, Draw, EffectsKind, Interval, Score, ScoreError, Scored, Scorer, Tally,
    planned, planned_as,
};
pub use predict::predict;
pub use simulator::Simulator;
pub use squares::{Experiment, ExperimentError, MethodResult, Plan, squares};
pub use stage::{SideResult, Stage, StageRun, Watch, campaign};
pub use table_one::{Candidate, TABLE_ONE, TableOneError, table_one};
