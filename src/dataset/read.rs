//! Files → dataset, strictly: what is not understood is an error that says where it stands and what is allowed.

use super::error::{CsvProblem, DatasetError};
use super::protocol::{Protocol, Rotation, Travel};
use super::write::RUN_COLUMNS;
use super::{
    Campaign, Dataset, DriveKind, EncoderLog, EncoderUnit, PoseLog, RobotFacts, Run, SurveyFacts, SurveyedPose,
};
use crate::geometry::Pose2;
use crate::odometry::OdometryParameters;
use crate::strict::{self, optional_non_negative, optional_positive, positive};
use serde::Deserialize;
use std::collections::{BTreeMap, HashMap};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

impl Dataset {
    /// Reads the dataset in `folder`: `dataset.toml` and `runs.csv`, and `encoders.csv` and `poses.csv` where they are.
    ///
    /// # Errors
    /// Anything that the format does not allow, with file, line, column, value and what is allowed.
    pub fn read(folder: &Path) -> Result<Dataset, DatasetError> {
        let path = folder.join("dataset.toml");
        let text =
            std::fs::read_to_string(&path).map_err(|source| DatasetError::Read { path: path.clone(), source })?;
        let file: DatasetFile =
            strict::parse(&text).map_err(|source| DatasetError::Toml { path: path.clone(), source })?;
        let campaign = Campaign::from(file);

        let runs = Csv::read(folder.join("runs.csv"), "run,protocol,…")?;
        let mut runs = read_runs(&runs)?;
        let index: HashMap<String, usize> =
            runs.iter().enumerate().map(|(index, run)| (run.name.clone(), index)).collect();
        if let Some(csv) = Csv::read_if_there(folder.join("encoders.csv"), "run,t_s,left_ticks,right_ticks")? {
            read_encoders(&csv, &campaign, &index, &mut runs)?;
        }
        if let Some(csv) = Csv::read_if_there(folder.join("poses.csv"), "run,t_s,x_m,y_m,heading_rad")? {
            read_poses(&csv, &index, &mut runs)?;
        }
        Ok(Dataset { campaign, runs })
    }
}

// ── dataset.toml ──

