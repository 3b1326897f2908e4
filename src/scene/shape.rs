//! Rigid bodies and their shapes.

use nalgebra::{Isometry3, Matrix3, Point3};

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
