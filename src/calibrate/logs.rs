//! Encoder logs beside surveyed poses, for the methods that use both. Clocks are taken to agree.

use super::error::CalibrateError;
use super::training::{Observation, Training};
use crate::geometry::Pose2;

/// One logged run: accumulated wheel rotation at each encoder row, and surveyed poses at times on the way.
pub(super) struct LoggedRun {
    time: Vec<f64>,
    /// Left and right \[rad\] since the start.
    wheels: Vec<[f64; 2]>,
    /// Surveyed poses with their stamps, the start first \[s\].
    pub poses: Vec<(f64, Pose2)>,
}

/// Time between the surveyed poses that are used, at least \[s\]: closer ones add the same noise again.
const POSE_INTERVAL: f64 = 1.0;

/// The runs of `training` that have logs.
pub(super) fn logged_runs(training: &Training) -> Result<Vec<LoggedRun>, CalibrateError> {
    let runs: Vec<LoggedRun> = training.runs.iter().filter_map(|run| LoggedRun::of(run)).collect();
    if runs.is_empty() { Err(CalibrateError::NoLogs { dataset: training.name.clone() }) } else { Ok(runs) }
}

impl LoggedRun {
    fn of(observation: &Observation) -> Option<LoggedRun> {
        let log = observation.run.log()?;
        let odometry = &observation.odometry;
        let zero = log.sides(0, odometry);
        let wheels = (0..log.len())
            .map(|row| {
                let now = log.sides(row, odometry);
                [now[0] - zero[0], now[1] - zero[1]]
            })
            .collect();
        let (first, last) = (log.time[0], log.time[log.len() - 1]);
        let mut poses = vec![(first, Pose2::IDENTITY)];
        if let Some(survey) = &observation.run.poses {
            for (&time, pose) in survey.time.iter().zip(&survey.poses) {
                let Some(heading) = pose.heading else { continue };
                let since = poses.last().map_or(f64::INFINITY, |(last, _)| time - last);
                if since >= POSE_INTERVAL && time < last {
                    poses.push((time, Pose2::new(pose.x, pose.y, heading)));
                }
            }
        }
        let end = observation.surveyed;
        poses.push((last, Pose2::new(end.x, end.y, end.heading?)));
        Some(LoggedRun { time: log.time.clone(), wheels, poses })
    }

    /// Wheel rotation at `time`, between two rows in proportion \[rad\].
    pub(super) fn wheels_at(&self, time: f64) -> [f64; 2] {
        let after = self.time.partition_point(|stamp| *stamp < time).clamp(1, self.time.len() - 1);
        let (t0, t1) = (self.time[after - 1], self.time[after]);
        let part = if t1 > t0 { ((time - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { 1.0 };
        let (from, to) = (self.wheels[after - 1], self.wheels[after]);
        [from[0] + part * (to[0] - from[0]), from[1] + part * (to[1] - from[1])]
    }

    /// Wheel rotation from row to row between two times, their ends included.
    pub(super) fn steps(&self, from: f64, to: f64) -> Vec<[f64; 2]> {
        let rows = self.time.partition_point(|stamp| *stamp <= from)..self.time.partition_point(|stamp| *stamp < to);
        let inner = self.wheels.get(rows.clone()).unwrap_or_default();
        let mut steps = Vec::with_capacity(inner.len() + 1);
        let mut last = self.wheels_at(from);
        for now in inner.iter().copied().chain([self.wheels_at(to)]) {
            steps.push([now[0] - last[0], now[1] - last[1]]);
            last = now;
        }
        steps
    }
}
