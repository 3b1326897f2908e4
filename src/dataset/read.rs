//! Files → dataset, strictly: what is not understood is an error that says where it stands and what is allowed.

use super::error::{CsvProblem, DatasetError};
use super::protocol::{Protocol, Rotation, Travel};
use super::table::{Row, Table};
use super::wire::DatasetFile;
use super::write::RUN_COLUMNS;
use super::{Campaign, Dataset, EncoderLog, EncoderUnit, PoseLog, Run, SurveyedPose};
use crate::geometry::Pose2;
use crate::strict;
use std::collections::HashMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The four files of a dataset: where they stand and what they say.
pub(super) struct Files {
    /// `dataset.toml`
    pub(super) campaign: File,
    /// `runs.csv`
    pub(super) runs: File,
    /// `encoders.csv`
    pub(super) encoders: Option<File>,
    /// `poses.csv`
    pub(super) poses: Option<File>,
}

/// A file and its text.
pub(super) struct File {
    pub(super) path: PathBuf,
    pub(super) text: String,
}

impl Dataset {
    /// Reads the dataset in `folder`: `dataset.toml` and `runs.csv`, and `encoders.csv` and `poses.csv` where they are.
    ///
    /// # Errors
    /// Anything that the format does not allow, with file, line, column, value and what is allowed.
    pub fn read(folder: &Path) -> Result<Dataset, DatasetError> {
        Dataset::parse(&Files {
            campaign: File::read(folder.join("dataset.toml"))?,
            runs: File::read(folder.join("runs.csv"))?,
            encoders: File::read_if_there(folder.join("encoders.csv"))?,
            poses: File::read_if_there(folder.join("poses.csv"))?,
        })
    }

    /// The dataset that the files state.
    pub(super) fn parse(files: &Files) -> Result<Dataset, DatasetError> {
        let File { path, text } = &files.campaign;
        let wire: DatasetFile =
            strict::parse(text).map_err(|source| DatasetError::Toml { path: path.clone(), source })?;
        let campaign = Campaign::from(wire);
        let mut runs = read_runs(&files.runs)?;
        let index: HashMap<String, usize> =
            runs.iter().enumerate().map(|(index, run)| (run.name.clone(), index)).collect();
        if let Some(file) = &files.encoders {
            read_encoders(file, &campaign, &index, &mut runs)?;
        }
        if let Some(file) = &files.poses {
            read_poses(file, &index, &mut runs)?;
        }
        Ok(Dataset { campaign, runs })
    }
}

impl File {
    fn read(path: PathBuf) -> Result<File, DatasetError> {
        let bytes = match std::fs::read(&path) {
            Ok(bytes) => bytes,
            Err(source) => return Err(DatasetError::Read { path, source }),
        };
        match String::from_utf8(bytes) {
            Ok(text) => Ok(File { path, text }),
            Err(error) => {
                let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
                let line = good.iter().filter(|byte| **byte == b'\n').count() as u64 + 1;
                Err(DatasetError::NotText { path, line })
            }
        }
    }

    fn read_if_there(path: PathBuf) -> Result<Option<File>, DatasetError> {
        match File::read(path) {
            Err(DatasetError::Read { source, .. }) if source.kind() == ErrorKind::NotFound => Ok(None),
            other => other.map(Some),
        }
    }

    fn table(&self, header: &'static str) -> Result<Table, DatasetError> {
        Table::parse(&self.path, &self.text, header)
    }
}

/// The runs that a file like `runs.csv` states, without logs.
///
/// # Errors
/// Anything that the format does not allow, with file, line, column, value and what is allowed.
pub fn read_stated_runs(path: &Path) -> Result<Vec<Run>, DatasetError> {
    read_runs(&File::read(path.to_owned())?)
}

fn read_runs(file: &File) -> Result<Vec<Run>, DatasetError> {
    let table = file.table("run,protocol,…")?;
    table.expect_columns(&RUN_COLUMNS.map(|(name, _)| name), 2)?;
    if table.rows().len() == 0 {
        return Err(table.fails(CsvProblem::NoRows));
    }
    let mut line_of = HashMap::new();
    table
        .rows()
        .map(|row| {
            let name = row.text("run");
            if name.is_empty() {
                return Err(row.blank("run", "a run has a name"));
            }
            if let Some(line) = line_of.insert(name, row.line()) {
                return Err(row.not_allowed("run", format!("a name of its own; line {line} has it already")));
            }
            read_run(name, &row)
        })
        .collect()
}

fn read_run(name: &str, row: &Row<'_>) -> Result<Run, DatasetError> {
    let start = match row.pose(["start_x_m", "start_y_m", "start_heading_rad"])? {
        Some(SurveyedPose { x, y, heading: Some(heading) }) => Some(Pose2::new(x, y, heading)),
        Some(_) => return Err(row.blank("start_heading_rad", "start_x_m and start_y_m stand beside it")),
        None => None,
    };
    Ok(Run {
        name: name.to_owned(),
        protocol: read_protocol(row)?,
        speed: row.number("speed_m_s")?,
        turn_rate: row.number("turn_rate_rad_s")?,
        started: row.number("started_s")?,
        start,
        end: row.pose(["x_m", "y_m", "heading_rad"])?,
        odometry_end: row.pose(["odom_x_m", "odom_y_m", "odom_heading_rad"])?,
        encoders: None,
        poses: None,
    })
}

