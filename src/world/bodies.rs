//! Scene → rapier: bodies, joints and colliders.
//!
//! On patches the robot is one body and its wheels are spins (see `wheel`); the engine's own cylinders are bodies of their
//! own, each on a hinge.

use super::convert;
use super::error::WorldError;
use super::ground::{Ground, Piece};
use crate::geometry::Pose2;
use crate::scene::{Body, Contact, Placement, Robot, Scene, Shape, Wheel};
use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rapier3d::math::{Pose, Rotation, Vector};
use rapier3d::parry::query::intersection_test;
use rapier3d::parry::shape::SharedShape;
use rapier3d::prelude::{
    ActiveHooks, CoefficientCombineRule, Collider, ColliderBuilder, FrictionModel, GenericJoint, MassProperties,
    PhysicsWorld, RevoluteJointBuilder, RigidBodyBuilder, RigidBodyHandle,
};

/// The engine with the robot in it, at rest on the ground.
pub(super) struct Bodies {
    pub physics: PhysicsWorld,
    /// The chassis; on patches the whole robot.
    pub chassis: RigidBodyHandle,
    /// The engine's own wheels, where it has any.
    pub hinged: Vec<RigidBodyHandle>,
}

/// The engine as it is, bit for bit; its pipelines hold nothing but room to work in.
pub(super) fn copied(physics: &PhysicsWorld) -> PhysicsWorld {
    PhysicsWorld {
        gravity: physics.gravity,
        integration_parameters: physics.integration_parameters,
        islands: physics.islands.clone(),
        broad_phase: physics.broad_phase.clone(),
        narrow_phase: physics.narrow_phase.clone(),
        bodies: physics.bodies.clone(),
        colliders: physics.colliders.clone(),
        impulse_joints: physics.impulse_joints.clone(),
        multibody_joints: physics.multibody_joints.clone(),
        soft_bodies: physics.soft_bodies.clone(),
        ..PhysicsWorld::new()
    }
}

/// Builds the engine's bodies for `scene` with the robot's base over `start`.
pub(super) fn build(scene: &Scene, ground: &Ground, start: Pose2) -> Result<Bodies, WorldError> {
    let room_from_base = stand(scene, ground, start)?;
    let robot = &scene.robot;
    refuse_overlap(robot, ground, &room_from_base)?;

    let mut physics = PhysicsWorld::new();
    physics.gravity = convert::vector(scene.floor.gravity());
    let settings = &mut physics.integration_parameters;
    settings.dt = scene.time_step;
    settings.num_solver_iterations = if scene.contact == Contact::Rigid { rounds(robot) } else { 1 };
    settings.contact_recycling = false;
    // One sweep leaves hinges open by about g dt²; two bring the loads of a spinning robot within 0.1 % of each other.
    settings.num_internal_pgs_iterations = 2;
    settings.friction_model = FrictionModel::Coulomb;
    // Sweeps for tunnelling: nothing here moves by its own size in a step, and no body asks for them.
    settings.max_ccd_substeps = 0;
    if scene.contact == Contact::Patch {
        // How near is near, among other things: a chassis a hand above the floor is not worth a look at every step.
        settings.length_unit = 0.1;
    }

    let chassis_friction = scene.floor.plane.map_or(0.3, |plane| plane.chassis_friction);
    for (index, piece) in ground.pieces.iter().enumerate() {
        let (shape, room_from_shape) = match scene.contact {
            Contact::Patch => to_hit(piece),
            Contact::Rigid => (piece.shape.clone(), piece.room_from_shape),
        };
        let collider = ColliderBuilder::new(shape)
            .position(room_from_shape)
            .user_data(index as u128)
            .friction(1.0)
            .friction_combine_rule(CoefficientCombineRule::Multiply);
        physics.insert_collider(collider, None);
    }

    let room_from = |placement: &Placement| convert::pose(&(room_from_base * placement));
    let chassis = match scene.contact {
        Contact::Patch => physics.insert_body(dynamic(convert::pose(&room_from_base), &robot.whole())),
        Contact::Rigid => physics.insert_body(dynamic(convert::pose(&room_from_base), &robot.chassis)),
    };
    for placed in &robot.chassis.collisions {
        physics.insert_collider(solid(&placed.shape, &placed.placement, chassis_friction), Some(chassis));
    }
    let hinged = match scene.contact {
        Contact::Patch => Vec::new(),
        Contact::Rigid => robot
            .wheels
            .iter()
            .map(|wheel| {
                let axle = wheel.axle.into_inner();
                let mut body = wheel.body.clone();
                body.inertia += axle * axle.transpose() * robot.drivetrain.reflected_inertia();
                let handle = physics.insert_body(dynamic(room_from(&wheel.base_from_wheel), &body));
                physics.insert_impulse_joint(chassis, handle, hinge(wheel));
                physics.insert_collider(rigid_tyre(wheel), Some(handle));
                handle
            })
            .collect(),
    };
    // The engine would not know where mass centres are before its first step.
    for body in hinged.iter().chain([&chassis]) {
        physics.bodies[*body].recompute_mass_properties_from_colliders(&physics.colliders);
    }
    Ok(Bodies { physics, chassis, hinged })
}

