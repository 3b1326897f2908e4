//! Poses on the way: units, turns and frame, against where the run ended; when they set off, against the wheels; and whether
//! the robot went where it pointed.

use super::SuspicionKind::{
    ClockOffset, ClocksApart, WayAcross, WayDegrees, WayFrozen, WayJump, WayRoomFrame, WayStart, WayUnit, WayWrapped,
};
use super::rows::way_between;
use super::{CLOCKS, FACTOR, SuspicionKind, Work, apart, label, median, seen_from, stated_length, stated_turn, within};
use crate::dataset::{PoseLog, Protocol, Run, SurveyedPose};
use crate::geometry::{Pose2, unwrap_near};
use crate::odometry::DeadReckoning;
use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};

/// What is taken for the noise of a reading where nobody states it \[m, rad\].
const READING: [f64; 2] = [0.005, 0.01];

/// What two readings of one pose never differ by, in σ of one.
const SURELY: f64 = 7.0;

/// Steps by which it is seen where a robot goes \[m\], and how far it may turn in one \[rad\].
const STEP: f64 = 0.05;
const STEP_TURN: f64 = 0.25;

/// Everything about poses on the way, the mended ones for the next question.
pub(super) fn poses(work: &mut Work) {
    degrees(work);
    wrapped(work);
    units(work);
    room_frame(work);
    set_off(work);
    start(work);
    frozen(work);
    jumps(work);
    across(work);
}

/// Headings in degrees: 57 times the turn that the run made; √57 is the middle in proportion.
fn degrees(work: &mut Work) {
    let is_wrong = |_: &Work, run: &Run, log: &PoseLog| {
        let (last, turn) = (last_heading(log)?, turn(run).filter(|turn| turn.abs() > 0.3)?);
        ((last / turn).abs() > (180.0 / PI).sqrt()).then_some((last, turn))
    };
    let runs = wrong(work, WayDegrees, is_wrong);
    // A straight in the same file is in degrees too, though it does not show it.
    let all = runs.len() * 2 > work.data.runs.len();
    mend(work, |index| all || runs.contains(&index), |log| headings(log, |heading, _| heading.to_radians()));
}

/// Headings that were brought back to one turn: whole turns off where the run ended, and not if each is the turn nearest to the
/// one before.
fn wrapped(work: &mut Work) {
    let is_wrong = |_: &Work, run: &Run, log: &PoseLog| {
        let (last, turn) = (last_heading(log)?, turn(run)?);
        let counted_on = log.poses.iter().filter_map(|pose| pose.heading).fold(0.0, |before, h| unwrap_near(h, before));
        ((last - turn).abs() > PI && (counted_on - turn).abs() < FRAC_PI_2).then_some((last, counted_on))
    };
    let runs = wrong(work, WayWrapped, is_wrong);
    mend(work, |index| runs.contains(&index), |log| headings(log, unwrap_near));
}

/// Positions in millimetres or centimetres, by how far the robot got from where its log begins.
fn units(work: &mut Work) {
    for factor in [1e-2, 1e-3] {
        let is_wrong = |_: &Work, run: &Run, log: &PoseLog| {
            let (reached, expected) = reach(run, log)?;
            within(factor * reached / expected, FACTOR).then_some((reached, expected))
        };
        let runs = wrong(work, WayUnit, is_wrong);
        let to_metres = |pose: &mut SurveyedPose| (pose.x, pose.y) = (factor * pose.x, factor * pose.y);
        mend(work, |index| runs.contains(&index), |log| log.poses.iter_mut().for_each(to_metres));
    }
}

/// Poses in the room: seen from their first row they end where the run did, as noted they do not.
fn room_frame(work: &mut Work) {
    let std = [position_std(work), work.data.campaign.survey.heading_std.unwrap_or(READING[1])];
    let is_wrong = |_: &Work, run: &Run, log: &PoseLog| {
        let length = stated_length(&run.protocol).unwrap_or(1.0);
        // Where nobody surveyed the end, it is somewhere about the protocol's.
        let (end, near) = match (run.end, run.protocol.nominal_end()) {
            (Some(end), _) => (end, SURELY * (std[0] + length * std[1])),
            (None, nominal) => (nominal?.into(), 0.1 * length),
        };
        let (first, last) = (first_pose(log)?, *log.poses.last()?);
        let (noted, from_start) = (apart(last, end, length), apart(seen_from(first, last), end, length));
        // Four times nearer, as of ends.
        (noted > 4.0 * from_start && noted > near).then_some((noted, from_start))
    };
    let runs = wrong(work, WayRoomFrame, is_wrong);
    mend(
        work,
        |index| runs.contains(&index),
        |log| {
            let Some(first) = first_pose(log) else { return };
            log.poses.iter_mut().for_each(|pose| *pose = seen_from(first, *pose));
        },
    );
}

