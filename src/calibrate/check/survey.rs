//! The survey: frame, units, axes.

use super::SuspicionKind::{
    ColumnsSwapped, HeadingDegrees, HeadingWrapped, OneAxisFlipped, PositionUnit, RoomFrame, SideLength, XAxisFlipped,
    YAxisFlipped,
};
use super::{FACTOR, TRACK_FACTOR, Work, apart, median, seen_from, share, stated_length, stated_turn, vector, within};
use crate::dataset::{Protocol, Rotation};
use crate::geometry::{Pose2, unwrap_near, wrap_angle};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A survey noise that leaves nothing to be told: half a side, half a radian.
pub(super) fn stated_noise(work: &mut Work) {
    let side = median(work.data.runs.iter().filter_map(|run| stated_length(&run.protocol)));
    if let (Some(std), Some(side)) = (work.data.campaign.survey.position_std, side)
        && std > 0.5 * side
    {
        work.suspect(PositionUnit, &[], std, 0.5 * side);
    }
    if let Some(std) = work.data.campaign.survey.heading_std.filter(|std| *std > 0.5) {
        work.suspect(HeadingDegrees, &[], std, 0.5);
    }
}

/// Ends noted in the room: seen from the start poses they are near the protocol's end, as noted they are not. Headings
/// are compared within a turn, so that nothing but the frame is asked for.
pub(super) fn room_frame(work: &mut Work) {
    let (mut runs, mut mended, mut noted, mut seen_from_start) = (Vec::new(), Vec::new(), 0.0, 0.0);
    let mut scale = 0.0;
    for (index, run) in work.data.runs.iter().enumerate() {
        let (Some(start), Some(end), Some(nominal)) = (run.start, run.end, run.protocol.nominal_end()) else {
            continue;
        };
        let length = stated_length(&run.protocol).unwrap_or(1.0);
        let from_start = seen_from(start, end);
        noted += apart(end, nominal.into(), length);
        seen_from_start += apart(from_start, nominal.into(), length);
        scale += length;
        runs.push(index);
        mended.push(from_start);
    }
    // Four times nearer, and a tenth of a side to begin with: a mean of start poses that is by chance the mean error of
    // the ends is the only other way to this.
    if noted > 4.0 * seen_from_start && noted > 0.1 * scale {
        let n = runs.len() as f64;
        work.suspect(RoomFrame, &runs, noted / n, seen_from_start / n);
        for (index, end) in runs.into_iter().zip(mended) {
            work.data.runs[index].end = Some(end);
        }
    }
}

/// Headings in degrees: 57 times the turn that was driven. Right is a ratio of about 1, up to 2.5 against logs of a
/// skid-steer robot; √(2.5 · 57) ≈ 12 is the middle in proportion.
pub(super) fn degrees(work: &mut Work) {
    let bound = (TRACK_FACTOR * 180.0 / PI).sqrt();
    let mut runs = Vec::new();
    let mut evidence = None;
    let mut of_logs = Vec::new();
    for (index, run) in work.data.runs.iter().enumerate() {
        let Some(heading) = run.end.and_then(|end| end.heading) else { continue };
        let logged = work.logged_turn(run).filter(|turn| turn.abs() > 0.3);
        match (stated_turn(&run.protocol), logged) {
            (Some(turn), _) if heading.abs() > bound * turn => {
                runs.push(index);
                evidence.get_or_insert((heading, turn));
            }
            (None, Some(turn)) => of_logs.push((index, heading, turn)),
            _ => {}
        }
    }
    // Runs without a stated turn are judged together: a single log may be of a wheel that spun.
    if median(of_logs.iter().map(|(_, heading, turn)| (heading / turn).abs())).is_some_and(|ratio| ratio > bound) {
        for (index, heading, turn) in of_logs {
            runs.push(index);
            evidence.get_or_insert((heading, turn.abs()));
        }
    }
    let Some((seen, expected)) = evidence else { return };
    runs.sort_unstable();
    work.suspect(HeadingDegrees, &runs, seen, expected);
    // A straight in the same notes is in degrees too, though it does not show it.
    let all = runs.len() * 2 > work.data.runs.len();
    for (index, run) in work.data.runs.iter_mut().enumerate() {
        if let Some(end) = run.end.as_mut().filter(|_| all || runs.contains(&index)) {
            end.heading = end.heading.map(f64::to_radians);
        }
    }
}

