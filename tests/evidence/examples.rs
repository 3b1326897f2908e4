//! The examples, run as they stand.

#[path = "../../examples/calibrate.rs"]
mod calibrate;
#[path = "../../examples/diagnose.rs"]
mod diagnose;
#[path = "../../examples/square.rs"]
mod square;
#[path = "../../examples/sweep.rs"]
mod sweep;

#[test]
fn a_square_is_simulated() {
    square::main().expect("it goes through");
}

#[test]
fn a_dataset_is_calibrated() {
    calibrate::main().expect("it goes through");
}

#[test]
fn a_robot_is_diagnosed() {
    diagnose::main().expect("it goes through");
}

#[test]
fn a_plan_is_swept() {
    sweep::main().expect("it goes through");
}
