//! What differs from run to run: survey noise of every reading, the start's included, and the scatter of real floors.
//!
//! The covariance of a run's readings is a sum of known shapes with unknown sizes. The sizes are what repeated runs say, by
//! restricted maximum likelihood, drawn to what the campaign states (survey) or to what real runs have (scatter). What is
//! stated may differ from campaign to campaign; by how much it is off is learnt from all of them together.

use super::case::{Case, Cluster};
use super::doubt;
use super::way::Way;
use crate::geometry::Pose2;
use crate::scene::{NoiseModel, Scatter, Survey};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;

/// Shapes of one cluster's covariance, each for a size of 1.
pub(super) struct Shapes {
    position: DMatrix<f64>,
    heading: DMatrix<f64>,
    start_position: DMatrix<f64>,
    start_heading: DMatrix<f64>,
    corner: DMatrix<f64>,
    distance_walk: DMatrix<f64>,
    stretch: DMatrix<f64>,
    /// Change of the readings per second of clock offset.
    pub clock: DVector<f64>,
    stamps: Vec<Option<f64>>,
    layout: Vec<(usize, usize)>,
}

/// Finest difference that a log or a simulation means \[m, rad\]: a tick, a step.
const FLOOR: [f64; 2] = [2e-4, 1e-4];

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

impl Shapes {
    /// For a cluster whose reference run reads `predicted` on the way `path`.
    pub fn new(case: &Case, way: &Way, path: &[Pose2], predicted: &[Pose2], clock: DVector<f64>) -> Shapes {
        let mut layout = Vec::new();
        for (index, reading) in case.readings.iter().enumerate() {
            layout.extend([(index, 0), (index, 1)]);
            if reading.heading.is_some() {
                layout.push((index, 2));
            }
        }
        let rows = layout.len();
        let start = path[0];
        let relative: Vec<Pose2> = path.iter().map(|pose| start.relative(*pose)).collect();
        let steps = path.len() - 1;
        // Index of the way's step at which each reading was taken.
        let step_of: Vec<usize> = case
            .readings
            .iter()
            .map(|reading| match reading.stamp {
                None => steps,
                Some(stamp) => (((stamp - way.began) / way.lasts).clamp(0.0, 1.0) * steps as f64).round() as usize,
            })
            .collect();
        let column = |value: &dyn Fn(usize, usize) -> f64| {
            DVector::from_iterator(rows, layout.iter().map(|&(reading, part)| value(reading, part)))
        };
        let outer = |columns: &[DVector<f64>]| {
            let mut sum = DMatrix::zeros(rows, rows);
            for column in columns {
                sum.ger(1.0, column, column, 1.0);
            }
            sum
        };
        let start_x = column(&|_, part| if part == 0 { -1.0 } else { 0.0 });
        let start_y = column(&|_, part| if part == 1 { -1.0 } else { 0.0 });
        let start_turn = column(&|reading, part| match part {
            0 => predicted[reading].y,
            1 => -predicted[reading].x,
            _ => -1.0,
        });
        // A turn of the body somewhere on the way carries all that comes later.
        let mut corner = DMatrix::zeros(rows, rows);
        let mut distance_walk = DMatrix::zeros(rows, rows);
        let pieces = steps.min(80);
        for piece in 0..pieces {
            let (from, to) = (piece * steps / pieces, (piece + 1) * steps / pieces);
            let (mut turned, mut gone) = (0.0, 0.0);
            for k in from..to {
                let step = relative[k].relative(relative[k + 1]);
                let way = step.x.hypot(step.y);
                turned += (step.heading.abs() - way / 0.2).max(0.0);
                gone += way;
            }
            if turned + gone < 1e-9 {
                continue;
            }
            let at = relative[(from + to) / 2];
            let kick = column(&|reading, part| {
                if step_of[reading] < (from + to) / 2 {
                    return 0.0;
                }
                match part {
                    0 => -(predicted[reading].y - at.y),
                    1 => predicted[reading].x - at.x,
                    _ => 1.0,
                }
            });
            corner.ger(turned / FRAC_PI_2, &kick, &kick, 1.0);
            distance_walk.ger(gone, &kick, &kick, 1.0);
        }
        let stretch = column(&|reading, part| match part {
            0 => predicted[reading].x,
            1 => predicted[reading].y,
            _ => 0.0,
        });
        let diagonal = |which: &dyn Fn(usize) -> bool| {
            DMatrix::from_diagonal(&column(&|_, part| if which(part) { 1.0 } else { 0.0 }))
        };
        Shapes {
            position: diagonal(&|part| part < 2),
            heading: diagonal(&|part| part == 2),
            start_position: outer(&[start_x, start_y]),
            start_heading: outer(&[start_turn]),
            corner,
            distance_walk,
            stretch: outer(&[stretch]),
            clock,
            stamps: case.readings.iter().map(|reading| reading.stamp).collect(),
            layout,
        }
    }

