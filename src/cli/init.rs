//! `treadmark init`: a campaign to fill in, for the lab with a tape measure.

use super::output;
use anyhow::Context;
use clap::Args;
use std::path::PathBuf;

/// Arguments of `treadmark init`.
#[derive(Args)]
pub(super) struct Arguments {
    /// New folder for the campaign
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

const TEMPLATE: [(&str, &str); 3] = [
    ("README.md", include_str!("template/README.md")),
    ("dataset.toml", include_str!("template/dataset.toml")),
    ("runs.csv", include_str!("template/runs.csv")),
];

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let folder = output::folder(Some(&arguments.folder), "campaign")?;
    for (name, text) in TEMPLATE {
        let file = folder.join(name);
        std::fs::write(&file, text).with_context(|| format!("{}: cannot be written", file.display()))?;
    }
    sayln!("{} is ready: README.md says how to mark, drive, measure and note", folder.display())?;
    Ok(())
}
