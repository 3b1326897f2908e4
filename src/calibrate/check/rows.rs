//! Rows of logs: whether counts go on counting, whether rows are missing, and what their stamps are in.

use super::SuspicionKind::{ClocksApart, CountSteps, CountsWrapped, LogGap, LogTime};
use super::{FACTOR, SuspicionKind, Work, within};
use crate::dataset::{EncoderLog, EncoderUnit, Protocol, Run};
use std::f64::consts::TAU;

/// How many times a jump between rows is a wheel's largest step that is none, before it is taken for the counter's.
const JUMP: f64 = 20.0;
/// How near to the counter's range a jump is, relative.
const RANGE: f64 = 0.05;
/// Mean speeds of the wheels beyond which no robot is tested \[m/s\]: in milliseconds one of 3 m/s seems to go so slowly.
const SPEEDS: [f64; 2] = [3e-3, 50.0];
/// Times the usual interval between rows, and seconds, from which on rows are missing; and how far a wheel has to go meanwhile \[m\].
const GAP: (f64, f64, f64) = (10.0, 0.5, 0.02);
/// Between one and the smallest wrong factor of seconds, 1000, in proportion.
const UNITS: f64 = 30.0;
/// What clocks of encoders and survey may disagree by \[s\].
const CLOCKS: f64 = 0.5;

/// Counts of each row alone, where the sum of all is what was driven and their difference from first to last is nothing.
pub(super) fn steps(work: &mut Work) {
    let is_wrong = |work: &Work, run: &Run| {
        let way = match run.protocol {
            Protocol::Square { side, .. } => 4.0 * side,
            Protocol::Straight { length, direction } => length * direction.sign(),
            Protocol::Circle { radius, turn, .. } => radius * turn.unwrap_or(TAU),
            Protocol::Spin { .. } | Protocol::Path => return None,
        };
        let counted = work.logged_way(run)?;
        let summed = Run { encoders: run.encoders.clone().map(summed), ..run.clone() };
        let sum = work.logged_way(&summed)?;
        (counted.abs() < 0.1 * way.abs() && within((sum / way).abs(), FACTOR)).then_some((counted, sum))
    };
    mend(work, CountSteps, is_wrong, |run| run.encoders = run.encoders.take().map(summed));
}

/// Counters that begin anew: jumps of one power of two, or of one turn of a joint.
pub(super) fn wrapped(work: &mut Work) {
    let is_wrong = |work: &Work, run: &Run| {
        // Where rows are missing a wheel may have gone as far.
        let log = run.log().filter(|_| gap(work, run).is_none())?;
        let ranges = (0..log.channels.len()).filter_map(|channel| Some((jump(log, channel)?, range(log, channel)?)));
        ranges.max_by(|(_, a), (_, b)| a.total_cmp(b))
    };
    mend(work, CountsWrapped, is_wrong, |run| {
        let Some(log) = &mut run.encoders else { return };
        let width = log.channels.len();
        for channel in 0..width {
            let Some(range) = range(log, channel) else { continue };
            for row in 1..log.len() {
                let before = log.counts[(row - 1) * width + channel];
                let count = &mut log.counts[row * width + channel];
                *count -= range * ((*count - before) / range).round();
            }
        }
    });
}

/// Stamps in another unit: wheels that crawl or fly.
pub(super) fn stamps(work: &mut Work) {
    let is_wrong = |work: &Work, run: &Run| {
        let (log, odometry) = (run.log()?, work.odometry.as_ref()?);
        let arcs = arcs(work, run)?;
        let way: f64 = arcs.iter().flatten().map(|arc| arc.abs()).sum::<f64>() / 2.0;
        let duration = log.time[log.len() - 1] - log.time[0];
        let speed = way / duration;
        let is_none = !(SPEEDS[0]..SPEEDS[1]).contains(&speed) && way > odometry.left_wheel_radius;
        is_none.then_some((speed, duration))
    };
    mend(work, LogTime, is_wrong, |run| {
        let same_unit =
            spans(run).is_some_and(|[counted, read]| within((read.1 - read.0) / (counted.1 - counted.0), UNITS));
        let of_poses = run.poses.as_mut().filter(|_| same_unit).map(|log| &mut log.time);
        let times = run.encoders.as_mut().map(|log| &mut log.time).into_iter().chain(of_poses).flatten();
        times.for_each(|time| *time *= 1e-3);
    });
}

/// Rows that are missing while wheels turned: nobody knows how.
pub(super) fn gaps(work: &mut Work) {
    mend(work, LogGap, gap, |_| {});
}

/// Poses at other times than counts: spans that share less than half of the shorter one.
pub(super) fn clocks(work: &mut Work) {
    let is_wrong = |_: &Work, run: &Run| {
        let [counted, read] = spans(run)?;
        let shared = counted.1.min(read.1) - counted.0.max(read.0) + 2.0 * CLOCKS;
        let shorter = (counted.1 - counted.0).min(read.1 - read.0);
        let alike = within((read.1 - read.0) / (counted.1 - counted.0), UNITS);
        (shared < 0.5 * shorter || !alike).then_some((read.1, counted.1))
    };
    mend(work, ClocksApart, is_wrong, |_| {});
}

