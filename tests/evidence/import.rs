//! Recordings become datasets: bags, tables and trajectories that are written here, with what goes wrong in real ones.

use super::cli::{refused, text, treadmark};
use mcap::records::MessageHeader;
use serde::Serialize;
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Write as _;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use tempfile::TempDir;
use treadmark::dataset::{Dataset, EncoderUnit, Protocol, Rotation, Run, Travel};
use treadmark::drive::{self, Task};
use treadmark::geometry::Pose2;
use treadmark::import::{Cut, Finding, Imported, Options, PoseSource, export, import};
use treadmark::odometry::OdometryParameters;
use treadmark::scene::Scene;

/// When recordings begin \[ns since 1970\]: in `f64` seconds this is good to 0.2 µs only.
const BEGAN: i64 = 1_750_000_000_123_456_789;
/// 20 Hz \[ns\].
const STEP: i64 = 50_000_000;
const ODOMETRY: OdometryParameters = OdometryParameters {
    left_wheel_radius: 0.05,
    right_wheel_radius: 0.05,
    track_width: 0.4,
    ticks_per_revolution: Some(1000.0),
};
/// The same on the command line.
const OPTIONS: [&str; 6] = ["--odometry", "0.05,0.05,0.4,1000", "--position-std", "0.001", "--heading-std", "0.002"];

// Messages, whole and in the order of their definitions.

#[derive(Serialize)]
struct Header(i32, u32, String);
#[derive(Serialize)]
struct JointState(Header, Vec<String>, Vec<f64>, Vec<f64>, Vec<f64>);
#[derive(Serialize)]
struct PoseStamped(Header, [f64; 3], [f64; 4]);
/// With 36 covariances, and a twist with as many, which serde has no arrays for.
#[derive(Serialize)]
struct Odometry(Header, String, [f64; 3], [f64; 4], [[f64; 6]; 6], [f64; 6], [[f64; 6]; 6]);
#[derive(Serialize)]
struct Transforms(Vec<(Header, String, [f64; 3], [f64; 4])>);

fn header(stamp: i64, frame: &str) -> Header {
    Header((stamp / 1_000_000_000) as i32, (stamp % 1_000_000_000) as u32, frame.to_owned())
}

fn upright(heading: f64) -> [f64; 4] {
    [0.0, 0.0, (0.5 * heading).sin(), (0.5 * heading).cos()]
}

const JOINTS: &str = "sensor_msgs/msg/JointState";
const POSE: &str = "geometry_msgs/msg/PoseStamped";
const ODOM: &str = "nav_msgs/msg/Odometry";
const TF: &str = "tf2_msgs/msg/TFMessage";

/// A bag that is being written.
struct Bag {
    writer: mcap::Writer<BufWriter<File>>,
    channels: BTreeMap<String, u16>,
}

impl Bag {
    fn new(path: &Path) -> Bag {
        let file = BufWriter::new(File::create(path).expect("it can be made"));
        Bag { writer: mcap::Writer::new(file).expect("it can be written"), channels: BTreeMap::new() }
    }

    /// Messages go uncompressed and unchunked: bytes lie where they are written.
    fn plain(path: &Path) -> Bag {
        let file = BufWriter::new(File::create(path).expect("it can be made"));
        let options = mcap::WriteOptions::new().compression(None).use_chunks(false);
        Bag { writer: options.create(file).expect("it can be written"), channels: BTreeMap::new() }
    }

    fn write(&mut self, topic: &str, kind: Option<&str>, log_time: i64, message: &impl Serialize) {
        let channel = *self.channels.entry(topic.to_owned()).or_insert_with(|| {
            let schema =
                kind.map_or(0, |kind| self.writer.add_schema(kind, "ros2msg", b"as ROS has it").expect("it fits"));
            self.writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).expect("it fits")
        });
        let mut data = vec![0, 1, 0, 0];
        data.extend(cdr_encoding::to_vec::<_, byteorder::LittleEndian>(message).expect("it can be encoded"));
        let log_time = log_time as u64;
        let header = MessageHeader { channel_id: channel, sequence: 0, log_time, publish_time: log_time };
        self.writer.write_to_known_channel(&header, &data).expect("it can be written");
    }

    fn wheels(&mut self, stamp: i64, log_time: i64, left: f64, right: f64) {
        let names = ["left_wheel_joint", "right_wheel_joint", "arm_joint"].map(str::to_owned).to_vec();
        let message = JointState(header(stamp, ""), names, vec![left, right, 0.5], Vec::new(), Vec::new());
        self.write("/joint_states", Some(JOINTS), log_time, &message);
    }

    fn pose(&mut self, stamp: i64, log_time: i64, pose: Pose2) {
        let message = PoseStamped(header(stamp, "room"), [pose.x, pose.y, 0.1], upright(pose.heading));
        self.write("/mocap/pose", Some(POSE), log_time, &message);
    }

    fn odometry(&mut self, stamp: i64, pose: Pose2) {
        let zeros = [[0.0; 6]; 6];
        let message = Odometry(
            header(stamp, "odom"),
            "base_link".to_owned(),
            [pose.x, pose.y, 0.0],
            upright(pose.heading),
            zeros,
            [0.0; 6],
            zeros,
        );
        self.write("/odom", Some(ODOM), stamp, &message);
    }

    fn close(mut self) {
        self.writer.finish().expect("it can be finished");
    }
}

/// A reading: since the recording began \[ns\], wheels \[rad\], where the robot is in the room.
type Reading = (i64, [f64; 2], Pose2);

/// Wheel speeds \[rad/s\] held for a time \[s\], one after another; the robot rolls as its odometry believes.
fn rolled(parts: &[(f64, f64, f64)]) -> Vec<Reading> {
    let (mut time, mut wheels, mut pose) = (0, [0.0, 0.0], Pose2::new(2.0, -1.0, 0.7));
    let mut readings = vec![(time, wheels, pose)];
    let step = STEP as f64 / 1e9;
    for (left, right, seconds) in parts {
        for _ in 0..(seconds / step).round() as usize {
            time += STEP;
            wheels = [wheels[0] + left * step, wheels[1] + right * step];
            pose = ODOMETRY.advance(pose, left * step, right * step);
            readings.push((time, wheels, pose));
        }
    }
    readings
}

/// Rest, 1 m forward, rest, half a turn on the spot counter-clockwise, rest.
fn two_runs() -> Vec<Reading> {
    let turn = 0.2 * std::f64::consts::PI / 0.05;
    rolled(&[(0.0, 0.0, 4.0), (2.0, 2.0, 10.0), (0.0, 0.0, 4.0), (-turn / 4.0, turn / 4.0, 4.0), (0.0, 0.0, 4.0)])
}

