//! Readings against a hypothesis, by a linear look: residuals, sensitivities, normal equations.
//!
//! All of it is whitened by what runs differ by (`noise`, `shapes`); what all runs of one kind err by (`doubt`) is seen by their
//! means alone.

use super::case::{Case, Cluster};
use super::doubt::{self, MotionError};
use super::low_rank::LowRank;
use super::surrogate::{self, Surrogate};
use super::variant::{Axis, CLOCKS, Coordinates, Variant, moved_along};
use super::way::{add_times, compose};
use crate::geometry::Pose2;
use crate::scene::{Scene, Survey};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// All that a fit needs.
pub(super) struct Problem<'a> {
    pub scene: &'a Scene,
    pub cases: &'a [Case],
    pub clusters: &'a [Cluster],
    pub variants: &'a [Variant],
    pub surrogate: &'a Surrogate,
    /// Observed readings, flattened, one vector a run.
    pub observed: Vec<DVector<f64>>,
    /// One a cluster.
    pub factors: Vec<Cholesky<f64, Dyn>>,
    pub response_error: [f64; 2],
    /// How often each run counts: 0 takes no part.
    pub counts: Vec<f64>,
    /// Whitened errors of the model's own motion, one a cluster; `None`: the model is exact.
    pub doubts: Vec<Option<DMatrix<f64>>>,
    /// What the mean of each cluster's runs errs by on their account.
    pub of_means: Vec<Option<Cholesky<f64, Dyn>>>,
    /// Variance of runs' means over what noise makes of it, from 1 on, where what every answer leaves is no noise [a dispersion
    /// in the sense of Wedderburn, *Biometrika* 61 (1974) 439–447].
    pub discrepancy: f64,
}

/// Whitened sensitivities and residuals of the runs, cluster by cluster.
pub(super) struct Linearised {
    /// Axes of the columns.
    pub axes: Vec<Axis>,
    /// Whitened columns of each cluster.
    pub columns: Vec<DMatrix<f64>>,
    /// Whitened residuals of each run.
    pub residuals: Vec<DVector<f64>>,
    /// What the mean of each cluster's runs errs by, where that is not what the problem says.
    pub of_means: Vec<Option<Cholesky<f64, Dyn>>>,
}

pub(super) fn flatten(case: &Case, poses: &[Pose2]) -> DVector<f64> {
    let mut values = Vec::with_capacity(3 * poses.len());
    for (reading, pose) in case.readings.iter().zip(poses) {
        values.extend([pose.x, pose.y]);
        if reading.heading.is_some() {
            values.push(pose.heading);
        }
    }
    DVector::from_vec(values)
}

pub(super) fn observed(case: &Case) -> DVector<f64> {
    let poses: Vec<Pose2> = case.readings.iter().map(|r| Pose2::new(r.x, r.y, r.heading.unwrap_or(0.0))).collect();
    flatten(case, &poses)
}

/// Means over the runs of a cluster: what columns are multiplied with, and residuals.
pub(super) struct Mean {
    pub weights: DVector<f64>,
    pub residual: DVector<f64>,
}

