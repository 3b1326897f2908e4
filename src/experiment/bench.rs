//! A test bench for one robot: a world at rest, wheels turned at given speeds, steady motions measured.

use crate::geometry::Pose2;
use crate::scene::{GRAVITY, Scene, Side};
use crate::world::{CELLS_ACROSS, CELLS_ALONG, PatchSnapshot, WheelSnapshot, World, WorldError};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Standstill in which tyres and bodies come to rest \[s\], as before every run.
pub const SETTLE: f64 = 0.5;
/// Time over which wheels reach their speeds \[s\].
const RAMP: f64 = 1.0;

/// A world over the origin that has stood for [`SETTLE`].
///
/// # Errors
/// The world cannot be built, or is left.
pub fn settled(scene: &Scene) -> Result<World, WorldError> {
    let mut world = World::new(scene, Pose2::IDENTITY, ChaCha8Rng::seed_from_u64(0))?;
    step_for(&mut world, SETTLE)?;
    Ok(world)
}

/// Whether a world can be built from the scene at all.
///
/// # Errors
/// It cannot.
pub fn buildable(scene: &Scene) -> Result<(), WorldError> {
    World::new(scene, Pose2::IDENTITY, ChaCha8Rng::seed_from_u64(0)).map(|_| ())
}

/// Steps for `seconds`.
///
/// # Errors
/// The world is left.
pub fn step_for(world: &mut World, seconds: f64) -> Result<(), WorldError> {
    let steps = (seconds / world.scene().time_step).round() as u64;
    (0..steps).try_for_each(|_| world.step())
}

/// Asks the left and right wheels for speeds \[rad/s\], ramped up over a second.
///
/// # Errors
/// The world is left.
pub fn ramp_to(world: &mut World, left: f64, right: f64) -> Result<(), WorldError> {
    const PARTS: u32 = 20;
    for part in 1..=PARTS {
        let share = f64::from(part) / f64::from(PARTS);
        command(world, share * left, share * right);
        step_for(world, RAMP / f64::from(PARTS))?;
    }
    Ok(())
}

fn command(world: &mut World, left: f64, right: f64) {
    for wheel in 0..world.scene().robot.wheels.len() {
        let side = world.scene().robot.wheels[wheel].side;
        world.command(wheel, if side == Side::Left { left } else { right });
    }
}

/// Mean wheel rotation since the start of the left and right sides \[rad\].
pub fn rotation(world: &World) -> [f64; 2] {
    by_side(world.scene(), |_| 1.0, |wheel| world.wheel_angle(wheel))
}

/// Mean of `value` over the wheels of the left and of the right side, which count by `weight`.
fn by_side(scene: &Scene, weight: impl Fn(usize) -> f64, value: impl Fn(usize) -> f64) -> [f64; 2] {
    [Side::Left, Side::Right].map(|side| {
        let wheels = scene.robot.wheels.iter().enumerate().filter(|(_, wheel)| wheel.side == side);
        let (sum, whole) = wheels
            .fold((0.0, 0.0), |(sum, whole), (index, _)| (sum + weight(index) * value(index), whole + weight(index)));
        sum / whole
    })
}

/// A steady motion, measured over a window of time.
#[derive(Debug, Clone)]
pub struct Steady {
    /// Rotation of the left and right wheels, mean of each side \[rad\].
    pub rotation: [f64; 2],
    /// Way of the treads of the left and right wheels, R_e of each under its load at rest times its rotation, mean of
    /// each side \[m\]. Wheels count by their loads: a brush pulls as its slip times its load, and those of a side pull against
    /// each other where their radii differ.
    pub way: [f64; 2],
    /// Turn of the body \[rad\].
    pub turned: f64,
    /// Length of the base's path \[m\].
    pub distance: f64,
    /// Length of the window \[s\].
    pub seconds: f64,
    /// Mean power of the motors at the wheels \[W\].
    pub motor_power: f64,
    /// Mean power that dry and viscous friction of the drivetrains take \[W\].
    pub drivetrain_loss: f64,
    /// Mean power that each tyre's shear gives to the robot \[W\]; friction takes, so it is negative.
    pub tyre_power: Vec<f64>,
    /// Greatest deviation of any wheel's load from its mean over the window, over an equal share of the weight \[–\].
    pub load_ripple: f64,
}

impl Steady {
    /// b_eff \[m\]: difference of the sides' ways over what the body turned.
    pub fn effective_track(&self) -> f64 {
        (self.way[1] - self.way[0]) / self.turned
    }

    /// R − δ/3 by the tyres' closed form, mean of the wheels under their loads at rest, by their loads \[m\].
    pub fn rolling_radius_at_rest(&self) -> f64 {
        (self.way[0] + self.way[1]) / (self.rotation[0] + self.rotation[1])
    }

    /// Travel of the base a radian of the mean wheel \[m\].
    pub fn rolling_radius(&self) -> f64 {
        2.0 * self.distance / (self.rotation[0] + self.rotation[1])
    }

    /// Radius of the path, positive turning left \[m\].
    pub fn turn_radius(&self) -> f64 {
        self.distance / self.turned
    }
}

/// Load of each wheel at rest \[N\]: the mean over a tenth of a second.
///
/// # Errors
/// The world is left.
pub fn loads(world: &mut World) -> Result<Vec<f64>, WorldError> {
    let mut snapshots = Vec::new();
    let mut sum = vec![0.0; world.scene().robot.wheels.len()];
    let steps = (0.1 / world.scene().time_step).round().max(1.0) as u64;
    for _ in 0..steps {
        world.step()?;
        world.wheel_snapshots(&mut snapshots);
        for (sum, snapshot) in sum.iter_mut().zip(&snapshots) {
            *sum += snapshot.load / steps as f64;
        }
    }
    Ok(sum)
}

