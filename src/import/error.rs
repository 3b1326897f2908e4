//! What keeps a recording from becoming a dataset.

use crate::dataset::{DatasetError, EncoderUnit};
use std::path::PathBuf;
use std::sync::Arc;

/// A recording that cannot be imported. Each message names file, place and value, and what is allowed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// A file or folder that cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file of a kind that is not known.
    #[error(
        "{}: is no recording that can be read here; an MCAP bag (.mcap, or the folder of a rosbag2), a table with a header (.csv) and a TUM trajectory (.tum or .txt) can; other bags become MCAP by `ros2 bag convert`",
        path.display()
    )]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// A bag that was not written to its end.
    #[error(
        "{}: breaks off at byte {bytes}, before the end that a whole bag has; {read} could be read; `mcap recover` makes a whole bag of that",
        path.display()
    )]
    Truncated {
        /// The bag.
        path: PathBuf,
        /// Its length.
        bytes: u64,
        /// What was read before it broke off.
        read: Box<Readable>,
    },
    /// A bag with bytes in it that are none of a bag.
    #[error("{}: is damaged before byte {byte}: {source}; {read} could be read; `mcap recover` keeps what is whole", path.display())]
    Damaged {
        /// The bag.
        path: PathBuf,
        /// How far it was read.
        byte: u64,
        /// The library's reason.
        source: Box<dyn std::error::Error + Send + Sync>,
        /// What was read before.
        read: Box<Readable>,
    },
    /// A topic whose type is not known.
    #[error(
        "{}: topic {topic} has no schema, so the type of its {messages} messages is not known; record it again, or convert the bag with `ros2 bag convert`, which adds it; {read} could be read",
        path.display()
    )]
    NoSchema {
        /// The bag.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// How many it has.
        messages: u64,
        /// What the bag holds.
        read: Box<Readable>,
    },
    /// A topic that is not in the bag.
    #[error("{}: {option} {topic}: there is no such topic; there are: {read}", path.display())]
    NoTopic {
        /// The bag.
        path: PathBuf,
        /// `--encoders` or `--pose`.
        option: &'static str,
        /// What was asked for.
        topic: String,
        /// What the bag holds.
        read: Box<Readable>,
    },
    /// A topic of another type than can be read.
    #[error("{}: {option} {topic}: it is of type {found}; allowed are {}", path.display(), allowed.join(", "))]
    TopicType {
        /// The bag.
        path: PathBuf,
        /// `--encoders` or `--pose`.
        option: &'static str,
        /// The topic.
        topic: String,
        /// Its type and encoding.
        found: String,
        /// The types that are read.
        allowed: &'static [&'static str],
    },
    /// No topic that would do, or none that may be taken without being asked.
    #[error("{}: no topic can be taken for {what} by itself{}; choose with {option} TOPIC{}; there are: {read}",
        path.display(),
        if doubtful.is_empty() { String::new() } else { format!(" ({} may be the robot's own dead reckoning, which is no survey)", doubtful.join(", ")) },
        if *option == "--pose" { ", or say --pose none where ends were measured otherwise" } else { "" })]
    NoCandidate {
        /// The bag.
        path: PathBuf,
        /// The encoders or the surveyed pose.
        what: &'static str,
        /// `--encoders` or `--pose`.
        option: &'static str,
        /// Topics of a fitting type that are not taken by themselves.
        doubtful: Vec<String>,
        /// What the bag holds.
        read: Box<Readable>,
    },
    /// Several that would do.
    #[error("{}: {what} may come from any of {}; choose with {option}", path.display(), candidates.join(", "))]
    Ambiguous {
        /// The bag.
        path: PathBuf,
        /// The encoders, the surveyed pose, the frames, the left joints, …
        what: &'static str,
        /// The option that chooses.
        option: &'static str,
        /// What would do.
        candidates: Vec<String>,
    },
    /// A joint or a pair of frames that never appears in the topic.
    #[error("{}: {option} {asked}: topic {topic} never has it; it has {}", path.display(), there.join(", "))]
    NotInTopic {
        /// The bag.
        path: PathBuf,
        /// `--left`, `--right` or `--frame`.
        option: &'static str,
        /// What was asked for.
        asked: String,
        /// The topic.
        topic: String,
        /// What it has.
        there: Vec<String>,
    },
    /// No message has all wheels at once.
    #[error(
        "{}: topic {topic}: none of its {messages} messages has positions of all of {}; a reading is one message with every wheel in it",
        path.display(), joints.join(", ")
    )]
    JointsApart {
        /// The bag.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// How many it has.
        messages: usize,
        /// The wheels.
        joints: Vec<String>,
    },
    /// A message that cannot be read.
    #[error("{}: topic {topic}, message {number}, logged at {log_time:.3} s: {problem}", path.display())]
    Message {
        /// The bag.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// From 1, in the topic.
        number: u64,
        /// When it was recorded \[s\].
        log_time: f64,
        /// What is wrong.
        problem: MessageProblem,
    },
    /// Headers that nobody stamped.
    #[error("{}: topic {topic}: every header is stamped 0; say --clock log to take the recorder's times instead", path.display())]
    NoStamps {
        /// The bag.
        path: PathBuf,
        /// The topic.
        topic: String,
    },
    /// Two clocks that do not run side by side.
    #[error(
        "{}: clocks are mixed: encoders are stamped {:.3} to {:.3} s, poses {:.3} to {:.3} s, which never meet; {}",
        path.display(), wheels[0], wheels[1], poses[0], poses[1],
        if *log_clock { "say --clock log to take the recorder's times for both" } else { "bring both to one clock first" }
    )]
    Clocks {
        /// The recording.
        path: PathBuf,
        /// First and last stamp of the encoders \[s\].
        wheels: [f64; 2],
        /// First and last stamp of the poses \[s\].
        poses: [f64; 2],
        /// Whether the recorder's own clock is there to be taken.
        log_clock: bool,
    },
    /// Times in another unit than seconds.
    #[error(
        "{}: {stream} are stamped {interval:.3} s apart, so their times are hardly in seconds; where they are in milliseconds \
         say --map t_ms=COLUMN (t_us, t_ns)",
        path.display()
    )]
    StampUnit {
        /// The recording.
        path: PathBuf,
        /// `encoders` or `poses`.
        stream: &'static str,
        /// The usual time from row to row, as stamped \[s\].
        interval: f64,
    },
    /// Joint positions that look like ticks.
    #[error(
        "{}: topic {topic}: positions of `{joint}` are whole numbers up to {largest}, so they may be ticks although the message says radians; say --unit ticks or --unit rad",
        path.display()
    )]
    UnitInDoubt {
        /// The bag.
        path: PathBuf,
        /// The topic.
        topic: String,
        /// The joint.
        joint: String,
        /// The largest of them.
        largest: f64,
    },
    /// A text file that does not parse.
    #[error("{}, line {line}: {problem}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// From 1.
        line: u64,
        /// What is wrong.
        problem: TableProblem,
    },
    /// A recording without encoders or without poses.
    #[error("{}: has no {lacks}{}", path.display(),
        if *lacks == "poses" { "; name the file that has them beside it (of the same name but for its ending), or say --pose none where ends were measured otherwise" }
        else { "; name the file that has them beside it, of the same name but for its ending" })]
    Lacks {
        /// The recording.
        path: PathBuf,
        /// `encoders` or `poses`.
        lacks: &'static str,
    },
    /// The same twice.
    #[error("{} and {} both have {what} of `{name}`; rename one, or import them one by one", first.display(), second.display())]
    Twice {
        /// A file.
        first: PathBuf,
        /// Another of the same name.
        second: PathBuf,
        /// `encoders` or `poses`.
        what: &'static str,
        /// Their common name.
        name: String,
    },
    /// Recordings of different columns.
    #[error(
        "{} has encoders {} ({}), but {} has {} ({}); all recordings of a campaign have the same",
        first.display(), has.0, unit(has.1), second.display(), other.0, unit(other.1)
    )]
    UnlikeWheels {
        /// A recording.
        first: PathBuf,
        /// Its columns and their unit.
        has: (String, EncoderUnit),
        /// Another.
        second: PathBuf,
        /// Its columns and their unit.
        other: (String, EncoderUnit),
    },
    /// Ticks that nobody can turn into radians.
    #[error("{}: encoders count ticks; say how many make a turn of the wheel: --odometry LEFT_RADIUS,RIGHT_RADIUS,TRACK,TICKS", path.display())]
    NoTicksPerRevolution {
        /// The recording.
        path: PathBuf,
    },
    /// One run that is broken in two.
    #[error("{}: cannot be one run: {why}; without --whole it is cut there", path.display())]
    Broken {
        /// The recording.
        path: PathBuf,
        /// What breaks it.
        why: String,
    },
    /// Wheels that never turned.
    #[error("{}: no wheel turned by more than {least} rad between standstills, so there is no run in it", path.display())]
    NothingMoved {
        /// The first recording.
        path: PathBuf,
        /// \[rad\]
        least: f64,
    },
    /// Another number of runs than stated.
    #[error(
        "{}: states {stated} runs, but {} were found: {}; --still changes where a recording is cut, --whole keeps files whole",
        path.display(), found.len(), found.join(", ")
    )]
    RunCount {
        /// The table of runs.
        path: PathBuf,
        /// Its rows.
        stated: usize,
        /// The runs found, with when they began.
        found: Vec<String>,
    },
    /// A table of runs, or the dataset itself, that does not hold.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
}

