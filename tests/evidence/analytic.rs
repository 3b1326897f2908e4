//! Closed forms and limits. Each test says where its tolerance comes from.

use crate::quasi_static;
use crate::rig::{ideal, ramp_to, rolling_radius, rotation, run, settled, step_for, track_factor_in_spin, tyre};
use std::f64::consts::FRAC_PI_2;
use treadmark::dataset::{Protocol, Rotation, Travel};
use treadmark::geometry::Pose2;
use treadmark::odometry::OdometryCorrection;
use treadmark::scene::{GRAVITY, Scene, Side};
use treadmark::world::{Patch, PatchMotion};

/// Steady pure side slip is Pacejka's brush model: F = μN(1 − (1 − θ)³) with θ = C·tan α/(3μN) below full sliding
/// [Pacejka, *Tyre and Vehicle Dynamics*, eqs 3.6–3.11]. A cell carries the deflection of its leaving edge, half a cell
/// (1/16 of the patch) late; where part of the patch slides that is worth up to 3 % of μN.
#[test]
fn patch_in_side_slip_is_the_brush_model() {
    let (tyre, load, speed) = (tyre(0.8, 0.8), 60.0, 0.4);
    for slip in [0.001, 0.01, 0.03, 0.06, 0.1, 0.16, 0.3] {
        let mut patch = Patch::default();
        let motion = PatchMotion { slip_along: 0.0, slip_across: slip * speed, spin: 0.0, rolling: speed };
        let mut force = Default::default();
        for _ in 0..2000 {
            force = patch.advance(&tyre, load, tyre.squash(load), 1.0, &motion, 1e-3);
        }
        let limit = tyre.friction_across * load;
        let theta = (tyre.slip_stiffness * load * slip / (3.0 * limit)).min(1.0);
        let brush = limit * (1.0 - (1.0 - theta).powi(3));
        assert!((-force.across - brush).abs() < 0.03 * limit, "slip {slip}: {} against {brush}", -force.across);
        // The limit of small slip is exact by the choice of the bristles' stiffness: 2 % of the force itself.
        if slip == 0.001 {
            assert!((-force.across / (tyre.slip_stiffness * load * slip) - 1.0).abs() < 0.02);
        }
    }
}

/// A patch that slides all over pulls with μN against the slip, whatever the direction.
#[test]
fn patch_in_full_sliding_is_coulomb() {
    let (tyre, load) = (tyre(0.8, 0.8), 60.0);
    for angle in [0.0f64, 0.7, 2.0, -1.2] {
        let mut patch = Patch::default();
        let slip = 0.5;
        let motion =
            PatchMotion { slip_along: slip * angle.cos(), slip_across: slip * angle.sin(), spin: 0.0, rolling: 0.0 };
        let mut force = Default::default();
        for _ in 0..100 {
            force = patch.advance(&tyre, load, tyre.squash(load), 1.0, &motion, 1e-3);
        }
        let limit = tyre.friction_along * load;
        assert!((force.along + limit * angle.cos()).abs() < 1e-9 * limit);
        assert!((force.across + limit * angle.sin()).abs() < 1e-9 * limit);
    }
}

/// In the limit of a hard, narrow tyre four equally loaded wheels have b_eff/b = 1 + (l/b)² for any isotropic friction
/// (science note 2), here within 0.1 %: width and length of the patch, 2 mm and 5 mm, are worth 0.01 %.
#[test]
fn spin_of_hard_narrow_tyres_is_the_closed_form() {
    for ratio in [0.4, 0.6, 0.9, 1.2] {
        let mut scene = ideal("jnpf_4wd");
        let half = 0.5 * ratio * scene.robot.track_width();
        for wheel in &mut scene.robot.wheels {
            wheel.base_from_wheel.translation.x = half.copysign(wheel.base_from_wheel.translation.x);
            wheel.tyre.width = 0.002;
            wheel.tyre.vertical_stiffness = 2e6;
            wheel.tyre.vertical_damping = 2e3;
        }
        scene.time_step = 0.5e-3;
        let factor = track_factor_in_spin(&scene, 2.5);
        let theory = 1.0 + ratio * ratio;
        assert!((factor / theory - 1.0).abs() < 1e-3, "l/b = {ratio}: {factor:.5} against {theory:.5}");
    }
}

