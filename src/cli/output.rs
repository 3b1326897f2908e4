//! Where results go: a new folder each time, so that nothing is ever overwritten.

use crate::report::page::{Page, Provenance};
use anyhow::Context;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Name of the recording in a folder of results.
#[cfg(feature = "recording")]
pub(super) const RECORDING: &str = "recording.rrd";

/// Says once what a build without the feature leaves out.
#[cfg(not(feature = "recording"))]
pub(super) fn note_missing_recording(unwanted: bool) {
    if !unwanted {
        tell!("note: this build makes no recordings (cargo feature `recording`)");
    }
}

/// Writes a file whole: under a temporary name, then under its own.
pub(super) fn write(file: &Path, text: &str) -> anyhow::Result<()> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".treadmark-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666)); // as the umask has it
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let write = || -> std::io::Result<()> {
        let mut temporary = builder.tempfile_in(folder)?;
        temporary.write_all(text.as_bytes())?;
        temporary.as_file().sync_all()?;
        temporary.persist(file).map_err(|error| error.error)?;
        Ok(())
    };
    write().with_context(|| format!("{}: cannot be written", file.display()))
}

/// Name of the report's data in a folder of results.
pub(super) const REPORT_JSON: &str = "report.json";

/// Writes a report into a folder of results: the page, and what it is made of.
pub(super) fn report(folder: &Path, page: &Page) -> anyhow::Result<()> {
    write(&folder.join(REPORT_JSON), &serde_json::to_string(page)?)?;
    write(&folder.join("report.html"), &page.html())
}

/// How a result can be had again: the command as it was typed, and the data that it read.
pub(super) fn provenance(seed: Option<u64>, data: &[PathBuf]) -> anyhow::Result<Provenance> {
    let arguments = std::env::args_os().map(|argument| argument.to_string_lossy().into_owned());
    Ok(Provenance::new(arguments, seed, data)?)
}

/// Where results are, and how to look at them.
pub(super) fn where_to_look(folder: &Path) -> String {
    let recording = folder.join("recording.rrd");
    let mut words = format!("results are in {}", folder.display());
    if recording.is_file() {
        words.push_str(&format!("; look at them with `rerun {}`", recording.display()));
    }
    let report = folder.join("report.html");
    if report.is_file() {
        words.push_str(&format!("\nthe report is {}", report.display()));
    }
    words
}

/// Refuses a folder that exists already, before long work whose results could not be put there.
pub(super) fn expect_new(asked: Option<&Path>) -> anyhow::Result<()> {
    match asked {
        Some(path) if path.exists() => Err(exists_already(path)),
        _ => Ok(()),
    }
}

fn exists_already(path: &Path) -> anyhow::Error {
    anyhow::anyhow!("{}: exists already, and results are never overwritten; name another", path.display())
}

/// Makes the folder that was asked for, which must not exist yet; or a new numbered one under `recordings/`.
pub(super) fn folder(asked: Option<&Path>, command: &str) -> anyhow::Result<PathBuf> {
    if let Some(path) = asked {
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).with_context(|| format!("{}: cannot be made", parent.display()))?;
        }
        return match std::fs::create_dir(path) {
            Ok(()) => Ok(path.to_owned()),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(exists_already(path)),
            Err(error) => Err(error).with_context(|| format!("{}: cannot be made", path.display())),
        };
    }
    let parent = Path::new("recordings");
    std::fs::create_dir_all(parent).with_context(|| format!("{}: cannot be made", parent.display()))?;
    for number in 1.. {
        let path = parent.join(format!("{command}-{number:03}"));
        match std::fs::create_dir(&path) {
            Ok(()) => return Ok(path),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error).with_context(|| format!("{}: cannot be made", path.display())),
        }
    }
    unreachable!("the numbers do not end")
}
