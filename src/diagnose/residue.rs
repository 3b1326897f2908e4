//! What a campaign leaves of the model that was fitted to it, and what that says of the next one.
//!
//! Whatever the model gets wrong about the motion, it gets wrong again in the next campaign of the same kind. So a diagnosis
//! that knows what the last campaign left looks at what has changed: the error of the motion (`doubt`) has the last
//! campaign's posterior for its prior, and that is as sharp as the last campaign's mean.
//!
//! Several campaigns that were diagnosed together leave each their own, of one error of the model: what they say adds up.
//!
//! What is found of errors is mostly noise: they are remembered as far as they are likelier to be the model's than noise (empirical
//! Bayes: MacKay, *Neural Comput.* 4 (1992) 415–447). Errors part by part are many, and all as likely; errors all along a way are what
//! causes look like, and each kind is asked for itself (automatic relevance determination: Tipping, *J. Mach. Learn. Res.* 1 (2001)
//! 211–244), by all clusters together, and remembered where that is convincing or a robot has to be calibrated for it.

use super::Study;
use super::case::{Case, Cluster, Reading};
use super::doubt;
use super::forward::{ForwardError, ForwardModel};
use super::linear::{self, flatten};
use super::shapes;
use super::variant::{Axis, Coordinates, edited, moved_along};
use super::verdict::CONVINCING;
use super::way::{Way, compose};
use crate::dataset::Protocol;
use crate::geometry::Pose2;
use crate::scene::{Residue, Scene};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

/// Share of a way that a model may be wrong by all along it at most: so wide that the last campaign tells.
const WIDE: f64 = 3e-3;
/// Times at most that the share of one kind of error is changed.
const TURNS: usize = 50;
/// ln evidence by which that has to gain.
const SETTLED: f64 = 1e-3;
/// Halvings of what a variance may be: to a millionth of the widest share.
const HALVINGS: usize = 40;

/// What the last campaigns tell of the model's error in one cluster, of its kinds, in the order of `columns`.
pub(super) struct Told {
    /// Information matrix.
    information: DMatrix<f64>,
    /// Information times what was found.
    found: DVector<f64>,
}

/// Share that errors of each kind are likeliest to be of, in any cluster, given what was left in all of them.
#[derive(Clone)]
struct Widths {
    of_parts: f64,
    /// Of each error all along a way, and of the survey.
    all_along: DVector<f64>,
}

/// What is known of the model's error in one cluster.
pub(super) struct Memory {
    told: Told,
    widths: Widths,
}

/// The model's error in one cluster: what is expected of it, and a factor of its covariance.
pub(super) struct Expected {
    pub mean: DVector<f64>,
    /// L with covariance L Lᵀ, transposed.
    pub spread: DMatrix<f64>,
}

/// Whether runs begin at the same place, be another point of the robot tracked, or its heading turned: what is plausible of that five
/// times over.
fn is_there(then: Pose2, now: Pose2) -> bool {
    then.distance(now) < 0.25 && (then.heading - now.heading).abs() < 0.1
}

/// What the last campaigns left of runs like this one, each campaign its own.
pub(super) fn of_last<'s>(scene: &'s Scene, case: &Case, condition: &str) -> impl Iterator<Item = &'s Residue> {
    let alike = move |residue: &&Residue| {
        let [x, y, heading] = residue.start;
        residue.condition == condition
            && residue.at.is_empty() != case.replayed
            && is_there(Pose2::new(x, y, heading), case.run.start.unwrap_or_default())
    };
    scene.robot.residues.iter().filter(alike)
}

