//! UMBmark as published, from the x errors [Borenstein & Feng, "Measurement and correction of systematic odometry
//! errors in mobile robots", *IEEE Trans. Robotics and Automation* 12 (1996) 869–880].
//!
//! Needs squares of one side both ways round; headings are not used. Cannot see the distance scale E_s, which it assumes
//! to be known from a tape-measured straight; is first order in small angles, so that one pass leaves an error of second
//! order: with E_b = 1.45 it returns 1.03.

use super::end_points::{CentreOfGravity, SquareErrors, odometry};
use super::error::CalibrateError;
use crate::dataset::{Dataset, Rotation};
use crate::odometry::OdometryCorrection;
use std::f64::consts::{FRAC_PI_2, PI};

/// The correction of E_d and E_b from the squares of `side` \[m\] in `dataset`.
///
/// # Errors
/// The dataset lacks what the robot believed or one direction, or its errors are beyond the formulae.
pub fn umbmark(dataset: &Dataset, side: f64) -> Result<OdometryCorrection, CalibrateError> {
    let name = || dataset.campaign.name.clone();
    let missing = |direction| CalibrateError::OneDirection { dataset: name(), side, direction };
    let groups = SquareErrors::of(dataset)?;
    let group = groups.iter().find(|group| group.side == side);
    let cw = group.and_then(SquareErrors::cw_centre).ok_or_else(|| missing(Rotation::Clockwise))?;
    let ccw = group.and_then(SquareErrors::ccw_centre).ok_or_else(|| missing(Rotation::CounterClockwise))?;
    let b = odometry(dataset)?.track_width;
    from_centres(&cw, &ccw, side, b).map_err(|(quantity, value, limit)| CalibrateError::OutOfRange {
        dataset: name(),
        quantity,
        value,
        limit,
    })
}

/// The published equations on two centres of gravity, for side L and nominal track b \[m\].
fn from_centres(
    cw: &CentreOfGravity,
    ccw: &CentreOfGravity,
    l: f64,
    b: f64,
) -> Result<OdometryCorrection, (&'static str, f64, f64)> {
    // α: heading lost per 90° turn; β: heading gained per side (their eqs 15, 16, in radians).
    let alpha = (cw.x + ccw.x) / (-4.0 * l);
    let beta = (cw.x - ccw.x) / (-4.0 * l);
    if alpha.abs() >= FRAC_PI_2 {
        return Err(("|α| [rad]", alpha.abs(), FRAC_PI_2));
    }
    if beta.abs() >= PI {
        return Err(("|β| [rad]", beta.abs(), PI));
    }
    // E_d = (R + b/2)/(R − b/2) with the radius R = (L/2)/sin(β/2) of the bent side (eqs 17, 18), written over 1/R so
    // that a straight side needs no special case.
    let half_track_over_radius = b / l * (0.5 * beta).sin();
    if half_track_over_radius.abs() >= 1.0 {
        return Err(("|b/2R|", half_track_over_radius.abs(), 1.0));
    }
    Ok(OdometryCorrection {
        diameter_ratio: (1.0 + half_track_over_radius) / (1.0 - half_track_over_radius),
        // E_b = 90°/(90° − α) (eq 19).
        track_ratio: FRAC_PI_2 / (FRAC_PI_2 - alpha),
        distance_scale: 1.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// First-order end points of α, β (science note 1) give them back, and E_d, E_b follow the published formulae.
    #[test]
    fn first_order_end_points_return_the_published_values() {
        let (l, b, alpha, beta) = (4.0, 0.34, 0.01, -0.004);
        let centre = |x| CentreOfGravity { x, y: 0.0, heading: None, runs: 5 };
        let cw = centre(-2.0 * l * (alpha + beta));
        let ccw = centre(-2.0 * l * (alpha - beta));
        let found = from_centres(&cw, &ccw, l, b).expect("small errors");
        let r = (l / 2.0) / f64::sin(beta / 2.0);
        assert!((found.diameter_ratio - (r + b / 2.0) / (r - b / 2.0)).abs() < 1e-12);
        assert!((found.track_ratio - 90.0 / (90.0 - alpha.to_degrees())).abs() < 1e-12);
        assert_eq!(found.distance_scale, 1.0);
    }
}
