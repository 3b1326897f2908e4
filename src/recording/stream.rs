//! rerun's stream with this room's habits: no call fails, failures are kept by [`Disk`].

use super::disk::Disk;
use super::error::RecordingError;
use nalgebra::UnitQuaternion;
use rerun::external::re_log_types::EntityPathPart;
use rerun::{
    AsComponents, EntityPath, RecordingStream, SerializationResult, SerializedComponentColumn, TimeColumn, Transform3D,
};

/// The timeline of what happens along a run: 0 where each run begins.
pub(super) const TIMELINE: &str = "time_in_run";

/// The timeline of a diagnosis' runs, from 1.
pub(super) const RUN: &str = "run";

/// Where an entity is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Path(EntityPath);

impl Path {
    pub(super) fn of<'a>(parts: impl IntoIterator<Item = &'a str>) -> Path {
        Path(EntityPath::new(parts.into_iter().map(EntityPathPart::new).collect()))
    }

    pub(super) fn child(&self, name: &str) -> Path {
        Path(self.0.join(&EntityPath::new(vec![EntityPathPart::new(name)])))
    }

    /// For queries: with what rerun wants escaped escaped.
    pub(super) fn escaped(&self) -> String {
        self.0.to_string()
    }
}

/// A stream into a file; clones go to the same one.
#[derive(Clone)]
pub(super) struct Stream {
    pub(super) to_disk: RecordingStream,
    pub(super) disk: Disk,
    /// World (z up) from room (z along the floor's normal), where they differ.
    pub(super) tilt: Option<UnitQuaternion<f64>>,
}

impl Stream {
    /// Logs what holds at all times.
    pub(super) fn fixed(&self, path: Path, what: &impl AsComponents) {
        if let Err(error) = self.to_disk.log_static(path.0, what) {
            self.disk.note(error);
        }
    }

    /// Logs one row a time \[ns\].
    pub(super) fn columns<C>(&self, path: &Path, times: &[i64], columns: SerializationResult<C>)
    where
        C: Iterator<Item = SerializedComponentColumn>,
    {
        self.send(path, TimeColumn::new_duration_nanos(TIMELINE, times.iter().copied()), columns);
    }

    /// Logs one row a run.
    pub(super) fn columns_by_run<C>(&self, path: &Path, runs: &[i64], columns: SerializationResult<C>)
    where
        C: Iterator<Item = SerializedComponentColumn>,
    {
        self.send(path, TimeColumn::new_sequence(RUN, runs.iter().copied()), columns);
    }

    fn send<C>(&self, path: &Path, index: TimeColumn, columns: SerializationResult<C>)
    where
        C: Iterator<Item = SerializedComponentColumn>,
    {
        match columns {
            Ok(columns) => {
                if let Err(error) = self.to_disk.send_columns(path.0.clone(), [index], columns) {
                    self.disk.note(error);
                }
            }
            Err(error) => self.disk.note(error),
        }
    }

    /// Waits until all that was logged has been given to the system.
    pub(super) fn flush(&self) -> Result<(), RecordingError> {
        if let Err(error) = self.to_disk.flush_blocking() {
            self.disk.note(error);
        }
        self.disk.check()
    }

    /// Ends the file and waits until it is on the disk.
    pub(super) fn finish(self) -> Result<(), RecordingError> {
        let flushed = self.flush();
        let finished = self.disk.finish();
        flushed.and(finished)
    }

    /// Stands what is below `path`, all in the room frame, upright in the world.
    pub(super) fn tilt(&self, path: &Path) {
        if let Some(tilt) = self.tilt {
            self.fixed(path.clone(), &Transform3D::new().with_quaternion(xyzw(&tilt)));
        }
    }
}

/// As rerun takes it.
pub(super) fn xyzw(rotation: &UnitQuaternion<f64>) -> rerun::Quaternion {
    let q = rotation.quaternion();
    rerun::Quaternion::from_xyzw([q.i as f32, q.j as f32, q.k as f32, q.w as f32])
}
