use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use treadmark::geometry::Pose2;
use treadmark::scene::*;
use treadmark::world::*;
fn main() {
    let mut scene = Scene::load("jnpf_4wd", "lab_floor").unwrap().noise_free();
    scene.time_step = std::env::args().nth(1).map_or(1e-3, |s| s.parse().unwrap());
    let mut w = World::new(&scene, Pose2::IDENTITY, ChaCha8Rng::seed_from_u64(0)).unwrap();
    let every = (0.05 / scene.time_step) as u64;
    for k in 0..(6.0 / scene.time_step) as u64 {
        let t = w.time();
        let s = if t < 0.5 {
            0.0
        } else if t < 4.0 {
            ((t - 0.5) * 4.0).min(2.5)
        } else {
            0.0
        };
        for i in 0..4 {
            let left = scene.robot.wheels[i].side == Side::Left;
            w.command(i, if left { -s } else { s });
        }
        w.step().unwrap();
        if k % every == 0 && (k / every) % 4 == 0 || (t > 2.0 && t < 2.02) {
            let tw = w.twist();
            print!(
                "{t:.3} z {:.5} v {:.4} {:.4} yaw {:.4} |",
                w.base().translation.z,
                tw.forward,
                tw.left,
                tw.yaw_rate
            );
            let mut v = vec![];
            w.wheel_snapshots(&mut v);
            for x in &v {
                print!(
                    " [{:.3} N{:.1} F{:.1} {:.1} T{:.2}]",
                    x.speed, x.load, x.force_along, x.force_across, x.motor_torque
                );
            }
            println!();
        }
    }
}
