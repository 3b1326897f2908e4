//! One run from mark to mark: settle, drive, survey, log.

use super::driver::{Command, Driver};
use super::error::DriveError;
use super::observe::{Observer, SNAPSHOT_RATE, Snapshot};
use crate::dataset::{EncoderLog, EncoderUnit, PoseLog, Protocol, Run};
use crate::geometry::Pose2;
use crate::scene::{Scene, Side, Survey, Wheel};
use crate::world::{World, WorldError, steps_between};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Standstill before a run, in which tyres and bodies come to rest \[s\].
const SETTLE: f64 = 0.5;
/// How often the surveyor reads poses on the way \[Hz\].
const SURVEY_RATE: f64 = 10.0;

/// What is to be driven.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Name of the run, unique in its campaign; with the seed it draws the run's noise.
    pub name: String,
    /// What is driven.
    pub protocol: Protocol,
    /// Cruising speed \[m/s\]; `None`: the robot's own.
    pub speed: Option<f64>,
    /// Turn rate on the spot \[rad/s\]; `None`: the robot's own.
    pub turn_rate: Option<f64>,
}

/// A run as simulated: what a lab would have noted of it, and what only a simulation knows.
#[derive(Debug, Clone)]
pub struct SimulatedRun {
    /// What a lab would have noted: surveyed with noise, encoders quantised.
    pub measured: Run,
    /// True end pose in the frame of the true start pose.
    pub actual: Pose2,
    /// End pose by the robot's own dead reckoning.
    pub odometry: Pose2,
    /// Simulated time from mark to mark \[s\].
    pub simulated: f64,
    /// Wall time of the step loop with logging, observers not included.
    pub wall: Duration,
    /// Steps of the loop.
    pub steps: u64,
}

impl SimulatedRun {
    /// Surveyed − dead-reckoned without survey noise: the error that a calibration is after.
    pub fn true_error(&self) -> Pose2 {
        Pose2::new(
            self.actual.x - self.odometry.x,
            self.actual.y - self.odometry.y,
            self.actual.heading - self.odometry.heading,
        )
    }
}

/// Drives `task` in `scene`. The same scene, task and `seed` give the same bits. `stop` set from outside ends the run.
///
/// # Errors
/// The world cannot be built or is left, or the run was stopped.
pub fn run(
    scene: &Scene,
    task: &Task,
    seed: u64,
    mut observer: Option<&mut dyn Observer>,
    stop: &AtomicBool,
) -> Result<SimulatedRun, DriveError> {
    let in_world = |source: WorldError| DriveError::World { run: task.name.clone(), source };
    let robot = &scene.robot;
    if task.protocol == Protocol::Path {
        return Err(DriveError::NoShape { run: task.name.clone() });
    }
    let speed = task.speed.unwrap_or(robot.driver.cruise_speed);
    let turn_rate = task.turn_rate.unwrap_or(robot.driver.turn_rate);
    let mut driver = Driver::new(&task.protocol, speed, turn_rate, &robot.driver, &robot.odometry);
    let decide_every = steps_between("the driver's rate_hz", robot.driver.rate, scene.time_step).map_err(in_world)?;
    let log_every = steps_between("the log rate", SNAPSHOT_RATE, scene.time_step).map_err(in_world)?;
    let survey_every = steps_between("the survey rate", SURVEY_RATE, scene.time_step).map_err(in_world)?;

    let mut world = World::new(scene, Pose2::IDENTITY, stream(seed, &task.name, "scatter")).map_err(in_world)?;
    for _ in 0..(SETTLE / scene.time_step).round() as u64 {
        world.step().map_err(in_world)?;
    }
    let mut logger = Logger::new(&world, driver.planned_duration());
    let mut surveyor = Surveyor::new(scene.survey, stream(seed, &task.name, "survey"), driver.planned_duration());
    let sides = Sides::new(scene);
    let zero = sides.mean(|wheel| world.ticks(wheel) as f64);

    let mut snapshots = Vec::with_capacity(robot.wheels.len());
    let mut watching = Duration::ZERO;
    let start = world.pose();
    let first_step = world.steps();
    let began = Instant::now();
    loop {
        let step = world.steps() - first_step;
        let time = step as f64 * scene.time_step;
        let mut done = false;
        if step.is_multiple_of(decide_every) {
            let ticks = sides.mean(|wheel| world.ticks(wheel) as f64);
            let command = driver.decide(time, ticks[0] - zero[0], ticks[1] - zero[1]);
            done = command.is_none();
            let Command { left, right } = command.unwrap_or_default();
            for (wheel, side) in sides.of_wheel.iter().enumerate() {
                world.command(wheel, if *side == Side::Left { left } else { right });
            }
        }
        if step.is_multiple_of(log_every) || done {
            logger.log(&world, time);
            if let Some(observer) = observer.as_deref_mut() {
                let began = Instant::now();
                world.wheel_snapshots(&mut snapshots);
                observer.observe(&Snapshot {
                    time,
                    base: world.base(),
                    truth: start.relative(world.pose()),
                    odometry: driver.believed(),
                    wheels: &snapshots,
                });
                watching += began.elapsed();
            }
            if stop.load(Ordering::Relaxed) {
                return Err(DriveError::Interrupted { run: task.name.clone() });
            }
        }
        if step.is_multiple_of(survey_every) || done {
            surveyor.read(time, start.relative(world.pose()));
        }
        if done {
            break;
        }
        world.step().map_err(in_world)?;
    }
    let wall = began.elapsed() - watching;
    let actual = start.relative(world.pose());
    let encoders = logger.finish();
    let mut run = Run {
        name: task.name.clone(),
        protocol: task.protocol,
        speed: Some(speed),
        turn_rate: matches!(task.protocol, Protocol::Square { .. } | Protocol::Spin { .. }).then_some(turn_rate),
        started: None,
        start: None,
        end: None,
        odometry_end: None,
        encoders: Some(encoders),
        poses: None,
    };
    let odometry = run.dead_reckoned_end(&robot.odometry).unwrap_or_default();
    run.odometry_end = Some(noted(odometry).into());
    surveyor.write(&mut run);
    Ok(SimulatedRun {
        measured: run,
        actual,
        odometry,
        simulated: (world.steps() - first_step) as f64 * scene.time_step,
        wall,
        steps: world.steps() - first_step,
    })
}

