//! What differs from run to run: survey noise of every reading, the start's included, and the scatter of real floors.
//!
//! The covariance of a run's readings is a sum of known shapes with unknown sizes. The sizes are what repeated runs say, by
//! restricted maximum likelihood, drawn to what the campaign states (survey) or to what real runs have (scatter). What is
//! stated may differ from campaign to campaign; by how much it is off is learnt from all of them together.

use super::Study;
use super::case::{Case, Cluster};
use super::linear::{self, Problem};
use super::search::{self, Hypothesis, Ranking};
use super::shapes::Shapes;
use super::variant::Axis;
use super::verdict;
use crate::scene::{NoiseModel, Scatter, Survey};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

impl NoiseModel {
    /// What is stated or usual, before any run was looked at.
    pub fn prior(survey: &Survey) -> NoiseModel {
        let usual = Survey::default();
        let or = |stated: f64, usual: f64| if stated > 0.0 { stated } else { usual };
        NoiseModel {
            position_std: or(survey.position_std, usual.position_std),
            heading_std: or(survey.heading_std, usual.heading_std),
            correlation_time: 0.0,
            scatter: Scatter::default(),
            clock_std: 0.0,
        }
    }
}

/// What runs stray by, cluster by cluster: a column a run, and how many of them are free.
pub(super) struct Spread {
    cluster: usize,
    campaign: usize,
    free: f64,
    off: DMatrix<f64>,
    /// Covariance of what is not noise of it.
    apart: Option<DMatrix<f64>>,
}

/// Spread of repeated runs about their means. `deviations` are readings less predictions, one vector a run.
pub(super) fn of_repeats(clusters: &[Cluster], deviations: &[DVector<f64>]) -> Vec<Spread> {
    let repeated = clusters.iter().enumerate().filter(|(_, cluster)| cluster.runs.len() > 1);
    let spreads = repeated.map(|(index, cluster)| {
        let count = cluster.runs.len() as f64;
        let rows = deviations[cluster.reference].len();
        let mean = cluster.runs.iter().fold(DVector::zeros(rows), |sum, &run| sum + &deviations[run]) / count;
        let off: Vec<DVector<f64>> = cluster.runs.iter().map(|&run| &deviations[run] - &mean).collect();
        let (campaign, free) = (cluster.campaign, count - 1.0);
        Spread { cluster: index, campaign, free, off: DMatrix::from_columns(&off), apart: None }
    });
    spreads.collect()
}

/// Spread of all runs about what a hypothesis predicts, for campaigns that repeat nothing.
pub(super) fn of_residuals(clusters: &[Cluster], residuals: &[DVector<f64>]) -> Vec<Spread> {
    let spreads =
        clusters.iter().enumerate().filter(|(_, cluster)| !cluster.runs.is_empty()).map(|(index, cluster)| {
            let off: Vec<DVector<f64>> = cluster.runs.iter().map(|&run| residuals[run].clone()).collect();
            let (campaign, free) = (cluster.campaign, cluster.runs.len() as f64);
            Spread { cluster: index, campaign, free, off: DMatrix::from_columns(&off), apart: None }
        });
    spreads.collect()
}

/// Widths of the priors on the logarithms of the sizes: a survey is known to a third, a floor within a factor of two or so.
pub(super) const KNOWN: [f64; 5] = [0.3, 0.3, 0.7, 0.7, 0.7];
/// The same where nothing repeats, and noise stands for all that a model leaves.
pub(super) const HARDLY_KNOWN: [f64; 5] = [1.5; 5];
/// Clock offsets that are tried from run to run \[s\].
const CLOCKS: [f64; 4] = [0.005, 0.015, 0.04, 0.1];
/// ln of the likelihood ratio that speaks for clocks that differ from run to run.
const CLOCK_EVIDENCE: f64 = 5.0;

