//! Closed forms that a robot is held against.

use crate::scene::{Scene, Side, Wheel};

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
