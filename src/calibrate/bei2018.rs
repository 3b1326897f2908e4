//! The method of Bei, Ping & Gao, "Calibration of Systematic Errors for Wheeled Mobile Robots": as printed, and as
//! corrected.
//!
//! As printed (eqs 4, 7, 8): α_d = πbβ/(4L), α_s = τ − τ_n = 90°(E_s − 1), α_b = α − (α_d + α_s), E_b = 90°/(90° − α_b).
//!
//! What is wrong with it (science note 1): α counts under-rotation, α_s over-rotation, so that they must be added; and a
//! turn on the spot turns by (π/2)E_s/E_b whatever E_d, so that α_d does not belong there. Corrected: α_b = α + α_s.

use super::Method;
use super::error::CalibrateError;
use super::estimate::Estimate;
use super::squares::{Angles, diameter_ratio, over_sides, scale_of_straights, within};
use super::training::Training;
use std::f64::consts::{FRAC_PI_2, PI};

pub(super) const AS_PRINTED: Method = Method {
    name: "bei2018",
    source: "Bei, Ping & Gao, eqs 1–8 as printed",
    needs: "squares both ways round and a measured straight",
    blind_to: "its own signs: eqs 7 and 8 clash, so an E_s other than 1 is counted twice the wrong way",
    estimate: |training| {
        let b = training.odometry.track_width;
        // eqs 4, 7, 8
        bei(training, |Angles { alpha, beta }, side, e_s| {
            let alpha_d = PI * b / (4.0 * side) * beta;
            let alpha_s = FRAC_PI_2 * (e_s - 1.0);
            alpha - (alpha_d + alpha_s)
        })
    },
};

pub(super) const CORRECTED: Method = Method {
    name: "bei2018_corrected",
    source: "Bei, Ping & Gao with the sign of α_s mended and α_d left out",
    needs: "squares both ways round and a measured straight",
    blind_to: "second order in the errors; headings",
    estimate: |training| bei(training, |Angles { alpha, .. }, _, e_s| alpha + FRAC_PI_2 * (e_s - 1.0)),
};

/// E_d and E_s as in UMBmark and from the straights; E_b from what `alpha_b` makes of α, β, the side and E_s.
fn bei(training: &Training, alpha_b: impl Fn(Angles, f64, f64) -> f64) -> Result<Estimate, CalibrateError> {
    let e_s =
        scale_of_straights(training).ok_or_else(|| CalibrateError::NoStraight { dataset: training.name.clone() })?;
    over_sides(training, Some(e_s), |clusters| {
        let angles = clusters.angles_from_x();
        let e_d = diameter_ratio(training, angles.beta, clusters.side)?;
        let alpha_b = within(training, "α_b [rad]", alpha_b(angles, clusters.side, e_s), FRAC_PI_2)?;
        Ok((e_d, FRAC_PI_2 / (FRAC_PI_2 - alpha_b)))
    })
}