/// A bag of these readings, with the robot's own odometry beside the survey.
fn bag_of(path: &Path, readings: &[Reading]) {
    let mut bag = Bag::new(path);
    for (time, wheels, pose) in readings {
        let stamp = BEGAN + time;
        bag.wheels(stamp, stamp, wheels[0], wheels[1]);
        bag.pose(stamp, stamp, *pose);
        bag.odometry(stamp, Pose2::IDENTITY);
    }
    bag.close();
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn options() -> Options {
    let mut options = Options::default();
    options.campaign.name = "test".to_owned();
    options.campaign.odometry = Some(ODOMETRY);
    options.campaign.survey.position_std = Some(0.001);
    options.campaign.survey.heading_std = Some(0.002);
    options
}

/// Imports, writes and reads back: what is imported is a dataset.
fn imported(files: &[PathBuf], options: &Options) -> Imported {
    let imported = import(files, options).unwrap_or_else(|error| panic!("{error}"));
    let folder = folder();
    imported.dataset.write(&folder.path().join("out")).expect("it can be written");
    imported
}

fn close(one: Pose2, other: Pose2, tolerance: f64) -> bool {
    one.distance(other) < tolerance && (one.heading - other.heading).abs() < tolerance
}

fn end(run: &Run) -> Pose2 {
    let end = run.end.expect("it is surveyed");
    Pose2::new(end.x, end.y, end.heading.expect("with a heading"))
}

/// A simulated campaign, logged as a real robot would: one bag, the robot carried back to a mark that is never quite the
/// same. Every run comes out of it with its protocol, its counts and its poses.
#[test]
fn a_simulated_campaign_comes_back_from_one_bag() {
    let scene = Scene::load("jnpf_4wd", "lab_floor").expect("shipped");
    let square = |direction| Protocol::Square { side: 1.0, direction };
    let protocols = [
        square(Rotation::Clockwise),
        square(Rotation::CounterClockwise),
        Protocol::Straight { length: 2.0, direction: Travel::Forward },
        Protocol::Straight { length: 2.0, direction: Travel::Reverse },
        Protocol::Spin { turn: TAU, direction: Rotation::Clockwise },
        Protocol::Spin { turn: FRAC_PI_2, direction: Rotation::CounterClockwise },
        Protocol::Circle { radius: 1.0, turn: Some(TAU), direction: Rotation::CounterClockwise },
    ];
    let driven: Vec<Run> = protocols
        .iter()
        .enumerate()
        .map(|(index, protocol)| {
            let task = Task::new(index.to_string(), *protocol);
            drive::run(&scene, &task, 1, None, &AtomicBool::new(false)).expect("it can be driven").measured
        })
        .collect();

    let folder = folder();
    let path = folder.path().join("lab.mcap");
    let mut bag = Bag::new(&path);
    let radians = TAU / scene.robot.odometry.ticks_per_revolution.expect("it counts ticks");
    let names: Vec<String> =
        driven[0].encoders.as_ref().expect("a log").channels.iter().map(|name| format!("{name}_wheel_joint")).collect();
    let mut zero = vec![12.0; names.len()];
    let mut began = BEGAN;
    for (index, run) in driven.iter().enumerate() {
        let (log, survey) = (run.encoders.as_ref().expect("a log"), run.poses.as_ref().expect("a log"));
        let room = Pose2::new(1.0, 0.1 * index as f64, 0.3 - index as f64);
        let width = names.len();
        let joints = |bag: &mut Bag, time: f64, counts: &[f64]| {
            let stamp = began + (time * 1e9).round() as i64;
            let positions = counts.iter().zip(&zero).map(|(count, zero)| (count + zero) * radians).collect();
            let message = JointState(header(stamp, ""), names.clone(), positions, Vec::new(), Vec::new());
            bag.write("/joint_states", Some(JOINTS), stamp, &message);
        };
        let pose = |bag: &mut Bag, time: f64, row: usize| {
            let pose = survey.poses[row];
            let stamp = began + (time * 1e9).round() as i64;
            bag.pose(stamp, stamp, room.compose(Pose2::new(pose.x, pose.y, pose.heading.expect("a heading"))));
        };
        let last = &log.counts[(log.len() - 1) * width..];
        for rest in 1..100 {
            joints(&mut bag, f64::from(rest - 100) * 0.05, &log.counts[..width]);
            pose(&mut bag, f64::from(rest - 100) * 0.05, 0);
        }
        for row in 0..log.len() {
            joints(&mut bag, log.time[row], &log.counts[row * width..(row + 1) * width]);
        }
        for row in 0..survey.time.len() {
            pose(&mut bag, survey.time[row], row);
        }
        let ended = log.time[log.len() - 1];
        for rest in 1..100 {
            joints(&mut bag, ended + f64::from(rest) * 0.05, last);
            pose(&mut bag, ended + f64::from(rest) * 0.05, survey.poses.len() - 1);
        }
        for (zero, count) in zero.iter_mut().zip(last) {
            *zero += count;
        }
        began += ((ended + 20.0) * 1e9) as i64;
    }
    bag.close();

    let mut options = options();
    options.campaign.odometry = Some(scene.robot.odometry);
    let Imported { dataset, findings, .. } = imported(&[path], &options);
    assert_eq!(dataset.runs.len(), driven.len(), "{findings:?}");
    for (run, original) in dataset.runs.iter().zip(&driven) {
        // Logs tell how often it went round a circle, not how often it should have.
        let expected = match original.protocol {
            Protocol::Circle { radius, direction, .. } => Protocol::Circle { radius, turn: None, direction },
            other => other,
        };
        assert_eq!(run.protocol, expected, "{}", run.name);
        // The first rest reading and the last may be other noise, but no other place than a survey's few millimetres.
        assert!(close(end(run), end(original), 0.03), "{:?} {:?}", run.end, original.end);
        let [ours, theirs] = [run, original].map(|run| run.dead_reckoned_end(&scene.robot.odometry).expect("a log"));
        // A wheel stands still while it turns by no more than 0.01 rad: a fifth of that as a heading.
        assert!(close(ours, theirs, 2e-3), "{}: {ours:?} {theirs:?}", run.name);
    }
    // Standstills hold gaps between runs only: twenty seconds less two rests of five.
    assert!(findings.iter().all(|finding| !matches!(finding, Finding::ClockJump { .. } | Finding::Reset { .. })));
}

/// Times are whole nanoseconds since the run began, poses are seen from its first, headings go on beyond half a turn.
#[test]
fn stamps_and_poses_are_relative_to_the_run() {
    let folder = folder();
    let path = folder.path().join("two.mcap");
    bag_of(&path, &two_runs());
    let Imported { dataset, driven, findings } = imported(&[path], &options());
    let [straight, spin] = &dataset.runs[..] else { panic!("{} runs", dataset.runs.len()) };
    assert_eq!((straight.name.as_str(), spin.name.as_str()), ("two-1", "two-2"));
    assert_eq!(straight.protocol, Protocol::Straight { length: 1.0, direction: Travel::Forward });
    assert_eq!(spin.protocol, Protocol::Spin { turn: 2.0 * FRAC_PI_2, direction: Rotation::CounterClockwise });
    assert!(matches!(driven[0], Some(Protocol::Straight { length, .. }) if (length - 1.0).abs() < 1e-9));
    assert!(close(end(straight), Pose2::new(1.0, 0.0, 0.0), 2e-9), "{:?}", straight.end);
    assert!(close(end(spin), Pose2::new(0.0, 0.0, 2.0 * FRAC_PI_2), 2e-9), "{:?}", spin.end);
    assert!(close(straight.start.expect("in the room"), Pose2::new(2.0, -1.0, 0.7), 1e-9));
    // Half a second of the standstills around it is kept.
    let log = straight.encoders.as_ref().expect("a log");
    assert_eq!(log.time[..3], [0.0, 0.05, 0.1]);
    assert_eq!(log.time.last(), Some(&11.0));
    assert_eq!((straight.started, spin.started), (Some(0.0), Some(14.0)));
    assert_eq!(straight.poses.as_ref().map(|log| log.time.clone()), Some(log.time.clone()));
    assert!(matches!(&findings[..], [Finding::Took { wheels, poses, .. }]
        if wheels.contains("/joint_states (left: left_wheel_joint; right: right_wheel_joint)") && poses.contains("/mocap/pose")));
    assert_eq!(export(&dataset).len(), 4);
}

/// The same in every type that poses come in, with the clocks' offset kept.
#[test]
fn poses_come_in_every_type() {
    for kind in ["geometry_msgs/msg/PoseWithCovarianceStamped", ODOM, TF] {
        let folder = folder();
        let path = folder.path().join("run.mcap");
        let mut bag = Bag::new(&path);
        for (time, wheels, pose) in two_runs() {
            let (stamp, late) = (BEGAN + time, BEGAN + time + 20_000_000);
            bag.wheels(stamp, stamp, wheels[0], wheels[1]);
            let (position, quaternion) = ([pose.x, pose.y, 0.0], upright(pose.heading));
            match kind {
                ODOM => {
                    let (frame, zeros) = (header(late, "room"), [[0.0; 6]; 6]);
                    let message = Odometry(frame, "robot".to_owned(), position, quaternion, zeros, [0.0; 6], zeros);
                    bag.write("/truth", Some(kind), stamp, &message);
                }
                TF => {
                    let sensor = (header(late, "robot"), "lidar".to_owned(), [0.1, 0.0, 0.0], upright(0.0));
                    let robot = (header(late, "room"), "robot".to_owned(), position, quaternion);
                    bag.write("/tf", Some(kind), stamp, &Transforms(vec![sensor, robot]));
                }
                _ => bag.write("/truth", Some(kind), stamp, &PoseStamped(header(late, "room"), position, quaternion)),
            }
        }
        bag.close();
        let mut options = options();
        if kind == TF {
            options.frame = Some(("room".to_owned(), "robot".to_owned()));
        }
        let dataset = imported(&[path], &options).dataset;
        assert!(close(end(&dataset.runs[0]), Pose2::new(1.0, 0.0, 0.0), 2e-9), "{kind}");
        let poses = dataset.runs[0].poses.as_ref().expect("a log");
        assert_eq!(poses.time[0], 0.02, "{kind}: the offset of the clocks is kept");
    }
}

fn csv(path: &Path, header: &str, rows: impl IntoIterator<Item = String>) -> PathBuf {
    let mut text = format!("{header}\n");
    for row in rows {
        let _ = writeln!(text, "{row}");
    }
    std::fs::write(path, text).expect("it can be written");
    path.to_owned()
}

fn tum(path: &Path, readings: &[Reading]) -> PathBuf {
    let rows = readings.iter().map(|(time, _, pose)| {
        let [x, y, z, w] = upright(pose.heading);
        format!("{}.{:09} {} {} 0.1 {x} {y} {z} {w}", time / 1_000_000_000, time % 1_000_000_000, pose.x, pose.y)
    });
    csv(path, "# t x y z qx qy qz qw", rows)
}

/// A table of encoders beside a trajectory gives what the bag gives; and what is exported of it comes back.
#[test]
fn tables_and_trajectories_round_trip() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let readings = two_runs();
    bag_of(&at("two.mcap"), &readings);
    let from_bag = imported(&[at("two.mcap")], &options()).dataset;
    let wheels = csv(
        &at("two.csv"),
        "stamp;battery;wl;wr",
        readings.iter().map(|(time, [left, right], _)| format!("{};12.6;{left};{right}", time / 1_000_000)),
    );
    let mut mapped = options();
    mapped.map = [("t_ms", "stamp"), ("left_rad", "wl"), ("right_rad", "wr")]
        .map(|(t, c)| (t.to_owned(), c.to_owned()))
        .to_vec();
    let from_text = imported(&[wheels, tum(&at("poses.tum"), &readings)], &mapped).dataset;
    assert_eq!(from_text.runs, from_bag.runs);

    // One table with both, in other units; what the survey did not read stays blank.
    let both = csv(
        &at("two.csv"),
        "t_us,left_deg,right_deg,x_mm,y_cm,heading_deg",
        readings.iter().enumerate().map(|(row, (time, [left, right], pose))| {
            let wheels = format!("{},{},{}", time / 1000, left.to_degrees(), right.to_degrees());
            if row % 2 == 1 {
                return format!("{wheels},,,");
            }
            format!("{wheels},{},{},{}", 1e3 * pose.x, 1e2 * pose.y, pose.heading.to_degrees())
        }),
    );
    let from_both = imported(&[both], &options()).dataset;
    for (run, expected) in from_both.runs.iter().zip(&from_bag.runs) {
        assert!(close(end(run), end(expected), 1e-6) && run.protocol == expected.protocol, "{run:?}");
    }

    // Exported, and imported as whole runs.
    let written = at("dataset");
    from_bag.write(&written).expect("it can be written");
    let mut whole = options();
    whole.cut = Cut::Whole;
    let mut files = Vec::new();
    for run in &from_bag.runs {
        let log = run.encoders.as_ref().expect("a log");
        files.push(csv(
            &at(&format!("{}.csv", run.name)),
            "t_s,left_rad,right_rad",
            log.time
                .iter()
                .zip(log.counts.chunks(2))
                .map(|(time, counts)| format!("{time},{},{}", counts[0], counts[1])),
        ));
    }
    let output = treadmark(folder.path()).args(["export", "dataset", "--out", "tum"]).output().expect("it starts");
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(text(&output.stdout), "4 trajectories of 2 runs are in tum\n");
    files.extend(["two-1", "two-2"].map(|name| at(&format!("tum/{name}.survey.tum"))));
    let again = imported(&files, &whole).dataset;
    for (run, expected) in again.runs.iter().zip(&from_bag.runs) {
        assert_eq!((&run.name, &run.protocol), (&expected.name, &expected.protocol));
        assert_eq!((&run.encoders, &run.poses, run.end), (&expected.encoders, &expected.poses, expected.end));
    }
    refused(folder.path(), &["export", "dataset", "--out", "tum"], &["tum: exists already"]);
}

