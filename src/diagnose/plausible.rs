//! What is plausible of coordinates beforehand.
//!
//! Causes have the catalogue's normal law, what is in doubt of a model the one that was learnt. Two laws have tails, without
//! which what a reader would call implausible is all but forbidden [O'Hagan & Pericchi, *Braz. J. Probab. Stat.* 26 (2012)
//! 372–401]; both are normal laws of uncertain width, so that one normal law touches them everywhere and is nowhere above:
//!
//! - What a calibration finds, what hangs on the load, and a term of no known cause has the normal law of what is expected, and
//!   by a small chance one ten times as wide [Tukey's contaminated normal; Box & Tiao, *Biometrika* 55 (1968) 119–129]: a model
//!   may state no more than what the makers do, a load is where someone puts it, and of what is unknown nobody knows how large it
//!   is. A Husky's tyres that were let down differ by twelve times what the catalogue expects of tyres, and a formula is not
//!   likelier than that.
//! - Where the centre of rotation goes in a model that was moved far falls off like Student's t: mostly next to nowhere, and
//!   sometimes, as on hard wheels that roll on their edges, several σ away.

use super::variant::{Axis, Variant};
use nalgebra::DVector;
use statrs::function::gamma::ln_gamma;

/// Degrees of freedom of Student's tail.
const FREEDOM: f64 = 4.0;
/// Chance that what may be larger than the catalogue expects is, and how many times as wide its law is then.
const UNUSUAL: f64 = 0.03;
const WIDER: f64 = 10.0;

/// The law of some coordinates.
pub(super) struct Plausible {
    mean: DVector<f64>,
    /// 1/σ² at the mean.
    precision: DVector<f64>,
    /// Coordinates that have a tail, and which; each at most once.
    tails: Vec<(Tail, Vec<usize>)>,
}

/// How a law falls off whose middle is normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tail {
    Student,
    Contaminated,
}

/// The normal law that touches it where it was asked for, and is nowhere above it.
pub(super) struct Local {
    /// −2 ln of the density over its greatest.
    pub cost: f64,
    /// Mean less coordinate.
    pub off: DVector<f64>,
    pub precision: DVector<f64>,
}

impl Tail {
    /// −2 ln of the density over its greatest at a `square` of the distance from the mean \[σ²\] in so many dimensions, and the
    /// precision of the touching law over that at the mean.
    fn at(self, square: f64, dimensions: usize) -> (f64, f64) {
        let count = dimensions as f64;
        match self {
            Tail::Student => {
                let freedom = FREEDOM + count;
                (freedom * (square / freedom).ln_1p(), freedom / (freedom + square))
            }
            Tail::Contaminated => {
                // ln of the wide law's density over the narrow one's.
                let excess = Tail::share_of_wide(dimensions).ln() + 0.5 * square * (1.0 - WIDER.powi(-2));
                let both = excess.max(0.0) + (-excess.abs()).exp().ln_1p();
                let share = 1.0 / (1.0 + (-excess).exp());
                let cost = square - 2.0 * (both - Tail::share_of_wide(dimensions).ln_1p());
                (cost, 1.0 - share * (1.0 - WIDER.powi(-2)))
            }
        }
    }

    /// Density of the wide law over that of the narrow one at the mean.
    fn share_of_wide(dimensions: usize) -> f64 {
        UNUSUAL / (1.0 - UNUSUAL) * WIDER.powi(-(dimensions as i32))
    }

    /// ln of its greatest density over that of the normal law of the catalogue.
    fn log_peak(self, dimensions: usize) -> f64 {
        let count = dimensions as f64;
        match self {
            Tail::Student => {
                let freedom = FREEDOM + count;
                ln_gamma(0.5 * freedom) - ln_gamma(0.5 * FREEDOM) - 0.5 * count * (0.5 * freedom).ln()
            }
            Tail::Contaminated => (1.0 - UNUSUAL).ln() + Tail::share_of_wide(dimensions).ln_1p(),
        }
    }
}

