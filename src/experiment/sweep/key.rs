//! What a plan can set and vary: every number of a scene by the name that model files give it, effects, and what is
//! done at a point.

use crate::calibrate::METHODS;
use crate::effect::{EFFECTS, Effect};
use crate::scene::{Caster, Scene, Tyre};
use serde::Deserialize;
use serde::de::{Deserializer, Error};
use std::fmt;

/// What is allowed of a value.
#[derive(Debug, Clone, PartialEq)]
pub enum Allowed {
    /// A finite number.
    Finite,
    /// A finite number above 0.
    Positive,
    /// A finite number, 0 or above.
    NonNegative,
    /// A number from the first to the second.
    Between(f64, f64),
    /// A whole number from the first to the second.
    Whole(u32, u32),
    /// One of these words.
    OneOf(Vec<&'static str>),
    /// Any text: what it names is looked up when the plan is prepared.
    Text,
}

/// A value that a plan gives.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged, expecting = "it must be a number or a text")]
pub enum Value {
    /// A number, in the unit that its key ends in.
    Number(f64),
    /// A word.
    Text(String),
}

/// A key that a plan can set and vary: `tyre.friction_across`, `floor_slope.gradient`, `protocol.side_m`, …
#[derive(Debug, Clone)]
pub struct Key {
    name: String,
    pub(super) target: Target,
}

/// What a key is about.
#[derive(Debug, Clone, Copy)]
pub(super) enum Target {
    /// A number of the scene.
    Scene(&'static Number),
    /// A number of one wheel's tyre: `wheels.WHEEL.NUMBER`.
    Wheel(&'static TyreNumber),
    /// A parameter of an effect.
    Effect(&'static Effect, usize),
    /// The wheel or side of an effect.
    Choice,
    /// Which robot, world, protocol, method: a word of the plan's own.
    Plan(&'static Word),
}

/// A number of the scene and how it is set.
#[derive(Debug)]
pub(super) struct Number {
    key: &'static str,
    allowed: Allowed,
    pub(super) set: fn(&mut Scene, f64),
}

/// A number of a tyre and how it is set.
#[derive(Debug)]
pub(super) struct TyreNumber {
    key: &'static str,
    allowed: Allowed,
    pub(super) set: fn(&mut Tyre, f64),
}

/// A key of the plan's own, and the kinds of points and protocols that have it.
#[derive(Debug)]
pub(super) struct Word {
    pub(super) key: &'static str,
    /// Protocols that have it, where it belongs to some alone.
    pub(super) protocols: &'static [&'static str],
}

use Allowed::{Finite, NonNegative, Positive};

/// Numbers of a tyre, as model files spell them.
static TYRE: &[TyreNumber] = &[
    TyreNumber { key: "free_radius_m", allowed: Positive, set: |tyre, value| tyre.free_radius = value },
    TyreNumber { key: "width_m", allowed: Positive, set: |tyre, value| tyre.width = value },
    TyreNumber { key: "vertical_stiffness_n_m", allowed: Positive, set: |tyre, value| tyre.vertical_stiffness = value },
    TyreNumber {
        key: "vertical_damping_n_s_m",
        allowed: NonNegative,
        set: |tyre, value| tyre.vertical_damping = value,
    },
    TyreNumber { key: "slip_stiffness", allowed: Positive, set: |tyre, value| tyre.slip_stiffness = value },
    TyreNumber { key: "friction_along", allowed: Positive, set: |tyre, value| tyre.friction_along = value },
    TyreNumber { key: "friction_across", allowed: Positive, set: |tyre, value| tyre.friction_across = value },
];

macro_rules! numbers {
    ($($key:literal, $allowed:ident, $($place:ident).+;)*) => {
        &[$(Number { key: $key, allowed: $allowed, set: |scene, value| scene.$($place).+ = value.into() }),*]
    };
}

/// Numbers that stand at one place of the scene.
static NUMBERS: &[Number] = numbers![
    "drivetrain.gear_ratio", Positive, robot.drivetrain.gear_ratio;
    "drivetrain.motor_stall_torque_nm", Positive, robot.drivetrain.motor_stall_torque;
    "drivetrain.motor_no_load_speed_rad_s", Positive, robot.drivetrain.motor_no_load_speed;
    "drivetrain.rotor_inertia_kg_m2", NonNegative, robot.drivetrain.rotor_inertia;
    "drivetrain.dry_friction_nm", NonNegative, robot.drivetrain.dry_friction;
    "drivetrain.viscous_friction_nm_s", NonNegative, robot.drivetrain.viscous_friction;
    "drivetrain.proportional_gain_nm_s", Positive, robot.drivetrain.proportional_gain;
    "drivetrain.integral_gain_nm", NonNegative, robot.drivetrain.integral_gain;
    "drivetrain.loop_rate_hz", Positive, robot.drivetrain.loop_rate;
    "drivetrain.speed_window_s", Positive, robot.drivetrain.speed_window;
    "drivetrain.backlash_rad", NonNegative, robot.drivetrain.backlash;
    "drivetrain.stop_overrun_rad", NonNegative, robot.drivetrain.stop_overrun;
    "drivetrain.wind_up_rad_nm", NonNegative, robot.drivetrain.wind_up;
    "encoder.ticks_per_revolution", Positive, robot.encoder.ticks_per_revolution;
    "encoder.rate_hz", Positive, robot.encoder.rate;
    "encoder.latency_s", NonNegative, robot.encoder.latency;
    "odometry.left_wheel_radius_m", Positive, robot.odometry.left_wheel_radius;
    "odometry.right_wheel_radius_m", Positive, robot.odometry.right_wheel_radius;
    "odometry.track_width_m", Positive, robot.odometry.track_width;
    "driver.cruise_speed_m_s", Positive, robot.driver.cruise_speed;
    "driver.acceleration_m_s2", Positive, robot.driver.acceleration;
    "driver.turn_rate_rad_s", Positive, robot.driver.turn_rate;
    "driver.turn_acceleration_rad_s2", Positive, robot.driver.turn_acceleration;
    "driver.heading_gain_1_s", Positive, robot.driver.heading_gain;
    "driver.distance_gain_1_s", Positive, robot.driver.distance_gain;
    "driver.line_gain_rad_m2", NonNegative, robot.driver.line_gain;
    "driver.pause_s", NonNegative, robot.driver.pause;
    "driver.rate_hz", Positive, robot.driver.rate;
    "chassis.centre_of_mass_x_m", Finite, robot.chassis.centre_of_mass.x;
    "chassis.centre_of_mass_y_m", Finite, robot.chassis.centre_of_mass.y;
    "chassis.centre_of_mass_z_m", Finite, robot.chassis.centre_of_mass.z;
    "floor.gradient", NonNegative, floor.gradient;
    "floor.downhill_heading_rad", Finite, floor.downhill_heading;
    "survey.position_std_m", NonNegative, survey.position_std;
    "survey.heading_std_rad", NonNegative, survey.heading_std;
    "survey.correlation_time_s", NonNegative, survey.correlation_time;
    "scatter.heading_per_corner_rad", NonNegative, scatter.heading_per_corner;
    "scatter.heading_per_sqrt_metre_rad", NonNegative, scatter.heading_per_sqrt_metre;
    "scatter.distance", NonNegative, scatter.distance;
    "time_step_s", Positive, time_step;
];

/// Numbers that stand at several places at once.
static SHARED: &[Number] = &[
    Number {
        key: "tyre.free_radius_m",
        allowed: Positive,
        set: |scene, value| tyres(scene, |it| it.free_radius = value),
    },
    Number { key: "tyre.width_m", allowed: Positive, set: |scene, value| tyres(scene, |it| it.width = value) },
    Number {
        key: "tyre.vertical_stiffness_n_m",
        allowed: Positive,
        set: |scene, value| tyres(scene, |it| it.vertical_stiffness = value),
    },
    Number {
        key: "tyre.vertical_damping_n_s_m",
        allowed: NonNegative,
        set: |scene, value| tyres(scene, |it| it.vertical_damping = value),
    },
    Number {
        key: "tyre.slip_stiffness",
        allowed: Positive,
        set: |scene, value| tyres(scene, |it| it.slip_stiffness = value),
    },
    Number {
        key: "tyre.friction_along",
        allowed: Positive,
        set: |scene, value| tyres(scene, |it| it.friction_along = value),
    },
    Number {
        key: "tyre.friction_across",
        allowed: Positive,
        set: |scene, value| tyres(scene, |it| it.friction_across = value),
    },
    Number {
        key: "caster.drag_coefficient",
        allowed: NonNegative,
        set: |scene, value| casters(scene, |it| it.drag_coefficient = value),
    },
    Number {
        key: "caster.vertical_stiffness_n_m",
        allowed: Positive,
        set: |scene, value| casters(scene, |it| it.vertical_stiffness = value),
    },
    Number {
        key: "caster.vertical_damping_n_s_m",
        allowed: NonNegative,
        set: |scene, value| casters(scene, |it| it.vertical_damping = value),
    },
    // A heavier chassis of the same shape: its moments of inertia grow with it.
    Number {
        key: "chassis.mass_kg",
        allowed: Positive,
        set: |scene, value| {
            let chassis = &mut scene.robot.chassis;
            chassis.inertia *= value / chassis.mass;
            chassis.mass = value;
        },
    },
    Number {
        key: "floor.grip_ratio",
        allowed: Positive,
        set: |scene, value| {
            if let Some(plane) = &mut scene.floor.plane {
                plane.grip_ratio = value;
            }
        },
    },
];

fn tyres(scene: &mut Scene, edit: impl Fn(&mut Tyre)) {
    scene.robot.wheels.iter_mut().for_each(|wheel| edit(&mut wheel.tyre));
}

fn casters(scene: &mut Scene, edit: impl Fn(&mut Caster)) {
    scene.robot.casters.iter_mut().for_each(edit);
}

/// Keys of the plan's own.
pub(super) static WORDS: &[Word] = &[
    Word { key: "robot", protocols: &[] },
    Word { key: "world", protocols: &[] },
    Word { key: "protocol.side_m", protocols: &["square"] },
    Word { key: "protocol.length_m", protocols: &["straight"] },
    Word { key: "protocol.radius_m", protocols: &["circle"] },
    Word { key: "protocol.turn_rad", protocols: &["spin", "circle"] },
    Word { key: "protocol.direction", protocols: &["square", "straight", "spin", "circle"] },
    Word { key: "protocol.speed_m_s", protocols: &["square", "straight", "circle"] },
    Word { key: "protocol.turn_rate_rad_s", protocols: &["square", "spin"] },
    Word { key: "campaign.side_m", protocols: &[] },
    Word { key: "campaign.runs", protocols: &[] },
    Word { key: "campaign.method", protocols: &[] },
    Word { key: "challenge.data", protocols: &[] },
    Word { key: "challenge.effects", protocols: &[] },
    Word { key: "challenge.campaign", protocols: &[] },
];

impl Word {
    fn allowed(&self) -> Allowed {
        match self.key {
            "robot" | "world" => Allowed::Text,
            "protocol.direction" => Allowed::OneOf(vec!["cw", "ccw", "forward", "reverse"]),
            "campaign.runs" => Allowed::Whole(1, 1000),
            "campaign.method" => Allowed::OneOf(METHODS.iter().map(|method| method.name).collect()),
            "challenge.data" => Allowed::OneOf(vec!["logs", "endpoints"]),
            "challenge.effects" => Allowed::OneOf(vec!["none", "one", "two", "outside", "mixed"]),
            "challenge.campaign" => Allowed::OneOf(vec!["squares", "full"]),
            _ => Positive,
        }
    }
}

impl Key {
    /// The key of this name, if there is one.
    pub fn named(name: &str) -> Option<Key> {
        let target = if let Some(number) = NUMBERS.iter().chain(SHARED).find(|number| number.key == name) {
            Target::Scene(number)
        } else if let Some(word) = WORDS.iter().find(|word| word.key == name) {
            Target::Plan(word)
        } else {
            let (first, rest) = name.split_once('.')?;
            if first == "wheels" {
                let (_, key) = rest.split_once('.')?;
                Target::Wheel(TYRE.iter().find(|number| number.key == key)?)
            } else {
                let effect = Effect::named(first)?;
                match effect.parameters.iter().position(|parameter| parameter.name == rest) {
                    Some(index) => Target::Effect(effect, index),
                    None if effect.choice.is_some_and(|choice| choice.key() == rest) => Target::Choice,
                    None => return None,
                }
            }
        };
        Some(Key { name: name.to_owned(), target })
    }

    /// As plans spell it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The wheel of `wheels.WHEEL.NUMBER`.
    pub(super) fn wheel(&self) -> Option<&str> {
        self.name.split('.').nth(1)
    }

    /// What values it takes.
    pub fn allowed(&self) -> Allowed {
        match self.target {
            Target::Scene(number) => number.allowed.clone(),
            Target::Wheel(number) => number.allowed.clone(),
            Target::Effect(effect, index) => {
                let [least, greatest] = effect.parameters[index].bounds;
                Allowed::Between(least, greatest)
            }
            Target::Choice => Allowed::Text,
            Target::Plan(word) => word.allowed(),
        }
    }

    /// Whether it takes words.
    pub fn takes_text(&self) -> bool {
        matches!(self.allowed(), Allowed::Text | Allowed::OneOf(_))
    }

    /// Every key there is, for messages: `WHEEL` stands for a wheel's name.
    fn known() -> String {
        let mut known: Vec<String> = WORDS.iter().map(|word| word.key.to_owned()).collect();
        known.extend(NUMBERS.iter().chain(SHARED).map(|number| number.key.to_owned()));
        known.extend(TYRE.iter().map(|number| format!("wheels.WHEEL.{}", number.key)));
        for effect in &EFFECTS {
            known.extend(effect.parameters.iter().map(|parameter| format!("{}.{}", effect.id, parameter.name)));
            known.extend(effect.choice.map(|choice| format!("{}.{}", effect.id, choice.key())));
        }
        known.join(", ")
    }
}

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Key, D::Error> {
        let name = String::deserialize(deserializer)?;
        Key::named(&name).ok_or_else(|| {
            D::Error::custom(format_args!(
                "no parameter `{name}` (in a table's key, quote it); there are: {}",
                Key::known()
            ))
        })
    }
}

impl Allowed {
    /// Whether `value` is.
    pub fn holds(&self, value: &Value) -> bool {
        match (self, value) {
            (Allowed::Text, Value::Text(_)) => true,
            (Allowed::OneOf(words), Value::Text(text)) => words.contains(&text.as_str()),
            (Allowed::Finite, Value::Number(value)) => value.is_finite(),
            (Allowed::Positive, Value::Number(value)) => value.is_finite() && *value > 0.0,
            (Allowed::NonNegative, Value::Number(value)) => value.is_finite() && *value >= 0.0,
            (Allowed::Between(least, greatest), Value::Number(value)) => (*least..=*greatest).contains(value),
            (Allowed::Whole(least, greatest), Value::Number(value)) => {
                value.fract() == 0.0 && (f64::from(*least)..=f64::from(*greatest)).contains(value)
            }
            _ => false,
        }
    }
}

impl fmt::Display for Allowed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Allowed::Finite => f.write_str("a finite number"),
            Allowed::Positive => f.write_str("a finite number above 0"),
            Allowed::NonNegative => f.write_str("a finite number, 0 or above"),
            Allowed::Between(least, greatest) => write!(f, "a number from {least} to {greatest}"),
            Allowed::Whole(least, greatest) => write!(f, "a whole number from {least} to {greatest}"),
            Allowed::OneOf(words) => write!(f, "one of {}", words.join(", ")),
            Allowed::Text => f.write_str("a text"),
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Number(value) => write!(f, "{value}"),
            Value::Text(text) => write!(f, "{text:?}"),
        }
    }
}