/// Counters of 16 and 32 bits, signed or not, that run over give what longer ones give, and it is said.
#[test]
fn counters_that_run_over_are_mended() {
    let readings = two_runs();
    let ticks = |angle: f64| (angle * 1000.0 / TAU).round() as i64;
    let folder = folder();
    let path = folder.path().join("count.csv");
    let of = |convert: &dyn Fn(i64) -> i64| {
        let rows = readings.iter().map(|(time, [left, right], pose)| {
            let [left, right] = [left, right].map(|angle| convert(ticks(*angle)));
            format!("{time},{left},{right},{},{},{}", pose.x, pose.y, pose.heading)
        });
        csv(&path, "t_ns,left_ticks,right_ticks,x_m,y_m,heading_rad", rows);
        imported(std::slice::from_ref(&path), &options())
    };
    let expected = of(&|count| count + 64_000);
    assert!(expected.findings.is_empty(), "{:?}", expected.findings);
    for (convert, name, offset) in [
        (&(|count: i64| (count + 64_000) % 65_536) as &dyn Fn(i64) -> i64, "a 16-bit counter", 0),
        (&|count| i64::from((count + 31_000) as i16), "a signed 16-bit counter", 33_000),
        (&|count| i64::from((count + 4_294_966_000) as u32), "a 32-bit counter", 64_000_i64 - 4_294_966_000),
        (&|count| i64::from((count + 2_147_483_000) as i32), "a signed 32-bit counter", 64_000 - 2_147_483_000),
    ] {
        let mended = of(convert);
        let told = mended.findings.iter().filter(|finding| finding.to_string().contains(name)).count();
        assert_eq!((told, mended.findings.len()), (2, 2), "{name}: {:?}", mended.findings);
        for (run, expected) in mended.dataset.runs.iter().zip(&expected.dataset.runs) {
            let counts =
                run.encoders.as_ref().map(|log| log.counts.iter().map(|count| count + offset as f64).collect());
            assert_eq!(counts, expected.encoders.as_ref().map(|log| log.counts.clone()), "{name}");
        }
    }

    // A counter that begins anew is none that ran over: said, cut there, and refused where a file is to be one run.
    let middle = readings.len() / 4;
    let row = std::cell::Cell::new(0);
    let restarted = |count: i64| {
        row.set(row.get() + 1);
        if row.get() > 2 * middle { count - ticks(readings[middle].1[0]) } else { count + 20_000 }
    };
    let cut = of(&restarted);
    let resets = cut.findings.iter().filter(|finding| matches!(finding, Finding::Reset { .. })).count();
    assert_eq!((resets, cut.dataset.runs.len()), (2, 3), "{:?}", cut.findings);
    assert!(cut.findings.iter().any(|finding| matches!(finding, Finding::InMotion { when: ["ends", _], .. })));
    // Poses of a file of their own, read at half the rate, are cut at the same time.
    let halved: Vec<Reading> = readings.iter().step_by(2).copied().collect();
    let wheels = csv(
        &folder.path().join("wheels.csv"),
        "t_ns,left_ticks,right_ticks",
        readings.iter().enumerate().map(|(row, (time, [left, right], _))| {
            let zero = if row >= middle { ticks(readings[middle].1[0]) } else { -20_000 };
            format!("{time},{},{}", ticks(*left) - zero, ticks(*right) - zero)
        }),
    );
    let apart = imported(&[wheels, tum(&folder.path().join("poses.tum"), &halved)], &options()).dataset;
    assert_eq!(apart.runs.len(), cut.dataset.runs.len());
    for (run, expected) in apart.runs.iter().zip(&cut.dataset.runs) {
        let [ours, theirs] = [run, expected].map(|run| {
            let time = &run.poses.as_ref().expect("a log").time;
            time[time.len() - 1] - time[0]
        });
        assert!((ours - theirs).abs() < 0.11, "{ours} s, {theirs} s");
    }
    let whole = Options { cut: Cut::Whole, ..options() };
    let error = import(std::slice::from_ref(&path), &whole).expect_err("it is broken").to_string();
    assert!(
        error.contains("cannot be one run: counter `left` jumps from") && error.contains("without --whole"),
        "{error}"
    );
}

