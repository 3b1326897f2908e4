//! Where no known cause takes a misfit away: a formula of the body's twist, beside known causes or alone.

use super::refine::{self, LONG_LIST, Place};
use super::search::{self, Hypothesis, Ranking};
use super::variant::Axis;
use super::{Study, verdict};

/// Terms of a formula.
const MOST_TERMS: usize = 4;
/// Size that no empirical term may have, in units of what is plausible: a tenth of the speed is no misfit but another robot.
const LARGEST_TERM: f64 = 10.0;
/// How much less sharply a cause may be told beside a formula than without it, in σ: a term that does much the same as a known
/// cause would stand in its place and move it anywhere.
const BLURRED: f64 = 2.0;
/// Times that causes beside a formula are simulated where they are best, with it.
const TOGETHER: usize = 3;

impl Study<'_> {
    /// The ranking as it is, or, where a formula of the body's twist takes away what known causes leave, one of causes beside
    /// the terms of that formula.
    pub(super) fn explained(&mut self, known: Ranking) -> Ranking {
        let Some(mut formula) = self.formula(&known).map(|it| self.terms_of(&it)) else { return known };
        // Terms are simulated as they are found.
        let places = formula.iter().map(|&(axis, value)| Place { axis, value, std_dev: f64::INFINITY });
        if self.refine_at(&places.collect::<Vec<_>>()) {
            let Some(again) = self.formula(&known) else { return known };
            formula = self.terms_of(&again);
        }
        formula.extend(search::doubted(&self.variants));
        let mut ranking = self.beside(&formula);
        // Beside a formula causes are elsewhere than without it, and what they do there with it was not simulated yet. What
        // cannot be driven there is seen when the answer is judged.
        for _ in 0..TOGETHER {
            if !matches!(self.refine(&ranking), Ok(true)) {
                break;
            }
            let before = ranking;
            ranking = self.beside(&formula);
            if refine::is_settled(&before, &ranking) {
                break;
            }
        }
        ranking
    }

    /// Causes by evidence beside the terms of a formula.
    fn beside(&self, formula: &[(Axis, f64)]) -> Ranking {
        let problem = self.problem(self.counts.clone());
        Ranking::search_on(&problem, formula, &self.known_variants(), self.options.most_causes)
    }

    /// The terms of a formula, without the causes beside it.
    fn terms_of(&self, formula: &Hypothesis) -> Vec<(Axis, f64)> {
        formula.fit.at.iter().filter(|(axis, _)| self.variants[axis.variant].is_term()).copied().collect()
    }

    /// The formula that serves best, alone or beside the best known causes, where it is clearly better than they. A misfit below
    /// what noise alone makes has no room for one, unless many causes took it there: one term may do what they do together.
    pub(super) fn formula(&self, known: &Ranking) -> Option<Hypothesis> {
        let best = known.best();
        let readings: f64 =
            self.observed.iter().zip(&self.counts).map(|(observed, count)| observed.len() as f64 * count).sum();
        let leaves_room = best.fit.chi2 >= readings;
        let causes = best.set.iter().filter(|&&index| self.variants[index].is_cause()).count();
        if !leaves_room && causes < LONG_LIST {
            return None;
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
        let formula = formulas.hypotheses.into_iter().next()?;
        let serves = formula.log_posterior > best.log_posterior + verdict::REAL;
        (serves && !self.terms_of(&formula).is_empty()).then_some(formula)
    }
}
