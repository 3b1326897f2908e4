//! Antonelli, Chiaverini & Fusco, "A calibration method for odometry of mobile robots based on the least-squares
//! technique", *IEEE Trans. Robotics* 21 (2005) 994–1004.
//!
//! v = c11·ω_R + c12·ω_L, ω = c21·ω_R + c22·ω_L: headings are linear in c21, c22 and are fitted first; with the headings
//! that follow, positions are linear in c11, c12. Four unknowns where a differential drive has three: E_d is that of the
//! headings, the scale that of the positions.

use super::Method;
use super::error::CalibrateError;
use super::estimate::Estimate;
use super::logs::logged_runs;
use super::training::Training;
use nalgebra::{Matrix2, Vector2};

pub(super) const METHOD: Method = Method {
    name: "antonelli2005",
    source: "Antonelli, Chiaverini & Fusco 2005, linear least squares on logs",
    needs: "encoder logs and surveyed headings; poses on the way are used where there are any",
    blind_to: "where the tracked point is on the robot; clock offsets; outliers",
    estimate,
};

/// Normal equations of two unknowns.
#[derive(Default)]
struct Normal {
    matrix: Matrix2<f64>,
    right: Vector2<f64>,
}

impl Normal {
    fn add(&mut self, row: Vector2<f64>, value: f64) {
        self.matrix += row * row.transpose();
        self.right += row * value;
    }

    fn solve(&self, training: &Training) -> Result<Vector2<f64>, CalibrateError> {
        let singular = || CalibrateError::Singular { dataset: training.name.clone() };
        let inverse = self.matrix.try_inverse().ok_or_else(singular)?;
        let solution = inverse * self.right;
        if solution.iter().all(|value| value.is_finite()) { Ok(solution) } else { Err(singular()) }
    }
}

fn estimate(training: &Training) -> Result<Estimate, CalibrateError> {
    let runs = logged_runs(training)?;
    // Headings: θ_k = c21 Σω_R + c22 Σω_L (their eq 12).
    let mut headings = Normal::default();
    for run in &runs {
        for (time, pose) in &run.poses[1..] {
            let [left, right] = run.wheels_at(*time);
            headings.add(Vector2::new(right, left), pose.heading);
        }
    }
    let c2 = headings.solve(training)?;
    // Positions, on those headings: x_k = Σ cos θ (c11 ω_R + c12 ω_L), y_k = Σ sin θ (…) (their eq 16).
    let mut positions = Normal::default();
    for run in &runs {
        let (mut heading, mut x, mut y) = (0.0, Vector2::zeros(), Vector2::zeros());
        for pair in run.poses.windows(2) {
            let ((from, _), (to, pose)) = (pair[0], pair[1]);
            for [left, right] in run.steps(from, to) {
                let wheels = Vector2::new(right, left);
                let turn = c2.dot(&wheels);
                let (sin, cos) = f64::sin_cos(heading + 0.5 * turn);
                x += wheels * cos;
                y += wheels * sin;
                heading += turn;
            }
            positions.add(x, pose.x);
            positions.add(y, pose.y);
        }
    }
    let c1 = positions.solve(training)?;
    // r_R/r_L = −c21/c22; mean radius c11 + c12; b from ω = (r_R ω_R − r_L ω_L)/b.
    let odometry = &training.odometry;
    let diameter_ratio = -c2[0] / c2[1];
    let mean_radius = c1[0] + c1[1];
    let right_radius = mean_radius * 2.0 * diameter_ratio / (1.0 + diameter_ratio);
    let track_width = right_radius / c2[0];
    if [diameter_ratio, mean_radius, track_width].iter().any(|value| value.is_nan() || *value <= 0.0) {
        return Err(CalibrateError::Singular { dataset: training.name.clone() });
    }
    Ok(Estimate::of_values(
        diameter_ratio * odometry.left_wheel_radius / odometry.right_wheel_radius,
        track_width / odometry.track_width,
        Some(2.0 * mean_radius / (odometry.left_wheel_radius + odometry.right_wheel_radius)),
    ))
}
