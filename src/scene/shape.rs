//! Rigid bodies and their shapes.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

/// Where one frame stands in another, in space.
pub type Placement = Isometry3<f64>;

/// A solid shape about its own origin.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Full edge lengths \[m\].
    Box {
        /// x, y, z \[m\].
        size: [f64; 3],
    },
    /// Axis along z, as URDF has it.
    Cylinder {
        /// \[m\]
        radius: f64,
        /// \[m\]
        length: f64,
    },
    /// A ball.
    Sphere {
        /// \[m\]
        radius: f64,
    },
}

/// A shape in the frame of its body.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedShape {
    /// The shape.
    pub shape: Shape,
    /// body_from_shape.
    pub placement: Placement,
    /// Colour, linear RGBA 0..1, where the URDF gives one.
    pub colour: Option<[f64; 4]>,
}

impl PlacedShape {
    /// How low it reaches in the frame of its body \[m\].
    pub(super) fn lowest(&self) -> f64 {
        let up = self.placement.rotation.inverse() * Vector3::z();
        let reach = match self.shape {
            Shape::Box { size } => 0.5 * (0..3).map(|axis| size[axis] * up[axis].abs()).sum::<f64>(),
            Shape::Cylinder { radius, length } => 0.5 * length * up.z.abs() + radius * up.x.hypot(up.y),
            Shape::Sphere { radius } => radius,
        };
        self.placement.translation.z - reach
    }
}

/// A rigid body: one or several URDF links, joined firmly.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name of its first link.
    pub name: String,
    /// \[kg\]
    pub mass: f64,
    /// In the body frame \[m\].
    pub centre_of_mass: Point3<f64>,
    /// About the centre of mass, axes of the body frame \[kg m²\].
    pub inertia: Matrix3<f64>,
    /// What it looks like.
    pub visuals: Vec<PlacedShape>,
    /// What it hits things with.
    pub collisions: Vec<PlacedShape>,
}

impl Body {
    /// An empty body without mass.
    pub(super) fn empty(name: &str) -> Self {
        Body {
            name: name.to_owned(),
            mass: 0.0,
            centre_of_mass: Point3::origin(),
            inertia: Matrix3::zeros(),
            visuals: Vec::new(),
            collisions: Vec::new(),
        }
    }

    /// Joins a mass with inertia `inertia` about its own centre `centre`, both in this body's frame: masses add, and the
    /// parallel-axis theorem moves both inertias to the common centre.
    pub(super) fn add_mass(&mut self, mass: f64, centre: Point3<f64>, inertia: Matrix3<f64>) {
        let total = self.mass + mass;
        if total <= 0.0 {
            return;
        }
        let common = Point3::from((self.centre_of_mass.coords * self.mass + centre.coords * mass) / total);
        let moved = |mass: f64, from: Point3<f64>| {
            let r = common - from;
            (Matrix3::identity() * r.norm_squared() - r * r.transpose()) * mass
        };
        self.inertia += inertia + moved(self.mass, self.centre_of_mass) + moved(mass, centre);
        self.mass = total;
        self.centre_of_mass = common;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion};
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, SQRT_2};

    #[test]
    fn shapes_reach_as_low_as_they_do() {
        let lowest = |shape, roll| {
            let rotation = UnitQuaternion::from_euler_angles(roll, 0.0, 0.3);
            let placement = Placement::from_parts(Translation3::new(1.0, 2.0, 0.5), rotation);
            PlacedShape { shape, placement, colour: None }.lowest()
        };
        let (cube, cylinder) = (Shape::Box { size: [0.2; 3] }, Shape::Cylinder { radius: 0.1, length: 0.6 });
        for (shape, roll, expected) in [
            (cube.clone(), 0.0, 0.4),
            (cube, FRAC_PI_4, 0.5 - 0.1 * SQRT_2),
            (cylinder.clone(), 0.0, 0.2),
            (cylinder, FRAC_PI_2, 0.4),
            (Shape::Sphere { radius: 0.2 }, 1.0, 0.3),
        ] {
            assert!((lowest(shape.clone(), roll) - expected).abs() < 1e-12, "{shape:?}");
        }
    }
}
