//! The robot: a URDF, and a model file with what a URDF cannot say.
//!
//! The base frame is the URDF's root link: x forward, y left, z up. Wheel rotation is positive forward whatever the
//! sign of the joint's axis.

use super::GRAVITY;
use super::error::SceneError;
use super::residue::Residue;
use super::shape::{Body, PlacedShape, Placement};
use super::tyre::Tyre;
use super::{inertia, shipped, standing, urdf};
use crate::odometry::OdometryParameters;
use crate::strict::{non_negative, optional_non_negative, optional_positive, positive, share};
use nalgebra::{Point3, UnitVector3, Vector3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Which side of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// y > 0.
    Left,
    /// y < 0.
    Right,
}

/// A robot, as built.
#[derive(Debug, Clone)]
pub struct Robot {
    /// Name in the model file.
    pub name: String,
    /// The model file, or the name of the shipped robot.
    pub file: PathBuf,
    /// Everything that is not a driven wheel; its frame is the base frame.
    pub chassis: Body,
    /// The driven wheels, in model-file order (by name).
    pub wheels: Vec<Wheel>,
    /// Unpowered supports.
    pub casters: Vec<Caster>,
    /// The same for every wheel.
    pub drivetrain: Drivetrain,
    /// The same for every wheel.
    pub encoder: Encoder,
    /// Relative growth of every tyre's radius an hour of the campaign \[1/h\]; tyres that cool or deflate shrink.
    pub tyre_growth: f64,
    /// What the on-board odometry believes.
    pub odometry: OdometryParameters,
    /// How the driver drives.
    pub driver: DriverSettings,
    /// How far the robot is known to differ from this model.
    pub doubt: Doubt,
    /// What the campaigns that it was fitted to left, one a condition.
    pub residues: Vec<Residue>,
    /// What loading it left out, in plain words: joints held fixed, meshes ignored.
    pub notes: Vec<String>,
}

/// How far a robot is known to differ from its model. Nothing is simulated by it; a diagnosis takes it into account.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Doubt {
    /// Of its motion, relative to each part of a way: no cause is blamed for so much.
    #[serde(deserialize_with = "share")]
    pub motion: f64,
    /// The same of what is made good again by a run's end: play, wind-up and delay that are not quite the model's.
    #[serde(deserialize_with = "share")]
    pub transient: f64,
    /// Of what causes do to its motion, relative.
    #[serde(deserialize_with = "share")]
    pub response: f64,
    /// 1 σ of what a calibration finds, relative: mean diameter, right over left diameter, effective track.
    #[serde(deserialize_with = "share")]
    pub diameter_scale: f64,
    /// See `diameter_scale`.
    #[serde(deserialize_with = "share")]
    pub diameter_ratio: f64,
    /// See `diameter_scale`.
    #[serde(deserialize_with = "share")]
    pub effective_track: f64,
    /// 1 σ of the logarithm of what tyres are taken for: how far the same rubber differs from floor to floor.
    #[serde(deserialize_with = "share")]
    pub friction: f64,
    /// The same of vertical and slip stiffness: how far carcasses and treads differ from one another.
    #[serde(deserialize_with = "share")]
    pub stiffness: f64,
}

impl Doubt {
    /// What is usual of a tyre that nobody has measured: an assumption, and what worlds of `challenge --mismatch` are drawn with.
    const USUAL_FRICTION: f64 = 0.15;
    const USUAL_STIFFNESS: f64 = 0.3;

    /// With tyres as unknown as is usual, where nothing is said of them.
    pub fn of_usual_tyres(self) -> Doubt {
        let or = |stated: f64, usual: f64| if stated > 0.0 { stated } else { usual };
        Doubt {
            friction: or(self.friction, Doubt::USUAL_FRICTION),
            stiffness: or(self.stiffness, Doubt::USUAL_STIFFNESS),
            ..self
        }
    }

    /// The greater of each.
    pub fn widest(self, other: Doubt) -> Doubt {
        Doubt {
            motion: self.motion.max(other.motion),
            transient: self.transient.max(other.transient),
            response: self.response.max(other.response),
            diameter_scale: self.diameter_scale.max(other.diameter_scale),
            diameter_ratio: self.diameter_ratio.max(other.diameter_ratio),
            effective_track: self.effective_track.max(other.effective_track),
            friction: self.friction.max(other.friction),
            stiffness: self.stiffness.max(other.stiffness),
        }
    }
}

