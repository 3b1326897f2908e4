//! Dataset → corrections to what the robot believed. One file a published method, its letters and equation numbers
//! beside the code.
//!
//! Methods see [`Training`], a view of datasets, and nothing of a simulation (invariant 1).

mod antonelli2005;
mod bei2018;
mod censi2013;
mod check;
mod end_points;
mod error;
mod estimate;
mod exact_heading;
mod jung2012;
mod lee2011;
mod logs;
mod maximum_likelihood;
mod score;
mod squares;
mod training;
mod umbmark;

pub use check::{Suspicion, SuspicionKind, check};
pub use end_points::{CentreOfGravity, SquareErrors};
pub use error::CalibrateError;
pub use estimate::{Estimate, Parameter};
pub use score::{Calibration, MethodOutcome, Score, calibrate, calibrate_telling};
pub use training::{Observation, Training, WheelPath};

/// A way to find corrections.
#[derive(Debug)]
pub struct Method {
    /// As the command line and JSON spell it.
    pub name: &'static str,
    /// Where it was published.
    pub source: &'static str,
    /// The data that it needs.
    pub needs: &'static str,
    /// What it cannot see.
    pub blind_to: &'static str,
    estimate: fn(&Training) -> Result<Estimate, CalibrateError>,
}

/// Every method, published ones first, by year.
pub static METHODS: [Method; 11] = [
    umbmark::FROM_X,
    umbmark::FROM_Y,
    umbmark::FROM_XY,
    antonelli2005::METHOD,
    lee2011::METHOD,
    jung2012::METHOD,
    censi2013::METHOD,
    bei2018::AS_PRINTED,
    bei2018::CORRECTED,
    exact_heading::METHOD,
    maximum_likelihood::METHOD,
];

impl Method {
    /// The method of this name.
    pub fn named(name: &str) -> Option<&'static Method> {
        METHODS.iter().find(|method| method.name == name)
    }

    /// Corrections to what the robot of `training` believed. σ is the method's own where it has one, else that of the
    /// jackknife over runs [Efron & Stein, *Annals of Statistics* 9 (1981) 586–596], stratified by protocol.
    ///
    /// # Errors
    /// What the method needs and the data lack.
    pub fn estimate(&self, training: &Training) -> Result<Estimate, CalibrateError> {
        let mut estimate = (self.estimate)(training)?;
        if estimate.diameter_ratio.std_dev.is_nan() {
            self.jackknife(training, &mut estimate);
        }
        Ok(estimate)
    }

    fn jackknife(&self, training: &Training, estimate: &mut Estimate) {
        let mut variance = [0.0; 3];
        let mut strata: Vec<(&Observation, Vec<usize>)> = Vec::new();
        for (index, run) in training.runs.iter().enumerate() {
            match strata.iter_mut().find(|(first, _)| first.protocol == run.protocol) {
                Some((_, members)) => members.push(index),
                None => strata.push((run, vec![index])),
            }
        }
        for (_, members) in &strata {
            let left_out: Vec<[f64; 3]> = members
                .iter()
                .filter_map(|&out| {
                    let rest = (self.estimate)(&training.only(|index, _| index != out)).ok()?;
                    let correction = rest.correction();
                    Some([correction.diameter_ratio, correction.track_ratio, correction.distance_scale])
                })
                .collect();
            let n = left_out.len() as f64;
            for (k, variance) in variance.iter_mut().enumerate() {
                // One run of a kind says nothing of its scatter.
                if left_out.len() < 2 || left_out.len() < members.len() {
                    *variance = f64::NAN;
                    continue;
                }
                let mean = left_out.iter().map(|values| values[k]).sum::<f64>() / n;
                *variance += (n - 1.0) / n * left_out.iter().map(|values| (values[k] - mean).powi(2)).sum::<f64>();
            }
        }
        let parameters = [&mut estimate.diameter_ratio, &mut estimate.track_ratio, &mut estimate.distance_scale];
        for (parameter, variance) in parameters.into_iter().zip(variance) {
            if parameter.std_dev.is_nan() {
                parameter.std_dev = variance.sqrt();
            }
        }
    }
}
