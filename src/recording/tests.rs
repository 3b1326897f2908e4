//! Recordings read back with the SDK's own reader.

#![allow(clippy::unwrap_used)] // A test that fails may panic.

use super::stream::{RUN, TIMELINE};
use super::*;
use crate::dataset::Rotation;
use crate::diagnose::{Diagnosis, Misfit, NoiseModel, RunReadings, Verdict};
use crate::drive::{CELLS_ACROSS, CELLS_ALONG, Observer, PatchSnapshot, Snapshot, WheelSnapshot};
use crate::effect::{Cause, Effect};
use crate::geometry::Pose2;
use crate::scene::{Placement, Survey};
use nalgebra::Translation3;
use rerun::external::re_log_encoding::Decoder;
use rerun::external::re_log_types::LogMsg;
use rerun::log::Chunk;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::BufReader;

const SNAPSHOTS: usize = 101;

/// Rows of each entity and the timelines of all, and whether the first data are a blueprint's.
struct Contents {
    rows: BTreeMap<String, usize>,
    /// Entities in the order of their messages.
    order: Vec<String>,
    timelines: BTreeSet<String>,
    series_names: Vec<String>,
    blueprint_first: bool,
}

fn read(path: &FilePath) -> Contents {
    let mut contents = Contents {
        rows: BTreeMap::new(),
        order: Vec::new(),
        timelines: BTreeSet::new(),
        series_names: Vec::new(),
        blueprint_first: false,
    };
    let mut first = true;
    for message in Decoder::decode_lazy(BufReader::new(File::open(path).unwrap())) {
        let LogMsg::ArrowMsg(store, message) = message.unwrap() else { continue };
        if std::mem::take(&mut first) {
            contents.blueprint_first = store.is_blueprint();
        }
        if store.is_blueprint() {
            continue;
        }
        let chunk = Chunk::from_arrow_msg(&message).unwrap();
        contents.order.push(chunk.entity_path().to_string());
        *contents.rows.entry(chunk.entity_path().to_string()).or_default() += chunk.num_rows();
        contents.timelines.extend(chunk.timelines().keys().map(|name| name.to_string()));
        for names in chunk.iter_slices::<String>(rerun::SeriesLines::descriptor_names().component) {
            contents.series_names.extend(names.iter().map(|name| name.as_str().to_owned()));
        }
    }
    contents
}

fn outline(featured: &RunLabel) -> Outline {
    let protocol = Protocol::Square { side: 2.0, direction: Rotation::CounterClockwise };
    Outline {
        title: "test".to_owned(),
        stages: vec!["before".to_owned()],
        featured: vec![featured.clone()],
        area: Area::of([&protocol]),
        sides: vec![2.0],
    }
}

fn label() -> RunLabel {
    RunLabel::of("before", &Protocol::Square { side: 2.0, direction: Rotation::CounterClockwise }, 1)
}

/// Two seconds straight ahead, the dead reckoning 1 % short.
fn drive(robot: &Robot, recorder: &mut RunRecorder) {
    for count in 0..SNAPSHOTS {
        let time = count as f64 / 50.0;
        let x = 0.4 * time;
        let base = Placement::from_parts(Translation3::new(x, 0.0, 0.1), UnitQuaternion::identity());
        let wheels: Vec<WheelSnapshot> = robot
            .wheels
            .iter()
            .map(|wheel| {
                let placement = base * wheel.base_from_wheel;
                let [x, y, _] = placement.translation.vector.into();
                let patch = PatchSnapshot {
                    centre: [x, y, 0.0],
                    along: [1.0, 0.0, 0.0],
                    across: [0.0, 1.0, 0.0],
                    half_length: 0.015,
                    width: 0.05,
                    tractions: [[[1e3, 0.0]; CELLS_ACROSS]; CELLS_ALONG],
                };
                WheelSnapshot {
                    placement,
                    angle: 4.0 * time,
                    speed: 4.0,
                    commanded_speed: 4.0,
                    ticks: (4.0 * time * 1304.0) as i64,
                    motor_torque: 0.0,
                    load: 59.0,
                    force_along: 1.5,
                    force_across: 0.0,
                    slip_along: 1e-4,
                    slip_across: 0.0,
                    patch: Some(patch),
                }
            })
            .collect();
        let (truth, odometry) = (Pose2::new(x, 0.0, 0.0), Pose2::new(0.99 * x, 0.0, 0.0));
        recorder.observe(&Snapshot { time, base, truth, odometry, wheels: &wheels, forks: &[] });
    }
}