/// Sizes under which `spreads` are likeliest, with normal priors of these widths on their logarithms about `priors`, one a
/// campaign, which are off by the same factors.
pub(super) fn learn(
    priors: &[NoiseModel],
    spreads: &[Spread],
    shapes: &[Shapes],
    widths: [f64; 5],
    on_the_way: bool,
) -> Vec<NoiseModel> {
    if spreads.iter().map(|spread| spread.free).sum::<f64>() < 2.0 {
        return priors.to_vec();
    }
    let sizes = |prior: &NoiseModel, logs: &[f64; 5], correlation_time: f64, clock_std: f64| NoiseModel {
        position_std: prior.position_std * logs[0].exp(),
        heading_std: prior.heading_std * logs[1].exp(),
        correlation_time,
        scatter: Scatter {
            heading_per_corner: prior.scatter.heading_per_corner * logs[2].exp(),
            heading_per_sqrt_metre: prior.scatter.heading_per_sqrt_metre * logs[3].exp(),
            distance: prior.scatter.distance * logs[4].exp(),
        },
        clock_std,
    };
    let cost = |logs: &[f64; 5], correlation_time: f64, clock_std: f64| -> f64 {
        let noises: Vec<NoiseModel> =
            priors.iter().map(|prior| sizes(prior, logs, correlation_time, clock_std)).collect();
        let fit: f64 = spreads
            .par_iter()
            .map(|Spread { cluster, campaign, free, off, apart }| {
                let factor = shapes[*cluster].factor_with(&noises[*campaign], apart.as_ref());
                let log_det = 2.0 * linear::half_log_det(&factor);
                let mut white = off.clone();
                factor.l_dirty().solve_lower_triangular_mut(&mut white);
                0.5 * free * log_det + 0.5 * white.norm_squared()
            })
            .collect::<Vec<f64>>()
            .into_iter()
            .sum();
        fit + logs.iter().zip(widths).map(|(log, width)| 0.5 * (log / width).powi(2)).sum::<f64>()
    };
    let times: &[f64] = if on_the_way { &[0.0, 0.3, 1.0, 3.0] } else { &[0.0] };
    let mut best = ([0.0; 5], 0.0, 0.0);
    let mut least = f64::INFINITY;
    let consider = |candidate: ([f64; 5], f64, f64), least: &mut f64, best: &mut ([f64; 5], f64, f64)| {
        let value = cost(&candidate.0, candidate.1, candidate.2);
        if value < *least {
            (*least, *best) = (value, candidate);
        }
        value
    };
    // Coordinate by coordinate, a parabola through three points each: five smooth logarithms, near their prior.
    let mut without_clocks = f64::INFINITY;
    let mut plain = best;
    for clocks in [false, true] {
        if clocks {
            (without_clocks, plain) = (least, best);
            if !on_the_way {
                break;
            }
            for clock in CLOCKS {
                consider((best.0, best.1, clock), &mut least, &mut best);
            }
            if best.2 == 0.0 {
                break;
            }
        }
        let mut step = 0.7;
        for _ in 0..4 {
            for &time in times {
                consider((best.0, time, best.2), &mut least, &mut best);
            }
            for index in 0..5 {
                let (middle, here) = (best, least);
                let around = [-step, step].map(|off| {
                    let mut logs = middle.0;
                    logs[index] += off;
                    consider((logs, middle.1, middle.2), &mut least, &mut best)
                });
                let curvature = around[0] - 2.0 * here + around[1];
                if curvature > 0.0 {
                    let mut logs = middle.0;
                    logs[index] += (0.5 * step * (around[0] - around[1]) / curvature).clamp(-2.0 * step, 2.0 * step);
                    consider((logs, middle.1, middle.2), &mut least, &mut best);
                }
            }
            if best.2 > 0.0 {
                for factor in [0.7, 1.4] {
                    consider((best.0, best.1, best.2 * factor), &mut least, &mut best);
                }
            }
            step *= 0.6;
        }
    }
    if best.2 > 0.0 && least > without_clocks - CLOCK_EVIDENCE {
        best = plain;
    }
    priors.iter().map(|prior| sizes(prior, &best.0, best.1, best.2)).collect()
}