/// A clock that is set cuts the recording; a reading that came late is put in order; a gap is told. Each is said once.
#[test]
fn clocks_and_gaps_are_told() {
    let folder = folder();
    let path = folder.path().join("clock.mcap");
    let with = |stamp: &dyn Fn(usize, i64) -> Option<i64>| {
        let mut bag = Bag::new(&path);
        for (row, (time, wheels, pose)) in two_runs().into_iter().enumerate() {
            if let Some(stamp) = stamp(row, BEGAN + time) {
                bag.wheels(stamp, BEGAN + time, wheels[0], wheels[1]);
                bag.pose(stamp, BEGAN + time + 1000, pose);
            }
        }
        bag.close();
        let Imported { dataset, findings, .. } = imported(std::slice::from_ref(&path), &options());
        (dataset.runs.len(), findings.into_iter().filter(|finding| !matches!(finding, Finding::Took { .. })).collect())
    };
    let second = 1_000_000_000;
    for by in [-7, 7] {
        // Within the straight, which becomes two runs: nobody knows how the robot went on meanwhile.
        let (runs, findings): (usize, Vec<Finding>) =
            with(&|row, stamp| Some(stamp + if row < 180 { 0 } else { by * second }));
        assert_eq!(runs, 3, "{findings:?}");
        let jumps = findings.iter().filter(|finding| {
            matches!(finding, Finding::ClockJump { at, by: found, .. } if (at - 8.95).abs() < 1e-9 && (found - by as f64).abs() < 1e-9)
        });
        assert_eq!(jumps.count(), 2, "{findings:?}");
    }
    let (runs, findings): (usize, Vec<Finding>) =
        with(&|row, stamp| Some(stamp - if row == 180 { 60_000_000 } else { 0 }));
    assert_eq!(runs, 2);
    assert!(matches!(&findings[..], [Finding::Late { count: 1, .. }, Finding::Late { count: 1, .. }]), "{findings:?}");
    let (runs, findings): (usize, Vec<Finding>) = with(&|row, stamp| (!(180..220).contains(&row)).then_some(stamp));
    assert_eq!(runs, 2);
    let told = |finding: &Finding| {
        matches!(finding, Finding::Gaps { count: 1, longest, at, usual, .. }
            if (longest - 2.05).abs() < 1e-9 && (at - 8.95).abs() < 1e-9 && (usual - 0.05).abs() < 1e-9)
    };
    assert!(findings.len() == 2 && findings.iter().all(told), "{findings:?}");
}

