//! What an extension is worth: errors before and after on runs that took no part in the choice or the fit.

use super::case::Condition;
use super::doubt;
use super::fit::Fit;
use super::search::Ranking;
use super::variant::Axis;
use super::verdict::{self, convincing};
use super::{ForwardModel, Study, misfit, tyres};
use crate::dataset::Protocol;
use crate::scene::Doubt;
use nalgebra::DVector;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::collections::BTreeMap;

/// Errors of end poses before and after, on held-out runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    /// RMS distance of surveyed and predicted ends by the model as given \[m\].
    pub position_before: f64,
    /// The same by what was found without these runs \[m\].
    pub position_after: f64,
    /// RMS heading error by the model as given \[rad\]; NaN where no heading was read.
    pub heading_before: f64,
    /// The same by what was found without these runs \[rad\].
    pub heading_after: f64,
    /// 95 % interval of 1 − after/before in position.
    pub interval: [f64; 2],
    /// What survey noise and scatter leave of any model \[m\].
    pub noise_floor: f64,
    /// RMS distance that was to be expected after, by the answer's own account: noise, the widths of its intervals, and what the
    /// model states that it may err by \[m\].
    pub position_expected: f64,
    /// What the motion of models that were fitted without them gets wrong about these runs, relative to each part of a way;
    /// the extended model holds it, so that the next diagnosis blames no cause for so much.
    pub motion_error: f64,
    /// What was held out, in words.
    pub held_out: String,
    /// The same on repeats, of [`Study::gain_or_repeats`], where no other condition shows a sure gain of what was found: a spot in
    /// one path is in no other.
    pub on_repeats: Option<Box<Gain>>,
}

/// Errors over what was expected of them from which on the account is wrong: where all of an error is of one cause, an account
/// that is right is exceeded so far one time in twenty.
const SURPRISING: f64 = 2.0;

impl Gain {
    /// How many times what it expects of itself an answer is wrong by on runs that it has not seen, where that is surprising.
    pub fn surprise(&self) -> Option<f64> {
        let times = self.position_after / self.position_expected;
        (times > SURPRISING).then_some(times)
    }

    /// 1 − after/before in position, as far as its interval keeps it above zero.
    pub fn sure(&self) -> f64 {
        if self.interval[0] > 0.0 { 1.0 - self.position_after / self.position_before } else { 0.0 }
    }
}

/// Squared errors of one held-out run.
struct Errors {
    position: [f64; 2],
    heading: Option<[f64; 2]>,
    floor: f64,
    expected: f64,
}

/// Splits of the runs, each a set to hold out, and what they are called: by size of the square, else by direction, else by
/// protocol, else every fourth run.
fn folds(study: &Study<'_>) -> (Vec<Vec<usize>>, String) {
    let by = |key: &dyn Fn(&Condition) -> Option<String>| -> Vec<Vec<usize>> {
        let mut groups: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for cluster in &study.clusters {
            let Some(key) = key(&study.conditions[cluster.condition]) else { return Vec::new() };
            groups.entry(key).or_default().extend(cluster.active(&study.counts));
        }
        groups.into_values().filter(|runs| !runs.is_empty()).collect()
    };
    let size = |condition: &Condition| match condition.protocol {
        Protocol::Square { side, .. } => Some(format!("square {side}")),
        Protocol::Circle { radius, .. } => Some(format!("circle {radius}")),
        Protocol::Straight { length, .. } => Some(format!("straight {length}")),
        Protocol::Spin { .. } => Some("spin".to_owned()),
        Protocol::Path => None,
    };
    let direction = |condition: &Condition| condition.protocol.direction().map(str::to_owned);
    let sizes = by(&size);
    if sizes.len() > 1 {
        return (sizes, "each shape and size predicted from the others".to_owned());
    }
    let directions = by(&direction);
    if directions.len() > 1 {
        return (directions, "each direction predicted from the other".to_owned());
    }
    let runs: Vec<usize> = (0..study.cases.len()).filter(|&run| study.counts[run] > 0.0).collect();
    let parts = runs.len().min(4);
    let folds = (0..parts).map(|part| runs.iter().copied().skip(part).step_by(parts).collect()).collect();
    (if parts > 1 { folds } else { Vec::new() }, "each quarter of the runs predicted from the rest".to_owned())
}

/// Two halves of the runs that have repeats; none where there are none.
fn halves(study: &Study<'_>) -> Vec<Vec<usize>> {
    let mut halves = vec![Vec::new(), Vec::new()];
    for cluster in &study.clusters {
        let runs: Vec<usize> = cluster.active(&study.counts).collect();
        if runs.len() > 1 {
            runs.iter().enumerate().for_each(|(k, &run)| halves[k % 2].push(run));
        }
    }
    halves.retain(|half| !half.is_empty());
    halves
}

