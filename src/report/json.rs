//! The JSON of each command. Keys carry their units; they are part of the interface.

use crate::calibrate::CentreOfGravity;
use crate::drive::SimulatedRun;
use crate::experiment::{Experiment, MethodResult, SideResult, Stage};
use crate::geometry::Pose2;
use crate::odometry::OdometryCorrection;
use serde::Serialize;

/// A planar pose.
#[derive(Debug, Clone, Serialize)]
pub struct PoseJson {
    x_m: f64,
    y_m: f64,
    heading_rad: f64,
}

/// `drive --json`.
#[derive(Debug, Clone, Serialize)]
pub struct DriveJson {
    actual: PoseJson,
    odometry: PoseJson,
    simulated_s: f64,
    wall_s: f64,
    steps: u64,
}

/// A centre of gravity of end-point errors.
#[derive(Debug, Clone, Serialize)]
pub struct CentreJson {
    x_m: f64,
    y_m: f64,
    heading_rad: Option<f64>,
    r_m: f64,
}

/// The squares of one side length.
#[derive(Debug, Clone, Serialize)]
pub struct SideJson {
    side_m: f64,
    cw: CentreJson,
    ccw: CentreJson,
    e_max_syst_m: f64,
}

/// Corrections to what the robot believed.
#[derive(Debug, Clone, Serialize)]
pub struct EstimateJson {
    diameter_ratio: f64,
    track_ratio: f64,
    distance_scale: f64,
}

/// One method calibrated on one side.
#[derive(Debug, Clone, Serialize)]
pub struct MethodJson {
    method: &'static str,
    calibrated_on_side_m: f64,
    estimate: EstimateJson,
    after: Vec<SideJson>,
    improvement: Option<f64>,
}

/// `experiment --json`.
#[derive(Debug, Clone, Serialize)]
pub struct ExperimentJson {
    robot: String,
    seed: u64,
    before: Vec<SideJson>,
    methods: Vec<MethodJson>,
}

impl From<Pose2> for PoseJson {
    fn from(pose: Pose2) -> Self {
        PoseJson { x_m: pose.x, y_m: pose.y, heading_rad: pose.heading }
    }
}

impl From<&SimulatedRun> for DriveJson {
    fn from(run: &SimulatedRun) -> Self {
        DriveJson {
            actual: run.actual.into(),
            odometry: run.odometry.into(),
            simulated_s: run.simulated,
            wall_s: run.wall.as_secs_f64(),
            steps: run.steps,
        }
    }
}

impl From<&CentreOfGravity> for CentreJson {
    fn from(centre: &CentreOfGravity) -> Self {
        CentreJson { x_m: centre.x, y_m: centre.y, heading_rad: centre.heading, r_m: centre.distance() }
    }
}

impl From<&SideResult> for SideJson {
    fn from(side: &SideResult) -> Self {
        SideJson { side_m: side.side, cw: (&side.cw).into(), ccw: (&side.ccw).into(), e_max_syst_m: side.e_max_syst() }
    }
}

impl From<&OdometryCorrection> for EstimateJson {
    fn from(estimate: &OdometryCorrection) -> Self {
        EstimateJson {
            diameter_ratio: estimate.diameter_ratio,
            track_ratio: estimate.track_ratio,
            distance_scale: estimate.distance_scale,
        }
    }
}

impl ExperimentJson {
    /// The JSON of `experiment` driven by `robot` with `seed`.
    pub fn new(robot: &str, seed: u64, experiment: &Experiment) -> Self {
        let sides = |stage: &Stage| stage.sides.iter().map(SideJson::from).collect();
        let method = |result: &MethodResult| MethodJson {
            method: result.method,
            calibrated_on_side_m: result.calibrated_on_side,
            estimate: (&result.estimate.correction()).into(),
            after: sides(&result.after),
            improvement: result.improvement(&experiment.before),
        };
        ExperimentJson {
            robot: robot.to_owned(),
            seed,
            before: sides(&experiment.before),
            methods: experiment.methods.iter().map(method).collect(),
        }
    }
}
