//! Datasets as a method sees them: for each run what the wheels did, where the survey says it ended, and where the robot
//! believed it was.

use super::error::CalibrateError;
use crate::dataset::{Dataset, EncoderLog, Protocol, Run, SurveyedPose};
use crate::geometry::Pose2;
use crate::odometry::{OdometryCorrection, OdometryParameters};
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Wheel rotation that is merged into one arc of the path \[rad\]: at constant curvature merging is exact, and within a
/// ramp of a turn it moves an end point by less than a micrometre.
const MERGED: f64 = 0.1;

/// Runs to calibrate on, or to predict. Cheap to clone and to cut into folds.
#[derive(Debug, Clone)]
pub struct Training {
    /// Name of the first dataset, for messages.
    pub name: String,
    /// What the first dataset's robot believed; corrections are to this.
    pub odometry: OdometryParameters,
    /// The runs that have a surveyed end.
    pub runs: Vec<Arc<Observation>>,
}

/// One run.
#[derive(Debug)]
pub struct Observation {
    /// Name of its dataset and of the run.
    pub name: String,
    /// Which dataset it came from.
    pub dataset: usize,
    /// What was driven.
    pub protocol: Protocol,
    /// Surveyed end in the frame of the surveyed start.
    pub surveyed: SurveyedPose,
    /// Survey σ of its dataset: position \[m\], heading \[rad\].
    pub survey_std: [f64; 2],
    /// What its robot believed.
    pub odometry: OdometryParameters,
    /// End by dead reckoning with what its robot believed.
    pub believed: Pose2,
    /// What the wheels did.
    pub path: WheelPath,
    /// The run as it stands in the dataset, for methods that use its logs.
    pub run: Run,
}

/// Rotation of the left and right wheels, arc by arc \[rad\], and a rest that no arc explains.
#[derive(Debug, Clone, PartialEq)]
pub struct WheelPath {
    arcs: Vec<[f64; 2]>,
    /// Believed end as stated, seen from the protocol's own end.
    rest: Pose2,
}

impl WheelPath {
    /// Dead reckoning with `parameters`.
    pub fn end(&self, parameters: &OdometryParameters) -> Pose2 {
        let end = self.arcs.iter().fold(Pose2::IDENTITY, |pose, [left, right]| parameters.advance(pose, *left, *right));
        end.compose(self.rest)
    }

    /// The same, and how it changes with the left and the right radius and the track: a column each of x, y and heading.
    ///
    /// An arc of length s that turns by θ goes (s sin θ/θ, s (1 − cos θ)/θ) ahead and to the left; the chain is differentiated as it
    /// is followed.
    pub(super) fn end_and_change(&self, parameters: &OdometryParameters) -> (Pose2, Matrix3<f64>) {
        let OdometryParameters { left_wheel_radius, right_wheel_radius, track_width, .. } = *parameters;
        let (mut pose, mut change) = (Pose2::IDENTITY, Matrix3::zeros());
        let mut follow =
            |pose: &mut Pose2, ahead: [f64; 2], by: [Vector3<f64>; 2], turn: f64, turn_by: Vector3<f64>| {
                let (sin, cos) = pose.heading.sin_cos();
                let turned: Vector3<f64> = change.row(2).transpose();
                let x = by[0] * cos - by[1] * sin - turned * (sin * ahead[0] + cos * ahead[1]);
                let y = by[0] * sin + by[1] * cos + turned * (cos * ahead[0] - sin * ahead[1]);
                change += Matrix3::from_rows(&[x.transpose(), y.transpose(), turn_by.transpose()]);
                *pose = pose.compose(Pose2::new(ahead[0], ahead[1], turn));
            };
        for &[left, right] in &self.arcs {
            let (l, r) = (left * left_wheel_radius, right * right_wheel_radius);
            let (s, turn) = (0.5 * (l + r), (r - l) / track_width);
            let s_by = Vector3::new(0.5 * left, 0.5 * right, 0.0);
            let turn_by = Vector3::new(-left, right, -turn) / track_width;
            let (sin, cos) = turn.sin_cos();
            let (a, b, a_by, b_by) = if turn.abs() < 1e-3 {
                (1.0 - turn * turn / 6.0, turn / 2.0, -turn / 3.0, 0.5 - turn * turn / 8.0)
            } else {
                let (a, b) = (sin / turn, (1.0 - cos) / turn);
                (a, b, (cos - a) / turn, (sin - b) / turn)
            };
            let by = [s_by * a + turn_by * (s * a_by), s_by * b + turn_by * (s * b_by)];
            follow(&mut pose, [a * s, b * s], by, turn, turn_by);
        }
        let rest = self.rest;
        let none = Vector3::zeros();
        follow(&mut pose, [rest.x, rest.y], [none, none], rest.heading, none);
        (pose, change)
    }

    /// Every pose on the way with the rotation that led to it.
    pub fn poses<'a>(&'a self, parameters: &'a OdometryParameters) -> impl Iterator<Item = (Pose2, [f64; 2])> + 'a {
        self.arcs.iter().scan(Pose2::IDENTITY, move |pose, arc| {
            *pose = parameters.advance(*pose, arc[0], arc[1]);
            Some((*pose, *arc))
        })
    }

    fn of_log(log: &EncoderLog, odometry: &OdometryParameters) -> WheelPath {
        let mut arcs: Vec<[f64; 2]> = Vec::new();
        let mut last: Option<[f64; 2]> = None;
        for row in 0..log.len() {
            let now = log.sides(row, odometry);
            if let Some(before) = last {
                let step = [now[0] - before[0], now[1] - before[1]];
                match arcs.last_mut().filter(|arc| mergeable(arc, &step)) {
                    Some(arc) => *arc = [arc[0] + step[0], arc[1] + step[1]],
                    None => arcs.push(step),
                }
            }
            last = Some(now);
        }
        WheelPath { arcs, rest: Pose2::IDENTITY }
    }