/// Clocks seconds apart are brought together, whichever is ahead, and a survey that comes seldom keeps its start and end.
#[test]
fn poses_by_a_clock_far_off_are_brought_to_the_wheels() {
    let folder = folder();
    let path = folder.path().join("two.mcap");
    let second = 1_000_000_000;
    let with = |late: i64, every: usize| {
        let mut bag = Bag::new(&path);
        // The robot is driven twice as two_runs() has it, and then once more straight on.
        let parts = [(0.0, 0.0, 6.0), (2.0, 2.0, 10.0), (0.0, 0.0, 6.0), (-1.5, 1.5, 4.0), (0.0, 0.0, 9.0)];
        let more = [(1.5, 1.0, 12.0), (0.0, 0.0, 7.0)];
        for (row, (time, wheels, pose)) in rolled(&[&parts[..], &parts[..], &more[..]].concat()).into_iter().enumerate()
        {
            let stamp = BEGAN + time;
            bag.wheels(stamp, stamp, wheels[0], wheels[1]);
            if row % every == 0 {
                bag.pose(stamp + late, stamp, pose);
            }
        }
        bag.close();
        imported(std::slice::from_ref(&path), &options())
    };
    let right = with(0, 1);
    assert_eq!(right.dataset.runs.len(), 5);
    let said = |imported: &Imported| {
        imported.findings.iter().find_map(|finding| match finding {
            Finding::ClocksApart { by, .. } => Some(*by),
            _ => None,
        })
    };
    assert_eq!(said(&right), None);
    // What cuts nothing off is the diagnosis' affair.
    assert_eq!(said(&with(second / 4, 1)), None);
    for late in [2 * second, -2 * second, 17 * second + second / 2] {
        let late_poses = with(late, 1);
        let by = said(&late_poses).expect("it is told");
        assert!((by - late as f64 / 1e9).abs() < 0.2, "{by}");
        for (one, other) in late_poses.dataset.runs.iter().zip(&right.dataset.runs) {
            assert_eq!(one.protocol, other.protocol);
            assert!(close(end(one), end(other), 1e-6), "{:?} {:?}", one.end, other.end);
        }
    }
    // A reading every two seconds, of a robot that stands for six.
    for (one, other) in with(0, 40).dataset.runs.iter().zip(&right.dataset.runs) {
        assert!(close(end(one), end(other), 1e-6), "{:?} {:?}", one.end, other.end);
    }
}

/// What no pose has seen is no part of a surveyed run: it begins and ends where its poses do.
#[test]
fn a_run_is_where_its_poses_are() {
    let folder = folder();
    let path = folder.path().join("two.mcap");
    // The straight goes from row 80 to row 280, by a tenth of a radian a row.
    let with = |seen: &dyn Fn(usize) -> bool| {
        let mut bag = Bag::new(&path);
        for (row, (time, wheels, pose)) in two_runs().into_iter().enumerate() {
            let stamp = BEGAN + time;
            bag.wheels(stamp, stamp, wheels[0], wheels[1]);
            if seen(row) {
                bag.pose(stamp, stamp, pose);
            }
        }
        bag.close();
        imported(std::slice::from_ref(&path), &options())
    };
    let half: [(&dyn Fn(usize) -> bool, &str); 2] =
        [(&|row: usize| row >= 180, "before"), (&|row: usize| row <= 180 || row > 320, "after")];
    for (seen, unseen) in half {
        let Imported { dataset, findings, .. } = with(seen);
        let told = findings.iter().any(|finding| {
            matches!(finding, Finding::Unseen { turned, when, .. } if *when == unseen && (turned - 10.0).abs() < 1e-9)
        });
        assert!(told, "{findings:?}");
        let straight = &dataset.runs[0];
        let log = straight.encoders.as_ref().expect("a log");
        let rolled = 0.05 * (log.counts[2 * (log.len() - 1)] - log.counts[0]);
        assert!((rolled - 0.5).abs() < 1e-9, "{rolled}");
        assert!(close(end(straight), Pose2::new(0.5, 0.0, 0.0), 1e-8), "{:?}", straight.end);
        assert_eq!(
            dataset.runs[1].protocol,
            Protocol::Spin { turn: 2.0 * FRAC_PI_2, direction: Rotation::CounterClockwise }
        );
    }
}

/// Columns that are mixed up are told as the recording is read; what is driven is told from them.
#[test]
fn wheels_that_turn_the_other_way_than_the_poses_are_told() {
    let folder = folder();
    let path = folder.path().join("two.mcap");
    let with = |order: fn([f64; 2]) -> [f64; 2]| {
        let readings: Vec<Reading> =
            two_runs().into_iter().map(|(time, wheels, pose)| (time, order(wheels), pose)).collect();
        bag_of(&path, &readings);
        imported(std::slice::from_ref(&path), &options()).findings
    };
    let told = |findings: &[Finding]| {
        findings.iter().any(|finding| matches!(finding, Finding::TurnsDisagree { disagree: 1, turned: 1 }))
    };
    assert!(!told(&with(|wheels| wheels)));
    assert!(told(&with(|[left, right]| [right, left])));
    assert!(told(&with(|wheels| wheels.map(|angle| -angle))));
}

