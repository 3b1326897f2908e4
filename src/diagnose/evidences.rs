//! Evidence for what is asked for by name: for an oracle, which knows what to ask.

use super::Study;
use super::search::{Hypothesis, Ranking, log_prior};
use super::verdict::CONVINCING;
use statrs::distribution::{ContinuousCDF, Normal};

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
            let those = ranking.hypotheses.iter().filter(|h| of(&ids(h)));
            those.max_by(|a, b| a.fit.log_evidence.total_cmp(&b.fit.log_evidence))
        };
        let is_pair = |ids: &[&str]| ids.len() == 2 && pair.iter().all(|id| ids.contains(id));
        let (both, fewer) = (best(&is_pair)?, best(&|ids| ids.len() < 2)?);
        let other = best(&|ids| ids.len() == 2 && !is_pair(ids)).map(|h| h.fit.log_evidence);
        let prior = |h: &Hypothesis| log_prior(&self.variants, &h.set);
        Some(PairEvidence {
            both: both.fit.log_evidence,
            fewer: fewer.fit.log_evidence,
            other: other.unwrap_or(f64::NEG_INFINITY),
            left_over: (fewer.fit.left - both.fit.left).max(0.0).sqrt(),
            takes: prior(fewer) - prior(both) + CONVINCING,
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
    /// What the best of fewer leaves of what both explain \[σ\].
    pub left_over: f64,
    /// ln evidence over fewer that a diagnosis takes to name both.
    pub takes: f64,
}

impl PairEvidence {
    /// ln of the odds of both against fewer.
    pub fn log_odds(&self) -> f64 {
        self.both - self.fewer
    }

    /// Chance that noise lets both be named by whoever weighs the same evidence, without any error of his own: what fewer leave, `s`
    /// σ without noise, is then normal about that, and ln evidence is half of its square less what the sizes of one more cause cost.
    pub fn chance(&self) -> f64 {
        let cost = 0.5 * self.left_over.powi(2) - self.log_odds();
        let needed = (2.0 * (self.takes + cost)).max(0.0).sqrt();
        let normal = Normal::standard();
        normal.sf(needed - self.left_over) + normal.cdf(-needed - self.left_over)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half where evidence without noise is just what it takes, less or more beside that, and all but certain far beyond.
    #[test]
    fn noise_decides_where_evidence_is_just_enough() {
        let of = |left_over: f64| {
            let both = 0.5 * left_over * left_over - 2.5;
            PairEvidence { both, fewer: 0.0, other: 0.0, left_over, takes: 6.0 }.chance()
        };
        let just = (2.0_f64 * 8.5).sqrt();
        assert!((of(just) - 0.5).abs() < 1e-12, "{}", of(just));
        assert!((of(just + 1.0) - 0.841_345).abs() < 1e-5 && (of(just - 1.0) - 0.158_655).abs() < 1e-5);
        assert!(of(30.0) > 1.0 - 1e-12 && of(0.0) < 1e-4);
    }
}
