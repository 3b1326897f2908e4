//! Everything that is physically so: the robot, its tyres, drivetrain and encoders, the floor, the survey.
//!
//! A [`Scene`] is immutable and complete: the same scene, protocol and seed give the same bits. It holds plain data in
//! SI units and knows no engine; [`crate::world`] builds the running state from it.

mod describe;
mod empirical;
mod error;
mod floor;
mod inertia;
mod left_out;
mod misread;
mod residue;
mod robot;
mod shape;
mod shipped;
mod standing;
mod stated;
mod survey;
mod tyre;
mod urdf;
mod whole;

pub use describe::{Description, Hints, describe};
pub use empirical::{EmpiricalTerm, Feature, Motion, TermPart};
pub use error::SceneError;
pub use floor::{Floor, GripRegion, Obstacle, Plane, RegionShape, SpottedFloor};
pub use residue::{NoiseModel, Residue};
pub use robot::{Caster, Doubt, DriverSettings, Drivetrain, Encoder, Robot, Side, Swivel, Wheel};
pub use shape::{Body, PlacedShape, Placement, Shape};
pub use shipped::{ROBOTS, WORLDS};
pub use survey::{Scatter, Survey};
pub use tyre::Tyre;
pub use whole::RoundWheel;

use serde::{Deserialize, Serialize};

/// Standard gravity \[m/s²\] (CGPM 1901).
pub const GRAVITY: f64 = 9.80665;

/// A complete physical situation.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The robot, as built.
    pub robot: Robot,
    /// What it drives on.
    pub floor: Floor,
    /// How poses are measured.
    pub survey: Survey,
    /// What differs from run to run.
    pub scatter: Scatter,
    /// How a wheel meets the ground.
    pub contact: Contact,
    /// A cable that pulls at the robot, where there is one.
    pub tether: Option<Tether>,
    /// Motion that no physical part of the scene explains, as a diagnosis found it.
    pub empirical: Vec<EmpiricalTerm>,
    /// Length of a simulation step \[s\].
    pub time_step: f64,
}

/// A cable from the middle of the robot's base to a fixed point, under a steady pull.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tether {
    /// Where it is fixed in the room \[m\].
    pub anchor: [f64; 3],
    /// \[N\]
    pub pull: f64,
}

/// How a wheel meets the ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Contact {
    /// A patch of bristles under parabolic pressure: the rubber tyre.
    #[default]
    Patch,
    /// The physics engine's own rigid cylinder with Coulomb friction, for comparison.
    Rigid,
}

/// Default length of a simulation step \[s\]: halving it moves no 4 m end pose by more than 0.1 mm and 0.1 mrad (test
/// `analytic::halving_the_step`).
pub const DEFAULT_TIME_STEP: f64 = 2.5e-3;

impl Contact {
    /// The other law.
    pub fn other(self) -> Contact {
        match self {
            Contact::Patch => Contact::Rigid,
            Contact::Rigid => Contact::Patch,
        }
    }
}

impl Scene {
    /// Reads a robot and a world, each a file or the name of a shipped one, under the default survey and scatter.
    ///
    /// # Errors
    /// What is wrong with which file, where, and what is allowed.
    pub fn load(robot: &str, world: &str) -> Result<Scene, SceneError> {
        Ok(Scene {
            robot: Robot::load(robot)?,
            floor: Floor::load(world)?,
            survey: Survey::default(),
            scatter: Scatter::default(),
            contact: Contact::default(),
            tether: None,
            empirical: Vec::new(),
            time_step: DEFAULT_TIME_STEP,
        })
    }

    /// The same scene without survey noise and without the scatter of real runs: what is left is systematic.
    pub fn noise_free(self) -> Scene {
        Scene { survey: self.survey.noise_free(), scatter: Scatter::NONE, ..self }
    }
}
