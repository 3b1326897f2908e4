//! Something is wrong with a robot that its model does not say: the simulator predicts the runs, and the diagnosis names it.
//!
//! ```sh
//! cargo run --release --example diagnose
//! ```

use rayon::prelude::*;
use std::error::Error;
use std::sync::atomic::AtomicBool;
use treadmark::dataset::{Dataset, Protocol, Rotation};
use treadmark::diagnose::{Options, Study};
use treadmark::drive::{self, DriveError, Task};
use treadmark::effect::Cause;
use treadmark::experiment::{Simulator, campaign};
use treadmark::report::diagnosis;
use treadmark::scene::Scene;

/// Drives a robot whose right tyres are larger than its model says, and asks what is wrong.
pub fn main() -> Result<(), Box<dyn Error>> {
    let stop = AtomicBool::new(false);
    let model = Scene::load("jnpf_4wd", "lab_floor")?;
    let settings = ["wheel_diameter_mismatch.ratio_minus_one=0.01".to_owned()];
    let real = Cause::edit_all(&Cause::from_settings(&settings, &model)?, &model);

    let square = |number: usize| {
        let direction = [Rotation::Clockwise, Rotation::CounterClockwise][number % 2];
        let task = Task::new(format!("square-{number}"), Protocol::Square { side: 1.0, direction });
        Ok(drive::run(&real, &task, 1, None, &stop)?.measured)
    };
    let runs = (0..4).into_par_iter().map(square).collect::<Result<Vec<_>, DriveError>>()?;
    let dataset = Dataset { campaign: campaign(&real, "example"), runs };

    // The diagnosis is handed the model, which knows nothing of the tyres, and anything that predicts runs.
    let simulator = Simulator::new(&model, &stop);
    let mut study = Study::new(&[dataset], &[], &simulator, Options::default(), None, &|_, _| {})?;
    let found = study.diagnose()?;
    println!("{}", diagnosis::answer(&found));
    Ok(())
}