/// A driven wheel.
#[derive(Debug, Clone)]
pub struct Wheel {
    /// Name in the model file: `front_left`, …
    pub name: String,
    /// Side whose speed it follows.
    pub side: Side,
    /// Rim, tyre and hub.
    pub body: Body,
    /// Where the wheel body stands in the chassis at rotation 0.
    pub base_from_wheel: Placement,
    /// The axle in the wheel frame, pointing to the robot's left, so that positive rotation rolls forward.
    pub axle: UnitVector3<f64>,
    /// The tyre.
    pub tyre: Tyre,
    /// Share of its encoder's counts that get lost while it turns \[–\].
    pub count_loss: f64,
    /// Relative amplitude of its radius over a turn, and the rotation at which it is greatest \[–, rad\].
    pub out_of_round: [f64; 2],
}

impl Wheel {
    /// The axle in the base frame, pointing left.
    pub fn axle_in_base(&self) -> UnitVector3<f64> {
        self.base_from_wheel.rotation * self.axle
    }

    /// Moment of inertia about the axle \[kg m²\], rotor not included.
    pub fn spin_inertia(&self) -> f64 {
        self.axle.dot(&(self.body.inertia * self.axle.into_inner()))
    }
}

/// An unpowered support: a ball, a point that presses on the floor and drags; or a wheel that trails behind a pivot.
#[derive(Debug, Clone)]
pub struct Caster {
    /// Its link.
    pub link: String,
    /// Centre of its ball in the base frame; of its wheel, where it trails straight behind.
    pub centre: Point3<f64>,
    /// What makes it a wheel that swivels; `None`: a ball.
    pub swivel: Option<Swivel>,
    /// \[m\]
    pub radius: f64,
    /// \[N/m\]
    pub vertical_stiffness: f64,
    /// \[N s/m\]
    pub vertical_damping: f64,
    /// Drag force over load \[–\].
    pub drag_coefficient: f64,
}

/// A fork that turns about a vertical axis and holds a wheel behind it.
#[derive(Debug, Clone)]
pub struct Swivel {
    /// From the axis back to the wheel's centre \[m\].
    pub trail: f64,
    /// What turns with it, from the axis at the height of the wheel's centre, x ahead.
    pub visuals: Vec<PlacedShape>,
}

impl Caster {
    /// The point on its axis at the height of its wheel's centre, in the base frame; a ball's centre.
    pub fn pivot(&self) -> Point3<f64> {
        let trail = self.swivel.as_ref().map_or(0.0, |swivel| swivel.trail);
        self.centre + Vector3::x() * trail
    }
}

/// Motor, gear and speed loop of one wheel; torques and speeds at the wheel unless said otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drivetrain {
    /// Motor turns a wheel turn \[–\].
    #[serde(deserialize_with = "positive")]
    pub gear_ratio: f64,
    /// Of the motor \[N m\].
    #[serde(rename = "motor_stall_torque_nm", deserialize_with = "positive")]
    pub motor_stall_torque: f64,
    /// Of the motor \[rad/s\]: at full voltage, torque falls on a line from stall to nothing here.
    #[serde(rename = "motor_no_load_speed_rad_s", deserialize_with = "positive")]
    pub motor_no_load_speed: f64,
    /// Of the motor \[kg m²\]; the wheel feels gear_ratio² of it.
    #[serde(rename = "rotor_inertia_kg_m2", deserialize_with = "non_negative")]
    pub rotor_inertia: f64,
    /// Dry friction at the wheel \[N m\].
    #[serde(rename = "dry_friction_nm", deserialize_with = "non_negative")]
    pub dry_friction: f64,
    /// Viscous friction at the wheel \[N m s\].
    #[serde(rename = "viscous_friction_nm_s", deserialize_with = "non_negative")]
    pub viscous_friction: f64,
    /// P of the speed loop, in stall torque of the voltage that it adds \[N m s\].
    #[serde(rename = "proportional_gain_nm_s", deserialize_with = "positive")]
    pub proportional_gain: f64,
    /// I of the speed loop, likewise \[N m/rad\].
    #[serde(rename = "integral_gain_nm", deserialize_with = "non_negative")]
    pub integral_gain: f64,
    /// Rate of the speed loop \[Hz\].
    #[serde(rename = "loop_rate_hz", deserialize_with = "positive")]
    pub loop_rate: f64,
    /// The measured speed is the count difference over this time \[s\].
    #[serde(rename = "speed_window_s", deserialize_with = "positive")]
    pub speed_window: f64,
    /// Play between encoder and wheel, taken up on every reversal, at the wheel \[rad\].
    #[serde(rename = "backlash_rad", default, deserialize_with = "non_negative")]
    pub backlash: f64,
    /// How far wheels coast on after a stop while the controller does not count \[rad\].
    #[serde(rename = "stop_overrun_rad", default, deserialize_with = "non_negative")]
    pub stop_overrun: f64,
    /// How far the side that is counted leads the tread for each newton metre between them \[rad/(N m)\]: shafts and belts
    /// wind up, and a soft tyre's carcass between rim and tread. A file that does not state it, be it as 0, says that this
    /// robot's do not.
    #[serde(rename = "wind_up_rad_nm", default, deserialize_with = "optional_non_negative")]
    pub wind_up: Option<f64>,
}