/// Poses that set off with the wheels by one clock and not by the other.
fn set_off(work: &mut Work) {
    for index in wrong(work, ClockOffset, |work, run, log| Some((late(work, run, log)?, CLOCKS))) {
        let run = &work.data.runs[index];
        let Some(late) = run.poses.as_ref().and_then(|log| late(work, run, log)) else { continue };
        mend(work, |other| other == index, |log| log.time.iter_mut().for_each(|time| *time -= late));
    }
}

/// By how much later poses set off than wheels do, where that is more than clocks disagree by \[s\].
fn late(work: &Work, run: &Run, log: &PoseLog) -> Option<f64> {
    let (counts, step) = (run.log()?, step(work));
    // On the spot it goes nowhere, and a path may begin there.
    if matches!(run.protocol, Protocol::Spin { .. } | Protocol::Path) {
        return None;
    }
    // A tracker that begins later and does not end later has not seen it set off.
    if log.time[0] > counts.time[0] + CLOCKS && log.time.last()? <= &(counts.time.last()? + CLOCKS) {
        return None;
    }
    // Clocks that hardly overlap are told already.
    if work.found.iter().any(|found| found.kind == ClocksApart && found.runs.contains(&run.name)) {
        return None;
    }
    let first = log.poses.first()?;
    let gone = log.poses.iter().map(|pose| (pose.x - first.x).hypot(pose.y - first.y));
    let rolled = |row| work.arc(run, 0, row).map(|[left, right]| (0.5 * (left + right)).abs());
    let rolled: Vec<f64> = (0..counts.len()).map(rolled).collect::<Option<_>>()?;
    let by_wheels = |level| crossing(&counts.time, rolled.iter().copied(), level);
    let ([seen, between_poses], [counted, between_counts]) = (crossing(&log.time, gone, step)?, by_wheels(step)?);
    let late = seen - counted;
    // Wheels that are not as believed take longer, or shorter, for that step, and nobody saw it but from one row to the next.
    let taken = counted - by_wheels(0.1 * step)?[0];
    (late.abs() > CLOCKS + (FACTOR - 1.0) * taken + between_poses + between_counts).then_some(late)
}

/// When `values` first get to `level`, on the straight line from the row before, and how long after that row the next one is.
fn crossing(time: &[f64], values: impl Iterator<Item = f64>, level: f64) -> Option<[f64; 2]> {
    let mut before = (*time.first()?, 0.0);
    for (&at, value) in time.iter().zip(values) {
        if value >= level {
            let share = if value > before.1 { (level - before.1) / (value - before.1) } else { 1.0 };
            return Some([before.0 + share * (at - before.0), at - before.0]);
        }
        before = (at, value);
    }
    None
}

/// Poses that begin with the run and elsewhere, by more than noise and what a robot that is on its way goes while clocks disagree;
/// or that begin later, as if the robot had not gone anywhere by then.
fn start(work: &mut Work) {
    let std = position_std(work);
    let is_wrong = |work: &Work, run: &Run, log: &PoseLog| {
        let first = log.poses.first()?;
        let off = first.x.hypot(first.y);
        if let Some(counts) = run.log().filter(|counts| log.time[0] > counts.time[0] + CLOCKS) {
            // Ticks that nobody can turn into radians.
            work.arcs(run)?;
            let odometry = work.odometry.as_ref()?;
            let mut reckoning = DeadReckoning::new(*odometry);
            let rows = (0..counts.len()).take_while(|&row| counts.time[row] < log.time[0] - CLOCKS);
            let [x, y] = rows.fold([0.0; 2], |_, row| {
                let [left, right] = counts.sides(row, odometry);
                let pose = reckoning.update(left, right);
                [pose.x, pose.y]
            });
            // As far from where it was as a wrong track hardly brings it, and no farther from the start than noise.
            let was = x.hypot(y);
            return (was > 4.0 * step(work) && off < 0.25 * was).then_some((off, was));
        }
        let soon = log.time.iter().zip(&log.poses).take_while(|(time, _)| **time <= log.time[0] + CLOCKS);
        let gone = soon.map(|(_, pose)| (pose.x - first.x).hypot(pose.y - first.y)).fold(0.0, f64::max);
        // Where rows are few, wheels say how far that is; without them the first row is late by its stamp, and by no more than
        // any other is from the next.
        let share = |pair: &[f64]| (log.time[0] / (pair[1] - pair[0])).clamp(0.0, 1.0);
        let late = match run.log() {
            Some(counts) => way_between(work, run, counts.time[0], log.time[0] + CLOCKS),
            None => steps(log).zip(log.time.windows(2)).map(|(step, pair)| step * share(pair)).reduce(f64::max),
        };
        (off > SURELY * std + gone.max(FACTOR * late.unwrap_or(0.0))).then_some((off, 0.0))
    };
    for index in wrong(work, WayStart, is_wrong) {
        let run = &mut work.data.runs[index];
        // An end that is the last of poses that begin on the way is seen from there, too.
        if run.poses.as_ref().is_some_and(|log| log.poses.last() == run.end.as_ref()) {
            run.end = None;
        }
    }
}

