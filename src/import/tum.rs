//! Trajectories as the TUM RGB-D benchmark writes them and `evo` reads them: `t x y z qx qy qz qw` a line.

use super::error::{ImportError, TableProblem};
use super::log::{FromAbove, Planar, Row};
use super::stamp;
use crate::dataset::{Dataset, EncoderLog, PoseLog};
use crate::geometry::Pose2;
use crate::odometry::{DeadReckoning, OdometryParameters};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

/// The poses of a file, and how many were not measured.
pub(super) fn read(path: &Path, text: &str) -> Result<(Vec<Row<Pose2>>, usize), ImportError> {
    let mut above = FromAbove::default();
    let mut rows: Vec<Row<Pose2>> = Vec::new();
    let mut last_line = 1;
    for (index, line) in text.lines().enumerate() {
        let number = index as u64 + 1;
        last_line = number;
        let fails = |problem| ImportError::Table { path: path.to_owned(), line: number, problem };
        let content = line.split('#').next().unwrap_or("").trim();
        if content.is_empty() {
            continue;
        }
        let cells: Vec<&str> = content.split_whitespace().collect();
        if cells.len() != 8 {
            return Err(fails(TableProblem::NotTum { found: cells.len() }));
        }
        let not_allowed = |index: usize| {
            fails(TableProblem::Value {
                column: TUM_COLUMNS[index].to_owned(),
                value: cells[index].to_owned(),
                allowed: "a number with a decimal point",
            })
        };
        let stamp = stamp::scaled(cells[0], 9).ok_or_else(|| not_allowed(0))?;
        if let Some(before) = rows.last().map(|row| row.stamp).filter(|before| *before > stamp) {
            let (before, after) = (stamp::seconds(before), stamp::seconds(stamp));
            return Err(fails(TableProblem::TimeGoesBack { before, after }));
        }
        let mut numbers = [0.0; 7];
        for (index, number) in numbers.iter_mut().enumerate() {
            *number = cells[index + 1].parse().map_err(|_| not_allowed(index + 1))?;
        }
        let [x, y, z, qx, qy, qz, qw] = numbers;
        let pose = above.see([x, y, z], [qx, qy, qz, qw]);
        if let Planar::Pose(value) = pose.map_err(|problem| fails(TableProblem::Pose(problem)))? {
            rows.push(Row { stamp, arrival: stamp, value });
        }
    }
    above.check().map_err(|problem| ImportError::Table {
        path: path.to_owned(),
        line: last_line,
        problem: TableProblem::Pose(problem),
    })?;
    Ok((rows, above.dropouts))
}

const TUM_COLUMNS: [&str; 8] = ["t", "x", "y", "z", "qx", "qy", "qz", "qw"];

/// A trajectory to be written.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// File name: the run's, `survey` or `odometry`, `.tum`.
    pub file: String,
    /// The whole file.
    pub text: String,
}

/// The trajectories of every run that has logs: surveyed poses that have a heading, and the dead-reckoned path where
/// `dataset.toml` says what the robot believed. Both in the frame of the run's start, stamped as the logs are, each by
/// its own clock.
pub fn export(dataset: &Dataset) -> Vec<Trajectory> {
    let mut taken = BTreeSet::new();
    let mut trajectories = Vec::new();
    for run in &dataset.runs {
        let plain: String =
            run.name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect();
        let mut name = plain.clone();
        for number in 2.. {
            if taken.insert(name.clone()) {
                break;
            }
            name = format!("{plain}-{number}");
        }
        if let Some(text) = run.poses.as_ref().and_then(surveyed) {
            trajectories.push(Trajectory { file: format!("{name}.survey.tum"), text });
        }
        if let (Some(log), Some(odometry)) = (&run.encoders, &dataset.campaign.odometry) {
            trajectories.push(Trajectory { file: format!("{name}.odometry.tum"), text: reckoned(log, odometry) });
        }
    }
    trajectories
}

fn surveyed(log: &PoseLog) -> Option<String> {
    let mut text = String::new();
    for (time, pose) in log.time.iter().zip(&log.poses) {
        if let Some(heading) = pose.heading {
            line(&mut text, *time, Pose2::new(pose.x, pose.y, heading));
        }
    }
    (!text.is_empty()).then_some(text)
}

fn reckoned(log: &EncoderLog, odometry: &OdometryParameters) -> String {
    let mut reckoning = DeadReckoning::new(*odometry);
    let mut text = String::new();
    for (row, time) in log.time.iter().enumerate() {
        let [left, right] = log.sides(row, odometry);
        line(&mut text, *time, reckoning.update(left, right));
    }
    text
}

fn line(text: &mut String, time: f64, pose: Pose2) {
    let (z, w) = (0.5 * pose.heading).sin_cos();
    let _ = writeln!(text, "{time} {} {} 0 0 0 {z} {w}", pose.x, pose.y);
}