fn unit(unit: EncoderUnit) -> &'static str {
    match unit {
        EncoderUnit::Ticks => "ticks",
        EncoderUnit::Radians => "rad",
    }
}

/// What a bag holds, for messages.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Readable {
    /// Topic, its type, its number of messages.
    pub topics: Vec<(String, String, u64)>,
}

impl std::fmt::Display for Readable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.topics.is_empty() {
            return f.write_str("no message");
        }
        for (index, (topic, kind, messages)) in self.topics.iter().enumerate() {
            let separator = if index == 0 { "" } else { ", " };
            write!(f, "{separator}{topic} ({kind}, {messages} messages)")?;
        }
        Ok(())
    }
}

/// What is wrong with a message of a bag.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum MessageProblem {
    /// Not even the four bytes before a message.
    #[error("it has {bytes} bytes, and its encapsulation alone takes 4")]
    Short {
        /// How many it has.
        bytes: usize,
    },
    /// Another encoding than plain CDR.
    #[error(
        "its encapsulation is {first:#04x} {second:#04x}; plain CDR is 0x00 0x00 (big-endian) or 0x00 0x01 (little-endian)"
    )]
    Encapsulation {
        /// First byte.
        first: u8,
        /// Second byte.
        second: u8,
    },
    /// Bytes that are not of its type.
    #[error("its bytes are not of its type: {source}")]
    Cdr {
        /// The library's reason.
        source: Arc<cdr_encoding::Error>,
    },
    /// A joint without a position.
    #[error("{names} joints have {positions} positions; each joint needs one")]
    Positions {
        /// Joints.
        names: usize,
        /// Positions.
        positions: usize,
    },
    /// A wheel that is nowhere.
    #[error("the position of `{joint}` is {value}; it must be a finite number")]
    NotFinite {
        /// The joint.
        joint: String,
        /// Its position.
        value: f64,
    },
    /// A pose that is none.
    #[error(transparent)]
    Pose(PoseProblem),
}

