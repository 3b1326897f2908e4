//! Evidence for what is asked for by name: for an oracle, which knows what to ask.

use super::Study;
use super::search::{Hypothesis, Ranking};

impl Study<'_> {
    /// Strength of the whole misfit: the root of Σ of squared whitened residuals of the model as given.
    pub fn strength(&self) -> f64 {
        let problem = self.problem(self.counts.clone());
        problem.fit(&[], &[]).chi2.sqrt()
    }

    /// ln evidence of nothing, and of every single effect at its best.
    pub fn single_evidences(&self) -> (f64, Vec<(&'static str, f64)>) {
        let ranking = Ranking::search(&self.problem(self.counts.clone()), &self.known_variants(), 1);
        let mut of_effect: Vec<(&'static str, f64)> = Vec::new();
        for hypothesis in ranking.hypotheses.iter().filter(|h| h.set.len() == 1) {
            let variant = &self.variants[*hypothesis.set.first().expect("one")];
            let id = variant.effect.id;
            // A place is one of many.
            let places = self.variants.iter().filter(|it| it.place().is_some() && it.effect == variant.effect).count();
            let log_evidence = hypothesis.fit.log_evidence - (places.max(1) as f64).ln();
            if !of_effect.iter().any(|(known, _)| *known == id) {
                of_effect.push((id, log_evidence));
            }
        }
        (ranking.nothing().fit.log_evidence, of_effect)
    }

    /// ln evidence of two effects together at their best; `None` where they are not worth a look.
    pub fn pair_evidence(&self, pair: [&str; 2]) -> Option<PairEvidence> {
        let ranking = Ranking::search(&self.problem(self.counts.clone()), &self.known_variants(), 2);
        let ids = |h: &Hypothesis| -> Vec<&str> {
            let causes = h.set.iter().map(|&index| &self.variants[index]).filter(|variant| variant.is_cause());
            causes.map(|variant| variant.effect.id).collect()
        };
        let best = |of: &dyn Fn(&[&str]) -> bool| {
            let evidences = ranking.hypotheses.iter().filter(|h| of(&ids(h))).map(|h| h.fit.log_evidence);
            evidences.reduce(f64::max)
        };
        let is_pair = |ids: &[&str]| ids.len() == 2 && pair.iter().all(|id| ids.contains(id));
        Some(PairEvidence {
            both: best(&is_pair)?,
            fewer: best(&|ids| ids.len() < 2)?,
            other: best(&|ids| ids.len() == 2 && !is_pair(ids)).unwrap_or(f64::NEG_INFINITY),
        })
    }
}

/// ln evidence of a pair of effects, and of what could be said instead.
#[derive(Debug, Clone, Copy)]
pub struct PairEvidence {
    /// Of both.
    pub both: f64,
    /// Of the best single effect, or of nothing.
    pub fewer: f64,
    /// Of the best other pair.
    pub other: f64,
}
