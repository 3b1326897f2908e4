//! A driven wheel in motion: its tyre's patches, its drivetrain, its rotation.
//!
//! On patches a wheel is one degree of freedom, its spin about the axle Ω (against the room), carried by us; everything else
//! of it is part of the robot's one rigid body. With T the torque on the wheel about its axle â, the body's inertia I
//! without the wheels' own about their axles, and J the wheel's with its rotor, Newton and Euler split exactly into
//!
//! ```text
//! J Ω' = T,    I ω' = τ − Σ T â − ω × (I ω + Σ J Ω â),    rotation against the chassis ψ' = Ω − â·ω
//! ```
//!
//! where τ is the moment of all outer forces about the mass centre. Known differences: a wheel's mass centre and inertia
//! are taken round about its axle (no imbalance), and a rotor, which turns about an axis of its own, has no part in Σ J Ω â.

use super::convert;
use super::drivetrain::{Counter, Friction, Mover, Play, SpeedLoop, WindUp};
use super::ground::{Ground, Touch};
use super::patch::{Patch, PatchMotion};
use crate::scene::{Drivetrain, Robot, Tyre, Wheel};
use rapier3d::math::{Pose, Vector};
use rapier3d::prelude::{RigidBody, RigidBodyHandle};

/// Pieces of ground that one wheel can press into at once: a floor and the edge of something on it, and one more.
const MAX_PATCHES: usize = 3;

#[derive(Clone)]
pub(super) struct RunningWheel {
    pub mount: Mount,
    /// Where its middle is in the base.
    hub: Vector,
    /// In the base, pointing left.
    axle: Vector,
    pub contacts: [Contacting; MAX_PATCHES],
    pub friction: Friction,
    pub counter: Counter,
    pub speed_loop: SpeedLoop,
    /// What the controller has got.
    pub ticks: i64,
    /// What the speed loop has got.
    pub prompt_ticks: i64,
    pub commanded_speed: f64,
    /// Where the counted side is to be at the end of the step, when it follows a log instead of its motor \[rad\].
    pub follows: Option<f64>,
    pub voltage: f64,
    pub motor_torque: f64,
    /// Against the chassis, since the start \[rad\].
    pub angle: f64,
    /// Rate of `angle` \[rad/s\].
    pub speed: f64,
    play: Play,
    wind_up: WindUp,
    /// Of the encoder \[rad\].
    pub encoder_angle: f64,
    pub load: f64,
    pub force: [f64; 2],
    pub slip: [f64; 2],
}

/// What holds a wheel.
#[derive(Clone)]
pub(super) enum Mount {
    /// It is part of the robot's body, and turns.
    Turning(Turning),
    /// A body of its own, hinged to the chassis by the engine.
    Hinged(RigidBodyHandle),
}

/// A wheel's own degree of freedom.
#[derive(Clone)]
pub(super) struct Turning {
    /// Ω, against the room \[rad/s\].
    spin: f64,
    /// J, rotor included \[kg m²\].
    inertia: f64,
    /// J without the rotor.
    of_wheel: f64,
}

/// A patch on one piece of ground.
#[derive(Clone, Default)]
pub(super) struct Contacting {
    piece: Option<usize>,
    /// Touched in this step.
    pub live: bool,
    pub patch: Patch,
    pub place: PatchPlace,
    pub load: f64,
}

/// Where a patch is, in the room.
#[derive(Clone, Copy, Default)]
pub(super) struct PatchPlace {
    pub centre: Vector,
    pub along: Vector,
    pub across: Vector,
}

/// The robot's body at the beginning of a step.
#[derive(Clone, Copy)]
pub(super) struct BodyState {
    pub room_from_base: Pose,
    pub mass_centre: Vector,
    /// Of the mass centre.
    velocity: Vector,
    /// ω
    pub spin: Vector,
}

/// Force and moment on a body about its mass centre, in the room.
#[derive(Clone, Copy, Default)]
pub(super) struct Wrench {
    pub force: Vector,
    pub torque: Vector,
}

