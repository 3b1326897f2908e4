use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use treadmark::geometry::Pose2;
use treadmark::scene::*;
use treadmark::world::*;
struct A;
thread_local! { static ON: Cell<bool> = const { Cell::new(false) }; }
fn note(l: Layout) {
    if ON.get() {
        ON.set(false);
        let b = std::backtrace::Backtrace::force_capture().to_string();
        let f: Vec<&str> = b
            .lines()
            .filter(|l| l.contains("rapier3d") || l.contains("treadmark") || l.contains("parry"))
            .take(4)
            .collect();
        println!("alloc {} align {}: {:#?}", l.size(), l.align(), f);
        ON.set(true);
    }
}
unsafe impl GlobalAlloc for A {
    unsafe fn alloc(&self, l: Layout) -> *mut u8 {
        note(l);
        unsafe { System.alloc(l) }
    }
    unsafe fn dealloc(&self, p: *mut u8, l: Layout) {
        unsafe { System.dealloc(p, l) }
    }
    unsafe fn realloc(&self, p: *mut u8, l: Layout, n: usize) -> *mut u8 {
        note(l);
        unsafe { System.realloc(p, l, n) }
    }
}
#[global_allocator]
static G: A = A;
fn main() {
    let mut scene = Scene::load("jnpf_4wd", "lab_floor").unwrap().noise_free();
    if std::env::args().nth(1).as_deref() == Some("nocol") {
        scene.robot.chassis.collisions.clear();
    }
    let mut w = World::new(&scene, Pose2::IDENTITY, ChaCha8Rng::seed_from_u64(0)).unwrap();
    for i in 0..4 {
        w.command(i, 4.0);
    }
    for _ in 0..3000 {
        w.step().unwrap();
    }
    ON.set(true);
    w.step().unwrap();
    ON.set(false);
}
