//! Results → text, JSON, ROS 2 parameters. Every number that a command prints comes from here, in one wording.

pub mod check;
pub mod import;
pub mod json;
pub mod ros2;
pub mod text;
