//! `treadmark init`: a campaign for the lab with a tape measure, to be filled in.

use super::output;
use anyhow::Context;
use clap::Args;
use std::path::PathBuf;

/// What the folder holds; `dataset.toml` comes last, so that a folder that holds one holds the whole dataset.
const FILES: [(&str, &str); 3] = [
    ("README.md", include_str!("template/README.md")),
    ("runs.csv", include_str!("template/runs.csv")),
    ("dataset.toml", include_str!("template/dataset.toml")),
];

/// Arguments of `treadmark init`.
#[derive(Args)]
pub(super) struct Arguments {
    /// New folder for the campaign
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let folder = output::folder(Some(&arguments.folder), "init")?;
    for (name, text) in FILES {
        let path = folder.join(name);
        std::fs::write(&path, text).with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    println!("{} is ready: README.md says how to mark, drive, measure and note", folder.display());
    println!("edit dataset.toml, fill in runs.csv, then: treadmark check {}", folder.display());
    Ok(())
}
