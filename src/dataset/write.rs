//! Dataset → files. Each is written beside its place and then renamed into it; `dataset.toml` comes last, so that a
//! folder that holds one holds the whole dataset.

use super::error::DatasetError;
use super::protocol::Protocol;
use super::{Dataset, DriveKind, EncoderUnit, Run, SurveyedPose};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

impl Dataset {
    /// Writes the dataset into `folder`, which is made if need be and must not hold one already.
    ///
    /// # Errors
    /// A dataset that is there already, a full disk, a folder that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), DatasetError> {
        std::fs::create_dir_all(folder).map_err(|source| DatasetError::Write { path: folder.to_owned(), source })?;
        let toml = folder.join("dataset.toml");
        if toml.exists() {
            return Err(DatasetError::Exists { path: toml });
        }
        write_file(folder.join("runs.csv"), &self.runs_csv())?;
        if self.runs.iter().any(|run| run.encoders.is_some()) {
            write_file(folder.join("encoders.csv"), &self.encoders_csv())?;
        }
        if self.runs.iter().any(|run| run.poses.is_some()) {
            write_file(folder.join("poses.csv"), &self.poses_csv())?;
        }
        write_file(toml, &self.dataset_toml())
    }

    fn dataset_toml(&self) -> String {
        let campaign = &self.campaign;
        let mut text = String::from("format = \"treadmark-dataset/1\"\n");
        let mut put = |key: &str, value: Option<toml::Value>| {
            if let Some(value) = value {
                let _ = writeln!(text, "{key} = {value}");
            }
        };
        let string = |value: &Option<String>| value.clone().map(toml::Value::String);
        let path = |value: &Option<PathBuf>| value.as_ref().map(|path| toml::Value::String(path.display().to_string()));
        let number = |value: Option<f64>| value.map(toml::Value::Float);
        put("name", Some(toml::Value::String(campaign.name.clone())));
        put("description", string(&campaign.description));
        put("source", string(&campaign.source));
        put("licence", string(&campaign.licence));
        let robot = &campaign.robot;
        let drive = robot.drive.map(|drive| toml::Value::String(drive.as_str().to_owned()));
        put("robot.model", path(&robot.model));
        put("robot.drive", drive);
        put("robot.nominal_wheel_diameter_m", number(robot.nominal_wheel_diameter));
        put("robot.nominal_track_width_m", number(robot.nominal_track_width));
        put("robot.wheelbase_m", number(robot.wheelbase));
        put("robot.wheel_width_m", number(robot.wheel_width));
        put("robot.mass_kg", number(robot.mass));
        put("robot.ticks_per_revolution", number(robot.ticks_per_revolution));
        put("world.model", path(&campaign.world_model));
        if let Some(odometry) = &campaign.odometry {
            put("odometry.left_wheel_radius_m", number(Some(odometry.left_wheel_radius)));
            put("odometry.right_wheel_radius_m", number(Some(odometry.right_wheel_radius)));
            put("odometry.track_width_m", number(Some(odometry.track_width)));
            put("odometry.ticks_per_revolution", number(odometry.ticks_per_revolution));
        }
        put("survey.method", string(&campaign.survey.method));
        put("survey.position_std_m", number(campaign.survey.position_std));
        put("survey.heading_std_rad", number(campaign.survey.heading_std));
        for (key, value) in &campaign.conditions {
            put(&format!("conditions.{}", quoted_key(key)), Some(value.clone()));
        }
        text
    }

    fn runs_csv(&self) -> String {
        table(&RUN_COLUMNS.map(|(name, value)| (name.to_owned(), self.runs.iter().map(value).collect())))
    }

    fn encoders_csv(&self) -> String {
        let logged = || self.runs.iter().filter_map(|run| Some((run, run.encoders.as_ref()?)));
        let Some((_, first)) = logged().next() else { return String::new() };
        let unit = first.unit.as_str();
        let mut text = String::from("run,t_s");
        for channel in &first.channels {
            let _ = write!(text, ",{channel}_{unit}");
        }
        text.push('\n');
        for (run, log) in logged() {
            let name = quoted(&run.name);
            for (time, counts) in log.time.iter().zip(log.counts.chunks(log.channels.len())) {
                let _ = write!(text, "{name},{time}");
                for count in counts {
                    let _ = write!(text, ",{count}");
                }
                text.push('\n');
            }
        }
        text
    }

    fn poses_csv(&self) -> String {
        let mut text = String::from("run,t_s,x_m,y_m,heading_rad\n");
        for (run, log) in self.runs.iter().filter_map(|run| Some((run, run.poses.as_ref()?))) {
            let name = quoted(&run.name);
            for (time, pose) in log.time.iter().zip(&log.poses) {
                let _ = writeln!(text, "{name},{time},{},{},{}", pose.x, pose.y, blank(pose.heading));
            }
        }
        text
    }
}

