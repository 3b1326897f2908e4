//! Published figures, beside their source.

use crate::rig::{ideal, run, track_factor_in_spin};
use treadmark::dataset::{Protocol, Rotation};
use treadmark::geometry::Pose2;
use treadmark::scene::Scene;

/// Bei, Ping & Gao, Table I, "before compensation": r_cg of 2 m squares, 0.4583 m CW and 0.5043 m CCW. The robot is
/// made to be near (its dimensions are not printed); required within 10 %.
#[test]
fn the_uncalibrated_robot_ends_near_the_papers_first_row() {
    let scene = Scene::load("jnpf_4wd", "lab_floor").expect("shipped").noise_free();
    for (direction, paper) in [(Rotation::Clockwise, 0.4583), (Rotation::CounterClockwise, 0.5043)] {
        let error = run(&scene, Protocol::Square { side: 2.0, direction }).true_error();
        let distance = error.distance(Pose2::IDENTITY);
        assert!((distance / paper - 1.0).abs() < 0.1, "{direction:?}: {distance:.4} m against {paper} m");
    }
}

/// Clearpath ships the Husky A200 with a track multiplier of 1.875 (husky_control); a rigid robot with equal loads on
/// its published dimensions has 1 + (l/b)² = 1.805, its patches make that 1.82. Within 5 %: the multiplier is rounded and was
/// found on one floor.
#[test]
fn the_husky_turns_as_its_maker_says() {
    let factor = track_factor_in_spin(&ideal("husky_a200"), 2.0);
    assert!((factor / 1.875 - 1.0).abs() < 0.05, "{factor:.4}");
}
