//! The program as a user runs it: what it prints, what it refuses and how.

use assert_cmd::Command;
use serde_json::Value;
use std::path::Path;

/// The program in a folder of its own.
pub(super) fn treadmark(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("treadmark").expect("cargo has built it");
    command.current_dir(folder).env("NO_COLOR", "1");
    command
}

pub(super) fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// Runs with `arguments` and expects exit code 2, one message that holds `parts`, an empty stdout and no panic.
pub(super) fn refused(folder: &Path, arguments: &[&str], parts: &[&str]) {
    let output = treadmark(folder).args(arguments).output().expect("it starts");
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}\n{stderr}");
    assert!(output.stdout.is_empty(), "{arguments:?} printed {}", text(&output.stdout));
    assert!(!stderr.contains("panicked"), "{stderr}");
    assert_eq!(stderr.matches("error:").count(), 1, "one message: {stderr}");
    for part in parts {
        assert!(stderr.contains(part), "{arguments:?}: expected `{part}` in\n{stderr}");
    }
}

/// A copy of a shipped file with some text replaced, under the same name.
fn edited(folder: &Path, file: &str, from: &str, to: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    let original = std::fs::read_to_string(path).expect("a shipped file");
    assert!(original.contains(from), "{file} has no `{from}`");
    let name = Path::new(file).file_name().expect("a file");
    std::fs::write(folder.join(name), original.replacen(from, to, 1)).expect("it can be written");
}

/// Who reads only the first line, as `head` does, is not shown a panic, and the work is done all the same.
#[test]
fn a_reader_may_leave() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin("treadmark"));
    let arguments = ["drive", "--side", "1", "--no-recording", "--out", "driven"];
    command.current_dir(folder.path()).args(arguments).stdout(std::process::Stdio::piped());
    let mut child = command.stderr(std::process::Stdio::piped()).spawn().expect("it starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    assert!(folder.path().join("driven").is_dir());
}

/// What a campaign could show is asked before it is driven, after it was logged, and of one that was surveyed.
#[test]
fn power_takes_a_campaign_that_is_only_planned() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    treadmark(at).args(["init", "lab"]).assert().success();
    let shows = |arguments: &[&str], note: &str| {
        let output = treadmark(at).arg("power").args(arguments).arg("--json").output().expect("it starts");
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}\n{stderr}");
        assert!(stderr.contains(note), "{stderr}");
        let json: Value = serde_json::from_slice(&output.stdout).expect("stdout is JSON alone");
        let effects = json["smallest_detectable"].as_array().expect("a list").len();
        assert!(effects > 20, "{json:#}");
        json
    };
    let planned = "nothing is noted of these runs yet: the model drives them";
    let logs = shows(&["lab"], planned);
    let ends = shows(&["lab", "--data", "endpoints"], planned);
    assert_ne!(logs, ends);

    // What was logged and not surveyed says as much as what was surveyed.
    treadmark(at).args(["challenge", "--seed", "1", "--data", "logs", "--out", "driven"]).assert().success();
    let surveyed = shows(&["driven"], "");
    let runs = std::fs::read_to_string(at.join("driven/runs.csv")).expect("it is there");
    let columns: Vec<&str> = runs.lines().next().expect("a header").split(',').collect();
    let blanked = runs.lines().enumerate().map(|(number, line)| {
        let blank = |(column, value)| match columns[column] {
            "x_m" | "y_m" | "heading_rad" if number > 0 => "",
            _ => value,
        };
        line.split(',').enumerate().map(blank).collect::<Vec<_>>().join(",")
    });
    let blanked: Vec<String> = blanked.collect();
    std::fs::write(at.join("driven/runs.csv"), blanked.join("\n")).expect("it can be written");
    std::fs::remove_file(at.join("driven/poses.csv")).expect("it is there");
    let logged = shows(&["driven"], "these runs are not surveyed yet: the model says where their wheels went");
    let least = |json: &Value, place: usize| json["smallest_detectable"][place]["smallest_detectable"].as_f64();
    for place in 0..10 {
        if let (Some(one), Some(other)) = (least(&surveyed, place), least(&logged, place)) {
            assert!((one / other - 1.0).abs() < 0.5, "{place}: {one} {other}");
        }
    }
}

