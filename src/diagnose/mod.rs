//! Explains: where a model is wrong, which causes would make it right, and how sure one can be.
//!
//! A diagnosis sees [`Dataset`]s and a [`ForwardModel`], and nothing of a simulation (invariant 1). In order:
//!
//! 1. Every run is predicted by the model as given: a replay of its log, or its protocol as driven ([`forward`]).
//! 2. What runs of one kind differ by is noise; its sizes are learnt from them ([`noise`]).
//! 3. What every cause of the catalogue would do to the way of each run is simulated once ([`surrogate`]).
//! 4. Sets of none, one and several causes are fitted and ranked by evidence ([`search`], [`linear`]).
//! 5. The best is simulated again where it is best, and what stands is named, with what cannot be told from it.

mod case;
mod forward;
mod linear;
mod noise;
mod search;
mod surrogate;
mod variant;
mod verdict;

pub use case::Condition;
pub use forward::{ForwardError, ForwardModel};
pub use noise::NoiseModel;
pub use surrogate::Library;
pub use verdict::{Blind, Diagnosis, Finding, Found, Misfit, MisfitCondition, Ranked, Verdict};

use crate::dataset::Dataset;
use crate::effect::Cause;
use case::{Case, Cluster};
use linear::Problem;
use nalgebra::DVector;
use noise::Shapes;
use surrogate::Surrogate;
use variant::Variant;

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
    noise: NoiseModel,
    observed: Vec<DVector<f64>>,
    /// How often each run counts.
    counts: Vec<f64>,
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
        model: &'m dyn ForwardModel,
        options: Options,
        library: Option<&Library>,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Study<'m>, DiagnoseError> {
        let scene = model.scene();
        let (cases, left_out) = case::cases(datasets, &scene.robot.odometry);
        if cases.is_empty() {
            return Err(DiagnoseError::NothingToUse { left_out });
        }
        let (clusters, conditions) = case::clusters(&cases, scene.robot.tyre_growth != 0.0);
        let variants = Variant::all(scene);
        let surrogate = Surrogate::new(model, &cases, &clusters, &variants, library, progress)?;
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
            counts: vec![1.0; cases.len()],
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
        if study.options.noise.is_none() {
            study.learn_noise();
        }
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

    /// Sizes of the noise from what repeated runs differ by.
    fn learn_noise(&mut self) {
        let problem = self.problem(self.counts.clone());
        let deviations: Vec<DVector<f64>> = {
            let mut deviations: Vec<DVector<f64>> = self.observed.clone();
            for (index, cluster) in self.clusters.iter().enumerate() {
                for &run in &cluster.runs {
                    deviations[run] = &self.observed[run] - problem.predict(index, run, &[]);
                }
            }
            deviations
        };
        let on_the_way = self.cases.iter().any(|case| case.frame_stamp.is_some());
        self.noise = noise::learn(self.noise, &self.clusters, &self.shapes, &deviations, on_the_way);
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
        let allowed: Vec<usize> = (0..self.variants.len()).collect();
        let everyone = self.counts.clone();
        let mut ranking = search::Ranking::search(&self.problem(everyone.clone()), &allowed, self.options.most_causes);
        // The stand-in is made exact where the leading answers are, and asked again.
        for _ in 0..2 {
            if !self.refine(&ranking)? {
                break;
            }
            ranking = search::Ranking::search(&self.problem(everyone.clone()), &allowed, self.options.most_causes);
        }
        Ok(verdict::judge(self, &ranking))
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

    /// Strength of the whole misfit: the root of Σ of squared whitened residuals of the model as given.
    pub fn strength(&self) -> f64 {
        let problem = self.problem(self.counts.clone());
        problem.fit(&[], &[]).chi2.sqrt()
    }

    /// ln evidence of nothing, and of every single effect at its best.
    pub fn single_evidences(&self) -> (f64, Vec<(&'static str, f64)>) {
        let allowed: Vec<usize> = (0..self.variants.len()).collect();
        let ranking = search::Ranking::search(&self.problem(self.counts.clone()), &allowed, 1);
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
