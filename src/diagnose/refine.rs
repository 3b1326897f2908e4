//! The stand-in made exact where the leading answers are, and asked again.

use super::forward::ForwardModel;
use super::search::{self, Hypothesis, Ranking, Set};
use super::surrogate::{Bench, Surrogate};
use super::variant::{Axis, Variant};
use super::{DiagnoseError, Study, spots, verdict};
use crate::scene::Contact;
use std::collections::BTreeSet;

/// Answers that are simulated where they are best.
const LEADING: usize = 4;
/// Times that the stand-in is made exact where the leading answers are: what is far from what is plausible is followed there.
const ROUNDS: usize = 6;
/// Times that an answer is simulated as a whole to find where it leaves least, and that another takes its place.
const AS_A_WHOLE: usize = 8;
/// Distance from what was simulated beyond which an answer is simulated where it is \[σ\].
const NEAR: f64 = 0.15;
const NEAR_FOR_SPOTS: f64 = 0.1;
/// The same at least, however sharp the data are.
const NEAREST: f64 = 0.02;
/// Answers that have one other cause than the best which are simulated as it is, and how far behind it they may be, for that is what
/// a sum of what causes do alone may be off by.
const RIVALS: usize = 2;
const OF_A_SUM: f64 = 30.0;
/// Causes that lead alone beside which others are simulated all along.
const ALONE: usize = 3;
/// Size from which on what a cause does was a guess at first: it is simulated at 1 σ \[σ\].
const LARGE: f64 = 2.0;
/// Times that leading answers are simulated on tyres that are in doubt, where that moves them, and how far behind the best those
/// may be that are looked at again then: one that holds the same causes gains a dozen by it.
const ON_TYRES: usize = 3;
const OF_TYRES: f64 = 30.0;
/// Halvings between no change and one under which the robot cannot be driven.
const HALVINGS: usize = 4;
/// Times that a spot is followed to a better one beside it, and how far at a time \[m\].
const FOLLOWED: usize = 12;
const FARTHER: [f64; 3] = [0.006_25, 0.003_125, 0.001_562];
/// Times that it is asked anew what leads where runs come upon spots elsewhere.
const ELSEWHERE: usize = 3;
/// Spots on the floor that are looked into at first.
const LEADING_SPOTS: usize = 3;
/// Causes from which on an answer is looked at askance: a spot, or one term of a formula, may do what many do together.
pub(super) const LONG_LIST: usize = 3;
/// ln of the evidence that a round has to bring, or to take, for the next.
const WORTH_A_ROUND: f64 = 1.0;

/// Where an answer is along one axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    pub axis: Axis,
    pub value: f64,
    /// To what σ the data tell it.
    pub std_dev: f64,
}

