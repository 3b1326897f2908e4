//! Why a sweep cannot be had, or cannot go on. A point that cannot be driven is no error: it is a row that says so.

use crate::effect::EffectError;
use crate::strict::TomlProblem;
use crate::table::TableError;
use std::path::PathBuf;

/// A sweep that cannot be planned, kept or merged.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// A file that cannot be read or written.
    #[error("{}: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A plan that does not parse.
    #[error("{}, {source}", file.display())]
    Toml {
        /// The plan.
        file: PathBuf,
        /// Where and what.
        source: TomlProblem,
    },
    /// A value that its key does not allow.
    #[error("{}, line {line}, column {column}: {key} = {value}: it must be {allowed}", file.display())]
    Value {
        /// The plan.
        file: PathBuf,
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// The key.
        key: String,
        /// As given.
        value: String,
        /// What is.
        allowed: String,
    },
    /// A key that this kind of point, or its protocol, does not have.
    #[error("{}, line {line}, column {column}: {key}: a {what} does not have it", file.display())]
    NotHere {
        /// The plan.
        file: PathBuf,
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// The key.
        key: String,
        /// Kind of point or protocol.
        what: &'static str,
    },
    /// A key that is varied twice.
    #[error("{}, line {line}, column {column}: {key} is varied a second time; once is allowed", file.display())]
    Twice {
        /// The plan.
        file: PathBuf,
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// The key.
        key: String,
    },
    /// A parameter that says neither its values nor its range, or both.
    #[error("{}, line {line}, column {column}: {key}: give either values, or from < to and a count of 2 or more", file.display())]
    Range {
        /// The plan.
        file: PathBuf,
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// The key.
        key: String,
    },
    /// A point of a list without one value a parameter.
    #[error("{}, line {line}, column {column}: this point has {found} values; its parameters are {expected}", file.display())]
    ListPoint {
        /// The plan.
        file: PathBuf,
        /// From 1.
        line: usize,
        /// From 1.
        column: usize,
        /// Values that it has.
        found: usize,
        /// Parameters that there are.
        expected: usize,
    },
    /// More or fewer points than can be.
    #[error("{}: {points} points; there must be from 1 to {most}", file.display())]
    TooMany {
        /// The plan.
        file: PathBuf,
        /// How many it asks for.
        points: u128,
        /// How many are allowed.
        most: usize,
    },
    /// A robot, world or effect of the plan that cannot be had.
    #[error("{}: {source}", file.display())]
    Scene {
        /// The plan.
        file: PathBuf,
        /// What is wrong.
        source: EffectError,
    },
    /// A part that a robot or floor does not have.
    #[error("{}: {key}: {robot} on {world} does not have it; {allowed}", file.display())]
    NoPart {
        /// The plan.
        file: PathBuf,
        /// The key.
        key: String,
        /// The robot.
        robot: String,
        /// The world.
        world: String,
        /// What it has.
        allowed: String,
    },
    /// A folder that is something else.
    #[error("{}: exists already and holds no sweep, and results are never overwritten; name a new folder", folder.display())]
    NotASweep {
        /// The folder.
        folder: PathBuf,
    },
    /// A folder with a sweep of another plan.
    #[error("{}: holds a sweep of another plan than {}; name a new folder", folder.display(), other.display())]
    OtherPlan {
        /// The folder.
        folder: PathBuf,
        /// The plan, or another shard's folder.
        other: PathBuf,
    },
    /// The same plan, but a robot or world file has changed since.
    #[error("{}: its plan is the same, but the robot or world files that it names were others; name a new folder", folder.display())]
    OtherInputs {
        /// The folder.
        folder: PathBuf,
    },
    /// A folder that another version wrote.
    #[error("{}: was written by treadmark {found}, and this is {own}: one table comes from one version", folder.display())]
    OtherVersion {
        /// The folder.
        folder: PathBuf,
        /// Its version.
        found: String,
        /// This version.
        own: &'static str,
    },
    /// A folder with another share of the points.
    #[error("{}: holds shard {found}, not {asked}; name another folder", folder.display())]
    OtherShard {
        /// The folder.
        folder: PathBuf,
        /// Its share.
        found: String,
        /// What was asked for.
        asked: String,
    },
    /// A folder in which another process is at work.
    #[error("{}: another process is at work on this sweep", folder.display())]
    Busy {
        /// The folder.
        folder: PathBuf,
    },
    /// A record that is no record and not the last one either.
    #[error("{}, line {line}: this record is damaged; take the line out, and its point is done again", file.display())]
    Damaged {
        /// The journal.
        file: PathBuf,
        /// From 1.
        line: usize,
    },
    /// Nothing to merge.
    #[error("{}: holds no sweep and no shards of one", folder.display())]
    NoShards {
        /// The folder.
        folder: PathBuf,
    },
    /// Shards cut in different numbers of parts.
    #[error("{}: is shard {found}, and {} is {other_shard}: they are not parts of one cut", folder.display(), other.display())]
    OtherCut {
        /// The folder.
        folder: PathBuf,
        /// Its share.
        found: String,
        /// Another folder.
        other: PathBuf,
        /// That one's share.
        other_shard: String,
    },
    /// A shard that comes twice.
    #[error("{} and {} are both shard {shard}", folder.display(), other.display())]
    SameShard {
        /// The folder.
        folder: PathBuf,
        /// Another folder.
        other: PathBuf,
        /// Their share.
        shard: String,
    },
    /// Shards that are not there.
    #[error("shards are missing: {}", missing.join(", "))]
    MissingShards {
        /// Their names.
        missing: Vec<String>,
    },
    /// Shards that were not run to their end.
    #[error("{}", unfinished.iter().map(|(folder, shard, left)| format!("{}: shard {shard} has {left} points to go", folder.display())).collect::<Vec<_>>().join("; "))]
    Unfinished {
        /// Folder, share, points to go.
        unfinished: Vec<(PathBuf, String, usize)>,
    },
    /// The table.
    #[error(transparent)]
    Table(#[from] TableError),
}
