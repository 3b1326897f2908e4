//! `treadmark predict`: the model at work, on data without any survey.

use super::options::set_threads;
use super::output;
use super::watch::stop_on_ctrl_c;
use crate::dataset::Dataset;
use crate::effect::{Cause, load_scene};
use crate::experiment::{Simulator, predict};
use crate::scene::WORLDS;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `treadmark predict`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Dataset folder; no pose in it is looked at
    dataset: PathBuf,
    /// Robot model file, extended or not, or the name of a shipped robot
    #[arg(long, value_name = "FILE|NAME")]
    robot: String,
    /// World file or shipped name
    #[arg(long, value_name = "FILE|NAME", default_value = WORLDS.names()[0])]
    world: String,
    /// Put an effect into the model; may be given several times
    #[arg(long = "set", value_name = "EFFECT.PARAMETER=VALUE")]
    settings: Vec<String>,
    /// Worker threads (default: one a core); results do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// New folder for the predictions, a dataset itself (default: a new numbered one under recordings/)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Predicts every run and writes a dataset.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    set_threads(arguments.threads)?;
    output::expect_new(arguments.out.as_deref())?;
    let dataset = Dataset::read(&arguments.dataset)?;
    super::check::warn([unsurveyed(&dataset)].iter());
    let scene = load_scene(&arguments.robot, &arguments.world)?;
    scene.robot.expect_stated(&dataset)?;
    let scene = Cause::edit_all(&Cause::from_settings(&arguments.settings, &scene)?, &scene);
    let simulator = Simulator::new(&scene, stop_on_ctrl_c());
    let (predicted, left_out) = predict(&dataset, &simulator)?;
    for reason in &left_out {
        tell!("note: {reason}");
    }
    if predicted.runs.is_empty() {
        anyhow::bail!("{}: no run can be predicted", arguments.dataset.display());
    }
    let folder = output::folder(arguments.out.as_deref(), "prediction")?;
    predicted.write(&folder)?;
    sayln!("{:<24} {:>10} {:>10} {:>12}", "run", "x [m]", "y [m]", "heading [rad]")?;
    for run in &predicted.runs {
        if let Some(end) = run.end {
            let heading = end.heading.map_or(String::new(), |heading| format!("{heading:.5}"));
            sayln!("{:<24} {:>10.5} {:>10.5} {heading:>12}", run.name, end.x, end.y)?;
        }
    }
    sayln!("predicted poses are in {}", folder.display())?;
    Ok(())
}

/// A dataset without what no prediction looks at.
fn unsurveyed(dataset: &Dataset) -> Dataset {
    let mut dataset = dataset.clone();
    for run in &mut dataset.runs {
        (run.start, run.end, run.odometry_end, run.poses) = (None, None, None, None);
    }
    dataset
}