impl Study<'_> {
    /// Causes by evidence, the leading ones simulated where they are best.
    pub(super) fn refined(&mut self, first: Ranking) -> Result<Ranking, DiagnoseError> {
        let mut ranking = first;
        if self.couple_all_along(&ranking) {
            ranking = self.search(&self.known_variants(), &self.worth_another_look(&ranking));
        }
        // The stand-in is made exact where the leading answers are, and asked again.
        for round in 0..ROUNDS {
            let closer = self.close_in(&ranking, spots::CLOSER.get(round).copied().unwrap_or_default())?;
            let refined = self.refine(&ranking)?;
            if !closer && !refined {
                break;
            }
            let before = ranking;
            ranking = self.search(&self.known_variants(), &self.worth_another_look(&before));
            if round > 1 && self.is_exact(ranking.best()) && is_settled(&before, &ranking) {
                break;
            }
        }
        self.follow_spot(&mut ranking)?;
        ranking = self.look_elsewhere(ranking)?;
        // What is in doubt of the tyres comes in once the causes have settled: while they are looked for it would serve those that
        // were simulated with it against all others. With it, they may go elsewhere.
        for _ in 0..ON_TYRES {
            if !self.refine_on_tyres(&ranking)? {
                break;
            }
            // What a cause does on other tyres is known in all answers then that hold it: one that was not looked at again would be
            // worth less than it is.
            ranking.look_anew_within(&self.problem(self.counts.clone()), OF_TYRES);
            if self.options.noise.is_none() {
                self.weigh_noise(&mut ranking);
            }
        }
        Ok(self.explained(ranking))
    }

    /// Simulates what does not go on as it begins beside causes that lead alone, where wheels grip or give and the best answer leaves
    /// much or is a long list; whether anything was.
    fn couple_all_along(&mut self, ranking: &Ranking) -> bool {
        let best = ranking.best();
        let is_long = best.set.len() >= ranking.nothing().set.len() + LONG_LIST;
        let in_doubt = is_long || verdict::leaves_much(self, best);
        if !in_doubt || self.model.scene().contact != Contact::Rigid {
            return false;
        }
        let moves_it = |h: &&Hypothesis| h.set.iter().any(|&index| self.variants[index].is_physical());
        let mut known = BTreeSet::new();
        let is_other = |h: &&Hypothesis| known.insert(verdict::ids(&h.set, &self.variants));
        let alone = singles(ranking).filter(moves_it).filter(is_other).take(ALONE);
        let alone: Vec<Vec<(Axis, f64)>> = alone.map(|h| h.fit.at.clone()).collect();
        let (surrogate, bench) = self.bench();
        let mut any = false;
        for answer in &alone {
            any |= surrogate.couple_all_along(bench, answer);
        }
        any
    }

    /// Whether the model had to be moved so far that causes may act otherwise than it has them.
    pub(super) fn was_moved(&self) -> bool {
        self.variants.iter().any(Variant::is_response_error)
    }

    /// Simulates spots about the leading one, at these distances; whether there was one. At first, several that lead are
    /// looked into, also where the best answer is none of them and yet leaves much or is a long list.
    fn close_in(&mut self, ranking: &Ranking, distances: &[f64]) -> Result<bool, DiagnoseError> {
        let best = ranking.best();
        let in_doubt = distances.len() > 1 && (best.set.len() >= LONG_LIST || verdict::leaves_much(self, best));
        let (most, window, spots) =
            if in_doubt { (usize::MAX, f64::INFINITY, LEADING_SPOTS) } else { (LEADING, 12.0, 1) };
        let leading = ranking.hypotheses.iter().take(most).filter(|h| h.log_posterior > best.log_posterior - window);
        let mut places: Vec<([f64; 2], f64)> = Vec::new();
        for h in leading {
            let of = h.fit.at.iter().filter_map(|&(axis, value)| Some((self.variants[axis.variant].place()?, value)));
            for (place, value) in of {
                if places.iter().all(|(known, _)| *known != place) {
                    places.push((place, value));
                }
            }
        }
        places.truncate(spots);
        let looked_into = !places.is_empty() && !distances.is_empty();
        for (place, value) in places {
            for &distance in distances {
                let known: Vec<[f64; 2]> = self.variants.iter().filter_map(Variant::place).collect();
                let paths = (self.cases.as_slice(), &self.clusters[..self.used], self.surrogate.ways.as_slice());
                for place in spots::near(place, distance, &known, paths) {
                    let axis = Axis { variant: self.variants.len(), coordinate: 0 };
                    self.variants.push(Variant::spot(place));
                    let (surrogate, bench) = self.bench();
                    surrogate.add_spot(bench, axis, value)?;
                }
            }
        }
        Ok(looked_into)
    }

    /// Follows the spot of the best answer to where it is likeliest: of a little less grip a little farther on it does nearly the
    /// same. One that is in doubt is not followed: looked for so closely, many would fit.
    fn follow_spot(&mut self, ranking: &mut Ranking) -> Result<(), DiagnoseError> {
        let mut followed = false;
        for _ in 0..FOLLOWED {
            let best = ranking.best().clone();
            let Some((axis, from, value)) = self.spot_of(&best) else { break };
            let without = ranking.hypotheses.iter().filter(|h| self.spot_of(h).is_none());
            let likeliest = without.map(|h| h.log_posterior).fold(f64::NEG_INFINITY, f64::max);
            if best.log_posterior < likeliest + verdict::REAL {
                break;
            }
            let beside = self.spot_beside(ranking, &best);
            let mut farther = Vec::new();
            for distance in FARTHER {
                let known: Vec<[f64; 2]> = self.variants.iter().filter_map(Variant::place).collect();
                let paths = (self.cases.as_slice(), &self.clusters[..self.used], self.surrogate.ways.as_slice());
                for place in spots::near(from, distance, &known, paths) {
                    let there = Axis { variant: self.variants.len(), ..axis };
                    self.variants.push(Variant::spot(place));
                    let on = beside.map_or(value, |beside| spots::continued((from, value), beside, place));
                    let on = self.variants[there.variant].coordinates[0].within(on);
                    let (surrogate, bench) = self.bench();
                    surrogate.add_spot(bench, there, on)?;
                    let mut answer = best.clone();
                    answer.set.remove(&axis.variant);
                    answer.set.insert(there.variant);
                    answer.fit.at.retain(|(other, _)| *other != axis);
                    answer.fit.at.push((there, on));
                    farther.push(answer);
                }
            }
            ranking.look_again(&self.problem(self.counts.clone()), &farther);
            let spots: Vec<Place> =
                leading(ranking).flat_map(places).filter(|place| !self.knows_spot(*place)).collect();
            if farther.is_empty() && spots.is_empty() {
                break;
            }
            for place in spots {
                self.refine_one(place.axis, place.value);
            }
            ranking.look_anew(&self.problem(self.counts.clone()));
            followed = true;
        }
        if followed && self.options.noise.is_none() {
            self.weigh_noise(ranking);
        }
        Ok(())
    }

    /// Simulates what spots that lead do where runs come upon them elsewhere, and, where the best answer has one, asks anew by how
    /// much noise makes runs differ, and which causes there are.
    fn look_elsewhere(&mut self, mut ranking: Ranking) -> Result<Ranking, DiagnoseError> {
        // Beside many causes a spot stands for what none of them is, and noise is not to be learnt from that.
        if self.spot_of(ranking.best()).is_none() || ranking.best().set.len() >= LONG_LIST {
            return Ok(ranking);
        }
        for _ in 0..ELSEWHERE {
            let spots: Vec<(Axis, f64)> =
                leading(&ranking).filter_map(|h| self.spot_of(h)).map(|(axis, _, value)| (axis, value)).collect();
            let mut looked = false;
            for (axis, value) in spots {
                let (surrogate, bench) = self.bench();
                looked |= surrogate.look_elsewhere(bench, axis, value)?;
            }
            if !looked {
                break;
            }
            if self.spot_of(ranking.best()).is_none() {
                ranking.look_anew(&self.problem(self.counts.clone()));
                continue;
            }
            let earlier: Vec<Hypothesis> = leading(&ranking).cloned().collect();
            ranking = self.search_under_noise_of(&self.known_variants(), &earlier);
            self.refine(&ranking)?;
            ranking.look_anew(&self.problem(self.counts.clone()));
        }
        Ok(ranking)
    }

    /// Where an answer has a spot, if it has one, and how large.
    fn spot_of(&self, answer: &Hypothesis) -> Option<(Axis, [f64; 2], f64)> {
        answer.fit.at.iter().find_map(|&(axis, value)| Some((axis, self.variants[axis.variant].place()?, value)))
    }

    /// Whether a spot was simulated where it is, as near as the data tell; what is none is not asked for.
    fn knows_spot(&self, Place { axis, value, std_dev }: Place) -> bool {
        let variant = &self.variants[axis.variant];
        let plausible = variant.coordinates[axis.coordinate].std_dev;
        let near = (std_dev / plausible).clamp(NEAREST, NEAR_FOR_SPOTS) * plausible;
        variant.place().is_none() || self.surrogate.nearest_node(axis, value, &self.variants) <= near
    }

    /// The nearest other spot that the same answer was simulated with where it is best: what is likely goes along both.
    fn spot_beside(&self, ranking: &Ranking, answer: &Hypothesis) -> Option<([f64; 2], f64)> {
        let (_, place, _) = self.spot_of(answer)?;
        let rest = |h: &Hypothesis| -> Set {
            h.set.iter().copied().filter(|&index| self.variants[index].place().is_none()).collect()
        };
        let alike =
            ranking.hypotheses.iter().filter(|h| places(h).all(|it| self.knows_spot(it)) && rest(h) == rest(answer));
        let others = alike.filter_map(|h| self.spot_of(h)).filter(|(_, other, _)| *other != place);
        let nearest =
            others.min_by(|(_, a, _), (_, b, _)| spots::distance(*a, place).total_cmp(&spots::distance(*b, place)));
        nearest.map(|(_, place, value)| (place, value))
    }

    /// Simulates the leading answers where they are best, and the causes of the best together; whether anything was.
    pub(super) fn refine(&mut self, ranking: &Ranking) -> Result<bool, DiagnoseError> {
        // What a model that was moved far lets a cause do is seen where the cause is, not where it was simulated at first.
        let moved = singles(ranking).filter(|_| self.was_moved());
        let wanted = leading(ranking).chain(self.large(ranking)).chain(moved);
        let refined = self.refine_at(&wanted.flat_map(|h| places(h).chain(opposite(h))).collect::<Vec<_>>());
        let coupled = self.couple(&ranking.best().fit.at)?;
        Ok(self.couple_rivals(ranking) || coupled || refined)
    }

    /// Simulates together what answers hold that have one other cause than the best: against what strong causes do together, that of
    /// others is no match as long as it is taken for a sum. Whether anything was; what cannot be driven is no rival.
    fn couple_rivals(&mut self, ranking: &Ranking) -> bool {
        let best = ranking.best();
        let effects = |set: &Set| verdict::ids(set, &self.variants);
        let of_best = effects(&best.set);
        let is_rival = |h: &&Hypothesis| {
            let is_near = h.log_posterior > best.log_posterior - OF_A_SUM;
            let is_other = h.set.len() == best.set.len() && h.set != best.set;
            is_near && is_other && effects(&h.set).iter().filter(|id| !of_best.contains(id)).count() <= 1
        };
        let rivals: Vec<Vec<(Axis, f64)>> =
            ranking.hypotheses.iter().filter(is_rival).take(RIVALS).map(|h| h.fit.at.clone()).collect();
        let (surrogate, bench) = self.bench();
        let mut any = false;
        for rival in &rivals {
            any |= surrogate.couple(bench, rival).unwrap_or(false);
        }
        any
    }

    /// Simulates all that is in an answer at once, or, where pairs are all that there is to it, those; whether anything was.
    fn as_a_whole(&mut self, answer: &[(Axis, f64)]) -> Result<bool, DiagnoseError> {
        if !self.surrogate.is_more_than_pairs(&self.variants, answer) {
            return self.couple(answer);
        }
        let (surrogate, bench) = self.bench();
        Ok(surrogate.couple_all(bench, answer)?)
    }

    /// Simulates the causes of an answer together; where the robot cannot be driven so, with the farthest of them, or else all, as
    /// near as they have to be, which is as far as their axes go from then on. Whether anything was simulated.
    pub(super) fn couple(&mut self, answer: &[(Axis, f64)]) -> Result<bool, DiagnoseError> {
        let (surrogate, bench) = self.bench();
        let failed = match surrogate.couple(bench, answer) {
            Ok(any) => return Ok(any),
            Err(failed) => failed,
        };
        let from_plausible = |index: usize| {
            let (axis, value) = answer[index];
            value.abs() / self.variants[axis.variant].coordinates[axis.coordinate].std_dev
        };
        let mut simulated: Vec<usize> =
            (0..answer.len()).filter(|&index| is_simulated(&self.variants[answer[index].0.variant])).collect();
        simulated.sort_by(|&a, &b| from_plausible(b).total_cmp(&from_plausible(a)));
        let (farthest, all) = (simulated.get(..1), simulated.get(..).filter(|all| all.len() > 1));
        for reduced in farthest.into_iter().chain(all) {
            let (surrogate, bench) = self.bench();
            let mut at = answer.to_vec();
            let share = as_far_as(1.0, |share| {
                reduced.iter().for_each(|&index| at[index].1 = share * answer[index].1);
                surrogate.couple(bench, &at).is_ok()
            });
            if share > 0.0 {
                for &index in reduced {
                    let (axis, value) = answer[index];
                    self.end_at(axis, value, share * value);
                }
                return Ok(true);
            }
        }
        Err(failed.into())
    }

    /// Simulates the leading answers where they are best and on tyres that are other than the model's in what is in doubt of
    /// them; whether any was.
    fn refine_on_tyres(&mut self, ranking: &Ranking) -> Result<bool, DiagnoseError> {
        if !self.variants.iter().any(|variant| variant.tyre_part().is_some()) {
            return Ok(false);
        }
        let mut refined = self.refine(ranking)?;
        let (surrogate, bench) = self.bench();
        for answer in leading(ranking) {
            // What a robot would do that cannot be driven so is not asked.
            refined |= surrogate.couple_with_tyres(bench, &answer.fit.at).unwrap_or(false);
        }
        Ok(refined)
    }

    /// Simulates axes where they are, each once; whether any was far from what is known.
    pub(super) fn refine_at(&mut self, places: &[Place]) -> bool {
        let mut wanted: Vec<Place> = Vec::new();
        for place in places {
            // What does much the same on both sides of 0 is told apart only where both are exact.
            let is_even = self.surrogate.is_even(place.axis);
            let is_there = |it: &Place| it.axis == place.axis && (!is_even || it.value * place.value > 0.0);
            if !self.is_known(*place) && !wanted.iter().any(is_there) {
                wanted.push(*place);
            }
        }
        for place in &wanted {
            self.refine_one(place.axis, place.value);
        }
        !wanted.is_empty()
    }

    /// Leaves an answer best that was simulated as a whole, where it leaves least so.
    pub(super) fn keep_promises(&mut self, ranking: &mut Ranking) {
        let mut settled: Vec<Set> = Vec::new();
        while settled.len() < AS_A_WHOLE && !settled.contains(&ranking.best().set) {
            settled.push(ranking.best().set.clone());
            self.settle(ranking);
            // What promises as much and was never simulated is no answer.
            let as_good = ranking.best().log_posterior - verdict::CONVINCING;
            let is_one =
                |h: &Hypothesis| h.log_posterior < as_good || self.surrogate.knows_of_all(&self.variants, &h.fit.at);
            ranking.hypotheses.retain(is_one);
            ranking.sort();
        }
    }

    /// Takes the best to where, simulated as a whole, it leaves least: to where it is best by what was simulated last, or, where
    /// it turns out to leave more there, halfway back.
    fn settle(&mut self, ranking: &mut Ranking) {
        let axes = search::axes_of(&self.variants, &ranking.best().set);
        let mut at = ranking.best().fit.at.clone();
        let mut least: Option<(f64, Vec<(Axis, f64)>)> = None;
        for _ in 0..AS_A_WHOLE {
            if !self.as_a_whole(&at).unwrap_or(false) {
                break;
            }
            let problem = self.problem(self.counts.clone());
            let cost = problem.cost(&at);
            match &least {
                Some((of_least, best)) if cost > *of_least => {
                    for ((_, value), (_, best)) in at.iter_mut().zip(best) {
                        *value = 0.5 * (*value + best);
                    }
                }
                _ => {
                    let gained = least.as_ref().map_or(f64::INFINITY, |(before, _)| before - cost);
                    least = Some((cost, at.clone()));
                    // A cost is −2 ln of what it takes from the evidence.
                    if gained < 2.0 * WORTH_A_ROUND {
                        break;
                    }
                    at = problem.fit(&axes, &at).at;
                }
            }
        }
        if let Some((_, best)) = least {
            let _ = self.as_a_whole(&best);
            ranking.move_best(&self.problem(self.counts.clone()), best);
        }
    }

    /// Whether an answer was simulated where it is, each axis and all of it at once.
    pub(super) fn is_exact(&self, answer: &Hypothesis) -> bool {
        places(answer).all(|place| self.is_known(place)) && self.surrogate.knows_all(&self.variants, &answer.fit.at)
    }

    /// Whether an axis was simulated about there, if it has to be: of a large cause, which was simulated here and there only, and of
    /// one that does not go on as it begins, as near as the data tell.
    fn is_known(&self, Place { axis, value, std_dev }: Place) -> bool {
        let variant = &self.variants[axis.variant];
        let plausible = variant.coordinates[axis.coordinate].std_dev;
        let near = match variant.place() {
            Some(_) => NEAR_FOR_SPOTS,
            None if value.abs() > LARGE * plausible || self.surrogate.is_wavy(axis) => {
                (std_dev / plausible).clamp(NEAREST, NEAR)
            }
            None => NEAR,
        };
        !is_simulated(variant) || self.surrogate.nearest_node(axis, value, &self.variants) <= near * plausible
    }

    /// Simulates an axis at a value; where the robot cannot be driven there, as far as it can be, which is as far as the axis
    /// goes from then on.
    fn refine_one(&mut self, axis: Axis, value: f64) {
        let (surrogate, bench) = self.bench();
        if surrogate.refine(bench, axis, value).is_ok() {
            return;
        }
        let drives = as_far_as(value, |value| surrogate.refine(bench, axis, value).is_ok());
        self.end_at(axis, value, drives);
    }

    /// Lets an axis go as far as the robot `drives` on the side of a value that is too far, and no farther.
    fn end_at(&mut self, axis: Axis, too_far: f64, drives: f64) {
        self.variants[axis.variant].coordinates[axis.coordinate].bounds[usize::from(too_far > 0.0)] = drives;
    }

    /// The leading ones of single causes that are so large that what they do was a guess at first. Against a guess, several
    /// causes that are better known fit better.
    fn large<'r>(&self, ranking: &'r Ranking) -> impl Iterator<Item = &'r Hypothesis> {
        let is_large = |&(axis, value): &(Axis, f64)| {
            let variant = &self.variants[axis.variant];
            is_simulated(variant) && value.abs() > LARGE * variant.coordinates[axis.coordinate].std_dev
        };
        singles(ranking).filter(move |h| h.fit.at.iter().any(is_large)).take(LEADING)
    }

    /// Answers that a search, which begins near 0, may not come to: where causes are large, and where they may act otherwise
    /// than the model has them.
    fn worth_another_look(&self, ranking: &Ranking) -> Vec<Hypothesis> {
        let leading = ranking.hypotheses.iter().take(search::LEADING).chain(singles(ranking));
        let moved = leading.chain([ranking.nothing()]).filter(|_| self.was_moved());
        moved.chain(self.large(ranking)).cloned().collect()
    }

    /// The stand-in, and all that it simulates.
    fn bench(&mut self) -> (&mut Surrogate, Bench<'_>) {
        let Study { model, cases, clusters, variants, surrogate, .. } = self;
        (surrogate, Bench { model, cases, clusters, variants })
    }
}

