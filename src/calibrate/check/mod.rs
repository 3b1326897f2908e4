//! What the data look like before anyone calculates: mistakes of noting and of wiring that a calibration would
//! swallow and turn into wrong parameters.
//!
//! The idea is that of witnesses. Label, survey and encoders each say which way a run turned and how far it went; the
//! one that stands against two others is wrong, and where only two stand against each other nothing is said, or that
//! they do. A mistake that was recognised is mended in a working copy before the next question is asked, so that one
//! mistake makes one suspicion. Bounds are of three sorts only: what is physically impossible, the middle (in
//! proportion) between right and the smallest mistake of that sort, and chance of less than one in a thousand campaigns.

mod logs;
mod rows;
mod scatter;
mod senses;
mod survey;
mod suspicion;
mod way;

pub use suspicion::{Suspicion, SuspicionKind};

use crate::dataset::{Dataset, EncoderUnit, Protocol, Run, SurveyedPose};
use crate::geometry::{Pose2, wrap_angle};
use crate::odometry::OdometryParameters;
use std::f64::consts::{SQRT_2, TAU};

/// Everything about `dataset` that is hardly what was meant; empty where nothing looks wrong.
pub fn check(dataset: &Dataset) -> Vec<Suspicion> {
    let mut work = Work::new(dataset);
    scatter::copied_runs(&mut work);
    logs::against_nominal(&mut work);
    rows::steps(&mut work);
    rows::wrapped(&mut work);
    rows::stamps(&mut work);
    rows::gaps(&mut work);
    rows::clocks(&mut work);
    logs::count_signs(&mut work);
    survey::stated_noise(&mut work);
    survey::room_frame(&mut work);
    survey::degrees(&mut work);
    survey::wrapped(&mut work);
    senses::turns(&mut work);
    senses::travel(&mut work);
    logs::distances(&mut work);
    survey::units(&mut work);
    way::poses(&mut work);
    survey::pattern(&mut work);
    scatter::outliers(&mut work);
    scatter::one_direction(&mut work);
    work.found.sort_by_key(|suspicion| suspicion.kind);
    work.found
}

/// Right or wrong by the smallest gross factor, 2: the middle in proportion. No tyre is off by so much, no calibrated
/// robot, and no lab's tape.
const FACTOR: f64 = SQRT_2;

/// How far a believed track may be from the one that the robot turns by. Skid steering alone makes a factor of up to
/// 2.2 in what makers ship (1.4 to 1.9 for most); a slipped decimal point makes ten.
const TRACK_FACTOR: f64 = 2.5;

/// What clocks of a robot and of a survey may disagree by, and more \[s\].
const CLOCKS: f64 = 0.5;

/// The dataset while it is being mended, and what was found.
struct Work {
    data: Dataset,
    /// What turns counts into ways: believed, or nominal where nobody says what was believed.
    odometry: Option<OdometryParameters>,
    /// Whether dead reckoning from the logs still deserves trust to the last millimetre.
    logs_exact: bool,
    found: Vec<Suspicion>,
}

impl Work {
    fn new(dataset: &Dataset) -> Self {
        let robot = &dataset.campaign.robot;
        let nominal = || {
            let radius = 0.5 * robot.nominal_wheel_diameter?;
            Some(OdometryParameters {
                left_wheel_radius: radius,
                right_wheel_radius: radius,
                track_width: robot.nominal_track_width?,
                ticks_per_revolution: robot.ticks_per_revolution,
            })
        };
        let odometry = dataset.campaign.odometry.or_else(nominal);
        Work { data: dataset.clone(), odometry, logs_exact: dataset.campaign.odometry.is_some(), found: Vec::new() }
    }

