//! Encoder logs and what turns them into ways: signs, radii, ticks, track, sides.

use super::SuspicionKind::{
    CountSignBoth, CountSignLeft, CountSignRight, SideLength, TicksPerRevolution, TrackWidth, WheelRadius,
};
use super::{FACTOR, SuspicionKind, TRACK_FACTOR, Work, label, median, stated_turn, stated_way, within};
use crate::dataset::{DriveKind, EncoderLog, EncoderUnit, Protocol};

/// What `[odometry]` states against the nominal facts of `[robot]`.
pub(super) fn against_nominal(work: &mut Work) {
    let robot = work.data.campaign.robot.clone();
    let Some(odometry) = work.data.campaign.odometry else { return };
    let mean = 0.5 * (odometry.left_wheel_radius + odometry.right_wheel_radius);
    let nominal = robot.nominal_wheel_diameter.map(|diameter| 0.5 * diameter);
    // The two wheels of a robot that drives squares at all are alike; nominal and believed differ by wear and squash.
    let reference = nominal.unwrap_or(mean);
    let worst = [odometry.left_wheel_radius, odometry.right_wheel_radius]
        .into_iter()
        .max_by(|one, other| (one / reference).ln().abs().total_cmp(&(other / reference).ln().abs()));
    let unlike = !within(odometry.left_wheel_radius / odometry.right_wheel_radius, FACTOR);
    if let Some(radius) = worst.filter(|radius| unlike || !within(radius / reference, FACTOR)) {
        let other = odometry.left_wheel_radius + odometry.right_wheel_radius - radius;
        let fits = nominal.unwrap_or(other);
        work.suspect(WheelRadius, &[], radius, fits);
        work.logs_exact = false;
        if let Some(mended) = &mut work.odometry {
            (mended.left_wheel_radius, mended.right_wheel_radius) = (fits, fits);
        }
    }
    if let Some(width) = robot.nominal_track_width {
        let ratio = odometry.track_width / width;
        // A belief is wider than the robot by the scrub of skid steering; it is not narrower by more than a contact's
        // width, and without skid steering there is no scrub.
        let widest = if robot.drive == Some(DriveKind::Differential) { FACTOR } else { TRACK_FACTOR };
        if ratio < 1.0 / FACTOR || ratio > widest {
            work.suspect(TrackWidth, &[], odometry.track_width, width);
            work.logs_exact = false;
            if let Some(mended) = &mut work.odometry {
                mended.track_width = width;
            }
        }
    }
    if let (Some(believed), Some(nominal)) = (odometry.ticks_per_revolution, robot.ticks_per_revolution)
        && !within(believed / nominal, FACTOR)
    {
        work.suspect(TicksPerRevolution, &[], believed, nominal);
        work.logs_exact = false;
        if let Some(mended) = &mut work.odometry {
            mended.ticks_per_revolution = Some(nominal);
        }
    }
}

/// Encoders that count down where their wheels go forward, by which wheels have to go forward in each protocol.
pub(super) fn count_signs(work: &mut Work) {
    let Some(odometry) = work.odometry else { return };
    let mut wrong: [Vec<usize>; 3] = Default::default();
    let mut evidence = [None; 3];
    for (index, run) in work.data.runs.iter().enumerate() {
        let Some([left, right]) = work.arcs(run) else { continue };
        // Net ways of the two sides that the protocol calls for, as far as it does.
        let turned = stated_turn(&run.protocol).zip(label(&run.protocol)).map(|(turn, sign)| 0.5 * turn * sign);
        let arc = turned.map_or(0.0, |turned| turned * odometry.track_width);
        // The sign of a straight is asked for by `senses::travel`.
        let Some(way) = stated_way(&run.protocol) else { continue };
        let expected = [way - arc, way + arc];
        // Both signs must be sure: the smaller expected way at least a third of the larger (else a wrong track or a
        // wheel that slips could turn it round), and each logged way at least a tenth of the other.
        let sure = |[one, other]: [f64; 2], part: f64| one.abs().min(other.abs()) > part * one.abs().max(other.abs());
        if !sure(expected, 1.0 / 3.0) || !sure([left, right], 0.1) {
            continue;
        }
        let agree = [left * expected[0] > 0.0, right * expected[1] > 0.0];
        let kind = match (agree, &run.protocol) {
            ([false, true], _) => 0,
            ([true, false], _) => 1,
            // On the spot this is a turn the other way, on a straight a drive the other way: other witnesses are asked.
            ([false, false], Protocol::Square { .. } | Protocol::Circle { .. }) => 2,
            _ => continue,
        };
        wrong[kind].push(index);
        evidence[kind].get_or_insert(match kind {
            0 => (left, expected[0]),
            1 => (right, expected[1]),
            _ => (0.5 * (left + right), way),
        });
    }
    paths(work, &mut wrong, &mut evidence);
    let kinds: [(SuspicionKind, &[&str]); 3] =
        [(CountSignLeft, &["left"]), (CountSignRight, &["right"]), (CountSignBoth, &["left", "right"])];
    for (slot, (kind, sides)) in kinds.into_iter().enumerate() {
        let Some((seen, expected)) = evidence[slot] else { continue };
        work.suspect(kind, &wrong[slot], seen, expected);
        for &index in &wrong[slot] {
            if let Some(log) = &mut work.data.runs[index].encoders {
                for side in sides {
                    negate(log, side);
                }
            }
        }
    }
}

