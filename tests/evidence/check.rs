//! `check` finds each planted mistake, and it alone, and none where none was made.

use assert_cmd::Command;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::Path;
use treadmark::calibrate::SuspicionKind as Kind;
use treadmark::calibrate::{SuspicionKind, check};
use treadmark::dataset::{
    Campaign, Dataset, DriveKind, EncoderLog, EncoderUnit, PoseLog, Protocol, RobotFacts, Rotation, Run, SurveyFacts,
    SurveyedPose, Travel,
};
use treadmark::experiment::campaign;
use treadmark::geometry::{Pose2, wrap_angle};
use treadmark::odometry::OdometryParameters;
use treadmark::scene::Scene;

use crate::rig;

const BELIEVED: OdometryParameters = OdometryParameters {
    left_wheel_radius: 0.1,
    right_wheel_radius: 0.1,
    track_width: 0.4,
    ticks_per_revolution: Some(4096.0),
};

/// A lab's campaign: five squares of 2 m each way round and two straights, a robot that believes a little wrongly,
/// scatter from run to run, a survey of 2 mm and 3 mrad.
fn clean(seed: u64) -> Dataset {
    with_track(seed, 0.412)
}

/// The same with another true track; the robot believes 0.4 m.
fn with_track(seed: u64, track: f64) -> Dataset {
    with_rows(seed, track, 5)
}

/// The same with twenty rows a second.
fn finer(seed: u64) -> Dataset {
    with_rows(seed, 0.412, 100)
}

/// The same with so many rows in the five seconds of a side or of a turn.
fn with_rows(seed: u64, track: f64, rows: usize) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut runs = Vec::new();
    for repeat in 1..=5 {
        for direction in [Rotation::Clockwise, Rotation::CounterClockwise] {
            let name = format!("{}-{repeat}", direction.as_str());
            runs.push(drive(name, Protocol::Square { side: 2.0, direction }, track, rows, &mut rng));
        }
    }
    for repeat in 1..=2 {
        let protocol = Protocol::Straight { length: 2.0, direction: Travel::Forward };
        runs.push(drive(format!("straight-{repeat}"), protocol, track, rows, &mut rng));
    }
    Dataset {
        campaign: Campaign {
            name: "lab".to_owned(),
            robot: RobotFacts {
                drive: Some(DriveKind::SkidSteer),
                nominal_wheel_diameter: Some(0.2),
                nominal_track_width: Some(0.38),
                ..RobotFacts::default()
            },
            odometry: Some(BELIEVED),
            survey: SurveyFacts { method: None, position_std: Some(0.002), heading_std: Some(0.003) },
            conditions: BTreeMap::new(),
            ..Campaign::default()
        },
        runs,
    }
}

/// Drives `protocol` by believed odometry; the truth has E_d = 1.003, a true track of `track` and a slip at every turn.
fn drive(name: String, protocol: Protocol, track: f64, rows: usize, rng: &mut ChaCha8Rng) -> Run {
    let mut normal = |std: f64| -> f64 { std * Distribution::<f64>::sample(&StandardNormal, rng) };
    let truth = OdometryParameters { right_wheel_radius: 0.1003, track_width: track, ..BELIEVED };
    let ticks = 4096.0 / TAU;
    let (mut pose, mut wheels) = (Pose2::IDENTITY, [0.0, 0.0]);
    let (mut time, mut counts, mut way) = (vec![0.0], vec![0.0, 0.0], vec![pose]);
    let mut go = |left: f64, right: f64, slip: f64| {
        let share = 1.0 / rows as f64;
        for _ in 0..rows {
            pose = truth.advance(pose, left * share, right * share);
            wheels = [wheels[0] + left * share, wheels[1] + right * share];
            time.push(time.len() as f64 * 5.0 * share);
            counts.extend(wheels.map(|angle| (angle * ticks).round()));
            way.push(pose);
        }
        pose.heading += slip;
        *way.last_mut().expect("it went") = pose;
    };
    match protocol {
        Protocol::Square { side, direction } => {
            for _ in 0..4 {
                go(side / 0.1, side / 0.1, 0.0);
                let arc = direction.sign() * FRAC_PI_2 * 0.2 / 0.1;
                go(-arc, arc, normal(0.002));
            }
        }
        Protocol::Straight { length, .. } => go(length / 0.1, length / 0.1, normal(0.002)),
        _ => unreachable!("not driven here"),
    }
    let mut read =
        |pose: Pose2| Pose2::new(pose.x + normal(0.003), pose.y + normal(0.003), pose.heading + normal(0.004));
    let end = read(pose);
    let poses = PoseLog { time: time.clone(), poses: way.into_iter().map(|pose| read(pose).into()).collect() };
    let log = EncoderLog { unit: EncoderUnit::Ticks, channels: vec!["left".into(), "right".into()], time, counts };
    Run {
        name,
        protocol,
        speed: None,
        turn_rate: None,
        started: None,
        start: None,
        end: Some(end.into()),
        odometry_end: None,
        encoders: Some(log),
        poses: Some(poses),
    }
}

