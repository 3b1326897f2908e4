//! The waist of the system: one campaign of runs, measured or simulated, and its files.
//!
//! Simulation writes a [`Dataset`], inference reads it, and nothing downstream can tell a simulated campaign from a
//! real one: there is no place here for a truth. Poses of a run are in the frame of that run's surveyed start pose:
//! x along the surveyed start heading, y to the left. SI units and radians; headings unwrapped.

use crate::geometry::Pose2;
use crate::odometry::{DeadReckoning, OdometryParameters};
use std::collections::BTreeMap;
use std::path::PathBuf;

mod error;
mod protocol;
mod read;
mod stops;
mod table;
mod wire;
mod write;

pub use error::{CsvProblem, DatasetError, Part};
pub use protocol::{Protocol, Rotation, Travel};
pub use read::read_stated_runs;
pub use stops::Stop;

/// `run a`, `runs a, b and c`, `runs a, b, c, d and 301 more`; of none, the file that holds for all.
pub(crate) fn runs_in_words(runs: &[String]) -> String {
    match runs {
        [] => "dataset.toml".to_owned(),
        [one] => format!("run {one}"),
        [start @ .., last] if runs.len() <= 6 => format!("runs {} and {last}", start.join(", ")),
        _ => format!("runs {} and {} more", runs[..4].join(", "), runs.len() - 4),
    }
}

/// One campaign: the same robot, the same on-board odometry parameters, the same survey.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// What `dataset.toml` states.
    pub campaign: Campaign,
    /// The runs, in file order; names are unique.
    pub runs: Vec<Run>,
}

/// What holds for every run of a campaign: the content of `dataset.toml`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Campaign {
    /// Name of the campaign.
    pub name: String,
    /// Free text.
    pub description: Option<String>,
    /// Where the data come from.
    pub source: Option<String>,
    /// Licence of the data.
    pub licence: Option<String>,
    /// Nominal facts about the robot.
    pub robot: RobotFacts,
    /// World file that the campaign names.
    pub world_model: Option<PathBuf>,
    /// What the on-board controller believed while it drove.
    pub odometry: Option<OdometryParameters>,
    /// How poses were measured.
    pub survey: SurveyFacts,
    /// Free conditions (`payload_kg`, `floor`, …) as the file states them.
    pub conditions: BTreeMap<String, toml::Value>,
}

/// Nominal facts about the robot: `[robot]` of `dataset.toml`. Units as the names of the file's keys say.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RobotFacts {
    /// Robot model file.
    pub model: Option<PathBuf>,
    /// `skid-steer` or `differential`.
    pub drive: Option<DriveKind>,
    /// \[m\]
    pub nominal_wheel_diameter: Option<f64>,
    /// Lateral distance between left and right contact centres \[m\].
    pub nominal_track_width: Option<f64>,
    /// Axle to axle \[m\].
    pub wheelbase: Option<f64>,
    /// \[m\]
    pub wheel_width: Option<f64>,
    /// \[kg\]
    pub mass: Option<f64>,
    /// Ticks a wheel revolution; a real number.
    pub ticks_per_revolution: Option<f64>,
}

/// How the robot steers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveKind {
    /// Two or more fixed wheels a side.
    SkidSteer,
    /// One fixed wheel a side.
    Differential,
}

/// How poses were measured; 1 σ of one reading, of start, end and every row of `poses.csv` alike.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SurveyFacts {
    /// Free text.
    pub method: Option<String>,
    /// \[m\]
    pub position_std: Option<f64>,
    /// \[rad\]
    pub heading_std: Option<f64>,
}

/// One run: what was driven, where it ended, what was logged.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Name, unique in the campaign.
    pub name: String,
    /// What was driven.
    pub protocol: Protocol,
    /// Cruising speed \[m/s\].
    pub speed: Option<f64>,
    /// Turn rate on the spot \[rad/s\].
    pub turn_rate: Option<f64>,
    /// Start of the run since the campaign began \[s\].
    pub started: Option<f64>,
    /// Surveyed start pose in the room; `None`: on the common mark.
    pub start: Option<Pose2>,
    /// Surveyed end pose in the frame of the surveyed start pose; `None`: not measured.
    pub end: Option<SurveyedPose>,
    /// End pose by the robot's own dead reckoning, as the `odom_*` columns state it.
    pub odometry_end: Option<SurveyedPose>,
    /// Wheel rotation over time.
    pub encoders: Option<EncoderLog>,
    /// Surveyed poses on the way.
    pub poses: Option<PoseLog>,
}

/// A position with a heading that may not have been measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurveyedPose {
    /// \[m\]
    pub x: f64,
    /// \[m\]
    pub y: f64,
    /// \[rad, unwrapped\]; `None`: not measured.
    pub heading: Option<f64>,
}

