//! Windows: runs that are cut out of one long drive, begin and end in motion, by clocks that disagree.

use crate::diagnosis::{cause, diagnosed, names};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use std::sync::atomic::AtomicBool;
use treadmark::dataset::{Campaign, Dataset, EncoderLog, EncoderUnit, PoseLog, Protocol, Run, SurveyFacts};
use treadmark::drive;
use treadmark::experiment::Simulator;
use treadmark::geometry::Pose2;
use treadmark::scene::Scene;

/// Between rows of encoders, and of poses \[s\].
const ROW: f64 = 0.05;
/// Rows of a command to the wheels, and of a window.
const ROWS: [usize; 2] = [120, 40];
/// 1 σ of a reading \[m, rad\].
const SURVEY: [f64; 2] = [0.003, 0.004];

fn path(name: String, counts: Vec<f64>, poses: Option<PoseLog>) -> Run {
    let time = (0..counts.len() / 2).map(|row| ROW * row as f64).collect();
    let channels = ["left", "right"].map(str::to_owned).to_vec();
    Run {
        name,
        protocol: Protocol::Path,
        speed: None,
        turn_rate: None,
        started: None,
        start: None,
        end: None,
        odometry_end: None,
        encoders: Some(EncoderLog { unit: EncoderUnit::Radians, channels, time, counts }),
        poses,
    }
}

/// Windows of a drive in `world` by random commands, each reached in half a second; poses have stamps that are later than the
/// encoders' by `offset` \[s\].
fn windows(world: &Scene, commands: usize, offset: f64) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let speeds = Uniform::new(-0.6, 2.4).expect("a range");
    let (mut speed, mut angle, mut counts) = ([0.0f64; 2], [0.0; 2], Vec::new());
    for _ in 0..commands {
        let command = [0, 1].map(|_| speeds.sample(&mut rng));
        let from = speed;
        for row in 0..ROWS[0] {
            counts.extend(angle);
            let part = ((row as f64 + 0.5) * ROW / 0.5).min(1.0);
            for side in 0..2 {
                speed[side] = from[side] + part * (command[side] - from[side]);
                angle[side] += speed[side] * ROW;
            }
        }
    }
    let drive = path("drive".to_owned(), counts.clone(), None);
    let trace =
        drive::replay(world, &drive, &world.robot.odometry, &AtomicBool::new(false)).expect("it can be replayed");
    let mut noise = |std_dev: f64| -> f64 { std_dev * Distribution::<f64>::sample(&StandardNormal, &mut rng) };
    // The first window has no drive before it, the last none after it.
    let runs = (1..commands * ROWS[0] / ROWS[1] - 1).map(|window| {
        let first = window * ROWS[1];
        let read: Vec<Pose2> = (0..ROWS[1])
            .map(|row| {
                let pose = trace.at((first + row) as f64 * ROW - offset);
                Pose2::new(pose.x + noise(SURVEY[0]), pose.y + noise(SURVEY[0]), pose.heading + noise(SURVEY[1]))
            })
            .collect();
        let poses = PoseLog {
            time: (0..ROWS[1]).map(|row| row as f64 * ROW).collect(),
            poses: read.iter().map(|&pose| read[0].relative(pose).into()).collect(),
        };
        path(format!("{window}"), counts[2 * first..2 * (first + ROWS[1])].to_vec(), Some(poses))
    });
    let runs = runs.collect();
    let [position_std, heading_std] = SURVEY.map(Some);
    let survey = SurveyFacts { method: None, position_std, heading_std };
    let odometry = Some(world.robot.odometry);
    Dataset { campaign: Campaign { name: "windows".to_owned(), survey, odometry, ..Campaign::default() }, runs }
}

/// A robot goes on beyond the first and the last row of a log that was cut: clocks that are a tenth of a second apart have poses
/// read there, and what winds up while a turn begins is told from them.
#[test]
fn what_a_cut_drive_does_beyond_its_rows_is_no_cause() {
    let mut given = Scene::load("husky_a200", "lab_floor").expect("shipped");
    given.time_step = Simulator::TIME_STEP;
    let wind_up = 0.008;
    let offset = -0.1;
    let found = diagnosed(&given, &windows(&cause("drivetrain_wind_up", wind_up).edit(&given), 12, offset));
    assert_eq!(names(&found), ["drivetrain_wind_up", "survey_time_offset"], "{:#?}", found.ranking);
    let truths: [&[f64]; 2] = [&[wind_up], &[offset, 0.0]];
    for (finding, truths) in found.findings.iter().zip(truths) {
        for (parameter, truth) in finding.parameters.iter().zip(truths) {
            let off = (parameter.value - truth) / parameter.std_dev.expect("it was sought");
            assert!(off.abs() < 3.0, "{:?}", found.findings);
        }
    }
}
