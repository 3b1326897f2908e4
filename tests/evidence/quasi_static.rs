//! The steady brush tyre solved on its own: no engine, no time, no cells of ours. Streamlines of the patch are followed
//! from where rubber enters to where it leaves, and a robot's steady spin is where the yaw moments balance.

use treadmark::scene::{Scene, Side, Tyre};

const STREAMLINES: usize = 60;
const POINTS: usize = 400;

/// Force along, across \[N\] and moment \[N m\] of a patch in steady motion: slip of its centre, turn slip, and the speed
/// at which rubber passes through, under `load`.
fn steady_patch(tyre: &Tyre, load: f64, slip: [f64; 2], spin: f64, rolling: f64) -> [f64; 3] {
    let a = (2.0 * tyre.free_radius * load / tyre.vertical_stiffness).sqrt();
    let (w, k) = (tyre.width, tyre.bristle_stiffness());
    let dx = 2.0 * a / POINTS as f64;
    let area = dx * w / STREAMLINES as f64;
    let mut total = [0.0; 3];
    for line in 0..STREAMLINES {
        let y = w * ((line as f64 + 0.5) / STREAMLINES as f64 - 0.5);
        let mut u = [0.0; 2];
        for point in 0..POINTS {
            let passed = (point as f64 + 0.5) * dx;
            let x = if rolling > 0.0 { a - passed } else { passed - a };
            let pressure = 0.75 * load / (a * w) * (1.0 - (x / a).powi(2));
            let v = [slip[0] - spin * y, slip[1] + spin * x];
            // In the time dx/|V| that rubber takes to pass, it is dragged by v; to the middle of the interval for the force.
            let time = dx / rolling.abs();
            let middle = [u[0] - 0.5 * v[0] * time, u[1] - 0.5 * v[1] * time];
            let force = within(tyre, pressure, [k * middle[0], k * middle[1]]);
            let end = [u[0] - v[0] * time, u[1] - v[1] * time];
            let held = within(tyre, pressure, [k * end[0], k * end[1]]);
            u = [held[0] / k, held[1] / k];
            total[0] += force[0] * area;
            total[1] += force[1] * area;
            total[2] += (x * force[1] - y * force[0]) * area;
        }
    }
    total
}

/// A traction cut back to the friction ellipse.
fn within(tyre: &Tyre, pressure: f64, traction: [f64; 2]) -> [f64; 2] {
    let use_of =
        (traction[0] / (tyre.friction_along * pressure)).hypot(traction[1] / (tyre.friction_across * pressure));
    if use_of > 1.0 { traction.map(|t| t / use_of) } else { traction }
}

/// b_eff/b of a robot with equal loads spinning steadily on the spot.
pub fn track_factor(scene: &Scene) -> f64 {
    let robot = &scene.robot;
    let load = robot.mass() * treadmark::scene::GRAVITY / robot.wheels.len() as f64;
    let rate = 1.0;
    // Yaw moment at wheel way speed `way` (±): falls as the wheels are faster than the body asks for.
    let moment = |way: f64| -> f64 {
        robot
            .wheels
            .iter()
            .map(|wheel| {
                let at = wheel.base_from_wheel.translation;
                let rolling = if wheel.side == Side::Left { -way } else { way };
                let slip = [-rate * at.y - rolling, rate * at.x];
                let [along, across, own] = steady_patch(&wheel.tyre, load, slip, rate, rolling);
                at.x * across - at.y * along + own
            })
            .sum()
    };
    let half = 0.5 * robot.track_width() * rate;
    let (mut low, mut high) = (half, 4.0 * half);
    assert!(moment(low) < 0.0 && moment(high) > 0.0, "the balance is bracketed");
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if moment(middle) < 0.0 { low = middle } else { high = middle }
    }
    low / half
}
