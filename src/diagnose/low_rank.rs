//! Whitening of readings that err along a few columns besides their noise.

use nalgebra::{DMatrix, DVector};

/// A root of the inverse of `I + CCᵀ`, for `C` of few columns: with `CᵀC = VΛVᵀ` it is `I − AAᵀ`, where `A = CV` with each
/// column divided by the root of `√(1+λ) (1+√(1+λ))`. As any root it whitens, and costs the readings times the columns, where
/// a triangular one costs the readings squared, and their cube to be had.
pub(super) struct LowRank {
    along: DMatrix<f64>,
    half_log_det: f64,
}

impl LowRank {
    /// Of white readings that err along `columns` as well, each by 1 σ.
    pub fn of(columns: &DMatrix<f64>) -> LowRank {
        let gram = columns.tr_mul(columns).symmetric_eigen();
        let mut along = columns * gram.eigenvectors;
        let mut half_log_det = 0.0;
        for (mut column, &square) in along.column_iter_mut().zip(gram.eigenvalues.iter()) {
            // Rounding leaves squares a little below 0.
            let root = (1.0 + square.max(0.0)).sqrt();
            column /= (root * (1.0 + root)).sqrt();
            half_log_det += root.ln();
        }
        LowRank { along, half_log_det }
    }

    /// ln √det of `I + CCᵀ`.
    pub fn half_log_det(&self) -> f64 {
        self.half_log_det
    }

    /// Whitens columns in place.
    pub fn whiten(&self, columns: &mut DMatrix<f64>) {
        let along = self.along.tr_mul(columns);
        columns.gemm(-1.0, &self.along, &along, 1.0);
    }

    /// Whitens a vector in place.
    pub fn whiten_vector(&self, vector: &mut DVector<f64>) {
        let along = self.along.tr_mul(vector);
        vector.gemv(-1.0, &self.along, &along, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Cholesky;

    #[test]
    fn it_whitens_as_a_factor_of_the_whole_does() {
        // The third column is next to none, the fourth the sum of two others.
        let mut columns =
            DMatrix::from_fn(12, 4, |i, j| ((3 * i + 5 * j * j) as f64).sin() * [40.0, 1.0, 1e-9, 0.0][j]);
        let sum = columns.column(0) + columns.column(1);
        columns.set_column(3, &sum);
        let whole = Cholesky::new(DMatrix::identity(12, 12) + &columns * columns.transpose()).expect("positive");
        let root = LowRank::of(&columns);
        let half_log_det: f64 = whole.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
        assert!((root.half_log_det() - half_log_det).abs() < 1e-9, "{} {half_log_det}", root.half_log_det());
        // Roots differ by a rotation: products are the same.
        let readings = DMatrix::from_fn(12, 3, |i, j| (1.7 * i as f64 + 0.4 * j as f64).cos());
        let mut by_root = readings.clone();
        root.whiten(&mut by_root);
        let expected = readings.tr_mul(&whole.solve(&readings));
        assert!((by_root.tr_mul(&by_root) - expected).amax() < 1e-9);
        let mut vector = readings.column(1).into_owned();
        root.whiten_vector(&mut vector);
        assert!((vector - by_root.column(1)).amax() < 1e-12);
    }
}
