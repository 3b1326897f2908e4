//! Shapes of the covariance of a run's readings: what each source of noise does to them, along the way that they are on.

use super::case::{Case, Cluster};
use super::linear::flatten;
use super::search::Ranking;
use super::surrogate::Surrogate;
use super::variant::{Axis, Coordinates, Variant};
use super::way::Way;
use super::{ForwardModel, Study};
use crate::geometry::Pose2;
use crate::scene::{NoiseModel, Scene, Survey};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use std::f64::consts::FRAC_PI_2;
use std::sync::OnceLock;

/// Shapes of one cluster's covariance, each for a size of 1.
pub(super) struct Shapes {
    position: DMatrix<f64>,
    heading: DMatrix<f64>,
    start_position: DMatrix<f64>,
    start_heading: DMatrix<f64>,
    corner: DMatrix<f64>,
    distance_walk: DMatrix<f64>,
    stretch: DMatrix<f64>,
    /// What is there whatever the sizes: the finest difference that is one, and what nobody logged.
    fixed: DMatrix<f64>,
    /// Change of the readings per second of clock offset.
    pub clock: DVector<f64>,
    stamps: Vec<Option<f64>>,
    layout: Vec<(usize, usize)>,
}

/// Finest difference that a log or a simulation means \[m, rad\]: a tick, a step.
const FLOOR: [f64; 2] = [2e-4, 1e-4];

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
        let (position, heading) = (diagonal(&|part| part < 2), diagonal(&|part| part == 2));
        Shapes {
            fixed: &position * FLOOR[0].powi(2) + &heading * FLOOR[1].powi(2),
            position,
            heading,
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

    /// Lets readings, and their frame, be in doubt by so much where no log tells how the robot moved \[m, rad\].
    fn with_unlogged(mut self, of_readings: &[[f64; 2]], of_frame: [f64; 2]) -> Shapes {
        for (row, &(reading, part)) in self.layout.iter().enumerate() {
            self.fixed[(row, row)] += of_readings[reading][usize::from(part == 2)].powi(2);
        }
        self.fixed += &self.start_position * of_frame[0].powi(2) + &self.start_heading * of_frame[1].powi(2);
        self
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
        sum += &self.fixed;
        if noise.clock_std > 0.0 {
            sum.ger(noise.clock_std.powi(2), &self.clock, &self.clock, 1.0);
        }
        sum
    }

    /// Its Cholesky factor.
    pub fn factor(&self, noise: &NoiseModel) -> Cholesky<f64, Dyn> {
        self.factor_with(noise, None)
    }

    /// That of its sum with another.
    pub fn factor_with(&self, noise: &NoiseModel, other: Option<&DMatrix<f64>>) -> Cholesky<f64, Dyn> {
        let own = self.covariance(noise);
        let sum = if let Some(other) = other { own + other } else { own };
        Cholesky::new(sum).expect("survey noise keeps every covariance positive")
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
    let unlogged = |stamp: Option<f64>| {
        let Some(time) = stamp.map(|stamp| survey.time_of(stamp)) else { return [0.0; 2] };
        let (beyond, between) = (way.unlogged(time, surrogate.unsteadiness), case.between_rows(time));
        [0, 1].map(|c| beyond[c].hypot(between[c]))
    };
    let of_readings: Vec<[f64; 2]> = case.readings.iter().map(|reading| unlogged(reading.stamp)).collect();
    Shapes::new(case, way, path, &predicted, clock).with_unlogged(&of_readings, unlogged(case.frame_stamp))
}

impl Study<'_> {
    /// Takes the shapes of the noise, and of the model's errors, anew on the ways of the best answer; whether that may matter:
    /// a way that is turned is strayed from in other directions, and a reading that was stamped late is of another place.
    pub(super) fn reshape(&mut self, ranking: &Ranking) -> bool {
        const TURNED: f64 = 0.03;
        const LATE: f64 = 0.03;
        let at = &ranking.best().fit.at;
        let end = |cluster: usize, at: &[(Axis, f64)]| {
            let path = self.surrogate.path(cluster, self.clusters[cluster].reference, at, &self.variants);
            path[path.len() - 1].heading
        };
        let turned = (0..self.used).any(|cluster| (end(cluster, at) - end(cluster, &[])).abs() > TURNED);
        let survey = self.surrogate.survey_of(self.model.scene(), at, &self.variants);
        let is_late = |cluster: &Cluster| {
            let survey = self.surrogate.by_clocks_of(cluster.campaign, survey, at, &self.variants);
            let mut stamps = self.cases[cluster.reference].readings.iter().filter_map(|reading| reading.stamp);
            stamps.any(|stamp| (survey.time_of(stamp) - self.surrogate.survey.time_of(stamp)).abs() > LATE)
        };
        let shifted = self.clusters[..self.used].iter().any(is_late);
        if turned || shifted {
            self.shape(at.clone());
        }
        turned || shifted
    }

    /// Takes the shapes of the noise, and of the model's errors, on the ways under `at`.
    pub(super) fn shape(&mut self, at: Vec<(Axis, f64)>) {
        let scene = self.model.scene();
        self.shapes = shapes(scene, &self.cases, &self.clusters, &self.variants, &self.surrogate, &at);
        self.doubts = OnceLock::new();
        self.shaped_at = at;
    }
}
