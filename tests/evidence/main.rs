//! The evidence, in one binary, by kind.

mod allocation;
mod analytic;
mod another_hand;
mod architecture;
mod calibration;
mod certify;
mod check;
mod cli;
mod dataset;
mod describe;
mod diagnosis;
mod effects;
mod examples;
mod ground;
mod import;
mod literature;
mod property;
mod quasi_static;
mod report;
mod rig;
mod stamps;
mod sweep;
mod swivel;
mod windows;
