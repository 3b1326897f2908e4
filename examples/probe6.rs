use std::sync::atomic::AtomicBool;
use treadmark::dataset::*;
use treadmark::drive::*;
use treadmark::scene::*;
fn main() {
    for (n, protocol) in [
        ("spin", Protocol::Spin { turn: 6.2831853, direction: Rotation::CounterClockwise }),
        ("spin90", Protocol::Spin { turn: 1.5707963, direction: Rotation::CounterClockwise }),
        ("straight", Protocol::Straight { length: 4.0, direction: Travel::Forward }),
    ] {
        for dt in [2.5e-3, 1.25e-3, 0.625e-3, 0.3125e-3] {
            let mut scene = Scene::load("jnpf_4wd", "lab_floor").unwrap().noise_free();
            if std::env::args().nth(1).is_some() {
                scene.robot.encoder.ticks_per_revolution = 8.192e6;
                scene.robot.odometry.ticks_per_revolution = 8.192e6;
            }
            scene.time_step = dt;
            let task = Task { name: "p".into(), protocol, speed: None, turn_rate: None };
            let r = run(&scene, &task, 1, None, &AtomicBool::new(false)).unwrap();
            let e = r.true_error();
            println!(
                "{n} dt {dt:.2e}: err x {:.4} mm y {:.4} mm th {:.4} mrad; true {:.5} odo {:.4} {:.4} {:.5}",
                e.x * 1e3,
                e.y * 1e3,
                e.heading * 1e3,
                r.actual.heading,
                r.odometry.x,
                r.odometry.y,
                r.odometry.heading
            );
        }
    }
}
