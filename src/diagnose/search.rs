//! Which causes: none, one or several, by their evidence and what is plausible beforehand.

use super::fit::Fit;
use super::linear::{self, Problem};
use super::plausible::Plausible;
use super::variant::{Axis, Variant};
use super::verdict;
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Chance beforehand that nothing is wrong, and that so many causes are at work at once: a robot that has so many has another
/// one by this chance.
const NOTHING: f64 = 0.25;
const FURTHER: f64 = 0.2;

/// A set of candidate causes.
pub(super) type Set = BTreeSet<usize>;

/// A hypothesis with its evidence.
#[derive(Debug, Clone)]
pub(super) struct Hypothesis {
    /// Indices of its variants.
    pub set: Set,
    pub fit: Fit,
    /// Logarithm of evidence times prior.
    pub log_posterior: f64,
    /// Where it is best on the other side of 0, of a cause that does much the same on both.
    pub opposite: Vec<(Axis, f64)>,
}

impl Hypothesis {
    /// A set at its best, looked for from `start` on.
    fn of(problem: &Problem<'_>, set: &Set, start: &[(Axis, f64)]) -> Hypothesis {
        let fit = problem.fit(&axes_of(problem.variants, set), start);
        let log_posterior = fit.log_evidence + log_prior(problem.variants, set);
        Hypothesis { set: set.clone(), fit, log_posterior, opposite: Vec::new() }
    }

    /// A set at its best, looked for from where each promise of it says.
    fn promised(problem: &Problem<'_>, promise: &Promise) -> Hypothesis {
        let mut found: Vec<Hypothesis> =
            promise.starts.iter().map(|start| Hypothesis::of(problem, &promise.set, start)).collect();
        found.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
        let mut found = found.into_iter();
        let best = found.next().expect("it begins somewhere");
        let is_across = |other: &Hypothesis| {
            let values = other.fit.at.iter().zip(&best.fit.at);
            values.clone().any(|((axis, a), (_, b))| problem.surrogate.is_even(*axis) && a * b < 0.0)
        };
        let opposite = found.find(is_across).map(|other| other.fit.at).unwrap_or_default();
        Hypothesis { opposite, ..best }
    }
}

/// Everything that was looked at, best first.
#[derive(Debug, Clone)]
pub(super) struct Ranking {
    pub hypotheses: Vec<Hypothesis>,
}

/// How far a hypothesis may lie behind the best one and still be worth going on from.
const WORTH: f64 = 12.0;
/// The same of what is looked at beside the best.
const BESIDE: f64 = 6.0;
/// How many are gone on from.
const BEAM: usize = 4;
/// How many besides, that differ from those by a wheel or a place.
const ALIKE: usize = 2;
/// Sets of several causes that are fitted at each size.
const PROMISES: usize = 24;
/// Linear looks from each: what is plausible is no normal law.
const LOOKS: usize = 2;
/// Answers of a search that are looked at again where more is known.
pub(super) const LEADING: usize = 20;
/// Spots on the floor that are looked at closely from each.
const SPOTS: usize = 6;

pub(super) fn axes_of(variants: &[Variant], set: &Set) -> Vec<Axis> {
    set.iter()
        .flat_map(|&variant| {
            (0..variants[variant].coordinates.len()).map(move |coordinate| Axis { variant, coordinate })
        })
        .collect()
}

/// Chance beforehand that what is wrong is not in the catalogue.
const UNKNOWN: f64 = 0.03;

