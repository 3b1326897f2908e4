//! What clocks and counters do to a recording: found, told, and mended only where there is no other way to read it.

use super::finding::Finding;
use super::log::{Log, Row, usual_interval};
use super::stamp::{Nanoseconds, seconds};
use crate::dataset::EncoderUnit;
use crate::geometry::unwrap_near;
use std::f64::consts::TAU;

/// Rows farther apart than this many usual intervals, and than `LEAST_GAP`, have a gap between them.
const GAP: Nanoseconds = 10;
/// \[ns\]
const LEAST_GAP: Nanoseconds = 500_000_000;
/// No step is this many times faster than all but the fastest twentieth of steps: a wheel has inertia, and a counter
/// that turns over or begins anew moves by its whole range at once.
const IMPLAUSIBLE: f64 = 20.0;
/// What is left of a step when a counter's turn is taken off is none of the fastest, and the step itself is: then the
/// counter ran over, and did so once.
const PLAUSIBLE: f64 = 3.0;
/// Too few steps to know what is usual.
const FEW: usize = 20;

/// What counters turn over at: smallest value, number of values, its name.
const TICK_RANGES: [(f64, f64, &str); 4] = [
    (-32768.0, 65536.0, "a signed 16-bit counter"),
    (0.0, 65536.0, "a 16-bit counter"),
    (-2147483648.0, 4294967296.0, "a signed 32-bit counter"),
    (0.0, 4294967296.0, "a 32-bit counter"),
];

/// Where a recording cannot be one piece: wheels from `row` on, poses from `pose` on, belong to the next.
#[derive(Debug, Clone)]
pub(super) struct Break {
    pub(super) row: usize,
    pub(super) pose: usize,
    pub(super) why: String,
}

/// Puts a recording in order as far as that is certain, unwraps its headings, and says where it breaks.
pub(super) fn mend(log: &mut Log, findings: &mut Vec<Finding>) -> Vec<Break> {
    let name = log.name.clone();
    for (stream, count) in [("encoders", put_in_order(&mut log.wheels.rows)), ("poses", put_in_order(&mut log.poses))] {
        if count > 0 {
            findings.push(Finding::Late { log: name.clone(), stream, count });
        }
    }
    let origin = log.wheels.rows.first().map_or(0, |row| row.stamp);
    let mut found = Vec::new();
    let mut arrivals = jumps(&name, "encoders", origin, &log.wheels.rows, log.own_arrivals, &mut found);
    arrivals.extend(jumps(&name, "poses", origin, &log.poses, log.own_arrivals, &mut found));
    gaps(&name, "encoders", origin, &log.wheels.rows, &mut found);
    gaps(&name, "poses", origin, &log.poses, &mut found);
    arrivals.extend(counters(log, origin, &mut found));
    findings.extend(found);

    let mut heading = 0.0;
    for row in &mut log.poses {
        row.value.heading = unwrap_near(row.value.heading, heading);
        heading = row.value.heading;
    }
    breaks(log, arrivals)
}

