use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use treadmark::geometry::Pose2;
use treadmark::scene::*;
use treadmark::world::*;
fn main() {
    let mut scene = Scene::load("jnpf_4wd", "lab_floor").unwrap().noise_free();
    if std::env::args().nth(1).as_deref() == Some("nocol") {
        scene.robot.chassis.collisions.clear();
    }
    let mut w = World::new(&scene, Pose2::IDENTITY, ChaCha8Rng::seed_from_u64(0)).unwrap();
    for i in 0..4 {
        w.command(i, 4.0);
    }
    let n = std::env::args().nth(2).map_or(100000, |s| s.parse().unwrap());
    let t = std::time::Instant::now();
    for _ in 0..n {
        w.step().unwrap();
    }
    println!("{:.3} us/step", t.elapsed().as_secs_f64() * 1e6 / n as f64);
}