fn without_logs(mut dataset: Dataset) -> Dataset {
    dataset.runs.iter_mut().for_each(|run| run.encoders = None);
    dataset
}

fn without_poses(mut dataset: Dataset) -> Dataset {
    dataset.runs.iter_mut().for_each(|run| run.poses = None);
    dataset
}

fn kinds(dataset: &Dataset) -> BTreeSet<SuspicionKind> {
    check(dataset).into_iter().map(|suspicion| suspicion.kind).collect()
}

/// Changes every surveyed end.
fn ends(dataset: &mut Dataset, change: impl Fn(SurveyedPose) -> SurveyedPose) {
    for end in dataset.runs.iter_mut().filter_map(|run| run.end.as_mut()) {
        *end = change(*end);
    }
}

fn headings(end: SurveyedPose, change: impl Fn(f64) -> f64) -> SurveyedPose {
    SurveyedPose { heading: end.heading.map(change), ..end }
}

fn mirrored(end: SurveyedPose) -> SurveyedPose {
    headings(SurveyedPose { y: -end.y, ..end }, |heading| -heading)
}

fn seen_from_end(end: SurveyedPose) -> SurveyedPose {
    Pose2::new(end.x, end.y, end.heading.expect("measured")).inverse().into()
}

fn relabelled(run: &mut Run) {
    if let Protocol::Square { direction, .. } = &mut run.protocol {
        *direction = match direction {
            Rotation::Clockwise => Rotation::CounterClockwise,
            Rotation::CounterClockwise => Rotation::Clockwise,
        };
    }
}

fn counts(dataset: &mut Dataset, change: impl Fn([f64; 2]) -> [f64; 2]) {
    for log in dataset.runs.iter_mut().filter_map(|run| run.encoders.as_mut()) {
        for row in log.counts.chunks_exact_mut(2) {
            row.copy_from_slice(&change([row[0], row[1]]));
        }
    }
}

fn odometry(dataset: &mut Dataset) -> &mut OdometryParameters {
    dataset.campaign.odometry.as_mut().expect("it has one")
}

/// Start poses anywhere in the room, with ends noted in the room.
fn in_the_room(dataset: &mut Dataset, ends_too: bool) {
    for (index, run) in dataset.runs.iter_mut().enumerate() {
        let start = Pose2::new(1.5 + 0.1 * index as f64, -0.8, 0.4 - 0.05 * index as f64);
        run.start = Some(start);
        let end = run.end.expect("surveyed");
        if ends_too {
            run.end = Some(start.compose(Pose2::new(end.x, end.y, end.heading.expect("measured"))).into());
        }
    }
}

type Plant = fn(&mut Dataset);

