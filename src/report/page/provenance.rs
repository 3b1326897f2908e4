//! How a result can be had again: command, version, seed, and what the data were.

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The files of a dataset, in the order in which they are digested.
const FILES: [&str; 4] = ["dataset.toml", "encoders.csv", "poses.csv", "runs.csv"];

/// What it takes to make a result again.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Provenance {
    /// As it was typed.
    pub command: String,
    /// Of this program.
    pub version: String,
    /// Of all noise; `None` where nothing was drawn.
    pub seed: Option<u64>,
    /// Data that were read.
    pub data: Vec<Digest>,
}

/// What a dataset folder held.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Digest {
    /// Name of its folder.
    pub folder: String,
    /// SHA-256 of the list that `sha256sum` prints of the files.
    pub sha256: String,
    /// The files that it is of.
    pub files: Vec<String>,
}

/// A dataset file that could not be read again.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{}: cannot be read", file.display())]
pub struct DigestError {
    /// The file.
    pub file: PathBuf,
    /// The system's reason.
    pub source: Arc<std::io::Error>,
}

impl Provenance {
    /// Of this program, run as `arguments`, the program's own name first.
    ///
    /// # Errors
    /// A file of the data that cannot be read.
    pub fn new(
        arguments: impl IntoIterator<Item = String>,
        seed: Option<u64>,
        data: &[PathBuf],
    ) -> Result<Provenance, DigestError> {
        let mut words = vec!["treadmark".to_owned()];
        words.extend(arguments.into_iter().skip(1).map(quoted));
        Ok(Provenance {
            command: words.join(" "),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed,
            data: data.iter().map(|folder| Digest::of(folder)).collect::<Result<_, _>>()?,
        })
    }
}

impl Digest {
    /// Of the dataset in `folder`, the same as
    /// `sha256sum dataset.toml encoders.csv poses.csv runs.csv | sha256sum` in it prints, of the files that are there.
    ///
    /// # Errors
    /// A file that is there and cannot be read.
    pub fn of(folder: &Path) -> Result<Digest, DigestError> {
        let mut list = String::new();
        let mut files = Vec::new();
        for name in FILES {
            let file = folder.join(name);
            if !file.is_file() {
                continue;
            }
            let bytes = std::fs::read(&file).map_err(|source| DigestError { file, source: Arc::new(source) })?;
            let _ = writeln!(list, "{}  {name}", hex(&bytes));
            files.push(name.to_owned());
        }
        let name = folder.file_name().map_or_else(|| folder.to_string_lossy(), |name| name.to_string_lossy());
        Ok(Digest { folder: name.into_owned(), sha256: hex(list.as_bytes()), files })
    }
}

fn hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// As a shell wants it.
fn quoted(word: String) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,=:@%+".contains(c);
    if !word.is_empty() && word.chars().all(plain) { word } else { format!("'{}'", word.replace('\'', r"'\''")) }
}
