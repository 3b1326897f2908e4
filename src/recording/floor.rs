//! The floor and what stands on it.

use super::look::{self, FLOOR, GRID, INK, LESS_GRIP, MORE_GRIP, OBSTACLE, Rgb};
use super::mesh::Mesh;
use super::stream::{Path, Stream};
use super::{Area, lettering};
use crate::scene::{Floor, GripRegion, Obstacle, Placement, RegionShape};
use nalgebra::Vector3;
use rerun::{Arrows3D, LineStrip3D, LineStrips3D};
use std::f64::consts::TAU;

/// Floor shown around the area \[m\].
const MARGIN: f64 = 1.0;
/// Height of letters, and length of the arrow downhill, in an area that is wide enough \[m\].
const LETTERS: f64 = 0.16;
const ARROW: f64 = 0.6;
/// Width of an area from which on it is \[m\].
const WIDE: f64 = 4.0;
/// Facets of a disc.
const FACETS: usize = 64;

/// Logs all of it, once.
pub(super) fn draw(stream: &Stream, floor: &Floor, driven: &Area) {
    let root = Path::of(["floor"]);
    stream.tilt(&root);
    let area = Area {
        min: driven.min.map(|least| (least - MARGIN).floor()),
        max: driven.max.map(|greatest| (greatest + MARGIN).ceil()),
    };
    if floor.plane.is_some() {
        let mut mesh = Mesh::default();
        rectangle(&mut mesh, area.min, area.max, -2e-3, FLOOR);
        stream.fixed(root.child("plane"), &mesh.into_rerun());
        grid(stream, &root, &area);
    }
    let mut regions = Mesh::default();
    for (index, region) in floor.regions.iter().enumerate() {
        draw_region(&mut regions, region, index);
    }
    if !regions.is_empty() {
        stream.fixed(root.child("grip"), &regions.into_rerun());
        let words = floor.regions.iter().flat_map(|region| {
            let (centre, half_width) = middle(region);
            let at = [centre[0], centre[1] - half_width - 0.1];
            lettering(&format!("GRIP x {:.2}", region.grip_ratio), at, LETTERS, 0.0)
        });
        stream.fixed(root.child("grip_words"), &ink(words));
    }
    let mut obstacles = Mesh::default();
    for obstacle in &floor.obstacles {
        draw_obstacle(&mut obstacles, obstacle);
    }
    if !obstacles.is_empty() {
        stream.fixed(root.child("obstacles"), &obstacles.into_rerun());
    }
    if floor.gradient != 0.0 {
        let width = [0, 1].map(|axis| driven.max[axis] - driven.min[axis]);
        let scale = (width[0].max(width[1]) / WIDE).min(1.0);
        let at = [0, 1].map(|axis| driven.min[axis] + 0.75 * width[axis]);
        let (sin, cos) = floor.downhill_heading.sin_cos();
        let arrow = Arrows3D::from_vectors([f32_at([cos, sin].map(|part| scale * ARROW * part), 0.0)])
            .with_origins([f32_at(at, 0.01)])
            .with_radii([look::metres(0.025 * scale as f32)])
            .with_colors([INK]);
        stream.fixed(root.child("downhill"), &arrow);
        // On the arrow's other side where it points at the reader.
        let beside = [at[0] + if cos < -0.5 { 0.25 } else { -0.25 } * scale, at[1]];
        let words = lettering(&format!("FALLS {:.1} %", 100.0 * floor.gradient), beside, scale * LETTERS, 0.7);
        stream.fixed(root.child("downhill_words"), &ink(words));
    }
}

/// Letters of this `height` on the floor, to be read from behind the start; `at` lies on their middle line \[m\], this share of it
/// from the left.
fn lettering(text: &str, at: [f64; 2], height: f64, share: f64) -> Vec<LineStrip3D> {
    let lines = lettering::lines(text, [0.0; 2], height, share);
    let on_floor = |[right, up]: [f64; 2]| f32_at([at[0] + up, at[1] - right], 4e-3);
    lines.into_iter().map(|line| LineStrip3D::from_iter(line.into_iter().map(on_floor))).collect()
}

