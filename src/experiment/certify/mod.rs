//! A robot's simulation held against what is known: closed forms, mirror images, shorter steps, balances of power.
//!
//! # What is measured
//!
//! The effective track b_eff is what an odometry has to divide by: the difference of the sides' ways (rolling radius times
//! rotation) over what the body turned. It is measured in a spin on the spot, in spins of other speeds and in arcs. Between it and
//! the closed form b(1 + (l/b)²) stand things that are switched off one after another, each change of b_eff/b being that
//! thing's contribution; what is left at the end, on equal stiff tyres that touch at points, is the engine's own error.
//!
//! # What is checked, and against which limit
//!
//! Every limit follows from one of three needs: the effective track within [`TRACK_ACCURACY`] and the rolling radius
//! within [`ROLLING_ACCURACY`], which is what the README states, and headings within [`HEADING_ACCURACY`], which is what a
//! calibration of odometry can tell apart. Each check's documentation, at the function that makes it, derives its limit.
//!
//! Validated by `certify::*` in the tests.

mod checks;
mod edit;
mod literature;
mod theory;

pub use literature::{LITERATURE, LiteratureRow, Published, literature};
pub use theory::{STABLE_BELOW, Stiffest, point_contact_factor, stability, stiffest};

use super::bench::{self, Steady};
use crate::scene::Scene;
use crate::world::WorldError;
use rayon::prelude::*;

/// Relative accuracy of the effective track that is claimed \[–\].
pub const TRACK_ACCURACY: f64 = 1e-3;
/// Relative accuracy of the rolling radius that is claimed \[–\].
pub const ROLLING_ACCURACY: f64 = 1e-4;
/// Heading over a side or a corner of a square that calibration needs \[rad\]: a hundredth of a good survey's 1 mrad.
pub const HEADING_ACCURACY: f64 = 1e-5;

/// Length of a straight \[m\] on which [`HEADING_ACCURACY`] counts: the longer usual side of a square.
const SIDE: f64 = 4.0;

/// The steps of the convergence study are the scene's over these.
pub const STEP_DIVISORS: [u32; 5] = [1, 2, 3, 4, 6];
/// Radii of the arcs, over the effective track.
const ARC_RADII: [f64; 5] = [0.5, 1.0, 2.0, 5.0, 20.0];
/// Rates of the spins, over the driver's.
const SPIN_RATES: [f64; 3] = [0.5, 1.0, 1.5];
/// Time to become steady, and to measure \[s\].
const WAIT: f64 = 2.0;
const WINDOW: f64 = 4.0;

/// How far the work is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// So many more simulations are going to run.
    Ahead(usize),
    /// One has run.
    Done,
}

/// Hears of [`Progress`], from the simulations' own threads.
pub type Tell<'a> = &'a (dyn Fn(Progress) + Sync);

/// What a robot's simulation came to.
#[derive(Debug, Clone)]
pub struct Certificate {
    /// Name of the robot.
    pub robot: String,
    /// b \[m\].
    pub track_width: f64,
    /// b_eff in a spin on the spot \[m\]; NaN where that could not be simulated.
    pub effective_track: f64,
    /// b_eff/b.
    pub track_factor: f64,
    /// What points under equal loads would have: 1 + (l/b)² for two axles.
    pub theory_factor: f64,
    /// Why the two differ; they add up to the difference.
    pub contributions: Vec<Contribution>,
    /// Travel a radian on a straight \[m\].
    pub rolling_radius: f64,
    /// R − δ/3, mean of the wheels under their loads at rest \[m\].
    pub rolling_radius_theory: f64,
    /// Heading gained on a straight as built \[rad/m\].
    pub drift: f64,
    /// b_eff/b in arcs: radius \[m\], factor.
    pub arcs: Vec<(f64, f64)>,
    /// b_eff/b in spins: yaw rate \[rad/s\], factor.
    pub spins: Vec<(f64, f64)>,
    /// b_eff/b over the step: step \[s\], factor.
    pub steps: Vec<(f64, f64)>,
    /// The verdicts.
    pub checks: Vec<Check>,
}

impl Certificate {
    /// Whether every check passed.
    pub fn passed(&self) -> bool {
        self.checks.iter().all(Check::passed)
    }
}

/// How much one thing adds to b_eff/b.
#[derive(Debug, Clone, PartialEq)]
pub struct Contribution {
    /// `patch_size`, …
    pub cause: &'static str,
    /// \[–\]
    pub delta: f64,
}

/// One verdict.
#[derive(Debug, Clone)]
pub struct Check {
    /// `rolling_radius`, …
    pub name: &'static str,
    /// What was found; NaN where it could not be simulated.
    pub value: f64,
    /// What it may be at most.
    pub limit: f64,
    /// In plain words what was found, with units, and where.
    pub note: String,
}

impl Check {
    /// Whether the value is known and within its limit.
    pub fn passed(&self) -> bool {
        self.value <= self.limit
    }
}

