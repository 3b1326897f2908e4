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
