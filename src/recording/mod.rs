//! Runs as rerun recordings: streamed while they go, and opened by the viewer on everything at once.
//!
//! # What is in a file
//!
//! An experiment's entities hang on one timeline, `time_in_run`, which is 0 where each run begins, so that runs before and after a
//! calibration drive side by side. A run of a stage (`before`, `after_umbmark_2m`, …) is at
//! `/{stage}/{protocol}_{direction}/run_{repeat}`, for instance `/before/square_4m_ccw/run_1`, with
//!
//! | below it | what | rate |
//! |---|---|---|
//! | `path/true`, `path/dead_reckoned` | whole paths \[m\] | static, logged at the end of the run |
//! | `path/true_end` | true end point \[m\] | static |
//!
//! and, for runs in [`Detail::Full`], also
//!
//! | below it | what | rate |
//! |---|---|---|
//! | `chassis`, `wheels/{wheel}`, `casters/{link}` that swivel | room_from_body, with a `shape` below | 25 Hz |
//! | `believed` | where the robot believes it is, with a wire `frame` below | 25 Hz |
//! | `path/true_so_far`, `path/dead_reckoned_so_far` | growing paths \[m\] | 5 Hz |
//! | `patches/{wheel}` | room_from_patch, x along, y across | 10 Hz |
//! | `patches/{wheel}/tractions` | shear traction of each bristle cell, 60 mm for 40 kPa | 10 Hz |
//! | `patches/{wheel}/force` | force on the wheel, 0.2 m for 50 N | 10 Hz |
//! | `patches/{wheel}/outline` | contact patch \[m\] | where it changes by 5 % |
//! | `series/wheel_speed_rad_s`, `series/wheel_speed_commanded_rad_s`, `series/ticks` | an instance a wheel | 50 Hz |
//! | `series/slip_along_m_s`, `series/slip_across_m_s` | an instance a wheel | 50 Hz |
//! | `series/load_n`, `series/force_along_n`, `series/force_across_n` | an instance a wheel | 50 Hz |
//! | `series/heading_error_mrad` | dead-reckoned − true | 50 Hz |
//! | `series/position_error_mm` | distance of dead-reckoned and true position | 50 Hz |
//!
//! `/floor` holds the room, `/end_points/square_{side}m/{stage}/{direction}` the end points \[mm, y counted downwards as
//! the viewer's screen does\], `/end_points/square_{side}m_closer` those after calibration at their own scale, `/result` and `/how_to_read` the
//! texts. Where the floor slopes, a transform at `/floor` and at each run turns the
//! room frame, whose z is the floor's normal, upright.
//!
//! What is in a diagnosis' file, [`diagnosis`] says.
//!
//! # When things go wrong
//!
//! What is logged reaches the system at least each second of wall time, so the recording of a process that was killed
//! opens, and shows what came before. A full disk is told by [`Recording::check`] and [`Recording::finish`]; runs go on.

mod blueprint;
mod diagnosis;
mod disk;
mod error;
mod floor;
mod lettering;
mod look;
mod mesh;
mod run;
mod scatter;
mod stream;
#[cfg(test)]
mod tests;

pub use diagnosis::diagnosis;
pub use error::RecordingError;
pub use run::RunRecorder;
pub use scatter::EndPoints;

use crate::dataset::Protocol;
use crate::scene::{Robot, Scene};
use disk::Disk;
use nalgebra::{UnitQuaternion, Vector3};
use rerun::external::re_log_types::LogMsg;
use rerun::sink::LogSink;
use rerun::{RecordingStream, RecordingStreamBuilder, RecordingStreamResult, TextDocument, ViewCoordinates};
use std::path::Path as FilePath;
use stream::{Path, Stream};

/// As the viewer names what made a file.
const APPLICATION: &str = "treadmark";

/// A recording that is being written. Runs may be recorded from several threads at once.
pub struct Recording {
    stream: Stream,
    robot: Robot,
    stages: Vec<String>,
    /// Robots wear their run's colour, since there are several.
    tint: bool,
}

