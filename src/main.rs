//! Parse, call, print the error chain, exit code: 0 done, 1 a check that was asked for failed, 2 error.

#![deny(clippy::print_stdout, clippy::print_stderr)]

use clap::Parser;
use std::io::Write;
use std::process::ExitCode;
use treadmark::cli::Outcome;

fn main() -> ExitCode {
    match treadmark::cli::Cli::parse().run() {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::CheckFailed) => ExitCode::from(1),
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "error: {}", message(&error));
            ExitCode::from(2)
        }
    }
}

/// The chain of causes; a cause that its effect has already told is not told twice.
fn message(error: &anyhow::Error) -> String {
    error.chain().fold(String::new(), |told, cause| match cause.to_string() {
        cause if told.contains(&cause) => told,
        cause if told.is_empty() => cause,
        cause => format!("{told}: {cause}"),
    })
}