/// What was driven can be stated, by name or in order, with ends that were measured by tape.
#[test]
fn runs_can_be_stated() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    bag_of(&at("two.mcap"), &two_runs());
    let import = |runs: &str, out: &str, more: &[&str]| {
        std::fs::write(at("stated.csv"), runs).expect("it can be written");
        let output = treadmark(folder.path())
            .args(["import", "two.mcap", "--out", out, "--runs", "stated.csv"])
            .args(OPTIONS)
            .args(more)
            .output()
            .expect("it starts");
        assert!(output.status.success(), "{}", text(&output.stderr));
        (Dataset::read(&at(out)).expect("it is a dataset"), text(&output.stdout), text(&output.stderr))
    };
    let (dataset, stdout, _) =
        import("run,protocol,side_m,turn_rad,direction\nway,straight,1.05,,\nturn,spin,,3,ccw\n", "a", &[]);
    let names: Vec<&str> = dataset.runs.iter().map(|run| run.name.as_str()).collect();
    assert_eq!(names, ["way", "turn"]);
    assert_eq!(dataset.runs[0].protocol, Protocol::Straight { length: 1.05, direction: Travel::Forward });
    assert!(stdout.contains("straight forward 1.0000 m") && stdout.contains("2 runs are in a;"), "{stdout}");
    assert_eq!(dataset.campaign.odometry, Some(ODOMETRY));
    assert_eq!(dataset.campaign.survey.position_std, Some(0.001));
    // Named as the cut runs are, in another order; one end by tape.
    let stated = "run,protocol,x_m,y_m\ntwo-2,path,,\ntwo-1,path,0.99,0.01\n";
    let (dataset, _, stderr) = import(stated, "b", &["--pose", "none"]);
    assert_eq!(dataset.runs[1].end.map(|end| (end.x, end.heading)), Some((0.99, None)));
    assert!(dataset.runs.iter().all(|run| run.poses.is_none()));
    assert!(!stderr.contains("NaN") && stderr.contains("no poses"), "{stderr}");
    std::fs::write(at("stated.csv"), "run,protocol\none,path\n").expect("it can be written");
    let arguments = [&["import", "two.mcap", "--out", "c", "--runs", "stated.csv"][..], &OPTIONS].concat();
    refused(
        folder.path(),
        &arguments,
        &["stated.csv: states 1 runs, but 2 were found: two-1 at 0.0 s, two-2 at 14.0 s"],
    );
}