/// Data of another robot are refused with what differs, wherever a model is held against them.
#[test]
fn data_of_another_robot_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    treadmark(at).args(["challenge", "--seed", "1", "--data", "logs", "--out", "driven"]).assert().success();
    let parts =
        ["optiodom.toml: is hardly the robot of dataset", "nominal_wheel_diameter_m is 0.2 there, and 0.084 by"];
    for command in [&["diagnose", "driven", "--robot", "optiodom"][..], &["predict", "driven", "--robot", "optiodom"]] {
        refused(at, command, &parts);
    }
    refused(at, &["power", "driven", "--robot", "optiodom"], &parts);
    // Without facts it is the columns of counts that tell.
    let file = at.join("driven/dataset.toml");
    let facts = std::fs::read_to_string(&file).expect("it is there");
    let without: Vec<&str> = facts.lines().filter(|line| !line.starts_with("nominal_")).collect();
    std::fs::write(&file, without.join("\n")).expect("it can be written");
    refused(
        at,
        &["diagnose", "driven", "--robot", "optiodom"],
        &["left wheels in encoders.csv is 2 there, and 1 by the model"],
    );
}

/// A result that cannot be written is an error.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin("treadmark"));
    let output = command.arg("effects").stdout(full).stderr(std::process::Stdio::piped()).output().expect("it starts");
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.starts_with("error: stdout cannot be written: ") && !stderr.contains("panicked"), "{stderr}");
}

#[test]
fn a_bad_robot_is_refused() {
    let model = "robots/jnpf_4wd.toml";
    for (file, from, to, parts) in [
        (
            model,
            "joint = \"front_left_wheel_joint\"",
            "joint = \"wheel_1\"",
            &["jnpf_4wd.toml", "wheel `front_left`", "`wheel_1`", "its joints are: front_left_wheel_joint, "][..],
        ),
        (
            model,
            "free_radius_m = 0.10006",
            "free_radius_m = -0.1",
            &["jnpf_4wd.toml, line 21, column 17", "-0.1 is not allowed here: it must be a finite number above 0"],
        ),
        (model, "free_radius_m = 0.10006", "free_radius_m = nan", &["line 21, column 17", "NaN is not allowed here"]),
        (
            model,
            "free_radius_m = 0.10006",
            "radius = 0.1",
            &["line 21, column 1", "unknown field `radius`, expected one of"],
        ),
        (
            model,
            "side = \"left\"",
            "side = \"right\"",
            &["joint `front_left_wheel_joint` of wheel `front_left` stands at y = 0.2000 m", "left is y > 0"],
        ),
        (model, "loop_rate_hz = 200.0", "loop_rate_hz = 333.0", &["loop_rate_hz is 333 Hz", "whole number of steps"]),
        (model, "urdf = \"jnpf_4wd.urdf\"", "urdf = \"none.urdf\"", &["none.urdf: cannot be read"]),
        (
            "robots/jnpf_4wd.urdf",
            "<mass value=\"18.0\"/>",
            "<mass value=\"-18.0\"/>",
            &["jnpf_4wd.urdf: link `base_link`: mass is -18; it must be 0 or above"],
        ),
        (
            "robots/jnpf_4wd.urdf",
            "type=\"continuous\"",
            "type=\"fixed\"",
            &["joint `front_left_wheel_joint` of wheel `front_left` is fixed"],
        ),
        (
            "robots/jnpf_4wd.urdf",
            "<axis xyz=\"0 1 0\"/>",
            "<axis xyz=\"1 0 0\"/>",
            &["turns about (1.000, 0.000, 0.000)", "lateral axis"],
        ),
        ("robots/jnpf_4wd.urdf", "</robot>", "", &["jnpf_4wd.urdf, line 1: not a valid URDF: no XML"]),
        (
            "robots/jnpf_4wd.urdf",
            "<mass value=\"18.0\"/>",
            "<mass value=\"18,0\"/>",
            &[
                "jnpf_4wd.urdf, line 11: not a valid URDF: <mass> of link `base_link` has value=\"18,0\"; it must be a number",
            ],
        ),
        (
            "robots/jnpf_4wd.urdf",
            "<mass value=\"18.0\"/>",
            "",
            &["jnpf_4wd.urdf, line 9: not a valid URDF: <inertial> of link `base_link` has no <mass>"],
        ),
        (
            "robots/jnpf_4wd.urdf",
            "type=\"continuous\"",
            "type=\"rolling\"",
            &[
                "line 45",
                "<joint> `front_left_wheel_joint` has type=\"rolling\"; it must be one of: revolute, continuous",
            ],
        ),
        (
            "robots/jnpf_4wd.urdf",
            "<parent link=\"base_link\"/>",
            "<parent link=\"chassis\"/>",
            &["joint `front_left_wheel_joint` holds or hangs on link `chassis`", "the links are: base_link"],
        ),
        (
            "robots/jnpf_4wd.urdf",
            "<axis xyz=\"0 1 0\"/>",
            "<axis xyz=\"0 0 0\"/>",
            &["of wheel `front_left` turns about no axis: its <axis> is 0 0 0"],
        ),
        (
            "robots/jnpf_4wd.urdf",
            "<cylinder radius=\"0.1\"",
            "<cylinder radius=\"-0.1\"",
            &["link `front_left_wheel_link`: a shape of it has a size of -0.1 m; it must be 0 or above"],
        ),
        (
            "robots/optiodom.toml",
            "link = \"caster_link\"",
            "link = \"castor\"",
            &["caster names link `castor`", "its links are: base_link"],
        ),
    ] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let robot = Path::new(file).file_stem().expect("a name").to_string_lossy().into_owned();
        for extension in ["toml", "urdf"] {
            edited(folder.path(), &format!("robots/{robot}.{extension}"), "", "");
        }
        edited(folder.path(), file, from, to);
        refused(folder.path(), &["drive", "--robot", &format!("./{robot}.toml"), "--side", "1"], parts);
        let left: Vec<_> = std::fs::read_dir(folder.path()).expect("it can be read").collect();
        assert!(left.len() <= 3, "nothing but the inputs and perhaps an empty recordings folder is left");
    }
}

