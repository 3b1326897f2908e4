//! What was driven, told from the dead-reckoned path: a square, a straight, a spin, a circle; else a path.

use crate::dataset::{Protocol, Rotation, Travel};
use crate::geometry::Pose2;
use crate::odometry::OdometryParameters;
use std::f64::consts::{FRAC_PI_2, TAU};

/// A turn on the spot that a believed odometry closes is off by no more: 20 degrees \[rad\].
const TURN: f64 = 0.35;
/// Sides of one square differ from their mean by no more, as a part of it.
const SIDE: f64 = 0.1;
/// A straight's heading strays by no more on the way \[rad\].
const STRAY: f64 = 0.15;
/// A circle's heading strays from its share of the turn by no more: a part of the turn, and \[rad\].
const CIRCLE: (f64, f64) = (0.03, 0.15);
/// Less than this is no turn of a spin and no circle \[rad\].
const LEAST_TURN: f64 = 1.0;
/// Sizes that differ by no more are of the same nominal size, as a part of it.
const SAME: f64 = 0.05;
/// A nominal size that was given holds for what the odometry measured within this part of it: a controller that stops
/// short, radii that are believed wrong.
const GIVEN: f64 = 0.25;

/// Part of a path, driven along or turned on the spot.
#[derive(Debug, Clone, Copy)]
struct Piece {
    on_the_spot: bool,
    /// Signed \[m\].
    way: f64,
    /// \[rad\]
    turn: f64,
}

/// What the wheels drove, sizes as dead reckoning has them: `wheels` is the accumulated rotation of the left and right
/// wheels \[rad\].
pub(super) fn recognise(wheels: &[[f64; 2]], odometry: &OdometryParameters) -> Protocol {
    let mut pose = Pose2::IDENTITY;
    let mut way = 0.0;
    let mut farthest: f64 = 0.0;
    let mut track = vec![(0.0, 0.0)];
    let mut pieces: Vec<Piece> = Vec::new();
    for pair in wheels.windows(2) {
        let before = pose;
        let (left, right) = (pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]);
        pose = odometry.advance(pose, left, right);
        let step = 0.5 * (left * odometry.left_wheel_radius + right * odometry.right_wheel_radius);
        let turn = pose.heading - before.heading;
        way += step.abs();
        farthest = farthest.max(pose.distance(Pose2::IDENTITY));
        track.push((way, pose.heading));
        if step != 0.0 || turn != 0.0 {
            let on_the_spot = 0.5 * turn.abs() * odometry.track_width > step.abs();
            add(&mut pieces, Piece { on_the_spot, way: step, turn });
        }
    }
    let pieces = merged(&pieces, odometry.track_width);
    let turn = pose.heading;
    let direction = if turn > 0.0 { Rotation::CounterClockwise } else { Rotation::Clockwise };
    if let Some(side) = square(&pieces, turn) {
        return Protocol::Square { side, direction };
    }
    if turn.abs() > LEAST_TURN && farthest < 0.25 * odometry.track_width {
        return Protocol::Spin { turn: turn.abs(), direction };
    }
    let net = pieces.iter().map(|piece| piece.way).sum::<f64>();
    let one_way = net.abs() > 0.98 * way;
    let distance = pose.distance(Pose2::IDENTITY);
    if one_way
        && track.iter().all(|(_, heading)| heading.abs() < STRAY)
        && distance > (0.98 * way).max(odometry.track_width)
    {
        let direction = if net > 0.0 { Travel::Forward } else { Travel::Reverse };
        return Protocol::Straight { length: distance, direction };
    }
    // Along a circle the heading grows with the way.
    let strays = CIRCLE.0 * turn.abs() + CIRCLE.1;
    let even = track.iter().all(|(along, heading)| (heading - turn * along / way).abs() < strays);
    if net > 0.98 * way && turn.abs() > LEAST_TURN && even {
        return Protocol::Circle { radius: way / turn.abs(), turn: None, direction };
    }
    Protocol::Path
}

