//! How length and width of the contact patch, pressure, friction, load offset and turn radius move the effective track of a
//! skid-steer robot; a figure each, and a recording in which the patches are seen at work.
//!
//! ```sh
//! cargo run --release --example contact_patch -- contact-patch        # a new folder
//! rerun contact-patch/recording.rrd
//! ```

use rayon::prelude::*;
use std::error::Error;
use std::path::{Path, PathBuf};
use treadmark::experiment::bench;
use treadmark::experiment::certify::point_contact_factor;
use treadmark::report::plot::{Panel, figure};
use treadmark::scene::{Scene, Tyre};

/// One study: a figure's file and title, what is moved, and over which values.
struct Study {
    file: &'static str,
    title: &'static str,
    over: &'static str,
    values: &'static [f64],
    /// The robot and the radius of the turn \[m\] at one value.
    at: fn(&Scene, f64) -> (Scene, f64),
}

const STUDIES: [Study; 6] = [
    Study {
        file: "length.svg",
        title: "Length of the patch, by softer rubber",
        over: "length over the tyre's own [–]",
        values: &[0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0],
        at: |scene, scale| (tyres(scene, |tyre| soften(tyre, scale * scale)), 0.0),
    },
    Study {
        file: "width.svg",
        title: "Width of the patch",
        over: "width [m]",
        values: &[0.01, 0.025, 0.05, 0.075, 0.1, 0.125, 0.15],
        at: |scene, width| (tyres(scene, |tyre| tyre.width = width), 0.0),
    },
    Study {
        file: "pressure.svg",
        title: "Pressure, by the robot's mass on the same tyres",
        over: "mass of the chassis over its own [–]",
        values: &[0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0],
        at: |scene, ratio| (heavier(scene, ratio), 0.0),
    },
    Study {
        file: "friction_ratio.svg",
        title: "Friction across over along",
        over: "ratio [–]",
        values: &[0.5, 0.7, 0.85, 1.0, 1.2, 1.4, 1.7, 2.0],
        at: |scene, ratio| (tyres(scene, |tyre| tyre.friction_across = ratio * tyre.friction_along), 0.0),
    },
    Study {
        file: "load_offset.svg",
        title: "Mass centre ahead of the middle",
        over: "offset over wheelbase [–]",
        values: &[-0.2, -0.15, -0.1, -0.05, 0.0, 0.05, 0.1, 0.15, 0.2],
        at: |scene, offset| (nose_heavy(scene, offset), 0.0),
    },
    Study {
        file: "turn_radius.svg",
        title: "Radius of the turn",
        over: "radius [m]",
        values: &[0.0, 0.15, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0],
        at: |scene, radius| (scene.clone(), radius),
    },
];

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "contact-patch".to_owned()));
    std::fs::create_dir(&folder).map_err(|error| format!("{}: cannot be made: {error}", folder.display()))?;
    let mut scene = Scene::load("jnpf_4wd", "lab_floor")?.noise_free();
    scene.robot.wheels.iter_mut().for_each(|wheel| wheel.tyre.free_radius = 0.1);
    let soft = tyres(&scene, |tyre| soften(tyre, 4.0));

    for study in &STUDIES {
        // The robot's own tyres, and softer ones, whose patches are twice as long.
        let curves = [("tyres as they are", curve(study, &scene)?), ("four times as soft", curve(study, &soft)?)];
        let panel =
            Panel { title: study.title, over: study.over, curves: &curves, theory: point_contact_factor(&scene) };
        std::fs::write(folder.join(study.file), figure("Effective track over track", &[panel])?)?;
        let (low, high) =
            curves[0].1.iter().fold((f64::MAX, f64::MIN), |(low, high), (_, y)| (low.min(*y), high.max(*y)));
        println!("{:<20} b_eff/b from {low:.4} to {high:.4}", study.file);
    }
    record(&folder, &soft)?;
    println!("figures and a recording are in {}", folder.display());
    Ok(())
}

/// b_eff/b at every value of a study, side by side.
fn curve(study: &Study, scene: &Scene) -> Result<Vec<(f64, f64)>, Box<dyn Error>> {
    let measure = |&value: &f64| {
        let (scene, radius) = (study.at)(scene, value);
        let robot = &scene.robot;
        let yaw_rate = robot.driver.turn_rate.min(robot.driver.cruise_speed / radius);
        let half = 0.5 * robot.track_width() * point_contact_factor(&scene);
        let wheel = |way: f64| yaw_rate * way / robot.wheels[0].tyre.free_radius;
        let steady = bench::steady(&scene, wheel(radius - half), wheel(radius + half), 2.0, 4.0)?;
        Ok((value, steady.effective_track() / robot.track_width()))
    };
    let points: Result<Vec<(f64, f64)>, treadmark::world::WorldError> = study.values.par_iter().map(measure).collect();
    Ok(points?)
}

fn tyres(scene: &Scene, edit: impl Fn(&mut Tyre)) -> Scene {
    let mut scene = scene.clone();
    scene.robot.wheels.iter_mut().for_each(|wheel| edit(&mut wheel.tyre));
    scene
}

/// `times` as soft, damped as before: a = √(2R N/k_z) grows with the root.
fn soften(tyre: &mut Tyre, times: f64) {
    tyre.vertical_stiffness /= times;
    tyre.vertical_damping /= times.sqrt();
}

fn heavier(scene: &Scene, ratio: f64) -> Scene {
    let mut scene = scene.clone();
    scene.robot.chassis.mass *= ratio;
    scene.robot.chassis.inertia *= ratio;
    scene
}

fn nose_heavy(scene: &Scene, offset: f64) -> Scene {
    let mut scene = scene.clone();
    let (whole, wheelbase) = (scene.robot.mass(), scene.robot.wheelbase());
    scene.robot.chassis.centre_of_mass.x += offset * wheelbase * whole / scene.robot.chassis.mass;
    scene
}

/// A spin on the spot and a tight circle, with the tractions of every bristle.
#[cfg(feature = "recording")]
fn record(folder: &Path, scene: &Scene) -> Result<(), Box<dyn Error>> {
    use std::f64::consts::TAU;
    use std::sync::atomic::AtomicBool;
    use treadmark::dataset::{Protocol, Rotation};
    use treadmark::drive::{self, Task};
    use treadmark::recording::{Area, Detail, Outline, Recording, RunLabel};

    let direction = Rotation::CounterClockwise;
    let protocols =
        [Protocol::Spin { turn: TAU, direction }, Protocol::Circle { radius: 1.0, turn: Some(TAU), direction }];
    let labels = protocols.map(|protocol| RunLabel::of("patches", &protocol, 1));
    let outline = Outline {
        title: "Contact patches at work".to_owned(),
        stages: vec!["patches".to_owned()],
        featured: labels.to_vec(),
        area: Area::of(&protocols),
        sides: Vec::new(),
    };
    let recording = Recording::create(&folder.join("recording.rrd"), &outline, scene)?;
    for (protocol, label) in protocols.into_iter().zip(&labels) {
        let mut recorder = recording.run(label, Detail::Full);
        let task = Task::new(protocol.kind(), protocol);
        drive::run(scene, &task, 1, Some(&mut recorder), &AtomicBool::new(false))?;
    }
    recording
        .result("The arrows are the shear of each bristle cell: across at the ends of the robot, along at its sides.");
    Ok(recording.finish()?)
}

#[cfg(not(feature = "recording"))]
fn record(_: &Path, _: &Scene) -> Result<(), Box<dyn Error>> {
    eprintln!("note: this build makes no recordings (cargo feature `recording`)");
    Ok(())
}