    /// The covariance of one run's readings.
    pub fn covariance(&self, noise: &NoiseModel) -> DMatrix<f64> {
        let [p, h] = [noise.position_std, noise.heading_std].map(|std| std * std);
        let scatter = noise.scatter;
        let mut sum = &self.start_position * p + &self.start_heading * h;
        sum += &self.corner * scatter.heading_per_corner.powi(2);
        sum += &self.distance_walk * scatter.heading_per_sqrt_metre.powi(2);
        sum += &self.stretch * scatter.distance.powi(2);
        if noise.correlation_time > 0.0 {
            for (i, &(a, part_a)) in self.layout.iter().enumerate() {
                for (j, &(b, part_b)) in self.layout.iter().enumerate() {
                    if part_a != part_b {
                        continue;
                    }
                    let apart = match (self.stamps[a], self.stamps[b]) {
                        (Some(one), Some(other)) => (one - other).abs(),
                        _ if a == b => 0.0,
                        _ => f64::INFINITY,
                    };
                    sum[(i, j)] += if part_a == 2 { h } else { p } * (-apart / noise.correlation_time).exp();
                }
            }
        } else {
            sum += &self.position * p + &self.heading * h;
        }
        sum += &self.position * FLOOR[0].powi(2) + &self.heading * FLOOR[1].powi(2);
        if noise.clock_std > 0.0 {
            sum.ger(noise.clock_std.powi(2), &self.clock, &self.clock, 1.0);
        }
        sum
    }

    /// Its Cholesky factor.
    pub fn factor(&self, noise: &NoiseModel) -> Cholesky<f64, Dyn> {
        Cholesky::new(self.covariance(noise)).expect("survey noise keeps every covariance positive")
    }
}

/// What runs stray by, cluster by cluster: a column a run, and how many of them are free.
pub(super) struct Spread {
    cluster: usize,
    campaign: usize,
    free: f64,
    off: DMatrix<f64>,
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
        Spread { cluster: index, campaign, free, off: DMatrix::from_columns(&off) }
    });
    spreads.collect()
}

/// Spread of all runs about what a hypothesis predicts, for campaigns that repeat nothing.
pub(super) fn of_residuals(clusters: &[Cluster], residuals: &[DVector<f64>]) -> Vec<Spread> {
    let spreads =
        clusters.iter().enumerate().filter(|(_, cluster)| !cluster.runs.is_empty()).map(|(index, cluster)| {
            let off: Vec<DVector<f64>> = cluster.runs.iter().map(|&run| residuals[run].clone()).collect();
            let (campaign, free) = (cluster.campaign, cluster.runs.len() as f64);
            Spread { cluster: index, campaign, free, off: DMatrix::from_columns(&off) }
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
            .map(|Spread { cluster, campaign, free, off }| {
                let factor = shapes[*cluster].factor(&noises[*campaign]);
                let log_det = 2.0 * doubt::half_log_det(&factor);
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
