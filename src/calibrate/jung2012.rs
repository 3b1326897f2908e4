//! Jung & Chung, "Calibration of kinematic parameters for two wheel differential mobile robots by using experimental
//! heading errors", 2011/2012: UMBmark's angles from the end headings, with the coupling α_d = πbβ/(4L).
//!
//! E_b = (π/2)/(π/2 − (α + α_d)) as science note 1 quotes it. For turns on the spot the coupling term does not belong
//! there; it is small where β is.

use super::Method;
use super::squares::{Angles, diameter_ratio, over_sides, within};
use std::f64::consts::{FRAC_PI_2, PI};

pub(super) const METHOD: Method = Method {
    name: "jung2012",
    source: "Jung & Chung 2012, from end headings",
    needs: "squares both ways round with end headings",
    blind_to: "E_s; positions",
    estimate: |training| {
        over_sides(training, None, |clusters| {
            let Angles { alpha, beta } = clusters.angles_from_headings(&training.name)?;
            let e_d = diameter_ratio(training, beta, clusters.side)?;
            let alpha_d = PI * training.odometry.track_width / (4.0 * clusters.side) * beta;
            let lost = within(training, "α + α_d [rad]", alpha + alpha_d, FRAC_PI_2)?;
            Ok((e_d, FRAC_PI_2 / (FRAC_PI_2 - lost)))
        })
    },
};
