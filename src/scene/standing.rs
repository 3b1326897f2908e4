//! How a robot stands: what each of its wheels and casters carries on level ground.
//!
//! Wheels and casters are springs under a rigid body. Where there are more than three of them statics alone do not say what each
//! carries, and stiff casters ahead and behind take the weight off soft tyres, which then pull at nothing.
//! Validated by `loads_are_those_of_levers_and_of_stiffness` below, and against loads in the world by
//! `describe::casters_ahead_and_behind_leave_the_wheels_their_load`.

use super::GRAVITY;
use super::robot::Robot;
use nalgebra::{Matrix3, Point3, Vector3};
use std::f64::consts::{PI, TAU};

/// Where a robot touches the ground.
struct Support {
    /// Its lowest point while it carries nothing, in the base frame.
    lowest: Point3<f64>,
    /// Vertical \[N/m\].
    stiffness: f64,
}

/// Share of the weight that driven wheels carry at least \[–\]: rubber that carries less pulls with less than a fifth of it.
const LEAST_SHARE: f64 = 0.25;

/// What is odd about how `robot` stands, in plain words.
pub(super) fn notes(robot: &Robot) -> Option<String> {
    let supports = supports(robot);
    let centre = robot.whole().centre_of_mass;
    if tips(&supports, centre) {
        return Some(format!(
            "the centre of mass lies at x = {:.3} m, y = {:.3} m, which is not between the wheels and casters that it stands \
             on: it tips",
            centre.x, centre.y
        ));
    }
    let weight = robot.mass() * GRAVITY;
    let loads = loads(&supports, weight, centre)?;
    let share = loads[..robot.wheels.len()].iter().sum::<f64>() / weight;
    (share < LEAST_SHARE).then(|| {
        format!(
            "its driven wheels carry {:.0} % of its weight and its casters the rest, so that the wheels slip; casters of a \
             lower vertical_stiffness_n_m or a smaller radius_m leave them more",
            100.0 * share
        )
    })
}

/// Wheels first, then casters.
fn supports(robot: &Robot) -> Vec<Support> {
    let under = |centre: Point3<f64>, radius: f64| Point3::new(centre.x, centre.y, centre.z - radius);
    let wheels = robot.wheels.iter().map(|wheel| Support {
        lowest: under(Point3::from(wheel.base_from_wheel.translation.vector), wheel.tyre.free_radius),
        stiffness: wheel.tyre.vertical_stiffness,
    });
    let casters = robot
        .casters
        .iter()
        .map(|caster| Support { lowest: under(caster.centre, caster.radius), stiffness: caster.vertical_stiffness });
    wheels.chain(casters).collect()
}

/// Whether all supports lie to one side of `centre`, as seen from above.
fn tips(supports: &[Support], centre: Point3<f64>) -> bool {
    let seen = |support: &Support| (support.lowest.y - centre.y).atan2(support.lowest.x - centre.x);
    let mut directions: Vec<f64> = supports.iter().map(seen).collect();
    directions.sort_by(f64::total_cmp);
    let round = directions.first().map(|first| first + TAU);
    let next = directions.iter().skip(1).copied().chain(round);
    directions.iter().zip(next).any(|(one, next)| next - one >= PI)
}

/// What each support carries \[N\]; `None` where no ground bears the body.
///
/// The ground is the plane z = h + a x + b y in the base frame, a and b small; a support is pressed in by what it reaches below it,
/// and pulls at nothing. Force and two moments balance where the energy of springs and weight is least, which is convex: Newton's
/// steps, halved until they lead down.
fn loads(supports: &[Support], weight: f64, centre: Point3<f64>) -> Option<Vec<f64>> {
    const STEPS: usize = 100;
    let lever = |at: Point3<f64>| Vector3::new(1.0, at.x, at.y);
    let pressed =
        |support: &Support, plane: &Vector3<f64>| (plane.dot(&lever(support.lowest)) - support.lowest.z).max(0.0);
    let energy = |plane: &Vector3<f64>| {
        let springs =
            supports.iter().map(|support| 0.5 * support.stiffness * pressed(support, plane).powi(2)).sum::<f64>();
        springs - weight * lever(centre).dot(plane)
    };
    // From where all are pressed in.
    let highest = supports.iter().map(|support| support.lowest.z).fold(f64::NEG_INFINITY, f64::max);
    let mut plane = Vector3::new(highest + 1.0, 0.0, 0.0);
    for _ in 0..STEPS {
        let (mut stiffness, mut missing) = (Matrix3::zeros(), weight * lever(centre));
        for support in supports {
            let (lever, by) = (lever(support.lowest), pressed(support, &plane));
            missing -= support.stiffness * by * lever;
            if by > 0.0 {
                stiffness += support.stiffness * lever * lever.transpose();
            }
        }
        if missing.norm() < 1e-9 * weight {
            return Some(supports.iter().map(|support| support.stiffness * pressed(support, &plane)).collect());
        }
        // Two supports, or one, leave the plane free to turn about them.
        stiffness += Matrix3::identity() * (1e-9 * stiffness.trace());
        let mut step = stiffness.cholesky()?.solve(&missing);
        let here = energy(&plane);
        while energy(&(plane + step)) > here {
            step *= 0.5;
        }
        plane += step;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn support(x: f64, y: f64, z: f64, stiffness: f64) -> Support {
        Support { lowest: Point3::new(x, y, z), stiffness }
    }

    #[test]
    fn loads_are_those_of_levers_and_of_stiffness() {
        let near = |one: &[f64], other: &[f64]| one.iter().zip(other).all(|(one, other)| (one - other).abs() < 1e-9);
        // Three supports: levers alone, however stiff.
        let three = [support(0.0, 0.2, 0.0, 1e4), support(0.0, -0.2, 0.0, 3e4), support(-0.3, 0.0, 0.01, 1e6)];
        let carried = loads(&three, 90.0, Point3::new(-0.1, 0.0, 0.0)).expect("it stands");
        assert!(near(&carried, &[30.0, 30.0, 30.0]), "{carried:?}");
        // Two wheels, and casters a hundred times as stiff ahead and behind: 1 part in 101.
        let wheels = [support(0.0, 0.2, 0.0, 1e4), support(0.0, -0.2, 0.0, 1e4)];
        let casters = [support(0.3, 0.0, 0.0, 1e6), support(-0.3, 0.0, 0.0, 1e6)];
        let four: Vec<Support> = wheels.into_iter().chain(casters).collect();
        let carried = loads(&four, 101.0, Point3::origin()).expect("it stands");
        assert!(near(&carried, &[0.5, 0.5, 50.0, 50.0]), "{carried:?}");
        // Casters 1 mm above the ground, and tyres that give way by half of that: the one that the body leans on carries its tenth.
        let high = [
            support(0.0, 0.2, 0.0, 1e5),
            support(0.0, -0.2, 0.0, 1e5),
            support(0.3, 0.0, 1e-3, 1e6),
            support(-0.3, 0.0, 1e-3, 1e6),
        ];
        let carried = loads(&high, 100.0, Point3::new(-0.03, 0.0, 0.0)).expect("it stands");
        assert!(near(&carried, &[45.0, 45.0, 0.0, 10.0]), "{carried:?}");
        // Beside, ahead of or on the edge of what it stands on.
        assert!(!tips(&three, Point3::new(-0.01, 0.0, 0.0)));
        assert!(tips(&three, Point3::new(0.01, 0.0, 0.0)) && tips(&three, Point3::new(-0.2, 0.1, 0.0)));
    }
}
