//! Rows of logs: whether counts go on counting, whether rows are missing, and what their stamps are in.

use super::SuspicionKind::{ClocksApart, CountSteps, CountsWrapped, LogGap, LogTime};
use super::{CLOCKS, FACTOR, SuspicionKind, Work, median, stated_way, within};
use crate::dataset::{EncoderLog, EncoderUnit, Run};
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

/// Counts of each row alone, where the sum of all is what was driven and their difference from first to last is nothing.
pub(super) fn steps(work: &mut Work) {
    let is_wrong = |work: &Work, run: &Run| {
        let (way, counted) = (stated_way(&run.protocol)?, work.logged_way(run)?);
        if counted.abs() >= 0.1 * way.abs() {
            return None;
        }
        let sum = work.logged_way(&Run { encoders: run.encoders.clone().map(summed), ..run.clone() })?;
        within((sum / way).abs(), FACTOR).then_some((counted, sum))
    };
    mend(work, CountSteps, is_wrong, |run| run.encoders = run.encoders.take().map(summed));
}

/// Counters that begin anew: jumps of one power of two, or of one turn of a joint.
pub(super) fn wrapped(work: &mut Work) {
    let is_wrong = |work: &Work, run: &Run| {
        // Where rows are missing a wheel may have gone as far.
        let log = run.log().filter(|_| gap(work, run).is_none())?;
        (0..log.channels.len()).filter_map(|channel| begins_anew(log, channel)).max_by(|(_, a), (_, b)| a.total_cmp(b))
    };
    mend(work, CountsWrapped, is_wrong, |run| {
        let Some(log) = &mut run.encoders else { return };
        let width = log.channels.len();
        for channel in 0..width {
            let Some((_, range)) = begins_anew(log, channel) else { continue };
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
        let arcs = work.arcs_of_rows(run)?;
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
    work.ask(LogGap, gap);
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
    work.ask(ClocksApart, is_wrong);
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
    let intervals: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let arcs = work.arcs_of_rows(run)?;
    let went = |k: &usize| arcs[*k].iter().any(|arc| arc.abs() > GAP.2);
    let longest = (0..intervals.len()).filter(went).map(|k| intervals[k]).fold(0.0, f64::max);
    let usual = median(intervals)?;
    (longest > GAP.0 * usual && longest > GAP.1).then_some((longest, usual))
}

/// How far the wheels go between two times, the mean of both sides \[m\].
pub(super) fn way_between(work: &Work, run: &Run, from: f64, until: f64) -> Option<f64> {
    let (time, arcs) = (&run.log()?.time, work.arcs_of_rows(run)?);
    let within = |(k, _): &(usize, &[f64; 2])| time[*k] >= from && time[k + 1] <= until;
    Some(arcs.iter().enumerate().filter(within).map(|(_, [left, right])| 0.5 * (left.abs() + right.abs())).sum())
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

/// The largest jump of a channel, far beyond all but a few of the wheel's steps, and the range of its counter, where every jump is
/// of it.
fn begins_anew(log: &EncoderLog, channel: usize) -> Option<(f64, f64)> {
    let mut sizes: Vec<f64> = differences(log, channel).map(f64::abs).collect();
    sizes.sort_by(f64::total_cmp);
    let (usual, largest) = (sizes[sizes.len() * 9 / 10], *sizes.last()?);
    if usual == 0.0 || largest <= JUMP * usual {
        return None;
    }
    let range = match log.unit {
        EncoderUnit::Ticks => largest.log2().round().exp2(),
        EncoderUnit::Radians => TAU,
    };
    let is_range = |size: f64| within(size / range, 1.0 + RANGE);
    (is_range(largest) && sizes.iter().all(|&size| size < 0.5 * range || is_range(size))).then_some((largest, range))
}

/// Suspects the runs of which a question finds what was seen and what should be, and changes them in the working copy.
fn mend(
    work: &mut Work,
    kind: SuspicionKind,
    ask: impl Fn(&Work, &Run) -> Option<(f64, f64)>,
    change: impl Fn(&mut Run),
) {
    work.ask(kind, ask).into_iter().for_each(|index| change(&mut work.data.runs[index]));
}