/// From when to when counts and poses of a run were logged \[s\].
fn spans(run: &Run) -> Option<[(f64, f64); 2]> {
    let (log, poses) = (run.log()?, run.poses.as_ref().filter(|poses| poses.time.len() > 2)?);
    let span = |time: &[f64]| Some((*time.first()?, *time.last()?));
    Some([span(&log.time)?, span(&poses.time)?])
}

/// The longest interval without rows while wheels turned, where it is no usual one, and the usual one \[s\].
fn gap(work: &Work, run: &Run) -> Option<(f64, f64)> {
    let time = &run.log()?.time;
    let mut intervals: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let arcs = arcs(work, run)?;
    let went = |k: &usize| arcs[*k].iter().any(|arc| arc.abs() > GAP.2);
    let longest = (0..intervals.len()).filter(went).map(|k| intervals[k]).fold(0.0, f64::max);
    intervals.sort_by(f64::total_cmp);
    let usual = intervals[intervals.len() / 2];
    (longest > GAP.0 * usual && longest > GAP.1).then_some((longest, usual))
}

/// How far the wheels go between two times, the mean of both sides \[m\].
pub(super) fn way_between(work: &Work, run: &Run, from: f64, until: f64) -> Option<f64> {
    let (time, arcs) = (&run.log()?.time, arcs(work, run)?);
    let within = |(k, _): &(usize, &[f64; 2])| time[*k] >= from && time[k + 1] <= until;
    Some(arcs.iter().enumerate().filter(within).map(|(_, [left, right])| 0.5 * (left.abs() + right.abs())).sum())
}

/// What the left and the right wheels go from row to row \[m\].
fn arcs(work: &Work, run: &Run) -> Option<Vec<[f64; 2]>> {
    let (log, odometry) = (run.log()?, work.odometry.as_ref()?);
    if log.unit == EncoderUnit::Ticks && odometry.ticks_per_revolution.is_none() {
        return None;
    }
    let radii = [odometry.left_wheel_radius, odometry.right_wheel_radius];
    let sides: Vec<[f64; 2]> = (0..log.len()).map(|row| log.sides(row, odometry)).collect();
    Some(sides.windows(2).map(|pair| [0, 1].map(|side| (pair[1][side] - pair[0][side]) * radii[side])).collect())
}

/// Counts that go on, of those of each row alone.
fn summed(mut log: EncoderLog) -> EncoderLog {
    let width = log.channels.len();
    for index in width..log.counts.len() {
        log.counts[index] += log.counts[index - width];
    }
    log
}

/// Differences of a channel from row to row.
fn differences(log: &EncoderLog, channel: usize) -> impl Iterator<Item = f64> {
    let count = move |row: usize| log.counts[row * log.channels.len() + channel];
    (1..log.len()).map(move |row| count(row) - count(row - 1))
}

/// The largest jump of a channel that is none of the wheel's: far beyond all but a few of its steps.
fn jump(log: &EncoderLog, channel: usize) -> Option<f64> {
    let mut sizes: Vec<f64> = differences(log, channel).map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    let usual = sizes.get(sizes.len() * 9 / 10).copied()?;
    sizes.last().copied().filter(|largest| *largest > JUMP * usual.max(f64::MIN_POSITIVE) && usual > 0.0)
}

/// The range of a channel's counter, where every jump is of it.
fn range(log: &EncoderLog, channel: usize) -> Option<f64> {
    let largest = jump(log, channel)?;
    let range = match log.unit {
        EncoderUnit::Ticks => largest.log2().round().exp2(),
        EncoderUnit::Radians => TAU,
    };
    let is_of_it = |size: f64| size < 0.5 * range || within(size / range, 1.0 + RANGE);
    (within(largest / range, 1.0 + RANGE) && differences(log, channel).all(|step| is_of_it(step.abs())))
        .then_some(range)
}

/// Suspects the runs of which a question finds what was seen and what should be, and changes their logs in the working copy.
fn mend(
    work: &mut Work,
    kind: SuspicionKind,
    ask: impl Fn(&Work, &Run) -> Option<(f64, f64)>,
    change: impl Fn(&mut Run),
) {
    let found: Vec<Option<(f64, f64)>> = work.data.runs.iter().map(|run| ask(work, run)).collect();
    let runs: Vec<usize> = (0..found.len()).filter(|&index| found[index].is_some()).collect();
    if let Some((seen, expected)) = found.into_iter().flatten().next() {
        work.suspect(kind, &runs, seen, expected);
    }
    runs.into_iter().for_each(|index| change(&mut work.data.runs[index]));
}
