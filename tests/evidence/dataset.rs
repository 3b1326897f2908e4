//! The dataset's files: what is written is read back to the bit, what is wrong is said where it stands.

use proptest::prelude::*;
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

/// A bad file: what was to be said about it, in full.
fn assert_says(files: &[(&str, &str)], message: &str) {
    match read(files) {
        Ok(_) => panic!("it reads, but was to say\n  {message}"),
        Err(error) => assert_eq!(error, message),
    }
}

#[test]
fn a_bad_campaign_is_named_with_place_key_and_what_is_allowed() {
    let cases = [
        (
            "/1",
            "/2",
            "line 1, column 10: unknown variant `treadmark-dataset/2`, expected `treadmark-dataset/1`, in `format`",
        ),
        ("format = \"treadmark-dataset/1\"", "", "line 1, column 1: missing field `format`"),
        (
            "name",
            "nam",
            "line 2, column 1: unknown field `nam`, expected one of `format`, `name`, `description`, `source`, `licence`, `robot`, `world`, `odometry`, `survey`, `conditions`",
        ),
        (
            "track_width_m",
            "track_width",
            "line 6, column 1: unknown field `track_width`, expected one of `left_wheel_radius_m`, `right_wheel_radius_m`, `track_width_m`, `ticks_per_revolution`, in `odometry`",
        ),
        (
            "= 0.5",
            "= -0.5",
            "line 6, column 17: -0.5 is not allowed here: it must be a finite number above 0, in `odometry.track_width_m`",
        ),
        (
            "= 0.5",
            "= nan",
            "line 6, column 17: NaN is not allowed here: it must be a finite number above 0, in `odometry.track_width_m`",
        ),
        ("= 0.5", "= 0,5", "line 6, column 18: unexpected key or value, expected newline, `#`"),
        (
            "= 100",
            "= 0",
            "line 7, column 24: 0 is not allowed here: it must be a finite number above 0, in `odometry.ticks_per_revolution`",
        ),
        (
            "= 100",
            "= \"many\"",
            "line 7, column 24: invalid type: string \"many\", expected f64, in `odometry.ticks_per_revolution`",
        ),
        (
            "= 100\n",
            "= 100\n[survey]\nposition_std_m = -1\n",
            "line 9, column 18: -1 is not allowed here: it must be a finite number, 0 or above, in `survey.position_std_m`",
        ),
        (
            "= 100\n",
            "= 100\n[robot]\ndrive = \"tracks\"\n",
            "line 9, column 9: unknown variant `tracks`, expected `skid-steer` or `differential`, in `robot.drive`",
        ),
        (
            "= 100\n",
            "= 100\n[conditions]\nload = [1, {x = inf}]\n",
            "line 9, column 8: inf is not allowed here: numbers are finite, in `conditions.load`",
        ),
    ];
    for (from, to, message) in cases {
        let message = format!("dataset.toml, {message}");
        assert_says(&[("dataset.toml", &TOML.replacen(from, to, 1)), ("runs.csv", RUNS)], &message);
    }
}

