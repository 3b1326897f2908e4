use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use treadmark::geometry::Pose2;
use treadmark::scene::*;
use treadmark::world::*;
fn main() {
    for (dh, locked) in [(1.5707963, false), (0.0, true)] {
        let mut scene = Scene::load("jnpf_4wd", "lab_floor").unwrap().noise_free();
        for w in &mut scene.robot.wheels {
            w.tyre.free_radius = 0.1;
        }
        scene.floor.gradient = 1.2;
        scene.floor.downhill_heading = dh;
        scene.time_step = 0.5e-3;
        if locked {
            scene.robot.drivetrain.dry_friction = 50.0;
        }
        let mut w = World::new(&scene, Pose2::IDENTITY, ChaCha8Rng::seed_from_u64(0)).unwrap();
        let mut last = 0.0;
        for k in 0..6000 {
            w.step().unwrap();
            if k % 400 == 0 {
                let t = w.twist();
                let v = t.forward.hypot(t.left);
                println!(
                    "{:.3} v {:.4} acc {:.5} fwd {:.4} left {:.4} yaw {:.4} hd {:.4} z {:.5} N {:?} F {:?} w {:?}",
                    w.time(),
                    v,
                    (v - last) / 0.2,
                    t.forward,
                    t.left,
                    t.yaw_rate,
                    w.pose().heading,
                    w.base().translation.z,
                    (0..4).map(|i| w.wheel_load(i).round()).collect::<Vec<_>>(),
                    (0..4).map(|i| (w.wheel_force(i)[0] * 100.0).round() / 100.0).collect::<Vec<_>>(),
                    (0..4).map(|i| w.wheel_speed(i)).collect::<Vec<_>>()
                );
                last = v;
            }
        }
    }
    println!("{}", 9.80665 * (1.2f64.atan().sin() - 0.8 * 1.2f64.atan().cos()));
}
