//! Sweeps: one thing done at many points of a plan, on every core or in shards on many machines, into one table.
//!
//! A point depends on the plan, its index and nothing else, so that the table has the same bytes whatever the threads,
//! shards and interruptions were. [`Plan`] says how plans are written; what was done is kept in a journal as it comes.

mod error;
mod journal;
mod key;
mod merge;
mod plan;
mod point;
mod shard;

pub use error::SweepError;
pub use key::{Allowed, Key, Value};
pub use merge::{Merged, merge};
pub use plan::{MOST_POINTS, Plan, Point, PointKind, ProtocolKind};
pub use shard::{NotAShard, Shard};

use super::Scorer;
use crate::effect::{Cause, load_scene};
use crate::scene::{Contact, ROBOTS, Scatter, Scene, WORLDS};
use crate::table::{Cell, Table};
use journal::{Header, Journal, Record};
use key::Target;
use plan::TyreLaw;
use point::{EFFECTS, Job};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Reads a sweep's table, and the plan that is kept in it.
///
/// # Errors
/// It cannot be read, or holds no plan of this version's format.
pub fn read(file: &Path) -> Result<(Plan, Table), SweepError> {
    let table = Table::read(file)?;
    let text = table.notes.iter().find(|(key, _)| key == "treadmark.plan").map(|(_, text)| text.clone());
    Ok((Plan::parse(file, text.unwrap_or_default())?, table))
}

/// Name of the table in a sweep's folder.
pub const TABLE: &str = "sweep.parquet";
/// Step of a challenge's simulations at least \[s\], as `treadmark challenge` has it.
const CHALLENGE_TIME_STEP: f64 = 2.5e-3;

/// A plan with the robots and worlds that it names, every point checked.
#[derive(Debug)]
pub struct Sweep {
    plan: Plan,
    bases: Vec<Base>,
    inputs: String,
}

#[derive(Debug)]
struct Base {
    robot: String,
    world: String,
    scene: Scene,
}

/// How far a sweep is.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Progress {
    /// Points of this share.
    pub points: usize,
    /// Done before this start.
    pub before: usize,
    /// Done since.
    pub since: usize,
    /// Simulated since \[s\].
    pub simulated: f64,
}

/// What a sweep came to.
#[derive(Debug, Clone, PartialEq)]
pub struct Swept {
    /// How far it got.
    pub progress: Progress,
    /// Points that could not be done, by index, and why.
    pub failures: Vec<(usize, String)>,
    /// Where the points are kept.
    pub folder: PathBuf,
    /// The table; `None` for a share, or where points are left.
    pub table: Option<PathBuf>,
}

impl Swept {
    /// Whether no point is left.
    pub fn is_complete(&self) -> bool {
        self.progress.before + self.progress.since == self.progress.points
    }
}

impl Sweep {
    /// Loads what `plan` names, and checks every point before any is driven.
    ///
    /// # Errors
    /// A robot, world, wheel or effect that cannot be had, and what can.
    pub fn prepare(plan: Plan) -> Result<Sweep, SweepError> {
        let beside = |name: &str| {
            let file = plan.file.parent().unwrap_or(Path::new("")).join(name);
            if file.is_file() { file.to_string_lossy().into_owned() } else { name.to_owned() }
        };
        let mut bases = Vec::new();
        for robot in plan.words("robot", ROBOTS.names()[0]) {
            for world in plan.words("world", WORLDS.names()[0]) {
                let mut scene = load_scene(&beside(&robot), &beside(&world))
                    .map_err(|source| SweepError::Scene { file: plan.file.clone(), source })?;
                // What is only seen is nothing to a number, and copied for every point.
                scene.robot.chassis.visuals.clear();
                scene.robot.wheels.iter_mut().for_each(|wheel| wheel.body.visuals.clear());
                if !plan.survey_noise {
                    scene.survey = scene.survey.noise_free();
                }
                if !plan.scatter {
                    scene.scatter = Scatter::NONE;
                }
                if plan.tyre_law == TyreLaw::Rigid {
                    scene.contact = Contact::Rigid;
                }
                if plan.kind == PointKind::Challenge {
                    scene.time_step = scene.time_step.max(CHALLENGE_TIME_STEP);
                }
                bases.push(Base { robot: robot.clone(), world, scene });
            }
        }
        let inputs = fingerprint(&bases);
        let sweep = Sweep { plan, bases, inputs };
        for combination in (0..sweep.plan.len()).step_by(sweep.plan.repeats) {
            sweep.check(&sweep.plan.point(combination))?;
        }
        Ok(sweep)
    }

