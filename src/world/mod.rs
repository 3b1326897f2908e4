//! Scene → rapier: bodies and joints, ground queries, tyre patches, drivetrains, encoders; one step at a time.
//!
//! A step, in order: encoders are read and speed loops run, each at its rate; every tyre's patch is carried on and its
//! force, with drivetrain torque on wheel and chassis, given to the engine; the engine moves the bodies (velocities
//! first, then positions with the new velocities: symplectic Euler, first order in the step).
//!
//! rapier and parry stay in this room, and glam with them.

mod bodies;
mod convert;
mod drivetrain;
mod error;
mod ground;
mod patch;
mod snapshot;
mod unevenness;

pub use error::WorldError;
pub use patch::{CELLS_ACROSS, CELLS_ALONG, Patch, PatchForce, PatchMotion};
pub use snapshot::{PatchSnapshot, WheelSnapshot};

use crate::geometry::{Pose2, Twist2, unwrap_near, wrap_angle};
use crate::scene::{Caster, Contact, EmpiricalTerm, Motion, Placement, Scene, Tyre, Wheel};
pub use drivetrain::Play;
use drivetrain::{Counter, Friction, SpeedLoop};
use ground::{Ground, Touch};
use rand_chacha::ChaCha8Rng;
use rapier3d::math::{Rotation, Vector};
use rapier3d::prelude::{PhysicsWorld, RigidBody, RigidBodyHandle};
use unevenness::Unevenness;

/// Pieces of ground that one wheel can press into at once: a floor and the edge of something on it, and one more.
const MAX_PATCHES: usize = 3;

/// Time over which the speed is smoothed before an acceleration is taken of it \[s\].
const SMOOTHING: f64 = 0.05;

/// Lean of the chassis beyond which the robot has tipped over: cos 60°.
const TIPPED: f64 = 0.5;

