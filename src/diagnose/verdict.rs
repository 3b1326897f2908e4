//! From a ranking to an answer: what is named, how sure that is, and what cannot be told from it.

use super::blind::blind;
use super::doubt::SHARES;
use super::misfit::{misfit, run_readings};
use super::noise;
use super::response_error::PARTS;
use super::search::{Hypothesis, Ranking, Set, axes_of};
use super::spots;
use super::variant::{Axis, CLOCKS, Variant, causes, moved_to, terms};
use super::{
    Clock, Diagnosis, Finding, ForwardError, ForwardModel, Found, PLAUSIBLE_TERM, Ranked, Study, Suspicion, Transient,
    Verdict, residue,
};
use crate::scene::{Doubt, TermPart};
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use std::collections::{BTreeMap, BTreeSet};

/// ln of the odds at which one answer is no longer a real alternative to another.
pub(super) const REAL: f64 = 3.912_023_005_428_146; // ln 50
/// ln of the odds over a simpler answer that an answer needs to be given.
pub(super) const CONVINCING: f64 = 1.5;
/// Variance of the runs' means, over what their noise makes of it, from which on the answer that leaves it is none.
const MUCH: f64 = 2.0;
/// … and the chance below which that is no noise.
const HARDLY: f64 = 1e-6;
/// Readings by which usual noise is known where nothing repeats: what is left is no noise beyond some forty times that.
const AS_USUAL: f64 = 4.0;
/// Chance from which on what is left may be noise.
const MAY_BE_NOISE: f64 = 1e-3;
/// Share of a misfit that causes have to take away to be named where a formula takes away the rest.
const MOST: f64 = 0.9;
/// Effects that the class `effective_track` stands for.
const TRACK_CLASS: [&str; 3] = ["effective_track", "tyre_grip_anisotropy", "load_offset_longitudinal"];

/// The answer from a ranking of causes, be it beside a formula; what is wrong is so of the model as `given`, which may be the
/// same study.
///
/// # Errors
/// It cannot be simulated.
pub(super) fn judge(study: &Study<'_>, given: &Study<'_>, ranking: &Ranking) -> Result<Diagnosis, ForwardError> {
    let variants = &study.variants;
    let best = convincing(ranking, variants);
    let has_formula = best.set.iter().any(|&index| variants[index].is_term());
    let by_formula = has_formula && share_of_causes(study, best) < MOST;
    let much = leaves_much(study, best);
    let answered = study.answered(best);
    // What cannot be driven explains nothing, however near the stand-in comes with it.
    let (answered, drives, (residues, remainder)) = match residue::residues(study, &answered) {
        Ok(left) => (answered, true, left),
        Err(_) => (Vec::new(), false, residue::residues(study, &[])?),
    };
    let unexplained = by_formula || much || !drives;
    let misfit = misfit(given);
    let total = log_sum(ranking.hypotheses.iter().map(|h| h.log_posterior));
    let probability = |h: &Hypothesis| (h.log_posterior - total).exp();

    let mut findings = Vec::new();
    for &index in best.set.iter().filter(|&&index| !unexplained && variants[index].is_cause()) {
        findings.push(finding(study, ranking, best, index, total));
    }
    let noise = noise::of_runs(&study.noise, &study.clusters, &study.counts);
    if noise.clock_std > 0.0 && !unexplained {
        // Clocks that differ from run to run are learnt as noise; they are a cause all the same.
        let spread = Found { name: "run_offset_std_s", value: noise.clock_std, std_dev: None };
        match findings.iter_mut().find(|finding| finding.effect == CLOCKS) {
            Some(finding) => {
                if let Some(found) = finding.parameters.iter_mut().find(|found| found.name == spread.name) {
                    *found = spread;
                }
            }
            None => findings.push(Finding {
                effect: CLOCKS,
                choice: String::new(),
                parameters: vec![
                    Found { name: "offset_s", value: 0.0, std_dev: None },
                    Found { name: "rate_minus_one", value: 0.0, std_dev: None },
                    spread,
                ],
                probability: 1.0,
                confounded_with: Vec::new(),
            }),
        }
    }
    let verdict = if unexplained {
        Verdict::Unexplained
    } else if findings.is_empty() {
        Verdict::Explained
    } else if findings.iter().all(|finding| finding.confounded_with.is_empty()) {
        Verdict::Named
    } else {
        Verdict::Ambiguous
    };
    let ids: Vec<&'static str> = {
        let mut ids: Vec<_> =
            variants.iter().filter(|variant| variant.is_cause()).map(|variant| variant.effect.id).collect();
        ids.dedup();
        ids
    };
    let mut probabilities = vec![(None, probability(ranking.nothing()))];
    probabilities.extend(ids.iter().map(|&id| {
        let holds = |h: &&Hypothesis| h.set.iter().any(|&index| variants[index].names(id));
        (Some(id), ranking.hypotheses.iter().filter(holds).map(probability).sum())
    }));
    let suspicion = if unexplained { None } else { suspicion(ranking, variants, best, &findings, total) };
    Ok(Diagnosis {
        verdict,
        misfit,
        findings,
        ranking: ranked(ranking, variants, total),
        suspicion,
        probabilities,
        blind_to: blind(study),
        noise,
        clocks: if unexplained { Vec::new() } else { clocks(study, ranking, best) },
        transient: if much { transient(study, best) } else { None },
        causes: causes(variants, &answered),
        empirical: terms(variants, &answered),
        other_tyres: None,
        doubt: doubt(study, if answered.is_empty() { ranking.nothing() } else { best }),
        residues,
        remainder,
        next_experiment: None,
        runs: run_readings(study, given, &answered),
        left_out: study.left_out.clone(),
    })
}

