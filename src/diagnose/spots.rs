//! Where a slippery spot on the floor could lie so that it shows: on the path, under a robot that turns.
//!
//! A spot has no small size that could be looked for first and followed: elsewhere it is another cause. So it is simulated
//! at places along the nominal path, each of which is a candidate; about the best of them the search goes on more finely.

use super::case::{Case, Cluster};
use super::way::{Way, compose};
use crate::dataset::Protocol;
use crate::effect::{Effect, Prior};
use crate::geometry::Pose2;
use crate::scene::Scene;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Distance of the first candidates along a path \[m\]: half a spot's radius.
const SPACING: f64 = 0.15;
/// Turn in a step of the way from which on wheels scrub \[rad\]; a step takes 0.1 s.
const TURNS: f64 = 0.01;
/// Distances from a leading place at which spots are tried round by round \[m\]: first all places up to the next candidates,
/// for a wheel is in a spot or out of it, and two centimetres decide; then in halves, to 1 mm.
pub(super) const ROUNDS: [&[f64]; 6] =
    [&[0.0375, 0.075, 0.1125, 0.15], &[0.01875], &[0.009_375], &[0.004_687], &[0.002_343], &[0.001_172]];

/// Places on the nominal paths of the runs where a spot would show \[m\], in the room.
pub(super) fn places(scene: &Scene, cases: &[Case], clusters: &[Cluster], ways: &[Way]) -> Vec<[f64; 2]> {
    let mut places: Vec<[f64; 2]> = Vec::new();
    if scene.floor.plane.is_none() {
        return places;
    }
    // A spot on the straight of one run may lie where another turns.
    let shows = |place| clusters.iter().any(|cluster| touches(scene, &ways[cluster.reference], place));
    for cluster in clusters {
        for place in nominal(&cases[cluster.reference], ways[cluster.reference].start, SPACING) {
            if places.iter().all(|known| distance(*known, place) > 0.5 * SPACING) && shows(place) {
                places.push(place);
            }
        }
    }
    places
}

/// Places on the nominal paths at a distance \[m\] from `place`.
pub(super) fn near(place: [f64; 2], wanted: f64, cases: &[Case], clusters: &[Cluster], ways: &[Way]) -> Vec<[f64; 2]> {
    let mut near: Vec<[f64; 2]> = Vec::new();
    for cluster in clusters {
        for other in nominal(&cases[cluster.reference], ways[cluster.reference].start, 0.25 * wanted) {
            let away = distance(place, other);
            if (away - wanted).abs() < 0.13 * wanted && near.iter().all(|known| distance(*known, other) > 0.5 * wanted)
            {
                near.push(other);
            }
        }
    }
    near
}

/// Whether wheels that scrub come upon a spot at `place`.
pub(super) fn touches(scene: &Scene, way: &Way, place: [f64; 2]) -> bool {
    let effect = Effect::named("floor_grip_patch").expect("it is in the catalogue");
    let radius = effect.parameters.iter().find_map(|parameter| match parameter.prior {
        Prior::Known(radius) => Some(radius),
        _ => None,
    });
    let arm =
        scene.robot.wheels.iter().map(|wheel| wheel.base_from_wheel.translation.vector.xy().norm()).fold(0.0, f64::max);
    let reach = radius.unwrap_or(0.0) + arm;
    compose(way.start, &way.steps)
        .iter()
        .zip(&way.steps)
        .any(|(pose, step)| step[2].abs() > TURNS && distance([pose.x, pose.y], place) < reach)
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// The nominal path of a run that begins at `start`, a point every `spacing` \[m\]; nothing for a path without a shape.
fn nominal(case: &Case, start: Pose2, spacing: f64) -> Vec<[f64; 2]> {
    let straight = |from: Pose2, length: f64| -> Vec<Pose2> {
        (0..=(length.abs() / spacing) as usize)
            .map(|k| from.moved(spacing * k as f64 * length.signum(), 0.0, 0.0))
            .collect()
    };
    let poses = match case.run.protocol {
        Protocol::Square { side, direction } => {
            let mut corner = start;
            let mut poses = Vec::new();
            for _ in 0..4 {
                poses.extend(straight(corner, side));
                corner = corner.compose(Pose2::new(side, 0.0, direction.sign() * FRAC_PI_2));
            }
            poses
        }
        Protocol::Straight { length, direction } => straight(start, direction.sign() * length),
        Protocol::Spin { .. } => vec![start],
        Protocol::Circle { radius, turn, direction } => {
            let turn = turn.unwrap_or(TAU).min(TAU);
            let points = (radius * turn / spacing) as usize;
            let each = direction.sign() * turn / points.max(1) as f64;
            (0..=points).map(|k| start.moved(radius * each.abs() * k as f64, 0.0, each * k as f64)).collect()
        }
        Protocol::Path => Vec::new(),
    };
    poses.into_iter().map(|pose| [pose.x, pose.y]).collect()
}
