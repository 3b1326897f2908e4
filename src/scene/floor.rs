//! What the robot drives on.
//!
//! The room frame lies in the floor: x, y in its plane, z along its normal. A floor that slopes is written as gravity
//! that leans, which is the same physics, and is how a tape measure on that floor sees it.

use super::error::SceneError;
use super::shape::Placement;
use super::{GRAVITY, shipped};
use crate::geometry::Pose2;
use crate::strict::{finite, finite_triple, non_negative, positive};
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use serde::de::{Deserializer, Error};
use std::path::PathBuf;

/// The ground, and what stands on it.
#[derive(Debug, Clone)]
pub struct Floor {
    /// Name in the world file.
    pub name: String,
    /// The world file, or the name of the shipped world.
    pub file: PathBuf,
    /// The plane z = 0, where there is one.
    pub plane: Option<Plane>,
    /// Rise over run of the room's z = 0 plane \[–\].
    pub gradient: f64,
    /// Heading that points straight downhill \[rad\].
    pub downhill_heading: f64,
    /// Where the plane's grip differs; the last one that holds a point counts.
    pub regions: Vec<GripRegion>,
    /// Things that wheels climb and the chassis hits.
    pub obstacles: Vec<Obstacle>,
}

/// The plane z = 0.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// Factor on the friction of tyres and chassis \[–\]; 1 is the floor on which the tyres' μ was stated.
    #[serde(default = "one", deserialize_with = "positive")]
    pub grip_ratio: f64,
    /// Coulomb friction between the chassis and anything that it hits \[–\].
    #[serde(default = "chassis_friction", deserialize_with = "non_negative")]
    pub chassis_friction: f64,
}

/// Part of the plane with another grip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GripRegion {
    /// Its outline.
    pub shape: RegionShape,
    /// Factor on friction inside, on top of what is there without it \[–\].
    pub grip_ratio: f64,
}

/// Outline of a region in the room \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RegionShape {
    /// A disc.
    Disc {
        /// Centre.
        x: f64,
        /// Centre.
        y: f64,
        /// Radius.
        radius: f64,
    },
    /// A rectangle along the axes.
    Rectangle {
        /// Corners' coordinates: least x, least y.
        min: [f64; 2],
        /// Corners' coordinates: greatest x, greatest y.
        max: [f64; 2],
    },
}

/// Something solid on the floor.
#[derive(Debug, Clone, PartialEq)]
pub enum Obstacle {
    /// A box: a sill, a step, a wall.
    Box {
        /// Full edge lengths \[m\].
        size: [f64; 3],
        /// Room from box centre.
        placement: Placement,
        /// Factor on friction.
        grip_ratio: f64,
    },
    /// A wedge that rises along its own x from 0 to `size[2]`.
    Ramp {
        /// Length, width, height \[m\].
        size: [f64; 3],
        /// Room from the middle of its lower edge.
        placement: Placement,
        /// Factor on friction.
        grip_ratio: f64,
    },
    /// Heights over a grid.
    HeightField {
        /// `heights[row][column]` \[m\], rows along y, columns along x.
        heights: Vec<Vec<f64>>,
        /// Distance of neighbours \[m\].
        spacing: f64,
        /// Room from the middle of the grid at height 0.
        placement: Placement,
        /// Factor on friction.
        grip_ratio: f64,
    },
}

/// A floor that is another's but for what lies about a place.
#[derive(Debug, Clone, PartialEq)]
pub struct SpottedFloor {
    /// All regions of its plane.
    pub regions: Vec<GripRegion>,
    /// The place, in the room \[m\].
    pub place: [f64; 2],
    /// How far from it the base of a robot is at most that notices \[m\].
    pub reach: f64,
}

impl SpottedFloor {
    /// Whether a robot there may notice.
    pub fn is_within(&self, base: Pose2) -> bool {
        (base.x - self.place[0]).hypot(base.y - self.place[1]) < self.reach
    }
}

/// Width of the band over which the grip changes at the edge of a region \[m\]: about a patch.
const EDGE: f64 = 0.02;