/// ln of the prior of a set: causes are alike likely, and so are the wheels or sides of one.
pub(super) fn log_prior(variants: &[Variant], set: &Set) -> f64 {
    let terms: Set = set.iter().copied().filter(|&index| variants[index].is_term()).collect();
    let causes: Set = set.iter().copied().filter(|&index| variants[index].is_cause()).collect();
    if !terms.is_empty() {
        // Each further term of a formula is as likely as any other.
        let all = variants.iter().filter(|variant| variant.is_term()).count() as f64;
        let of_causes = if causes.is_empty() { 0.0 } else { log_prior(variants, &causes) };
        return of_causes + UNKNOWN.ln() - terms.len() as f64 * all.ln();
    }
    if causes.is_empty() {
        return NOTHING.ln();
    }
    let mut of_effect: BTreeMap<&str, usize> = BTreeMap::new();
    for variant in variants.iter().filter(|variant| variant.is_cause()) {
        *of_effect.entry(variant.effect.id).or_default() += 1;
    }
    let effects = of_effect.len() as f64;
    let rarity = (1.0 - NOTHING).ln() + (causes.len() - 1) as f64 * FURTHER.ln();
    rarity - causes.iter().map(|&index| (effects * of_effect[variants[index].effect.id] as f64).ln()).sum::<f64>()
}

impl Ranking {
    /// Searches sets of up to `most` causes among `allowed` variants, besides what is in doubt of the model.
    pub fn search(problem: &Problem<'_>, allowed: &[usize], most: usize) -> Ranking {
        Ranking::search_on(problem, &doubted(problem.variants), allowed, most)
    }

    /// Searches sets of what moves along the axes of `base`, which begin where it says, and up to `most` of the `allowed`
    /// variants besides.
    pub fn search_on(problem: &Problem<'_>, base: &[(Axis, f64)], allowed: &[usize], most: usize) -> Ranking {
        let mut known: BTreeMap<Set, Hypothesis> = BTreeMap::new();
        let always: Set = base.iter().map(|(axis, _)| axis.variant).collect();
        known.insert(always.clone(), Hypothesis::of(problem, &always, base));
        for size in 1..=most {
            let mut seeds: Vec<&Hypothesis> =
                known.values().filter(|h| h.set.len() == always.len() + size - 1).collect();
            seeds.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
            let mut known_effects: BTreeSet<Vec<&str>> = BTreeSet::new();
            let is_other = |seed: &&Hypothesis| known_effects.insert(verdict::ids(&seed.set, problem.variants));
            let (mut seeds, mut alike): (Vec<_>, Vec<_>) = seeds.into_iter().partition(is_other);
            seeds.truncate(BEAM);
            alike.truncate(ALIKE);
            seeds.extend(alike);
            // What one more cause promises, by a linear look from each seed.
            let promises: Vec<Promise> = seeds.par_iter().flat_map(|seed| promises(problem, allowed, seed)).collect();
            let best_so_far = known.values().map(|h| h.log_posterior).fold(f64::NEG_INFINITY, f64::max);
            // Each cause alone is always looked at.
            let mut wanted = best_of_each(promises, |promise| {
                (size == 1 || promise.log_posterior >= best_so_far - WORTH) && !known.contains_key(&promise.set)
            });
            if size > 1 {
                // A bad seed promises much: what the best one promises is looked at in any case.
                let best = seeds[0].set.clone();
                let mut of_best = 0;
                let mut all = 0;
                wanted.retain(|promise| {
                    of_best += usize::from(promise.set.is_superset(&best));
                    all += 1;
                    all <= PROMISES || (promise.set.is_superset(&best) && of_best <= PROMISES / 2)
                });
            }
            let level: Vec<Hypothesis> =
                wanted.par_iter().map(|promise| Hypothesis::promised(problem, promise)).collect();
            let best_of_level = level.iter().map(|h| h.log_posterior).fold(f64::NEG_INFINITY, f64::max);
            known.extend(level.into_iter().map(|hypothesis| (hypothesis.set.clone(), hypothesis)));
            if size > 1 && best_of_level < best_so_far - 3.0 {
                break;
            }
        }
        let mut ranking = Ranking { hypotheses: known.into_values().collect() };
        ranking.sort();
        ranking.look_at_fewer(problem);
        ranking.look_beside(problem, allowed, most);
        ranking
    }

