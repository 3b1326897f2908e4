//! Parse, call, print the error chain, exit code: 0 done, 1 a check that was asked for failed, 2 error.

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    match treadmark::cli::Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}
