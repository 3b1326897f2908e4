//! What made the paper's own Table I possible: a search of the catalogue for causes under which the simulated robot,
//! calibrated as printed, ends where the paper's did.
//!
//! The table's six distances (r_cg clockwise and counter-clockwise before, after UMBmark, after the paper's method) are
//! measured data. Every candidate is a robot with unequal tyres, another mean diameter and another effective track, all
//! three free, and none or one cause of the catalogue on top; beside the best of those, each other one as a second. Each is
//! fitted by Gauss–Newton through the whole experiment: drive, calibrate, drive again. A candidate begins beside where the
//! one with a cause less ended, and so ends no worse but for what a last step leaves.

use crate::calibrate::{CalibrateError, Method, Training};
use crate::dataset::{Dataset, Protocol, Rotation, Travel};
use crate::drive::{self, DriveError, Task};
use crate::effect::{Cause, EFFECTS, Effect, Prior};
use crate::experiment::campaign;
use crate::scene::Scene;
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// r_cg of 2 m squares \[m\], clockwise and counter-clockwise: before, after UMBmark, after the paper's method
/// [Bei, Ping & Gao, Table I].
pub const TABLE_ONE: [f64; 6] = [0.4583, 0.5043, 0.2019, 0.4175, 0.0769, 0.1099];

/// What one distance of the table is worth: five runs, surveyed and scattered as usual \[m\], and a share of the distance
/// for a robot whose dimensions the paper does not print.
const UNCERTAINTY: [f64; 2] = [0.010, 0.03];
/// Side of the squares \[m\].
const SIDE: f64 = 2.0;

/// A candidate at its best.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Everything that is in the robot: unequal tyres, mean diameter and track, then what is on top of them.
    pub causes: Vec<Cause>,
    /// The six distances that it would have brought \[m\].
    pub distances: [f64; 6],
    /// Of the six distances.
    pub chi2: f64,
    /// How far its numbers lie from what is plausible beforehand: root of Σ of squared σ.
    pub strain: f64,
    /// ln evidence.
    pub log_evidence: f64,
    /// Where its free numbers are.
    at: Vec<f64>,
}

impl Candidate {
    /// What is on top of unequal tyres, mean diameter and track.
    pub fn on_top(&self) -> &[Cause] {
        &self.causes[ALWAYS.len()..]
    }
}

/// What is free in every candidate.
const ALWAYS: [&str; 3] = ["wheel_diameter_mismatch", "wheel_diameter_scale", "effective_track"];

/// Why the study ended.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableOneError {
    /// A run.
    #[error(transparent)]
    Drive(#[from] DriveError),
    /// A calibration.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
}

/// One free number of a candidate.
#[derive(Clone)]
struct Free {
    cause: usize,
    parameter: usize,
    mean: f64,
    std_dev: f64,
    bounds: [f64; 2],
}

/// The six distances of a robot.
///
/// # Errors
/// It cannot be driven, or not be calibrated.
pub fn distances(scene: &Scene, stop: &AtomicBool) -> Result<[f64; 6], TableOneError> {
    let drive_all = |scene: &Scene, with_straight: bool| -> Result<Dataset, DriveError> {
        let mut protocols: Vec<Protocol> = [Rotation::Clockwise, Rotation::CounterClockwise]
            .map(|direction| Protocol::Square { side: SIDE, direction })
            .to_vec();
        if with_straight {
            protocols.push(Protocol::Straight { length: SIDE, direction: Travel::Forward });
        }
        let runs = protocols
            .iter()
            .enumerate()
            .map(|(number, &protocol)| {
                let mut run = drive::run(scene, &Task::new(number.to_string(), protocol), 0, None, stop)?.measured;
                (run.encoders, run.poses) = (None, None);
                Ok(run)
            })
            .collect::<Result<_, DriveError>>()?;
        Ok(Dataset { campaign: campaign(scene, "table-one"), runs })
    };
    // r: distance of the surveyed from the dead-reckoned end.
    let ends = |dataset: &Dataset| -> [f64; 2] {
        std::array::from_fn(|index| {
            let run = &dataset.runs[index];
            let odometry = run.odometry_end.map_or((0.0, 0.0), |end| (end.x, end.y));
            run.end.map_or(f64::NAN, |end| (end.x - odometry.0).hypot(end.y - odometry.1))
        })
    };
    let before = drive_all(scene, true)?;
    let training = Training::new(std::slice::from_ref(&before))?;
    let mut all = ends(&before).to_vec();
    for method in ["umbmark", "bei2018"] {
        let method = Method::named(method).expect("it is one of METHODS");
        let mut calibrated = scene.clone();
        calibrated.robot.odometry = scene.robot.odometry.corrected(&method.estimate(&training)?.correction());
        all.extend(ends(&drive_all(&calibrated, false)?));
    }
    Ok(std::array::from_fn(|index| all[index]))
}

