//! `treadmark power`: what a campaign could show, before anyone drives it.

use super::options::{SceneOptions, set_threads};
use super::progress::{progress_bar, simulations};
use super::watch::stop_on_ctrl_c;
use crate::dataset::Dataset;
use crate::diagnose::{Options, Study};
use crate::experiment::{CampaignKind, DataKind, Simulator, planned};
use crate::report::power;
use anyhow::Context;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Arguments of `treadmark power`.
#[derive(Args)]
pub(super) struct Arguments {
    /// A dataset folder, whose protocols are taken; or `squares` or `full`, the campaigns of `treadmark challenge`
    #[arg(value_name = "DATASET|squares|full")]
    campaign: String,
    /// What would be noted
    #[arg(long, value_enum, default_value_t = Data::Logs)]
    data: Data,
    #[command(flatten)]
    scene: SceneOptions,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Data {
    Logs,
    Endpoints,
}

/// Simulates the campaign without noise and prints what each effect would have to be to show.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    set_threads(arguments.scene.threads)?;
    let scene = arguments.scene.scene()?;
    let stop = stop_on_ctrl_c();
    let data = match arguments.data {
        Data::Logs => DataKind::Logs,
        Data::Endpoints => DataKind::EndPoints,
    };
    let (dataset, counts) = match arguments.campaign.as_str() {
        "squares" => planned(&scene, CampaignKind::Squares, data, stop)?,
        "full" => planned(&scene, CampaignKind::Full, data, stop)?,
        path => {
            let dataset = Dataset::read(&PathBuf::from(path))
                .with_context(|| format!("{path}: neither `squares`, `full` nor a dataset"))?;
            let counts = vec![1; dataset.runs.len()];
            (dataset, counts)
        }
    };
    let simulator = Simulator::new(&scene, stop);
    let bar = progress_bar(0, "simulations");
    let progress = simulations(&bar, "what this campaign could show");
    let study = Study::new(std::slice::from_ref(&dataset), &[], &simulator, Options::default(), None, &progress)?;
    let study =
        if arguments.campaign == "squares" || arguments.campaign == "full" { study.repeated(&counts) } else { study };
    let (blind, alike) = (study.blind(), study.alike());
    bar.finish_and_clear();
    if arguments.scene.json {
        sayln!("{}", serde_json::to_string_pretty(&crate::report::json::power(&blind, &alike))?)?;
    } else {
        sayln!("{}", power::power(&blind, &alike))?;
    }
    Ok(())
}