/// Mistakes that are found with logs and without.
const OF_THE_SURVEY: &[(&str, SuspicionKind, Plant)] = &[
    ("two labels swapped", Kind::DirectionLabel, |d| d.runs[..2].iter_mut().for_each(relabelled)),
    ("all labels swapped", Kind::DirectionLabel, |d| d.runs.iter_mut().for_each(relabelled)),
    ("one run noted with y to the right", Kind::YAxisFlipped, |d| d.runs[3].end = d.runs[3].end.map(mirrored)),
    ("y alone to the right", Kind::YAxisFlipped, |d| ends(d, |end| SurveyedPose { y: -end.y, ..end })),
    ("x backwards", Kind::XAxisFlipped, |d| ends(d, |end| SurveyedPose { x: -end.x, ..end })),
    ("x backwards on squares alone", Kind::XAxisFlipped, |d| {
        d.runs.truncate(10);
        ends(d, |end| SurveyedPose { x: -end.x, ..end });
    }),
    ("headings in degrees", Kind::HeadingDegrees, |d| ends(d, |end| headings(end, f64::to_degrees))),
    ("one heading in degrees", Kind::HeadingDegrees, |d| {
        d.runs[4].end = d.runs[4].end.map(|end| headings(end, f64::to_degrees));
    }),
    ("millimetres", Kind::PositionUnit, |d| {
        ends(d, |end| SurveyedPose { x: 1e3 * end.x, y: 1e3 * end.y, ..end });
    }),
    ("centimetres", Kind::PositionUnit, |d| {
        ends(d, |end| SurveyedPose { x: 1e2 * end.x, y: 1e2 * end.y, ..end });
    }),
    ("one run in millimetres", Kind::PositionUnit, |d| {
        d.runs[2].end = d.runs[2].end.map(|end| SurveyedPose { x: 1e3 * end.x, y: 1e3 * end.y, ..end });
    }),
    ("wheel radius off by ten", Kind::WheelRadius, |d| {
        (odometry(d).left_wheel_radius, odometry(d).right_wheel_radius) = (0.01, 0.01);
    }),
    ("diameter as radius", Kind::WheelRadius, |d| {
        (odometry(d).left_wheel_radius, odometry(d).right_wheel_radius) = (0.2, 0.2);
    }),
    ("one wheel's radius off by ten", Kind::WheelRadius, |d| odometry(d).left_wheel_radius = 1.0),
    ("track off by ten", Kind::TrackWidth, |d| odometry(d).track_width = 4.0),
    ("half the track", Kind::TrackWidth, |d| odometry(d).track_width = 0.2),
    ("an outlier", Kind::Outlier, |d| {
        d.runs[6].end = d.runs[6].end.map(|end| SurveyedPose { x: end.x + 0.25, ..end });
    }),
    ("headings wrapped", Kind::HeadingWrapped, |d| ends(d, |end| headings(end, wrap_angle))),
    ("headings wrapped to 0 … 2π", Kind::HeadingWrapped, |d| ends(d, |end| headings(end, |h| h.rem_euclid(TAU)))),
    ("ends in the room", Kind::RoomFrame, |d| in_the_room(d, true)),
    ("start and end swapped", Kind::StartEndSwapped, |d| ends(d, seen_from_end)),
    ("start and end swapped in one run", Kind::StartEndSwapped, |d| d.runs[5].end = d.runs[5].end.map(seen_from_end)),
    ("x and y columns swapped", Kind::ColumnsSwapped, |d| ends(d, |end| SurveyedPose { x: end.y, y: end.x, ..end })),
    ("x and y columns swapped, squares alone", Kind::ColumnsSwapped, |d| {
        d.runs.truncate(10);
        ends(d, |end| SurveyedPose { x: end.y, y: end.x, ..end });
    }),
    ("a row copied", Kind::CopiedRun, |d| d.runs[8].end = d.runs[4].end),
    ("a straight of the wrong length", Kind::SideLength, |d| {
        d.runs[10].protocol = Protocol::Straight { length: 20.0, direction: Travel::Forward };
    }),
    ("one direction", Kind::OneDirection, |d| d.runs.retain(|run| !run.name.starts_with("ccw"))),
    ("a single run", Kind::OneDirection, |d| d.runs.truncate(1)),
];

/// Changes every pose on the way.
fn on_the_way(dataset: &mut Dataset, change: impl Fn(SurveyedPose) -> SurveyedPose) {
    for log in dataset.runs.iter_mut().filter_map(|run| run.poses.as_mut()) {
        log.poses.iter_mut().for_each(|pose| *pose = change(*pose));
    }
}

/// Mistakes in poses on the way.
const OF_THE_WAY: &[(&str, SuspicionKind, Plant)] = &[
    ("headings on the way in degrees", Kind::WayDegrees, |d| on_the_way(d, |pose| headings(pose, f64::to_degrees))),
    ("headings on the way wrapped", Kind::WayWrapped, |d| on_the_way(d, |pose| headings(pose, wrap_angle))),
    ("headings on the way wrapped to 0 … 2π", Kind::WayWrapped, |d| {
        on_the_way(d, |pose| headings(pose, |h| h.rem_euclid(TAU)));
    }),
    ("millimetres on the way", Kind::WayUnit, |d| {
        on_the_way(d, |pose| SurveyedPose { x: 1e3 * pose.x, y: 1e3 * pose.y, ..pose });
    }),
    ("centimetres on the way of one run", Kind::WayUnit, |d| {
        let mut one = Dataset { campaign: d.campaign.clone(), runs: vec![d.runs.remove(3)] };
        on_the_way(&mut one, |pose| SurveyedPose { x: 1e2 * pose.x, y: 1e2 * pose.y, ..pose });
        d.runs.insert(3, one.runs.remove(0));
    }),
    ("a way in the room", Kind::WayRoomFrame, |d| on_the_way(d, |pose| in_a_room(pose, Pose2::new(1.5, -0.8, 0.7)))),
    ("a way in a room that is turned by a little", Kind::WayRoomFrame, |d| {
        on_the_way(d, |pose| in_a_room(pose, Pose2::new(0.0, 0.0, 0.1)));
    }),
    ("a way and no end in the room", Kind::WayRoomFrame, |d| {
        d.runs.iter_mut().for_each(|run| run.end = None);
        on_the_way(d, |pose| in_a_room(pose, Pose2::new(1.5, -0.8, 0.7)));
    }),
    ("a tracked point 0.1 m ahead, counted from the axle", Kind::WayStart, |d| {
        let ahead = |pose: SurveyedPose| {
            let (sin, cos) = pose.heading.expect("measured").sin_cos();
            SurveyedPose { x: pose.x + 0.1 * cos, y: pose.y + 0.1 * sin, ..pose }
        };
        on_the_way(d, ahead);
        ends(d, ahead);
        // What ends alone look like then is another question.
        d.runs.truncate(10);
    }),
    ("y on the way to the right", Kind::WayAcross, |d| on_the_way(d, |pose| SurveyedPose { y: -pose.y, ..pose })),
    ("x and y on the way swapped", Kind::WayAcross, |d| {
        on_the_way(d, |pose| SurveyedPose { x: pose.y, y: pose.x, ..pose });
    }),
];