#[test]
fn a_bad_world_is_refused() {
    let head = "format = \"treadmark-world/1\"\nname = \"w\"\n";
    let wall = "[plane]\n[[obstacles]]\nkind = \"box\"\nsize_m = [0.1, 2.0, 1.0]\nposition_m = [0.0, 0.0, 0.5]\n";
    for (world, parts) in [
        ("", &["w.toml", "a world without ground"][..]),
        (
            "[plane]\ngrip = 1\n",
            &["w.toml, line 4, column 1", "unknown field `grip`, expected `grip_ratio` or `chassis_friction`"],
        ),
        (
            "[plane]\ngrip_ratio = 0.0\n",
            &["line 4, column 14", "0 is not allowed here: it must be a finite number above 0"],
        ),
        ("[plane]\n[slope]\ngradient = inf\n", &["line 5, column 12", "inf is not allowed here"]),
        (wall, &["the robot starts inside obstacle 1 of the world", "base_link"]),
        (
            "[[obstacles]]\nkind = \"box\"\nsize_m = [1.0, 1.0, 0.1]\nposition_m = [5.0, 0.0, 0.0]\n",
            &["has no ground beneath it at the start"],
        ),
        (
            "[[obstacles]]\nkind = \"box\"\nsize_m = [1.0, 1.0, 0.1]\nposition_m = [0.0, 0.0, 0.0]\n",
            &["tipped over", "into the run", "leans by more than 60 degrees"],
        ),
    ] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(folder.path().join("w.toml"), format!("{head}{world}")).expect("it can be written");
        refused(folder.path(), &["drive", "--world", "w.toml", "--side", "2"], parts);
    }
}

