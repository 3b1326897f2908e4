//! What a diagnosis asks of a simulation.

use crate::dataset::Run;
use crate::geometry::Trace;
use crate::odometry::OdometryParameters;
use crate::scene::{Contact, Scene, SpottedFloor};

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

    /// The same on each of `floors`, which are the scene's but for a spot, to the first order in what the spot does.
    ///
    /// # Errors
    /// One of them cannot be simulated.
    fn traces_on(
        &self,
        scene: &Scene,
        run: &Run,
        counted: &OdometryParameters,
        floors: &[SpottedFloor],
    ) -> Result<Vec<Trace>, ForwardError>;
}

/// A model that begins from a scene of its own: what is given, or the same robot on other tyres.
pub(super) struct Base<'m> {
    model: &'m dyn ForwardModel,
    scene: Scene,
}

impl<'m> Base<'m> {
    /// The model as given.
    pub fn of(model: &'m dyn ForwardModel) -> Base<'m> {
        Base { model, scene: model.scene().clone() }
    }

    /// The same, where wheels meet the ground otherwise. What a campaign left of the one says nothing of the other.
    pub fn on(&self, contact: Contact) -> Base<'m> {
        let mut scene = Scene { contact, ..self.scene.clone() };
        scene.robot.residues.clear();
        Base { model: self.model, scene }
    }
}

impl ForwardModel for Base<'_> {
    fn scene(&self) -> &Scene {
        &self.scene
    }

    fn trace(&self, scene: &Scene, run: &Run, counted: &OdometryParameters) -> Result<Trace, ForwardError> {
        self.model.trace(scene, run, counted)
    }

    fn traces_on(
        &self,
        scene: &Scene,
        run: &Run,
        counted: &OdometryParameters,
        floors: &[SpottedFloor],
    ) -> Result<Vec<Trace>, ForwardError> {
        self.model.traces_on(scene, run, counted, floors)
    }
}

/// A run that the model cannot predict.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct ForwardError(pub Box<dyn std::error::Error + Send + Sync>);
