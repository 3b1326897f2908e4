//! Scoring of hidden-effect challenges against an oracle that knows the true scene.

use super::campaign::{CampaignKind, DataKind, drive_campaign, noise_free};
use super::judge::{STRONG, called_for_by_clean, judge};
use super::oracle::{left_by, oracle};
use super::{Challenge, EffectsKind, surveyed};
use crate::dataset::Dataset;
use crate::diagnose::{DiagnoseError, ForwardError, ForwardModel, Library, Options, PairEvidence, Study};
use crate::drive::{self, DriveError};
use crate::experiment::Simulator;
use crate::scene::{Contact, Doubt, Scene};
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// What a draw came to.
#[derive(Debug, Clone)]
pub struct Scored {
    /// The draw's seed.
    pub seed: u64,
    /// What was hidden: effect ids, or a description of what is not in the catalogue.
    pub truth: Vec<String>,
    /// Strength of the whole response \[σ\].
    pub strength: f64,
    /// Effects that the data cannot tell from the true one; of two, both where the data call for them and for no other pair.
    pub oracle_set: Vec<&'static str>,
    /// The diagnosis in a line.
    pub answer: String,
    /// How it counts.
    pub tally: Tally,
    /// What the draw calls for.
    pub called_for: Call,
    /// With another tyre law: the same, where the oracle, too, knows the world by clean campaigns alone.
    pub called_for_as_told: Option<Call>,
    /// Of two effects: whether both together are within odds of 50 to 1 of the likeliest answer, be it given or not.
    pub both_stand: Option<bool>,
    /// Parameters of true effects that were found alone.
    pub intervals: Vec<Interval>,
    /// Members of the answer's sets.
    pub set_size: Option<usize>,
    /// ln of the probability that an oracle gives the truth, less the diagnosis'.
    pub regret: Option<f64>,
    /// Smallest detectable sizes over the oracle's.
    pub detectable_ratio: Vec<f64>,
    /// Gain in position on folds of the campaign, each foretold from the others, and that of an oracle which knows the truth
    /// beforehand; `None` where the response is too weak.
    pub gain: Option<[f64; 2]>,
    /// Gain in position on another campaign of the same world, and that of the oracle; `None` where the response is too weak.
    pub gain_on_fresh: Option<[f64; 2]>,
    /// Time that the diagnosis took \[s\].
    pub seconds: f64,
}

/// What a draw calls for, by an oracle's evidence without noise.
#[derive(Debug, Clone, Copy)]
pub struct Call {
    /// Whether silence, or one of two effects alone, would be a miss.
    pub for_answer: bool,
    /// Of two effects: the evidence.
    pub pair: Option<PairEvidence>,
}

/// A number of a true effect that was found alone.
#[derive(Debug, Clone, Copy)]
pub struct Interval {
    /// The effect.
    pub effect: &'static str,
    /// The parameter.
    pub parameter: &'static str,
    /// What was found less the truth \[σ\].
    pub off: f64,
}

impl Interval {
    /// Whether the 95 % interval holds the truth.
    pub fn covers(&self) -> bool {
        self.off.abs() <= 1.96
    }
}

/// How a draw counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Tally {
    /// Nothing was hidden, and nothing named.
    Clean,
    /// Nothing was hidden, and something named.
    FalseAlarm,
    /// The true effect stands alone.
    Named,
    /// The answer holds the true effect and at most one member more than the oracle's.
    RightGroup,
    /// Up to twice the oracle's.
    Half,
    /// Nothing was named where the data could not show it, or more than is of use.
    SilentRightly,
    /// Nothing was named where the data show it, or too large a set.
    Missed,
    /// An answer without the true effect.
    Wrong,
    /// Nothing false of two effects that the data do not call for both of.
    AsFarAsCalledFor,
    /// Both of two effects, each alone.
    BothExact,
    /// Both of two effects, in the answers' sets.
    BothInSets,
    /// Something that is not in the catalogue: said to be unexplained, or a true mimic was named.
    Unexplained,
}