/// Without odometry nothing is made up: runs are paths, and what is missing is said.
#[test]
fn nothing_is_invented() {
    let folder = folder();
    bag_of(&folder.path().join("two.mcap"), &two_runs());
    let output = treadmark(folder.path()).args(["import", "two.mcap", "--out", "out"]).output().expect("it starts");
    let stderr = text(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    assert!(stderr.contains("every run is a path") && stderr.contains("--position-std and --heading-std"), "{stderr}");
    let dataset = Dataset::read(&folder.path().join("out")).expect("it is a dataset");
    assert!(dataset.campaign.odometry.is_none() && dataset.campaign.survey.position_std.is_none());
    assert!(dataset.runs.iter().all(|run| run.protocol == Protocol::Path));
    refused(folder.path(), &["import", "two.mcap", "--out", "out"], &["out: is there already", "never overwritten"]);
}

/// Every way in which a bag can be no good is one message with file, place and what is allowed.
#[test]
fn bad_bags_are_refused() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let check = |more: &[&str], parts: &[&str]| {
        let arguments = [&["import", "bag.mcap", "--out", "out"][..], &OPTIONS, more].concat();
        refused(folder.path(), &arguments, parts);
        assert!(!at("out").exists(), "nothing is left of what was refused");
    };
    /// What one message of a bag is written as.
    type Write<'a> = &'a dyn Fn(&mut Bag, i64, [f64; 2], Pose2);
    let bag = |write: Write| {
        let mut bag = Bag::plain(&at("bag.mcap"));
        for (time, wheels, pose) in two_runs() {
            write(&mut bag, BEGAN + time, wheels, pose);
        }
        bag.close();
    };
    let good = |bag: &mut Bag, stamp: i64, wheels: [f64; 2], pose: Pose2| {
        bag.wheels(stamp, stamp, wheels[0], wheels[1]);
        bag.pose(stamp, stamp, pose);
    };
    let there = "/joint_states (sensor_msgs/msg/JointState, 521 messages), /mocap/pose (geometry_msgs/msg/PoseStamped, 521 messages)";

    refused(folder.path(), &["import", "none.mcap", "--out", "out"], &["none.mcap: cannot be read"]);
    std::fs::write(at("bag.mcap"), "bag, but of what?").expect("it can be written");
    check(&[], &["bag.mcap: is no recording that can be read here", "`ros2 bag convert`"]);
    std::fs::write(at("bag.db3"), "SQLite format 3").expect("it can be written");
    refused(folder.path(), &["import", "bag.db3", "--out", "out"], &["bag.db3: is no recording", "MCAP"]);
    std::fs::create_dir(at("empty")).expect("it is new");
    refused(folder.path(), &["import", "empty", "--out", "out"], &["empty: is no recording"]);

    bag(&good);
    check(&["--encoders", "/wheels"], &["bag.mcap: --encoders /wheels: there is no such topic", there]);
    check(&["--pose", "/vicon"], &["--pose /vicon: there is no such topic", there]);
    check(
        &["--pose", "/joint_states"],
        &["--pose /joint_states: it is of type sensor_msgs/msg/JointState; allowed are geometry_msgs/msg/PoseStamped"],
    );
    check(
        &["--left", "wl", "--right", "wr"],
        &["--left wl: topic /joint_states never has it; it has arm_joint, left_wheel_joint"],
    );
    check(&["--frame", "map/base"], &["--frame map/base: topic /mocap/pose never has it; it has room/"]);
    check(&["--left", "left_wheel_joint"], &["--right"]);
    let alone = |option: &str, value: &str, parts: &[&str]| {
        refused(folder.path(), &["import", "bag.mcap", "--out", "out", option, value], parts);
    };
    alone("--odometry", "0.05,0.05", &["2 numbers; it must be three or four: LEFT,RIGHT,TRACK[,TICKS]"]);
    alone("--odometry", "0.05,-0.05,0.4", &["it must be a finite number above 0"]);
    check(&["--robot", "jnpf_4wd"], &["cannot be used with"]);

    // Cut off anywhere: what could be read is told, and nothing panics.
    let whole = std::fs::read(at("bag.mcap")).expect("it is there");
    for length in [whole.len() / 2, whole.len() - 1, 100, 9] {
        std::fs::write(at("bag.mcap"), &whole[..length]).expect("it can be written");
        check(&[], &[&format!("bag.mcap: breaks off at byte {length}"), "could be read", "`mcap recover`"]);
    }
    std::fs::write(at("bag.mcap"), &whole[..whole.len() / 2]).expect("it can be written");
    check(&[], &["/joint_states (sensor_msgs/msg/JointState, ", "/mocap/pose (geometry_msgs/msg/PoseStamped, "]);
    // One byte of a chunk turned round.
    bag_of(&at("bag.mcap"), &two_runs());
    let mut damaged = std::fs::read(at("bag.mcap")).expect("it is there");
    let middle = damaged.len() / 3;
    damaged[middle] ^= 0x55;
    std::fs::write(at("bag.mcap"), &damaged).expect("it can be written");
    check(&[], &["bag.mcap: is damaged before byte"]);

    bag(&|bag, stamp, wheels, pose| {
        bag.wheels(stamp, stamp, wheels[0], wheels[1]);
        bag.write("/mocap/pose", None, stamp, &PoseStamped(header(stamp, ""), [pose.x, pose.y, 0.0], upright(0.0)));
    });
    check(&[], &["topic /mocap/pose has no schema, so the type of its 521 messages is not known"]);
    check(&["--pose", "/mocap/pose"], &["topic /mocap/pose has no schema"]);

    bag(&|bag, stamp, wheels, pose| bag.wheels(stamp - BEGAN, stamp, wheels[0], wheels[1] + 0.0 * pose.x));
    check(&[], &["no topic can be taken for the surveyed pose", "--pose none"]);
    bag(&|bag, stamp, _, pose| bag.pose(stamp, stamp, pose));
    check(
        &[],
        &["no topic can be taken for the encoders by itself; choose with --encoders TOPIC; there are: /mocap/pose"],
    );
    bag(&|bag, stamp, wheels, pose| {
        bag.wheels(stamp, stamp, wheels[0], wheels[1]);
        bag.odometry(stamp, pose);
    });
    check(&[], &["/odom may be the robot's own dead reckoning, which is no survey", "choose with --pose TOPIC"]);
    bag(&|bag, stamp, wheels, pose| {
        good(bag, stamp, wheels, pose);
        bag.write("/vicon", Some(POSE), stamp, &PoseStamped(header(stamp, ""), [0.0; 3], upright(0.0)));
    });
    check(&[], &["the surveyed pose may come from any of /mocap/pose, /vicon; choose with --pose TOPIC"]);
    bag(&|bag, stamp, wheels, _| {
        bag.wheels(stamp, stamp, wheels[0], wheels[1]);
        let of = |parent: &str, child: &str| (header(stamp, parent), child.to_owned(), [0.0; 3], upright(0.0));
        bag.write("/tf", Some(TF), stamp, &Transforms(vec![of("map", "robot"), of("robot", "lidar")]));
    });
    check(&[], &["may come from any of map/robot, robot/lidar; choose with --frame PARENT/CHILD"]);

    let joints = |names: &'static [&'static str], positions: fn([f64; 2]) -> Vec<f64>| {
        bag(&|bag, stamp, wheels, pose| {
            let names = names.iter().map(|name| (*name).to_owned()).collect();
            let message = JointState(header(stamp, ""), names, positions(wheels), Vec::new(), Vec::new());
            bag.write("/joint_states", Some(JOINTS), stamp, &message);
            bag.pose(stamp, stamp, pose);
        });
    };
    joints(&["motor_a", "motor_b"], |wheels| wheels.to_vec());
    check(&[], &["the left and the right wheels may come from any of motor_a, motor_b; choose with --left"]);
    joints(&["wheel_l", "wheel_r"], |_| Vec::new());
    check(&[], &["topic /joint_states, message 1, logged at 1750000000.123 s: 2 joints have 0 positions"]);
    joints(&["wheel_l", "wheel_r"], |wheels| vec![wheels[0], if wheels[1] > 3.0 { f64::NAN } else { 0.0 }]);
    check(&[], &["the position of `wheel_r` is NaN; it must be a finite number"]);
    joints(&["wheel_l", "wheel_r"], |wheels| wheels.map(|angle| (100.0 * angle).round()).to_vec());
    check(&[], &["are whole numbers up to 2", "say --unit ticks or --unit rad"]);
    let ticks = ["import", "bag.mcap", "--out", "out", "--unit", "ticks", "--odometry", "0.05,0.05,0.4"];
    refused(folder.path(), &ticks, &["encoders count ticks; say how many make a turn"]);

    // Clocks that never meet; headers that nobody stamped.
    bag(&|bag, stamp, wheels, pose| {
        bag.wheels(stamp - BEGAN, stamp, wheels[0], wheels[1]);
        bag.pose(stamp, stamp, pose);
    });
    check(&[], &["clocks are mixed: encoders are stamped 0.000 to 26.000 s, poses 1750000000.123 to", "--clock log"]);
    let arguments = [&["import", "bag.mcap", "--out", "by_log", "--clock", "log"][..], &OPTIONS].concat();
    assert!(treadmark(folder.path()).args(arguments).output().expect("it starts").status.success());
    bag(&|bag, stamp, wheels, pose| {
        bag.wheels(0, stamp, wheels[0], wheels[1]);
        bag.pose(stamp, stamp, pose);
    });
    check(&[], &["topic /joint_states: every header is stamped 0; say --clock log"]);

    let posed = |quaternion: [f64; 4]| {
        bag(&|bag, stamp, wheels, pose| {
            bag.wheels(stamp, stamp, wheels[0], wheels[1]);
            let message = PoseStamped(header(stamp, ""), [pose.x, pose.y, 0.0], quaternion);
            bag.write("/mocap/pose", Some(POSE), stamp, &message);
        });
    };
    posed([0.0; 4]);
    check(&[], &["topic /mocap/pose, message 1,", "has length 0; it must be 1"]);
    posed([0.5, 0.5, 0.5, 0.5]);
    check(&[], &["leans by 90° from upright on average", "z up"]);
    bag(&|bag, stamp, _, pose| good(bag, stamp, [0.5, 0.25], pose));
    check(&[], &["no wheel turned by more than 0.1 rad between standstills"]);
    // A message that ends before its type does.
    bag(&|bag, stamp, _, pose| {
        bag.pose(stamp, stamp, pose);
        bag.write("/joint_states", Some(JOINTS), stamp, &header(stamp, ""));
    });
    check(&[], &["topic /joint_states, message 1, logged at 1750000000.123 s: its bytes are not of its type"]);
}

