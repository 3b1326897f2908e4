//! Why a method cannot be applied to a dataset.

use crate::dataset::Rotation;

/// What a method needs and the data lack.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateError {
    /// Nobody said what the robot believed.
    #[error(
        "dataset `{dataset}` has no [odometry] table; a calibration corrects what the robot believed, so it has to know it"
    )]
    NoOdometry {
        /// The campaign.
        dataset: String,
    },
    /// One direction is missing.
    #[error(
        "dataset `{dataset}` has no surveyed {} square of {side} m; the method needs both directions, because what turns the robot too little and what bends its straights differ in sign only between them",
        direction.as_str()
    )]
    OneDirection {
        /// The campaign.
        dataset: String,
        /// \[m\]
        side: f64,
        /// The missing direction.
        direction: Rotation,
    },
    /// The error is beyond what the method's formula can express.
    #[error("dataset `{dataset}`: {quantity} comes out as {value:.4}; the method's formula holds below {limit:.4}")]
    OutOfRange {
        /// The campaign.
        dataset: String,
        /// Which intermediate quantity.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// Where the formula ends.
        limit: f64,
    },
}