/// Results of a range of seeds.
#[derive(Debug, Clone)]
pub struct Score {
    /// One a seed.
    pub draws: Vec<Scored>,
    /// Draws whose effect, or whose two effects, an oracle could name alone.
    pub oracle_nameable: usize,
}

/// Why scoring ended.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScoreError {
    /// A run.
    #[error(transparent)]
    Drive(#[from] DriveError),
    /// A diagnosis.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
}

/// Scores diagnoses of one robot in one kind of campaign: what causes do to it there is simulated once for all draws.
pub struct Scorer {
    base: Scene,
    libraries: Libraries,
}

impl Scorer {
    /// Simulates what draws like `challenge` share, on other tyres as well where diagnoses come to asking for them: where worlds
    /// have them, or something that no cause explains. `progress` is told how many simulations are done.
    ///
    /// # Errors
    /// A run that cannot be driven.
    pub fn new(
        base: &Scene,
        challenge: &Challenge,
        progress: &(dyn Fn(usize, usize) + Sync),
        stop: &AtomicBool,
    ) -> Result<Scorer, ScoreError> {
        // The world is made of the model: but for another tyre law, nothing of it is in doubt.
        let mut base = base.clone();
        base.robot.doubt = Doubt::default();
        let on_tyres = |contact| -> Result<Library, ScoreError> {
            let scene = Scene { contact, ..base.clone() };
            library(&Simulator::new(&scene, stop), challenge.campaign, challenge.data, progress)
        };
        let asks = challenge.mismatch || challenge.effects == EffectsKind::Outside;
        let libraries = Libraries {
            contact: base.contact,
            given: on_tyres(base.contact)?,
            other: asks.then(|| on_tyres(base.contact.other())).transpose()?,
        };
        Ok(Scorer { base, libraries })
    }

    /// Draws, diagnoses with these options and scores a range of seeds; `watch` is told of each.
    ///
    /// # Errors
    /// A run that cannot be driven or diagnosed.
    pub fn score(
        &self,
        challenge: Challenge,
        seeds: std::ops::Range<u64>,
        options: &Options,
        watch: &mut dyn FnMut(&Scored),
        stop: &AtomicBool,
    ) -> Result<Score, ScoreError> {
        // Nobody drives what would settle a draw.
        let options = &Options { next_experiment: false, ..options.clone() };
        let mut draws = Vec::new();
        // Side by side, told in order.
        let seeds: Vec<u64> = seeds.collect();
        for seeds in seeds.chunks(rayon::current_num_threads()) {
            let scored: Vec<Scored> = seeds
                .par_iter()
                .map(|&seed| self.one(Challenge { seed, ..challenge }, options, stop))
                .collect::<Result<_, _>>()?;
            scored.iter().for_each(&mut *watch);
            draws.extend(scored);
        }
        let nameable = |scored: &&Scored| {
            !scored.truth.is_empty() && scored.oracle_set.len() == scored.truth.len() && scored.strength >= STRONG
        };
        let oracle_nameable = draws.iter().filter(nameable).count();
        Ok(Score { draws, oracle_nameable })
    }