fn in_a_room(pose: SurveyedPose, start: Pose2) -> SurveyedPose {
    start.compose(Pose2::new(pose.x, pose.y, pose.heading.expect("measured"))).into()
}

/// Changes every stamp of encoders, and of poses too.
fn stamps(dataset: &mut Dataset, of_poses: bool, change: impl Fn(f64) -> f64) {
    for run in &mut dataset.runs {
        let poses = run.poses.as_mut().filter(|_| of_poses).map(|log| &mut log.time);
        let all = run.encoders.as_mut().map(|log| &mut log.time).into_iter().chain(poses).flatten();
        all.for_each(|time| *time = change(*time));
    }
}

/// Changes every stamp of poses.
fn times_of_poses(dataset: &mut Dataset, change: impl Fn(f64) -> f64) {
    for log in dataset.runs.iter_mut().filter_map(|run| run.poses.as_mut()) {
        log.time.iter_mut().for_each(|time| *time = change(*time));
    }
}

/// Leaves some rows of poses.
fn rows_of_poses(dataset: &mut Dataset, stays: impl Fn(usize) -> bool) {
    for log in dataset.runs.iter_mut().filter_map(|run| run.poses.as_mut()) {
        let rows: Vec<usize> = (0..log.time.len()).filter(|row| stays(*row)).collect();
        log.time = rows.iter().map(|row| log.time[*row]).collect();
        log.poses = rows.iter().map(|row| log.poses[*row]).collect();
    }
}

/// Changes every column of counts.
fn columns(dataset: &mut Dataset, change: impl Fn(&mut [f64])) {
    for log in dataset.runs.iter_mut().filter_map(|run| run.encoders.as_mut()) {
        for channel in 0..2 {
            let mut column: Vec<f64> = log.counts.iter().skip(channel).step_by(2).copied().collect();
            change(&mut column);
            log.counts.iter_mut().skip(channel).step_by(2).zip(column).for_each(|(count, changed)| *count = changed);
        }
    }
}

/// Mistakes in rows of logs, beside poses on the way.
const OF_ROWS: &[(&str, SuspicionKind, Plant)] = &[
    ("counts since the row before", Kind::CountSteps, |d| {
        columns(d, |column| (1..column.len()).rev().for_each(|row| column[row] -= column[row - 1]));
    }),
    ("a counter of 14 bits", Kind::CountsWrapped, |d| {
        columns(d, |column| column.iter_mut().for_each(|count| *count = (*count + 500.0).rem_euclid(16_384.0)));
    }),
    ("joints that are wrapped to one turn", Kind::CountsWrapped, |d| {
        for log in d.runs.iter_mut().filter_map(|run| run.encoders.as_mut()) {
            log.unit = EncoderUnit::Radians;
            log.counts.iter_mut().for_each(|count| *count = wrap_angle(*count * TAU / 4096.0));
        }
    }),
    ("milliseconds", Kind::LogTime, |d| stamps(d, true, |time| 1e3 * time)),
    ("encoders in milliseconds", Kind::LogTime, |d| stamps(d, false, |time| 1e3 * time)),
    ("encoders by the clock of the wall", Kind::ClocksApart, |d| stamps(d, false, |time| 1.7e9 + time)),
    ("poses two seconds late", Kind::ClockOffset, |d| times_of_poses(d, |time| time + 2.0)),
    ("poses a second early", Kind::ClockOffset, |d| times_of_poses(d, |time| time - 1.0)),
    ("poses somewhat late, in centimetres", Kind::WayUnit, |d| {
        on_the_way(d, |pose| SurveyedPose { x: 1e2 * pose.x, y: 1e2 * pose.y, ..pose });
        // Within what clocks may disagree by.
        times_of_poses(d, |time| time + 0.4);
    }),
    ("a tracker that missed the first side", Kind::WayStart, |d| {
        let log = d.runs[1].poses.as_mut().expect("it has a log");
        log.time.drain(..80);
        log.poses.drain(..80);
        let first = log.poses[0];
        let start = Pose2::new(first.x, first.y, first.heading.expect("measured"));
        for pose in &mut log.poses {
            *pose = start.relative(Pose2::new(pose.x, pose.y, pose.heading.expect("measured"))).into();
        }
        d.runs[1].end = log.poses.last().copied();
    }),
    ("rows lost", Kind::LogGap, |d| {
        let log = d.runs[2].encoders.as_mut().expect("it has a log");
        log.time.drain(120..180);
        log.counts.drain(240..360);
    }),
    ("a pose of something else", Kind::WayJump, |d| {
        let poses = &mut d.runs[5].poses.as_mut().expect("it has a log").poses;
        poses[200].y += 1.0;
    }),
    ("a tracker that repeats itself", Kind::WayFrozen, |d| {
        let poses = &mut d.runs[5].poses.as_mut().expect("it has a log").poses;
        let last = poses[40];
        poses[40..100].fill(last);
    }),
];