    /// Notes a suspicion about the runs of these indices; more runs of a kind join those that are known.
    fn suspect(&mut self, kind: SuspicionKind, runs: &[usize], seen: f64, expected: f64) {
        let name = |index: &usize| self.data.runs[*index].name.clone();
        let known = self.found.iter_mut().find(|found| found.kind == kind && !found.runs.is_empty());
        match known.filter(|_| !runs.is_empty()) {
            Some(found) => {
                let all = self.data.runs.iter().enumerate();
                let joined = all.filter(|(index, run)| runs.contains(index) || found.runs.contains(&run.name));
                found.runs = joined.map(|(_, run)| run.name.clone()).collect();
            }
            None => self.found.push(Suspicion { kind, runs: runs.iter().map(name).collect(), seen, expected }),
        }
    }

    /// Suspects the runs of which a question finds what was seen and what should be; their indices.
    fn ask(&mut self, kind: SuspicionKind, ask: impl Fn(&Work, &Run) -> Option<(f64, f64)>) -> Vec<usize> {
        let found: Vec<Option<(f64, f64)>> = self.data.runs.iter().map(|run| ask(self, run)).collect();
        let runs: Vec<usize> = (0..found.len()).filter(|&index| found[index].is_some()).collect();
        if let Some((seen, expected)) = found.into_iter().flatten().next() {
            self.suspect(kind, &runs, seen, expected);
        }
        runs
    }

    /// Indices of the runs that `keep`.
    fn indices(&self, keep: impl Fn(&Run) -> bool) -> Vec<usize> {
        (0..self.data.runs.len()).filter(|&index| keep(&self.data.runs[index])).collect()
    }

    /// Net way of the left and of the right wheels of a run by its log \[m\].
    fn arcs(&self, run: &Run) -> Option<[f64; 2]> {
        self.arc(run, 0, run.log()?.len() - 1)
    }

    /// That from row to row.
    fn arcs_of_rows(&self, run: &Run) -> Option<Vec<[f64; 2]>> {
        (1..run.log()?.len()).map(|row| self.arc(run, row - 1, row)).collect()
    }

    /// That from one row to another.
    fn arc(&self, run: &Run, from: usize, until: usize) -> Option<[f64; 2]> {
        let odometry = self.odometry.as_ref()?;
        let log = run.log()?;
        // Ticks that nobody can turn into radians.
        if log.unit == EncoderUnit::Ticks && odometry.ticks_per_revolution.is_none() {
            return None;
        }
        let (first, last) = (log.sides(from, odometry), log.sides(until, odometry));
        Some([(last[0] - first[0]) * odometry.left_wheel_radius, (last[1] - first[1]) * odometry.right_wheel_radius])
    }

    /// Net turn of a run by its log \[rad\].
    fn logged_turn(&self, run: &Run) -> Option<f64> {
        let [left, right] = self.arcs(run)?;
        Some((right - left) / self.odometry.as_ref()?.track_width)
    }

    /// Net way of the centre by the log \[m\].
    fn logged_way(&self, run: &Run) -> Option<f64> {
        let [left, right] = self.arcs(run)?;
        Some(0.5 * (left + right))
    }

    /// Surveyed − dead-reckoned end pose: from the log where it is trusted, else against the protocol.
    fn end_error(&self, run: &Run) -> Option<SurveyedPose> {
        let end = run.end?;
        let believed = match &self.odometry {
            Some(odometry) if self.logs_exact => run.dead_reckoned_end(odometry)?,
            _ => run.protocol.nominal_end()?,
        };
        Some(SurveyedPose {
            x: end.x - believed.x,
            y: end.y - believed.y,
            heading: end.heading.map(|heading| heading - believed.heading),
        })
    }
}

/// +1 counter-clockwise, −1 clockwise; `None` for a straight and a path.
fn label(protocol: &Protocol) -> Option<f64> {
    match protocol {
        Protocol::Square { direction, .. } | Protocol::Spin { direction, .. } | Protocol::Circle { direction, .. } => {
            Some(direction.sign())
        }
        Protocol::Straight { .. } | Protocol::Path => None,
    }
}

