//! A robot on its tyres, moved on without the engine's pipeline where nothing is near its chassis.
//!
//! For one body that touches nothing the engine's step, which looks for neighbours, keeps islands and readies its solver, comes
//! to a few lines, and takes more time than all of the robot's tyres. They stand here, on the engine's own body and in its
//! order of arithmetic, so that it makes no difference to a bit which of the two moves the robot.

use super::bodies::{self, parry_shape};
use super::convert;
use super::ground::{Ground, Piece};
use crate::scene::Robot;
use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::parry::bounding_volume::{Aabb, BoundingVolume};
use rapier3d::prelude::{PhysicsWorld, RigidBody, RigidBodyHandle};

/// What is nearer than this to the chassis is left to the engine, which foresees contacts over a fifth of it \[m\].
const NEAR: f64 = 0.01;

/// The chassis and what it might hit, as boxes.
#[derive(Clone)]
pub(super) struct Alone {
    /// About all of the chassis that is solid, in the base; `None`: nothing is.
    chassis: Option<Aabb>,
    /// About each piece of the ground, in the room.
    ground: Vec<Aabb>,
}

impl Alone {
    pub(super) fn new(robot: &Robot, ground: &Ground) -> Alone {
        let to_hit = |piece: &Piece| {
            let (shape, room_from_shape) = bodies::to_hit(piece);
            shape.compute_aabb(&room_from_shape)
        };
        let solid = robot.chassis.collisions.iter().map(|placed| {
            let (shape, shape_from_parry) = parry_shape(&placed.shape);
            shape.compute_aabb(&(convert::pose(&placed.placement) * shape_from_parry))
        });
        Alone {
            chassis: solid.reduce(|one, other| one.merged(&other)),
            ground: ground.pieces.iter().map(|piece| to_hit(piece).loosened(NEAR)).collect(),
        }
    }

    /// Moves the robot on by a step, unless that would bring it near anything: then nothing is done, and `false` returned.
    pub(super) fn step(&self, physics: &mut PhysicsWorld, robot: RigidBodyHandle) -> bool {
        let (gravity, dt) = (physics.gravity, physics.integration_parameters.dt);
        let body = &mut physics.bodies[robot];
        let (old_velocity, old_spin) = (body.linvel(), body.angvel());
        let moved = fly(body, gravity, dt);
        let clear = moved.is_finite() && !self.is_near(&moved);
        if clear {
            body.set_position(moved, false);
        } else {
            body.set_linvel(old_velocity, false);
            body.set_angvel(old_spin, false);
        }
        clear
    }

    fn is_near(&self, room_from_base: &Pose) -> bool {
        let Some(chassis) = &self.chassis else { return false };
        let here = chassis.transform_by(room_from_base);
        self.ground.iter().any(|piece| piece.intersects(&here))
    }
}

/// Gives a body the velocities that it has after a step under `gravity` and what pushes on it; returns where these take it.
/// (Forces, then the gyroscopic moment with the angular momentum's size kept, then symplectic Euler about the mass centre.)
fn fly(body: &mut RigidBody, gravity: Vector, dt: f64) -> Pose {
    let properties = body.mass_properties();
    let to_mass_centre = properties.local_mprops.local_com;
    let force = body.user_force() + gravity * properties.effective_mass() * body.gravity_scale();
    let velocity = body.linvel() + force * properties.effective_inv_mass * dt;
    let spin = body.angvel() + properties.effective_world_inv_inertia * body.user_torque() * dt;
    body.set_linvel(velocity, false);
    body.set_angvel(spin, false);
    body.set_angvel(body.angvel_with_gyroscopic_forces(dt), false);
    let mut pose = body.position().prepend_translation(to_mass_centre);
    let half = body.angvel() * (dt * 0.5);
    pose.rotation = (Rotation::from_xyzw(half.x, half.y, half.z, 1.0) * pose.rotation).normalize();
    pose.translation += body.linvel() * dt;
    pose.prepend_translation(-to_mass_centre)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;
    use crate::scene::{Placement, Scene};
    use nalgebra::Translation3;

    /// A robot that is pushed and turned about in all directions, by the engine and by the lines above, is in the same place at
    /// the same velocities after 400 steps, bit for bit; its mass centre is not its origin, and its axes lie askew.
    #[test]
    fn a_step_without_the_pipeline_is_the_engines_own() {
        let mut scene = Scene::load("jnpf_4wd", "lab_floor").expect("shipped");
        let chassis = &mut scene.robot.chassis;
        chassis.centre_of_mass += nalgebra::Vector3::new(0.02, -0.03, 0.05);
        chassis.inertia[(0, 1)] = 0.2 * chassis.inertia[(0, 0)];
        chassis.inertia[(1, 0)] = chassis.inertia[(0, 1)];
        // High over everything.
        for wheel in &mut scene.robot.wheels {
            wheel.base_from_wheel =
                Placement::from_parts(Translation3::new(0.0, 0.0, -30.0), wheel.base_from_wheel.rotation);
        }
        let ground = Ground::new(&scene.floor);
        let build = || bodies::build(&scene, &ground, Pose2::new(0.3, -0.2, 0.7)).expect("it stands");
        let (mut by_engine, mut by_us) = (build(), build());
        let alone = Alone::new(&scene.robot, &ground);
        for step in 0..400 {
            let by = |rate: f64| f64::sin(rate * f64::from(step));
            let force = Vector::new(by(0.11), by(0.13), by(0.017)) * 90.0;
            let torque = Vector::new(by(0.07), by(0.19), by(0.023)) * 9.0;
            for one in [&mut by_engine, &mut by_us] {
                let body = &mut one.physics.bodies[one.chassis];
                body.reset_forces(false);
                body.reset_torques(false);
                body.add_force(force, false);
                body.add_torque(torque, false);
            }
            by_engine.physics.step();
            assert!(alone.step(&mut by_us.physics, by_us.chassis), "near something in step {step}");
            let [engine, us] = [&by_engine, &by_us].map(|one| {
                let body = &one.physics.bodies[one.chassis];
                (*body.position(), body.linvel(), body.angvel(), body.center_of_mass())
            });
            assert_eq!(engine, us, "step {step}");
        }
        let spin = by_us.physics.bodies[by_us.chassis].angvel();
        assert!(spin.length() > 0.5, "{spin}");
    }
}