/// What is wrong with a pose.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseProblem {
    /// A quaternion that turns nothing.
    #[error("the quaternion {quaternion:?} (x, y, z, w) has length {norm}; it must be 1")]
    NotUnit {
        /// x, y, z, w.
        quaternion: [f64; 4],
        /// Its length.
        norm: f64,
    },
    /// A vertical that is not z.
    #[error(
        "the z axis of the poses leans by {:.0}° from upright on average, so x and y are not the floor; write the poses with z up first",
        lean.to_degrees()
    )]
    NotUpright {
        /// \[rad\]
        lean: f64,
    },
}

/// What is wrong with a text file, or with a line of it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TableProblem {
    /// Bytes that are no text.
    #[error("is not UTF-8 text; save the file as UTF-8")]
    NotText,
    /// Nothing in it.
    #[error("there are no rows")]
    Empty,
    /// A line of a trajectory with another number of values.
    #[error("{found} value(s); a line of a TUM trajectory has eight with spaces between them: t x y z qx qy qz qw")]
    NotTum {
        /// How many.
        found: usize,
    },
    /// A row that is too short or too long.
    #[error("{found} values under {expected} columns")]
    Ragged {
        /// In the row.
        found: usize,
        /// In the header.
        expected: usize,
    },
    /// A column that `--map` names and that is not there.
    #[error("--map {target}={column}: there is no column `{column}`; there are: {}", there.join(", "))]
    NoColumn {
        /// What it was to be.
        target: String,
        /// Its name.
        column: String,
        /// Those that are there.
        there: Vec<String>,
    },
    /// A target that is not known.
    #[error(
        "--map {target}=…: `{target}` is no target; targets carry their unit: t_s, t_ms, t_us or t_ns; left_rad, left_deg or left_ticks (right, front_left, … alike); x_m, x_cm or x_mm, y alike; heading_rad or heading_deg, or qx, qy, qz and qw"
    )]
    NoTarget {
        /// Its name.
        target: String,
    },
    /// No column says by its name and unit what it is.
    #[error(
        "no time and encoders or poses can be told from the columns {}: what a column is and its unit are never guessed; say it, such as --map t_s=stamp,left_rad=wl,right_rad=wr or --map t_s=stamp,x_m=px,y_m=py,heading_rad=yaw",
        there.join(", ")
    )]
    Untold {
        /// The columns.
        there: Vec<String>,
    },
    /// Part of what belongs together.
    #[error("there is `{there}` but nothing for {lacks}; name its column with --map")]
    Incomplete {
        /// What there is.
        there: String,
        /// What lacks.
        lacks: &'static str,
    },
    /// Encoder columns of two units.
    #[error("`{first}` and `{second}` differ in their unit; all encoders count ticks, or all are angles")]
    MixedUnits {
        /// A target.
        first: String,
        /// A target of another unit.
        second: String,
    },
    /// A cell that is no number.
    #[error("column `{column}`: `{value}` is not allowed here: it must be {allowed}")]
    Value {
        /// Its name.
        column: String,
        /// As it stands there.
        value: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// A pose that is none.
    #[error(transparent)]
    Pose(PoseProblem),
    /// A time that goes back, in a file that nothing else orders.
    #[error(
        "time goes back from {before:.6} s to {after:.6} s; cut the file there, and import the parts as files of their own"
    )]
    TimeGoesBack {
        /// \[s\]
        before: f64,
        /// \[s\]
        after: f64,
    },
}