/// Poses that leap from one row to the next, by ten times what all but one in fifty do: a tracker that took something else for
/// the robot.
fn jumps(work: &mut Work) {
    let std = position_std(work);
    let is_wrong = |_: &Work, _: &Run, log: &PoseLog| {
        let intervals = || log.time.windows(2).map(|pair| pair[1] - pair[0]);
        let (step, interval) = (quantile(steps(log), 0.98)?, median(intervals())?);
        // Where rows are missing it may have gone as far.
        let at_once = steps(log).zip(intervals()).filter(|(_, after)| *after < 3.0 * interval);
        let largest = at_once.map(|(step, _)| step).fold(0.0, f64::max);
        (largest > 10.0 * step && largest > SURELY * SQRT_2 * std).then_some((largest, step))
    };
    wrong(work, WayJump, is_wrong);
}

/// Poses that stay the same to the last digit while wheels turn: a tracker that lost the robot and repeats itself.
fn frozen(work: &mut Work) {
    let is_wrong = |work: &Work, run: &Run, log: &PoseLog| {
        let mut row = 0;
        let stretches = log.poses.chunk_by(|one, next| one == next).map(|alike| {
            let first = row;
            row += alike.len();
            (log.time[first], log.time[row - 1])
        });
        // What is shorter than clocks may disagree by says nothing.
        let stands = stretches.filter(|(from, until)| until - from > 2.0 * CLOCKS);
        let ways = stands
            .filter_map(|(from, until)| Some((until - from, way_between(work, run, from + CLOCKS, until - CLOCKS)?)));
        // A tread that rolls as far as a step is no settling.
        ways.filter(|(_, way)| *way > STEP).max_by(|(one, _), (other, _)| one.total_cmp(other))
    };
    let runs = wrong(work, WayFrozen, is_wrong);
    mend(
        work,
        |index| runs.contains(&index),
        |log| {
            let PoseLog { time, poses } = std::mem::take(log);
            for (time, pose) in time.into_iter().zip(poses) {
                if log.poses.last() != Some(&pose) {
                    log.time.push(time);
                    log.poses.push(pose);
                }
            }
        },
    );
}

/// How far poses are from one row to the next \[m\].
fn steps(log: &PoseLog) -> impl Iterator<Item = f64> {
    log.poses.windows(2).map(|pair| (pair[1].x - pair[0].x).hypot(pair[1].y - pair[0].y))
}

/// The value that such a share of `values` does not exceed; `None` of none.
fn quantile(values: impl Iterator<Item = f64>, share: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(((values.len() as f64 - 1.0) * share) as usize).copied()
}

/// Whether the robot goes along its headings, forward or back: with an axis turned round, or two swapped, the way of a square
/// or a circle is along them as often as across or against.
fn across(work: &mut Work) {
    let step = step(work);
    let is_wrong = |_: &Work, run: &Run, log: &PoseLog| {
        // On the spot it goes nowhere, and a path may lead back and forth.
        if matches!(run.protocol, Protocol::Spin { .. } | Protocol::Path) {
            return None;
        }
        let [along, way] = along_headings(log, step)?;
        let share = along.abs() / way;
        // Right is 1, wrong is 0 or less; ten steps, so that no swing of a point ahead of the axle is taken for the way.
        (way > 10.0 * step && share < 0.5).then_some((share, 1.0))
    };
    wrong(work, WayAcross, is_wrong);
}

