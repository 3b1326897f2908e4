//! Strict TOML for every room: unknown keys, NaN and values out of range are errors with line and column.

use serde::de::{Deserialize, DeserializeOwned, Deserializer, Error};

/// What is wrong at a place in a TOML file, in the parser's words without its picture of the line.
#[derive(Debug)]
pub struct TomlProblem {
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    source: Box<toml::de::Error>,
}

impl std::fmt::Display for TomlProblem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "line {}, column {}: ", self.line, self.column)?;
        // Without its input, the parser's error drops the picture and names the key that it is about.
        let mut source = self.source.clone();
        source.set_input(None);
        f.write_str(&source.to_string().trim_end().replace('\n', ", "))
    }
}

impl std::error::Error for TomlProblem {}

/// Parses `text`.
pub(crate) fn parse<T: DeserializeOwned>(text: &str) -> Result<T, TomlProblem> {
    toml::from_str(text).map_err(|source| {
        let (line, column) = place(text, source.span().map_or(0, |span| span.start));
        TomlProblem { line, column, source: Box::new(source) }
    })
}

/// Line and column, from 1, of the byte at `offset` of `text`.
pub(crate) fn place(text: &str, offset: usize) -> (usize, usize) {
    let before = &text[..offset.min(text.len())];
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

fn ranged<'de, D: Deserializer<'de>>(
    deserializer: D,
    allowed: &str,
    holds: impl Fn(f64) -> bool,
) -> Result<f64, D::Error> {
    let value = f64::deserialize(deserializer)?;
    if value.is_finite() && holds(value) {
        Ok(value)
    } else {
        Err(D::Error::custom(format_args!("{value} is not allowed here: it must be {allowed}")))
    }
}

/// A finite number.
pub(crate) fn finite<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    ranged(deserializer, "a finite number", |_| true)
}

/// A finite number above 0.
pub(crate) fn positive<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    ranged(deserializer, "a finite number above 0", |value| value > 0.0)
}

/// A finite number, 0 or above.
pub(crate) fn non_negative<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    ranged(deserializer, "a finite number, 0 or above", |value| value >= 0.0)
}

/// A share: a number from 0 to 1.
pub(crate) fn share<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    ranged(deserializer, "a number from 0 to 1", |value| (0.0..=1.0).contains(&value))
}

/// [`positive`] for a key that may be absent.
pub(crate) fn optional_positive<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    positive(deserializer).map(Some)
}

/// [`non_negative`] for a key that may be absent.
pub(crate) fn optional_non_negative<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
    non_negative(deserializer).map(Some)
}

/// Three finite numbers.
pub(crate) fn finite_triple<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 3], D::Error> {
    let values = <[f64; 3]>::deserialize(deserializer)?;
    if values.iter().all(|value| value.is_finite()) {
        Ok(values)
    } else {
        Err(D::Error::custom(format_args!("{values:?} is not allowed here: it must be three finite numbers")))
    }
}
