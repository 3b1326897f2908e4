//! The robots and worlds that come with the program, so that it works from any folder.

use super::error::SceneError;
use crate::strict;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// Files of one kind that are built into the program.
pub struct Shipped {
    folder: &'static str,
    names: &'static [&'static str],
    files: &'static [(&'static str, &'static str)],
}

macro_rules! shipped {
    ($folder:literal, [$($name:literal),*], [$($file:literal),*]) => {
        Shipped {
            folder: $folder,
            names: &[$($name),*],
            files: &[$(($file, include_str!(concat!("../../", $folder, "/", $file)))),*],
        }
    };
}

/// Robots by name.
pub const ROBOTS: Shipped = shipped!(
    "robots",
    ["jnpf_4wd", "husky_a200", "optiodom", "leo", "rosbot", "panther", "pioneer_3at"],
    [
        "jnpf_4wd.toml",
        "jnpf_4wd.urdf",
        "husky_a200.toml",
        "husky_a200.urdf",
        "optiodom.toml",
        "optiodom.urdf",
        "leo.toml",
        "leo.urdf",
        "rosbot.toml",
        "rosbot.urdf",
        "panther.toml",
        "panther.urdf",
        "pioneer_3at.toml",
        "pioneer_3at.urdf"
    ]
);

/// Worlds by name.
pub const WORLDS: Shipped = shipped!(
    "worlds",
    ["lab_floor", "tilted_floor", "slippery_patch", "sill"],
    ["lab_floor.toml", "tilted_floor.toml", "slippery_patch.toml", "sill.toml"]
);

/// The text of a file, and what to call it in messages.
pub(super) struct Source {
    pub file: PathBuf,
    pub text: String,
    shipped: Option<&'static Shipped>,
}

impl Shipped {
    /// The names, in the order of the docs.
    pub fn names(&self) -> &'static [&'static str] {
        self.names
    }

    /// The model or world file `given` as a path, or shipped under that name.
    pub(super) fn find(&'static self, kind: &'static str, given: &str) -> Result<Source, SceneError> {
        let path = Path::new(given);
        if self.names.contains(&given) && !path.is_file() {
            return Ok(self.built_in(&format!("{given}.toml")).expect("every name has its file"));
        }
        if !path.is_file() {
            return Err(SceneError::NotFound { kind, given: given.to_owned(), shipped: self.names.to_vec() });
        }
        read(path)
    }

    fn built_in(&'static self, file: &str) -> Option<Source> {
        self.files.iter().find(|(name, _)| *name == file).map(|(name, text)| Source {
            file: Path::new(self.folder).join(name),
            text: (*text).to_owned(),
            shipped: Some(self),
        })
    }
}

impl Source {
    /// The text as strict TOML.
    pub(super) fn parse<T: DeserializeOwned>(&self) -> Result<T, SceneError> {
        strict::parse(&self.text).map_err(|source| SceneError::Toml { file: self.file.clone(), source })
    }

    /// A file that this one names, relative to its own folder.
    pub(super) fn sibling(&self, name: &str) -> Result<Source, SceneError> {
        if let Some(source) = self.shipped.and_then(|shipped| shipped.built_in(name)) {
            return Ok(source);
        }
        read(&self.file.parent().unwrap_or(Path::new("")).join(name))
    }
}

fn read(path: &Path) -> Result<Source, SceneError> {
    match std::fs::read_to_string(path) {
        Ok(text) => Ok(Source { file: path.to_owned(), text, shipped: None }),
        Err(source) => Err(SceneError::Io { file: path.to_owned(), source }),
    }
}
