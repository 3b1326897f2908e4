//! Runs against their own kind: outliers, copies, a direction that is missing.

use super::SuspicionKind::{CopiedRun, OneDirection, Outlier};
use super::{Work, median};
use crate::dataset::{Protocol, Rotation, SurveyedPose};

/// How many robust standard deviations scatter keeps within: ten of the quartile below, which is 1.15 σ of normal
/// scatter. Of 20,000 campaigns of normal scatter, four, five or ten runs each way round, one in a thousand exceeds 9.0,
/// 9.1 or 5.5 of it. (The median of so few deviations is too uncertain for that: it would have to be above 20.)
const OUTLIER: f64 = 11.5;

/// Fewest runs of a kind among which one can be said to stand out, and fewest that their spread is taken from.
const KIND: usize = 4;
const POOL: usize = 8;

/// x, y and heading of an end; NaN where the heading was not measured.
fn values(end: SurveyedPose) -> [f64; 3] {
    [end.x, end.y, end.heading.unwrap_or(f64::NAN)]
}

/// Indices of the runs of each kind: the same protocol to the digit.
fn kinds(work: &Work) -> Vec<Vec<usize>> {
    let mut kinds: Vec<(Protocol, Vec<usize>)> = Vec::new();
    for (index, run) in work.data.runs.iter().enumerate() {
        if run.end.is_none() || run.protocol == Protocol::Path {
            continue;
        }
        match kinds.iter_mut().find(|(protocol, _)| *protocol == run.protocol) {
            Some((_, runs)) => runs.push(index),
            None => kinds.push((run.protocol, vec![index])),
        }
    }
    kinds.into_iter().map(|(_, runs)| runs).collect()
}

/// Runs far from the median of their kind. The spread is the upper quartile of the absolute deviations over all kinds
/// together (a kind of five is too few for its own), which a quarter of bad runs does not move, and at least what the
/// survey's start and end readings make.
pub(super) fn outliers(work: &mut Work) {
    let survey = &work.data.campaign.survey;
    let noise =
        [survey.position_std, survey.position_std, survey.heading_std].map(|std| std.unwrap_or(0.0) * f64::sqrt(2.0));
    let mut deviations: Vec<(usize, [f64; 3])> = Vec::new();
    for kind in kinds(work).into_iter().filter(|kind| kind.len() >= KIND) {
        let errors: Vec<(usize, [f64; 3])> = kind
            .into_iter()
            .filter_map(|index| Some((index, values(work.end_error(&work.data.runs[index])?))))
            .collect();
        let middle: [Option<f64>; 3] = std::array::from_fn(|axis| {
            median(errors.iter().map(|(_, error)| error[axis]).filter(|value| value.is_finite()))
        });
        deviations.extend(errors.iter().map(|(index, error)| {
            (*index, std::array::from_fn(|axis| error[axis] - middle[axis].unwrap_or(f64::NAN)))
        }));
    }
    let mut runs: Vec<(usize, f64)> = Vec::new();
    for axis in 0..3 {
        let of_axis: Vec<(usize, f64)> =
            deviations.iter().map(|(index, d)| (*index, d[axis].abs())).filter(|(_, d)| d.is_finite()).collect();
        if of_axis.len() < POOL {
            continue;
        }
        let mut sorted: Vec<f64> = of_axis.iter().map(|(_, deviation)| *deviation).collect();
        sorted.sort_by(f64::total_cmp);
        let spread = sorted[sorted.len() * 3 / 4] / 1.15;
        let scale = spread.max(noise[axis]);
        for (index, deviation) in of_axis {
            if scale > 0.0 && deviation > OUTLIER * scale {
                match runs.iter_mut().find(|(known, _)| *known == index) {
                    Some((_, most)) => *most = most.max(deviation / scale),
                    None => runs.push((index, deviation / scale)),
                }
            }
        }
    }
    runs.sort_by_key(|(index, _)| *index);
    let indices: Vec<usize> = runs.iter().map(|(index, _)| *index).collect();
    if let Some(most) = runs.iter().map(|(_, most)| *most).reduce(f64::max) {
        work.suspect(Outlier, &indices, most, OUTLIER);
    }
}

/// Ends that are the same to the last digit, where chance hardly makes them so: the digits that were noted against the
/// scatter of the runs.
pub(super) fn copied_runs(work: &mut Work) {
    let survey = work.data.campaign.survey.clone();
    let floor =
        [survey.position_std, survey.position_std, survey.heading_std].map(|std| std.unwrap_or(0.0) * f64::sqrt(2.0));
    let mut copied = Vec::new();
    let mut expected = 0.0_f64;
    for kind in kinds(work) {
        let ends: Vec<(usize, [f64; 3])> =
            kind.iter().filter_map(|&index| Some((index, values(work.data.runs[index].end?)))).collect();
        let same =
            |one: &[f64; 3], other: &[f64; 3]| one.iter().zip(other).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()));
        let twins: Vec<usize> = ends
            .iter()
            .filter(|(index, end)| ends.iter().any(|(other, at)| other != index && same(end, at)))
            .map(|(index, _)| *index)
            .collect();
        if twins.is_empty() {
            continue;
        }
        // Two normal values of spread s fall into the same step r of the notes with probability r/(2√π·s).
        let pairs = (ends.len() * (ends.len() - 1) / 2) as f64;
        let chance: f64 = (0..3)
            .map(|axis| {
                let column: Vec<f64> =
                    ends.iter().map(|(_, end)| end[axis]).filter(|value| value.is_finite()).collect();
                let Some(middle) = median(column.iter().copied()) else { return 1.0 };
                let n = (column.len() as f64 - 1.0).max(1.0);
                let spread = (column.iter().map(|value| (value - middle).powi(2)).sum::<f64>() / n).sqrt();
                let scale = spread.max(floor[axis]);
                if scale > 0.0 { (step(&column) / (3.545 * scale)).min(1.0) } else { 1.0 }
            })
            .product();
        // Fewer than one campaign in a hundred; noise-free repetitions, which are all the same, have no scatter.
        if pairs * chance < 0.01 {
            copied.extend(twins);
            expected = expected.max(pairs * chance);
        }
    }
    copied.sort_unstable();
    if !copied.is_empty() {
        work.suspect(CopiedRun, &copied, copied.len() as f64, expected);
    }
}

/// The step that values were noted in: the coarsest of 5·10⁻ᵏ, 10⁻ᵏ that all of them are multiples of.
fn step(values: &[f64]) -> f64 {
    for power in 0..9 {
        for unit in [5.0, 1.0] {
            let step = unit * 10.0_f64.powi(-power);
            if values.iter().all(|value| ((value / step).round() * step - value).abs() < 1e-9) {
                return step;
            }
        }
    }
    1e-9
}

/// Squares one way round only.
pub(super) fn one_direction(work: &mut Work) {
    let driven = |way: Rotation| {
        work.indices(|run| {
            run.end.is_some() && matches!(run.protocol, Protocol::Square { direction, .. } if direction == way)
        })
    };
    match (driven(Rotation::Clockwise), driven(Rotation::CounterClockwise)) {
        (cw, ccw) if ccw.is_empty() && !cw.is_empty() => work.suspect(OneDirection, &cw, -(cw.len() as f64), 0.0),
        (cw, ccw) if cw.is_empty() && !ccw.is_empty() => work.suspect(OneDirection, &ccw, ccw.len() as f64, 0.0),
        _ => {}
    }
}
