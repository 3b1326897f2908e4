//! Where no known cause takes a misfit away: what stands out of what is left, be it causes or a formula.

use super::refine::{self, LONG_LIST, Place};
use super::search::{self, Hypothesis, Ranking};
use super::variant::Axis;
use super::{ForwardModel, Study, verdict};
use std::collections::BTreeSet;

/// Terms of a formula.
const MOST_TERMS: usize = 4;
/// Size that no empirical term may have, in units of what is plausible: half of the speed is no misfit but another robot.
const LARGEST_TERM: f64 = 50.0;
/// How much less sharply a cause may be told beside a formula than without it, in σ: a term that does much the same as a known
/// cause would stand in its place and move it anywhere.
const BLURRED: f64 = 2.0;
/// Times that causes beside a formula are simulated where they are best, with it.
const TOGETHER: usize = 8;
/// Such times in a row after which answers that keep no more are looked for no longer.
const IN_VAIN: usize = 2;
/// Formulas that are tried, where what the first ones promised was not kept.
const FORMULAS: usize = 4;
/// Times that the dispersion of the runs' means is taken anew from what the best answer leaves.
const ANNEALINGS: usize = 3;
/// Share of what was left before, from which on what is left is as much.
const STEADY: f64 = 0.8;

impl Study<'_> {
    /// The ranking as it is, or, where that leaves much, one of what stands out of a dispersion of the runs' means as large as
    /// what is left, be it causes or a formula.
    pub(super) fn explained(&mut self, known: Ranking) -> Ranking {
        if !verdict::leaves_much(self, known.best()) {
            return self.with_formula(known);
        }
        let mut ranking = known;
        let mut discrepancy = self.discrepancy_of(ranking.best());
        for _ in 0..ANNEALINGS {
            self.discrepancy = discrepancy;
            let mut known = self.search(&self.known_variants(), &[]);
            self.keep_promises(&mut known);
            ranking = self.with_formula(known);
            discrepancy = self.discrepancy_of(ranking.best());
            if discrepancy > STEADY * self.discrepancy {
                break;
            }
        }
        ranking
    }

    /// Variance of runs' means, over what noise makes of it, under which what an answer leaves is likeliest.
    fn discrepancy_of(&self, answer: &Hypothesis) -> f64 {
        let problem = self.problem_of(&self.noise, self.model.scene().robot.doubt, self.counts.clone());
        problem.left_of_means(&answer.fit.at).max(1.0)
    }

    /// The ranking as it is, or, where a formula takes away what known causes leave, one of causes beside
    /// the terms of that formula.
    fn with_formula(&mut self, known: Ranking) -> Ranking {
        let mut best = known.clone();
        let mut tried: Vec<BTreeSet<Axis>> = Vec::new();
        for _ in 0..FORMULAS {
            let Some(mut formula) = self.next_formula(&known, &best, &tried) else { break };
            // Terms are simulated as they are found.
            let places = formula.iter().map(|&(axis, value)| Place { axis, value, std_dev: f64::INFINITY });
            if self.refine_at(&places.collect::<Vec<_>>()) {
                let Some(again) = self.next_formula(&known, &best, &tried) else { break };
                formula = again;
            }
            tried.push(formula.iter().map(|(axis, _)| *axis).collect());
            let explained = self.beside_simulated(formula);
            if explained.best().log_posterior > best.best().log_posterior + verdict::REAL {
                best = explained;
            }
        }
        best
    }

    /// Terms of the best formula that was not tried and promises more than the best so far keeps.
    fn next_formula(&self, known: &Ranking, best: &Ranking, tried: &[BTreeSet<Axis>]) -> Option<Vec<(Axis, f64)>> {
        let kept = best.best().log_posterior + verdict::REAL;
        let formulas = self.formulas(known).into_iter().take_while(|h| h.log_posterior > kept);
        let mut terms = formulas.map(|it| self.terms_of(&it));
        terms.find(|terms| {
            let axes = terms.iter().map(|(axis, _)| *axis).collect();
            !terms.is_empty() && !tried.contains(&axes)
        })
    }

    /// Causes by evidence beside the terms of a formula, simulated with it until the best is what it is said to be: causes are
    /// elsewhere there than without it, and many promise more than they keep. What cannot be driven there is seen when the
    /// answer is judged.
    fn beside_simulated(&mut self, mut formula: Vec<(Axis, f64)>) -> Ranking {
        formula.extend(search::doubted(&self.variants));
        // The formula alone stays what answers are measured by.
        let _ = self.couple(&formula);
        let (allowed, most) = (self.known_variants(), self.options.most_causes);
        let mut ranking = Ranking::search_on(&self.problem(self.counts.clone()), &formula, &allowed, most);
        let (mut kept, mut in_vain) = (f64::NEG_INFINITY, 0);
        for _ in 0..TOGETHER {
            if in_vain == IN_VAIN || !matches!(self.refine(&ranking), Ok(true)) {
                break;
            }
            let before = ranking.clone();
            ranking.look_on(&self.problem(self.counts.clone()), &allowed, most);
            if self.is_exact(ranking.best()) && refine::is_settled(&before, &ranking) {
                break;
            }
            let keeps = ranking.of(&before.best().set).map_or(f64::NEG_INFINITY, |h| h.log_posterior);
            in_vain = if keeps > kept + verdict::REAL { 0 } else { in_vain + 1 };
            kept = kept.max(keeps);
        }
        let is_simulated = |h: &Hypothesis| self.surrogate.knows_of_all(&self.variants, &h.fit.at);
        if let Some(first) = ranking.hypotheses.iter().position(is_simulated) {
            ranking.hypotheses.drain(..first);
        }
        self.keep_promises(&mut ranking);
        ranking
    }

    /// The terms of a formula, without the causes beside it.
    fn terms_of(&self, formula: &Hypothesis) -> Vec<(Axis, f64)> {
        formula.fit.at.iter().filter(|(axis, _)| self.variants[axis.variant].is_term()).copied().collect()
    }

    /// The formula that serves best, if any does.
    pub(super) fn formula(&self, known: &Ranking) -> Option<Hypothesis> {
        self.formulas(known).into_iter().next().filter(|it| !self.terms_of(it).is_empty())
    }

    /// Formulas, alone or beside the best known causes, that are clearly better than those, best first. A misfit below what
    /// noise alone makes has no room for one, unless many causes took it there: one term may do what they do together.
    fn formulas(&self, known: &Ranking) -> Vec<Hypothesis> {
        let best = known.best();
        let readings: f64 =
            self.observed.iter().zip(&self.counts).map(|(observed, count)| observed.len() as f64 * count).sum();
        let leaves_room = best.fit.chi2 >= readings;
        let causes = best.set.iter().filter(|&&index| self.variants[index].is_cause()).count();
        if !leaves_room && causes < LONG_LIST {
            return Vec::new();
        }
        let terms: Vec<usize> = (0..self.variants.len()).filter(|&index| self.variants[index].is_term()).collect();
        let problem = self.problem(self.counts.clone());
        let mut formulas = Ranking::search(&problem, &terms, if leaves_room { MOST_TERMS } else { 1 });
        if leaves_room && !best.set.is_empty() {
            let beside = Ranking::search_on(&problem, &best.fit.at, &terms, MOST_TERMS);
            formulas.hypotheses.extend(beside.hypotheses);
        }
        let is_large = |&(axis, value): &(Axis, f64)| {
            self.variants[axis.variant].is_term()
                && value.abs() > LARGEST_TERM * self.variants[axis.variant].coordinates[0].std_dev
        };
        let is_blurred = |h: &Hypothesis, axis: Axis| {
            let [with, without] = [h, best].map(|h| h.fit.std_dev(axis));
            self.variants[axis.variant].is_cause() && with > without.map(|it| BLURRED * it)
        };
        let blurs = |h: &Hypothesis| best.fit.at.iter().any(|(axis, _)| is_blurred(h, *axis));
        formulas.hypotheses.retain(|h| !h.fit.at.iter().any(is_large) && !blurs(h));
        formulas.sort();
        formulas.hypotheses.retain(|h| h.log_posterior > best.log_posterior + verdict::REAL);
        formulas.hypotheses
    }
}
