//! Triangles for shapes.

use super::look::{LUG, RIM, Rgb, SPOKE};
use crate::scene::{PlacedShape, Placement, Shape};
use nalgebra::{Point3, Vector3};
use rerun::{Color, Mesh3D};
use std::f64::consts::TAU;

/// Facets of a round thing.
const FACETS: usize = 48;
const SPOKES: usize = 6;

/// Triangles with a normal and a colour at each corner.
#[derive(Default)]
pub(super) struct Mesh {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    colours: Vec<Color>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    pub(super) fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    pub(super) fn into_rerun(self) -> Mesh3D {
        Mesh3D::new(self.positions)
            .with_vertex_normals(self.normals)
            .with_vertex_colors(self.colours)
            .with_triangle_indices(self.triangles)
    }

    /// A flat convex outline, counter-clockwise seen from its outside.
    pub(super) fn flat(&mut self, place: &Placement, corners: &[Vector3<f64>], colour: Rgb) {
        let [a, b, c, ..] = corners else { return };
        let normal = (b - a).cross(&(c - a)).try_normalize(1e-12).unwrap_or_else(Vector3::z);
        let first = self.positions.len() as u32;
        for corner in corners {
            self.corner(place, *corner, normal, colour);
        }
        self.triangles.extend((1..corners.len() as u32 - 1).map(|k| [first, first + k, first + k + 1]));
    }

    /// One triangle a row of `triangles`, all facing up and shaded by their own normals.
    pub(super) fn triangle(&mut self, place: &Placement, corners: [Vector3<f64>; 3], colour: Rgb) {
        self.flat(place, &corners, colour);
    }

    /// A shape of a robot.
    pub(super) fn shape(&mut self, shape: &PlacedShape, colour: Rgb) {
        match shape.shape {
            Shape::Box { size } => self.cuboid(&shape.placement, size, colour),
            Shape::Cylinder { radius, length } => self.cylinder(&shape.placement, radius, length, colour),
            Shape::Sphere { radius } => self.sphere(&shape.placement, radius, colour),
        }
    }