    /// The plan.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Does the points of `shard` that are not done yet, side by side on rayon's threads, and keeps each in `folder` (a
    /// share: in a folder of its own inside) as it comes. With the last one the table is written. `watch` is told after
    /// every point, from the points' own threads; `stop` set from outside ends it with what there is.
    ///
    /// # Errors
    /// A folder that is something else's, or results that cannot be kept. Points that cannot be driven are rows that say so.
    pub fn run(
        &self,
        folder: &Path,
        shard: Shard,
        watch: &(dyn Fn(&Progress) + Sync),
        stop: &AtomicBool,
    ) -> Result<Swept, SweepError> {
        let folder = shard.folder().map_or_else(|| folder.to_owned(), |inside| folder.join(inside));
        let points = self.plan.len();
        let header = Header::new(shard, points, self.inputs.clone());
        let (journal, mut records) = Journal::open(&folder, &self.plan.file, &self.plan.text, &header)?;
        let mut is_done = vec![false; points];
        records.retain(|(index, _)| *index < points && !std::mem::replace(&mut is_done[*index], true));
        let todo: Vec<usize> = shard.points(points).filter(|&index| !is_done[index]).collect();
        let mut progress = Progress { points: shard.points(points).count(), ..Progress::default() };
        progress.before = progress.points - todo.len();
        watch(&progress);

        let scorer = if todo.is_empty() { None } else { self.scorer(stop) };
        let state = Mutex::new((journal, progress, records));
        todo.par_iter().with_max_len(1).try_for_each(|&index| -> Result<(), SweepError> {
            if stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            let point = self.plan.point(index);
            let job = Job { scorer: scorer.as_ref(), ..self.job(&point) };
            let Some(outcome) = job.outcome(&self.plan, stop) else { return Ok(()) };
            let (journal, progress, records) = &mut *state.lock().unwrap_or_else(|broken| broken.into_inner());
            journal.add(index, &outcome.cells)?;
            records.push((index, outcome.cells));
            progress.since += 1;
            progress.simulated += outcome.simulated;
            watch(progress);
            Ok(())
        })?;
        let (mut journal, progress, mut records) = state.into_inner().unwrap_or_else(|broken| broken.into_inner());
        journal.sync()?;
        records.sort_by_key(|(index, _)| *index);
        let failures = failures(&records);
        let mut swept = Swept { progress, failures, folder: folder.clone(), table: None };
        if shard == Shard::WHOLE && swept.is_complete() {
            let file = folder.join(TABLE);
            table(&self.plan, &header, records).write(&file)?;
            swept.table = Some(file);
        }
        Ok(swept)
    }

    /// What holds at `point`, made into a scene.
    fn job<'a>(&'a self, point: &'a Point) -> Job<'a> {
        let settings = self.plan.settings(point);
        let mut scene = self.base(point).scene.clone();
        for (key, value) in settings.clone() {
            let &Value::Number(value) = value else { continue };
            match key.target {
                Target::Scene(number) => (number.set)(&mut scene, value),
                Target::Wheel(number) => scene
                    .robot
                    .wheels
                    .iter_mut()
                    .filter(|wheel| key.wheel() == Some(wheel.name.as_str()))
                    .for_each(|wheel| (number.set)(&mut wheel.tyre, value)),
                _ => {}
            }
        }
        // Effects come last, since they are increments on the scene as it is; `check` has found no fault with them.
        let causes = Cause::from_settings(&effects(settings.clone()), &self.base(point).scene).unwrap_or_default();
        let scene = Cause::edit_all(&causes, &scene);
        Job { scene, seed: point.seed, words: point::words(settings), scorer: None }
    }

    /// What hidden-effect draws share, where all points are draws of one robot in one kind of campaign. It is the plan's, so that
    /// a point does not depend on which others are done beside it; one that cannot be had, each point says for itself.
    fn scorer(&self, stop: &AtomicBool) -> Option<Scorer> {
        let alike = self.plan.kind == PointKind::Challenge && self.plan.keys().all(|key| key.name() == EFFECTS);
        let first = self.plan.point(0);
        alike.then(|| self.job(&first).scorer(&self.plan, stop).ok()).flatten()
    }