/// What errors of the `motion` do to a run's readings, and errors of the survey: each as large as is plausible of it where the
/// motion is wrong by `WIDE`. `way` is the run's under `at`.
pub(super) fn columns(
    study: &Study<'_>,
    case: &Case,
    way: &Way,
    at: &Coordinates,
    motion: &DMatrix<f64>,
) -> DMatrix<f64> {
    // Of what is plausible: small against what turns a way.
    const SMALL: f64 = 0.1;
    let survey_of =
        |at: &Coordinates| study.surrogate.survey_in(case.campaign, study.model.scene(), at, &study.variants);
    let path = compose(way.start, &way.steps);
    let read = |at: &Coordinates| flatten(case, &study.surrogate.readings(case, way, &path, &survey_of(at)));
    // By the survey of then, whatever is wrong with that of now.
    let at: Vec<(Axis, f64)> =
        at.iter().copied().filter(|(axis, _)| !study.variants[axis.variant].effect.is_survey()).collect();
    let here = read(&at);
    let surveyed = study.variants.iter().enumerate().filter(|(_, it)| it.is_cause() && it.effect.is_survey());
    let surveyed = surveyed.flat_map(|(variant, it)| {
        it.coordinates.iter().enumerate().map(move |(coordinate, along)| (Axis { variant, coordinate }, along.std_dev))
    });
    let mut all: Vec<DVector<f64>> = motion.column_iter().map(|column| column.into_owned()).collect();
    all.extend(
        surveyed.map(|(axis, std_dev)| (read(&moved_along(&at, axis, SMALL * std_dev)) - &here) / (SMALL * WIDE)),
    );
    DMatrix::from_columns(&all)
}

/// What the last campaigns left says of runs like `case`, which stands for a cluster; `None` where they left nothing of such.
pub(super) fn told<'s>(
    study: &Study<'_>,
    residues: impl Iterator<Item = &'s Residue>,
    case: &Case,
    way: &Way,
) -> Option<Told> {
    let told = residues.map(|residue| Told::by(study, residue, case, way));
    told.reduce(|all, one| Told { information: all.information + one.information, found: all.found + one.found })
}

/// What is known of the errors of clusters that the last campaigns tell of, each by what it was told and by how large errors of its
/// kinds are in all of them: a kind of error that is the model's has no reason to be large in one and none in another.
pub(super) fn memories(told: Vec<Option<Told>>) -> Vec<Option<Memory>> {
    let all: Vec<&Told> = told.iter().flatten().collect();
    let widths = (!all.is_empty()).then(|| Widths::likeliest(&all));
    told.into_iter().map(|told| Some(Memory { told: told?, widths: widths.clone()? })).collect()
}

impl Told {
    /// What one campaign's residue tells of the kinds of error in runs like `case`.
    fn by(study: &Study<'_>, residue: &Residue, case: &Case, way: &Way) -> Told {
        let (scene, surrogate) = (study.model.scene(), &study.surrogate);
        let heading = (!residue.heading.is_empty()).then_some(0.0);
        let reading = |stamp: Option<f64>| Reading { stamp, x: 0.0, y: 0.0, heading };
        // As the runs of then were read, but on the way of now: a robot that stops longer is where it is later.
        let stamps =
            |at: &[f64]| way.times_of(at.iter().copied()).into_iter().map(|time| Some(scene.survey.stamp(time)));
        let read = Case {
            readings: if residue.at.is_empty() {
                vec![reading(None)]
            } else {
                stamps(&residue.at).map(reading).collect()
            },
            frame_stamp: stamps(residue.frame_at.as_slice()).next().flatten(),
            ..case.clone()
        };
        let path = compose(way.start, &way.steps);
        let factor = shapes::shapes_of(surrogate, &read, way, &path, &scene.survey).factor(&residue.noise);
        let survey = surrogate.survey_in(read.campaign, scene, &[], &study.variants);
        let motion = doubt::lasting(&doubt::kinds(surrogate, &read, way, &survey));
        let mut columns = columns(study, &read, way, &[], &motion);
        linear::whiten(&factor, &mut columns);
        let left: Vec<Pose2> = (0..residue.x.len())
            .map(|k| Pose2::new(residue.x[k], residue.y[k], residue.heading.get(k).copied().unwrap_or(0.0)))
            .collect();
        let left = linear::whitened(&factor, &flatten(&read, &left));
        Told { information: columns.tr_mul(&columns) * residue.runs, found: columns.tr_mul(&left) * residue.runs }
    }

    /// What is told of errors all along a way and of the survey, whatever those in parts of it are, which may be of `of_parts`.
    fn of_all_along(&self, of_parts: f64) -> Told {
        let (parts, rest) = (doubt::KINDS_OF_PARTS, self.found.len() - doubt::KINDS_OF_PARTS);
        let shares = DVector::from_element(parts, of_parts);
        let own = over_prior(&self.information.view((0, 0), (parts, parts)).into_owned(), &shares);
        let across = self.information.view((0, parts), (parts, rest)) * of_parts;
        let found = self.found.rows(0, parts) * of_parts;
        Told {
            information: self.information.view((parts, parts), (rest, rest)) - across.tr_mul(&own.solve(&across)),
            found: self.found.rows(parts, rest) - across.tr_mul(&own.solve(&found)),
        }
    }

