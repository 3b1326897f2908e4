//! `treadmark diagnose`: what a model gets wrong, and why.

use super::options::{positive, set_threads};
use super::output;
use super::progress::{progress_bar, simulations};
use super::watch::stop_on_ctrl_c;
use crate::dataset::Dataset;
use crate::diagnose::{Options, Study};
use crate::effect::{Cause, ExtendedModel, load_scene};
use crate::experiment::Simulator;
use crate::report::{check, diagnosis, json::DiagnosisJson, page};
use crate::scene::{Doubt, ROBOTS, WORLDS};
use anyhow::Context;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `treadmark diagnose`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Dataset folders
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Robot model file, extended or not, or a shipped name (default: the one that the first dataset names)
    #[arg(long, value_name = "FILE|NAME")]
    robot: Option<String>,
    /// World file or shipped name (default: the one that the first dataset names, else a level floor)
    #[arg(long, value_name = "FILE|NAME")]
    world: Option<String>,
    /// Put an effect into the model before it is held against the data; may be given several times
    #[arg(long = "set", value_name = "EFFECT.PARAMETER=VALUE")]
    settings: Vec<String>,
    /// Datasets that take no part in choice or fit, on which the gain is measured
    #[arg(long, value_name = "DATASET", num_args = 1..)]
    hold_out: Vec<PathBuf>,
    /// Causes that may be at work at once
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u8).range(1..=8))]
    most_causes: u8,
    /// Error that the model's responses are allowed, relative: a tyre is not the model's tyre
    #[arg(long, value_name = "SHARE", default_value_t = 0.03, allow_negative_numbers = true, value_parser = positive)]
    response_error: f64,
    /// Keep to the model's law of tyres, also where another serves better
    #[arg(long)]
    hold_tyres: bool,
    /// Worker threads (default: one a core); results do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// New folder for results (default: a new numbered one under recordings/)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Do not write a recording
    #[arg(long)]
    no_recording: bool,
    /// Print JSON on stdout, and nothing else there
    #[arg(long)]
    json: bool,
}

