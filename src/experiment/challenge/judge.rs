//! How an answer counts against the truth and an oracle.

use super::score::{Call, Interval, Scored, Tally};
use super::{Challenge, Draw, EffectsKind};
use crate::diagnose::{Diagnosis, PairEvidence, Study, Verdict};
use crate::effect::Cause;
use crate::scene::Scene;
use std::collections::{BTreeMap, BTreeSet};

/// ln of the odds within which the oracle holds effects for alike: 50.
const ALIKE: f64 = 3.912_023_005_428_146;

/// Strength from which on silence is a miss \[σ\].
pub(super) const STRONG: f64 = 5.0;

/// The name that an effect goes by: friction across is the effective track on two axles.
fn class<'a>(id: &'a str, scene: &Scene) -> &'a str {
    if id == "tyre_grip_anisotropy" && scene.robot.wheelbase() > 0.0 { "effective_track" } else { id }
}

/// What was hidden, by the names that it goes by.
fn truth_of(draw: &Draw) -> Vec<&str> {
    draw.causes.iter().map(|cause| class(cause.effect.id, &draw.clean)).collect()
}

/// Evidence of the truth, where it is two effects.
fn pair_evidence(truth: &[&str], oracle: &Study<'_>) -> Option<PairEvidence> {
    <[&str; 2]>::try_from(truth).ok().and_then(|pair| oracle.pair_evidence(pair))
}

fn calls_for_both(pair: PairEvidence) -> bool {
    pair.log_odds() > ALIKE
}

/// What a draw calls for.
fn calls_for(truth: &[&str], strength: f64, pair: Option<PairEvidence>) -> Call {
    let for_answer = if truth.len() == 2 { pair.is_some_and(calls_for_both) } else { strength >= STRONG };
    Call { for_answer, pair }
}

/// The same, as an oracle has it which is not told what the world is, but knows it by `clean` campaigns like the draw's alone: the
/// difference of a campaign from the mean of k others has 1 + 1/k times its variance.
pub(super) fn called_for_by_clean(draw: &Draw, oracle: Study<'_>, clean: usize) -> Call {
    let oracle = oracle.counting_for(clean as f64 / (clean + 1) as f64);
    let truth = truth_of(draw);
    calls_for(&truth, oracle.strength(), pair_evidence(&truth, &oracle))
}

/// Whether two effects together, and nothing else, are a real alternative among the answers that were weighed: within odds of 50
/// to 1 of the likeliest, whichever wheel or place they have.
fn both_stand(truth: &[&str], diagnosis: &Diagnosis, scene: &Scene) -> bool {
    let mut probabilities: BTreeMap<BTreeSet<&str>, f64> = BTreeMap::new();
    for answer in &diagnosis.ranking {
        let effects = answer.effects.iter().map(|id| class(id, scene)).collect();
        *probabilities.entry(effects).or_default() += answer.probability;
    }
    let likeliest = probabilities.values().copied().fold(0.0, f64::max);
    let both: BTreeSet<&str> = truth.iter().copied().collect();
    probabilities.get(&both).is_some_and(|probability| *probability > likeliest * (-ALIKE).exp())
}

