//! A model file made of a URDF: right where the URDF says it, marked where it does not, and drivable.

use crate::cli::{refused, text, treadmark};
use crate::rig;
use nalgebra::{Point3, Vector3};
use std::path::Path;
use treadmark::dataset::{Protocol, Rotation};
use treadmark::scene::{GRAVITY, Robot, Scene};

/// The URDF of a shipped robot, in a folder of its own.
fn shipped(folder: &Path, name: &str) -> String {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("robots").join(format!("{name}.urdf"));
    std::fs::copy(file, folder.join(format!("{name}.urdf"))).expect("it can be copied");
    format!("{name}.urdf")
}

fn described(folder: &Path, arguments: &[&str]) -> (String, String) {
    let output = treadmark(folder).arg("describe").args(arguments).output().expect("it starts");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    (text(&output.stdout), text(&output.stderr))
}

/// What the shipped model files say of wheels and casters is what their URDFs say; and the described robots drive.
#[test]
fn shipped_robots_come_back_from_their_urdfs() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in ["jnpf_4wd", "husky_a200", "optiodom", "leo", "rosbot", "panther", "pioneer_3at"] {
        let (stdout, stderr) = described(folder.path(), &[&shipped(folder.path(), name)]);
        assert!(
            stdout.starts_with(&format!("{name}.toml describes {name}: ")) && stderr.is_empty(),
            "{stdout}{stderr}"
        );
        let own =
            Scene::load(&folder.path().join(format!("{name}.toml")).to_string_lossy(), "lab_floor").expect("it loads");
        let model = Robot::load(name).expect("shipped");
        assert_eq!(own.robot.wheels.len(), model.wheels.len(), "{name}");
        for (wheel, expected) in own.robot.wheels.iter().zip(&model.wheels) {
            assert_eq!((&wheel.name, wheel.side), (&expected.name, expected.side), "{name}");
            assert_eq!(wheel.base_from_wheel, expected.base_from_wheel, "{name}");
            // Tyres of the first robot are stated to differ by 0.06 % from what is drawn.
            assert!((wheel.tyre.free_radius / expected.tyre.free_radius - 1.0).abs() < 1e-3, "{name}");
            assert_eq!(wheel.tyre.width, expected.tyre.width, "{name}");
        }
        let casters = |robot: &Robot| robot.casters.iter().map(|it| (it.link.clone(), it.radius)).collect::<Vec<_>>();
        assert_eq!(casters(&own.robot), casters(&model), "{name}");

        let protocol = Protocol::Square { side: 1.0, direction: Rotation::CounterClockwise };
        let end = rig::run(&own.noise_free(), protocol).measured.end.expect("it is surveyed");
        // A tenth of the side is what a track by theory and an assumed patch may cost.
        assert!(end.x.hypot(end.y) < 0.1, "{name}: {end:?}");
    }
}

/// A robot as makers draw it: 1.57 for a quarter turn, a footprint without mass, a box for a caster that would rub on the floor,
/// a scanner of which there is only a mesh.
const DRAWN: &str = r#"<robot name="little">
  <link name="base_footprint"/>
  <joint name="base_joint" type="fixed"><parent link="base_footprint"/><child link="base_link"/><origin xyz="0 0 0.02"/></joint>
  <link name="base_link">
    <inertial><origin xyz="-0.02 0 0.03"/><mass value="1.2"/>
      <inertia ixx="0.004" ixy="0" ixz="0" iyy="0.004" iyz="0" izz="0.005"/></inertial>
    <collision><origin xyz="-0.03 0 0.06"/><geometry><box size="0.16 0.14 0.1"/></geometry></collision>
  </link>
  <joint name="left_joint" type="continuous"><parent link="base_link"/><child link="left_wheel"/>
    <origin xyz="0 0.09 0.016" rpy="-1.57 0 0"/><axis xyz="0 0 1"/></joint>
  <link name="left_wheel"><inertial><mass value="0.04"/>
      <inertia ixx="2e-5" ixy="0" ixz="0" iyy="2e-5" iyz="0" izz="3e-5"/></inertial>
    <collision><geometry><cylinder radius="0.036" length="0.02"/></geometry></collision></link>
  <joint name="right_joint" type="continuous"><parent link="base_link"/><child link="right_wheel"/>
    <origin xyz="0 -0.09 0.016" rpy="-1.57 0 0"/><axis xyz="0 0 1"/></joint>
  <link name="right_wheel"><inertial><mass value="0.04"/>
      <inertia ixx="2e-5" ixy="0" ixz="0" iyy="2e-5" iyz="0" izz="3e-5"/></inertial>
    <collision><geometry><cylinder radius="0.036" length="0.02"/></geometry></collision></link>
  <joint name="back_joint" type="fixed"><parent link="base_link"/><child link="back_castor"/><origin xyz="-0.1 0 -0.012"/></joint>
  <link name="back_castor"><collision><geometry><box size="0.03 0.02 0.016"/></geometry></collision></link>
  <joint name="scan_joint" type="continuous"><parent link="base_link"/><child link="scan"/><origin xyz="0 0.01 0.15"/>
    <axis xyz="0 1 0"/></joint>
  <link name="scan"><visual><geometry><cylinder radius="0.03" length="0.02"/></geometry></visual>
    <visual><geometry><mesh filename="scan.stl"/></geometry></visual></link>
