//! What differs from run to run: survey noise of every reading, the start's included, and the scatter of real floors.
//!
//! The covariance of a run's readings is a sum of known shapes with unknown sizes. The sizes are what repeated runs say, by
//! restricted maximum likelihood, drawn to what the campaign states (survey) or to what real runs have (scatter).

use super::case::{Case, Cluster};
use super::surrogate::Way;
use crate::geometry::Pose2;
use crate::scene::{Scatter, Survey};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::f64::consts::FRAC_PI_2;

/// Sizes of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseModel {
    /// 1 σ of a surveyed coordinate \[m\].
    pub position_std: f64,
    /// 1 σ of a surveyed heading \[rad\].
    pub heading_std: f64,
    /// Time over which readings on the way remember their noise \[s\].
    pub correlation_time: f64,
    /// What floors do to runs.
    pub scatter: Scatter,
    /// σ of the clock offset from run to run \[s\].
    pub clock_std: f64,
}

/// Shapes of one cluster's covariance, each for a size of 1.
pub(super) struct Shapes {
    /// Readings that a run of it has, flattened.
    pub rows: usize,
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
            rows,
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

/// Sizes under which the repeated runs' deviations from their means are likeliest. `deviations` are readings less
/// predictions, one vector a run.
pub(super) fn learn(
    prior: NoiseModel,
    clusters: &[Cluster],
    shapes: &[Shapes],
    deviations: &[DVector<f64>],
    on_the_way: bool,
) -> NoiseModel {
    let repeated: usize = clusters.iter().map(|cluster| cluster.runs.len().saturating_sub(1)).sum();
    if repeated < 2 {
        return prior;
    }
    // Scatter of each repeated cluster: Σ (r − r̄)(r − r̄)ᵀ.
    let spreads: Vec<(usize, f64, DMatrix<f64>)> = clusters
        .iter()
        .enumerate()
        .filter(|(_, cluster)| cluster.runs.len() > 1)
        .map(|(index, cluster)| {
            let count = cluster.runs.len() as f64;
            let mean = cluster
                .runs
                .iter()
                .map(|&run| &deviations[run])
                .fold(DVector::zeros(shapes[index].rows), |sum, deviation| sum + deviation)
                / count;
            let mut spread = DMatrix::zeros(mean.len(), mean.len());
            for &run in &cluster.runs {
                let off = &deviations[run] - &mean;
                spread.ger(1.0, &off, &off, 1.0);
            }
            (index, count - 1.0, spread)
        })
        .collect();
    let sizes = |logs: &[f64; 5], correlation_time: f64| NoiseModel {
        position_std: prior.position_std * logs[0].exp(),
        heading_std: prior.heading_std * logs[1].exp(),
        correlation_time,
        scatter: Scatter {
            heading_per_corner: prior.scatter.heading_per_corner * logs[2].exp(),
            heading_per_sqrt_metre: prior.scatter.heading_per_sqrt_metre * logs[3].exp(),
            distance: prior.scatter.distance * logs[4].exp(),
        },
        clock_std: prior.clock_std,
    };
    // Widths of the priors on the logarithms: a survey is known to a third, a floor within a factor of two or so.
    const WIDTHS: [f64; 5] = [0.3, 0.3, 0.7, 0.7, 0.7];
    let cost = |logs: &[f64; 5], correlation_time: f64| -> f64 {
        let noise = sizes(logs, correlation_time);
        let fit: f64 = spreads
            .iter()
            .map(|(index, dof, spread)| {
                let factor = shapes[*index].factor(&noise);
                let log_det: f64 = 2.0 * factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
                0.5 * dof * log_det + 0.5 * factor.solve(spread).trace()
            })
            .sum();
        fit + logs.iter().zip(WIDTHS).map(|(log, width)| 0.5 * (log / width).powi(2)).sum::<f64>()
    };
    let times: &[f64] = if on_the_way { &[0.0, 0.3, 1.0, 3.0] } else { &[0.0] };
    let mut best = ([0.0; 5], 0.0, f64::INFINITY);
    for &time in times {
        let value = cost(&best.0, time);
        if value < best.2 {
            best = (best.0, time, value);
        }
    }
    // Coordinate-wise golden steps: five smooth logarithms, near their prior.
    let mut step = [0.5; 5];
    for _ in 0..6 {
        for index in 0..5 {
            for sign in [1.0, -1.0] {
                let mut logs = best.0;
                logs[index] += sign * step[index];
                let value = cost(&logs, best.1);
                if value < best.2 {
                    best = (logs, best.1, value);
                    break;
                }
            }
            // A parabola through three points finds the place between them.
            let around = [-step[index], 0.0, step[index]].map(|off| {
                let mut logs = best.0;
                logs[index] += off;
                if off == 0.0 { best.2 } else { cost(&logs, best.1) }
            });
            let curvature = around[0] - 2.0 * around[1] + around[2];
            if curvature > 0.0 {
                let off = (0.5 * step[index] * (around[0] - around[2]) / curvature).clamp(-step[index], step[index]);
                let mut logs = best.0;
                logs[index] += off;
                let value = cost(&logs, best.1);
                if value < best.2 {
                    best = (logs, best.1, value);
                }
            }
            step[index] *= 0.6;
        }
        for &time in times {
            let value = cost(&best.0, time);
            if value < best.2 {
                best = (best.0, time, value);
            }
        }
    }
    sizes(&best.0, best.1)
}
