//! Results → text, JSON, HTML, ROS 2 parameters, figures. Every number that a command prints comes from here, in one wording.

pub mod certify;
pub mod challenge;
pub mod check;
pub mod diagnosis;
pub mod grid;
pub mod import;
pub mod json;
pub mod page;
pub mod plot;
pub mod power;
pub mod ros2;
pub mod table_one;
pub mod text;
