//! Scene → rapier: bodies and joints, ground queries, tyre patches, drivetrains, encoders; one step at a time.
//!
//! A step, in order: encoders are read and speed loops run, each at its rate; every tyre's patch is carried on and its
//! force, with drivetrain torque on wheel and chassis, given to wheels' spins and to the engine; the engine moves the robot's
//! body (velocities first, then positions with the new velocities: symplectic Euler, first order in the step), or, where nothing
//! is near it, `alone` does, to the same bits.
//!
//! rapier and parry stay in this room, and glam with them.

mod alone;
mod bodies;
mod carried;
mod caster;
mod convert;
mod drivetrain;
mod error;
mod ground;
mod patch;
mod snapshot;
mod unevenness;
mod wheel;

pub use error::WorldError;
pub use patch::{BRISTLE_DAMPING, CELLS_ACROSS, CELLS_ALONG, Patch, PatchForce, PatchMotion};
pub use snapshot::{PatchSnapshot, WheelSnapshot};

use crate::geometry::{Pose2, Twist2, unwrap_near, wrap_angle};
use crate::scene::{Contact, EmpiricalTerm, GripRegion, Motion, Placement, Scene};
use alone::Alone;
use carried::CarriedContacts;
use caster::RunningCaster;
pub use drivetrain::Play;
use ground::Ground;
use nalgebra::UnitQuaternion;
use rand_chacha::ChaCha8Rng;
use rapier3d::math::Vector;
use rapier3d::prelude::{PhysicsWorld, RigidBody, RigidBodyHandle};
use unevenness::Unevenness;
use wheel::{BodyState, FloorMotion, Mount, RunningWheel, Wrench};

/// Time over which the speed is smoothed before an acceleration is taken of it \[s\].
const SMOOTHING: f64 = 0.05;

/// Lean of the chassis beyond which the robot has tipped over: cos 60°.
const TIPPED: f64 = 0.5;

/// A running world: one robot on one floor. A copy goes on as the original does, bit for bit.
pub struct World {
    scene: Scene,
    ground: Ground,
    physics: PhysicsWorld,
    alone: Alone,
    chassis: RigidBodyHandle,
    wheels: Vec<RunningWheel>,
    casters: Vec<RunningCaster>,
    unevenness: Option<Unevenness>,
    encoder_period: u64,
    loop_period: u64,
    steps: u64,
    heading: f64,
    /// Forward speed, smoothed, from which empirical terms take an acceleration \[m/s\].
    smooth_speed: f64,
}

impl Clone for World {
    fn clone(&self) -> World {
        World {
            scene: self.scene.clone(),
            ground: self.ground.clone(),
            physics: bodies::copied(&self.physics),
            alone: self.alone.clone(),
            chassis: self.chassis,
            wheels: self.wheels.clone(),
            casters: self.casters.clone(),
            unevenness: self.unevenness.clone(),
            ..*self
        }
    }
}

impl World {
    /// Puts the scene's robot over `start` in the room, at rest; `scatter` draws this run's uneven floor.
    ///
    /// # Errors
    /// No ground beneath a wheel, an obstacle in the robot's place, a rate that is no whole number of steps.
    pub fn new(scene: &Scene, start: Pose2, scatter: ChaCha8Rng) -> Result<World, WorldError> {
        let robot = &scene.robot;
        let encoder_period = steps_between("the encoder's rate_hz", robot.encoder.rate, scene.time_step)?;
        let loop_period = steps_between("the drivetrain's loop_rate_hz", robot.drivetrain.loop_rate, scene.time_step)?;
        let ground = Ground::new(&scene.floor);
        let bodies = bodies::build(scene, &ground, start)?;
        let hinged = |index: usize| bodies.hinged.get(index).copied();
        let wheels = robot.wheels.iter().enumerate();
        let wheels = wheels.map(|(index, wheel)| RunningWheel::new(robot, wheel, hinged(index))).collect();
        let casters = robot.casters.iter().map(RunningCaster::new).collect();
        Ok(World {
            unevenness: Unevenness::new(scene.scatter, 0.5 * robot.track_width(), scatter),
            scene: scene.clone(),
            alone: Alone::new(robot, &ground),
            ground,
            physics: bodies.physics,
            chassis: bodies.chassis,
            wheels,
            casters,
            encoder_period,
            loop_period,
            steps: 0,
            heading: start.heading,
            smooth_speed: 0.0,
        })
    }