/// The random stream of one purpose of one run: adding a run or a purpose moves no other.
fn stream(seed: u64, run: &str, purpose: &str) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(fnv1a(&[run, "/", purpose]));
    rng
}

/// The seed of one campaign of several under a common `seed`: another campaign has fresh noise.
pub fn derived_seed(seed: u64, campaign: &str) -> u64 {
    seed ^ fnv1a(&[campaign])
}

/// FNV-1a: a hash that is the same in every version and on every platform, which the standard library's is not.
fn fnv1a(parts: &[&str]) -> u64 {
    let bytes = parts.iter().flat_map(|part| part.bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

/// Which wheels make a side.
struct Sides {
    of_wheel: Vec<Side>,
    count: [f64; 2],
}

impl Sides {
    fn new(scene: &Scene) -> Sides {
        let of_wheel: Vec<Side> = scene.robot.wheels.iter().map(|wheel| wheel.side).collect();
        let left = of_wheel.iter().filter(|side| **side == Side::Left).count();
        Sides { count: [left as f64, (of_wheel.len() - left) as f64], of_wheel }
    }

    /// Mean of `value` over the wheels of the left and of the right side.
    fn mean(&self, value: impl Fn(usize) -> f64) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for (wheel, side) in self.of_wheel.iter().enumerate() {
            sum[usize::from(*side == Side::Right)] += value(wheel);
        }
        [sum[0] / self.count[0], sum[1] / self.count[1]]
    }
}

/// Logs the encoders, one channel a wheel.
struct Logger {
    log: EncoderLog,
    zero: Vec<i64>,
}

impl Logger {
    fn new(world: &World, duration: f64) -> Logger {
        let wheels = &world.scene().robot.wheels;
        // A driver that lags behind its plan takes longer; a quarter more spares the step loop any allocation.
        let rows = (1.25 * duration * SNAPSHOT_RATE) as usize + 100;
        Logger {
            zero: (0..wheels.len()).map(|wheel| world.ticks_now(wheel)).collect(),
            log: EncoderLog {
                unit: EncoderUnit::Ticks,
                channels: wheels.iter().map(channel).collect(),
                time: Vec::with_capacity(rows),
                counts: Vec::with_capacity(rows * wheels.len()),
            },
        }
    }

    fn log(&mut self, world: &World, time: f64) {
        self.log.time.push(time);
        let counts = self.zero.iter().enumerate().map(|(wheel, zero)| (world.ticks_now(wheel) - zero) as f64);
        self.log.counts.extend(counts);
    }

    fn finish(self) -> EncoderLog {
        self.log
    }
}

/// A pose as it is noted down: to a tenth of a micrometre and of a microradian.
fn noted(pose: Pose2) -> Pose2 {
    let round = |value: f64| (value * 1e7).round() / 1e7 + 0.0;
    Pose2::new(round(pose.x), round(pose.y), round(pose.heading))
}

/// Column of a wheel's encoder: its name, which has to end in its side.
fn channel(wheel: &Wheel) -> String {
    let side = if wheel.side == Side::Left { "left" } else { "right" };
    if wheel.name.ends_with(side) { wheel.name.clone() } else { format!("{}_{side}", wheel.name) }
}

/// Reads true poses with noise. The start is a reading like any other, and every pose is stated in its frame.
struct Surveyor {
    survey: Survey,
    rng: ChaCha8Rng,
    start: Option<Pose2>,
    log: PoseLog,
}

impl Surveyor {
    fn new(survey: Survey, rng: ChaCha8Rng, duration: f64) -> Surveyor {
        let rows = (1.25 * duration * SURVEY_RATE) as usize + 20;
        let log = PoseLog { time: Vec::with_capacity(rows), poses: Vec::with_capacity(rows) };
        Surveyor { survey, rng, start: None, log }
    }

    fn read(&mut self, time: f64, truth: Pose2) {
        let reading = Pose2::new(
            truth.x + self.survey.position_std * self.normal(),
            truth.y + self.survey.position_std * self.normal(),
            truth.heading + self.survey.heading_std * self.normal(),
        );
        let start = *self.start.get_or_insert(noted(reading));
        self.log.time.push(time);
        self.log.poses.push(noted(start.relative(reading)).into());
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.rng)
    }

    /// The last reading is the end of the run.
    fn write(self, run: &mut Run) {
        run.start = self.start;
        run.end = self.log.poses.last().copied();
        run.poses = Some(self.log);
    }
}