/// Held-out errors of the runs that were named, else of other conditions; `None` where nothing can be held out.
pub(super) fn gain(study: &mut Study<'_>) -> Option<Gain> {
    let named: Vec<usize> = (0..study.cases.len()).filter(|&run| study.held_out[run]).collect();
    if !named.is_empty() {
        return measure(study, &[named], "the runs that were named to be held out".to_owned(), true);
    }
    let (folds, words) = folds(study);
    measure(study, &folds, words, false)
}

/// The same, and held-out errors of repeats where no runs were named, something was found, and other conditions show no sure gain.
pub(super) fn gain_or_repeats(study: &mut Study<'_>) -> Option<Gain> {
    let mut gain = gain(study)?;
    let is_named = study.held_out.contains(&true);
    let finds = |study: &Study<'_>| study.answer.as_ref().is_some_and(|answer| !answer.at.is_empty());
    if !is_named && gain.sure() == 0.0 && (finds(study) || study.on_other_tyres.as_deref().is_some_and(finds)) {
        let words = "each half of the runs of a kind predicted from the other half".to_owned();
        gain.on_repeats = measure(study, &halves(study), words, false).map(Box::new);
    }
    Some(gain)
}

/// Errors on each of `folds`, held out, which are called `words` together; `is_named` is whether the answer has not seen them.
fn measure(study: &mut Study<'_>, folds: &[Vec<usize>], words: String, is_named: bool) -> Option<Gain> {
    let everyone = study.counts.clone();
    let mut other = study.on_other_tyres.take();
    let errors_of = |study: &Study<'_>| (study.noise.clone(), study.discrepancy);
    let learnt = [Some(errors_of(study)), other.as_deref().map(errors_of)];
    let stated = study.model.scene().robot.doubt;
    let mut errors = Vec::new();
    let mut likelihoods = [0.0; doubt::SHARES.len()];
    for fold in folds {
        let counts: Vec<f64> =
            everyone.iter().enumerate().map(|(run, count)| if fold.contains(&run) { 0.0 } else { *count }).collect();
        if counts.iter().all(|count| *count == 0.0) {
            continue;
        }
        // A diagnosis has not seen runs that were named: what it says is what they hold to account.
        let answer = |study: &mut Study<'_>| match study.answer.clone() {
            Some(answer) if is_named => answer,
            _ => answer_without(study, &counts),
        };
        let own = answer(study);
        let theirs = other.as_mut().map(|other| answer(other));
        let (answering, answer): (&Study<'_>, _) = match (&other, theirs) {
            (Some(other), Some(theirs)) if tyres::log_odds(&own, &theirs) > 0.0 => (other, theirs),
            _ => (study, own),
        };
        let Answer { at, fit, .. } = answer;
        let of_fold: Vec<f64> = everyone.iter().zip(&counts).map(|(all, without)| all - without).collect();
        for (likelihood, share) in likelihoods.iter_mut().zip(doubt::SHARES) {
            let doubt = Doubt { motion: share.max(stated.motion), ..stated };
            *likelihood += answering.problem_of(&answering.noise, doubt, of_fold.clone()).log_likelihood(&at);
        }
        let (given, answered) = (study.problem(everyone.clone()), answering.problem(everyone.clone()));
        let axes: Vec<Axis> = fit.at.iter().map(|(axis, _)| *axis).collect();
        let linear = answered.linearise(&fit.at, &axes);
        for (index, cluster) in study.clusters.iter().enumerate() {
            let runs: Vec<usize> = cluster.runs.iter().copied().filter(|run| fold.contains(run)).collect();
            if runs.is_empty() {
                continue;
            }
            let covariance = answering.shapes[index].covariance(&answering.noise[cluster.campaign]);
            let first = study.cases[cluster.reference].rows_of_end().start;
            let floor = covariance[(first, first)] + covariance[(first + 1, first + 1)];
            let expected = answered.expected_off(&linear, &fit, index, first);
            for run in runs {
                let predicted = [given.predict(index, run, &[]), answered.predict(index, run, &at)];
                errors.push(end_errors(&study.observed[run], predicted, first, [floor, expected(run)]));
            }
        }
    }
    let studies = std::iter::once(&mut *study).chain(other.as_deref_mut());
    for (study, (noise, discrepancy)) in studies.zip(learnt.into_iter().flatten()) {
        study.counts.clone_from(&everyone);
        study.noise = noise;
        study.discrepancy = discrepancy;
        study.shape(Vec::new());
    }
    study.on_other_tyres = other;
    if errors.is_empty() {
        return None;
    }
    let root = |values: &mut dyn Iterator<Item = f64>| {
        let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
        if count > 0.0 { (sum / count).sqrt() } else { f64::NAN }
    };
    let position = |part: usize| root(&mut errors.iter().map(|e| e.position[part]));
    let heading = |part: usize| root(&mut errors.iter().filter_map(|e| e.heading.map(|h| h[part])));
    // The mean over what it may be, each share alike likely beforehand.
    let most = likelihoods.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let weights = likelihoods.map(|likelihood| (likelihood - most).exp());
    let motion_error = weights.iter().zip(doubt::SHARES).map(|(weight, share)| weight * share).sum::<f64>()
        / weights.iter().sum::<f64>();
    Some(Gain {
        position_before: position(0),
        position_after: position(1),
        heading_before: heading(0),
        heading_after: heading(1),
        interval: interval(&errors),
        noise_floor: root(&mut errors.iter().map(|e| e.floor)),
        position_expected: root(&mut errors.iter().map(|e| e.expected)),
        motion_error: motion_error.max(stated.motion),
        held_out: words,
        on_repeats: None,
    })
}

