//! Explains: where a model is wrong, which causes would make it right, and how sure one can be.
//!
//! A diagnosis sees [`Dataset`]s and a [`ForwardModel`], and nothing of a simulation (invariant 1). In order:
//!
//! 1. Every run is predicted by the model as given: a replay of its log, or its protocol as driven (`forward`).
//! 2. What runs of one kind differ by is noise; its sizes are learnt from them (`noise`).
//! 3. What every cause of the catalogue would do to the way of each run is simulated once (`surrogate`).
//! 4. Sets of none, one and several causes are fitted and ranked by evidence (`search`, `linear`).
//! 5. The best is simulated again where it is best, and what stands is named, with what cannot be told from it.

mod case;
mod forward;
mod gain;
mod linear;
mod next;
mod noise;
mod search;
mod surrogate;
mod variant;
mod verdict;

pub use case::Condition;
pub use forward::{ForwardError, ForwardModel};
pub use gain::Gain;
pub use next::NextExperiment;
pub use noise::NoiseModel;
pub use surrogate::Library;
pub use verdict::{Blind, Diagnosis, Finding, Found, Misfit, MisfitCondition, Ranked, RunReadings, Verdict};

use crate::dataset::Dataset;
use crate::effect::Cause;
use crate::scene::TwistPart;
use case::{Case, Cluster};
use linear::Problem;
use nalgebra::DVector;
use noise::Shapes;
use surrogate::Surrogate;
use variant::Variant;

/// Terms of a formula.
const MOST_TERMS: usize = 4;
/// What is plausible of an empirical term: its part of the twist over the speed \[–, rad/m\].
const PLAUSIBLE_TERM: f64 = 0.01;

/// What to look for, and how hard.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Causes that may be at work at once.
    pub most_causes: usize,
    /// Error that responses of the model are allowed, relative: as a whole, and in each part of a way.
    pub response_error: [f64; 2],
    /// Sizes of the noise where they are known; learnt from repeated runs otherwise.
    pub noise: Option<NoiseModel>,
}

impl Default for Options {
    fn default() -> Self {
        Options { most_causes: 3, response_error: linear::RESPONSE_ERROR, noise: None }
    }
}

/// Data that a diagnosis cannot begin with.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DiagnoseError {
    /// No run has anything to say.
    #[error("no run can be used: {}", if left_out.is_empty() { "there is none".to_owned() } else { left_out.join("; ") })]
    NothingToUse {
        /// Runs and why each was left out.
        left_out: Vec<String>,
    },
    /// A run that cannot be simulated.
    #[error(transparent)]
    Forward(#[from] ForwardError),
}

/// Runs, predictions and responses: what a diagnosis works on.
pub struct Study<'m> {
    model: &'m dyn ForwardModel,
    options: Options,
    cases: Vec<Case>,
    clusters: Vec<Cluster>,
    conditions: Vec<Condition>,
    variants: Vec<Variant>,
    surrogate: Surrogate,
    shapes: Vec<Shapes>,
    /// What is stated or usual of the noise, and what was learnt.
    prior_noise: NoiseModel,
    noise: NoiseModel,
    observed: Vec<DVector<f64>>,
    /// How often each run counts.
    counts: Vec<f64>,
    /// Runs that were named to be held out.
    held_out: Vec<bool>,
    left_out: Vec<String>,
}

impl<'m> Study<'m> {
    /// Predicts every run and simulates what causes would do to it; `progress` is told how many simulations of how many are
    /// done. Conditions that `library` knows are not simulated again.
    ///
    /// # Errors
    /// No run can be used, or one cannot be simulated.
    pub fn new(
        datasets: &[Dataset],
        hold_out: &[Dataset],
        model: &'m dyn ForwardModel,
        options: Options,
        library: Option<&Library>,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Study<'m>, DiagnoseError> {
        let scene = model.scene();
        let (mut cases, mut left_out) = case::cases(datasets, &scene.robot.odometry);
        let used = cases.len();
        let (held, held_left_out) = case::cases(hold_out, &scene.robot.odometry);
        cases.extend(held);
        left_out.extend(held_left_out);
        if used == 0 {
            return Err(DiagnoseError::NothingToUse { left_out });
        }
        let (clusters, conditions) = case::clusters(&cases, scene.robot.tyre_growth != 0.0);
        let variants = Variant::all(scene);
        let mut variants = variants;
        let mut surrogate = Surrogate::new(model, &cases, &clusters, &variants, library, progress)?;
        let (features, speed) = surrogate.sizes(&clusters);
        for part in TwistPart::ALL {
            // A hundredth of the speed, or so many radians a metre.
            for (feature, size) in features.iter().filter(|(_, size)| *size > 1e-9) {
                variants.push(Variant::empirical(part, *feature, PLAUSIBLE_TERM * speed / size));
            }
        }
        surrogate.add_terms(&clusters, &variants);
        let shapes = linear::shapes(scene, &cases, &clusters, &surrogate);
        let observed: Vec<DVector<f64>> = cases.iter().map(linear::observed).collect();
        let mut survey = scene.survey;
        if let Some(facts) = datasets.iter().map(|dataset| &dataset.campaign.survey).find(|s| s.position_std.is_some())
        {
            survey.position_std = facts.position_std.unwrap_or(survey.position_std);
            survey.heading_std = facts.heading_std.unwrap_or(survey.heading_std);
        }
        let mut study = Study {
            model,
            counts: (0..cases.len()).map(|run| f64::from(u8::from(run < used))).collect(),
            held_out: (0..cases.len()).map(|run| run >= used).collect(),
            prior_noise: NoiseModel::prior(&survey),
            noise: options.noise.unwrap_or_else(|| NoiseModel::prior(&survey)),
            options,
            cases,
            clusters,
            conditions,
            variants,
            surrogate,
            shapes,
            observed,
            left_out,
        };
        study.noise = study.options.noise.unwrap_or(study.noise);
        Ok(study)
    }

