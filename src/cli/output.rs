//! Where results go: a new folder each time, so that nothing is ever overwritten.

use anyhow::Context;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

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