/// The shipped skid-steer robots against the same tyre solved without engine or time. Required within 1 %; eight cells
/// along a patch that slides nearly all over leave less than 0.1 %.
#[test]
fn spin_of_shipped_robots_is_the_quasi_static_solution() {
    for robot in ["jnpf_4wd", "husky_a200"] {
        let scene = ideal(robot);
        let (factor, solution) = (track_factor_in_spin(&scene, 2.5), quasi_static::track_factor(&scene));
        assert!((factor / solution - 1.0).abs() < 1e-3, "{robot}: {factor:.5} against {solution:.5}");
    }
}

/// A wheel rolls R_e = R − δ/3 a radian. Nothing drags on the ground in steady rolling, so only the settling of the
/// suspension and 4 m of f64 remain: 0.01 %.
#[test]
fn rolling_radius_is_the_closed_form() {
    for robot in ["jnpf_4wd", "husky_a200"] {
        let scene = ideal(robot);
        let mut world = settled(&scene);
        ramp_to(&mut world, 3.0, 3.0);
        step_for(&mut world, 1.0);
        let (from, wheels) = (world.pose(), rotation(&world));
        step_for(&mut world, 10.0);
        let to = world.pose();
        let [left, right] = rotation(&world);
        let turned = 0.5 * (left + right - wheels[0] - wheels[1]);
        let radius = from.distance(to) / turned;
        assert!((radius / rolling_radius(&scene) - 1.0).abs() < 1e-4, "{robot}: {radius:.7}");
    }
}

/// Tyres 1 % apart turn the robot by the difference of the wheels' ways over the effective track. The arc's slip is a
/// hundredth of a spin's, so the patches stick and their elastic track differs a little from the sliding one: 1 %.
#[test]
fn a_diameter_mismatch_turns_the_robot_over_the_effective_track() {
    let mut scene = ideal("jnpf_4wd");
    let factor = track_factor_in_spin(&scene, 2.5);
    for wheel in &mut scene.robot.wheels {
        wheel.tyre.free_radius *= if wheel.side == Side::Left { 0.995 } else { 1.005 };
    }
    let mut world = settled(&scene);
    ramp_to(&mut world, 3.0, 3.0);
    step_for(&mut world, 1.0);
    let (heading, wheels) = (world.pose().heading, rotation(&world));
    step_for(&mut world, 8.0);
    let [left, right] = rotation(&world);
    let radius = |side: Side| {
        let wheel = scene.robot.wheels.iter().find(|wheel| wheel.side == side).expect("both sides have wheels");
        wheel.tyre.rolling_radius(wheel.tyre.squash(scene.robot.mass() * GRAVITY / 4.0))
    };
    let difference = radius(Side::Right) * (right - wheels[1]) - radius(Side::Left) * (left - wheels[0]);
    let expected = difference / (factor * scene.robot.track_width());
    let turned = world.pose().heading - heading;
    assert!((turned / expected - 1.0).abs() < 0.01, "{turned:.6} against {expected:.6}");
}

/// Parked on a 5 % slope, along and across, it stays: less than 0.1 mm in a minute after it has settled.
#[test]
fn a_parked_robot_does_not_creep() {
    for robot in ["jnpf_4wd", "husky_a200", "optiodom"] {
        for downhill in [0.0, FRAC_PI_2] {
            let mut scene = ideal(robot);
            scene.floor.gradient = 0.05;
            scene.floor.downhill_heading = downhill;
            let mut world = settled(&scene);
            step_for(&mut world, 1.0);
            let from = world.pose();
            step_for(&mut world, 60.0);
            let crept = from.distance(world.pose());
            assert!(crept < 1e-4, "{robot}, downhill at {downhill:.2} rad: {:.4} mm", 1e3 * crept);
        }
    }
}

/// On a slope beyond μ it slides at g(sin θ − μ cos θ): sideways on free wheels, and straight down on locked ones. The
/// bristles saturate within a patch length; 0.1 %.
#[test]
fn beyond_friction_it_slides_at_the_closed_form() {
    let gradient = 1.2f64;
    let slope = gradient.atan();
    for (downhill, locked) in [(FRAC_PI_2, false), (0.0, true)] {
        let mut scene = ideal("jnpf_4wd");
        scene.floor.gradient = gradient;
        scene.floor.downhill_heading = downhill;
        scene.time_step = 0.5e-3;
        if locked {
            scene.robot.drivetrain.dry_friction = 50.0;
        }
        let mut world = settled(&scene);
        let speed = |twist: treadmark::geometry::Twist2| twist.forward.hypot(twist.left);
        let from = speed(world.twist());
        step_for(&mut world, 1.0);
        let acceleration = speed(world.twist()) - from;
        let expected = GRAVITY * (slope.sin() - 0.8 * slope.cos());
        assert!((acceleration / expected - 1.0).abs() < 1e-3, "{acceleration:.5} against {expected:.5}");
    }
}