    /// A box about its centre.
    pub(super) fn cuboid(&mut self, place: &Placement, size: [f64; 3], colour: Rgb) {
        let half = Vector3::from(size) * 0.5;
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let at = |u: f64, v: f64| {
                    let mut corner = Vector3::zeros();
                    corner[axis] = sign * half[axis];
                    corner[(axis + 1) % 3] = u * half[(axis + 1) % 3];
                    corner[(axis + 2) % 3] = sign * v * half[(axis + 2) % 3];
                    corner
                };
                self.flat(place, &[at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)], colour);
            }
        }
    }

    /// A wedge along x: from a lower edge at the origin up to its full height.
    pub(super) fn wedge(&mut self, place: &Placement, [length, width, height]: [f64; 3], colour: Rgb) {
        let at = |x: f64, side: f64, z: f64| Vector3::new(x * length, 0.5 * side * width, z * height);
        let (r, l) = (-1.0, 1.0);
        self.flat(place, &[at(0.0, r, 0.0), at(1.0, r, 1.0), at(1.0, l, 1.0), at(0.0, l, 0.0)], colour);
        self.flat(place, &[at(1.0, r, 0.0), at(1.0, l, 0.0), at(1.0, l, 1.0), at(1.0, r, 1.0)], colour);
        self.flat(place, &[at(0.0, r, 0.0), at(1.0, r, 0.0), at(1.0, r, 1.0)], colour);
        self.flat(place, &[at(0.0, l, 0.0), at(1.0, l, 1.0), at(1.0, l, 0.0)], colour);
    }

    /// A cylinder along z.
    pub(super) fn cylinder(&mut self, place: &Placement, radius: f64, length: f64, colour: Rgb) {
        self.tread(place, radius, length, |_| colour);
        for top in [true, false] {
            self.ring(place, [0.0, radius], 0.5 * length, top, colour);
        }
    }

    /// A wheel along z in place of a plain cylinder: lugs, a rim, spokes of which one is `mark`ed, so that one sees it turn.
    pub(super) fn wheel(&mut self, place: &Placement, radius: f64, width: f64, tyre: Rgb, mark: Rgb) {
        self.tread(place, radius, width, |facet| {
            if facet == 0 {
                mark
            } else if facet % 4 < 2 {
                tyre
            } else {
                LUG
            }
        });
        let half = 0.5 * width;
        for top in [true, false] {
            self.ring(place, [0.66 * radius, radius], half, top, tyre);
            self.ring(place, [0.0, 0.66 * radius], half, top, RIM.over(tyre, 0.35));
            for spoke in 0..SPOKES {
                let colour = if spoke == 0 { mark } else { SPOKE };
                self.spoke(place, radius, half * 1.01, top, TAU * spoke as f64 / SPOKES as f64, colour);
            }
            self.ring(place, [0.0, 0.16 * radius], half * 1.02, top, SPOKE);
        }
    }

    fn spoke(&mut self, place: &Placement, radius: f64, z: f64, top: bool, angle: f64, colour: Rgb) {
        let at = |along: f64, across: f64| {
            let (sin, cos) = angle.sin_cos();
            let (along, across) = (along * radius, across * radius * if top { 1.0 } else { -1.0 });
            Vector3::new(cos * along - sin * across, sin * along + cos * across, if top { z } else { -z })
        };
        self.flat(place, &[at(0.1, -0.05), at(0.64, -0.045), at(0.64, 0.045), at(0.1, 0.05)], colour);
    }

    /// The lateral surface.
    fn tread(&mut self, place: &Placement, radius: f64, length: f64, colour: impl Fn(usize) -> Rgb) {
        for facet in 0..FACETS {
            let first = self.positions.len() as u32;
            for (step, z) in [(0, -0.5), (1, -0.5), (1, 0.5), (0, 0.5)] {
                let (sin, cos) = angle(facet + step).sin_cos();
                let corner = Vector3::new(radius * cos, radius * sin, z * length);
                self.corner(place, corner, Vector3::new(cos, sin, 0.0), colour(facet));
            }
            self.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        }
    }

    /// A flat ring at height ±`z`.
    fn ring(&mut self, place: &Placement, [inner, outer]: [f64; 2], z: f64, top: bool, colour: Rgb) {
        let z = if top { z } else { -z };
        let normal = Vector3::z() * z.signum();
        let first = self.positions.len() as u32;
        for facet in 0..=FACETS {
            let (sin, cos) = angle(facet).sin_cos();
            for radius in [inner, outer] {
                self.corner(place, Vector3::new(radius * cos, radius * sin, z), normal, colour);
            }
        }
        for facet in 0..FACETS as u32 {
            let k = first + 2 * facet;
            self.triangles.extend([[k, k + 1, k + 3], [k, k + 3, k + 2]]);
        }
    }

    fn sphere(&mut self, place: &Placement, radius: f64, colour: Rgb) {
        let rings = FACETS / 4;
        let first = self.positions.len() as u32;
        for ring in 0..=rings {
            let (rise, level) = (std::f64::consts::PI * (ring as f64 / rings as f64 - 0.5)).sin_cos();
            for facet in 0..=FACETS {
                let (sin, cos) = angle(facet).sin_cos();
                let normal = Vector3::new(level * cos, level * sin, rise);
                self.corner(place, normal * radius, normal, colour);
            }
        }
        let row = FACETS as u32 + 1;
        for ring in 0..rings as u32 {
            for facet in 0..FACETS as u32 {
                let k = first + ring * row + facet;
                self.triangles.extend([[k, k + 1, k + row + 1], [k, k + row + 1, k + row]]);
            }
        }
    }

    fn corner(&mut self, place: &Placement, at: Vector3<f64>, normal: Vector3<f64>, colour: Rgb) {
        self.positions.push(f32s(&place.transform_point(&Point3::from(at)).coords));
        self.normals.push(f32s(&place.transform_vector(&normal)));
        self.colours.push(colour.into());
    }
}

fn angle(facet: usize) -> f64 {
    TAU * facet as f64 / FACETS as f64
}

/// As rerun takes it.
pub(super) fn f32s(vector: &Vector3<f64>) -> [f32; 3] {
    [vector.x as f32, vector.y as f32, vector.z as f32]
}
