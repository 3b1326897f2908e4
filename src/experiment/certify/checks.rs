//! One function a check: what is compared, and where the limit comes from.

use super::super::bench::Steady;
use super::{
    Check, HEADING_ACCURACY, Outcome, ROLLING_ACCURACY, SIDE, SPIN_RATES, STABLE_BELOW, STEP_DIVISORS, Stiffest,
    TRACK_ACCURACY, edit, factor, point_contact_factor, stiffest,
};
use crate::scene::{GRAVITY, Scene, Tyre};
use crate::world::WorldError;
use std::f64::consts::FRAC_PI_2;

/// What the simulations found, for the checks.
pub(super) struct Evidence<'a> {
    pub scene: &'a Scene,
    pub spins: [&'a Outcome; SPIN_RATES.len()],
    pub arcs: [&'a Outcome; super::ARC_RADII.len()],
    pub steps: [&'a Outcome; STEP_DIVISORS.len()],
    /// The spin and its mirror image, with fine encoders.
    pub mirror: [&'a Outcome; 2],
    pub straight: &'a Outcome,
    /// Of the robot with fine encoders, equal tyres and its mass midway.
    pub even_straight: &'a Outcome,
    /// Equal stiff tyres that touch at points.
    pub points: &'a Outcome,
    pub bounce: &'a Result<f64, WorldError>,
}

/// All checks, in the order in which one would look for what is wrong.
pub(super) fn all(evidence: &Evidence<'_>) -> Vec<Check> {
    vec![
        stiffest_part(evidence.scene),
        settling(evidence),
        load_ripple(evidence),
        rolling_radius(evidence),
        straight_drift(evidence),
        mirror_symmetry(evidence),
        point_contact(evidence),
        convergence(evidence),
        spin_speed(evidence),
        energy(evidence),
        friction_power(evidence),
    ]
}

/// The robot on its springs against the integrator's bound, see [`stiffest`].
fn stiffest_part(scene: &Scene) -> Check {
    let Stiffest { stability, spring, stiffness } = stiffest(scene);
    Check {
        name: "stiffest_part",
        value: stability,
        limit: STABLE_BELOW,
        note: format!(
            "{spring}: {:.0} N/mm at a step of {:.4} ms; a step is stable below 4 = (k Δt² + 2 c Δt)/m",
            1e-3 * stiffness,
            1e3 * scene.time_step
        ),
    }
}

/// The robot is made to bounce by as much as its weight squashes a tyre; after the standstill before a run 5 % of that may
/// be left, which is what control engineers call settled. Of the rolling radius it is 5 % of δ/3, and alternating.
fn settling(evidence: &Evidence<'_>) -> Check {
    let scene = evidence.scene;
    let share = edit::wheel_share(scene) / GRAVITY;
    let damping = |tyre: &Tyre| 0.5 * tyre.vertical_damping / (tyre.vertical_stiffness * share).sqrt();
    let least = scene.robot.wheels.iter().min_by(|one, other| damping(&one.tyre).total_cmp(&damping(&other.tyre)));
    let note = match (evidence.bounce, least) {
        (Err(error), _) => error.to_string(),
        (Ok(left), Some(wheel)) => format!(
            "of a bounce {:.2} % is left after {} s; least damped is wheel `{}`, at {:.2} of critical",
            1e2 * left,
            super::bench::SETTLE,
            wheel.name,
            damping(&wheel.tyre)
        ),
        (Ok(_), None) => String::new(),
    };
    Check { name: "settling", value: *evidence.bounce.as_ref().unwrap_or(&f64::NAN), limit: 0.05, note }
}

/// By how much wheel loads waver on a straight. A ripple r moves R_e = R − δ/3 by r δ/3, which has to stay within
/// [`ROLLING_ACCURACY`] of R; and at a ripple of 1 the wheel leaves the ground.
fn load_ripple(evidence: &Evidence<'_>) -> Check {
    let share = edit::wheel_share(evidence.scene);
    let wheels = evidence.scene.robot.wheels.iter();
    let squash = wheels.map(|wheel| wheel.tyre.squash(share) / wheel.tyre.free_radius).fold(0.0, f64::max);
    of_steady("load_ripple", evidence.straight, (3.0 * ROLLING_ACCURACY / squash).min(1.0), |steady| {
        (steady.load_ripple, format!("wheel loads on a straight waver by {:.2} %", 1e2 * steady.load_ripple))
    })
}

/// Travel a radian against R − δ/3. Nothing drags in steady rolling, so that only [`ROLLING_ACCURACY`] is left.
fn rolling_radius(evidence: &Evidence<'_>) -> Check {
    of_steady("rolling_radius", evidence.straight, ROLLING_ACCURACY, |steady| {
        let (found, theory) = (steady.rolling_radius(), steady.rolling_radius_at_rest());
        ((found / theory - 1.0).abs(), format!("{:.4} mm against R − δ/3 = {:.4} mm", 1e3 * found, 1e3 * theory))
    })
}

/// With equal tyres and its mass midway nothing turns a robot on a straight: [`HEADING_ACCURACY`] over a side of 4 m. Ticks
/// would, by one tick's heading either way, so its encoders are fine.
fn straight_drift(evidence: &Evidence<'_>) -> Check {
    of_steady("straight_drift", evidence.even_straight, HEADING_ACCURACY, |steady| {
        let drift = (SIDE * steady.turned / steady.distance).abs();
        (drift, format!("with equal tyres it turns by {:.1} µrad in {SIDE} m", 1e6 * drift))
    })
}

/// The mirrored robot turns clockwise as the robot turns counter-clockwise: a difference would be read as unequal wheels.
/// [`HEADING_ACCURACY`] for a quarter turn, on fine encoders.
fn mirror_symmetry(evidence: &Evidence<'_>) -> Check {
    let [ccw, cw] = evidence.mirror;
    let ccw = ccw.as_ref().map_or(f64::NAN, Steady::effective_track);
    of_steady("mirror_symmetry", cw, HEADING_ACCURACY, |steady| {
        let apart = FRAC_PI_2 * (steady.effective_track() / ccw - 1.0).abs();
        (apart, format!("the mirror image's quarter turn differs by {:.1} µrad", 1e6 * apart))
    })
}

/// Equal stiff tyres on points against the closed form: [`TRACK_ACCURACY`], and what a patch of the size that stands
/// for a point adds, (w² + (2a)²)/(3b²).
fn point_contact(evidence: &Evidence<'_>) -> Check {
    let theory = point_contact_factor(evidence.scene);
    let limit = TRACK_ACCURACY + 2.0 * edit::POINT * edit::POINT / 3.0;
    of_steady("point_contact", evidence.points, limit, |steady| {
        let found = steady.effective_track() / evidence.scene.robot.track_width();
        ((found / theory - 1.0).abs(), format!("b_eff/b = {found:.5} against {theory:.5}"))
    })
}

/// The integrator is of first order: the error falls with the step. It is taken against the value at step zero, from a line
/// through all steps; the scene's step has to be within [`TRACK_ACCURACY`] of it and each finer one within its share.
fn convergence(evidence: &Evidence<'_>) -> Check {
    let found: Vec<(f64, f64)> = STEP_DIVISORS
        .iter()
        .zip(evidence.steps)
        .map(|(&divisor, outcome)| (1.0 / f64::from(divisor), factor(evidence.scene, outcome)))
        .collect();
    let at_zero = intercept(&found);
    let error = |&(step, factor): &(f64, f64)| (factor / at_zero - 1.0).abs() / step;
    let worst = found.iter().max_by(|one, other| error(one).total_cmp(&error(other)));
    let failed = evidence.steps.iter().zip(STEP_DIVISORS).find_map(|(outcome, n)| Some((outcome.as_ref().err()?, n)));
    let milliseconds = |share: f64| 1e3 * share * evidence.scene.time_step;
    let (value, note) = match (failed, worst) {
        (Some((error, n)), _) => (f64::NAN, format!("at {:.4} ms {error}", milliseconds(1.0 / f64::from(n)))),
        (None, Some(worst)) => (
            error(worst),
            format!(
                "b_eff/b → {at_zero:.5} over {} steps; farthest is {:.5} at {:.4} ms, for its share of the step",
                found.len(),
                worst.1,
                milliseconds(worst.0)
            ),
        ),
        (None, None) => (f64::NAN, String::new()),
    };
    Check { name: "convergence", value, limit: TRACK_ACCURACY, note }
}

/// Where the least-squares line through (x, y) is at x = 0.
fn intercept(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(&|point| point.0), mean(&|point| point.1));
    let slope = mean(&|point| (point.0 - x) * (point.1 - y)) / mean(&|point| (point.0 - x).powi(2));
    y - slope * x
}

/// Friction knows no rate, so that spins at all rates are alike: [`TRACK_ACCURACY`], and what turns a mass centre off the
/// middle outwards, x ω² over μ g, which is that share of the friction.
fn spin_speed(evidence: &Evidence<'_>) -> Check {
    let scene = evidence.scene;
    let factors: Vec<f64> = evidence.spins.iter().map(|outcome| factor(scene, outcome)).collect();
    let fastest = SPIN_RATES[SPIN_RATES.len() - 1] * scene.robot.driver.turn_rate;
    let outward = edit::load_offset(scene).abs() * fastest * fastest / (least_friction(scene) * GRAVITY);
    let (least, most) =
        (factors.iter().copied().fold(f64::INFINITY, f64::min), factors.iter().copied().fold(0.0, f64::max));
    let failed = evidence.spins.iter().find_map(|outcome| outcome.as_ref().err());
    let (value, note) = match failed {
        Some(error) => (f64::NAN, error.to_string()),
        None => {
            (most / least - 1.0, format!("b_eff/b from {least:.5} to {most:.5} in spins of up to {fastest:.2} rad/s"))
        }
    };
    Check { name: "spin_speed", value, limit: TRACK_ACCURACY + outward, note }
}

/// What the motors give in a steady spin is what drivetrain friction and the tyres' slip take. A leak acts like a force that
/// is not there; as a share of the friction that all tyres have together it moves the effective track by that share at most:
/// [`TRACK_ACCURACY`].
fn energy(evidence: &Evidence<'_>) -> Check {
    let scene = evidence.scene;
    let friction = least_friction(scene) * scene.robot.mass() * GRAVITY;
    of_steady("energy", evidence.steps[0], TRACK_ACCURACY, |steady| {
        let slip: f64 = steady.tyre_power.iter().sum();
        let leak = steady.motor_power - steady.drivetrain_loss + slip;
        let tread_speed = 0.5 * (steady.way[0].abs() + steady.way[1].abs()) / steady.seconds;
        let note = format!(
            "of {:.4} W of the motors in a spin, {:.4} W go into drivetrains and {:.4} W into slip; {:+.4} W are left",
            steady.motor_power, steady.drivetrain_loss, -slip, leak
        );
        (leak.abs() / (friction * tread_speed), note)
    })
}

/// Friction takes power and never gives it: no tyre's mean power over a spin or an arc is above zero.
fn friction_power(evidence: &Evidence<'_>) -> Check {
    let moving = evidence.spins.iter().chain(&evidence.arcs).chain(&evidence.steps);
    let (mut value, mut note) = (f64::NEG_INFINITY, String::new());
    for outcome in moving {
        match outcome {
            Err(error) => {
                return Check { name: "friction_power", value: f64::NAN, limit: 0.0, note: error.to_string() };
            }
            Ok(Steady { tyre_power, .. }) => {
                for (power, wheel) in tyre_power.iter().zip(&evidence.scene.robot.wheels) {
                    if *power > value {
                        (value, note) =
                            (*power, format!("nearest to giving is wheel `{}`: {power:+.1e} W", wheel.name));
                    }
                }
            }
        }
    }
    Check { name: "friction_power", value, limit: 0.0, note }
}

fn least_friction(scene: &Scene) -> f64 {
    let tyres = scene.robot.wheels.iter().map(|wheel| &wheel.tyre);
    tyres.map(|tyre| tyre.friction_along.min(tyre.friction_across)).fold(f64::INFINITY, f64::min)
}

/// A check on one simulation; why it could not be done, where it could not.
fn of_steady(name: &'static str, outcome: &Outcome, limit: f64, check: impl FnOnce(&Steady) -> (f64, String)) -> Check {
    let (value, note) = match outcome {
        Ok(steady) => check(steady),
        Err(error) => (f64::NAN, error.to_string()),
    };
    Check { name, value, limit, note }
}
