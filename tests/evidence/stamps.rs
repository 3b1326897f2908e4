//! What logs say does not hang on the clock that stamps them, on when a tracker looks, or on how often rows are kept.

use crate::diagnosis::{base, cause, diagnosed_knowing, names, off, small, squares};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use treadmark::dataset::{Dataset, EncoderLog, PoseLog, SurveyedPose};
use treadmark::diagnose::{Library, Verdict};
use treadmark::experiment::DataKind;

type Change = fn(&mut Dataset);

/// The same runs, otherwise stamped or read.
const OTHERWISE: [(&str, Change); 8] = [
    ("as they are", |_| {}),
    ("by the clock of the wall", |dataset| {
        each_log(dataset, |log, poses| {
            for time in log.time.iter_mut().chain(&mut poses.time) {
                *time += 1.7e9 + 0.000_3;
            }
        });
    }),
    ("ten counts a second", |dataset| {
        each_log(dataset, |log, _| {
            let (width, last) = (log.channels.len(), log.time.len() - 1);
            let rows: Vec<usize> = (0..=last).filter(|row| row % 5 == 0 || *row == last).collect();
            log.time = rows.iter().map(|row| log.time[*row]).collect();
            log.counts = rows.iter().flat_map(|row| log.counts[row * width..][..width].to_vec()).collect();
        });
    }),
    ("stamps that are 2 ms off from row to row", |dataset| {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        each_log(dataset, |log, poses| {
            for times in [&mut log.time, &mut poses.time] {
                let mut latest = 0.0f64;
                for time in times.iter_mut() {
                    let off: f64 = StandardNormal.sample(&mut rng);
                    latest = latest.max(*time + 0.002 * off);
                    *time = latest;
                }
            }
        });
    }),
    ("rows that are held up", |dataset| {
        let mut rng = ChaCha8Rng::seed_from_u64(10);
        each_log(dataset, |log, _| {
            let mut free = 0.0f64;
            for time in &mut log.time {
                if rng.next_u64() % 50 == 0 {
                    free = *time + 0.05;
                }
                *time = time.max(free);
            }
        });
    }),
    ("a tracker that runs before and after", |dataset| {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        each_log(dataset, |_, poses| {
            let mut normal = |std_dev: f64| std_dev * Distribution::<f64>::sample(&StandardNormal, &mut rng);
            let (first, last) = (poses.time[0], poses.time.len() - 1);
            let (ended, end) = (poses.time[last], poses.poses[last]);
            let mut read = |pose: SurveyedPose| SurveyedPose {
                x: pose.x + normal(0.002),
                y: pose.y + normal(0.002),
                heading: pose.heading.map(|heading| heading + normal(0.003)),
            };
            // The frame is that of its first reading, three seconds before the robot sets off.
            let start = poses.poses[0];
            poses.poses[0] = read(start);
            for row in (1..=30).rev() {
                poses.time.insert(0, first - 0.1 * f64::from(31 - row));
                poses.poses.insert(0, if row == 1 { start } else { read(start) });
            }
            for row in 1..=30 {
                poses.time.push(ended + 0.1 * f64::from(row));
                poses.poses.push(read(end));
            }
        });
    }),
    ("a tracker that saw the second half", |dataset| {
        each_log(dataset, |_, poses| {
            let half = poses.time.len() / 2;
            poses.time.drain(..half);
            poses.poses.drain(..half);
        });
    }),
    ("a pose now and then", |dataset| {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        each_log(dataset, |_, poses| {
            let last = poses.time.len() - 1;
            let mut rows: Vec<usize> = (0..12).map(|_| (rng.next_u64() % last as u64) as usize).chain([last]).collect();
            rows.sort_unstable();
            rows.dedup();
            *poses = PoseLog {
                time: rows.iter().map(|row| poses.time[*row]).collect(),
                poses: rows.iter().map(|row| poses.poses[*row]).collect(),
            };
        });
    }),
];

fn each_log(dataset: &mut Dataset, mut change: impl FnMut(&mut EncoderLog, &mut PoseLog)) {
    for run in &mut dataset.runs {
        let (Some(log), Some(poses)) = (&mut run.encoders, &mut run.poses) else { panic!("every run has logs") };
        change(log, poses);
    }
}

/// A clean robot is left alone, and a floor that slopes is found, as steep as it is.
#[test]
fn logs_say_the_same_however_they_are_stamped_and_read() {
    const GRADIENT: f64 = 0.006;
    let model = base();
    let mut sloping = cause("floor_slope", GRADIENT);
    sloping.values.push(0.5);
    let mut library: Option<Library> = None;
    let clean = small(squares(&model, &model, DataKind::Logs, 203));
    let on_slope = small(squares(&sloping.edit(&model), &model, DataKind::Logs, 203));
    for (how, change) in OTHERWISE {
        let mut says = |mut dataset: Dataset| {
            change(&mut dataset);
            diagnosed_knowing(&model, &dataset, &mut library)
        };
        let of_clean = says(clean.clone());
        assert_eq!(of_clean.verdict, Verdict::Explained, "{how}: {:#?}", of_clean.ranking);
        let found = says(on_slope.clone());
        assert_eq!(names(&found), ["floor_slope"], "{how}: {:#?}", found.ranking);
        assert!(off(&found.findings[0], GRADIENT).abs() < 3.0, "{how}: {:#?}", found.findings);
    }
}