/// Paths have no label; but over all of them the surveyed heading is c_R·(right way) + c_L·(left way) with c_R = 1/b and
/// c_L = −1/b [Antonelli et al. 2005], linear whatever the path. Coefficients of one sign are a wrong count sign.
fn paths(work: &Work, wrong: &mut [Vec<usize>; 3], evidence: &mut [Option<(f64, f64)>; 3]) {
    let Some((runs, [c_left, c_right])) = heading_on_ways(work) else { return };
    // The smaller must be clear of zero; true ones are equal in size.
    if c_left.abs().min(c_right.abs()) < 0.25 * c_left.abs().max(c_right.abs()) || c_left * c_right < 0.0 {
        return;
    }
    let kind = if c_left > 0.0 { 0 } else { 1 };
    if let Some(&(_, [left, right], _)) = runs.first() {
        evidence[kind].get_or_insert(if kind == 0 { (left, -left) } else { (right, -right) });
    }
    wrong[kind].extend(runs.iter().map(|(index, ..)| *index));
    wrong[kind].sort_unstable();
}

/// A path with its index, the net ways of its sides and its surveyed turn.
type PathRun = (usize, [f64; 2], f64);

/// The paths that have logs and headings, and the two coefficients; `None` where they do not fix the two.
pub(super) fn heading_on_ways(work: &Work) -> Option<(Vec<PathRun>, [f64; 2])> {
    let runs: Vec<PathRun> = work
        .data
        .runs
        .iter()
        .enumerate()
        .filter(|(_, run)| run.protocol == Protocol::Path)
        .filter_map(|(index, run)| Some((index, work.arcs(run)?, run.end?.heading?)))
        .collect();
    let (mut ll, mut lr, mut rr, mut lh, mut rh, mut hh) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (_, [left, right], heading) in &runs {
        ll += left * left;
        lr += left * right;
        rr += right * right;
        lh += left * heading;
        rh += right * heading;
        hh += heading * heading;
    }
    let determinant = ll * rr - lr * lr;
    // Five runs for two unknowns, not all of one curvature (a sine of 0.3 between the two columns).
    if runs.len() < 5 || determinant < 0.1 * ll * rr {
        return None;
    }
    let c = [(rr * lh - lr * rh) / determinant, (ll * rh - lr * lh) / determinant];
    // Four fifths of the turning has to be explained, or else it is not the wheels that turned the robot.
    let explained = (c[0] * lh + c[1] * rh) / hh;
    (explained > 0.8).then_some((runs, c))
}

/// Turns the sign of a side's counts round.
fn negate(log: &mut EncoderLog, side: &str) {
    let width = log.channels.len();
    for (channel, name) in log.channels.iter().enumerate() {
        if name.ends_with(side) {
            log.counts.iter_mut().skip(channel).step_by(width).for_each(|count| *count = -*count);
        }
    }
}

