//! Ctrl-C, and what an experiment tells of its runs: progress, recordings, datasets.

use crate::dataset::DatasetError;
use crate::drive::{Observer, SimulatedRun};
use crate::experiment::{Experiment, Stage, StageRun, Watch};
use indicatif::ProgressBar;
use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Set by Ctrl-C; a second Ctrl-C ends the program at once.
pub(super) fn stop_on_ctrl_c() -> &'static AtomicBool {
    static STOP: AtomicBool = AtomicBool::new(false);
    static SET: OnceLock<()> = OnceLock::new();
    SET.get_or_init(|| {
        let handler = || {
            if STOP.swap(true, Ordering::Relaxed) {
                std::process::exit(2);
            }
            tell!("\nstopping: what has been driven is kept (Ctrl-C again to end at once)");
        };
        if let Err(error) = ctrlc::set_handler(handler) {
            tell!("note: Ctrl-C will end the program at once: {error}");
        }
    });
    &STOP
}

/// Watches an experiment for a progress bar and, where there is one, a recording.
pub(super) struct Watcher<'a> {
    pub progress: ProgressBar,
    /// Where datasets go, a folder a stage.
    pub folder: &'a Path,
    /// Makes the observer that records a run.
    pub record: &'a (dyn Fn(StageRun<'_>) -> Option<Box<dyn Observer>> + Sync),
}

impl Watch for Watcher<'_> {
    fn begins(&self, run: StageRun<'_>) -> Option<Box<dyn Observer>> {
        self.progress.set_message(format!("{} {}", run.stage, run.task.name));
        (self.record)(run)
    }

    fn ended(&self, _run: StageRun<'_>, _result: &SimulatedRun) {
        self.progress.inc(1);
    }

    fn stage_ended(&self, stage: &Stage) -> Result<(), DatasetError> {
        if stage.dataset.runs.is_empty() {
            return Ok(());
        }
        let mut dataset = stage.dataset.clone();
        if stage.name != Experiment::BEFORE {
            // Logs of every method's robot would be 50 MB that hardly anyone reads; its end points say how good it is.
            for run in &mut dataset.runs {
                (run.encoders, run.poses) = (None, None);
            }
        }
        dataset.write(&self.folder.join(&stage.name))
    }
}
