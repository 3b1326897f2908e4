//! What can go wrong with a recording.

use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;

/// A recording that cannot be made or kept. Each message names the file.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A file of that name exists, and recordings are never overwritten.
    #[error("{}: exists already, and a recording is never overwritten", file.display())]
    Exists {
        /// The file.
        file: PathBuf,
    },
    /// The file cannot be made.
    #[error("{}: the recording cannot be made: {source}", file.display())]
    Create {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: Arc<std::io::Error>,
    },
    /// The file cannot be written to its end, as on a full disk; it opens, and holds what came before.
    #[error("{}: the recording breaks off here, what came before is readable: {source}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// The system's or the encoder's reason.
        source: Arc<dyn Error + Send + Sync>,
    },
}