/// A running world: one robot on one floor.
pub struct World {
    scene: Scene,
    ground: Ground,
    physics: PhysicsWorld,
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

struct RunningWheel {
    handle: RigidBodyHandle,
    /// In the wheel frame, pointing left.
    axle: Vector,
    /// Rotation of the wheel in the base at angle 0.
    base_from_wheel: Rotation,
    contacts: [Contacting; MAX_PATCHES],
    friction: Friction,
    counter: Counter,
    speed_loop: SpeedLoop,
    /// What the controller has got.
    ticks: i64,
    /// What the speed loop has got.
    prompt_ticks: i64,
    commanded_speed: f64,
    /// Where the wheel is to be at the end of the step, when it follows a log instead of its motor \[rad\].
    follows: Option<f64>,
    voltage: f64,
    motor_torque: f64,
    /// Against the chassis, since the start \[rad\].
    angle: f64,
    play: Play,
    /// Of the encoder \[rad\].
    encoder_angle: f64,
    load: f64,
    force: [f64; 2],
    slip: [f64; 2],
}

/// A patch on one piece of ground.
#[derive(Default)]
struct Contacting {
    piece: Option<usize>,
    /// Touched in this step.
    live: bool,
    patch: Patch,
    place: PatchPlace,
    load: f64,
}

/// Where a patch is, in the room.
#[derive(Clone, Copy, Default)]
struct PatchPlace {
    centre: Vector,
    along: Vector,
    across: Vector,
}

struct RunningCaster {
    caster: Caster,
    /// Deflection of its one bristle, in the room.
    bristle: Vector,
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
        let wheels = robot
            .wheels
            .iter()
            .zip(&bodies.wheels)
            .map(|(wheel, &handle)| RunningWheel {
                handle,
                axle: convert::vector(wheel.axle.into_inner()),
                base_from_wheel: convert::pose(&wheel.base_from_wheel).rotation,
                contacts: Default::default(),
                friction: Friction::default(),
                counter: Counter::new(&robot.encoder, wheel.count_loss),
                speed_loop: SpeedLoop::new(&robot.drivetrain, &robot.encoder),
                ticks: 0,
                prompt_ticks: 0,
                commanded_speed: 0.0,
                follows: None,
                voltage: 0.0,
                motor_torque: 0.0,
                angle: 0.0,
                play: Play::new(robot.drivetrain.backlash),
                encoder_angle: 0.0,
                load: 0.0,
                force: [0.0; 2],
                slip: [0.0; 2],
            })
            .collect();
        let casters = robot
            .casters
            .iter()
            .map(|caster| RunningCaster { caster: caster.clone(), bristle: Vector::ZERO })
            .collect();
        Ok(World {
            unevenness: Unevenness::new(scene.scatter, 0.5 * robot.track_width(), scatter),
            scene: scene.clone(),
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
        self.apply_forces();
        self.physics.step();
        self.steps += 1;
        self.read_angles();
        self.check()
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

    /// Makes a wheel follow a log: at the end of the next step it is to stand at `angle` \[rad\]. The torque that this
    /// takes acts on wheel and chassis, as a motor's would.
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

    /// Rate of [`World::wheel_angle`] \[rad/s\].
    pub fn wheel_speed(&self, wheel: usize) -> f64 {
        let running = &self.wheels[wheel];
        let body = &self.physics.bodies[running.handle];
        let axle = *body.rotation() * running.axle;
        (body.angvel() - self.chassis().angvel()).dot(axle)
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

    fn wheel_snapshot(&self, index: usize) -> WheelSnapshot {
        let running = &self.wheels[index];
        let tyre = &self.scene.robot.wheels[index].tyre;
        let main =
            running.contacts.iter().filter(|contact| contact.live).max_by(|one, other| one.load.total_cmp(&other.load));
        WheelSnapshot {
            placement: convert::placement(self.physics.bodies[running.handle].position()),
            angle: running.angle,
            speed: self.wheel_speed(index),
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
                width: tyre.width,
                tractions: contact.patch.tractions(tyre),
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
    fn apply_forces(&mut self) {
        let dt = self.scene.time_step;
        let floor = self.floor_twist();
        let (chassis_spin, base, forward) = {
            let chassis = &self.physics.bodies[self.chassis];
            (chassis.angvel(), chassis.translation(), *chassis.rotation() * Vector::X)
        };
        // Velocity of the moving floor at a point of the room.
        let floor_velocity = |at: Vector| {
            forward * floor.forward
                + Vector::Z.cross(forward) * floor.left
                + Vector::Z.cross(at - base) * floor.yaw_rate
        };

        let mut reaction = Vector::ZERO;
        let rigid = self.scene.contact == Contact::Rigid;
        for (running, wheel) in self.wheels.iter_mut().zip(&self.scene.robot.wheels) {
            let body = &self.physics.bodies[running.handle];
            let axle = *body.rotation() * running.axle;
            let speed = (body.angvel() - chassis_spin).dot(axle);
            let drivetrain = &self.scene.robot.drivetrain;
            let (force, torque) = if rigid {
                (Vector::ZERO, Vector::ZERO)
            } else {
                running.press(wheel, &self.ground, body, floor.yaw_rate, &floor_velocity, dt)
            };
            let about_axle = match running.follows {
                None => {
                    running.motor_torque = drivetrain.motor_torque(running.voltage, speed);
                    running.motor_torque + running.friction.torque(drivetrain, speed, dt)
                }
                // Whatever brings the wheel to its place in one step against the tyre's pull.
                Some(angle) => {
                    let inertia = wheel.spin_inertia() + drivetrain.reflected_inertia();
                    let wanted = (angle - running.angle) / dt;
                    running.motor_torque = inertia * (wanted - speed) / dt - torque.dot(axle);
                    running.motor_torque
                }
            };
            let drive = axle * about_axle;
            reaction -= drive;
            let body = &mut self.physics.bodies[running.handle];
            body.reset_forces(false);
            body.reset_torques(false);
            body.add_force(force, false);
            body.add_torque(torque + drive, false);
        }
        let mut force = Vector::ZERO;
        let mut torque = reaction;
        if let Some(tether) = &self.scene.tether {
            let [x, y, z] = tether.anchor;
            let chassis = &self.physics.bodies[self.chassis];
            let pull = (Vector::new(x, y, z) - base).normalize() * tether.pull;
            force += pull;
            torque += (base - chassis.center_of_mass()).cross(pull);
        }
        let chassis = &self.physics.bodies[self.chassis];
        for caster in &mut self.casters {
            let (pushed, turned) = caster.press(&self.ground, chassis, &floor_velocity, dt);
            force += pushed;
            torque += turned;
        }
        let chassis = &mut self.physics.bodies[self.chassis];
        chassis.reset_forces(false);
        chassis.reset_torques(false);
        chassis.add_force(force, false);
        chassis.add_torque(torque, false);
    }

    /// The twist of the floor under the tyres: an uneven floor's, and that of empirical terms.
    fn floor_twist(&mut self) -> Twist2 {
        if self.unevenness.is_none() && self.scene.empirical.is_empty() {
            return Twist2::default();
        }
        let dt = self.scene.time_step;
        let chassis = &self.physics.bodies[self.chassis];
        let forward = *chassis.rotation() * Vector::X;
        let velocity = chassis.velocity_at_point(chassis.translation());
        let body = Twist2 { forward: velocity.dot(forward), left: 0.0, yaw_rate: chassis.angvel().z };
        let mut floor = self.unevenness.as_mut().map_or_else(Twist2::default, |floor| floor.twist(body, dt));
        if !self.scene.empirical.is_empty() {
            let acceleration = (body.forward - self.smooth_speed) / SMOOTHING;
            self.smooth_speed += acceleration * dt;
            let motion = Motion { twist: body, pose: self.pose(), time: self.time(), acceleration };
            let extra = EmpiricalTerm::twist(&self.scene.empirical, &motion);
            floor.forward += extra.forward;
            floor.left += extra.left;
            floor.yaw_rate += extra.yaw_rate;
        }
        floor
    }

    /// Rotation of each wheel against the chassis, from the bodies' orientations.
    fn read_angles(&mut self) {
        let chassis = &self.physics.bodies[self.chassis];
        let rotation = *chassis.rotation();
        for running in &mut self.wheels {
            let turned =
                (rotation * running.base_from_wheel).inverse() * *self.physics.bodies[running.handle].rotation();
            let about_axle = Vector::new(turned.x, turned.y, turned.z).dot(running.axle);
            let turned = wrap_angle(2.0 * about_axle.atan2(turned.w) - running.angle);
            running.angle += turned;
            running.encoder_angle += running.play.encoder(turned);
        }
        let forward = rotation * Vector::X;
        self.heading = unwrap_near(forward.y.atan2(forward.x), self.heading);
        if self.scene.contact == Contact::Rigid {
            self.read_rigid_loads();
        }
    }

    /// The engine's own contacts: load only.
    fn read_rigid_loads(&mut self) {
        let dt = self.scene.time_step;
        for running in &mut self.wheels {
            running.load = self.physics.bodies[running.handle]
                .colliders()
                .iter()
                .flat_map(|&collider| self.physics.contact_pairs_with(collider))
                .map(|pair| pair.total_impulse().length() / dt)
                .sum();
        }
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

impl RunningWheel {
    /// Presses the tyre on the ground; returns force and torque about the wheel's centre of mass, in the room.
    fn press(
        &mut self,
        wheel: &Wheel,
        ground: &Ground,
        body: &RigidBody,
        floor_spin: f64,
        floor_velocity: &impl Fn(Vector) -> Vector,
        dt: f64,
    ) -> (Vector, Vector) {
        let [uneven, phase] = wheel.out_of_round;
        let tyre = &if uneven == 0.0 {
            wheel.tyre
        } else {
            Tyre { free_radius: wheel.tyre.free_radius * (1.0 + uneven * (self.angle - phase).cos()), ..wheel.tyre }
        };
        let centre = body.translation();
        let mass_centre = body.center_of_mass();
        let axle = *body.rotation() * self.axle;
        let spin = body.angvel();
        let rolling_rate = spin.dot(axle);
        let (mut force, mut torque) = (Vector::ZERO, Vector::ZERO);
        self.load = 0.0;
        self.force = [0.0; 2];
        self.slip = [0.0; 2];
        for contact in &mut self.contacts {
            contact.live = false;
        }
        ground.touches(centre, axle, tyre.free_radius, tyre.width, |touch| {
            let Some(contact) = claim(&mut self.contacts, &touch) else { return };
            let Touch { point, normal, depth, .. } = touch;
            // Velocities live half a step back (they are what moved the bodies here), forces half a step ahead: the
            // patch is turned accordingly, or a spinning robot's effective track would depend on the step.
            let half_turn = spin.dot(normal) * 0.5 * dt;
            let now = axle.cross(normal).normalize();
            let aside = normal.cross(now);
            let (along, across) = (now - aside * half_turn, aside + now * half_turn);
            let velocity = body.velocity_at_point(point) - floor_velocity(point);
            let load = (tyre.vertical_stiffness * depth - tyre.vertical_damping * velocity.dot(normal)).max(0.0);
            // The bodies' own motion carries the point at the loaded radius; the tread rolls at the rolling radius.
            let rolling_radius = tyre.rolling_radius(depth);
            let loaded_radius = tyre.free_radius - depth;
            let motion = PatchMotion {
                slip_along: velocity.dot(along) + rolling_rate * (loaded_radius - rolling_radius),
                slip_across: velocity.dot(across),
                spin: spin.dot(normal) - floor_spin,
                rolling: rolling_rate * rolling_radius,
            };
            let shear = contact.patch.advance(tyre, load, depth, ground.grip_ratio(&touch), &motion, dt);
            let (along, across) = (now + aside * half_turn, aside - now * half_turn);
            let pushed = along * shear.along + across * shear.across + normal * load;
            force += pushed;
            // About the axle the shear acts at the rolling radius, so that its power is that of slip alone.
            torque += (point - mass_centre).cross(pushed)
                + normal * shear.moment
                + axle * (shear.along * (loaded_radius - rolling_radius));
            contact.place = PatchPlace { centre: point, along, across };
            contact.load = load;
            self.load += load;
            self.force[0] += shear.along;
            self.force[1] += shear.across;
            self.slip = [motion.slip_along, motion.slip_across];
        });
        for contact in &mut self.contacts {
            if !contact.live && contact.piece.is_some() {
                contact.piece = None;
                contact.patch.release();
            }
        }
        (force, torque)
    }
}

/// The patch that this wheel has, or can have, on the touched piece.
fn claim<'a>(contacts: &'a mut [Contacting; MAX_PATCHES], touch: &Touch) -> Option<&'a mut Contacting> {
    let index = contacts
        .iter()
        .position(|contact| contact.piece == Some(touch.piece))
        .or_else(|| contacts.iter().position(|contact| contact.piece.is_none()))?;
    let contact = &mut contacts[index];
    contact.piece = Some(touch.piece);
    contact.live = true;
    Some(contact)
}

impl RunningCaster {
    /// Presses the ball on the ground; returns force and torque about the chassis' centre of mass, in the room. Its drag
    /// is one bristle, as stiff as the ball is, cut back to `drag_coefficient` times the load.
    fn press(
        &mut self,
        ground: &Ground,
        chassis: &RigidBody,
        floor_velocity: &impl Fn(Vector) -> Vector,
        dt: f64,
    ) -> (Vector, Vector) {
        let caster = &self.caster;
        let centre = *chassis.position() * convert::point(caster.centre);
        let (mut force, mut torque) = (Vector::ZERO, Vector::ZERO);
        let bristle = &mut self.bristle;
        let mut touched = false;
        ground.touches(centre, Vector::ZERO, caster.radius, 2.0 * caster.radius, |touch| {
            let Touch { point, normal, depth, .. } = touch;
            let velocity = chassis.velocity_at_point(point) - floor_velocity(point);
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
            force += pushed;
            torque += (point - chassis.center_of_mass()).cross(pushed);
        });
        if !touched {
            *bristle = Vector::ZERO;
        }
        (force, torque)
    }
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