</robot>"#;

#[test]
fn a_robot_as_makers_draw_it_stands_and_rolls() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    std::fs::write(at.join("little.urdf"), DRAWN).expect("it can be written");
    let (stdout, stderr) = described(at, &["little.urdf", "--odometry", "0.0355,0.0355,0.18,2048"]);
    assert!(stdout.contains("2 driven wheels of 0.036 m, track 0.1800 m, caster `back_castor`, 1.280 kg"), "{stdout}");
    assert!(stderr.contains("joint `scan_joint` turns like a wheel and does not reach the ground"), "{stderr}");
    let robot = Robot::load(&at.join("little.toml").to_string_lossy()).expect("it loads");
    assert_eq!((robot.casters[0].radius, robot.encoder.ticks_per_revolution), (0.008, 2048.0));
    assert_eq!(robot.odometry.left_wheel_radius, 0.0355);
    for wheel in &robot.wheels {
        let axle = wheel.base_from_wheel.rotation * wheel.axle;
        assert!((axle.y - 1.0).abs() < 1e-15 && axle.x.abs() < 1e-15 && axle.z.abs() < 1e-15, "{axle:?}");
    }
    // What is drawn as a mesh alone is shown as the shape that it hits with.
    let meshed = DRAWN.replace(
        r#"<collision><origin xyz="-0.03 0 0.06"/>"#,
        r#"<visual><geometry><mesh filename="body.stl"/></geometry></visual><collision><origin xyz="-0.03 0 0.06"/>"#,
    );
    std::fs::write(at.join("meshed.urdf"), meshed).expect("it can be written");
    let (_, stderr) = described(at, &["meshed.urdf"]);
    assert!(stderr.contains("link `base_link`: visual meshes are left out, recordings show collision shapes instead"));
    let meshed = Robot::load(&at.join("meshed.toml").to_string_lossy()).expect("it loads");
    assert_eq!(meshed.chassis.collisions, robot.chassis.collisions);
    assert_eq!(meshed.chassis.visuals.len(), robot.chassis.visuals.len() + 1);
    // Half a millimetre above the floor its body would rub: the tyres squash by 0.7 mm.
    let low = DRAWN.replace(r#"<origin xyz="-0.03 0 0.06"/>"#, r#"<origin xyz="-0.03 0 0.0305"/>"#);
    std::fs::write(at.join("low.urdf"), low).expect("it can be written");
    let (_, stderr) = described(at, &["low.urdf"]);
    assert!(
        stderr.contains("link `base_link`: its collision shape clears the ground by 0.5 mm") && stderr.contains("rubs")
    );
    assert_eq!(stderr.matches("rubs").count(), 1, "{stderr}");
    // The paper's own figures are of another robot.
    let squares = ["--robot", "little.toml", "--sides", "1", "--repeats", "1", "--no-recording", "--out", "squares"];
    let output = treadmark(at).args(squares).output().expect("it starts");
    let stdout = text(&output.stdout);
    assert!(stdout.contains("Where the squares ended") && !stdout.contains("the paper's Table I"), "{stdout}");
    // Of spots on the floor that show alike, one is said.
    let output = treadmark(at).args(["power", "squares", "--data", "endpoints", "--robot", "little.toml"]).output();
    let stdout = text(&output.expect("it starts").stdout);
    assert_eq!(stdout.matches("floor_grip_patch.ratio").count(), 1, "{stdout}");
    // It stands on wheels and caster alone, rolls by its tyres' radius, goes straight, and turns as theory has it.
    let output = treadmark(at).args(["certify", "little.toml"]).output().expect("it starts");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stdout));
}