    /// ln evidence of what was left, where each kind of error may be of its share, but for what does not hang on them.
    fn log_evidence(&self, shares: &DVector<f64>) -> f64 {
        let factor = over_prior(&self.information, shares);
        self.found.dot(&mean(&factor, shares, &self.found)) / 2.0 - linear::half_log_det(&factor)
    }
}

impl Widths {
    fn likeliest(told: &[&Told]) -> Widths {
        let all_along = DVector::from_element(told[0].found.len() - doubt::KINDS_OF_PARTS, WIDE);
        let mut widths = Widths { of_parts: 0.0, all_along };
        // The one hangs on the other, a little.
        for _ in 0..2 {
            let log_evidence = |of_parts: f64| {
                let shares = Widths { of_parts, ..widths.clone() }.shares(0.0);
                told.iter().map(|told| told.log_evidence(&shares)).sum::<f64>()
            };
            let likeliest = doubt::SHARES.into_iter().max_by(|a, b| log_evidence(*a).total_cmp(&log_evidence(*b)));
            let of_parts = likeliest.expect("shares");
            let along: Vec<Told> = told.iter().map(|told| told.of_all_along(of_parts)).collect();
            widths = Widths { of_parts, all_along: likeliest_widths(&along) };
        }
        widths
    }

    /// Share that each kind may be of before the last campaign, none of the motion's less than `least`.
    fn shares(&self, least: f64) -> DVector<f64> {
        let along = |kind| self.all_along[kind - doubt::KINDS_OF_PARTS];
        let count = doubt::KINDS_OF_PARTS + self.all_along.len();
        DVector::from_fn(count, |kind, _| match kind {
            ..doubt::KINDS_OF_PARTS => self.of_parts.max(least),
            doubt::KINDS_OF_PARTS..doubt::KINDS => along(kind).max(least),
            doubt::KINDS.. => along(kind),
        })
    }
}

impl Memory {
    /// The model's error, where it may be wrong by `share` at least.
    pub fn expected(&self, share: f64) -> Expected {
        let shares = self.widths.shares(share);
        let factor = over_prior(&self.told.information, &shares);
        let mut spread = DMatrix::from_diagonal(&shares);
        linear::whiten(&factor, &mut spread);
        Expected { mean: mean(&factor, &shares, &self.told.found), spread }
    }
}

/// Factor of the inverse covariance after something was seen of errors, in units of what they may be before it, which is none of
/// some: 1 + D I D with the diagonal D of `shares` and what was seen, I.
fn over_prior(information: &DMatrix<f64>, shares: &DVector<f64>) -> Cholesky<f64, Dyn> {
    let seen = information.map_with_location(|row, column, value| value * shares[row] * shares[column]);
    Cholesky::new(DMatrix::identity(shares.len(), shares.len()) + seen).expect("a precision with a floor is positive")
}

/// What errors are expected to be then.
fn mean(factor: &Cholesky<f64, Dyn>, shares: &DVector<f64>, found: &DVector<f64>) -> DVector<f64> {
    factor.solve(&found.component_mul(shares)).component_mul(shares)
}

/// Share that errors of each kind are likeliest to be of in all clusters, no more than `WIDE`: from none on, time and again that one
/// which makes what was found likeliest [Tipping & Faul, *Proc. AISTATS* (2003), whose closed form is of one cluster]. That has to
/// be convincing, but for what is calibrated of every robot, which a model may well be wrong about. What was hardly seen may be of
/// any.
fn likeliest_widths(told: &[Told]) -> DVector<f64> {
    let seen: DVector<f64> = told.iter().map(|told| told.information.diagonal()).sum();
    let is_seen = |kind: usize| seen[kind] * WIDE.powi(2) > 1.0;
    let mut widths = DVector::from_fn(seen.len(), |kind, _| if is_seen(kind) { 0.0 } else { WIDE });
    for _ in 0..TURNS {
        let change = |kind: usize| {
            let width = widths[kind];
            let own = own_of(kind, told, &widths);
            let variance = likeliest_variance(&own);
            let gain = log_evidence(&own, variance) - log_evidence(&own, width.powi(2));
            let needed = if width > 0.0 || doubt::CALIBRATED_KINDS.contains(&kind) { SETTLED } else { CONVINCING };
            (gain > needed).then_some((kind, variance, gain))
        };
        let changes = (0..seen.len()).filter(|&kind| is_seen(kind)).filter_map(change);
        let Some((kind, variance, _)) = changes.max_by(|a, b| a.2.total_cmp(&b.2)) else { break };
        widths[kind] = variance.sqrt();
    }
    widths
}

