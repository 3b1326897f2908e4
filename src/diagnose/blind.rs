//! What data could not have shown, and what they cannot tell apart.

use super::Study;
use super::search::{Set, axes_of};
use super::variant::{Axis, Variant};
use crate::effect::Prior;
use nalgebra::{Cholesky, DMatrix};

/// Strength of a response, in σ of the whole of it, from which on an effect counts as shown.
pub(super) const SHOWN: f64 = 5.0;

/// What the data could not have shown.
#[derive(Debug, Clone)]
pub struct Blind {
    /// The effect, with its choice.
    pub effect: &'static str,
    /// Wheel or side.
    pub choice: String,
    /// The parameter.
    pub parameter: &'static str,
    /// The smallest size that these data could have shown; infinite: none at all.
    pub smallest_detectable: f64,
    /// What is plausible beforehand.
    pub plausible: f64,
}

/// The smallest size of each parameter that these data could have shown.
pub(super) fn blind(study: &Study<'_>) -> Vec<Blind> {
    let problem = study.problem(study.counts.clone());
    let all: Set = study.known_variants().into_iter().collect();
    let axes = axes_of(&study.variants, &all);
    let (gram, _, _) = problem.normal_equations(&problem.linearise(&[], &axes));
    let (mut list, mut spots): (Vec<Blind>, Vec<Blind>) = (Vec::new(), Vec::new());
    for (index, variant) in study.variants.iter().enumerate().filter(|(_, variant)| variant.is_cause()) {
        let is_own = |axis: &Axis| axis.variant == index && axis.coordinate < variant.own_parameters();
        let own: Vec<usize> = (0..axes.len()).filter(|&k| is_own(&axes[k])).collect();
        let information: Vec<f64> = own.iter().map(|&k| gram[(k, k)]).collect();
        let smallest = |value: f64| if value > 1e-12 { SHOWN / value.sqrt() } else { f64::INFINITY };
        let names = parameter_names(variant);
        for (position, (&name, &value)) in names.iter().zip(&information).enumerate() {
            // Of a vector, the size: the worse of its two directions.
            let value =
                if names.len() < information.len() { information.iter().copied().fold(value, f64::min) } else { value };
            let kind = if variant.place().is_some() { &mut spots } else { &mut list };
            kind.push(Blind {
                effect: variant.effect.id,
                choice: variant.choice.clone(),
                parameter: name,
                smallest_detectable: smallest(value),
                plausible: variant.coordinates[position].std_dev,
            });
        }
    }
    // Of spots on the floor, the one that shows best, and the first of those that show alike.
    list.extend(spots.into_iter().min_by(|one, other| one.smallest_detectable.total_cmp(&other.smallest_detectable)));
    list
}

/// Responses closer than this are hardly kept apart: a response's own error turns it as far \[rad\].
const ALIKE: f64 = 0.15;

/// Pairs of variants of different effects whose whitened responses are nearly parallel.
pub(super) fn alike(study: &Study<'_>) -> Vec<(String, String, f64)> {
    let problem = study.problem(study.counts.clone());
    // Spots on the floor are many, and next to one another.
    let all: Set =
        study.known_variants().into_iter().filter(|&index| study.variants[index].place().is_none()).collect();
    let axes = axes_of(&study.variants, &all);
    let (gram, _, _) = problem.normal_equations(&problem.linearise(&[], &axes));
    let block = |a: usize, b: usize| {
        let of = |variant: usize| -> Vec<usize> { (0..axes.len()).filter(|&k| axes[k].variant == variant).collect() };
        let (rows, columns) = (of(a), of(b));
        DMatrix::from_fn(rows.len(), columns.len(), |i, j| gram[(rows[i], columns[j])])
    };
    let shown = |variant: usize| {
        let coordinates = &study.variants[variant].coordinates;
        let own = block(variant, variant);
        (0..coordinates.len()).any(|k| own[(k, k)].sqrt() * 3.0 * coordinates[k].std_dev > SHOWN)
    };
    let variants: Vec<usize> = all.iter().copied().filter(|&variant| shown(variant)).collect();
    let mut pairs = Vec::new();
    for (position, &one) in variants.iter().enumerate() {
        for &other in &variants[position + 1..] {
            if study.variants[one].effect == study.variants[other].effect {
                continue;
            }
            // cos of the smallest principal angle: largest singular value of L₁⁻¹ G₁₂ L₂⁻ᵀ.
            let factors = [one, other].map(|v| Cholesky::new(block(v, v)));
            let [Some(first), Some(second)] = factors else { continue };
            let mut between = block(one, other);
            first.l_dirty().solve_lower_triangular_mut(&mut between);
            let mut between = between.transpose();
            second.l_dirty().solve_lower_triangular_mut(&mut between);
            let cosine = between.singular_values().max().min(1.0);
            if cosine.acos() < ALIKE {
                pairs.push((study.variants[one].label(), study.variants[other].label(), cosine.acos()));
            }
        }
    }
    pairs.sort_by(|a, b| a.2.total_cmp(&b.2));
    pairs
}

fn parameter_names(variant: &Variant) -> Vec<&'static str> {
    let held = |index: usize| variant.held.iter().any(|(held, _)| *held == index);
    variant
        .effect
        .parameters
        .iter()
        .enumerate()
        .filter(|(index, parameter)| {
            matches!(parameter.prior, Prior::Normal { .. } | Prior::HalfNormal { .. }) && !held(*index)
        })
        .map(|(_, parameter)| parameter.name)
        .collect()
}
