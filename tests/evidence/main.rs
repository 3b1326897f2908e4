//! The evidence, in one binary, by kind.

mod analytic;
mod architecture;
mod cli;
mod dataset;
mod property;
mod quasi_static;
mod rig;