/// Mistakes that logs are needed for.
const OF_THE_LOGS: &[(&str, SuspicionKind, Plant)] = &[
    ("encoder columns swapped", Kind::EncoderSidesSwapped, |d| counts(d, |[left, right]| [right, left])),
    ("all runs with y to the right", Kind::YAxisFlipped, |d| ends(d, mirrored)),
    ("all runs and their ways with y to the right", Kind::YAxisFlipped, |d| {
        ends(d, mirrored);
        on_the_way(d, mirrored);
    }),
    ("headings alone clockwise", Kind::HeadingSign, |d| ends(d, |end| headings(end, |heading| -heading))),
    ("left counts down", Kind::CountSignLeft, |d| counts(d, |[left, right]| [-left, right])),
    ("right counts down", Kind::CountSignRight, |d| counts(d, |[left, right]| [left, -right])),
    ("both count down", Kind::CountSignBoth, |d| counts(d, |[left, right]| [-left, -right])),
    ("ticks off by two", Kind::TicksPerRevolution, |d| odometry(d).ticks_per_revolution = Some(2048.0)),
    ("ticks off by four", Kind::TicksPerRevolution, |d| odometry(d).ticks_per_revolution = Some(1024.0)),
    ("ticks off by ten", Kind::TicksPerRevolution, |d| odometry(d).ticks_per_revolution = Some(40960.0)),
    ("ticks off by ten, no straights", Kind::TicksPerRevolution, |d| {
        odometry(d).ticks_per_revolution = Some(40960.0);
        d.runs.truncate(10);
    }),
    ("a side mistyped", Kind::SideLength, |d| {
        if let Protocol::Square { side, .. } = &mut d.runs[2].protocol {
            *side = 20.0;
        }
    }),
    ("all sides mistyped", Kind::SideLength, |d| {
        for run in &mut d.runs {
            if let Protocol::Square { side, .. } = &mut run.protocol {
                *side = 4.0;
            }
        }
    }),
    ("track off by ten and no nominal facts", Kind::TrackWidth, |d| {
        d.campaign.robot = RobotFacts::default();
        odometry(d).track_width = 4.0;
    }),
    ("a straight labelled reverse", Kind::DirectionLabel, |d| {
        d.runs[11].protocol = Protocol::Straight { length: 2.0, direction: Travel::Reverse };
    }),
];

#[test]
fn each_planted_mistake_is_found_and_no_other() {
    for seed in 0..20 {
        let campaign = clean(seed);
        let bare = without_logs(campaign.clone());
        let planted = |dataset: &Dataset, what: &str, kind: SuspicionKind, plant: Plant| {
            let mut dataset = dataset.clone();
            plant(&mut dataset);
            let found = check(&dataset);
            let words: Vec<String> =
                found.iter().map(|suspicion| format!("{:?}: {suspicion}", suspicion.kind)).collect();
            assert!(found.len() == 1 && found[0].kind == kind, "seed {seed}: {what}: {words:#?}");
        };
        for dataset in [&campaign, &bare, &without_poses(campaign.clone())] {
            assert_eq!(check(dataset), vec![], "seed {seed}");
            OF_THE_SURVEY.iter().for_each(|(what, kind, plant)| planted(dataset, what, *kind, *plant));
        }
        for dataset in [&campaign, &bare] {
            OF_THE_WAY.iter().for_each(|(what, kind, plant)| planted(dataset, what, *kind, *plant));
        }
        OF_ROWS.iter().for_each(|(what, kind, plant)| planted(&finer(seed), what, *kind, *plant));
        assert_eq!(check(&finer(seed)), vec![], "seed {seed}");
        OF_THE_LOGS.iter().for_each(|(what, kind, plant)| planted(&campaign, what, *kind, *plant));
    }
}

