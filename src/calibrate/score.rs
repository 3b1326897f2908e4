//! How good corrections are: end-point errors before and after, on the runs they were fitted to and on runs they never
//! saw, and which method to take.

use super::end_points::SquareErrors;
use super::error::CalibrateError;
use super::estimate::Estimate;
use super::training::{Observation, Training};
use super::{METHODS, Method, maximum_likelihood};
use crate::dataset::SurveyedPose;
use crate::odometry::OdometryCorrection;
use rayon::prelude::*;

/// Errors of predicted end points before and after a calibration, over some runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Root mean square distance of surveyed and predicted end \[m\].
    pub position_rmse_before: f64,
    /// \[m\]
    pub position_rmse_after: f64,
    /// Over the runs whose heading was surveyed \[rad\]; NaN where none was.
    pub heading_rmse_before: f64,
    /// \[rad\]
    pub heading_rmse_after: f64,
    /// E_max,syst over the squares, the largest over their sides \[m\]; `None` without squares both ways round.
    pub e_max_syst_before: Option<f64>,
    /// \[m\]
    pub e_max_syst_after: Option<f64>,
}

/// One method on one training set.
#[derive(Debug)]
pub struct MethodOutcome {
    /// The method.
    pub method: &'static Method,
    /// What it found, or why it is not applicable.
    pub estimate: Result<Estimate, CalibrateError>,
    /// On the runs it was fitted to.
    pub in_sample: Option<Score>,
    /// On runs it never saw: those held out by name, or else each run predicted from all the others.
    pub held_out: Option<Score>,
    /// What the method's approximations bias (E_d, E_b/E_s, E_s) by on a robot like this: what it finds, less what went in, on
    /// noise-free end poses of these runs under the best model's corrections. `None` where that cannot be told.
    pub bias: Option<[f64; 3]>,
    /// Position error of the training runs, each predicted from the others \[m\]: what the choice of the best goes by.
    pub selection: Option<f64>,
}

/// All methods on one training set.
#[derive(Debug)]
pub struct Calibration {
    /// In the order of [`METHODS`].
    pub outcomes: Vec<MethodOutcome>,
    /// Index of the best by folds inside the training runs.
    pub best: Option<usize>,
    /// Whether `held_out` is other data than the training runs.
    pub held_out_by_name: bool,
}

/// Applies `methods` (empty: all) to `training`, and scores them on it and on `hold_out`; without one, on folds by run.
pub fn calibrate(training: &Training, hold_out: Option<&Training>, methods: &[&'static Method]) -> Calibration {
    calibrate_telling(training, hold_out, methods, &|| ())
}

/// The same, telling of each method when it is through.
pub fn calibrate_telling(
    training: &Training,
    hold_out: Option<&Training>,
    methods: &[&'static Method],
    done: &(dyn Fn() + Sync),
) -> Calibration {
    let methods: Vec<&'static Method> = if methods.is_empty() { METHODS.iter().collect() } else { methods.to_vec() };
    let ideal = maximum_likelihood::METHOD.estimate(training).ok().map(|best| {
        let truth = best.correction();
        (training.noise_free(&truth), truth)
    });
    let outcomes: Vec<MethodOutcome> = methods
        .par_iter()
        .map(|&method| {
            let estimate = method.estimate(training);
            let correction = estimate.as_ref().ok().map(Estimate::correction);
            let score = |runs: &Training, correction: &OdometryCorrection| {
                Score::of(runs, |_, run| run.error(&training.odometry, correction))
            };
            let folds = correction.and_then(|_| folds(method, training));
            let fold_score = folds.as_ref().map(|errors| Score::of(training, |index, _| errors[index]));
            let outcome = MethodOutcome {
                method,
                in_sample: correction.map(|correction| score(training, &correction)),
                held_out: match hold_out {
                    Some(hold_out) => correction.map(|correction| score(hold_out, &correction)),
                    None => fold_score,
                },
                selection: fold_score.map(|score| score.position_rmse_after),
                bias: ideal.as_ref().and_then(|(runs, truth)| {
                    let found = (method.estimate)(runs).ok()?.correction();
                    Some([
                        found.diameter_ratio - truth.diameter_ratio,
                        found.track_ratio / found.distance_scale - truth.track_ratio / truth.distance_scale,
                        found.distance_scale - truth.distance_scale,
                    ])
                }),
                estimate,
            };
            done();
            outcome
        })
        .collect();
    let best = (0..outcomes.len()).filter(|&index| outcomes[index].selection.is_some()).min_by(|&one, &other| {
        outcomes[one].selection.partial_cmp(&outcomes[other].selection).unwrap_or(std::cmp::Ordering::Equal)
    });
    Calibration { outcomes, best, held_out_by_name: hold_out.is_some() }
}

/// How much worse than its own runs a method may predict others before its model is not enough: errors of a handful of
/// runs differ by half by chance.
const NOT_ENOUGH: f64 = 2.0;

impl Calibration {
    /// The outcome of the best method.
    pub fn best(&self) -> Option<&MethodOutcome> {
        self.best.map(|index| &self.outcomes[index])
    }

    /// Whether what fits the training runs also predicts the runs held out by name, by the best method; `None` where
    /// nothing was held out by name.
    pub fn model_is_enough(&self) -> Option<bool> {
        let best = self.best().filter(|_| self.held_out_by_name)?;
        Some(best.held_out?.position_rmse_after <= NOT_ENOUGH * best.selection?)
    }
}

/// Error of each run as predicted by the method from all other runs; `None` where it cannot do without one of them.
fn folds(method: &Method, training: &Training) -> Option<Vec<SurveyedPose>> {
    (0..training.runs.len())
        .into_par_iter()
        .map(|out| {
            let estimate = (method.estimate)(&training.only(|index, _| index != out)).ok()?;
            Some(training.runs[out].error(&training.odometry, &estimate.correction()))
        })
        .collect()
}

impl Score {
    /// Before: what each run's own robot believed. After: as `after` makes it of a run and its index.
    fn of(training: &Training, after: impl Fn(usize, &Observation) -> SurveyedPose) -> Score {
        let before: Vec<SurveyedPose> = training.runs.iter().map(|run| run.believed_error()).collect();
        let after: Vec<SurveyedPose> = training.runs.iter().enumerate().map(|(index, run)| after(index, run)).collect();
        let e_max = |errors: &[SurveyedPose]| {
            let sides = SquareErrors::by(training, |index, _| errors[index]);
            sides.iter().filter_map(SquareErrors::e_max_syst).max_by(f64::total_cmp)
        };
        Score {
            position_rmse_before: position_rmse(&before),
            position_rmse_after: position_rmse(&after),
            heading_rmse_before: heading_rmse(&before),
            heading_rmse_after: heading_rmse(&after),
            e_max_syst_before: e_max(&before),
            e_max_syst_after: e_max(&after),
        }
    }
}

fn position_rmse(errors: &[SurveyedPose]) -> f64 {
    (errors.iter().map(|error| error.x * error.x + error.y * error.y).sum::<f64>() / errors.len() as f64).sqrt()
}

fn heading_rmse(errors: &[SurveyedPose]) -> f64 {
    let headings: Vec<f64> = errors.iter().filter_map(|error| error.heading).collect();
    (headings.iter().map(|heading| heading * heading).sum::<f64>() / headings.len() as f64).sqrt()
}
