//! What a diagnosis says.

use super::{Blind, Misfit, NextExperiment, OtherTyres, Remainder, RunReadings};
use crate::effect::Cause;
use crate::scene::{Doubt, EmpiricalTerm, NoiseModel, Residue, Scene};

/// A diagnosis in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The model as given suffices.
    Explained,
    /// Each finding stands alone.
    Named,
    /// At least one finding cannot be told from others.
    Ambiguous,
    /// The misfit is real, and no known effect takes it away.
    Unexplained,
}

/// A diagnosis.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// In a word.
    pub verdict: Verdict,
    /// Where and how much the model as given is wrong.
    pub misfit: Misfit,
    /// What is named.
    pub findings: Vec<Finding>,
    /// Hypotheses that were weighed, best first.
    pub ranking: Vec<Ranked>,
    /// Probability of each effect to be at work; nothing at all is `None`.
    pub probabilities: Vec<(Option<&'static str>, f64)>,
    /// What is likelier than the answer by itself: a cause where nothing is named, a further one beside what is.
    pub suspicion: Option<Suspicion>,
    /// What these data could not have shown.
    pub blind_to: Vec<Blind>,
    /// Sizes of the noise; root mean squares over several campaigns.
    pub noise: NoiseModel,
    /// Where clocks disagree in several campaigns, by how much in each.
    pub clocks: Vec<Clock>,
    /// Errors that are made good by a run's end, as which what is left is likelier, where the answer leaves much.
    pub transient: Option<Transient>,
    /// The causes of the best answer, as an extended model holds them: where its responses are in doubt, of such sizes that
    /// they predict best as they are, which is not what is stated of them.
    pub causes: Vec<Cause>,
    /// Terms of the body's twist, where a formula takes away what known causes leave.
    pub empirical: Vec<EmpiricalTerm>,
    /// Another law of tyres that serves better than the model's, where there is one: the extended model has it.
    pub other_tyres: Option<OtherTyres>,
    /// How far the answer is to be doubted in its turn, but for its motion, which [`super::Gain`] tells.
    pub doubt: Doubt,
    /// What the answer leaves of these runs, for the diagnosis of later ones.
    pub residues: Vec<Residue>,
    /// What the answer as fitted and the extended model leave of the ends of these runs; `None` where no run has a protocol.
    pub remainder: Option<Remainder>,
    /// What to drive next, where two answers stand, or one that is suspected.
    pub next_experiment: Option<NextExperiment>,
    /// Readings of every run, and what the models predict of them.
    pub runs: Vec<RunReadings>,
    /// Runs that were not used, and why.
    pub left_out: Vec<String>,
}

impl Diagnosis {
    /// The model as extended by this answer, for the next diagnosis: `scene` is the model as given, `motion_error` what
    /// [`super::Gain`] tells of its motion, 0 where it was not asked.
    pub fn extended(&self, scene: &Scene, motion_error: f64) -> Scene {
        let mut extended = Cause::edit_all(&self.causes, scene);
        extended.empirical.extend(&self.empirical);
        extended.contact = self.other_tyres.map_or(extended.contact, |tyres| tyres.contact);
        extended.robot.doubt = Doubt { motion: motion_error, ..self.doubt };
        extended.robot.residues.clone_from(&self.residues);
        extended
    }
}

/// One finding.
#[derive(Debug, Clone)]
pub struct Finding {
    /// The effect.
    pub effect: &'static str,
    /// Wheel or side; empty where nothing has to be chosen.
    pub choice: String,
    /// Its numbers.
    pub parameters: Vec<Found>,
    /// Probability that it is at work.
    pub probability: f64,
    /// Effects that these data cannot tell from it.
    pub confounded_with: Vec<&'static str>,
}

/// A number that was found.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    /// The parameter.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// 1 σ; `None`: not sought.
    pub std_dev: Option<f64>,
}

/// Causes that are likelier than none, or than no further one, and not sure enough to be named.
#[derive(Debug, Clone, PartialEq)]
pub struct Suspicion {
    /// Odds that a cause is at work, or one more than are named, against none.
    pub odds: f64,
    /// The likeliest effects, each with its probability.
    pub effects: Vec<(&'static str, f64)>,
}

/// What the clocks of one campaign disagree by.
#[derive(Debug, Clone, PartialEq)]
pub struct Clock {
    /// Its name.
    pub campaign: String,
    /// Pose stamp − encoder stamp \[s\].
    pub offset: f64,
    /// 1 σ \[s\].
    pub std_dev: f64,
}

/// What an answer leaves, taken for errors of the motion that are made good by a run's end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transient {
    /// Size under which the data are likeliest, relative to each part of a way: `[doubt] transient`.
    pub share: f64,
    /// ln of how much likelier they are than under errors of no such kind, as large as what is left.
    pub log_odds: f64,
}

/// A hypothesis and what the data say of it.
#[derive(Debug, Clone)]
pub struct Ranked {
    /// Effects by their id; a term of a formula as it is written.
    pub effects: Vec<String>,
    /// The same with wheel, side or place.
    pub causes: Vec<String>,
    /// ln evidence.
    pub log_evidence: f64,
    /// Share of the posterior.
    pub probability: f64,
}
