//! A caster that trails behind its pivot, against closed forms: the tractrix, its drag's lever in a spin, and the kick as a leg
//! begins with the wheel still turned aside.

use crate::rig::{ideal, ramp_to, rotation, settled, step_for};
use std::f64::consts::FRAC_PI_2;
use treadmark::scene::{GRAVITY, Scene, Swivel};
use treadmark::world::World;

/// Of the driven wheels \[m\].
const RADIUS: f64 = 0.042;
const TRAIL: f64 = 0.03;
/// Of driven wheels \[rad/s\].
const SPEED: f64 = 2.0;

/// The shipped two-wheel robot on a caster whose wheel trails, and drags by `drag` of its load.
fn on_swivel(drag: f64) -> Scene {
    let mut scene = ideal("optiodom");
    let caster = &mut scene.robot.casters[0];
    caster.swivel = Some(Swivel { trail: TRAIL, visuals: Vec::new() });
    caster.drag_coefficient = drag;
    scene
}

/// Of the pivot behind the axle \[m\].
fn behind(scene: &Scene) -> f64 {
    -scene.robot.casters[0].pivot().x
}

/// Of the fork against the chassis, in (−π, π].
fn fork_angle(world: &World) -> f64 {
    let mut forks = Vec::new();
    world.forks(&mut forks);
    (world.base().rotation.inverse() * forks[0].rotation).euler_angles().2
}

/// A world that has turned left on the spot until its caster trails.
fn turned_left(scene: &Scene) -> World {
    let mut world = settled(scene);
    ramp_to(&mut world, -SPEED, SPEED);
    step_for(&mut world, 6.0);
    world
}

/// In a spin the contact goes round on the circle that its wheel is tangent to: sin α = t/d between wheel and the pivot's way.
/// On a straight it swings back by tan(α/2) ∝ e^(−x/t). The angle is stepped explicitly: by half of what a step goes over the
/// trail of each e-fold.
#[test]
fn it_trails_as_a_tractrix() {
    let scene = on_swivel(0.0);
    let mut world = turned_left(&scene);
    let expected = -FRAC_PI_2 - (TRAIL / behind(&scene)).asin();
    assert!((fork_angle(&world) - expected).abs() < 2e-3, "{} of {expected}", fork_angle(&world));

    ramp_to(&mut world, 0.0, 0.0);
    ramp_to(&mut world, SPEED, SPEED);
    // Against the leg: speed loops wiggle the chassis by a milliradian.
    let leg = world.pose().heading;
    let place = |world: &World| {
        let angle = fork_angle(world) + world.pose().heading - leg;
        (world.pose(), (0.5 * angle).tan().abs().ln())
    };
    let (start, first) = place(&world);
    let allowed = 0.5 * SPEED * RADIUS * scene.time_step / TRAIL;
    // A milliradian moves the pivot aside.
    let aside = 1e-3 * behind(&scene) / TRAIL;
    for _ in 0..8 {
        step_for(&mut world, 0.1);
        let (now, found) = place(&world);
        let expected = -start.distance(now) / TRAIL;
        assert!((found - first - expected).abs() < allowed * expected.abs() + aside, "{} of {expected}", found - first);
    }
}

/// In a spin its drag pulls at the contact's own radius, √(d² − t²), where a ball's would at its distance; a drag of nothing does
/// nothing.
#[test]
fn its_drag_has_the_lever_of_its_contact() {
    // What the wheels' forces turn it by, and the load on the caster.
    let turning = |drag: f64| {
        let scene = on_swivel(drag);
        let mut world = turned_left(&scene);
        let sides: Vec<f64> = scene.robot.wheels.iter().map(|wheel| wheel.base_from_wheel.translation.y).collect();
        let (mut wheels, mut moment, mut carried) = (Vec::new(), 0.0, 0.0);
        let looks = 2000;
        for _ in 0..looks {
            step_for(&mut world, scene.time_step);
            world.wheel_snapshots(&mut wheels);
            moment += sides.iter().zip(&wheels).map(|(y, now)| -y * now.force_along).sum::<f64>() / f64::from(looks);
            carried += wheels.iter().map(|wheel| wheel.load).sum::<f64>() / f64::from(looks);
        }
        (moment, scene.robot.mass() * GRAVITY - carried)
    };
    let drag = 0.02;
    let ((free, _), (dragged, load)) = (turning(0.0), turning(drag));
    let lever = behind(&on_swivel(0.0)).powi(2) - TRAIL.powi(2);
    let expected = drag * load * lever.sqrt();
    assert!(((dragged - free) / expected - 1.0).abs() < 0.01, "{} of {expected}", dragged - free);
}

/// As a leg begins after a left turn, the wheel still lies across, and its drag turns the robot on to the right: the moment
/// F d sin α, which the tyres take with a creep of 2 F d sin α/(b² C) a metre, along a tractrix, where dx = t dα/sin α; to the
/// left while the wheel, more than across, rolls backward. What the tyres were stretched by at the stop, half a patch of the
/// creep in the turn, they give back. The wheel's load is by statics.
#[test]
fn a_leg_begins_with_a_kick() {
    // Turned beyond what wheels roll, and what that is to be.
    let leg = |drag: f64| {
        let scene = on_swivel(drag);
        let mut world = turned_left(&scene);
        ramp_to(&mut world, 0.0, 0.0);
        let (heading, angle, before) = (world.pose().heading, fork_angle(&world).abs(), rotation(&world));
        ramp_to(&mut world, SPEED, SPEED);
        step_for(&mut world, 3.0);
        let after = rotation(&world);
        let counted = (after[1] - before[1]) - (after[0] - before[0]);
        let mut wheels = Vec::new();
        world.wheel_snapshots(&mut wheels);

        let (robot, distance) = (&scene.robot, behind(&scene));
        let moment = robot.chassis.mass * robot.chassis.centre_of_mass.x * GRAVITY;
        let dragged = |angle: f64| drag * -moment / (distance + TRAIL * angle.cos());
        let parts = 1000;
        let swing = (0..parts).map(|part| angle * (f64::from(part) + 0.5) / f64::from(parts));
        let swing: f64 = swing.map(|at| dragged(at) * at.cos().signum() * TRAIL * angle / f64::from(parts)).sum();
        let half_patch = wheels[0].patch.as_ref().expect("it stands").half_length;
        let stretched = dragged(angle) * (distance.powi(2) - TRAIL.powi(2)).sqrt() * half_patch;
        let (stiffness, track) = (robot.wheels[0].tyre.slip_stiffness * wheels[0].load, robot.track_width());
        let expected = 2.0 * (stretched - distance * swing) / (track * track * stiffness);
        (world.pose().heading - heading - RADIUS * counted / track, expected)
    };
    let ((free, _), (kicked, expected)) = (leg(0.0), leg(0.05));
    assert!(expected < -1e-4 && ((kicked - free) / expected - 1.0).abs() < 0.05, "{} of {expected}", kicked - free);
}