#[test]
fn holds_what_the_docs_promise() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let scene = Scene::load("jnpf_4wd", "tilted_floor").unwrap();
    let robot = &scene.robot;
    let recording = Recording::create(&path, &outline(&label()), &scene).unwrap();
    drive(robot, &mut recording.run(&label(), Detail::Full));
    let thin = RunLabel { repeat: 2, ..label() };
    drive(robot, &mut recording.run(&thin, Detail::Path));
    let errors = vec![[0.1, 0.2], [0.12, 0.21], [0.11, 0.19]];
    let cluster = EndPoints {
        stage: "before".to_owned(),
        direction: Rotation::CounterClockwise,
        errors,
        centre_of_gravity: [0.11, 0.2],
    };
    recording.end_points(2.0, &[cluster]);
    recording.result("### Result");
    recording.finish().unwrap();

    let contents = read(&path);
    assert!(contents.blueprint_first);
    assert_eq!(contents.timelines, BTreeSet::from([TIMELINE.to_owned()]));
    let run = "/before/square_2m_ccw/run_1";
    // Static rows beside those of 50, 25, 10 and 5 Hz.
    let mut expected = vec![
        (format!("{run}/chassis"), 51),
        (format!("{run}/believed"), 51),
        (format!("{run}/path/true"), 1),
        (format!("{run}/path/dead_reckoned"), 1),
        (format!("{run}/path/true_end"), 1),
        (format!("{run}/path/true_so_far"), 11 + 1),
        (format!("{run}/path/dead_reckoned_so_far"), 11 + 1),
        // The tilt of the floor.
        (run.to_owned(), 1),
        ("/before/square_2m_ccw/run_2/path/true".to_owned(), 1),
        ("/before/square_2m_ccw/run_2/path/dead_reckoned".to_owned(), 1),
        ("/end_points/square_2m/before/ccw/runs".to_owned(), 1),
        ("/end_points/square_2m/before/ccw/centre_of_gravity".to_owned(), 1),
        ("/floor/plane".to_owned(), 1),
    ];
    for wheel in ["front_left", "front_right", "rear_left", "rear_right"] {
        expected.push((format!("{run}/wheels/{wheel}"), 51));
        // Rows of vectors, of cells, of style.
        let patch = format!("{run}/patches/{wheel}");
        expected.push((format!("{patch}/tractions"), 21 + 1 + 1));
        expected.push((format!("{patch}/outline"), 1 + 1));
        expected.push((format!("{patch}/force"), 21 + 1));
        expected.push((patch, 21));
    }
    let series = "wheel_speed_rad_s wheel_speed_commanded_rad_s ticks slip_along_m_s slip_across_m_s load_n force_along_n \
                  force_across_n heading_error_mrad position_error_mm";
    expected.extend(series.split(' ').map(|name| (format!("{run}/series/{name}"), SNAPSHOTS + 1)));
    for (entity, rows) in expected {
        assert_eq!(contents.rows.get(&entity), Some(&rows), "{entity}");
    }
    assert!(!contents.rows.keys().any(|entity| entity.starts_with("/before/square_2m_ccw/run_2/series")));
    assert_eq!(contents.series_names.len(), 8 * robot.wheels.len() + 2);
    assert!(contents.series_names.iter().all(|name| name.ends_with(']') && name.contains('[')));
}

#[test]
fn what_is_left_after_calibration_has_a_plot_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let scene = Scene::load("jnpf_4wd", "lab_floor").unwrap();
    let stages = ["before", "after_umbmark_2m"].map(str::to_owned);
    let outline = Outline { stages: stages.to_vec(), ..outline(&label()) };
    let recording = Recording::create(&path, &outline, &scene).unwrap();
    let cluster = |stage: &String| EndPoints {
        stage: stage.clone(),
        direction: Rotation::Clockwise,
        errors: vec![[0.1, 0.2], [0.12, 0.21], [0.11, 0.19]],
        centre_of_gravity: [0.11, 0.2],
    };
    recording.end_points(2.0, &stages.each_ref().map(cluster));
    recording.finish().unwrap();
    let rows = read(&path).rows;
    for (plot, stage, there) in [
        ("square_2m", "before", true),
        ("square_2m", "after_umbmark_2m", true),
        ("square_2m_closer", "before", false),
        ("square_2m_closer", "after_umbmark_2m", true),
    ] {
        assert_eq!(rows.contains_key(&format!("/end_points/{plot}/{stage}/cw/runs")), there, "{plot} {stage}");
    }
}

#[test]
fn never_overwrites() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    std::fs::write(&path, "precious").unwrap();
    let scene = Scene::load("jnpf_4wd", "lab_floor").unwrap();
    let error = Recording::create(&path, &outline(&label()), &scene).err().unwrap();
    assert!(matches!(error, RecordingError::Exists { .. }));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "precious");
}

