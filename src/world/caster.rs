//! A caster in motion: a ball that drags, or a wheel that trails behind its pivot.
//!
//! A trailing wheel rolls and does not slip sideways, and its bearing turns freely: no force on it but the drag along it. Its
//! contact moves across by what the pivot does, less what the fork turns, which makes the angle of the fork against the chassis
//! obey φ̇ = v/t, with v the velocity to the left that the contact would have on a fork held fast, and t the trail. On a straight
//! it dies out as e^(−x/t), on a circle it settles where the pivot's path is tangent to its wheel: the tractrix.

use super::convert;
use super::ground::{Ground, Touch};
use super::wheel::{BodyState, FloorMotion, Wrench};
use crate::scene::{Caster, Placement};
use nalgebra::UnitQuaternion;
use rapier3d::math::Vector;

#[derive(Clone)]
pub(super) struct RunningCaster {
    caster: Caster,
    /// Deflection of its one bristle, in the room.
    bristle: Vector,
    /// Of its fork against the chassis \[rad\]; a ball has none.
    angle: f64,
}

impl RunningCaster {
    pub(super) fn new(caster: &Caster) -> RunningCaster {
        RunningCaster { caster: caster.clone(), bristle: Vector::ZERO, angle: 0.0 }
    }

    /// base_from_fork, if it has one.
    pub(super) fn fork(&self) -> Option<Placement> {
        self.caster.swivel.as_ref()?;
        let turned = UnitQuaternion::from_euler_angles(0.0, 0.0, self.angle);
        Some(Placement::from_parts(self.caster.pivot().coords.into(), turned))
    }

    /// Presses it on the ground; returns force and moment about the body's mass centre. Its drag is one bristle, as stiff as it
    /// is upright, cut back to `drag_coefficient` times the load.
    pub(super) fn press(&mut self, ground: &Ground, body: &BodyState, floor: &FloorMotion, dt: f64) -> Wrench {
        let RunningCaster { caster, bristle, angle } = self;
        let ahead = Vector::new(angle.cos(), angle.sin(), 0.0);
        let centre = match &caster.swivel {
            Some(swivel) => convert::point(caster.pivot()) - ahead * swivel.trail,
            None => convert::point(caster.centre),
        };
        let centre = body.room_from_base * centre;
        let mut wrench = Wrench::default();
        let mut touched = false;
        ground.touches(centre, Vector::ZERO, caster.radius, 2.0 * caster.radius, |touch| {
            let Touch { point, normal, depth, .. } = touch;
            let velocity = body.velocity_at(point) - floor.velocity_at(point);
            let load = (caster.vertical_stiffness * depth - caster.vertical_damping * velocity.dot(normal)).max(0.0);
            let mut pushed = normal * load;
            if !touched {
                let mut slip = velocity - normal * velocity.dot(normal);
                if let Some(swivel) = &caster.swivel {
                    let ahead = body.room_from_base.rotation * ahead;
                    let along = (ahead - normal * ahead.dot(normal)).normalize();
                    *angle += slip.dot(normal.cross(along)) * dt / swivel.trail;
                    slip = along * slip.dot(along);
                    *bristle = along * bristle.dot(along);
                }
                if caster.drag_coefficient > 0.0 {
                    *bristle -= slip * dt;
                    let limit = caster.drag_coefficient * load * ground.grip_ratio(&touch) / caster.vertical_stiffness;
                    *bristle = bristle.clamp_length_max(limit);
                    pushed += *bristle * caster.vertical_stiffness;
                }
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
