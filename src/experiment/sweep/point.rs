//! What is done at a point, and the columns that it fills.

use super::key::{Target, Value};
use super::plan::{Plan, PointKind, ProtocolKind};
use crate::calibrate::Method;
use crate::dataset::{DatasetError, Protocol, Rotation, SurveyedPose, Travel};
use crate::diagnose::Options;
use crate::drive::{self, DriveError, Observer, SimulatedRun, Task};
use crate::experiment::{
    self, CampaignKind, Challenge, DataKind, EffectsKind, ExperimentError, ScoreError, Scorer, Stage, StageRun, Watch,
};
use crate::geometry::Pose2;
use crate::scene::Scene;
use crate::table::{Cell, Column};
use std::f64::consts::TAU;
use std::fmt::Debug;
use std::sync::atomic::AtomicBool;

/// What a point came to.
#[derive(Debug)]
pub(super) struct Outcome {
    /// One a column of [`columns`].
    pub cells: Vec<Cell>,
    /// Simulated time [s].
    pub simulated: f64,
}

/// What there is to know of a point beside its scene.
pub(super) struct Job<'a> {
    pub scene: Scene,
    pub seed: u64,
    pub words: Vec<(&'a str, &'a Value)>,
    /// What draws of this scene share, where it was simulated.
    pub scorer: Option<&'a Scorer>,
}

/// The key of what is hidden.
pub(super) const EFFECTS: &str = "challenge.effects";

/// The columns that a kind of point fills; the last one says why a point has no others.
pub(super) fn columns(kind: PointKind) -> Vec<Column> {
    let mut columns = Vec::new();
    match kind {
        PointKind::Run => {
            columns.extend([Column::number("simulated_s"), Column::whole("steps")]);
            for pose in ["true_end", "surveyed_end", "odometry_end", "error"] {
                columns.extend(["x_m", "y_m", "heading_rad"].map(|part| Column::number(format!("{pose}_{part}"))));
            }
        }
        PointKind::Campaign => {
            columns.push(Column::number("simulated_s"));
            for direction in ["cw", "ccw"] {
                columns.extend(["x_m", "y_m"].map(|part| Column::number(format!("{direction}_centre_{part}"))));
            }
            columns.push(Column::number("e_max_syst_before_m"));
            for parameter in ["diameter_ratio", "track_ratio", "distance_scale"] {
                columns.extend([Column::number(parameter), Column::number(format!("{parameter}_std_dev"))]);
            }
            columns.push(Column::number("e_max_syst_after_m"));
        }
        PointKind::Challenge => columns.extend([
            Column::text("truth"),
            Column::number("strength_sigma"),
            Column::text("oracle_set"),
            Column::text("answer"),
            Column::text("tally"),
            Column::whole("intervals"),
            Column::whole("intervals_that_cover"),
            Column::whole("set_size"),
            Column::number("log_score_regret"),
        ]),
    }
    columns.push(Column::text("failure"));
    columns
}