/// A wheel encoder.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Encoder {
    /// Of the wheel; a real number, as gears make it.
    #[serde(deserialize_with = "positive")]
    pub ticks_per_revolution: f64,
    /// How often it is read \[Hz\].
    #[serde(rename = "rate_hz", deserialize_with = "positive")]
    pub rate: f64,
    /// Age of a count when the controller gets it \[s\]; logged stamps are not late.
    #[serde(rename = "latency_s", deserialize_with = "non_negative")]
    pub latency: f64,
}

/// How the driver drives.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriverSettings {
    /// \[m/s\]
    #[serde(rename = "cruise_speed_m_s", deserialize_with = "positive")]
    pub cruise_speed: f64,
    /// \[m/s²\]
    #[serde(rename = "acceleration_m_s2", deserialize_with = "positive")]
    pub acceleration: f64,
    /// On the spot \[rad/s\].
    #[serde(rename = "turn_rate_rad_s", deserialize_with = "positive")]
    pub turn_rate: f64,
    /// On the spot \[rad/s²\].
    #[serde(rename = "turn_acceleration_rad_s2", deserialize_with = "positive")]
    pub turn_acceleration: f64,
    /// Yaw rate asked for a radian of heading error \[1/s\].
    #[serde(rename = "heading_gain_1_s", deserialize_with = "positive")]
    pub heading_gain: f64,
    /// Speed asked for a metre of distance still behind the plan \[1/s\].
    #[serde(rename = "distance_gain_1_s", deserialize_with = "positive")]
    pub distance_gain: f64,
    /// Yaw rate asked for a metre off the line, over the speed \[rad/m²\].
    #[serde(rename = "line_gain_rad_m2", deserialize_with = "non_negative")]
    pub line_gain: f64,
    /// Standstill at each corner \[s\].
    #[serde(rename = "pause_s", deserialize_with = "non_negative")]
    pub pause: f64,
    /// How often the driver decides \[Hz\].
    #[serde(rename = "rate_hz", deserialize_with = "positive")]
    pub rate: f64,
}

impl Drivetrain {
    /// Rotor inertia as the wheel feels it \[kg m²\].
    pub fn reflected_inertia(&self) -> f64 {
        self.gear_ratio * self.gear_ratio * self.rotor_inertia
    }

    /// Torque at the wheel at standstill under full voltage \[N m\].
    pub fn stall_torque(&self) -> f64 {
        self.motor_stall_torque * self.gear_ratio
    }

    /// Speed of the unloaded wheel under full voltage \[rad/s\].
    pub fn no_load_speed(&self) -> f64 {
        self.motor_no_load_speed / self.gear_ratio
    }

    /// Torque at the wheel \[N m\] at `voltage` (−1 to 1 of the full one) and wheel speed `speed` \[rad/s\]: the line of a
    /// permanent-magnet motor, stall · (voltage − speed/no-load speed).
    pub fn motor_torque(&self, voltage: f64, speed: f64) -> f64 {
        self.stall_torque() * (voltage - speed / self.no_load_speed())
    }
}