impl Problem<'_> {
    /// Predicted readings of one run, flattened.
    pub fn predict(&self, cluster: usize, run: usize, at: &Coordinates) -> DVector<f64> {
        let survey = self.surrogate.survey_in(self.cases[run].campaign, self.scene, at, self.variants);
        self.read(run, &self.surrogate.path(cluster, run, at, self.variants), &survey)
    }

    /// What is read of a run on this path, flattened.
    pub(super) fn read(&self, run: usize, path: &[Pose2], survey: &Survey) -> DVector<f64> {
        let case = &self.cases[run];
        flatten(case, &self.surrogate.readings(case, &self.surrogate.ways[run], path, survey))
    }

    /// The coordinate's value at which nothing changes is 0 throughout.
    fn step(&self, axis: Axis) -> f64 {
        let variant = &self.variants[axis.variant];
        // A reading moves on with its clock from where the robot stands to where it goes: what lies ahead is seen from afar.
        let part = if variant.effect.id == CLOCKS { 0.1 } else { 1e-3 };
        part * variant.coordinates[axis.coordinate].std_dev
    }

    /// Residuals at `at` and sensitivities along `axes` there.
    pub fn linearise(&self, at: &Coordinates, axes: &[Axis]) -> Linearised {
        self.linearise_by(at, axes, 0)
    }

    /// Steps from 0 along an axis that are worth a linear look each: on both sides, where a cause does much the same on both;
    /// of a spot on the floor, which does little until it does much, and then something else, to where it was simulated.
    pub fn looks(&self, axis: Axis) -> Vec<f64> {
        let variant = &self.variants[axis.variant];
        let coordinate = variant.coordinates[axis.coordinate];
        match () {
            () if variant.place().is_some() => surrogate::nodes(variant, coordinate),
            () if self.surrogate.is_even(axis) => vec![coordinate.std_dev, -coordinate.std_dev],
            () => vec![self.step(axis)],
        }
    }

    /// The same; what `at` does not hold is looked at by one of its looks, or the first where it has none of that number.
    pub fn linearise_by(&self, at: &Coordinates, axes: &[Axis], look: usize) -> Linearised {
        let survey = self.surrogate.survey_of(self.scene, at, self.variants);
        let shift = |&axis: &Axis| {
            let mut step = self.step(axis);
            if at.iter().all(|(known, _)| *known != axis) {
                let looks = self.looks(axis);
                step = *looks.get(look).unwrap_or(&looks[0]);
            }
            let there = |step| {
                let moved = moved_along(at, axis, step);
                let survey = self.surrogate.survey_of(self.scene, &moved, self.variants);
                (moved, survey)
            };
            let back = (self.variants[axis.variant].effect.id == CLOCKS).then(|| there(-step));
            (there(step), back, step)
        };
        let shifted: Vec<_> = axes.iter().map(shift).collect();
        let mut residuals: Vec<DVector<f64>> = self.cases.iter().map(|_| DVector::zeros(0)).collect();
        let mut columns = Vec::with_capacity(self.clusters.len());
        for (index, cluster) in self.clusters.iter().enumerate() {
            let factor = self.factors[index].l_dirty();
            let reference = cluster.reference;
            let by_own =
                |survey, at: &Coordinates| self.surrogate.by_clocks_of(cluster.campaign, survey, at, self.variants);
            let survey = by_own(survey, at);
            let common = self.surrogate.common_change((index, reference), at, self.variants);
            let steps_of = |run: usize| match &common {
                None => self.surrogate.steps(index, run, at, self.variants),
                Some(change) => {
                    let mut steps = self.surrogate.ways[run].steps.clone();
                    add_times(1.0, change, &mut steps);
                    steps
                }
            };
            let steps = steps_of(reference);
            let path = compose(self.surrogate.ways[reference].start, &steps);
            let here = self.read(reference, &path, &survey);
            let mut jacobian = DMatrix::zeros(here.len(), axes.len());
            for (column, (axis, ((moved, survey), back, step))) in axes.iter().zip(&shifted).enumerate() {
                let survey = by_own(*survey, moved);
                if let Some((moved, earlier)) = back {
                    // The path is the same, read earlier and later.
                    let earlier = self.read(reference, &path, &by_own(*earlier, moved));
                    jacobian.set_column(column, &((self.read(reference, &path, &survey) - earlier) / (2.0 * step)));
                    continue;
                }
                let hourly = self.variants[axis.variant].coordinates[axis.coordinate].hourly;
                let there = if hourly {
                    self.predict_at_an_hour(index, reference, at, moved, &survey)
                } else {
                    let to = self.surrogate.path_beyond((index, reference), (at, &steps), moved, self.variants);
                    self.read(reference, to.as_deref().unwrap_or(&path), &survey) - &here
                };
                jacobian.set_column(column, &(there / *step));
            }
            factor.solve_lower_triangular_mut(&mut jacobian);
            columns.push(jacobian);
            for run in self.clusters[index].active(&self.counts) {
                let predicted = match run == reference {
                    true => here.clone(),
                    false => self.read(run, &compose(self.surrogate.ways[run].start, &steps_of(run)), &survey),
                };
                let mut residual = &self.observed[run] - predicted;
                factor.solve_lower_triangular_mut(&mut residual);
                residuals[run] = residual;
            }
        }
        let of_means = vec![None; self.clusters.len()];
        Linearised { axes: axes.to_vec(), columns, residuals, of_means }
    }

    /// The same problem, with errors of the model's own motion by a share of it, or as the last campaign left them, and with
    /// such that are made good by a run's end.
    pub fn with_doubts(mut self, errors: &[MotionError], motion: f64, transient: f64) -> Self {
        for (index, error) in errors.iter().enumerate() {
            let (mut columns, off) = error.of_readings(motion, transient);
            for &run in &self.clusters[index].runs {
                self.observed[run] -= &off;
            }
            whiten(&self.factors[index], &mut columns);
            self.doubts[index] = Some(columns);
        }
        self.with_means()
    }

    /// The same problem, in which runs' means vary `discrepancy` times as much as noise makes them.
    pub fn with_discrepancy(self, discrepancy: f64) -> Self {
        Problem { discrepancy, ..self }.with_means()
    }

    fn with_means(mut self) -> Self {
        self.of_means = (0..self.clusters.len()).map(|index| self.of_mean(index, None)).collect();
        self
    }

    /// Variance of the runs' means about what is foretold of them at `at`, over what they should have.
    pub fn left_of_means(&self, at: &Coordinates) -> f64 {
        let linear = self.linearise(at, &[]);
        let (mut left, mut freedom) = (0.0, 0);
        for (index, cluster) in self.clusters.iter().enumerate() {
            let count = cluster.count(&self.counts);
            if count == 0.0 {
                continue;
            }
            let mean = self.mean(&linear, index).residual;
            let white = self.errs(&linear, index).map(|errs| whitened(errs, &mean));
            left += count * white.as_ref().unwrap_or(&mean).norm_squared();
            freedom += mean.len();
        }
        left / freedom as f64
    }

    /// What the mean of a cluster's runs errs by.
    pub(super) fn errs<'l>(&'l self, linear: &'l Linearised, cluster: usize) -> Option<&'l Cholesky<f64, Dyn>> {
        linear.of_means[cluster].as_ref().or(self.of_means[cluster].as_ref())
    }

    /// Factor of what the mean of a cluster's runs errs by, where runs are whitened by `further` as well.
    pub(super) fn of_mean(&self, cluster: usize, further: Option<&LowRank>) -> Option<Cholesky<f64, Dyn>> {
        let rows = self.factors[cluster].l_dirty().nrows();
        let no_more = || (self.discrepancy > 1.0).then(|| DMatrix::zeros(rows, 0));
        let mut columns = self.doubts[cluster].clone().or_else(no_more)?;
        if let Some(further) = further {
            further.whiten(&mut columns);
        }
        doubt::factor(&columns, self.clusters[cluster].count(&self.counts), self.discrepancy)
    }

    /// Change of the reference run's readings when it is driven an hour later.
    fn predict_at_an_hour(
        &self,
        cluster: usize,
        run: usize,
        at: &Coordinates,
        moved: &Coordinates,
        survey: &Survey,
    ) -> DVector<f64> {
        let case = &self.cases[run];
        let mut way = self.surrogate.ways[run].clone();
        way.hours = 1.0;
        let read = |at: &Coordinates| {
            let path = compose(way.start, &self.surrogate.steps_along(cluster, &way, at, self.variants));
            flatten(case, &self.surrogate.readings(case, &way, &path, survey))
        };
        read(moved) - read(at)
    }

    /// What a column of the reference run is multiplied with for a run.
    pub(super) fn weight(&self, axis: Axis, run: usize) -> f64 {
        if self.variants[axis.variant].coordinates[axis.coordinate].hourly { self.cases[run].hours } else { 1.0 }
    }

    pub(super) fn whitened(&self, cluster: usize, columns: &[DVector<f64>]) -> DMatrix<f64> {
        let mut columns = DMatrix::from_columns(columns);
        self.factors[cluster].l_dirty().solve_lower_triangular_mut(&mut columns);
        columns
    }

    /// Normal equations of the columns: `jᵀj`, `jᵀr` and `rᵀr` over the active runs. What runs differ by counts as it is, their
    /// mean as far as the model's own motion is sure.
    pub fn normal_equations(&self, linear: &Linearised) -> (DMatrix<f64>, DVector<f64>, f64) {
        let p = linear.axes.len();
        let (mut a, mut b, mut c) = (DMatrix::zeros(p, p), DVector::zeros(p), 0.0);
        for (index, columns) in linear.columns.iter().enumerate() {
            let n = self.clusters[index].count(&self.counts);
            if n == 0.0 {
                continue;
            }
            let gram = columns.tr_mul(columns);
            let mut mean = Mean { weights: DVector::zeros(p), residual: DVector::zeros(columns.nrows()) };
            if let Some(of_mean) = self.errs(linear, index) {
                mean = self.mean(linear, index);
                let (mut white, residual) = (columns.clone(), whitened(of_mean, &mean.residual));
                whiten(of_mean, &mut white);
                let (gram, projected) = (white.tr_mul(&white), white.tr_mul(&residual));
                for i in 0..p {
                    b[i] += n * mean.weights[i] * projected[i];
                    for j in 0..p {
                        a[(i, j)] += n * mean.weights[i] * mean.weights[j] * gram[(i, j)];
                    }
                }
                c += n * residual.norm_squared();
            }
            for run in self.clusters[index].active(&self.counts) {
                let count = self.counts[run];
                let weights: Vec<f64> = linear
                    .axes
                    .iter()
                    .zip(mean.weights.iter())
                    .map(|(&axis, mean)| self.weight(axis, run) - mean)
                    .collect();
                let residual = &linear.residuals[run] - &mean.residual;
                let projected = columns.tr_mul(&residual);
                for i in 0..p {
                    b[i] += count * weights[i] * projected[i];
                    for j in 0..p {
                        a[(i, j)] += count * weights[i] * weights[j] * gram[(i, j)];
                    }
                }
                c += count * residual.norm_squared();
            }
        }
        (a, b, c)
    }

    /// Σ of squared whitened differences of a cluster's runs from their mean.
    pub(super) fn strays(&self, linear: &Linearised, cluster: usize) -> f64 {
        let mean = self.mean(linear, cluster).residual;
        let active = self.clusters[cluster].active(&self.counts);
        active.map(|run| self.counts[run] * (&linear.residuals[run] - &mean).norm_squared()).sum()
    }

    /// Means over the active runs of a cluster.
    pub(super) fn mean(&self, linear: &Linearised, cluster: usize) -> Mean {
        let n = self.clusters[cluster].count(&self.counts);
        let rows = linear.columns[cluster].nrows();
        let mut mean = Mean { weights: DVector::zeros(linear.axes.len()), residual: DVector::zeros(rows) };
        for run in self.clusters[cluster].active(&self.counts) {
            let share = self.counts[run] / n;
            mean.residual.axpy(share, &linear.residuals[run], 1.0);
            for (weight, &axis) in mean.weights.iter_mut().zip(&linear.axes) {
                *weight += share * self.weight(axis, run);
            }
        }
        mean
    }
}

/// ln √det of a factor's matrix.
pub(super) fn half_log_det(factor: &Cholesky<f64, Dyn>) -> f64 {
    factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum()
}

/// Solves for a factor in place.
pub(super) fn whiten(factor: &Cholesky<f64, Dyn>, columns: &mut DMatrix<f64>) {
    factor.l_dirty().solve_lower_triangular_mut(columns);
}

/// The same of one vector.
pub(super) fn whitened(factor: &Cholesky<f64, Dyn>, vector: &DVector<f64>) -> DVector<f64> {
    let mut white = vector.clone();
    factor.l_dirty().solve_lower_triangular_mut(&mut white);
    white
}
