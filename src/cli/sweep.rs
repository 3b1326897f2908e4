//! `treadmark sweep`: one thing at many points of a plan, and shards put together.

use super::options::set_threads;
use super::progress::progress_bar;
use super::watch::stop_on_ctrl_c;
use crate::experiment::sweep::{Plan, Progress, Shard, Sweep, Swept, merge};
use crate::report::json::SweptJson;
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Arguments of `treadmark sweep`.
#[derive(Args)]
pub(super) struct Arguments {
    /// The plan: what a point is, what is varied and over what
    #[arg(value_name = "PLAN.toml", required_unless_present = "merge", conflicts_with = "merge")]
    plan: Option<PathBuf>,
    /// Folder of results; one with part of the same sweep goes on where it was stopped
    #[arg(long, value_name = "DIR", required_unless_present = "merge")]
    out: Option<PathBuf>,
    /// Do only the points whose index leaves I when divided by N, for one machine of several; I from 0
    #[arg(long, value_name = "I/N", conflicts_with = "merge")]
    shard: Option<Shard>,
    /// Put shards, or folders of shards, together into one table: in --out, or in the only DIR
    #[arg(long, value_name = "DIR", num_args = 1..)]
    merge: Vec<PathBuf>,
    /// Worker threads (default: one a core); results do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print JSON on stdout, and nothing else there
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    set_threads(arguments.threads)?;
    if let Some(plan) = &arguments.plan
        && let Some(out) = &arguments.out
    {
        return sweep(arguments, plan, out);
    }
    let into = match (&arguments.out, arguments.merge.as_slice()) {
        (Some(out), _) => out,
        (None, [only]) => only,
        (None, _) => anyhow::bail!("--merge of several folders needs --out DIR for their table"),
    };
    let merged = merge(&arguments.merge, into)?;
    if arguments.json {
        sayln!("{}", serde_json::to_string_pretty(&SweptJson::merged(&merged))?)?;
    } else {
        sayln!(
            "{} points of {} shards are in {}; `treadmark report {}` draws them",
            merged.points,
            merged.shards,
            merged.table.display(),
            into.display()
        )?;
    }
    Ok(())
}

fn sweep(arguments: &Arguments, plan: &Path, out: &Path) -> anyhow::Result<()> {
    let sweep = Sweep::prepare(Plan::read(plan)?)?;
    let shard = arguments.shard.unwrap_or(Shard::WHOLE);
    let stop = stop_on_ctrl_c();
    let began = Instant::now();
    let bar = progress_bar(shard.points(sweep.plan().len()).count(), "points");
    let watch = |progress: &Progress| {
        bar.set_position((progress.before + progress.since) as u64);
        bar.set_message(rate(progress, began.elapsed()));
    };
    let swept = sweep.run(out, shard, &watch, stop);
    bar.finish_and_clear();
    let swept = swept?;
    let took = began.elapsed();
    tell!("{}", account(&swept, took));
    anyhow::ensure!(
        swept.is_complete(),
        "interrupted; {} keeps {} of {} points, and the same command goes on from there",
        swept.folder.display(),
        swept.progress.before + swept.progress.since,
        swept.progress.points
    );
    if arguments.json {
        sayln!("{}", serde_json::to_string_pretty(&SweptJson::new(&swept, took))?)?;
    } else {
        match &swept.table {
            Some(table) => sayln!(
                "{} points are in {}; `treadmark report {}` draws them",
                swept.progress.points,
                table.display(),
                swept.folder.display()
            )?,
            None => sayln!(
                "shard {shard}: {} points are in {}; with all shards there, `treadmark sweep --merge {}`",
                swept.progress.points,
                swept.folder.display(),
                out.display()
            )?,
        }
    }
    Ok(())
}

/// Simulated seconds a second, or points where what is simulated is not counted.
fn rate(progress: &Progress, took: Duration) -> String {
    let took = took.as_secs_f64().max(1e-3);
    if progress.simulated > 0.0 {
        format!("{:.0} simulated seconds a second", progress.simulated / took)
    } else {
        format!("{:.2} points a second", progress.since as f64 / took)
    }
}

/// What was done since this start, in a line or two.
fn account(swept: &Swept, took: Duration) -> String {
    let progress = &swept.progress;
    let mut line = format!("{} points in {:.1} s", progress.since, took.as_secs_f64());
    if progress.before > 0 {
        line += &format!(", {} were done before", progress.before);
    }
    if progress.since > 0 {
        line += &format!("; {} on {} threads", rate(progress, took), rayon::current_num_threads());
    }
    if let Some((index, failure)) = swept.failures.first() {
        line += &format!("\nnote: {} points could not be done; the first, {index}: {failure}", swept.failures.len());
    }
    line
}
