//! Closed forms that a robot is held against.

use crate::scene::{GRAVITY, Scene, Side, Wheel};
use crate::world::BRISTLE_DAMPING;
use nalgebra::{DMatrix, DVector, Point3, UnitVector3, Vector3};

/// b_eff/b of wheels that touch the ground at points, all with the same load, under Coulomb friction: the ratio at which the
/// yaw moments of a spin on the spot balance.
///
/// Two axles l apart give 1 + (l/b)² for this and for any other isotropic law of friction, as all four slips are then
/// alike; so does a single axle, with l = 0. Other arrangements depend on the law; this is sliding friction's.
pub fn point_contact_factor(scene: &Scene) -> f64 {
    let wheels = &scene.robot.wheels;
    let middle = wheels.iter().map(|wheel| wheel.base_from_wheel.translation.x).sum::<f64>() / wheels.len() as f64;
    let half = 0.5 * scene.robot.track_width();
    // Moment at unit yaw rate of treads that move at ±factor·b/2; it grows with the factor, from below zero.
    let moment = |factor: f64| -> f64 { wheels.iter().map(|wheel| yaw_moment(wheel, middle, factor * half)).sum() };
    let (mut low, mut high) = (0.0, 2.0);
    while moment(high) < 0.0 {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..60 {
        let factor = 0.5 * (low + high);
        if moment(factor) < 0.0 { low = factor } else { high = factor }
    }
    0.5 * (low + high)
}

/// Yaw moment of unit friction on one wheel.
fn yaw_moment(wheel: &Wheel, middle: f64, way: f64) -> f64 {
    let at = wheel.base_from_wheel.translation;
    let rolling = if wheel.side == Side::Left { -way } else { way };
    let (x, y) = (at.x - middle, at.y);
    let slip = [-y - rolling, x];
    let speed = slip[0].hypot(slip[1]);
    if speed > 0.0 { (y * slip[0] - x * slip[1]) / speed } else { 0.0 }
}

/// (k Δt² + 2 c Δt)/m of a mass on a spring and a damper under symplectic Euler: the motion is stable below 4.
///
/// v' = v − Δt(k x + c v)/m, x' = x + Δt v' has the characteristic polynomial z² − (2 − C − K) z + 1 − C with
/// K = k Δt²/m, C = c Δt/m; both roots lie inside the unit circle where K + 2C < 4 [Jury's criterion].
pub fn stability(stiffness: f64, damping: f64, mass: f64, time_step: f64) -> f64 {
    time_step * (stiffness * time_step + 2.0 * damping) / mass
}

/// The bound of [`stability`].
pub const STABLE_BELOW: f64 = 4.0;

/// The way of shaking of a robot at rest that asks for the shortest step.
#[derive(Debug, Clone, PartialEq)]
pub struct Stiffest {
    /// (K Δt² + 2 C Δt)/M of it, as in [`stability`].
    pub stability: f64,
    /// The spring that gives most to it: `wheel …` or `caster …`, and what it does.
    pub spring: String,
    /// Stiffness of that spring \[N/m\].
    pub stiffness: f64,
}

/// One spring between the robot and the ground.
struct Spring {
    name: String,
    stiffness: f64,
    damping: f64,
    /// How fast it is stretched a unit of each speed: of the mass centre, about it, and of each wheel's spin.
    stretch: DVector<f64>,
}

/// The robot on all its springs at once: tyres' and casters' squash, and the shear of patches and casters that stick.
///
/// In many dimensions the bound of [`stability`] is that on the greatest eigenvalue of (K Δt² + 2 C Δt) over M: the motion
/// begins to grow where 4M − 2CΔt − KΔt² is no longer positive, at z = −1. Gyroscopic moments are left out, and so are motors.
pub fn stiffest(scene: &Scene) -> Stiffest {
    let robot = &scene.robot;
    let whole = robot.whole();
    let freedoms = 6 + robot.wheels.len();
    let mut mass = DMatrix::zeros(freedoms, freedoms);
    mass.view_mut((0, 0), (3, 3)).fill_diagonal(whole.mass);
    mass.view_mut((3, 3), (3, 3)).copy_from(&whole.inertia);
    for (index, wheel) in robot.wheels.iter().enumerate() {
        mass[(6 + index, 6 + index)] = wheel.round().spin_inertia + robot.drivetrain.reflected_inertia();
    }
    let springs = springs(scene, whole.centre_of_mass);
    let step = scene.time_step;
    let weight = |spring: &Spring| stability(spring.stiffness, spring.damping, 1.0, step);
    let sum = springs.iter().fold(DMatrix::zeros(freedoms, freedoms), |sum, spring| {
        sum + &spring.stretch * spring.stretch.transpose() * weight(spring)
    });
    let unknown = Stiffest { stability: f64::NAN, spring: String::new(), stiffness: f64::NAN };
    let Some(root) = mass.cholesky() else { return unknown };
    let Some(inverse) = root.l().try_inverse() else { return unknown };
    let modes = (&inverse * sum * inverse.transpose()).symmetric_eigen();
    let mode = inverse.transpose() * modes.eigenvectors.column(modes.eigenvalues.imax());
    let share = |spring: &Spring| weight(spring) * spring.stretch.dot(&mode).powi(2);
    let most = springs.into_iter().max_by(|one, other| share(one).total_cmp(&share(other)));
    let Some(Spring { name, stiffness, .. }) = most else { return unknown };
    Stiffest { stability: modes.eigenvalues.max(), spring: name, stiffness }
}

fn springs(scene: &Scene, mass_centre: Point3<f64>) -> Vec<Spring> {
    let robot = &scene.robot;
    let freedoms = 6 + robot.wheels.len();
    let load = robot.mass() * GRAVITY / robot.wheels.len() as f64;
    // A point of a part that turns with the body but for `spin` about an axle of its own.
    let stretch = |point: Vector3<f64>, way: Vector3<f64>, spin: Option<(usize, Vector3<f64>, UnitVector3<f64>)>| {
        let mut stretch = DVector::zeros(freedoms);
        let about = (point - mass_centre.coords).cross(&way);
        stretch.fixed_rows_mut::<3>(0).copy_from(&way);
        stretch.fixed_rows_mut::<3>(3).copy_from(&about);
        if let Some((index, hub, axle)) = spin {
            let lever = way.dot(&axle.cross(&(point - hub)));
            let about = about - axle.into_inner() * lever;
            stretch.fixed_rows_mut::<3>(3).copy_from(&about);
            stretch[6 + index] = lever;
        }
        stretch
    };
    let up = Vector3::z();
    let mut springs = Vec::new();
    for (index, wheel) in robot.wheels.iter().enumerate() {
        let tyre = &wheel.tyre;
        let (hub, axle) = (wheel.base_from_wheel.translation.vector, wheel.axle_in_base());
        let point = hub - up * tyre.rolling_radius(tyre.squash(load));
        let along = axle.cross(&up).normalize();
        // Of a stuck patch: k·2a·w.
        let shear = tyre.bristle_stiffness() * 2.0 * tyre.contact_half_length(tyre.squash(load)) * tyre.width;
        for (what, way, stiffness, damping) in [
            ("bounce on its tyre", up, tyre.vertical_stiffness, tyre.vertical_damping),
            ("shear of its patch along", along, shear, shear * BRISTLE_DAMPING),
            ("shear of its patch across", up.cross(&along), shear, shear * BRISTLE_DAMPING),
        ] {
            springs.push(Spring {
                name: format!("wheel `{}`, {what}", wheel.name),
                stiffness,
                damping,
                stretch: stretch(point, way, Some((index, hub, axle))),
            });
        }
    }
    for caster in &robot.casters {
        let point = caster.centre.coords - up * caster.radius;
        let dragged = if caster.drag_coefficient > 0.0 { caster.vertical_stiffness } else { 0.0 };
        for (what, way, stiffness, damping) in [
            ("bounce", up, caster.vertical_stiffness, caster.vertical_damping),
            ("drag along", Vector3::x(), dragged, 0.0),
            ("drag across", Vector3::y(), dragged, 0.0),
        ] {
            let name = format!("caster `{}`, {what}", caster.link);
            springs.push(Spring { name, stiffness, damping, stretch: stretch(point, way, None) });
        }
    }
    springs
}
