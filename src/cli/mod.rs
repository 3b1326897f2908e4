//! The command line: one file a subcommand. It validates arguments, prints, and decides nothing.

#[macro_use]
mod say;
mod calibrate;
mod certify;
mod challenge;
mod check;
mod describe;
mod diagnose;
mod drive;
mod effects;
mod experiment;
mod export;
mod import;
mod init;
mod options;
mod output;
mod power;
mod predict;
mod progress;
#[cfg(feature = "recording")]
mod record;
mod report;
mod sweep;
mod table_one;
mod watch;

use crate::report::text;
use clap::{Parser, Subcommand};

/// Simulates, calibrates and records the odometry of wheeled robots.
#[derive(Parser)]
#[command(name = "treadmark", version, about, long_about = None, args_conflicts_with_subcommands = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    experiment: experiment::Arguments,
}

#[derive(Subcommand)]
enum Command {
    /// Drive squares both ways round, calibrate from where they ended, drive again (the default)
    Experiment(experiment::Arguments),
    /// Drive one run
    Drive(drive::Arguments),
    /// Write a model file for a robot of your own, of what its URDF says and of marked assumptions
    Describe(describe::Arguments),
    /// Write a campaign to fill in, with instructions how to mark, drive, measure and note
    Init(init::Arguments),
    /// Make a dataset of recordings of a real robot: rosbag2/MCAP bags, tables, TUM trajectories
    Import(Box<import::Arguments>),
    /// Write surveyed and dead-reckoned paths as TUM trajectories, for evo and others
    Export(export::Arguments),
    /// Say in plain words what looks wrong with a dataset, before anyone calculates; exit code 1 if anything does
    Check(check::Arguments),
    /// Find wheel diameters and track from measured or simulated datasets, by every published method
    Calibrate(calibrate::Arguments),
    /// Show what a model gets wrong about measured data, name the cause, extend the model, measure the gain
    Diagnose(diagnose::Arguments),
    /// Predict end poses and poses on the way for data without any survey
    Predict(predict::Arguments),
    /// Say what a campaign could show, before anyone drives it
    Power(power::Arguments),
    /// Search the catalogue for what made Table I of Bei, Ping & Gao possible
    TableOne(table_one::Arguments),
    /// Hide effects in simulated campaigns, and score how the diagnosis finds them
    Challenge(challenge::Arguments),
    /// Do one thing at many points of a plan, on every core or in shards on a cluster, into one Parquet table
    Sweep(sweep::Arguments),
    /// Hold a robot's simulation against closed forms, mirror images, shorter steps and balances; exit code 1 if one fails
    Certify(certify::Arguments),
    /// Write a report of a folder of results again, or one of a dataset, as one HTML file
    Report(report::Arguments),
    /// List the calibration methods, with source, needs and blind spots
    Methods,
    /// List the effects: every cause that a diagnosis can name and that --set puts into a scene
    Effects(effects::Arguments),
}

/// How a command ended that did what was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Done: exit code 0.
    Done,
    /// A check that was asked for failed: exit code 1.
    CheckFailed,
}

impl Cli {
    /// Does what was asked for.
    ///
    /// # Errors
    /// Anything that kept it from being done, as a chain of causes for the user.
    pub fn run(self) -> anyhow::Result<Outcome> {
        match self.command {
            None => experiment::run(&self.experiment)?,
            Some(Command::Experiment(arguments)) => experiment::run(&arguments)?,
            Some(Command::Drive(arguments)) => drive::run(&arguments)?,
            Some(Command::Describe(arguments)) => describe::run(&arguments)?,
            Some(Command::Init(arguments)) => init::run(&arguments)?,
            Some(Command::Import(arguments)) => import::run(&arguments)?,
            Some(Command::Export(arguments)) => export::run(&arguments)?,
            Some(Command::Check(arguments)) => return check::run(&arguments),
            Some(Command::Calibrate(arguments)) => calibrate::run(&arguments)?,
            Some(Command::Diagnose(arguments)) => diagnose::run(&arguments)?,
            Some(Command::Predict(arguments)) => predict::run(&arguments)?,
            Some(Command::Power(arguments)) => power::run(&arguments)?,
            Some(Command::TableOne(arguments)) => table_one::run(&arguments)?,
            Some(Command::Challenge(arguments)) => challenge::run(&arguments)?,
            Some(Command::Sweep(arguments)) => sweep::run(&arguments)?,
            Some(Command::Certify(arguments)) => return certify::run(&arguments),
            Some(Command::Report(arguments)) => report::run(&arguments)?,
            Some(Command::Methods) => say!("{}", text::methods())?,
            Some(Command::Effects(arguments)) => effects::run(&arguments)?,
        }
        Ok(Outcome::Done)
    }
}
