//! What a model is known to get wrong in general: an error of its motion that no cause is behind.
//!
//! A model that was fitted to one campaign is not the robot, and what is left must not be blamed on whatever effect is nearest
//! in the next campaign. Each part of a way may err, straight and turning each for themselves, forward, sideways and in heading,
//! by a share of the way there; runs of one kind err alike. The share is a property of the model, learnt on runs that it was
//! not fitted to [a discrepancy in the sense of Kennedy & O'Hagan, *J. R. Statist. Soc. B* 63 (2001) 425–464].
//!
//! There are two such errors. `motion` adds up along a way. `transient` is made good again by a run's end, as play, wind-up and
//! delay are that are not quite the model's: of errors that add up, those are left whose sum over a way is none. Dense logs
//! show such errors to a fraction of a millimetre, and causes that do not make them good would be found for them otherwise.

use super::case::{Case, Cluster};
use super::linear::flatten;
use super::residue::{self, Memory};
use super::response_error::PARTS;
use super::surrogate::Surrogate;
use super::way::{ARM, Step, Way, compose};
use super::{ForwardModel, Study};
use crate::scene::Survey;
use nalgebra::{Cholesky, DMatrix, DVector, DVectorView, Dyn};
use rayon::prelude::*;

/// Shares that are tried \[–\].
pub(super) const SHARES: [f64; 8] = [0.0, 1e-4, 2e-4, 4e-4, 8e-4, 1.6e-3, 3.2e-3, 6.4e-3];

/// How one cluster's readings take errors of the model's motion.
pub(super) struct MotionError {
    /// Change of the readings by each kind of error that adds up, for a share of 1.
    pub columns: DMatrix<f64>,
    /// The same by those that are made good by the end.
    pub transient: DMatrix<f64>,
    /// What the last campaign says of these errors, where there was one.
    pub memory: Option<Memory>,
}

impl MotionError {
    /// Columns that the readings err along, each by 1 σ, and what they are expected to be off by; `motion` is how far the
    /// motion may be wrong, and `transient` how far in passing.
    pub fn of_readings(&self, motion: f64, transient: f64) -> (DMatrix<f64>, DVector<f64>) {
        let (lasting, off) = match &self.memory {
            None => (&self.columns * motion, DVector::zeros(self.columns.nrows())),
            Some(memory) => {
                let expected = memory.expected(motion);
                (&self.columns * expected.spread.transpose(), &self.columns * expected.mean)
            }
        };
        if transient == 0.0 {
            return (lasting, off);
        }
        let passing = &self.transient * transient;
        let all: Vec<_> = lasting.column_iter().chain(passing.column_iter()).collect();
        (DMatrix::from_columns(&all), off)
    }
}

/// One kind of error of the motion.
pub(super) struct Kind {
    part: usize,
    /// Of the step: forward, sideways or heading.
    component: usize,
    /// How much of the way it acts on, signed.
    moved: f64,
    /// Change of the readings for a share of 1.
    column: DVector<f64>,
}

/// How many kinds there are of errors in parts of a way; they come before those in all of it.
pub(super) const KINDS_OF_PARTS: usize = PARTS * 6;
/// Of those in all of a way, what a calibration finds: its length, and the turn on straights and in turns.
pub(super) const CALIBRATED_KINDS: [usize; 3] = [0, 2, 5];
/// How many there are with those in all of it.
pub(super) const KINDS: usize = KINDS_OF_PARTS + 6;