/// What each cluster tells of one kind of error where those of the others explain what they can: information, and that times what was
/// found.
fn own_of(kind: usize, told: &[Told], widths: &DVector<f64>) -> Vec<[f64; 2]> {
    let mut others = widths.clone();
    others[kind] = 0.0;
    let of = |Told { information, found }: &Told| {
        let factor = over_prior(information, &others);
        let row = information.column(kind).into_owned();
        let seen = row[kind] - row.dot(&mean(&factor, &others, &row));
        [seen, found[kind] - row.dot(&mean(&factor, &others, found))]
    };
    told.iter().map(of).collect()
}

/// ln evidence of errors of one kind with that variance, over none, of which each cluster tells so much.
fn log_evidence(own: &[[f64; 2]], variance: f64) -> f64 {
    let of = |[seen, found]: &[f64; 2]| {
        let precision = 1.0 + variance * seen;
        0.5 * (found.powi(2) * variance / precision - precision.ln())
    };
    own.iter().map(of).sum()
}

/// Variance, up to the widest, at which that is greatest.
fn likeliest_variance(own: &[[f64; 2]]) -> f64 {
    let rises = |variance: f64| {
        let of = |[seen, found]: &[f64; 2]| {
            let precision = 1.0 + variance * seen;
            (found / precision).powi(2) - seen / precision
        };
        own.iter().map(of).sum::<f64>() > 0.0
    };
    let (mut low, mut high) = (0.0, WIDE.powi(2));
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if rises(middle) { low = middle } else { high = middle }
    }
    low
}

/// What is left of the ends of the runs that an answer was fitted to, where each has a protocol: root mean squares of the
/// distance \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Remainder {
    /// By the answer as it was fitted, in which causes, pairs of them and what was simulated of all of them add up.
    pub fitted: f64,
    /// By the extended model, in which all of it is simulated at once.
    pub simulated: f64,
}

/// Mean square that the extended model leaves over that of the fit from which on it is not what was fitted.
const OTHER: f64 = 1.5;

impl Remainder {
    /// Whether the extended model is clearly worse than what was fitted.
    pub fn is_other(&self) -> bool {
        self.simulated.powi(2) > OTHER * self.fitted.powi(2)
    }

    /// Over all clusters, of which each leaves so much of its runs in the mean \[m²\], by the fit and by the simulation, and has so
    /// many.
    fn of(clusters: &[([f64; 2], f64)]) -> Option<Remainder> {
        let all: f64 = clusters.iter().map(|(_, runs)| runs).sum();
        let root = |by: usize| (clusters.iter().map(|(squares, runs)| squares[by] * runs).sum::<f64>() / all).sqrt();
        (all > 0.0).then(|| Remainder { fitted: root(0), simulated: root(1) })
    }
}