#[test]
fn bad_runs_are_named_with_line_column_value_and_what_is_allowed() {
    let known = "run, protocol, side_m, radius_m, turn_rad, direction, speed_m_s, turn_rate_rad_s, started_s, start_x_m, start_y_m, start_heading_rad, x_m, y_m, heading_rad, odom_x_m, odom_y_m, odom_heading_rad";
    let unknown = format!("line 1: unknown column `foo`; known are: {known}");
    let cases = [
        (String::new(), "line 1: the file is empty; it begins with a header: run,protocol,…"),
        ("\n \n".into(), "line 1: the file is empty; it begins with a header: run,protocol,…"),
        ("run,protocol\n".into(), "line 1: there are no runs below the header"),
        (
            "run;protocol\na;path\n".into(),
            "line 1: columns are separated by semicolons; write commas between columns and points in decimals",
        ),
        ("run,protocol,foo\na,path,1\n".into(), &unknown),
        ("run,run,protocol\na,a,path\n".into(), "line 1: column `run` stands there twice"),
        ("run,side_m\na,1\n".into(), "line 1: column `protocol` is missing"),
        (
            "run,protocol\na,path\na,path\n".into(),
            "line 3, column `run`: `a` is not allowed here: a name of its own; line 2 has it already",
        ),
        ("run,protocol\n,path\n".into(), "line 2, column `run`: must not be blank: a run has a name"),
        (
            "run,protocol\na,\n".into(),
            "line 2, column `protocol`: must not be blank: a run is a square, straight, spin, circle or path",
        ),
        // Blank lines count: the line is the one that an editor shows.
        (
            "\nrun,protocol\n\n\na,path\n\nb,part\n".into(),
            "line 7, column `protocol`: `part` is not allowed here: square, straight, spin, circle or path",
        ),
        (
            "\r\nrun,protocol\r\n\r\na,path\r\n\r\nb,part\r\n".into(),
            "line 6, column `protocol`: `part` is not allowed here: square, straight, spin, circle or path",
        ),
        (
            "run,protocol\na,\"path\nb,path\n".into(),
            "line 2: a value runs over the end of the line; a double quote that opens a value needs one that closes it",
        ),
        (
            RUNS.replace("0.1,0.2", "0,1,0,2"),
            "line 2: 9 values under 7 columns; a decimal comma would also split a value in two: write points in decimals",
        ),
        (
            RUNS.replace("0.1,", "\"0,1\","),
            "line 2, column `x_m`: `0,1` is not allowed here: a finite number with a decimal point, not a comma",
        ),
        (RUNS.replace("0.1,", "nan,"), "line 2, column `x_m`: `nan` is not allowed here: a finite number"),
        (RUNS.replace("0.1,", "1e999,"), "line 2, column `x_m`: `1e999` is not allowed here: a finite number"),
        (RUNS.replace("0.1,", "0.1 m,"), "line 2, column `x_m`: `0.1 m` is not allowed here: a finite number"),
        (
            RUNS.replace("0.1,", ","),
            "line 2, column `x_m`: must not be blank beside `0.2` in `y_m`: a pose is whole or blank",
        ),
        (
            RUNS.replace("0.1,0.2", ","),
            "line 2, column `x_m`: must not be blank beside `-6.2` in `heading_rad`: a pose is whole or blank",
        ),
        (
            "run,protocol,start_x_m,start_y_m\na,path,1,2\n".into(),
            "line 2, column `start_heading_rad`: must not be blank: start_x_m and start_y_m stand beside it",
        ),
        (RUNS.replace("cw", "left"), "line 2, column `direction`: `left` is not allowed here: cw or ccw"),
        (
            RUNS.replace("cw", ""),
            "line 2, column `direction`: must not be blank: a square, a spin and a circle go round cw or ccw",
        ),
        (
            RUNS.replace("square", "straight"),
            "line 2, column `direction`: `cw` is not allowed here: forward or reverse, or blank for forward",
        ),
        (RUNS.replace("square", "circle"), "line 2, column `radius_m`: must not be blank: a circle has a radius"),
        (RUNS.replace("square", "spin"), "line 2, column `turn_rad`: must not be blank: a spin has a total turn"),
        (
            RUNS.replace("square", "sqare"),
            "line 2, column `protocol`: `sqare` is not allowed here: square, straight, spin, circle or path",
        ),
        (RUNS.replace(",2,", ",-2,"), "line 2, column `side_m`: `-2` is not allowed here: a number above 0"),
        (RUNS.replace(",2,", ",,"), "line 2, column `side_m`: must not be blank: a square has a side"),
    ];
    for (runs, message) in cases {
        assert_says(&[("dataset.toml", TOML), ("runs.csv", &runs)], &format!("runs.csv, {message}"));
    }
}