impl Robot {
    /// Reads a model file and the URDF that it names; `given` is a path or the name of a shipped robot.
    ///
    /// # Errors
    /// What is wrong with which file, where, and what is allowed.
    pub fn load(given: &str) -> Result<Robot, SceneError> {
        let source = shipped::ROBOTS.find("robot", given)?;
        let model: ModelFile = source.parse()?;
        let urdf_source = source.sibling(&model.urdf)?;
        let wheels: Vec<(String, urdf::WheelJoint)> = model
            .wheels
            .iter()
            .map(|(name, wheel)| (name.clone(), urdf::WheelJoint { joint: wheel.joint.clone(), side: wheel.side }))
            .collect();
        let tree = urdf::Tree::parse(&urdf_source.file, &urdf_source.text)?;
        let named = |caster: &CasterTable| (caster.link.clone(), caster.swivel.clone());
        let casters: Vec<(String, Option<String>)> = model.casters.iter().map(named).collect();
        let assembly = tree.assemble(&source.file, &wheels, &casters)?;
        let lowest = |(wheel, mounted): (&WheelTable, &urdf::MountedWheel)| {
            mounted.base_from_wheel.translation.z - wheel.free_radius
        };
        let ground = model.wheels.values().zip(&assembly.wheels).map(lowest).fold(f64::INFINITY, f64::min);
        assembly.check_clear(&urdf_source.file, ground)?;
        let load = assembly.mass() * GRAVITY / (wheels.len() + casters.len()) as f64;
        let rubs = assembly.rubs(ground, load / model.tyre.vertical_stiffness);

        for (side, word) in [(Side::Left, "left"), (Side::Right, "right")] {
            if !model.wheels.values().any(|wheel| wheel.side == side) {
                return Err(SceneError::NoWheel { model: source.file, side: word });
            }
        }
        let tyre = model.tyre;
        let wheels = model
            .wheels
            .into_iter()
            .zip(assembly.wheels)
            .map(|((name, wheel), mounted)| Wheel {
                name,
                side: wheel.side,
                body: mounted.body,
                base_from_wheel: mounted.base_from_wheel,
                axle: mounted.axle,
                tyre: Tyre {
                    free_radius: wheel.free_radius,
                    width: wheel.width.unwrap_or(tyre.width),
                    vertical_stiffness: wheel.vertical_stiffness.unwrap_or(tyre.vertical_stiffness),
                    vertical_damping: wheel.vertical_damping.unwrap_or(tyre.vertical_damping),
                    slip_stiffness: wheel.slip_stiffness.unwrap_or(tyre.slip_stiffness),
                    friction_along: wheel.friction_along.unwrap_or(tyre.friction_along),
                    friction_across: wheel.friction_across.unwrap_or(tyre.friction_across),
                },
                count_loss: 0.0,
                out_of_round: [0.0; 2],
            })
            .collect();
        let casters = model
            .casters
            .into_iter()
            .zip(assembly.casters)
            .map(|(caster, mounted)| Caster {
                link: caster.link,
                centre: mounted.centre,
                swivel: mounted.swivel,
                radius: caster.radius,
                vertical_stiffness: caster.vertical_stiffness,
                vertical_damping: caster.vertical_damping,
                drag_coefficient: caster.drag_coefficient,
            })
            .collect();
        let mut robot = Robot {
            name: model.name,
            file: source.file,
            chassis: assembly.chassis,
            wheels,
            casters,
            drivetrain: model.drivetrain,
            encoder: model.encoder,
            tyre_growth: 0.0,
            odometry: OdometryParameters {
                left_wheel_radius: model.odometry.left_wheel_radius,
                right_wheel_radius: model.odometry.right_wheel_radius,
                track_width: model.odometry.track_width,
                ticks_per_revolution: Some(model.odometry.ticks_per_revolution),
            },
            driver: model.driver,
            doubt: model.doubt,
            residues: Vec::new(),
            notes: assembly.notes,
        };
        let stands = standing::notes(&robot);
        let unbelievable = inertia::notes(&robot);
        robot.notes.extend(rubs.into_iter().chain(stands).chain(unbelievable));
        Ok(robot)
    }

    /// Whole mass \[kg\].
    pub fn mass(&self) -> f64 {
        self.chassis.mass + self.wheels.iter().map(|wheel| wheel.body.mass).sum::<f64>()
    }

