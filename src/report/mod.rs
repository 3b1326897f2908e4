//! Results → text, JSON, ROS 2 parameters, figures. Every number that a command prints comes from here, in one wording.

pub mod certify;
pub mod challenge;
pub mod check;
pub mod diagnosis;
pub mod import;
pub mod json;
pub mod plot;
pub mod ros2;
pub mod text;
