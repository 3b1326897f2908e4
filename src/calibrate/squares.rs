//! What the square methods share: α and β of each side's centres of gravity, and E_s of the straights.

use super::end_points::{CentreOfGravity, SquareErrors};
use super::error::CalibrateError;
use super::estimate::Estimate;
use super::training::Training;
use crate::dataset::{Protocol, Rotation};

/// Centres of gravity of one side length, both ways round.
pub(super) struct Clusters {
    /// L \[m\].
    pub side: f64,
    pub cw: CentreOfGravity,
    pub ccw: CentreOfGravity,
}

/// The clusters of every side length that was driven both ways round.
pub(super) fn clusters(training: &Training) -> Result<Vec<Clusters>, CalibrateError> {
    let groups = SquareErrors::of(training);
    let found: Vec<Clusters> = groups
        .iter()
        .filter_map(|group| Some(Clusters { side: group.side, cw: group.cw_centre()?, ccw: group.ccw_centre()? }))
        .collect();
    if !found.is_empty() {
        return Ok(found);
    }
    let dataset = training.name.clone();
    Err(match groups.first() {
        None => CalibrateError::NoSquares { dataset },
        Some(group) => {
            let direction = if group.cw.is_empty() { Rotation::Clockwise } else { Rotation::CounterClockwise };
            CalibrateError::OneDirection { dataset, side: group.side, direction }
        }
    })
}

/// α: heading lost a 90° turn; β: heading gained a side \[rad\] (science note 1, left positive).
pub(super) struct Angles {
    pub alpha: f64,
    pub beta: f64,
}

impl Clusters {
    /// From the x errors [Borenstein & Feng 1996, eqs 15, 16].
    pub(super) fn angles_from_x(&self) -> Angles {
        let l = self.side;
        Angles { alpha: (self.cw.x + self.ccw.x) / (-4.0 * l), beta: (self.cw.x - self.ccw.x) / (-4.0 * l) }
    }

    /// From the y errors.
    pub(super) fn angles_from_y(&self) -> Angles {
        let l = self.side;
        Angles { alpha: (self.cw.y - self.ccw.y) / (-4.0 * l), beta: (self.cw.y + self.ccw.y) / (-4.0 * l) }
    }

    /// From the end headings, exactly for turns on the spot.
    pub(super) fn angles_from_headings(&self, dataset: &str) -> Result<Angles, CalibrateError> {
        match (self.cw.heading, self.ccw.heading) {
            (Some(cw), Some(ccw)) => Ok(Angles { alpha: (cw - ccw) / 8.0, beta: (cw + ccw) / 8.0 }),
            _ => Err(CalibrateError::NoHeadings { dataset: dataset.to_owned() }),
        }
    }
}

/// Applies `method` to every side's clusters and takes the mean, weighted with the number of runs.
pub(super) fn over_sides(
    training: &Training,
    distance_scale: Option<f64>,
    method: impl Fn(&Clusters) -> Result<(f64, f64), CalibrateError>,
) -> Result<Estimate, CalibrateError> {
    let (mut diameter_ratio, mut track_ratio, mut weights) = (0.0, 0.0, 0.0);
    for clusters in clusters(training)? {
        let weight = (clusters.cw.runs + clusters.ccw.runs) as f64;
        let (e_d, e_b) = method(&clusters)?;
        diameter_ratio += weight * e_d;
        track_ratio += weight * e_b;
        weights += weight;
    }
    Ok(Estimate::of_values(diameter_ratio / weights, track_ratio / weights, distance_scale))
}

/// E_s: surveyed over dead-reckoned length of the straights; `None` where none was driven.
pub(super) fn scale_of_straights(training: &Training) -> Option<f64> {
    let straights = training.runs.iter().filter(|run| matches!(run.protocol, Protocol::Straight { .. }));
    let (surveyed, believed) = straights.fold((0.0, 0.0), |(surveyed, believed), run| {
        // The chord is as long as the straight to second order in the heading gained.
        let reckoned = run.path.end(&training.odometry);
        (surveyed + run.surveyed.x.hypot(run.surveyed.y), believed + reckoned.x.hypot(reckoned.y))
    });
    (believed > 0.0).then(|| surveyed / believed)
}

/// A value that a published formula holds for.
pub(super) fn within(
    training: &Training,
    quantity: &'static str,
    value: f64,
    limit: f64,
) -> Result<f64, CalibrateError> {
    if value.abs() < limit {
        Ok(value)
    } else {
        Err(CalibrateError::OutOfRange { dataset: training.name.clone(), quantity, value, limit })
    }
}

/// E_d = (R + b/2)/(R − b/2) with R = (L/2)/sin(β/2) [Borenstein & Feng 1996, eqs 17, 18], written over 1/R so that a
/// straight side needs no special case.
pub(super) fn diameter_ratio(training: &Training, beta: f64, side: f64) -> Result<f64, CalibrateError> {
    let beta = within(training, "β [rad]", beta, std::f64::consts::PI)?;
    let ratio = training.odometry.track_width / side * (0.5 * beta).sin();
    let ratio = within(training, "b/2R", ratio, 1.0)?;
    Ok((1.0 + ratio) / (1.0 - ratio))
}
