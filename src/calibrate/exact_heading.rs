//! The exact heading form: no small angles.
//!
//! A turn on the spot turns by (π/2)E_s/E_b whatever E_d, and a side of length L by (E_s/E_b)·δ·L/b_n, with
//! δ = (D_R − D_L)/D_mean; so with end headings α = (π/2)(1 − E_s/E_b), β = (E_s/E_b)δL/b_n hold exactly, and
//! E_b/E_s = (π/2)/(π/2 − α), δ = β(E_b/E_s)b_n/L, E_d = (1 + δ/2)/(1 − δ/2) (derived in science note 1).

use super::Method;
use super::squares::{Angles, over_sides, scale_of_straights, within};
use std::f64::consts::FRAC_PI_2;

pub(super) const METHOD: Method = Method {
    name: "exact_heading",
    source: "derived: the square test's end headings without small angles",
    needs: "squares both ways round with end headings; a measured straight parts E_s from E_b",
    blind_to: "positions; E_s without a straight",
    estimate: |training| {
        let scale = scale_of_straights(training);
        over_sides(training, scale, |clusters| {
            let Angles { alpha, beta } = clusters.angles_from_headings(&training.name)?;
            let alpha = within(training, "α [rad]", alpha, FRAC_PI_2)?;
            let track_over_scale = FRAC_PI_2 / (FRAC_PI_2 - alpha);
            let delta = beta * track_over_scale * training.odometry.track_width / clusters.side;
            let delta = within(training, "δ", delta, 2.0)?;
            Ok(((1.0 + 0.5 * delta) / (1.0 - 0.5 * delta), track_over_scale * scale.unwrap_or(1.0)))
        })
    },
};