/// Answers that are listed at most.
const MOST_RANKED: usize = 40;

/// The answers that were weighed, the likeliest first; those of the same causes, with spots at the same place to the centimetre
/// that names state, are one. `total` is ln of all that answers weigh.
fn ranked(ranking: &Ranking, variants: &[Variant], total: f64) -> Vec<Ranked> {
    let mut answers: Vec<Ranked> = Vec::new();
    for h in &ranking.hypotheses {
        let parts = || h.set.iter().map(|&index| &variants[index]).filter(|variant| !variant.is_doubted());
        let causes: Vec<String> = parts().map(Variant::label).collect();
        let (log_evidence, probability) = (h.fit.log_evidence, (h.log_posterior - total).exp());
        if let Some(known) = answers.iter_mut().find(|known| known.causes == causes) {
            known.probability += probability;
            known.log_evidence = log_sum([known.log_evidence, log_evidence].into_iter());
        } else if answers.len() < MOST_RANKED {
            let effects = parts().map(Variant::id).collect();
            answers.push(Ranked { effects, causes, log_evidence, probability });
        }
    }
    answers
}

/// What is likelier than the answer by itself, and not sure enough to be named: a cause where none is, a further one where some
/// are. `total` is ln of all that answers weigh.
fn suspicion(
    ranking: &Ranking,
    variants: &[Variant],
    answer: &Hypothesis,
    findings: &[Finding],
    total: f64,
) -> Option<Suspicion> {
    // Odds that are positive evidence [Kass & Raftery 1995, *J. Am. Stat. Assoc.* 90] where the answer has no cause. That a robot
    // has a further one is unlikely beforehand: where it is likelier than not, the data have said as much.
    const POSITIVE: f64 = 3.0;
    const LIKELIER_THAN_NOT: f64 = 1.0;
    // Of an effect that is worth a word.
    const LIKELY: f64 = 0.1;
    let is_named = |id: &str| findings.iter().any(|it| it.effect == id || it.confounded_with.contains(&id));
    let mut further: BTreeMap<&'static str, f64> = BTreeMap::new();
    let mut likely = 0.0;
    for h in ranking.hypotheses.iter().filter(|h| h.set.len() > answer.set.len()) {
        let probability = (h.log_posterior - total).exp();
        likely += probability;
        let causes = h.set.iter().map(|&index| &variants[index]).filter(|variant| variant.is_cause());
        let effects: BTreeSet<&'static str> = causes.map(|cause| cause.effect.id).collect();
        for id in effects.into_iter().filter(|id| !is_named(id)) {
            *further.entry(id).or_default() += probability;
        }
    }
    let mut effects: Vec<(&str, f64)> = further.into_iter().filter(|(_, p)| *p > LIKELY).collect();
    effects.sort_by(|one, other| other.1.total_cmp(&one.1));
    let odds = likely / (1.0 - likely);
    let is_first = answer.set.iter().all(|&index| !variants[index].is_cause());
    let wanted = if is_first { POSITIVE } else { LIKELIER_THAN_NOT };
    (odds > wanted && !effects.is_empty()).then_some(Suspicion { odds, effects })
}

