//! `dataset.toml` as the wire has it: every key, its unit in its name, stated once for reading and writing.

use super::{Campaign, DriveKind, RobotFacts, SurveyFacts};
use crate::odometry::OdometryParameters;
use crate::strict::{optional_non_negative, optional_positive, positive};
use serde::de::{Deserializer, Error};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

#[derive(Deserialize, Serialize)]
enum Format {
    #[serde(rename = "treadmark-dataset/1")]
    V1,
}

/// The whole file.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DatasetFile {
    format: Format,
    name: String,
    description: Option<String>,
    source: Option<String>,
    licence: Option<String>,
    #[serde(default, skip_serializing_if = "is_default")]
    robot: RobotTable,
    #[serde(default, skip_serializing_if = "is_default")]
    world: WorldTable,
    odometry: Option<OdometryTable>,
    #[serde(default, skip_serializing_if = "is_default")]
    survey: SurveyTable,
    #[serde(default, skip_serializing_if = "is_default")]
    conditions: BTreeMap<String, Condition>,
}

#[derive(Deserialize, Serialize, Default, PartialEq)]
#[serde(deny_unknown_fields, default)]
struct RobotTable {
    model: Option<PathBuf>,
    drive: Option<DriveWord>,
    #[serde(deserialize_with = "optional_positive")]
    nominal_wheel_diameter_m: Option<f64>,
    #[serde(deserialize_with = "optional_positive")]
    nominal_track_width_m: Option<f64>,
    #[serde(deserialize_with = "optional_positive")]
    wheelbase_m: Option<f64>,
    #[serde(deserialize_with = "optional_positive")]
    wheel_width_m: Option<f64>,
    #[serde(deserialize_with = "optional_positive")]
    mass_kg: Option<f64>,
    #[serde(deserialize_with = "optional_positive")]
    ticks_per_revolution: Option<f64>,
}

#[derive(Deserialize, Serialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum DriveWord {
    SkidSteer,
    Differential,
}

#[derive(Deserialize, Serialize, Default, PartialEq)]
#[serde(deny_unknown_fields, default)]
struct WorldTable {
    model: Option<PathBuf>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct OdometryTable {
    #[serde(deserialize_with = "positive")]
    left_wheel_radius_m: f64,
    #[serde(deserialize_with = "positive")]
    right_wheel_radius_m: f64,
    #[serde(deserialize_with = "positive")]
    track_width_m: f64,
    #[serde(default, deserialize_with = "optional_positive")]
    ticks_per_revolution: Option<f64>,
}

#[derive(Deserialize, Serialize, Default, PartialEq)]
#[serde(deny_unknown_fields, default)]
struct SurveyTable {
    method: Option<String>,
    #[serde(deserialize_with = "optional_non_negative")]
    position_std_m: Option<f64>,
    #[serde(deserialize_with = "optional_non_negative")]
    heading_std_rad: Option<f64>,
}

/// Anything, but no number in it that is none: conditions are free, NaN and infinity are errors everywhere.
#[derive(Serialize, PartialEq)]
#[serde(transparent)]
struct Condition(toml::Value);

impl<'de> Deserialize<'de> for Condition {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = toml::Value::deserialize(deserializer)?;
        match not_finite(&value) {
            None => Ok(Condition(value)),
            Some(number) => Err(D::Error::custom(format_args!("{number} is not allowed here: numbers are finite"))),
        }
    }
}

fn not_finite(value: &toml::Value) -> Option<f64> {
    match value {
        toml::Value::Float(number) => Some(*number).filter(|number| !number.is_finite()),
        toml::Value::Array(values) => values.iter().find_map(not_finite),
        toml::Value::Table(table) => table.values().find_map(not_finite),
        _ => None,
    }
}

/// Tables of which nothing is stated are left out.
fn is_default<T: Default + PartialEq>(table: &T) -> bool {
    *table == T::default()
}

impl From<DatasetFile> for Campaign {
    fn from(file: DatasetFile) -> Self {
        let robot = file.robot;
        Campaign {
            name: file.name,
            description: file.description,
            source: file.source,
            licence: file.licence,
            odometry: file.odometry.map(|odometry| OdometryParameters {
                left_wheel_radius: odometry.left_wheel_radius_m,
                right_wheel_radius: odometry.right_wheel_radius_m,
                track_width: odometry.track_width_m,
                ticks_per_revolution: odometry.ticks_per_revolution.or(robot.ticks_per_revolution),
            }),
            robot: RobotFacts {
                model: robot.model,
                drive: robot.drive.map(|drive| match drive {
                    DriveWord::SkidSteer => DriveKind::SkidSteer,
                    DriveWord::Differential => DriveKind::Differential,
                }),
                nominal_wheel_diameter: robot.nominal_wheel_diameter_m,
                nominal_track_width: robot.nominal_track_width_m,
                wheelbase: robot.wheelbase_m,
                wheel_width: robot.wheel_width_m,
                mass: robot.mass_kg,
                ticks_per_revolution: robot.ticks_per_revolution,
            },
            world_model: file.world.model,
            survey: SurveyFacts {
                method: file.survey.method,
                position_std: file.survey.position_std_m,
                heading_std: file.survey.heading_std_rad,
            },
            conditions: file.conditions.into_iter().map(|(key, Condition(value))| (key, value)).collect(),
        }
    }
}

impl From<Campaign> for DatasetFile {
    fn from(campaign: Campaign) -> Self {
        let Campaign { name, description, source, licence, robot, world_model, odometry, survey, conditions } =
            campaign;
        DatasetFile {
            format: Format::V1,
            name,
            description,
            source,
            licence,
            robot: RobotTable {
                model: robot.model,
                drive: robot.drive.map(|drive| match drive {
                    DriveKind::SkidSteer => DriveWord::SkidSteer,
                    DriveKind::Differential => DriveWord::Differential,
                }),
                nominal_wheel_diameter_m: robot.nominal_wheel_diameter,
                nominal_track_width_m: robot.nominal_track_width,
                wheelbase_m: robot.wheelbase,
                wheel_width_m: robot.wheel_width,
                mass_kg: robot.mass,
                ticks_per_revolution: robot.ticks_per_revolution,
            },
            world: WorldTable { model: world_model },
            odometry: odometry.map(|odometry| OdometryTable {
                left_wheel_radius_m: odometry.left_wheel_radius,
                right_wheel_radius_m: odometry.right_wheel_radius,
                track_width_m: odometry.track_width,
                ticks_per_revolution: odometry.ticks_per_revolution,
            }),
            survey: SurveyTable {
                method: survey.method,
                position_std_m: survey.position_std,
                heading_std_rad: survey.heading_std,
            },
            conditions: conditions.into_iter().map(|(key, value)| (key, Condition(value))).collect(),
        }
    }
}
