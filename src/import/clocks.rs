//! Whether wheels and poses move at the same times: clocks too far apart for a run to be cut out of both by one of them.

use super::finding::Finding;
use super::log::{Log, Row, span, usual_interval};
use super::mend::is_gap;
use super::stamp::{Nanoseconds, seconds};
use crate::geometry::Pose2;

/// A motion is seen over this many steps of the grid, so that the noise of a survey is none; half before, half after.
const OVER: usize = 10;
/// Grid on which the two motions are laid side by side \[ns\].
const GRID: Nanoseconds = 100_000_000;
/// Clocks that are no farther apart lose no part of a run; their offset is left to the diagnosis \[ns\].
const HARMLESS: Nanoseconds = 500_000_000;
/// How far apart they are looked for \[ns\].
const FARTHEST: Nanoseconds = 60_000_000_000;
/// How alike the two motions are where they belong together (correlation), and how much less so everywhere else.
const ALIKE: f64 = 0.8;
const CLEARLY: f64 = 0.1;
/// What a turn counts against a way \[m/rad\]: about half a track.
const LEVER: f64 = 0.2;

/// Brings poses to the clock of the wheels, if the two motions are plainly the same with half a second or more between
/// them, and says so. A recording in which the robot was also carried, or pushed, is left as it is.
pub(super) fn bring_together(log: &mut Log, findings: &mut Vec<Finding>) {
    let Some(lag) = lag(&log.wheels.rows, &log.poses).filter(|lag| lag.abs() > HARMLESS) else { return };
    log.poses.iter_mut().for_each(|row| row.stamp -= lag);
    findings.push(Finding::ClocksApart { log: log.name.clone(), by: seconds(lag) });
}

/// By how much later the poses move than the wheels, to the grid; `None` where that is not plain.
fn lag(wheels: &[Row<Vec<f64>>], poses: &[Row<Pose2>]) -> Option<Nanoseconds> {
    let turned = |one: &Vec<f64>, other: &Vec<f64>| one.iter().zip(other).map(|(a, b)| (a - b).abs()).sum();
    let moved = |one: &Pose2, other: &Pose2| one.distance(*other).hypot(LEVER * (one.heading - other.heading));
    let (wheels, poses) = (Motion::of(wheels, turned)?, Motion::of(poses, moved)?);
    let offset = (poses.first - wheels.first) / GRID;
    let reach = FARTHEST / GRID;
    let shorter = wheels.steps.len().min(poses.steps.len());
    let alike = |shift: Nanoseconds| {
        // Step k of the wheels beside the step of the poses that was stamped `shift` later.
        let beside = |k: usize| poses.steps.get(usize::try_from(k as i64 + shift - offset).ok()?).copied().flatten();
        correlation(wheels.steps.iter().enumerate().filter_map(|(k, step)| Some(((*step)?, beside(k)?))), shorter / 2)
    };
    let found: Vec<(Nanoseconds, f64)> =
        (-reach..=reach).filter_map(|shift| Some((shift * GRID, alike(shift)?))).collect();
    let &(lag, best) = found.iter().max_by(|(_, one), (_, other)| one.total_cmp(other))?;
    // A robot that always drives the same moves alike at many shifts; it is the right one that stands out.
    let elsewhere = found.iter().filter(|(other, _)| (other - lag).abs() > 2 * HARMLESS);
    let next = elsewhere.map(|(_, alike)| *alike).fold(0.0, f64::max);
    (best > ALIKE && best > next + CLEARLY).then_some(lag)
}

/// Pearson's, of numbers from 0 to 1; `None` of no more than `few` pairs, or where either does not vary.
fn correlation(pairs: impl Iterator<Item = (f64, f64)>, few: usize) -> Option<f64> {
    let (mut n, mut a, mut b, mut aa, mut ab, mut bb) = (0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (one, other) in pairs {
        n += 1;
        (a, b) = (a + one, b + other);
        (aa, ab, bb) = (aa + one * one, ab + one * other, bb + other * other);
    }
    let count = n as f64;
    let (aa, ab, bb) = (aa - a * a / count, ab - a * b / count, bb - b * b / count);
    (n > few && aa > 0.0 && bb > 0.0).then(|| ab / (aa * bb).sqrt())
}

/// How much something moves in each step of the grid, from 0 at rest towards 1.
struct Motion {
    first: Nanoseconds,
    /// `None` within a gap.
    steps: Vec<Option<f64>>,
}

impl Motion {
    /// Of readings and how far two of them are apart; `None` of fewer than two, or of what never moves.
    fn of<T>(rows: &[Row<T>], apart: impl Fn(&T, &T) -> f64) -> Option<Motion> {
        let [from, until] = span(rows)?;
        // On whole steps of the clock, so that two motions lie on one grid.
        let first = from.div_euclid(GRID) + 1;
        let count = usize::try_from(until.div_euclid(GRID) - first).ok().filter(|count| *count > 0)?;
        let usual = usual_interval(rows);
        let mut at = 0;
        let mut nearest = |time: Nanoseconds| {
            while rows.get(at + 1).is_some_and(|next| next.stamp <= time) {
                at += 1;
            }
            let next = rows.get(at + 1)?;
            (!is_gap(next.stamp - rows[at].stamp, usual)).then_some(at)
        };
        let marks: Vec<Option<usize>> = (0..=count).map(|k| nearest((first + k as i64) * GRID)).collect();
        let mut steps: Vec<Option<f64>> =
            marks.windows(OVER + 1).map(|span| Some(apart(&rows[span[0]?].value, &rows[span[OVER]?].value))).collect();
        // What is usual in motion: of a fast robot that is carried slowly, or a slow one that is carried fast, both count alike.
        let mut sizes: Vec<f64> = steps.iter().flatten().copied().collect();
        sizes.sort_by(f64::total_cmp);
        let largest = *sizes.get(sizes.len().checked_sub(1)? * 19 / 20)?;
        let moving = &sizes[sizes.partition_point(|size| *size < 0.1 * largest)..];
        let usual = *moving.get(moving.len() / 2).filter(|usual| **usual > 0.0)?;
        steps.iter_mut().flatten().for_each(|size| *size /= *size + usual);
        Some(Motion { first: first * GRID, steps })
    }
}