/// Headings brought back to one turn: the right direction, whole turns short.
pub(super) fn wrapped(work: &mut Work) {
    let mut runs: Vec<(usize, f64, f64)> = Vec::new();
    let mut candidates = Vec::new();
    let mut all_in_one_turn = true;
    for (index, run) in work.data.runs.iter().enumerate() {
        let Some(heading) = run.end.and_then(|end| end.heading) else { continue };
        match run.protocol.nominal_end().filter(|end| end.heading.abs() > 1.25 * PI) {
            Some(Pose2 { heading: nominal, .. }) => {
                all_in_one_turn &= (-0.01..TAU + 0.5).contains(&heading);
                // More than half a turn short, and within a quarter of a turn of the right direction.
                if heading.abs() < nominal.abs() - PI && wrap_angle(heading - nominal).abs() < FRAC_PI_2 {
                    runs.push((index, heading, unwrap_near(heading, nominal)));
                } else if (heading + nominal).abs() < FRAC_PI_2 {
                    candidates.push((index, heading, unwrap_near(heading, nominal)));
                }
            }
            // Without a stated turn the log tells: what a track that is wrong by its largest factor still leaves is
            // more than half a turn.
            None if matches!(run.protocol, Protocol::Circle { .. } | Protocol::Path) => {
                let logged = work.logged_turn(run).filter(|turn| turn.abs() > TRACK_FACTOR * PI);
                if let Some(turn) = logged.filter(|_| heading.abs() < 1.001 * PI) {
                    runs.push((index, heading, unwrap_near(heading, turn)));
                }
            }
            None => {}
        }
    }
    // Wrapped to 0 … 2π, a clockwise square ends near 0 or near +2π, as it happens.
    if !runs.is_empty() && all_in_one_turn {
        runs.extend(candidates);
        runs.sort_by_key(|(index, ..)| *index);
    }
    let Some(&(_, seen, expected)) = runs.first() else { return };
    let indices: Vec<usize> = runs.iter().map(|(index, ..)| *index).collect();
    work.suspect(HeadingWrapped, &indices, seen, expected);
    for (index, _, heading) in runs {
        if let Some(end) = &mut work.data.runs[index].end {
            end.heading = Some(heading);
        }
    }
}