    /// b, lateral distance between the mean left and the mean right contact centre \[m\].
    pub fn track_width(&self) -> f64 {
        let mean = |side| {
            let (sum, n) = self
                .wheels
                .iter()
                .filter(|wheel| wheel.side == side)
                .fold((0.0, 0.0), |(sum, n), wheel| (sum + wheel.base_from_wheel.translation.y, n + 1.0));
            sum / n
        };
        mean(Side::Left) - mean(Side::Right)
    }

    /// The robot at `time` \[s\] since the campaign began: its tyres have grown or shrunk until then.
    pub fn at(mut self, time: f64) -> Robot {
        for wheel in &mut self.wheels {
            wheel.tyre.free_radius *= 1.0 + self.tyre_growth * time / 3600.0;
        }
        self
    }

    /// l, from the rearmost to the foremost axle \[m\]; 0 for two wheels.
    pub fn wheelbase(&self) -> f64 {
        let x = |wheel: &Wheel| wheel.base_from_wheel.translation.x;
        let front = self.wheels.iter().map(x).fold(f64::NEG_INFINITY, f64::max);
        let rear = self.wheels.iter().map(x).fold(f64::INFINITY, f64::min);
        front - rear
    }
}

// ── the model file ──

#[derive(Deserialize)]
enum Format {
    #[serde(rename = "treadmark-robot/1")]
    V1,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ModelFile {
    #[serde(rename = "format")]
    _format: Format,
    name: String,
    #[serde(rename = "description", default)]
    _description: String,
    urdf: String,
    tyre: TyreTable,
    wheels: BTreeMap<String, WheelTable>,
    #[serde(default)]
    casters: Vec<CasterTable>,
    drivetrain: Drivetrain,
    encoder: Encoder,
    odometry: OdometryTable,
    driver: DriverSettings,
    #[serde(default)]
    doubt: Doubt,
}

/// What every tyre is like; a wheel's table may say otherwise.
#[derive(Deserialize, Clone, Copy)]
#[serde(deny_unknown_fields)]
struct TyreTable {
    #[serde(rename = "width_m", deserialize_with = "positive")]
    width: f64,
    #[serde(rename = "vertical_stiffness_n_m", deserialize_with = "positive")]
    vertical_stiffness: f64,
    #[serde(rename = "vertical_damping_n_s_m", deserialize_with = "non_negative")]
    vertical_damping: f64,
    #[serde(deserialize_with = "positive")]
    slip_stiffness: f64,
    #[serde(deserialize_with = "positive")]
    friction_along: f64,
    #[serde(deserialize_with = "positive")]
    friction_across: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WheelTable {
    joint: String,
    side: Side,
    #[serde(rename = "free_radius_m", deserialize_with = "positive")]
    free_radius: f64,
    #[serde(rename = "width_m", default, deserialize_with = "optional_positive")]
    width: Option<f64>,
    #[serde(rename = "vertical_stiffness_n_m", default, deserialize_with = "optional_positive")]
    vertical_stiffness: Option<f64>,
    #[serde(rename = "vertical_damping_n_s_m", default, deserialize_with = "optional_non_negative")]
    vertical_damping: Option<f64>,
    #[serde(default, deserialize_with = "optional_positive")]
    slip_stiffness: Option<f64>,
    #[serde(default, deserialize_with = "optional_positive")]
    friction_along: Option<f64>,
    #[serde(default, deserialize_with = "optional_positive")]
    friction_across: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CasterTable {
    link: String,
    swivel: Option<String>,
    #[serde(rename = "radius_m", deserialize_with = "positive")]
    radius: f64,
    #[serde(rename = "vertical_stiffness_n_m", deserialize_with = "positive")]
    vertical_stiffness: f64,
    #[serde(rename = "vertical_damping_n_s_m", deserialize_with = "non_negative")]
    vertical_damping: f64,
    #[serde(deserialize_with = "non_negative")]
    drag_coefficient: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OdometryTable {
    #[serde(rename = "left_wheel_radius_m", deserialize_with = "positive")]
    left_wheel_radius: f64,
    #[serde(rename = "right_wheel_radius_m", deserialize_with = "positive")]
    right_wheel_radius: f64,
    #[serde(rename = "track_width_m", deserialize_with = "positive")]
    track_width: f64,
    #[serde(deserialize_with = "positive")]
    ticks_per_revolution: f64,
}
