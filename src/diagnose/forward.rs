//! What a diagnosis asks of a simulation.

use crate::dataset::Run;
use crate::geometry::Trace;
use crate::odometry::OdometryParameters;
use crate::scene::Scene;

/// Predicts where the base of the robot was during a run. A diagnosis is handed one, and knows no engine.
pub trait ForwardModel: Sync {
    /// The model as given.
    fn scene(&self) -> &Scene;

    /// Where the base was during `run` in `scene`, which is the given scene with causes in it: a replay of the run's
    /// encoder log where it has one, else its protocol as the simulated driver drives it. Without noise and scatter.
    /// `counted` says what the log's ticks mean.
    ///
    /// # Errors
    /// It cannot be simulated.
    fn trace(&self, scene: &Scene, run: &Run, counted: &OdometryParameters) -> Result<Trace, ForwardError>;
}

/// A run that the model cannot predict.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct ForwardError(pub Box<dyn std::error::Error + Send + Sync>);
