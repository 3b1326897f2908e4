//! `treadmark power`: what a campaign could show, before anyone drives it.

use super::options::{SceneOptions, set_threads};
use super::progress::{progress_bar, simulations};
use super::watch::stop_on_ctrl_c;
use crate::dataset::Dataset;
use crate::diagnose::{Options, Study};
use crate::experiment::{CampaignKind, DataKind, Simulator, planned, planned_as, predict};
use crate::report::power;
use crate::scene::Scene;
use anyhow::Context;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// Arguments of `treadmark power`.
#[derive(Args)]
pub(super) struct Arguments {
    /// A dataset folder, driven and surveyed, or logged, or only planned; or `squares` or `full`, the campaigns of `treadmark challenge`
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
            scene.robot.expect_stated(&dataset)?;
            as_noted(dataset, &scene, data, stop)?
        }
    };
    let simulator = Simulator::new(&scene, stop);
    let bar = progress_bar(0, "simulations");
    let progress = simulations(&bar, "what this campaign could show");
    let study = Study::new(std::slice::from_ref(&dataset), &[], &simulator, Options::default(), None, &progress)?;
    let study = if counts.iter().any(|count| *count != 1) { study.repeated(&counts) } else { study };
    let (blind, alike) = (study.blind(), study.alike());
    bar.finish_and_clear();
    if arguments.scene.json {
        sayln!("{}", serde_json::to_string_pretty(&crate::report::json::power(&blind, &alike))?)?;
    } else {
        sayln!("{}", power::power(&blind, &alike))?;
    }
    Ok(())
}

/// A dataset whose runs were surveyed as it is; else as the model would have it: what was logged is predicted, and what was only
/// planned is driven. How many runs each stands for comes with it.
fn as_noted(
    dataset: Dataset,
    scene: &Scene,
    data: DataKind,
    stop: &AtomicBool,
) -> anyhow::Result<(Dataset, Vec<usize>)> {
    let once = |dataset: Dataset| {
        let counts = vec![1; dataset.runs.len()];
        (dataset, counts)
    };
    if dataset.runs.iter().any(|run| run.end.is_some() || run.poses.is_some()) {
        return Ok(once(dataset));
    }
    if dataset.runs.iter().all(|run| run.encoders.is_none()) {
        tell!("note: nothing is noted of these runs yet: the model drives them");
        return Ok(planned_as(&dataset, scene, data, stop)?);
    }
    tell!("note: these runs are not surveyed yet: the model says where their wheels went");
    let (mut predicted, _) = predict(&dataset, &Simulator::new(scene, stop))?;
    predicted.campaign.survey = dataset.campaign.survey;
    if data == DataKind::EndPoints {
        predicted.runs.iter_mut().for_each(|run| run.poses = None);
    }
    Ok(once(predicted))
}