/// The answer of the fewest causes that is hardly less likely than the best, of which no part could as well be left out; none,
/// where that is a real alternative to all the others. Which wheel or place an effect has does not matter here: answers of the
/// same effects speak for one another.
pub(super) fn convincing<'r>(ranking: &'r Ranking, variants: &[Variant]) -> &'r Hypothesis {
    let nothing = ranking.nothing();
    let others = ranking.hypotheses.iter().filter(|h| h.set != nothing.set);
    if log_sum(others.map(|h| h.log_posterior)) < nothing.log_posterior + REAL {
        return nothing;
    }
    let effects = |h: &Hypothesis| ids(&h.set, variants);
    let mut alike: BTreeMap<Vec<&str>, Vec<f64>> = BTreeMap::new();
    for h in &ranking.hypotheses {
        alike.entry(effects(h)).or_default().push(h.log_posterior);
    }
    let together = |h: &Hypothesis| log_sum(alike[&effects(h)].iter().copied());
    let hardly_less = together(ranking.best()) - CONVINCING;
    let likely = ranking.hypotheses.iter().filter(|h| together(h) > hardly_less);
    let mut best = likely.min_by_key(|h| h.set.len()).unwrap_or(ranking.best());
    loop {
        let needed = together(best) - CONVINCING;
        let simpler = ranking
            .hypotheses
            .iter()
            .filter(|h| h.set.len() < best.set.len() && h.set.is_subset(&best.set))
            .find(|h| together(h) > needed);
        match simpler {
            Some(simpler) => best = simpler,
            None => return best,
        }
    }
}

/// How far an answer is to be doubted: a model that had to be moved by so much may answer causes otherwise by as much, and
/// what a calibration would find is known as well as these data say. What it leaves and its tyres are as much in doubt as the
/// model's.
fn doubt(study: &Study<'_>, best: &Hypothesis) -> Doubt {
    let problem = study.problem(study.counts.clone());
    let of = super::CALIBRATED.map(|id| study.variants.iter().position(|it| it.names(id)));
    let mut set = best.set.clone();
    set.extend(of.into_iter().flatten());
    let fit = problem.fit(&axes_of(&study.variants, &set), &best.fit.at);
    let widths = of.map(|variant| {
        let place = fit.at.iter().position(|(axis, _)| Some(axis.variant) == variant);
        place.map_or(0.0, |place| {
            let left_out = !best.set.contains(&fit.at[place].0.variant);
            let off = if left_out { fit.at[place].1 } else { 0.0 };
            off.hypot(fit.covariance[(place, place)].sqrt())
        })
    });
    // What was fitted is how the robot moves; its tyres are what the model took them for.
    Doubt {
        motion: 0.0,
        response: correction(study, &best.fit.at),
        diameter_scale: widths[0],
        diameter_ratio: widths[1],
        effective_track: widths[2],
        ..study.model.scene().robot.doubt.of_usual_tyres()
    }
}