/// Every candidate, the best first. `watch` is told of each that is done.
///
/// # Errors
/// The study was stopped. A candidate that cannot be driven anywhere is left out.
pub fn table_one(
    base: &Scene,
    watch: &(dyn Fn(&Candidate) + Sync),
    stop: &AtomicBool,
) -> Result<Vec<Candidate>, TableOneError> {
    let mut base = base.clone().noise_free();
    base.robot.chassis.visuals.clear();
    base.robot.wheels.iter_mut().for_each(|wheel| wheel.body.visuals.clear());
    let others = EFFECTS.iter().filter(|effect| {
        // A drift, a clock and a friction ratio do nothing here, or what the track does.
        let idle = ["tyre_radius_drift", "survey_time_offset", "tyre_grip_anisotropy"];
        effect.applies(&base) && !ALWAYS.contains(&effect.id) && !idle.contains(&effect.id)
    });
    let extras: Vec<Cause> = others
        .flat_map(|effect| effect.choices(&base).into_iter().map(|choice| Cause { choice, ..effect.nothing() }))
        .collect();
    let beside = |known: &Candidate| -> Vec<Candidate> {
        let on_top = known.on_top();
        let new = extras.par_iter().filter(|extra| on_top.iter().all(|cause| cause.effect != extra.effect));
        new.filter_map(|extra| {
            let causes = on_top.iter().cloned().chain([extra.clone()]).collect();
            let candidate = fit(&base, causes, &known.at, stop)?;
            watch(&candidate);
            Some(candidate)
        })
        .collect()
    };
    let by_evidence = |candidates: &mut Vec<Candidate>| {
        candidates.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
    };
    let mut candidates: Vec<Candidate> = fit(&base, Vec::new(), &[], stop).into_iter().collect();
    if let Some(nothing) = candidates.first() {
        watch(nothing);
        candidates.extend(beside(nothing));
        by_evidence(&mut candidates);
        candidates.extend(beside(&candidates[0]));
        by_evidence(&mut candidates);
    }
    if stop.load(Ordering::Relaxed) {
        return Err(DriveError::Interrupted { run: "table one".to_owned() }.into());
    }
    Ok(candidates)
}

