//! A hypothesis at its best, and the evidence for it.
//!
//! A hypothesis moves along some axes with a prior on each (`plausible`). Its evidence is Laplace's: the likelihood of the
//! readings at the best coordinates, the prior there, and the share of the prior that the readings leave
//! [MacKay, *Neural Computation* 4 (1992) 415–447]. The responses themselves are allowed an error of a few per cent, as
//! unknowns with a prior of their own (`response_error`).

use super::case::Cluster;
use super::linear::{self, Linearised, Problem};
use super::low_rank::LowRank;
use super::plausible::Plausible;
use super::response_error::PARTS;
use super::variant::{Axis, Coordinates};
use nalgebra::{Cholesky, DMatrix, DVector};
use std::f64::consts::LN_2;

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

/// The least that a fit has come to, and the look that it took there.
struct Least {
    cost: f64,
    at: Vec<(Axis, f64)>,
    linear: Linearised,
}

/// Halvings of a step until what it leaves is what a linear look foretells.
const HALVINGS: i32 = 4;
/// What is left over what was foretold from which on it is something else.
const FORETOLD: f64 = 1.1;

impl Problem<'_> {
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
        let mut least: Option<Least> = None;
        for _ in 0..10 {
            let linear = self.linearise(&at, axes);
            let (a, b, c) = self.normal_equations(&linear);
            let local = plausible.at(&values(&at));
            let cost = c + local.cost;
            let gained = least.as_ref().map_or(f64::INFINITY, |least| least.cost - cost);
            if let (true, Some(least)) = (gained < 0.0, &least) {
                // Too far: half of the way back.
                for ((_, value), (_, best)) in at.iter_mut().zip(&least.at) {
                    *value = 0.5 * (*value + best);
                }
                continue;
            }
            least = Some(Least { cost, at: at.clone(), linear });
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
        let Least { at, linear, .. } = least.expect("the first look is the least so far");
        self.evidence_by(axes, at, linear)
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
        let of = |(cluster, factor): (&Cluster, _)| cluster.count(&self.counts) * linear::half_log_det(factor);
        self.clusters.iter().zip(&self.factors).map(of).sum()
    }

    fn log_det_of_means(&self, linear: &Linearised) -> f64 {
        (0..self.clusters.len())
            .filter_map(|index| self.errs(linear, index))
            .map(|it| 2.0 * linear::half_log_det(it))
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
        further: &[Option<LowRank>],
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
            squares(&|index, run| {
                let mut residual = there.residuals[run].clone();
                if let Some(further) = &further[index] {
                    further.whiten_vector(&mut residual);
                }
                residual
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
        let linear = self.linearise(&at, axes);
        self.evidence_by(axes, at, linear)
    }

    /// The same, by a linear look that was taken there.
    fn evidence_by(&self, axes: &[Axis], at: Vec<(Axis, f64)>, mut linear: Linearised) -> Fit {
        let with_error = self.may_err(&at);
        let chi2: f64 =
            linear.residuals.iter().zip(&self.counts).map(|(residual, count)| count * residual.norm_squared()).sum();
        let takes_part = |index: usize| self.clusters[index].count(&self.counts) > 0.0;
        let run_errors: Vec<Option<LowRank>> = (0..self.clusters.len())
            .map(|index| (with_error && takes_part(index)).then(|| self.run_errors(index, &at)))
            .collect();
        let mut log_det = 0.0;
        for (index, (errors, columns)) in run_errors.iter().zip(&mut linear.columns).enumerate() {
            let Some(errors) = errors else { continue };
            errors.whiten(columns);
            for run in self.clusters[index].active(&self.counts) {
                errors.whiten_vector(&mut linear.residuals[run]);
                log_det += 2.0 * self.counts[run] * errors.half_log_det();
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
            // A spot may do more in each part, and be farther east, or north.
            (true, true) => of_responses + PARTS + 2,
        };
        // Those of runs that do not count are left out: were it for zeros, sums would be rounded otherwise.
        let those = || self.clusters.iter().enumerate().filter(|(index, _)| takes_part(*index));
        let conditions = those().map(|(_, cluster)| cluster.condition + 1).max().unwrap_or(0);
        let size = p + per_condition * conditions;
        let mut normal = DMatrix::<f64>::identity(size, size);
        let mut right = DVector::<f64>::zeros(size);
        normal.view_mut((0, 0), (p, p)).copy_from(&(a + DMatrix::from_diagonal(&local.precision)));
        right.rows_mut(0, p).copy_from(&(b + local.pull()));
        if with_error {
            for (index, cluster) in those() {
                let mut errors = self.response_errors(index, &at);
                if let Some(further) = &run_errors[index] {
                    further.whiten(&mut errors);
                }
                let n = cluster.count(&self.counts);
                // All runs of a cluster err alike: its mean has all that there is to say of it.
                let mut columns = linear.columns[index].clone();
                let mut mean = self.mean(&linear, index);
                if let Some(of_mean) = self.errs(&linear, index) {
                    linear::whiten(of_mean, &mut errors);
                    linear::whiten(of_mean, &mut columns);
                    mean.residual = linear::whitened(of_mean, &mean.residual);
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
        log_det += 2.0 * linear::half_log_det(&factor);
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