    /// What the best found on its way may serve fewer causes better than where they were begun from.
    fn look_at_fewer(&mut self, problem: &Problem<'_>) {
        loop {
            let (best, always) = (self.best(), &self.nothing().set);
            let fewer: Vec<Set> = best
                .set
                .difference(always)
                .map(|&cause| best.set.iter().copied().filter(|&other| other != cause).collect())
                .collect();
            let fewer: Vec<Hypothesis> =
                fewer.par_iter().map(|set| Hypothesis::of(problem, set, &best.fit.at)).collect();
            let before = best.log_posterior;
            self.add(fewer);
            if self.best().log_posterior <= before {
                break;
            }
        }
    }

    /// What adds one cause at a time comes to the best set only where each step towards it pays: looks at one more, one fewer
    /// and one in another's place, until none of them is better.
    fn look_beside(&mut self, problem: &Problem<'_>, allowed: &[usize], most: usize) {
        loop {
            let (best, always) = (self.best().clone(), self.nothing().set.clone());
            let is_seed = |h: &&Hypothesis| {
                let is_part = h.set.is_subset(&best.set) && h.set.is_superset(&always);
                is_part && h.set.len() + 1 >= best.set.len() && h.set.len() < always.len() + most
            };
            let seeds: Vec<&Hypothesis> = self.hypotheses.iter().filter(is_seed).collect();
            let promises: Vec<Promise> = seeds.par_iter().flat_map(|seed| promises(problem, allowed, seed)).collect();
            let mut wanted = best_of_each(promises, |promise| {
                promise.log_posterior >= best.log_posterior - BESIDE && self.of(&promise.set).is_none()
            });
            wanted.truncate(PROMISES);
            let found = wanted.par_iter().map(|promise| Hypothesis::promised(problem, promise)).collect();
            self.add(found);
            if self.best().log_posterior <= best.log_posterior {
                break;
            }
            self.look_at_fewer(problem);
        }
    }

    /// Looks from where answers of an earlier search were best, too: what was simulated there since may have moved them away
    /// from where a search begins.
    pub fn look_again(&mut self, problem: &Problem<'_>, earlier: &[Hypothesis]) {
        self.add(earlier.par_iter().map(|h| Hypothesis::of(problem, &h.set, &h.fit.at)).collect());
        self.look_at_fewer(problem);
    }

    /// Looks at the leading answers and at none anew, where more was simulated of them.
    pub fn look_anew(&mut self, problem: &Problem<'_>) {
        self.look_anew_within(problem, 0.0);
    }

    /// The same of all that lie so little behind the best, too, where what was simulated may move each of them by as much.
    pub fn look_anew_within(&mut self, problem: &Problem<'_>, window: f64) {
        let (nothing, worst) = (self.nothing().set.clone(), self.best().log_posterior - window);
        let is_due =
            |(rank, h): &(usize, &mut Hypothesis)| *rank < LEADING || h.log_posterior > worst || h.set == nothing;
        let due = self.hypotheses.par_iter_mut().enumerate().filter(is_due);
        due.for_each(|(_, h)| *h = Hypothesis::of(problem, &h.set, &h.fit.at));
        self.sort();
        self.look_at_fewer(problem);
    }

    /// Goes on where more was simulated of what leads, from where that was best.
    pub fn look_on(&mut self, problem: &Problem<'_>, allowed: &[usize], most: usize) {
        self.look_anew(problem);
        self.look_beside(problem, allowed, most);
    }

    /// Takes the best, which stays the best, to where it was simulated.
    pub fn move_best(&mut self, problem: &Problem<'_>, at: Vec<(Axis, f64)>) {
        let best = &mut self.hypotheses[0];
        let fit = problem.evidence(&axes_of(problem.variants, &best.set), at.clone());
        let log_posterior = fit.log_evidence + log_prior(problem.variants, &best.set);
        *best = Hypothesis { fit: Fit { at, ..fit }, log_posterior, ..best.clone() };
    }

