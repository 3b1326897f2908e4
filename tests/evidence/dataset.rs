//! The dataset's files: what is written is read back to the bit, what is wrong is said where it stands.

use proptest::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use treadmark::dataset::{
    Campaign, Dataset, DriveKind, EncoderLog, EncoderUnit, PoseLog, Protocol, RobotFacts, Rotation, Run, SurveyFacts,
    SurveyedPose, Travel,
};
use treadmark::geometry::Pose2;
use treadmark::odometry::OdometryParameters;

const TOML: &str = "format = \"treadmark-dataset/1\"\nname = \"t\"\n[odometry]\nleft_wheel_radius_m = 0.1\n\
right_wheel_radius_m = 0.1\ntrack_width_m = 0.5\nticks_per_revolution = 100\n";
const RUNS: &str = "run,protocol,side_m,direction,x_m,y_m,heading_rad\na,square,2,cw,0.1,0.2,-6.2\n";

/// Reads a dataset of these files; the folder's path is cut out of the message.
fn read(files: &[(&str, &str)]) -> Result<Dataset, String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).expect("it can be written");
    }
    Dataset::read(folder.path())
        .map_err(|error| error.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

#[test]
fn a_bad_file_is_named_with_place_value_and_what_is_allowed() {
    let toml = |from: &str, to: &str| TOML.replace(from, to);
    let cases: Vec<(String, String, &str)> = vec![
        (
            toml("/1", "/2"),
            RUNS.into(),
            "dataset.toml, line 1, column 10: unknown variant `treadmark-dataset/2`, expected `treadmark-dataset/1`",
        ),
        (
            toml("name", "nam"),
            RUNS.into(),
            "dataset.toml, line 2, column 1: unknown field `nam`, expected one of `format`, `name`",
        ),
        (
            toml("track_width_m = 0.5", "track_width_m = -0.5"),
            RUNS.into(),
            "line 6, column 17: -0.5 is not allowed here: it must be a finite number above 0",
        ),
        (
            toml("track_width_m = 0.5", "track_width_m = nan"),
            RUNS.into(),
            "line 6, column 17: NaN is not allowed here: it must be a finite number above 0",
        ),
        (TOML.into(), String::new(), "runs.csv, line 1: the file is empty; it begins with a header: run,protocol,…"),
        (TOML.into(), "run,protocol\n".into(), "runs.csv, line 1: there are no runs below the header"),
        (TOML.into(), "run;protocol\na;path\n".into(), "runs.csv, line 1: columns are separated by semicolons"),
        (
            TOML.into(),
            "run,protocol,foo\na,path,1\n".into(),
            "runs.csv, line 1: unknown column `foo`; known are: run, protocol, side_m",
        ),
        (TOML.into(), "run,run,protocol\na,a,path\n".into(), "runs.csv, line 1: column `run` stands there twice"),
        (TOML.into(), "run,side_m\na,1\n".into(), "runs.csv, line 1: column `protocol` is missing"),
        (
            TOML.into(),
            "run,protocol\na,path\na,path\n".into(),
            "runs.csv, line 3, column `run`: `a` is not allowed here: a name of its own; line 2 has it already",
        ),
        (
            TOML.into(),
            RUNS.replace("0.1,0.2", "0,1,0,2"),
            "runs.csv, line 2: 9 values under 7 columns; a decimal comma would also split a value in two",
        ),
        (
            TOML.into(),
            RUNS.replace("0.1,", "\"0,1\","),
            "column `x_m`: `0,1` is not allowed here: a finite number with a decimal point, not a comma",
        ),
        (
            TOML.into(),
            RUNS.replace("0.1,", "nan,"),
            "runs.csv, line 2, column `x_m`: `nan` is not allowed here: a finite number, or blank",
        ),
        (
            TOML.into(),
            RUNS.replace("0.1,", ","),
            "runs.csv, line 2: x_m and y_m (and heading_rad only with them) stand together or are blank together",
        ),
        (
            TOML.into(),
            RUNS.replace("cw", "left"),
            "runs.csv, line 2, column `direction`: `left` is not allowed here: cw or ccw",
        ),
        (
            TOML.into(),
            RUNS.replace("square", "sqare"),
            "column `protocol`: `sqare` is not allowed here: square, straight, spin, circle or path",
        ),
        (
            TOML.into(),
            RUNS.replace(",2,", ",-2,"),
            "runs.csv, line 2, column `side_m`: `-2` is not allowed here: a number above 0",
        ),
        (
            TOML.into(),
            RUNS.replace(",2,", ",,"),
            "runs.csv, line 2, column `side_m`: `` is not allowed here: a square has a side",
        ),
    ];
    for (toml, runs, message) in cases {
        let error = read(&[("dataset.toml", &toml), ("runs.csv", &runs)]).expect_err(message);
        assert!(error.contains(message), "expected\n  {message}\ngot\n  {error}");
    }
}

#[test]
fn a_bad_log_is_named_with_place_value_and_what_is_allowed() {
    for (name, text, message) in [
        (
            "encoders.csv",
            "run,t_s,left_ticks\na,0,0\n",
            "encoders.csv, line 1: encoder columns end in `_ticks` or `_rad`",
        ),
        ("encoders.csv", "run,t_s,left_ticks,right_rad\na,0,0,0\n", "encoders.csv, line 1: encoder columns end in"),
        (
            "encoders.csv",
            "run,t_s,left_ticks,right_ticks\nb,0,0,0\n",
            "encoders.csv, line 2, column `run`: `b` is not allowed here: a run of runs.csv",
        ),
        (
            "encoders.csv",
            "run,t_s,left_ticks,right_ticks\na,1,0,0\na,0.5,0,0\n",
            "encoders.csv, line 3, column `t_s`: `0.5` is not allowed here: time does not go back within a run; the row before is at 1",
        ),
        (
            "encoders.csv",
            "run,t_s,left_ticks,right_ticks\na,0,0,\n",
            "encoders.csv, line 2, column `right_ticks`: `` is not allowed here: a number in every row",
        ),
        ("poses.csv", "run,t_s,x_m,y_m,z_m\na,0,0,0,0\n", "poses.csv, line 1: unknown column `z_m`"),
        ("poses.csv", "run,t_s,x_m\na,0,0\n", "poses.csv, line 1: column `y_m` is missing"),
        ("poses.csv", "run,t_s,x_m,y_m\na,0,inf,0\n", "poses.csv, line 2, column `x_m`: `inf` is not allowed here"),
    ] {
        let error = read(&[("dataset.toml", TOML), ("runs.csv", RUNS), (name, text)]).expect_err(message);
        assert!(error.contains(message), "expected\n  {message}\ngot\n  {error}");
    }
    let no_ticks = TOML.replace("ticks_per_revolution = 100\n", "");
    let log = "run,t_s,left_ticks,right_ticks\na,0,0,0\n";
    let error = read(&[("dataset.toml", &no_ticks), ("runs.csv", RUNS), ("encoders.csv", log)]).expect_err("no ticks");
    assert!(error.contains("says how many make a turn"), "{error}");
}

/// What other programs do to text files changes nothing.
#[test]
fn windows_line_ends_a_byte_order_mark_and_blank_lines_are_read() {
    let plain = read(&[("dataset.toml", TOML), ("runs.csv", RUNS)]).expect("it is good");
    let runs = format!("\u{feff}{}\r\n\r\n", RUNS.replace('\n', "\r\n"));
    let toml = TOML.replace('\n', "\r\n");
    assert_eq!(read(&[("dataset.toml", &toml), ("runs.csv", &runs)]).expect("it is good too"), plain);
}

#[test]
fn a_dataset_is_never_overwritten() {
    let dataset = read(&[("dataset.toml", TOML), ("runs.csv", RUNS)]).expect("it is good");
    let folder = tempfile::tempdir().expect("a temporary folder");
    dataset.write(folder.path()).expect("the folder is empty");
    let error = dataset.write(folder.path()).expect_err("there is one already").to_string();
    assert!(error.contains("a dataset is there already"), "{error}");
}

/// Every real campaign reads. Skipped aloud where the folder is absent.
#[test]
fn measured_campaigns_read() {
    let measured = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/measured");
    if !measured.is_dir() {
        eprintln!("SKIPPED: no measured campaigns at ../shared/data/measured");
        return;
    }
    for (name, runs) in [
        ("optiodom-square-230620202042", 6),
        ("optiodom-square-230620202258", 6),
        ("optiodom-square-231220200029", 6),
        ("optiodom-circular-250620202104", 6),
        ("optiodom-circular-231220200121", 6),
        ("optiodom-ivanjko-231220200057", 9),
        ("husky-tile-a", 305),
    ] {
        let dataset = Dataset::read(&measured.join(name)).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(dataset.runs.len(), runs, "{name}");
        let odometry = dataset.campaign.odometry.expect("it is stated");
        for run in &dataset.runs {
            let log = run.encoders.as_ref().expect("every run is logged");
            assert!(log.len() > 10 && run.poses.as_ref().is_some_and(|poses| poses.time.len() > 10), "{name}");
            assert!(run.dead_reckoned_end(&odometry).is_some_and(|end| end.x.is_finite()), "{name}");
        }
    }
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![-1e3..1e3f64, prop::num::f64::NORMAL]
}

fn positive() -> impl Strategy<Value = f64> {
    prop_oneof![1e-3..1e3f64, prop::num::f64::POSITIVE | prop::num::f64::NORMAL]
}

fn surveyed() -> impl Strategy<Value = Option<SurveyedPose>> {
    prop::option::of((number(), number(), prop::option::of(number())).prop_map(|(x, y, heading)| SurveyedPose {
        x,
        y,
        heading,
    }))
}

fn protocol() -> impl Strategy<Value = Protocol> {
    let round = || prop_oneof![Just(Rotation::Clockwise), Just(Rotation::CounterClockwise)];
    let along = prop_oneof![Just(Travel::Forward), Just(Travel::Reverse)];
    prop_oneof![
        (positive(), round()).prop_map(|(side, direction)| Protocol::Square { side, direction }),
        (positive(), along).prop_map(|(length, direction)| Protocol::Straight { length, direction }),
        (positive(), round()).prop_map(|(turn, direction)| Protocol::Spin { turn, direction }),
        (positive(), prop::option::of(positive()), round()).prop_map(|(radius, turn, direction)| Protocol::Circle {
            radius,
            turn,
            direction
        }),
        Just(Protocol::Path),
    ]
}

fn stamps() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(0.0..10.0f64, 1..5).prop_map(|mut times| {
        times.sort_by(f64::total_cmp);
        times
    })
}