#[derive(Deserialize)]
enum Format {
    #[serde(rename = "treadmark-dataset/1")]
    V1,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DatasetFile {
    #[serde(rename = "format")]
    _format: Format,
    name: String,
    description: Option<String>,
    source: Option<String>,
    licence: Option<String>,
    #[serde(default)]
    robot: RobotTable,
    #[serde(default)]
    world: WorldTable,
    odometry: Option<OdometryTable>,
    #[serde(default)]
    survey: SurveyTable,
    #[serde(default)]
    conditions: BTreeMap<String, toml::Value>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct RobotTable {
    model: Option<PathBuf>,
    drive: Option<DriveWord>,
    #[serde(deserialize_with = "optional_positive")]
    nominal_wheel_diameter_m: Option<f64>,
    #[serde(deserialize_with = "optional_positive")]
    nominal_track_width_m: Option<f64>,
    #[serde(deserialize_with = "optional_positive")]
    wheelbase_m: Option<f64>,
    #[serde(deserialize_with = "optional_positive")]
    wheel_width_m: Option<f64>,
    #[serde(deserialize_with = "optional_positive")]
    mass_kg: Option<f64>,
    #[serde(deserialize_with = "optional_positive")]
    ticks_per_revolution: Option<f64>,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
enum DriveWord {
    SkidSteer,
    Differential,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct WorldTable {
    model: Option<PathBuf>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OdometryTable {
    #[serde(deserialize_with = "positive")]
    left_wheel_radius_m: f64,
    #[serde(deserialize_with = "positive")]
    right_wheel_radius_m: f64,
    #[serde(deserialize_with = "positive")]
    track_width_m: f64,
    #[serde(default, deserialize_with = "optional_positive")]
    ticks_per_revolution: Option<f64>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct SurveyTable {
    method: Option<String>,
    #[serde(deserialize_with = "optional_non_negative")]
    position_std_m: Option<f64>,
    #[serde(deserialize_with = "optional_non_negative")]
    heading_std_rad: Option<f64>,
}

impl From<DatasetFile> for Campaign {
    fn from(file: DatasetFile) -> Self {
        let robot = file.robot;
        Campaign {
            name: file.name,
            description: file.description,
            source: file.source,
            licence: file.licence,
            odometry: file.odometry.map(|odometry| OdometryParameters {
                left_wheel_radius: odometry.left_wheel_radius_m,
                right_wheel_radius: odometry.right_wheel_radius_m,
                track_width: odometry.track_width_m,
                ticks_per_revolution: odometry.ticks_per_revolution.or(robot.ticks_per_revolution),
            }),
            robot: RobotFacts {
                model: robot.model,
                drive: robot.drive.map(|drive| match drive {
                    DriveWord::SkidSteer => DriveKind::SkidSteer,
                    DriveWord::Differential => DriveKind::Differential,
                }),
                nominal_wheel_diameter: robot.nominal_wheel_diameter_m,
                nominal_track_width: robot.nominal_track_width_m,
                wheelbase: robot.wheelbase_m,
                wheel_width: robot.wheel_width_m,
                mass: robot.mass_kg,
                ticks_per_revolution: robot.ticks_per_revolution,
            },
            world_model: file.world.model,
            survey: SurveyFacts {
                method: file.survey.method,
                position_std: file.survey.position_std_m,
                heading_std: file.survey.heading_std_rad,
            },
            conditions: file.conditions,
        }
    }
}

// ── CSV ──

/// A CSV file whose header has been taken apart.
struct Csv {
    path: PathBuf,
    columns: Vec<String>,
    rows: Vec<csv::StringRecord>,
}

/// One row of a CSV file.
#[derive(Clone, Copy)]
struct Row<'a> {
    csv: &'a Csv,
    record: &'a csv::StringRecord,
    line: u64,
}

impl Csv {
    fn read_if_there(path: PathBuf, header: &str) -> Result<Option<Csv>, DatasetError> {
        match Csv::read(path, header) {
            Err(DatasetError::Read { source, .. }) if source.kind() == ErrorKind::NotFound => Ok(None),
            other => other.map(Some),
        }
    }

    /// Reads the file as text; `header` is what its header looks like, for the message about an empty one.
    fn read(path: PathBuf, header: &str) -> Result<Csv, DatasetError> {
        let bytes = std::fs::read(&path).map_err(|source| DatasetError::Read { path: path.clone(), source })?;
        let text = match std::str::from_utf8(&bytes) {
            Ok(text) => text.trim_start_matches('\u{feff}'),
            Err(error) => {
                let line = bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count() as u64 + 1;
                return Err(DatasetError::Csv { path, line, problem: CsvProblem::NotText });
            }
        };
        let fails = |line, problem| Err(DatasetError::Csv { path: path.clone(), line, problem });
        let first = text.lines().next().unwrap_or("");
        if first.trim().is_empty() {
            return fails(1, CsvProblem::Empty { expected: header.to_owned() });
        }
        if !first.contains(',') {
            for (separator, found) in [(';', "semicolons"), ('\t', "tabs")] {
                if first.contains(separator) {
                    return fails(1, CsvProblem::Separator { found });
                }
            }
        }
        let mut reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .trim(csv::Trim::All)
            .from_reader(text.as_bytes());
        let mut columns: Vec<String> = Vec::new();
        let mut rows = Vec::new();
        for record in reader.records() {
            // Text in memory that is UTF-8 has no other way to fail than a quote that is never closed, which ends the file.
            let Ok(record) = record else { return fails(1, CsvProblem::NotText) };
            let line = record.position().map_or(1, |position| position.line());
            if columns.is_empty() {
                columns = record.iter().map(str::to_owned).collect();
                for (index, column) in columns.iter().enumerate() {
                    if columns[..index].contains(column) {
                        return fails(line, CsvProblem::DuplicateColumn { column: column.clone() });
                    }
                }
                continue;
            }
            if record.iter().all(str::is_empty) {
                continue;
            }
            if record.len() != columns.len() {
                return fails(line, CsvProblem::Ragged { found: record.len(), expected: columns.len() });
            }
            rows.push(record);
        }
        Ok(Csv { path, columns, rows })
    }

    fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.rows.iter().map(|record| Row {
            csv: self,
            record,
            line: record.position().map_or(1, |position| position.line()),
        })
    }

    fn require(&self, column: &'static str) -> Result<usize, DatasetError> {
        self.column(column).ok_or_else(|| self.fails(CsvProblem::MissingColumn { column }))
    }

    fn column(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column == name)
    }

    /// An error of the header.
    fn fails(&self, problem: CsvProblem) -> DatasetError {
        DatasetError::Csv { path: self.path.clone(), line: 1, problem }
    }
}

impl<'a> Row<'a> {
    /// The cell under `column`; blank where there is no such column.
    fn text(&self, column: &str) -> &'a str {
        self.csv.column(column).map_or("", |index| &self.record[index])
    }

    /// The number under `column`; `None` where it is blank.
    fn number(&self, column: &str) -> Result<Option<f64>, DatasetError> {
        match self.csv.column(column) {
            Some(index) => self.number_at(index),
            None => Ok(None),
        }
    }

    fn number_at(&self, index: usize) -> Result<Option<f64>, DatasetError> {
        let text = &self.record[index];
        if text.is_empty() {
            return Ok(None);
        }
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => {
                let comma = text.contains(',');
                let allowed = if comma {
                    "a finite number with a decimal point, not a comma"
                } else {
                    "a finite number, or blank"
                };
                Err(self.not_allowed(&self.csv.columns[index], allowed))
            }
        }
    }

    /// A number that must be there.
    fn required(&self, column: &str, why: &str) -> Result<f64, DatasetError> {
        self.number(column)?.ok_or_else(|| self.not_allowed(column, why))
    }

    /// A number that must be there and above 0.
    fn positive(&self, column: &str, why: &str) -> Result<f64, DatasetError> {
        let value = self.required(column, why)?;
        if value > 0.0 { Ok(value) } else { Err(self.not_allowed(column, "a number above 0")) }
    }

    fn not_allowed(&self, column: &str, allowed: &str) -> DatasetError {
        DatasetError::Value {
            path: self.csv.path.clone(),
            line: self.line,
            column: column.to_owned(),
            value: self.text(column).to_owned(),
            allowed: allowed.to_owned(),
        }
    }

    fn fails(&self, problem: CsvProblem) -> DatasetError {
        DatasetError::Csv { path: self.csv.path.clone(), line: self.line, problem }
    }

    /// Position and heading under three columns; position both or neither, a heading only with a position.
    fn pose(&self, columns: [&str; 3], together: &'static str) -> Result<Option<SurveyedPose>, DatasetError> {
        let heading = self.number(columns[2])?;
        match (self.number(columns[0])?, self.number(columns[1])?) {
            (Some(x), Some(y)) => Ok(Some(SurveyedPose { x, y, heading })),
            (None, None) if heading.is_none() => Ok(None),
            _ => Err(self.fails(CsvProblem::Together { columns: together })),
        }
    }
}

fn read_runs(csv: &Csv) -> Result<Vec<Run>, DatasetError> {
    let known = || RUN_COLUMNS.iter().map(|(name, _)| (*name).to_owned());
    if let Some(column) = csv.columns.iter().find(|column| !known().any(|name| name == **column)) {
        return Err(csv.fails(CsvProblem::UnknownColumn { column: column.clone(), known: known().collect() }));
    }
    csv.require("run")?;
    csv.require("protocol")?;
    let mut runs: Vec<Run> = Vec::with_capacity(csv.rows.len());
    let mut seen = HashMap::new();
    for row in csv.rows() {
        let name = row.text("run");
        if name.is_empty() {
            return Err(row.not_allowed("run", "a name"));
        }
        if let Some(line) = seen.insert(name, row.line) {
            return Err(row.not_allowed("run", &format!("a name of its own; line {line} has it already")));
        }
        let start = row.pose(["start_x_m", "start_y_m", "start_heading_rad"], "start_x_m and start_y_m")?;
        let start = match start {
            Some(SurveyedPose { x, y, heading: Some(heading) }) => Some(Pose2::new(x, y, heading)),
            Some(SurveyedPose { heading: None, .. }) => {
                let columns = "start_x_m, start_y_m and start_heading_rad";
                return Err(row.fails(CsvProblem::Together { columns }));
            }
            None => None,
        };
        runs.push(Run {
            name: name.to_owned(),
            protocol: read_protocol(&row)?,
            speed: row.number("speed_m_s")?,
            turn_rate: row.number("turn_rate_rad_s")?,
            started: row.number("started_s")?,
            start,
            end: row.pose(["x_m", "y_m", "heading_rad"], "x_m and y_m (and heading_rad only with them)")?,
            odometry_end: row.pose(
                ["odom_x_m", "odom_y_m", "odom_heading_rad"],
                "odom_x_m and odom_y_m (and odom_heading_rad only with them)",
            )?,
            encoders: None,
            poses: None,
        });
    }
    if runs.is_empty() {
        return Err(csv.fails(CsvProblem::NoRows));
    }
    Ok(runs)
}

fn read_protocol(row: &Row<'_>) -> Result<Protocol, DatasetError> {
    let round = || match row.text("direction") {
        "cw" => Ok(Rotation::Clockwise),
        "ccw" => Ok(Rotation::CounterClockwise),
        _ => Err(row.not_allowed("direction", "cw or ccw")),
    };
    Ok(match row.text("protocol") {
        "square" => Protocol::Square { side: row.positive("side_m", "a square has a side")?, direction: round()? },
        "straight" => Protocol::Straight {
            length: row.positive("side_m", "a straight has a length, in the column of sides")?,
            direction: match row.text("direction") {
                "" | "forward" => Travel::Forward,
                "reverse" => Travel::Reverse,
                _ => return Err(row.not_allowed("direction", "forward or reverse")),
            },
        },
        "spin" => Protocol::Spin { turn: row.positive("turn_rad", "a spin has a total turn")?, direction: round()? },
        "circle" => Protocol::Circle {
            radius: row.positive("radius_m", "a circle has a radius")?,
            turn: match row.number("turn_rad")? {
                Some(_) => Some(row.positive("turn_rad", "")?),
                None => None,
            },
            direction: round()?,
        },
        "path" => Protocol::Path,
        _ => return Err(row.not_allowed("protocol", "square, straight, spin, circle or path")),
    })
}

fn read_encoders(
    csv: &Csv,
    campaign: &Campaign,
    index: &HashMap<String, usize>,
    runs: &mut [Run],
) -> Result<(), DatasetError> {
    csv.require("run")?;
    csv.require("t_s")?;
    let mut unit = None;
    let mut channels = Vec::new();
    let mut cells = Vec::new();
    for (position, column) in csv.columns.iter().enumerate() {
        if column == "run" || column == "t_s" {
            continue;
        }
        let (channel, of_column) = [EncoderUnit::Ticks, EncoderUnit::Radians]
            .into_iter()
            .find_map(|unit| Some((column.strip_suffix(unit.as_str())?.strip_suffix('_')?, unit)))
            .filter(|(channel, _)| channel.ends_with("left") || channel.ends_with("right"))
            .ok_or_else(|| csv.fails(CsvProblem::EncoderColumns))?;
        if *unit.get_or_insert(of_column) != of_column {
            return Err(csv.fails(CsvProblem::EncoderColumns));
        }
        channels.push(channel.to_owned());
        cells.push(position);
    }
    let has = |side: &str| channels.iter().any(|channel| channel.ends_with(side));
    let (Some(unit), true, true) = (unit, has("left"), has("right")) else {
        return Err(csv.fails(CsvProblem::EncoderColumns));
    };
    let known = campaign.robot.ticks_per_revolution.is_some()
        || campaign.odometry.as_ref().is_some_and(|odometry| odometry.ticks_per_revolution.is_some());
    if unit == EncoderUnit::Ticks && !known {
        return Err(DatasetError::NoTicksPerRevolution { path: csv.path.clone() });
    }
    for row in csv.rows() {
        let run = &mut runs[run_of(&row, index)?];
        let log = run.encoders.get_or_insert_with(|| EncoderLog {
            unit,
            channels: channels.clone(),
            time: Vec::new(),
            counts: Vec::new(),
        });
        log.time.push(time_of(&row, log.time.last())?);
        for &cell in &cells {
            let count = row.number_at(cell)?;
            log.counts.push(count.ok_or_else(|| row.not_allowed(&csv.columns[cell], "a number in every row"))?);
        }
    }
    Ok(())
}

fn read_poses(csv: &Csv, index: &HashMap<String, usize>, runs: &mut [Run]) -> Result<(), DatasetError> {
    let known = ["run", "t_s", "x_m", "y_m", "heading_rad"];
    if let Some(column) = csv.columns.iter().find(|column| !known.contains(&column.as_str())) {
        let known = known.map(str::to_owned).to_vec();
        return Err(csv.fails(CsvProblem::UnknownColumn { column: column.clone(), known }));
    }
    for column in &known[..4] {
        csv.require(column)?;
    }
    for row in csv.rows() {
        let run = &mut runs[run_of(&row, index)?];
        let log = run.poses.get_or_insert_with(PoseLog::default);
        log.time.push(time_of(&row, log.time.last())?);
        log.poses.push(SurveyedPose {
            x: row.required("x_m", "a number in every row")?,
            y: row.required("y_m", "a number in every row")?,
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
    let time = row.required("t_s", "a number in every row")?;
    match last {
        Some(last) if time < *last => {
            Err(row.not_allowed("t_s", &format!("time does not go back within a run; the row before is at {last}")))
        }
        _ => Ok(time),
    }
}