/// What some of the runs say without the others.
#[derive(Debug, Clone)]
pub(super) struct Answer {
    at: Vec<(Axis, f64)>,
    /// With what it takes for unknown besides.
    fit: Fit,
    /// ln of its evidence and prior, in terms that studies of the same runs share.
    pub weight: f64,
    /// RMS distance of the runs' ends from what the written answer foretells \[m\].
    pub ends_off: f64,
    /// Whether it leaves more than noise makes.
    pub leaves_much: bool,
}

impl Study<'_> {
    /// What a ranking says.
    pub(super) fn answer_of(&self, ranking: &Ranking) -> Answer {
        let stands = convincing(ranking, &self.variants);
        let at = self.answered(stands);
        Answer {
            ends_off: misfit::left_of_ends(self, &at),
            leaves_much: verdict::leaves_much(self, stands),
            at,
            fit: stands.fit.clone(),
            weight: self.weight(ranking.best()),
        }
    }
}

/// The answer of the runs that count.
fn answer_without(study: &mut Study<'_>, counts: &[f64]) -> Answer {
    study.counts = counts.to_vec();
    // Spots that were closed in on know all runs, and so do the shapes of the noise on the best answer's ways.
    study.shape(Vec::new());
    study.discrepancy = 1.0;
    let known = study.first_look(&study.first_variants());
    let explained = study.explained(known);
    study.answer_of(&explained)
}

/// Errors of one run's end, which stands from `first` on, as predicted before and after; `floor` and `expected` are squared
/// distances.
fn end_errors(
    observed: &DVector<f64>,
    predicted: [DVector<f64>; 2],
    first: usize,
    [floor, expected]: [f64; 2],
) -> Errors {
    let parts = observed.len() - first;
    let [before, after] = predicted.map(|predicted| (observed - predicted).rows(first, parts).into_owned());
    let square = |v: &DVector<f64>| v[0] * v[0] + v[1] * v[1];
    Errors {
        position: [square(&before), square(&after)],
        heading: (parts == 3).then(|| [before[2] * before[2], after[2] * after[2]]),
        floor,
        expected,
    }
}

/// 95 % interval of 1 − after/before by resampling the runs; the same every time.
fn interval(errors: &[Errors]) -> [f64; 2] {
    const RESAMPLES: usize = 2000;
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut gains: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let (mut before, mut after) = (0.0, 0.0);
            for _ in 0..errors.len() {
                let picked = &errors[(rng.next_u64() % errors.len() as u64) as usize];
                before += picked.position[0];
                after += picked.position[1];
            }
            if before > 0.0 { 1.0 - (after / before).sqrt() } else { 0.0 }
        })
        .collect();
    gains.sort_by(f64::total_cmp);
    [gains[RESAMPLES / 40], gains[RESAMPLES - 1 - RESAMPLES / 40]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    fn answer(weight: f64, ends_off: f64, leaves_much: bool) -> Answer {
        let covariance = DMatrix::zeros(0, 0);
        let fit = Fit { at: Vec::new(), covariance, log_evidence: weight, chi2: 0.0, left: 0.0, strays: 0.0 };
        Answer { at: Vec::new(), fit, weight, ends_off, leaves_much }
    }

    /// Whatever its odds, another law that leaves much stands only where its model ends no farther off; one that leaves nothing
    /// stands by its odds.
    #[test]
    fn another_law_that_leaves_much_stands_only_where_its_model_ends_no_farther_off() {
        let own = answer(0.0, 0.07, true);
        assert_eq!(tyres::log_odds(&own, &answer(40.0, 0.40, true)), f64::NEG_INFINITY);
        let nearer = tyres::log_odds(&own, &answer(40.0, 0.06, true));
        assert!(nearer > 0.0 && nearer == tyres::log_odds(&own, &answer(40.0, 0.40, false)));
        assert!(tyres::log_odds(&own, &answer(1.0, 0.06, true)) < 0.0);
    }
}