/// Hard casters ahead and behind would hold the wheels off the floor that they are to pull on: they are given springs, and whoever
/// makes them hard, or leaves the centre of mass outside, is told.
#[test]
fn casters_ahead_and_behind_leave_the_wheels_their_load() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let back = r#"<link name="back_castor">"#;
    let front = r#"<joint name="front_joint" type="fixed"><parent link="base_link"/><child link="front_castor"/>
        <origin xyz="0.06 0 -0.012"/></joint><link name="front_castor"/>"#;
    std::fs::write(at.join("little.urdf"), DRAWN.replace(back, &format!("{front}{back}"))).expect("it can be written");
    let (_, stderr) = described(at, &["little.urdf"]);
    assert!(!stderr.contains("weight") && !stderr.contains("tips"), "{stderr}");

    // The mass centre is 18.75 mm behind the axle; springs alike at 60, 0, 0 and −100 mm, in units of W: with F = k (u − a x),
    // 4 u + 40 a = 1/k and 40 u + 13600 a = 18.75/k.
    let (moment, square, behind) = (-0.04, 0.0136, -0.02 * 1.2 / 1.28);
    let slope = (behind - 0.25 * moment) / (square - 0.25 * moment * moment);
    let level = 0.25 * (1.0 - slope * moment);
    let model = std::fs::read_to_string(at.join("little.toml")).expect("it was written");
    let on_wheels = |model: &str| {
        std::fs::write(at.join("little.toml"), model).expect("it can be written");
        let scene = Scene::load(&at.join("little.toml").to_string_lossy(), "lab_floor").expect("it loads").noise_free();
        let mut world = rig::settled(&scene);
        rig::step_for(&mut world, 1.0);
        let mut wheels = Vec::new();
        world.wheel_snapshots(&mut wheels);
        wheels.iter().map(|wheel| wheel.load).sum::<f64>() / (scene.robot.mass() * GRAVITY)
    };
    let soft = on_wheels(&model);
    assert!((soft / (2.0 * level) - 1.0).abs() < 0.01, "{soft} of {}", 2.0 * level);

    let robot = Robot::load(&at.join("little.toml").to_string_lossy()).expect("it loads");
    let (own, squash) = (robot.casters[0].vertical_stiffness, 30.0);
    let hard = model.replace(
        &format!("vertical_stiffness_n_m = {own:?}    # ASSUMED: as soft as tyres"),
        &format!("vertical_stiffness_n_m = {:?}    # as soft as tyres", squash * own),
    );
    assert_eq!(hard.matches("# as soft").count(), 2);
    let share = on_wheels(&hard);
    let output = treadmark(at).args(["certify", "little.toml"]).output().expect("it starts");
    let told = text(&output.stderr);
    let expected = format!("its driven wheels carry {:.0} % of its weight and its casters the rest", 100.0 * share);
    assert!(share < 0.1 && told.contains(&expected), "{share}: {told}");

    std::fs::write(at.join("heavy.urdf"), DRAWN.replace("xyz=\"-0.02 0 0.03\"", "xyz=\"-0.12 0 0.03\""))
        .expect("it can be written");
    let (_, stderr) = described(at, &["heavy.urdf"]);
    assert!(
        stderr.contains("the centre of mass lies at x = -0.112 m, y = 0.000 m") && stderr.contains("it tips"),
        "{stderr}"
    );
}

/// Wheels on springs are drawn on joints that slide or swing: held as drawn, and told. What steers is no driven wheel.
#[test]
fn a_suspension_is_held_as_drawn() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let own = r#"<joint name="left_joint" type="continuous"><parent link="base_link"/>"#;
    let on = |kind: &str, axis: &str| {
        let arm = format!(
            r#"<joint name="spring" type="{kind}"><parent link="base_link"/><child link="arm"/><axis xyz="{axis}"/>
               <limit lower="-0.01" upper="0.01" effort="1" velocity="1"/></joint><link name="arm"/>"#
        );
        DRAWN.replace(own, &format!("{arm}{}", own.replace("base_link", "arm")))
    };
    std::fs::write(at.join("little.urdf"), DRAWN).expect("it can be written");
    described(at, &["little.urdf"]);
    let plain = Robot::load(&at.join("little.toml").to_string_lossy()).expect("it loads");
    for (kind, axis) in [("prismatic", "0 0 1"), ("revolute", "0 1 0")] {
        std::fs::write(at.join("sprung.urdf"), on(kind, axis)).expect("it can be written");
        let (_, stderr) = described(at, &["sprung.urdf"]);
        assert!(stderr.contains("joints `spring` and `scan_joint`: no driven wheel's, held fixed at zero"), "{stderr}");
        let sprung = Robot::load(&at.join("sprung.toml").to_string_lossy()).expect("it loads");
        for (wheel, own) in sprung.wheels.iter().zip(&plain.wheels) {
            assert_eq!(
                (&wheel.name, wheel.base_from_wheel, wheel.body.mass),
                (&own.name, own.base_from_wheel, own.body.mass)
            );
        }
        std::fs::remove_file(at.join("sprung.toml")).expect("it was written");
    }
    for (kind, axis) in [("revolute", "0 0 1"), ("continuous", "0 1 0")] {
        std::fs::write(at.join("little.urdf"), on(kind, axis)).expect("it can be written");
        refused(
            at,
            &["certify", "little.toml"],
            &["joint `left_joint` of wheel `left` hangs on `arm`, which itself turns"],
        );
    }
}

