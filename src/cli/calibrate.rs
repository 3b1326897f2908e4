//! `treadmark calibrate`: datasets → corrections, scored, and parameters to paste.

use super::progress::progress_bar;
use super::{options, output};
use crate::calibrate::{self, Training};
use crate::dataset::Dataset;
use crate::report::{json::CalibrationJson, page, ros2, text};
use anyhow::Context;
use clap::Args;
use std::path::{Path, PathBuf};

/// Arguments of `treadmark calibrate`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Folders with a dataset.toml and a runs.csv; with several, all runs are fitted together
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Methods, by name, or all (see `treadmark methods`)
    #[arg(long = "method", value_name = "NAME", value_delimiter = ',', default_value = "all")]
    methods: Vec<String>,
    /// Datasets that no fit sees and every method is scored on (default: each run predicted from the others)
    #[arg(long, value_name = "DATASET", num_args = 1..)]
    hold_out: Vec<PathBuf>,
    /// Write the best method's parameters for ROS 2's diff_drive_controller to a new file
    #[arg(long, value_name = "FILE")]
    ros2: Option<PathBuf>,
    /// New folder for a report
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON on stdout, and nothing else there
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    output::expect_new(arguments.out.as_deref())?;
    output::expect_new(arguments.ros2.as_deref())?;
    let methods = options::methods(&arguments.methods)?;
    let training = Training::new(&read(&arguments.datasets)?)?;
    let hold_out = match arguments.hold_out.as_slice() {
        [] => None,
        folders => Some(Training::new(&read(folders)?)?),
    };
    let count = if methods.is_empty() { calibrate::METHODS.len() } else { methods.len() };
    let bar = progress_bar(count, "methods");
    let calibration = calibrate::calibrate_telling(&training, hold_out.as_ref(), &methods, &|| bar.inc(1));
    bar.finish_and_clear();
    anyhow::ensure!(
        calibration.outcomes.iter().any(|outcome| outcome.estimate.is_ok()),
        "no method is applicable: {}",
        calibration
            .outcomes
            .iter()
            .filter_map(|outcome| Some(format!("{}: {}", outcome.method.name, outcome.estimate.as_ref().err()?)))
            .collect::<Vec<_>>()
            .join("; ")
    );
    if let Some(file) = &arguments.ros2 {
        let best = calibration.best().or(calibration.outcomes.iter().find(|outcome| outcome.estimate.is_ok()));
        if let Some((best, (estimate, score))) =
            best.and_then(|best| Some((best, (best.estimate.as_ref().ok()?, best.held_out.or(best.in_sample)?))))
        {
            let yaml = ros2::diff_drive_controller(best.method.name, &training.odometry, estimate, &score);
            write_new(file, &yaml)?;
        }
    }
    let folder = arguments.out.as_deref().map(|path| output::folder(Some(path), "calibration")).transpose()?;
    if let Some(folder) = &folder {
        let data: Vec<PathBuf> = arguments.datasets.iter().chain(&arguments.hold_out).cloned().collect();
        let title = format!("Calibration of {}", training.name);
        let provenance = output::provenance(None, &data)?;
        let page = page::calibration::page(title, &training, hold_out.as_ref(), &calibration, provenance);
        output::report(folder, &page)?;
        let json = serde_json::to_string_pretty(&CalibrationJson::from(&calibration))?;
        output::write(&folder.join("calibration.json"), &json)?;
    }
    if arguments.json {
        sayln!("{}", serde_json::to_string_pretty(&CalibrationJson::from(&calibration))?)?;
    } else {
        say!("{}", text::calibration(&calibration))?;
        if let Some(file) = &arguments.ros2 {
            sayln!("ROS 2 parameters are in {}", file.display())?;
        }
        if let Some(folder) = &folder {
            sayln!("{}", output::where_to_look(folder))?;
        }
    }
    Ok(())
}

/// Reads datasets, and says what looks wrong with them.
fn read(folders: &[PathBuf]) -> anyhow::Result<Vec<Dataset>> {
    let datasets = folders.iter().map(|folder| Dataset::read(folder)).collect::<Result<Vec<_>, _>>()?;
    super::check::warn(datasets.iter());
    Ok(datasets)
}

/// Writes a file that must not exist yet.
fn write_new(file: &Path, text: &str) -> anyhow::Result<()> {
    use std::io::Write;
    let mut open = std::fs::File::create_new(file).with_context(|| format!("{}: cannot be made", file.display()))?;
    open.write_all(text.as_bytes()).with_context(|| format!("{}: cannot be written", file.display()))
}