/// What holds of a campaign that is unusual and right.
#[test]
fn nothing_is_said_of_what_is_right() {
    let right: &[(&str, Plant)] = &[
        ("start poses", |d| in_the_room(d, false)),
        ("no headings", |d| ends(d, |end| SurveyedPose { heading: None, ..end })),
        ("no odometry", |d| d.campaign.odometry = None),
        ("no facts", |d| d.campaign.robot = RobotFacts::default()),
        ("nothing surveyed", |d| d.runs.iter_mut().for_each(|run| run.end = None)),
        ("no survey noise stated", |d| d.campaign.survey = SurveyFacts::default()),
        ("three runs each way", |d| d.runs.truncate(6)),
        ("noted to the centimetre, without headings", |d| {
            let rounded = |value: f64| (100.0 * value).round() / 100.0;
            ends(d, |end| SurveyedPose { x: rounded(end.x), y: rounded(end.y), heading: None });
            d.campaign.survey.position_std = Some(0.005);
        }),
        ("the effective track of a skid-steer robot", |d| odometry(d).track_width = 0.8),
        ("believes half of what it turns by", |d| *d = with_track(3, 0.8)),
        ("believes a third too little", |d| *d = with_track(4, 0.58)),
        ("believes too much", |d| *d = with_track(5, 0.28)),
        ("poses by threes at stops alone", |d| {
            *d = finer(6);
            rows_of_poses(d, |row| row % 100 < 3);
        }),
        ("a pose now and then, the first on the way", |d| {
            *d = finer(7);
            rows_of_poses(d, |row| row % 90 == 8);
        }),
    ];
    for seed in 0..20 {
        for (what, change) in right {
            let mut dataset = clean(seed);
            change(&mut dataset);
            assert_eq!(check(&dataset), vec![], "seed {seed}: {what}");
            assert_eq!(check(&without_logs(dataset)), vec![], "seed {seed}: {what}, without logs");
        }
    }
}

/// Five hundred campaigns without a mistake.
#[test]
fn scatter_alone_is_not_suspicious() {
    let suspected = (100..600).filter(|seed| !check(&without_logs(clean(*seed))).is_empty()).count();
    assert!(suspected <= 2, "{suspected} of 500; below one in a thousand is meant");
}

/// The simulated robot on skidding tyres, and mistakes planted into what it did.
#[test]
fn a_simulated_campaign_is_clean_and_its_mistakes_are_found() {
    let scene = Scene::load("jnpf_4wd", "lab_floor").expect("shipped");
    let mut runs = Vec::new();
    for (repeat, direction) in [(1, Rotation::Clockwise), (2, Rotation::CounterClockwise)] {
        let run = rig::run(&scene, Protocol::Square { side: 1.0, direction });
        runs.push(Run { name: format!("{repeat}"), ..run.measured });
    }
    let simulated = Dataset { campaign: campaign(&scene, "simulated"), runs };
    assert_eq!(check(&simulated), vec![]);
    let plants: &[(Kind, Plant)] = &[
        (Kind::DirectionLabel, |d| d.runs.iter_mut().for_each(relabelled)),
        (Kind::YAxisFlipped, |d| ends(d, mirrored)),
        (Kind::XAxisFlipped, |d| ends(d, |end| SurveyedPose { x: -end.x, ..end })),
        (Kind::HeadingDegrees, |d| ends(d, |end| headings(end, f64::to_degrees))),
        (Kind::PositionUnit, |d| ends(d, |end| SurveyedPose { x: 1e3 * end.x, y: 1e3 * end.y, ..end })),
        (Kind::HeadingWrapped, |d| ends(d, |end| headings(end, wrap_angle))),
        (Kind::StartEndSwapped, |d| ends(d, seen_from_end)),
        (Kind::WheelRadius, |d| {
            (odometry(d).left_wheel_radius, odometry(d).right_wheel_radius) = (1.0, 1.0);
        }),
    ];
    for (kind, plant) in plants {
        let mut dataset = simulated.clone();
        plant(&mut dataset);
        assert_eq!(kinds(&dataset), BTreeSet::from([*kind]), "{kind:?}: {:#?}", check(&dataset));
    }
}

