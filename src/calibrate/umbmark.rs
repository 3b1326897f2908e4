//! UMBmark [Borenstein & Feng, "Measurement and correction of systematic odometry errors in mobile robots", *IEEE Trans.
//! Robotics and Automation* 12 (1996) 869–880]: from the x errors as published, from the y errors, and from both.
//!
//! First order in small angles: one pass leaves an error of second order, and with E_b = 1.45 the x form returns 1.03, the
//! y form 2.04. E_s is assumed to be 1, or known.

use super::Method;
use super::error::CalibrateError;
use super::estimate::Estimate;
use super::squares::{Angles, Clusters, diameter_ratio, over_sides, within};
use super::training::Training;
use std::f64::consts::FRAC_PI_2;

pub(super) const FROM_X: Method = Method {
    name: "umbmark",
    source: "Borenstein & Feng 1996, from x errors",
    needs: "squares both ways round",
    blind_to: "E_s; second order in the errors; headings",
    estimate: |training| umbmark(training, Clusters::angles_from_x),
};

pub(super) const FROM_Y: Method = Method {
    name: "umbmark_y",
    source: "Borenstein & Feng 1996, from y errors",
    needs: "squares both ways round",
    blind_to: "E_s; second order in the errors; headings",
    estimate: |training| umbmark(training, Clusters::angles_from_y),
};

pub(super) const FROM_XY: Method = Method {
    name: "umbmark_xy",
    source: "Borenstein & Feng 1996, mean of x and y errors",
    needs: "squares both ways round",
    blind_to: "E_s; second order in the errors; headings",
    estimate: |training| {
        umbmark(training, |clusters| {
            let (x, y) = (clusters.angles_from_x(), clusters.angles_from_y());
            Angles { alpha: 0.5 * (x.alpha + y.alpha), beta: 0.5 * (x.beta + y.beta) }
        })
    },
};

fn umbmark(training: &Training, angles: impl Fn(&Clusters) -> Angles) -> Result<Estimate, CalibrateError> {
    over_sides(training, None, |clusters| {
        let Angles { alpha, beta } = angles(clusters);
        let e_d = diameter_ratio(training, beta, clusters.side)?;
        let alpha = within(training, "α [rad]", alpha, FRAC_PI_2)?;
        // E_b = 90°/(90° − α) (eq 19).
        Ok((e_d, FRAC_PI_2 / (FRAC_PI_2 - alpha)))
    })
}