/// Share by which turns or ways change under `at`, root mean square over the parts of a way, whichever is greater: a turn that
/// comes a little later, or is made good at once, is none.
pub(super) fn correction(study: &Study<'_>, at: &[(Axis, f64)]) -> f64 {
    let of = |component: usize| {
        let (mut changed, mut whole) = (0.0, 0.0);
        // Runs that are held out have no say in how far a model is to be doubted.
        for (index, cluster) in study.clusters[..study.used].iter().enumerate() {
            let way = &study.surrogate.ways[cluster.reference];
            let steps = study.surrogate.steps(index, cluster.reference, at, &study.variants);
            let both: Vec<[f64; 2]> =
                steps.iter().zip(&way.steps).map(|(step, given)| [step[component], given[component]]).collect();
            for part in both.chunks(both.len().div_ceil(PARTS)) {
                changed += part.iter().map(|[step, given]| step - given).sum::<f64>().powi(2);
                whole += part.iter().map(|[_, given]| given.abs()).sum::<f64>().powi(2);
            }
        }
        if whole > 0.0 { (changed / whole).sqrt() } else { 0.0 }
    };
    of(0).max(of(2)).min(1.0)
}

/// Whether an answer leaves so much of the runs' means, against what runs of one kind stray by, that it is none.
pub(super) fn leaves_much(study: &Study<'_>, best: &Hypothesis) -> bool {
    let left = Left::of(study, best);
    left.variance > MUCH && left.chance < HARDLY
}

/// Whether it leaves no more than noise makes, as far as repeats tell.
pub(super) fn leaves_noise(study: &Study<'_>, best: &Hypothesis) -> bool {
    study.repeats() && Left::of(study, best).chance > MAY_BE_NOISE
}

/// Σ of squares that an answer leaves of the runs' means, each over its variance.
pub(super) fn misfit_of_means(study: &Study<'_>, answer: &Hypothesis) -> f64 {
    (answer.fit.left - answer.fit.strays) * study.discrepancy
}

/// What an answer leaves of the runs' means.
struct Left {
    /// Their variance over what noise makes of it.
    variance: f64,
    /// Chance that noise makes so much.
    chance: f64,
}

impl Left {
    fn of(study: &Study<'_>, best: &Hypothesis) -> Left {
        // Readings of all runs that count, and of one of each kind.
        let (mut all, mut of_means) = (0, 0);
        for cluster in &study.clusters {
            let readings = study.observed[cluster.reference].len();
            let runs = cluster.active(&study.counts).count();
            all += runs * readings;
            of_means += runs.min(1) * readings;
        }
        let freedom = of_means as f64;
        let variance = misfit_of_means(study, best) / freedom;
        // The noise is known as well as repeated runs tell it, which for end points is not well.
        let of_noise = f64::max((all - of_means) as f64, AS_USUAL);
        let chance = FisherSnedecor::new(freedom, of_noise).map_or(1.0, |law| law.sf(variance));
        Left { variance, chance }
    }
}

/// Errors that are made good by a run's end, under which what an answer leaves is likeliest; `None` where they say little that
/// errors of no such kind do not.
fn transient(study: &Study<'_>, best: &Hypothesis) -> Option<Transient> {
    let stated = study.model.scene().robot.doubt;
    let under = |transient: f64| study.problem_of(&study.noise, Doubt { transient, ..stated }, study.counts.clone());
    let own = under(stated.transient);
    let left = own.left_of_means(&best.fit.at).max(1.0);
    let of_no_kind = own.with_discrepancy(left).log_likelihood(&best.fit.at);
    let of = |share: f64| Transient { share, log_odds: under(share).log_likelihood(&best.fit.at) - of_no_kind };
    let all = SHARES.into_iter().filter(|&share| share > stated.transient).map(of);
    all.max_by(|a, b| a.log_odds.total_cmp(&b.log_odds)).filter(|best| best.log_odds > REAL)
}

