//! The invariants of the house, read from the imports.

use std::collections::BTreeMap;
use std::path::Path;

/// The rooms, ground floor first; a room may use those before it. What stands on one line may not use each other.
const FLOORS: &[&[&str]] = &[
    &["strict", "geometry", "table"],
    &["odometry"],
    &["dataset"],
    &["scene", "import"],
    &["effect"],
    &["world"],
    &["drive", "calibrate", "diagnose"],
    &["experiment"],
    &["report"],
    &["recording"],
    &["cli"],
];

/// What a room must not use although it stands below.
const CLOSED: &[(&str, &str)] =
    &[("calibrate", "world"), ("calibrate", "drive"), ("calibrate", "scene"), ("diagnose", "world")];

/// Third parties, and the rooms that may name them.
const THIRD_PARTIES: &[(&str, &[&str])] = &[
    ("rapier3d::", &["world"]),
    ("parry3d", &["world"]),
    ("wide::", &["world"]),
    ("urdf_rs::", &["scene"]),
    ("mcap::", &["import"]),
    ("cdr_encoding::", &["import"]),
    ("byteorder::", &["import"]),
    ("parquet::", &["table"]),
    ("sobol_burley::", &["experiment"]),
    ("crc32fast::", &["experiment"]),
    ("rerun::", &["recording"]),
    ("clap::", &["cli", "main"]),
    ("anyhow::", &["cli", "main"]),
    ("comfy_table::", &["report"]),
    ("plotters::", &["report"]),
    ("maud::", &["report"]),
    ("sha2::", &["report"]),
    ("indicatif::", &["cli"]),
    ("ctrlc::", &["cli"]),
];

/// The code of each room, comments left out.
fn rooms() -> BTreeMap<String, Vec<(String, String)>> {
    let mut rooms = BTreeMap::new();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut open = vec![source.clone()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).expect("src can be read") {
            let path = entry.expect("src can be read").path();
            if path.is_dir() {
                open.push(path);
                continue;
            }
            let inside = path.strip_prefix(&source).expect("it is below src").to_string_lossy().into_owned();
            let room = inside.split(['/', '\\', '.']).next().expect("a first part").to_owned();
            let text = std::fs::read_to_string(&path).expect("a source file can be read");
            let code: String =
                text.lines().map(|line| line.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n");
            rooms.entry(room).or_insert_with(Vec::new).push((inside, code));
        }
    }
    rooms
}

#[test]
fn imports_run_downward() {
    let floor_of = |room: &str| FLOORS.iter().position(|floor| floor.contains(&room));
    let mut checked = 0;
    for (room, files) in rooms() {
        let Some(floor) = floor_of(&room) else {
            assert!(["lib", "main"].contains(&room.as_str()), "room `{room}` has no floor: add it to FLOORS");
            continue;
        };
        for (file, code) in files {
            for used in code.split("crate::").skip(1) {
                let used: String = used.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                if used == room || used.is_empty() {
                    continue;
                }
                let used_floor =
                    floor_of(&used).unwrap_or_else(|| panic!("{file} uses crate::{used}, which has no floor"));
                assert!(used_floor < floor, "{file}: `{room}` uses `{used}`, which does not stand below it");
                assert!(!CLOSED.contains(&(room.as_str(), used.as_str())), "{file}: `{room}` must not use `{used}`");
                checked += 1;
            }
        }
    }
    assert!(checked > 50, "only {checked} imports were found: the test reads the wrong place");
}

#[test]
fn third_parties_stay_in_their_rooms() {
    let rooms = rooms();
    for (party, allowed) in THIRD_PARTIES {
        for (room, files) in &rooms {
            for (file, code) in files {
                assert!(allowed.contains(&room.as_str()) || !code.contains(party), "{file} names {party}");
            }
        }
    }
}

/// The driver's only way in is ticks.
#[test]
fn the_driver_never_sees_a_pose() {
    let rooms = rooms();
    let (_, driver) = rooms["drive"].iter().find(|(file, _)| file.ends_with("driver.rs")).expect("there is a driver");
    for forbidden in ["crate::world", "World", "Snapshot", "fn pose"] {
        assert!(!driver.contains(forbidden), "the driver names {forbidden}");
    }
}

/// What the README says is shown by a test is, by one that there is: as `cargo test` finds it by a part of its name.
#[test]
fn the_readme_names_tests_that_there_are() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut tests = Vec::new();
    for entry in std::fs::read_dir(root.join("tests/evidence")).expect("it can be read") {
        let path = entry.expect("it can be read").path();
        let module = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let text = std::fs::read_to_string(&path).expect("a source file can be read");
        for (attribute, function) in text.lines().zip(text.lines().skip(1)) {
            let name = function.trim().strip_prefix("fn ").and_then(|rest| rest.split('(').next());
            tests.extend(name.filter(|_| attribute.trim() == "#[test]").map(|name| format!("{module}::{name}")));
        }
    }
    let readme = std::fs::read_to_string(root.join("README.md")).expect("it can be read");
    let evidence = readme.split("\n## What the evidence is").nth(1).expect("it says so");
    let evidence = evidence.split("\n## ").next().expect("a first part");
    let spans = evidence.split('`').skip(1).step_by(2).map(|span| span.trim_matches(['…', '*']));
    let is_name = |span: &&str| span.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || "_:".contains(c));
    let named: Vec<&str> = spans.filter(is_name).collect();
    assert!(named.len() > 20, "only {named:?} were found: the test reads the wrong place");
    for name in named {
        assert!(tests.iter().any(|test| test.contains(name)), "there is no test `{name}`");
    }
}
