//! Recordings of a real robot → dataset, and dataset → trajectories for other tools.
//!
//! A robot that already logs its wheels and is already surveyed needs no new driving: an MCAP bag (`bag`, `cdr`), a TUM
//! trajectory beside a table of encoders (`tum`, `table`) become the runs of a [`Dataset`]. All formats meet in one
//! `Log`: wheel rotation and poses, each stamped by its own clock in whole nanoseconds. From there on one way:
//!
//! 1. **Mend** what can only be read in one way (a counter that ran over, a reading that came one place late), find what
//!    cannot (clocks that were set, counters that began anew, gaps), and say all of it: a [`Finding`] each. Poses whose
//!    clock is far from that of the wheels are brought to it (`clocks`).
//! 2. **Cut** at standstills, and where a clock or a counter leaves no connection.
//! 3. **Recognise** squares, straights, spins and circles in the dead-reckoned path, unless a table states what was
//!    driven.
//! 4. **Re-express** poses in the frame of the run's first one, headings unwrapped; stamps since the run's first reading
//!    of the wheels. An offset of the two clocks of up to half a second stays as it is: finding it is the diagnosis' affair.
//!
//! Nothing is invented: what the robot believed and how well it was surveyed are given or stay blank, a unit is named or
//! refused, a topic that may be the robot's own odometry is not taken for a survey unless somebody says so.
//!
//! Validated by `import` in the tests: bags and tables of a simulated campaign come back as it was; and by
//! `tests/cross_check`, where an independent library writes the bags.

mod bag;
mod cdr;
mod clocks;
mod cut;
mod error;
mod finding;
mod log;
mod mend;
mod shape;
mod stamp;
mod table;
mod tum;

pub use error::{ImportError, MessageProblem, PoseProblem, Readable, TableProblem};
pub use finding::Finding;
pub use tum::{Trajectory, export};

use crate::dataset::{Campaign, Dataset, EncoderLog, EncoderUnit, PoseLog, Protocol, Run};
use crate::geometry::{Pose2, wrap_angle};
use crate::odometry::OdometryParameters;
use cut::Stretch;
use log::{Log, span};
use stamp::{Nanoseconds, seconds};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// Wheels that turn by no more between two standstills have driven no run \[rad\].
const NUDGE: f64 = 0.1;

/// What to take from recordings, and what they do not tell.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Topic of the encoders; `None`: the only one that fits.
    pub encoders: Option<String>,
    /// Where the surveyed poses are.
    pub pose: PoseSource,
    /// Frame and child frame of the surveyed pose, where a topic has several.
    pub frame: Option<(String, String)>,
    /// Joints of the left wheels; empty: told from their names.
    pub left: Vec<String>,
    /// Joints of the right wheels; empty: told from their names.
    pub right: Vec<String>,
    /// What joint positions count; `None`: radians, as the message has it, unless they look like ticks.
    pub unit: Option<EncoderUnit>,
    /// Whose times of a bag are taken.
    pub clock: Clock,
    /// Targets and columns of tables: `("t_s", "stamp")`.
    pub map: Vec<(String, String)>,
    /// Where a recording is cut.
    pub cut: Cut,
    /// Nominal sides of squares and lengths of straights \[m\].
    pub sides: Vec<f64>,
    /// Nominal radii of circles \[m\].
    pub radii: Vec<f64>,
    /// The file that states what was driven, and its runs; `None`: recognised.
    pub stated: Option<(PathBuf, Vec<Run>)>,
    /// What `dataset.toml` is to say; its odometry is what shapes are recognised by.
    pub campaign: Campaign,
}

/// Where surveyed poses are.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum PoseSource {
    /// In the only topic or file that fits.
    #[default]
    Found,
    /// In this topic of a bag.
    Topic(String),
    /// Nowhere: ends were measured otherwise.
    Nowhere,
}

/// Whose times of a bag are taken.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Clock {
    /// Of the headers: by who measured.
    #[default]
    Header,
    /// Of the log: by who recorded.
    Log,
}

