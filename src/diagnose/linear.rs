//! Readings against a hypothesis: residuals, sensitivities, evidence.
//!
//! A hypothesis moves along some axes with a prior on each (`plausible`). Its evidence is Laplace's: the likelihood of the
//! readings at the best coordinates, the prior there, and the share of the prior that the readings leave
//! [MacKay, *Neural Computation* 4 (1992) 415–447]. The responses themselves are allowed an error of a few per cent, as
//! unknowns with a prior of their own: a tyre is not the model's tyre.

use super::case::{Case, Cluster};
use super::doubt::{self, MotionError};
use super::noise::Shapes;
use super::plausible::Plausible;
use super::surrogate::Surrogate;
use super::variant::{Axis, Coordinates, Variant, moved_along};
use super::way::{Step, Way, compose};
use crate::geometry::Pose2;
use crate::scene::{Scene, Survey};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::f64::consts::LN_2;
use std::ops::Range;

/// Error that responses are allowed as a whole, and in each part of the way, relative.
pub(super) const RESPONSE_ERROR: [f64; 2] = [0.02, 0.03];
/// Error that a response may have from run to run, relative: runs are not the run that stands for them.
const RUN_ERROR: f64 = 0.005;
/// The same of a spot on the floor, in each component of the steps: a run that strays by a centimetre comes upon it
/// otherwise, and what a spot does changes over a decimetre.
const SPOT_ERROR: f64 = 0.1;
/// Parts of a way whose responses may err independently.
pub(super) const PARTS: usize = 8;

/// All that a fit needs.
pub(super) struct Problem<'a> {
    pub scene: &'a Scene,
    pub cases: &'a [Case],
    pub clusters: &'a [Cluster],
    pub conditions: usize,
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

/// A hypothesis at its best.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    /// Axes and coordinates.
    pub at: Vec<(Axis, f64)>,
    /// Of the coordinates, in their order.
    pub covariance: DMatrix<f64>,
    /// Logarithm of the evidence, up to a constant that all hypotheses share.
    pub log_evidence: f64,
    /// Σ of squared whitened residuals.
    pub chi2: f64,
    /// What is left of it where responses are allowed their error.
    pub left: f64,
    /// The part of that by which runs of one kind differ, which no model can take away.
    pub strays: f64,
}

impl Fit {
    /// σ along an axis; `None` where it does not move along it.
    pub fn std_dev(&self, axis: Axis) -> Option<f64> {
        let index = self.at.iter().position(|(own, _)| *own == axis)?;
        Some(self.covariance[(index, index)].sqrt())
    }
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
    of_means: Vec<Option<Cholesky<f64, Dyn>>>,
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
struct Mean {
    weights: DVector<f64>,
    residual: DVector<f64>,
}

impl Problem<'_> {
    /// Predicted readings of one run, flattened.
    pub fn predict(&self, cluster: usize, run: usize, at: &Coordinates) -> DVector<f64> {
        let survey = self.surrogate.survey_in(self.cases[run].campaign, self.scene, at, self.variants);
        self.predict_with(cluster, run, at, &survey)
    }

    fn predict_with(&self, cluster: usize, run: usize, at: &Coordinates, survey: &Survey) -> DVector<f64> {
        let path = self.surrogate.path(cluster, run, at, self.variants);
        let case = &self.cases[run];
        flatten(case, &self.surrogate.readings(case, &self.surrogate.ways[run], &path, survey))
    }

    /// The coordinate's value at which nothing changes is 0 throughout.
    fn step(&self, axis: Axis) -> f64 {
        1e-3 * self.variants[axis.variant].coordinates[axis.coordinate].std_dev
    }

    /// Residuals at `at` and sensitivities along `axes` there.
    pub fn linearise(&self, at: &Coordinates, axes: &[Axis]) -> Linearised {
        self.linearise_beside(at, axes, 1.0)
    }