    /// Moves the world on by one step.
    ///
    /// # Errors
    /// The robot tipped over, fell, or the numbers are no longer finite.
    pub fn step(&mut self) -> Result<(), WorldError> {
        self.control();
        let motion = self.motion();
        let floor = self.floor_motion(&motion);
        self.apply_forces(&motion, floor);
        match self.scene.contact {
            Contact::Patch if self.alone.step(&mut self.physics, self.chassis) => {}
            Contact::Patch => self.physics.step(),
            Contact::Rigid => {
                self.physics.step_with_events(&CarriedContacts { ground: &self.ground, motion: floor }, &())
            }
        }
        self.steps += 1;
        self.read_angles();
        self.check()
    }

    /// From now on these regions of the floor's plane grip otherwise, and no others.
    pub fn set_regions(&mut self, regions: &[GripRegion]) {
        self.scene.floor.regions = regions.to_vec();
        self.ground.set_regions(regions);
    }

    /// Simulated time \[s\].
    pub fn time(&self) -> f64 {
        self.steps as f64 * self.scene.time_step
    }

    /// Steps so far.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// What this world was built from.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Asks the speed loop of a wheel for `speed` \[rad/s\], positive forward.
    pub fn command(&mut self, wheel: usize, speed: f64) {
        self.wheels[wheel].commanded_speed = speed;
    }

    /// Makes a wheel follow a log: at the end of the next step its counted side, which is the wheel where nothing winds up,
    /// is to stand at `angle` \[rad\]. The torque that this takes acts on wheel and chassis, as a motor's would.
    pub fn follow(&mut self, wheel: usize, angle: f64) {
        self.wheels[wheel].follows = Some(angle);
    }

    /// Gives a wheel that followed back to its motor.
    pub fn release(&mut self, wheel: usize) {
        self.wheels[wheel].follows = None;
    }

    /// What the controller has got from a wheel's encoder: quantised, and late by the latency.
    pub fn ticks(&self, wheel: usize) -> i64 {
        self.wheels[wheel].ticks
    }

    /// What a wheel's encoder counts now, as a log stamps it.
    pub fn ticks_now(&self, wheel: usize) -> i64 {
        let wheel = &self.wheels[wheel];
        wheel.counter.count(wheel.encoder_angle)
    }

    /// Rotation of a wheel against the chassis since the start \[rad\].
    pub fn wheel_angle(&self, wheel: usize) -> f64 {
        self.wheels[wheel].angle
    }

    /// Rotation of the side of a wheel's drivetrain that is counted, which is the wheel's where nothing winds up, since the
    /// start \[rad\].
    pub fn counted_angle(&self, wheel: usize) -> f64 {
        self.wheels[wheel].counted_angle()
    }

    /// Rate of [`World::wheel_angle`] \[rad/s\].
    pub fn wheel_speed(&self, wheel: usize) -> f64 {
        self.wheels[wheel].speed
    }

    /// room_from_base.
    pub fn base(&self) -> Placement {
        convert::placement(self.chassis().position())
    }

    /// True pose of the base in the plane of the room; heading unwrapped.
    pub fn pose(&self) -> Pose2 {
        let at = self.chassis().translation();
        Pose2::new(at.x, at.y, self.heading)
    }

    /// True velocity of the base in its own frame, in the plane of the room.
    pub fn twist(&self) -> Twist2 {
        let chassis = self.chassis();
        let velocity = chassis.velocity_at_point(chassis.translation());
        let (sin, cos) = self.heading.sin_cos();
        Twist2 {
            forward: velocity.x * cos + velocity.y * sin,
            left: velocity.y * cos - velocity.x * sin,
            yaw_rate: chassis.angvel().z,
        }
    }

    /// Fills `out` with the state of every wheel.
    pub fn wheel_snapshots(&self, out: &mut Vec<WheelSnapshot>) {
        out.clear();
        out.extend((0..self.wheels.len()).map(|index| self.wheel_snapshot(index)));
    }

    /// Fills `out` with room_from_fork of every caster that swivels.
    pub fn forks(&self, out: &mut Vec<Placement>) {
        out.clear();
        let base = self.base();
        out.extend(self.casters.iter().filter_map(RunningCaster::fork).map(|fork| base * fork));
    }