/// Share of what causes and formula take away together that the causes take away alone.
fn share_of_causes(study: &Study<'_>, best: &Hypothesis) -> f64 {
    let problem = study.problem(study.counts.clone());
    let variants = &study.variants;
    let slope_is_formulas = pulls_on_its_own(variants, best);
    let of_causes = |variant: &Variant| variant.is_cause() && !(variant.is_slope() && slope_is_formulas);
    let is_cause = |(axis, _): &&(Axis, f64)| of_causes(&variants[axis.variant]);
    let causes: Vec<_> = best.fit.at.iter().filter(is_cause).copied().collect();
    let axes: Vec<_> = causes.iter().map(|(axis, _)| *axis).collect();
    let before = problem.fit(&[], &[]).chi2;
    (before - problem.fit(&axes, &causes).chi2) / (before - best.fit.chi2)
}

/// Whether what a formula pulls by is no small part of what a slope beside it does: that is what of the same force is alike everywhere
/// then, and no slope.
fn pulls_on_its_own(variants: &[Variant], best: &Hypothesis) -> bool {
    // Both over the weight.
    let of = |pull: &dyn Fn(&Variant) -> Option<f64>| {
        let parts = best.fit.at.iter().filter_map(|(axis, value)| Some(pull(&variants[axis.variant])? * value));
        parts.map(|part| part * part).sum::<f64>().sqrt()
    };
    let by_formula = of(&|variant| {
        let is_potential = variant.term()?.part == TermPart::Potential;
        is_potential.then(|| PLAUSIBLE_TERM / variant.coordinates[0].std_dev)
    });
    by_formula > (1.0 - MOST) * of(&|variant| variant.is_slope().then_some(1.0))
}

/// Coordinates of one variant in an answer, and their covariance.
fn own(answer: &Hypothesis, variant: usize) -> (Vec<f64>, DMatrix<f64>) {
    let fit = &answer.fit;
    let own: Vec<usize> = (0..fit.at.len()).filter(|&k| fit.at[k].0.variant == variant).collect();
    let covariance = DMatrix::from_fn(own.len(), own.len(), |i, j| fit.covariance[(own[i], own[j])]);
    (own.iter().map(|&k| fit.at[k].1).collect(), covariance)
}

/// Second moments of a variant's coordinates about those of the best answer, over all answers that hold it by their
/// probability: what else may be at work, or a spot may lie elsewhere, is part of what is not known of a size [Hoeting et al.,
/// *Statist. Sci.* 14 (1999) 382–417]. A spot stands for as much of the path as no other one was tried on.
fn spread(study: &Study<'_>, ranking: &Ranking, best: &Hypothesis, index: usize) -> DMatrix<f64> {
    let variants = &study.variants;
    let (at, _) = own(best, index);
    let is_it = |other: usize| other == index || variants[other].place().is_some() && variants[index].place().is_some();
    let (mut sum, mut total) = (DMatrix::zeros(at.len(), at.len()), 0.0);
    for answer in &ranking.hypotheses {
        let Some(&it) = answer.set.iter().find(|&&other| variants[other].is_cause() && is_it(other)) else { continue };
        let weight = (answer.log_posterior - best.log_posterior).exp() * spots::room(variants, it);
        let (there, of_answer) = own(answer, it);
        let off = DVector::from_iterator(at.len(), there.iter().zip(&at).map(|(there, here)| there - here));
        sum += (of_answer + &off * off.transpose()) * weight;
        total += weight;
    }
    // The best answer is one of them.
    let mut spread = sum / total;
    for (coordinate, own) in at.iter().enumerate() {
        let place = (coordinate, coordinate);
        spread[place] = spread[place].max(along_waves(study, best, Axis { variant: index, coordinate }, *own));
    }
    spread
}

/// Parts of what is plausible \[σ\] at which a cause that does not go on as it begins is asked how likely it is.
const ASKED: f64 = 0.1;