/// Sizes for a reader: root mean squares over campaigns, one a run that counts.
pub(super) fn of_runs(noises: &[NoiseModel], clusters: &[Cluster], counts: &[f64]) -> NoiseModel {
    let of_campaign = |campaign: usize| clusters.iter().filter(move |it| it.campaign == campaign);
    let weights: Vec<f64> =
        (0..noises.len()).map(|it| of_campaign(it).map(|cluster| cluster.count(counts)).sum()).collect();
    let mut counting = noises.iter().zip(&weights).filter(|(_, weight)| **weight > 0.0);
    if let (Some((only, _)), None) = (counting.next(), counting.next()) {
        return *only;
    }
    let mean_square = |of: &dyn Fn(&NoiseModel) -> f64| {
        let squares = noises.iter().zip(&weights).map(|(noise, weight)| weight * of(noise).powi(2));
        (squares.sum::<f64>() / weights.iter().sum::<f64>()).sqrt()
    };
    NoiseModel {
        position_std: mean_square(&|noise| noise.position_std),
        heading_std: mean_square(&|noise| noise.heading_std),
        correlation_time: mean_square(&|noise| noise.correlation_time),
        clock_std: mean_square(&|noise| noise.clock_std),
        scatter: Scatter {
            heading_per_corner: mean_square(&|noise| noise.scatter.heading_per_corner),
            heading_per_sqrt_metre: mean_square(&|noise| noise.scatter.heading_per_sqrt_metre),
            distance: mean_square(&|noise| noise.scatter.distance),
        },
    }
}

/// Times that noise is learnt from what causes leave, and causes are looked for under that noise, where nothing repeats.
pub(super) const MOST_LEARNINGS: usize = 3;