    /// What the wheels did if the robot drove until its odometry closed the protocol, or ended where it says.
    fn of_protocol(run: &Run, odometry: &OdometryParameters) -> Option<WheelPath> {
        let along = |way: f64, turn: f64| {
            let half = 0.5 * odometry.track_width * turn;
            [(way - half) / odometry.left_wheel_radius, (way + half) / odometry.right_wheel_radius]
        };
        let arcs = match run.protocol {
            Protocol::Square { side, direction } => {
                let turn = direction.sign() * FRAC_PI_2;
                (0..4).flat_map(|_| [along(side, 0.0), along(0.0, turn)]).collect()
            }
            Protocol::Straight { length, direction } => vec![along(direction.sign() * length, 0.0)],
            Protocol::Spin { turn, direction } => vec![along(0.0, direction.sign() * turn)],
            Protocol::Circle { radius, turn: Some(turn), direction } => {
                vec![along(radius * turn, direction.sign() * turn)]
            }
            Protocol::Circle { turn: None, .. } | Protocol::Path => return None,
        };
        let nominal = run.protocol.nominal_end()?;
        let rest = nominal.relative(run.dead_reckoned_end(odometry)?);
        Some(WheelPath { arcs, rest })
    }
}

/// Small steps of the same kind of motion are merged: both in the same sense.
fn mergeable(arc: &[f64; 2], step: &[f64; 2]) -> bool {
    let small = arc.iter().chain(step).all(|rotation| rotation.abs() < MERGED);
    small && arc[0] * step[0] >= 0.0 && arc[1] * step[1] >= 0.0
}

impl Training {
    /// The surveyed runs of `datasets`, which may have driven with different beliefs.
    ///
    /// # Errors
    /// No dataset, one without what the robot believed, or no surveyed run at all.
    pub fn new(datasets: &[Dataset]) -> Result<Training, CalibrateError> {
        let first = datasets.first().ok_or(CalibrateError::NoRuns { dataset: "none".to_owned() })?;
        let mut runs = Vec::new();
        for (index, dataset) in datasets.iter().enumerate() {
            let odometry = odometry(dataset)?;
            let survey = &dataset.campaign.survey;
            let survey_std = [survey.position_std.unwrap_or(0.0), survey.heading_std.unwrap_or(0.0)];
            runs.extend(dataset.runs.iter().filter_map(|run| {
                let path = match run.encoders.as_ref().filter(|log| !log.is_empty()) {
                    Some(log) => WheelPath::of_log(log, odometry),
                    None => WheelPath::of_protocol(run, odometry)?,
                };
                Some(Arc::new(Observation {
                    name: format!("{}/{}", dataset.campaign.name, run.name),
                    dataset: index,
                    protocol: run.protocol,
                    surveyed: run.end?,
                    survey_std,
                    odometry: *odometry,
                    believed: run.dead_reckoned_end(odometry)?,
                    path,
                    run: run.clone(),
                }))
            }));
        }
        let name = first.campaign.name.clone();
        if runs.is_empty() {
            return Err(CalibrateError::NoRuns { dataset: name });
        }
        Ok(Training { name, odometry: *odometry(first)?, runs })
    }

    /// The same with the runs that `keep` says.
    pub fn only(&self, keep: impl Fn(usize, &Observation) -> bool) -> Training {
        let runs = self.runs.iter().enumerate().filter(|(index, run)| keep(*index, run)).map(|(_, run)| run.clone());
        Training { runs: runs.collect(), ..self.clone() }
    }
}

impl Training {
    /// The same runs as a robot with these errors would end them, without noise: end poses alone.
    pub(super) fn noise_free(&self, truth: &OdometryCorrection) -> Training {
        let actual = self.odometry.corrected(truth);
        let runs = self.runs.iter().map(|run| {
            Arc::new(Observation {
                name: run.name.clone(),
                surveyed: run.path.end(&actual).into(),
                path: run.path.clone(),
                run: Run { poses: None, ..run.run.clone() },
                ..**run
            })
        });
        Training { runs: runs.collect(), ..self.clone() }
    }
}

impl Observation {
    /// Surveyed − predicted with `correction` to what `reference` believed: x, y \[m\], heading \[rad\].
    pub fn error(&self, reference: &OdometryParameters, correction: &OdometryCorrection) -> SurveyedPose {
        let predicted = self.path.end(&reference.corrected(correction));
        SurveyedPose {
            x: self.surveyed.x - predicted.x,
            y: self.surveyed.y - predicted.y,
            heading: self.surveyed.heading.map(|heading| heading - predicted.heading),
        }
    }

    /// Surveyed − dead-reckoned with what its own robot believed.
    pub fn believed_error(&self) -> SurveyedPose {
        SurveyedPose {
            x: self.surveyed.x - self.believed.x,
            y: self.surveyed.y - self.believed.y,
            heading: self.surveyed.heading.map(|heading| heading - self.believed.heading),
        }
    }
}

/// What the robot of `dataset` believed.
fn odometry(dataset: &Dataset) -> Result<&OdometryParameters, CalibrateError> {
    dataset
        .campaign
        .odometry
        .as_ref()
        .ok_or_else(|| CalibrateError::NoOdometry { dataset: dataset.campaign.name.clone() })
}
