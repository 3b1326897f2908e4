//! A test bench: shipped robots made ideal, worlds stepped by hand, steady states measured.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use std::sync::atomic::AtomicBool;
use treadmark::dataset::Protocol;
use treadmark::drive::{self, SimulatedRun, Task};
use treadmark::geometry::Pose2;
use treadmark::scene::{Scene, Side, Tyre};
use treadmark::world::World;

/// A shipped robot on the level floor, without noise or scatter, with tyres of one radius.
pub fn ideal(robot: &str) -> Scene {
    let mut scene = Scene::load(robot, "lab_floor").expect("shipped").noise_free();
    let wheels = &mut scene.robot.wheels;
    let mean = wheels.iter().map(|wheel| wheel.tyre.free_radius).sum::<f64>() / wheels.len() as f64;
    for wheel in wheels {
        wheel.tyre.free_radius = mean;
    }
    scene
}

/// A world over the origin, at rest after half a second.
pub fn settled(scene: &Scene) -> World {
    let mut world = World::new(scene, Pose2::IDENTITY, ChaCha8Rng::seed_from_u64(0)).expect("it stands");
    step_for(&mut world, 0.5);
    world
}

/// Steps for `seconds`.
pub fn step_for(world: &mut World, seconds: f64) {
    let end = world.time() + seconds;
    while world.time() < end - 1e-9 {
        world.step().expect("it goes on");
    }
}

/// Asks the left and right wheels for speeds \[rad/s\], ramped up over a second.
pub fn ramp_to(world: &mut World, left: f64, right: f64) {
    let sides: Vec<Side> = world.scene().robot.wheels.iter().map(|wheel| wheel.side).collect();
    for part in 1..=20 {
        for (wheel, side) in sides.iter().enumerate() {
            let speed = if *side == Side::Left { left } else { right };
            world.command(wheel, speed * f64::from(part) / 20.0);
        }
        step_for(world, 0.05);
    }
}

/// Mean wheel rotation since the start of the left and right sides \[rad\].
pub fn rotation(world: &World) -> [f64; 2] {
    [Side::Left, Side::Right].map(|side| {
        let wheels = world.scene().robot.wheels.iter().enumerate().filter(|(_, wheel)| wheel.side == side);
        let angles: Vec<f64> = wheels.map(|(index, _)| world.wheel_angle(index)).collect();
        angles.iter().sum::<f64>() / angles.len() as f64
    })
}

/// b_eff/b in a steady spin at wheel speed `speed` \[rad/s\]: the wheels' way over what the body turned.
pub fn track_factor_in_spin(scene: &Scene, speed: f64) -> f64 {
    let mut world = settled(scene);
    ramp_to(&mut world, -speed, speed);
    step_for(&mut world, 2.0);
    let (wheels, heading) = (rotation(&world), world.pose().heading);
    step_for(&mut world, 4.0);
    let [left, right] = rotation(&world);
    let way = ((right - wheels[1]) - (left - wheels[0])) * rolling_radius(scene);
    way / (world.pose().heading - heading) / scene.robot.track_width()
}

/// R_e of the first wheel under its share of the weight \[m\] (equal loads).
pub fn rolling_radius(scene: &Scene) -> f64 {
    let tyre = &scene.robot.wheels[0].tyre;
    tyre.rolling_radius(tyre.squash(scene.robot.mass() * treadmark::scene::GRAVITY / scene.robot.wheels.len() as f64))
}

/// One run of `protocol`.
pub fn run(scene: &Scene, protocol: Protocol) -> SimulatedRun {
    let task = Task::new("test".to_owned(), protocol);
    drive::run(scene, &task, 1, None, &AtomicBool::new(false)).expect("it can be driven")
}

/// A tyre of the JNPF robot, with friction along and across.
pub fn tyre(friction_along: f64, friction_across: f64) -> Tyre {
    Tyre {
        free_radius: 0.1,
        width: 0.05,
        vertical_stiffness: 60e3,
        vertical_damping: 400.0,
        slip_stiffness: 15.0,
        friction_along,
        friction_across,
    }
}
