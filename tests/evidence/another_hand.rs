//! A robot of another hand: kinematics alone, which share nothing with the simulator but the data format. What is hidden in
//! its logs is found all the same, though its wheels coast and wait as its maker pleased, and each day has clocks of its own.

use crate::diagnosis::{diagnosed, diagnosed_together};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::OnceLock;
use treadmark::dataset::{Campaign, Dataset, EncoderLog, EncoderUnit, PoseLog, Protocol, Rotation, Run, SurveyFacts};
use treadmark::diagnose::Found;
use treadmark::experiment::Simulator;
use treadmark::geometry::Pose2;
use treadmark::odometry::OdometryParameters;
use treadmark::scene::Scene;

/// What it believes, and how its wheels roll.
const BELIEVED: OdometryParameters = OdometryParameters {
    left_wheel_radius: RADIUS,
    right_wheel_radius: RADIUS,
    track_width: TRACK,
    ticks_per_revolution: Some(TICKS),
};
const RADIUS: f64 = 0.042;
const TRACK: f64 = 0.2;
const TICKS: f64 = 2796.8;
/// A step \[s\], and how many make a row of the encoders' log and of the poses'.
const STEP: f64 = 0.01;
const ROW: usize = 5;
const POSE: usize = 10;
/// Speed and acceleration of a wheel \[rad/s, rad/s²\].
const SPEED: f64 = 2.4;
const ACCELERATION: f64 = 4.8;
/// Noise of a reading \[m, rad\].
const SURVEY: [f64; 2] = [0.5e-3, 2e-3];
/// What a corner, a metre and the way of a run stray by \[rad, rad, 1\].
const SCATTER: [f64; 3] = [2.5e-3, 1e-3, 1e-3];

/// How wheels stop: they go on by an angle \[rad\] that nobody counts, in a time \[s\], and stand for another \[s\].
#[derive(Debug, Clone, Copy)]
struct Stops {
    overrun: f64,
    coast: f64,
    stand: f64,
}

/// They go on quickly, and wait for a second.
const QUICK: Stops = Stops { overrun: 0.03, coast: 0.1, stand: 1.0 };

struct Robot {
    rng: ChaCha8Rng,
    pose: Pose2,
    /// How far it goes, over what it should.
    stretched: f64,
    counted: [f64; 2],
    steps: usize,
    encoders: EncoderLog,
    poses: PoseLog,
}

impl Robot {
    fn normal(&mut self, std_dev: f64) -> f64 {
        let normal: f64 = StandardNormal.sample(&mut self.rng);
        std_dev * normal
    }

    /// Turns the wheels by `angles` \[rad\] in a step, whereby the body turns `off` \[rad\] more.
    fn step(&mut self, angles: [f64; 2], off: f64, counts: bool) {
        let [left, right] = angles;
        let further = 0.5 * (left + right) * (self.stretched - 1.0);
        let moved = BELIEVED.advance(self.pose, left + further, right + further);
        self.pose = Pose2::new(moved.x, moved.y, moved.heading + off);
        if counts {
            self.counted = [0, 1].map(|side| self.counted[side] + angles[side]);
        }
        self.steps += 1;
        self.note();
    }

    fn note(&mut self) {
        let time = self.steps as f64 * STEP;
        if self.steps.is_multiple_of(ROW) {
            self.encoders.time.push(time);
            self.encoders.counts.extend(self.counted.map(|angle| (angle / TAU * TICKS).floor()));
        }
        if self.steps.is_multiple_of(POSE) {
            let Pose2 { x, y, heading } = self.pose;
            let read = [x, y].map(|value| value + self.normal(SURVEY[0]));
            let heading = heading + self.normal(SURVEY[1]);
            self.poses.time.push(time);
            self.poses.poses.push(Pose2::new(read[0], read[1], heading).into());
        }
    }

    /// Turns each wheel by `way` \[rad\] in its own direction, up to speed and down, and stops.
    fn leg(&mut self, way: f64, directions: [f64; 2], stops: Stops) {
        let ramp = SPEED / ACCELERATION;
        let steps = ((way / SPEED + ramp) / STEP).round();
        let total = steps * STEP;
        let gone = |time: f64| match (time < ramp, total - time < ramp) {
            (true, _) => 0.5 * ACCELERATION * time * time,
            (_, true) => way - 0.5 * ACCELERATION * (total - time) * (total - time),
            _ => SPEED * (time - 0.5 * ramp),
        };
        let turns = directions[0] != directions[1];
        let at_corner = self.normal(SCATTER[0]);
        for step in 0..steps as usize {
            let angle = gone((step + 1) as f64 * STEP) - gone(step as f64 * STEP);
            let off = if turns { at_corner * angle / way } else { self.normal(SCATTER[1]) * (RADIUS * angle).sqrt() };
            self.step(directions.map(|direction| direction * angle), off, true);
        }
        let coasting = (stops.coast / STEP).round();
        for _ in 0..coasting as usize {
            self.step(directions.map(|direction| direction * stops.overrun / coasting), 0.0, false);
        }
        for _ in 0..(stops.stand / STEP).round() as usize {
            self.step([0.0; 2], 0.0, false);
        }
    }
}