/// How far towards `value`, which is too far, the robot can be driven.
fn as_far_as(value: f64, mut drives: impl FnMut(f64) -> bool) -> f64 {
    let (mut near, mut far) = (0.0, value);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (near + far);
        *(if drives(middle) { &mut near } else { &mut far }) = middle;
    }
    near
}

/// Whether a variant is simulated where it is: what is in doubt moves little against what its effect was simulated at.
fn is_simulated(variant: &Variant) -> bool {
    !variant.effect.is_survey() && !variant.is_doubted()
}

/// Whether another round would hardly say anything else: the best is hardly better than the best before, and what leads is
/// worth what it was.
pub(super) fn is_settled(before: &Ranking, now: &Ranking) -> bool {
    let is_moved =
        |h: &Hypothesis| before.of(&h.set).is_some_and(|it| (it.log_posterior - h.log_posterior).abs() > WORTH_A_ROUND);
    now.best().log_posterior < before.best().log_posterior + WORTH_A_ROUND && !leading(now).any(is_moved)
}

/// Where an answer is best.
fn places(answer: &Hypothesis) -> impl Iterator<Item = Place> {
    let std_dev = |index| answer.fit.covariance[(index, index)].sqrt();
    answer.fit.at.iter().enumerate().map(move |(index, &(axis, value))| Place { axis, value, std_dev: std_dev(index) })
}

/// Where it is best on the other side of 0.
fn opposite(answer: &Hypothesis) -> impl Iterator<Item = Place> {
    answer.opposite.iter().map(|&(axis, value)| Place { axis, value, std_dev: f64::INFINITY })
}

/// Answers of one cause.
fn singles(ranking: &Ranking) -> impl Iterator<Item = &Hypothesis> {
    let alone = ranking.nothing().set.len() + 1;
    ranking.hypotheses.iter().filter(move |h| h.set.len() == alone)
}

/// Answers that are worth simulating where they are best.
fn leading(ranking: &Ranking) -> impl Iterator<Item = &Hypothesis> {
    let best = ranking.best().log_posterior;
    ranking.hypotheses.iter().take(LEADING).filter(move |h| h.log_posterior > best - 12.0)
}
