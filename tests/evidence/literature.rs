//! Published figures, beside their source.

use crate::rig::{ideal, run, track_factor_in_spin};
use treadmark::dataset::{Protocol, Rotation};
use treadmark::experiment::certify::literature;
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

/// Multipliers shipped or used for five robots, each predicted from its dimensions alone. As one reads them, as bands: what
/// is published lies within 8 % of what is predicted. Fits of one robot spread by 10 %, which is what a mass centre moved by 5 % of
/// its wheelbase does; no robot is tuned.
#[test]
fn published_multipliers_are_near_what_dimensions_say() {
    let rows = literature(&|_| ()).expect("shipped");
    for row in &rows {
        let (robot, published) = (row.published.robot, row.published);
        // 1 + (l/b)² is below the prediction by what the patch adds, about (w² + (2a)²)/(3b²) (science note 2), within a third.
        let patch = (row.patch[0].powi(2) + row.patch[1].powi(2)) / (3.0 * row.track_width.powi(2));
        assert!((row.predicted - row.theory - patch).abs() < patch / 3.0, "{robot}: {} and {patch}", row.predicted);
        if published.source.starts_with("fitted") {
            // Below 1 + (l/b)² only a mass centre off the middle, or less grip across, leads.
            assert!(row.load_offset.is_some() && row.patch_scale.is_none(), "{robot}: {row:?}");
        } else {
            assert!((row.predicted / published.factor - 1.0).abs() < 0.08, "{robot}: {row:?}");
            assert!(row.load_offset.is_none(), "{robot}: an offset only lowers the factor: {row:?}");
        }
    }
}