#[test]
fn bad_arguments_are_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (arguments, parts) in [
        (&["drive", "--side", "-1"][..], &["--side", "it must be a finite number above 0"][..]),
        (&["drive", "--side", "nan"], &["it must be a finite number above 0"]),
        (&["drive", "--direction", "forward"], &["--direction forward", "cw or ccw"]),
        (&["drive", "--protocol", "straight", "--direction", "cw"], &["--direction cw", "forward or reverse"]),
        (&["drive", "--protocol", "zigzag"], &["invalid value 'zigzag'", "square, straight, spin, circle"]),
        (&["experiment", "--repeats", "0"], &["0 is not in 1..=1000"]),
        (&["--robot", "nobody"], &["nobody: no such robot file", "jnpf_4wd, husky_a200, optiodom"]),
        (&["--world", "mars"], &["mars: no such world file", "lab_floor"]),
        (&["drive", "--side", "1", "--time-step", "0.0013"], &["whole number of steps"]),
    ] {
        refused(folder.path(), arguments, parts);
    }
}

#[test]
fn an_existing_folder_is_left_alone() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let kept = folder.path().join("mine");
    std::fs::create_dir(&kept).expect("it is new");
    std::fs::write(kept.join("thesis.txt"), "years of work").expect("it can be written");
    let drive = ["drive", "--side", "1"].as_slice();
    // What takes long, or reads first, says so before it has begun.
    let predict = ["predict", "nowhere", "--robot", "leo"].as_slice();
    for command in [drive, predict, &["diagnose", "nowhere"], &["calibrate", "nowhere"], &["table-one"]] {
        let arguments = [command, &["--out", "mine"]].concat();
        refused(folder.path(), &arguments, &["mine: exists already", "never overwritten"]);
    }
    assert_eq!(std::fs::read_to_string(kept.join("thesis.txt")).expect("it is there"), "years of work");
}

/// A file-size limit stands for a full disk: writes fail in the same place, with the system's reason. Results that no
/// longer fit are one message; a recording breaks off readably and costs nothing else.
#[cfg(unix)]
#[test]
fn a_full_disk_is_one_message_and_keeps_what_was_there() {
    let program = assert_cmd::cargo::cargo_bin("treadmark");
    for (limit, options, message, kept) in
        [(40, "--no-recording", "cannot be written", false), (400, "", "the recording breaks off here", true)]
    {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let script = format!(
            "trap '' XFSZ; ulimit -f {limit}; exec '{}' drive --side 1 --out full {options}",
            program.display()
        );
        let output =
            Command::new("bash").args(["-c", &script]).current_dir(folder.path()).output().expect("bash starts");
        let stderr = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert_eq!(stderr.matches("error:").count(), 1, "{stderr}");
        assert!(stderr.contains(message) && !stderr.contains("panicked"), "{stderr}");
        // A folder with a dataset.toml holds a whole dataset.
        assert_eq!(folder.path().join("full/dataset.toml").exists(), kept, "{stderr}");
    }
}

#[test]
fn drive_prints_its_json_alone() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = treadmark(folder.path())
        .args(["drive", "--protocol", "square", "--side", "1", "--direction", "ccw", "--json"])
        .output()
        .expect("it starts");
    assert!(output.status.success(), "{}", text(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).expect("stdout is JSON alone");
    for pose in ["actual", "odometry"] {
        for key in ["x_m", "y_m", "heading_rad"] {
            assert!(json[pose][key].is_f64(), "{pose}.{key}");
        }
    }
    assert!(json["simulated_s"].as_f64() > Some(20.0) && json["steps"].as_u64() > Some(10_000));
    assert!(json["wall_s"].as_f64() > Some(0.0));
    assert!(folder.path().join("recordings/drive-001/dataset.toml").is_file());
}

