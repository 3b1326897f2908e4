//! The main job: drive squares, calibrate from their end points, drive again.

use super::stage::{Stage, Watch, collect, drive_all, tasks};
use crate::calibrate::{CalibrateError, Estimate, METHODS, Training};
use crate::dataset::{DatasetError, Protocol};
use crate::drive::DriveError;
use crate::scene::Scene;
use std::sync::atomic::{AtomicBool, Ordering};

/// What an experiment drives.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Sides of the squares \[m\].
    pub sides: Vec<f64>,
    /// Runs each way round.
    pub repeats: usize,
    /// Of all noise.
    pub seed: u64,
}

impl Plan {
    /// How many runs the experiment has: before, and after a calibration on each side.
    pub fn run_count(&self) -> usize {
        2 * self.sides.len() * self.repeats * (1 + self.sides.len())
    }
}

/// What an experiment came to.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Uncalibrated.
    pub before: Stage,
    /// Each method on each side's end points.
    pub methods: Vec<MethodResult>,
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

/// Drives squares of every side both ways round, calibrates on each side's end points, and drives all again with each
/// calibration. Runs go side by side on rayon's threads; results do not depend on how many. `stop` set from outside
/// ends it early with what there is.
///
/// # Errors
/// A run that cannot be driven, or a calibration whose formulae do not hold.
pub fn squares(
    scene: &Scene,
    plan: &Plan,
    watch: &dyn Watch,
    stop: &AtomicBool,
) -> Result<Experiment, ExperimentError> {
    let tasks = tasks(&plan.sides, plan.repeats);
    let drive = |stages: Vec<(String, Scene)>| -> Result<Vec<Stage>, ExperimentError> {
        let (runs, failure) = drive_all(&stages, &tasks, plan.seed, watch, stop);
        let collected = stages.iter().zip(runs).map(|((name, scene), runs)| collect(name, scene, runs));
        let collected = collected.collect::<Result<Vec<_>, _>>()?;
        for stage in &collected {
            watch.stage_ended(stage)?;
        }
        failure.map_or(Ok(collected), |failure| Err(failure.into()))
    };
    let before = drive(vec![("before".to_owned(), scene.clone())])?.remove(0);
    if stop.load(Ordering::Relaxed) {
        return Ok(Experiment { before, methods: Vec::new(), complete: false });
    }

    let training = Training::new(std::slice::from_ref(&before.dataset))?;
    let mut estimates = Vec::new();
    let mut stages = Vec::new();
    for &side in &plan.sides {
        // The squares of this side, and runs that are no squares.
        let of_side =
            training.only(|_, run| !matches!(run.protocol, Protocol::Square { side: other, .. } if other != side));
        for method in &METHODS {
            let Ok(estimate) = method.estimate(&of_side) else { continue };
            let mut calibrated = scene.clone();
            calibrated.robot.odometry = scene.robot.odometry.corrected(&estimate.correction());
            stages.push((format!("after_{}_{side}m", method.name), calibrated));
            estimates.push((method.name, side, estimate));
        }
    }
    let methods = estimates
        .into_iter()
        .zip(drive(stages)?)
        .map(|((method, calibrated_on_side, estimate), after)| MethodResult {
            method,
            calibrated_on_side,
            estimate,
            after,
        })
        .collect();
    Ok(Experiment { before, methods, complete: !stop.load(Ordering::Relaxed) })
}