/// URDFs are published with inertias that nobody looked up; such a robot is drawn well and drives as nothing does.
#[test]
fn inertias_that_no_such_robot_has_are_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let wheel = r#"ixx="2e-5" ixy="0" ixz="0" iyy="2e-5" iyz="0" izz="3e-5""#;
    let body = r#"ixx="0.004" ixy="0" ixz="0" iyy="0.004" iyz="0" izz="0.005""#;
    let placeholder = |value: f64| format!(r#"ixx="{value}" ixy="0" ixz="0" iyy="{value}" iyz="0" izz="{value}""#);
    for (own, value, told) in [
        (
            wheel,
            0.01,
            "wheel `left`: its moment of inertia about its axle, 1.000e-2 kg m², is that of its 0.040 kg at 500 mm",
        ),
        (body, 1e-5, "chassis: its moment of inertia in yaw, 1.000e-5 kg m², is that of its 1.200 kg at 3 mm"),
    ] {
        std::fs::write(at.join("little.urdf"), DRAWN.replace(own, &placeholder(value))).expect("it can be written");
        let (_, stderr) = described(at, &["little.urdf"]);
        assert!(stderr.contains(told), "{stderr}");
        std::fs::remove_file(at.join("little.toml")).expect("it was written");
    }
    std::fs::write(at.join("little.urdf"), DRAWN).expect("it can be written");
    assert!(!described(at, &["little.urdf"]).1.contains("placeholder"));
}

/// A fork that turns on a bolt, drawn with its wheel aside: what swivels is found, moved behind, and shown apart from the chassis.
const FORK: &str = r#"<joint name="bolt" type="continuous"><parent link="base_link"/><child link="fork"/>
    <origin xyz="-0.08 0 0.01"/><axis xyz="0 0 1"/></joint>
  <link name="fork"><visual><geometry><box size="0.01 0.01 0.02"/></geometry></visual></link>
  <joint name="back_joint" type="continuous"><parent link="fork"/><child link="back_castor"/><origin xyz="0 0.02 -0.022"/>
    <axis xyz="1 0 0"/></joint>"#;

#[test]
fn a_caster_that_swivels_is_found() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let fixed = r#"<joint name="back_joint" type="fixed"><parent link="base_link"/><child link="back_castor"/><origin xyz="-0.1 0 -0.012"/></joint>"#;
    let drawn = DRAWN.replace(fixed, FORK);
    std::fs::write(at.join("little.urdf"), &drawn).expect("it can be written");
    let (_, stderr) = described(at, &["little.urdf"]);
    assert!(!stderr.contains("back_joint") && !stderr.contains("bolt"), "{stderr}");
    let file = at.join("little.toml");
    let robot = Robot::load(&file.to_string_lossy()).expect("it loads");
    let (caster, chassis) = (&robot.casters[0], &robot.chassis);
    let swivel = caster.swivel.as_ref().expect("it swivels");
    let off = (caster.centre - Point3::new(-0.1, 0.0, 0.008)).norm() + (swivel.trail - 0.02).abs();
    assert!(off < 1e-12, "{:?}, {}", caster.centre, swivel.trail);
    assert!(swivel.visuals.len() == 1 && chassis.collisions.len() == 1, "{chassis:?}");
    // Drawn to the left of its bolt, what was straight above the bolt is so still; the fork's x looked to the right.
    let turned = swivel.visuals[0].placement.rotation * Vector3::x();
    assert!((turned - Vector3::y()).norm() < 1e-12, "{turned:?}");
    let output = treadmark(at).args(["certify", "little.toml"]).output().expect("it starts");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stdout));

    let model = std::fs::read_to_string(&file).expect("it was written");
    for (urdf, swivel, parts) in [
        (drawn.clone(), "scan_joint", &["joint `scan_joint` of caster `back_castor` does not carry it", "bolt"][..]),
        (drawn.clone(), "back_joint", &["turns about (1.000, 0.000, 0.000)", "about the vertical"]),
        (drawn.clone(), "base_joint", &["is fixed", "continuous or revolute"]),
        (
            drawn.replace("0 0.02 -0.022", "0 0.002 -0.022"),
            "bolt",
            &["at 2.0 mm", "5 mm or more", "leave `swivel` out"],
        ),
    ] {
        std::fs::write(at.join("little.urdf"), urdf).expect("it can be written");
        let model = model.replace("swivel = \"bolt\"", &format!("swivel = \"{swivel}\""));
        std::fs::write(at.join("other.toml"), model).expect("it can be written");
        refused(at, &["certify", "other.toml"], parts);
    }
}

