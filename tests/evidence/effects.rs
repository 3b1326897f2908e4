//! Every effect does to the robot what its sentence says: one physical test an effect, against a closed form or an argued
//! inequality. Robots stand on a level floor without noise, at steps of 2.5 ms unless said otherwise (moving from there to
//! 1 ms is worth 0.2 mm and 0.03 mrad on a whole square).

use crate::rig::{ideal, ramp_to, rolling_radius, rotation, run, settled, step_for, track_factor_in_spin};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use treadmark::dataset::{Protocol, Rotation, Run, Travel};
use treadmark::diagnose::ForwardModel;
use treadmark::drive::{self, Observer, SimulatedRun, Snapshot, Task};
use treadmark::effect::{Cause, EFFECTS, Effect, EffectError, ExtendedModel, Prior, load_scene};
use treadmark::experiment::Simulator;
use treadmark::geometry::{Pose2, Trace};
use treadmark::odometry::DeadReckoning;
use treadmark::scene::{
    Contact, Doubt, EmpiricalTerm, Feature, GRAVITY, NoiseModel, Residue, Scatter, Scene, Side, SpottedFloor, TermPart,
    Tyre,
};
use treadmark::world::{Patch, PatchMotion, Play, WheelSnapshot, World};

/// The physical test of each effect.
const TESTS: [(&str, fn()); 22] = [
    ("wheel_diameter_mismatch", wheel_diameter_mismatch),
    ("wheel_diameter_scale", wheel_diameter_scale),
    ("axle_diameter_mismatch", axle_diameter_mismatch),
    ("tyre_radius_drift", tyre_radius_drift),
    ("tyre_grip_anisotropy", tyre_grip_anisotropy),
    ("wheel_toe", wheel_toe),
    ("load_offset_longitudinal", load_offset_longitudinal),
    ("load_offset_lateral", load_offset_lateral),
    ("caster_drag", caster_drag),
    ("effective_track", effective_track),
    ("floor_slope", floor_slope),
    ("floor_grip_patch", floor_grip_patch),
    ("encoder_count_loss", encoder_count_loss),
    ("encoder_latency", encoder_latency),
    ("gear_backlash", gear_backlash),
    ("drivetrain_wind_up", drivetrain_wind_up),
    ("stop_overrun", stop_overrun),
    ("start_heading_error", start_heading_error),
    ("tracked_frame_turned", tracked_frame_turned),
    ("survey_lever_arm", survey_lever_arm),
    ("survey_scale", survey_scale),
    ("survey_time_offset", survey_time_offset),
];

/// An effect without a physical test of its own does not enter the registry.
#[test]
fn every_effect_has_its_test() {
    let tested: BTreeSet<&str> = TESTS.iter().map(|(id, _)| *id).collect();
    let registered: BTreeSet<&str> = EFFECTS.iter().map(|effect| effect.id).collect();
    assert_eq!(tested, registered);
}

// ── the bench ──

/// A shipped robot, ideal, at 2.5 ms.
fn bench(robot: &str) -> Scene {
    Scene { time_step: 2.5e-3, ..ideal(robot) }
}

/// `scene` with one cause in it, which has to be allowed.
fn with(scene: &Scene, id: &str, values: &[f64], choice: &str) -> Scene {
    let effect = Effect::named(id).expect("it is registered");
    let cause = Cause { effect, choice: choice.to_owned(), values: values.to_vec() };
    cause.check(scene).expect("it is allowed");
    cause.edit(scene)
}

/// Tyres of nearly no patch, 2 mm wide and 11 mm long, on stiff bristles: Coulomb friction at four points is exact to
/// (w² + (2a)²)/3b², 0.03 %.
fn hard_and_narrow(mut scene: Scene) -> Scene {
    for wheel in &mut scene.robot.wheels {
        wheel.tyre.width = 0.002;
        wheel.tyre.vertical_stiffness = 4e5;
        wheel.tyre.vertical_damping = 1e3;
        wheel.tyre.slip_stiffness = 240.0;
    }
    Scene { time_step: 0.5e-3, ..scene }
}

fn straight(length: f64) -> Protocol {
    Protocol::Straight { length, direction: Travel::Forward }
}

fn reverse(length: f64) -> Protocol {
    Protocol::Straight { length, direction: Travel::Reverse }
}

fn spin(turn: f64) -> Protocol {
    let direction = if turn > 0.0 { Rotation::CounterClockwise } else { Rotation::Clockwise };
    Protocol::Spin { turn: turn.abs(), direction }
}

fn square(side: f64) -> Protocol {
    Protocol::Square { side, direction: Rotation::CounterClockwise }
}

/// Travel \[m\] and heading \[rad\] that one tick of both sides amounts to: what a run's end can be off by because the
/// driver stops within a tick.
fn tick(scene: &Scene) -> (f64, f64) {
    let odometry = &scene.robot.odometry;
    let way = odometry.angle_of_ticks(1.0) * odometry.left_wheel_radius;
    (way, way / odometry.track_width)
}

/// A world in steady motion with the left and right wheels at these speeds \[rad/s\]. A speed loop that works against a
/// rolling tyre, which is a damper of C N R²/V, takes its time: 1.5 s for each e-fold.
fn steady(scene: &Scene, left: f64, right: f64) -> World {
    let mut world = settled(scene);
    ramp_to(&mut world, left, right);
    step_for(&mut world, 8.0);
    world
}

/// Means over a time of steady motion.
#[derive(Debug)]
struct Means {
    forward: f64,
    left: f64,
    yaw_rate: f64,
    /// Of the wheels \[rad/s\].
    speed: Vec<f64>,
    load: Vec<f64>,
    along: Vec<f64>,
    across: Vec<f64>,
}

fn means(world: &mut World, seconds: f64) -> Means {
    let steps = (seconds / world.scene().time_step).round() as usize;
    let mut wheels: Vec<WheelSnapshot> = Vec::new();
    let n = world.scene().robot.wheels.len();
    let zero = || vec![0.0; n];
    let mut sum =
        Means { forward: 0.0, left: 0.0, yaw_rate: 0.0, speed: zero(), load: zero(), along: zero(), across: zero() };
    let share = 1.0 / steps as f64;
    for _ in 0..steps {
        world.step().expect("it goes on");
        let twist = world.twist();
        sum.forward += share * twist.forward;
        sum.left += share * twist.left;
        sum.yaw_rate += share * twist.yaw_rate;
        world.wheel_snapshots(&mut wheels);
        for (index, wheel) in wheels.iter().enumerate() {
            sum.speed[index] += share * wheel.speed;
            sum.load[index] += share * wheel.load;
            sum.along[index] += share * wheel.force_along;
            sum.across[index] += share * wheel.force_across;
        }
    }
    sum
}

/// Force of the brush model at a slip of the whole patch \[Pacejka, eqs 3.6–3.11\].
fn brush(tyre: &Tyre, load: f64, slip: f64) -> f64 {
    let limit = tyre.friction_along * load;
    let theta = (tyre.slip_stiffness * load * slip.abs() / (3.0 * limit)).min(1.0);
    slip.signum() * limit * (1.0 - (1.0 - theta).powi(3))
}

/// The slip at which the brush gives `force`.
fn brush_slip(tyre: &Tyre, load: f64, force: f64) -> f64 {
    let theta = 1.0 - (1.0 - force / (tyre.friction_along * load)).cbrt();
    3.0 * tyre.friction_along * theta / tyre.slip_stiffness
}