/// How far the logs say the runs went and turned, against the protocol: ticks and radii stretch both, a wrong side the
/// way alone, a wrong track the turn alone.
pub(super) fn distances(work: &mut Work) {
    let Some(odometry) = work.odometry else { return };
    let mut off: Vec<(usize, f64, bool)> = Vec::new();
    let mut turns: Vec<f64> = Vec::new();
    let mut of_turns: Vec<usize> = Vec::new();
    let mut sound = Vec::new();
    for (index, run) in work.data.runs.iter().enumerate() {
        let (Some(way), Some(turn)) = (work.logged_way(run), work.logged_turn(run)) else { continue };
        let surveyed = run.end.and_then(|end| end.heading).map(f64::abs);
        let true_turn = stated_turn(&run.protocol).or(surveyed.filter(|turn| *turn > 1.0));
        let driven = match run.protocol {
            Protocol::Square { side, .. } => Some(4.0 * side),
            Protocol::Straight { length, .. } => Some(length),
            Protocol::Circle { radius, .. } => true_turn.map(|turn| radius * turn),
            Protocol::Spin { .. } | Protocol::Path => None,
        };
        // Only a turn that was really surveyed or stated says something about the track.
        let t = true_turn.map(|true_turn| turn.abs() / true_turn);
        let q = driven.map(|driven| way.abs() / driven);
        match q {
            Some(q) if !within(q, FACTOR) => {
                // Whether the turn is stretched like the way, or is right.
                let stretched = t.filter(|t| *t > 0.0).is_some_and(|t| (t / q).ln().abs() < t.ln().abs());
                off.push((index, q, stretched));
            }
            Some(_) => sound.push(index),
            None => {}
        }
        if let Some(t) = t.filter(|_| q.is_none_or(|q| within(q, FACTOR))) {
            turns.push(t);
            of_turns.push(index);
        }
    }
    let global = off.iter().any(|(_, _, stretched)| *stretched)
        || (sound.is_empty() && off.len() > 1 && all_straights(work, &off));
    if global {
        // Straights turn nothing; they go with the rest.
        let factor = median(off.iter().map(|(_, q, _)| *q)).unwrap_or(1.0);
        let indices: Vec<usize> = off.iter().map(|(index, ..)| *index).collect();
        let ticks = odometry.ticks_per_revolution.filter(|_| counts_ticks(work));
        let kind: SuspicionKind = if ticks.is_some() { TicksPerRevolution } else { WheelRadius };
        match ticks {
            Some(ticks) => work.suspect(kind, &indices, ticks, ticks * factor),
            None => work.suspect(kind, &indices, odometry.left_wheel_radius, odometry.left_wheel_radius / factor),
        }
        work.logs_exact = false;
        if let Some(mended) = &mut work.odometry {
            mended.left_wheel_radius /= factor;
            mended.right_wheel_radius /= factor;
        }
        return;
    }
    if let Some(&(first, q, _)) = off.first() {
        let stated = super::stated_length(&work.data.runs[first].protocol).unwrap_or(0.0);
        let indices: Vec<usize> = off.iter().map(|(index, ..)| *index).collect();
        work.suspect(SideLength, &indices, stated, stated * q);
        for (index, q, _) in off {
            match &mut work.data.runs[index].protocol {
                Protocol::Square { side: length, .. }
                | Protocol::Straight { length, .. }
                | Protocol::Circle { radius: length, .. } => *length *= q,
                Protocol::Spin { .. } | Protocol::Path => {}
            }
        }
    }
    let differential = work.data.campaign.robot.drive == Some(DriveKind::Differential);
    let bound = if differential { FACTOR } else { TRACK_FACTOR };
    let suspected = work.found.iter().any(|found| found.kind == TrackWidth);
    if let Some(t) = median(turns).filter(|t| !within(*t, bound) && !suspected) {
        work.suspect(TrackWidth, &of_turns, odometry.track_width, odometry.track_width * t);
        work.logs_exact = false;
    }
}

/// Whether these are straights, whose survey agrees with what they state: then it is the logs that are wrong.
fn all_straights(work: &Work, off: &[(usize, f64, bool)]) -> bool {
    off.iter().all(|(index, ..)| {
        let run = &work.data.runs[*index];
        match (run.protocol, run.end) {
            (Protocol::Straight { length, .. }, Some(end)) => within(end.x.hypot(end.y) / length, FACTOR),
            _ => false,
        }
    })
}

fn counts_ticks(work: &Work) -> bool {
    work.data.runs.iter().filter_map(|run| run.encoders.as_ref()).any(|log| log.unit == EncoderUnit::Ticks)
}
