//! The main job: drive squares, calibrate from their end points, drive again.

use super::stage::{Stage, Watch, collect, drive_all};
use crate::calibrate::{CalibrateError, Estimate, Method, Training};
use crate::dataset::{DatasetError, Protocol, Rotation, Travel};
use crate::drive::{DriveError, Task};
use crate::scene::Scene;
use std::sync::atomic::{AtomicBool, Ordering};

/// What an experiment drives, and how it calibrates.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Sides of the squares \[m\].
    pub sides: Vec<f64>,
    /// Runs of each kind.
    pub repeats: usize,
    /// Of all noise.
    pub seed: u64,
    /// In the order of their results; one that is not applicable is left out of them.
    pub methods: Vec<&'static Method>,
}

impl Plan {
    /// The squares: every side, both ways round.
    pub fn squares(&self) -> Vec<Protocol> {
        let both = [Rotation::Clockwise, Rotation::CounterClockwise];
        self.sides.iter().flat_map(|&side| both.map(|direction| Protocol::Square { side, direction })).collect()
    }

    /// The straight, as long as the longest side, that parts the distance scale from the track.
    pub fn straight(&self) -> Protocol {
        Protocol::Straight { length: self.longest(), direction: Travel::Forward }
    }

    /// The run that a recording shows closely.
    pub fn featured(&self) -> Protocol {
        Protocol::Square { side: self.longest(), direction: Rotation::CounterClockwise }
    }

    /// How many runs the experiment has at most: squares and straights before, squares after each method on each side.
    pub fn run_count(&self) -> usize {
        let squares = 2 * self.sides.len() * self.repeats;
        squares + self.repeats + self.methods.len() * self.sides.len() * squares
    }

    /// Longest side \[m\].
    pub fn longest(&self) -> f64 {
        self.sides.iter().copied().fold(0.0, f64::max)
    }

    /// Every repeat of `protocols`, with its number from 1.
    fn tasks(&self, protocols: &[Protocol]) -> Vec<(Task, usize)> {
        let repeats = |&protocol: &Protocol| {
            (1..=self.repeats).map(move |repeat| {
                let name = match protocol {
                    Protocol::Square { side, direction } => format!("{side}m-{}-{repeat}", direction.as_str()),
                    _ => format!("{}-{repeat}", protocol.kind()),
                };
                (Task::new(name, protocol), repeat)
            })
        };
        protocols.iter().flat_map(repeats).collect()
    }
}

/// What an experiment came to.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Name of the robot that drove.
    pub robot: String,
    /// Uncalibrated.
    pub before: Stage,
    /// Each method on each side's end points.
    pub methods: Vec<MethodResult>,
    /// Methods that could not be applied: name, side \[m\], why.
    pub not_applicable: Vec<(&'static str, f64, CalibrateError)>,
    /// Whether it was driven to its end; stages hold what was.
    pub complete: bool,
}

/// One method, calibrated on one side's end points, driven again on all.
#[derive(Debug, Clone)]
pub struct MethodResult {
    /// `umbmark`, …
    pub method: &'static str,
    /// \[m\]
    pub calibrated_on_side: f64,
    /// The correction.
    pub estimate: Estimate,
    /// The calibrated robot's squares.
    pub after: Stage,
}

impl Experiment {
    /// Name of the uncalibrated stage.
    pub const BEFORE: &'static str = "before";

    /// Before, then after each method.
    pub fn stages(&self) -> impl Iterator<Item = &Stage> {
        std::iter::once(&self.before).chain(self.methods.iter().map(|method| &method.after))
    }

    /// The calibration that gained most at the side that it saw.
    pub fn best(&self) -> Option<&MethodResult> {
        let better = |result: &&MethodResult| result.improvement(&self.before);
        let gained = self.methods.iter().filter(|result| better(result).is_some());
        gained.max_by(|one, other| better(one).unwrap_or(0.0).total_cmp(&better(other).unwrap_or(0.0)))
    }

    /// Name of the stage after a calibration with `method` on squares of `side` \[m\].
    pub fn stage_after(method: &str, side: f64) -> String {
        format!("after_{method}_{side}m")
    }
}

impl MethodResult {
    /// E_max,syst before over after at the calibrated side \[–\]; `None` where it was not driven to its end.
    pub fn improvement(&self, before: &Stage) -> Option<f64> {
        let side = self.calibrated_on_side;
        Some(before.side(side)?.e_max_syst() / self.after.side(side)?.e_max_syst())
    }
}

/// Why an experiment failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// A run.
    #[error(transparent)]
    Drive(#[from] DriveError),
    /// A calibration.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
    /// Results could not be kept.
    #[error(transparent)]
    Keep(#[from] DatasetError),
}

/// Drives squares of every side both ways round and a straight, calibrates with every method on each side's end points,
/// and drives all squares again with each calibration. Runs go side by side on rayon's threads; results do not depend on
/// how many. `stop` set from outside ends it early with what there is.
///
/// # Errors
/// A run that cannot be driven, or results that cannot be kept.
pub fn squares(
    scene: &Scene,
    plan: &Plan,
    watch: &dyn Watch,
    stop: &AtomicBool,
) -> Result<Experiment, ExperimentError> {
    let robot = scene.robot.name.clone();
    let drive = |stages: Vec<(String, Scene)>, protocols: &[Protocol]| -> Result<Vec<Stage>, ExperimentError> {
        let (runs, failure) = drive_all(&stages, &plan.tasks(protocols), plan.seed, watch, stop);
        let collected = stages.iter().zip(runs).map(|((name, scene), runs)| collect(name, scene, runs));
        let collected = collected.collect::<Result<Vec<_>, _>>()?;
        for stage in &collected {
            watch.stage_ended(stage)?;
        }
        failure.map_or(Ok(collected), |failure| Err(failure.into()))
    };
    let squares = plan.squares();
    let with_straight = [&squares[..], &[plan.straight()]].concat();
    let before = drive(vec![(Experiment::BEFORE.to_owned(), scene.clone())], &with_straight)?.remove(0);
    if stop.load(Ordering::Relaxed) {
        return Ok(Experiment { robot, before, methods: Vec::new(), not_applicable: Vec::new(), complete: false });
    }

    let training = Training::new(std::slice::from_ref(&before.dataset))?;
    let mut estimates = Vec::new();
    let mut not_applicable = Vec::new();
    let mut stages = Vec::new();
    for &side in &plan.sides {
        // The squares of this side, and the straights.
        let other = |protocol| matches!(protocol, Protocol::Square { side: of_run, .. } if of_run != side);
        let of_side = training.only(|_, run| !other(run.protocol));
        for method in &plan.methods {
            let estimate = match method.estimate(&of_side) {
                Ok(estimate) => estimate,
                Err(reason) => {
                    not_applicable.push((method.name, side, reason));
                    continue;
                }
            };
            let mut calibrated = scene.clone();
            calibrated.robot.odometry = scene.robot.odometry.corrected(&estimate.correction());
            stages.push((Experiment::stage_after(method.name, side), calibrated));
            estimates.push((method.name, side, estimate));
        }
    }
    let methods = estimates
        .into_iter()
        .zip(drive(stages, &squares)?)
        .map(|((method, calibrated_on_side, estimate), after)| MethodResult {
            method,
            calibrated_on_side,
            estimate,
            after,
        })
        .collect();
    Ok(Experiment { robot, before, methods, not_applicable, complete: !stop.load(Ordering::Relaxed) })
}
