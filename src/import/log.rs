//! What a recording holds before it is cut: wheel rotation and surveyed poses, each by its own clock.

use super::error::{ImportError, PoseProblem};
use super::stamp::{Nanoseconds, seconds};
use crate::dataset::EncoderUnit;
use crate::geometry::Pose2;
use std::path::PathBuf;

/// A reading and when it was.
#[derive(Debug, Clone)]
pub(super) struct Row<T> {
    /// By the clock of who measured.
    pub(super) stamp: Nanoseconds,
    /// By the clock of who recorded; the stamp again, where a file has no such clock (and is refused if it goes back).
    pub(super) arrival: i64,
    pub(super) value: T,
}

/// One recording.
#[derive(Debug)]
pub(super) struct Log {
    /// The name of its file, without folder and ending.
    pub(super) name: String,
    /// Its first file, for messages.
    pub(super) path: PathBuf,
    pub(super) wheels: Wheels,
    pub(super) poses: Vec<Row<Pose2>>,
    /// Whether `arrival` is a clock of its own \[ns\], the same for wheels and poses.
    pub(super) own_arrivals: bool,
}

/// Accumulated wheel rotation.
#[derive(Debug)]
pub(super) struct Wheels {
    pub(super) unit: EncoderUnit,
    /// As `encoders.csv` names its columns, without the unit.
    pub(super) channels: Vec<String>,
    pub(super) rows: Vec<Row<Vec<f64>>>,
}

impl Log {
    /// Wheels and poses must have been stamped in seconds, by clocks that run side by side.
    pub(super) fn check_clocks(&self) -> Result<(), ImportError> {
        self.check_unit("encoders", usual_interval(&self.wheels.rows))?;
        let (Some(wheels), Some(poses)) = (span(&self.wheels.rows), span(&self.poses)) else { return Ok(()) };
        // A survey may be of a reading a minute, but not for thirty times as long as the wheels were logged.
        if poses[1] - poses[0] > 30 * (wheels[1] - wheels[0]) {
            self.check_unit("poses", usual_interval(&self.poses))?;
        }
        if wheels[0] <= poses[1] && poses[0] <= wheels[1] {
            return Ok(());
        }
        Err(ImportError::Clocks {
            path: self.path.clone(),
            wheels: wheels.map(seconds),
            poses: poses.map(seconds),
            log_clock: self.own_arrivals,
        })
    }

    fn check_unit(&self, stream: &'static str, interval: Nanoseconds) -> Result<(), ImportError> {
        if interval < SELDOM {
            return Ok(());
        }
        Err(ImportError::StampUnit { path: self.path.clone(), stream, interval: seconds(interval) })
    }
}

/// Rows that are farther apart are no log of wheels, unless they are stamped in another unit \[ns\].
const SELDOM: Nanoseconds = 2_000_000_000;

/// First and last stamp.
pub(super) fn span<T>(rows: &[Row<T>]) -> Option<[Nanoseconds; 2]> {
    Some([rows.iter().map(|row| row.stamp).min()?, rows.iter().map(|row| row.stamp).max()?])
}

/// The usual time from row to row: the median \[ns\].
pub(super) fn usual_interval<T>(rows: &[Row<T>]) -> Nanoseconds {
    let mut intervals: Vec<Nanoseconds> = rows.windows(2).map(|pair| pair[1].stamp - pair[0].stamp).collect();
    intervals.sort_unstable();
    intervals.get(intervals.len() / 2).copied().unwrap_or(0)
}

/// A pose as every format states it, seen from above.
pub(super) enum Planar {
    /// Its heading is wrapped.
    Pose(Pose2),
    /// Not measured: motion capture that lost its markers writes NaN.
    Dropout,
}

/// Poses in space, seen from above; keeps the lean of their z axes, because poses of another vertical make no plan.
#[derive(Default)]
pub(super) struct FromAbove {
    count: f64,
    sum_of_cosines: f64,
    /// Poses that were not measured.
    pub(super) dropouts: usize,
}

/// A survey's z axis leans no further from upright than a robot would on a floor \[rad\].
const LEAN: f64 = 0.5;

impl FromAbove {
    /// The pose of a position \[m\] and a quaternion x, y, z, w.
    pub(super) fn see(&mut self, position: [f64; 3], quaternion: [f64; 4]) -> Result<Planar, PoseProblem> {
        if position.iter().chain(&quaternion).any(|value| !value.is_finite()) {
            self.dropouts += 1;
            return Ok(Planar::Dropout);
        }
        let norm = quaternion.iter().map(|part| part * part).sum::<f64>().sqrt();
        // Rounded to three decimals, a unit quaternion is one to 1e-3.
        if (norm - 1.0).abs() > 2e-3 {
            return Err(PoseProblem::NotUnit { quaternion, norm });
        }
        let [x, y, z, w] = quaternion.map(|part| part / norm);
        self.count += 1.0;
        self.sum_of_cosines += 1.0 - 2.0 * (x * x + y * y);
        let heading = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
        Ok(Planar::Pose(Pose2::new(position[0], position[1], heading)))
    }

    /// Whether what was seen is a plan at all.
    pub(super) fn check(&self) -> Result<(), PoseProblem> {
        let lean = (self.sum_of_cosines / self.count).clamp(-1.0, 1.0).acos();
        if lean > LEAN { Err(PoseProblem::NotUpright { lean }) } else { Ok(()) }
    }
}
