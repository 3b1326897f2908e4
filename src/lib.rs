//! `treadmark`: a rigid-body testbed for the odometry of wheeled robots.

pub mod calibrate;
pub mod cli;
pub mod dataset;
pub mod drive;
pub mod experiment;
pub mod geometry;
pub mod odometry;
#[cfg(feature = "recording")]
pub mod recording;
pub mod report;
pub mod scene;
pub mod world;
