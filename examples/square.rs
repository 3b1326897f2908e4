//! One square, simulated: where the robot thinks it is, and where it is.
//!
//! ```sh
//! cargo run --release --example square
//! ```

use std::error::Error;
use std::sync::atomic::AtomicBool;
use treadmark::dataset::{Protocol, Rotation};
use treadmark::drive::{self, Task};
use treadmark::scene::Scene;

/// Drives it.
pub fn main() -> Result<(), Box<dyn Error>> {
    let scene = Scene::load("jnpf_4wd", "lab_floor")?;
    let square = Task::new("square", Protocol::Square { side: 1.0, direction: Rotation::CounterClockwise });
    let run = drive::run(&scene, &square, 1, None, &AtomicBool::new(false))?;

    let line = |what, pose: treadmark::geometry::Pose2| {
        println!("{what:<10} x {:+.4} m, y {:+.4} m, heading {:+.4} rad", pose.x, pose.y, pose.heading);
    };
    line("believed", run.odometry);
    line("true", run.actual);
    line("error", run.true_error());
    println!("{:.1} simulated seconds in {:.2} s", run.simulated, run.wall.as_secs_f64());
    Ok(())
}
