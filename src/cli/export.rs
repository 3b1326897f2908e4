//! `treadmark export`: dataset → TUM trajectories.

use super::output;
use crate::dataset::Dataset;
use crate::import;
use anyhow::Context;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `treadmark export`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Folder of the campaign, with dataset.toml and runs.csv
    #[arg(value_name = "DATASET")]
    dataset: PathBuf,
    /// New folder for RUN.survey.tum and RUN.odometry.tum
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let dataset = Dataset::read(&arguments.dataset)?;
    let trajectories = import::export(&dataset);
    anyhow::ensure!(
        !trajectories.is_empty(),
        "{}: no run has poses with headings, or encoders and an [odometry] to reckon with",
        arguments.dataset.display()
    );
    if dataset.campaign.odometry.is_none() {
        tell!("note: dataset.toml has no [odometry], so there are no dead-reckoned paths");
    }
    let folder = output::folder(Some(&arguments.out), "export")?;
    for trajectory in &trajectories {
        let file = folder.join(&trajectory.file);
        std::fs::write(&file, &trajectory.text).with_context(|| format!("{}: cannot be written", file.display()))?;
    }
    sayln!("{} trajectories of {} runs are in {}", trajectories.len(), dataset.runs.len(), folder.display())?;
    Ok(())
}