/// What a recording is going to show; the viewer's layout follows from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    /// Of the recording and of its main view.
    pub title: String,
    /// Stages, in their order; where there are several, the first one is the uncalibrated one.
    pub stages: Vec<String>,
    /// Runs that are recorded in full. The first one is shown closely, and its series are plotted.
    pub featured: Vec<RunLabel>,
    /// Where the robot is going to drive.
    pub area: Area,
    /// Of the squares whose end points are going to be plotted \[m\]; none for a single drive.
    pub sides: Vec<f64>,
}

/// A rectangle of the room.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    /// Least x and y \[m\].
    pub min: [f64; 2],
    /// Greatest x and y \[m\].
    pub max: [f64; 2],
}

/// Which run it is.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct RunLabel {
    /// `before`, `after_umbmark_2m`, …
    pub stage: String,
    /// `square_4m`, …
    pub protocol: String,
    /// `cw`, `ccw`, `forward`, `reverse`; empty where there is none.
    pub direction: String,
    /// From 1.
    pub repeat: usize,
}

/// How much of a run is recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detail {
    /// Everything: 1 to 2 MB a minute.
    Full,
    /// The paths alone: some 10 kB.
    Path,
}

impl Recording {
    /// Opens a new recording at `path`, with the viewer's layout and the scene's floor in it.
    ///
    /// # Errors
    /// The file exists, or cannot be made or written.
    pub fn create(path: &FilePath, outline: &Outline, scene: &Scene) -> Result<Recording, RecordingError> {
        let messages = blueprint::messages(outline, &scene.robot);
        let stream = Recording::open(path, &outline.title, messages, scene, &outline.area)?;
        let recording = Recording {
            stream,
            robot: scene.robot.clone(),
            stages: outline.stages.clone(),
            tint: outline.featured.len() > 1,
        };
        let how_to_read = TextDocument::from_markdown(look::how_to_read(outline));
        recording.stream.fixed(Path::of(["how_to_read"]), &how_to_read);
        recording.result("*The result comes at the end.*");
        recording.check()?;
        Ok(recording)
    }

    /// A stream into a new file at `path`, with a layout and the scene's floor in it.
    fn open(
        path: &FilePath,
        title: &str,
        layout: RecordingStreamResult<Vec<LogMsg>>,
        scene: &Scene,
        area: &Area,
    ) -> Result<Stream, RecordingError> {
        let disk = Disk::create(path)?;
        let stream = Recording::begin(disk, title, layout, scene, area);
        stream.disk.check().inspect_err(|_| {
            // Nothing that one could look at; the error that comes back is the one to tell.
            let _ = std::fs::remove_file(path);
        })?;
        Ok(stream)
    }

    fn begin(
        disk: Disk,
        title: &str,
        layout: RecordingStreamResult<Vec<LogMsg>>,
        scene: &Scene,
        area: &Area,
    ) -> Stream {
        match layout {
            Ok(messages) => disk.send_all(messages),
            Err(error) => disk.note(error),
        }
        let stream = RecordingStreamBuilder::new(APPLICATION).recording_name(title).enabled(true).buffered();
        let stream = stream.unwrap_or_else(|error| {
            disk.note(error);
            RecordingStream::disabled()
        });
        stream.set_sink(Box::new(disk.clone()));
        let upright = UnitQuaternion::rotation_between(&scene.floor.gravity(), &-Vector3::z());
        let tilt = upright.filter(|upright| upright.angle() > 1e-9);
        let stream = Stream { to_disk: stream, disk, tilt };
        stream.fixed(Path::of([]), &ViewCoordinates::RIGHT_HAND_Z_UP());
        floor::draw(&stream, &scene.floor, area);
        stream
    }

    /// Records a run; give the recorder to [`drive::run`](crate::drive::run) and drop it when the run has ended.
    pub fn run(&self, label: &RunLabel, detail: Detail) -> RunRecorder {
        RunRecorder::new(self, label, detail)
    }