fn add(pieces: &mut Vec<Piece>, piece: Piece) {
    match pieces.last_mut().filter(|last| last.on_the_spot == piece.on_the_spot) {
        Some(last) => {
            last.way += piece.way;
            last.turn += piece.turn;
        }
        None => pieces.push(piece),
    }
}

/// Without the flicker between ticks: what is too short to be a side or a corner belongs to what it is part of.
fn merged(pieces: &[Piece], track_width: f64) -> Vec<Piece> {
    let mut merged: Vec<Piece> = Vec::new();
    for piece in pieces {
        let small = if piece.on_the_spot { piece.turn.abs() < 0.2 } else { piece.way.abs() < 0.25 * track_width };
        match merged.last_mut() {
            Some(last) if small => {
                last.way += piece.way;
                last.turn += piece.turn;
            }
            None if small => {}
            _ => add(&mut merged, *piece),
        }
    }
    merged
}

/// The mean side, if these are four straights of one length, each followed by a quarter turn of one sense.
fn square(pieces: &[Piece], turn: f64) -> Option<f64> {
    let alternate = pieces.iter().enumerate().all(|(index, piece)| piece.on_the_spot == (index % 2 == 1));
    if pieces.len() != 8 || !alternate || (turn.abs() - TAU).abs() > TURN {
        return None;
    }
    let sides: Vec<f64> = pieces.iter().step_by(2).map(|piece| piece.way).collect();
    let mean = sides.iter().sum::<f64>() / 4.0;
    let even = mean > 0.0 && sides.iter().all(|side| (side - mean).abs() < SIDE * mean);
    let quarter = |piece: &Piece| (piece.turn * turn.signum() - FRAC_PI_2).abs() < TURN;
    let straight = pieces.iter().step_by(2).all(|piece| piece.turn.abs() < TURN);
    (even && straight && pieces.iter().skip(1).step_by(2).all(quarter)).then_some(mean)
}

/// Sizes as somebody meant them: a given one where it fits, else the mean of those alike, rounded to a centimetre; and
/// turns of spins as quarter turns where they are near. What was measured stays in the logs.
pub(super) fn as_meant(driven: &[Protocol], sides: &[f64], radii: &[f64]) -> Vec<Protocol> {
    let sizes = |kind: &str| {
        let mut sizes: Vec<f64> = driven.iter().filter(|one| one.kind() == kind).filter_map(Protocol::size).collect();
        sizes.sort_by(f64::total_cmp);
        sizes
    };
    let meant = |size: f64, kind: &str, given: &[f64]| {
        let nearest = given.iter().copied().min_by(|one, other| (one - size).abs().total_cmp(&(other - size).abs()));
        if let Some(nearest) = nearest.filter(|nearest| (nearest - size).abs() < GIVEN * nearest) {
            return nearest;
        }
        let all = sizes(kind);
        let alike = all
            .chunk_by(|one, next| next / one < 1.0 + SAME)
            .find(|alike| alike.contains(&size))
            .unwrap_or(std::slice::from_ref(&size));
        let mean = alike.iter().sum::<f64>() / alike.len() as f64;
        let unit = if mean >= 0.1 { 100.0 } else { 1000.0 };
        ((mean * unit).round() / unit).max(1.0 / unit)
    };
    let settle = |protocol: &Protocol| match *protocol {
        Protocol::Square { side, direction } => Protocol::Square { side: meant(side, "square", sides), direction },
        Protocol::Straight { length, direction } => {
            Protocol::Straight { length: meant(length, "straight", sides), direction }
        }
        Protocol::Circle { radius, turn, direction } => {
            Protocol::Circle { radius: meant(radius, "circle", radii), turn, direction }
        }
        Protocol::Spin { turn, direction } => {
            let quarters = (turn / FRAC_PI_2).round() * FRAC_PI_2;
            let near = (turn - quarters).abs() < 0.03 * turn;
            Protocol::Spin { turn: if near { quarters } else { (turn * 1e3).round() / 1e3 }, direction }
        }
        Protocol::Path => Protocol::Path,
    };
    driven.iter().map(settle).collect()
}