/// Change of a run's readings by each kind of error, in each part of its way and in all of it.
pub(super) fn kinds(surrogate: &Surrogate, case: &Case, way: &Way, survey: &Survey) -> Vec<Kind> {
    // Small against everything that bends the way.
    const SMALL: f64 = 1e-4;
    let read = |steps: &[Step]| flatten(case, &surrogate.readings(case, way, &compose(way.start, steps), survey));
    let here = read(&way.steps);
    let count = way.steps.len();
    let mut kinds = Vec::new();
    for part in 0..=PARTS {
        let range = if part == PARTS { 0..count } else { part * count / PARTS..(part + 1) * count / PARTS };
        for turning in [false, true] {
            let moved = |step: &Step| if turning { ARM * step[2] } else { step[0] };
            for component in 0..3 {
                let mut steps = way.steps.clone();
                for step in &mut steps[range.clone()] {
                    step[component] += SMALL * if component == 2 { moved(step) / ARM } else { moved(step) };
                }
                kinds.push(Kind {
                    part,
                    component,
                    moved: way.steps[range.clone()].iter().map(moved).sum(),
                    column: (read(&steps) - &here) / SMALL,
                });
            }
        }
    }
    kinds
}

/// Columns of errors that add up, in each part of a way and in all of it, for a share of 1.
pub(super) fn lasting(kinds: &[Kind]) -> DMatrix<f64> {
    DMatrix::from_columns(&kinds.iter().map(|kind| kind.column.as_view()).collect::<Vec<DVectorView<'_, f64>>>())
}

/// The same of errors in each part that are made good by the end: independent ones, given that in each component the motion
/// that they make adds up to none, Σ εᵢ mᵢ = 0 with mᵢ the way they act on. Their covariance is that of ε less its projection
/// on m.
pub(super) fn transient(mut kinds: Vec<Kind>) -> DMatrix<f64> {
    kinds.retain(|kind| kind.part < PARTS);
    for component in 0..3 {
        let of = || kinds.iter().filter(|kind| kind.component == component);
        let square: f64 = of().map(|kind| kind.moved.powi(2)).sum();
        if square == 0.0 {
            continue;
        }
        let nothing = DVector::zeros(kinds[0].column.len());
        let summed = of().fold(nothing, |sum, kind| sum + &kind.column * (kind.moved / square));
        for kind in kinds.iter_mut().filter(|kind| kind.component == component) {
            kind.column.axpy(-kind.moved, &summed, 1.0);
        }
    }
    lasting(&kinds)
}

/// Factor of the covariance that the mean of a cluster's whitened readings has by such errors, over the one it has without:
/// `columns` are whitened, `count` is how many runs the mean is of, and noise alone makes it vary `times` as much.
pub(super) fn factor(columns: &DMatrix<f64>, count: f64, times: f64) -> Option<Cholesky<f64, Dyn>> {
    let rows = columns.nrows();
    Cholesky::new(DMatrix::identity(rows, rows) * times + columns * columns.transpose() * count)
}

impl Study<'_> {
    /// What an error of the model's own motion does to each cluster's readings.
    pub(super) fn doubts(&self) -> &[MotionError] {
        let at = &self.shaped_at;
        let survey = self.surrogate.survey_of(self.model.scene(), at, &self.variants);
        let of = |(index, cluster): (usize, &Cluster)| {
            let reference = cluster.reference;
            let survey = self.surrogate.by_clocks_of(cluster.campaign, survey, at, &self.variants);
            let (case, given) = (&self.cases[reference], &self.surrogate.ways[reference]);
            let way = Way { steps: self.surrogate.steps(index, reference, at, &self.variants), ..given.clone() };
            let condition = self.conditions[cluster.condition].label();
            let kinds = kinds(&self.surrogate, case, &way, &survey);
            let lasting = lasting(&kinds);
            let told = residue::told(self, residue::of_last(self.model.scene(), case, &condition), case, given);
            let columns = match told {
                None => lasting,
                Some(_) => residue::columns(self, case, &way, at, &lasting),
            };
            ((columns, transient(kinds)), told)
        };
        self.doubts.get_or_init(|| {
            let (errors, told): (Vec<_>, Vec<_>) = self.clusters.par_iter().enumerate().map(of).unzip();
            let of = |((columns, transient), memory)| MotionError { columns, transient, memory };
            errors.into_iter().zip(residue::memories(told)).map(of).collect()
        })
    }
}
