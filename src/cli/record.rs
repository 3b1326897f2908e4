//! What the commands record: an experiment's best-known stages, or one run.

use crate::drive::Observer;
use crate::experiment::{Experiment, Plan, Stage, StageRun};
use crate::recording::{Area, Detail, EndPoints, Outline, Recording, RecordingError, RunLabel};
use crate::report::page;
use crate::report::text::{self, Style};
use crate::scene::Scene;
use std::path::Path;

/// Methods whose calibrated robots are shown beside the uncalibrated one, where they are asked for: else the first and the last
/// that are.
const SHOWN: [&str; 2] = ["umbmark", "maximum_likelihood"];

/// Records an experiment: the longest square counter-clockwise in full, before and after; the paths of the others.
pub(super) struct ExperimentRecorder {
    recording: Recording,
    stages: Vec<String>,
    featured: Vec<RunLabel>,
}

impl ExperimentRecorder {
    pub(super) fn create(file: &Path, scene: &Scene, plan: &Plan) -> Result<Self, RecordingError> {
        let side = plan.longest();
        let mut stages = vec![Experiment::BEFORE.to_owned()];
        let asked: Vec<&'static str> = plan.methods.iter().map(|method| method.name).collect();
        let shown =
            |known, other: Option<&&'static str>| if asked.contains(&known) { Some(known) } else { other.copied() };
        for method in [shown(SHOWN[0], asked.first()), shown(SHOWN[1], asked.last())].into_iter().flatten() {
            let stage = Experiment::stage_after(method, side);
            if !stages.contains(&stage) {
                stages.push(stage);
            }
        }
        let featured: Vec<RunLabel> = [&stages[0], &stages[stages.len() - 1]]
            .into_iter()
            .map(|stage| RunLabel::of(stage, &plan.featured(), 1))
            .collect();
        let outline = Outline {
            title: format!("{} on {}", scene.robot.name, scene.floor.name),
            stages: stages.clone(),
            featured: featured.clone(),
            area: Area::of(&plan.squares()),
            sides: plan.sides.clone(),
        };
        let recording = Recording::create(file, &outline, scene)?;
        Ok(ExperimentRecorder { recording, stages, featured })
    }

    /// The recorder of a run, if its stage is shown.
    pub(super) fn observer(&self, run: StageRun<'_>) -> Option<Box<dyn Observer>> {
        if !self.stages.iter().any(|stage| stage == run.stage) {
            return None;
        }
        let label = RunLabel::of(run.stage, &run.task.protocol, run.repeat);
        let detail = if self.featured.contains(&label) { Detail::Full } else { Detail::Path };
        Some(Box::new(self.recording.run(&label, detail)))
    }

    /// End points and the table, then the end of the file.
    pub(super) fn finish(self, result: &Experiment) -> Result<(), RecordingError> {
        let shown: Vec<&Stage> = result.stages().filter(|stage| self.stages.contains(&stage.name)).collect();
        for side in &result.before.sides {
            let clusters: Vec<EndPoints> = shown.iter().flat_map(|stage| clusters(stage, side.side)).collect();
            self.recording.end_points(side.side, &clusters);
        }
        let (answer, beside) = page::experiment::answer(result);
        let tables = text::experiment(result, Style::Markdown, |stage| self.stages.contains(&stage.name));
        self.recording.result(&format!("**{answer}** {}\n\n{tables}", beside.join(" ")));
        self.recording.finish()
    }
}

fn clusters(stage: &Stage, side: f64) -> Vec<EndPoints> {
    use crate::dataset::Rotation::{Clockwise, CounterClockwise};
    let Some(result) = stage.side(side) else { return Vec::new() };
    [(Clockwise, &result.errors.cw, &result.cw), (CounterClockwise, &result.errors.ccw, &result.ccw)]
        .map(|(direction, errors, centre)| EndPoints {
            stage: stage.name.clone(),
            direction,
            errors: errors.iter().map(|error| [error.x, error.y]).collect(),
            centre_of_gravity: [centre.x, centre.y],
        })
        .into()
}

/// Opens the recording of a single run and its recorder.
pub(super) fn drive(
    file: &Path,
    scene: &Scene,
    protocol: &crate::dataset::Protocol,
) -> Result<(Recording, Box<dyn Observer>), RecordingError> {
    let label = RunLabel::of("drive", protocol, 1);
    let outline = Outline {
        title: format!("{} on {}", scene.robot.name, scene.floor.name),
        stages: vec![label.stage.clone()],
        featured: vec![label.clone()],
        area: Area::of([protocol]),
        sides: Vec::new(),
    };
    let recording = Recording::create(file, &outline, scene)?;
    let recorder = recording.run(&label, Detail::Full);
    Ok((recording, Box::new(recorder)))
}
