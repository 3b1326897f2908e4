//! `treadmark certify`: a robot's simulation held against what is known.

use super::Outcome;
use super::options::{positive, set_threads};
use super::output;
use super::progress::progress_bar;
use crate::experiment::certify::{self, Progress};
use crate::report::{certify as report, plot};
use crate::scene::{DEFAULT_TIME_STEP, Scene, WORLDS};
use anyhow::Context;
use clap::Args;
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};

/// Arguments of `treadmark certify`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Robot model file, or the name of a shipped robot
    #[arg(value_name = "ROBOT", required_unless_present = "literature", conflicts_with = "literature")]
    robot: Option<String>,
    /// Compare the shipped robots with published track multipliers instead
    #[arg(long, conflicts_with_all = ["json", "out", "time_step"])]
    literature: bool,
    /// Simulation step [s]
    #[arg(long, value_name = "SECONDS", default_value_t = DEFAULT_TIME_STEP, allow_negative_numbers = true, value_parser = positive)]
    time_step: f64,
    /// Worker threads (default: one a core); results do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// New folder for certificate.json and effective_track.svg: effective track over turn radius, load offset and friction
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON on stdout, and nothing else there
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    set_threads(arguments.threads)?;
    match &arguments.robot {
        Some(robot) => certify(arguments, robot),
        None => literature(),
    }
}

fn certify(arguments: &Arguments, robot: &str) -> anyhow::Result<Outcome> {
    let mut scene = Scene::load(robot, WORLDS.names()[0])?;
    scene.time_step = arguments.time_step;
    for note in &scene.robot.notes {
        tell!("note: {note}");
    }
    let folder = arguments.out.as_deref().map(|path| output::folder(Some(path), "certify")).transpose()?;
    let progress = progress_bar(0, "runs");
    let tell = telling(&progress);
    let certificate = certify::certify(&scene, &tell)?;
    let sweeps = folder.as_ref().map(|_| certify::sweeps(&scene, &tell));
    progress.finish_and_clear();

    let json = serde_json::to_string_pretty(&report::CertifyJson::from(&certificate))?;
    if let (Some(folder), Some(sweeps)) = (&folder, &sweeps) {
        write(&folder.join("certificate.json"), &json)?;
        write(&folder.join("effective_track.svg"), &plot::sweeps(sweeps)?)?;
    }
    if arguments.json {
        sayln!("{json}")?;
    } else {
        say!("{}", report::certificate(&certificate))?;
        if let Some(folder) = &folder {
            sayln!("{}", output::where_to_look(folder))?;
        }
    }
    Ok(if certificate.passed() { Outcome::Done } else { Outcome::CheckFailed })
}

fn literature() -> anyhow::Result<Outcome> {
    let progress = progress_bar(0, "runs");
    let rows = certify::literature(&telling(&progress))?;
    progress.finish_and_clear();
    say!("{}", report::literature(&rows))?;
    Ok(Outcome::Done)
}

fn telling(progress: &ProgressBar) -> impl Fn(Progress) + Sync {
    move |news| match news {
        Progress::Ahead(simulations) => progress.inc_length(simulations as u64),
        Progress::Done => progress.inc(1),
    }
}

fn write(file: &Path, text: &str) -> anyhow::Result<()> {
    std::fs::write(file, text).with_context(|| format!("{}: cannot be written", file.display()))
}