/// Second moment about `own` of such a cause, by all that it is likely to be, and not by how that bends where it is likeliest; 0 of
/// others. What else is in the answer stays where it is.
fn along_waves(study: &Study<'_>, best: &Hypothesis, axis: Axis, own: f64) -> f64 {
    let waves = study.surrogate.waves(axis);
    let Some(farthest) = waves.last() else { return 0.0 };
    let problem = study.problem(study.counts.clone());
    let cost = |value: f64| problem.cost(&moved_to(&best.fit.at, axis, value));
    let least = cost(own);
    let part = ASKED * study.variants[axis.variant].coordinates[axis.coordinate].std_dev;
    let asked = (0..).map(|k| f64::from(k) * part).take_while(|value| value <= farthest);
    let (moment, total) = asked.fold((0.0, 1.0), |(moment, total), value| {
        let weight = (0.5 * (least - cost(value))).exp();
        (moment + weight * (value - own).powi(2), total + weight)
    });
    moment / total
}

/// What the clocks of each of several campaigns disagree by, if an answer says that they do.
fn clocks(study: &Study<'_>, ranking: &Ranking, best: &Hypothesis) -> Vec<Clock> {
    let Some(&index) = best.set.iter().find(|&&index| study.variants[index].names(CLOCKS)) else { return Vec::new() };
    let variant = &study.variants[index];
    let ((at, _), covariance) = (own(best, index), spread(study, ranking, best, index));
    let of_campaign = |k: usize| {
        let campaign = variant.coordinates[k].clocks_of?;
        let case = study.cases.iter().find(|case| case.campaign == campaign)?;
        let (offset, std_dev) = (at[k], covariance[(k, k)].sqrt());
        Some(Clock { campaign: case.campaign_name.clone(), offset, std_dev })
    };
    variant.clocks().into_iter().filter_map(of_campaign).collect()
}

fn finding(study: &Study<'_>, ranking: &Ranking, best: &Hypothesis, index: usize, total: f64) -> Finding {
    let variants = &study.variants;
    let variant = &variants[index];
    let (at, _) = own(best, index);
    let std_devs = variant.std_devs(&at, &spread(study, ranking, best, index));
    let cause = variant.cause(&at);
    let parameters = variant
        .effect
        .parameters
        .iter()
        .zip(cause.values)
        .zip(std_devs)
        .map(|((parameter, value), std_dev)| Found { name: parameter.name, value, std_dev })
        .collect();

    let mut confounded = in_its_place(ranking, variants, best, index);
    let holds = |h: &&Hypothesis| h.set.iter().any(|&other| variants[other].names(variant.effect.id));
    let mut probability =
        ranking.hypotheses.iter().filter(holds).map(|h| (h.log_posterior - total).exp()).sum::<f64>().min(1.0);
    // What only the class can name is named by the class.
    let class = confounded.contains(&"effective_track") || variant.effect.id == "effective_track";
    if class
        && confounded.iter().chain([&variant.effect.id]).all(|id| TRACK_CLASS.contains(id))
        && variant.effect.id == "effective_track"
    {
        confounded.clear();
        probability = probability.max(
            ranking
                .hypotheses
                .iter()
                .filter(|h| h.set.iter().any(|&other| TRACK_CLASS.iter().any(|id| variants[other].names(id))))
                .map(|h| (h.log_posterior - total).exp())
                .sum::<f64>(),
        );
    }
    Finding {
        effect: variant.effect.id,
        choice: variant.choice.clone(),
        parameters,
        probability: probability.min(1.0),
        confounded_with: confounded,
    }
}