/// A steady motion to be simulated, by the speeds of the treads.
#[derive(Debug, Clone, Copy)]
struct Motion {
    /// Of the base \[m/s\].
    forward: f64,
    /// \[rad/s\]
    yaw_rate: f64,
    /// \[s\]
    window: f64,
}

type Outcome = Result<Steady, WorldError>;

/// b_eff/b of an outcome; NaN where there is none.
fn factor(scene: &Scene, outcome: &Outcome) -> f64 {
    outcome.as_ref().map_or(f64::NAN, |steady| steady.effective_track() / scene.robot.track_width())
}

/// Simulates `motion`, the sides' speeds being those of a robot with the point-contact track.
fn simulate(scene: &Scene, motion: Motion) -> Outcome {
    let robot = &scene.robot;
    let half = 0.5 * robot.track_width() * point_contact_factor(scene);
    let radius = robot.wheels.iter().map(|wheel| wheel.tyre.free_radius).sum::<f64>() / robot.wheels.len() as f64;
    let (left, right) = (motion.forward - half * motion.yaw_rate, motion.forward + half * motion.yaw_rate);
    bench::steady(scene, left / radius, right / radius, WAIT, motion.window)
}

/// A spin on the spot at `rate` times the driver's turn rate.
fn spin(scene: &Scene, rate: f64) -> Motion {
    Motion { forward: 0.0, yaw_rate: rate * scene.robot.driver.turn_rate, window: WINDOW }
}

/// An arc of `radius` \[m\], no faster in speed and turn than the driver drives.
fn arc(scene: &Scene, radius: f64) -> Motion {
    let driver = &scene.robot.driver;
    let yaw_rate = driver.turn_rate.min(driver.cruise_speed / radius);
    Motion { forward: yaw_rate * radius, yaw_rate, window: 2.0 * WINDOW }
}

fn straight(scene: &Scene) -> Motion {
    Motion { forward: scene.robot.driver.cruise_speed, yaw_rate: 0.0, window: 2.0 * WINDOW }
}

/// b_eff/b in a spin on the spot at the driver's turn rate.
///
/// # Errors
/// The world cannot be built, or is left.
pub fn spin_factor(scene: &Scene) -> Result<f64, WorldError> {
    Ok(simulate(scene, spin(scene, 1.0))?.effective_track() / scene.robot.track_width())
}

/// The same scene without one cause.
type SwitchOff = fn(&Scene) -> Scene;

/// Everything on the way from the robot as built to equal, stiff tyres that touch at points: what is switched off, and
/// how. The order matters where causes act together; it goes from what a workshop can change to what rubber is.
const SWITCHES: [(&str, SwitchOff); 6] = [
    ("unequal_tyres", edit::equal_tyres),
    ("load_offset", |scene| edit::mass_centre_at(scene, 0.0)),
    ("caster_drag", edit::free_casters),
    ("friction_ratio", |scene| edit::friction_ratio(scene, 1.0)),
    ("slip_stiffness", edit::stiff_bristles),
    ("patch_size", edit::point_patches),
];

