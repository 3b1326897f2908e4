//! What can be switched off in a scene, one thing at a time, on the way to the closed form; and what can be moved.

use crate::scene::{Caster, GRAVITY, Scene, Side, Tyre, Wheel};
use nalgebra::{Matrix3, Vector3};

/// Width and length of the patch that stands for a point, over the track.
pub(super) const POINT: f64 = 0.01;

/// Slip stiffness that stands for stiff rubber: the patch of a spinning robot, whose slip is about 0.4, sticks in the
/// first 3μ/(C·0.4), a tenth of its length. Stiffer still would ask for a step of microseconds.
const STIFF: f64 = 60.0;

/// Every tyre is the mean of all.
pub(super) fn equal_tyres(scene: &Scene) -> Scene {
    let wheels = &scene.robot.wheels;
    let mean = |of: fn(&Tyre) -> f64| wheels.iter().map(|wheel| of(&wheel.tyre)).sum::<f64>() / wheels.len() as f64;
    let tyre = Tyre {
        free_radius: mean(|tyre| tyre.free_radius),
        width: mean(|tyre| tyre.width),
        vertical_stiffness: mean(|tyre| tyre.vertical_stiffness),
        vertical_damping: mean(|tyre| tyre.vertical_damping),
        slip_stiffness: mean(|tyre| tyre.slip_stiffness),
        friction_along: mean(|tyre| tyre.friction_along),
        friction_across: mean(|tyre| tyre.friction_across),
    };
    each_tyre(scene, |each| *each = tyre)
}

/// The mass centre `forward` of the middle of the wheels \[m\], and midway between the sides.
///
/// A robot on casters keeps its mass centre along: over its axle it would rock from caster to nothing.
pub(super) fn mass_centre_at(scene: &Scene, forward: f64) -> Scene {
    let mut scene = scene.clone();
    let middle = wheel_middle(&scene);
    let now = scene.robot.whole().centre_of_mass;
    let robot = &mut scene.robot;
    let (whole, chassis) = (robot.mass(), &mut robot.chassis);
    if robot.casters.is_empty() {
        chassis.centre_of_mass.x += (middle.x + forward - now.x) * whole / chassis.mass;
    }
    chassis.centre_of_mass.y += (middle.y - now.y) * whole / chassis.mass;
    scene
}

/// Casters roll without drag.
pub(super) fn free_casters(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.robot.casters.iter_mut().for_each(|caster: &mut Caster| caster.drag_coefficient = 0.0);
    scene
}

/// Friction across is `ratio` times friction along.
pub(super) fn friction_ratio(scene: &Scene, ratio: f64) -> Scene {
    each_tyre(scene, |tyre| tyre.friction_across = ratio * tyre.friction_along)
}

/// Bristles so stiff that a patch slides all over.
pub(super) fn stiff_bristles(scene: &Scene) -> Scene {
    each_tyre(scene, |tyre| tyre.slip_stiffness = tyre.slip_stiffness.max(STIFF))
}

/// Patches `scale` times as wide and as long, by softer or harder rubber: a = √(2R N/k_z). The bounce is damped as before.
pub(super) fn patch_scaled(scene: &Scene, scale: f64) -> Scene {
    each_tyre(scene, |tyre| {
        tyre.width *= scale;
        tyre.vertical_stiffness /= scale * scale;
        tyre.vertical_damping /= scale;
    })
}

/// Patches as small as a point, for the purpose.
pub(super) fn point_patches(scene: &Scene) -> Scene {
    let size = POINT * scene.robot.track_width();
    let load = wheel_share(scene);
    each_tyre(scene, |tyre| {
        let half = 0.5 * size;
        let stiffness = (2.0 * tyre.free_radius * load / (half * half)).max(tyre.vertical_stiffness);
        tyre.width = tyre.width.min(size);
        tyre.vertical_damping *= (stiffness / tyre.vertical_stiffness).sqrt();
        tyre.vertical_stiffness = stiffness;
    })
}