/// A piece of ground as a chassis hits it. A floor is a slab: a half space would be near everything at every step, and this is
/// near what is low.
pub(super) fn to_hit(piece: &Piece) -> (SharedShape, Pose) {
    let [far, deep] = [1e3, 1.0];
    match piece.obstacle {
        None => (SharedShape::cuboid(far, far, deep), Pose::from_translation(Vector::Z * -deep)),
        Some(_) => (piece.shape.clone(), piece.room_from_shape),
    }
}

fn dynamic(room_from_body: Pose, body: &Body) -> RigidBodyBuilder {
    RigidBodyBuilder::dynamic().pose(room_from_body).can_sleep(false).additional_mass_properties(
        MassProperties::with_inertia_matrix(
            convert::point(body.centre_of_mass),
            body.mass,
            convert::matrix(&body.inertia),
        ),
    )
}

/// Where the base stands so that the lowest tyres bear the robot, squashed as at rest.
fn stand(scene: &Scene, ground: &Ground, start: Pose2) -> Result<Placement, WorldError> {
    let robot = &scene.robot;
    let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), start.heading);
    let over = Placement::from_parts(Translation3::new(start.x, start.y, 0.0), heading);
    let stiffness = robot.wheels.iter().map(|wheel| wheel.tyre.vertical_stiffness).sum::<f64>()
        + robot.casters.iter().map(|caster| caster.vertical_stiffness).sum::<f64>();
    let squash = match scene.contact {
        Contact::Patch => robot.mass() * crate::scene::GRAVITY / stiffness,
        Contact::Rigid => 0.0,
    };
    let mut height = f64::NEG_INFINITY;
    for wheel in &robot.wheels {
        let hub = over * wheel.base_from_wheel.translation.vector;
        let above = if scene.floor.plane.is_some() { wheel.tyre.free_radius } else { 100.0 };
        let ground = ground.height_at(hub.x, hub.y, above).ok_or_else(|| WorldError::NoGround {
            wheel: wheel.name.clone(),
            x: hub.x,
            y: hub.y,
        })?;
        height = height.max(ground + wheel.tyre.free_radius - squash - hub.z);
    }
    Ok(Placement::from_parts(Translation3::new(start.x, start.y, height), heading))
}

