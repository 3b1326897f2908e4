//! Explains: where a model is wrong, which causes would make it right, and how sure one can be.
//!
//! A diagnosis sees [`Dataset`]s and a [`ForwardModel`], and nothing of a simulation (invariant 1). In order:
//!
//! 1. Every run is predicted by the model as given: a replay of its log, or its protocol as driven (`forward`).
//! 2. What runs of one kind differ by is noise; its sizes are learnt from them (`noise`, `shapes`). What the model is known to get
//!    wrong in general is no cause either (`doubt`, `residue`).
//! 3. What every cause of the catalogue would do to the way of each run is simulated once (`surrogate`, `spots`).
//! 4. Sets of none, one and several causes are fitted and ranked by evidence (`search`, `fit`, `linear`, `plausible`).
//! 5. The leading ones are simulated again where they are best, until that changes nothing (`refine`).
//! 6. Where the best leaves much, answers have to stand out of as much, and a formula may take it away (`formula`), or the robot
//!    is on other tyres (`tyres`).
//! 7. What stands is named, with what cannot be told from it (`verdict`) and what could not have shown (`blind`), and what it is
//!    worth is measured on runs that it did not see (`gain`).

mod blind;
mod case;
mod diagnosis;
mod doubt;
mod evidences;
mod fit;
mod formula;
mod forward;
mod gain;
mod linear;
mod low_rank;
mod misfit;
mod next;
mod noise;
mod plausible;
mod refine;
mod residue;
mod response_error;
mod search;
mod shapes;
mod spots;
mod surrogate;
mod tyres;
mod variant;
mod verdict;
mod way;

pub use crate::scene::NoiseModel;
pub use blind::Blind;
pub use case::Condition;
pub use diagnosis::{Clock, Diagnosis, Finding, Found, Ranked, Suspicion, Transient, Verdict};
pub use evidences::PairEvidence;
pub use forward::{ForwardError, ForwardModel};
pub use gain::Gain;
pub use misfit::{Misfit, MisfitCondition, RunReadings};
pub use next::NextExperiment;
pub use residue::Remainder;
pub use surrogate::Library;
pub use tyres::OtherTyres;

use crate::dataset::Dataset;
use crate::scene::{Doubt, Feature, GRAVITY, TermPart};
use case::{Case, Cluster, with_clocks};
use doubt::MotionError;
use forward::Base;
use gain::Answer;
use linear::Problem;
use nalgebra::DVector;
use shapes::Shapes;
use std::sync::OnceLock;
use surrogate::{Candidates, Surrogate};
use variant::{TyrePart, Variant};

/// What is plausible of an empirical term: its part of the twist over the speed \[–, rad/m\], or of a force over the weight.
const PLAUSIBLE_TERM: f64 = 0.01;

/// What a calibration finds.
const CALIBRATED: [&str; 3] = ["wheel_diameter_scale", "wheel_diameter_mismatch", "effective_track"];

/// How far that is in doubt.
fn calibrated(doubt: Doubt) -> [f64; 3] {
    [doubt.diameter_scale, doubt.diameter_ratio, doubt.effective_track]
}

/// What responses of a model that had to be moved far may err by, over what it was moved by. Rigid cylinders turn the robot in
/// a track a fifth less than the model's, which friction can make so as well; but then a load moves the centre of rotation half
/// as far again as it moves that of cylinders, and turns the robot three times as much.
const STRANGE: f64 = 2.0;

/// Strength of a misfit \[σ\] up to which responses that were simulated on other runs of the kind are exact enough: they are
/// good to half a per cent.
const CARRIED: f64 = 200.0;