    /// When the stage of that name comes; last, where the outline does not have it.
    fn stage(&self, name: &str) -> look::Stage {
        let index = self.stages.iter().position(|stage| stage == name).unwrap_or(self.stages.len());
        look::Stage { index, of: self.stages.len() }
    }

    /// Plots the end points of the squares of one side \[m\], in place of an earlier plot of it.
    ///
    /// Clusters of the first stage are lettered where they are, those of later ones beside the origin.
    pub fn end_points(&self, side: f64, clusters: &[EndPoints]) {
        scatter::draw(&self.stream, &scatter::path(side), clusters, |stage| self.stage(stage));
        // What is left is too small to be seen beside what was.
        let after = clusters.iter().filter(|cluster| !self.stage(&cluster.stage).is_before());
        let after: Vec<EndPoints> = after.cloned().collect();
        if !after.is_empty() && after.len() < clusters.len() {
            scatter::draw(&self.stream, &scatter::closer(side), &after, |stage| self.stage(stage));
        }
    }

    /// Shows `markdown` in the text panel, which has room for about a dozen lines. The last one stays.
    pub fn result(&self, markdown: &str) {
        self.stream.fixed(Path::of(["result"]), &TextDocument::from_markdown(markdown));
    }

    /// Whether all that was logged has been written so far.
    ///
    /// # Errors
    /// The first failed write; what came before it is readable.
    pub fn check(&self) -> Result<(), RecordingError> {
        self.stream.disk.check()
    }

    /// Waits until all that was logged has been given to the system.
    ///
    /// # Errors
    /// As [`check`](Recording::check).
    pub fn flush(&self) -> Result<(), RecordingError> {
        self.stream.flush()
    }

    /// Ends the file and waits until it is on the disk. What recorders that still live would log is lost.
    ///
    /// # Errors
    /// As [`check`](Recording::check).
    pub fn finish(self) -> Result<(), RecordingError> {
        self.stream.finish()
    }
}

impl RunLabel {
    /// The label of a run of `protocol`.
    pub fn of(stage: &str, protocol: &Protocol, repeat: usize) -> RunLabel {
        let shape = match *protocol {
            Protocol::Square { side, .. } => format!("square_{side}m"),
            Protocol::Straight { length, .. } => format!("straight_{length}m"),
            Protocol::Circle { radius, .. } => format!("circle_{radius}m"),
            Protocol::Spin { .. } | Protocol::Path => protocol.kind().to_owned(),
        };
        let direction = protocol.direction().unwrap_or_default().to_owned();
        RunLabel { stage: stage.to_owned(), protocol: shape, direction, repeat }
    }

    /// `/{stage}/{protocol}_{direction}/run_{repeat}`
    fn path(&self) -> Path {
        let gap = if self.direction.is_empty() { "" } else { "_" };
        let drive = format!("{}{gap}{}", self.protocol, self.direction);
        Path::of([self.stage.as_str(), &drive, &format!("run_{}", self.repeat)])
    }

    /// For readers.
    fn words(&self) -> String {
        look::words(&self.stage)
    }
}

impl Area {
    /// Where runs of `protocols` lead, as planned, from a start at the origin.
    pub fn of<'a>(protocols: impl IntoIterator<Item = &'a Protocol>) -> Area {
        let mut area = Area { min: [-0.5; 2], max: [0.5; 2] };
        for protocol in protocols {
            match *protocol {
                Protocol::Square { side, direction } => {
                    area.include([0.0, 0.0]);
                    area.include([side, direction.sign() * side]);
                }
                Protocol::Straight { length, direction } => area.include([direction.sign() * length, 0.0]),
                Protocol::Circle { radius, direction, .. } => {
                    area.include([-radius, 0.0]);
                    area.include([radius, 2.0 * direction.sign() * radius]);
                }
                Protocol::Spin { .. } | Protocol::Path => {}
            }
        }
        area
    }

    fn include(&mut self, point: [f64; 2]) {
        for (axis, value) in point.into_iter().enumerate() {
            self.min[axis] = self.min[axis].min(value);
            self.max[axis] = self.max[axis].max(value);
        }
    }
}