impl Job<'_> {
    fn number(&self, key: &str) -> Option<f64> {
        self.words.iter().rev().find(|(known, _)| *known == key).and_then(|(_, value)| match value {
            Value::Number(value) => Some(*value),
            Value::Text(_) => None,
        })
    }

    fn word(&self, key: &str) -> Option<&str> {
        self.words.iter().rev().find(|(known, _)| *known == key).and_then(|(_, value)| match value {
            Value::Text(text) => Some(text.as_str()),
            Value::Number(_) => None,
        })
    }

    /// Does what `plan` says; `None` where it was stopped from outside.
    pub(super) fn outcome(&self, plan: &Plan, stop: &AtomicBool) -> Option<Outcome> {
        let done = match plan.kind {
            PointKind::Run => self.run(plan, stop),
            PointKind::Campaign => self.campaign(stop),
            PointKind::Challenge => self.challenge(plan, stop),
        };
        // What a stop cut short would come out otherwise another time.
        if stop.load(std::sync::atomic::Ordering::Relaxed) {
            return None;
        }
        let columns = columns(plan.kind).len();
        let mut outcome = done.unwrap_or_else(|failure| {
            let mut cells = vec![Cell::Absent; columns - 1];
            cells.push(Cell::Text(failure));
            Outcome { cells, simulated: 0.0 }
        });
        outcome.cells.resize(columns, Cell::Absent);
        Some(outcome)
    }

    /// The protocol and how it is driven.
    fn task(&self, plan: &Plan) -> Task {
        let side = |key| self.number(key).unwrap_or(4.0);
        let turn = self.number("protocol.turn_rad").unwrap_or(TAU);
        let direction = match self.word("protocol.direction") {
            Some("cw") => Rotation::Clockwise,
            _ => Rotation::CounterClockwise,
        };
        let protocol = match plan.protocol {
            ProtocolKind::Square => Protocol::Square { side: side("protocol.side_m"), direction },
            ProtocolKind::Straight => {
                let reverse = self.word("protocol.direction") == Some("reverse");
                let direction = if reverse { Travel::Reverse } else { Travel::Forward };
                Protocol::Straight { length: side("protocol.length_m"), direction }
            }
            ProtocolKind::Spin => Protocol::Spin { turn, direction },
            ProtocolKind::Circle => {
                let radius = self.number("protocol.radius_m").unwrap_or(1.0);
                Protocol::Circle { radius, turn: Some(turn), direction }
            }
        };
        // As `treadmark drive` calls it, so that it drives any row again from the row's seed.
        let name = format!("{}-{}", protocol.kind(), protocol.direction().unwrap_or_default());
        Task {
            speed: self.number("protocol.speed_m_s"),
            turn_rate: self.number("protocol.turn_rate_rad_s"),
            ..Task::new(name, protocol)
        }
    }

    fn run(&self, plan: &Plan, stop: &AtomicBool) -> Result<Outcome, String> {
        let run = drive::run(&self.scene, &self.task(plan), self.seed, None, stop)
            .map_err(|error: DriveError| error.to_string())?;
        let surveyed = run.measured.end.unwrap_or(SurveyedPose { x: f64::NAN, y: f64::NAN, heading: None });
        let mut cells = vec![Cell::number(run.simulated), Cell::Whole(run.steps)];
        cells.extend(pose(run.actual));
        cells.extend([surveyed.x, surveyed.y, surveyed.heading.unwrap_or(f64::NAN)].map(Cell::number));
        cells.extend(pose(run.odometry));
        cells.extend(pose(run.true_error()));
        Ok(Outcome { cells, simulated: run.simulated })
    }

    fn campaign(&self, stop: &AtomicBool) -> Result<Outcome, String> {
        let side = self.number("campaign.side_m").unwrap_or(2.0);
        let name = self.word("campaign.method").unwrap_or("maximum_likelihood");
        let squares = experiment::Plan {
            sides: vec![side],
            repeats: self.number("campaign.runs").unwrap_or(5.0) as usize,
            seed: self.seed,
            methods: Method::named(name).into_iter().collect(),
        };
        let result = experiment::squares(&self.scene, &squares, &Unwatched, stop)
            .map_err(|error: ExperimentError| error.to_string())?;
        let simulated = result.stages().flat_map(|stage| &stage.runs).map(|run| run.simulated).sum();
        let before = result.before.side(side).ok_or("no squares were driven both ways round")?;
        let mut cells = vec![Cell::number(simulated)];
        cells.extend([before.cw.x, before.cw.y, before.ccw.x, before.ccw.y, before.e_max_syst()].map(Cell::number));
        match result.methods.first() {
            Some(method) => {
                let estimate = &method.estimate;
                for parameter in [estimate.diameter_ratio, estimate.track_ratio, estimate.distance_scale] {
                    cells.extend([parameter.value, parameter.std_dev].map(Cell::number));
                }
                cells.push(method.after.side(side).map_or(Cell::Absent, |after| Cell::number(after.e_max_syst())));
            }
            None => {
                cells.resize(columns(PointKind::Campaign).len() - 1, Cell::Absent);
                cells.extend(result.not_applicable.first().map(|(_, _, reason)| Cell::Text(reason.to_string())));
            }
        }
        Ok(Outcome { cells, simulated })
    }

    fn hidden(&self, plan: &Plan) -> Challenge {
        Challenge {
            seed: self.seed,
            data: match self.word("challenge.data") {
                Some("endpoints") => DataKind::EndPoints,
                _ => DataKind::Logs,
            },
            effects: match self.word(EFFECTS) {
                Some("none") => EffectsKind::None,
                Some("one") => EffectsKind::One,
                Some("two") => EffectsKind::Two,
                Some("outside") => EffectsKind::Outside,
                _ => EffectsKind::Mixed,
            },
            campaign: match self.word("challenge.campaign") {
                Some("full") => CampaignKind::Full,
                _ => CampaignKind::Squares,
            },
            mismatch: plan.mismatch,
            clean_campaigns: 1,
        }
    }

    /// Simulates what draws of this scene share.
    pub(super) fn scorer(&self, plan: &Plan, stop: &AtomicBool) -> Result<Scorer, ScoreError> {
        Scorer::new(&self.scene, &self.hidden(plan), &|_, _| {}, stop)
    }

    fn challenge(&self, plan: &Plan, stop: &AtomicBool) -> Result<Outcome, String> {
        let own;
        let scorer = match self.scorer {
            Some(shared) => shared,
            None => {
                own = self.scorer(plan, stop).map_err(|error| error.to_string())?;
                &own
            }
        };
        let seeds = self.seed..self.seed + 1;
        let score = scorer
            .score(self.hidden(plan), seeds, &Options::default(), &mut |_| {}, stop)
            .map_err(|error| error.to_string())?;
        let scored = score.draws.first().ok_or("nothing was drawn")?;
        let count = |value: usize| Cell::Whole(value as u64);
        let cells = vec![
            Cell::Text(scored.truth.join(" & ")),
            Cell::number(scored.strength),
            Cell::Text(scored.oracle_set.join(", ")),
            Cell::Text(scored.answer.clone()),
            Cell::Text(snake_case(&scored.tally)),
            count(scored.intervals.len()),
            count(scored.intervals.iter().filter(|interval| interval.covers()).count()),
            scored.set_size.map_or(Cell::Absent, count),
            scored.regret.map_or(Cell::Absent, Cell::number),
        ];
        Ok(Outcome { cells, simulated: 0.0 })
    }
}

fn pose(pose: Pose2) -> [Cell; 3] {
    [pose.x, pose.y, pose.heading].map(Cell::number)
}

/// `RightGroup` → `right_group`.
fn snake_case(variant: &impl Debug) -> String {
    let mut word = String::new();
    for letter in format!("{variant:?}").chars() {
        if letter.is_uppercase() && !word.is_empty() {
            word.push('_');
        }
        word.extend(letter.to_lowercase());
    }
    word
}

/// Nobody watches a campaign's single runs.
struct Unwatched;

impl Watch for Unwatched {
    fn begins(&self, _: StageRun<'_>) -> Option<Box<dyn Observer>> {
        None
    }

    fn ended(&self, _: StageRun<'_>, _: &SimulatedRun) {}

    fn stage_ended(&self, _: &Stage) -> Result<(), DatasetError> {
        Ok(())
    }
}

/// The words of `settings` that are the plan's own.
pub(super) fn words<'a>(settings: impl Iterator<Item = (&'a super::key::Key, &'a Value)>) -> Vec<(&'a str, &'a Value)> {
    settings.filter(|(key, _)| matches!(key.target, Target::Plan(_))).map(|(key, value)| (key.name(), value)).collect()
}