/// The experiment's JSON, and the same bits with one thread or many.
#[test]
fn experiment_prints_its_json_and_does_not_depend_on_threads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let run = |threads: &str| {
        let output = treadmark(folder.path())
            .args(["experiment", "--sides", "1", "--repeats", "2", "--seed", "7", "--threads", threads, "--json"])
            .output()
            .expect("it starts");
        assert!(output.status.success(), "{}", text(&output.stderr));
        serde_json::from_slice::<Value>(&output.stdout).expect("stdout is JSON alone")
    };
    let (one, two) = (run("1"), run("2"));
    assert_eq!(one, two);
    assert_eq!(one["robot"], "jnpf_4wd");
    assert_eq!(one["seed"], 7);
    let before = &one["before"][0];
    assert_eq!(before["side_m"], 1.0);
    for direction in ["cw", "ccw"] {
        for key in ["x_m", "y_m", "heading_rad", "r_m"] {
            assert!(before[direction][key].is_f64(), "{direction}.{key}");
        }
    }
    let method = &one["methods"][0];
    assert_eq!(method["method"], "umbmark");
    assert_eq!(method["calibrated_on_side_m"], 1.0);
    for key in ["diameter_ratio", "track_ratio", "distance_scale"] {
        assert!(method["estimate"][key].is_f64(), "{key}");
    }
    let gain = before["e_max_syst_m"].as_f64().expect("a number")
        / method["after"][0]["e_max_syst_m"].as_f64().expect("a number");
    assert!((method["improvement"].as_f64().expect("a number") - gain).abs() < 1e-12);
    assert!(gain > 3.0, "{gain}");
    for (stage, file) in [("before", "runs.csv"), ("before", "encoders.csv"), ("after_umbmark_1m", "runs.csv")] {
        let file = |number: u32| folder.path().join(format!("recordings/experiment-00{number}/{stage}/{file}"));
        assert_eq!(std::fs::read(file(1)).expect("it is there"), std::fs::read(file(2)).expect("it is there"));
    }
}

/// A campaign as a lab with a tape measure notes it: two files, end points alone.
const TAPE_TOML: &str = "format = \"treadmark-dataset/1\"\nname = \"tape\"\n[odometry]\nleft_wheel_radius_m = 0.1\n\
    right_wheel_radius_m = 0.1\ntrack_width_m = 0.6\n[survey]\nposition_std_m = 0.002\nheading_std_rad = 0.003\n";
const TAPE_RUNS: &str = "run,protocol,side_m,direction,x_m,y_m,heading_rad\n\
    1,square,4,cw,-0.31,-0.33,-6.12\n2,square,4,cw,-0.32,-0.34,-6.13\n3,square,4,cw,-0.30,-0.32,-6.12\n\
    4,square,4,ccw,-0.35,0.38,6.10\n5,square,4,ccw,-0.36,0.37,6.11\n6,square,4,ccw,-0.34,0.38,6.10\n";

fn tape(runs: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let data = folder.path().join("tape");
    std::fs::create_dir(&data).expect("it is new");
    std::fs::write(data.join("dataset.toml"), TAPE_TOML).expect("it can be written");
    std::fs::write(data.join("runs.csv"), runs).expect("it can be written");
    folder
}