/// Where a recording is cut into runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cut {
    /// Nowhere: a file is a run.
    Whole,
    /// Where every wheel stands still for a time.
    Standstills {
        /// At least this long \[s\]; longer than the robot pauses at a corner.
        least: f64,
    },
}

impl Cut {
    /// Longer than the pauses at the corners of real squares (up to 1.3 s), shorter than it takes to note an end pose.
    pub const DEFAULT_STANDSTILL: f64 = 3.0;
}

impl Default for Cut {
    fn default() -> Self {
        Cut::Standstills { least: Cut::DEFAULT_STANDSTILL }
    }
}

/// What became of recordings.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The runs.
    pub dataset: Dataset,
    /// What each run drove by its odometry, its sizes as they were measured; `None` without odometry.
    pub driven: Vec<Option<Protocol>>,
    /// What their owner should know.
    pub findings: Vec<Finding>,
}

/// One run, before it has a name.
struct Found {
    log: usize,
    /// When it began, by the clock of its wheels.
    began: Nanoseconds,
    run: Run,
    in_motion: [bool; 2],
}

/// Reads `files` and makes a dataset of them.
///
/// # Errors
/// A file that cannot be read or understood; a choice that is not clear or a unit that is not known; nothing that moved.
pub fn import(files: &[PathBuf], options: &Options) -> Result<Imported, ImportError> {
    let mut findings = Vec::new();
    let mut logs = read(files, options, &mut findings)?;
    let odometry = options.campaign.odometry;
    let mut runs: Vec<Found> = Vec::new();
    let mut clocks_set = false;
    for (index, log) in logs.iter_mut().enumerate() {
        log.check_clocks()?;
        let angle = match (log.wheels.unit, odometry.and_then(|odometry| odometry.ticks_per_revolution)) {
            (EncoderUnit::Radians, _) => 1.0,
            (EncoderUnit::Ticks, Some(ticks)) => TAU / ticks,
            (EncoderUnit::Ticks, None) => {
                return Err(ImportError::NoTicksPerRevolution { path: log.path.clone() });
            }
        };
        let breaks = mend::mend(log, &mut findings);
        clocks_set |= !breaks.is_empty();
        if breaks.is_empty() {
            clocks::bring_together(log, &mut findings);
        }
        let stretches = cut::cut(log, &breaks, options.cut, angle, &mut findings)?;
        runs.extend(stretches.into_iter().map(|stretch| found(log, index, stretch)));
    }
    let Some(first) = logs.first().filter(|_| !runs.is_empty()) else {
        let path = files.first().cloned().unwrap_or_default();
        return Err(ImportError::NothingMoved { path, least: NUDGE });
    };
    check_same_wheels(first, &logs)?;
    if !clocks_set && follow_each_other(&logs) {
        let began = runs.iter().map(|found| found.began).min().unwrap_or(0);
        for found in &mut runs {
            found.run.started = Some(seconds(found.began - began));
        }
    }
    name(&mut runs, &logs)?;

    if let Some((path, stated)) = &options.stated {
        state(&mut runs, path, stated)?;
    }
    let driven: Vec<Option<Protocol>> =
        runs.iter().map(|found| Some(shape::recognise(&sides(&found.run, &odometry?)?, &odometry?))).collect();
    if options.stated.is_none() {
        let known: Vec<Protocol> = driven.iter().map(|driven| driven.unwrap_or(Protocol::Path)).collect();
        for (found, protocol) in runs.iter_mut().zip(shape::as_meant(&known, &options.sides, &options.radii)) {
            found.run.protocol = protocol;
        }
        if odometry.is_none() {
            findings.push(Finding::ShapesUntold);
        }
    }
    findings.extend(tell(&runs, options));
    findings.extend(odometry.and_then(|odometry| turns_disagree(&runs, &odometry)));
    if options.pose != PoseSource::Nowhere {
        let survey = &options.campaign.survey;
        let missing = match (survey.position_std, survey.heading_std) {
            (None, None) => Some("--position-std and --heading-std are"),
            (None, Some(_)) => Some("--position-std is"),
            (Some(_), None) => Some("--heading-std is"),
            (Some(_), Some(_)) => None,
        };
        findings.extend(missing.map(|missing| Finding::NoNoise { missing }));
    }
    let dataset =
        Dataset { campaign: options.campaign.clone(), runs: runs.into_iter().map(|found| found.run).collect() };
    Ok(Imported { dataset, driven, findings })
}