impl Floor {
    /// Reads a world file; `given` is a path or the name of a shipped world.
    ///
    /// # Errors
    /// What is wrong with which file, where, and what is allowed.
    pub fn load(given: &str) -> Result<Floor, SceneError> {
        let source = shipped::WORLDS.find("world", given)?;
        let world: WorldFile = source.parse()?;
        if world.plane.is_none() && world.obstacles.is_empty() {
            return Err(SceneError::NoGround { file: source.file });
        }
        Ok(Floor {
            name: world.name,
            file: source.file,
            plane: world.plane,
            gradient: world.slope.gradient,
            downhill_heading: world.slope.downhill_heading,
            regions: world.regions.into_iter().map(GripRegion::from).collect(),
            obstacles: world.obstacles.into_iter().map(Obstacle::from).collect(),
        })
    }

    /// A level plane without anything on it.
    pub fn level() -> Floor {
        Floor {
            name: "level".to_owned(),
            file: PathBuf::from("level"),
            plane: Some(Plane { grip_ratio: one(), chassis_friction: chassis_friction() }),
            gradient: 0.0,
            downhill_heading: 0.0,
            regions: Vec::new(),
            obstacles: Vec::new(),
        }
    }

    /// Gravity in the room frame \[m/s²\].
    pub fn gravity(&self) -> Vector3<f64> {
        let slope = self.gradient.atan();
        let downhill = self.downhill_heading.sin_cos();
        Vector3::new(slope.sin() * downhill.1, slope.sin() * downhill.0, -slope.cos()) * GRAVITY
    }

    /// Factor on friction of the plane at a point of the room \[m\]. It changes over a band of 20 mm at the edge of a
    /// region, as a patch slides over the edge; where regions overlap, each has its say.
    pub fn grip_ratio_at(&self, x: f64, y: f64) -> f64 {
        let plane = self.plane.map_or(1.0, |plane| plane.grip_ratio);
        self.regions.iter().fold(plane, |outside, region| {
            let inside = (region.shape.depth(x, y) / EDGE + 0.5).clamp(0.0, 1.0);
            outside * (1.0 + inside * (region.grip_ratio - 1.0))
        })
    }
}

impl RegionShape {
    /// How far inside the outline a point lies \[m\]; negative outside.
    fn depth(&self, x: f64, y: f64) -> f64 {
        match *self {
            RegionShape::Disc { x: cx, y: cy, radius } => radius - (x - cx).hypot(y - cy),
            RegionShape::Rectangle { min, max } => (x - min[0]).min(max[0] - x).min((y - min[1]).min(max[1] - y)),
        }
    }
}

// ── the world file ──

fn one() -> f64 {
    1.0
}

fn chassis_friction() -> f64 {
    0.3
}

