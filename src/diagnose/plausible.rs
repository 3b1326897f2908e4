//! What is plausible of coordinates beforehand.
//!
//! Causes have the catalogue's normal law, what is in doubt of a model the one that was learnt. Only where the centre of
//! rotation goes in a model that was moved far falls off like Student's t: mostly next to nowhere, and sometimes, as on hard
//! wheels that roll on their edges, several σ away, which a normal law all but forbids
//! [O'Hagan & Pericchi, *Braz. J. Probab. Stat.* 26 (2012) 372–401].

use super::variant::{Axis, Variant};
use nalgebra::DVector;
use statrs::function::gamma::ln_gamma;

/// Degrees of freedom of the tail.
const FREEDOM: f64 = 4.0;

/// The law of some coordinates.
pub(super) struct Plausible {
    mean: DVector<f64>,
    /// 1/σ² at the mean.
    precision: DVector<f64>,
    /// Coordinates that have such a tail together.
    tail: Vec<usize>,
}

/// The normal law that touches it where it was asked for, and is nowhere above it.
pub(super) struct Local {
    /// −2 ln of the density over its greatest.
    pub cost: f64,
    /// Mean less coordinate.
    pub off: DVector<f64>,
    pub precision: DVector<f64>,
}

impl Plausible {
    /// Of these axes, in their order.
    pub fn of(variants: &[Variant], axes: &[Axis]) -> Plausible {
        let along = |axis: &Axis| variants[axis.variant].coordinates[axis.coordinate];
        let has_tail = |axis: &Axis| variants[axis.variant].part_of_centre(axis.coordinate).is_some();
        Plausible {
            mean: DVector::from_iterator(axes.len(), axes.iter().map(|axis| along(axis).mean)),
            precision: DVector::from_iterator(axes.len(), axes.iter().map(|axis| along(axis).std_dev.powi(-2))),
            tail: (0..axes.len()).filter(|&index| has_tail(&axes[index])).collect(),
        }
    }

    /// The normal law that touches it at `at`: t is normal with a precision that falls with the distance from the mean.
    pub fn at(&self, at: &DVector<f64>) -> Local {
        let off = &self.mean - at;
        let squares = off.component_mul(&off).component_mul(&self.precision);
        let (mut cost, mut precision) = (squares.sum(), self.precision.clone());
        if !self.tail.is_empty() {
            let square: f64 = self.tail.iter().map(|&index| squares[index]).sum();
            let freedom = FREEDOM + self.tail.len() as f64;
            cost += freedom * (square / freedom).ln_1p() - square;
            self.tail.iter().for_each(|&index| precision[index] *= freedom / (freedom + square));
        }
        Local { cost, off, precision }
    }

    /// ln of its greatest density, but for (2π)^(−½) a coordinate.
    pub fn log_peak(&self) -> f64 {
        let (count, freedom) = (self.tail.len() as f64, FREEDOM + self.tail.len() as f64);
        let of_tail = ln_gamma(0.5 * freedom) - ln_gamma(0.5 * FREEDOM) - 0.5 * count * (0.5 * freedom).ln();
        0.5 * self.precision.iter().map(|it| it.ln()).sum::<f64>() + of_tail
    }
}

impl Local {
    /// Gradient of half of −2 ln density along each coordinate, turned round: where it pulls to.
    pub fn pull(&self) -> DVector<f64> {
        self.precision.component_mul(&self.off)
    }

    /// −2 ln of the touching law's density at the coordinates where it was asked for moved by `step`, over the greatest of
    /// the law that it touches.
    pub fn cost_at(&self, step: &DVector<f64>) -> f64 {
        let moved = &self.off - step;
        let square = |off: &DVector<f64>| off.component_mul(off).dot(&self.precision);
        self.cost - square(&self.off) + square(&moved)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(coordinates: usize) -> Plausible {
        Plausible {
            mean: DVector::from_element(coordinates, 0.3),
            precision: DVector::from_element(coordinates, 4.0),
            tail: (0..coordinates).collect(),
        }
    }

    #[test]
    fn its_density_is_one_in_all() {
        // ∫ over a line and over a plane, in polar coordinates; tails beyond 2000 σ are below 1e-6.
        let density = |law: &Plausible, at: DVector<f64>| {
            let root = (std::f64::consts::TAU).sqrt().powi(at.len() as i32);
            (law.log_peak() - 0.5 * law.at(&at).cost).exp() / root
        };
        let (line, plane) = (law(1), law(2));
        let (mut on_line, mut on_plane) = (0.0, 0.0);
        for k in 0..2_000_000 {
            let (r, dr) = ((f64::from(k) + 0.5) * 5e-4, 5e-4);
            on_line += 2.0 * dr * density(&line, DVector::from_element(1, 0.3 + r));
            on_plane += std::f64::consts::TAU * r * dr * density(&plane, DVector::from_vec(vec![0.3 + r, 0.3]));
        }
        assert!((on_line - 1.0).abs() < 1e-5 && (on_plane - 1.0).abs() < 1e-5, "{on_line} {on_plane}");
    }

    #[test]
    fn the_touching_law_touches_and_is_nowhere_above() {
        let law = law(2);
        for here in [[0.3, 0.3], [0.5, 1.0], [4.0, -2.0]] {
            let here = DVector::from_row_slice(&here);
            let local = law.at(&here);
            for step in [[0.0, 0.0], [1e-4, 0.0], [0.0, 1e-4], [1.0, -0.5], [-3.0, 2.0]] {
                let step = DVector::from_row_slice(&step);
                let (touching, own) = (local.cost_at(&step), law.at(&(&here + &step)).cost);
                assert!(touching > own - 1e-9, "{touching} below {own}");
                if step.norm() < 1e-3 {
                    assert!((touching - own).abs() < 1e-6, "{touching} is not {own}");
                }
            }
        }
    }
}
