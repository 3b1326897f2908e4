//! `treadmark drive`: one run.

use super::options::{SceneOptions, positive};
use super::output;
use super::watch::stop_on_ctrl_c;
use crate::dataset::{Dataset, Protocol, Rotation, Travel};
use crate::drive::{self, SimulatedRun, Task};
use crate::experiment::campaign;
use crate::report::{json::DriveJson, text};
use crate::scene::Scene;
#[cfg(feature = "recording")]
use anyhow::Context;
use clap::{Args, ValueEnum};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Arguments of `treadmark drive`.
#[derive(Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    scene: SceneOptions,
    /// What to drive
    #[arg(long, value_enum, default_value_t = Shape::Square)]
    protocol: Shape,
    /// Side of the square or length of the straight [m]
    #[arg(long, value_name = "METRES", default_value_t = 4.0, allow_negative_numbers = true, value_parser = positive)]
    side: f64,
    /// Radius of the circle [m]
    #[arg(long, value_name = "METRES", default_value_t = 1.0, allow_negative_numbers = true, value_parser = positive)]
    radius: f64,
    /// Total turn of the spin or circle [rad] (default: one turn)
    #[arg(long, value_name = "RADIANS", default_value_t = std::f64::consts::TAU, allow_negative_numbers = true, value_parser = positive)]
    turn: f64,
    /// cw or ccw for a square, spin or circle; forward or reverse for a straight
    #[arg(long, value_enum)]
    direction: Option<Direction>,
    /// Cruising speed [m/s] (default: the robot's)
    #[arg(long, value_name = "M_S", allow_negative_numbers = true, value_parser = positive)]
    speed: Option<f64>,
    /// Turn rate on the spot [rad/s] (default: the robot's)
    #[arg(long, value_name = "RAD_S", allow_negative_numbers = true, value_parser = positive)]
    turn_rate: Option<f64>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Shape {
    Square,
    Straight,
    Spin,
    Circle,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum Direction {
    Cw,
    Ccw,
    Forward,
    Reverse,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let protocol = arguments.protocol()?;
    let scene = arguments.scene.scene()?;
    let folder = output::folder(arguments.scene.out.as_deref(), "drive")?;
    let stop = stop_on_ctrl_c();
    let name = match protocol.direction() {
        Some(direction) => format!("{}-{direction}", protocol.kind()),
        None => protocol.kind().to_owned(),
    };
    let task = Task {
        name,
        protocol,
        speed: arguments.speed,
        turn_rate: arguments.turn_rate,
        started: None,
        ..Task::new("", protocol)
    };
    let (result, recorded) = drive_recorded(arguments, &folder, &scene, &task, stop)?;
    Dataset { campaign: campaign(&scene, &task.name), runs: vec![result.measured.clone()] }.write(&folder)?;

    if arguments.scene.json {
        sayln!("{}", serde_json::to_string_pretty(&DriveJson::from(&result))?)?;
    } else {
        say!("{}", text::drive(&result, text::Style::Terminal))?;
        sayln!("{}", output::where_to_look(&folder))?;
    }
    recorded
}

/// Drives the task, watched by a recorder; beside the run, whether it could be recorded to its end.
#[cfg(feature = "recording")]
fn drive_recorded(
    arguments: &Arguments,
    folder: &Path,
    scene: &Scene,
    task: &Task,
    stop: &AtomicBool,
) -> anyhow::Result<(SimulatedRun, anyhow::Result<()>)> {
    let seed = arguments.scene.seed;
    if arguments.scene.no_recording {
        return Ok((drive::run(scene, task, seed, None, stop)?, Ok(())));
    }
    let (recording, mut recorder) = super::record::drive(&folder.join(output::RECORDING), scene, &task.protocol)?;
    let result = drive::run(scene, task, seed, Some(recorder.as_mut()), stop);
    drop(recorder);
    if let Ok(run) = &result {
        recording.result(&text::drive(run, text::Style::Markdown));
    }
    let finished = recording.finish();
    let result = result.with_context(|| format!("{} is kept as far as it got", folder.display()))?;
    Ok((result, finished.map_err(Into::into)))
}

/// Drives the task; this build records nothing.
#[cfg(not(feature = "recording"))]
fn drive_recorded(
    arguments: &Arguments,
    _: &Path,
    scene: &Scene,
    task: &Task,
    stop: &AtomicBool,
) -> anyhow::Result<(SimulatedRun, anyhow::Result<()>)> {
    output::note_missing_recording(arguments.scene.no_recording);
    Ok((drive::run(scene, task, arguments.scene.seed, None, stop)?, Ok(())))
}

impl Arguments {
    fn protocol(&self) -> anyhow::Result<Protocol> {
        let round = || match self.direction {
            None | Some(Direction::Ccw) => Ok(Rotation::CounterClockwise),
            Some(Direction::Cw) => Ok(Rotation::Clockwise),
            Some(other) => anyhow::bail!("--direction {}: a square, spin or circle is driven cw or ccw", word(other)),
        };
        Ok(match self.protocol {
            Shape::Square => Protocol::Square { side: self.side, direction: round()? },
            Shape::Spin => Protocol::Spin { turn: self.turn, direction: round()? },
            Shape::Circle => Protocol::Circle { radius: self.radius, turn: Some(self.turn), direction: round()? },
            Shape::Straight => {
                let direction = match self.direction {
                    None | Some(Direction::Forward) => Travel::Forward,
                    Some(Direction::Reverse) => Travel::Reverse,
                    Some(other) => {
                        anyhow::bail!("--direction {}: a straight is driven forward or reverse", word(other))
                    }
                };
                Protocol::Straight { length: self.side, direction }
            }
        })
    }
}

fn word(direction: Direction) -> String {
    format!("{direction:?}").to_lowercase()
}
