//! `treadmark report`: one HTML file of a folder of results, or of a dataset.

use super::output;
use crate::calibrate;
use crate::dataset::Dataset;
use crate::experiment::sweep;
use crate::report::page::{self, Digest, FORMAT, Page, Provenance};
use anyhow::Context;
use clap::Args;
use std::path::{Path, PathBuf};

/// Arguments of `treadmark report`.
#[derive(Args)]
pub(super) struct Arguments {
    /// Folder of results by `diagnose`, `experiment`, `calibrate --out` or `sweep`, or of a dataset
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// New file for the report (default: a new report.html; in a folder of results the one that is there is written again)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let folder = &arguments.folder;
    let results = folder.join(output::REPORT_JSON);
    let swept = folder.join(sweep::TABLE);
    let (page, again) = if swept.is_file() {
        (of_sweep(folder, &swept)?, true)
    } else if results.is_file() {
        (read(&results)?, true)
    } else if folder.join("dataset.toml").is_file() {
        let dataset = Dataset::read(folder)?;
        let provenance = output::provenance(None, std::slice::from_ref(folder))?;
        (page::dataset::page(&dataset, &calibrate::check(&dataset), provenance), false)
    } else {
        anyhow::bail!(
            "{}: there is neither a {} (results) nor a {} (a sweep) nor a dataset.toml (a dataset)",
            folder.display(),
            output::REPORT_JSON,
            sweep::TABLE
        )
    };
    // A dataset is the lab's; nothing is added to it unasked.
    let default = if again { folder.join("report.html") } else { PathBuf::from("report.html") };
    let file = arguments.out.clone().unwrap_or(default);
    anyhow::ensure!(
        (again && arguments.out.is_none()) || !file.exists(),
        "{}: exists already, and results are never overwritten; name a new file with --out",
        file.display()
    );
    output::write(&file, &page.html())?;
    sayln!("the report is {}", file.display())?;
    Ok(())
}

/// The page of a sweep, whole or merged.
fn of_sweep(folder: &Path, table: &Path) -> anyhow::Result<Page> {
    let (plan, table) = sweep::read(table)?;
    let version = table.notes.iter().find(|(key, _)| key == "treadmark.version").map(|(_, version)| version.clone());
    let provenance = Provenance {
        command: "treadmark sweep plan.toml --out NEW_DIR".to_owned(),
        version: version.unwrap_or_default(),
        seed: Some(plan.seed),
        data: vec![Digest::of_files(folder, &[sweep::TABLE])?],
    };
    Ok(page::sweep::page(&plan, &table, provenance))
}

fn read(file: &Path) -> anyhow::Result<Page> {
    let text = std::fs::read_to_string(file).with_context(|| format!("{}: cannot be read", file.display()))?;
    let page: Page =
        serde_json::from_str(&text).with_context(|| format!("{}: is no report of this version", file.display()))?;
    anyhow::ensure!(
        page.format == FORMAT,
        "{}: format = \"{}\" is not known; this version reads \"{FORMAT}\"",
        file.display(),
        page.format
    );
    Ok(page)
}
