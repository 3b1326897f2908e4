//! One run from mark to mark: settle, drive, survey, log.

use super::driver::{Command, Driver};
use super::error::DriveError;
use super::observe::{Observer, SNAPSHOT_RATE, Snapshot};
use super::overrun::Overrun;
use crate::dataset::{EncoderLog, EncoderUnit, PoseLog, Protocol, Run};
use crate::geometry::Pose2;
use crate::scene::{Robot, Scene, Side, Survey, Wheel};
use crate::world::{World, WorldError, steps_between};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Standstill before a run, in which tyres and bodies come to rest \[s\].
pub(super) const SETTLE: f64 = 0.5;
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
    /// When it starts since the campaign began \[s\]; `None`: not noted, and taken as 0.
    pub started: Option<f64>,
    /// Where it starts in the room.
    pub start: Pose2,
}

impl Task {
    /// `protocol` at the robot's own speeds.
    pub fn new(name: impl Into<String>, protocol: Protocol) -> Task {
        Task { name: name.into(), protocol, speed: None, turn_rate: None, started: None, start: Pose2::IDENTITY }
    }

    /// Whether `robot` without noise drives it as it drives `other`: the same, from the same place, and at the same time where that
    /// changes the robot.
    pub(crate) fn is_alike(&self, other: &Task, robot: &Robot) -> bool {
        let what = |task: &Task| (task.protocol, task.speed, task.turn_rate, task.start);
        what(self) == what(other) && (robot.tyre_growth == 0.0 || self.started == other.started)
    }

    fn speed_of(&self, robot: &Robot) -> f64 {
        self.speed.unwrap_or(robot.driver.cruise_speed)
    }

    fn turn_rate_of(&self, robot: &Robot) -> f64 {
        self.turn_rate.unwrap_or(robot.driver.turn_rate)
    }
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
    let mut going = Underway::begin(scene, task, seed)?;
    let survey_every = steps_between("the survey rate", SURVEY_RATE, scene.time_step).map_err(in_world(&task.name))?;
    let (survey, duration) = (going.world.scene().survey, going.driver.planned_duration());
    let mut surveyor = Surveyor::new(survey, stream(seed, &task.name, "survey"), duration);
    let mut snapshots = Vec::with_capacity(scene.robot.wheels.len());
    let mut forks = Vec::with_capacity(scene.robot.casters.len());
    let mut watching = Duration::ZERO;
    let start = going.world.pose();
    let began = Instant::now();
    loop {
        let time = going.time();
        let done = going.decide();
        if going.is_kept() || done {
            going.logger.log(&going.world, time);
            if let Some(observer) = observer.as_deref_mut() {
                let began = Instant::now();
                going.world.wheel_snapshots(&mut snapshots);
                going.world.forks(&mut forks);
                observer.observe(&Snapshot {
                    time,
                    base: going.world.base(),
                    truth: start.relative(going.world.pose()),
                    odometry: going.driver.believed(),
                    wheels: &snapshots,
                    forks: &forks,
                });
                watching += began.elapsed();
            }
            if stop.load(Ordering::Relaxed) {
                return Err(DriveError::Interrupted { run: task.name.clone() });
            }
        }
        if going.step().is_multiple_of(survey_every) || done {
            surveyor.read(time, start.relative(going.world.pose()));
        }
        if done {
            break;
        }
        going.advance().map_err(in_world(&task.name))?;
    }
    let wall = began.elapsed() - watching;
    let actual = start.relative(going.world.pose());
    let (simulated, steps) = (going.time(), going.step());
    let robot = &scene.robot;
    let turns_on_the_spot = matches!(task.protocol, Protocol::Square { .. } | Protocol::Spin { .. });
    let mut run = Run {
        name: task.name.clone(),
        protocol: task.protocol,
        speed: Some(task.speed_of(robot)),
        turn_rate: turns_on_the_spot.then(|| task.turn_rate_of(robot)),
        started: task.started,
        start: None,
        end: None,
        odometry_end: None,
        encoders: Some(going.logger.log),
        poses: None,
    };
    let odometry = run.dead_reckoned_end(&robot.odometry).unwrap_or_default();
    run.odometry_end = Some(noted(odometry).into());
    surveyor.write(&mut run);
    run.start = run.start.map(|start| noted(task.start.compose(start)));
    Ok(SimulatedRun { measured: run, actual, odometry, simulated, wall, steps })
}

/// A run under way: the robot in its world, and the driver that closes the loop. A copy goes on as the original does.
#[derive(Clone)]
pub(super) struct Underway {
    pub world: World,
    driver: Driver,
    overrun: Overrun,
    logger: Logger,
    sides: Sides,
    /// Counts of the sides as it began.
    zero: [f64; 2],
    first_step: u64,
    decide_every: u64,
    log_every: u64,
}

impl Underway {
    /// At its start, at rest.
    pub fn begin(scene: &Scene, task: &Task, seed: u64) -> Result<Underway, DriveError> {
        if task.protocol == Protocol::Path {
            return Err(DriveError::NoShape { run: task.name.clone() });
        }
        let scene = &at_time(scene, task.started);
        let robot = &scene.robot;
        let every = |what, rate| steps_between(what, rate, scene.time_step).map_err(in_world(&task.name));
        let decide_every = every("the driver's rate_hz", robot.driver.rate)?;
        let log_every = every("the log rate", SNAPSHOT_RATE)?;
        let speeds = [task.speed_of(robot), task.turn_rate_of(robot)];
        let driver = Driver::new(&task.protocol, speeds[0], speeds[1], &robot.driver, &robot.odometry);
        let scatter = stream(seed, &task.name, "scatter");
        let mut world = World::new(scene, task.start, scatter).map_err(in_world(&task.name))?;
        for _ in 0..(SETTLE / scene.time_step).round() as u64 {
            world.step().map_err(in_world(&task.name))?;
        }
        let sides = Sides::new(scene);
        Ok(Underway {
            overrun: Overrun::new(&world),
            logger: Logger::new(&world, driver.planned_duration()),
            zero: sides.mean(|wheel| world.ticks(wheel) as f64),
            first_step: world.steps(),
            world,
            driver,
            sides,
            decide_every,
            log_every,
        })
    }