#[test]
fn a_bad_log_is_named_with_line_column_value_and_what_is_allowed() {
    let pair = "run,t_s,left_ticks,right_ticks\n";
    for (name, text, message) in [
        (
            "encoders.csv",
            "run,t_s,left_ticks\na,0,0\n".into(),
            "line 1: no column of the right side; encoder columns are left_ticks and right_ticks, left_rad and right_rad, or one a wheel, such as front_right_ticks",
        ),
        (
            "encoders.csv",
            "run,t_s,left_ticks,right_rad\na,0,0,0\n".into(),
            "line 1: columns `left_ticks` and `right_rad` differ in their unit; all encoder columns count ticks, or all are in rad",
        ),
        (
            "encoders.csv",
            "run,t_s,left_ticks,right_ticks,battery_v\n".into(),
            "line 1: unknown column `battery_v`; encoder columns are left_ticks and right_ticks, left_rad and right_rad, or one a wheel, such as front_left_ticks",
        ),
        (
            "encoders.csv",
            format!("{pair}b,0,0,0\n"),
            "line 2, column `run`: `b` is not allowed here: a run of runs.csv",
        ),
        (
            "encoders.csv",
            format!("{pair}a,1,0,0\na,0.5,0,0\n"),
            "line 3, column `t_s`: `0.5` is not allowed here: time does not go back within a run; the row before is at 1",
        ),
        (
            "encoders.csv",
            format!("{pair}a,0,0,\n"),
            "line 2, column `right_ticks`: must not be blank: every row is a reading of every encoder",
        ),
        ("encoders.csv", format!("{pair}a,,0,0\n"), "line 2, column `t_s`: must not be blank: every row has its time"),
        (
            "poses.csv",
            "run,t_s,x_m,y_m,z_m\na,0,0,0,0\n".into(),
            "line 1: unknown column `z_m`; known are: run, t_s, x_m, y_m, heading_rad",
        ),
        ("poses.csv", "run,t_s,x_m\na,0,0\n".into(), "line 1: column `y_m` is missing"),
        (
            "poses.csv",
            "run,t_s,x_m,y_m\na,0,inf,0\n".into(),
            "line 2, column `x_m`: `inf` is not allowed here: a finite number",
        ),
    ] {
        assert_says(&[("dataset.toml", TOML), ("runs.csv", RUNS), (name, &text)], &format!("{name}, {message}"));
    }
    let no_ticks = TOML.replace("ticks_per_revolution = 100\n", "");
    let log = format!("{pair}a,0,0,0\n");
    assert_says(
        &[("dataset.toml", &no_ticks), ("runs.csv", RUNS), ("encoders.csv", &log)],
        "encoders.csv: its columns count ticks, but neither odometry.ticks_per_revolution nor robot.ticks_per_revolution of dataset.toml says how many make a turn",
    );
    let of_robot = format!("{no_ticks}[robot]\nticks_per_revolution = 50\n");
    let dataset = read(&[("dataset.toml", &of_robot), ("runs.csv", RUNS), ("encoders.csv", &log)]).expect("it is good");
    assert_eq!(dataset.campaign.odometry.and_then(|odometry| odometry.ticks_per_revolution), Some(50.0));
}

#[test]
fn a_file_that_is_no_text_is_named_with_its_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("dataset.toml"), TOML).expect("it can be written");
    std::fs::write(folder.path().join("runs.csv"), b"run,protocol\nm\xfcde,path\n").expect("it can be written");
    let error = Dataset::read(folder.path()).expect_err("Latin-1 is not UTF-8").to_string();
    assert!(error.ends_with("runs.csv, line 2: is not UTF-8 text; save the file as UTF-8"), "{error}");
}

/// Rows of several runs may alternate; only within a run does time not go back, and it may stand still.
#[test]
fn rows_of_runs_may_alternate() {
    let runs = "run,protocol\na,path\nb,path\n";
    let log = "run,t_s,left_rad,right_rad\na,1,0,0\nb,0,5,5\na,1,1,2\nb,3,6,7\n";
    let dataset = read(&[("dataset.toml", TOML), ("runs.csv", runs), ("encoders.csv", log)]).expect("it is good");
    let log = |run: usize| dataset.runs[run].encoders.clone().expect("it is logged");
    assert_eq!((log(0).time, log(0).counts), (vec![1.0, 1.0], vec![0.0, 0.0, 1.0, 2.0]));
    assert_eq!((log(1).time, log(1).counts), (vec![0.0, 3.0], vec![5.0, 5.0, 6.0, 7.0]));
}

/// What other programs do to text files changes nothing.
#[test]
fn windows_line_ends_a_byte_order_mark_and_blank_lines_are_read() {
    let plain = read(&[("dataset.toml", TOML), ("runs.csv", RUNS)]).expect("it is good");
    let runs = format!("\u{feff}{}\r\n\r\n", RUNS.replace('\n', "\r\n"));
    let toml = format!("\u{feff}{}", TOML.replace('\n', "\r\n"));
    assert_eq!(read(&[("dataset.toml", &toml), ("runs.csv", &runs)]).expect("it is good too"), plain);
}

#[test]
fn a_dataset_is_never_overwritten() {
    let dataset = read(&[("dataset.toml", TOML), ("runs.csv", RUNS)]).expect("it is good");
    let folder = tempfile::tempdir().expect("a temporary folder");
    dataset.write(folder.path()).expect("the folder is empty");
    let error = dataset.write(folder.path()).expect_err("there is one already").to_string();
    assert!(error.contains("never overwritten"), "{error}");
}