/// Turns the wheels at `left` and `right` \[rad/s\], lets that become steady for `wait` \[s\] and measures for `seconds`.
///
/// # Errors
/// The world cannot be built, or is left.
pub fn steady(scene: &Scene, left: f64, right: f64, wait: f64, seconds: f64) -> Result<Steady, WorldError> {
    let mut world = settled(scene)?;
    let loads = loads(&mut world)?;
    ramp_to(&mut world, left, right)?;
    step_for(&mut world, wait)?;

    let robot = &scene.robot;
    let steps = (seconds / scene.time_step).round().max(1.0);
    let angles: Vec<f64> = (0..robot.wheels.len()).map(|wheel| world.wheel_angle(wheel)).collect();
    let heading = world.pose().heading;
    let (mut before, mut now) = (Vec::new(), Vec::new());
    world.wheel_snapshots(&mut now);
    let mut earlier_yaw_rate = world.twist().yaw_rate;
    let mut load = vec![[f64::INFINITY, f64::NEG_INFINITY]; robot.wheels.len()];
    let mut tyre_power = vec![0.0; robot.wheels.len()];
    let (mut motor_power, mut drivetrain_loss, mut distance) = (0.0, 0.0, 0.0);
    for _ in 0..steps as u64 {
        // A step holds its force and moves velocity from one value to the next: work goes with their mean. A snapshot has
        // the force and the slip that its step began with, and the speed and the yaw rate that it ended with.
        let (from, yaw_rate) = (world.pose(), world.twist().yaw_rate);
        world.step()?;
        distance += from.distance(world.pose());
        std::mem::swap(&mut before, &mut now);
        world.wheel_snapshots(&mut now);
        for wheel in 0..robot.wheels.len() {
            let (old, new) = (&before[wheel], &now[wheel]);
            load[wheel] = [load[wheel][0].min(new.load), load[wheel][1].max(new.load)];
            let speed = 0.5 * (old.speed + new.speed);
            motor_power += new.motor_torque * speed / steps;
            let drivetrain = &robot.drivetrain;
            drivetrain_loss +=
                (drivetrain.dry_friction * speed.abs() + drivetrain.viscous_friction * old.speed * speed) / steps;
            tyre_power[wheel] += shear_power(old, new, 0.5 * (earlier_yaw_rate + yaw_rate)) / steps;
        }
        earlier_yaw_rate = yaw_rate;
    }
    let turned_by = |wheel: usize| world.wheel_angle(wheel) - angles[wheel];
    let share = robot.mass() * GRAVITY / robot.wheels.len() as f64;
    Ok(Steady {
        rotation: by_side(scene, |_| 1.0, turned_by),
        way: by_side(
            scene,
            |wheel| loads[wheel],
            |wheel| {
                let tyre = &robot.wheels[wheel].tyre;
                tyre.rolling_radius(tyre.squash(loads[wheel])) * turned_by(wheel)
            },
        ),
        turned: world.pose().heading - heading,
        distance,
        seconds: steps * scene.time_step,
        motor_power,
        drivetrain_loss,
        tyre_power,
        load_ripple: load.iter().map(|[least, most]| 0.5 * (most - least) / share).fold(0.0, f64::max),
    })
}

/// Power that the shear of a wheel's patch gave to the robot in the step before the last one \[W\]: its force times the mean
/// of the slips before and after, and its moment times the turn slip.
fn shear_power(old: &WheelSnapshot, new: &WheelSnapshot, spin: f64) -> f64 {
    let moment = old.patch.as_ref().map_or(0.0, shear_moment);
    0.5 * (old.force_along * (old.slip_along + new.slip_along) + old.force_across * (old.slip_across + new.slip_across))
        + moment * spin
}

/// Moment of the tractions about the patch centre \[N m\].
fn shear_moment(patch: &PatchSnapshot) -> f64 {
    let area = 2.0 * patch.half_length * patch.width / (CELLS_ALONG * CELLS_ACROSS) as f64;
    let mut moment = 0.0;
    for (i, row) in patch.tractions.iter().enumerate() {
        let xi = patch.half_length * ((2 * i + 1) as f64 / CELLS_ALONG as f64 - 1.0);
        for (j, [along, across]) in row.iter().enumerate() {
            let eta = 0.5 * patch.width * ((2 * j + 1) as f64 / CELLS_ACROSS as f64 - 1.0);
            moment += (across * xi - along * eta) * area;
        }
    }
    moment
}

/// Starts with one wheel's tyre blown up by the squash that it has at rest, so that the robot bounces, heaves, pitches
/// and rolls; returns by how much any wheel's load still moves after [`SETTLE`], over an equal share of the weight \[–\].
///
/// # Errors
/// The world cannot be built, or is left.
pub fn bounce_after_settling(scene: &Scene) -> Result<f64, WorldError> {
    let mut kicked = scene.clone();
    let share = scene.robot.mass() * GRAVITY / scene.robot.wheels.len() as f64;
    let tyre = &mut kicked.robot.wheels[0].tyre;
    tyre.free_radius += tyre.squash(share);
    let mut world = settled(&kicked)?;
    let mut snapshots = Vec::new();
    let mut load = vec![[f64::INFINITY, f64::NEG_INFINITY]; kicked.robot.wheels.len()];
    // A fifth of a second holds a period of anything that stands on tyres.
    for _ in 0..(0.2 / scene.time_step).ceil() as u64 {
        world.step()?;
        world.wheel_snapshots(&mut snapshots);
        for (range, snapshot) in load.iter_mut().zip(&snapshots) {
            *range = [range[0].min(snapshot.load), range[1].max(snapshot.load)];
        }
    }
    Ok(load.iter().map(|[least, most]| 0.5 * (most - least) / share).fold(0.0, f64::max))
}