/// Wheels that spin up on ice lean the chassis back, until the floor's loads have given as much angular momentum as the
/// wheels have. The ice's friction takes 0.01 %; what the chassis still rocks by after two seconds may be 0.2 %.
#[test]
fn wheels_that_spin_up_lean_the_chassis_back() {
    let mut scene = ideal("jnpf_4wd");
    scene.robot.encoder.ticks_per_revolution *= 1e3;
    for wheel in &mut scene.robot.wheels {
        wheel.tyre.friction_along = 1e-6;
        wheel.tyre.friction_across = 1e-6;
    }
    let robot = &scene.robot;
    let centre = robot.whole().centre_of_mass;
    let mut world = settled(&scene);
    for wheel in 0..robot.wheels.len() {
        world.command(wheel, 10.0);
    }
    let (mut snapshots, mut given) = (Vec::new(), 0.0);
    for _ in 0..(2.0 / scene.time_step).round() as u64 {
        let centre = world.base() * centre;
        step_for(&mut world, scene.time_step);
        world.wheel_snapshots(&mut snapshots);
        for wheel in &snapshots {
            // At full voltage the front wheels lift for a moment.
            let at = wheel.patch.as_ref().map_or(centre.x, |patch| patch.centre[0]);
            given -= scene.time_step * wheel.load * (at - centre.x);
        }
    }
    let inertia = robot.wheels[0].spin_inertia() + robot.drivetrain.reflected_inertia();
    let spun = inertia * snapshots.iter().map(|snapshot| snapshot.speed).sum::<f64>();
    assert!((given / spun - 1.0).abs() < 2e-3, "{given:.6} against {spun:.6}");
}

/// The default step: halving it moves no 4 m end-pose error by more than 0.1 mm and 0.1 mrad. Encoders are a thousand
/// times as fine as they are: a tick that comes a step earlier would hide it.
#[test]
fn halving_the_step() {
    let mut scene = Scene::load("jnpf_4wd", "lab_floor").expect("shipped").noise_free();
    scene.robot.encoder.ticks_per_revolution *= 1e3;
    scene.robot.odometry.ticks_per_revolution = scene.robot.odometry.ticks_per_revolution.map(|ticks| 1e3 * ticks);
    for direction in [Rotation::Clockwise, Rotation::CounterClockwise] {
        let protocol = Protocol::Square { side: 4.0, direction };
        let coarse = run(&scene, protocol).true_error();
        let fine = run(&Scene { time_step: 0.5 * scene.time_step, ..scene.clone() }, protocol).true_error();
        let moved = coarse.distance(fine);
        assert!(moved < 1e-4, "{direction:?}: {:.3} mm", 1e3 * moved);
        let turned = (coarse.heading - fine.heading).abs();
        assert!(turned < 1e-4, "{direction:?}: {:.3} mrad", 1e3 * turned);
    }
}

/// A robot with equal tyres that has learnt its radii on a straight and its track on a spin closes the 4 m square.
#[test]
fn a_robot_calibrated_on_straight_and_spin_closes_the_square() {
    let mut scene = ideal("jnpf_4wd");
    // Start and stop wind the tyres up by the same angle in any spin: the difference of two spins is free of it, and so
    // is that of two straights.
    let way = |scene: &Scene, length| run(scene, Protocol::Straight { length, direction: Travel::Forward });
    let turn = |scene: &Scene, turn| run(scene, Protocol::Spin { turn, direction: Rotation::CounterClockwise });
    let (short, long) = (way(&scene, 1.0), way(&scene, 5.0));
    let scale = (long.actual.x - short.actual.x) / (long.odometry.x - short.odometry.x);
    scene.robot.odometry =
        scene.robot.odometry.corrected(&OdometryCorrection { distance_scale: scale, ..OdometryCorrection::IDENTITY });
    let quarter = turn(&scene, FRAC_PI_2);
    let track = quarter.odometry.heading / quarter.actual.heading;
    scene.robot.odometry =
        scene.robot.odometry.corrected(&OdometryCorrection { track_ratio: track, ..OdometryCorrection::IDENTITY });
    for direction in [Rotation::Clockwise, Rotation::CounterClockwise] {
        let error = run(&scene, Protocol::Square { side: 4.0, direction }).true_error();
        assert!(error.distance(Pose2::IDENTITY) < 5e-3, "{direction:?}: {:.2} mm", 1e3 * error.x.hypot(error.y));
        assert!(error.heading.abs() < 2e-3, "{direction:?}: {:.2} mrad", 1e3 * error.heading);
    }
}
