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
    /// Of its fork against the chassis \[rad\]; none before it has touched ground, nor of a ball.
    angle: Option<f64>,
}

/// Speed of a pivot from which on a run has begun in motion \[m/s\].
const MOVING: f64 = 1e-3;

impl RunningCaster {
    pub(super) fn new(caster: &Caster) -> RunningCaster {
        RunningCaster { caster: caster.clone(), bristle: Vector::ZERO, angle: None }
    }

    /// base_from_fork, if it has one.
    pub(super) fn fork(&self) -> Option<Placement> {
        self.caster.swivel.as_ref()?;
        let turned = UnitQuaternion::from_euler_angles(0.0, 0.0, self.angle.unwrap_or(0.0));
        Some(Placement::from_parts(self.caster.pivot().coords.into(), turned))
    }

    /// Presses it on the ground; returns force and moment about the body's mass centre. Its drag is one bristle, as stiff as it
    /// is upright, cut back to `drag_coefficient` times the load.
    pub(super) fn press(&mut self, ground: &Ground, body: &BodyState, floor: &FloorMotion, dt: f64) -> Wrench {
        if self.caster.swivel.is_some() && self.angle.is_none() {
            self.angle = Some(self.first_angle(body, floor));
        }
        let caster = &self.caster;
        let steered = self.angle.as_mut().zip(caster.swivel.as_ref());
        let mut steered =
            steered.map(|(angle, swivel)| (Vector::new(angle.cos(), angle.sin(), 0.0), angle, swivel.trail));
        let centre = match &steered {
            Some((ahead, _, trail)) => convert::point(caster.pivot()) - *ahead * *trail,
            None => convert::point(caster.centre),
        };
        let centre = body.room_from_base * centre;
        let mut wrench = Wrench::default();
        let bristle = &mut self.bristle;
        let mut touched = false;
        ground.touches(centre, Vector::ZERO, caster.radius, 2.0 * caster.radius, |touch| {
            let Touch { point, normal, depth, .. } = touch;
            let velocity = body.velocity_at(point) - floor.velocity_at(point);
            let load = (caster.vertical_stiffness * depth - caster.vertical_damping * velocity.dot(normal)).max(0.0);
            let mut pushed = normal * load;
            if !touched {
                let mut slip = velocity - normal * velocity.dot(normal);
                if let Some((ahead, angle, trail)) = &mut steered {
                    let ahead = body.room_from_base.rotation * *ahead;
                    let along = (ahead - normal * ahead.dot(normal)).normalize();
                    **angle += slip.dot(normal.cross(along)) * dt / *trail;
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

    /// Where its fork points as a run begins: straight ahead at rest, and in motion as on a circle that has been driven for long.
    fn first_angle(&self, body: &BodyState, floor: &FloorMotion) -> f64 {
        let trail = self.caster.swivel.as_ref().map_or(0.0, |swivel| swivel.trail);
        let pivot = body.room_from_base * convert::point(self.caster.pivot());
        let moved = body.room_from_base.rotation.inverse() * (body.velocity_at(pivot) - floor.velocity_at(pivot));
        let speed = moved.x.hypot(moved.y);
        if speed < MOVING {
            return 0.0;
        }
        let yaw_rate = body.spin.z - floor.yaw_rate;
        moved.y.atan2(moved.x) - (trail * yaw_rate / speed).clamp(-1.0, 1.0).asin()
    }
}
