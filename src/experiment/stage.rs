//! One campaign of squares with one set of believed parameters.

use crate::calibrate::{CalibrateError, CentreOfGravity, SquareErrors, Training};
use crate::dataset::{Campaign, Dataset, DatasetError, DriveKind, RobotFacts, SurveyFacts};
use crate::drive::{self, DriveError, Observer, SimulatedRun, Task};
use crate::odometry::OdometryParameters;
use crate::scene::Scene;
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;

/// A run of a stage, for whoever watches.
#[derive(Debug, Clone, Copy)]
pub struct StageRun<'a> {
    /// `before`, `after_umbmark_2m`, …
    pub stage: &'a str,
    /// What is driven.
    pub task: &'a Task,
    /// Which repeat, from 1.
    pub repeat: usize,
}

/// Watches an experiment: a progress bar, a recording. Called from the runs' own threads.
pub trait Watch: Sync {
    /// A run begins; the observer returned sees it while it goes.
    fn begins(&self, run: StageRun<'_>) -> Option<Box<dyn Observer>>;
    /// A run has come to its end.
    fn ended(&self, run: StageRun<'_>, result: &SimulatedRun);
    /// All runs of a stage have ended, or will not: what there is should be kept now.
    ///
    /// # Errors
    /// It could not be kept; the experiment ends.
    fn stage_ended(&self, stage: &Stage) -> Result<(), DatasetError>;
}

/// What one campaign of squares came to.
#[derive(Debug, Clone)]
pub struct Stage {
    /// `before`, `after_umbmark_2m`, …
    pub name: String,
    /// What the robot believed.
    pub odometry: OdometryParameters,
    /// What a lab would have noted, of the runs that came to their end.
    pub dataset: Dataset,
    /// The same runs with their truth.
    pub runs: Vec<SimulatedRun>,
    /// Centres of gravity, one entry a side.
    pub sides: Vec<SideResult>,
}

/// Centres of gravity of the squares of one side length.
#[derive(Debug, Clone)]
pub struct SideResult {
    /// All errors.
    pub errors: SquareErrors,
    /// \[m\]
    pub side: f64,
    /// Clockwise.
    pub cw: CentreOfGravity,
    /// Counter-clockwise.
    pub ccw: CentreOfGravity,
}

impl SideResult {
    /// E_max,syst = max(r_cg,cw, r_cg,ccw) \[m\] [Borenstein & Feng 1996, eq 12; Bei et al., eq 11].
    #[doc(alias = "E_max,syst")]
    pub fn e_max_syst(&self) -> f64 {
        self.cw.distance().max(self.ccw.distance())
    }
}

impl Stage {
    /// The entry of one side.
    pub fn side(&self, side: f64) -> Option<&SideResult> {
        self.sides.iter().find(|entry| entry.side == side)
    }
}

/// Drives the tasks of several stages side by side; results come in the order of the tasks, whatever the threads did.
/// Runs that were stopped or failed are left out; the first failure, in that order, comes beside the rest.
pub(super) fn drive_all(
    stages: &[(String, Scene)],
    tasks: &[(Task, usize)],
    seed: u64,
    watch: &dyn Watch,
    stop: &AtomicBool,
) -> (Vec<Vec<SimulatedRun>>, Option<DriveError>) {
    let jobs: Vec<(usize, usize)> =
        (0..stages.len()).flat_map(|stage| (0..tasks.len()).map(move |task| (stage, task))).collect();
    let results: Vec<Result<SimulatedRun, DriveError>> = jobs
        .par_iter()
        .map(|&(stage, task)| {
            let (name, scene) = &stages[stage];
            let (task, repeat) = &tasks[task];
            let label = StageRun { stage: name, task, repeat: *repeat };
            let mut observer = watch.begins(label);
            let observer = observer.as_deref_mut().map(|observer| observer as &mut dyn Observer);
            let result = drive::run(scene, task, drive::derived_seed(seed, name), observer, stop)?;
            watch.ended(label, &result);
            Ok(result)
        })
        .collect();
    let mut by_stage: Vec<Vec<SimulatedRun>> = vec![Vec::new(); stages.len()];
    let mut failure = None;
    for ((stage, _), result) in jobs.into_iter().zip(results) {
        match result {
            Ok(run) => by_stage[stage].push(run),
            Err(DriveError::Interrupted { .. }) => {}
            Err(error) => failure = failure.or(Some(error)),
        }
    }
    (by_stage, failure)
}

/// Puts a stage's runs together as a lab would have noted them.
pub(super) fn collect(name: &str, scene: &Scene, runs: Vec<SimulatedRun>) -> Result<Stage, CalibrateError> {
    let dataset =
        Dataset { campaign: campaign(scene, name), runs: runs.iter().map(|run| run.measured.clone()).collect() };
    if dataset.runs.is_empty() {
        let (name, odometry) = (name.to_owned(), scene.robot.odometry);
        return Ok(Stage { name, odometry, dataset, runs, sides: Vec::new() });
    }
    let sides = SquareErrors::of(&Training::new(std::slice::from_ref(&dataset))?)
        .into_iter()
        .filter_map(|errors| {
            let (cw, ccw) = (errors.cw_centre()?, errors.ccw_centre()?);
            Some(SideResult { side: errors.side, cw, ccw, errors })
        })
        .collect();
    Ok(Stage { name: name.to_owned(), odometry: scene.robot.odometry, dataset, runs, sides })
}

/// What `dataset.toml` states of a campaign simulated in `scene`.
pub fn campaign(scene: &Scene, name: &str) -> Campaign {
    let robot = &scene.robot;
    let mean_diameter =
        robot.wheels.iter().map(|wheel| 2.0 * wheel.tyre.free_radius).sum::<f64>() / robot.wheels.len() as f64;
    let skid_steer = robot.wheels.len() > 2;
    Campaign {
        name: format!("{}-{name}", robot.name),
        description: Some(format!("Simulated: {} on {}", robot.name, scene.floor.name)),
        source: Some(format!("treadmark {}", env!("CARGO_PKG_VERSION"))),
        licence: None,
        robot: RobotFacts {
            model: Some(robot.file.clone()),
            drive: Some(if skid_steer { DriveKind::SkidSteer } else { DriveKind::Differential }),
            nominal_wheel_diameter: Some(mean_diameter),
            nominal_track_width: Some(robot.track_width()),
            wheelbase: skid_steer.then(|| robot.wheelbase()),
            wheel_width: robot.wheels.first().map(|wheel| wheel.tyre.width),
            mass: Some(robot.mass()),
            ticks_per_revolution: Some(robot.encoder.ticks_per_revolution),
        },
        world_model: Some(scene.floor.file.clone()),
        odometry: Some(robot.odometry),
        survey: SurveyFacts {
            method: Some("simulated".to_owned()),
            position_std: Some(scene.survey.position_std),
            heading_std: Some(scene.survey.heading_std),
        },
        conditions: Default::default(),
    }
}
