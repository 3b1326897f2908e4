//! `treadmark experiment`: squares before and after calibration.

use super::options::{SceneOptions, positive};
use super::output;
use super::watch::{Watcher, progress_bar, stop_on_ctrl_c};
use crate::experiment::{self, Plan};
use crate::report::{json::ExperimentJson, text};
use clap::Args;

/// Arguments of `treadmark experiment`.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneOptions,
    /// Sides of the squares [m]
    #[arg(long, value_name = "METRES", value_delimiter = ',', default_value = "2,4", allow_negative_numbers = true, value_parser = positive)]
    sides: Vec<f64>,
    /// Runs each way round
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=1000))]
    repeats: u16,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let scene = arguments.scene.scene()?;
    arguments.scene.set_threads()?;
    let mut sides = arguments.sides.clone();
    sides.sort_by(f64::total_cmp);
    sides.dedup();
    let plan = Plan { sides, repeats: usize::from(arguments.repeats), seed: arguments.scene.seed };
    let folder = output::folder(arguments.scene.out.as_deref(), "experiment")?;
    let stop = stop_on_ctrl_c();

    let watcher = Watcher { progress: progress_bar(plan.run_count()), folder: &folder, record: &|_| None };
    let result = experiment::squares(&scene, &plan, &watcher, stop);
    watcher.progress.finish_and_clear();
    let result = result?;

    if arguments.scene.json {
        println!("{}", serde_json::to_string_pretty(&ExperimentJson::new(&scene.robot.name, plan.seed, &result))?);
    } else {
        print!("{}", text::experiment(&result, text::Style::Terminal));
        println!("results are in {}", folder.display());
    }
    anyhow::ensure!(result.complete, "interrupted; {} holds the runs that came to their end", folder.display());
    Ok(())
}