/// What a draw came to, but for the gain.
pub(super) fn judge(
    challenge: &Challenge,
    draw: &Draw,
    diagnosis: &Diagnosis,
    oracle: &Study<'_>,
    seconds: f64,
) -> Scored {
    let truth = truth_of(draw);
    let strength = oracle.strength();
    let (nothing, evidences) = oracle.single_evidences();
    let evidence_of = |id: &str| evidences.iter().find(|(known, _)| *known == id).map(|(_, value)| *value);
    let pair = pair_evidence(&truth, oracle);
    let oracle_set: Vec<&'static str> = match truth.as_slice() {
        [_, _] if pair.is_some_and(|pair| pair.both > pair.fewer.max(pair.other) + ALIKE) => {
            draw.causes.iter().map(|cause| cause.effect.id).collect()
        }
        [id] => {
            // A spot on the floor has no single evidence without its place: what the data say at best is all of the misfit.
            let own = evidence_of(id).unwrap_or(nothing + 0.5 * strength * strength - 8.0);
            let mut set: Vec<&'static str> = evidences
                .iter()
                .filter(|(known, value)| known == id || *value > own - ALIKE)
                .map(|(k, _)| *k)
                .collect();
            if !set.contains(id) {
                set.push(draw.causes[0].effect.id);
            }
            set
        }
        _ => Vec::new(),
    };
    let answers: Vec<Vec<&str>> = diagnosis
        .findings
        .iter()
        .map(|finding| std::iter::once(finding.effect).chain(finding.confounded_with.iter().copied()).collect())
        .collect();
    let holds = |answer: &[&str], id: &str| {
        answer.contains(&id) || (id == "load_offset_longitudinal" && answer.contains(&"effective_track"))
    };
    let silent = answers.is_empty() && diagnosis.verdict != Verdict::Unexplained;
    let wrong = answers.iter().any(|answer| !truth.iter().any(|id| holds(answer, id)));
    let tally = match (challenge.effects, truth.as_slice()) {
        (EffectsKind::Outside, _) => {
            // A mimic is true if it takes away what can be taken away.
            let mimic = answers.len() == 1 && {
                let best = evidences.iter().map(|(_, value)| *value).fold(nothing, f64::max);
                answers[0].iter().any(|id| evidence_of(id).is_some_and(|value| value > best - ALIKE))
                    && best > nothing + 0.4 * strength * strength
            };
            match () {
                () if strength < STRONG && silent => Tally::SilentRightly,
                () if diagnosis.verdict == Verdict::Unexplained || mimic => Tally::Unexplained,
                () if silent => Tally::Missed,
                () => Tally::Wrong,
            }
        }
        (_, []) if silent => Tally::Clean,
        (_, []) => Tally::FalseAlarm,
        (_, [id]) => match () {
            () if silent && strength >= STRONG => Tally::Missed,
            () if silent => Tally::SilentRightly,
            () if wrong || answers.is_empty() || strength < 1.0 => Tally::Wrong,
            () => {
                let size = answers.iter().filter(|answer| holds(answer, id)).map(Vec::len).max().unwrap_or(0);
                match () {
                    () if size == 1 => Tally::Named,
                    () if size <= oracle_set.len() + 1 => Tally::RightGroup,
                    () if size <= 2 * oracle_set.len() => Tally::Half,
                    // Below 5 σ only a wrong name counts against an answer.
                    () if strength < STRONG => Tally::SilentRightly,
                    () => Tally::Missed,
                }
            }
        },
        (_, both) => {
            let all = both.iter().all(|id| answers.iter().any(|answer| holds(answer, id)));
            match () {
                () if wrong => Tally::Wrong,
                () if !pair.is_some_and(calls_for_both) => Tally::AsFarAsCalledFor,
                () if all && answers.len() == both.len() && answers.iter().all(|answer| answer.len() == 1) => {
                    Tally::BothExact
                }
                () if all => Tally::BothInSets,
                () => Tally::Missed,
            }
        }
    };
    let mut intervals = Vec::new();
    for cause in &draw.causes {
        let finding = diagnosis.findings.iter().find(|f| f.effect == cause.effect.id && f.choice == cause.choice);
        let Some(finding) = finding.filter(|finding| finding.confounded_with.is_empty()) else { continue };
        for ((found, &value), parameter) in finding.parameters.iter().zip(&cause.values).zip(cause.effect.parameters) {
            if let Some(std_dev) = found.std_dev {
                let off = parameter.difference(found.value, value) / std_dev;
                intervals.push(Interval { effect: finding.effect, parameter: found.name, off });
            }
        }
    }
    let regret = match truth.as_slice() {
        [] => diagnosis.probabilities.iter().find(|(id, _)| id.is_none()).map(|(_, p)| -p.max(1e-6).ln()),
        [id] if strength >= STRONG => {
            let total: f64 =
                evidences.iter().map(|(_, value)| (value - evidence_of(id).unwrap_or(nothing)).exp()).sum();
            diagnosis
                .probabilities
                .iter()
                .find(|(known, _)| known.as_deref() == Some(id))
                .map(|(_, p)| -total.max(1.0).ln() - p.max(1e-6).ln())
        }
        _ => None,
    };
    let detectable_ratio = ratios(diagnosis, oracle);
    let answer = match diagnosis.findings.as_slice() {
        [] => format!("{:?}", diagnosis.verdict).to_lowercase(),
        findings => findings
            .iter()
            .map(|f| {
                let mut line = f.effect.to_owned();
                if !f.confounded_with.is_empty() {
                    line = format!("{line} or {}", f.confounded_with.join(" or "));
                }
                line
            })
            .collect::<Vec<_>>()
            .join(" and "),
    };
    let mut described: Vec<String> = draw.causes.iter().map(Cause::line).collect();
    described.extend(draw.outside.clone());
    Scored {
        seed: challenge.seed,
        truth: described,
        strength,
        oracle_set,
        answer,
        tally,
        called_for: calls_for(&truth, strength, pair),
        called_for_as_told: None,
        both_stand: (truth.len() == 2).then(|| both_stand(&truth, diagnosis, &draw.clean)),
        intervals,
        set_size: answers.iter().map(Vec::len).max(),
        regret,
        detectable_ratio,
        gain: None,
        gain_on_fresh: None,
        seconds,
    }
}

/// Smallest detectable sizes of the diagnosis over the oracle's.
fn ratios(diagnosis: &Diagnosis, oracle: &Study<'_>) -> Vec<f64> {
    let of_oracle: BTreeMap<(&str, String, &str), f64> = oracle
        .blind()
        .into_iter()
        .map(|blind| ((blind.effect, blind.choice, blind.parameter), blind.smallest_detectable))
        .collect();
    diagnosis
        .blind_to
        .iter()
        .filter_map(|blind| {
            let known = of_oracle.get(&(blind.effect, blind.choice.clone(), blind.parameter))?;
            let ratio = blind.smallest_detectable / known;
            ratio.is_finite().then_some(ratio)
        })
        .collect()
}
