//! `treadmark experiment`: squares before and after calibration.

use super::options::{self, SceneOptions, positive};
use super::output;
use super::progress::progress_bar;
use super::watch::{Watcher, stop_on_ctrl_c};
use crate::drive::Observer;
use crate::experiment::{self, Experiment, Plan, StageRun};
use crate::report::{json::ExperimentJson, page, text};
use crate::scene::Scene;
use clap::Args;
use std::path::Path;

/// Arguments of `treadmark experiment`.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneOptions,
    /// Sides of the squares [m]
    #[arg(long, value_name = "METRES", value_delimiter = ',', default_value = "2,4", allow_negative_numbers = true, value_parser = positive)]
    sides: Vec<f64>,
    /// Runs of each square each way round, and of the straight
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=1000))]
    repeats: u16,
    /// Calibration methods, by name, or all (see `treadmark methods`)
    #[arg(long = "method", value_name = "NAME", value_delimiter = ',', default_value = "all")]
    methods: Vec<String>,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let scene = arguments.scene.scene()?;
    options::set_threads(arguments.scene.threads)?;
    let mut sides = arguments.sides.clone();
    sides.sort_by(f64::total_cmp);
    sides.dedup();
    let methods = options::methods(&arguments.methods)?;
    let plan = Plan { sides, repeats: usize::from(arguments.repeats), seed: arguments.scene.seed, methods };
    let folder = output::folder(arguments.scene.out.as_deref(), "experiment")?;
    let stop = stop_on_ctrl_c();

    let recorder = Recorder::create(arguments.scene.no_recording, &folder, &scene, &plan)?;
    let record = |run: StageRun<'_>| recorder.observer(run);
    let watcher = Watcher { progress: progress_bar(plan.run_count(), "runs"), folder: &folder, record: &record };
    let result = experiment::squares(&scene, &plan, &watcher, stop);
    watcher.progress.finish_and_clear();
    let result = result?;
    let recorded = recorder.finish(&result);
    let title = format!("{} on {}: squares before and after calibration", scene.robot.name, scene.floor.name);
    output::report(&folder, &page::experiment::page(title, &result, output::provenance(Some(plan.seed), &[])?))?;

    if arguments.scene.json {
        sayln!("{}", serde_json::to_string_pretty(&ExperimentJson::new(plan.seed, &result))?)?;
    } else {
        let (answer, beside) = page::experiment::answer(&result);
        sayln!("{answer}")?;
        for words in &beside {
            sayln!("{words}")?;
        }
        say!("\n{}", text::experiment(&result, text::Style::Terminal, |_| true))?;
        sayln!("{}", output::where_to_look(&folder))?;
    }
    recorded?;
    anyhow::ensure!(result.complete, "interrupted; {} holds the runs that came to their end", folder.display());
    Ok(())
}

/// The recording, or nothing where none is wanted or this build has none.
struct Recorder {
    #[cfg(feature = "recording")]
    recorder: Option<super::record::ExperimentRecorder>,
}

#[cfg(feature = "recording")]
impl Recorder {
    fn create(unwanted: bool, folder: &Path, scene: &Scene, plan: &Plan) -> anyhow::Result<Recorder> {
        let create = || super::record::ExperimentRecorder::create(&folder.join(output::RECORDING), scene, plan);
        Ok(Recorder { recorder: if unwanted { None } else { Some(create()?) } })
    }

    fn observer(&self, run: StageRun<'_>) -> Option<Box<dyn Observer>> {
        self.recorder.as_ref()?.observer(run)
    }

    fn finish(self, result: &Experiment) -> anyhow::Result<()> {
        Ok(self.recorder.map_or(Ok(()), |recorder| recorder.finish(result))?)
    }
}

#[cfg(not(feature = "recording"))]
impl Recorder {
    fn create(unwanted: bool, _: &Path, _: &Scene, _: &Plan) -> anyhow::Result<Recorder> {
        output::note_missing_recording(unwanted);
        Ok(Recorder {})
    }

    fn observer(&self, _: StageRun<'_>) -> Option<Box<dyn Observer>> {
        None
    }

    fn finish(self, _: &Experiment) -> anyhow::Result<()> {
        Ok(())
    }
}
