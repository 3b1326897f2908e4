//! `treadmark table-one`: what made the paper's own Table I possible.

use super::options::SceneOptions;
use super::watch::stop_on_ctrl_c;
use super::{Cli, output};
use crate::effect::ExtendedModel;
use crate::experiment::{self, Candidate, Simulator, TABLE_ONE};
use crate::report::{table_one, text::Style};
use anyhow::Context;
use clap::{Args, Parser};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Arguments of `treadmark table-one`.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneOptions,
}

/// Searches, prints, writes the best model, and drives it.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    super::options::set_threads(arguments.scene.threads)?;
    output::expect_new(arguments.scene.out.as_deref())?;
    let mut scene = arguments.scene.scene()?;
    scene.time_step = scene.time_step.max(Simulator::TIME_STEP);
    let done = AtomicUsize::new(0);
    let watch = |candidate: &Candidate| {
        let number = done.fetch_add(1, Ordering::Relaxed) + 1;
        let effects: Vec<&str> = candidate.on_top().iter().map(|cause| cause.effect.id).collect();
        let name = if effects.is_empty() { "nothing more".to_owned() } else { effects.join(" and ") };
        tell!("{number:>3}: {name} leaves χ² {:.1}", candidate.chi2);
    };
    let candidates = experiment::table_one(&scene, &watch, stop_on_ctrl_c())?;
    let best = candidates.first().context("no candidate could be driven")?;

    let folder = output::folder(arguments.scene.out.as_deref(), "table-one")?;
    let model = ExtendedModel {
        contact: arguments.scene.tyre.map(crate::scene::Contact::from),
        base: arguments.scene.robot.clone(),
        description: "The robot that comes nearest to Table I of Bei, Ping & Gao".to_owned(),
        causes: best.causes.clone(),
        empirical: Vec::new(),
        doubt: crate::scene::Doubt::default(),
        residues: Vec::new(),
    };
    let file = folder.join("best_model.toml");
    std::fs::write(&file, model.to_toml()).with_context(|| file.display().to_string())?;
    let json = crate::report::json::table_one(&candidates);
    std::fs::write(folder.join("table_one.json"), format!("{json:#}\n"))
        .with_context(|| folder.display().to_string())?;
    if arguments.scene.json {
        sayln!("{json:#}")?;
        return Ok(());
    }
    sayln!("{}", table_one::table_one(&candidates, &TABLE_ONE, Style::Terminal))?;
    if !arguments.scene.no_recording {
        let out = folder.join("best");
        let words = [
            "treadmark".into(),
            "experiment".into(),
            "--robot".into(),
            file.clone().into_os_string(),
            "--sides".into(),
            "2".into(),
            "--repeats".into(),
            "1".into(),
            "--no-survey-noise".into(),
            "--no-scatter".into(),
            "--method".into(),
            "umbmark,bei2018".into(),
            "--out".into(),
            out.into_os_string(),
        ];
        Cli::try_parse_from(words)?.run()?;
    }
    sayln!("the best robot is {}; every command takes it as --robot", file.display())?;
    Ok(())
}