/// One candidate at its best, from where the one with a cause less ended and the last cause to either side; `None` where it
/// cannot be driven.
fn fit(base: &Scene, on_top: Vec<Cause>, known: &[f64], stop: &AtomicBool) -> Option<Candidate> {
    let mut causes: Vec<Cause> =
        ALWAYS.iter().map(|id| Effect::named(id).expect("it is in the catalogue").nothing()).collect();
    causes.extend(on_top);
    let mut free = Vec::new();
    for (index, cause) in causes.iter_mut().enumerate() {
        for (parameter, entry) in cause.effect.parameters.iter().enumerate() {
            // What the robot's track really is, the paper does not say.
            let wide = if cause.effect.id == "effective_track" { 5.0 } else { 1.0 };
            let (mean, std_dev) = match entry.prior {
                Prior::Normal { mean, std_dev } => (mean, std_dev * wide),
                Prior::HalfNormal { std_dev } => (0.0, std_dev),
                Prior::AnyHeading => (0.0, 1.8),
                // A spot matters where the robot turns: at its first corner.
                Prior::OnPath => {
                    cause.values[parameter] = if entry.name == "x_m" { SIDE } else { 0.0 };
                    continue;
                }
                Prior::Known(_) => continue,
            };
            free.push(Free { cause: index, parameter, mean, std_dev, bounds: entry.bounds });
        }
    }
    let at = |x: &DVector<f64>| {
        let mut causes = causes.clone();
        for (free, value) in free.iter().zip(x.iter()) {
            causes[free.cause].values[free.parameter] = value.clamp(free.bounds[0], free.bounds[1]);
        }
        causes
    };
    let predict = |x: &DVector<f64>| distances(&Cause::edit_all(&at(x), base), stop).ok();
    let mut best: Option<Fit> = None;
    let starts: &[f64] = if known.is_empty() { &[0.0] } else { &[0.7, -0.7] };
    for &start in starts {
        let mut x = DVector::from_iterator(
            free.len(),
            free.iter().enumerate().map(|(k, free)| match known.get(k) {
                Some(&value) => value,
                // One-sided: a little or more of it.
                None if free.bounds[0] >= 0.0 => free.mean + free.std_dev * (0.5 + 0.3 * start),
                None => free.mean + free.std_dev * start,
            }),
        );
        let mut here = predict(&x)?;
        let cost_of = |x: &DVector<f64>, d: &[f64; 6]| -> f64 {
            let prior: f64 = free.iter().zip(x.iter()).map(|(f, v)| ((v - f.mean) / f.std_dev).powi(2)).sum();
            chi2(d) + prior
        };
        let mut cost = cost_of(&x, &here);
        let mut normal = DMatrix::identity(free.len(), free.len());
        for _ in 0..10 {
            let mut jacobian = DMatrix::zeros(6, free.len());
            for (column, free) in free.iter().enumerate() {
                let step = 0.15 * free.std_dev;
                let mut moved = x.clone();
                moved[column] += step;
                let there = predict(&moved)?;
                for row in 0..6 {
                    jacobian[(row, column)] = (there[row] - here[row]) / step / sigma(row);
                }
            }
            let off = DVector::from_fn(6, |row, _| (TABLE_ONE[row] - here[row]) / sigma(row));
            let precision = DVector::from_iterator(free.len(), free.iter().map(|free| free.std_dev.powi(-2)));
            normal = jacobian.tr_mul(&jacobian) + DMatrix::from_diagonal(&precision);
            let pull =
                DVector::from_iterator(free.len(), free.iter().zip(x.iter()).map(|(free, value)| free.mean - value));
            let step = Cholesky::new(normal.clone())?.solve(&(jacobian.tr_mul(&off) + precision.component_mul(&pull)));
            // Distances are folded: halve the step until it helps.
            let mut share = 1.0;
            let mut better = None;
            while share > 0.1 {
                let moved = &x + &step * share;
                if let Some(there) = predict(&moved) {
                    let value = cost_of(&moved, &there);
                    if value < cost {
                        better = Some((moved, there, value));
                        break;
                    }
                }
                share *= 0.4;
            }
            let Some((moved, there, value)) = better else { break };
            let gained = cost - value;
            (x, here, cost) = (moved, there, value);
            if gained < 0.05 {
                break;
            }
        }
        if best.as_ref().is_none_or(|known| cost < known.cost) {
            best = Some(Fit { cost, x, normal, distances: here });
        }
    }
    let Fit { cost, x, normal, distances } = best?;
    let log_det: f64 = 2.0 * Cholesky::new(normal)?.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    let log_prior: f64 = -free.iter().map(|free| free.std_dev.ln()).sum::<f64>();
    Some(Candidate {
        causes: at(&x),
        chi2: chi2(&distances),
        strain: (cost - chi2(&distances)).max(0.0).sqrt(),
        at: x.iter().copied().collect(),
        distances,
        log_evidence: -0.5 * cost - 0.5 * log_det + log_prior,
    })
}

/// Where a search ended.
struct Fit {
    cost: f64,
    x: DVector<f64>,
    normal: DMatrix<f64>,
    distances: [f64; 6],
}

fn sigma(row: usize) -> f64 {
    UNCERTAINTY[0].hypot(UNCERTAINTY[1] * TABLE_ONE[row])
}

fn chi2(distances: &[f64; 6]) -> f64 {
    (0..6).map(|row| ((TABLE_ONE[row] - distances[row]) / sigma(row)).powi(2)).sum()
}