    fn base(&self, point: &Point) -> &Base {
        let word = |wanted: &str| {
            let of_plan = self.plan.settings(point).filter(|(key, _)| key.name() == wanted).last();
            of_plan.and_then(|(_, value)| if let Value::Text(text) = value { Some(text.as_str()) } else { None })
        };
        let (robot, world) = (word("robot"), word("world"));
        let fits = |base: &&Base| robot.is_none_or(|it| it == base.robot) && world.is_none_or(|it| it == base.world);
        self.bases.iter().find(fits).unwrap_or(&self.bases[0])
    }

    /// Whether the robot and floor of `point` have what its settings are about.
    fn check(&self, point: &Point) -> Result<(), SweepError> {
        let base = self.base(point);
        let robot = &base.scene.robot;
        let lacks = |key: &Key, allowed: String| SweepError::NoPart {
            file: self.plan.file.clone(),
            key: key.name().to_owned(),
            robot: base.robot.clone(),
            world: base.world.clone(),
            allowed,
        };
        for (key, _) in self.plan.settings(point) {
            let name = key.name();
            if let Target::Wheel(_) = key.target
                && !robot.wheels.iter().any(|wheel| key.wheel() == Some(wheel.name.as_str()))
            {
                let wheels: Vec<&str> = robot.wheels.iter().map(|wheel| wheel.name.as_str()).collect();
                return Err(lacks(key, format!("its wheels are: {}", wheels.join(", "))));
            }
            if name.starts_with("caster.") && robot.casters.is_empty() {
                return Err(lacks(key, "it has no casters".to_owned()));
            }
            if name == "floor.grip_ratio" && base.scene.floor.plane.is_none() {
                return Err(lacks(key, "it has no plane".to_owned()));
            }
        }
        Cause::from_settings(&effects(self.plan.settings(point)), &base.scene)
            .map(|_| ())
            .map_err(|source| SweepError::Scene { file: self.plan.file.clone(), source })
    }
}

/// Settings of effects as [`Cause::from_settings`] takes them: what varies comes in the place of what is set everywhere.
fn effects<'a>(settings: impl Iterator<Item = (&'a Key, &'a Value)>) -> Vec<String> {
    let mut latest: Vec<(&str, String)> = Vec::new();
    for (key, value) in settings {
        if !matches!(key.target, Target::Effect(..) | Target::Choice) {
            continue;
        }
        let text = match value {
            Value::Number(value) => value.to_string(),
            Value::Text(text) => text.clone(),
        };
        match latest.iter_mut().find(|(known, _)| *known == key.name()) {
            Some((_, known)) => *known = text,
            None => latest.push((key.name(), text)),
        }
    }
    latest.into_iter().map(|(key, text)| format!("{key}={text}")).collect()
}

/// A sum over everything that is physically so, wherever its files lie.
fn fingerprint(bases: &[Base]) -> String {
    let mut sum = crc32fast::Hasher::new();
    for base in bases {
        let mut scene = base.scene.clone();
        scene.robot.file = PathBuf::new();
        scene.robot.notes.clear();
        scene.floor.file = PathBuf::new();
        sum.update(format!("{scene:?}").as_bytes());
    }
    format!("{:08x}", sum.finalize())
}

/// Points that could not be done, and why.
fn failures(records: &[Record]) -> Vec<(usize, String)> {
    let failure = |(index, cells): &Record| match cells.last() {
        Some(Cell::Text(failure)) => Some((*index, failure.clone())),
        _ => None,
    };
    records.iter().filter_map(failure).collect()
}

/// The table of all points, which `records` hold in order.
fn table(plan: &Plan, header: &Header, records: Vec<Record>) -> Table {
    let mut columns = plan.columns();
    columns.extend(point::columns(plan.kind));
    let rows = records.into_iter().map(|(index, cells)| {
        let point = plan.point(index);
        let mut row = vec![Cell::Whole(index as u64), Cell::Whole(point.repeat as u64), Cell::Whole(point.seed)];
        row.extend(point.values.into_iter().map(|value| match value {
            Value::Number(value) => Cell::number(value),
            Value::Text(text) => Cell::Text(text),
        }));
        row.extend(cells);
        row
    });
    let rows = rows.collect();
    let note = |key: &str, value: &str| (format!("treadmark.{key}"), value.to_owned());
    let notes = vec![
        note("version", &header.version),
        note("seed", &plan.seed.to_string()),
        note("inputs", &header.inputs),
        note("plan", &plan.text),
    ];
    Table { columns, rows, notes }
}