    /// Steps since it began.
    pub fn step(&self) -> u64 {
        self.world.steps() - self.first_step
    }

    /// Time since it began \[s\].
    pub fn time(&self) -> f64 {
        self.step() as f64 * self.world.scene().time_step
    }

    /// Whether this is a moment at which encoders are logged.
    pub fn is_kept(&self) -> bool {
        self.step().is_multiple_of(self.log_every)
    }

    /// Lets the driver decide where it is its turn; whether that ends the run.
    pub fn decide(&mut self) -> bool {
        let time = self.time();
        let is_its_turn = self.step().is_multiple_of(self.decide_every);
        if !is_its_turn || self.overrun.coasts(&mut self.world, &mut self.logger, time) {
            return false;
        }
        let Underway { world, driver, overrun, sides, zero, .. } = self;
        let ticks = sides.mean(|wheel| (world.ticks(wheel) - overrun.lost(wheel)) as f64);
        let command = driver.decide(time - overrun.lasted, ticks[0] - zero[0], ticks[1] - zero[1]);
        let done = command.is_none();
        let Command { left, right } = command.unwrap_or_default();
        for (wheel, side) in sides.of_wheel.iter().enumerate() {
            world.command(wheel, if *side == Side::Left { left } else { right });
        }
        overrun.after(world, driver.leg(), time);
        done
    }

    /// Moves on by one step.
    pub fn advance(&mut self) -> Result<(), WorldError> {
        let time = self.time();
        self.overrun.carry(&mut self.world, time);
        self.world.step()
    }
}

/// What went wrong, and in which run.
pub(super) fn in_world(run: &str) -> impl Fn(WorldError) -> DriveError + '_ {
    move |source| DriveError::World { run: run.to_owned(), source }
}

/// The scene when a run starts, `started` \[s\] after its campaign.
pub(super) fn at_time(scene: &Scene, started: Option<f64>) -> Scene {
    let mut scene = scene.clone();
    scene.robot = scene.robot.at(started.unwrap_or(0.0));
    scene
}

/// The random stream of one purpose of one run: adding a run or a purpose moves no other.
pub(super) fn stream(seed: u64, run: &str, purpose: &str) -> ChaCha8Rng {
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
#[derive(Clone)]
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
#[derive(Clone)]
pub(super) struct Logger {
    log: EncoderLog,
    pub zero: Vec<i64>,
    /// Whether the counters stand still whatever the wheels do.
    pub held: bool,
}

impl Logger {
    fn new(world: &World, duration: f64) -> Logger {
        let wheels = &world.scene().robot.wheels;
        // A driver that lags behind its plan takes longer; a quarter more spares the step loop any allocation.
        let rows = (1.25 * duration * SNAPSHOT_RATE) as usize + 100;
        Logger {
            held: false,
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
        if self.held {
            let last = self.log.counts.len() - self.zero.len();
            self.log.counts.extend_from_within(last..);
            return;
        }
        let counts = self.zero.iter().enumerate().map(|(wheel, zero)| (world.ticks_now(wheel) - zero) as f64);
        self.log.counts.extend(counts);
    }
}

/// A stamp as it is noted down: to a microsecond.
fn noted_stamp(time: f64) -> f64 {
    (time * 1e6).round() / 1e6 + 0.0
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
    /// Noise of the last reading in units of its σ, and when that was.
    noise: Option<(f64, [f64; 3])>,
    log: PoseLog,
}

impl Surveyor {
    fn new(mut survey: Survey, mut rng: ChaCha8Rng, duration: f64) -> Surveyor {
        let rows = (1.25 * duration * SURVEY_RATE) as usize + 20;
        let log = PoseLog { time: Vec::with_capacity(rows), poses: Vec::with_capacity(rows) };
        if survey.time_offset_std > 0.0 {
            let of_run: f64 = StandardNormal.sample(&mut rng);
            survey.time_offset += survey.time_offset_std * of_run;
        }
        Surveyor { survey, rng, start: None, noise: None, log }
    }

    /// Reads the base at `truth`, in the frame of its true start, at `time` of the encoders' clock.
    fn read(&mut self, time: f64, truth: Pose2) {
        let survey = self.survey;
        let noise = self.noise(time);
        let tracked = truth.compose(survey.base_from_tracked);
        let reading = Pose2::new(
            tracked.x + survey.position_std * noise[0],
            tracked.y + survey.position_std * noise[1],
            tracked.heading + survey.heading_std * noise[2],
        );
        let start = *self.start.get_or_insert(noted(reading));
        self.log.time.push(noted_stamp(survey.stamp(time)));
        self.log.poses.push(noted(survey.stated(start.relative(reading))).into());
    }

    /// A reading's noise in units of σ: a first-order Gauss–Markov process over the survey's correlation time.
    fn noise(&mut self, time: f64) -> [f64; 3] {
        let fresh = [self.normal(), self.normal(), self.normal()];
        let noise = match self.noise {
            Some((before, old)) if self.survey.correlation_time > 0.0 => {
                let keep = (-(time - before) / self.survey.correlation_time).exp();
                let renew = (1.0 - keep * keep).sqrt();
                std::array::from_fn(|i| keep * old[i] + renew * fresh[i])
            }
            _ => fresh,
        };
        self.noise = Some((time, noise));
        noise
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