/// The logs of `files`, in their order: bags one by one, tables and trajectories of one name together.
fn read(files: &[PathBuf], options: &Options, findings: &mut Vec<Finding>) -> Result<Vec<Log>, ImportError> {
    let mut logs = Vec::new();
    let mut parts: Vec<Part> = Vec::new();
    for path in files {
        if bag::is_bag(path) {
            logs.push(bag::read(path, options, findings)?);
        } else if has_ending(path, &["csv"]) {
            let table = table::read(path, &text(path)?, &options.map)?;
            if table.dropouts > 0 {
                findings.push(Finding::Dropouts { log: stem(path), count: table.dropouts });
            }
            parts.push(Part { path: path.clone(), wheels: table.wheels, poses: table.poses });
        } else if has_ending(path, &["tum", "txt"]) {
            let (poses, dropouts) = tum::read(path, &text(path)?)?;
            if dropouts > 0 {
                findings.push(Finding::Dropouts { log: stem(path), count: dropouts });
            }
            parts.push(Part { path: path.clone(), wheels: None, poses: Some(poses) });
        } else {
            // What is not there is not of a wrong kind.
            std::fs::metadata(path).map_err(|source| ImportError::Read { path: path.clone(), source })?;
            return Err(ImportError::Format { path: path.clone() });
        }
    }
    logs.extend(together(parts, options)?);
    Ok(logs)
}

/// A file that holds wheels, poses or both.
struct Part {
    path: PathBuf,
    wheels: Option<log::Wheels>,
    poses: Option<Vec<log::Row<Pose2>>>,
}

/// Puts wheels and poses of one name together; two files alone belong together whatever they are called.
fn together(parts: Vec<Part>, options: &Options) -> Result<Vec<Log>, ImportError> {
    let alone = parts.len() == 2 && parts[0].wheels.is_some() != parts[1].wheels.is_some();
    let mut order: Vec<String> = Vec::new();
    let mut by_name: BTreeMap<String, Vec<Part>> = BTreeMap::new();
    for part in parts {
        let name = if alone { String::new() } else { common_stem(&part.path) };
        if !order.contains(&name) {
            order.push(name.clone());
        }
        by_name.entry(name).or_default().push(part);
    }
    let mut logs = Vec::new();
    for name in order {
        let mut wheels: Option<(PathBuf, log::Wheels)> = None;
        let mut poses: Option<(PathBuf, Vec<log::Row<Pose2>>)> = None;
        let mut any = PathBuf::new();
        for part in by_name.remove(&name).unwrap_or_default() {
            let twice = |first: &Path, what| {
                let (first, second) = (first.to_owned(), part.path.clone());
                ImportError::Twice { first, second, what, name: name.clone() }
            };
            if let Some(rows) = part.wheels {
                if let Some((first, _)) = &wheels {
                    return Err(twice(first, "encoders"));
                }
                wheels = Some((part.path.clone(), rows));
            }
            if let Some(rows) = part.poses {
                if let Some((first, _)) = &poses {
                    return Err(twice(first, "poses"));
                }
                poses = Some((part.path.clone(), rows));
            }
            any = part.path;
        }
        let Some((path, wheels)) = wheels else { return Err(ImportError::Lacks { path: any, lacks: "encoders" }) };
        if poses.is_none() && options.pose != PoseSource::Nowhere {
            return Err(ImportError::Lacks { path, lacks: "poses" });
        }
        let name = if alone { common_stem(&path) } else { name };
        let poses = poses.filter(|_| options.pose != PoseSource::Nowhere).map_or(Vec::new(), |(_, rows)| rows);
        logs.push(Log { name, path, wheels, poses, own_arrivals: false });
    }
    Ok(logs)
}