/// End points alone suffice; the JSON is the documented one; the ROS 2 file is written once.
#[test]
fn calibrate_takes_a_tape_measured_campaign() {
    let folder = tape(TAPE_RUNS);
    let calibrate = |options: &[&str]| {
        let output = treadmark(folder.path()).args(["calibrate", "tape"]).args(options).output().expect("it starts");
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    };
    let (code, stdout, stderr) = calibrate(&["--json", "--ros2", "controller.yaml"]);
    assert_eq!(code, Some(0), "{stderr}");
    let json: Value = serde_json::from_str(&stdout).expect("stdout is JSON alone");
    let methods = json["methods"].as_array().expect("a list");
    assert_eq!(methods.len(), 11);
    let of = |name: &str| methods.iter().find(|method| method["method"] == name).expect("it is listed");
    for name in ["umbmark", "umbmark_y", "umbmark_xy", "jung2012", "exact_heading", "maximum_likelihood"] {
        let method = of(name);
        assert_eq!(method["applicable"], true, "{name}");
        assert!(
            (method["estimate"]["track_ratio"]["value"].as_f64().expect("a number") - 1.027).abs() < 0.01,
            "{method}"
        );
        assert!(method["estimate"]["diameter_ratio"]["std_dev"].is_f64(), "{method}");
        assert!(method["estimate"]["distance_scale"]["std_dev"].is_null(), "end points do not fix the scale");
        for score in ["in_sample", "held_out"] {
            for key in ["position_rmse", "heading_rmse", "e_max_syst"] {
                let unit = if key == "heading_rmse" { "rad" } else { "m" };
                let value = |when: &str| method[score][format!("{key}_{when}_{unit}")].as_f64().expect("a number");
                assert!(value("after") < 0.5 * value("before"), "{name}: {score} {key}");
            }
        }
    }
    for name in ["lee2011", "bei2018", "antonelli2005", "censi2013"] {
        assert_eq!(of(name)["applicable"], false, "{name}");
        assert!(of(name)["reason"].is_string() && of(name)["estimate"].is_null(), "{name}");
    }
    assert!(json["best"].is_string());
    let yaml = std::fs::read_to_string(folder.path().join("controller.yaml")).expect("it is written");
    assert!(yaml.contains("wheel_separation_multiplier:") && yaml.contains("Not fixed by the data: E_s against E_b"));
    let (code, _, stderr) = calibrate(&["--ros2", "controller.yaml"]);
    assert_eq!(code, Some(2), "an existing file is left alone");
    assert!(stderr.contains("controller.yaml: exists already"), "{stderr}");
    let (_, stdout, _) = calibrate(&["--method", "umbmark,exact_heading"]);
    assert!(stdout.contains("exact_heading") && !stdout.contains("jung2012"), "{stdout}");
}

#[test]
fn calibrate_says_what_data_lack() {
    let one_direction: String =
        TAPE_RUNS.lines().filter(|line| !line.contains("ccw")).map(|line| format!("{line}\n")).collect();
    let folder = tape(&one_direction);
    let output = treadmark(folder.path()).args(["calibrate", "tape"]).output().expect("it starts");
    let stdout = text(&output.stdout);
    assert!(stdout.contains("umbmark: dataset `tape` has no surveyed ccw square of 4 m"), "{stdout}");
    for (runs, arguments, parts) in [
        (
            one_direction.as_str(),
            &["calibrate", "tape", "--method", "umbmark"][..],
            &["no method is applicable", "needs both directions"][..],
        ),
        (TAPE_RUNS, &["calibrate", "nowhere"], &["nowhere/dataset.toml: cannot be read"]),
        (
            TAPE_RUNS,
            &["calibrate", "tape", "--method", "guess"],
            &["--method guess: no such method", "maximum_likelihood"],
        ),
        (TAPE_RUNS, &["calibrate"], &["<DATASET>..."]),
        ("run,protocol,side_m,direction\n1,square,4,cw\n", &["calibrate", "tape"], &["no run with a surveyed end"]),
    ] {
        let folder = tape(runs);
        refused(folder.path(), arguments, parts);
    }
}

/// The template reads as it is, says what is still missing, and calibrates once it is filled in.
#[test]
fn init_writes_a_campaign_that_reads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let init = || treadmark(folder.path()).args(["init", "mine"]).output().expect("it starts");
    assert!(init().status.success());
    let dataset = treadmark::dataset::Dataset::read(&folder.path().join("mine")).expect("the template is valid");
    assert_eq!(dataset.runs.len(), 13);
    refused(folder.path(), &["calibrate", "mine"], &["no run with a surveyed end"]);
    refused(folder.path(), &["init", "mine"], &["mine: exists already"]);
    // The example of its instructions is a run that the format takes.
    let runs = folder.path().join("mine/runs.csv");
    let text = std::fs::read_to_string(&runs).expect("it is there");
    let filled = text
        .replace("cw-1,square,4,cw,,,", "cw-1,square,4,cw,-0.31,-0.33,-6.12")
        .replace("ccw-1,square,4,ccw,,,", "ccw-1,square,4,ccw,-0.35,0.38,6.10")
        .replace("straight-1,straight,4,forward,,,", "straight-1,straight,4,forward,4.02,0.01,0.002");
    std::fs::write(runs, filled).expect("it can be written");
    let output = treadmark(folder.path()).args(["calibrate", "mine"]).output().expect("it starts");
    assert!(output.status.success());
}