    /// Adds what is new or better.
    fn add(&mut self, all: Vec<Hypothesis>) {
        for found in all {
            match self.hypotheses.iter_mut().find(|h| h.set == found.set) {
                Some(known) if known.log_posterior >= found.log_posterior => {}
                Some(known) => *known = found,
                None => self.hypotheses.push(found),
            }
        }
        self.sort();
    }

    /// That of a set, if it was looked at.
    pub fn of(&self, set: &Set) -> Option<&Hypothesis> {
        self.hypotheses.iter().find(|h| h.set == *set)
    }

    /// Best first.
    pub fn sort(&mut self) {
        self.hypotheses.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior).then_with(|| a.set.cmp(&b.set)));
    }

    /// The best.
    pub fn best(&self) -> &Hypothesis {
        &self.hypotheses[0]
    }

    /// That of no cause.
    pub fn nothing(&self) -> &Hypothesis {
        self.hypotheses.iter().min_by_key(|h| h.set.len()).expect("nothing is always looked at")
    }
}

/// The axes of what is in doubt of the model.
pub(super) fn doubted(variants: &[Variant]) -> Vec<(Axis, f64)> {
    let indices = (0..variants.len()).filter(|&index| variants[index].is_doubted());
    indices.map(|variant| (Axis { variant, coordinate: 0 }, 0.0)).collect()
}

/// What a linear look expects of a set.
struct Promise {
    log_posterior: f64,
    set: Set,
    /// Where to begin its fit: on each side of 0, where what is new in it does much the same on both, and all along what does not go
    /// on as it begins.
    starts: Vec<Vec<(Axis, f64)>>,
}

/// The best promise of each set among those that are `worth` it, best first.
fn best_of_each(promises: Vec<Promise>, worth: impl Fn(&Promise) -> bool) -> Vec<Promise> {
    let mut of_set: BTreeMap<Set, Promise> = BTreeMap::new();
    for promise in promises.into_iter().filter(worth) {
        if of_set.get(&promise.set).is_none_or(|other| promise.log_posterior > other.log_posterior) {
            of_set.insert(promise.set.clone(), promise);
        }
    }
    let mut best: Vec<Promise> = of_set.into_values().collect();
    best.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
    best
}

/// What `seed` and one more variant each promise, by a linear look from the seed's best coordinates. Of spots on the floor,
/// which are many, the most promising.
fn promises(problem: &Problem<'_>, allowed: &[usize], seed: &Hypothesis) -> Vec<Promise> {
    let variants = problem.variants;
    // The catalogue knows one spot; with several, any floor could be painted.
    let has_spot = seed.set.iter().any(|&index| variants[index].place().is_some());
    let fits = |&index: &usize| !(seed.set.contains(&index) || has_spot && variants[index].place().is_some());
    let others: Vec<usize> = allowed.iter().copied().filter(fits).collect();
    let looks = |index: usize| {
        let axes = axes_of(variants, &Set::from([index]));
        axes.into_iter().map(|axis| problem.looks(axis).len()).max().unwrap_or(0)
    };
    let adds_spot = |set: &Set| set.difference(&seed.set).any(|&index| variants[index].place().is_some());
    let mut all = promises_beside(problem, &others, seed, 0);
    for look in 1.. {
        let more: Vec<usize> = others.iter().copied().filter(|&index| looks(index) > look).collect();
        if more.is_empty() {
            break;
        }
        for other in promises_beside(problem, &more, seed, look) {
            let promise = all.iter_mut().find(|promise| promise.set == other.set).expect("all were looked at");
            let is_spot = adds_spot(&other.set);
            match () {
                // There are many of them: each begins where it promises most.
                () if is_spot && other.log_posterior > promise.log_posterior => *promise = other,
                () if is_spot => {}
                () => {
                    promise.log_posterior = promise.log_posterior.max(other.log_posterior);
                    promise.starts.extend(other.starts);
                }
            }
        }
    }
    let of_seed = problem.cost(&seed.fit.at);
    all.par_iter_mut().for_each(|promise| {
        let new: Set = promise.set.difference(&seed.set).copied().collect();
        for axis in axes_of(variants, &new) {
            let begins_at = |value: f64| [seed.fit.at.as_slice(), &[(axis, value)]].concat();
            let begun: Vec<_> = problem.surrogate.waves(axis).into_iter().map(begins_at).collect();
            // A linear look at what does not go on as it begins says little: it promises what it takes away there.
            let least = begun.iter().map(|at| problem.cost(at)).fold(f64::INFINITY, f64::min);
            let there = seed.fit.log_evidence + 0.5 * (of_seed - least) + log_prior(variants, &promise.set);
            promise.log_posterior = promise.log_posterior.max(there);
            promise.starts.extend(begun);
        }
    });
    all.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
    let mut spots = 0;
    all.retain(|promise| {
        let is_spot = adds_spot(&promise.set);
        spots += usize::from(is_spot);
        !is_spot || spots <= SPOTS
    });
    all
}