impl Study<'_> {
    /// Sizes of the noise from what repeated runs differ by under `at`, or from what it leaves where too little repeats.
    pub(super) fn learn_noise(&mut self, at: &[(Axis, f64)]) {
        let clusters: Vec<Cluster> = self
            .clusters
            .iter()
            .map(|cluster| Cluster { runs: cluster.active(&self.counts).collect(), ..cluster.clone() })
            .collect();
        let repeats = self.repeats();
        let spreads = {
            let problem = self.problem(self.counts.clone());
            let mut off: Vec<DVector<f64>> = self.observed.clone();
            for (index, cluster) in clusters.iter().enumerate() {
                for &run in &cluster.runs {
                    off[run] = &self.observed[run] - problem.predict(index, run, at);
                }
            }
            let mut spreads = if repeats { of_repeats(&clusters, &off) } else { of_residuals(&clusters, &off) };
            for spread in &mut spreads {
                spread.apart = problem.runs_apart(spread.cluster, at);
            }
            spreads
        };
        let on_the_way = self.cases.iter().any(Case::is_timed);
        let widths = if repeats { KNOWN } else { HARDLY_KNOWN };
        self.noise = learn(&self.prior_noise, &spreads, &self.shapes, widths, on_the_way);
    }

    /// Sizes of the noise from what these causes leave at their best, which hangs on the noise.
    pub(super) fn learn_noise_of(&mut self, mut at: Vec<(Axis, f64)>) {
        let axes: Vec<_> = at.iter().map(|(axis, _)| *axis).collect();
        for _ in 0..MOST_LEARNINGS {
            let before = self.noise.clone();
            self.learn_noise(&at);
            if self.noise == before {
                break;
            }
            at = self.problem(self.counts.clone()).fit(&axes, &at).at;
        }
    }

    /// Whether causes make repeated runs differ: tyres that grow or shrink do, and spots that runs come upon here and there.
    pub(super) fn moves_runs_apart(&self, at: &[(Axis, f64)]) -> bool {
        at.iter().any(|&(axis, _)| {
            self.variants[axis.variant].coordinates[axis.coordinate].hourly || self.surrogate.knows_elsewhere(axis)
        })
    }

    /// Whether enough runs repeat one another to tell noise by.
    pub(super) fn repeats(&self) -> bool {
        let active: Vec<usize> = self.clusters.iter().map(|cluster| cluster.active(&self.counts).count()).collect();
        let free: usize = active.iter().map(|runs| runs.saturating_sub(1)).sum();
        free >= 2 && 4 * free >= active.iter().sum::<usize>()
    }

    /// Averages the evidence of the leading answers, and of all that are a real alternative to them, over what the scatter may
    /// be: a handful of repeated runs tell its size to a fifth or so, and a scatter that they showed too small by chance would
    /// make a cause of what is none. All of it may be of another size, or that of distance alone: that is drawn once a run, so that
    /// logs, which tell that of headings at every corner, tell it no better than ends.
    pub(super) fn weigh_noise(&self, ranking: &mut Ranking) {
        const LOG_SCALES: [f64; 4] = [-0.25, 0.25, 0.5, 0.75];
        const WITHIN: f64 = 15.0;
        let best = ranking.best();
        let problem_of = |change: &dyn Fn(&mut Scatter)| -> (Problem<'_>, f64) {
            let mut noise = self.noise.clone();
            noise.iter_mut().for_each(|noise| change(&mut noise.scatter));
            let problem = self.problem_under(&noise, self.counts.clone());
            let log_det = problem.log_det_of_noise();
            (problem, log_det)
        };
        let of_distance = |scale: f64| problem_of(&|scatter| scatter.distance *= scale.exp());
        let of_all = |scale: f64| {
            problem_of(&|scatter| {
                let Scatter { heading_per_corner, heading_per_sqrt_metre, distance } = scatter;
                [heading_per_corner, heading_per_sqrt_metre, distance]
                    .into_iter()
                    .for_each(|size| *size *= scale.exp());
            })
        };
        let as_learnt = problem_of(&|_| {});
        let own = as_learnt.1;
        let problems: Vec<(Problem<'_>, f64)> =
            LOG_SCALES.map(of_all).into_iter().chain(LOG_SCALES.map(of_distance)).chain([as_learnt]).collect();
        let average = |hypothesis: &mut Hypothesis| {
            let axes = search::axes_of(&self.variants, &hypothesis.set);
            let under = |(problem, log_det): &(Problem<'_>, f64)| {
                problem.evidence(&axes, hypothesis.fit.at.clone()).log_evidence - log_det + own
            };
            let values: Vec<f64> = problems.iter().map(under).collect();
            let mean = verdict::log_sum(values.iter().copied()) - (values.len() as f64).ln();
            hypothesis.log_posterior += mean - hypothesis.fit.log_evidence;
            hypothesis.fit.log_evidence = mean;
        };
        // Parts of the best answer are what it has to stand against, however little they were worth under noise that was learnt
        // with the rest of it.
        let is_due = |(rank, h): (usize, &Hypothesis)| {
            let leads = rank < search::LEADING && h.log_posterior > best.log_posterior - WITHIN;
            leads || h.set.is_subset(&best.set)
        };
        let mut averaged: Vec<bool> = ranking.hypotheses.iter().enumerate().map(is_due).collect();
        let mut due = averaged.clone();
        // No answer is held against one that scatter of another size has spoken on before it has spoken on it itself.
        while due.contains(&true) {
            let hypotheses = ranking.hypotheses.par_iter_mut().zip(&due);
            hypotheses.filter(|(_, due)| **due).for_each(|(hypothesis, _)| average(hypothesis));
            let of_averaged = ranking.hypotheses.iter().zip(&averaged).filter(|(_, averaged)| **averaged);
            let best = of_averaged.map(|(h, _)| h.log_posterior).fold(f64::NEG_INFINITY, f64::max);
            for ((h, averaged), due) in ranking.hypotheses.iter().zip(&mut averaged).zip(&mut due) {
                *due = !*averaged && h.log_posterior > best - verdict::REAL;
                *averaged |= *due;
            }
        }
        ranking.sort();
    }
}