/// The seven real campaigns as they are, and mistakes planted into them.
#[test]
fn the_real_campaigns_are_clean_and_their_mistakes_are_found() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/measured");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        eprintln!("skipped: the real campaigns are not in {}", folder.display());
        return;
    };
    let mut seen = 0;
    for entry in entries {
        let path = entry.expect("it can be read").path();
        if !path.join("dataset.toml").is_file() {
            continue;
        }
        let dataset = Dataset::read(&path).expect("it is strict");
        let name = dataset.campaign.name.clone();
        assert_eq!(check(&dataset), vec![], "{name}");
        seen += 1;
        let planted = |plant: Plant, allowed: &[Kind]| {
            let mut dataset = dataset.clone();
            plant(&mut dataset);
            let found = kinds(&dataset);
            assert!(
                found.len() == 1 && found.iter().all(|kind| allowed.contains(kind)),
                "{name}: {found:?} not {allowed:?}"
            );
        };
        // Paths have no label: that encoders and survey disagree is all that can be said, but for what poses on the way show.
        planted(|d| counts(d, |[l, r]| [r, l]), &[Kind::EncoderSidesSwapped, Kind::TurnDisagrees]);
        planted(|d| counts(d, |[l, r]| [-l, -r]), &[Kind::CountSignBoth]);
        planted(
            |d| {
                ends(d, mirrored);
                on_the_way(d, mirrored);
            },
            &[Kind::YAxisFlipped, Kind::TurnDisagrees],
        );
        planted(|d| counts(d, |[l, r]| [-l, r]), &[Kind::CountSignLeft]);
        planted(|d| counts(d, |[l, r]| [l, -r]), &[Kind::CountSignRight]);
        planted(|d| ends(d, |end| headings(end, f64::to_degrees)), &[Kind::HeadingDegrees]);
        planted(
            |d| {
                let odometry = odometry(d);
                odometry.left_wheel_radius *= 10.0;
                odometry.right_wheel_radius *= 10.0;
            },
            &[Kind::WheelRadius],
        );
        planted(|d| odometry(d).track_width *= 10.0, &[Kind::TrackWidth]);
        planted(|d| ends(d, |end| SurveyedPose { x: 1e3 * end.x, y: 1e3 * end.y, ..end }), &[Kind::PositionUnit]);
        if name.contains("square") {
            planted(|d| ends(d, mirrored), &[Kind::YAxisFlipped]);
            planted(|d| d.runs.iter_mut().for_each(relabelled), &[Kind::DirectionLabel]);
            planted(|d| ends(d, |end| headings(end, wrap_angle)), &[Kind::HeadingWrapped]);
            planted(|d| odometry(d).ticks_per_revolution = Some(2796.8 / 4.0), &[Kind::TicksPerRevolution]);
        }
    }
    assert_eq!(seen, 7);
}

