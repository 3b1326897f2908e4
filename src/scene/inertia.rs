//! Inertias that no such robot has: placeholders, with which many URDFs are published. A wheel that is a flywheel, or a chassis that
//! resists no turn, stands and rolls as it should, and drives as nothing on earth.

use super::robot::Robot;

/// Radius at which all of a chassis's mass would lie at least, over the track: a full box as wide as the track has 0.4.
const LEAST_GYRATION: f64 = 0.1;

/// What is not to be believed about the masses of `robot`, in plain words.
pub(super) fn notes(robot: &Robot) -> Vec<String> {
    let gyration = |inertia: f64, mass: f64| (inertia / mass).sqrt();
    // No part of a wheel lies farther from its axle than its tread does.
    let flywheels = robot.wheels.iter().filter_map(|wheel| {
        let (inertia, mass, radius) = (wheel.spin_inertia(), wheel.body.mass, wheel.tyre.free_radius);
        let at = gyration(inertia, mass);
        (at > radius).then(|| {
            format!(
                "wheel `{}`: its moment of inertia about its axle, {inertia:.3e} kg m², is that of its {mass:.3} kg at {:.0} mm, \
                 and it ends at {:.0} mm: a placeholder in the URDF?",
                wheel.name,
                1e3 * at,
                1e3 * radius
            )
        })
    });
    let (yaw, mass) = (robot.chassis.inertia.m33, robot.chassis.mass);
    let at = gyration(yaw, mass);
    let needle = (at < LEAST_GYRATION * robot.track_width()).then(|| {
        format!(
            "chassis: its moment of inertia in yaw, {yaw:.3e} kg m², is that of its {mass:.3} kg at {:.0} mm, and its wheels \
             stand {:.0} mm apart: a placeholder in the URDF?",
            1e3 * at,
            1e3 * robot.track_width()
        )
    });
    flywheels.chain(needle).collect()
}
