//! Where results go: a new folder each time, so that nothing is ever overwritten.

use anyhow::Context;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Name of the recording in a folder of results.
#[cfg(feature = "recording")]
pub(super) const RECORDING: &str = "recording.rrd";

/// Says once what a build without the feature leaves out.
#[cfg(not(feature = "recording"))]
pub(super) fn note_missing_recording(unwanted: bool) {
    if !unwanted {
        eprintln!("note: this build makes no recordings (cargo feature `recording`)");
    }
}

/// Where results are, and how to look at them.
pub(super) fn where_to_look(folder: &Path) -> String {
    let recording = folder.join("recording.rrd");
    if recording.is_file() {
        format!("results are in {}; look at them with `rerun {}`", folder.display(), recording.display())
    } else {
        format!("results are in {}", folder.display())
    }
}

/// Makes the folder that was asked for, which must not exist yet; or a new numbered one under `recordings/`.
pub(super) fn folder(asked: Option<&Path>, command: &str) -> anyhow::Result<PathBuf> {
    if let Some(path) = asked {
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).with_context(|| format!("{}: cannot be made", parent.display()))?;
        }
        return match std::fs::create_dir(path) {
            Ok(()) => Ok(path.to_owned()),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                anyhow::bail!(
                    "{}: exists already, and results are never overwritten; name a new folder",
                    path.display()
                )
            }
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
