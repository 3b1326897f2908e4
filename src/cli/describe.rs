//! `treadmark describe`: a model file for a robot of one's own, to begin with.

use super::options::{odometry, positive};
use super::output;
use crate::odometry::OdometryParameters;
use crate::scene::{Description, Hints, Robot, describe};
use anyhow::Context;
use clap::Args;
use std::path::{Path, PathBuf};

/// Arguments of `treadmark describe`.
#[derive(Args)]
pub(super) struct Arguments {
    /// URDF of the robot, macros expanded
    urdf: PathBuf,
    /// New model file (default: beside the URDF, under its name)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Name of the robot (default: the model file's)
    #[arg(long)]
    name: Option<String>,
    /// Radius of wheels that the URDF draws as meshes [m]
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = positive)]
    wheel_radius: Option<f64>,
    /// Links of casters (default: those with caster or castor in their names)
    #[arg(long, value_name = "LINK", value_delimiter = ',')]
    caster: Vec<String>,
    /// What its controller believes: wheel radii and track [m], ticks a wheel revolution
    #[arg(long, value_name = "LEFT,RIGHT,TRACK[,TICKS]", value_parser = odometry)]
    odometry: Option<OdometryParameters>,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let urdf = &arguments.urdf;
    let out = arguments.out.clone().unwrap_or_else(|| urdf.with_extension("toml"));
    output::expect_new(Some(&out))?;
    let text = std::fs::read_to_string(urdf).with_context(|| format!("{}: cannot be read", urdf.display()))?;
    let hints =
        Hints { wheel_radius: arguments.wheel_radius, casters: arguments.caster.clone(), odometry: arguments.odometry };
    let stem = out.file_stem().map_or_else(|| "robot".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let name = arguments.name.clone().unwrap_or(stem);
    let described = describe(urdf, &text, &named(urdf, &out)?, &name, &hints)?;
    output::write(&out, &described.text)?;
    let robot = Robot::load(&out.to_string_lossy())?;
    let Description { wheels, casters, radius, track, mass, mut notes, .. } = described;
    // The model says more, as it is: how far its tyres squash.
    notes.extend(robot.notes.iter().filter(|note| !notes.contains(note)).cloned().collect::<Vec<_>>());
    for note in notes {
        tell!("note: {note}");
    }
    sayln!(
        "{} describes {}: {wheels} driven wheels of {radius} m, track {track:.4} m, {}{mass:.3} kg",
        out.display(),
        robot.name,
        match casters.len() {
            0 => String::new(),
            1 => format!("caster `{}`, ", casters[0]),
            _ => format!("casters `{}`, ", casters.join("`, `")),
        },
    )?;
    sayln!(
        "what the URDF does not say is marked ASSUMED there; `treadmark certify {}` holds it against closed forms",
        out.display()
    )?;
    Ok(())
}

/// How the model file names its URDF: by name where they lie together, else by its whole path.
fn named(urdf: &Path, out: &Path) -> anyhow::Result<String> {
    let folder = |file: &Path| std::path::absolute(file).map(|file| file.parent().map(Path::to_owned));
    let whole = std::path::absolute(urdf)?;
    let together = folder(urdf)? == folder(out)?;
    let name = whole.file_name().filter(|_| together).map_or(whole.as_os_str(), |name| name);
    Ok(name.to_string_lossy().into_owned())
}