impl BodyState {
    pub(super) fn of(body: &RigidBody) -> BodyState {
        BodyState {
            room_from_base: *body.position(),
            mass_centre: body.center_of_mass(),
            velocity: body.linvel(),
            spin: body.angvel(),
        }
    }

    pub(super) fn velocity_at(&self, point: Vector) -> Vector {
        self.velocity + self.spin.cross(point - self.mass_centre)
    }
}

impl std::ops::AddAssign for Wrench {
    fn add_assign(&mut self, other: Wrench) {
        self.force += other.force;
        self.torque += other.torque;
    }
}

impl RunningWheel {
    /// A wheel at rest; `hinged` is its own body where it has one.
    pub(super) fn new(robot: &Robot, wheel: &Wheel, hinged: Option<RigidBodyHandle>) -> RunningWheel {
        let turning = || {
            let of_wheel = wheel.round().spin_inertia;
            Mount::Turning(Turning { spin: 0.0, inertia: of_wheel + robot.drivetrain.reflected_inertia(), of_wheel })
        };
        RunningWheel {
            mount: hinged.map_or_else(turning, Mount::Hinged),
            hub: convert::vector(wheel.base_from_wheel.translation.vector),
            axle: convert::vector(wheel.axle_in_base().into_inner()),
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
            speed: 0.0,
            play: Play::new(robot.drivetrain.backlash),
            wind_up: WindUp::new(robot.drivetrain.wind_up.unwrap_or_default()),
            encoder_angle: 0.0,
            load: 0.0,
            force: [0.0; 2],
            slip: [0.0; 2],
        }
    }

    /// The axle in the room.
    pub(super) fn axle_in_room(&self, room_from_base: &Pose) -> Vector {
        room_from_base.rotation * self.axle
    }

    /// The wheel has come to turn at `speed` \[rad/s\] against the chassis, and has turned by `turned` \[rad\].
    pub(super) fn turned(&mut self, speed: f64, turned: f64) {
        self.speed = speed;
        self.angle += turned;
        self.encoder_angle += self.play.encoder(self.wind_up.counted(turned));
    }

    /// Where the side of the drivetrain is that is counted, play apart \[rad\].
    pub(super) fn counted_angle(&self) -> f64 {
        self.angle + self.wind_up.lead()
    }

    /// Torque of motor and drivetrain friction on the wheel \[N m\]; `tyre` is what the ground does.
    pub(super) fn drive(&mut self, robot: &Robot, inertia: f64, tyre: f64, dt: f64) -> f64 {
        let drivetrain = &robot.drivetrain;
        if !self.wind_up.is_rigid() {
            return self.drive_elastic(drivetrain, inertia, tyre, dt);
        }
        match self.follows {
            None => {
                self.motor_torque = drivetrain.motor_torque(self.voltage, self.speed);
                self.motor_torque + self.friction.torque(drivetrain, self.speed, dt)
            }
            // Whatever brings the wheel to its place in one step against the tyre's pull.
            Some(angle) => {
                let wanted = (angle - self.angle) / dt;
                self.motor_torque = inertia * (wanted - self.speed) / dt - tyre;
                self.motor_torque
            }
        }
    }

    /// The same through a drivetrain that winds up.
    fn drive_elastic(&mut self, drivetrain: &Drivetrain, inertia: f64, tyre: f64, dt: f64) -> f64 {
        let counted = match self.follows {
            None => Mover {
                speed: self.voltage * drivetrain.no_load_speed(),
                slows: drivetrain.no_load_speed() / drivetrain.stall_torque(),
            },
            Some(angle) => Mover { speed: (angle - self.counted_angle()) / dt, slows: 0.0 },
        };
        let drag = self.friction.torque(drivetrain, self.speed, dt);
        let tread = Mover { speed: self.speed + (tyre + drag) / inertia * dt, slows: dt / inertia };
        self.motor_torque = self.wind_up.torque(counted, tread, dt);
        self.motor_torque + drag
    }

