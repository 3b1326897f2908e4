//! Why a run did not come to its end.

use crate::world::WorldError;

/// A run that could not be driven.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum DriveError {
    /// The world could not be built, or was left.
    #[error("run `{run}`: {source}")]
    World {
        /// The run.
        run: String,
        /// Why.
        source: WorldError,
    },
    /// It was stopped from outside.
    #[error("run `{run}` was interrupted")]
    Interrupted {
        /// The run.
        run: String,
    },
    /// Nothing to replay.
    #[error("run `{run}` has no encoder log, and nothing to replay")]
    NoLog {
        /// The run.
        run: String,
    },
    /// A protocol that has no shape of its own.
    #[error("run `{run}`: a path has no shape that could be driven; square, straight, spin and circle have")]
    NoShape {
        /// The run.
        run: String,
    },
}
