//! `treadmark import`: recordings of a real robot → dataset.

use super::options::{non_negative, odometry, positive};
use crate::dataset::{Campaign, DatasetError, EncoderUnit, SurveyFacts, read_stated_runs};
use crate::import::{self, Clock, Cut, Imported, Options, PoseSource};
use crate::odometry::OdometryParameters;
use crate::report::import as report;
use crate::scene::Robot;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Arguments of `treadmark import`.
#[derive(Args)]
pub(super) struct Arguments {
    /// MCAP bags (.mcap, or the folder of a rosbag2); tables of encoders, poses or both (.csv); TUM trajectories (.tum,
    /// .txt). Tables and trajectories of one name belong together
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// New folder for the dataset
    #[arg(long, value_name = "DATASET")]
    out: PathBuf,
    /// Name of the campaign (default: the folder's)
    #[arg(long)]
    name: Option<String>,

    /// Topic of the encoders, a sensor_msgs/msg/JointState (default: the only one)
    #[arg(long, value_name = "TOPIC")]
    encoders: Option<String>,
    /// Topic of the surveyed pose: PoseStamped, PoseWithCovarianceStamped, Odometry or TFMessage (default: the only one
    /// that cannot be the robot's own dead reckoning); none: ends were measured otherwise
    #[arg(long, value_name = "TOPIC|none")]
    pose: Option<String>,
    /// Frames of the surveyed pose, where a topic has several
    #[arg(long, value_name = "PARENT/CHILD", value_parser = frames)]
    frame: Option<(String, String)>,
    /// Joints of the left wheels (default: told from their names)
    #[arg(long, value_name = "JOINT", value_delimiter = ',', requires = "right")]
    left: Vec<String>,
    /// Joints of the right wheels
    #[arg(long, value_name = "JOINT", value_delimiter = ',', requires = "left")]
    right: Vec<String>,
    /// What the joints' positions count (default: rad, as the message has it, unless they look like ticks)
    #[arg(long, value_enum)]
    unit: Option<Unit>,
    /// Times of a bag: those in the messages' headers, or those at which it was recorded
    #[arg(long, value_enum, default_value_t = ClockWord::Header)]
    clock: ClockWord,
    /// Columns of tables, such as t_s=stamp,left_rad=wl,right_rad=wr; columns already named like that need none
    #[arg(long, value_name = "TARGET=COLUMN", value_delimiter = ',', value_parser = pair)]
    map: Vec<(String, String)>,

    /// Cut recordings into runs where every wheel stands still for this long [s]; longer than pauses at corners
    #[arg(long, value_name = "SECONDS", default_value_t = Cut::DEFAULT_STANDSTILL, allow_negative_numbers = true, value_parser = positive)]
    still: f64,
    /// Every file is one run, from its first reading to its last
    #[arg(long, conflicts_with = "still")]
    whole: bool,
    /// What was driven, as a dataset's runs.csv states it, a row a run: by name, or in the order driven
    #[arg(long, value_name = "CSV")]
    runs: Option<PathBuf>,
    /// Nominal sides of squares and lengths of straights [m] (default: as the odometry has it, to the centimetre)
    #[arg(long, value_name = "METRES", value_delimiter = ',', allow_negative_numbers = true, value_parser = positive)]
    side: Vec<f64>,
    /// Nominal radii of circles [m] (default: as the odometry has it, to the centimetre)
    #[arg(long, value_name = "METRES", value_delimiter = ',', allow_negative_numbers = true, value_parser = positive)]
    radius: Vec<f64>,

    /// What the robot believed while it drove: wheel radii and track [m], ticks a wheel revolution if encoders count ticks
    #[arg(long, value_name = "LEFT,RIGHT,TRACK[,TICKS]", value_parser = odometry, conflicts_with = "robot")]
    odometry: Option<OdometryParameters>,
    /// Robot model that says what the robot believed: a file, or the name of a shipped robot
    #[arg(long, value_name = "FILE|NAME")]
    robot: Option<String>,
    /// 1 σ of one surveyed position [m]
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = non_negative)]
    position_std: Option<f64>,
    /// 1 σ of one surveyed heading [rad]
    #[arg(long, value_name = "RADIANS", allow_negative_numbers = true, value_parser = non_negative)]
    heading_std: Option<f64>,
    /// How poses were measured, in words
    #[arg(long, value_name = "TEXT")]
    survey: Option<String>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Unit {
    Rad,
    Ticks,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ClockWord {
    Header,
    Log,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    // Hours of bag are read in vain where the result has no place.
    let out = &arguments.out;
    if out.exists() {
        return Err(DatasetError::Exists { path: out.clone() }.into());
    }
    let imported = import::import(&arguments.files, &arguments.options()?)?;
    for finding in &imported.findings {
        tell!("note: {finding}");
    }
    let Imported { dataset, driven, .. } = imported;
    dataset.write(out)?;
    say!("{}", report::import(&dataset, &driven))?;
    sayln!("{} runs are in {}; `treadmark check` says what looks wrong with them", dataset.runs.len(), out.display())?;
    Ok(())
}

impl Arguments {
    fn options(&self) -> anyhow::Result<Options> {
        let name = match &self.name {
            Some(name) => name.trim().to_owned(),
            None => {
                self.out.file_name().map_or_else(|| "campaign".to_owned(), |name| name.to_string_lossy().into_owned())
            }
        };
        let mut campaign = Campaign {
            name,
            source: Some(format!("treadmark {} import", env!("CARGO_PKG_VERSION"))),
            survey: SurveyFacts {
                method: self.survey.clone(),
                position_std: self.position_std,
                heading_std: self.heading_std,
            },
            odometry: self.odometry,
            ..Campaign::default()
        };
        if let Some(given) = &self.robot {
            let robot = Robot::load(given)?;
            campaign.odometry = Some(robot.odometry);
            campaign.robot.model = Some(robot.file);
        }
        let stated = match &self.runs {
            Some(path) => Some((path.clone(), read_stated_runs(path)?)),
            None => None,
        };
        Ok(Options {
            encoders: self.encoders.clone(),
            pose: match self.pose.as_deref() {
                None => PoseSource::Found,
                Some("none") => PoseSource::Nowhere,
                Some(topic) => PoseSource::Topic(topic.to_owned()),
            },
            frame: self.frame.clone(),
            left: self.left.clone(),
            right: self.right.clone(),
            unit: self.unit.map(|unit| match unit {
                Unit::Rad => EncoderUnit::Radians,
                Unit::Ticks => EncoderUnit::Ticks,
            }),
            clock: match self.clock {
                ClockWord::Header => Clock::Header,
                ClockWord::Log => Clock::Log,
            },
            map: self.map.clone(),
            cut: if self.whole { Cut::Whole } else { Cut::Standstills { least: self.still } },
            sides: self.side.clone(),
            radii: self.radius.clone(),
            stated,
            campaign,
        })
    }
}

/// `target=column`.
fn pair(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((target, column)) if !target.trim().is_empty() && !column.trim().is_empty() => {
            Ok((target.trim().to_owned(), column.trim().to_owned()))
        }
        _ => Err("it must be TARGET=COLUMN, such as t_s=stamp".to_owned()),
    }
}

/// `parent/child`; a frame's own name may have slashes in front, as old ones do.
fn frames(text: &str) -> Result<(String, String), String> {
    match text.rsplit_once('/') {
        Some((parent, child)) if !parent.is_empty() => Ok((parent.to_owned(), child.to_owned())),
        _ => Err("it must be PARENT/CHILD, such as map/base_link".to_owned()),
    }
}