/// A robot that shares space with an obstacle at the start would be thrown out of it.
fn refuse_overlap(robot: &Robot, ground: &Ground, room_from_base: &Placement) -> Result<(), WorldError> {
    let chassis = robot.chassis.collisions.iter().map(|placed| {
        let (shape, shape_from_parry) = parry_shape(&placed.shape);
        (robot.chassis.name.clone(), shape, convert::pose(&(room_from_base * placed.placement)) * shape_from_parry)
    });
    let wheels = robot.wheels.iter().map(|wheel| {
        // A tenth smaller, so that a tyre may stand on or touch an obstacle.
        let shape = SharedShape::cylinder(0.45 * wheel.tyre.width, 0.9 * wheel.tyre.free_radius);
        let room_from_wheel = convert::pose(&(room_from_base * wheel.base_from_wheel));
        (format!("wheel `{}`", wheel.name), shape, room_from_wheel * along_axle(wheel))
    });
    for (part, shape, placement) in chassis.chain(wheels) {
        for piece in &ground.pieces {
            let Some(obstacle) = piece.obstacle else { continue };
            let overlap = intersection_test(&piece.room_from_shape, &*piece.shape, &placement, &*shape);
            if overlap.is_ok_and(|overlap| overlap.intersecting) {
                return Err(WorldError::StartsInside { obstacle, part });
            }
        }
    }
    Ok(())
}

/// The engine's rounds of solving a step. A hinge between a heavy chassis and light wheels is solved slowly: one round turns a
/// two-wheel robot whose wheels weigh a 27th of it, straight as it is, by 67 mrad in 2 m, and four by 0.01 mrad.
fn rounds(robot: &Robot) -> usize {
    const HEAVY: f64 = 20.0;
    let lightest = robot.wheels.iter().map(|wheel| wheel.body.mass).fold(f64::INFINITY, f64::min);
    if robot.chassis.mass > HEAVY * lightest { 4 } else { 1 }
}

/// A revolute joint about the wheel's axle; no contacts between wheel and chassis.
fn hinge(wheel: &Wheel) -> GenericJoint {
    let mut joint: GenericJoint =
        RevoluteJointBuilder::new(convert::vector(wheel.axle.into_inner())).contacts_enabled(false).build().into();
    joint.local_frame1 = convert::pose(&wheel.base_from_wheel) * joint.local_frame2;
    joint
}

/// The wheel as the engine's own cylinder with Coulomb friction, on a floor that `carried` knows.
fn rigid_tyre(wheel: &Wheel) -> Collider {
    ColliderBuilder::cylinder(0.5 * wheel.tyre.width, wheel.tyre.free_radius)
        .position(along_axle(wheel))
        .density(0.0)
        .friction(wheel.tyre.friction_along)
        .friction_combine_rule(CoefficientCombineRule::Multiply)
        .active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS)
        .build()
}

/// Parry's cylinders stand along y.
fn along_axle(wheel: &Wheel) -> Pose {
    Pose::from_rotation(Rotation::from_rotation_arc(Vector::Y, convert::vector(wheel.axle.into_inner())))
}

fn solid(shape: &Shape, placement: &Placement, friction: f64) -> Collider {
    let (shape, shape_from_parry) = parry_shape(shape);
    ColliderBuilder::new(shape)
        .position(convert::pose(placement) * shape_from_parry)
        .density(0.0)
        .friction(friction)
        .friction_combine_rule(CoefficientCombineRule::Multiply)
        .build()
}

/// A shape as parry has it, and how parry's stands in ours: URDF's cylinders stand along z, parry's along y.
pub(super) fn parry_shape(shape: &Shape) -> (SharedShape, Pose) {
    match *shape {
        Shape::Box { size: [x, y, z] } => (SharedShape::cuboid(0.5 * x, 0.5 * y, 0.5 * z), Pose::identity()),
        Shape::Sphere { radius } => (SharedShape::ball(radius), Pose::identity()),
        Shape::Cylinder { radius, length } => (
            SharedShape::cylinder(0.5 * length, radius),
            Pose::from_rotation(Rotation::from_rotation_arc(Vector::Y, Vector::Z)),
        ),
    }
}