    /// The same; what `at` does not hold and does much the same on both sides of 0 is looked at on one `side`, ±1.
    pub fn linearise_beside(&self, at: &Coordinates, axes: &[Axis], side: f64) -> Linearised {
        let survey = self.surrogate.survey_of(self.scene, at, self.variants);
        let shift = |&axis: &Axis| {
            let mut step = self.step(axis);
            if at.iter().all(|(known, _)| *known != axis) {
                // What does little until it does much is looked at where it does.
                let coordinate = self.variants[axis.variant].coordinates[axis.coordinate];
                if self.variants[axis.variant].place().is_some() {
                    step = coordinate.mean - coordinate.std_dev;
                } else if self.surrogate.is_even(axis) {
                    step = side * coordinate.std_dev;
                }
            }
            let moved = moved_along(at, axis, step);
            let survey = self.surrogate.survey_of(self.scene, &moved, self.variants);
            (moved, survey, step)
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
            let (case, way) = (&self.cases[reference], &self.surrogate.ways[reference]);
            let steps = self.surrogate.steps(index, reference, at, self.variants);
            let path = compose(way.start, &steps);
            let read =
                |path: &[Pose2], survey: &Survey| flatten(case, &self.surrogate.readings(case, way, path, survey));
            let here = read(&path, &survey);
            let mut jacobian = DMatrix::zeros(here.len(), axes.len());
            for (column, (axis, (moved, survey, step))) in axes.iter().zip(&shifted).enumerate() {
                let survey = by_own(*survey, moved);
                let hourly = self.variants[axis.variant].coordinates[axis.coordinate].hourly;
                let there = if hourly {
                    self.predict_at_an_hour(index, reference, at, moved, &survey)
                } else {
                    let to = self.surrogate.path_beyond((index, reference), (at, &steps), moved, self.variants);
                    read(to.as_deref().unwrap_or(&path), &survey) - &here
                };
                jacobian.set_column(column, &(there / *step));
            }
            factor.solve_lower_triangular_mut(&mut jacobian);
            columns.push(jacobian);
            for run in self.clusters[index].active(&self.counts) {
                let predicted =
                    if run == reference { here.clone() } else { self.predict_with(index, run, at, &survey) };
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
            doubt::whiten(&self.factors[index], &mut columns);
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
            let white = self.errs(&linear, index).map(|errs| doubt::whitened(errs, &mean));
            left += count * white.as_ref().unwrap_or(&mean).norm_squared();
            freedom += mean.len();
        }
        left / freedom as f64
    }

    /// What the mean of a cluster's runs errs by.
    fn errs<'l>(&'l self, linear: &'l Linearised, cluster: usize) -> Option<&'l Cholesky<f64, Dyn>> {
        linear.of_means[cluster].as_ref().or(self.of_means[cluster].as_ref())
    }

    /// Factor of what the mean of a cluster's runs errs by, where runs are whitened by `further` as well.
    fn of_mean(&self, cluster: usize, further: Option<&Cholesky<f64, Dyn>>) -> Option<Cholesky<f64, Dyn>> {
        let rows = self.factors[cluster].l_dirty().nrows();
        let no_more = || (self.discrepancy > 1.0).then(|| DMatrix::zeros(rows, 0));
        let mut columns = self.doubts[cluster].clone().or_else(no_more)?;
        if let Some(further) = further {
            doubt::whiten(further, &mut columns);
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
    fn weight(&self, axis: Axis, run: usize) -> f64 {
        if self.variants[axis.variant].coordinates[axis.coordinate].hourly { self.cases[run].hours } else { 1.0 }
    }

    /// Components of the steps that a response errs in together: each for itself where the model was moved far.
    fn components(&self) -> &'static [&'static [usize]] {
        if self.variants.iter().any(Variant::is_response_error) { &[&[0], &[1], &[2]] } else { &[&[0, 1, 2]] }
    }

    /// Whitened change of a cluster's readings that the response of `at` makes as a whole and in each part of its way:
    /// columns of the response's own error.
    fn response_errors(&self, cluster: usize, at: &Coordinates) -> DMatrix<f64> {
        let response = Changed::by(self, cluster, at);
        let (given, count) = (&response.way.steps, response.steps.len());
        let parts = (0..PARTS).map(|part| part * count / PARTS..(part + 1) * count / PARTS);
        let mut columns = Vec::with_capacity(PARTS + 1);
        for (range, error) in parts.clone().map(|part| (part, 1)).chain([(0..count, 0)]) {
            let less = |components| response.less(given, range.clone(), components) * self.response_error[error];
            columns.extend(self.components().iter().copied().map(less));
        }
        // What a spot does hangs on where exactly it is come upon, run for run and for all of them.
        if let Some(without) = self.without_spots(cluster, at) {
            columns.extend(parts.map(|part| response.less(&without, part, &[0, 1, 2]) * SPOT_ERROR));
        }
        self.whitened(cluster, &columns)
    }

    /// Whitened change of a cluster's readings that each run's response makes on its own: columns of what runs differ by.
    fn run_error_columns(&self, cluster: usize, at: &Coordinates) -> DMatrix<f64> {
        let response = Changed::by(self, cluster, at);
        let all = 0..response.steps.len();
        let mut columns = vec![response.less(&response.way.steps, all.clone(), &[0, 1, 2]) * RUN_ERROR];
        if let Some(without) = self.without_spots(cluster, at) {
            columns.extend((0..3).map(|c| response.less(&without, all.clone(), &[c]) * SPOT_ERROR));
        }
        self.whitened(cluster, &columns)
    }

    /// Factor of the covariance of a cluster's whitened readings with what its runs' responses differ by.
    fn run_errors(&self, cluster: usize, at: &Coordinates) -> Option<Cholesky<f64, Dyn>> {
        let columns = self.run_error_columns(cluster, at);
        let size = columns.nrows();
        Cholesky::new(DMatrix::identity(size, size) + &columns * columns.transpose())
    }

    /// Steps of a cluster's reference run without what spots on the floor do, where there are any.
    fn without_spots(&self, cluster: usize, at: &Coordinates) -> Option<Vec<Step>> {
        let on_level_floor: Vec<(Axis, f64)> = at.iter().copied().filter(|(axis, _)| !self.is_spot(axis)).collect();
        let reference = self.clusters[cluster].reference;
        (on_level_floor.len() < at.len())
            .then(|| self.surrogate.steps(cluster, reference, &on_level_floor, self.variants))
    }

    fn is_spot(&self, axis: &Axis) -> bool {
        self.variants[axis.variant].place().is_some()
    }

    fn whitened(&self, cluster: usize, columns: &[DVector<f64>]) -> DMatrix<f64> {
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
                let (mut white, residual) = (columns.clone(), doubt::whitened(of_mean, &mean.residual));
                doubt::whiten(of_mean, &mut white);
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
    fn strays(&self, linear: &Linearised, cluster: usize) -> f64 {
        let mean = self.mean(linear, cluster).residual;
        let active = self.clusters[cluster].active(&self.counts);
        active.map(|run| self.counts[run] * (&linear.residuals[run] - &mean).norm_squared()).sum()
    }

    /// Means over the active runs of a cluster.
    fn mean(&self, linear: &Linearised, cluster: usize) -> Mean {
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

    /// The best coordinates along `axes` from `start` on, and their evidence.
    pub fn fit(&self, axes: &[Axis], start: &Coordinates) -> Fit {
        let mut at: Vec<(Axis, f64)> = axes
            .iter()
            .map(|&axis| {
                let known = start.iter().find(|(other, _)| *other == axis);
                (axis, known.map_or(0.0, |(_, value)| *value))
            })
            .collect();
        let prior: Vec<_> = axes.iter().map(|axis| self.variants[axis.variant].coordinates[axis.coordinate]).collect();
        let plausible = Plausible::of(self.variants, axes);
        let mut least: Option<(f64, Vec<(Axis, f64)>)> = None;
        for _ in 0..10 {
            let linear = self.linearise(&at, axes);
            let (a, b, c) = self.normal_equations(&linear);
            let local = plausible.at(&values(&at));
            let cost = c + local.cost;
            let gained = least.as_ref().map_or(f64::INFINITY, |(least, _)| least - cost);
            if let (true, Some((_, best))) = (gained < 0.0, &least) {
                // Too far: half of the way back.
                for ((_, value), (_, best)) in at.iter_mut().zip(best) {
                    *value = 0.5 * (*value + best);
                }
                continue;
            }
            least = Some((cost, at.clone()));
            let normal = a + DMatrix::from_diagonal(&local.precision);
            let Some(factor) = Cholesky::new(normal) else { break };
            let mut step = factor.solve(&(b + local.pull()));
            // Farther than a linear look sees, a part of the way is enough.
            step /= step.iter().zip(&prior).map(|(step, prior)| step.abs() / prior.reach).fold(1.0, f64::max);
            let mut moved = 0.0_f64;
            for (((_, value), step), prior) in at.iter_mut().zip(step.iter()).zip(&prior) {
                let before = *value;
                *value = prior.within(before + step);
                moved = moved.max((*value - before).abs() / prior.std_dev);
            }
            if moved < 1e-3 || gained < 1e-6 * (1.0 + cost) {
                break;
            }
        }
        if let Some((_, best)) = least {
            at = best;
        }
        self.evidence(axes, at)
    }

    /// What a fit makes least: what readings and priors leave at `at`; responses are taken as exact.
    pub fn cost(&self, at: &Coordinates) -> f64 {
        let axes: Vec<Axis> = at.iter().map(|(axis, _)| *axis).collect();
        let (_, _, left) = self.normal_equations(&self.linearise(at, &[]));
        left + Plausible::of(self.variants, &axes).at(&values(at)).cost
    }

    /// Logarithm of the likelihood of the readings at `at`, up to a constant; responses are taken as exact.
    pub fn log_likelihood(&self, at: &Coordinates) -> f64 {
        let linear = self.linearise(at, &[]);
        let (_, _, c) = self.normal_equations(&linear);
        -0.5 * c - 0.5 * self.log_det_of_means(&linear)
    }

    /// ln √det of the noise of all runs that count: what likelihoods under different noise differ by besides.
    pub fn log_det_of_noise(&self) -> f64 {
        let of = |(cluster, factor): (&Cluster, _)| cluster.count(&self.counts) * doubt::half_log_det(factor);
        self.clusters.iter().zip(&self.factors).map(of).sum()
    }

    fn log_det_of_means(&self, linear: &Linearised) -> f64 {
        (0..self.clusters.len())
            .filter_map(|index| self.errs(linear, index))
            .map(|it| 2.0 * doubt::half_log_det(it))
            .sum()
    }

    /// Whether what a hypothesis does may err: a cause of it is physical.
    fn may_err(&self, at: &Coordinates) -> bool {
        let physical = at.iter().any(|(axis, _)| {
            let variant = &self.variants[axis.variant];
            !variant.effect.is_survey() && !variant.is_doubted()
        });
        physical && self.response_error.iter().any(|error| *error > 0.0)
    }

    /// Squared distance that ends of a cluster's runs, which a fit has not seen, are to be expected from where it foretells them
    /// \[m²\], as a function of the run: by noise, by what its responses and the model's motion may err by, and by what the fit
    /// leaves open. `linear` is along the fit's axes, `first` is where the position of the end stands among the readings.
    pub fn expected_off<'l>(
        &'l self,
        linear: &'l Linearised,
        fit: &'l Fit,
        cluster: usize,
        first: usize,
    ) -> impl Fn(usize) -> f64 + 'l {
        let end = self.factors[cluster].l().rows(first, 2).into_owned();
        let of_noise = 1.0 + (self.discrepancy - 1.0) / f64::max(self.clusters[cluster].runs.len() as f64, 1.0);
        let mut columns: Vec<DMatrix<f64>> = self.doubts[cluster].iter().cloned().collect();
        if self.may_err(&fit.at) {
            columns.push(self.response_errors(cluster, &fit.at));
            columns.push(self.run_error_columns(cluster, &fit.at));
        }
        // A squared distance is a covariance's trace, and that of MMᵀ is the sum of M's squares.
        let errors =
            columns.iter().fold(of_noise * end.norm_squared(), |sum, columns| sum + (&end * columns).norm_squared());
        let open = &end * &linear.columns[cluster];
        move |run| {
            let mut open = open.clone();
            for (mut column, &axis) in open.column_iter_mut().zip(&linear.axes) {
                column *= self.weight(axis, run);
            }
            errors + (&open * &fit.covariance).dot(&open)
        }
    }

    /// A step from `at` along the axes of `linear`, as much of it as leaves what a linear look foretells: what a spot does has
    /// kinks. Readings are whitened by `further` besides.
    fn as_far_as_linear(
        &self,
        at: &Coordinates,
        step: &DVector<f64>,
        linear: &Linearised,
        further: &[Option<Cholesky<f64, Dyn>>],
    ) -> Vec<(Axis, f64)> {
        let moved = |halvings: i32| -> Vec<(Axis, f64)> {
            let moved = at.iter().zip(step.iter()).map(|(&(axis, value), step)| {
                let coordinate = self.variants[axis.variant].coordinates[axis.coordinate];
                (axis, coordinate.within(value + 0.5_f64.powi(halvings) * step))
            });
            moved.collect()
        };
        let squares = |of: &dyn Fn(usize, usize) -> DVector<f64>| -> f64 {
            let of_cluster = |(index, cluster): (usize, &Cluster)| -> f64 {
                cluster.active(&self.counts).map(|run| self.counts[run] * of(index, run).norm_squared()).sum()
            };
            self.clusters.iter().enumerate().map(of_cluster).sum()
        };
        let left = |there: &Coordinates| {
            let there = self.linearise(there, &[]);
            squares(&|index, run| match &further[index] {
                Some(further) => doubt::whitened(further, &there.residuals[run]),
                None => there.residuals[run].clone(),
            })
        };
        let foretold = |there: &Coordinates| {
            let by = values(there) - values(at);
            squares(&|index, run| {
                let weighted = by.iter().zip(&linear.axes).map(|(by, &axis)| by * self.weight(axis, run));
                &linear.residuals[run] - &linear.columns[index] * DVector::from_iterator(by.len(), weighted)
            })
        };
        let mut shorter = (0..HALVINGS).map(moved);
        shorter.find(|there| left(there) < FORETOLD * foretold(there)).unwrap_or_else(|| at.to_vec())
    }

    /// The evidence of a hypothesis at `at`, its best coordinates, with the response's own error as unknowns.
    pub fn evidence(&self, axes: &[Axis], at: Vec<(Axis, f64)>) -> Fit {
        let mut linear = self.linearise(&at, axes);
        let with_error = self.may_err(&at);
        let chi2: f64 =
            linear.residuals.iter().zip(&self.counts).map(|(residual, count)| count * residual.norm_squared()).sum();
        let run_errors: Vec<Option<Cholesky<f64, Dyn>>> =
            (0..self.clusters.len()).map(|index| if with_error { self.run_errors(index, &at) } else { None }).collect();
        let mut log_det = 0.0;
        for (index, (errors, columns)) in run_errors.iter().zip(&mut linear.columns).enumerate() {
            let Some(errors) = errors else { continue };
            errors.l_dirty().solve_lower_triangular_mut(columns);
            for run in self.clusters[index].active(&self.counts) {
                errors.l_dirty().solve_lower_triangular_mut(&mut linear.residuals[run]);
                log_det += 2.0 * self.counts[run] * doubt::half_log_det(errors);
            }
        }
        for (index, errors) in run_errors.iter().enumerate().filter(|(_, errors)| errors.is_some()) {
            linear.of_means[index] = self.of_mean(index, errors.as_ref());
        }
        log_det += self.log_det_of_means(&linear);
        let (a, b, c) = self.normal_equations(&linear);
        let p = axes.len();
        let prior: Vec<_> = axes.iter().map(|axis| self.variants[axis.variant].coordinates[axis.coordinate]).collect();
        let plausible = Plausible::of(self.variants, axes);
        let local = plausible.at(&values(&at));

        let spots = at.iter().any(|(axis, _)| self.is_spot(axis));
        let of_responses = (PARTS + 1) * self.components().len();
        let per_condition = match (with_error, spots) {
            (false, _) => 0,
            (true, false) => of_responses,
            (true, true) => of_responses + PARTS,
        };
        let size = p + per_condition * self.conditions;
        let mut normal = DMatrix::<f64>::identity(size, size);
        let mut right = DVector::<f64>::zeros(size);
        normal.view_mut((0, 0), (p, p)).copy_from(&(a + DMatrix::from_diagonal(&local.precision)));
        right.rows_mut(0, p).copy_from(&(b + local.pull()));
        if with_error {
            for (index, cluster) in self.clusters.iter().enumerate() {
                let mut errors = self.response_errors(index, &at);
                if let Some(further) = &run_errors[index] {
                    further.l_dirty().solve_lower_triangular_mut(&mut errors);
                }
                let n = self.clusters[index].count(&self.counts);
                if n == 0.0 {
                    continue;
                }
                // All runs of a cluster err alike: its mean has all that there is to say of it.
                let mut columns = linear.columns[index].clone();
                let mut mean = self.mean(&linear, index);
                if let Some(of_mean) = self.errs(&linear, index) {
                    doubt::whiten(of_mean, &mut errors);
                    doubt::whiten(of_mean, &mut columns);
                    mean.residual = doubt::whitened(of_mean, &mean.residual);
                }
                let cross = errors.tr_mul(&columns);
                let first = p + per_condition * cluster.condition;
                let mut block = normal.view_mut((first, first), (per_condition, per_condition));
                block += errors.tr_mul(&errors) * n;
                for j in 0..p {
                    for i in 0..per_condition {
                        normal[(first + i, j)] += n * mean.weights[j] * cross[(i, j)];
                        normal[(j, first + i)] += n * mean.weights[j] * cross[(i, j)];
                    }
                }
                let mut part = right.rows_mut(first, per_condition);
                part += errors.tr_mul(&mean.residual) * n;
            }
        }
        let Some(factor) = Cholesky::new(normal) else {
            return Fit {
                at,
                covariance: DMatrix::identity(p, p),
                log_evidence: f64::NEG_INFINITY,
                chi2,
                left: chi2,
                strays: 0.0,
            };
        };
        let solution = factor.solve(&right);
        log_det += 2.0 * doubt::half_log_det(&factor);
        let strays = (0..self.clusters.len()).map(|index| self.strays(&linear, index)).sum();
        let quadratic = c + local.cost - right.dot(&solution);
        let mut log_evidence = -0.5 * quadratic - 0.5 * log_det + plausible.log_peak();
        let covariance = factor.inverse().view((0, 0), (p, p)).into_owned();
        // A one-sided prior is twice as dense, and only the part of the posterior above 0 counts.
        for (index, prior) in prior.iter().enumerate() {
            if prior.one_sided {
                let best = at[index].1 + solution[index];
                log_evidence += LN_2 + log_normal_cdf(best / covariance[(index, index)].sqrt());
            }
        }
        let step = solution.rows(0, p).into_owned();
        let at = self.as_far_as_linear(&at, &step, &linear, &run_errors);
        Fit { at, covariance, log_evidence, chi2, left: quadratic, strays }
    }
}

/// Halvings of a step until what it leaves is what a linear look foretells.
const HALVINGS: i32 = 4;
/// What is left over what was foretold from which on it is something else.
const FORETOLD: f64 = 1.1;

/// The coordinates, without what they are along.
fn values(at: &Coordinates) -> DVector<f64> {
    DVector::from_iterator(at.len(), at.iter().map(|(_, value)| *value))
}

/// ln Φ(z).
pub(super) fn log_normal_cdf(z: f64) -> f64 {
    if z > -5.0 {
        (0.5 * statrs::function::erf::erfc(-z / std::f64::consts::SQRT_2)).ln()
    } else {
        // The tail's first terms.
        -0.5 * z * z - (-z).ln() - 0.5 * std::f64::consts::TAU.ln() + (-1.0 / (z * z)).ln_1p()
    }
}

/// Shapes of every cluster's noise on the ways that its runs take under `at`: a heading that was changed early turns what
/// noise does later.
pub(super) fn shapes(
    scene: &Scene,
    cases: &[Case],
    clusters: &[Cluster],
    variants: &[Variant],
    surrogate: &Surrogate,
    at: &Coordinates,
) -> Vec<Shapes> {
    let survey = surrogate.survey_of(scene, at, variants);
    let survey_in = |campaign| surrogate.by_clocks_of(campaign, survey, at, variants);
    clusters
        .iter()
        .enumerate()
        .map(|(index, cluster)| {
            let reference = cluster.reference;
            let (case, way) = (&cases[reference], &surrogate.ways[reference]);
            let path = surrogate.path(index, reference, at, variants);
            shapes_of(surrogate, case, way, &path, &survey_in(cluster.campaign))
        })
        .collect()
}

/// Shapes of the noise of one run's readings, whose way `path` is.
pub(super) fn shapes_of(surrogate: &Surrogate, case: &Case, way: &Way, path: &[Pose2], survey: &Survey) -> Shapes {
    const LATER: f64 = 0.01;
    let predicted = surrogate.readings(case, way, path, survey);
    // The frame comes with the clock: an offset moves readings, not the frame that they are stated in.
    let later = Survey { time_offset: survey.time_offset + LATER, ..*survey };
    let clock = (flatten(case, &surrogate.readings(case, way, path, &later)) - flatten(case, &predicted)) / LATER;
    Shapes::new(case, way, path, &predicted, clock)
}

/// The way of a cluster's reference run as a hypothesis changes it.
struct Changed<'p> {
    surrogate: &'p Surrogate,
    case: &'p Case,
    way: &'p Way,
    survey: Survey,
    steps: Vec<Step>,
    readings: DVector<f64>,
}

impl<'p> Changed<'p> {
    fn by(problem: &'p Problem<'p>, cluster: usize, at: &Coordinates) -> Changed<'p> {
        let surrogate = problem.surrogate;
        let &Cluster { reference, campaign, .. } = &problem.clusters[cluster];
        let (case, way) = (&problem.cases[reference], &surrogate.ways[reference]);
        let survey = surrogate.survey_in(campaign, problem.scene, at, problem.variants);
        let steps = surrogate.steps(cluster, reference, at, problem.variants);
        let mut changed = Changed { surrogate, case, way, survey, steps, readings: DVector::zeros(0) };
        changed.readings = changed.read(&changed.steps);
        changed
    }

    fn read(&self, steps: &[Step]) -> DVector<f64> {
        let path = compose(self.way.start, steps);
        flatten(self.case, &self.surrogate.readings(self.case, self.way, &path, &self.survey))
    }

    /// What it changes of the readings beyond `without`, by these components of the steps of a part of the way. A tenth of
    /// it is taken away and scaled back up: linear to a tenth of a per cent of it.
    fn less(&self, without: &[Step], part: Range<usize>, components: &[usize]) -> DVector<f64> {
        let mut steps = self.steps.clone();
        for k in part {
            for &c in components {
                steps[k][c] -= 0.1 * (self.steps[k][c] - without[k][c]);
            }
        }
        (&self.readings - self.read(&steps)) * 10.0
    }
}
