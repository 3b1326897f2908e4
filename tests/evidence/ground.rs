//! Ground that is not a plane: wheels stand on it, climb it, and the chassis hits it.

use crate::rig::{ideal, ramp_to, settled, step_for};
use nalgebra::{Translation3, UnitQuaternion};
use std::f64::consts::FRAC_PI_2;
use treadmark::scene::{
    Contact, EmpiricalTerm, Feature, Floor, GRAVITY, GripRegion, Obstacle, Placement, RegionShape, Scene, TermPart,
};

fn at(x: f64, y: f64, z: f64) -> Placement {
    Placement::from_parts(Translation3::new(x, y, z), UnitQuaternion::identity())
}

/// A slab and a flat height field carry the robot as the plane does, higher by their height. The squash of the tyres is
/// the same; 1 µm for the settling.
#[test]
fn a_robot_stands_on_slab_and_height_field_as_on_the_plane() {
    let mut scene = ideal("jnpf_4wd");
    let on_plane = settled(&scene).base().translation.z;
    for obstacle in [
        Obstacle::Box { size: [3.0, 3.0, 0.2], placement: at(0.0, 0.0, -0.07), grip_ratio: 1.0 },
        Obstacle::HeightField {
            heights: vec![vec![0.03; 7]; 5],
            spacing: 0.3,
            placement: at(0.0, 0.0, 0.0),
            grip_ratio: 1.0,
        },
    ] {
        scene.floor = Floor { plane: None, obstacles: vec![obstacle], ..Floor::level() };
        let raised = settled(&scene).base().translation.z;
        assert!((raised - on_plane - 0.03).abs() < 1e-6, "{raised}");
    }
}

/// Over a sill and up a ramp onto a slab: at the end the robot stands as high as what it stands on.
#[test]
fn wheels_climb_a_sill_and_a_ramp() {
    let mut scene = ideal("jnpf_4wd");
    let on_plane = settled(&scene).base().translation.z;
    scene.floor.obstacles = vec![
        Obstacle::Box { size: [0.06, 2.0, 0.02], placement: at(0.6, 0.0, 0.0), grip_ratio: 1.0 },
        Obstacle::Ramp { size: [0.8, 2.0, 0.1], placement: at(1.2, 0.0, 0.0), grip_ratio: 1.0 },
        Obstacle::Box { size: [4.0, 2.0, 0.1], placement: at(4.0, 0.0, 0.05), grip_ratio: 1.0 },
    ];
    let mut world = settled(&scene);
    ramp_to(&mut world, 4.0, 4.0);
    let mut highest: f64 = 0.0;
    while world.pose().x < 1.0 {
        step_for(&mut world, 0.01);
        highest = highest.max(world.base().translation.z);
    }
    // The 10 mm sill lifts one axle at a time, the base by half of it.
    assert!((highest - on_plane - 0.005).abs() < 1e-3, "{highest}");
    while world.pose().x < 3.0 {
        step_for(&mut world, 0.01);
    }
    ramp_to(&mut world, 0.0, 0.0);
    step_for(&mut world, 1.0);
    let raised = world.base().translation.z - on_plane;
    assert!((raised - 0.1).abs() < 1e-5, "{raised}");
}

/// A post between the wheels stops the robot where the chassis' front meets it.
#[test]
fn a_post_stops_the_chassis() {
    let mut scene = ideal("jnpf_4wd");
    scene.floor.obstacles =
        vec![Obstacle::Box { size: [0.1, 0.25, 0.5], placement: at(1.05, 0.0, 0.35), grip_ratio: 1.0 }];
    // Motors too weak to climb it.
    scene.robot.drivetrain.motor_stall_torque = 0.03;
    let mut world = settled(&scene);
    ramp_to(&mut world, 2.0, 2.0);
    step_for(&mut world, 8.0);
    // The post's face is at 1.0 m, the chassis reaches 0.22 m ahead of its base. The engine lets solids overlap by a few
    // millimetres where they are pushed together.
    let nose = world.pose().x + 0.22;
    assert!((nose - 1.0).abs() < 0.01, "{nose}");
}

