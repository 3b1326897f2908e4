//! End-point errors of square runs and their centres of gravity.

use super::error::CalibrateError;
use crate::dataset::{Dataset, Protocol, Rotation, Run};
use crate::odometry::OdometryParameters;

/// Errors (surveyed − dead-reckoned end pose, in the frame of the surveyed start) of the squares of one side length.
#[derive(Debug, Clone, PartialEq)]
pub struct SquareErrors {
    /// \[m\]
    pub side: f64,
    /// Clockwise runs, in file order.
    pub cw: Vec<EndError>,
    /// Counter-clockwise runs, in file order.
    pub ccw: Vec<EndError>,
}

/// One run's error; the heading may not have been measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndError {
    /// \[m\]
    pub x: f64,
    /// \[m\]
    pub y: f64,
    /// \[rad\]
    pub heading: Option<f64>,
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
    /// Errors of the surveyed squares in `dataset`, a group a side length, shortest first.
    ///
    /// # Errors
    /// The dataset does not say what the odometry believed.
    pub fn of(dataset: &Dataset) -> Result<Vec<SquareErrors>, CalibrateError> {
        let odometry = odometry(dataset)?;
        let mut groups: Vec<SquareErrors> = Vec::new();
        for run in &dataset.runs {
            let Protocol::Square { side, direction } = run.protocol else { continue };
            let Some(error) = end_error(run, odometry) else { continue };
            let index = groups.iter().position(|group| group.side == side).unwrap_or_else(|| {
                groups.push(SquareErrors { side, cw: Vec::new(), ccw: Vec::new() });
                groups.len() - 1
            });
            match direction {
                Rotation::Clockwise => groups[index].cw.push(error),
                Rotation::CounterClockwise => groups[index].ccw.push(error),
            }
        }
        groups.sort_by(|one, other| one.side.total_cmp(&other.side));
        Ok(groups)
    }

    /// Centre of gravity of the clockwise runs; `None` where there are none.
    pub fn cw_centre(&self) -> Option<CentreOfGravity> {
        CentreOfGravity::of(&self.cw)
    }

    /// Centre of gravity of the counter-clockwise runs; `None` where there are none.
    pub fn ccw_centre(&self) -> Option<CentreOfGravity> {
        CentreOfGravity::of(&self.ccw)
    }
}

impl CentreOfGravity {
    fn of(errors: &[EndError]) -> Option<CentreOfGravity> {
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

/// What the robot of `dataset` believed.
pub(super) fn odometry(dataset: &Dataset) -> Result<&OdometryParameters, CalibrateError> {
    dataset
        .campaign
        .odometry
        .as_ref()
        .ok_or_else(|| CalibrateError::NoOdometry { dataset: dataset.campaign.name.clone() })
}

fn end_error(run: &Run, odometry: &OdometryParameters) -> Option<EndError> {
    let surveyed = run.end?;
    let believed = run.dead_reckoned_end(odometry)?;
    Some(EndError {
        x: surveyed.x - believed.x,
        y: surveyed.y - believed.y,
        heading: surveyed.heading.map(|heading| heading - believed.heading),
    })
}