#[test]
fn what_makes_no_robot_is_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    let cylinder = r#"<cylinder radius="0.036" length="0.02"/>"#;
    let lowered = DRAWN.replace(r#"<origin xyz="-0.03 0 0.06"/>"#, r#"<origin xyz="-0.03 0 0.02"/>"#);
    let xacro = r#"<robot xmlns:xacro="x" name="a"><xacro:property name="m" value="1"/>
        <link name="a"><inertial><mass value="${m}"/></inertial></link></robot>"#;
    for (urdf, more, parts) in [
        (xacro.to_owned(), &[][..], &["robot.urdf: is a xacro, not a URDF", "xacro robot.urdf > robot.urdf"][..]),
        ("<robot".to_owned(), &[], &["robot.urdf, line 1: not a valid URDF"]),
        (
            DRAWN.replace("continuous", "fixed"),
            &[],
            &["no wheel stands on the left", "hangs on the chassis there; it has none"],
        ),
        (
            DRAWN.replace("0 0.09 0.016\" rpy=\"-1.57 0 0\"", "0.09 0 0.016\" rpy=\"0 1.57 0\""),
            &[],
            &["no wheel stands on the left", "about the x axis turn: left_joint; x must point ahead"],
        ),
        (
            DRAWN.replace("xyz=\"-0.02 0 0.03\"", "xyz=\"$(arg back) 0 0.03\""),
            &[],
            &["robot.urdf: not a valid URDF", "`$(arg back)` in line 5 is a xacro's"],
        ),
        (
            DRAWN.replace(cylinder, r#"<mesh filename="wheel.stl"/>"#),
            &[],
            &["joint `left_joint`: its wheel is drawn without a cylinder or sphere", "--wheel-radius"],
        ),
        (
            DRAWN.replace("castor", "thing"),
            &[],
            &["it stands on one axle and on nothing else", "--caster", "back_thing"],
        ),
        (DRAWN.to_owned(), &["--caster", "nothing"], &["caster names link `nothing`", "back_castor"]),
        (lowered, &[], &["link `base_link`: its collision shape reaches 10.0 mm below where the wheels stand"]),
        (DRAWN.to_owned(), &["--wheel-radius", "-1"], &["it must be a finite number above 0"]),
    ] {
        std::fs::write(at.join("robot.urdf"), urdf).expect("it can be written");
        refused(at, &[&["describe", "robot.urdf"], more].concat(), parts);
        assert!(!at.join("robot.toml").exists());
    }
    refused(at, &["describe", "nowhere.urdf"], &["nowhere.urdf: cannot be read"]);
    std::fs::write(at.join("robot.urdf"), DRAWN).expect("it can be written");
    std::fs::write(at.join("robot.toml"), "mine").expect("it can be written");
    refused(at, &["describe", "robot.urdf"], &["robot.toml: exists already"]);
    assert_eq!(std::fs::read_to_string(at.join("robot.toml")).expect("it is there"), "mine");
}

/// A model file elsewhere finds its URDF.
#[test]
fn a_model_file_may_lie_elsewhere() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = folder.path();
    std::fs::create_dir(at.join("models")).expect("it is new");
    std::fs::write(at.join("little.urdf"), DRAWN).expect("it can be written");
    described(at, &["little.urdf", "--out", "models/mine.toml", "--name", "Rosie \"the\" robot"]);
    let robot = Robot::load(&at.join("models/mine.toml").to_string_lossy()).expect("it finds its URDF");
    assert_eq!(robot.name, "Rosie \"the\" robot");
}
