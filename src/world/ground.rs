//! What lies under a wheel, by parry queries.

use super::convert;
use crate::scene::{Floor, GripRegion, Obstacle};
use rapier3d::math::{Pose, Vector};
use rapier3d::parry::bounding_volume::{Aabb, BoundingVolume};
use rapier3d::parry::shape::SharedShape;

/// Lean of a wheel up to which it stands on its tread: sin of a little over a degree.
const LEAN: f64 = 0.02;

/// The ground as shapes that can be queried and hit.
#[derive(Clone)]
pub(super) struct Ground {
    pub pieces: Vec<Piece>,
    floor: Floor,
}

/// One shape of the ground.
#[derive(Clone)]
pub(super) struct Piece {
    pub shape: SharedShape,
    pub room_from_shape: Pose,
    aabb: Aabb,
    grip_ratio: f64,
    /// Number in the world file, from 1; `None`: the plane.
    pub obstacle: Option<usize>,
}

/// Where a disc (a wheel's mid-plane) or a ball presses into a piece of ground.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    /// Index of the piece.
    pub piece: usize,
    /// Point of the ground nearest to the centre, in the room.
    pub point: Vector,
    /// From the ground to the centre.
    pub normal: Vector,
    /// How far the free surface would reach into the ground \[m\].
    pub depth: f64,
}

impl Ground {
    pub(super) fn new(floor: &Floor) -> Ground {
        let mut pieces = Vec::new();
        if floor.plane.is_some() {
            pieces.push(Piece::new(SharedShape::halfspace(Vector::Z), Pose::identity(), 1.0, None));
        }
        for (index, obstacle) in floor.obstacles.iter().enumerate() {
            let (shape, placement, grip_ratio) = solid(obstacle);
            pieces.push(Piece::new(shape, convert::pose(placement), grip_ratio, Some(index + 1)));
        }
        Ground { pieces, floor: floor.clone() }
    }

    /// From now on these regions of the plane grip otherwise.
    pub(super) fn set_regions(&mut self, regions: &[GripRegion]) {
        self.floor.regions = regions.to_vec();
    }

    /// Calls `touch` for each piece that a disc of `radius` and `width` about `centre` with axle `axle` presses into.
    /// A ball is a disc of no axle: `axle` zero, `width` twice the radius.
    pub(super) fn touches(&self, centre: Vector, axle: Vector, radius: f64, width: f64, mut touch: impl FnMut(Touch)) {
        for (index, piece) in self.pieces.iter().enumerate() {
            if !piece.near(centre, radius) {
                continue;
            }
            // The mid-plane first; a shoulder where only it is on the piece.
            let mut found = piece.nearest(centre, axle, width);
            if found.is_none() {
                let middle = piece.shape.project_point(&piece.room_from_shape, centre, true).point;
                let shoulder = (0.5 * width).copysign((middle - centre).dot(axle));
                found = piece.nearest(centre + axle * shoulder, axle, 0.0);
            }
            if let Some((point, away)) = found {
                let distance = away.length();
                if distance < radius && distance > 0.0 {
                    touch(Touch { piece: index, point, normal: away / distance, depth: radius - distance });
                }
            }
        }
    }

    /// Factor on friction at a touch.
    pub(super) fn grip_ratio(&self, touch: &Touch) -> f64 {
        self.grip_ratio_at(touch.piece, touch.point)
    }

    /// Factor on friction at a point of a piece.
    pub(super) fn grip_ratio_at(&self, piece: usize, point: Vector) -> f64 {
        let piece = &self.pieces[piece];
        match piece.obstacle {
            None => self.floor.grip_ratio_at(point.x, point.y),
            Some(_) => piece.grip_ratio,
        }
    }

    /// Height of the highest ground at (x, y) below `from` \[m\].
    pub(super) fn height_at(&self, x: f64, y: f64, from: f64) -> Option<f64> {
        use rapier3d::parry::query::Ray;
        let down = Ray::new(Vector::new(x, y, from), -Vector::Z);
        self.pieces
            .iter()
            .filter_map(|piece| piece.shape.cast_ray(&piece.room_from_shape, &down, f64::MAX, true))
            .map(|distance| from - distance)
            .max_by(f64::total_cmp)
    }
}

impl Piece {
    fn new(shape: SharedShape, room_from_shape: Pose, grip_ratio: f64, obstacle: Option<usize>) -> Piece {
        let aabb = shape.compute_aabb(&room_from_shape);
        Piece { shape, room_from_shape, aabb, grip_ratio, obstacle }
    }

    fn near(&self, centre: Vector, radius: f64) -> bool {
        self.obstacle.is_none() || self.aabb.loosened(radius).contains_local_point(centre)
    }

    /// The nearest point of the piece, and the way from it along which the tyre is pressed in; `None` where that point
    /// lies beyond the wheel's width.
    ///
    /// On a face the way is the face's normal, which a wheel that leans a little meets a little aside of its mid-plane;
    /// a corner under the tread pushes within the wheel's plane.
    fn nearest(&self, centre: Vector, axle: Vector, width: f64) -> Option<(Vector, Vector)> {
        let point = match self.obstacle {
            None => Vector::new(centre.x, centre.y, 0.0),
            Some(_) => self.shape.project_point(&self.room_from_shape, centre, true).point,
        };
        let away = centre - point;
        let aside = away.dot(axle);
        let radial = away - axle * aside;
        if aside.abs() <= LEAN * radial.length() {
            Some((point, away))
        } else {
            (aside.abs() <= 0.5 * width).then_some((point, radial))
        }
    }
}

fn solid(obstacle: &Obstacle) -> (SharedShape, &crate::scene::Placement, f64) {
    match obstacle {
        Obstacle::Box { size: [x, y, z], placement, grip_ratio } => {
            (SharedShape::cuboid(0.5 * x, 0.5 * y, 0.5 * z), placement, *grip_ratio)
        }
        Obstacle::Ramp { size: [length, width, height], placement, grip_ratio } => {
            let corners = [0.5 * width, -0.5 * width]
                .map(|y| [Vector::new(0.0, y, 0.0), Vector::new(*length, y, 0.0), Vector::new(*length, y, *height)]);
            let hull = SharedShape::convex_hull(&corners.concat()).expect("six corners of a wedge with positive size");
            (hull, placement, *grip_ratio)
        }
        Obstacle::HeightField { heights, spacing, placement, grip_ratio } => {
            (height_field(heights, *spacing), placement, *grip_ratio)
        }
    }
}

/// Two triangles a cell; a mesh, because its tree of boxes answers point queries quickly.
fn height_field(heights: &[Vec<f64>], spacing: f64) -> SharedShape {
    let (rows, columns) = (heights.len(), heights[0].len());
    let middle = |count: usize| 0.5 * spacing * (count - 1) as f64;
    let vertices = heights
        .iter()
        .enumerate()
        .flat_map(|(row, line)| {
            line.iter().enumerate().map(move |(column, &height)| {
                Vector::new(spacing * column as f64 - middle(columns), spacing * row as f64 - middle(rows), height)
            })
        })
        .collect();
    let mut triangles = Vec::with_capacity(2 * (rows - 1) * (columns - 1));
    for row in 0..rows - 1 {
        for column in 0..columns - 1 {
            let corner = |row: usize, column: usize| (row * columns + column) as u32;
            let (a, b) = (corner(row, column), corner(row, column + 1));
            let (c, d) = (corner(row + 1, column), corner(row + 1, column + 1));
            triangles.push([a, b, d]);
            triangles.push([a, d, c]);
        }
    }
    SharedShape::trimesh(vertices, triangles).expect("a grid of two or more rows and columns has triangles")
}
