//! Options that several commands share.

use crate::calibrate::{METHODS, Method};
use crate::effect::{Cause, load_scene};
use crate::odometry::OdometryParameters;
use crate::scene::{Contact, DEFAULT_TIME_STEP, ROBOTS, Scatter, Scene, WORLDS};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// What to simulate, and where results go.
#[derive(Args)]
pub(super) struct SceneOptions {
    /// Robot model file, or the name of a shipped robot: jnpf_4wd, husky_a200, optiodom, leo, rosbot, panther, pioneer_3at
    #[arg(long, value_name = "FILE|NAME", default_value = ROBOTS.names()[0])]
    pub robot: String,
    /// World file, or the name of a shipped world: lab_floor, tilted_floor, slippery_patch, sill
    #[arg(long, value_name = "FILE|NAME", default_value = WORLDS.names()[0])]
    pub world: String,
    /// Put an effect into the scene, as listed by `treadmark effects`; may be given several times
    #[arg(long = "set", value_name = "EFFECT.PARAMETER=VALUE")]
    pub settings: Vec<String>,
    /// How wheels meet the ground: rubber tyres on contact patches, or the engine's own rigid cylinders, for comparison
    /// (default: as the robot's model says, patches unless it says otherwise)
    #[arg(long, value_enum)]
    pub tyre: Option<Tyre>,
    /// Seed of all noise; the same seed gives the same bits
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Survey poses without noise (default: 2 mm and 3 mrad a reading)
    #[arg(long)]
    pub no_survey_noise: bool,
    /// Leave out the scatter that an uneven floor makes from run to run
    #[arg(long)]
    pub no_scatter: bool,
    /// Simulation step [s]
    #[arg(long, value_name = "SECONDS", default_value_t = DEFAULT_TIME_STEP, allow_negative_numbers = true, value_parser = positive)]
    pub time_step: f64,
    /// Worker threads (default: one a core); results do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// New folder for results (default: a new numbered one under recordings/)
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write no recording
    #[arg(long)]
    pub no_recording: bool,
    /// Print JSON on stdout, and nothing else there
    #[arg(long)]
    pub json: bool,
}

/// `--tyre`.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Tyre {
    Patch,
    Rigid,
}

impl From<Tyre> for Contact {
    fn from(tyre: Tyre) -> Contact {
        match tyre {
            Tyre::Patch => Contact::Patch,
            Tyre::Rigid => Contact::Rigid,
        }
    }
}

impl SceneOptions {
    /// The scene that the options describe; notes on what loading it left out go to stderr.
    pub(super) fn scene(&self) -> anyhow::Result<Scene> {
        let mut scene = load_scene(&self.robot, &self.world)?;
        for note in &scene.robot.notes {
            tell!("note: {note}");
        }
        scene.contact = self.tyre.map_or(scene.contact, Contact::from);
        let mut scene = Cause::edit_all(&Cause::from_settings(&self.settings, &scene)?, &scene);
        if self.no_survey_noise {
            scene.survey = scene.survey.noise_free();
        }
        if self.no_scatter {
            scene.scatter = Scatter::NONE;
        }
        scene.time_step = self.time_step;
        Ok(scene)
    }
}

/// Sets the number of rayon's threads, where one is asked for.
pub(super) fn set_threads(threads: Option<u16>) -> anyhow::Result<()> {
    if let Some(threads) = threads {
        rayon::ThreadPoolBuilder::new().num_threads(usize::from(threads)).build_global()?;
    }
    Ok(())
}

/// A finite number above 0.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("it must be a finite number above 0".to_owned()),
    }
}

/// A finite number, 0 or above.
pub(super) fn non_negative(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value >= 0.0 => Ok(value),
        _ => Err("it must be a finite number, 0 or above".to_owned()),
    }
}

/// Methods by name; `all` is every one.
pub(super) fn methods(names: &[String]) -> anyhow::Result<Vec<&'static Method>> {
    if names.iter().any(|name| name == "all") {
        return Ok(METHODS.iter().collect());
    }
    let find = |name: &String| {
        Method::named(name).ok_or_else(|| {
            let known: Vec<&str> = METHODS.iter().map(|method| method.name).collect();
            anyhow::anyhow!("--method {name}: no such method; there are: all, {}", known.join(", "))
        })
    };
    names.iter().map(find).collect()
}

/// `left,right,track[,ticks]`, all above 0.
pub(super) fn odometry(text: &str) -> Result<OdometryParameters, String> {
    let numbers = text.split(',').map(|part| positive(part.trim())).collect::<Result<Vec<f64>, String>>();
    let numbers = numbers.map_err(|why| format!("{why}, each of LEFT,RIGHT,TRACK[,TICKS]"))?;
    let (left_wheel_radius, right_wheel_radius, track_width, ticks_per_revolution) = match numbers[..] {
        [left, right, track] => (left, right, track, None),
        [left, right, track, ticks] => (left, right, track, Some(ticks)),
        _ => return Err(format!("{} numbers; it must be three or four: LEFT,RIGHT,TRACK[,TICKS]", numbers.len())),
    };
    Ok(OdometryParameters { left_wheel_radius, right_wheel_radius, track_width, ticks_per_revolution })
}