/// Effects that may be in the place of one cause of the `best` answer: of answers that put something else there and are nearly as
/// likely, of no more causes than what is hardly less likely than any. Which wheel or place the rest of the answer has does not
/// matter here: one toed wheel on tracks of two widths is told from another by little.
fn in_its_place(ranking: &Ranking, variants: &[Variant], best: &Hypothesis, index: usize) -> Vec<&'static str> {
    let leads = |h: &&Hypothesis| h.log_posterior > ranking.best().log_posterior - CONVINCING;
    let most = ranking.hypotheses.iter().filter(leads).map(|h| h.set.len()).fold(best.set.len(), usize::max);
    let rest: Set = best.set.iter().copied().filter(|&other| other != index).collect();
    let ids_of_rest = ids(&rest, variants);
    let mut confounded: Vec<&'static str> = Vec::new();
    // A real alternative, and one that the data speak for: what does nothing here is no cause of it.
    let is_rest = |h: &&Hypothesis| ids(&h.set, variants) == ids_of_rest;
    let without = ranking.hypotheses.iter().find(is_rest).map_or(f64::NEG_INFINITY, |h| h.fit.log_evidence);
    let is_likely =
        |h: &&Hypothesis| h.log_posterior > best.log_posterior - REAL && h.fit.log_evidence > without + CONVINCING;
    let others: Vec<(&Hypothesis, Vec<&'static str>)> = ranking
        .hypotheses
        .iter()
        .filter(is_likely)
        .filter(|h| !h.set.contains(&index) && h.set.len() <= most)
        .filter_map(|h| Some((h, beyond(ids(&h.set, variants), &ids_of_rest)?)))
        .collect();
    // What is no less likely without a part of it says nothing for that part.
    let is_part = |it: &Hypothesis, of: &Hypothesis| it.set.len() < of.set.len() && it.set.is_subset(&of.set);
    let is_whole = |h: &Hypothesis| !others.iter().any(|(it, put)| !put.is_empty() && is_part(it, h));
    for id in others.iter().filter(|(h, _)| is_whole(h)).flat_map(|(_, put)| put) {
        if *id != variants[index].effect.id && !confounded.contains(id) {
            confounded.push(id);
        }
    }
    confounded
}

/// Effects of an answer, one a cause, in order.
pub(super) fn ids(set: &Set, variants: &[Variant]) -> Vec<&'static str> {
    let mut ids: Vec<&'static str> = set.iter().map(|&index| variants[index].effect.id).collect();
    ids.sort_unstable();
    ids
}

/// What of `all` is beyond `rest`; `None` where not all of that is in it.
fn beyond(mut all: Vec<&'static str>, rest: &[&'static str]) -> Option<Vec<&'static str>> {
    for id in rest {
        let place = all.iter().position(|other| other == id)?;
        all.remove(place);
    }
    Some(all)
}

pub(super) fn log_sum(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = values.clone().fold(f64::NEG_INFINITY, f64::max);
    most + values.map(|value| (value - most).exp()).sum::<f64>().ln()
}

#[cfg(test)]
mod tests {
    use super::super::fit::Fit;
    use super::*;
    use crate::scene::Scene;

    fn variants() -> Vec<Variant> {
        Variant::all(&Scene::load("jnpf_4wd", "lab_floor").expect("shipped"), &[])
    }

    /// Answers of causes, each with ln of its posterior.
    fn ranking(variants: &[Variant], answers: &[(&[&str], f64)]) -> Ranking {
        let of = |(ids, log_posterior): &(&[&str], f64)| {
            let covariance = DMatrix::zeros(0, 0);
            let fit =
                Fit { at: Vec::new(), covariance, log_evidence: *log_posterior, chi2: 0.0, left: 0.0, strays: 0.0 };
            Hypothesis { set: set(variants, ids), fit, log_posterior: *log_posterior, opposite: Vec::new() }
        };
        let mut ranking = Ranking { hypotheses: answers.iter().map(of).collect() };
        ranking.sort();
        ranking
    }

    fn set(variants: &[Variant], ids: &[&str]) -> Set {
        let place = |id: &&str| variants.iter().position(|variant| variant.names(id)).expect("it applies");
        ids.iter().map(place).collect()
    }

