//! A test bench: shipped robots made ideal, worlds stepped by hand, steady states measured.

use std::sync::atomic::AtomicBool;
use treadmark::dataset::Protocol;
use treadmark::drive::{self, SimulatedRun, Task};
use treadmark::experiment::bench;
pub use treadmark::experiment::bench::rotation;
use treadmark::scene::{Scene, Tyre};
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
    bench::settled(scene).expect("it stands")
}

/// Steps for `seconds`.
pub fn step_for(world: &mut World, seconds: f64) {
    bench::step_for(world, seconds).expect("it goes on");
}

/// Asks the left and right wheels for speeds \[rad/s\], ramped up over a second.
pub fn ramp_to(world: &mut World, left: f64, right: f64) {
    bench::ramp_to(world, left, right).expect("it goes on");
}

/// b_eff/b in a steady spin at wheel speed `speed` \[rad/s\]: the wheels' way over what the body turned.
pub fn track_factor_in_spin(scene: &Scene, speed: f64) -> f64 {
    let spin = bench::steady(scene, -speed, speed, 2.0, 4.0).expect("it goes on");
    spin.effective_track() / scene.robot.track_width()
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