/// Reads, diagnoses, writes, prints.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    set_threads(arguments.threads)?;
    output::expect_new(arguments.out.as_deref())?;
    let read = |paths: &[PathBuf]| paths.iter().map(|path| Dataset::read(path)).collect::<Result<Vec<_>, _>>();
    let (datasets, hold_out) = (read(&arguments.datasets)?, read(&arguments.hold_out)?);
    let wrong = super::check::warn(datasets.iter().chain(&hold_out));
    let cautions = check::cautions(&wrong);
    let (robot, world) = models(arguments, &datasets[0])?;
    let given = load_scene(&robot, &world)?;
    datasets.iter().chain(&hold_out).try_for_each(|dataset| given.robot.expect_stated(dataset))?;
    let settings = Cause::from_settings(&arguments.settings, &given)?;
    let mut given = Cause::edit_all(&settings, &given);
    if !settings.is_empty() {
        // What a campaign left of the model says nothing of one with other causes in it.
        given.robot.residues.clear();
    }

    let simulator = Simulator::new(&given, stop_on_ctrl_c());
    let bar = progress_bar(0, "simulations");
    let progress = simulations(&bar, "which causes these data ask for");
    let options = Options {
        most_causes: usize::from(arguments.most_causes),
        response_error: [arguments.response_error / 1.5, arguments.response_error],
        other_tyres: !arguments.hold_tyres,
        ..Options::default()
    };
    let mut study = Study::new(&datasets, &hold_out, &simulator, options, None, &progress)?;
    let found = study.diagnose()?;
    let gain = study.gain_or_repeats();
    bar.finish_and_clear();

    let folder = output::folder(arguments.out.as_deref(), "diagnosis")?;
    let model = folder.join("extended_model.toml");
    let base = if std::path::Path::new(&robot).is_file() {
        std::path::absolute(&robot).with_context(|| robot.clone())?.to_string_lossy().into_owned()
    } else {
        robot.clone()
    };
    let extended = ExtendedModel {
        base,
        contact: found.other_tyres.map(|tyres| tyres.contact),
        description: format!("treadmark diagnose: {:?}", found.verdict).to_lowercase(),
        causes: settings.into_iter().chain(found.causes.clone()).collect(),
        empirical: found.empirical.clone(),
        // What a calibration would find is known as well as these data say; the rest stays in doubt.
        doubt: Doubt {
            motion: gain.as_ref().map_or(given.robot.doubt.motion, |gain| gain.motion_error),
            response: found.doubt.response.max(given.robot.doubt.response),
            ..found.doubt
        },
        residues: found.residues.clone(),
    };
    std::fs::write(&model, extended.to_toml()).with_context(|| model.display().to_string())?;
    let model = std::path::absolute(&model).with_context(|| model.display().to_string())?;
    let looks_wrong = wrong.iter().map(|(dataset, suspicions)| check::CheckJson::new(dataset, suspicions)).collect();
    let json = serde_json::to_string_pretty(&DiagnosisJson::new(&found, gain.as_ref(), looks_wrong, &model))?;
    std::fs::write(folder.join("diagnosis.json"), &json).with_context(|| folder.display().to_string())?;
    let data: Vec<PathBuf> = arguments.datasets.iter().chain(&arguments.hold_out).cloned().collect();
    let title = format!("What {} gets wrong about {}", given.robot.name, names(&datasets));
    #[cfg(feature = "recording")]
    if !arguments.no_recording {
        let result = diagnosis::markdown(&found, gain.as_ref());
        crate::recording::diagnosis(&folder.join(output::RECORDING), &title, &found, &given, &result)?;
    }
    #[cfg(not(feature = "recording"))]
    output::note_missing_recording(arguments.no_recording);
    let provenance = output::provenance(None, &data)?;
    // What a campaign left is numbers for the next diagnosis; a reader sees it in the figures.
    let text = ExtendedModel { residues: Vec::new(), ..extended }.to_toml();
    output::report(&folder, &page::diagnosis::page(title, &found, gain.as_ref(), &cautions, &text, provenance))?;
    let report = diagnosis::diagnosis(&found, gain.as_ref(), &cautions);
    std::fs::write(folder.join("report.txt"), &report).with_context(|| folder.display().to_string())?;
    if arguments.json {
        sayln!("{json}")?;
    } else {
        sayln!("{report}")?;
        sayln!("{}", output::where_to_look(&folder))?;
    }
    Ok(())
}

/// Names of datasets, as far as a title has room.
fn names(datasets: &[Dataset]) -> String {
    let name = |dataset: &Dataset| dataset.campaign.name.clone();
    match datasets {
        [one] => name(one),
        [one, other] => format!("{} and {}", name(one), name(other)),
        [one, rest @ ..] => format!("{} and {} others", name(one), rest.len()),
        [] => String::new(),
    }
}

/// Robot and world: as given, else as the dataset names them, relative to its folder or shipped.
fn models(arguments: &Arguments, dataset: &Dataset) -> anyhow::Result<(String, String)> {
    let named = |path: &Option<PathBuf>, shipped: &[&str]| {
        let path = path.as_ref()?;
        let beside = arguments.datasets[0].join(path);
        let stem = path.file_stem()?.to_str()?;
        match () {
            () if beside.is_file() => Some(beside.to_string_lossy().into_owned()),
            () if path.is_file() => Some(path.to_string_lossy().into_owned()),
            () if shipped.contains(&stem) => Some(stem.to_owned()),
            () => None,
        }
    };
    let robot = arguments.robot.clone().or_else(|| named(&dataset.campaign.robot.model, ROBOTS.names()));
    let robot = robot.with_context(|| {
        format!(
            "{}: the dataset names no robot model that can be found; give one with --robot (a file, or one of {})",
            arguments.datasets[0].display(),
            ROBOTS.names().join(", ")
        )
    })?;
    let world = arguments.world.clone().or_else(|| named(&dataset.campaign.world_model, WORLDS.names()));
    Ok((robot, world.unwrap_or_else(|| WORLDS.names()[0].to_owned())))
}
