//! Dataset → files. What would not read back is refused; all files are staged beside their places before the first is
//! renamed into its own; `dataset.toml` comes last, so that a folder that holds one holds the whole dataset.

use super::error::{DatasetError, Part};
use super::protocol::Protocol;
use super::read::{File, Files};
use super::wire::DatasetFile;
use super::{Dataset, EncoderUnit, Run, SurveyedPose};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use tempfile::NamedTempFile;

impl Dataset {
    /// Writes the dataset into `folder`, which is made if need be and must not hold any file of a dataset already.
    /// Reading gives the identical dataset; numbers are written as short as that allows.
    ///
    /// # Errors
    /// A file of a dataset that is there already; a full disk, a folder that cannot be written; anything that
    /// [`Dataset::read`] would not accept (a NaN, two runs of one name) or would not give back as it was. An error
    /// leaves no new `dataset.toml` behind, and, unless it is a rename that failed, no other file either.
    pub fn write(&self, folder: &Path) -> Result<(), DatasetError> {
        let files = self.files(folder)?;
        self.check_faithful(folder, &files)?;
        let cannot = |source| DatasetError::Write { path: folder.to_owned(), source };
        std::fs::create_dir_all(folder).map_err(cannot)?;
        // A stray log of another dataset would become part of this one.
        for name in ["dataset.toml", "runs.csv", "encoders.csv", "poses.csv"] {
            let path = folder.join(name);
            if path.exists() {
                return Err(DatasetError::Exists { path });
            }
        }
        let Files { campaign, runs, encoders, poses } = files;
        let staged = [Some(runs), encoders, poses, Some(campaign)]
            .into_iter()
            .flatten()
            .map(|file| Ok((stage(&file, folder)?, file.path)))
            .collect::<Result<Vec<_>, DatasetError>>()?;
        for (temporary, path) in staged {
            temporary.persist(&path).map_err(|error| DatasetError::Write { path, source: error.error })?;
        }
        Ok(())
    }

    fn files(&self, folder: &Path) -> Result<Files, DatasetError> {
        let file = |name, text| File { path: folder.join(name), text };
        let path = folder.join("dataset.toml");
        let campaign = toml::to_string(&DatasetFile::from(self.campaign.clone()))
            .map_err(|source| DatasetError::Unwritable { path: path.clone(), source })?;
        let version = env!("CARGO_PKG_VERSION");
        let text = format!("# By treadmark {version}. SI units and radians, as every key and column says.\n{campaign}");
        Ok(Files {
            campaign: File { path, text },
            runs: file("runs.csv", self.runs_csv()),
            encoders: self.encoders_csv().map(|text| file("encoders.csv", text)),
            poses: self.poses_csv().map(|text| file("poses.csv", text)),
        })
    }

    /// Reads the files back before they are files: what cannot be read again is better refused than kept.
    fn check_faithful(&self, folder: &Path, files: &Files) -> Result<(), DatasetError> {
        let back = Dataset::parse(files)?;
        let part = if back.campaign != self.campaign {
            Part::Campaign
        } else if let Some((run, _)) = self.runs.iter().zip(&back.runs).find(|(run, back)| run != back) {
            Part::Run(run.name.clone())
        } else {
            return Ok(());
        };
        Err(DatasetError::NotFaithful { path: folder.to_owned(), part })
    }

    /// Columns that are blank throughout are left out, but for the two that are required.
    fn runs_csv(&self) -> String {
        let columns = RUN_COLUMNS.map(|(name, cell)| (name, self.runs.iter().map(cell).collect::<Vec<_>>()));
        let mut kept = Vec::new();
        for (name, cells) in columns {
            if ["run", "protocol"].contains(&name) || cells.iter().any(|cell| !cell.is_empty()) {
                kept.push((name, cells));
            }
        }
        let mut text = kept.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(",");
        text.push('\n');
        for row in 0..self.runs.len() {
            text.push_str(&kept.iter().map(|(_, cells)| cells[row].as_str()).collect::<Vec<_>>().join(","));
            text.push('\n');
        }
        text
    }

    fn encoders_csv(&self) -> Option<String> {
        let logs = || self.runs.iter().filter_map(|run| Some((run, run.encoders.as_ref()?)));
        let (_, first) = logs().next()?;
        let mut text = String::from("run,t_s");
        for channel in &first.channels {
            let _ = write!(text, ",{channel}_{}", first.unit.as_str());
        }
        text.push('\n');
        for (run, log) in logs() {
            let name = quoted(&run.name);
            // A log without channels has no counts to chunk; it is refused when the files are read back.
            for (time, counts) in log.time.iter().zip(log.counts.chunks(log.channels.len().max(1))) {
                let _ = write!(text, "{name},{time}");
                for count in counts {
                    let _ = write!(text, ",{count}");
                }
                text.push('\n');
            }
        }
        Some(text)
    }

    fn poses_csv(&self) -> Option<String> {
        let logs = || self.runs.iter().filter_map(|run| Some((run, run.poses.as_ref()?)));
        logs().next()?;
        let headings = logs().any(|(_, log)| log.poses.iter().any(|pose| pose.heading.is_some()));
        let mut text = String::from(if headings { "run,t_s,x_m,y_m,heading_rad\n" } else { "run,t_s,x_m,y_m\n" });
        for (run, log) in logs() {
            let name = quoted(&run.name);
            for (time, pose) in log.time.iter().zip(&log.poses) {
                let _ = write!(text, "{name},{time},{},{}", pose.x, pose.y);
                if headings {
                    let _ = write!(text, ",{}", blank(pose.heading));
                }
                text.push('\n');
            }
        }
        Some(text)
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

/// A CSV cell of free text.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// The whole of a file, on disk under a temporary name in `folder`; gone again if it is dropped.
fn stage(file: &File, folder: &Path) -> Result<NamedTempFile, DatasetError> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".treadmark-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666)); // as the umask has it
    let write = || {
        let mut temporary = builder.tempfile_in(folder)?;
        temporary.write_all(file.text.as_bytes())?;
        temporary.as_file().sync_all()?;
        Ok(temporary)
    };
    write().map_err(|source| DatasetError::Write { path: file.path.clone(), source })
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
