//! The step loop allocates nothing of its own. rapier's pipeline allocates a little in every step, so the count is held
//! against that of the bare engine with as many bodies and joints.

#![allow(unsafe_code)] // an allocator that counts

use crate::rig::ideal;
use rapier3d::prelude::*;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::AtomicBool;
use treadmark::dataset::{Protocol, Rotation};
use treadmark::drive::{self, Task};

struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call is handed on to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations of this thread while `work` runs.
fn allocations<T>(work: impl FnOnce() -> T) -> (u64, T) {
    let before = COUNT.get();
    let result = work();
    (COUNT.get() - before, result)
}

/// Allocations a step of the bare engine: a chassis, four hinged wheels, each pushed in every step.
fn of_the_engine() -> f64 {
    let mut world = PhysicsWorld::new();
    world.integration_parameters.num_solver_iterations = 1;
    let body = |y: f64| {
        RigidBodyBuilder::dynamic().translation(Vector::new(0.0, y, 1.0)).can_sleep(false).additional_mass(1.0)
    };
    let chassis = world.insert_body(body(0.0));
    let mut bodies = vec![chassis];
    for wheel in 1..=4 {
        let wheel = world.insert_body(body(f64::from(wheel)));
        world.insert_impulse_joint(chassis, wheel, RevoluteJointBuilder::new(Vector::Y).contacts_enabled(false));
        bodies.push(wheel);
    }
    let mut step = || {
        for &body in &bodies {
            world.bodies[body].reset_forces(false);
            world.bodies[body].add_force(Vector::Z, false);
        }
        world.step();
    };
    (0..1000).for_each(|_| step());
    let (count, ()) = allocations(|| (0..1000).for_each(|_| step()));
    count as f64 / 1000.0
}

#[test]
fn the_step_loop_allocates_nothing_of_its_own() {
    let scene = ideal("jnpf_4wd");
    let spin = |turn| {
        let protocol = Protocol::Spin { turn, direction: Rotation::CounterClockwise };
        let task = Task::new("count".to_owned(), protocol);
        allocations(|| drive::run(&scene, &task, 1, None, &AtomicBool::new(false)).expect("it can be driven"))
    };
    // Set-up is the same for both; the rest is the loop, with control, driver, log and survey.
    let ((short, one), (long, other)) = (spin(3.0), spin(30.0));
    let a_step = (long - short) as f64 / (other.steps - one.steps) as f64;
    let engine = of_the_engine();
    assert!(a_step <= engine + 0.01, "{a_step:.3} allocations a step, of which the engine makes {engine:.3}");
}