/// Positions in millimetres or centimetres.
pub(super) fn units(work: &mut Work) {
    let squares: Vec<(usize, f64, f64)> = work
        .data
        .runs
        .iter()
        .enumerate()
        .filter_map(|(index, run)| match run.protocol {
            Protocol::Square { side, .. } => run.end.map(|end| (index, side, end.x.hypot(end.y))),
            _ => None,
        })
        .collect();
    // The largest heading error of any square: known only where all were measured, and both ways round, so that what
    // turns and what bends cannot cancel.
    let headings: Option<Vec<f64>> = squares
        .iter()
        .map(|&(index, ..)| work.end_error(&work.data.runs[index]).and_then(|error| error.heading))
        .collect();
    let both = [Rotation::Clockwise, Rotation::CounterClockwise].into_iter().all(|way| {
        squares.iter().any(|&(index, ..)| {
            matches!(work.data.runs[index].protocol, Protocol::Square { direction, .. } if direction == way)
        })
    });
    let largest = headings.filter(|_| both).map(|all| all.iter().fold(0.0_f64, |most, error| most.max(error.abs())));
    let mut runs: Vec<(usize, f64)> = Vec::new();
    let mut evidence = None;
    for (index, side, distance) in squares {
        // A robot is never farther away than it drove. Where its heading was never off by more than ε, its way 4L was
        // never off by more than 4Lε; a quarter of a side beside that is more than any slip that leaves the heading alone.
        let possible = largest.map_or(4.2 * side, |angle| (4.0 * side * angle + 0.25 * side).min(4.2 * side));
        if distance > possible {
            // In centimetres by what is left, unless that is still too far.
            let factor = if distance * 0.01 > 0.1 * side + possible * 0.25 { 1e-3 } else { 1e-2 };
            runs.push((index, factor));
            evidence.get_or_insert((distance, possible));
        }
    }
    let mut lengths: Vec<(usize, f64, f64)> = Vec::new();
    for (index, run) in work.data.runs.iter().enumerate() {
        let Some(distance) = run.end.map(|end| end.x.hypot(end.y)) else { continue };
        match run.protocol {
            Protocol::Straight { length, .. } => {
                let ratio = distance / length;
                if let Some(factor) = [1e-2, 1e-3].into_iter().find(|factor| within(ratio * factor, FACTOR)) {
                    runs.push((index, factor));
                    evidence.get_or_insert((distance, FACTOR * length));
                } else if !within(ratio, FACTOR) && run.encoders.is_none() {
                    // With a log the log has told already.
                    lengths.push((index, length, distance));
                }
            }
            // On a circle no point is farther than its diameter; half as much again for one that drifts.
            Protocol::Circle { radius, .. } if distance > 3.0 * radius => {
                runs.push((index, if distance * 0.01 > 2.0 * radius { 1e-3 } else { 1e-2 }));
                evidence.get_or_insert((distance, 3.0 * radius));
            }
            _ => {}
        }
    }
    if let Some(&(_, stated, distance)) = lengths.first() {
        let indices: Vec<usize> = lengths.iter().map(|(index, ..)| *index).collect();
        work.suspect(SideLength, &indices, stated, distance);
    }
    // A path: what was surveyed against what the wheels rolled, where the run was nearly straight.
    let paths: Vec<(usize, f64, f64)> = work
        .data
        .runs
        .iter()
        .enumerate()
        .filter(|(_, run)| run.protocol == Protocol::Path)
        .filter_map(|(index, run)| {
            let end = run.end.filter(|end| end.heading.is_some_and(|heading| heading.abs() < 0.3))?;
            let way = work.logged_way(run)?.abs();
            (way > 0.05).then(|| (index, end.x.hypot(end.y), way))
        })
        .collect();
    if let Some(ratio) = median(paths.iter().map(|(_, distance, way)| distance / way)).filter(|_| paths.len() >= 3)
        && let Some(factor) = [1e-2, 1e-3].into_iter().find(|factor| within(ratio * factor, 3.0))
    {
        evidence.get_or_insert((paths[0].1, paths[0].2));
        runs.extend(paths.iter().map(|(index, ..)| (*index, factor)));
    }
    let Some((seen, expected)) = evidence else { return };
    runs.sort_by_key(|(index, _)| *index);
    let indices: Vec<usize> = runs.iter().map(|(index, _)| *index).collect();
    work.suspect(PositionUnit, &indices, seen, expected);
    for (index, factor) in runs {
        if let Some(end) = &mut work.data.runs[index].end {
            (end.x, end.y) = (end.x * factor, end.y * factor);
        }
    }
}