/// Measures and checks the robot of `scene`. Simulations go side by side on rayon's threads; results do not depend on how
/// many. A simulation that fails fails the checks that rest on it.
///
/// # Errors
/// The world cannot be built at all: a rate that is no whole number of steps, no ground.
pub fn certify(scene: &Scene, tell: Tell<'_>) -> Result<Certificate, WorldError> {
    let scene = &scene.clone().noise_free();
    bench::buildable(scene)?;

    let mut trials: Vec<(Scene, Motion)> = Vec::new();
    let mut plan = |scene: Scene, motion: Motion| {
        trials.push((scene, motion));
        trials.len() - 1
    };
    let spins = SPIN_RATES.map(|rate| plan(scene.clone(), spin(scene, rate)));
    let effective = scene.robot.track_width() * point_contact_factor(scene);
    let arcs = ARC_RADII.map(|radius| plan(scene.clone(), arc(scene, radius * effective)));
    let steps = STEP_DIVISORS.map(|divisor| plan(with_step_over(scene, divisor), spin(scene, 1.0)));
    let fine = edit::fine_encoders(scene);
    let image = plan(edit::mirrored(&fine), spin(scene, -1.0));
    let imaged = plan(fine.clone(), spin(scene, 1.0));
    let drive = plan(scene.clone(), straight(scene));
    let even = edit::mass_centre_at(&edit::equal_tyres(&fine), edit::load_offset(scene));
    let even_drive = plan(even, straight(scene));
    let mut edited = with_step_over(scene, edit::fine_divisor(scene));
    let mut switched = vec![("time_step", plan(edited.clone(), spin(scene, 1.0)))];
    for (cause, switch_off) in SWITCHES {
        edited = switch_off(&edited);
        switched.push((cause, plan(edited.clone(), spin(scene, 1.0))));
    }

    tell(Progress::Ahead(trials.len() + 1));
    let (outcomes, bounce) = rayon::join(
        || {
            let run = |(scene, motion): &(Scene, Motion)| {
                let outcome = simulate(scene, *motion);
                tell(Progress::Done);
                outcome
            };
            // One at a time to each thread: the fine steps take ten times as long as the others.
            trials.par_iter().with_max_len(1).map(run).collect::<Vec<Outcome>>()
        },
        || {
            let bounce = bench::bounce_after_settling(scene);
            tell(Progress::Done);
            bounce
        },
    );

    let theory_factor = point_contact_factor(scene);
    let of = |trial: usize| factor(scene, &outcomes[trial]);
    let track_factor = of(steps[0]);
    let mut contributions = Vec::new();
    let mut before = track_factor;
    for &(cause, trial) in &switched {
        contributions.push(Contribution { cause, delta: before - of(trial) });
        before = of(trial);
    }
    contributions.push(Contribution { cause: "remainder", delta: before - theory_factor });

    let evidence = checks::Evidence {
        scene,
        spins: spins.map(|trial| &outcomes[trial]),
        arcs: arcs.map(|trial| &outcomes[trial]),
        steps: steps.map(|trial| &outcomes[trial]),
        mirror: [&outcomes[imaged], &outcomes[image]],
        straight: &outcomes[drive],
        even_straight: &outcomes[even_drive],
        points: &outcomes[switched[switched.len() - 1].1],
        bounce: &bounce,
    };
    let drive = outcomes[drive].as_ref();
    Ok(Certificate {
        robot: scene.robot.name.clone(),
        track_width: scene.robot.track_width(),
        effective_track: track_factor * scene.robot.track_width(),
        track_factor,
        theory_factor,
        contributions,
        rolling_radius: drive.map_or(f64::NAN, Steady::rolling_radius),
        rolling_radius_theory: drive.map_or(f64::NAN, Steady::rolling_radius_at_rest),
        drift: drive.map_or(f64::NAN, |steady| steady.turned / steady.distance),
        arcs: arcs.iter().zip(ARC_RADII).map(|(&trial, radius)| (radius * effective, of(trial))).collect(),
        spins: spins.iter().zip(SPIN_RATES).map(|(&trial, rate)| (spin(scene, rate).yaw_rate, of(trial))).collect(),
        steps: steps.iter().zip(STEP_DIVISORS).map(|(&trial, n)| (scene.time_step / f64::from(n), of(trial))).collect(),
        checks: checks::all(&evidence),
    })
}

fn with_step_over(scene: &Scene, divisor: u32) -> Scene {
    Scene { time_step: scene.time_step / f64::from(divisor), ..scene.clone() }
}

/// How the effective track moves with something: its value, b_eff/b.
pub type Curve = Vec<(f64, f64)>;

/// The effective track over turn radius, load offset and friction ratio.
#[derive(Debug, Clone)]
pub struct Sweeps {
    /// Name of the robot.
    pub robot: String,
    /// b \[m\].
    pub track_width: f64,
    /// What points under equal loads would have.
    pub theory_factor: f64,
    /// Over the radius of the turn, in effective tracks.
    pub turn_radius: Curve,
    /// Over how far the mass centre lies ahead of the middle of the wheels, in wheelbases; empty for one axle.
    pub load_offset: Curve,
    /// Over μ_y/μ_x.
    pub friction_ratio: Curve,
}

/// Simulates [`Sweeps`] side by side; a point that cannot be simulated is left out.
pub fn sweeps(scene: &Scene, tell: Tell<'_>) -> Sweeps {
    let scene = &scene.clone().noise_free();
    let effective = scene.robot.track_width() * point_contact_factor(scene);
    let over_radius = [0.0, 0.15, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0];
    let over_offset = [-0.25, -0.2, -0.15, -0.1, -0.05, 0.0, 0.05, 0.1, 0.15, 0.2, 0.25];
    let over_ratio = [0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.15, 1.3, 1.5, 1.75, 2.0];
    let curve = |values: &[f64], trial: &(dyn Fn(f64) -> (Scene, Motion) + Sync)| -> Curve {
        let run = |&value: &f64| {
            let (scene, motion) = trial(value);
            let factor = factor(&scene, &simulate(&scene, motion));
            tell(Progress::Done);
            factor.is_finite().then_some((value, factor))
        };
        values.par_iter().with_max_len(1).filter_map(run).collect()
    };
    let wheelbase = scene.robot.wheelbase();
    let can_lean = wheelbase > 0.0 && scene.robot.casters.is_empty();
    let offsets: &[f64] = if can_lean { &over_offset } else { &[] };
    tell(Progress::Ahead(over_radius.len() + offsets.len() + over_ratio.len()));
    Sweeps {
        robot: scene.robot.name.clone(),
        track_width: scene.robot.track_width(),
        theory_factor: point_contact_factor(scene),
        turn_radius: curve(&over_radius, &|radius| {
            let motion = if radius > 0.0 { arc(scene, radius * effective) } else { spin(scene, 1.0) };
            (scene.clone(), motion)
        }),
        load_offset: curve(offsets, &|offset| (edit::mass_centre_at(scene, offset * wheelbase), spin(scene, 1.0))),
        friction_ratio: curve(&over_ratio, &|ratio| (edit::friction_ratio(scene, ratio), spin(scene, 1.0))),
    }
}