fn read_protocol(row: &Row<'_>) -> Result<Protocol, DatasetError> {
    let round = || match row.text("direction") {
        "cw" => Ok(Rotation::Clockwise),
        "ccw" => Ok(Rotation::CounterClockwise),
        "" => Err(row.blank("direction", "a square, a spin and a circle go round cw or ccw")),
        _ => Err(row.not_allowed("direction", "cw or ccw")),
    };
    Ok(match row.text("protocol") {
        "square" => {
            Protocol::Square { side: row.required_positive("side_m", "a square has a side")?, direction: round()? }
        }
        "straight" => Protocol::Straight {
            length: row.required_positive("side_m", "a straight has a length, in the column of sides")?,
            direction: match row.text("direction") {
                "" | "forward" => Travel::Forward,
                "reverse" => Travel::Reverse,
                _ => return Err(row.not_allowed("direction", "forward or reverse, or blank for forward")),
            },
        },
        "spin" => {
            Protocol::Spin { turn: row.required_positive("turn_rad", "a spin has a total turn")?, direction: round()? }
        }
        "circle" => Protocol::Circle {
            radius: row.required_positive("radius_m", "a circle has a radius")?,
            turn: row.positive("turn_rad")?,
            direction: round()?,
        },
        "path" => Protocol::Path,
        "" => return Err(row.blank("protocol", "a run is a square, straight, spin, circle or path")),
        _ => return Err(row.not_allowed("protocol", "square, straight, spin, circle or path")),
    })
}

/// A column of `encoders.csv` that counts.
struct EncoderColumn {
    name: String,
    channel: String,
    unit: EncoderUnit,
}

impl EncoderColumn {
    /// Takes a name such as `front_left_ticks` apart.
    fn parse(name: &str) -> Option<EncoderColumn> {
        [EncoderUnit::Ticks, EncoderUnit::Radians].into_iter().find_map(|unit| {
            let channel = name.strip_suffix(unit.as_str())?.strip_suffix('_')?;
            let sided = channel.ends_with("left") || channel.ends_with("right");
            sided.then(|| EncoderColumn { name: name.to_owned(), channel: channel.to_owned(), unit })
        })
    }
}

/// The columns of `encoders.csv` that count: all in one unit, at least one a side.
fn encoder_columns(table: &Table) -> Result<(EncoderUnit, Vec<EncoderColumn>), DatasetError> {
    table.require("run")?;
    table.require("t_s")?;
    let mut columns: Vec<EncoderColumn> = Vec::new();
    for name in table.columns().iter().filter(|name| !["run", "t_s"].contains(&name.as_str())) {
        let column = EncoderColumn::parse(name)
            .ok_or_else(|| table.fails(CsvProblem::EncoderColumn { column: name.clone() }))?;
        if let Some(first) = columns.first().filter(|first| first.unit != column.unit) {
            return Err(table.fails(CsvProblem::MixedUnits { first: first.name.clone(), column: column.name }));
        }
        columns.push(column);
    }
    for side in ["left", "right"] {
        if !columns.iter().any(|column| column.channel.ends_with(side)) {
            return Err(table.fails(CsvProblem::MissingSide { side }));
        }
    }
    Ok((columns[0].unit, columns))
}

fn read_encoders(
    file: &File,
    campaign: &Campaign,
    index: &HashMap<String, usize>,
    runs: &mut [Run],
) -> Result<(), DatasetError> {
    let table = file.table("run,t_s,left_ticks,right_ticks")?;
    let (unit, columns) = encoder_columns(&table)?;
    let known = campaign.robot.ticks_per_revolution.is_some()
        || campaign.odometry.as_ref().is_some_and(|odometry| odometry.ticks_per_revolution.is_some());
    if unit == EncoderUnit::Ticks && !known {
        return Err(DatasetError::NoTicksPerRevolution { path: file.path.clone() });
    }
    for row in table.rows() {
        let run = &mut runs[run_of(&row, index)?];
        let log = run.encoders.get_or_insert_with(|| EncoderLog {
            unit,
            channels: columns.iter().map(|column| column.channel.clone()).collect(),
            time: Vec::new(),
            counts: Vec::new(),
        });
        log.time.push(time_of(&row, log.time.last())?);
        for column in &columns {
            log.counts.push(row.required(&column.name, "every row is a reading of every encoder")?);
        }
    }
    Ok(())
}

fn read_poses(file: &File, index: &HashMap<String, usize>, runs: &mut [Run]) -> Result<(), DatasetError> {
    let table = file.table("run,t_s,x_m,y_m,heading_rad")?;
    table.expect_columns(&["run", "t_s", "x_m", "y_m", "heading_rad"], 4)?;
    for row in table.rows() {
        let run = &mut runs[run_of(&row, index)?];
        let log = run.poses.get_or_insert_with(PoseLog::default);
        log.time.push(time_of(&row, log.time.last())?);
        log.poses.push(SurveyedPose {
            x: row.required("x_m", "every row is a surveyed position")?,
            y: row.required("y_m", "every row is a surveyed position")?,
            heading: row.number("heading_rad")?,
        });
    }
    Ok(())
}

/// Index of the run that a row of a log names.
fn run_of(row: &Row<'_>, index: &HashMap<String, usize>) -> Result<usize, DatasetError> {
    index.get(row.text("run")).copied().ok_or_else(|| row.not_allowed("run", "a run of runs.csv"))
}

/// The stamp of a row of a log, which must not go back.
fn time_of(row: &Row<'_>, last: Option<&f64>) -> Result<f64, DatasetError> {
    let time = row.required("t_s", "every row has its time")?;
    match last {
        Some(last) if time < *last => {
            Err(row.not_allowed("t_s", format!("time does not go back within a run; the row before is at {last}")))
        }
        _ => Ok(time),
    }
}
