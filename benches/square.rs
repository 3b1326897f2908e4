//! Where the time goes: the tyre kernel, a step, a square. `cargo bench`.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use std::hint::black_box;
use std::sync::atomic::AtomicBool;
use treadmark::dataset::{Protocol, Rotation};
use treadmark::drive::{self, Task};
use treadmark::geometry::Pose2;
use treadmark::scene::{Contact, Scene};
use treadmark::world::{Patch, PatchMotion, World};

fn shipped(robot: &str) -> Scene {
    Scene::load(robot, "lab_floor").expect("a shipped robot loads")
}

/// One tyre's patch, carried on by a step: four of them make a step of a 4WD robot.
fn tyre(criterion: &mut Criterion) {
    let scene = shipped("jnpf_4wd");
    let tyre = &scene.robot.wheels[0].tyre;
    let motion = PatchMotion { slip_along: 0.05, slip_across: 0.1, spin: 0.8, rolling: 0.25 };
    let mut patch = Patch::default();
    criterion.bench_function("tyre patch, 8 x 4 cells", |bencher| {
        bencher.iter(|| patch.advance(tyre, black_box(60.0), 1e-3, 1.0, black_box(&motion), scene.time_step));
    });
}

/// A step of the whole robot, driving: tyres, drivetrain, engine.
fn step(criterion: &mut Criterion) {
    for (label, robot, contact) in [
        ("step, 4WD on patches", "jnpf_4wd", Contact::Patch),
        ("step, 4WD on rigid cylinders", "jnpf_4wd", Contact::Rigid),
        ("step, two wheels and a caster", "optiodom", Contact::Patch),
    ] {
        let scene = Scene { contact, ..shipped(robot) };
        let mut world = World::new(&scene, Pose2::IDENTITY, ChaCha8Rng::seed_from_u64(1)).expect("it stands");
        for wheel in 0..scene.robot.wheels.len() {
            world.command(wheel, 2.0);
        }
        criterion.bench_function(label, |bencher| bencher.iter(|| world.step()));
    }
}

/// A 4 m square at the default step with logging, without recording, on one core; the throughput is simulated
/// milliseconds a second, so that 200 Kelem/s is 200 times real time.
fn square(criterion: &mut Criterion) {
    let scene = shipped("jnpf_4wd");
    let protocol = Protocol::Square { side: 4.0, direction: Rotation::CounterClockwise };
    let task = Task::new("bench".to_owned(), protocol);
    let stop = AtomicBool::new(false);
    let drive = || drive::run(&scene, &task, 1, None, &stop).expect("it can be driven");
    let mut group = criterion.benchmark_group("square");
    group.sample_size(10).throughput(Throughput::Elements((1e3 * drive().simulated) as u64));
    group.bench_function("4 m square", |bencher| bencher.iter(drive));
    group.finish();
}

criterion_group!(benches, tyre, step, square);
criterion_main!(benches);
