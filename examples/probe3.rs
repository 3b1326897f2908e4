use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use treadmark::geometry::Pose2;
use treadmark::scene::*;
use treadmark::world::*;
fn main() {
    for robot in ["jnpf_4wd", "husky_a200"] {
        for dt in [5e-3, 2.5e-3, 1.25e-3, 0.625e-3, 0.3125e-3, 0.15625e-3] {
            let mut scene = Scene::load(robot, "lab_floor").unwrap().noise_free();
            for w in &mut scene.robot.wheels {
                if robot == "jnpf_4wd" {
                    w.tyre.free_radius = 0.1;
                }
            }
            scene.robot.encoder.ticks_per_revolution = 1e9;
            scene.time_step = dt;
            let s = 2.5;
            let mut w = World::new(&scene, Pose2::IDENTITY, ChaCha8Rng::seed_from_u64(0)).unwrap();
            let mut a0 = [0.0; 4];
            let mut h0 = 0.0;
            let mut hd = 0.0;
            let (mut a1, mut h1) = ([0.0; 4], 0.0);
            for k in 0..(10.0 / dt) as u64 {
                let t = w.time();
                let c = if t < 0.5 { 0.0 } else { ((t - 0.5) * 4.0).min(s) };
                for i in 0..4 {
                    let left = scene.robot.wheels[i].side == Side::Left;
                    w.command(i, if left { -c } else { c });
                }
                w.step().unwrap();
                if k == (0.5 / dt) as u64 {
                    for i in 0..4 {
                        a1[i] = w.wheel_angle(i);
                    }
                    h1 = w.pose().heading;
                }
                if k == (5.0 / dt) as u64 {
                    for i in 0..4 {
                        a0[i] = w.wheel_angle(i);
                    }
                    h0 = w.pose().heading;
                }
                hd = w.pose().heading;
            }
            let f = |a0: &[f64; 4], h0: f64| {
                let mut d = 0.0;
                for i in 0..4 {
                    let left = scene.robot.wheels[i].side == Side::Left;
                    d += if left { -1.0 } else { 1.0 }
                        * (w.wheel_angle(i) - a0[i])
                        * 1.0
                        * if left { 1.0 } else { 1.0 }
                        * 1.0;
                    let _ = d;
                }
                let mut d = 0.0;
                for i in 0..4 {
                    let left = scene.robot.wheels[i].side == Side::Left;
                    d += if left { -(w.wheel_angle(i) - a0[i]) } else { w.wheel_angle(i) - a0[i] };
                }
                let load = scene.robot.mass() * 9.80665 / 4.0;
                let re = scene.robot.wheels[0].tyre.rolling_radius(scene.robot.wheels[0].tyre.squash(load));
                d / 2.0 * re / (hd - h0) / scene.robot.track_width()
            };
            let th = 1.0 + (scene.robot.wheelbase() / scene.robot.track_width()).powi(2);
            println!(
                "{robot} dt {dt:.2e} steady factor {:.6} with start {:.6} theory {th:.4}  z {:.6} N {:?}",
                f(&a0, h0),
                f(&a1, h1),
                w.base().translation.z,
                (0..4).map(|i| w.wheel_load(i)).collect::<Vec<_>>()
            );
        }
    }
}
