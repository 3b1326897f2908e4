//! Lee, Jung & Chung, "Accurate calibration of kinematic parameters for two wheel differential mobile robots", *J. Mech.
//! Sci. Technol.* 25 (2011) 1603–1611.
//!
//! We could not source its equations, so it is listed and never applied.

use super::Method;
use super::error::CalibrateError;

pub(super) const METHOD: Method = Method {
    name: "lee2011",
    source: "Lee, Jung & Chung 2011",
    needs: "its equations, which we could not source",
    blind_to: "–",
    estimate: |_| Err(CalibrateError::NotSourced),
};