/// A log that was left lying there would become part of a dataset that has none.
#[test]
fn a_stray_log_is_not_taken_in() {
    let dataset = read(&[("dataset.toml", TOML), ("runs.csv", RUNS)]).expect("it is good");
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("encoders.csv"), "run,t_s,left_rad,right_rad\na,0,0,0\n").expect("written");
    let error = dataset.write(folder.path()).expect_err("a log is there already").to_string();
    assert!(error.contains("encoders.csv: is there already"), "{error}");
    assert!(!folder.path().join("dataset.toml").exists());
}

/// What would not read back is refused before anything is written.
#[test]
fn what_would_not_read_back_is_not_written() {
    let good = read(&[("dataset.toml", TOML), ("runs.csv", RUNS)]).expect("it is good");
    type Edit = fn(&mut Dataset);
    let edits: [(Edit, &str); 4] = [
        (
            |dataset| dataset.runs[0].end = Some(SurveyedPose { x: 0.1, y: f64::NAN, heading: None }),
            "/runs.csv, line 2, column `y_m`: `NaN` is not allowed here: a finite number",
        ),
        (
            |dataset| dataset.runs.push(dataset.runs[0].clone()),
            "/runs.csv, line 3, column `run`: `a` is not allowed here: a name of its own; line 2 has it already",
        ),
        (
            |dataset| dataset.runs[0].name = " a".to_owned(),
            ": run ` a` would not read back as it is; names begin and end without blanks, no log is empty, and all encoder logs of a campaign count the same channels in the same unit",
        ),
        (
            |dataset| dataset.campaign.survey.heading_std = Some(f64::NEG_INFINITY),
            "/dataset.toml, line 12, column 19: -inf is not allowed here: it must be a finite number, 0 or above, in `survey.heading_std_rad`",
        ),
    ];
    for (edit, message) in edits {
        let mut bad = good.clone();
        edit(&mut bad);
        let folder = tempfile::tempdir().expect("a temporary folder");
        let error = bad.write(folder.path()).expect_err(message).to_string();
        assert_eq!(error.replace(&folder.path().display().to_string(), ""), message);
        assert_eq!(std::fs::read_dir(folder.path()).expect("it is there").count(), 0, "nothing is left behind");
    }
}

/// Without a log, a closed protocol ends where the robot's own odometry closed it: at the start, a whole turn on.
#[test]
fn a_square_without_logs_is_dead_reckoned_to_its_start() {
    for (direction, heading) in [("cw", -std::f64::consts::TAU), ("ccw", std::f64::consts::TAU)] {
        let runs = RUNS.replace("cw", direction);
        let dataset = read(&[("dataset.toml", TOML), ("runs.csv", &runs)]).expect("it is good");
        let odometry = dataset.campaign.odometry.expect("it is stated");
        assert_eq!(dataset.runs[0].dead_reckoned_end(&odometry), Some(Pose2::new(0.0, 0.0, heading)));
    }
}

/// Centres of gravity of surveyed − dead-reckoned ends of the real squares: finite, and less than 0.2 m from the origin,
/// which only holds if ticks, radii, track and the frames of both poses are read as they are meant.
#[test]
fn centres_of_gravity_of_the_measured_squares_are_small() {
    let Some(measured) = measured() else { return };
    for name in ["optiodom-square-230620202042", "optiodom-square-230620202258", "optiodom-square-231220200029"] {
        let dataset = Dataset::read(&measured.join(name)).unwrap_or_else(|error| panic!("{error}"));
        let odometry = dataset.campaign.odometry.expect("it is stated");
        for wanted in [Rotation::Clockwise, Rotation::CounterClockwise] {
            let errors: Vec<(f64, f64)> = dataset
                .runs
                .iter()
                .filter(|run| matches!(run.protocol, Protocol::Square { direction, .. } if direction == wanted))
                .map(|run| {
                    let end = run.end.expect("every end is surveyed");
                    let believed = run.dead_reckoned_end(&odometry).expect("every run is logged");
                    (end.x - believed.x, end.y - believed.y)
                })
                .collect();
            assert_eq!(errors.len(), 3, "{name}");
            let (x, y) = errors.iter().fold((0.0, 0.0), |(x, y), error| (x + error.0 / 3.0, y + error.1 / 3.0));
            let radius = f64::hypot(x, y);
            assert!(radius.is_finite() && radius < 0.2, "{name}, {}: {radius} m", wanted.as_str());
        }
    }
}

