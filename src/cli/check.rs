//! `treadmark check`: what the data look like before anyone calculates.

use super::Outcome;
use crate::calibrate;
use crate::dataset::Dataset;
use crate::report::check;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `treadmark check`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Folder of the campaign, with dataset.toml and runs.csv
    #[arg(value_name = "DATASET")]
    dataset: PathBuf,
    /// Print JSON on stdout, and nothing else there
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let dataset = Dataset::read(&arguments.dataset)?;
    let suspicions = calibrate::check(&dataset);
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&check::CheckJson::new(&dataset, &suspicions))?);
    } else {
        print!("{}", check::check(&dataset, &suspicions));
    }
    Ok(if suspicions.is_empty() { Outcome::Done } else { Outcome::CheckFailed })
}