    fn wheel_snapshot(&self, index: usize) -> WheelSnapshot {
        let running = &self.wheels[index];
        let wheel = &self.scene.robot.wheels[index];
        let main =
            running.contacts.iter().filter(|contact| contact.live).max_by(|one, other| one.load.total_cmp(&other.load));
        WheelSnapshot {
            placement: match running.mount {
                Mount::Turning(_) => {
                    let turned = UnitQuaternion::from_axis_angle(&wheel.axle, running.angle);
                    self.base() * wheel.base_from_wheel * turned
                }
                Mount::Hinged(handle) => convert::placement(self.physics.bodies[handle].position()),
            },
            angle: running.angle,
            speed: running.speed,
            commanded_speed: running.commanded_speed,
            ticks: self.ticks_now(index),
            motor_torque: running.motor_torque,
            load: running.load,
            force_along: running.force[0],
            force_across: running.force[1],
            slip_along: running.slip[0],
            slip_across: running.slip[1],
            patch: main.map(|contact| PatchSnapshot {
                centre: contact.place.centre.to_array(),
                along: contact.place.along.to_array(),
                across: contact.place.across.to_array(),
                half_length: contact.patch.half_length(),
                width: wheel.tyre.width,
                tractions: contact.patch.tractions(&wheel.tyre),
            }),
        }
    }

    fn chassis(&self) -> &RigidBody {
        &self.physics.bodies[self.chassis]
    }

    /// Encoders and speed loops, each at its rate.
    fn control(&mut self) {
        let read = self.steps.is_multiple_of(self.encoder_period);
        let run_loop = self.steps.is_multiple_of(self.loop_period);
        for wheel in &mut self.wheels {
            if read {
                wheel.ticks = wheel.counter.read(wheel.encoder_angle);
                wheel.prompt_ticks = wheel.counter.count(wheel.encoder_angle);
            }
            if run_loop {
                // The speed loop sits at the encoder; what is late is the way from there to the controller. A loop as quick
                // as this one would shake the robot on counts a twentieth of a second old.
                let drivetrain = &self.scene.robot.drivetrain;
                wheel.voltage = wheel.speed_loop.voltage(drivetrain, wheel.commanded_speed, wheel.prompt_ticks);
            }
        }
    }

    /// Tyres, casters and drivetrains push on the bodies.
    fn apply_forces(&mut self, motion: &Motion, floor: FloorMotion) {
        let dt = self.scene.time_step;
        let body = BodyState::of(self.chassis());
        let base = body.room_from_base.translation;
        let mut on_body = Wrench::default();
        let robot = &self.scene.robot;
        for (running, wheel) in self.wheels.iter_mut().zip(&robot.wheels) {
            match running.mount {
                Mount::Turning(_) => on_body += running.advance(robot, wheel, &self.ground, &body, &floor, dt),
                Mount::Hinged(handle) => {
                    let inertia = wheel.spin_inertia() + robot.drivetrain.reflected_inertia();
                    let drive = running.axle_in_room(&body.room_from_base) * running.drive(robot, inertia, 0.0, dt);
                    push(&mut self.physics.bodies[handle], Wrench { force: Vector::ZERO, torque: drive });
                    on_body.torque -= drive;
                }
            }
        }
        if let Some(tether) = &self.scene.tether {
            let [x, y, z] = tether.anchor;
            let pull = (Vector::new(x, y, z) - base).normalize() * tether.pull;
            on_body += Wrench { force: pull, torque: (base - body.mass_centre).cross(pull) };
        }
        if !self.scene.empirical.is_empty() {
            let [x, y] = EmpiricalTerm::force(&self.scene.empirical, motion.pose);
            on_body += Wrench { force: Vector::new(x, y, 0.0), torque: Vector::ZERO };
        }
        for caster in &mut self.casters {
            on_body += caster.press(&self.ground, &body, &floor, dt);
        }
        push(&mut self.physics.bodies[self.chassis], on_body);
    }

    /// How the floor moves in the coming step, under a body that moves so.
    fn floor_motion(&mut self, motion: &Motion) -> FloorMotion {
        let floor = self.floor_twist(motion);
        let room_from_base = self.chassis().position();
        let forward = room_from_base.rotation * Vector::X;
        let velocity = forward * floor.forward + Vector::Z.cross(forward) * floor.left;
        FloorMotion { base: room_from_base.translation, velocity, yaw_rate: floor.yaw_rate }
    }