/// Every way in which a text file can be no good is one message with file, line, column and what is allowed.
#[test]
fn bad_tables_are_refused() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let readings = two_runs();
    tum(&at("good.tum"), &readings);
    csv(
        &at("good.csv"),
        "t_s,left_rad,right_rad",
        readings.iter().map(|(time, wheels, _)| format!("{},{},{}", *time as f64 / 1e9, wheels[0], wheels[1])),
    );
    let check = |files: &[&str], more: &[&str], parts: &[&str]| {
        let arguments = [&["import"], files, &["--out", "out"][..], &OPTIONS, more].concat();
        refused(folder.path(), &arguments, parts);
    };
    for (table, more, parts) in [
        (
            "stamp,wl,wr\n0,0,0\n",
            &[][..],
            &["bad.csv, line 1: no time and encoders or poses can be told from the columns stamp, wl, wr", "--map"][..],
        ),
        (
            "stamp,left,right\n0,0,0\n",
            &["--map", "t_s=stamp,left=left"],
            &["`left` is no target; targets carry their unit", "left_ticks"],
        ),
        (
            "stamp,wl,wr\n0,0,0\n",
            &["--map", "t_s=time,left_rad=wl,right_rad=wr"],
            &["--map t_s=time: there is no column `time`; there are: stamp, wl, wr"],
        ),
        ("t_s,left_rad\n0,0\n", &[], &["there is `left_rad` but nothing for the right wheels"]),
        ("left_rad,right_rad\n0,0\n", &[], &["nothing for the time"]),
        ("t_s,left_rad,right_ticks\n0,0,0\n", &[], &["`left_rad` and `right_ticks` differ in their unit"]),
        (
            "t_s,left_rad,right_rad\n0,0,0\n1,zero,0\n",
            &[],
            &["bad.csv, line 3: column `left_rad`: `zero` is not allowed here"],
        ),
        (
            "t_s,left_rad,right_rad\n0,0,nan\n",
            &[],
            &["line 2: column `right_rad`: `nan` is not allowed here: it must be a finite number"],
        ),
        ("t_s,left_rad,right_rad\n0,0,0\n1,0\n", &[], &["line 3: 2 values under 3 columns"]),
        ("t_s,left_rad,right_rad\n1,0,0\n0.5,0,0\n", &[], &["line 3: time goes back from 1.000000 s to 0.500000 s"]),
        ("t_s,left_rad,right_rad\n", &[], &["there are no rows"]),
        ("t_s,x_m,y_m\n0,0,0\n", &[], &["nothing for the heading"]),
        ("", &[], &["no time and encoders or poses can be told"]),
    ] {
        std::fs::write(at("bad.csv"), table).expect("it can be written");
        check(&["bad.csv", "good.tum"], more, parts);
    }
    for (trajectory, parts) in [
        (
            "0 0 0 0 0 0 0\n",
            &[
                "bad.tum, line 1: 7 value(s); a line of a TUM trajectory has eight with spaces between them: t x y z qx qy qz qw",
            ][..],
        ),
        ("# t\n0 0 0 0 0 0 0 1\n1 0 a 0 0 0 0 1\n", &["bad.tum, line 3: column `y`: `a` is not allowed here"]),
        ("0 0 0 0 0 0 0 2\n", &["line 1: the quaternion [0.0, 0.0, 0.0, 2.0] (x, y, z, w) has length 2; it must be 1"]),
        ("1 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n", &["bad.tum, line 2: time goes back from 1.000000 s to 0.000000 s"]),
        ("0,0,0,0,0,0,0,1\n", &["bad.tum, line 1: 1 value(s)", "with spaces between them"]),
        ("1e9 0 0 0 0 0 0 1\n", &["good.csv: clocks are mixed", "bring both to one clock first"]),
    ] {
        std::fs::write(at("bad.tum"), trajectory).expect("it can be written");
        check(&["good.csv", "bad.tum"], &[], parts);
    }
    csv(
        &at("milliseconds.csv"),
        "t_s,left_rad,right_rad",
        readings.iter().map(|(time, wheels, _)| format!("{},{},{}", time / 1_000_000, wheels[0], wheels[1])),
    );
    check(
        &["milliseconds.csv", "good.tum"],
        &[],
        &["milliseconds.csv: encoders are stamped 50.000 s apart", "--map t_ms=COLUMN"],
    );
    check(&["good.csv"], &[], &["good.csv: has no poses; name the file that has them beside it", "--pose none"]);
    check(&["good.tum"], &[], &["good.tum: has no encoders"]);
    check(&["good.csv", "good.tum", "bad.csv"], &["--map", "nothing"], &["it must be TARGET=COLUMN"]);
    std::fs::create_dir(at("other")).expect("it is new");
    std::fs::copy(at("good.csv"), at("other/good.csv")).expect("it can be copied");
    check(
        &["good.csv", "good.tum", "other/good.csv"],
        &[],
        &["good.csv and other/good.csv both have encoders of `good`"],
    );
    std::fs::write(at("bad.csv"), [0x74, 0x5f, 0x73, 0x0a, 0xff, 0xfe]).expect("it can be written");
    check(&["bad.csv", "good.tum"], &[], &["bad.csv, line 2: is not UTF-8 text"]);
}

/// Encoders that only say where in its turn a wheel is, and poses that are not there, are common enough to be known.
#[test]
fn wrapped_angles_and_lost_markers() {
    let folder = folder();
    let path = folder.path().join("two.mcap");
    let mut bag = Bag::new(&path);
    for (row, (time, wheels, pose)) in two_runs().into_iter().enumerate() {
        let stamp = BEGAN + time;
        let [left, right] = wheels.map(|angle| angle - TAU * (angle / TAU).round());
        bag.wheels(stamp, stamp, left, right);
        bag.pose(stamp, stamp, if row % 10 == 5 { Pose2::new(f64::NAN, f64::NAN, 0.0) } else { pose });
    }
    bag.close();
    let Imported { dataset, findings, .. } = imported(&[path], &options());
    assert_eq!(dataset.runs[0].protocol, Protocol::Straight { length: 1.0, direction: Travel::Forward });
    assert!(findings.iter().any(|finding| matches!(finding, Finding::Dropouts { count: 52, .. })), "{findings:?}");
    let wrapped = findings
        .iter()
        .filter(|finding| matches!(finding, Finding::Wrapped { range, .. } if range.contains("within one turn")));
    assert_eq!(wrapped.count(), 2, "{findings:?}");
    // Nothing of it is done to counts of a table that go beyond a turn.
    assert_eq!(dataset.runs[0].encoders.as_ref().map(|log| log.unit), Some(EncoderUnit::Radians));
    let none = Options { pose: PoseSource::Nowhere, ..options() };
    let path = folder.path().join("two.mcap");
    assert!(imported(&[path], &none).dataset.runs.iter().all(|run| run.end.is_none()));
}
