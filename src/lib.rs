//! `treadmark`: a rigid-body testbed for the odometry of wheeled robots, and a detective for what it gets wrong.
//!
//! Wheeled robots dead-reckon from wheel encoders, and drift. Labs drive a square clockwise and counter-clockwise,
//! measure where the robot ended, and correct what it believes of its wheel diameters and track (UMBmark
//! \[Borenstein & Feng 1996\]). This crate simulates such a robot with rubber tyres on real contact patches, drives the
//! squares by encoders alone, calibrates, and drives again.
//!
//! # The method on one page
//!
//! ```
//! use std::sync::atomic::AtomicBool;
//! use treadmark::calibrate::{Method, Training};
//! use treadmark::dataset::{Dataset, Protocol, Rotation};
//! use treadmark::drive::{self, Task};
//! use treadmark::experiment::campaign;
//! use treadmark::scene::Scene;
//!
//! // A robot (URDF and model file), a floor, a survey: everything that is physically so.
//! let mut scene = Scene::load("jnpf_4wd", "lab_floor")?.noise_free();
//!
//! // Drive a square of 1 m each way round, closed by ticks alone, and survey where it ended.
//! let square = |scene: &Scene, direction: Rotation| {
//!     let name = direction.as_str().to_owned();
//!     let protocol = Protocol::Square { side: 1.0, direction };
//!     let task = Task::new(name, protocol);
//!     drive::run(scene, &task, 1, None, &AtomicBool::new(false))
//! };
//! let cw = square(&scene, Rotation::Clockwise)?;
//! let ccw = square(&scene, Rotation::CounterClockwise)?;
//!
//! // What a lab would have noted is a dataset; from it, what the robot should have believed.
//! let dataset = Dataset { campaign: campaign(&scene, "doc"), runs: vec![cw.measured.clone(), ccw.measured] };
//! let umbmark = Method::named("umbmark").expect("it is one of METHODS");
//! let correction = umbmark.estimate(&Training::new(&[dataset])?)?.correction();
//! assert!(correction.track_ratio > 1.03); // the robot believed too narrow a track: it scrubs when it turns
//!
//! // The calibrated robot drives again.
//! scene.robot.odometry = scene.robot.odometry.corrected(&correction);
//! let again = square(&scene, Rotation::Clockwise)?;
//! assert!(again.true_error().heading.abs() < 0.3 * cw.true_error().heading.abs());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The house
//!
//! Reading order is data order. Two wings, simulation and inference, meet at one waist, the dataset.
//!
//! - Ground floor, plain data without an engine: [`geometry`], [`odometry`], [`dataset`] (the waist), [`import`] (a real
//!   robot's recordings → dataset), [`scene`], [`effect`] (every cause that a model may leave out),
//!   [`table`] (rows under named columns, and their file).
//! - Simulation wing: [`world`] (scene → rapier, one step at a time), [`drive`] (protocols, the driver, one run).
//! - Inference wing: [`calibrate`], [`diagnose`] (which causes a model leaves out, from a forward model handed in).
//! - Compositions and outlets: [`experiment`], [`report`], `recording` (feature `recording`), [`cli`].
//!
//! # Invariants
//!
//! Imports run downward only, and a test reads them (`architecture`):
//!
//! 1. `calibrate` and `diagnose` import neither `world` nor `drive`: they see data, never a simulated truth.
//! 2. The driver receives ticks, never poses.
//! 3. A third party stays in its room: rapier and parry in `world`, `urdf_rs` in `scene`, `mcap` and `cdr_encoding` in
//!    `import`, parquet in `table`, rerun in `recording`, plotters and maud in `report`, clap and anyhow in `cli` and
//!    `main`.
//! 4. A [`Scene`](scene::Scene) is immutable and complete: the same scene, protocol and seed give the same bits. Set-up
//!    and running state are two types (`Scene` → `World`, `Protocol` → `Driver`), so runs go side by side on threads.
//!
//! # Frames and units
//!
//! SI units and radians in `f64`, `[m]` in the docs; on the wire every key and column carries its unit. Base frame:
//! x forward, y left, z up. Room frame: x, y in the floor, z its normal; a sloping floor is gravity that leans. Headings
//! are counter-clockwise positive and unwrapped. A transform `a_from_b` takes b's coordinates to a's.
//!
//! # Words
//!
//! `track_width` b, lateral distance of left and right contact centres (some papers call it wheelbase), or the effective
//! one that an odometry divides by; `wheelbase` l, axle to axle; `free_radius`, `rolling_radius` R_e, travel a radian;
//! `diameter_ratio` E_d, `track_ratio` E_b, `distance_scale` E_s: corrections to what the robot believed.
//!
//! # References
//!
//! - J. Borenstein, L. Feng, "Measurement and correction of systematic odometry errors in mobile robots", *IEEE Trans.
//!   Robotics and Automation* 12(6), 1996.
//! - X. Bei, X. Ping, W. Gao, "Calibration of Systematic Errors for Wheeled Mobile Robots".
//! - H. B. Pacejka, *Tyre and Vehicle Dynamics*.
//! - J. J. Kalker, "A fast algorithm for the simplified theory of rolling contact", *Vehicle System Dynamics* 11, 1982.

// What is printed goes through `cli::say`, which a closed pipe does not end.
#![deny(clippy::print_stdout, clippy::print_stderr)]

pub mod calibrate;
pub mod cli;
pub mod dataset;
pub mod diagnose;
pub mod drive;
pub mod effect;
pub mod experiment;
pub mod geometry;
pub mod import;
pub mod odometry;
#[cfg(feature = "recording")]
pub mod recording;
pub mod report;
pub mod scene;
pub mod strict;
pub mod table;
pub mod world;
