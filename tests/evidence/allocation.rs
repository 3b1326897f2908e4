//! The step loop allocates nothing: a robot that nothing is near goes without rapier's pipeline, which allocates a little in
//! every step. What is left is that logs grow.

#![allow(unsafe_code)] // an allocator that counts

use crate::rig::ideal;
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
    assert!(a_step <= 0.01, "{a_step:.4} allocations a step");
}
