//! Campaigns of a challenge: what is driven, and what is noted of it.

use crate::dataset::{Campaign, Dataset, Protocol, Rotation, Run, Travel};
use crate::drive::{self, DriveError, Task};
use crate::experiment::campaign;
use crate::experiment::simulator::task_of;
use crate::scene::Scene;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::atomic::AtomicBool;

/// What the diagnosis gets to see.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataKind {
    /// Encoder logs and poses on the way.
    Logs,
    /// Where runs ended.
    EndPoints,
}

/// What is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CampaignKind {
    /// 2 m and 4 m squares, both ways, five runs each.
    Squares,
    /// A straight, spins at two rates, circles of two radii and a slow square besides.
    Full,
}

/// What a changeover between runs takes \[s\].
const CHANGEOVER: f64 = 60.0;

impl CampaignKind {
    /// What is driven: protocol, speed and turn rate over the robot's own, repeats.
    fn plan(self) -> Vec<(Protocol, f64, f64, usize)> {
        let both = [Rotation::Clockwise, Rotation::CounterClockwise];
        let mut plan = Vec::new();
        for side in [2.0, 4.0] {
            plan.extend(both.map(|direction| (Protocol::Square { side, direction }, 1.0, 1.0, 5)));
        }
        if self == CampaignKind::Full {
            plan.push((Protocol::Straight { length: 4.0, direction: Travel::Forward }, 1.0, 1.0, 5));
            for rate in [1.0, 0.5] {
                plan.extend(both.map(|direction| (Protocol::Spin { turn: 5.0 * TAU, direction }, 1.0, rate, 3)));
            }
            for radius in [0.5, 1.5] {
                plan.extend(
                    both.map(|direction| (Protocol::Circle { radius, turn: Some(TAU), direction }, 1.0, 1.0, 3)),
                );
            }
            plan.extend(both.map(|direction| (Protocol::Square { side: 2.0, direction }, 0.5, 0.5, 3)));
        }
        plan
    }

    /// The squares that are driven: side \[m\] and direction.
    pub(super) fn squares(self) -> Vec<(f64, Rotation)> {
        let square = |protocol| match protocol {
            Protocol::Square { side, direction } => Some((side, direction)),
            _ => None,
        };
        self.plan().into_iter().filter_map(|(protocol, ..)| square(protocol)).collect()
    }

    /// The runs, kinds taking turns, with the times at which they start.
    pub fn tasks(self, scene: &Scene) -> Vec<Task> {
        let driver = &scene.robot.driver;
        let plan = self.plan();
        let mut tasks = Vec::new();
        let mut clock = 0.0;
        let most = plan.iter().map(|(_, _, _, repeats)| *repeats).max().unwrap_or(0);
        for repeat in 1..=most {
            for (number, &(protocol, speed, rate, repeats)) in plan.iter().enumerate() {
                if repeat > repeats {
                    continue;
                }
                let (speed, turn_rate) = (driver.cruise_speed * speed, driver.turn_rate * rate);
                let duration =
                    drive::Driver::new(&protocol, speed, turn_rate, driver, &scene.robot.odometry).planned_duration();
                tasks.push(Task {
                    speed: Some(speed),
                    turn_rate: Some(turn_rate),
                    started: Some(clock),
                    ..Task::new(format!("{:02}-{}-{repeat}", number + 1, protocol.kind()), protocol)
                });
                clock += (duration + CHANGEOVER).round();
            }
        }
        tasks
    }
}

/// Drives a campaign in `scene`; `data` says what is noted.
pub(super) fn drive_campaign(
    scene: &Scene,
    kind: CampaignKind,
    data: DataKind,
    seed: u64,
    name: &str,
    stop: &AtomicBool,
) -> Result<Dataset, DriveError> {
    let runs = noted(scene, &kind.tasks(scene), data, seed, stop)?;
    Ok(Dataset { campaign: campaign(scene, name), runs })
}

/// Drives runs side by side; `data` says what is noted.
fn noted(scene: &Scene, tasks: &[Task], data: DataKind, seed: u64, stop: &AtomicBool) -> Result<Vec<Run>, DriveError> {
    let drive = |task| {
        let mut run = drive::run(scene, task, seed, None, stop)?.measured;
        if data == DataKind::EndPoints {
            (run.encoders, run.poses) = (None, None);
        }
        Ok(run)
    };
    tasks.par_iter().map(drive).collect()
}

/// A campaign that nobody has driven: one run a condition without noise, and how many each stands for.
///
/// # Errors
/// A run that cannot be driven.
pub fn planned(
    scene: &Scene,
    kind: CampaignKind,
    data: DataKind,
    stop: &AtomicBool,
) -> Result<(Dataset, Vec<usize>), DriveError> {
    noise_free(scene, scene, kind, data, stop)
}

/// The same of what a dataset plans, nothing of whose runs has been noted.
///
/// # Errors
/// A run that cannot be driven.
pub fn planned_as(
    dataset: &Dataset,
    scene: &Scene,
    data: DataKind,
    stop: &AtomicBool,
) -> Result<(Dataset, Vec<usize>), DriveError> {
    let drivable = dataset.runs.iter().filter(|run| run.protocol.nominal_end().is_some());
    let (runs, counts) = one_of_each(scene, drivable.map(task_of), data, stop)?;
    // It is this robot that drives, by what it believes.
    let facts = Campaign { odometry: Some(scene.robot.odometry), ..dataset.campaign.clone() };
    Ok((Dataset { campaign: facts, runs }, counts))
}

/// A campaign without noise: one run a condition, and how many of the campaign's runs it stands for. Where tyres grow, all.
pub(super) fn noise_free(
    world: &Scene,
    base: &Scene,
    kind: CampaignKind,
    data: DataKind,
    stop: &AtomicBool,
) -> Result<(Dataset, Vec<usize>), DriveError> {
    let (runs, counts) = one_of_each(world, kind.tasks(base), data, stop)?;
    let facts = Campaign { odometry: Some(base.robot.odometry), ..campaign(world, "noise-free") };
    Ok((Dataset { campaign: facts, runs }, counts))
}

/// Drives one of all tasks that are alike, without noise, and counts them.
fn one_of_each(
    world: &Scene,
    all: impl IntoIterator<Item = Task>,
    data: DataKind,
    stop: &AtomicBool,
) -> Result<(Vec<Run>, Vec<usize>), DriveError> {
    let scene = world.clone().noise_free();
    let (mut tasks, mut counts): (Vec<Task>, Vec<usize>) = (Vec::new(), Vec::new());
    for task in all {
        match tasks.iter().position(|known| known.is_alike(&task, &scene.robot)) {
            Some(known) => counts[known] += 1,
            None => {
                tasks.push(task);
                counts.push(1);
            }
        }
    }
    Ok((noted(&scene, &tasks, data, 0, stop)?, counts))
}