/// What to look for, and how hard.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Causes that may be at work at once.
    pub most_causes: usize,
    /// Error that responses of the model are allowed, relative: as a whole, and in each part of a way.
    pub response_error: [f64; 2],
    /// Sizes of the noise where they are known; learnt from repeated runs otherwise.
    pub noise: Option<NoiseModel>,
    /// Whether wheels may meet the ground by another law than the model's, where the model is far off.
    pub other_tyres: bool,
    /// Whether to look for the run that would settle what these data leave open.
    pub next_experiment: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            most_causes: 8,
            response_error: response_error::RESPONSE_ERROR,
            noise: None,
            other_tyres: true,
            next_experiment: true,
        }
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
    model: Base<'m>,
    options: Options,
    /// Told how many simulations of how many are done.
    progress: &'m (dyn Fn(usize, usize) + Sync),
    cases: Vec<Case>,
    clusters: Vec<Cluster>,
    /// How many of them, the first ones, have runs that were not named to be held out.
    used: usize,
    conditions: Vec<Condition>,
    variants: Vec<Variant>,
    /// How many of them do not depend on what was measured; those after are spots between the first ones.
    first_variants: usize,
    surrogate: Surrogate,
    shapes: Vec<Shapes>,
    /// What an error of the model's own motion does to each cluster's readings, once it was asked for.
    doubts: OnceLock<Vec<MotionError>>,
    /// Variance of runs' means over what noise makes of it, where what every answer leaves is no noise; 1 else.
    discrepancy: f64,
    /// The hypothesis on whose ways these two are.
    shaped_at: Vec<(variant::Axis, f64)>,
    /// What is stated or usual of each campaign's noise, and what was learnt.
    prior_noise: Vec<NoiseModel>,
    noise: Vec<NoiseModel>,
    observed: Vec<DVector<f64>>,
    /// How often each run counts.
    counts: Vec<f64>,
    /// Runs that were named to be held out.
    held_out: Vec<bool>,
    left_out: Vec<String>,
    /// What the runs that are not held out say, once they were asked.
    answer: Option<Answer>,
    /// The same runs on other tyres, once the model as given was seen to be far off.
    on_other_tyres: Option<Box<Study<'m>>>,
    /// Responses on other tyres that are known.
    other_library: Option<&'m Library>,
}