/// A place where a recording breaks: when, in which stream, why.
type Place = (i64, &'static str, String);

/// One clock for both streams is set once, which each stream shows at its next reading: that is one break.
const ONE_BREAK: i64 = 1_000_000_000;

fn breaks(log: &Log, mut places: Vec<Place>) -> Vec<Break> {
    places.sort_by_key(|(arrival, ..)| *arrival);
    let mut breaks: Vec<(Place, Break)> = Vec::new();
    for place in places {
        let (arrival, stream, why) = &place;
        let row = log.wheels.rows.partition_point(|row| row.arrival < *arrival);
        let pose = log.poses.partition_point(|row| row.arrival < *arrival);
        match breaks.last_mut() {
            Some((last, known)) if *arrival - last.0 < if log.own_arrivals { ONE_BREAK } else { 1 } => {
                if *stream == "poses" && last.1 != *stream {
                    known.pose = pose;
                } else if last.1 != *stream {
                    known.row = row;
                }
            }
            _ => breaks.push((place.clone(), Break { row, pose, why: why.clone() })),
        }
    }
    breaks.into_iter().map(|(_, known)| known).collect()
}

/// Swaps readings that came one place late: the next one is ahead of all again, so no clock was set.
fn put_in_order<T>(rows: &mut [Row<T>]) -> usize {
    let mut count = 0;
    for late in 1..rows.len().saturating_sub(1) {
        let (before, now, after) = (rows[late - 1].stamp, rows[late].stamp, rows[late + 1].stamp);
        let fits = late < 2 || rows[late - 2].stamp <= now;
        if now < before && before <= after && fits {
            // Who recorded them has seen them the other way round; that order is of no use any more.
            let arrivals = [rows[late - 1].arrival, rows[late].arrival];
            rows.swap(late - 1, late);
            [rows[late - 1].arrival, rows[late].arrival] = arrivals;
            count += 1;
        }
    }
    count
}

/// Arrivals at which the clock was set.
fn jumps<T>(
    log: &str,
    stream: &'static str,
    origin: Nanoseconds,
    rows: &[Row<T>],
    own_arrivals: bool,
    findings: &mut Vec<Finding>,
) -> Vec<Place> {
    let usual = usual_interval(rows);
    let mut arrivals = Vec::new();
    for pair in rows.windows(2) {
        let step = pair[1].stamp - pair[0].stamp;
        let waited = pair[1].arrival - pair[0].arrival;
        let ahead = own_arrivals && is_gap(step, usual) && waited < step / 2;
        if step < 0 || ahead {
            let by = seconds(if own_arrivals { step - waited } else { step });
            let finding = Finding::ClockJump { log: log.to_owned(), stream, at: seconds(pair[0].stamp - origin), by };
            arrivals.push((pair[1].arrival, stream, format!("the clock of the {stream} jumps by {by:+.3} s")));
            findings.push(finding);
        }
    }
    arrivals
}

/// Whether such a step from row to row is a gap.
pub(super) fn is_gap(step: Nanoseconds, usual: Nanoseconds) -> bool {
    step > LEAST_GAP.max(GAP * usual)
}

fn gaps<T>(log: &str, stream: &'static str, origin: Nanoseconds, rows: &[Row<T>], findings: &mut Vec<Finding>) {
    let usual = usual_interval(rows);
    let steps = rows.windows(2).map(|pair| (pair[1].stamp - pair[0].stamp, pair[0].stamp));
    let gaps: Vec<(Nanoseconds, Nanoseconds)> = steps.filter(|(step, _)| is_gap(*step, usual)).collect();
    if let Some((longest, at)) = gaps.iter().max_by_key(|(step, _)| *step) {
        findings.push(Finding::Gaps {
            log: log.to_owned(),
            stream,
            count: gaps.len(),
            longest: seconds(*longest),
            at: seconds(*at - origin),
            usual: seconds(usual),
        });
    }
}

/// Mends counters that ran over; arrivals at which one jumped in a way that only a restart explains.
fn counters(log: &mut Log, origin: Nanoseconds, findings: &mut Vec<Finding>) -> Vec<Place> {
    let usual = usual_interval(&log.wheels.rows).max(1);
    let rows = &mut log.wheels.rows;
    let mut arrivals = Vec::new();
    for (channel, column) in log.wheels.channels.iter().enumerate() {
        let range = range(rows.iter().map(|row| row.value[channel]), log.wheels.unit);
        // The shorter way round, where a counter may have run over.
        let folded = |step: f64| match range {
            Some((modulus, _)) if step.abs() > 0.5 * modulus => step - modulus * step.signum(),
            _ => step,
        };
        let duration = |before: &Row<Vec<f64>>, after: &Row<Vec<f64>>| seconds((after.stamp - before.stamp).max(usual));
        let mut rates: Vec<f64> = rows
            .windows(2)
            .map(|pair| folded(pair[1].value[channel] - pair[0].value[channel]).abs() / duration(&pair[0], &pair[1]))
            .filter(|rate| *rate > 0.0)
            .collect();
        if rates.len() < FEW {
            continue;
        }
        rates.sort_by(f64::total_cmp);
        let fast = rates[rates.len() * 19 / 20];
        let mut carried = 0.0;
        let mut wraps = (0, 0);
        let mut before = rows[0].value[channel];
        for index in 1..rows.len() {
            let now = rows[index].value[channel];
            let (step, usual) = (now - before, fast * duration(&rows[index - 1], &rows[index]));
            let mended = folded(step);
            if mended != step && mended.abs() <= PLAUSIBLE * usual && step.abs() > PLAUSIBLE * usual {
                carried += mended - step;
                wraps = (wraps.0 + 1, if wraps.0 == 0 { index } else { wraps.1 });
            } else if mended != step || step.abs() > IMPLAUSIBLE * usual {
                let at = seconds(rows[index].stamp - origin);
                let why = format!("counter `{column}` jumps from {before} to {now} at {at:.3} s");
                arrivals.push((rows[index].arrival, "encoders", why));
                let (log, channel) = (log.name.clone(), column.clone());
                findings.push(Finding::Reset { log, channel, at, from: before, to: now });
            }
            before = now;
            rows[index].value[channel] = now + carried;
        }
        if let (count @ 1.., first) = wraps {
            findings.push(Finding::Wrapped {
                log: log.name.clone(),
                channel: column.clone(),
                count,
                at: seconds(rows[first].stamp - origin),
                range: range.map_or("", |(_, name)| name),
            });
        }
    }
    arrivals
}

/// The smallest range that holds every value: its number of values and its name. Ticks are whole; angles may be those
/// of a joint that only knows where in its turn it is.
fn range(values: impl Iterator<Item = f64> + Clone, unit: EncoderUnit) -> Option<(f64, &'static str)> {
    let within = |least: f64, size: f64| values.clone().all(|value| value >= least && value < least + size);
    match unit {
        EncoderUnit::Ticks => values
            .clone()
            .all(|value| value.fract() == 0.0)
            .then(|| TICK_RANGES.into_iter().find(|(least, size, _)| within(*least, *size)))
            .flatten()
            .map(|(_, size, name)| (size, name)),
        EncoderUnit::Radians => {
            // A turn written with few decimals may read as a hair more than a turn.
            let slack = 1e-3;
            [-0.5 * TAU, 0.0]
                .into_iter()
                .any(|least| within(least - slack, TAU + 2.0 * slack))
                .then_some((TAU, "an angle within one turn"))
        }
    }
}
