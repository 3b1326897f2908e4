//! End-point errors of square runs and their centres of gravity.

use super::training::{Observation, Training};
use crate::dataset::{Protocol, Rotation, SurveyedPose};
use crate::odometry::OdometryCorrection;

/// Errors (surveyed − predicted end pose, in the frame of the surveyed start) of the squares of one side length.
#[derive(Debug, Clone, PartialEq)]
pub struct SquareErrors {
    /// \[m\]
    pub side: f64,
    /// Clockwise runs, in file order.
    pub cw: Vec<SurveyedPose>,
    /// Counter-clockwise runs, in file order.
    pub ccw: Vec<SurveyedPose>,
}

/// Mean error of a cluster of runs [Borenstein & Feng 1996, eq 11; Bei et al., eqs 9, 10].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CentreOfGravity {
    /// \[m\]
    pub x: f64,
    /// \[m\]
    pub y: f64,
    /// Over the runs whose heading was measured \[rad\].
    pub heading: Option<f64>,
    /// How many runs.
    pub runs: usize,
}

impl SquareErrors {
    /// Errors against what the training's robot believed (the first dataset's, where several were driven with different
    /// beliefs), a group a side length, shortest first.
    pub fn of(training: &Training) -> Vec<SquareErrors> {
        SquareErrors::by(training, |_, run| run.error(&training.odometry, &OdometryCorrection::IDENTITY))
    }

    /// The squares' errors as `error` makes them of a run and its index, a group a side length, shortest first.
    pub fn by(training: &Training, error: impl Fn(usize, &Observation) -> SurveyedPose) -> Vec<SquareErrors> {
        let mut groups: Vec<SquareErrors> = Vec::new();
        for (number, run) in training.runs.iter().enumerate() {
            let Protocol::Square { side, direction } = run.protocol else { continue };
            let index = groups.iter().position(|group| group.side == side).unwrap_or_else(|| {
                groups.push(SquareErrors { side, cw: Vec::new(), ccw: Vec::new() });
                groups.len() - 1
            });
            let errors = match direction {
                Rotation::Clockwise => &mut groups[index].cw,
                Rotation::CounterClockwise => &mut groups[index].ccw,
            };
            errors.push(error(number, run));
        }
        groups.sort_by(|one, other| one.side.total_cmp(&other.side));
        groups
    }

    /// Centre of gravity of the clockwise runs; `None` where there are none.
    pub fn cw_centre(&self) -> Option<CentreOfGravity> {
        CentreOfGravity::of(&self.cw)
    }

    /// Centre of gravity of the counter-clockwise runs; `None` where there are none.
    pub fn ccw_centre(&self) -> Option<CentreOfGravity> {
        CentreOfGravity::of(&self.ccw)
    }

    /// E_max,syst = max(r_cg,cw, r_cg,ccw) \[m\] [Borenstein & Feng 1996, eq 12; Bei et al., eq 11]; `None` where a
    /// direction is missing.
    #[doc(alias = "E_max,syst")]
    pub fn e_max_syst(&self) -> Option<f64> {
        Some(self.cw_centre()?.distance().max(self.ccw_centre()?.distance()))
    }
}

impl CentreOfGravity {
    fn of(errors: &[SurveyedPose]) -> Option<CentreOfGravity> {
        if errors.is_empty() {
            return None;
        }
        let mean = |values: &mut dyn Iterator<Item = f64>| {
            let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| (sum + value, count + 1));
            (count > 0).then(|| sum / count as f64)
        };
        Some(CentreOfGravity {
            x: mean(&mut errors.iter().map(|error| error.x))?,
            y: mean(&mut errors.iter().map(|error| error.y))?,
            heading: mean(&mut errors.iter().filter_map(|error| error.heading)),
            runs: errors.len(),
        })
    }

    /// r_cg = √(x² + y²) \[m\] (Bei et al., eqs 9, 10).
    #[doc(alias = "r_cg")]
    pub fn distance(&self) -> f64 {
        self.x.hypot(self.y)
    }
}