/// What was measured, and what is known of how.
struct Runs {
    cases: Vec<Case>,
    /// How many of them, the first ones, were not named to be held out.
    used: usize,
    left_out: Vec<String>,
    /// One a campaign.
    prior_noise: Vec<NoiseModel>,
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
        progress: &'m (dyn Fn(usize, usize) + Sync),
    ) -> Result<Study<'m>, DiagnoseError> {
        let scene = model.scene();
        let (mut cases, mut left_out) = case::cases(datasets, 0, scene);
        let used = cases.len();
        let (held, held_left_out) = case::cases(hold_out, datasets.len(), scene);
        cases.extend(held);
        left_out.extend(held_left_out);
        if used == 0 {
            return Err(DiagnoseError::NothingToUse { left_out });
        }
        let prior = |dataset| NoiseModel::prior(&case::stated_survey(dataset, scene));
        let prior_noise = datasets.iter().chain(hold_out).map(prior).collect();
        let runs = Runs { cases, used, left_out, prior_noise };
        Ok(Study::of(Base::of(model), runs, Candidates::All(library), options, progress)?)
    }

    /// A study of these runs.
    fn of(
        model: Base<'m>,
        runs: Runs,
        candidates: Candidates<'_>,
        options: Options,
        progress: &'m (dyn Fn(usize, usize) + Sync),
    ) -> Result<Study<'m>, ForwardError> {
        let Runs { cases, used, mut left_out, prior_noise } = runs;
        let scene = model.scene();
        let (clusters, conditions) = case::clusters(&cases, scene.robot.tyre_growth != 0.0);
        // Candidates, and what is plausible of them, are those of the runs that are explained. Cases that are held out come last,
        // and so do their clusters.
        let used_clusters = clusters.iter().filter(|cluster| cluster.reference < used).count();
        let mut variants = match candidates {
            Candidates::All(_) => Variant::all(scene, &with_clocks(&cases[..used])),
            Candidates::Few(few) => few.iter().filter(|variant| variant.effect.applies(scene)).cloned().collect(),
        };
        let mut surrogate =
            Surrogate::new(&model, &cases, &clusters, used_clusters, &mut variants, candidates, progress)?;
        left_out.append(&mut surrogate.refused);
        // A hundredth of the speed, or so many radians a metre; of the weight, where it is known what that pulls.
        let motions = surrogate.motions(&clusters[..used_clusters]);
        let size = |part, feature| surrogate::size(part, feature, &motions);
        let (speed, weight) = (size(TermPart::Forward, Feature::Speed), scene.robot.mass() * GRAVITY);
        let of_twist = TermPart::TWIST.into_iter().flat_map(|part| Feature::OF_MOTION.map(|it| (part, it, speed)));
        let of_place = Feature::OF_PLACE.map(|feature| (TermPart::Potential, feature, weight));
        let pulls = variants.iter().any(Variant::is_slope);
        for (part, feature, whole) in of_twist.chain(of_place.into_iter().filter(|_| pulls)) {
            let size = size(part, feature);
            if size > 1e-9 {
                variants.push(Variant::empirical(part, feature, PLAUSIBLE_TERM * whole / size));
            }
        }
        surrogate.add_terms(&clusters, &variants, weight);
        // Where the last campaign is remembered, what it left is known better than what a calibration would find.
        let remembers = |cluster: &Cluster| {
            let label = conditions[cluster.condition].label();
            residue::of_last(scene, &cases[cluster.reference], &label).next().is_some()
        };
        let in_doubt = !clusters[..used_clusters].iter().all(remembers);
        for (id, doubt) in CALIBRATED.into_iter().zip(calibrated(scene.robot.doubt)) {
            let known = variants.iter().find(|variant| variant.effect.id == id);
            if let Some(doubted) = known.filter(|_| in_doubt && doubt > 0.0).map(|variant| variant.doubted(doubt)) {
                variants.push(doubted);
            }
        }
        surrogate.add_doubted(&variants);
        let moved = scene.robot.doubt.response;
        if moved > options.response_error[0] {
            variants.push(Variant::response_error(STRANGE * moved));
        }
        variants
            .extend(TyrePart::in_doubt(scene).into_iter().map(|(part, std_dev)| Variant::tyre_error(part, std_dev)));
        let shapes = shapes::shapes(scene, &cases, &clusters, &variants, &surrogate, &[]);
        let observed: Vec<DVector<f64>> = cases.iter().map(linear::observed).collect();
        Ok(Study {
            model,
            progress,
            counts: (0..cases.len()).map(|run| f64::from(u8::from(run < used))).collect(),
            held_out: (0..cases.len()).map(|run| run >= used).collect(),
            noise: prior_noise.iter().map(|prior| options.noise.unwrap_or(*prior)).collect(),
            prior_noise,
            options,
            cases,
            clusters,
            used: used_clusters,
            conditions,
            first_variants: variants.len(),
            variants,
            surrogate,
            shapes,
            doubts: OnceLock::new(),
            discrepancy: 1.0,
            shaped_at: Vec::new(),
            observed,
            left_out,
            answer: None,
            on_other_tyres: None,
            other_library: None,
        })
    }

    /// Lets a study on other tyres know these responses.
    pub fn knowing_other_tyres(mut self, library: Option<&'m Library>) -> Study<'m> {
        self.other_library = library;
        self
    }

    /// Lets each run count as so many alike, in the order of the datasets' runs; none may have been left out.
    pub fn repeated(mut self, counts: &[usize]) -> Study<'m> {
        assert!(counts.len() == self.cases.len(), "one count a run");
        self.counts = counts.iter().map(|&count| count as f64).collect();
        self
    }

    /// Lets each run count for a share of what it counts: noise of so much more variance.
    pub fn counting_for(mut self, share: f64) -> Study<'m> {
        self.counts.iter_mut().for_each(|count| *count *= share);
        self
    }

    /// The responses, for other campaigns of the same robot.
    pub fn library(&self) -> Library {
        Library::of_surrogate(&self.surrogate, &self.variants, &self.cases, &self.clusters)
    }

    /// Causes by evidence; where nothing repeats, or repeated runs differ by what the best of them do, noise is learnt from what
    /// those leave, and they are asked again.
    /// Where `earlier` answers were best, this search looks as well.
    fn search(&mut self, allowed: &[usize], earlier: &[search::Hypothesis]) -> search::Ranking {
        let (learns, repeats) = (self.options.noise.is_none(), self.repeats());
        if learns && repeats {
            // What runs stray by on their way hangs on where readings are of.
            self.learn_noise(&self.shaped_at.clone());
        }
        let most = self.options.most_causes;
        let mut ranking = search::Ranking::search(&self.problem(self.counts.clone()), allowed, most);
        let runs = self.counts.iter().filter(|count| **count > 0.0).count();
        if learns && if repeats { self.moves_runs_apart(&ranking.best().fit.at) } else { runs > 3 } {
            for _ in 0..noise::MOST_LEARNINGS {
                let best = ranking.best();
                let (set, at) = (best.set.clone(), best.fit.at.clone());
                self.learn_noise_of(at);
                ranking = search::Ranking::search(&self.problem(self.counts.clone()), allowed, most);
                if ranking.best().set == set {
                    break;
                }
            }
        }
        self.weighed(ranking, earlier)
    }

    /// Causes by evidence, under noise as the best of `earlier` answers leaves it.
    fn search_under_noise_of(&mut self, allowed: &[usize], earlier: &[search::Hypothesis]) -> search::Ranking {
        if self.options.noise.is_none() {
            self.learn_noise_of(earlier[0].fit.at.clone());
        }
        let ranking = search::Ranking::search(&self.problem(self.counts.clone()), allowed, self.options.most_causes);
        self.weighed(ranking, earlier)
    }

    /// A search that has looked where `earlier` answers were best, too, weighed over what noise may be where that is learnt.
    fn weighed(&self, mut ranking: search::Ranking, earlier: &[search::Hypothesis]) -> search::Ranking {
        if !earlier.is_empty() {
            ranking.look_again(&self.problem(self.counts.clone()), earlier);
        }
        if self.options.noise.is_none() {
            self.weigh_noise(&mut ranking);
        }
        ranking
    }

    fn problem(&self, counts: Vec<f64>) -> Problem<'_> {
        self.problem_under(&self.noise, counts)
    }

    fn problem_under(&self, noise: &[NoiseModel], counts: Vec<f64>) -> Problem<'_> {
        let problem = self.problem_of(noise, self.model.scene().robot.doubt, counts);
        if self.discrepancy > 1.0 { problem.with_discrepancy(self.discrepancy) } else { problem }
    }

    /// The problem where the model's motion errs as `doubt` says, and no more than that.
    fn problem_of(&self, noise: &[NoiseModel], doubt: Doubt, counts: Vec<f64>) -> Problem<'_> {
        let clusters = self.clusters.iter().zip(&self.shapes);
        let factors: Vec<_> = clusters.map(|(cluster, shapes)| shapes.factor(&noise[cluster.campaign])).collect();
        let Doubt { motion, transient, response, .. } = doubt;
        let exact = Problem {
            doubts: vec![None; factors.len()],
            of_means: vec![None; factors.len()],
            discrepancy: 1.0,
            scene: self.model.scene(),
            cases: &self.cases,
            clusters: &self.clusters,
            variants: &self.variants,
            surrogate: &self.surrogate,
            observed: self.observed.clone(),
            factors,
            response_error: self.options.response_error.map(|error| error.max(response)),
            counts,
        };
        let remembers = !self.model.scene().robot.residues.is_empty();
        let errs = motion > 0.0 || transient > 0.0 || remembers;
        if errs { exact.with_doubts(self.doubts(), motion, transient) } else { exact }
    }

    /// Which causes, if any.
    ///
    /// # Errors
    /// The best answer cannot be simulated.
    pub fn diagnose(&mut self) -> Result<Diagnosis, DiagnoseError> {
        let mut own = self.first_look(&self.known_variants());
        let glance = self.glance_at_other_law(&own);
        let is_sure = glance.as_ref().is_some_and(|glance| glance.is_sure);
        if !is_sure {
            own = self.refined(own)?;
        }
        let is_open = |glance: &tyres::Glance| is_sure || !self.stands_alone(&own, glance);
        let other = glance.filter(is_open).and_then(|_| {
            let mut other = self.under_the_other_law()?;
            let first = other.first_look(&other.known_variants());
            if !is_sure && self.stands_against(&own, &other, &first) {
                return None;
            }
            // What cannot be driven where it is best is no answer.
            Some((other.refined(first).ok()?, other))
        });
        if is_sure && other.is_none() {
            own = self.refined(own)?;
        }
        let mut answer = self.answer_of(&own);
        let Some((theirs, mut other)) = other else {
            self.answer = Some(answer);
            return self.judge(self, &own);
        };
        let of_other = other.answer_of(&theirs);
        let log_odds = tyres::log_odds(&answer, &of_other);
        let diagnosis = if log_odds > 0.0 {
            tyres::judge(self, &other, &theirs, log_odds)
        } else {
            if is_sure {
                // What is not worth a closer look beside an answer that stands is worth one where that does not.
                own = self.refined(own)?;
                answer = self.answer_of(&own);
            }
            self.judge(self, &own)
        };
        (self.answer, other.answer) = (Some(answer), Some(of_other));
        self.on_other_tyres = Some(other);
        diagnosis
    }

    /// Causes by evidence, by what was simulated of each at first.
    fn first_look(&mut self, allowed: &[usize]) -> search::Ranking {
        let ranking = self.search(allowed, &[]);
        if self.reshape(&ranking) { self.search(allowed, &[]) } else { ranking }
    }

    /// What is said of a ranking, and of the model as `given`.
    fn judge(&self, given: &Study<'_>, ranking: &search::Ranking) -> Result<Diagnosis, DiagnoseError> {
        let mut diagnosis = verdict::judge(self, given, ranking)?;
        if self.options.next_experiment {
            diagnosis.next_experiment = self.next_experiment(ranking, &diagnosis)?;
        }
        Ok(diagnosis)
    }

    /// What the extension is worth on runs that take no part in it; `None` where nothing can be held out.
    pub fn gain(&mut self) -> Option<Gain> {
        gain::gain(self)
    }

    /// The same, with what it is worth on repeats where those runs do not show it.
    pub fn gain_or_repeats(&mut self) -> Option<Gain> {
        gain::gain_or_repeats(self)
    }

    /// Variants of the catalogue.
    fn known_variants(&self) -> Vec<usize> {
        (0..self.variants.len()).filter(|&index| self.variants[index].is_cause()).collect()
    }

    /// Those that do not depend on what was measured.
    fn first_variants(&self) -> Vec<usize> {
        (0..self.first_variants).filter(|&index| self.variants[index].is_cause()).collect()
    }

    /// Where an answer is, without what is in doubt of the model anyway. Where causes may act otherwise than the model has
    /// them, their sizes are such that the model as it is predicts best. At nothing, where it leaves much and is worse than that.
    fn answered(&self, answer: &search::Hypothesis) -> Vec<(variant::Axis, f64)> {
        let as_simulated = |axis: &variant::Axis| {
            let variant = &self.variants[axis.variant];
            !variant.is_error_of_response(axis.coordinate) && variant.tyre_part().is_none()
        };
        let axes: Vec<_> = answer.fit.at.iter().map(|(axis, _)| *axis).filter(as_simulated).collect();
        let refitted =
            (axes.len() < answer.fit.at.len()).then(|| self.problem(self.counts.clone()).fit(&axes, &answer.fit.at).at);
        let mut at = refitted.unwrap_or_else(|| answer.fit.at.clone());
        at.retain(|(axis, _)| !self.variants[axis.variant].is_doubted());
        // What comes nearest on the way may end farther off than the model as given, and then it is no model.
        if verdict::leaves_much(self, answer) && misfit::left_of_ends(self, &at) > misfit::left_of_ends(self, &[]) {
            at.clear();
        }
        at
    }

    /// What these data could not show.
    pub fn blind(&self) -> Vec<Blind> {
        blind::blind(self)
    }

    /// Pairs of effects whose responses these data cannot keep apart, with the angle between the whitened responses \[rad\]:
    /// the smallest principal angle of their spans [Björck & Golub 1973, *Math. Comp.* 27].
    pub fn alike(&self) -> Vec<(String, String, f64)> {
        blind::alike(self)
    }

    /// Whether the misfit is so weak that responses which were simulated on other runs of the kind are exact enough.
    pub fn may_carry(&self) -> bool {
        self.strength() < CARRIED
    }
}