/// Makes a run of part of a log.
fn found(log: &Log, index: usize, stretch: Stretch) -> Found {
    let rows = &log.wheels.rows[stretch.rows.clone()];
    let began = rows[0].stamp;
    let encoders = EncoderLog {
        unit: log.wheels.unit,
        channels: log.wheels.channels.clone(),
        time: rows.iter().map(|row| seconds(row.stamp - began)).collect(),
        counts: rows.iter().flat_map(|row| row.value.iter().copied()).collect(),
    };
    let surveyed = &log.poses[stretch.poses.clone()];
    let first = surveyed.first().map(|row| row.value);
    let poses = first.map(|first| PoseLog {
        time: surveyed.iter().map(|row| seconds(row.stamp - began)).collect(),
        poses: surveyed.iter().map(|row| in_nanometres(first.relative(row.value)).into()).collect(),
    });
    let run = Run {
        name: String::new(),
        protocol: Protocol::Path,
        speed: None,
        turn_rate: None,
        started: None,
        start: first.map(|first| in_nanometres(Pose2 { heading: wrap_angle(first.heading), ..first })),
        end: poses.as_ref().and_then(|log| log.poses.last().copied()),
        odometry_end: None,
        encoders: Some(encoders),
        poses,
    };
    Found { log: index, began, run, in_motion: stretch.in_motion }
}

/// Nanometres and nanoradians are far below what any survey knows, and above what a quaternion's rounding leaves: a pose
/// that was written as a decimal number comes back as that number.
fn in_nanometres(pose: Pose2) -> Pose2 {
    // Zero has no sign on paper.
    let round = |value: f64| (value * 1e9).round() / 1e9 + 0.0;
    Pose2::new(round(pose.x), round(pose.y), round(pose.heading))
}

/// All encoder logs of a dataset have the same columns.
fn check_same_wheels(first: &Log, logs: &[Log]) -> Result<(), ImportError> {
    let other =
        logs.iter().find(|log| (log.wheels.unit, &log.wheels.channels) != (first.wheels.unit, &first.wheels.channels));
    match other {
        None => Ok(()),
        Some(other) => {
            let columns = |log: &Log| (log.wheels.channels.join(", "), log.wheels.unit);
            Err(ImportError::UnlikeWheels {
                first: first.path.clone(),
                has: columns(first),
                second: other.path.clone(),
                other: columns(other),
            })
        }
    }
}

/// Whether the recordings share a clock: none begins before the other has ended.
fn follow_each_other(logs: &[Log]) -> bool {
    let mut spans: Vec<[Nanoseconds; 2]> = logs.iter().filter_map(|log| span(&log.wheels.rows)).collect();
    spans.sort_unstable();
    spans.windows(2).all(|pair| pair[0][1] <= pair[1][0])
}

/// Names runs after their recordings, with a number where a recording has several.
fn name(runs: &mut [Found], logs: &[Log]) -> Result<(), ImportError> {
    for (index, log) in logs.iter().enumerate() {
        if let Some(other) = logs[..index].iter().find(|other| other.name == log.name) {
            let (first, second, name) = (other.path.clone(), log.path.clone(), log.name.clone());
            return Err(ImportError::Twice { first, second, what: "runs", name });
        }
        let several = runs.iter().filter(|found| found.log == index).count() > 1;
        for (number, found) in runs.iter_mut().filter(|found| found.log == index).enumerate() {
            found.run.name = if several { format!("{}-{}", log.name, number + 1) } else { log.name.clone() };
        }
    }
    Ok(())
}

/// Runs are what a table states they are: by name where it names them all, else in their order.
fn state(runs: &mut [Found], path: &Path, stated: &[Run]) -> Result<(), ImportError> {
    if stated.len() != runs.len() {
        let when = |found: &Found| match found.run.started {
            Some(started) => format!("{} at {started:.1} s", found.run.name),
            None => found.run.name.clone(),
        };
        let found = runs.iter().map(when).collect();
        return Err(ImportError::RunCount { path: path.to_owned(), stated: stated.len(), found });
    }
    let place = |found: &Found| stated.iter().position(|run| run.name == found.run.name);
    if runs.iter().all(|found| place(found).is_some()) {
        runs.sort_by_key(|found| place(found));
    }
    for (found, stated) in runs.iter_mut().zip(stated) {
        let run = &mut found.run;
        run.name.clone_from(&stated.name);
        run.protocol = stated.protocol;
        run.speed = stated.speed;
        run.turn_rate = stated.turn_rate;
        run.odometry_end = stated.odometry_end;
        run.started = stated.started.or(run.started);
        run.start = stated.start.or(run.start);
        run.end = stated.end.or(run.end);
    }
    Ok(())
}