/// A steady spin on four points of Coulomb friction whose axles can hold `front` and `rear` (any unit): b_eff/b, and how
/// far ahead of the middle the turn centre is.
///
/// Slip at a wheel is the excess e of its way over b/2 along, and its distance d from the turn centre across. Side forces
/// balance, Q = F_f d_f/h_f = F_r d_r/h_r with h² = e² + d², and so do yaw moments, (b/2) e (F_f/h_f + F_r/h_r) = Q l.
fn coulomb_spin(b: f64, l: f64, front: f64, rear: f64) -> (f64, f64) {
    let bisect = |mut low: f64, mut high: f64, rises: &dyn Fn(f64) -> f64| {
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if rises(middle) < 0.0 { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    let side = |weight: f64, d: f64, e: f64| weight * d / d.hypot(e);
    let centre = |e: f64| bisect(-0.5 * l, 0.5 * l, &|x| side(rear, 0.5 * l + x, e) - side(front, 0.5 * l - x, e));
    let excess = bisect(0.0, l * l / b, &|e| {
        let x = centre(e);
        let (ahead, behind) = (0.5 * l - x, 0.5 * l + x);
        0.5 * b * e * (front / ahead.hypot(e) + rear / behind.hypot(e)) - side(front, ahead, e) * l
    });
    (1.0 + 2.0 * excess / b, centre(excess))
}

/// Keeps the wheels' angles beside each row of the log.
#[derive(Default)]
struct Watch {
    truth: Vec<Pose2>,
    believed: Vec<Pose2>,
    angles: Vec<Vec<f64>>,
}

impl Observer for Watch {
    fn observe(&mut self, snapshot: &Snapshot<'_>) {
        self.truth.push(snapshot.truth);
        self.believed.push(snapshot.odometry);
        self.angles.push(snapshot.wheels.iter().map(|wheel| wheel.angle).collect());
    }
}

impl Watch {
    /// Rotation of a wheel since the first row \[rad\].
    fn turned(&self, row: usize, wheel: usize) -> f64 {
        self.angles[row][wheel] - self.angles[0][wheel]
    }

    /// What the log has beyond what the wheel did, at a row \[rad\].
    fn excess(&self, scene: &Scene, run: &SimulatedRun, row: usize, wheel: usize) -> f64 {
        let log = run.measured.encoders.as_ref().expect("it is logged");
        log.radians(row, wheel, &scene.robot.odometry) - self.turned(row, wheel)
    }
}

fn watched(scene: &Scene, protocol: Protocol) -> (SimulatedRun, Watch) {
    let mut watch = Watch::default();
    let task = Task::new("test", protocol);
    let run = drive::run(scene, &task, 1, Some(&mut watch), &AtomicBool::new(false)).expect("it can be driven");
    (run, watch)
}

fn close(found: f64, expected: f64, relative: f64, what: &str) {
    assert!((found / expected - 1.0).abs() < relative, "{what}: {found:.6e} against {expected:.6e}");
}

fn within(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((found - expected).abs() < tolerance, "{what}: {found:.6e} against {expected:.6e} ± {tolerance:.1e}");
}

// ── wheels and tyres ──

/// A straight of L bends by L δ/b_eff, δ the difference of the rolling radii over their mean; the mean way stays. The
/// patches stick, and their elastic track is within 1 % of the sliding one; a tick at each end is worth 0.3 %.
#[test]
fn wheel_diameter_mismatch() {
    for (robot, b_eff) in [
        ("jnpf_4wd", track_factor_in_spin(&bench("jnpf_4wd"), 2.5) * 0.4),
        ("optiodom", track_factor_in_spin(&bench("optiodom"), 2.5) * 0.2),
    ] {
        let plain = bench(robot);
        let ratio = 0.01;
        let scene = with(&plain, "wheel_diameter_mismatch", &[ratio], "");
        let radius = |side: Side| {
            scene.robot.wheels.iter().find(|wheel| wheel.side == side).expect("both sides").tyre.free_radius
        };
        within(radius(Side::Right) / radius(Side::Left), 1.0 + ratio, 1e-12, "E_d");
        let bend = |scene: &Scene| run(scene, straight(4.0)).actual.heading - run(scene, straight(1.0)).actual.heading;
        let mean = rolling_radius(&plain);
        let delta = (radius(Side::Right) - radius(Side::Left)) / mean;
        let way = 3.0 * mean / plain.robot.odometry.left_wheel_radius;
        close(bend(&scene), way * delta / b_eff, 0.015, robot);
        let mirrored = bend(&with(&plain, "wheel_diameter_mismatch", &[1.0 / (1.0 + ratio) - 1.0], ""));
        within(mirrored, -bend(&scene), 2.0 * tick(&scene).1, "mirrored");
        // An arc of 4 m, measured by its chord.
        let (bent, before) = (run(&scene, straight(4.0)), run(&plain, straight(4.0)));
        let arc = bent.actual.distance(Pose2::IDENTITY) * (1.0 + bent.actual.heading.powi(2) / 24.0);
        close(arc / bent.odometry.x, before.actual.x / before.odometry.x, 1e-4, "the mean way");
    }
}

/// Everything that rolls is longer by the same factor: R_e grows by the ratio times R/R_e, since the squash stays. Ways
/// are known to a tick.
#[test]
fn wheel_diameter_scale() {
    for robot in ["jnpf_4wd", "husky_a200"] {
        let plain = bench(robot);
        let scene = with(&plain, "wheel_diameter_scale", &[0.02], "");
        let grown = 1.0 + 0.02 * plain.robot.wheels[0].tyre.free_radius / rolling_radius(&plain);
        let (way_tick, heading_tick) = tick(&plain);
        let way = |scene: &Scene| run(scene, straight(3.0)).actual;
        close(way(&scene).x / way(&plain).x, grown, 2.0 * way_tick / 3.0, "a straight");
        within(way(&scene).heading, 0.0, heading_tick, "and no turn");
        let turn = |scene: &Scene| run(scene, spin(4.0 * PI)).actual.heading;
        close(turn(&scene) / turn(&plain), grown, 2.0 * heading_tick / (4.0 * PI) + 1e-3, "a spin");
    }
}

/// Wheels that turn alike on tyres that do not: the larger ones, at the rear, push, the smaller ones brake, each with the
/// brush's force at half the mismatch, and the sum is nothing, since nothing resists. The robot goes on at the mean.
#[test]
fn axle_diameter_mismatch() {
    let plain = bench("jnpf_4wd");
    let ratio = 0.02;
    let scene = with(&plain, "axle_diameter_mismatch", &[ratio], "");
    let mut world = steady(&scene, 3.0, 3.0);
    let found = means(&mut world, 4.0);
    for (index, wheel) in scene.robot.wheels.iter().enumerate() {
        let rear = wheel.name.starts_with("rear");
        let radius = wheel.tyre.rolling_radius(wheel.tyre.squash(found.load[index]));
        let slip = 1.0 - found.forward / (found.speed[index] * radius);
        assert_eq!(slip > 0.0, rear, "{}: the larger tyre runs ahead of the floor", wheel.name);
        // Eight cells see less of the sliding at the trailing edge than a continuum: between the brush and its tangent.
        let force = found.along[index].abs();
        let tangent = wheel.tyre.slip_stiffness * found.load[index] * slip.abs();
        let least = brush(&wheel.tyre, found.load[index], slip).abs();
        assert!(0.995 * least < force && force < 1.005 * tangent, "{}: {least} < {force} < {tangent}", wheel.name);
        assert!(found.along[index] * slip > 0.0);
        close(slip, 0.5 * ratio * if rear { 1.0 } else { -1.0 }, 0.03, "slip is half the mismatch");
    }
    within(found.along.iter().sum::<f64>(), 0.0, 0.02 * found.along[3], "nothing resists");
    let speed = found.speed.iter().sum::<f64>() / 4.0;
    // Unequal tyres lean the robot forward, which moves the loads a little: the mean to second order of the mismatch.
    close(found.forward / speed, rolling_radius(&plain), ratio * ratio, "mean travel");
    within(found.yaw_rate / found.forward, 0.0, 1e-4, "and straight on");
    // Either way round it is the same fight with parts exchanged.
    let other = means(&mut steady(&with(&plain, "axle_diameter_mismatch", &[-ratio], ""), 3.0, 3.0), 4.0);
    assert!(other.along[0] > 0.0 && other.along[2] < 0.0);
}

/// Two runs two hours apart: the later one is shorter by what the tyres have shrunk, R/R_e of it; the first has the bits
/// of a campaign without drift, and so has one whose start was not noted.
#[test]
fn tyre_radius_drift() {
    let plain = bench("jnpf_4wd");
    let scene = with(&plain, "tyre_radius_drift", &[-0.01], "");
    let at = |scene: &Scene, started: Option<f64>| {
        let task = Task { started, ..Task::new("test", straight(3.0)) };
        drive::run(scene, &task, 1, None, &AtomicBool::new(false)).expect("it can be driven").actual
    };
    assert_eq!(at(&scene, Some(0.0)), at(&plain, Some(0.0)));
    assert_eq!(at(&scene, None), at(&plain, Some(7200.0)));
    let shrunk = 1.0 - 0.02 * plain.robot.wheels[0].tyre.free_radius / rolling_radius(&plain);
    close(at(&scene, Some(7200.0)).x / at(&scene, Some(0.0)).x, shrunk, 2.0 * tick(&plain).0 / 3.0, "two hours later");
    within(at(&scene, Some(7200.0)).heading, 0.0, tick(&plain).1, "straight on");
}

/// Less grip across than along: a spin's factor is 1 + k²(l/b)², k = μ_y/μ_x, for points of Coulomb friction (0.1 %, as
/// for isotropic ones), and a straight does not see it.
#[test]
fn tyre_grip_anisotropy() {
    let plain = hard_and_narrow(bench("jnpf_4wd"));
    let (b, l) = (plain.robot.track_width(), plain.robot.wheelbase());
    for ratio in [-0.2, 0.1] {
        let scene = with(&plain, "tyre_grip_anisotropy", &[ratio], "");
        let theory = 1.0 + (1.0f64 + ratio).powi(2) * (l / b).powi(2);
        close(track_factor_in_spin(&scene, 2.5), theory, 1e-3, "spin factor");
    }
    // Soft bristles stretch towards the slip before they slide, and take part of the change back.
    let soft = bench("jnpf_4wd");
    let factor = |ratio: f64| track_factor_in_spin(&with(&soft, "tyre_grip_anisotropy", &[ratio], ""), 2.5);
    let share = (factor(0.0) - factor(-0.2)) / (0.36 * (l / b).powi(2));
    assert!(0.85 < share && share < 1.0, "{share}");
    let slippery = with(&soft, "tyre_grip_anisotropy", &[-0.2], "");
    let (one, other) = (run(&soft, straight(2.0)).actual, run(&slippery, straight(2.0)).actual);
    assert!(one.distance(other) < tick(&soft).0 && (one.heading - other.heading).abs() < tick(&soft).1);
}

/// A patch that slides all over an ellipse of friction pulls with (μ_x² s_x, μ_y² s_y)N/√(μ_x² s_x² + μ_y² s_y²) against the slip:
/// the force of the ellipse that takes the most power out of it.
#[test]
fn sliding_on_an_ellipse_dissipates_the_most() {
    let tyre = crate::rig::tyre(0.8, 0.5);
    let load = 60.0;
    for angle in [0.0f64, 0.3, 0.7, 1.5, 2.0, -1.2] {
        let mut patch = Patch::default();
        let (x, y) = (0.5 * angle.cos(), 0.5 * angle.sin());
        let motion = PatchMotion { slip_along: x, slip_across: y, spin: 0.0, rolling: 0.0 };
        let mut force = Default::default();
        for _ in 0..200 {
            force = patch.advance(&tyre, load, tyre.squash(load), 1.0, &motion, 1e-3);
        }
        let power = (0.8 * x).hypot(0.5 * y);
        assert!((force.along + 0.64 * x / power * load).abs() < 1e-6 * load, "{angle}: {force:?}");
        assert!((force.across + 0.25 * y / power * load).abs() < 1e-6 * load, "{angle}: {force:?}");
    }
}

/// One wheel of four toed in by τ, all rolling alike, patches linear at equal loads: side forces balance at a crab angle
/// of τ/4, and yaw moments at a curvature of τ x/(l² + b²), x how far ahead the wheel is. The brush at a slip angle of
/// 4 mrad is 2.5 % softer than its tangent; 3 %.
#[test]
fn wheel_toe() {
    let plain = bench("jnpf_4wd");
    let (b, l) = (plain.robot.track_width(), plain.robot.wheelbase());
    let drift = |wheel: &str, toe: f64| {
        let found = means(&mut steady(&with(&plain, "wheel_toe", &[toe], wheel), 3.0, 3.0), 8.0);
        (found.yaw_rate / found.forward, found.left / found.forward, found)
    };
    let toe = 0.005;
    for (wheel, index, ahead) in [("front_left", 0, 1.0), ("rear_left", 2, -1.0)] {
        let (curvature, crab, found) = drift(wheel, toe);
        close(curvature, ahead * toe * 0.5 * l / (l * l + b * b), 0.03, "curvature");
        close(crab, 0.25 * toe, 0.04, "crab angle");
        assert!(found.across[index] > 0.0, "it pulls to its side");
        let others: f64 = (0..4).filter(|other| *other != index).map(|other| found.across[other]).sum();
        within(others / -found.across[index], 1.0, 0.02, "the others hold against it");
    }
    // The mirrored wheel turned the other way is the mirror image.
    let (left, right) = (drift("front_left", toe), drift("front_right", -toe));
    within(right.0, -left.0, 0.01 * left.0.abs(), "mirrored curvature");
    within(right.1, -left.1, 0.01 * left.1.abs(), "mirrored crab");
    let scene = with(&plain, "wheel_toe", &[toe], "front_left");
    let ends = run(&scene, straight(3.0));
    assert!(ends.actual.heading > 0.0 && ends.actual.y > 0.0 && ends.odometry.y.abs() < 1e-3);
}

// ── mass ──

/// Loads by statics, N_front = Mg(½ + x/l); and a spin on four points of Coulomb friction with those loads: factor and
/// turn centre, against `coulomb_spin` (which is itself 1 + (l/b)² when balanced). Straights do not see it.
#[test]
fn load_offset_longitudinal() {
    let plain = hard_and_narrow(bench("jnpf_4wd"));
    let (b, l, weight) = (plain.robot.track_width(), plain.robot.wheelbase(), plain.robot.mass() * GRAVITY);
    let balanced = coulomb_spin(b, l, 1.0, 1.0);
    within(balanced.0, 1.0 + (l / b).powi(2), 1e-9, "the balanced closed form");
    for x in [0.02, -0.02] {
        let scene = with(&plain, "load_offset_longitudinal", &[x], "");
        let still = means(&mut settled(&scene), 0.5);
        let front = 0.5 + x / l;
        close((still.load[0] + still.load[1]) / weight, front, 1e-3, "front axle's load");
        // How two hard tyres share it is a matter of a micrometre in the engine's hinges.
        within(still.load[0] / still.load[1], 1.0, 0.01, "left and right alike");
        let (factor, centre) = coulomb_spin(b, l, front, 1.0 - front);
        let mut world = steady(&scene, -0.6, 0.6);
        let found = means(&mut world, 4.0);
        let way = (found.speed[1] - found.speed[0]) * rolling_radius(&scene);
        // Slowly, so that the mass on its way round the turn centre does not pull: 0.02 % of the friction.
        close(way / found.yaw_rate / b, factor, 2e-3, "spin factor");
        close(-found.left / found.yaw_rate, centre, 0.01, "turn centre");
        assert!(centre.abs() > x.abs() && centre * x > 0.0 && factor < balanced.0);
    }
    let soft = bench("jnpf_4wd");
    let loaded = run(&with(&soft, "load_offset_longitudinal", &[0.02], ""), straight(2.0)).actual;
    within(loaded.heading, 0.0, tick(&soft).1, "a straight stays straight");
    within(loaded.x, run(&soft, straight(2.0)).actual.x, 2.0 * tick(&soft).0, "and as long");
}

/// Loads by statics, N_left = Mg(½ + y/b); the heavy side's tyres are pressed in more and roll on R − δ/3, so the robot
/// bends to the heavy side. Linear patches with side shares p of the load turn by the difference of the sides' ways over
/// b(1 + l²/(4 p_L p_R b²)).
#[test]
fn load_offset_lateral() {
    let plain = bench("jnpf_4wd");
    let (b, l, weight) = (plain.robot.track_width(), plain.robot.wheelbase(), plain.robot.mass() * GRAVITY);
    let bend = |y: f64| {
        let scene = with(&plain, "load_offset_lateral", &[y], "");
        let still = means(&mut settled(&scene), 0.5);
        let heavy = 0.5 + y / b;
        close((still.load[0] + still.load[2]) / weight, heavy, 2e-3, "left side's load");
        let mut world = steady(&scene, 3.0, 3.0);
        let (before, heading) = (rotation(&world), world.pose().heading);
        step_for(&mut world, 10.0);
        let [left, right] = rotation(&world);
        let tyre = &scene.robot.wheels[0].tyre;
        let radius = |share: f64| tyre.rolling_radius(tyre.squash(0.5 * share * weight));
        let difference = radius(1.0 - heavy) * (right - before[1]) - radius(heavy) * (left - before[0]);
        let track = b * (1.0 + l * l / (4.0 * heavy * (1.0 - heavy) * b * b));
        let turned = world.pose().heading - heading;
        assert!(turned * y > 0.0, "to the heavy side");
        close(turned, difference / track, 0.03, "bend");
        turned
    };
    let (left, right) = (bend(0.02), bend(-0.02));
    within(left, -right, 0.02 * left.abs(), "mirrored");
}

/// The caster's load is by statics, its drag is the coefficient times it, the wheels pull against it, and creep at the
/// brush's slip for that force: a run is shorter by it. In a spin the drag acts at the caster's lever and the robot turns
/// less than it believes.
#[test]
fn caster_drag() {
    let plain = bench("optiodom");
    let robot = &plain.robot;
    let moment: f64 = robot.chassis.mass * robot.chassis.centre_of_mass.x;
    let load = moment / robot.casters[0].centre.x * GRAVITY;
    let coefficient = 0.3;
    let scene = with(&plain, "caster_drag", &[coefficient], "");
    let found = means(&mut steady(&scene, 2.4, 2.4), 4.0);
    let pull = found.along.iter().sum::<f64>();
    close(pull, coefficient * load, 0.01, "the wheels pull against the drag");
    let tyre = &scene.robot.wheels[0].tyre;
    let slip = brush_slip(tyre, found.load[0], 0.5 * pull);
    let free = means(&mut steady(&plain, 2.4, 2.4), 4.0);
    within(free.along.iter().sum::<f64>(), 0.0, 0.01 * pull, "no drag, no pull");
    let creep = 1.0 - (found.forward / found.speed[0]) / (free.forward / free.speed[0]);
    // Eight cells see less of the sliding at the trailing edge than a continuum: between the brush and its tangent.
    let tangent = 0.5 * pull / (tyre.slip_stiffness * found.load[0]);
    assert!(0.99 * tangent < creep && creep < 1.01 * slip, "{tangent:.3e} < {creep:.3e} < {slip:.3e}");
    let turn = |scene: &Scene| run(scene, spin(4.0 * PI)).true_error().heading;
    assert!(turn(&scene) < turn(&plain) - 5.0 * tick(&plain).1, "it turns less than it believes");
}

/// The spin's factor moves by the ratio: on one axle, where the wheels are set apart, exactly; on two, through the friction
/// ratio, exactly for small stiff patches. Soft ones take up to a tenth of the change back (see `tyre_grip_anisotropy`), and
/// their own size, [w² + (2a)²]/3b², another hundredth. Straights do not see it.
#[test]
fn effective_track() {
    let soft = ["jnpf_4wd", "husky_a200"].map(|robot| (bench(robot), 0.1));
    let exact = [bench("optiodom"), hard_and_narrow(bench("jnpf_4wd"))].map(|scene| (scene, 0.01));
    for (plain, tolerance) in soft.into_iter().chain(exact) {
        let track = |scene: &Scene| track_factor_in_spin(scene, 2.0) * scene.robot.track_width();
        let before = track(&plain);
        for ratio in [0.05, -0.05] {
            let scene = with(&plain, "effective_track", &[ratio], "");
            close(track(&scene) / before - 1.0, ratio, tolerance, &plain.robot.name);
            let (one, other) = (run(&plain, straight(1.0)).actual, run(&scene, straight(1.0)).actual);
            let (way, heading) = tick(&plain);
            assert!(one.distance(other) < way && (one.heading - other.heading).abs() < heading);
        }
    }
}

// ── floor ──

/// A rolling tyre that has to hold a share of its load creeps by gradient/C of its way: downhill, wherever the robot
/// heads, and in proportion. The brush is 1 % softer than its tangent here.
#[test]
fn floor_slope() {
    let plain = bench("jnpf_4wd");
    let stiffness = plain.robot.wheels[0].tyre.slip_stiffness;
    // Creep over the way rolled, in the room, of a robot that starts at `heading`.
    let creep = |gradient: f64, downhill: f64, heading: f64| {
        let scene = with(&plain, "floor_slope", &[gradient, downhill], "");
        let start = Pose2::new(0.3, -0.2, heading);
        let mut world = World::new(&scene, start, ChaCha8Rng::seed_from_u64(0)).expect("it stands");
        step_for(&mut world, 0.5);
        ramp_to(&mut world, 3.0, 3.0);
        step_for(&mut world, 1.0);
        let found = means(&mut world, 4.0);
        let rolled = found.speed.iter().sum::<f64>() / 4.0 * rolling_radius(&plain);
        // Yaw turned the robot a little on the way here; forward and left are along its own axes.
        Pose2::new(0.0, 0.0, world.pose().heading).compose(Pose2::new(
            found.forward / rolled - 1.0,
            found.left / rolled,
            0.0,
        ))
    };
    for heading in [0.0, FRAC_PI_2, 2.0] {
        for downhill in [0.0, FRAC_PI_2, -2.5] {
            let gradient = 0.02;
            let found = creep(gradient, downhill, heading);
            let expected = gradient / stiffness;
            let along = found.x * f64::cos(downhill) + found.y * f64::sin(downhill);
            let across = found.y * f64::cos(downhill) - found.x * f64::sin(downhill);
            close(along, expected, 0.05, "downhill");
            within(across, 0.0, 0.05 * expected, "and not along the contour");
        }
    }
    let (gentle, steep) = (creep(0.01, 1.0, 0.0), creep(0.02, 1.0, 0.0));
    close(steep.x.hypot(steep.y), 2.0 * gentle.x.hypot(gentle.y), 0.03, "proportional");
}

/// Points of Coulomb friction, the front axle on ground of 0.7 times the grip: a spin there is `coulomb_spin` of those
/// two. A spot that no wheel meets changes no bit, one under all wheels scales all forces alike and changes no factor, and
/// a straight across one stays straight.
#[test]
fn floor_grip_patch() {
    let plain = hard_and_narrow(bench("jnpf_4wd"));
    let (b, l) = (plain.robot.track_width(), plain.robot.wheelbase());
    // A disc so large that its edge is a straight line between the axles: half the floor.
    let ratio = 0.7;
    let scene = with(&plain, "floor_grip_patch", &[10.0, 0.0, 10.0, ratio], "");
    let start = Pose2::new(0.0, 0.0, -0.9);
    let mut world = World::new(&scene, start, ChaCha8Rng::seed_from_u64(0)).expect("it stands");
    step_for(&mut world, 0.5);
    ramp_to(&mut world, -0.6, 0.6);
    while world.pose().heading < -0.15 {
        step_for(&mut world, 0.01);
    }
    let duration = 0.3 / world.twist().yaw_rate;
    let found = means(&mut world, duration);
    let (factor, centre) = coulomb_spin(b, l, ratio, 1.0);
    let way = 0.5 * (found.speed[1] + found.speed[3] - found.speed[0] - found.speed[2]) * rolling_radius(&scene);
    close(way / found.yaw_rate / b, factor, 2e-3, "spin factor");
    close(-found.left / found.yaw_rate, centre, 0.01, "turn centre");

    let everywhere = with(&plain, "floor_grip_patch", &[0.0, 0.0, 2.0, ratio], "");
    close(track_factor_in_spin(&everywhere, 2.5), track_factor_in_spin(&plain, 2.5), 1e-3, "the same grip all round");

    let soft = bench("jnpf_4wd");
    let far = with(&soft, "floor_grip_patch", &[5.0, 5.0, 0.3, 0.5], "");
    assert_eq!(run(&soft, square(1.0)).measured, run(&far, square(1.0)).measured);
    let on_corner = with(&soft, "floor_grip_patch", &[1.15, 0.0, 0.3, 0.5], "");
    let (there, before) = (run(&on_corner, square(1.0)).actual, run(&soft, square(1.0)).actual);
    assert!((there.heading - before.heading).abs() > 5.0 * tick(&soft).1, "a turn that touches it comes out otherwise");
    let (across, before) = (run(&on_corner, straight(3.0)).actual, run(&soft, straight(3.0)).actual);
    assert!(across.distance(before) < 2.0 * tick(&soft).0 && (across.heading - before.heading).abs() < tick(&soft).1);
}

// ── drivetrain and encoders ──

/// The left encoder counts 1 − f of what its wheels turn, the right one all of it; the controller makes the counts equal, so
/// that the left side goes 1/(1 − f) as far: the robot bends to the right by that over the track, and goes farther by half.
#[test]
fn encoder_count_loss() {
    let plain = bench("jnpf_4wd");
    let fraction = 0.01;
    let scene = with(&plain, "encoder_count_loss", &[fraction], "left");
    let (lossy, watch) = watched(&scene, straight(4.0));
    let log = lossy.measured.encoders.as_ref().expect("it is logged");
    let last = log.len() - 1;
    let tick_angle = plain.robot.odometry.angle_of_ticks(1.0);
    for (wheel, kept) in [(0, 1.0 - fraction), (1, 1.0), (2, 1.0 - fraction), (3, 1.0)] {
        let counted = log.radians(last, wheel, &plain.robot.odometry);
        within(counted, kept * watch.turned(last, wheel), tick_angle, "counts");
    }
    let b_eff = track_factor_in_spin(&plain, 2.5) * plain.robot.track_width();
    let before = run(&plain, straight(4.0)).actual.x;
    let more = 1.0 / (1.0 - fraction) - 1.0;
    close(lossy.actual.heading, -more * before / b_eff, 0.015, "bend");
    let arc = lossy.actual.distance(Pose2::IDENTITY) * (1.0 + lossy.actual.heading.powi(2) / 24.0);
    close(arc / before - 1.0, 0.5 * more, 0.02, "distance");
    let right = run(&with(&plain, "encoder_count_loss", &[fraction], "right"), straight(4.0)).actual;
    within(right.heading, -lossy.actual.heading, 2.0 * tick(&plain).1, "mirrored");
}

/// The driver steers by what was true a while ago, and overshoots by more the later it gets it: believed heading and way go
/// beyond the plan. The speed loops sit at the encoders and stay calm. Log stamps are not late: a row has what the wheels had
/// turned at its time, and a replay does not know of the latency.
#[test]
fn encoder_latency() {
    for robot in ["jnpf_4wd", "optiodom", "husky_a200"] {
        let plain = bench(robot);
        let overshoot = |delay: f64| {
            let scene = with(&plain, "encoder_latency", &[delay], "");
            let beyond = |protocol: Protocol, of: fn(Pose2) -> f64| {
                let (run, watch) = watched(&scene, protocol);
                let log = run.measured.encoders.as_ref().expect("it is logged");
                let tick_angle = plain.robot.odometry.angle_of_ticks(1.0);
                for row in 0..log.len() {
                    assert!(watch.excess(&scene, &run, row, 0).abs() < 1.01 * tick_angle, "the log is not late");
                }
                let mut reckoning = DeadReckoning::new(scene.robot.odometry);
                let believed = (0..log.len()).map(|row| {
                    let [left, right] = log.sides(row, &scene.robot.odometry);
                    of(reckoning.update(left, right))
                });
                believed.fold(f64::NEG_INFINITY, f64::max)
            };
            [beyond(spin(FRAC_PI_2), |pose| pose.heading - FRAC_PI_2), beyond(straight(1.0), |pose| pose.x - 1.0)]
        };
        let by_delay: Vec<[f64; 2]> = [0.0, 0.05, 0.1, 0.15].into_par_iter().map(overshoot).collect();
        for pair in by_delay.windows(2) {
            assert!(pair[1][0] > pair[0][0] && pair[1][1] > pair[0][1], "{robot}: {by_delay:?}");
        }
    }
}

/// Play B: in steady motion forward the encoder is B/2 ahead of the wheel (it starts in the middle of the play), backward
/// B/2 behind, so that each reversal shows B which no wheel has turned. What it shows at the end of a run is what the robot
/// believes too much: nothing else changes.
#[test]
fn gear_backlash() {
    let plain = bench("jnpf_4wd");
    let play = 0.02;
    let scene = with(&plain, "gear_backlash", &[play], "");
    let tick_angle = plain.robot.odometry.angle_of_ticks(1.0);
    let b_eff = track_factor_in_spin(&plain, 2.5) * plain.robot.track_width();
    let radius = rolling_radius(&plain);
    for (protocol, reversals) in
        [(straight(1.0), [0, 0]), (straight(3.0), [0, 0]), (spin(PI), [0, 0]), (square(0.6), [7, 0])]
    {
        let (played, watch) = watched(&scene, protocol);
        let last = watch.angles.len() - 1;
        let mut seen = [0; 4];
        let mut direction = [0.0; 4];
        for row in 1..last {
            for wheel in 0..4 {
                // At half a radian a second and more it has gone far beyond the play since it last stood.
                let speed = (watch.turned(row + 1, wheel) - watch.turned(row - 1, wheel)) / 0.04;
                if speed.abs() > 1.0 {
                    let excess = watch.excess(&scene, &played, row, wheel);
                    within(excess, 0.5 * play * speed.signum(), 1.01 * tick_angle, "play in motion");
                    seen[wheel] += usize::from(direction[wheel] * speed < 0.0);
                    direction[wheel] = speed;
                }
            }
        }
        assert_eq!(seen, [reversals[0], reversals[1], reversals[0], reversals[1]], "{protocol:?}");
        let side = |wheels: [usize; 2]| {
            0.5 * wheels.map(|wheel| watch.excess(&scene, &played, last, wheel)).iter().sum::<f64>()
        };
        let (left, right) = (side([0, 2]), side([1, 3]));
        let apart = |of: fn(Pose2) -> f64| of(played.true_error()) - of(run(&plain, protocol).true_error());
        let heading = (right - left) * radius / b_eff;
        within(apart(|pose| pose.heading), -heading, 2.0 * tick(&plain).1, "heading");
        if let Protocol::Straight { .. } = protocol {
            within(apart(|pose| pose.x), -0.5 * (left + right) * radius, 2.0 * tick(&plain).0, "distance");
        }
    }
}

/// The play by itself: closed forms, and turning wheel to encoder and back is the identity, take-up included.
#[test]
fn play_is_undone_by_its_inverse() {
    let mut play = Play::new(0.02);
    let gone = |play: &mut Play, way: f64| play.encoder(way) - way;
    assert!((gone(&mut play, 1.0) - 0.01).abs() < 1e-15, "half of it from its middle");
    assert!((gone(&mut play, -1.0) + 0.02).abs() < 1e-15, "all of it on a reversal");
    assert!(gone(&mut play, -1.0).abs() < 1e-15, "and none going on");
    let (mut there, mut back) = (Play::new(0.02), Play::new(0.02));
    for step in [0.003, 0.5, -0.001, -0.004, 0.002, -0.3, -0.2, 0.0, 0.009, 0.02, -0.006] {
        let encoder = there.encoder(step);
        assert!((back.wheel(encoder) - step).abs() < 1e-15, "{step}");
    }
}

/// Where a drivetrain winds up by c the encoder of a wheel leads its tread by c T. Scrub has T at its full size all through a
/// spin, μ N e/√(e² + (l/2)²) at the loaded radius, e = (b_eff − b)/2 (slip at four points), and friction adds its own; so a
/// robot lags its counts by dψ/dφ c T, as far the other way once it spins back, and its treads' way is that of rigid
/// drivetrains.
#[test]
fn drivetrain_wind_up() {
    let plain = bench("husky_a200");
    let compliance = 8e-3;
    let wound = with(&plain, "drivetrain_wind_up", &[compliance], "");
    let spun = |scene: &Scene, speed: f64| {
        let mut world = settled(scene);
        let (mut now, mut angle) = (0.0f64, 0.0);
        let mut wheels: Vec<WheelSnapshot> = Vec::new();
        [speed, -speed].map(|speed| {
            let [before, after] = [3.0, 1.0].map(|seconds| {
                for _ in 0..(seconds / scene.time_step) as u32 {
                    now += (speed - now).clamp(-2.0 * scene.time_step, 2.0 * scene.time_step);
                    angle += now * scene.time_step;
                    for (index, wheel) in scene.robot.wheels.iter().enumerate() {
                        world.follow(index, if wheel.side == Side::Left { -angle } else { angle });
                    }
                    world.step().expect("it goes on");
                }
                (world.pose().heading, angle)
            });
            world.wheel_snapshots(&mut wheels);
            let torque = wheels.iter().map(|wheel| wheel.motor_torque.abs()).sum::<f64>() / 4.0;
            (after.0, (after.0 - before.0) / (after.1 - before.1), torque)
        })
    };
    let (b, l) = (plain.robot.track_width(), plain.robot.wheelbase());
    let tyre = &plain.robot.wheels[0].tyre;
    let load = plain.robot.mass() * GRAVITY / 4.0;
    let friction = &plain.robot.drivetrain;
    for speed in [0.4, 1.2] {
        let (rigid, elastic) = (spun(&plain, speed), spun(&wound, speed));
        for ((direction, rigid), elastic) in [1.0, -1.0].into_iter().zip(rigid).zip(elastic) {
            let (heading, by_counts, torque) = rigid;
            let e = rolling_radius(&plain) / by_counts - 0.5 * b;
            let scrub = tyre.friction_along * load * e / e.hypot(0.5 * l) * (tyre.free_radius - tyre.squash(load));
            close(torque, scrub, 0.03, "torque of scrub");
            close(elastic.1, by_counts, 1e-3, "the treads' way");
            close(
                elastic.2,
                torque + friction.dry_friction + friction.viscous_friction * speed,
                0.005,
                "and of friction",
            );
            // What winds up is taken implicitly, and may be a step late.
            let late = by_counts * speed * plain.time_step;
            within(heading - elastic.0, direction * by_counts * compliance * elastic.2, late, "lag");
        }
    }
    // Driven by its motors, the encoders are ahead of the wheels by as much, and of rigid ones by a tick.
    let tick_angle = plain.robot.odometry.angle_of_ticks(1.0);
    for (scene, torque) in [(&plain, 0.0), (&wound, spun(&wound, 0.6)[0].2)] {
        let (run, watch) = watched(scene, spin(PI));
        let middle = watch.angles.len() / 2;
        for (wheel, direction) in [(0, -1.0), (1, 1.0), (2, -1.0), (3, 1.0)] {
            let expected = direction * compliance * torque;
            let excess = watch.excess(scene, &run, middle, wheel);
            within(excess, expected, 0.01 * expected.abs() + 1.01 * tick_angle, "ahead in a spin");
        }
    }
}

/// After each stop the wheels go on by the angle in the direction in which they went, and no log shows it: a straight of one
/// stop is longer by R_e times it, whatever its length and either way along; a spin turns farther by 2R_e/b_eff times it.
#[test]
fn stop_overrun() {
    let plain = bench("jnpf_4wd");
    let angle = 0.03;
    let scene = with(&plain, "stop_overrun", &[angle], "");
    let (way_tick, heading_tick) = tick(&plain);
    let radius = rolling_radius(&plain);
    for (protocol, sign) in [(straight(1.0), 1.0), (straight(3.0), 1.0), (reverse(1.0), -1.0)] {
        let more = run(&scene, protocol).true_error().x - run(&plain, protocol).true_error().x;
        within(more, sign * radius * angle, 2.0 * way_tick, "a straight");
    }
    let b_eff = track_factor_in_spin(&plain, 2.5) * plain.robot.track_width();
    for (turn, sign) in [(PI, 1.0), (-PI, -1.0), (3.0 * PI, 1.0)] {
        let more = run(&scene, spin(turn)).true_error().heading - run(&plain, spin(turn)).true_error().heading;
        // The patches are strained one way when they go on, so that nothing of it is lost to their elasticity: 5 %.
        within(
            more,
            sign * 2.0 * radius * angle / b_eff,
            0.05 * 2.0 * radius * angle / b_eff + 2.0 * heading_tick,
            "a spin",
        );
    }
    // Eight stops of a square: the right wheels always went forward, the left ones half the times.
    let (coasted, watch) = watched(&scene, square(1.0));
    let last = watch.angles.len() - 1;
    let tick_angle = plain.robot.odometry.angle_of_ticks(1.0);
    for (wheel, stops) in [0.0, 8.0, 0.0, 8.0].into_iter().enumerate() {
        within(watch.excess(&scene, &coasted, last, wheel), -stops * angle, 9.0 * tick_angle, "lost in a square");
    }
    assert_eq!(coasted.measured.protocol, square(1.0));
    let believed = coasted.odometry.distance(Pose2::IDENTITY);
    assert!(
        believed < 2.0 * run(&plain, square(1.0)).odometry.distance(Pose2::IDENTITY) + 1e-3,
        "it believes it is home"
    );
}

// ── survey: the robot does what it does, and is read otherwise ──

/// A square as it was read under a survey effect, beside the truth at the same rows.
fn read(id: &str, values: &[f64]) -> (SimulatedRun, Vec<(Pose2, Pose2)>) {
    let plain = bench("jnpf_4wd");
    let scene = with(&plain, id, values, "");
    let (before, read) = (run(&plain, square(1.0)), run(&scene, square(1.0)));
    assert_eq!(before.actual, read.actual, "the robot does what it does");
    assert_eq!(before.measured.encoders, read.measured.encoders);
    let pose = |run: &SimulatedRun, row: usize| {
        let pose = run.measured.poses.as_ref().expect("it is read").poses[row];
        Pose2::new(pose.x, pose.y, pose.heading.expect("headings are read"))
    };
    let rows = before.measured.poses.as_ref().map_or(0, |log| log.time.len());
    assert!(rows > 50);
    let end = pose(&read, rows - 1);
    assert_eq!(read.measured.end.map(|end| (end.x, end.y, end.heading)), Some((end.x, end.y, Some(end.heading))));
    let pairs = (0..rows).map(|row| (pose(&before, row), pose(&read, row))).collect();
    (read, pairs)
}

/// Readings are noted to 0.1 µm and 0.1 µrad, each of the two by itself.
const NOTED: f64 = 3e-7;

fn same_pose(found: Pose2, expected: Pose2) {
    assert!(found.distance(expected) < NOTED, "{found:?} against {expected:?}");
    assert!((found.heading - expected.heading).abs() < NOTED, "{found:?} against {expected:?}");
}

fn rotated(pose: Pose2, angle: f64) -> Pose2 {
    let (sin, cos) = angle.sin_cos();
    Pose2::new(cos * pose.x - sin * pose.y, sin * pose.x + cos * pose.y, pose.heading)
}

/// Positions and headings turn by the angle.
#[test]
fn start_heading_error() {
    for (truth, read) in read("start_heading_error", &[0.02]).1 {
        let turned = rotated(truth, 0.02);
        same_pose(read, Pose2::new(turned.x, turned.y, truth.heading + 0.02));
    }
}

/// Positions turn by minus the angle, headings do not.
#[test]
fn tracked_frame_turned() {
    for (truth, read) in read("tracked_frame_turned", &[0.02]).1 {
        same_pose(read, rotated(truth, -0.02));
    }
}

/// The tracked point swings: p + R(θ)a − a. A half turn displaces it by twice the arm, a whole turn not at all.
#[test]
fn survey_lever_arm() {
    let arm = Pose2::new(0.05, -0.03, 0.0);
    for (truth, read) in read("survey_lever_arm", &[arm.x, arm.y]).1 {
        let swung = truth.compose(arm);
        same_pose(read, Pose2::new(swung.x - arm.x, swung.y - arm.y, truth.heading));
    }
    let scene = with(&bench("jnpf_4wd"), "survey_lever_arm", &[arm.x, arm.y], "");
    let turned = |turn: f64| {
        let run = run(&scene, spin(turn));
        let end = run.measured.end.expect("it is read");
        (end.x - run.actual.x, end.y - run.actual.y, run.actual.heading)
    };
    // The robot does not turn by its nominal angle: what is missing to half a turn swings the arm by so much less.
    let (x, y, heading) = turned(PI);
    within(x, -2.0 * arm.x, arm.x.hypot(arm.y) * (heading - PI).abs() + NOTED, "half a turn");
    within(y, -2.0 * arm.y, arm.x.hypot(arm.y) * (heading - PI).abs() + NOTED, "half a turn");
}

/// Lengths are longer by the ratio, headings as they are.
#[test]
fn survey_scale() {
    for (truth, read) in read("survey_scale", &[0.01]).1 {
        same_pose(read, Pose2::new(1.01 * truth.x, 1.01 * truth.y, truth.heading));
    }
}

/// Poses stay, their stamps are rate · t + offset (noted to a microsecond); and offsets of runs scatter as stated (120 of
/// them: within 20 % with a probability of 0.998, χ²).
#[test]
fn survey_time_offset() {
    let (run, pairs) = read("survey_time_offset", &[0.3, 0.002, 0.0]);
    let stamps = &run.measured.poses.as_ref().expect("it is read").time;
    for (row, (truth, read)) in pairs.into_iter().enumerate() {
        same_pose(read, truth);
        let time = if row + 1 < stamps.len() { 0.1 * row as f64 } else { run.simulated };
        assert!((stamps[row] - (1.002 * time + 0.3)).abs() < 1e-6);
    }
    let mut scene = with(&bench("jnpf_4wd"), "survey_time_offset", &[0.0, 0.0, 0.1], "");
    scene.robot.driver.pause = 0.02;
    let offsets: Vec<f64> = (0..120)
        .into_par_iter()
        .map(|index| {
            let task = Task::new(format!("run {index}"), straight(0.01));
            let run = drive::run(&scene, &task, 1, None, &AtomicBool::new(false)).expect("it can be driven");
            run.measured.poses.expect("it is read").time[0]
        })
        .collect();
    let mean = offsets.iter().sum::<f64>() / 120.0;
    let deviation = (offsets.iter().map(|offset| (offset - mean).powi(2)).sum::<f64>() / 119.0).sqrt();
    close(deviation, 0.1, 0.2, "offsets of runs");
}

// ── the registry ──

/// Robots, and on them scenes in which every effect has something to add to: each once with other causes in it already.
fn scenes() -> Vec<Scene> {
    let mut scenes = Vec::new();
    for robot in ["jnpf_4wd", "husky_a200", "optiodom"] {
        let plain = bench(robot);
        let causes: Vec<Cause> = small(&plain).into_iter().map(|(cause, _)| cause).collect();
        scenes.push(Cause::edit_all(&causes, &plain));
        scenes.push(plain);
    }
    scenes
}

/// Every effect that applies to `scene`, small, and twice as large. Where parameters are not sizes (a place, a heading) they
/// stay.
fn small(scene: &Scene) -> Vec<(Cause, Cause)> {
    let applying = EFFECTS.iter().filter(|effect| effect.applies(scene));
    applying
        .map(|effect| {
            let sized = |size: f64| {
                let values = effect.parameters.iter().map(|parameter| match parameter.name {
                    "ratio" => 1.0 + size,
                    "downhill_heading_rad" => 0.7,
                    "radius_m" => 0.3,
                    "run_offset_std_s" => 0.0,
                    "x_m" | "y_m" if effect.id == "floor_grip_patch" => 0.4,
                    _ => size,
                });
                let choice = effect.choices(scene).remove(0);
                Cause { effect, choice, values: values.collect() }
            };
            (sized(1e-3), sized(2e-3))
        })
        .collect()
}

/// Every number of a scene.
fn numbers(scene: &Scene) -> Vec<f64> {
    let text = format!("{scene:?}");
    text.split(|c: char| !(c.is_ascii_alphanumeric() || "+-.".contains(c)))
        .filter_map(|word| word.parse().ok())
        .collect()
}

/// At zero an effect changes no number of a scene, to the last bit, whatever else is in it; a run in it has the same bits.
#[test]
fn effects_are_the_identity_at_zero() {
    for scene in scenes() {
        for effect in EFFECTS.iter().filter(|effect| effect.applies(&scene)) {
            for choice in effect.choices(&scene) {
                let nothing = Cause { choice, ..effect.nothing() };
                if effect.id != "floor_grip_patch" {
                    nothing.check(&scene).expect("nothing is allowed");
                }
                assert_eq!(format!("{:?}", nothing.edit(&scene)), format!("{scene:?}"), "{}", effect.id);
            }
        }
    }
    let plain = bench("jnpf_4wd");
    let before = run(&plain, square(0.5));
    EFFECTS.par_iter().filter(|effect| effect.applies(&plain)).for_each(|effect| {
        let nothing = Cause { choice: effect.choices(&plain).remove(0), ..effect.nothing() };
        let run = run(&nothing.edit(&plain), square(0.5));
        assert_eq!((run.measured, run.actual), (before.measured.clone(), before.actual), "{}", effect.id);
    });
}

/// Effects are increments on the scene as given: twice a small one is one of twice the size, to the second order of its
/// size (1e-3), and something moves by the first.
#[test]
fn effects_are_increments() {
    for scene in scenes() {
        for (once, double) in small(&scene) {
            let id = once.effect.id;
            if id == "floor_grip_patch" {
                // In the middle of it, half over another one as well as alone, and at the other's edge.
                for given in [&scene, &with(&scene, id, &[0.7, 0.4, 0.3, 0.5], "")] {
                    let (twice, at_once) = (once.edit(&once.edit(given)), double.edit(given));
                    for x in [0.2, 0.4, 0.6] {
                        let grip = |scene: &Scene| scene.floor.grip_ratio_at(x, 0.4);
                        assert!((grip(&twice) / grip(&at_once) - 1.0).abs() < 2e-6, "{id}");
                        assert!((grip(&at_once) / grip(given) - 1.002).abs() < 1e-9, "{id}");
                    }
                }
                continue;
            }
            let (twice, at_once) = (once.edit(&once.edit(&scene)), double.edit(&scene));
            let (before, twice, at_once) = (numbers(&scene), numbers(&twice), numbers(&at_once));
            assert!(before.len() == twice.len() && before.len() == at_once.len());
            let mut moved: f64 = 0.0;
            for ((before, twice), at_once) in before.iter().zip(&twice).zip(&at_once) {
                // 4 ε² of a number's own size, or of 1 for those that are nothing before; k² works through its square.
                let size = before.abs().max(1.0);
                assert!((twice - at_once).abs() < 8e-6 * size, "{id}: {before} → {twice} or {at_once}");
                moved = moved.max((at_once - before).abs() / before.abs().max(1e-3));
            }
            assert!(moved > 4e-4, "{id} moves something: {moved}");
        }
    }
    // Independent scatters add as their squares do.
    let scene = with(&bench("jnpf_4wd"), "survey_time_offset", &[0.0, 0.0, 0.3], "");
    within(with(&scene, "survey_time_offset", &[0.0, 0.0, 0.4], "").survey.time_offset_std, 0.5, 1e-12, "σ");
}

/// Every effect states what it is, what shows it and where it comes from; its parameters have a unit or none in their name,
/// bounds that hold the prior's centre, and nothing outside them is taken.
#[test]
fn every_entry_is_complete_and_bounded() {
    let scenes = [bench("jnpf_4wd"), bench("optiodom"), bench("husky_a200")];
    for effect in &EFFECTS {
        assert!(effect.cause.len() > 20 && effect.shown_by.len() > 10 && effect.source.len() > 5, "{}", effect.id);
        let scene = scenes.iter().find(|scene| effect.applies(scene)).expect("some robot has the part");
        let choice = effect.choices(scene).remove(0);
        for (index, parameter) in effect.parameters.iter().enumerate() {
            let [least, greatest] = parameter.bounds;
            let centre = match parameter.prior {
                Prior::Normal { mean, .. } => mean,
                Prior::HalfNormal { .. } | Prior::AnyHeading | Prior::OnPath => 0.0,
                Prior::Known(value) => value,
            };
            assert!(least <= centre && centre < greatest && !parameter.meaning.is_empty(), "{}", effect.id);
            let dimensionless =
                ["ratio", "ratio_minus_one", "rate_minus_one", "fraction", "coefficient", "gradient", "per_hour"];
            let unit = ["_m", "_rad", "_s", "_rad_nm"].iter().any(|unit| parameter.name.ends_with(unit));
            assert!(unit || dimensionless.contains(&parameter.name), "{}.{}", effect.id, parameter.name);
            for (value, allowed) in [(least, true), (greatest, true), (least - 1e-6, false), (greatest + 1e-6, false)] {
                let mut cause = Cause { choice: choice.clone(), ..effect.nothing() };
                cause.values[index] = value;
                let checked = cause.check(scene);
                assert_eq!(checked.is_ok(), allowed, "{}.{} = {value}", effect.id, parameter.name);
                assert!(allowed || matches!(checked, Err(EffectError::OutOfBounds { .. })));
            }
            // The prior and what is allowed go together: four σ are allowed.
            if let Prior::Normal { std_dev, .. } | Prior::HalfNormal { std_dev } = parameter.prior {
                assert!(std_dev > 0.0 && greatest > centre + 4.0 * std_dev, "{}.{}", effect.id, parameter.name);
            }
        }
    }
}

/// What `--set` takes and refuses.
#[test]
fn settings_become_causes_or_errors() {
    let scene = bench("jnpf_4wd");
    let parse = |settings: &[&str]| {
        let settings: Vec<String> = settings.iter().map(|setting| (*setting).to_owned()).collect();
        Cause::from_settings(&settings, &scene)
    };
    let causes = parse(&[
        "floor_slope.gradient=0.01",
        "wheel_toe.angle_rad=0.02",
        "floor_slope.downhill_heading_rad=1.5",
        "wheel_toe.wheel=rear_left",
        "wheel_toe.angle_rad=-0.01",
        "wheel_toe.wheel=front_left",
        "floor_grip_patch.ratio=0.7",
    ])
    .expect("all of it is allowed");
    let lines: Vec<String> = causes.iter().map(Cause::line).collect();
    assert_eq!(
        lines,
        [
            "floor_slope: gradient 0.0100, downhill_heading_rad 1.5000",
            "wheel_toe: angle_rad 0.0200, wheel rear_left",
            "wheel_toe: angle_rad -0.0100, wheel front_left",
            "floor_grip_patch: x_m 0.0000, y_m 0.0000, radius_m 0.3000, ratio 0.7000",
        ]
    );
    for (settings, parts) in [
        ("floor_slope=0.01", &["--set floor_slope=0.01", "EFFECT.PARAMETER=VALUE"][..]),
        ("floor_slope.gradient", &["EFFECT.PARAMETER=VALUE"]),
        ("floor_tilt.gradient=0.01", &["`floor_tilt`: no such effect", "floor_slope"]),
        ("floor_slope.angle_rad=0.01", &["floor_slope: no parameter `angle_rad`", "gradient, downhill_heading_rad"]),
        ("floor_slope.gradient=steep", &["floor_slope.gradient = steep", "finite number"]),
        ("floor_slope.gradient=nan", &["finite number"]),
        ("floor_slope.gradient=-0.01", &["floor_slope.gradient = -0.01", "between 0 and 0.3"]),
        ("wheel_toe.angle_rad=0.01", &["wheel_toe.wheel = \"\"", "front_left, front_right, rear_left, rear_right"]),
        ("encoder_count_loss.side=middle", &["encoder_count_loss.side = \"middle\"", "left, right"]),
        ("caster_drag.coefficient=0.1", &["caster_drag", "needs a caster", "`jnpf_4wd`"]),
    ] {
        let error = parse(&[settings]).expect_err(settings).to_string();
        for part in parts {
            assert!(error.contains(part), "{settings}: expected `{part}` in {error}");
        }
    }
}

/// What a diagnosis writes is what every command reads: the same scene, number by number, also through two files.
#[test]
fn an_extended_model_reads_as_it_was_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, model: &ExtendedModel| {
        let path = folder.path().join(name);
        std::fs::write(&path, model.to_toml()).expect("it can be written");
        path.to_string_lossy().into_owned()
    };
    for robot in ["jnpf_4wd", "optiodom"] {
        let plain = Scene::load(robot, "tilted_floor").expect("shipped");
        let causes: Vec<Cause> = small(&plain).into_iter().map(|(cause, _)| cause).collect();
        let (first, second) = causes.split_at(7);
        let noise = NoiseModel {
            position_std: 0.002,
            heading_std: 0.003,
            correlation_time: 0.3,
            clock_std: 0.0,
            scatter: Scatter::default(),
        };
        let residues = vec![Residue {
            condition: "square 2 m cw".to_owned(),
            start: [0.0, 0.1, 0.2],
            runs: 5.0,
            frame_at: Some(0.01),
            at: vec![1.0, 2.0],
            x: vec![0.001, 0.002],
            y: vec![-0.001, 0.0],
            heading: vec![0.003, 0.004],
            noise,
        }];
        let terms = [
            EmpiricalTerm { part: TermPart::Yaw, feature: Feature::SpeedTime, coefficient: 0.1 + 0.2 },
            EmpiricalTerm { part: TermPart::Potential, feature: Feature::XY, coefficient: -0.7 },
        ];
        let model = |base: &str, causes: &[Cause], empirical: &[EmpiricalTerm]| ExtendedModel {
            base: base.to_owned(),
            contact: None,
            description: "a \"test\"".to_owned(),
            causes: causes.to_vec(),
            empirical: empirical.to_vec(),
            doubt: Doubt { motion: 1e-4 * empirical.len() as f64, response: 0.1, ..Doubt::default() },
            residues: residues.clone(),
        };
        let one = model(robot, first, &terms);
        let inner = write("inner.toml", &one);
        assert_eq!(ExtendedModel::read(Path::new(&inner)).expect("it reads"), Some(one));
        // The base stands beside the file that names it.
        let outer = write("outer.toml", &model("inner.toml", second, &[]));
        let mut expected = Cause::edit_all(&causes, &plain);
        expected.empirical.extend(terms);
        let doubt = Doubt { motion: 2e-4, response: 0.1, ..Doubt::default() };
        expected.robot.doubt = plain.robot.doubt.widest(doubt);
        expected.robot.residues = residues;
        let mut read = load_scene(&outer, "tilted_floor").expect("it reads");
        assert_eq!(read.robot.file, Path::new(&outer));
        read.robot.file.clone_from(&expected.robot.file);
        assert_eq!(format!("{read:?}"), format!("{expected:?}"));
    }
    let hard = folder.path().join("hard.toml");
    let text = "format = \"treadmark-extended-robot/1\"\nbase = \"jnpf_4wd\"\ncontact = \"rigid\"\n";
    std::fs::write(&hard, text).expect("it can be written");
    let read = ExtendedModel::read(&hard).expect("it reads").expect("it is one");
    assert_eq!(read.to_toml().matches("contact = \"rigid\"").count(), 1);
    assert_eq!(load_scene(&hard.to_string_lossy(), "lab_floor").expect("it reads").contact, Contact::Rigid);
    let refused = |text: &str, parts: &[&str]| {
        let path = folder.path().join("bad.toml");
        std::fs::write(&path, format!("format = \"treadmark-extended-robot/1\"\n{text}")).expect("it can be written");
        let error = load_scene(&path.to_string_lossy(), "lab_floor").expect_err(text).to_string();
        assert!(error.contains("bad.toml"), "{error}");
        for part in parts {
            assert!(error.contains(part), "expected `{part}` in {error}");
        }
    };
    refused("base = \"bad.toml\"", &["in a circle"]);
    refused("base = \"jnpf_4wd\"\nbasis = 1", &["line 3", "basis"]);
    refused("base = \"jnpf_4wd\"\ncontact = \"soft\"", &["line 3", "soft", "patch", "rigid"]);
    let across = "[[effects]]\neffect = \"tyre_grip_anisotropy\"\nratio_minus_one = 0.1";
    refused(
        &format!("base = \"jnpf_4wd\"\ncontact = \"rigid\"\n{across}"),
        &["tyre_grip_anisotropy", "needs tyres on contact patches"],
    );
    refused("base = \"jnpf_4wd\"\n[[effects]]\neffect = \"tilt\"", &["`tilt`: no such effect"]);
    refused("base = \"jnpf_4wd\"\n[[effects]]\ngradient = 1", &["no such effect"]);
    let moves = "base = \"jnpf_4wd\"\n[[empirical]]\npart = \"potential\"\nfeature = \"speed\"\ncoefficient = 1.0";
    refused(moves, &["[[empirical]]", "U = +1.0000e0 v", "one of x², x y or y²"]);
    let odd = "base = \"jnpf_4wd\"\n[[residue]]\ncondition = \"spin\"\nstart = [0.0, 0.0, 0.0]\nruns = 5\nat = [1.0]\nx = [0.0]\n\
               y = [0.0, 1.0]\n[residue.noise]\nposition_std = 0.002\nheading_std = 0.003\ncorrelation_time = 0.0\n\
               clock_std = 0.0\n[residue.noise.scatter]\nheading_per_corner = 0.0\nheading_per_sqrt_metre = 0.0\ndistance = 0.0";
    refused(odd, &["residue of `spin`", "1, 2, 0, 1 numbers"]);
    refused("base = \"jnpf_4wd\"\n[[effects]]\neffect = \"floor_slope\"\nslope = 1", &["no parameter `slope`"]);
    refused("base = \"jnpf_4wd\"\n[[effects]]\neffect = \"floor_slope\"\ngradient = 1", &["between 0 and 0.3"]);
    refused("base = \"jnpf_4wd\"\n[[effects]]\neffect = \"caster_drag\"\ncoefficient = 0.1", &["needs a caster"]);
}

// ── replay ──

/// How far a replay was from the truth, at worst on the way: position \[m\], heading \[rad\].
fn replay_error(scene: &Scene, run: &Run, times: &[f64], truth: &[Pose2]) -> (f64, f64) {
    let trace = drive::replay(scene, run, &scene.robot.odometry, &AtomicBool::new(false)).expect("it can be replayed");
    let start = trace.at(times[0]);
    let (mut position, mut heading) = (0.0f64, 0.0f64);
    for (&time, &truth) in times.iter().zip(truth) {
        let replayed = start.relative(trace.at(time));
        position = position.max(replayed.distance(truth));
        heading = heading.max((replayed.heading - truth.heading).abs());
    }
    (position, heading)
}

/// What the log leaves open, with the robot within `reach` \[m\] of where it started and turning by `turn` \[rad\] in all. Between
/// rows of 20 ms a way that accelerates is no farther aside than a straight line would be, a dt²/8, twice where the driver's
/// commands step. A staircase of ticks shakes the slip of a scrubbing tyre by δ = tick/20 ms, 4 % of its slip speed, which takes
/// (δ/e)²/24 of the friction: below 1e-4 of the turn.
fn left_open(scene: &Scene, reach: f64, turn: f64) -> (f64, f64) {
    open_by(scene, 0.02f64.powi(2) / 4.0, reach, 1e-4 * turn)
}

/// The same where an acceleration takes a wheel so many s² times it aside, and the heading is off by `slip` besides. Each side is
/// known to half a tick at both ends of any stretch: two ticks of both sides over the track. A position inherits the heading's
/// error over the reach.
fn open_by(scene: &Scene, aside: f64, reach: f64, slip: f64) -> (f64, f64) {
    let (way, heading) = tick(scene);
    let driver = &scene.robot.driver;
    let b = scene.robot.odometry.track_width;
    let heading = 2.0 * heading + aside * (2.0 * driver.acceleration / b).max(driver.turn_acceleration) + slip;
    (2.0 * way + aside * driver.acceleration + heading * reach, heading)
}

/// Replaying a run's own log makes the wheels turn as they turned, and so the body moves as it moved.
#[test]
fn a_replay_of_its_own_log_goes_where_the_run_went() {
    let circle = |radius: f64| Protocol::Circle { radius, turn: Some(TAU), direction: Rotation::Clockwise };
    let cases: Vec<(&str, Protocol, f64)> = ["jnpf_4wd", "optiodom", "husky_a200"]
        .into_iter()
        .flat_map(|robot| [(robot, square(1.0), 1.5), (robot, circle(0.7), 1.4), (robot, spin(2.5 * PI), 0.1)])
        .collect();
    cases.into_par_iter().for_each(|(robot, protocol, reach)| {
        let scene = bench(robot);
        let (run, watch) = watched(&scene, protocol);
        let log = run.measured.encoders.as_ref().expect("it is logged");
        let (position, heading) = replay_error(&scene, &run.measured, &log.time, &watch.truth);
        let (open, open_heading) = left_open(&scene, reach, 4.0 * PI);
        assert!(position < open && heading < open_heading, "{robot} {protocol:?}: {position:.2e} m, {heading:.2e} rad");
    });
}

/// Replays of two logs of one run end within what is open: position \[m\], heading \[rad\].
fn replays_end_alike(scene: &Scene, logs: [&Run; 2], (open, open_heading): (f64, f64), what: &str) {
    let [one, other] = logs.map(|run| {
        let trace = drive::replay(scene, run, &scene.robot.odometry, &AtomicBool::new(false)).expect("it goes");
        *trace.poses.last().expect("it has a start")
    });
    let (position, heading) = (other.distance(one), (other.heading - one.heading).abs());
    assert!(
        position < open && heading < open_heading,
        "{what}: {position:.2e} of {open:.2e} m, {heading:.2e} of {open_heading:.2e} rad"
    );
}

/// Between rows wheels turn as smoothly as they did: three rows of four left out, which leaves 12.5 Hz, a replay ends where that of
/// the whole log does. A parabola through three rows is a dt²/32 aside where an acceleration sets in, twice where the driver's
/// commands step. On straight lines between rows it turned 5.6 mrad less a square.
#[test]
fn a_replay_of_few_rows_goes_where_that_of_all_goes() {
    ["jnpf_4wd", "optiodom", "husky_a200"].into_par_iter().for_each(|robot| {
        let scene = bench(robot);
        let (run, _) = watched(&scene, square(1.0));
        let mut thinned = run.measured.clone();
        let log = thinned.encoders.as_mut().expect("it is logged");
        let (width, last) = (log.channels.len(), log.len() - 1);
        let rows: Vec<usize> = (0..last).step_by(4).chain([last]).collect();
        log.counts = rows.iter().flat_map(|row| &log.counts[row * width..(row + 1) * width]).copied().collect();
        log.time = rows.iter().map(|&row| log.time[row]).collect();
        let open = open_by(&scene, 0.08f64.powi(2) / 16.0, 1.5, 0.0);
        replays_end_alike(&scene, [&run.measured, &thinned], open, robot);
    });
}

/// Wheels do not shake with what rows are off by: more of them than there are ticks to tell apart, stamps that are off by 2 ms, or
/// rows that are held up, a replay ends where that of the log does. The JNPF-4WD turned by up to 94 mrad more a square.
#[test]
fn a_replay_does_not_shake() {
    type Change = fn(&mut Vec<f64>, &mut Vec<f64>, usize);
    let changes: [(&str, Change); 3] = [
        ("four rows for one", |time, counts, width| {
            let rows = time.len();
            let part = |values: &dyn Fn(usize) -> f64, quarter: usize| {
                let (row, part) = (quarter / 4, (quarter % 4) as f64 / 4.0);
                values(row) + part * (values((row + 1).min(rows - 1)) - values(row))
            };
            let quarters = 0..4 * (rows - 1) + 1;
            let counted = quarters.clone().flat_map(|quarter| {
                (0..width).map(|wheel| part(&|row| counts[row * width + wheel], quarter).floor()).collect::<Vec<_>>()
            });
            let (counted, stamps) =
                (counted.collect(), quarters.map(|quarter| part(&|row| time[row], quarter)).collect());
            (*counts, *time) = (counted, stamps);
        }),
        ("stamps that are off", |time, _, _| {
            let mut latest = 0.0f64;
            for (row, time) in time.iter_mut().enumerate() {
                // Of no pattern that a smoother could like: the fractional parts of multiples of √2.
                let off = (row as f64 * 2f64.sqrt()).fract() - 0.5;
                latest = latest.max(*time + 0.002 * 12f64.sqrt() * off);
                *time = latest;
            }
        }),
        ("rows that are held up", |time, _, _| {
            let mut free = 0.0f64;
            for (row, time) in time.iter_mut().enumerate() {
                if row % 47 == 13 {
                    free = *time + 0.055;
                }
                *time = time.max(free);
            }
        }),
    ];
    let robots = ["jnpf_4wd", "optiodom", "husky_a200"];
    let cases = robots.iter().flat_map(|robot| changes.iter().map(move |change| (robot, change)));
    cases.collect::<Vec<_>>().into_par_iter().for_each(|(robot, (how, change))| {
        let scene = bench(robot);
        let (run, _) = watched(&scene, square(1.0));
        let mut changed = run.measured.clone();
        let log = changed.encoders.as_mut().expect("it is logged");
        change(&mut log.time, &mut log.counts, log.channels.len());
        let open = left_open(&scene, 1.5, TAU);
        replays_end_alike(&scene, [&run.measured, &changed], open, &format!("{robot} {how}"));
    });
}

/// A spot that is simulated while a run passes it does what it does on the whole way, to within a hundredth of it: on a level
/// floor with one spot nothing else hangs on where in the room the robot is. What differs is on its counts: a tick of slip,
/// which the driver drives off on the next leg. Where the floor is what it was, the copies of a run go on as it does. Rigid
/// cylinders under a driver are left out: whatever is changed, a corner of theirs comes out otherwise by up to a centimetre.
#[test]
fn a_spot_in_passing_does_what_it_does_on_the_whole_way() {
    let places = [[1.0, 1.0, 0.65], [1.0, 0.9, 0.5], [0.8, 1.0, 0.4]];
    let contacts = [(Contact::Patch, false), (Contact::Patch, true), (Contact::Rigid, false), (Contact::Rigid, true)];
    let cases = contacts.into_iter().flat_map(|contact| places.map(|place| (contact, place)));
    cases.collect::<Vec<_>>().into_par_iter().for_each(|((contact, logged), [x, y, ratio])| {
        let mut scene = bench("jnpf_4wd");
        scene.contact = contact;
        let (run, _) = watched(&scene, square(1.0));
        let run = Run { encoders: run.measured.encoders.filter(|_| logged), poses: None, ..run.measured };
        let spot = Effect::named("floor_grip_patch").expect("known").nothing();
        let spotted = Cause { values: vec![x, y, 0.3, ratio], ..spot }.edit(&scene);
        let go_on = AtomicBool::new(false);
        let simulator = Simulator::new(&scene, &go_on);
        let counted = scene.robot.odometry;
        let whole = |scene: &Scene| simulator.trace(scene, &run, &counted).expect("it can be driven");
        let floor = |scene: &Scene| SpottedFloor { regions: scene.floor.regions.clone(), place: [x, y], reach: 0.7 };
        let floors = [floor(&scene), floor(&spotted)];
        let in_passing = simulator.traces_on(&scene, &run, &counted, &floors).expect("it can be driven");
        let end = |trace: &Trace| *trace.poses.last().expect("it has a start");
        let off = |one: Pose2, other: Pose2| (one.distance(other), (one.heading - other.heading).abs());

        let given = whole(&scene);
        assert_eq!(in_passing[0].time, given.time);
        for (copy, pose) in in_passing[0].poses.iter().zip(&given.poses) {
            let (position, heading) = off(*copy, *pose);
            assert!(position < 1e-12 && heading < 1e-12, "{contact:?} {logged}: a copy strays by {position:.1e} m");
        }
        let (moved, turned) = off(end(&whole(&spotted)), end(&given));
        assert!(moved > 0.01 && turned > 0.005, "{contact:?} {logged}: it does little, {moved:.1e} m, {turned:.1e} rad");
        if contact == Contact::Patch || logged {
            let (position, heading) = off(end(&in_passing[1]), end(&whole(&spotted)));
            let (way, tick) = tick(&scene);
            assert!(
                position < 0.01 * moved + way && heading < 0.01 * turned + tick,
                "{contact:?} {logged} ({x}, {y}), {ratio}: {position:.1e} of {moved:.1e} m, {heading:.1e} of {turned:.1e} rad"
            );
        }
    });
}

/// A replay undoes what the scene's encoders do: lost counts, play, wind-up and overrun included, the path is that of the run.
/// Without knowing of them it is another one.
#[test]
fn a_replay_undoes_what_encoders_do() {
    for robot in ["jnpf_4wd", "optiodom", "husky_a200"] {
        let plain = bench(robot);
        let cases = [("encoder_count_loss", 0.01, "left"), ("gear_backlash", 0.02, ""), ("stop_overrun", 0.03, "")];
        // How far a standing wheel was wound up while it coasted is on no log either.
        let winds_up = plain.robot.drivetrain.wind_up.map(|_| ("drivetrain_wind_up", 8e-3, ""));
        let all = cases.iter().fold(plain.clone(), |scene, (id, value, choice)| with(&scene, id, &[*value], choice));
        let scenes = cases
            .iter()
            .chain(&winds_up)
            .map(|(id, value, choice)| (*id, with(&plain, id, &[*value], choice)))
            .chain([("all three", all)])
            .collect::<Vec<_>>();
        scenes.into_par_iter().for_each(|(id, scene)| {
            let (run, watch) = watched(&scene, square(1.0));
            let log = run.measured.encoders.as_ref().expect("it is logged");
            // When in a stop the wheels went on is on no log: paths are compared where all wheels count.
            let width = log.channels.len();
            let counts = |row: usize, wheel: usize| log.counts[row * width + wheel];
            let moving = |row: usize| {
                let counted = |from: usize, to: usize| (0..width).all(|wheel| counts(from, wheel) != counts(to, wheel));
                row == 0 || row >= 5 && row + 5 < log.len() && counted(row - 5, row) && counted(row, row + 5)
            };
            let rows: Vec<usize> = (0..log.len()).filter(|&row| moving(row)).collect();
            let times: Vec<f64> = rows.iter().map(|&row| log.time[row]).collect();
            let truth: Vec<Pose2> = rows.iter().map(|&row| watch.truth[row]).collect();
            let (position, heading) = replay_error(&scene, &run.measured, &times, &truth);
            let unaware = replay_error(&plain, &run.measured, &times, &truth);
            // Besides, each of eight stops and reversals is known to a tick: √8 of them.
            let (open, open_heading) = left_open(&scene, 1.5, TAU);
            let (way, angle) = tick(&scene);
            let (open, open_heading) = (open + 3.0 * (way + 1.5 * angle), open_heading + 3.0 * angle);
            assert!(
                position < open && heading < open_heading,
                "{robot} {id}: {position:.2e} m, {heading:.2e} rad, allowed {open:.2e}, {open_heading:.2e}"
            );
            assert!(unaware.1 > 2.0 * heading, "{robot} {id}: {unaware:?}");
        });
    }
}

/// A latency is not in the log, and a replay does not know of it.
#[test]
fn a_replay_is_blind_to_latency() {
    let plain = bench("jnpf_4wd");
    let late = with(&plain, "encoder_latency", &[0.1], "");
    let run = run(&late, square(0.5)).measured;
    let of =
        |scene: &Scene| drive::replay(scene, &run, &plain.robot.odometry, &AtomicBool::new(false)).expect("it goes");
    assert_eq!(of(&plain), of(&late));
}

/// A log that begins in motion is replayed after a run-up: the second part of a run goes where it went.
#[test]
fn a_replay_of_the_second_half_goes_where_it_went() {
    let circle = Protocol::Circle { radius: 0.7, turn: Some(TAU), direction: Rotation::CounterClockwise };
    let cases: Vec<(&str, Protocol, f64)> = ["jnpf_4wd", "optiodom", "husky_a200"]
        .into_iter()
        .flat_map(|robot| [(robot, square(1.0), 1.5), (robot, circle, 1.4), (robot, spin(4.0 * PI), 0.1)])
        .collect();
    cases.into_par_iter().for_each(|(robot, protocol, reach)| {
        let scene = bench(robot);
        let (run, watch) = watched(&scene, protocol);
        let mut cut = run.measured;
        let log = cut.encoders.as_mut().expect("it is logged");
        // In the middle of a side, of a circle, of a spin, all wheels turn.
        let middle = (log.len() / 2..log.len())
            .find(|&row| {
                (0..watch.angles[0].len())
                    .all(|wheel| (watch.turned(row, wheel) - watch.turned(row - 20, wheel)).abs() > 0.1)
            })
            .expect("it goes on");
        log.time.drain(..middle);
        log.counts.drain(..middle * log.channels.len());
        let times = log.time.clone();
        cut.start = Some(watch.truth[middle]);
        let truth: Vec<Pose2> = watch.truth[middle..].iter().map(|pose| watch.truth[middle].relative(*pose)).collect();
        let (position, heading) = replay_error(&scene, &cut, &times, &truth);
        let (open, open_heading) = left_open(&scene, reach, 4.0 * PI);
        assert!(position < open && heading < open_heading, "{robot} {protocol:?}: {position:.2e} m, {heading:.2e} rad");
        let trace = drive::replay(&scene, &cut, &scene.robot.odometry, &AtomicBool::new(false)).expect("it goes");
        let began = trace.at(times[0]);
        assert!(began.distance(watch.truth[middle]) < 0.02, "it arrives where it was: {began:?}");
    });
}