    /// Draws, diagnoses and scores one.
    fn one(&self, challenge: Challenge, options: &Options, stop: &AtomicBool) -> Result<Scored, ScoreError> {
        let Scorer { base, libraries } = self;
        let simulator = &Simulator::new(base, stop);
        let draw = challenge.draw(base, stop)?;
        let began = Instant::now();
        // With another tyre law the model is first extended on clean campaigns of that world, as a user would.
        let extended = match draw.clean_datasets.as_slice() {
            [] => None,
            clean => {
                let mut study = study_of(clean, simulator, options, Some(libraries))?;
                let found = study.diagnose()?;
                let extended = found.extended(base, study.gain().map_or(0.0, |gain| gain.motion_error));
                // A model that was moved by more than responses may err answers causes otherwise.
                let is_near = found.doubt.response < options.response_error[1];
                Some((Simulator::new(&extended, stop), is_near.then_some(libraries)))
            }
        };
        let (model, known) = match &extended {
            None => (simulator, Some(libraries)),
            Some((model, known)) => (model, *known),
        };
        let mut study = study_of(std::slice::from_ref(&draw.dataset), model, options, known)?;
        let diagnosis = study.diagnose()?;
        let seconds = began.elapsed().as_secs_f64();
        let held_out = study.gain();
        drop(study);

        let of_world = Simulator::new(&draw.clean, stop);
        let clean = if challenge.mismatch { &of_world } else { simulator };
        let oracle = oracle(&challenge, &draw, clean, libraries.on(draw.clean.contact))?;
        let mut scored = judge(&challenge, &draw, &diagnosis, &oracle, seconds);
        if challenge.mismatch {
            scored.called_for_as_told = Some(called_for_by_clean(&draw, oracle, challenge.clean_campaigns));
        }
        if scored.strength >= STRONG && challenge.effects != EffectsKind::None {
            if let Some(gain) = held_out {
                let of_oracle = left_by(&draw.world, &draw.dataset, stop)?;
                scored.gain = Some([gain.position_after, of_oracle].map(|left| 1.0 - left / gain.position_before));
            }
            let seed = drive::derived_seed(challenge.seed, "fresh");
            let fresh = drive_campaign(&draw.world, challenge.campaign, challenge.data, seed, "fresh", stop)?;
            let given = model.scene();
            let before = left_by(given, &fresh, stop)?;
            // What the extension states of its doubt does not move it.
            let [found, of_oracle] =
                [&diagnosis.extended(given, 0.0), &draw.world].map(|scene| left_by(scene, &fresh, stop));
            scored.gain_on_fresh = Some([found?, of_oracle?].map(|left| 1.0 - left / before));
        }
        Ok(scored)
    }
}

/// Responses that are simulated once for all draws.
struct Libraries {
    /// On the tyres of the model.
    given: Library,
    /// On other tyres.
    other: Option<Library>,
    /// The tyres of the model.
    contact: Contact,
}

impl Libraries {
    /// Of a robot on these tyres.
    fn on(&self, contact: Contact) -> Option<&Library> {
        if contact == self.contact { Some(&self.given) } else { self.other.as_ref() }
    }
}

/// Responses of the robot as the diagnosis knows it.
fn library(
    simulator: &Simulator<'_>,
    kind: CampaignKind,
    data: DataKind,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Library, ScoreError> {
    let scene = surveyed(simulator.scene());
    let (dataset, _) = noise_free(&scene, &scene, kind, data, simulator.stop())?;
    let study = Study::new(&[dataset], &[], simulator, Options::default(), None, progress)?;
    Ok(study.library())
}

/// What the command works on: `known` responses, on the model's tyres and on others, serve where the misfit is not so strong
/// that they have to be simulated anew.
fn study_of<'m>(
    datasets: &[Dataset],
    model: &'m Simulator<'_>,
    options: &Options,
    known: Option<&'m Libraries>,
) -> Result<Study<'m>, DiagnoseError> {
    let contact = model.scene().contact;
    let [known, other] = [contact, contact.other()].map(|contact| known.and_then(|known| known.on(contact)));
    // Where rigid wheels grip or give hangs on the run: what a cause does to one of them it does not do to the next.
    let known = known.filter(|_| contact != Contact::Rigid);
    let of = |known| Study::new(datasets, &[], model, options.clone(), known, &|_, _| {});
    let study = of(known)?;
    let study = if known.is_some() && !study.may_carry() { of(None)? } else { study };
    Ok(study.knowing_other_tyres(other))
}

impl Score {
    /// How many draws count so.
    pub fn count(&self, tally: Tally) -> usize {
        self.draws.iter().filter(|scored| scored.tally == tally).count()
    }
}

impl From<ForwardError> for ScoreError {
    fn from(error: ForwardError) -> Self {
        ScoreError::Diagnose(error.into())
    }
}