    /// Lets each run count as so many alike, in the order of the datasets' runs; none may have been left out.
    pub fn repeated(mut self, counts: &[usize]) -> Study<'m> {
        assert!(counts.len() == self.cases.len(), "one count a run");
        self.counts = counts.iter().map(|&count| count as f64).collect();
        self
    }

    /// The responses, for other campaigns of the same robot.
    pub fn library(&self) -> Library {
        Library::of_surrogate(&self.surrogate, &self.cases, &self.clusters)
    }

    /// Sizes of the noise from what repeated runs differ by, or from what `at` leaves where too little repeats.
    fn learn_noise(&mut self, at: &[(variant::Axis, f64)]) {
        let clusters: Vec<Cluster> = self
            .clusters
            .iter()
            .map(|cluster| {
                let runs = cluster.runs.iter().copied().filter(|&run| self.counts[run] > 0.0).collect();
                Cluster { runs, ..cluster.clone() }
            })
            .collect();
        let repeats = self.repeats();
        let spreads = {
            let problem = self.problem(self.counts.clone());
            let at = if repeats { &[] } else { at };
            let mut off: Vec<DVector<f64>> = self.observed.clone();
            for (index, cluster) in clusters.iter().enumerate() {
                for &run in &cluster.runs {
                    off[run] = &self.observed[run] - problem.predict(index, run, at);
                }
            }
            if repeats { noise::of_repeats(&clusters, &off) } else { noise::of_residuals(&clusters, &off) }
        };
        let on_the_way = self.cases.iter().any(|case| case.frame_stamp.is_some());
        let widths = if repeats { noise::KNOWN } else { noise::HARDLY_KNOWN };
        self.noise = noise::learn(self.prior_noise, &spreads, &self.shapes, widths, on_the_way);
    }

    /// Whether enough runs repeat one another to tell noise by.
    fn repeats(&self) -> bool {
        let active = |runs: &[usize]| runs.iter().filter(|&&run| self.counts[run] > 0.0).count();
        let free: usize = self.clusters.iter().map(|cluster| active(&cluster.runs).saturating_sub(1)).sum();
        free >= 2 && 4 * free >= active(&(0..self.cases.len()).collect::<Vec<_>>())
    }

    /// Causes by evidence; where nothing repeats, noise is learnt from what the best of them leave, and they are asked again.
    fn search(&mut self) -> search::Ranking {
        let allowed = self.known_variants();
        let learns = self.options.noise.is_none();
        if learns && self.repeats() {
            self.learn_noise(&[]);
        }
        let most = self.options.most_causes;
        let mut ranking = search::Ranking::search(&self.problem(self.counts.clone()), &allowed, most);
        let runs = self.counts.iter().filter(|count| **count > 0.0).count();
        if learns && !self.repeats() && runs > 3 {
            for _ in 0..3 {
                let at = ranking.best().fit.at.clone();
                self.learn_noise(&at);
                ranking = search::Ranking::search(&self.problem(self.counts.clone()), &allowed, most);
            }
        }
        ranking
    }

    fn problem(&self, counts: Vec<f64>) -> Problem<'_> {
        Problem {
            scene: self.model.scene(),
            cases: &self.cases,
            clusters: &self.clusters,
            conditions: self.conditions.len(),
            variants: &self.variants,
            surrogate: &self.surrogate,
            observed: self.observed.clone(),
            factors: self.shapes.iter().map(|shapes| shapes.factor(&self.noise)).collect(),
            response_error: self.options.response_error,
            counts,
        }
    }

    /// Which causes, if any.
    ///
    /// # Errors
    /// The best answer cannot be simulated.
    pub fn diagnose(&mut self) -> Result<Diagnosis, DiagnoseError> {
        let mut ranking = self.search();
        // The stand-in is made exact where the leading answers are, and asked again.
        for _ in 0..2 {
            if !self.refine(&ranking)? {
                break;
            }
            ranking = self.search();
        }
        let empirical = self.empirical_ranking(&self.problem(self.counts.clone()), &ranking);
        let mut diagnosis = verdict::judge(self, &ranking, empirical.as_ref());
        diagnosis.next_experiment = self.next_experiment(&ranking, &diagnosis)?;
        Ok(diagnosis)
    }

    /// What the extension is worth on runs that take no part in it; `None` where nothing can be held out.
    ///
    /// # Errors
    /// A run that cannot be simulated.
    pub fn gain(&mut self) -> Result<Option<Gain>, DiagnoseError> {
        gain::gain(self)
    }

    /// Variants of the catalogue.
    fn known_variants(&self) -> Vec<usize> {
        (0..self.variants.len()).filter(|&index| self.variants[index].term.is_none()).collect()
    }

    /// Formulas of the body's twist, where the known causes leave enough for one.
    fn empirical_ranking(&self, problem: &Problem<'_>, known: &search::Ranking) -> Option<search::Ranking> {
        let left = known.best().fit.chi2;
        let readings: f64 =
            self.observed.iter().zip(&self.counts).map(|(observed, count)| observed.len() as f64 * count).sum();
        // A misfit below what noise alone makes has no room for a formula.
        if left < readings {
            return None;
        }
        let terms: Vec<usize> = (0..self.variants.len()).filter(|&index| self.variants[index].term.is_some()).collect();
        Some(search::Ranking::search(problem, &terms, MOST_TERMS))
    }

    /// The protocol that separates the best answer from the next best, where both stand.
    fn next_experiment(
        &self,
        ranking: &search::Ranking,
        diagnosis: &Diagnosis,
    ) -> Result<Option<NextExperiment>, DiagnoseError> {
        let best = ranking.best();
        let ids = |h: &search::Hypothesis| -> Vec<&'static str> {
            h.set.iter().map(|&index| self.variants[index].effect.id).collect()
        };
        let ambiguous = diagnosis.verdict == Verdict::Ambiguous;
        let rival =
            ranking.hypotheses.iter().skip(1).find(|h| ids(h) != ids(best) && (!ambiguous || !h.set.is_empty()));
        let Some(rival) = rival.filter(|_| ambiguous) else { return Ok(None) };
        let name = |h: &search::Hypothesis| {
            let names: Vec<String> = h.set.iter().map(|&index| self.variants[index].label()).collect();
            if names.is_empty() { "nothing".to_owned() } else { names.join(" and ") }
        };
        let causes = |h: &search::Hypothesis| causes_of(&self.variants, &h.fit.at);
        next::next(self, (&name(best), &causes(best)), (&name(rival), &causes(rival)))
    }

    /// Simulates the leading answers where they are best; whether anything was simulated.
    fn refine(&mut self, ranking: &search::Ranking) -> Result<bool, DiagnoseError> {
        const LEADING: usize = 4;
        let best = ranking.best().log_posterior;
        let mut wanted: Vec<(variant::Axis, f64)> = Vec::new();
        for hypothesis in ranking.hypotheses.iter().take(LEADING).filter(|h| h.log_posterior > best - 12.0) {
            for &(axis, value) in &hypothesis.fit.at {
                let coordinate = self.variants[axis.variant].coordinates[axis.coordinate];
                let survey = self.variants[axis.variant].effect.is_survey();
                let nearest = self.surrogate.nearest_node(axis, value);
                if !survey && nearest > 0.5 * coordinate.std_dev && !wanted.iter().any(|(known, _)| *known == axis) {
                    wanted.push((axis, value));
                }
            }
        }
        for &(axis, value) in &wanted {
            self.surrogate.refine(self.model, &self.cases, &self.clusters, &self.variants, axis, value)?;
        }
        Ok(!wanted.is_empty())
    }

    /// What these data could not show.
    pub fn blind(&self) -> Vec<Blind> {
        verdict::blind(self)
    }

    /// Pairs of effects whose responses these data cannot keep apart, with the angle between the whitened responses \[rad\]:
    /// the smallest principal angle of their spans [Björck & Golub 1973, *Math. Comp.* 27].
    pub fn alike(&self) -> Vec<(String, String, f64)> {
        verdict::alike(self)
    }

    /// Strength of the whole misfit: the root of Σ of squared whitened residuals of the model as given.
    pub fn strength(&self) -> f64 {
        let problem = self.problem(self.counts.clone());
        problem.fit(&[], &[]).chi2.sqrt()
    }

    /// ln evidence of nothing, and of every single effect at its best.
    pub fn single_evidences(&self) -> (f64, Vec<(&'static str, f64)>) {
        let ranking = search::Ranking::search(&self.problem(self.counts.clone()), &self.known_variants(), 1);
        let mut of_effect: Vec<(&'static str, f64)> = Vec::new();
        for hypothesis in ranking.hypotheses.iter().filter(|h| h.set.len() == 1) {
            let id = self.variants[*hypothesis.set.first().expect("one")].effect.id;
            if !of_effect.iter().any(|(known, _)| *known == id) {
                of_effect.push((id, hypothesis.fit.log_evidence));
            }
        }
        (ranking.nothing().fit.log_evidence, of_effect)
    }
}

/// The causes of a hypothesis.
fn causes_of(variants: &[Variant], at: &[(variant::Axis, f64)]) -> Vec<Cause> {
    surrogate::causes(variants, at)
}