/// A square of `side` \[m\].
fn square(name: usize, side: f64, direction: Rotation, stops: Stops) -> Run {
    let mut robot = Robot {
        rng: ChaCha8Rng::seed_from_u64(name as u64),
        pose: Pose2::IDENTITY,
        stretched: 1.0,
        counted: [0.0; 2],
        steps: 0,
        encoders: EncoderLog {
            unit: EncoderUnit::Ticks,
            channels: ["left", "right"].map(str::to_owned).into(),
            time: Vec::new(),
            counts: Vec::new(),
        },
        poses: PoseLog { time: Vec::new(), poses: Vec::new() },
    };
    robot.stretched += robot.normal(SCATTER[2]);
    robot.note();
    let (way, corner) = (side / RADIUS, FRAC_PI_2 * (0.5 * TRACK) / RADIUS);
    for _ in 0..4 {
        robot.leg(way, [1.0; 2], stops);
        robot.leg(corner, [-direction.sign(), direction.sign()], stops);
    }
    let start = robot.poses.poses[0];
    let start = Pose2::new(start.x, start.y, start.heading.expect("read"));
    for pose in &mut robot.poses.poses {
        *pose = start.relative(Pose2::new(pose.x, pose.y, pose.heading.expect("read"))).into();
    }
    Run {
        name: name.to_string(),
        protocol: Protocol::Square { side, direction },
        speed: Some(0.1),
        turn_rate: Some(1.0),
        started: None,
        start: None,
        end: robot.poses.poses.last().copied(),
        odometry_end: None,
        encoders: Some(robot.encoders),
        poses: Some(robot.poses),
    }
}

/// Squares of 1 m and 2 m, five a way round.
fn campaign(first: usize, stops: Stops) -> Dataset {
    let driven = (0..20).map(|number| {
        let direction = if number % 2 == 0 { Rotation::Clockwise } else { Rotation::CounterClockwise };
        square(first + number, if number % 4 < 2 { 1.0 } else { 2.0 }, direction, stops)
    });
    let survey = SurveyFacts { method: None, position_std: Some(SURVEY[0]), heading_std: Some(SURVEY[1]) };
    let campaign = Campaign { name: "another".into(), odometry: Some(BELIEVED), survey, ..Default::default() };
    Dataset { campaign, runs: driven.collect() }
}

fn shipped() -> Scene {
    Scene { time_step: Simulator::TIME_STEP, ..Scene::load("optiodom", "lab_floor").expect("shipped") }
}

/// The shipped model, extended on a campaign of the robot without any overrun.
fn known() -> &'static Scene {
    static KNOWN: OnceLock<Scene> = OnceLock::new();
    KNOWN.get_or_init(|| diagnosed(&shipped(), &campaign(0, Stops { overrun: 0.0, ..QUICK })).extended(&shipped(), 0.0))
}

/// Wheels go on by 0.03 rad as soon as they have stopped: quickly, and wait for a second; or slowly, and go on at once. No
/// log tells which. The model knows the robot from a campaign without.
#[test]
fn an_overrun_is_found_however_wheels_coast() {
    let slow = Stops { coast: 0.4, stand: 0.0, ..QUICK };
    let model = known();
    for (first, stops) in [(100, QUICK), (200, slow)] {
        let found = diagnosed(model, &campaign(first, stops));
        let [overrun] = &found.findings[..] else { panic!("{:#?}", found.findings) };
        assert_eq!((overrun.effect, &overrun.confounded_with[..]), ("stop_overrun", &[][..]));
        let angle = overrun.parameters[0];
        let std_dev = angle.std_dev.expect("it was sought");
        assert!((angle.value - 0.03).abs() < 3.0 * std_dev && std_dev < 0.003, "{angle:?}");
    }
}

/// Two days of the same robot: the clocks of poses and encoders disagree on each, and by other amounts. Neither day's clock
/// blurs the other's, and what the robot does on both is found beside them.
#[test]
fn each_campaign_has_clocks_of_its_own() {
    let model = known();
    let days = [("one day", 300, -0.06), ("another", 400, 0.09)].map(|(name, first, offset)| {
        let mut day = campaign(first, QUICK);
        day.campaign.name = name.into();
        let logs = day.runs.iter_mut().filter_map(|run| run.poses.as_mut());
        logs.flat_map(|log| &mut log.time).for_each(|stamp| *stamp += offset);
        (day, offset)
    });
    let found = diagnosed_together(model, &days.each_ref().map(|(day, _)| day.clone()));
    let mut names: Vec<&str> = found.findings.iter().map(|finding| finding.effect).collect();
    names.sort_unstable();
    assert_eq!(names, ["stop_overrun", "survey_time_offset"], "{:#?}", found.findings);
    for finding in &found.findings {
        let truth = if finding.effect == "stop_overrun" { 0.03 } else { 0.5 * (days[0].1 + days[1].1) };
        let Found { value, std_dev, .. } = finding.parameters[0];
        assert!((value - truth).abs() < 3.0 * std_dev.expect("it was sought"), "{finding:#?}");
    }
    assert_eq!(found.clocks.len(), days.len());
    for (clock, (day, offset)) in found.clocks.iter().zip(&days) {
        assert_eq!(clock.campaign, day.campaign.name);
        assert!((clock.offset - offset).abs() < 3.0 * clock.std_dev && clock.std_dev < 0.003, "{clock:?}");
    }
}