/// The real campaigns, which stand beside the project; says aloud when they do not.
fn measured() -> Option<std::path::PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/measured");
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("SKIPPED: no measured campaigns at ../shared/data/measured");
    None
}

/// Every real campaign reads. Skipped aloud where the folder is absent.
#[test]
fn measured_campaigns_read() {
    let Some(measured) = measured() else { return };
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

/// The columns of a campaign's encoders: their unit and their channels.
fn columns() -> impl Strategy<Value = (EncoderUnit, Vec<String>)> {
    let unit = prop_oneof![Just(EncoderUnit::Ticks), Just(EncoderUnit::Radians)];
    let pair = ["left", "right"].map(str::to_owned).to_vec();
    let wheels = ["front_left", "rear_left", "front_right", "rear_right"].map(str::to_owned).to_vec();
    (unit, prop_oneof![Just(pair), Just(wheels)])
}

fn encoders(unit: EncoderUnit, channels: Vec<String>) -> impl Strategy<Value = Option<EncoderLog>> {
    prop::option::of(stamps().prop_flat_map(move |time| {
        let (rows, channels) = (time.len(), channels.clone());
        let count = prop_oneof![number(), (-9_000_000i64..9_000_000).prop_map(|ticks| ticks as f64)];
        prop::collection::vec(count, channels.len() * rows).prop_map(move |counts| EncoderLog {
            unit,
            channels: channels.clone(),
            time: time.clone(),
            counts,
        })
    }))
}

/// Any value that a TOML file may state and that is equal to itself.
fn condition() -> impl Strategy<Value = toml::Value> {
    let leaf = prop_oneof![
        any::<bool>().prop_map(toml::Value::Boolean),
        any::<i64>().prop_map(toml::Value::Integer),
        number().prop_map(toml::Value::Float),
        any::<String>().prop_map(toml::Value::String),
    ];
    leaf.prop_recursive(2, 8, 3, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 0..3).prop_map(toml::Value::Array),
            prop::collection::btree_map(any::<String>(), inner, 0..3)
                .prop_map(|table| toml::Value::Table(table.into_iter().collect())),
        ]
    })
}

fn poses() -> impl Strategy<Value = Option<PoseLog>> {
    prop::option::of(stamps().prop_flat_map(|time| {
        let rows = time.len();
        let pose = surveyed().prop_filter_map("a position", |pose| pose);
        prop::collection::vec(pose, rows).prop_map(move |poses| PoseLog { time: time.clone(), poses })
    }))
}

fn run(unit: EncoderUnit, channels: Vec<String>) -> impl Strategy<Value = Run> {
    let start = (number(), number(), number()).prop_map(|(x, y, heading)| Pose2::new(x, y, heading));
    let quantities = (prop::option::of(number()), prop::option::of(number()), prop::option::of(number()));
    let logs = (encoders(unit, channels), poses());
    (protocol(), quantities, prop::option::of(start), surveyed(), surveyed(), logs).prop_map(
        |(protocol, (speed, turn_rate, started), start, end, odometry_end, (encoders, poses))| Run {
            name: String::new(),
            protocol,
            speed,
            turn_rate,
            started,
            start,
            end,
            odometry_end,
            encoders,
            poses,
        },
    )
}

fn dataset() -> impl Strategy<Value = Dataset> {
    let runs = columns().prop_flat_map(|(unit, channels)| prop::collection::vec(run(unit, channels), 1..6));
    let conditions = prop::collection::btree_map(any::<String>(), condition(), 0..4);
    (runs, positive(), "[ -~]{0,12}", any::<String>(), conditions).prop_map(
        |(mut runs, track_width, words, description, conditions)| {
            for (index, run) in runs.iter_mut().enumerate() {
                run.name = format!("r{index},{}", words.trim());
            }
            let robot = RobotFacts {
                model: Some("robots/a \"b\".toml".into()),
                drive: Some(DriveKind::SkidSteer),
                mass: Some(24.0),
                ..Default::default()
            };
            let campaign = Campaign {
                name: format!("n{words}"),
                description: Some(description),
                odometry: Some(OdometryParameters {
                    left_wheel_radius: 0.1,
                    right_wheel_radius: 0.1 + f64::EPSILON,
                    track_width,
                    ticks_per_revolution: Some(2796.8),
                }),
                robot,
                survey: SurveyFacts { method: Some("tape".to_owned()), position_std: Some(0.0), heading_std: None },
                conditions,
                ..Default::default()
            };
            Dataset { campaign, runs }
        },
    )
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