fn treadmark(folder: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let mut command = Command::cargo_bin("treadmark").expect("cargo has built it");
    let output = command.current_dir(folder).args(arguments).output().expect("it starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

/// The template reads, an existing folder is left alone, filled in it is clean, and with a mistake exit code 1 says so.
#[test]
fn init_and_check_on_the_command_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    assert_eq!(treadmark(at, &["init", "lab"]).0, Some(0));
    let template = Dataset::read(&at.join("lab")).expect("the template is a dataset");
    assert_eq!(template.runs.len(), 13);
    assert!(template.runs.iter().all(|run| run.end.is_none()) && template.campaign.odometry.is_some());
    let (code, stdout, _) = treadmark(at, &["check", "lab"]);
    assert_eq!(code, Some(0), "{stdout}");
    assert!(stdout.contains("5 × square of 4 m, cw, 5 without a surveyed end"), "{stdout}");
    assert!(stdout.contains("nothing can be checked yet") && !stdout.contains("nothing looks wrong"), "{stdout}");

    let (code, stdout, stderr) = treadmark(at, &["init", "lab"]);
    assert_eq!((code, stdout.as_str()), (Some(2), ""));
    assert!(stderr.contains("lab: exists already"), "{stderr}");

    // As its README computes its example.
    let readme = std::fs::read_to_string(at.join("lab/README.md")).expect("it is there");
    assert!(readme.contains("looks 0.16 rad too far left") && readme.contains("`cw-1,square,4,cw,-0.31,-0.33,-6.12`"));
    assert!((0.16 - TAU + 6.12).abs() < 5e-3);

    let runs = std::fs::read_to_string(at.join("lab/runs.csv")).expect("it is there");
    let fill = |cw: &str, ccw: &str| {
        let mut number = 0;
        let rows: Vec<String> = runs
            .lines()
            .map(|row| {
                number += 1;
                let pose = if row.starts_with("cw-") {
                    cw
                } else if row.starts_with("ccw-") {
                    ccw
                } else if row.starts_with("straight") {
                    "3.99,0.0,0.0"
                } else {
                    return row.to_owned();
                };
                let values: Vec<f64> = pose.split(',').map(|value| value.parse().expect("a number")).collect();
                // A scatter of a few millimetres, as a lab would note.
                let off = f64::from((7 * number) % 5) * 0.004;
                format!(
                    "{},{:.3},{:.3},{:.4}",
                    row.trim_end_matches(','),
                    values[0] + off,
                    values[1] - off,
                    values[2] + off
                )
            })
            .collect();
        std::fs::write(at.join("lab/runs.csv"), rows.join("\n")).expect("it can be written");
    };
    fill("-0.2,-0.2,-6.18", "-0.16,0.17,6.20");
    let (code, stdout, _) = treadmark(at, &["check", "lab"]);
    assert_eq!(code, Some(0), "{stdout}");
    assert!(stdout.contains("nothing looks wrong") && stdout.contains("spread"), "{stdout}");

    fill("-0.2,-0.2,-354.2", "-0.16,0.17,355.4");
    let (code, stdout, stderr) = treadmark(at, &["check", "lab"]);
    assert_eq!((code, stderr.as_str()), (Some(1), ""), "{stdout}");
    assert!(stdout.contains("1 thing looks wrong") && stdout.contains("degrees"), "{stdout}");
    let (_, stdout, stderr) = treadmark(at, &["calibrate", "lab"]);
    assert!(stderr.starts_with("look at the data first: ") && stderr.contains("degrees"), "{stderr}");
    assert!(!stdout.contains("degrees"), "{stdout}");
    let (code, stdout, _) = treadmark(at, &["check", "lab", "--json"]);
    assert_eq!(code, Some(1));
    let json: serde_json::Value = serde_json::from_str(&stdout).expect("stdout is JSON alone");
    assert_eq!(json["suspicions"][0]["kind"], "heading_degrees");
    assert_eq!(json["suspicions"][0]["runs"].as_array().map(Vec::len), Some(10));

    let (code, stdout, stderr) = treadmark(at, &["check", "nowhere"]);
    assert_eq!((code, stdout.as_str()), (Some(2), ""));
    assert!(stderr.contains("dataset.toml: cannot be read"), "{stderr}");
}

/// Logs without a survey are looked at too, and what is wrong with them is said to whoever predicts from them.
#[test]
fn logs_without_a_survey_are_looked_at() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let scene = Scene::load("jnpf_4wd", "lab_floor").expect("shipped");
    let run = rig::run(&scene, Protocol::Square { side: 1.0, direction: Rotation::Clockwise });
    let mut dataset = Dataset { campaign: campaign(&scene, "logged"), runs: vec![run.measured] };
    let run = &mut dataset.runs[0];
    (run.start, run.end, run.odometry_end, run.poses) = (None, None, None, None);
    dataset.write(&at.join("whole")).expect("it can be written");
    let (code, stdout, _) = treadmark(at, &["check", "whole"]);
    assert_eq!(code, Some(0));
    assert!(stdout.contains("nothing looks wrong with the logs; no run has a surveyed end"), "{stdout}");

    // A second of the first side.
    let log = dataset.runs[0].encoders.as_mut().expect("it has a log");
    let (from, until) = [1.0, 2.0].map(|time| log.time.partition_point(|at| *at < time)).into();
    let width = log.channels.len();
    log.time.drain(from..until);
    log.counts.drain(width * from..width * until);
    dataset.write(&at.join("gap")).expect("it can be written");
    let (code, stdout, _) = treadmark(at, &["check", "gap"]);
    assert_eq!(code, Some(1));
    assert!(stdout.contains("1 thing looks wrong") && stdout.contains("Rows look lost"), "{stdout}");
    let (code, _, stderr) = treadmark(at, &["predict", "gap", "--robot", "jnpf_4wd", "--out", "predicted"]);
    assert_eq!(code, Some(0), "{stderr}");
    assert!(stderr.starts_with("look at the data first: ") && stderr.contains("Rows look lost"), "{stderr}");
    let (_, _, stderr) = treadmark(at, &["predict", "whole", "--robot", "jnpf_4wd", "--out", "also"]);
    assert!(!stderr.contains("look at the data first"), "{stderr}");
}