#[test]
fn what_was_logged_is_in_the_file_before_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let scene = Scene::load("jnpf_4wd", "lab_floor").unwrap();
    let robot = &scene.robot;
    let recording = Recording::create(&path, &outline(&label()), &scene).unwrap();
    drive(robot, &mut recording.run(&label(), Detail::Full));
    recording.flush().unwrap();
    // What does not change comes first, or a recording that breaks off shows nothing.
    let contents = read(&path);
    let position = |entity: &str| contents.order.iter().position(|other| other == entity).unwrap();
    assert!(position("/floor/plane") < position("/before/square_2m_ccw/run_1/chassis/shape"));
    assert!(position("/before/square_2m_ccw/run_1/chassis/shape") < position("/before/square_2m_ccw/run_1/chassis"));
    // As a killed process leaves it: no footer.
    let so_far = folder.path().join("killed.rrd");
    std::fs::copy(&path, &so_far).unwrap();
    assert_eq!(read(&so_far).rows.get("/before/square_2m_ccw/run_1/chassis"), Some(&51));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told() {
    let full = FilePath::new("/dev/full");
    let file = File::options().write(true).open(full).unwrap();
    let error = Disk::start(full, file).err().unwrap();
    assert!(error.to_string().contains("No space left on device"), "{error}");
}

/// Two runs surveyed on the way and one surveyed at its end alone.
fn diagnosed() -> Diagnosis {
    let run = |name: &str, condition: &str, readings: usize, sign: f64| {
        let x = |index: usize| 0.1 * (index + 1) as f64;
        let on_the_way = readings > 1;
        RunReadings {
            name: format!("lab/{name}"),
            condition: condition.to_owned(),
            held_out: false,
            start: Pose2::IDENTITY,
            stamps: (0..readings).map(|index| on_the_way.then_some(100.0 + index as f64)).collect(),
            measured: (0..readings).map(|index| Pose2::new(x(index), sign * 0.02, 0.0).into()).collect(),
            before: (0..readings).map(|index| Pose2::new(x(index), 0.0, 0.0)).collect(),
            after: (0..readings).map(|index| Pose2::new(x(index), sign * 0.019, 0.0)).collect(),
        }
    };
    let spot = Effect::named("floor_grip_patch").unwrap();
    Diagnosis {
        verdict: Verdict::Named,
        misfit: Misfit { chi2: 0.0, dof: 0, p_value: 1.0, conditions: Vec::new() },
        findings: Vec::new(),
        ranking: Vec::new(),
        probabilities: Vec::new(),
        blind_to: Vec::new(),
        noise: NoiseModel::prior(&Survey::default()),
        clocks: Vec::new(),
        suspicion: None,
        transient: None,
        causes: vec![Cause { values: vec![0.5, 0.0, 0.3, 0.5], ..spot.nothing() }],
        empirical: Vec::new(),
        other_tyres: None,
        doubt: crate::scene::Doubt::default(),
        residues: Vec::new(),
        remainder: None,
        next_experiment: None,
        runs: vec![
            run("cw-1", "square 1 m cw", 10, 1.0),
            run("cw-2", "square 1 m cw", 10, 1.0),
            run("ccw-1", "square 1 m ccw", 1, -1.0),
        ],
        left_out: Vec::new(),
    }
}

#[test]
fn a_diagnosis_holds_what_the_docs_promise() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("diagnosis.rrd");
    let scene = Scene::load("jnpf_4wd", "lab_floor").unwrap();
    diagnosis(&path, "test", &diagnosed(), &scene, "### Diagnosis").unwrap();

    let contents = read(&path);
    assert!(contents.blueprint_first);
    assert_eq!(contents.timelines, BTreeSet::from([RUN.to_owned(), TIMELINE.to_owned()]));
    let rows = |entity: &str| contents.rows.get(entity).copied().unwrap_or(0);
    let below =
        |root: &str| contents.rows.keys().filter(|entity| entity.starts_with(root)).cloned().collect::<Vec<_>>();
    for way in ["measured", "before", "after"] {
        // Ways of the condition whose runs were surveyed on the way, ends of both.
        let of = |ending: &str| below("/paths/").iter().filter(|entity| entity.ends_with(ending)).count();
        assert_eq!(of(&format!("/{way}")), 1, "{way}");
        assert_eq!(of(&format!("/{way}/end")), 2, "{way}");
        assert_eq!(rows(&format!("/one_run/{way}")), 3);
    }
    for stage in ["before", "after"] {
        let arrows = below("/residuals/").iter().filter(|entity| entity.ends_with(&format!("/{stage}"))).count();
        assert_eq!(arrows, 2, "a condition each");
        for series in ["position_residual_mm", "heading_residual_mrad"] {
            let along: Vec<String> = below(&format!("/series/{series}/"));
            let along: Vec<&String> = along.iter().filter(|entity| entity.ends_with(stage)).collect();
            assert_eq!(along.len(), 2, "the run without logs has none");
            // A row a reading and one of style.
            assert!(along.iter().all(|entity| rows(entity) == 10 + 1));
            assert_eq!(rows(&format!("/by_run/{series}/{stage}")), 3 + 1);
        }
    }
    for entity in ["/result", "/how_to_read", "/floor/plane", "/floor/grip"] {
        assert_eq!(rows(entity), 1, "{entity}");
    }
    assert!(!contents.series_names.is_empty());
    assert!(contents.series_names.iter().all(|name| name.ends_with("[mm]") || name.ends_with("[mrad]")));
}