/// A column of `runs.csv`: its name, and its cell of a run.
type RunColumn = (&'static str, fn(&Run) -> String);

/// The columns of `runs.csv`, in the order of the format.
pub(super) const RUN_COLUMNS: [RunColumn; 18] = [
    ("run", |run| quoted(&run.name)),
    ("protocol", |run| run.protocol.kind().to_owned()),
    ("side_m", |run| match run.protocol {
        Protocol::Square { side, .. } => side.to_string(),
        Protocol::Straight { length, .. } => length.to_string(),
        _ => String::new(),
    }),
    ("radius_m", |run| match run.protocol {
        Protocol::Circle { radius, .. } => radius.to_string(),
        _ => String::new(),
    }),
    ("turn_rad", |run| match run.protocol {
        Protocol::Spin { turn, .. } => turn.to_string(),
        Protocol::Circle { turn, .. } => blank(turn),
        _ => String::new(),
    }),
    ("direction", |run| run.protocol.direction().unwrap_or("").to_owned()),
    ("speed_m_s", |run| blank(run.speed)),
    ("turn_rate_rad_s", |run| blank(run.turn_rate)),
    ("started_s", |run| blank(run.started)),
    ("start_x_m", |run| blank(run.start.map(|pose| pose.x))),
    ("start_y_m", |run| blank(run.start.map(|pose| pose.y))),
    ("start_heading_rad", |run| blank(run.start.map(|pose| pose.heading))),
    ("x_m", |run| x(run.end)),
    ("y_m", |run| y(run.end)),
    ("heading_rad", |run| heading(run.end)),
    ("odom_x_m", |run| x(run.odometry_end)),
    ("odom_y_m", |run| y(run.odometry_end)),
    ("odom_heading_rad", |run| heading(run.odometry_end)),
];

fn x(pose: Option<SurveyedPose>) -> String {
    blank(pose.map(|pose| pose.x))
}

fn y(pose: Option<SurveyedPose>) -> String {
    blank(pose.map(|pose| pose.y))
}

fn heading(pose: Option<SurveyedPose>) -> String {
    blank(pose.and_then(|pose| pose.heading))
}

fn blank(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| value.to_string())
}

/// Columns side by side; those blank throughout are left out, but for the first two.
fn table(columns: &[(String, Vec<String>)]) -> String {
    let kept: Vec<&(String, Vec<String>)> = columns
        .iter()
        .enumerate()
        .filter(|(index, (_, cells))| *index < 2 || cells.iter().any(|cell| !cell.is_empty()))
        .map(|(_, column)| column)
        .collect();
    let mut text = kept.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(",");
    text.push('\n');
    for row in 0..kept.first().map_or(0, |(_, cells)| cells.len()) {
        let cells: Vec<&str> = kept.iter().map(|(_, cells)| cells[row].as_str()).collect();
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

/// A CSV cell of free text.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) || text.trim() != text {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// A TOML key of free text.
fn quoted_key(key: &str) -> String {
    let bare = !key.is_empty() && key.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
    if bare { key.to_owned() } else { toml::Value::String(key.to_owned()).to_string() }
}

fn write_file(path: PathBuf, text: &str) -> Result<(), DatasetError> {
    let write = || {
        let folder = path.parent().unwrap_or(Path::new("."));
        let mut builder = tempfile::Builder::new();
        builder.prefix(".treadmark-");
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666)); // as the umask has it
        let mut file = builder.tempfile_in(folder)?;
        file.write_all(text.as_bytes())?;
        file.as_file().sync_all()?;
        file.persist(&path).map_err(|error| error.error)?;
        Ok(())
    };
    write().map_err(|source| DatasetError::Write { path: path.clone(), source })
}

impl DriveKind {
    /// As `dataset.toml` spells it.
    pub(super) fn as_str(self) -> &'static str {
        match self {
            DriveKind::SkidSteer => "skid-steer",
            DriveKind::Differential => "differential",
        }
    }
}

impl EncoderUnit {
    /// As the columns of `encoders.csv` end.
    pub(super) fn as_str(self) -> &'static str {
        match self {
            EncoderUnit::Ticks => "ticks",
            EncoderUnit::Radians => "rad",
        }
    }
}
