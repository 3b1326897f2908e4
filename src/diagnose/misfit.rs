//! Where and how much a model is wrong, condition by condition and run by run.

use super::case::Case;
use super::variant::Axis;
use super::{ForwardModel, Study};
use crate::dataset::SurveyedPose;
use crate::geometry::Pose2;
use nalgebra::{Cholesky, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Where and how much a model is wrong.
#[derive(Debug, Clone)]
pub struct Misfit {
    /// Of the mean residuals of the conditions' end poses, whitened.
    pub chi2: f64,
    /// Its degrees of freedom.
    pub dof: usize,
    /// Chance of such a misfit or a greater one if the model is right.
    pub p_value: f64,
    /// One a condition.
    pub conditions: Vec<MisfitCondition>,
}

/// What a model gets wrong in one condition: surveyed less predicted end poses.
#[derive(Debug, Clone)]
pub struct MisfitCondition {
    /// What was driven.
    pub label: String,
    /// Runs.
    pub runs: usize,
    /// Mean residual; heading `None` where none was read.
    pub residual: [Option<f64>; 3],
    /// Its σ, from the noise of the runs.
    pub std_dev: [f64; 3],
    /// How far single runs stray from their mean, 1 σ; `None` for a single run.
    pub repeatability: [Option<f64>; 3],
}

/// What was read of a run, and what is predicted.
#[derive(Debug, Clone)]
pub struct RunReadings {
    /// Campaign and run.
    pub name: String,
    /// Its condition in words.
    pub condition: String,
    /// Whether it was named to be held out.
    pub held_out: bool,
    /// Surveyed start, in the room.
    pub start: Pose2,
    /// Stamps by the survey's clock \[s\]; `None`: the end of the run.
    pub stamps: Vec<Option<f64>>,
    /// Surveyed, in the frame of the surveyed start.
    pub measured: Vec<SurveyedPose>,
    /// By the model as given.
    pub before: Vec<Pose2>,
    /// By the extended model.
    pub after: Vec<Pose2>,
}

/// Mean residuals of the end poses, condition by condition.
pub(super) fn misfit(study: &Study<'_>) -> Misfit {
    let problem = study.problem(study.counts.clone());
    let mut conditions: Vec<MisfitCondition> = Vec::new();
    let (mut chi2, mut dof) = (0.0, 0);
    for (index, cluster) in study.clusters.iter().enumerate() {
        let rows = study.cases[cluster.reference].rows_of_end();
        let (first, parts) = (rows.start, rows.len());
        let end = |values: &DVector<f64>| values.rows(first, parts).into_owned();
        let residuals: Vec<DVector<f64>> = cluster
            .runs
            .iter()
            .map(|&run| end(&study.observed[run]) - end(&problem.predict(index, run, &[])))
            .collect();
        let runs = residuals.len();
        let count = runs as f64;
        let mean = residuals.iter().fold(DVector::zeros(parts), |sum, r| sum + r) / count;
        let full = study.shapes[index].covariance(&study.noise[cluster.campaign]);
        let covariance = full.view((first, first), (parts, parts)).into_owned() / count;
        if let Some(factor) = Cholesky::new(covariance.clone()) {
            chi2 += mean.dot(&factor.solve(&mean));
            dof += parts;
        }
        let spread = |part: usize| {
            (runs > 1)
                .then(|| (residuals.iter().map(|r| (r[part] - mean[part]).powi(2)).sum::<f64>() / (count - 1.0)).sqrt())
        };
        let label = study.conditions[cluster.condition].label();
        let entry = MisfitCondition {
            label: label.clone(),
            runs,
            residual: [Some(mean[0]), Some(mean[1]), (parts == 3).then(|| mean[2])],
            std_dev: std::array::from_fn(|part| if part < parts { covariance[(part, part)].sqrt() } else { f64::NAN }),
            repeatability: std::array::from_fn(|part| if part < parts { spread(part) } else { None }),
        };
        conditions.push(entry);
    }
    let p_value = ChiSquared::new(dof as f64).map_or(f64::NAN, |law| law.sf(chi2));
    Misfit { chi2, dof, p_value, conditions }
}

/// Root mean square distance of the ends of the runs that count from what is foretold of them under `at` \[m\].
pub(super) fn left_of_ends(study: &Study<'_>, at: &[(Axis, f64)]) -> f64 {
    let problem = study.problem(study.counts.clone());
    let (mut sum, mut count) = (0.0, 0.0);
    for (index, cluster) in study.clusters.iter().enumerate() {
        let first = study.cases[cluster.reference].rows_of_end().start;
        for run in cluster.active(&study.counts) {
            let off = &study.observed[run] - problem.predict(index, run, at);
            sum += study.counts[run] * off.rows(first, 2).norm_squared();
            count += study.counts[run];
        }
    }
    (sum / f64::max(count, 1.0)).sqrt()
}

/// Readings of every run, enough to draw its way, beside those predicted as given and under `at`.
pub(super) fn run_readings(study: &Study<'_>, given: &Study<'_>, at: &[(Axis, f64)]) -> Vec<RunReadings> {
    let read = |study: &Study<'_>, cluster: usize, (run, drawn): (usize, &Case), at: &[(Axis, f64)]| {
        let survey = study.surrogate.survey_in(drawn.campaign, study.model.scene(), at, &study.variants);
        let path = study.surrogate.path(cluster, run, at, &study.variants);
        study.surrogate.readings(drawn, &study.surrogate.ways[run], &path, &survey)
    };
    let mut runs: Vec<(usize, RunReadings)> = Vec::new();
    for (index, cluster) in study.clusters.iter().enumerate() {
        for &run in &cluster.runs {
            let case = study.cases[run].drawn();
            let measured = case.readings.iter().map(|r| SurveyedPose { x: r.x, y: r.y, heading: r.heading }).collect();
            runs.push((
                run,
                RunReadings {
                    name: case.name(),
                    condition: study.conditions[cluster.condition].label(),
                    held_out: study.held_out[run],
                    start: case.run.start.unwrap_or_default(),
                    stamps: case.readings.iter().map(|reading| reading.stamp).collect(),
                    measured,
                    before: read(given, index, (run, &case), &[]),
                    after: read(study, index, (run, &case), at),
                },
            ));
        }
    }
    runs.sort_by_key(|(run, _)| *run);
    runs.into_iter().map(|(_, readings)| readings).collect()
}