fn ink(lines: impl IntoIterator<Item = LineStrip3D>) -> LineStrips3D {
    LineStrips3D::new(lines).with_radii([look::points(1.5)]).with_colors([INK])
}

/// A line each metre, and a mark where runs start.
fn grid(stream: &Stream, root: &Path, area: &Area) {
    let mut lines = Vec::new();
    for axis in 0..2 {
        let other = 1 - axis;
        for metre in area.min[axis] as i64..=area.max[axis] as i64 {
            lines.push([area.min[other], area.max[other]].map(|end| {
                let mut point = [0.0, 0.0];
                point[axis] = metre as f64;
                point[other] = end;
                f32_at(point, 0.0)
            }));
        }
    }
    let lines = LineStrips3D::new(lines).with_radii([look::points(1.0)]).with_colors([GRID]);
    stream.fixed(root.child("metre_grid"), &lines);
    let cross = [[[-0.12, 0.0], [0.4, 0.0]], [[0.0, -0.12], [0.0, 0.12]]];
    let cross = LineStrips3D::new(cross.map(|line| line.map(|point| f32_at(point, 2e-3))));
    stream.fixed(root.child("start_mark"), &cross.with_radii([look::metres(0.008)]).with_colors([INK]));
}

fn draw_region(mesh: &mut Mesh, region: &GripRegion, index: usize) {
    let colour = if region.grip_ratio < 1.0 { LESS_GRIP } else { MORE_GRIP };
    let z = -1e-3 + 1e-4 * index as f64;
    match region.shape {
        RegionShape::Disc { x, y, radius } => {
            let rim: Vec<_> = (0..FACETS)
                .map(|facet| {
                    let (sin, cos) = (TAU * facet as f64 / FACETS as f64).sin_cos();
                    Vector3::new(x + radius * cos, y + radius * sin, z)
                })
                .collect();
            mesh.flat(&Placement::identity(), &rim, colour);
        }
        RegionShape::Rectangle { min, max } => rectangle(mesh, min, max, z, colour),
    }
}

/// Centre and half width along y \[m\].
fn middle(region: &GripRegion) -> ([f64; 2], f64) {
    match region.shape {
        RegionShape::Disc { x, y, radius } => ([x, y], radius),
        RegionShape::Rectangle { min, max } => {
            ([0.5 * (min[0] + max[0]), 0.5 * (min[1] + max[1])], 0.5 * (max[1] - min[1]))
        }
    }
}

fn draw_obstacle(mesh: &mut Mesh, obstacle: &Obstacle) {
    match obstacle {
        Obstacle::Box { size, placement, .. } => mesh.cuboid(placement, *size, OBSTACLE),
        Obstacle::Ramp { size, placement, .. } => mesh.wedge(placement, *size, OBSTACLE),
        Obstacle::HeightField { heights, spacing, placement, .. } => {
            let (rows, columns) = (heights.len(), heights.first().map_or(0, Vec::len));
            let at = |row: usize, column: usize| {
                let middle = |count: usize| 0.5 * (count as f64 - 1.0);
                let (x, y) = (column as f64 - middle(columns), row as f64 - middle(rows));
                Vector3::new(spacing * x, spacing * y, heights[row][column])
            };
            for row in 1..rows {
                for column in 1..columns {
                    let (a, b) = (at(row - 1, column - 1), at(row - 1, column));
                    let (c, d) = (at(row, column - 1), at(row, column));
                    mesh.triangle(placement, [a, b, d], OBSTACLE);
                    mesh.triangle(placement, [a, d, c], OBSTACLE);
                }
            }
        }
    }
}

fn rectangle(mesh: &mut Mesh, min: [f64; 2], max: [f64; 2], z: f64, colour: Rgb) {
    let corners = [[min[0], min[1]], [max[0], min[1]], [max[0], max[1]], [min[0], max[1]]];
    mesh.flat(&Placement::identity(), &corners.map(|[x, y]| Vector3::new(x, y, z)), colour);
}

fn f32_at([x, y]: [f64; 2], z: f32) -> [f32; 3] {
    [x as f32, y as f32, z]
}
