//! The way to the file.
//!
//! rerun's own file sink says of a failed write only a line in a log that nobody reads, and drops what comes after. This
//! one keeps the first failure for whoever asks, and cuts the file back to the last whole message. Every message goes to
//! the system at once and whole, so that a killed process leaves all that it had logged.

use super::error::RecordingError;
use rerun::external::re_log_encoding::{EncodeError, Encoder, EncodingOptions};
use rerun::external::re_log_types::LogMsg;
use rerun::log::ChunkBatcherConfig;
use rerun::sink::{LogSink, SinkFlushError};
use std::error::Error;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A recording file that is being written; clones write to the same one.
#[derive(Clone)]
pub(super) struct Disk(Arc<Mutex<State>>);

struct State {
    file: PathBuf,
    /// `None` once finished.
    encoder: Option<Encoder<WholeMessages>>,
    /// The first one.
    failure: Option<Arc<dyn Error + Send + Sync>>,
}

impl Disk {
    /// Makes the file, which must not exist.
    pub(super) fn create(path: &Path) -> Result<Disk, RecordingError> {
        let file =
            OpenOptions::new().write(true).create_new(true).open(path).map_err(|source| match source.kind() {
                io::ErrorKind::AlreadyExists => RecordingError::Exists { file: path.to_owned() },
                _ => RecordingError::Create { file: path.to_owned(), source: Arc::new(source) },
            })?;
        Disk::start(path, file).inspect_err(|_| {
            // Not even a header: no recording.
            let _ = std::fs::remove_file(path);
        })
    }

    /// Writes to a file that is open.
    pub(super) fn start(path: &Path, file: File) -> Result<Disk, RecordingError> {
        let sink = WholeMessages { file, whole: 0, broken: false };
        let version = rerun::build_info().version;
        let encoder = Encoder::new_eager(version, EncodingOptions::PROTOBUF_COMPRESSED, sink)
            .map_err(|error| RecordingError::Write { file: path.to_owned(), source: reason(error) })?;
        Ok(Disk(Arc::new(Mutex::new(State { file: path.to_owned(), encoder: Some(encoder), failure: None }))))
    }

    /// The first failure, if there has been one.
    pub(super) fn check(&self) -> Result<(), RecordingError> {
        self.state().check()
    }

    /// Notes a failure on the way to the file.
    pub(super) fn note(&self, failure: impl Error + Send + Sync + 'static) {
        let mut state = self.state();
        state.failure.get_or_insert_with(|| Arc::new(failure));
    }

    /// Writes the footer and has the system bring all to the disk. Later messages are dropped.
    pub(super) fn finish(&self) -> Result<(), RecordingError> {
        let mut state = self.state();
        if let Some(mut encoder) = state.encoder.take()
            && state.failure.is_none()
        {
            let ended = encoder.finish().and_then(|()| encoder.into_inner()).map_err(reason);
            let synced = ended.and_then(|sink| sink.file.sync_all().map_err(|error| Arc::new(error) as _));
            state.failure = synced.err();
        }
        state.check()
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn check(&self) -> Result<(), RecordingError> {
        match &self.failure {
            None => Ok(()),
            Some(source) => Err(RecordingError::Write { file: self.file.clone(), source: Arc::clone(source) }),
        }
    }
}

impl LogSink for Disk {
    fn send(&self, message: LogMsg) {
        let mut state = self.state();
        if state.failure.is_some() {
            return;
        }
        if let Some(encoder) = &mut state.encoder
            && let Err(error) = encoder.append(&message)
        {
            state.failure = Some(reason(error));
        }
    }

    /// Rows, which are only logged for what does not change, go out at once: a recording that breaks off needs them first.
    fn default_batcher_config(&self) -> ChunkBatcherConfig {
        ChunkBatcherConfig { flush_num_rows: 1, ..ChunkBatcherConfig::DEFAULT }
    }

    fn flush_blocking(&self, _timeout: Duration) -> Result<(), SinkFlushError> {
        self.check().map_err(|error| SinkFlushError::failed(error.to_string()))
    }
}

/// The system's reason where there is one, else the encoder's.
fn reason(error: EncodeError) -> Arc<dyn Error + Send + Sync> {
    match error {
        EncodeError::Write(error) => Arc::new(error),
        error => Arc::new(error),
    }
}

/// A file that ends with a whole message. The encoder hands over one message at a time.
struct WholeMessages {
    file: File,
    /// Length of what has been written whole \[bytes\].
    whole: u64,
    /// A write has failed: the encoder, when it is dropped, must not add its footer.
    broken: bool,
}

impl Write for WholeMessages {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.write_all(bytes).map(|()| bytes.len())
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        if self.broken {
            return Err(io::ErrorKind::WriteZero.into());
        }
        match self.file.write_all(bytes) {
            Ok(()) => self.whole += bytes.len() as u64,
            Err(error) => {
                self.broken = true;
                // Where this fails too, readers stop at the half message, which they can.
                let _ = self.file.set_len(self.whole);
                return Err(error);
            }
        }
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