    /// Carries the spin of a wheel that is part of the body on by a step; returns what ground and wheel do to the body.
    pub(super) fn advance(
        &mut self,
        robot: &Robot,
        wheel: &Wheel,
        ground: &Ground,
        body: &BodyState,
        floor: &FloorMotion,
        dt: f64,
    ) -> Wrench {
        let Mount::Turning(Turning { spin, inertia, of_wheel }) = self.mount else { return Wrench::default() };
        let axle = self.axle_in_room(&body.room_from_base);
        let (mut wrench, tyre) = self.press(wheel, ground, body, axle, spin, floor, dt);
        let about_axle = tyre + self.drive(robot, inertia, tyre, dt);
        wrench.torque -= axle * about_axle + body.spin.cross(axle) * (of_wheel * spin);
        self.mount = Mount::Turning(Turning { spin: spin + about_axle / inertia * dt, inertia, of_wheel });
        wrench
    }

    /// The chassis has moved: how the wheel has turned against it.
    pub(super) fn follow_body(&mut self, body: &RigidBody, dt: f64) {
        if let Mount::Turning(turning) = &self.mount {
            let speed = turning.spin - body.angvel().dot(self.axle_in_room(body.position()));
            self.turned(speed, speed * dt);
        }
    }

    /// Presses the tyre on the ground; returns force and moment about the body's mass centre, and the moment's part about the
    /// axle as seen from the hub \[N m\].
    #[allow(clippy::too_many_arguments)]
    fn press(
        &mut self,
        wheel: &Wheel,
        ground: &Ground,
        body: &BodyState,
        axle: Vector,
        rolling_rate: f64,
        floor: &FloorMotion,
        dt: f64,
    ) -> (Wrench, f64) {
        let [uneven, phase] = wheel.out_of_round;
        let tyre = &if uneven == 0.0 {
            wheel.tyre
        } else {
            Tyre { free_radius: wheel.tyre.free_radius * (1.0 + uneven * (self.angle - phase).cos()), ..wheel.tyre }
        };
        let centre = body.room_from_base * self.hub;
        let of_wheel = axle * (rolling_rate - body.spin.dot(axle));
        let spin = body.spin + of_wheel;
        let (mut wrench, mut about_axle) = (Wrench::default(), 0.0);
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
            let velocity = body.velocity_at(point) + of_wheel.cross(point - centre) - floor.velocity_at(point);
            let load = (tyre.vertical_stiffness * depth - tyre.vertical_damping * velocity.dot(normal)).max(0.0);
            // The bodies' own motion carries the point at the loaded radius; the tread rolls at the rolling radius.
            let rolling_radius = tyre.rolling_radius(depth);
            let loaded_radius = tyre.free_radius - depth;
            let motion = PatchMotion {
                slip_along: velocity.dot(along) + rolling_rate * (loaded_radius - rolling_radius),
                slip_across: velocity.dot(across),
                spin: spin.dot(normal) - floor.yaw_rate,
                rolling: rolling_rate * rolling_radius,
            };
            let shear = contact.patch.advance(tyre, load, depth, ground.grip_ratio(&touch), &motion, dt);
            let (along, across) = (now + aside * half_turn, aside - now * half_turn);
            let pushed = along * shear.along + across * shear.across + normal * load;
            // About the axle the shear acts at the rolling radius, so that its power is that of slip alone.
            let couple = normal * shear.moment + axle * (shear.along * (loaded_radius - rolling_radius));
            wrench.force += pushed;
            wrench.torque += (point - body.mass_centre).cross(pushed) + couple;
            about_axle += ((point - centre).cross(pushed) + couple).dot(axle);
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
        (wrench, about_axle)
    }
}

/// How the floor moves under the tyres: an uneven floor's stand-in, and empirical terms.
#[derive(Clone, Copy)]
pub(super) struct FloorMotion {
    /// Where the base is.
    pub base: Vector,
    /// Of the floor there.
    pub velocity: Vector,
    /// About the vertical \[rad/s\].
    pub yaw_rate: f64,
}

impl FloorMotion {
    /// At a point of the room.
    pub(super) fn velocity_at(&self, point: Vector) -> Vector {
        self.velocity + Vector::Z.cross(point - self.base) * self.yaw_rate
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
