//! The simulator as a diagnosis uses it.

use crate::dataset::Run;
use crate::diagnose::{ForwardError, ForwardModel};
use crate::drive::{self, DriveError, Observer, Snapshot, Task};
use crate::geometry::Trace;
use crate::odometry::OdometryParameters;
use crate::scene::{Scene, SpottedFloor};
use std::sync::atomic::AtomicBool;

/// Predicts runs by simulating them: a replay where there is a log, else the driver drives the protocol.
pub struct Simulator<'a> {
    scene: Scene,
    stop: &'a AtomicBool,
}

impl<'a> Simulator<'a> {
    /// Step of the simulations that a diagnosis makes \[s\], unless the scene's is longer: the default.
    pub const TIME_STEP: f64 = 2.5e-3;

    /// A simulator of `scene` as given; `stop` set from outside ends what it does.
    pub fn new(scene: &Scene, stop: &'a AtomicBool) -> Simulator<'a> {
        let mut scene = scene.clone();
        // What is only seen or hit is nothing to a prediction, and copied with every edit.
        scene.robot.chassis.visuals.clear();
        scene.robot.wheels.iter_mut().for_each(|wheel| wheel.body.visuals.clear());
        scene.time_step = scene.time_step.max(Simulator::TIME_STEP);
        Simulator { scene, stop }
    }
}

impl Simulator<'_> {
    /// What ends it from outside.
    pub fn stop(&self) -> &AtomicBool {
        self.stop
    }
}

/// Keeps where the base was.
struct Tracer {
    start: crate::geometry::Pose2,
    trace: Trace,
}

impl Observer for Tracer {
    fn observe(&mut self, snapshot: &Snapshot<'_>) {
        self.trace.time.push(snapshot.time);
        self.trace.poses.push(self.start.compose(snapshot.truth));
    }
}

impl ForwardModel for Simulator<'_> {
    fn scene(&self) -> &Scene {
        &self.scene
    }

    fn trace(&self, scene: &Scene, run: &Run, counted: &OdometryParameters) -> Result<Trace, ForwardError> {
        let scene = scene.clone().noise_free();
        if run.log().is_some() {
            return drive::replay(&scene, run, counted, self.stop).map_err(boxed);
        }
        let task = task_of(run);
        let mut tracer = Tracer { start: task.start, trace: Trace::default() };
        drive::run(&scene, &task, 0, Some(&mut tracer), self.stop).map_err(boxed)?;
        Ok(tracer.trace)
    }

    fn traces_on(
        &self,
        scene: &Scene,
        run: &Run,
        counted: &OdometryParameters,
        floors: &[SpottedFloor],
    ) -> Result<Vec<Trace>, ForwardError> {
        let scene = scene.clone().noise_free();
        if run.log().is_some() {
            drive::replay_beside(&scene, run, counted, floors, self.stop).map_err(boxed)
        } else {
            drive::run_beside(&scene, &task_of(run), floors, self.stop).map_err(boxed)
        }
    }
}

fn boxed(error: DriveError) -> ForwardError {
    ForwardError(Box::new(error))
}

/// What the driver drives where there is no log.
pub(super) fn task_of(run: &Run) -> Task {
    Task {
        speed: run.speed,
        turn_rate: run.turn_rate,
        started: run.started,
        start: run.start.unwrap_or_default(),
        ..Task::new(run.name.clone(), run.protocol)
    }
}
