//! Track multipliers that makers ship or people measured, beside what the simulation and the closed form say of the same
//! dimensions; and what it would take to reach them.

use super::{Progress, Tell, edit, point_contact_factor, spin_factor};
use crate::scene::{Scene, SceneError};
use rayon::prelude::*;

/// A published track multiplier of a shipped robot. No robot is tuned to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Published {
    /// The shipped robot with these dimensions.
    pub robot: &'static str,
    /// b_eff/b as published; multipliers are rounded, and found on one floor.
    pub factor: f64,
    /// Whose figure it is.
    pub source: &'static str,
}

/// Published multipliers.
pub const LITERATURE: [Published; 7] = [
    Published { robot: "husky_a200", factor: 1.875, source: "shipped by the maker" },
    Published { robot: "leo", factor: 1.76, source: "shipped by the maker" },
    Published { robot: "rosbot", factor: 1.405, source: "shipped by the maker" },
    Published { robot: "panther", factor: 1.50, source: "shipped by the maker" },
    Published { robot: "pioneer_3at", factor: 1.49, source: "used in the field" },
    Published { robot: "pioneer_3at", factor: 1.44, source: "fitted to runs, highest" },
    Published { robot: "pioneer_3at", factor: 1.31, source: "fitted to runs, lowest" },
];

/// One robot and one published figure.
#[derive(Debug, Clone)]
pub struct LiteratureRow {
    /// What is published.
    pub published: Published,
    /// 1 + (l/b)².
    pub theory: f64,
    /// b_eff/b of the simulated robot in a spin on the spot; NaN where that could not be simulated.
    pub predicted: f64,
    /// Mass centre ahead of the middle of the wheels that would give the published factor, over the wheelbase \[–\].
    pub load_offset: Option<f64>,
    /// μ_y/μ_x that would, by the simulated patch, whose sliding traction points against the slip.
    pub friction_ratio: Option<f64>,
    /// μ_y/μ_x that would by the law of most dissipation, whose closed form is 1 + k²(l/b)²; the patch's own part is kept.
    pub friction_ratio_of_most_dissipation: Option<f64>,
    /// Width and length of every patch over those of the robot that would.
    pub patch_scale: Option<f64>,
    /// Width and length of a patch as the robot stands \[m\].
    pub patch: [f64; 2],
    /// b \[m\].
    pub track_width: f64,
}

/// Farthest that a search goes: offsets, up to where the light axle bears a tenth; ratios; patches, from points to as
/// large as a wheel leaves room for (see [`largest_patch`]).
const OFFSETS: [f64; 2] = [0.0, 0.4];
const RATIOS: [f64; 2] = [0.25, 4.0];
const SMALLEST_PATCH: f64 = 0.25;

/// Simulates every robot of [`LITERATURE`] and searches for what would give its published factor, in brackets, by simulation.
///
/// # Errors
/// A robot that cannot be loaded.
pub fn literature(tell: Tell<'_>) -> Result<Vec<LiteratureRow>, SceneError> {
    let scenes = LITERATURE
        .iter()
        .map(|published| Ok(Scene::load(published.robot, "lab_floor")?.noise_free()))
        .collect::<Result<Vec<Scene>, SceneError>>()?;
    tell(Progress::Ahead(4 * scenes.len()));
    let jobs: Vec<(usize, usize)> = (0..scenes.len()).flat_map(|row| (0..4).map(move |what| (row, what))).collect();
    let found: Vec<Option<f64>> = jobs
        .par_iter()
        .with_max_len(1)
        .map(|&(row, what)| {
            let (scene, target) = (&scenes[row], LITERATURE[row].factor);
            let wheelbase = scene.robot.wheelbase();
            let found = match what {
                0 => spin_factor(scene).ok(),
                1 => search(target, OFFSETS, |offset| edit::mass_centre_at(scene, offset * wheelbase)),
                2 => search(target, RATIOS, |ratio| edit::friction_ratio(scene, ratio)),
                _ => {
                    // The hard tyres of small patches ask for a short step.
                    let scene = Scene { time_step: SMALLEST_PATCH * scene.time_step, ..scene.clone() };
                    search(target, [SMALLEST_PATCH, largest_patch(&scene)], |scale| edit::patch_scaled(&scene, scale))
                }
            };
            tell(Progress::Done);
            found
        })
        .collect();
    Ok(scenes
        .iter()
        .zip(LITERATURE)
        .zip(found.chunks_exact(4))
        .map(|((scene, published), found)| row(scene, published, found))
        .collect())
}

fn row(scene: &Scene, published: Published, found: &[Option<f64>]) -> LiteratureRow {
    let tyre = &scene.robot.wheels[0].tyre;
    let theory = point_contact_factor(scene);
    let predicted = found[0].unwrap_or(f64::NAN);
    let squared = (published.factor - predicted + theory - 1.0) / (theory - 1.0);
    LiteratureRow {
        published,
        theory,
        predicted,
        friction_ratio_of_most_dissipation: (squared > 0.0).then(|| squared.sqrt()),
        load_offset: found[1],
        friction_ratio: found[2],
        patch_scale: found[3],
        patch: [tyre.width, 2.0 * tyre.contact_half_length(tyre.squash(edit::wheel_share(scene)))],
        track_width: scene.robot.track_width(),
    }
}

/// How much larger patches can be: as long as the wheel's radius, as wide as half the track, and less of the two.
fn largest_patch(scene: &Scene) -> f64 {
    let tyre = &scene.robot.wheels[0].tyre;
    let length = 2.0 * tyre.contact_half_length(tyre.squash(edit::wheel_share(scene)));
    (tyre.free_radius / length).min(0.5 * scene.robot.track_width() / tyre.width)
}

/// Where in `bracket` the simulated factor is `target`, to a tenth of the last digit of published ones; `None` where both
/// ends lie on the same side of it or cannot be simulated.
fn search(target: f64, [mut low, mut high]: [f64; 2], edited: impl Fn(f64) -> Scene) -> Option<f64> {
    const RESOLUTION: f64 = 5e-4;
    let miss = |value: f64| spin_factor(&edited(value)).ok().map(|factor| factor - target);
    let (mut at_low, at_high) = (miss(low)?, miss(high)?);
    if at_low * at_high > 0.0 {
        return None;
    }
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        let at_middle = miss(middle)?;
        if at_middle.abs() < RESOLUTION {
            return Some(middle);
        }
        if at_low * at_middle > 0.0 { (low, at_low) = (middle, at_middle) } else { high = middle }
    }
    Some(0.5 * (low + high))
}