/// Total turn that the protocol states, unsigned \[rad\].
fn stated_turn(protocol: &Protocol) -> Option<f64> {
    match *protocol {
        Protocol::Square { .. } => Some(TAU),
        Protocol::Spin { turn, .. } => Some(turn),
        Protocol::Circle { turn, .. } => turn,
        Protocol::Straight { .. } | Protocol::Path => None,
    }
}

/// Net way that the protocol states, negative in reverse \[m\].
fn stated_way(protocol: &Protocol) -> Option<f64> {
    match *protocol {
        Protocol::Square { side, .. } => Some(4.0 * side),
        Protocol::Circle { radius, turn, .. } => Some(radius * turn.unwrap_or(TAU)),
        Protocol::Straight { length, direction } => Some(length * direction.sign()),
        Protocol::Spin { .. } => Some(0.0),
        Protocol::Path => None,
    }
}

/// The length that the protocol states \[m\].
fn stated_length(protocol: &Protocol) -> Option<f64> {
    match *protocol {
        Protocol::Square { side, .. } => Some(side),
        Protocol::Straight { length, .. } => Some(length),
        Protocol::Circle { radius, .. } => Some(radius),
        Protocol::Spin { .. } | Protocol::Path => None,
    }
}

/// A pose as seen from a start; of a heading that was not measured nothing is taken off.
fn seen_from(start: Pose2, pose: SurveyedPose) -> SurveyedPose {
    let seen = start.relative(Pose2::new(pose.x, pose.y, pose.heading.unwrap_or(0.0)));
    SurveyedPose { x: seen.x, y: seen.y, heading: pose.heading.map(|_| seen.heading) }
}

/// How far two poses are apart, headings within a turn and by `length` \[m\].
fn apart(one: SurveyedPose, other: SurveyedPose, length: f64) -> f64 {
    let turn = one.heading.zip(other.heading).map_or(0.0, |(one, other)| wrap_angle(one - other).abs());
    (one.x - other.x).hypot(one.y - other.y) + length * turn
}

/// The start as seen from the end.
fn inverse(end: SurveyedPose) -> SurveyedPose {
    let inverse = Pose2::new(end.x, end.y, end.heading.unwrap_or(0.0)).inverse();
    SurveyedPose { x: inverse.x, y: inverse.y, heading: end.heading.map(|heading| -heading) }
}

/// Share of an end error (x, y, heading) of a square of `side` that errors of wheel size and track explain, 0 to 1.
///
/// With α lost a turn and β gained a side, to first order (science: Borenstein & Feng 1996), u = 2L(α+β), w = 2L(α−β):
/// clockwise (x, y, Lθ/2) = u·(−1, −1, 1), counter-clockwise w·(−1, 1, −1). A wrong sign of one of the three leaves
/// (±1 ±1 ±1)/3 squared, a ninth; without a heading it leaves nothing.
fn share(sums: &[([f64; 3], f64)]) -> f64 {
    let (mut along, mut all) = (0.0, 0.0);
    for (v, direction) in sums {
        let n = [-1.0, *direction, -direction];
        let (dot, known) = v
            .iter()
            .zip(n)
            .filter(|(v, _)| v.is_finite())
            .fold((0.0, 0.0), |(dot, known), (v, n)| (dot + v * n, known + 1.0));
        along += dot * dot / known;
        all += v.iter().filter(|v| v.is_finite()).map(|v| v * v).sum::<f64>();
    }
    if all > 0.0 { along / all } else { 0.0 }
}

/// (x, y, Lθ/2) of an end error; a heading that was not measured is NaN.
fn vector(error: SurveyedPose, side: f64) -> [f64; 3] {
    [error.x, error.y, error.heading.map_or(f64::NAN, |heading| 0.5 * side * heading)]
}

/// The middle of `values`; `None` of none.
fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        n if n % 2 == 1 => Some(values[middle]),
        _ => Some(0.5 * (values[middle - 1] + values[middle])),
    }
}

/// Whether `ratio` is within `factor` of 1, either way.
fn within(ratio: f64, factor: f64) -> bool {
    ratio > 1.0 / factor && ratio < factor
}
