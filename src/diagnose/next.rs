//! The next experiment: which protocol would separate two answers best.

use super::noise;
use super::search::{Hypothesis, Ranking};
use super::shapes::Shapes;
use super::variant;
use super::verdict;
use super::way::{Way, compose, steps_of};
use super::{DiagnoseError, Diagnosis, ForwardModel, Study, Verdict};
use crate::dataset::{Protocol, Rotation, Run, Travel};
use crate::effect::Cause;
use nalgebra::{Cholesky, DVector};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// A protocol, and how well it would separate two answers.
#[derive(Debug, Clone, PartialEq)]
pub struct NextExperiment {
    /// What to drive, in words.
    pub protocol: String,
    /// The answers that it separates.
    pub separates: Vec<String>,
    /// Their expected distance after five runs \[σ\].
    pub expected_sigma: f64,
}

/// Runs that are reckoned with.
const RUNS: f64 = 5.0;

/// What could be driven: protocol, and speed and turn rate over the robot's own.
fn candidates() -> Vec<(String, Protocol, f64)> {
    use Rotation::{Clockwise, CounterClockwise};
    let mut list = vec![
        ("a straight of 4 m".to_owned(), Protocol::Straight { length: 4.0, direction: Travel::Forward }, 1.0),
        (
            "a straight of 4 m in reverse".to_owned(),
            Protocol::Straight { length: 4.0, direction: Travel::Reverse },
            1.0,
        ),
        ("a slow straight of 4 m".to_owned(), Protocol::Straight { length: 4.0, direction: Travel::Forward }, 0.5),
    ];
    for (word, direction) in [("cw", Clockwise), ("ccw", CounterClockwise)] {
        list.extend([
            (format!("a square of 2 m {word}"), Protocol::Square { side: 2.0, direction }, 1.0),
            (format!("a square of 4 m {word}"), Protocol::Square { side: 4.0, direction }, 1.0),
            (format!("a slow square of 2 m {word}"), Protocol::Square { side: 2.0, direction }, 0.5),
            (format!("five turns on the spot {word}"), Protocol::Spin { turn: 5.0 * TAU, direction }, 1.0),
            (format!("five slow turns on the spot {word}"), Protocol::Spin { turn: 5.0 * TAU, direction }, 0.5),
            (format!("half a turn on the spot {word}"), Protocol::Spin { turn: PI, direction }, 1.0),
            (format!("a circle of 0.5 m {word}"), Protocol::Circle { radius: 0.5, turn: Some(TAU), direction }, 1.0),
            (
                format!("half a circle of 1.5 m {word}"),
                Protocol::Circle { radius: 1.5, turn: Some(PI), direction },
                1.0,
            ),
        ]);
    }
    list
}

/// The protocol that tells `one` from `other` best.
fn next(
    study: &Study<'_>,
    one: (&str, &[Cause]),
    other: (&str, &[Cause]),
) -> Result<Option<NextExperiment>, DiagnoseError> {
    let scene = study.model.scene();
    let driver = &scene.robot.driver;
    let noise = noise::of_runs(&study.noise, &study.clusters, &study.counts);
    let distances: Vec<(String, f64)> = candidates()
        .into_par_iter()
        .map(|(words, protocol, slow)| {
            let run = Run {
                name: words.clone(),
                protocol,
                speed: Some(driver.cruise_speed * slow),
                turn_rate: Some(driver.turn_rate * slow),
                started: Some(3600.0),
                start: None,
                end: Some(crate::geometry::Pose2::IDENTITY.into()),
                odometry_end: None,
                encoders: None,
                poses: None,
            };
            let dataset = crate::dataset::Dataset { campaign: Default::default(), runs: vec![run.clone()] };
            let (cases, _) = super::case::cases(&[dataset], 0, scene);
            let case = &cases[0];
            let end = |causes: &[Cause]| {
                let edited = Cause::edit_all(causes, scene);
                let trace = study.model.trace(&edited, &run, &case.counted)?;
                let way = Way::of(&trace, steps_of(&trace), false, case.hours);
                let path = compose(way.start, &way.steps);
                let readings = study.surrogate.readings(case, &way, &path, &edited.survey);
                Ok::<_, super::ForwardError>((super::linear::flatten(case, &readings), way, path, readings))
            };
            let (base, way, path, readings) = end(&[])?;
            let first = end(one.1)?.0 - &base;
            let second = end(other.1)?.0 - &base;
            let shapes = Shapes::new(case, &way, &path, &readings, DVector::zeros(base.len()));
            let factor = Cholesky::new(shapes.covariance(&noise)).expect("noise keeps it positive");
            let white = |mut v: DVector<f64>| {
                factor.l_dirty().solve_lower_triangular_mut(&mut v);
                v * RUNS.sqrt()
            };
            let (first, second) = (white(first), white(second));
            // The other answer may be refitted as far as a fifth of its size.
            let scale = (second.dot(&(&first - &second)) / (second.norm_squared() + 25.0)).clamp(-1.0, 1.0);
            Ok((words, (&first - &second * (1.0 + scale)).norm()))
        })
        .collect::<Result<_, super::ForwardError>>()?;
    let best = distances.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
    Ok(best.filter(|(_, sigma)| *sigma > 0.5).map(|(protocol, expected_sigma)| NextExperiment {
        protocol,
        separates: vec![one.0.to_owned(), other.0.to_owned()],
        expected_sigma,
    }))
}

impl Study<'_> {
    /// The protocol that separates the answer from the likeliest other, where both stand, or from what is suspected.
    pub(super) fn next_experiment(
        &self,
        ranking: &Ranking,
        diagnosis: &Diagnosis,
    ) -> Result<Option<NextExperiment>, DiagnoseError> {
        let best = verdict::convincing(ranking, &self.variants);
        let is_further = diagnosis.verdict != Verdict::Ambiguous;
        if is_further && diagnosis.suspicion.is_none() {
            return Ok(None);
        }
        let ids = |h: &Hypothesis| verdict::ids(&h.set, &self.variants);
        let is_rival = |h: &&Hypothesis| match is_further {
            true => h.set.len() > best.set.len(),
            false => h.set != ranking.nothing().set && ids(h) != ids(best),
        };
        let Some(rival) = ranking.hypotheses.iter().find(is_rival) else { return Ok(None) };
        let name = |h: &Hypothesis| {
            let causes = h.set.iter().filter(|&&index| self.variants[index].is_cause());
            let names: Vec<String> = causes.map(|&index| self.variants[index].label()).collect();
            if names.is_empty() { "nothing".to_owned() } else { names.join(" and ") }
        };
        let causes = |h: &Hypothesis| variant::causes(&self.variants, &h.fit.at);
        // The one that may be refitted comes second.
        let (one, other) = if is_further { (rival, best) } else { (best, rival) };
        next(self, (&name(one), &causes(one)), (&name(other), &causes(other)))
    }
}