/// What is odd about some of the runs.
fn tell(runs: &[Found], options: &Options) -> Vec<Finding> {
    let named = |is_odd: &dyn Fn(&Found) -> bool| -> Option<Vec<String>> {
        let odd: Vec<String> = runs.iter().filter(|found| is_odd(found)).map(|found| found.run.name.clone()).collect();
        (!odd.is_empty()).then_some(odd)
    };
    let unseen = |found: &Found| options.pose != PoseSource::Nowhere && found.run.poses.is_none();
    let moving = |end: usize| move |found: &Found| found.run.poses.is_some() && found.in_motion[end];
    [
        named(&unseen).map(|runs| Finding::NotSurveyed { runs }),
        named(&moving(0)).map(|runs| Finding::InMotion { runs, when: ["begins", "begin"], end: "start" }),
        named(&moving(1)).map(|runs| Finding::InMotion { runs, when: ["ends", "end"], end: "end" }),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Runs that turned the other way round by their wheels than by their poses, if most did that turned at all.
fn turns_disagree(runs: &[Found], odometry: &OdometryParameters) -> Option<Finding> {
    let turns = runs.iter().filter_map(|Found { run, .. }| {
        let log = run.encoders.as_ref()?;
        let ([left, right], [last_left, last_right]) = (log.sides(0, odometry), log.sides(log.len() - 1, odometry));
        let by_wheels = (odometry.right_wheel_radius * (last_right - right)
            - odometry.left_wheel_radius * (last_left - left))
            / odometry.track_width;
        let by_poses = run.poses.as_ref()?.poses.last()?.heading?;
        // No track is believed so wrongly that a quarter of a turn is nothing.
        (by_wheels.abs().min(by_poses.abs()) > 0.5).then_some(by_wheels * by_poses < 0.0)
    });
    let (turned, disagree) = turns.fold((0, 0), |(all, not), disagrees| (all + 1, not + usize::from(disagrees)));
    (2 * disagree > turned).then_some(Finding::TurnsDisagree { disagree, turned })
}

/// Accumulated rotation of the left and right wheels \[rad\].
fn sides(run: &Run, odometry: &OdometryParameters) -> Option<Vec<[f64; 2]>> {
    let log = run.encoders.as_ref()?;
    Some((0..log.len()).map(|row| log.sides(row, odometry)).collect())
}

/// The text of a file.
fn text(path: &Path) -> Result<String, ImportError> {
    let bytes = std::fs::read(path).map_err(|source| ImportError::Read { path: path.to_owned(), source })?;
    String::from_utf8(bytes).map_err(|error| {
        let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = good.iter().filter(|byte| **byte == b'\n').count() as u64 + 1;
        ImportError::Table { path: path.to_owned(), line, problem: TableProblem::NotText }
    })
}

/// Whether a file's name ends so, in capitals or not.
fn has_ending(path: &Path, endings: &[&str]) -> bool {
    path.extension().is_some_and(|found| endings.iter().any(|ending| found.eq_ignore_ascii_case(ending)))
}

/// A file's name without its ending.
fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| path.display().to_string(), |stem| stem.to_string_lossy().trim().to_owned())
}

/// … and without what says which half of a recording it is, as exports name them.
fn common_stem(path: &Path) -> String {
    let stem = stem(path);
    [".survey", ".odometry", ".encoders", ".poses", "_encoders", "_poses"]
        .into_iter()
        .find_map(|ending| stem.strip_suffix(ending).filter(|rest| !rest.is_empty()).map(str::to_owned))
        .unwrap_or(stem)
}