fn encoders() -> impl Strategy<Value = Option<EncoderLog>> {
    prop::option::of(stamps().prop_flat_map(|time| {
        let rows = time.len();
        prop::collection::vec(number(), 2 * rows).prop_map(move |counts| EncoderLog {
            unit: EncoderUnit::Ticks,
            channels: vec!["left".to_owned(), "right".to_owned()],
            time: time.clone(),
            counts,
        })
    }))
}

fn poses() -> impl Strategy<Value = Option<PoseLog>> {
    prop::option::of(stamps().prop_flat_map(|time| {
        let rows = time.len();
        let pose = surveyed().prop_filter_map("a position", |pose| pose);
        prop::collection::vec(pose, rows).prop_map(move |poses| PoseLog { time: time.clone(), poses })
    }))
}

fn dataset() -> impl Strategy<Value = Dataset> {
    let run = (
        protocol(),
        prop::option::of(number()),
        prop::option::of((number(), number(), number()).prop_map(|(x, y, heading)| Pose2::new(x, y, heading))),
        surveyed(),
        surveyed(),
        encoders(),
        poses(),
    );
    (prop::collection::vec(run, 1..6), positive(), "[ -~]{0,12}").prop_map(|(runs, track_width, words)| Dataset {
        campaign: Campaign {
            name: format!("n{words}"),
            description: Some(words.clone()),
            odometry: Some(OdometryParameters {
                left_wheel_radius: 0.1,
                right_wheel_radius: 0.1 + f64::EPSILON,
                track_width,
                ticks_per_revolution: Some(2796.8),
            }),
            robot: RobotFacts { drive: Some(DriveKind::SkidSteer), mass: Some(24.0), ..Default::default() },
            survey: SurveyFacts { method: Some("tape".to_owned()), position_std: Some(0.0), heading_std: None },
            conditions: BTreeMap::from([("payload_kg".to_owned(), toml::Value::Float(3.5))]),
            ..Default::default()
        },
        runs: runs
            .into_iter()
            .enumerate()
            .map(|(index, (protocol, speed, start, end, odometry_end, encoders, poses))| Run {
                name: format!("r{index},{}", words.trim()),
                protocol,
                speed,
                turn_rate: None,
                started: None,
                start,
                end,
                odometry_end,
                encoders,
                poses,
            })
            .collect(),
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn what_is_written_is_read_back(dataset in dataset()) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        dataset.write(folder.path()).expect("the folder is new");
        let back = Dataset::read(folder.path()).map_err(|error| TestCaseError::fail(error.to_string()))?;
        prop_assert_eq!(back, dataset);
    }
}
