//! Sweeps: plans, points, and one table whatever threads, shards and interruptions there were.

use super::cli::{refused, text, treadmark};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use treadmark::dataset::{Protocol, Travel};
use treadmark::drive::{self, Task};
use treadmark::effect::Cause;
use treadmark::experiment::sweep::{Plan, Shard, Sweep, SweepError, TABLE, Value, merge};
use treadmark::scene::Scene;

/// Twelve short straights: two seconds of simulation each.
const SHORT: &str = r#"
format = "treadmark-sweep/1"
point = "run"
seed = 5
repeats = 2
time_step_s = 0.0025

[protocol]
kind = "straight"

[set]
"floor_slope.downhill_heading_rad" = 1.5

[[grid]]
parameter = "protocol.length_m"
values = [0.1, 0.2]

[[grid]]
parameter = "floor_slope.gradient"
from = 0.0
to = 0.02
count = 3
"#;

fn plan(text: &str) -> Plan {
    Plan::parse(Path::new("plan.toml"), text.to_owned()).expect("it is a plan")
}

fn sweep(text: &str) -> Sweep {
    Sweep::prepare(plan(text)).expect("its robot is shipped")
}

fn run(sweep: &Sweep, folder: &Path, shard: Shard) -> Result<(), SweepError> {
    let swept = sweep.run(folder, shard, &|_| {}, &AtomicBool::new(false))?;
    assert!(swept.is_complete() && swept.failures.is_empty(), "{swept:?}");
    Ok(())
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn bytes(folder: &Path) -> Vec<u8> {
    std::fs::read(folder.join(TABLE)).expect("there is a table")
}

/// The values of all points, as text.
fn values(text: &str) -> Vec<String> {
    let plan = plan(text);
    let line = |index| {
        let values: Vec<String> = plan.point(index).values.iter().map(Value::to_string).collect();
        values.join(" ")
    };
    (0..plan.len()).map(line).collect()
}

const HEAD: &str = "format = \"treadmark-sweep/1\"\npoint = \"run\"\n";

#[test]
fn a_bad_plan_is_refused_with_place_value_and_what_is_allowed() {
    let grid = |body: &str| format!("{HEAD}[[grid]]\n{body}\n");
    for (plan, parts) in [
        (format!("{HEAD}sides = 2\n"), &["plan.toml, line 3, column 1", "unknown field `sides`, expected one of"][..]),
        (
            HEAD.replace("run", "walk"),
            &["line 2, column 9", "unknown variant `walk`, expected one of `run`, `campaign`"],
        ),
        (
            grid("parameter = \"tyre.grip\"\nvalues = [1]"),
            &["line 4, column 13", "no parameter `tyre.grip`", "tyre.width_m"],
        ),
        (
            grid("parameter = \"tyre.width_m\"\nvalues = [0.1, -0.1]"),
            &["plan.toml, line 5, column 16: tyre.width_m = -0.1: it must be a finite number above 0"],
        ),
        (
            grid("parameter = \"tyre.width_m\"\nvalues = [\"wide\"]"),
            &["line 5, column 11: tyre.width_m = \"wide\": it must be a finite number above 0"],
        ),
        (grid("parameter = \"tyre.width_m\"\nvalues = [true]"), &["line 5, column 10", "a number or a text"]),
        (
            grid("parameter = \"floor_slope.gradient\"\nvalues = [7.5]"),
            &["line 5, column 11: floor_slope.gradient = 7.5: it must be a number from 0 to "],
        ),
        (grid("parameter = \"survey.position_std_m\"\nvalues = [nan]"), &["survey.position_std_m = NaN", "0 or above"]),
        (
            grid("parameter = \"protocol.radius_m\"\nvalues = [1]"),
            &["line 4, column 13: protocol.radius_m: a square does not have it"],
        ),
        (
            grid("parameter = \"campaign.runs\"\nvalues = [1]"),
            &["line 4, column 13: campaign.runs: a run does not have it"],
        ),
        (
            grid("parameter = \"protocol.direction\"\nvalues = [\"forward\"]"),
            &["protocol.direction = \"forward\": it must be one of cw, ccw"],
        ),
        (
            grid("parameter = \"tyre.width_m\"\nvalues = [1]\n[[grid]]\nparameter = \"tyre.width_m\"\nvalues = [1]"),
            &["line 7, column 13: tyre.width_m is varied a second time"],
        ),
        (
            grid("parameter = \"tyre.width_m\"\nfrom = 0.1\ncount = 3"),
            &["line 4, column 13: tyre.width_m: give either values, or from < to and a count of 2 or more"],
        ),
        (
            format!("{HEAD}[list]\nparameters = [\"tyre.width_m\", \"protocol.side_m\"]\npoints = [[0.1, 1], [0.1]]\n"),
            &["line 5, column 21: this point has 1 values; its parameters are 2"],
        ),
        (
            grid("parameter = \"tyre.width_m\"\nfrom = 0.1\nto = 0.2\ncount = 20000000"),
            &["20000000 points; there must be from 1 to 10000000"],
        ),
        (grid("parameter = \"tyre.width_m\"\nvalues = []"), &["0 points; there must be from 1"]),
        (
            grid("parameter = \"wheels.middle_left.width_m\"\nvalues = [0.1]"),
            &["wheels.middle_left.width_m: jnpf_4wd on lab_floor does not have it; its wheels are: front_left, "],
        ),
        (
            grid("parameter = \"wheel_toe.angle_rad\"\nvalues = [0.1]"),
            &["plan.toml: wheel_toe.wheel = \"\": it must be one of front_left, "],
        ),
        (format!("{HEAD}robot = \"robbie\"\n"), &["plan.toml: ", "robbie", "jnpf_4wd"]),
    ] {
        let folder = folder();
        std::fs::write(folder.path().join("plan.toml"), plan).expect("it can be written");
        refused(folder.path(), &["sweep", "plan.toml", "--out", "out"], parts);
        assert!(!folder.path().join("out").exists(), "nothing is begun");
    }
    let folder = folder();
    refused(folder.path(), &["sweep", "none.toml", "--out", "out"], &["none.toml: "]);
    refused(folder.path(), &["sweep", "p", "--out", "o", "--shard", "4/4"], &["--shard", "I < N, from 0/N on"]);
    refused(folder.path(), &["sweep", "--merge", "."], &[".: holds no sweep and no shards of one"]);
}

#[test]
fn grids_lists_and_repeats_are_combined_in_a_stated_order() {
    let text = format!(
        "{HEAD}repeats = 2\nseed = 9\n\
         [list]\nparameters = [\"protocol.side_m\", \"protocol.direction\"]\npoints = [[1, \"cw\"], [2, \"ccw\"]]\n\
         [[grid]]\nparameter = \"tyre.friction_across\"\nvalues = [0.5, 0.75]\n\
         [[grid]]\nparameter = \"tyre.vertical_stiffness_n_m\"\nfrom = 1e4\nto = 1e6\ncount = 3\nscale = \"log\"\n"
    );
    let values = values(&text);
    assert_eq!(values.len(), 2 * 2 * 3 * 2);
    assert_eq!(values[0], "1 \"cw\" 0.5 10000");
    assert_eq!(values[1], values[0], "repeats are neighbours");
    let middle: f64 = values[2].rsplit(' ').next().and_then(|value| value.parse().ok()).expect("a number");
    assert!((middle / 1e5 - 1.0).abs() < 1e-12, "the middle of a log range is the geometric mean: {middle}");
    assert_eq!(values[5], "1 \"cw\" 0.5 1000000", "the end of a range is the number that was given");
    assert_eq!(values[6], "1 \"cw\" 0.75 10000");
    assert_eq!(values[23], "2 \"ccw\" 0.75 1000000");
    let point = plan(&text).point(23);
    assert_eq!((point.index, point.repeat, point.seed), (23, 2, 32));
}

fn sampled(method: &str, seed: u32) -> Vec<[f64; 2]> {
    let text = format!(
        "{HEAD}seed = {seed}\n[sample]\nmethod = \"{method}\"\ncount = 64\n\
         [[sample.over]]\nparameter = \"tyre.friction_across\"\nfrom = 0.5\nto = 1.5\n\
         [[sample.over]]\nparameter = \"encoder.latency_s\"\nfrom = 0.0\nto = 1.0\n"
    );
    let plan = plan(&text);
    let shares = |index| match plan.point(index).values.as_slice() {
        [Value::Number(a), Value::Number(b)] => [a - 0.5, *b],
        other => panic!("{other:?}"),
    };
    (0..plan.len()).map(shares).collect()
}

#[test]
fn samples_are_seeded_and_sobol_points_are_a_net() {
    for method in ["random", "sobol"] {
        assert_eq!(sampled(method, 1), sampled(method, 1));
        assert_ne!(sampled(method, 1), sampled(method, 2));
        assert!(sampled(method, 1).iter().flatten().all(|share| (0.0..1.0).contains(share)));
    }
    // A (0, 6, 2)-net in base 2 [Niederreiter 1987]: every 2^-a by 2^-b box with a + b = 6 holds one of the 64 points.
    for seed in 1..5 {
        let points = sampled("sobol", seed);
        for a in 0..=6 {
            let (wide, high) = (f64::from(1 << a), f64::from(1 << (6 - a)));
            let mut boxes: Vec<_> = points.iter().map(|[x, y]| ((x * wide) as u32, (y * high) as u32)).collect();
            boxes.sort_unstable();
            boxes.dedup();
            assert_eq!(boxes.len(), 64, "seed {seed}, boxes of 2^-{a}");
        }
    }
}

#[test]
fn the_table_has_typed_columns_its_plan_and_rows_that_drive_again() {
    let folder = folder();
    let out = folder.path().join("out");
    run(&sweep(SHORT), &out, Shard::WHOLE).expect("it sweeps");
    let file = std::fs::File::open(out.join(TABLE)).expect("there is a table");
    let reader = SerializedFileReader::new(file).expect("it is Parquet");
    let meta = reader.metadata().file_metadata();
    let notes = meta.key_value_metadata().expect("there are notes");
    let note = |key: &str| notes.iter().find(|note| note.key == key).and_then(|note| note.value.clone());
    assert_eq!(note("treadmark.plan").as_deref(), Some(SHORT));
    assert_eq!(note("treadmark.seed").as_deref(), Some("5"));
    assert_eq!(note("treadmark.version").as_deref(), Some(env!("CARGO_PKG_VERSION")));

    let rows: Vec<_> = reader.get_row_iter(None).expect("rows").map(|row| row.expect("a row")).collect();
    assert_eq!(rows.len(), 12);
    for (index, row) in rows.iter().enumerate() {
        let cell =
            |name: &str| row.get_column_iter().find(|(column, _)| *column == name).map(|(_, field)| field.clone());
        let number = |name: &str| match cell(name) {
            Some(Field::Double(value)) => value,
            other => panic!("{name}: {other:?}"),
        };
        assert_eq!(cell("point"), Some(Field::ULong(index as u64)), "rows are in point order");
        assert_eq!(cell("failure"), Some(Field::Null));
        // The same robot, driven by hand.
        let mut scene = Scene::load("jnpf_4wd", "lab_floor").expect("shipped");
        scene.time_step = 2.5e-3;
        let settings = [
            "floor_slope.downhill_heading_rad=1.5".to_owned(),
            format!("floor_slope.gradient={}", number("floor_slope_gradient")),
        ];
        scene = Cause::edit_all(&Cause::from_settings(&settings, &scene).expect("in bounds"), &scene);
        let straight = Protocol::Straight { length: number("protocol_length_m"), direction: Travel::Forward };
        let task = Task::new("straight-forward", straight);
        let seed = 5 + index as u64;
        let again = drive::run(&scene, &task, seed, None, &AtomicBool::new(false)).expect("it drives");
        assert_eq!(cell("seed"), Some(Field::ULong(seed)));
        assert_eq!(again.actual.y.to_bits(), number("true_end_y_m").to_bits(), "point {index}");
    }
}

#[test]
fn a_campaign_is_a_point_too() {
    let folder = folder();
    let text = "format = \"treadmark-sweep/1\"\npoint = \"campaign\"\ntime_step_s = 0.0025\n\
                [campaign]\nside_m = 0.3\nruns = 2\nmethod = \"bei2018\"\n\
                [[grid]]\nparameter = \"wheel_diameter_mismatch.ratio_minus_one\"\nvalues = [-0.05, 0.05]\n";
    run(&sweep(text), folder.path(), Shard::WHOLE).expect("it sweeps");
    let file = std::fs::File::open(folder.path().join(TABLE)).expect("there is a table");
    let reader = SerializedFileReader::new(file).expect("it is Parquet");
    let ratios: Vec<f64> = reader
        .get_row_iter(None)
        .expect("rows")
        .map(|row| {
            let row = row.expect("a row");
            let ratio =
                row.get_column_iter().find(|(name, _)| *name == "diameter_ratio").map(|(_, field)| field.clone());
            if let Some(Field::Double(ratio)) = ratio { ratio } else { panic!("{row}") }
        })
        .collect();
    // The tyres' radii differ by 0.12 % besides; 0.3 m squares say it to a per cent or two.
    assert!(ratios[0] < 0.98 && ratios[1] > 1.02, "the calibration finds the larger wheel: {ratios:?}");
}

#[test]
fn a_journal_cut_anywhere_goes_on_to_the_same_bytes() {
    let (whole, folder) = (folder(), folder());
    let sweep = sweep(SHORT);
    run(&sweep, whole.path(), Shard::WHOLE).expect("it sweeps");
    let journal = std::fs::read(whole.path().join("journal.tsv")).expect("a journal");
    let lines = journal.iter().filter(|&&byte| byte == b'\n').count();
    assert_eq!(lines, 13, "a header, and a record a point");
    // Nothing at all, within the header, after it, within the first record, within the last, and without its line end.
    let header = journal.iter().position(|&byte| byte == b'\n').expect("a header") + 1;
    for end in [0, header / 2, header, header + 40, journal.len() / 2, journal.len() - 30, journal.len() - 1] {
        let cut = folder.path().join(end.to_string());
        std::fs::create_dir(&cut).expect("a folder");
        std::fs::copy(whole.path().join("plan.toml"), cut.join("plan.toml")).expect("a copy");
        std::fs::write(cut.join("journal.tsv"), &journal[..end]).expect("it can be written");
        run(&sweep, &cut, Shard::WHOLE).expect("it goes on");
        assert_eq!(bytes(&cut), bytes(whole.path()), "cut at {end}");
        let after = std::fs::read_to_string(cut.join("journal.tsv")).expect("text");
        let mut points: Vec<&str> = after.lines().skip(1).filter_map(|line| line.split([' ', '\t']).nth(1)).collect();
        points.sort_unstable();
        points.dedup();
        assert_eq!((after.lines().count(), points.len()), (13, 12), "no point is there twice, none is lost");
    }
    // Once it is whole there is nothing to do, and nothing is written.
    let before = std::fs::metadata(whole.path().join(TABLE)).and_then(|meta| meta.modified()).expect("a time");
    run(&sweep, whole.path(), Shard::WHOLE).expect("there is nothing to do");
    assert_eq!(std::fs::metadata(whole.path().join(TABLE)).and_then(|meta| meta.modified()).expect("a time"), before);

    // Damage in the middle is no torn end.
    let mut damaged = journal.clone();
    damaged[header + 12] ^= 1;
    std::fs::write(whole.path().join("journal.tsv"), damaged).expect("it can be written");
    let error = run(&sweep, whole.path(), Shard::WHOLE).expect_err("it is damaged").to_string();
    assert!(error.contains("journal.tsv, line 2: this record is damaged"), "{error}");
}

#[test]
fn a_killed_process_goes_on_to_the_same_bytes() {
    let folder = folder();
    let text = SHORT.replace("repeats = 2", "repeats = 20");
    std::fs::write(folder.path().join("plan.toml"), text).expect("it can be written");
    let arguments = |out: &str| ["sweep", "plan.toml", "--out", out, "--threads", "2"].map(str::to_owned);
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_treadmark"))
        .current_dir(folder.path())
        .args(arguments("killed"))
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("it starts");
    let journal = folder.path().join("killed/journal.tsv");
    let records = || std::fs::read_to_string(&journal).map_or(0, |text| text.lines().count());
    while records() < 10 && child.try_wait().expect("it is ours").is_none() {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    // On Unix this is SIGKILL: nothing is tidied up.
    child.kill().expect("it is ours");
    child.wait().expect("it ends");
    let done = records();
    for out in ["killed", "whole"] {
        treadmark(folder.path()).args(arguments(out)).assert().success();
    }
    assert_eq!(bytes(&folder.path().join("killed")), bytes(&folder.path().join("whole")));
    assert_eq!(records(), 121, "{done} lines were there after the kill");
}

#[test]
fn shards_merge_to_the_table_of_one_machine() {
    let (whole, cut) = (folder(), folder());
    let sweep = sweep(SHORT);
    run(&sweep, whole.path(), Shard::WHOLE).expect("it sweeps");
    let shards = cut.path().join("shards");
    let part = |index| Shard::new(index, 3).expect("a share");
    run(&sweep, &shards, part(2)).expect("it sweeps");
    run(&sweep, &shards, part(0)).expect("it sweeps");
    let merged = |folders: &[&Path], into: &Path| {
        let folders: Vec<PathBuf> = folders.iter().map(|folder| folder.to_path_buf()).collect();
        merge(&folders, into).map_err(|error| error.to_string())
    };
    assert_eq!(merged(&[&shards], &shards).expect_err("one is missing"), "shards are missing: 1/3");
    assert!(!shards.join(TABLE).exists());

    // One that was stopped is named with what it lacks.
    run(&sweep, &shards, part(1)).expect("it sweeps");
    let journal = shards.join("shard-1-of-3/journal.tsv");
    let records = std::fs::read(&journal).expect("a journal");
    std::fs::write(&journal, &records[..records.len() - 10]).expect("it can be written");
    let error = merged(&[&shards], &shards).expect_err("a point is missing");
    assert!(error.contains("shard-1-of-3: shard 1/3 has 1 points to go"), "{error}");
    run(&sweep, &shards, part(1)).expect("it goes on");
    let result = merged(&[&shards], &shards).expect("they are all there");
    assert_eq!((result.shards, result.points), (3, 12));
    assert_eq!(bytes(&shards), bytes(whole.path()));

    // From folders that lie anywhere, and by the command line.
    let apart: Vec<PathBuf> = (0..3).map(|index| shards.join(format!("shard-{index}-of-3"))).collect();
    let mut command = treadmark(cut.path());
    let output = command.args(["sweep", "--out", "apart", "--merge"]).args(&apart).output().expect("it starts");
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(text(&output.stdout), "12 points of 3 shards are in apart/sweep.parquet\n");
    assert_eq!(bytes(&cut.path().join("apart")), bytes(whole.path()));

    // What does not belong together.
    let error = merged(&[&shards, &apart[0]], cut.path()).expect_err("one comes twice");
    assert!(error.contains("are both shard 0/3"), "{error}");
    let other = cut.path().join("other");
    let other_sweep = self::sweep(&SHORT.replace("seed = 5", "seed = 6"));
    run(&other_sweep, &other, part(0)).expect("it sweeps");
    let error = merged(&[&other, &apart[1], &apart[2]], cut.path()).expect_err("another plan");
    assert!(error.contains("holds a sweep of another plan than"), "{error}");
    let error = run(&other_sweep, &shards, part(0)).expect_err("another plan").to_string();
    assert!(error.contains("holds a sweep of another plan than plan.toml; name a new folder"), "{error}");
    let journal = shards.join("shard-2-of-3/journal.tsv");
    let text = std::fs::read_to_string(&journal).expect("a journal");
    let version = format!("\"version\":\"{}\"", env!("CARGO_PKG_VERSION"));
    std::fs::write(&journal, text.replacen(&version, "\"version\":\"0.0.1\"", 1)).expect("it can be written");
    let error = merged(&[&shards], cut.path()).expect_err("another version");
    assert!(error.contains("shard-2-of-3: was written by treadmark 0.0.1, and this is"), "{error}");
    std::fs::write(&journal, text.replacen("\"inputs\":\"", "\"inputs\":\"x", 1)).expect("it can be written");
    let error = merged(&[&shards], cut.path()).expect_err("another robot");
    assert!(error.contains("the robot or world files that it names were others"), "{error}");
}

#[test]
fn a_folder_of_something_else_is_left_alone() {
    let folder = folder();
    std::fs::write(folder.path().join("plan.toml"), SHORT).expect("it can be written");
    std::fs::create_dir(folder.path().join("mine")).expect("a folder");
    std::fs::write(folder.path().join("mine/notes.txt"), "notes").expect("it can be written");
    refused(folder.path(), &["sweep", "plan.toml", "--out", "mine"], &["mine: exists already and holds no sweep"]);
    let left = std::fs::read_dir(folder.path().join("mine")).expect("it can be read").count();
    assert_eq!(left, 1);
}
