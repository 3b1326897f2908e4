use std::sync::atomic::AtomicBool;
use treadmark::dataset::*;
use treadmark::drive::*;
use treadmark::scene::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let robot = args.get(1).map_or("jnpf_4wd", |s| s);
    for side in [2.0, 4.0] {
        for direction in [Rotation::Clockwise, Rotation::CounterClockwise] {
            for dt in [1.25e-3] {
                let mut scene = Scene::load(robot, "lab_floor").unwrap().noise_free();
                scene.time_step = dt;
                let task = Task {
                    name: "p".into(),
                    protocol: Protocol::Square { side, direction },
                    speed: None,
                    turn_rate: None,
                };
                match run(&scene, &task, 1, None, &AtomicBool::new(false)) {
                    Ok(r) => {
                        let e = r.true_error();
                        println!(
                            "{side} {} dt {dt:.2e}: err x {:.3} mm y {:.3} mm th {:.3} mrad r {:.4}; odo {:.4} {:.4} {:.5}; sim {:.1}s  x{:.0}  {:.2} us/step",
                            direction.as_str(),
                            e.x * 1e3,
                            e.y * 1e3,
                            e.heading * 1e3,
                            e.x.hypot(e.y),
                            r.odometry.x,
                            r.odometry.y,
                            r.odometry.heading,
                            r.simulated,
                            r.simulated / r.wall.as_secs_f64(),
                            r.wall.as_secs_f64() * 1e6 / r.steps as f64
                        );
                    }
                    Err(e) => println!("{side} {e}"),
                }
            }
        }
    }
}