/// What `seed` and one of `others` each promise, by one of the linear looks at it.
fn promises_beside(problem: &Problem<'_>, others: &[usize], seed: &Hypothesis, look: usize) -> Vec<Promise> {
    if others.is_empty() {
        return Vec::new();
    }
    let variants = problem.variants;
    let mut axes: Vec<Axis> = seed.fit.at.iter().map(|(axis, _)| *axis).collect();
    let own = axes.len();
    axes.extend(axes_of(variants, &others.iter().copied().collect()));
    let linear = problem.linearise_by(&seed.fit.at, &axes, look);
    let (a, b, c) = problem.normal_equations(&linear);
    let here = |axis: Axis| seed.fit.at.iter().find(|(other, _)| *other == axis).map_or(0.0, |(_, value)| *value);
    // Evidence of the seed in the same linear terms, so that what the linear look leaves out cancels.
    let linear_evidence = |columns: &[usize]| -> (f64, DVector<f64>) {
        let own: Vec<Axis> = columns.iter().map(|&column| axes[column]).collect();
        let plausible = Plausible::of(variants, &own);
        let here = DVector::from_iterator(own.len(), own.iter().map(|&axis| here(axis)));
        let (of_data, pull) = (a.select_rows(columns).select_columns(columns), b.select_rows(columns));
        let (mut step, mut evidence) = (DVector::zeros(own.len()), f64::NEG_INFINITY);
        for _ in 0..LOOKS {
            // The normal law that touches what is plausible where the last look came to, seen from here.
            let local = plausible.at(&(&here + &step));
            let off = &local.off + &step;
            let Some(factor) = Cholesky::new(&of_data + DMatrix::from_diagonal(&local.precision)) else { break };
            let right = &pull + local.precision.component_mul(&off);
            let quadratic = c + local.cost_at(&-&step);
            step = factor.solve(&right);
            let log_det = 2.0 * linear::half_log_det(&factor);
            evidence = -0.5 * (quadratic - right.dot(&step)) - 0.5 * log_det + plausible.log_peak();
        }
        (evidence, step)
    };
    let base: Vec<usize> = (0..own).collect();
    let (of_seed, _) = linear_evidence(&base);
    others
        .iter()
        .map(|&index| {
            let mut columns = base.clone();
            columns.extend((own..axes.len()).filter(|&column| axes[column].variant == index));
            let (with, solution) = linear_evidence(&columns);
            let mut set = seed.set.clone();
            set.insert(index);
            let log_posterior = seed.fit.log_evidence + with - of_seed + log_prior(variants, &set);
            let start = columns
                .iter()
                .zip(solution.iter())
                .map(|(&column, step)| {
                    let axis = axes[column];
                    let reach = variants[axis.variant].coordinates[axis.coordinate].reach;
                    (axis, here(axis) + step.clamp(-reach, reach))
                })
                .collect();
            Promise { log_posterior, set, starts: vec![start] }
        })
        .collect()
}
