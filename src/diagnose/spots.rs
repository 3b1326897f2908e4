//! Where a slippery spot on the floor could lie so that it shows: on the path, under a robot that turns.
//!
//! A spot has no small size that could be looked for first and followed: elsewhere it is another cause. So it is simulated
//! at places along the nominal path, each of which is a candidate; about the best of them the search goes on more finely.

use super::case::{Case, Cluster};
use super::variant::Variant;
use super::way::{Way, compose};
use crate::dataset::Protocol;
use crate::effect::{Effect, Prior};
use crate::geometry::Pose2;
use crate::scene::{Scene, SpottedFloor};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Distance of the first candidates along a path \[m\]. Where a robot turns on the spot, a few centimetres decide which of its
/// wheels are in a spot, and what that does changes about evenly from one of these places to the next. Along a bend wheels
/// pass through, and half a spot's radius will do.
const SPACING: f64 = 0.05;
const ALONG_A_BEND: f64 = 0.15;
/// Turn in a step of the way from which on wheels scrub \[rad\]; a step takes 0.1 s.
const TURNS: f64 = 0.01;
/// How far beyond its reach a spot is noticed: a patch has a length, and a robot moves while nobody looks \[m\].
const EDGE: f64 = 0.06;
/// Distances from a leading place at which spots are tried round by round \[m\]: first up to the next candidates, then in
/// halves, to 2 mm.
pub(super) const CLOSER: [&[f64]; 4] = [&[0.0125, 0.025, 0.0375, 0.075], &[0.006_25], &[0.003_125], &[0.001_562]];
/// How far a run strays from the one that stands for it by where it comes upon a spot \[m\]: 2.5 mrad of a corner make 5 mm over
/// 2 m and 10 mm over 4 m.
pub(super) const STRAY: f64 = 0.01;
/// Share of that distance by which a place has to be away from all that are known.
const APART: f64 = 0.4;

/// Places on the nominal paths of the runs where a spot would show \[m\], in the room.
pub(super) fn places(scene: &Scene, cases: &[Case], clusters: &[Cluster], ways: &[Way]) -> Vec<[f64; 2]> {
    let mut places: Vec<[f64; 2]> = Vec::new();
    if scene.floor.plane.is_none() {
        return places;
    }
    // A spot on the straight of one run may lie where another turns.
    let shows = |place| clusters.iter().any(|cluster| touches(scene, &ways[cluster.reference], place));
    for cluster in clusters {
        let case = &cases[cluster.reference];
        let spacing = if let Protocol::Circle { .. } = case.run.protocol { ALONG_A_BEND } else { SPACING };
        for place in nominal(case, ways[cluster.reference].start, spacing) {
            if places.iter().all(|known| distance(*known, place) > 0.5 * spacing) && shows(place) {
                places.push(place);
            }
        }
    }
    places
}

/// Places on the nominal paths at a distance \[m\] from `place` that are not `known`.
pub(super) fn near(
    place: [f64; 2],
    wanted: f64,
    known: &[[f64; 2]],
    (cases, clusters, ways): (&[Case], &[Cluster], &[Way]),
) -> Vec<[f64; 2]> {
    let mut near: Vec<[f64; 2]> = Vec::new();
    let is_new = |other: [f64; 2]| known.iter().all(|known| distance(*known, other) > APART * wanted);
    for cluster in clusters {
        for other in nominal(&cases[cluster.reference], ways[cluster.reference].start, 0.25 * wanted) {
            let away = distance(place, other);
            let is_apart = |other| near.iter().all(|near| distance(*near, other) > 0.5 * wanted);
            if (away - wanted).abs() < 0.13 * wanted && is_new(other) && is_apart(other) {
                near.push(other);
            }
        }
    }
    near
}

/// How large a spot at a third `place` is likely to be, after two of them: grip and place trade off against one another along
/// a line, as far as the farther of the two is away.
pub(super) fn continued(from: ([f64; 2], f64), beside: ([f64; 2], f64), place: [f64; 2]) -> f64 {
    let apart = [0, 1].map(|k| beside.0[k] - from.0[k]);
    let along =
        [0, 1].map(|k| apart[k] * (place[k] - from.0[k])).iter().sum::<f64>() / distance(from.0, beside.0).powi(2);
    from.1 + (beside.1 - from.1) * along.clamp(-1.0, 1.0)
}

/// How far a spot is from the nearest other one that was tried \[m\]; 1 of another variant.
pub(super) fn room(variants: &[Variant], index: usize) -> f64 {
    let Some(place) = variants[index].place() else { return 1.0 };
    let others = variants.iter().enumerate().filter(|(other, _)| *other != index).filter_map(|(_, it)| it.place());
    others.map(|other| distance(place, other)).fold(1.0, f64::min)
}

/// How far from a spot's middle the base of a robot is at most of which a wheel is in it \[m\].
fn reach(scene: &Scene) -> f64 {
    let effect = Effect::named("floor_grip_patch").expect("it is in the catalogue");
    let radius = effect.parameters.iter().find_map(|parameter| match parameter.prior {
        Prior::Known(radius) => Some(radius),
        _ => None,
    });
    let arm =
        scene.robot.wheels.iter().map(|wheel| wheel.base_from_wheel.translation.vector.xy().norm()).fold(0.0, f64::max);
    radius.unwrap_or(0.0) + arm
}

/// The floor of `scene`, in which there is a spot at `place`.
pub(super) fn spotted(scene: &Scene, place: [f64; 2]) -> SpottedFloor {
    SpottedFloor { regions: scene.floor.regions.clone(), place, reach: reach(scene) + EDGE }
}

/// Whether wheels that scrub come upon a spot at `place`.
pub(super) fn touches(scene: &Scene, way: &Way, place: [f64; 2]) -> bool {
    let reach = reach(scene);
    compose(way.start, &way.steps)
        .iter()
        .zip(&way.steps)
        .any(|(pose, step)| step[2].abs() > TURNS && distance([pose.x, pose.y], place) < reach)
}

pub(super) fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// The nominal path of a run that begins at `start`, a point every `spacing` \[m\] or less, corners among them; nothing for a
/// path without a shape.
fn nominal(case: &Case, start: Pose2, spacing: f64) -> Vec<[f64; 2]> {
    let straight = |from: Pose2, length: f64| -> Vec<Pose2> {
        let parts = (length.abs() / spacing).ceil().max(1.0) as usize;
        (0..=parts).map(|k| from.moved(length * k as f64 / parts as f64, 0.0, 0.0)).collect()
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