#[derive(Deserialize)]
enum Format {
    #[serde(rename = "treadmark-world/1")]
    V1,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WorldFile {
    #[serde(rename = "format")]
    _format: Format,
    name: String,
    #[serde(rename = "description", default)]
    _description: String,
    plane: Option<Plane>,
    #[serde(default)]
    slope: SlopeTable,
    #[serde(default)]
    regions: Vec<RegionTable>,
    #[serde(default)]
    obstacles: Vec<ObstacleTable>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct SlopeTable {
    #[serde(deserialize_with = "finite")]
    gradient: f64,
    #[serde(rename = "downhill_heading_rad", deserialize_with = "finite")]
    downhill_heading: f64,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum RegionTable {
    Disc {
        #[serde(deserialize_with = "finite")]
        x_m: f64,
        #[serde(deserialize_with = "finite")]
        y_m: f64,
        #[serde(deserialize_with = "positive")]
        radius_m: f64,
        #[serde(deserialize_with = "positive")]
        grip_ratio: f64,
    },
    Rectangle {
        #[serde(deserialize_with = "finite")]
        min_x_m: f64,
        #[serde(deserialize_with = "finite")]
        max_x_m: f64,
        #[serde(deserialize_with = "finite")]
        min_y_m: f64,
        #[serde(deserialize_with = "finite")]
        max_y_m: f64,
        #[serde(deserialize_with = "positive")]
        grip_ratio: f64,
    },
}

impl From<RegionTable> for GripRegion {
    fn from(table: RegionTable) -> Self {
        match table {
            RegionTable::Disc { x_m, y_m, radius_m, grip_ratio } => {
                GripRegion { shape: RegionShape::Disc { x: x_m, y: y_m, radius: radius_m }, grip_ratio }
            }
            RegionTable::Rectangle { min_x_m, max_x_m, min_y_m, max_y_m, grip_ratio } => GripRegion {
                shape: RegionShape::Rectangle { min: [min_x_m, min_y_m], max: [max_x_m, max_y_m] },
                grip_ratio,
            },
        }
    }
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum ObstacleTable {
    Box {
        #[serde(deserialize_with = "positive_triple")]
        size_m: [f64; 3],
        #[serde(deserialize_with = "finite_triple")]
        position_m: [f64; 3],
        #[serde(default, deserialize_with = "finite_triple")]
        rpy_rad: [f64; 3],
        #[serde(default = "one", deserialize_with = "positive")]
        grip_ratio: f64,
    },
    Ramp {
        #[serde(deserialize_with = "positive_triple")]
        size_m: [f64; 3],
        #[serde(deserialize_with = "finite_triple")]
        position_m: [f64; 3],
        #[serde(default, deserialize_with = "finite_triple")]
        rpy_rad: [f64; 3],
        #[serde(default = "one", deserialize_with = "positive")]
        grip_ratio: f64,
    },
    HeightField {
        #[serde(deserialize_with = "grid")]
        heights_m: Vec<Vec<f64>>,
        #[serde(deserialize_with = "positive")]
        spacing_m: f64,
        #[serde(deserialize_with = "finite_triple")]
        position_m: [f64; 3],
        #[serde(default, deserialize_with = "finite_triple")]
        rpy_rad: [f64; 3],
        #[serde(default = "one", deserialize_with = "positive")]
        grip_ratio: f64,
    },
}

impl From<ObstacleTable> for Obstacle {
    fn from(table: ObstacleTable) -> Self {
        let placed = |[x, y, z]: [f64; 3], [roll, pitch, yaw]: [f64; 3]| {
            Placement::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
        };
        match table {
            ObstacleTable::Box { size_m, position_m, rpy_rad, grip_ratio } => {
                Obstacle::Box { size: size_m, placement: placed(position_m, rpy_rad), grip_ratio }
            }
            ObstacleTable::Ramp { size_m, position_m, rpy_rad, grip_ratio } => {
                Obstacle::Ramp { size: size_m, placement: placed(position_m, rpy_rad), grip_ratio }
            }
            ObstacleTable::HeightField { heights_m, spacing_m, position_m, rpy_rad, grip_ratio } => {
                Obstacle::HeightField {
                    heights: heights_m,
                    spacing: spacing_m,
                    placement: placed(position_m, rpy_rad),
                    grip_ratio,
                }
            }
        }
    }
}

fn positive_triple<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 3], D::Error> {
    let values = <[f64; 3]>::deserialize(deserializer)?;
    if values.iter().all(|value| value.is_finite() && *value > 0.0) {
        Ok(values)
    } else {
        Err(D::Error::custom(format_args!("{values:?} is not allowed here: it must be three finite numbers above 0")))
    }
}

fn grid<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Vec<f64>>, D::Error> {
    let rows = Vec::<Vec<f64>>::deserialize(deserializer)?;
    let columns = rows.first().map_or(0, Vec::len);
    let whole = rows.len() >= 2 && columns >= 2 && rows.iter().all(|row| row.len() == columns);
    if whole && rows.iter().flatten().all(|height| height.is_finite()) {
        Ok(rows)
    } else {
        Err(D::Error::custom("a height field needs two or more rows of two or more finite heights, all of one length"))
    }
}
