//! Certificates: shipped robots pass, broken ones fail and are told where, the explanation adds up.

use crate::rig::ideal;
use rayon::prelude::*;
use treadmark::experiment::certify::{Certificate, Check, certify, point_contact_factor, stability, stiffest};
use treadmark::scene::{ROBOTS, Scene, Tyre};

fn certificate(scene: &Scene) -> Certificate {
    certify(scene, &|_| ()).expect("it can be built")
}

fn check<'a>(certificate: &'a Certificate, name: &str) -> &'a Check {
    certificate.checks.iter().find(|check| check.name == name).unwrap_or_else(|| panic!("there is a check {name}"))
}

fn edited(robot: &str, edit: fn(&mut Tyre)) -> Scene {
    let mut scene = Scene::load(robot, "lab_floor").expect("shipped");
    scene.robot.wheels.iter_mut().for_each(|wheel| edit(&mut wheel.tyre));
    scene
}

/// Every shipped robot passes, and its contributions add up to the whole difference from theory: sums of f64, 1e-12.
#[test]
fn every_shipped_robot_passes_and_its_track_is_explained() {
    ROBOTS.names().par_iter().for_each(|robot| {
        let scene = Scene::load(robot, "lab_floor").expect("shipped");
        let certificate = certificate(&scene);
        let failed: Vec<&Check> = certificate.checks.iter().filter(|check| !check.passed()).collect();
        assert!(failed.is_empty(), "{robot}: {failed:?}");
        let sum: f64 = certificate.contributions.iter().map(|one| one.delta).sum();
        let difference = certificate.track_factor - certificate.theory_factor;
        assert!((sum - difference).abs() < 1e-12, "{robot}: {sum} against {difference}");
        // What is left for the engine itself is a tenth of the accuracy that is claimed.
        let rest = certificate.contributions.iter().find(|one| one.cause == "remainder").expect("there is one");
        assert!(rest.delta.abs() < 1e-4 * certificate.theory_factor, "{robot}: {rest:?}");
        assert!(certificate.steps.len() >= 5, "five steps or more");
    });
}

/// The balance of points is 1 + (l/b)² for two axles and 1 for one, to the last digits of a bisection.
#[test]
fn points_have_the_closed_form() {
    for robot in ROBOTS.names() {
        let scene = ideal(robot);
        let theory = 1.0 + (scene.robot.wheelbase() / scene.robot.track_width()).powi(2);
        assert!((point_contact_factor(&scene) - theory).abs() < 1e-12, "{robot}");
    }
}

/// Dimensions put in by hand move the causes that they belong to, and no other by more than they act together: a mass
/// centre 2 % of the wheelbase ahead lowers the factor through `load_offset` alone.
#[test]
fn a_cause_is_found_where_it_was_put() {
    let mut scene = ideal("husky_a200");
    let forward = 0.02 * scene.robot.wheelbase();
    scene.robot.chassis.centre_of_mass.x += forward * scene.robot.mass() / scene.robot.chassis.mass;
    let (moved, plain) = (certificate(&scene), certificate(&ideal("husky_a200")));
    let delta = |certificate: &Certificate, cause: &str| {
        certificate.contributions.iter().find(|one| one.cause == cause).expect("there is one").delta
    };
    let lost = plain.track_factor - moved.track_factor;
    assert!(lost > 5e-3, "{lost}");
    assert!((delta(&moved, "load_offset") + lost).abs() < 1e-4, "{} against {lost}", delta(&moved, "load_offset"));
    for cause in ["friction_ratio", "slip_stiffness", "patch_size", "remainder"] {
        assert!((delta(&moved, cause) - delta(&plain, cause)).abs() < 1e-4, "{cause}");
    }
}

/// A step of 5 ms, the longest that the encoders' rate lets pass, is too long for light wheels; a heavier robot stands it.
#[test]
fn a_step_that_is_too_long_fails() {
    let at_5_ms = |robot: &str| {
        let mut scene = Scene::load(robot, "lab_floor").expect("shipped");
        scene.time_step = 5e-3;
        certificate(&scene)
    };
    let hopping = at_5_ms("rosbot");
    for name in ["stiffest_part", "rolling_radius", "convergence", "energy"] {
        assert!(!check(&hopping, name).passed(), "{name}");
    }
    let tipped = at_5_ms("optiodom");
    let stiffest = check(&tipped, "stiffest_part");
    assert!(!stiffest.passed() && stiffest.note.contains("shear of its patch along"), "{stiffest:?}");
    let spin = check(&tipped, "energy");
    assert!(spin.value.is_nan() && spin.note.contains("tipped over"), "{spin:?}");
    assert!(at_5_ms("jnpf_4wd").passed());
}