    /// The motion that an uneven floor and empirical terms are made of, as far as there are any.
    fn motion(&mut self) -> Motion {
        if self.unevenness.is_none() && self.scene.empirical.is_empty() {
            return Motion::default();
        }
        let chassis = self.chassis();
        let forward = *chassis.rotation() * Vector::X;
        let velocity = chassis.velocity_at_point(chassis.translation());
        let twist = Twist2 { forward: velocity.dot(forward), left: 0.0, yaw_rate: chassis.angvel().z };
        if self.scene.empirical.is_empty() {
            return Motion { twist, ..Motion::default() };
        }
        let acceleration = (twist.forward - self.smooth_speed) / SMOOTHING;
        self.smooth_speed += acceleration * self.scene.time_step;
        Motion { twist, pose: self.pose(), time: self.time(), acceleration }
    }

    /// The twist of the floor under the tyres: an uneven floor's, and that of empirical terms.
    fn floor_twist(&mut self, motion: &Motion) -> Twist2 {
        let dt = self.scene.time_step;
        let mut floor = self.unevenness.as_mut().map_or_else(Twist2::default, |floor| floor.twist(motion.twist, dt));
        let extra = EmpiricalTerm::twist(&self.scene.empirical, motion);
        floor.forward += extra.forward;
        floor.left += extra.left;
        floor.yaw_rate += extra.yaw_rate;
        floor
    }

    /// Rotation of each wheel against the chassis, and heading.
    fn read_angles(&mut self) {
        let dt = self.scene.time_step;
        let chassis = &self.physics.bodies[self.chassis];
        for (running, wheel) in self.wheels.iter_mut().zip(&self.scene.robot.wheels) {
            match running.mount {
                Mount::Turning(_) => running.follow_body(chassis, dt),
                Mount::Hinged(handle) => {
                    let body = &self.physics.bodies[handle];
                    let axle = running.axle_in_room(chassis.position());
                    let speed = (body.angvel() - chassis.angvel()).dot(axle);
                    let at_zero = *chassis.rotation() * convert::pose(&wheel.base_from_wheel).rotation;
                    let turned = at_zero.inverse() * *body.rotation();
                    let sine = Vector::new(turned.x, turned.y, turned.z).dot(convert::vector(wheel.axle.into_inner()));
                    running.turned(speed, wrap_angle(2.0 * sine.atan2(turned.w) - running.angle));
                    // The engine's own contacts: load only.
                    let colliders = body.colliders().iter();
                    let pairs = colliders.flat_map(|&collider| self.physics.contact_pairs_with(collider));
                    running.load = pairs.map(|pair| pair.total_impulse().length() / dt).sum();
                }
            }
        }
        let forward = *chassis.rotation() * Vector::X;
        self.heading = unwrap_near(forward.y.atan2(forward.x), self.heading);
    }

    fn check(&self) -> Result<(), WorldError> {
        let chassis = self.chassis();
        let at = chassis.translation();
        let time = self.time();
        if !(at.is_finite() && chassis.linvel().is_finite() && chassis.angvel().is_finite()) {
            return Err(WorldError::Diverged { time, time_step: self.scene.time_step });
        }
        let up = (*chassis.rotation() * Vector::Z).z;
        if up < TIPPED {
            return Err(WorldError::TippedOver { time, x: at.x, y: at.y });
        }
        if at.z < -10.0 {
            return Err(WorldError::Fell { time, x: at.x, y: at.y });
        }
        Ok(())
    }
}

/// Sets what pushes on a body in the coming step.
fn push(body: &mut RigidBody, wrench: Wrench) {
    body.reset_forces(false);
    body.reset_torques(false);
    body.add_force(wrench.force, false);
    body.add_torque(wrench.torque, false);
}

/// How many steps make one period of `rate` \[Hz\].
pub(crate) fn steps_between(what: &'static str, rate: f64, time_step: f64) -> Result<u64, WorldError> {
    let period_steps = 1.0 / (rate * time_step);
    let whole = period_steps.round();
    if whole >= 1.0 && (period_steps - whole).abs() < 1e-6 * whole {
        Ok(whole as u64)
    } else {
        Err(WorldError::Rate { what, rate, time_step, period_steps })
    }
}
