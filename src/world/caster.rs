//! A ball caster in motion.

use super::convert;
use super::ground::{Ground, Touch};
use super::wheel::{BodyState, FloorMotion, Wrench};
use crate::scene::Caster;
use rapier3d::math::Vector;

#[derive(Clone)]
pub(super) struct RunningCaster {
    caster: Caster,
    /// Deflection of its one bristle, in the room.
    bristle: Vector,
}

impl RunningCaster {
    pub(super) fn new(caster: &Caster) -> RunningCaster {
        RunningCaster { caster: caster.clone(), bristle: Vector::ZERO }
    }

    /// Presses the ball on the ground; returns force and moment about the body's mass centre. Its drag is one bristle, as
    /// stiff as the ball is, cut back to `drag_coefficient` times the load.
    pub(super) fn press(&mut self, ground: &Ground, body: &BodyState, floor: &FloorMotion, dt: f64) -> Wrench {
        let caster = &self.caster;
        let centre = body.room_from_base * convert::point(caster.centre);
        let mut wrench = Wrench::default();
        let bristle = &mut self.bristle;
        let mut touched = false;
        ground.touches(centre, Vector::ZERO, caster.radius, 2.0 * caster.radius, |touch| {
            let Touch { point, normal, depth, .. } = touch;
            let velocity = body.velocity_at(point) - floor.velocity_at(point);
            let load = (caster.vertical_stiffness * depth - caster.vertical_damping * velocity.dot(normal)).max(0.0);
            let mut pushed = normal * load;
            if caster.drag_coefficient > 0.0 && !touched {
                let slip = velocity - normal * velocity.dot(normal);
                *bristle -= slip * dt;
                let limit = caster.drag_coefficient * load * ground.grip_ratio(&touch) / caster.vertical_stiffness;
                *bristle = bristle.clamp_length_max(limit);
                pushed += *bristle * caster.vertical_stiffness;
            }
            touched = true;
            wrench.force += pushed;
            wrench.torque += (point - body.mass_centre).cross(pushed);
        });
        if !touched {
            *bristle = Vector::ZERO;
        }
        wrench
    }
}
