//! A campaign of squares becomes a dataset, and every published method says what the robot should have believed.
//!
//! ```sh
//! cargo run --release --example calibrate
//! ```

use rayon::prelude::*;
use std::error::Error;
use std::sync::atomic::AtomicBool;
use treadmark::calibrate::{METHODS, Training, calibrate};
use treadmark::dataset::{Dataset, Protocol, Rotation};
use treadmark::drive::{self, DriveError, Task};
use treadmark::experiment::campaign;
use treadmark::report::text;
use treadmark::scene::Scene;

/// Drives three squares each way round, and calibrates on them.
pub fn main() -> Result<(), Box<dyn Error>> {
    let scene = Scene::load("jnpf_4wd", "lab_floor")?;
    let square = |number: usize| {
        let direction = [Rotation::Clockwise, Rotation::CounterClockwise][number % 2];
        let task = Task::new(format!("square-{number}"), Protocol::Square { side: 1.0, direction });
        Ok(drive::run(&scene, &task, 1, None, &AtomicBool::new(false))?.measured)
    };
    let runs = (0..6).into_par_iter().map(square).collect::<Result<Vec<_>, DriveError>>()?;

    // A lab's own campaign comes from `Dataset::read(folder)` instead; from here on nothing knows of a simulation.
    let dataset = Dataset { campaign: campaign(&scene, "example"), runs };
    let training = Training::new(&[dataset])?;
    let methods: Vec<_> = METHODS.iter().collect();
    print!("{}", text::calibration(&calibrate(&training, None, &methods)));
    Ok(())
}