/// `certify`: the JSON is what it is said to be, a failed check is exit code 1, bad input is one error.
#[test]
fn certify_answers_in_json_and_by_exit_code() {
    let folder = tempfile::tempdir().expect("a folder");
    let certify = |arguments: &[&str]| {
        let output = treadmark(folder.path()).arg("certify").args(arguments).output().expect("it starts");
        let json: Value = serde_json::from_slice(&output.stdout).expect("JSON and nothing else");
        (output.status.code(), json)
    };
    let (code, json) = certify(&["optiodom", "--json", "--out", "certified"]);
    assert_eq!(code, Some(0), "{json:#}");
    let keys: Vec<&str> = json.as_object().expect("an object").keys().map(String::as_str).collect();
    let mut wanted =
        ["robot", "effective_track_m", "track_factor", "theory_factor", "contributions", "rolling_radius_m", "checks"];
    wanted.sort_unstable();
    let mut sorted = keys.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, wanted);
    let figure = std::fs::read_to_string(folder.path().join("certified/effective_track.svg")).expect("a figure");
    assert!(figure.starts_with("<svg") && figure.contains("Turn radius"));

    // A number that could not be found is null, and its check fails.
    let (code, json) = certify(&["optiodom", "--json", "--time-step", "0.005"]);
    assert_eq!(code, Some(1));
    assert!(json["track_factor"].is_null());
    let energy = json["checks"].as_array().expect("checks").iter().find(|check| check["name"] == "energy");
    assert_eq!(energy.expect("there is one")["pass"], Value::Bool(false));

    refused(folder.path(), &["certify", "none"], &["none: no such robot file", "pioneer_3at"]);
    refused(folder.path(), &["certify", "leo", "--time-step", "0.01"], &["rate_hz is 200 Hz", "whole number of steps"]);
    refused(folder.path(), &["certify", "leo", "--out", "certified"], &["certified: exists already"]);
}

/// `effects` is the registry, as a table of families and as JSON.
#[test]
fn effects_lists_the_registry() {
    use treadmark::effect::EFFECTS;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let print = |arguments: &[&str]| {
        let output = treadmark(folder.path()).args(arguments).output().expect("it starts");
        assert_eq!(output.status.code(), Some(0));
        text(&output.stdout)
    };
    let table = print(&["effects"]);
    // Long words may be broken over lines of a cell; families and short names are not.
    for family in ["wheels and tyres", "mass", "class", "floor", "drivetrain and encoders", "survey"] {
        assert_eq!(table.lines().filter(|line| *line == family).count(), 1, "{family}");
    }
    for word in ["floor_slope", "gradient", "caster_drag", "wheel_toe", "any heading", "0.65 ± 0.2", "σ 0.004", "side"]
    {
        assert!(table.contains(word), "{word} in\n{table}");
    }
    let json: Value = serde_json::from_str(&print(&["effects", "--json"])).expect("stdout is JSON alone");
    let entries = json.as_array().expect("a list");
    assert_eq!(entries.len(), EFFECTS.len());
    for (entry, effect) in entries.iter().zip(&EFFECTS) {
        assert_eq!(entry["effect"], effect.id);
        assert_eq!(entry["family"], effect.family.as_str());
        for key in ["cause", "shown_by", "source"] {
            assert!(entry[key].as_str().is_some_and(|text| !text.is_empty()), "{} {key}", effect.id);
        }
        let parameters = entry["parameters"].as_array().expect("a list");
        assert_eq!(parameters.len(), effect.parameters.len());
        for (entry, parameter) in parameters.iter().zip(effect.parameters) {
            assert_eq!(entry["name"], parameter.name);
            assert_eq!(entry["least"].as_f64(), Some(parameter.bounds[0]));
        }
    }
}
