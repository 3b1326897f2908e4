//! `treadmark check`: what the data look like before anyone calculates.

use super::Outcome;
use crate::calibrate::{self, Suspicion, SuspicionKind};
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
        sayln!("{}", serde_json::to_string_pretty(&check::CheckJson::new(&dataset, &suspicions))?)?;
    } else {
        say!("{}", check::check(&dataset, &suspicions))?;
    }
    Ok(if suspicions.is_empty() { Outcome::Done } else { Outcome::CheckFailed })
}

/// What looks wrong with campaigns, said on stderr before anything is made of them: a mistake of noting or wiring is no cause, and
/// a calibration swallows it. What one direction leaves open is no mistake, and several campaigns may have both between them.
pub(super) fn warn<'d>(campaigns: impl Iterator<Item = &'d Dataset>) -> Vec<(&'d Dataset, Vec<Suspicion>)> {
    let mistakes = |dataset| {
        let mut found = calibrate::check(dataset);
        found.retain(|suspicion| suspicion.kind != SuspicionKind::OneDirection);
        (dataset, found)
    };
    let wrong: Vec<_> = campaigns.map(mistakes).filter(|(_, found)| !found.is_empty()).collect();
    for words in check::cautions(&wrong) {
        tell!("look at the data first: {words}");
    }
    wrong
}