/// Wheel rotation over time, one row a reading. Only differences count.
#[derive(Debug, Clone, PartialEq)]
pub struct EncoderLog {
    /// What the columns count.
    pub unit: EncoderUnit,
    /// Column names without their unit: `left`, `right`, or one a wheel (`front_left`, …), in file order.
    pub channels: Vec<String>,
    /// Stamps by the encoders' clock \[s\], never decreasing.
    pub time: Vec<f64>,
    /// Accumulated counts, `counts[row * channels.len() + channel]`.
    pub counts: Vec<f64>,
}

/// What an encoder column counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EncoderUnit {
    /// Counts; the odometry's ticks a revolution turn them into radians.
    Ticks,
    /// Wheel rotation, positive forward \[rad\].
    Radians,
}

/// Surveyed poses over time, in the frame of the run's surveyed start pose.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PoseLog {
    /// Stamps by the survey's clock \[s\], never decreasing.
    pub time: Vec<f64>,
    /// One pose a stamp; a blank heading is `None`.
    pub poses: Vec<SurveyedPose>,
}

impl Dataset {
    /// When the clocks of the campaign begin: the first stamp of its encoders \[s\]. What a clock goes wrong by grows from there.
    pub fn clock_zero(&self) -> f64 {
        let first = |run: &Run| run.encoders.as_ref()?.time.first().copied();
        self.runs.iter().filter_map(first).reduce(f64::min).unwrap_or(0.0)
    }
}

impl From<Pose2> for SurveyedPose {
    fn from(pose: Pose2) -> Self {
        SurveyedPose { x: pose.x, y: pose.y, heading: Some(pose.heading) }
    }
}

impl EncoderLog {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// What its columns count in \[rad\]; `None`: they are angles already.
    pub fn tick(&self, odometry: &OdometryParameters) -> Option<f64> {
        (self.unit == EncoderUnit::Ticks).then(|| odometry.angle_of_ticks(1.0))
    }

    /// Rotation of one channel at `row` \[rad\]; `odometry` turns ticks into radians.
    pub fn radians(&self, row: usize, channel: usize, odometry: &OdometryParameters) -> f64 {
        let count = self.counts[row * self.channels.len() + channel];
        match self.unit {
            EncoderUnit::Radians => count,
            EncoderUnit::Ticks => odometry.angle_of_ticks(count),
        }
    }

    /// Mean rotation of the left and of the right wheels at `row` \[rad\]; `odometry` turns ticks into radians. A side
    /// is the channels whose name is or ends in `left` or `right`.
    pub fn sides(&self, row: usize, odometry: &OdometryParameters) -> [f64; 2] {
        let width = self.channels.len();
        let row = &self.counts[row * width..(row + 1) * width];
        ["left", "right"].map(|side| {
            let (sum, n) = self
                .channels
                .iter()
                .zip(row)
                .filter(|(name, _)| name.ends_with(side))
                .fold((0.0, 0.0), |(sum, n), (_, count)| (sum + count, n + 1.0));
            match self.unit {
                EncoderUnit::Radians => sum / n,
                EncoderUnit::Ticks => odometry.angle_of_ticks(sum / n),
            }
        })
    }
}

impl Run {
    /// The encoder log, where there is one that says how the wheels turned: of two rows or more.
    pub fn log(&self) -> Option<&EncoderLog> {
        self.encoders.as_ref().filter(|log| log.len() > 1)
    }

    /// Where the robot believed that it ended, in the frame of its start: the replay of the encoder log with
    /// `odometry` where there is one; else the `odom_*` columns; else, for a closed protocol, the protocol's own end
    /// (the robot drove until its odometry closed it). `None` for a path without logs.
    pub fn dead_reckoned_end(&self, odometry: &OdometryParameters) -> Option<Pose2> {
        if let Some(log) = self.encoders.as_ref().filter(|log| !log.is_empty()) {
            let mut reckoning = DeadReckoning::new(*odometry);
            for row in 0..log.len() {
                let [left, right] = log.sides(row, odometry);
                reckoning.update(left, right);
            }
            return Some(reckoning.pose());
        }
        let nominal = self.protocol.nominal_end();
        match (self.odometry_end, nominal) {
            (Some(end), nominal) => {
                Some(Pose2::new(end.x, end.y, end.heading.or(nominal.map(|pose| pose.heading)).unwrap_or(0.0)))
            }
            (None, nominal) => nominal,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::runs_in_words;

    #[test]
    fn runs_are_named_or_counted() {
        let runs: Vec<String> = (1..=12).map(|run| format!("{run:02}")).collect();
        for (count, words) in
            [(0, "dataset.toml"), (1, "run 01"), (3, "runs 01, 02 and 03"), (12, "runs 01, 02, 03, 04 and 8 more")]
        {
            assert_eq!(runs_in_words(&runs[..count]), words);
        }
    }
}
