//! Censi, Franchi, Marchionni & Oriolo, "Simultaneous calibration of odometry and sensor parameters for mobile robots",
//! *IEEE Trans. Robotics* 29 (2013) 475–492.
//!
//! Between two surveyed poses the sensor moved by s and the robot by q: ℓ ⊕ s = q ⊕ ℓ for the sensor's pose ℓ on the
//! robot. Headings give J21 = −r_L/b and J22 = r_R/b by linear least squares; then b and ℓ follow from a least-squares
//! problem that is linear in (b, ℓ_x, ℓ_y, cos ℓ_θ, sin ℓ_θ) under cos² + sin² = 1. The worst intervals are trimmed and the
//! fit repeated. Only relative poses are used, so that noise of a run's start stays in its first interval.

use super::Method;
use super::error::CalibrateError;
use super::estimate::Estimate;
use super::logs::logged_runs;
use super::training::Training;
use crate::geometry::Pose2;
use nalgebra::{Matrix2, Matrix3, Matrix3x2, SMatrix, SVector, Vector2};

pub(super) const METHOD: Method = Method {
    name: "censi2013",
    source: "Censi, Franchi, Marchionni & Oriolo 2013, sensor's pose on the robot unknown, outliers trimmed",
    needs: "encoder logs and surveyed poses, best many on the way",
    blind_to: "clock offsets",
    estimate,
};

/// Share of the intervals that is trimmed in each round, and how often (their section V-G).
const TRIMMED: f64 = 0.02;
const ROUNDS: usize = 4;

/// One interval between surveyed poses.
struct Interval {
    steps: Vec<[f64; 2]>,
    left: f64,
    right: f64,
    /// Motion of the sensor.
    sensor: Pose2,
}

struct Fit {
    j21: f64,
    j22: f64,
    track_width: f64,
    /// (ℓ_x, ℓ_y, cos ℓ_θ, sin ℓ_θ)
    lever: SVector<f64, 4>,
}

fn estimate(training: &Training) -> Result<Estimate, CalibrateError> {
    let singular = || CalibrateError::Singular { dataset: training.name.clone() };
    let mut intervals: Vec<Interval> = Vec::new();
    for run in logged_runs(training)? {
        for pair in run.poses.windows(2) {
            let ((from, before), (to, after)) = (pair[0], pair[1]);
            let steps = run.steps(from, to);
            let (left, right) = steps.iter().fold((0.0, 0.0), |(left, right), step| (left + step[0], right + step[1]));
            intervals.push(Interval { left, right, steps, sensor: before.relative(after) });
        }
    }
    let mut solution = fit(&intervals).ok_or_else(singular)?;
    for _ in 0..ROUNDS {
        let keep = ((1.0 - TRIMMED) * intervals.len() as f64).ceil() as usize;
        if keep < 8 {
            break;
        }
        // A radian weighs as much as the track's half: both are what a wheel that slips would make.
        let weight = 0.5 * solution.track_width;
        let mut ranked: Vec<(f64, Interval)> =
            intervals.into_iter().map(|interval| (misfit(&interval, &solution, weight), interval)).collect();
        ranked.sort_by(|(one, _), (other, _)| one.total_cmp(other));
        intervals = ranked.into_iter().take(keep).map(|(_, interval)| interval).collect();
        solution = fit(&intervals).ok_or_else(singular)?;
    }
    let Fit { j21, j22, track_width, .. } = solution;
    let (left, right) = (-j21 * track_width, j22 * track_width);
    let odometry = &training.odometry;
    if [left, right, track_width].iter().any(|value| value.is_nan() || *value <= 0.0) {
        return Err(singular());
    }
    Ok(Estimate::of_values(
        (right / left) / (odometry.right_wheel_radius / odometry.left_wheel_radius),
        track_width / odometry.track_width,
        Some((left + right) / (odometry.left_wheel_radius + odometry.right_wheel_radius)),
    ))
}

/// Motion of the robot over an interval for a track of 1 m: the heading is exact, the position scales with the track.
fn motion(interval: &Interval, j21: f64, j22: f64) -> Pose2 {
    interval.steps.iter().fold(Pose2::IDENTITY, |pose, [left, right]| {
        pose.moved(0.5 * (j22 * right - j21 * left), 0.0, j21 * left + j22 * right)
    })
}

/// Rows of the linear problem in (b, ℓ_x, ℓ_y, cos ℓ_θ, sin ℓ_θ): b·q + (R(q_θ) − I)ℓ − R(ℓ_θ)s = 0.
fn rows(motion: Pose2, sensor: Pose2) -> SMatrix<f64, 2, 5> {
    let (sin, cos) = motion.heading.sin_cos();
    SMatrix::<f64, 2, 5>::new(
        motion.x,
        cos - 1.0,
        -sin,
        -sensor.x,
        sensor.y, //
        motion.y,
        sin,
        cos - 1.0,
        -sensor.y,
        -sensor.x,
    )
}

fn fit(intervals: &[Interval]) -> Option<Fit> {
    let (mut matrix, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for interval in intervals {
        let wheels = Vector2::new(interval.left, interval.right);
        matrix += wheels * wheels.transpose();
        right += wheels * interval.sensor.heading;
    }
    let j = matrix.try_inverse()? * right;
    let mut m = SMatrix::<f64, 5, 5>::zeros();
    for interval in intervals {
        let rows = rows(motion(interval, j[0], j[1]), interval.sensor);
        m += rows.transpose() * rows;
    }
    // For a given direction c = (cos, sin) the rest is −A⁻¹B c; what is left, cᵀ(D − BᵀA⁻¹B)c, is least along the smaller
    // eigenvector.
    let a: Matrix3<f64> = m.fixed_view::<3, 3>(0, 0).into();
    let b: Matrix3x2<f64> = m.fixed_view::<3, 2>(0, 3).into();
    let d: Matrix2<f64> = m.fixed_view::<2, 2>(3, 3).into();
    let rest = a.try_inverse()? * b;
    let eigen = (d - b.transpose() * rest).symmetric_eigen();
    let smaller = if eigen.eigenvalues[0] <= eigen.eigenvalues[1] { 0 } else { 1 };
    let mut direction: Vector2<f64> = eigen.eigenvectors.column(smaller).into();
    // The other sign is the robot seen from behind; a track is positive.
    let mut linear = -(rest * direction);
    if linear[0] < 0.0 {
        direction = -direction;
        linear = -linear;
    }
    let lever = SVector::<f64, 4>::new(linear[1], linear[2], direction[0], direction[1]);
    let fit = Fit { j21: j[0], j22: j[1], track_width: linear[0], lever };
    fit.lever.iter().all(|value| value.is_finite()).then_some(fit)
}

fn misfit(interval: &Interval, fit: &Fit, weight: f64) -> f64 {
    let motion = motion(interval, fit.j21, fit.j22);
    let unknowns = SVector::<f64, 5>::new(fit.track_width, fit.lever[0], fit.lever[1], fit.lever[2], fit.lever[3]);
    let position = rows(motion, interval.sensor) * unknowns;
    position.norm() + weight * (interval.sensor.heading - motion.heading).abs()
}