/// How far a robot goes where it points, negative in reverse, and how far altogether, by steps of `step` in which it hardly
/// turns \[m\].
fn along_headings(log: &PoseLog, step: f64) -> Option<[f64; 2]> {
    let (mut along, mut way) = (0.0, 0.0);
    let mut readings = log.poses.iter().filter_map(|pose| Some(Pose2::new(pose.x, pose.y, pose.heading?)));
    let mut last = readings.next()?;
    for reading in readings {
        let distance = reading.distance(last);
        if distance < step {
            continue;
        }
        if (reading.heading - last.heading).abs() < STEP_TURN {
            let heading = 0.5 * (reading.heading + last.heading);
            let direction = (reading.y - last.y).atan2(reading.x - last.x);
            along += distance * (direction - heading).cos();
            way += distance;
        }
        last = reading;
    }
    Some([along, way])
}

/// How far these runs go where their wheels say by the headings of their poses, negative if against it, and how far altogether
/// \[m\]; `None` where that is next to nothing.
pub(super) fn along_wheels(work: &Work, runs: &[usize]) -> Option<[f64; 2]> {
    let step = step(work);
    let each = runs.iter().filter_map(|&index| {
        let run = &work.data.runs[index];
        let [along, way] = along_headings(run.poses.as_ref()?, step)?;
        Some([along * work.logged_way(run)?.signum(), way])
    });
    let [along, way] = each.fold([0.0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
    (way > 10.0 * step).then_some([along, way])
}

/// Of one reading, stated or taken for it \[m\].
fn position_std(work: &Work) -> f64 {
    work.data.campaign.survey.position_std.unwrap_or(READING[0])
}

/// By how much a point moves until it has surely moved \[m\].
fn step(work: &Work) -> f64 {
    STEP.max(SURELY * position_std(work))
}

/// The turn that a run made \[rad\], as surveyed or else as its protocol has it.
fn turn(run: &Run) -> Option<f64> {
    let surveyed = run.end.and_then(|end| end.heading);
    surveyed.or_else(|| Some(label(&run.protocol)? * stated_turn(&run.protocol)?))
}

/// How far poses get from their first \[m\], and how far the protocol calls for; of a path, from the first to the last.
fn reach(run: &Run, log: &PoseLog) -> Option<(f64, f64)> {
    let first = log.poses.first()?;
    let from_first = |pose: &SurveyedPose| (pose.x - first.x).hypot(pose.y - first.y);
    let farthest = log.poses.iter().map(from_first).fold(0.0, f64::max);
    match run.protocol {
        Protocol::Square { side, .. } => Some((farthest, SQRT_2 * side)),
        Protocol::Circle { radius, turn, .. } => {
            let turn = turn.unwrap_or(PI).min(PI);
            Some((farthest, 2.0 * radius * (0.5 * turn).sin()))
        }
        Protocol::Straight { length, .. } => Some((farthest, length)),
        Protocol::Path => {
            let end = run.end.map(|end| end.x.hypot(end.y)).filter(|end| *end > STEP)?;
            Some((from_first(log.poses.last()?), end))
        }
        Protocol::Spin { .. } => None,
    }
}

/// The first pose; a heading that was not measured is none.
fn first_pose(log: &PoseLog) -> Option<Pose2> {
    log.poses.first().map(|pose| Pose2::new(pose.x, pose.y, pose.heading.unwrap_or(0.0)))
}

fn last_heading(log: &PoseLog) -> Option<f64> {
    log.poses.iter().rev().find_map(|pose| pose.heading)
}

/// Suspects the runs with poses of which a question finds what was seen and what should be; their indices.
fn wrong(
    work: &mut Work,
    kind: SuspicionKind,
    ask: impl Fn(&Work, &Run, &PoseLog) -> Option<(f64, f64)>,
) -> Vec<usize> {
    work.ask(kind, |work, run| ask(work, run, run.poses.as_ref()?))
}

/// Changes the poses of some runs in the working copy.
fn mend(work: &mut Work, is_wrong: impl Fn(usize) -> bool, change: impl Fn(&mut PoseLog)) {
    let runs = work.data.runs.iter_mut().enumerate().filter(|(index, _)| is_wrong(*index));
    runs.filter_map(|(_, run)| run.poses.as_mut()).for_each(change);
}

/// Changes each heading that was measured, given the one before it as it was changed.
fn headings(log: &mut PoseLog, change: impl Fn(f64, f64) -> f64) {
    let mut before = 0.0;
    for heading in log.poses.iter_mut().filter_map(|pose| pose.heading.as_mut()) {
        *heading = change(*heading, before);
        before = *heading;
    }
}
