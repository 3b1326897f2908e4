//! The stand-in made exact where the leading answers are, and asked again.

use super::search::{Hypothesis, Ranking};
use super::surrogate::{Bench, Surrogate};
use super::variant::{Axis, Variant};
use super::{DiagnoseError, Study, spots, verdict};

/// Answers that are simulated where they are best.
const LEADING: usize = 4;
/// Times that they are, where a round moves them.
const REFINED: usize = 4;
/// Distance from what was simulated beyond which an answer is simulated where it is \[σ\].
const NEAR: f64 = 0.15;
const NEAR_FOR_SPOTS: f64 = 0.1;
/// Spots on the floor that are looked into at first.
const LEADING_SPOTS: usize = 3;
/// Causes from which on an answer is looked at askance: a spot may do in one what many do together.
const LONG_LIST: usize = 3;
/// ln of the evidence that a round of closing in on a spot has to bring for the next.
const WORTH_A_ROUND: f64 = 1.0;

impl Study<'_> {
    /// Causes by evidence, the leading ones simulated where they are best.
    pub(super) fn refined(&mut self, first: Ranking) -> Result<Ranking, DiagnoseError> {
        let mut ranking = first;
        // The stand-in is made exact where the leading answers are, and asked again.
        for (round, distances) in spots::ROUNDS.into_iter().enumerate() {
            let before = ranking.best().log_posterior;
            let closer = self.close_in(&ranking, distances)?;
            let refined = (closer || round < REFINED) && self.refine(&ranking)?;
            if !closer && !refined {
                break;
            }
            ranking = self.search(&self.known_variants(), self.was_moved().then_some(&ranking));
            if round > 1 && ranking.best().log_posterior < before + WORTH_A_ROUND {
                break;
            }
        }
        // What is in doubt of the tyres comes in once the causes have settled: while they are looked for it would serve those that
        // were simulated with it against all others.
        if self.refine_on_tyres(&ranking)? {
            ranking.look_anew(&self.problem(self.counts.clone()));
            if self.options.noise.is_none() {
                self.weigh_noise(&mut ranking);
            }
        }
        Ok(self.explained(ranking))
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
        let looked_into = !places.is_empty();
        for (place, value) in places {
            for &distance in distances {
                let campaign = &self.clusters[..self.campaign];
                for place in spots::near(place, distance, &self.cases, campaign, &self.surrogate.ways) {
                    if self.variants.iter().any(|variant| variant.place() == Some(place)) {
                        continue;
                    }
                    let axis = Axis { variant: self.variants.len(), coordinate: 0 };
                    self.variants.push(Variant::spot(place));
                    let (surrogate, bench) = self.bench();
                    surrogate.add_spot(bench, axis, value)?;
                }
            }
        }
        Ok(looked_into)
    }

    /// Simulates the leading answers where they are best, and the causes of the best together; whether anything was.
    fn refine(&mut self, ranking: &Ranking) -> Result<bool, DiagnoseError> {
        // What a model that was moved far lets a cause do is seen where the cause is, not where it was simulated at first.
        let alone = ranking.nothing().set.len() + 1;
        let singles = ranking.hypotheses.iter().filter(|h| self.was_moved() && h.set.len() == alone);
        let at: Vec<_> =
            leading(ranking).chain(singles).flat_map(|h| h.fit.at.iter().chain(&h.opposite).copied()).collect();
        let refined = self.refine_at(&at)?;
        let (surrogate, bench) = self.bench();
        Ok(surrogate.couple(bench, &ranking.best().fit.at)? || refined)
    }

    /// Simulates the leading answers on tyres that are other than the model's in what is in doubt of them; whether any was.
    fn refine_on_tyres(&mut self, ranking: &Ranking) -> Result<bool, DiagnoseError> {
        let (surrogate, bench) = self.bench();
        let mut refined = false;
        for answer in leading(ranking) {
            refined |= surrogate.couple_with_tyres(bench, &answer.fit.at)?;
        }
        Ok(refined)
    }

    /// Simulates axes where they are, each once; whether any was far from what is known.
    pub(super) fn refine_at(&mut self, at: &[(Axis, f64)]) -> Result<bool, DiagnoseError> {
        let mut wanted: Vec<(Axis, f64)> = Vec::new();
        // What does much the same on both sides of 0 is told apart only where both are exact.
        let is_even = |axis| self.surrogate.is_even(axis);
        for &(axis, value) in at {
            let variant = &self.variants[axis.variant];
            let share = if variant.place().is_some() { NEAR_FOR_SPOTS } else { NEAR };
            let near = share * variant.coordinates[axis.coordinate].std_dev;
            // What is in doubt moves little against what its effect was simulated at.
            let known = variant.effect.is_survey()
                || variant.is_doubted()
                || self.surrogate.nearest_node(axis, value, &self.variants) <= near;
            let is_there = |&(other, at): &(Axis, f64)| other == axis && (!is_even(axis) || at * value > 0.0);
            if !known && !wanted.iter().any(is_there) {
                wanted.push((axis, value));
            }
        }
        let (surrogate, bench) = self.bench();
        for &(axis, value) in &wanted {
            surrogate.refine(bench, axis, value)?;
        }
        Ok(!wanted.is_empty())
    }

    /// The stand-in, and all that it simulates.
    fn bench(&mut self) -> (&mut Surrogate, Bench<'_>) {
        let Study { model, cases, clusters, variants, surrogate, .. } = self;
        (surrogate, Bench { model, cases, clusters, variants })
    }
}

/// Answers that are worth simulating where they are best.
fn leading(ranking: &Ranking) -> impl Iterator<Item = &Hypothesis> {
    let best = ranking.best().log_posterior;
    ranking.hypotheses.iter().take(LEADING).filter(move |h| h.log_posterior > best - 12.0)
}