/// Axes by the pattern that end points of squares make (see [`share`]).
pub(super) fn pattern(work: &mut Work) {
    let mut sides: Vec<f64> = Vec::new();
    for run in &work.data.runs {
        if let (Protocol::Square { side, .. }, Some(_)) = (run.protocol, run.end)
            && !sides.contains(&side)
        {
            sides.push(side);
        }
    }
    // Mean error of each condition, where it stands out of survey noise and scatter five-fold.
    let mut means: Vec<([f64; 3], f64)> = Vec::new();
    for side in sides {
        for direction in [Rotation::Clockwise, Rotation::CounterClockwise] {
            let errors: Vec<[f64; 3]> = work
                .data
                .runs
                .iter()
                .filter(|run| run.protocol == Protocol::Square { side, direction })
                .filter_map(|run| Some(vector(work.end_error(run)?, side)))
                .collect();
            if errors.is_empty() {
                continue;
            }
            let n = errors.len() as f64;
            let mean: [f64; 3] = std::array::from_fn(|axis| errors.iter().map(|error| error[axis]).sum::<f64>() / n);
            let survey = work.data.campaign.survey.position_std.unwrap_or(0.0);
            let spread = errors
                .iter()
                .map(|error| {
                    error.iter().zip(mean).map(|(e, m)| (e - m) * (e - m)).filter(|d| d.is_finite()).sum::<f64>()
                })
                .sum::<f64>();
            let noise = (spread / (n - 1.0).max(1.0) / n).sqrt().max(survey * (2.0 / n).sqrt());
            let size = mean.iter().filter(|m| m.is_finite()).map(|m| m * m).sum::<f64>().sqrt();
            // The pattern is of first order: half a side is √3·2Lα of α = 0.14 rad a turn, where second order comes up.
            if size > 0.5 * side {
                return;
            }
            if size > 5.0 * noise {
                means.push((mean, direction.sign()));
            }
        }
    }
    let squares = work.indices(|run| matches!(run.protocol, Protocol::Square { .. }) && run.end.is_some());
    let with_headings = means.iter().all(|(v, _)| v[2].is_finite());
    let both = means.iter().any(|(_, d)| *d > 0.0) && means.iter().any(|(_, d)| *d < 0.0);
    // Other effects than wheel size and track (an offset centre of turning, a side slip at stops) shift all ends alike;
    // both directions are needed to be sure that it is not them.
    if !both || work.found.iter().any(|found| matches!(found.kind, XAxisFlipped | YAxisFlipped | ColumnsSwapped)) {
        return;
    }
    type Turn = fn([f64; 3]) -> [f64; 3];
    let x: Turn = |v| [-v[0], v[1], v[2]];
    let y: Turn = |v| [v[0], -v[1], v[2]];
    let swap: Turn = |v| [v[1], v[0], v[2]];
    // The worst of the conditions: every one of them has to make sense.
    let worst = |turn: Turn| means.iter().map(|(v, d)| share(&[(turn(*v), *d)])).fold(1.0, f64::min);
    let as_noted = means.iter().map(|(v, d)| share(&[(*v, *d)])).fold(1.0, f64::min);
    // A wrong sign leaves a ninth, a right one all: 0.4 and 0.8 leave room for what the two parameters do not explain.
    if as_noted > 0.4 {
        return;
    }
    if with_headings {
        let fits: Vec<_> = [(XAxisFlipped, x), (YAxisFlipped, y), (ColumnsSwapped, swap)]
            .into_iter()
            .map(|(kind, turn)| (kind, worst(turn)))
            .filter(|(_, fit)| *fit > 0.8)
            .collect();
        if let [(kind, fit)] = fits[..] {
            work.suspect(kind, &squares, as_noted, fit);
            for &index in &squares {
                if let Some(end) = &mut work.data.runs[index].end {
                    match kind {
                        XAxisFlipped => end.x = -end.x,
                        YAxisFlipped => end.y = -end.y,
                        _ => (end.x, end.y) = (end.y, end.x),
                    }
                }
            }
        }
    } else if worst(x) > 0.9 && as_noted < 0.1 {
        // Without headings the two axes look the same, and the swap cannot be seen.
        work.suspect(OneAxisFlipped, &squares, as_noted, worst(x));
    }
}
