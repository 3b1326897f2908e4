//! What a model is known to get wrong in general: an error of its motion that no cause is behind.
//!
//! A model that was fitted to one campaign is not the robot, and what is left must not be blamed on whatever effect is nearest
//! in the next campaign. Each part of a way may err, straight and turning each for themselves, forward, sideways and in heading,
//! by a share of the way there; runs of one kind err alike. The share is a property of the model, learnt on runs that it was
//! not fitted to [a discrepancy in the sense of Kennedy & O'Hagan, *J. R. Statist. Soc. B* 63 (2001) 425–464].

use super::case::Case;
use super::linear::{PARTS, flatten};
use super::residue::Memory;
use super::surrogate::Surrogate;
use super::way::{ARM, Step, Way, compose};
use crate::scene::Survey;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Shares that are tried \[–\].
pub(super) const SHARES: [f64; 8] = [0.0, 1e-4, 2e-4, 4e-4, 8e-4, 1.6e-3, 3.2e-3, 6.4e-3];

/// How one cluster's readings take errors of the model's motion.
pub(super) struct MotionError {
    /// Change of the readings by each kind of error, for a share of 1.
    pub columns: DMatrix<f64>,
    /// What the last campaign says of these errors, where there was one.
    pub memory: Option<Memory>,
}

impl MotionError {
    /// Columns that the readings err along, each by 1 σ, and what they are expected to be off by; `share` is how far the
    /// motion may be wrong.
    pub fn of_readings(&self, share: f64) -> (DMatrix<f64>, DVector<f64>) {
        match &self.memory {
            None => (&self.columns * share, DVector::zeros(self.columns.nrows())),
            Some(memory) => {
                let expected = memory.expected(share);
                (&self.columns * expected.spread.transpose(), &self.columns * expected.mean)
            }
        }
    }
}

/// Change of a run's readings by each kind of error, in each part of its way and in all of it, for a share of 1.
pub(super) fn columns(surrogate: &Surrogate, case: &Case, way: &Way, survey: &Survey) -> DMatrix<f64> {
    // Small against everything that bends the way.
    const SMALL: f64 = 1e-4;
    let read = |steps: &[Step]| flatten(case, &surrogate.readings(case, way, &compose(way.start, steps), survey));
    let here = read(&way.steps);
    let count = way.steps.len();
    let mut columns = Vec::new();
    for part in 0..=PARTS {
        let range = if part == PARTS { 0..count } else { part * count / PARTS..(part + 1) * count / PARTS };
        for turning in [false, true] {
            for component in 0..3 {
                let mut steps = way.steps.clone();
                for step in &mut steps[range.clone()] {
                    let moved = if turning { ARM * step[2] } else { step[0] };
                    step[component] += SMALL * if component == 2 { moved / ARM } else { moved };
                }
                columns.push((read(&steps) - &here) / SMALL);
            }
        }
    }
    DMatrix::from_columns(&columns)
}

/// Factor of the covariance that the mean of a cluster's whitened readings has by such errors, over the one it has without:
/// `columns` are whitened, `count` is how many runs the mean is of.
pub(super) fn factor(columns: &DMatrix<f64>, count: f64) -> Option<Cholesky<f64, Dyn>> {
    let rows = columns.nrows();
    Cholesky::new(DMatrix::identity(rows, rows) + columns * columns.transpose() * count)
}

/// ln √det of a factor's matrix.
pub(super) fn half_log_det(factor: &Cholesky<f64, Dyn>) -> f64 {
    factor.l_dirty().diagonal().iter().map(|d| d.ln()).sum()
}

/// Solves for a factor in place.
pub(super) fn whiten(factor: &Cholesky<f64, Dyn>, columns: &mut DMatrix<f64>) {
    factor.l_dirty().solve_lower_triangular_mut(columns);
}

/// The same of one vector.
pub(super) fn whitened(factor: &Cholesky<f64, Dyn>, vector: &DVector<f64>) -> DVector<f64> {
    let mut white = vector.clone();
    factor.l_dirty().solve_lower_triangular_mut(&mut white);
    white
}