/// Encoders a thousand times finer, so that no tick hides what the simulation itself does.
pub(super) fn fine_encoders(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.robot.encoder.ticks_per_revolution *= 1e3;
    scene
}

/// Steps of the scene are cut into so many for tyres as hard as [`point_patches`] has them: a third of a millisecond, and a
/// wheel's share of the robot moves through less than half a radian of its bounce in a step.
pub(super) fn fine_divisor(scene: &Scene) -> u32 {
    let hard = point_patches(scene);
    let share = scene.robot.mass() / scene.robot.wheels.len() as f64;
    let shortest = hard.robot.wheels.iter().map(|wheel| 0.5 * (share / wheel.tyre.vertical_stiffness).sqrt());
    (scene.time_step / shortest.fold(0.3125e-3, f64::min)).ceil().max(1.0) as u32
}

/// The robot as a mirror shows it, its wheels in the order of sides that it has.
pub(super) fn mirrored(scene: &Scene) -> Scene {
    let flip = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0));
    let mut mirrored = scene.clone();
    let robot = &mut mirrored.robot;
    robot.chassis.centre_of_mass.y = -robot.chassis.centre_of_mass.y;
    robot.chassis.inertia = flip * robot.chassis.inertia * flip;
    robot.casters.iter_mut().for_each(|caster| caster.centre.y = -caster.centre.y);
    let images: Vec<Wheel> = scene.robot.wheels.iter().map(|wheel| image(wheel, &flip)).collect();
    let mut of_side = [Side::Left, Side::Right].map(|side| images.iter().filter(move |wheel| wheel.side == side));
    let in_order = scene.robot.wheels.iter().filter_map(|wheel| of_side[usize::from(wheel.side == Side::Right)].next());
    // Sides of unequal count cannot keep their order.
    let in_order: Vec<Wheel> = in_order.cloned().collect();
    robot.wheels = if in_order.len() == images.len() { in_order } else { images };
    mirrored
}

fn image(wheel: &Wheel, flip: &Matrix3<f64>) -> Wheel {
    let mut image = wheel.clone();
    image.side = if wheel.side == Side::Left { Side::Right } else { Side::Left };
    image.base_from_wheel.translation.y = -wheel.base_from_wheel.translation.y;
    // A rotation by an angle about n is seen as one by the opposite angle about the mirrored n.
    let turned = wheel.base_from_wheel.rotation.scaled_axis();
    image.base_from_wheel.rotation = nalgebra::UnitQuaternion::from_scaled_axis(-(flip * turned));
    // The image of an axle that points left points right.
    image.axle = nalgebra::Unit::new_unchecked(-(flip * wheel.axle.into_inner()));
    image.body.centre_of_mass.y = -wheel.body.centre_of_mass.y;
    image.body.inertia = flip * wheel.body.inertia * flip;
    image
}

fn each_tyre(scene: &Scene, edit: impl Fn(&mut Tyre)) -> Scene {
    let mut scene = scene.clone();
    scene.robot.wheels.iter_mut().for_each(|wheel| edit(&mut wheel.tyre));
    scene
}

/// An equal share of the weight \[N\].
pub(super) fn wheel_share(scene: &Scene) -> f64 {
    scene.robot.mass() * GRAVITY / scene.robot.wheels.len() as f64
}

/// Mean of the wheel centres in the base frame.
fn wheel_middle(scene: &Scene) -> Vector3<f64> {
    let wheels = &scene.robot.wheels;
    wheels.iter().map(|wheel| wheel.base_from_wheel.translation.vector).sum::<Vector3<f64>>() / wheels.len() as f64
}

/// How far the mass centre lies ahead of the middle of the wheels \[m\].
pub(super) fn load_offset(scene: &Scene) -> f64 {
    scene.robot.whole().centre_of_mass.x - wheel_middle(scene).x
}
