//! A recording → runs: it is cut where the wheels stand still.

use super::error::ImportError;
use super::finding::Finding;
use super::log::{Log, Row, span, usual_interval};
use super::mend::Break;
use super::stamp::{Nanoseconds, seconds};
use super::{Cut, NUDGE};
use crate::geometry::Pose2;
use std::ops::Range;

/// A wheel that turns by no more stands still; an encoder on an edge flickers by a tick \[rad\].
const STILL: f64 = 0.01;
/// What a run keeps of the standstills around it, and a reading of the survey, and half of them at most: robots are often
/// carried back to the mark between runs, with wheels that stand still \[ns\].
const KEPT: Nanoseconds = 500_000_000;

/// Part of a recording that is one run.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stretch {
    /// Of the wheels.
    pub(super) rows: Range<usize>,
    /// Of the poses.
    pub(super) poses: Range<usize>,
    /// Whether it rolls as it begins, and as it ends.
    pub(super) in_motion: [bool; 2],
}

/// Cuts `log` at its breaks and standstills; `angle` is what a count of its wheels stands for \[rad\].
pub(super) fn cut(
    log: &Log,
    breaks: &[Break],
    cut: Cut,
    angle: f64,
    findings: &mut Vec<Finding>,
) -> Result<Vec<Stretch>, ImportError> {
    let rows = &log.wheels.rows;
    let mut bounds = vec![(0, 0)];
    bounds.extend(breaks.iter().map(|place| (place.row, place.pose)));
    bounds.push((rows.len(), log.poses.len()));
    let mut stretches = Vec::new();
    for pair in bounds.windows(2) {
        let (piece, poses) = (pair[0].0..pair[1].0, pair[0].1..pair[1].1);
        if piece.is_empty() {
            continue;
        }
        let runs = match cut {
            Cut::Whole => match breaks.first() {
                Some(place) => {
                    return Err(ImportError::Broken { path: log.path.clone(), why: place.why.clone() });
                }
                None => vec![piece.clone()],
            },
            Cut::Standstills { least } => between_standstills(log, piece.clone(), least, angle, findings),
        };
        for run in runs {
            let poses = while_it_lasts(&log.poses, poses.clone(), rows[run.start].stamp, rows[run.end - 1].stamp);
            let run = where_seen(log, run, &log.poses[poses.clone()], angle, findings);
            stretches.push(Stretch {
                poses,
                in_motion: [
                    moves(&rows[run.start..run.end.min(run.start + 2)], angle),
                    moves(&rows[run.start.max(run.end.saturating_sub(2))..run.end], angle),
                ],
                rows: run,
            });
        }
    }
    Ok(stretches)
}

/// Whether any wheel turns within these rows.
fn moves(rows: &[Row<Vec<f64>>], angle: f64) -> bool {
    turned(rows, angle) > still(angle)
}

/// What counts as standing still \[rad\].
fn still(angle: f64) -> f64 {
    if angle == 1.0 { STILL } else { STILL.max(2.0 * angle) }
}

/// The most that any wheel turned to and fro \[rad\].
fn turned(rows: &[Row<Vec<f64>>], angle: f64) -> f64 {
    let channels = rows.first().map_or(0, |row| row.value.len());
    let range = |channel: usize| {
        let values = || rows.iter().map(move |row| row.value[channel]);
        angle * (values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min))
    };
    (0..channels).map(range).fold(0.0, f64::max)
}

/// Poses from `first` to `last`, and half a usual interval around, so that clocks that differ by less lose none.
fn while_it_lasts<T>(poses: &[Row<T>], within: Range<usize>, first: Nanoseconds, last: Nanoseconds) -> Range<usize> {
    let piece = &poses[within.clone()];
    let slack = usual_interval(piece) / 2;
    let start = piece.partition_point(|row| row.stamp < first - slack);
    let end = piece.partition_point(|row| row.stamp <= last + slack);
    within.start + start..within.start + end.max(start)
}

/// What of a run the poses cover: a survey that begins on the way does not know the start, nor one that ends there the end.
fn where_seen(
    log: &Log,
    run: Range<usize>,
    poses: &[Row<Pose2>],
    angle: f64,
    findings: &mut Vec<Finding>,
) -> Range<usize> {
    let rows = &log.wheels.rows;
    let Some([first, last]) = span(poses) else { return run };
    // Up to a reading of the wheels on either side.
    let within = &rows[run.clone()];
    let start = run.start + within.partition_point(|row| row.stamp <= first).saturating_sub(1);
    let end = (run.start + within.partition_point(|row| row.stamp < last) + 1).clamp(start + 1, run.end);
    let mut unseen = |part: Range<usize>, when| {
        let turned = turned(&rows[part.clone()], angle);
        let is_much = turned > NUDGE;
        if is_much {
            let at = |row: usize| seconds(rows[row].stamp - rows[0].stamp);
            let (from, until) = (at(part.start), at(part.end - 1));
            findings.push(Finding::Unseen { log: log.name.clone(), from, until, turned, when });
        }
        is_much
    };
    let begins_later = unseen(run.start..start + 1, "before");
    let ends_earlier = unseen(end - 1..run.end, "after");
    (if begins_later { start } else { run.start })..(if ends_earlier { end } else { run.end })
}

/// The runs between the standstills of a piece that has no break.
fn between_standstills(
    log: &Log,
    piece: Range<usize>,
    least: f64,
    angle: f64,
    findings: &mut Vec<Finding>,
) -> Vec<Range<usize>> {
    let rows = &log.wheels.rows;
    let stands = standstills(rows, piece.clone(), (least * 1e9) as Nanoseconds, angle);
    let least_kept = KEPT.max(usual_interval(&log.poses));
    let kept = |stand: &Range<usize>| least_kept.min((rows[stand.end - 1].stamp - rows[stand.start].stamp) / 2);
    // Moving parts lie before, between and after them; each part with the standstills on its two sides.
    let mut runs = Vec::new();
    for index in 0..=stands.len() {
        let before = index.checked_sub(1).map(|before| &stands[before]);
        let after = stands.get(index);
        let start = before.map_or(piece.start, |stand| {
            let since = rows[stand.end - 1].stamp - kept(stand);
            stand.start + rows[stand.clone()].partition_point(|row| row.stamp < since)
        });
        let end = after.map_or(piece.end, |stand| {
            let until = rows[stand.start].stamp + kept(stand);
            stand.start + rows[stand.clone()].partition_point(|row| row.stamp <= until)
        });
        if start >= end {
            continue;
        }
        let most = turned(&rows[start..end], angle);
        if most > NUDGE {
            runs.push(start..end);
        } else if most > still(angle) {
            let at = seconds(rows[start].stamp - rows[0].stamp);
            findings.push(Finding::Nudge { log: log.name.clone(), at, most });
        }
    }
    runs
}

/// Rows over which no wheel turned for at least `least`.
fn standstills(rows: &[Row<Vec<f64>>], piece: Range<usize>, least: Nanoseconds, angle: f64) -> Vec<Range<usize>> {
    let tolerance = still(angle) / angle;
    let mut stands = Vec::new();
    let mut first = piece.start;
    while first < piece.end {
        let here = |row: &Row<Vec<f64>>| {
            row.value.iter().zip(&rows[first].value).all(|(value, anchor)| (value - anchor).abs() <= tolerance)
        };
        let length = rows[first..piece.end].iter().take_while(|row| here(row)).count();
        let end = first + length;
        if rows[end - 1].stamp - rows[first].stamp >= least {
            stands.push(first..end);
            first = end;
        } else {
            first += 1;
        }
    }
    stands
}
