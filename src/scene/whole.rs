//! The whole robot as one rigid body whose wheels only turn about their axles.

use super::robot::{Robot, Wheel};
use super::shape::Body;
use nalgebra::{Matrix3, Point3};

/// A wheel's mass as it is on the mean over a turn: its centre on the axle, its inertia round about it.
///
/// Known difference: an unbalanced wheel shakes; this one does not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoundWheel {
    /// J, about the axle, rotor not included \[kg m²\].
    pub spin_inertia: f64,
    /// About any line through the mass centre across the axle \[kg m²\].
    pub cross_inertia: f64,
    /// In the wheel frame, on the axle through its origin.
    pub centre_of_mass: Point3<f64>,
}

impl Wheel {
    /// Its mass on the mean over a turn.
    pub fn round(&self) -> RoundWheel {
        let axle = self.axle.into_inner();
        let centre = self.body.centre_of_mass.coords;
        let on_axle = axle * axle.dot(&centre);
        let moved = self.body.mass * (centre - on_axle).norm_squared();
        let spin_inertia = self.spin_inertia() + moved;
        // An inertia's trace about a point that lies r aside is 2 m r² greater.
        let cross_inertia = 0.5 * (self.body.inertia.trace() + 2.0 * moved - spin_inertia);
        RoundWheel { spin_inertia, cross_inertia, centre_of_mass: on_axle.into() }
    }
}

impl Robot {
    /// The robot as one body in the base frame, without shapes: its inertia has no part of the wheels' about their own axles,
    /// along which they turn freely.
    pub fn whole(&self) -> Body {
        let mut whole = Body::empty(&self.name);
        whole.add_mass(self.chassis.mass, self.chassis.centre_of_mass, self.chassis.inertia);
        for wheel in &self.wheels {
            let round = wheel.round();
            let axle = wheel.axle_in_base().into_inner();
            let inertia = (Matrix3::identity() - axle * axle.transpose()) * round.cross_inertia;
            whole.add_mass(wheel.body.mass, wheel.base_from_wheel * round.centre_of_mass, inertia);
        }
        whole
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::Robot;
    use nalgebra::{Matrix3, Vector3};

    /// What the parallel-axis theorem says of an off-axle mass, by moving it round the axle in steps and taking means.
    #[test]
    fn a_round_wheel_is_the_mean_over_a_turn() {
        let mut wheel = Robot::load("husky_a200").expect("shipped").wheels.remove(0);
        wheel.body.centre_of_mass += Vector3::new(0.01, 0.02, -0.015);
        wheel.body.inertia[(0, 0)] *= 1.3;
        let round = wheel.round();
        let axle = wheel.axle.into_inner();
        // About the point of the axle beside the mass centre.
        let r = wheel.body.centre_of_mass - round.centre_of_mass;
        let there = wheel.body.inertia + (Matrix3::identity() * r.norm_squared() - r * r.transpose()) * wheel.body.mass;
        let mut mean = Matrix3::zeros();
        for part in 0..8 {
            let turn = nalgebra::Rotation3::new(axle * (std::f64::consts::FRAC_PI_4 * f64::from(part)));
            mean += turn * there * turn.transpose() / 8.0;
        }
        let along = axle * axle.transpose();
        let expected = along * round.spin_inertia + (Matrix3::identity() - along) * round.cross_inertia;
        assert!((mean - expected).norm() < 1e-12);
        assert!(r.dot(&axle).abs() < 1e-15);
    }

    #[test]
    fn the_whole_has_the_robots_mass() {
        let robot = Robot::load("jnpf_4wd").expect("shipped");
        assert!((robot.whole().mass - robot.mass()).abs() < 1e-12);
    }
}
