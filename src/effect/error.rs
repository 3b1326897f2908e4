//! What can be wrong with an effect's settings or an extended model file.

use super::EFFECTS;
use crate::scene::{EmpiricalTerm, SceneError};
use crate::strict::TomlProblem;
use std::path::PathBuf;

/// A cause that cannot be had. Each message names the place, the value and what is allowed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EffectError {
    /// Not `EFFECT.PARAMETER=VALUE`.
    #[error("--set {setting}: it must read EFFECT.PARAMETER=VALUE, as in floor_slope.gradient=0.01")]
    Malformed {
        /// As given.
        setting: String,
    },
    /// An effect that does not exist.
    #[error("`{given}`: no such effect; there are: {}", known.join(", "))]
    UnknownEffect {
        /// As given.
        given: String,
        /// Those that exist.
        known: Vec<&'static str>,
    },
    /// A parameter that the effect does not have.
    #[error("{effect}: no parameter `{parameter}`; it has: {}", known.join(", "))]
    UnknownParameter {
        /// The effect.
        effect: &'static str,
        /// As given.
        parameter: String,
        /// Those that it has.
        known: Vec<&'static str>,
    },
    /// A value that is no finite number.
    #[error("{effect}.{parameter} = {value}: it must be a finite number")]
    NotANumber {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        parameter: &'static str,
        /// As given.
        value: String,
    },
    /// A value out of its bounds.
    #[error("{effect}.{parameter} = {value}: it must lie between {least} and {greatest}")]
    OutOfBounds {
        /// The effect.
        effect: &'static str,
        /// The parameter.
        parameter: &'static str,
        /// As given.
        value: f64,
        /// Least allowed.
        least: f64,
        /// Greatest allowed.
        greatest: f64,
    },
    /// A wheel or side that does not exist, or was not said.
    #[error("{effect}.{key} = \"{given}\": it must be one of {}", among.join(", "))]
    Choice {
        /// The effect.
        effect: &'static str,
        /// `wheel` or `side`.
        key: &'static str,
        /// As given.
        given: String,
        /// Those that exist.
        among: Vec<String>,
    },
    /// A scene in which it does nothing.
    #[error("{effect}: it needs {needs}, and robot `{robot}` as it stands here has none")]
    DoesNotApply {
        /// The effect.
        effect: &'static str,
        /// The robot.
        robot: String,
        /// What it needs.
        needs: &'static str,
    },
    /// A robot or world that cannot be loaded.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An extended model file that does not parse.
    #[error("{}, {source}", file.display())]
    Toml {
        /// The file.
        file: PathBuf,
        /// Where and what.
        source: TomlProblem,
    },
    /// A cause in an extended model file.
    #[error("{}: {source}", file.display())]
    InFile {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        source: Box<EffectError>,
    },
    /// A residue whose readings do not fit together.
    #[error(
        "residue of `{condition}`: x, y, heading and at have {} numbers; heading may have none, the rest must be as many \
         (without `at`, one of each), all finite, of more than 0 runs",
        counts.map(|count| count.to_string()).join(", ")
    )]
    Residue {
        /// Its condition.
        condition: String,
        /// Numbers in `x`, `y`, `heading` and `at`.
        counts: [usize; 4],
    },
    /// A term of a formula that cannot be.
    #[error("[[empirical]] {term}: a coefficient is a finite number, and a potential one of x², x y or y²")]
    Term {
        /// The term.
        term: EmpiricalTerm,
    },
    /// Extended models that extend one another in a circle, or too deep.
    #[error("{}: models that extend one another more than {limit} deep, or in a circle", file.display())]
    TooDeep {
        /// The file.
        file: PathBuf,
        /// How deep is allowed.
        limit: usize,
    },
    /// A file that cannot be read or written.
    #[error("{}: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
}

impl EffectError {
    pub(super) fn unknown(given: &str) -> EffectError {
        EffectError::UnknownEffect { given: given.to_owned(), known: EFFECTS.iter().map(|effect| effect.id).collect() }
    }
}