impl Plausible {
    /// Of these axes, in their order.
    pub fn of(variants: &[Variant], axes: &[Axis]) -> Plausible {
        let along = |axis: &Axis| variants[axis.variant].coordinates[axis.coordinate];
        let is_centre = |axis: &Axis| variants[axis.variant].part_of_centre(axis.coordinate).is_some();
        let centre: Vec<usize> = (0..axes.len()).filter(|&index| is_centre(&axes[index])).collect();
        let unusual = (0..axes.len()).filter(|&index| variants[axes[index].variant].may_be_large());
        let mut tails: Vec<(Tail, Vec<usize>)> = unusual.map(|index| (Tail::Contaminated, vec![index])).collect();
        if !centre.is_empty() {
            tails.push((Tail::Student, centre));
        }
        Plausible {
            mean: DVector::from_iterator(axes.len(), axes.iter().map(|axis| along(axis).mean)),
            precision: DVector::from_iterator(axes.len(), axes.iter().map(|axis| along(axis).std_dev.powi(-2))),
            tails,
        }
    }

    /// The normal law that touches it at `at`: one whose precision falls with the distance from the mean.
    pub fn at(&self, at: &DVector<f64>) -> Local {
        let off = &self.mean - at;
        let squares = off.component_mul(&off).component_mul(&self.precision);
        let (mut cost, mut precision) = (squares.sum(), self.precision.clone());
        for (tail, group) in &self.tails {
            let square: f64 = group.iter().map(|&index| squares[index]).sum();
            let (of_tail, share) = tail.at(square, group.len());
            cost += of_tail - square;
            group.iter().for_each(|&index| precision[index] *= share);
        }
        Local { cost, off, precision }
    }

    /// ln of its greatest density, but for (2π)^(−½) a coordinate.
    pub fn log_peak(&self) -> f64 {
        let of_tails: f64 = self.tails.iter().map(|(tail, group)| tail.log_peak(group.len())).sum();
        0.5 * self.precision.iter().map(|it| it.ln()).sum::<f64>() + of_tails
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

    fn laws(coordinates: usize) -> [Plausible; 2] {
        [Tail::Student, Tail::Contaminated].map(|tail| Plausible {
            mean: DVector::from_element(coordinates, 0.3),
            precision: DVector::from_element(coordinates, 4.0),
            tails: vec![(tail, (0..coordinates).collect())],
        })
    }

    #[test]
    fn their_density_is_one_in_all() {
        // ∫ over a line and over a plane, in polar coordinates; tails beyond 2000 σ are below 1e-6.
        let density = |law: &Plausible, at: DVector<f64>| {
            let root = (std::f64::consts::TAU).sqrt().powi(at.len() as i32);
            (law.log_peak() - 0.5 * law.at(&at).cost).exp() / root
        };
        for (line, plane) in laws(1).iter().zip(&laws(2)) {
            let (mut on_line, mut on_plane) = (0.0, 0.0);
            for k in 0..2_000_000 {
                let (r, dr) = ((f64::from(k) + 0.5) * 5e-4, 5e-4);
                on_line += 2.0 * dr * density(line, DVector::from_element(1, 0.3 + r));
                on_plane += std::f64::consts::TAU * r * dr * density(plane, DVector::from_vec(vec![0.3 + r, 0.3]));
            }
            assert!((on_line - 1.0).abs() < 1e-5 && (on_plane - 1.0).abs() < 1e-5, "{on_line} {on_plane}");
        }
    }

    #[test]
    fn the_touching_law_touches_and_is_nowhere_above() {
        for law in laws(2) {
            for here in [[0.3, 0.3], [0.5, 1.0], [1.3, 1.5], [4.0, -2.0], [60.0, 2.0]] {
                let here = DVector::from_row_slice(&here);
                let local = law.at(&here);
                for step in [[0.0, 0.0], [1e-4, 0.0], [0.0, 1e-4], [1.0, -0.5], [-3.0, 2.0]] {
                    let step = DVector::from_row_slice(&step);
                    let (touching, own) = (local.cost_at(&step), law.at(&(&here + &step)).cost);
                    assert!(touching > own - 1e-9, "{touching} below {own}");
                    if step.norm() < 1e-3 {
                        assert!((touching - own).abs() < 1e-5, "{touching} is not {own}");
                    }
                }
            }
        }
    }
}
