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
    /// No run with a surveyed end and a known way.
    #[error("dataset `{dataset}` has no run with a surveyed end and either logs or a protocol whose way is known")]
    NoRuns {
        /// The campaign.
        dataset: String,
    },
    /// No squares.
    #[error("dataset `{dataset}` has no surveyed square")]
    NoSquares {
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
    /// End headings are blank.
    #[error("dataset `{dataset}` has no end headings in one of the directions")]
    NoHeadings {
        /// The campaign.
        dataset: String,
    },
    /// No straight.
    #[error("dataset `{dataset}` has no measured straight, which the method takes E_s from")]
    NoStraight {
        /// The campaign.
        dataset: String,
    },
    /// No logs.
    #[error("dataset `{dataset}` has no encoder logs of surveyed runs")]
    NoLogs {
        /// The campaign.
        dataset: String,
    },
    /// Too little for as many unknowns.
    #[error("dataset `{dataset}` has too few surveyed runs: {found} numbers for {needed} unknowns")]
    TooFew {
        /// The campaign.
        dataset: String,
        /// Surveyed numbers.
        found: usize,
        /// Unknowns.
        needed: usize,
    },
    /// The normal equations are singular, or the fit went nowhere.
    #[error("dataset `{dataset}`: the runs do not fix what the method looks for")]
    Singular {
        /// The campaign.
        dataset: String,
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
    /// A method whose equations we do not have.
    #[error("its equations could not be sourced")]
    NotSourced,
}
