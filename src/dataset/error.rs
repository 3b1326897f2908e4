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
    /// Bytes that are no text.
    #[error("{}, line {line}: is not UTF-8 text; save the file as UTF-8", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// Where the first of those bytes stands, from 1.
        line: u64,
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
    #[error("{}: is there already, and results are never overwritten; write to a new folder", path.display())]
    Exists {
        /// The file of it that was found.
        path: PathBuf,
    },
    /// A campaign that TOML cannot state, such as a path that is not UTF-8.
    #[error("{}: cannot be stated in TOML: {source}", path.display())]
    Unwritable {
        /// `dataset.toml`.
        path: PathBuf,
        /// Why not.
        source: toml::ser::Error,
    },
    /// A dataset that the format cannot hold: what would be read back is not what was to be written.
    #[error(
        "{}: {part} would not read back as it is; names begin and end without blanks, no log is empty, and all encoder logs of a campaign count the same channels in the same unit",
        path.display()
    )]
    NotFaithful {
        /// The folder.
        path: PathBuf,
        /// The first part that would differ.
        part: Part,
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
    /// A blank where something must be.
    #[error("{}, line {line}, column `{column}`: must not be blank: {why}", path.display())]
    Blank {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: u64,
        /// Its name in the header.
        column: String,
        /// What it is for.
        why: &'static str,
    },
    /// Part of a pose: x and y are measured both or neither, a heading only with them.
    #[error("{}, line {line}, column `{blank}`: must not be blank beside `{value}` in `{filled}`: a pose is whole or blank", path.display())]
    Together {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: u64,
        /// The column that is blank.
        blank: &'static str,
        /// A column of the same pose that is not.
        filled: &'static str,
        /// What stands in it.
        value: String,
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
        expected: &'static str,
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
        known: Vec<&'static str>,
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
    /// A value over two lines: as good as always a quote without its partner.
    #[error("a value runs over the end of the line; a double quote that opens a value needs one that closes it")]
    LineBreak,
    /// An encoder column without a side or a unit.
    #[error(
        "unknown column `{column}`; encoder columns are left_ticks and right_ticks, left_rad and right_rad, or one a wheel, such as front_left_ticks"
    )]
    EncoderColumn {
        /// Its name.
        column: String,
    },
    /// Ticks beside radians.
    #[error(
        "columns `{first}` and `{column}` differ in their unit; all encoder columns count ticks, or all are in rad"
    )]
    MixedUnits {
        /// The first encoder column.
        first: String,
        /// One of the other unit.
        column: String,
    },
    /// Wheels on one side only.
    #[error(
        "no column of the {side} side; encoder columns are left_ticks and right_ticks, left_rad and right_rad, or one a wheel, such as front_{side}_ticks"
    )]
    MissingSide {
        /// `left` or `right`.
        side: &'static str,
    },
}

/// Part of a dataset.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Part {
    /// What `dataset.toml` states.
    #[error("the campaign")]
    Campaign,
    /// One of its runs.
    #[error("run `{0}`")]
    Run(String),
}
