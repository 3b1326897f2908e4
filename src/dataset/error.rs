//! What can be wrong with the files of a dataset.

use crate::strict::TomlProblem;
use std::path::PathBuf;

/// A dataset that cannot be read or written. Each message names file, line, column and value, and what is allowed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// A file or folder that cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file or folder that cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A dataset that is there already.
    #[error("{}: a dataset is there already, and results are never overwritten", path.display())]
    Exists {
        /// Its `dataset.toml`.
        path: PathBuf,
    },
    /// `dataset.toml`: does not parse, an unknown or missing key, a value out of range.
    #[error("{}, {source}", path.display())]
    Toml {
        /// The file.
        path: PathBuf,
        /// Where and what.
        source: TomlProblem,
    },
    /// A CSV that does not parse.
    #[error("{}, line {line}: {problem}", path.display())]
    Csv {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: u64,
        /// What is wrong.
        problem: CsvProblem,
    },
    /// A value that is not allowed.
    #[error("{}, line {line}, column `{column}`: `{value}` is not allowed here: {allowed}", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: u64,
        /// Its name in the header.
        column: String,
        /// As it stands in the file.
        value: String,
        /// What is allowed.
        allowed: String,
    },
    /// Ticks that nobody can turn into radians.
    #[error(
        "{}: its columns count ticks, but neither odometry.ticks_per_revolution nor robot.ticks_per_revolution of dataset.toml says how many make a turn",
        path.display()
    )]
    NoTicksPerRevolution {
        /// `encoders.csv`.
        path: PathBuf,
    },
}

/// What is wrong with a CSV as a whole or with a row as a whole.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CsvProblem {
    /// Nothing in it.
    #[error("the file is empty; it begins with a header: {expected}")]
    Empty {
        /// The header.
        expected: String,
    },
    /// A header and no rows.
    #[error("there are no runs below the header")]
    NoRows,
    /// Semicolons or tabs.
    #[error("columns are separated by {found}; write commas between columns and points in decimals")]
    Separator {
        /// Which separator.
        found: &'static str,
    },
    /// A column that is not known.
    #[error("unknown column `{column}`; known are: {}", known.join(", "))]
    UnknownColumn {
        /// Its name.
        column: String,
        /// Those that are known.
        known: Vec<String>,
    },
    /// A column twice.
    #[error("column `{column}` stands there twice")]
    DuplicateColumn {
        /// Its name.
        column: String,
    },
    /// A column that has to be there.
    #[error("column `{column}` is missing")]
    MissingColumn {
        /// Its name.
        column: &'static str,
    },
    /// A row that is too short or too long.
    #[error(
        "{found} values under {expected} columns; a decimal comma would also split a value in two: write points in decimals"
    )]
    Ragged {
        /// In the row.
        found: usize,
        /// In the header.
        expected: usize,
    },
    /// Values that stand together or not at all.
    #[error("{columns} stand together or are blank together")]
    Together {
        /// Which columns.
        columns: &'static str,
    },
    /// Bytes that are no text.
    #[error("the file is not UTF-8 text")]
    NotText,
    /// Encoder columns that make no pair of sides.
    #[error(
        "encoder columns end in `_ticks` or `_rad`, all in one of the two, each named by a side: left_ticks,right_ticks, or one a wheel such as front_left_ticks; at least one for each side"
    )]
    EncoderColumns,
}