/// The robot as a whole has the number of a mass on a spring where one can be told: straight up it is the whole mass on
/// four tyres, and along it a wheel's inertia and its share of the mass on the shear of a stuck patch.
#[test]
fn the_stiffest_way_of_shaking_is_the_closed_form() {
    let mut scene = ideal("husky_a200");
    let whole = scene.robot.whole();
    let middle = scene.robot.wheels.iter().map(|wheel| wheel.base_from_wheel.translation.x).sum::<f64>() / 4.0;
    scene.robot.chassis.centre_of_mass.x += (middle - whole.centre_of_mass.x) * whole.mass / scene.robot.chassis.mass;
    // Heave of four equal springs; pitch and roll of so long and wide a body are slower.
    scene.robot.chassis.inertia *= 100.0;
    scene.robot.wheels.iter_mut().for_each(|wheel| wheel.tyre.slip_stiffness = 1e-6);
    let tyre = scene.robot.wheels[0].tyre;
    let heave = stability(4.0 * tyre.vertical_stiffness, 4.0 * tyre.vertical_damping, whole.mass, scene.time_step);
    let found = stiffest(&scene);
    assert!((found.stability / heave - 1.0).abs() < 1e-6, "{found:?} against {heave}");
    assert!(found.spring.contains("bounce"), "{found:?}");

    // Stuck patches of a robot that cannot pitch: four wheels wind together against the whole mass.
    let mut scene = ideal("husky_a200");
    scene.robot.chassis.inertia *= 1e9;
    scene.robot.wheels.iter_mut().for_each(|wheel| {
        wheel.tyre.slip_stiffness *= 10.0;
        wheel.tyre.vertical_damping = 0.0;
    });
    let robot = &scene.robot;
    let (wheel, tyre) = (&robot.wheels[0], &robot.wheels[0].tyre);
    let squash = tyre.squash(robot.mass() * treadmark::scene::GRAVITY / 4.0);
    let shear = tyre.bristle_stiffness() * 2.0 * tyre.contact_half_length(squash) * tyre.width;
    let inertia = wheel.spin_inertia() + robot.drivetrain.reflected_inertia();
    let mobility = tyre.rolling_radius(squash).powi(2) / inertia + 4.0 / robot.mass();
    let damping = shear * treadmark::world::BRISTLE_DAMPING;
    let winding = stability(shear, damping, 1.0 / mobility, scene.time_step);
    let found = stiffest(&scene);
    assert!((found.stability / winding - 1.0).abs() < 1e-6, "{found:?} against {winding}");
    assert!(found.spring.contains("along"), "{found:?}");
}

#[test]
fn tyres_too_stiff_for_the_step_fail() {
    let stiff = certificate(&edited("husky_a200", |tyre| tyre.vertical_stiffness *= 1e3));
    let stiffest = check(&stiff, "stiffest_part");
    assert!(!stiffest.passed() && stiffest.note.contains("40000 N/mm"), "{stiffest:?}");
    assert!(!stiff.passed() && !check(&stiff, "convergence").passed());
}

#[test]
fn tyres_without_damping_fail() {
    for robot in ["jnpf_4wd", "husky_a200", "optiodom"] {
        let undamped = certificate(&edited(robot, |tyre| tyre.vertical_damping = 0.0));
        let settling = check(&undamped, "settling");
        assert!(!settling.passed() && settling.note.contains("0.00 of critical"), "{robot}: {settling:?}");
    }
}

/// The bound of the integrator is where a mass on a spring really begins to grow.
#[test]
fn stability_is_the_integrators_own() {
    for damping in [0.0, 50.0, 900.0] {
        for (factor, stable) in [(0.98, true), (1.02, false)] {
            let (mass, step) = (2.0, 1e-3);
            // The stiffness at which the number is 4, a little aside.
            let stiffness = factor * (4.0 * mass / step - 2.0 * damping) / step;
            let (mut x, mut v) = (1.0f64, 0.0f64);
            for _ in 0..20_000 {
                v -= step * (stiffness * x + damping * v) / mass;
                x += step * v;
                if x.abs() > 1e3 {
                    break;
                }
            }
            assert_eq!(x.abs() < 1e2, stable, "damping {damping}: {x}");
            assert_eq!(stability(stiffness, damping, mass, step) < 4.0, stable, "damping {damping}");
        }
    }
}