/// Polished ground under the left wheels lets them slip where the rest grips: what was to be a spin becomes a drive along the gripping side.
#[test]
fn a_region_of_other_grip_is_felt_where_it_is() {
    let mut scene = ideal("jnpf_4wd");
    let shape = RegionShape::Rectangle { min: [-1.0, 0.0], max: [1.0, 1.0] };
    scene.floor.regions = vec![GripRegion { shape, grip_ratio: 0.2 }];
    let mut world = settled(&scene);
    ramp_to(&mut world, -2.0, 2.0);
    step_for(&mut world, 1.0);
    // The gripping right side rolls at 0.2 m/s and drags the robot along; the left has not the grip to turn it.
    let twist = world.twist();
    assert!(twist.forward > 0.1 && twist.yaw_rate > 0.0 && twist.yaw_rate < 0.3, "{twist:?}");
    assert!((scene.floor.grip_ratio_at(0.0, 0.5) - 0.2).abs() < 1e-12);
    assert!((scene.floor.grip_ratio_at(0.0, -0.5) - 1.0).abs() < 1e-12);
    assert!((scene.floor.grip_ratio_at(0.0, 0.0) - 0.6).abs() < 1e-12, "half way at the edge");
}

/// The engine's own cylinders feel the floor as tyres do: a carpet that carries by 1 % of the way and turns by 0.01 rad/m
/// does so to 1 % of that, and on ground of half the grip the robot slides sideways at g(sin θ − μ/2 cos θ), 1 % for the
/// hinges that give.
#[test]
fn the_engines_own_contacts_feel_the_floor() {
    let rigid = || {
        let mut scene = ideal("jnpf_4wd");
        scene.contact = Contact::Rigid;
        scene
    };
    let end = |empirical: &[EmpiricalTerm]| {
        let mut scene = rigid();
        scene.empirical = empirical.to_vec();
        let mut world = settled(&scene);
        ramp_to(&mut world, 4.0, 4.0);
        step_for(&mut world, 5.0);
        world.pose()
    };
    let term = |part| EmpiricalTerm { part, feature: Feature::Speed, coefficient: 0.01 };
    let still = end(&[]);
    let carried = end(&[term(TermPart::Forward)]);
    assert!(((carried.x / still.x - 1.0) / 0.01 - 1.0).abs() < 0.02, "{carried:?} against {still:?}");
    let turned = end(&[term(TermPart::Yaw)]);
    assert!((turned.heading / (0.01 * still.x) - 1.0).abs() < 0.02, "{turned:?} against {still:?}");

    let mut scene = rigid();
    scene.floor.gradient = 0.6;
    scene.floor.downhill_heading = FRAC_PI_2;
    let shape = RegionShape::Rectangle { min: [-5.0, -5.0], max: [5.0, 5.0] };
    scene.floor.regions = vec![GripRegion { shape, grip_ratio: 0.5 }];
    let mut world = settled(&scene);
    let from = world.twist().left;
    step_for(&mut world, 1.0);
    let slope = 0.6f64.atan();
    let expected = GRAVITY * (slope.sin() - 0.5 * 0.8 * slope.cos());
    let acceleration = world.twist().left - from;
    assert!((acceleration / expected - 1.0).abs() < 0.01, "{acceleration:.4} against {expected:.4}");
}

/// A potential pulls the robot as a slope does that is as steep. Driving along x in U = c x y it is pulled aside by −c x, on average by
/// what pulls it half way, and creeps aside by as much of what it creeps on a floor that falls all along as steeply as it pulls at the
/// end: to 1 %, for a tyre answers within its patch's length. At a standstill it is held.
#[test]
fn a_potential_pulls_as_a_slope_does() {
    const FALLS: f64 = 0.02;
    // From where to where it is driven, and what it creeps to the left on the way.
    let driven = |scene: &Scene| {
        let mut world = settled(scene);
        let at_rest = world.pose();
        step_for(&mut world, 2.0);
        assert!((world.pose().y - at_rest.y).abs() < 1e-6, "{at_rest:?} {:?}", world.pose());
        ramp_to(&mut world, 4.0, 4.0);
        let from = world.pose();
        let mut crept = 0.0;
        for _ in 0..1000 {
            step_for(&mut world, 0.01);
            crept += 0.01 * world.twist().left;
        }
        ([from.x, world.pose().x], crept)
    };
    let mut sloping = ideal("jnpf_4wd");
    sloping.floor.gradient = FALLS;
    sloping.floor.downhill_heading = -FRAC_PI_2;
    let ([from, to], on_slope) = driven(&sloping);
    let mut pulled = ideal("jnpf_4wd");
    let coefficient = FALLS * pulled.robot.mass() * GRAVITY / to;
    pulled.empirical = vec![EmpiricalTerm { part: TermPart::Potential, feature: Feature::XY, coefficient }];
    let (_, in_potential) = driven(&pulled);
    let expected = on_slope * 0.5 * (from + to) / to;
    assert!(on_slope < -1e-3, "{on_slope}");
    assert!((in_potential / expected - 1.0).abs() < 0.01, "{in_potential} of {on_slope} from {from} to {to} m");
}