/// What the runs of a study leave of the model at `at`, one a cluster that repeats a protocol, and how far they end from it. All
/// causes are simulated at once, where the stand-in adds up what each does alone.
pub(super) fn residues(
    study: &Study<'_>,
    at: &[(Axis, f64)],
) -> Result<(Vec<Residue>, Option<Remainder>), ForwardError> {
    let problem = study.problem(study.counts.clone());
    let extended = edited(study.model.scene(), &study.variants, at);
    let of = |(index, cluster): (usize, &Cluster)| {
        let case = &study.cases[cluster.reference];
        let runs = cluster.count(&study.counts);
        let whole = case.readings.iter().all(|reading| reading.stamp.is_some() == case.replayed)
            && case.readings.iter().all(|reading| reading.heading.is_some() == case.readings[0].heading.is_some());
        if runs == 0.0 || case.run.protocol == Protocol::Path || !whole {
            return Ok(None);
        }
        let way = &study.surrogate.ways[cluster.reference];
        let survey = study.surrogate.by_clocks_of(cluster.campaign, extended.survey, at, &study.variants);
        let trace = study.model.trace(&extended, &case.run, &case.counted)?;
        // The way by which the next diagnosis, whose model this is, tells places.
        let Way { steps, bows, .. } = Way::of(&trace, way.steps.len(), case.replayed, 0.0);
        let extended_way = Way { steps, bows, ..way.clone() };
        let path = compose(way.start, &extended_way.steps);
        let together = flatten(case, &study.surrogate.readings(case, &extended_way, &path, &survey))
            - problem.predict(index, cluster.reference, at);
        let rows = case.rows_of_end();
        let (end, parts) = (rows.start, rows.len());
        let mut left = DVector::zeros(together.len());
        let square = |off: &DVector<f64>| off[end].powi(2) + off[end + 1].powi(2);
        let mut mean_squares = [0.0; 2];
        for run in cluster.active(&study.counts) {
            let share = study.counts[run] / runs;
            let fitted = &study.observed[run] - problem.predict(index, run, at);
            let simulated = &fitted - &together;
            mean_squares[0] += square(&fitted) * share;
            mean_squares[1] += square(&simulated) * share;
            left += simulated * share;
        }
        // To a micrometre and a microradian.
        let part =
            |part: usize| left.iter().skip(part).step_by(parts).map(|value| rounded(*value)).collect::<Vec<f64>>();
        let start = case.run.start.unwrap_or_default();
        let shares = |stamps: &mut dyn Iterator<Item = f64>| -> Vec<f64> {
            let times = stamps.map(|stamp| survey.time_of(stamp));
            extended_way.shares_at(times).into_iter().map(rounded).collect()
        };
        let residue = Residue {
            condition: study.conditions[cluster.condition].label(),
            start: [start.x, start.y, start.heading],
            runs,
            frame_at: shares(&mut case.frame_stamp.into_iter()).first().copied(),
            at: shares(&mut case.readings.iter().filter_map(|reading| reading.stamp)),
            x: part(0),
            y: part(1),
            heading: if parts == 3 { part(2) } else { Vec::new() },
            noise: study.noise[cluster.campaign],
        };
        Ok(Some((residue, (mean_squares, runs))))
    };
    let all: Vec<Option<_>> = study.clusters.par_iter().enumerate().map(of).collect::<Result<_, ForwardError>>()?;
    let (residues, mean_squares): (Vec<_>, Vec<_>) = all.into_iter().flatten().unzip();
    Ok((residues, Remainder::of(&mean_squares)))
}

fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    /// So many kinds besides those of parts, of which the last two are the survey's.
    const BESIDES: usize = 2 + doubt::KINDS - doubt::KINDS_OF_PARTS;

    /// What is told by a campaign that shows each kind of error to a share of 1e-4 and left so much of it.
    fn left(of: impl Fn(usize) -> f64) -> Told {
        let kinds = doubt::KINDS_OF_PARTS + BESIDES;
        let found = DVector::from_fn(kinds, |kind, _| of(kind) * 1e8);
        Told { information: DMatrix::identity(kinds, kinds) * 1e8, found }
    }

    /// What is remembered of the first of clusters that left so much each.
    fn first_of(told: Vec<Told>) -> Memory {
        memories(told.into_iter().map(Some).collect()).swap_remove(0).expect("told")
    }

    /// What is remembered where one cluster left so much.
    fn remembered(of: impl Fn(usize) -> f64) -> Memory {
        first_of(vec![left(of)])
    }

    /// What left nothing of parts, and of each other kind z σ.
    fn along(z: f64) -> Told {
        left(|kind| if kind < doubt::KINDS_OF_PARTS { 0.0 } else { z * 1e-4 })
    }

    /// Of either sign in turn.
    fn in_turn(kind: usize) -> f64 {
        if kind.is_multiple_of(2) { 1.0 } else { -1.0 }
    }

    #[test]
    fn noise_that_was_left_of_parts_is_not_expected_again_but_an_error_is() {
        let noise = remembered(|kind| 1e-4 * in_turn(kind));
        assert_eq!(noise.widths.of_parts, 0.0);
        assert_eq!(noise.expected(0.0).mean[0], 0.0);
        let error = remembered(|kind| 1.6e-3 * in_turn(kind));
        assert_eq!(error.widths.of_parts, 1.6e-3);
        assert!((error.expected(0.0).mean[0] - 1.6e-3).abs() < 1e-5);
        // A model that is known to be wrong by more is held to what was left of it.
        assert!(noise.expected(1.6e-3).mean[0] > 0.99e-4);
    }

    /// The likeliest width of what was found z σ off is √(z² − 1) σ, up to the widest, so that 1 − 1/z² of it is expected again, which is
    /// known to √(1 − 1/z²) σ; it is e^(z²/2 − 1/2)/z times as likely as none, and what is not clearly larger than its noise is not
    /// expected, and known not to be.
    #[test]
    fn what_was_clearly_left_all_along_the_way_is_expected_again() {
        let is_calibrated = |kind: usize| doubt::CALIBRATED_KINDS.contains(&(kind - doubt::KINDS_OF_PARTS));
        let widest = WIDE.powi(2) / (WIDE.powi(2) + 1e-8);
        for (z, share) in [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.5, 0.84), (5.0, 0.96), (100.0, widest)] {
            let memory = first_of(vec![along(z)]);
            assert_eq!(memory.widths.of_parts, 0.0);
            let expected = memory.expected(0.0);
            let variance = expected.spread.tr_mul(&expected.spread).diagonal();
            assert_eq!(variance[0], 0.0);
            for kind in doubt::KINDS_OF_PARTS..doubt::KINDS_OF_PARTS + BESIDES {
                // A calibration need not convince.
                let share = if z == 2.0 && is_calibrated(kind) { 0.75 } else { share };
                assert!((expected.mean[kind] - share * z * 1e-4).abs() < 1e-9, "{z}: {}", expected.mean[kind]);
                assert!((variance[kind] * 1e8 - share).abs() < 1e-6, "{z}: {}", variance[kind]);
            }
        }
    }

    /// Of the survey a model of the motion says nothing, however far it is wrong.
    #[test]
    fn a_motion_that_is_wrong_makes_no_errors_of_the_survey() {
        let spread = first_of(vec![along(0.0)]).expected(1e-3).spread;
        let known = |kind: usize| spread.column(kind).norm();
        assert!((known(0) / 1e-4 - 1.0).abs() < 0.01 && (known(doubt::KINDS - 1) / 1e-4 - 1.0).abs() < 0.01);
        assert_eq!(known(doubt::KINDS), 0.0);
    }

    /// Noise of 2 σ in one of four clusters is no error of all; an error of 2 σ in each is.
    #[test]
    fn an_error_is_as_large_in_one_cluster_as_in_another() {
        let widths_of = |all: &[f64]| first_of(all.iter().map(|z| along(*z)).collect()).widths.all_along;
        assert_eq!(widths_of(&[2.0, 0.5, -0.5, 0.0])[1], 0.0);
        assert!((widths_of(&[2.0, -2.0, 2.0, 2.0])[1] - 3_f64.sqrt() * 1e-4).abs() < 1e-8);
    }

    /// Of two errors that look much alike, the one that explains more is remembered, and the other not.
    #[test]
    fn of_errors_that_look_alike_one_is_remembered() {
        let information = DMatrix::from_row_slice(2, 2, &[1e8, 0.98e8, 0.98e8, 1e8]);
        let found = &information * DVector::from_column_slice(&[6e-4, 0.0]);
        let widths = likeliest_widths(&[Told { information, found }]);
        assert!((widths[0] - 35_f64.sqrt() * 1e-4).abs() < 2e-6 && widths[1] == 0.0, "{widths}");
    }

    #[test]
    fn a_model_that_leaves_clearly_more_than_the_fit_is_another() {
        let of = |squares: [f64; 2]| Remainder::of(&[(squares, 3.0), ([0.0; 2], 1.0)]).expect("runs");
        let one = of([4.0, 4.0 * 1.1 * OTHER]);
        assert_eq!(one.fitted, 3_f64.sqrt());
        assert!(one.is_other());
        assert!(!of([4.0, 4.0 * 0.9 * OTHER]).is_other());
        assert!(!of([4.0, 1.0]).is_other());
        assert_eq!(Remainder::of(&[]), None);
    }
}