    /// Nothing is said of a first cause below odds of 3 to 1, of a further one where it is less likely than not, nor of what is
    /// named or cannot be told from it.
    #[test]
    fn a_further_cause_is_suspected_where_it_is_likelier_than_not() {
        let variants = variants();
        let named = |effect, confounded_with: &[&'static str]| Finding {
            effect,
            choice: String::new(),
            parameters: Vec::new(),
            probability: 1.0,
            confounded_with: confounded_with.to_vec(),
        };
        let suspected = |answers: &[(&[&str], f64)], findings: &[Finding]| {
            let ranking = ranking(&variants, answers);
            let ids: Vec<&str> = findings.iter().map(|finding| finding.effect).collect();
            let answer = ranking.of(&set(&variants, &ids)).expect("it was weighed").clone();
            let total = log_sum(ranking.hypotheses.iter().map(|h| h.log_posterior));
            suspicion(&ranking, &variants, &answer, findings, total)
        };
        let (one, both): (&[&str], &[&str]) = (&["floor_slope"], &["floor_slope", "stop_overrun"]);
        for (odds, is_told) in [(2.9_f64, false), (3.1, true)] {
            let told = suspected(&[(&[], 0.0), (one, odds.ln())], &[]);
            assert_eq!(told.is_some(), is_told, "{told:?}");
        }
        for (odds, is_told) in [(0.9_f64, false), (1.1, true)] {
            let told = suspected(&[(&[], -30.0), (one, 0.0), (both, odds.ln())], &[named("floor_slope", &[])]);
            assert_eq!(told.is_some(), is_told, "{told:?}");
            if let Some(told) = told {
                assert!((told.odds - odds).abs() < 1e-9, "{told:?}");
                assert_eq!(told.effects.iter().map(|(id, _)| *id).collect::<Vec<_>>(), ["stop_overrun"]);
            }
        }
        let group = [named("floor_slope", &["stop_overrun"])];
        assert_eq!(suspected(&[(&[], -30.0), (one, 0.0), (both, 1.0)], &group), None);
    }

    #[test]
    fn of_answers_that_are_alike_likely_the_one_of_fewest_causes_stands() {
        let variants = variants();
        let stands = |answers: &[(&[&str], f64)]| convincing(&ranking(&variants, answers), &variants).set.clone();
        let set = |ids: &[&str]| set(&variants, ids);
        let (one, two): (&[&str], &[&str]) = (&["gear_backlash"], &["floor_slope", "stop_overrun"]);
        let three: &[&str] = &["floor_slope", "stop_overrun", "survey_scale"];
        // Nearly as likely as the best, and clearly less.
        assert_eq!(stands(&[(two, 0.0), (one, -0.9 * CONVINCING), (&[], -8.0)]), set(one));
        assert_eq!(stands(&[(two, 0.0), (one, -1.1 * CONVINCING), (&[], -8.0)]), set(two));
        // What then could as well be left out, be it clearly less likely than the best.
        let fewer = [(three, 0.0), (two, -0.9 * CONVINCING), (&two[..1], -1.8 * CONVINCING), (&[], -8.0)];
        assert_eq!(stands(&fewer), set(&two[..1]));
        // Nothing at all stands until it is no real alternative.
        assert_eq!(stands(&[(two, 0.0), (one, -8.0), (&[], -0.9 * REAL)]), set(&[]));
        assert_eq!(stands(&[(two, 0.0), (one, -8.0), (&[], -1.1 * REAL)]), set(two));
    }

    /// What may be in a cause's place has as many causes as what is hardly less likely than the best.
    #[test]
    fn two_causes_may_be_in_the_place_of_one() {
        let variants = variants();
        let (one, both): (&[&str], &[&str]) = (&["wheel_diameter_scale"], &["survey_scale", "wheel_diameter_scale"]);
        let others: &[&str] = &["survey_scale", "tyre_radius_drift"];
        let in_place = |of_both: f64, of_others: f64| {
            let ranking = ranking(&variants, &[(one, 0.0), (both, of_both), (others, of_others), (&[], -8.0)]);
            let best = ranking.of(&set(&variants, one)).expect("it was weighed");
            in_its_place(&ranking, &variants, best, *best.set.first().expect("one"))
        };
        assert_eq!(in_place(-0.9 * CONVINCING, -0.9 * REAL), others);
        assert!(in_place(-0.9 * CONVINCING, -1.1 * REAL).is_empty());
        assert!(in_place(-1.1 * CONVINCING, -1.2 * CONVINCING).is_empty());
    }
}
