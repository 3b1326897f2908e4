//! Whether wheels meet the ground as the model has it at all.
//!
//! A rubber tyre on its patch and a hard wheel on its edges answer the same causes otherwise, and no coordinate leads from the
//! one to the other: friction can give a patch the track of a rigid cylinder, but then a load turns the robot two and a half
//! times as far. So where a model has to be moved by more than its responses may err, and the causes that make it right do not
//! do clearly worse under the other law, the whole diagnosis is made a second time there, and the likelier one stands. What goes
//! by a name of the catalogue then is the class `effective_track`.
//!
//! That takes several times as long as the first one, and is left where it cannot win: one cause that leaves nothing but noise
//! stands, for there it takes a cause as well, and another law besides; and what leaves too little by a first look to make up for
//! its odds is not looked at more closely.

use super::blind::SHOWN;
use super::gain::Answer;
use super::search::{Hypothesis, Ranking, axes_of};
use super::surrogate::Candidates;
use super::variant::{Axis, Variant};
use super::{DiagnoseError, Diagnosis, Finding, ForwardError, ForwardModel, Found, Runs, Study, Verdict, verdict};
use crate::effect::Effect;
use crate::scene::{Contact, EmpiricalTerm, Feature, TermPart};

/// Chance beforehand that wheels meet the ground by another law than the model's.
const ANOTHER: f64 = 0.03;
/// ln of the odds by which the causes that serve here may do worse under the other law before it is not worth a look: there it
/// may be others that serve.
const SLACK: f64 = 50.0;
/// ln of the odds by which they have to do better there for what serves here not to be worth a closer look.
const SURE: f64 = 30.0;
/// ln of the odds by which what was tried there has to do worse for what serves here to stand.
const CLEARLY: f64 = 8.0;
/// The class that stands for whatever makes the track.
const CLASS: &str = "effective_track";

/// Another law of tyres that serves better than the model's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OtherTyres {
    /// The law.
    pub contact: Contact,
    /// ln of its odds over the model's own.
    pub log_odds: f64,
}

/// A first look at the same runs under the other law.
pub(super) struct Glance {
    /// What the causes that serve here weigh there, with any track.
    theirs: f64,
    /// Whether they serve so much better there, also than a formula does here, that what they leave here is not worth a closer
    /// look.
    pub is_sure: bool,
}

impl<'m> Study<'m> {
    /// How the other law does with the causes of the best answer, where that moves the model by more than responses may err or
    /// leaves much; `None` where it is not worth a look: they do clearly worse there, or a formula that leaves nothing clearly
    /// better here.
    pub(super) fn glance_at_other_law(&self, own: &Ranking) -> Option<Glance> {
        let best = own.best();
        let is_far = || {
            verdict::correction(self, &best.fit.at) > self.options.response_error[1] || verdict::leaves_much(self, best)
        };
        if !self.options.other_tyres || !is_far() {
            return None;
        }
        let in_answer = |index: usize| best.set.contains(&index) && self.variants[index].is_cause();
        let few = self.variants.iter().enumerate();
        let few = few.filter(|(index, variant)| in_answer(*index) || variant.is_of_calibration());
        let few: Vec<Variant> = few.map(|(_, variant)| variant.clone()).collect();
        // A robot that cannot be driven so is no such robot.
        let mut there = self.under_the_other(Candidates::Few(&few)).ok()?;
        let mut candidates = there.known_variants();
        candidates.extend(track(&there));
        let first = there.search(&candidates, &[]);
        let theirs = there.weight(first.best());
        let mut odds = odds_by(self.weight(best), theirs);
        if odds < -SLACK {
            return None;
        }
        // What no known cause takes away here may be none of the tyres' either.
        if let Some(formula) = self.formula(own) {
            odds = odds_by(self.weight(&formula), theirs);
            if odds < -SLACK && !verdict::leaves_much(self, &formula) {
                return None;
            }
        }
        Some(Glance { theirs, is_sure: odds > SURE })
    }

    /// Whether an answer stands against the other law: one cause that leaves nothing but noise. There it takes another cause as
    /// well, and another law besides.
    pub(super) fn stands_alone(&self, own: &Ranking, there: &Glance) -> bool {
        let best = own.best();
        let parts = best.set.iter().filter(|&&index| self.variants[index].is_cause() || self.variants[index].is_term());
        let odds = odds_by(self.weight(best), there.theirs);
        parts.count() <= 1 && odds < -CLEARLY && verdict::leaves_noise(self, best)
    }

    /// Whether an answer here stands, whatever a closer look at those of another law would take away of what they leave by a
    /// first one.
    pub(super) fn stands_against(&self, own: &Ranking, other: &Study<'_>, theirs: &Ranking) -> bool {
        let (own, theirs) = (self.weight(own.best()), theirs.best());
        let left = 0.5 * verdict::misfit_of_means(other, theirs);
        other.repeats() && odds_by(own, other.weight(theirs) + left) < -CLEARLY
    }

    /// The same runs under the other law; `None` where they cannot be simulated.
    pub(super) fn under_the_other_law(&self) -> Option<Box<Study<'m>>> {
        let known = self.other_library.and_then(|known| self.under_the_other(Candidates::All(Some(known))).ok());
        let known = known.filter(|study| study.may_carry());
        known.map_or_else(|| self.under_the_other(Candidates::All(None)), Ok).ok().map(Box::new)
    }

    fn under_the_other(&self, candidates: Candidates<'_>) -> Result<Study<'m>, ForwardError> {
        let runs = Runs {
            cases: self.cases.clone(),
            used: self.held_out.iter().filter(|held_out| !**held_out).count(),
            left_out: self.left_out.clone(),
            prior_noise: self.prior_noise.clone(),
        };
        let base = self.model.on(self.contact().other());
        let mut study = Study::of(base, runs, candidates, self.options.clone(), self.progress)?;
        study.counts.clone_from(&self.counts);
        Ok(study)
    }

    fn contact(&self) -> Contact {
        self.model.scene().contact
    }

    /// ln of the evidence of an answer with its prior, in terms that studies of the same runs share.
    pub(super) fn weight(&self, answer: &Hypothesis) -> f64 {
        answer.log_posterior - self.problem(self.counts.clone()).log_det_of_noise()
    }
}

/// ln of the odds of another law over the model's own, each by its answer. One that leaves much and ends farther off than the
/// own is none, however likely: under a law that is far from these runs causes have to be large, and then what they are allowed
/// to err by takes away any misfit, and stands in no model.
pub(super) fn log_odds(own: &Answer, theirs: &Answer) -> f64 {
    let is_model = !theirs.leaves_much || theirs.ends_off <= own.ends_off;
    if is_model { odds_by(own.weight, theirs.weight) } else { f64::NEG_INFINITY }
}

fn odds_by(own: f64, theirs: f64) -> f64 {
    ANOTHER.ln() + theirs - own
}

/// The answer under another law: that it makes another track is named.
pub(super) fn judge(
    given: &Study<'_>,
    other: &Study<'_>,
    ranking: &Ranking,
    log_odds: f64,
) -> Result<Diagnosis, DiagnoseError> {
    let mut diagnosis = other.judge(given, ranking)?;
    diagnosis.other_tyres = Some(OtherTyres { contact: other.contact(), log_odds });
    if diagnosis.verdict == Verdict::Unexplained {
        return Ok(diagnosis);
    }
    // The same counts turn the robot by so much under each law.
    let (_, most_turning) = given.surrogate.most_turning;
    let [was, is] = [given, other].map(|study| study.surrogate.ways[most_turning].turned());
    let ratio = was / is.max(f64::MIN_POSITIVE) - 1.0;
    let Some(std_dev) = track_std_dev(other, ranking).filter(|std_dev| ratio.abs() > SHOWN * std_dev) else {
        return Ok(diagnosis);
    };
    let sure = 1.0 / (1.0 + (-log_odds).exp());
    let found = diagnosis.findings.iter_mut().find(|finding| finding.effect == CLASS);
    match found.and_then(|finding| finding.parameters.first_mut()) {
        Some(found) => found.value = (1.0 + ratio) * (1.0 + found.value) - 1.0,
        None => {
            let effect = Effect::named(CLASS).expect("it is in the catalogue");
            diagnosis.findings.push(Finding {
                effect: effect.id,
                choice: String::new(),
                parameters: vec![Found { name: effect.parameters[0].name, value: ratio, std_dev: Some(std_dev) }],
                probability: sure,
                confounded_with: Vec::new(),
            });
        }
    }
    if diagnosis.verdict == Verdict::Explained {
        diagnosis.verdict = Verdict::Named;
        (diagnosis.suspicion, diagnosis.next_experiment) = (None, None);
    }
    for answer in diagnosis.ranking.iter_mut().filter(|answer| !answer.effects.iter().any(|id| id == CLASS)) {
        answer.effects.insert(0, CLASS.to_owned());
        answer.causes.insert(0, CLASS.to_owned());
    }
    for (effect, probability) in &mut diagnosis.probabilities {
        match *effect {
            None => *probability *= 1.0 - sure,
            Some(CLASS) => *probability = probability.max(sure),
            Some(_) => {}
        }
    }
    Ok(diagnosis)
}

/// The term of a yaw rate that is off in proportion: any track; `None` where nothing turns.
fn track(study: &Study<'_>) -> Option<usize> {
    let is_track = |term: EmpiricalTerm| term.part == TermPart::Yaw && term.feature == Feature::YawRate;
    study.variants.iter().position(|variant| variant.term().is_some_and(is_track))
}

/// How well the runs know the track: σ of a yaw rate that is off in proportion, beside the best answer.
fn track_std_dev(study: &Study<'_>, ranking: &Ranking) -> Option<f64> {
    let variant = track(study)?;
    let best = ranking.best();
    let mut set = best.set.clone();
    set.insert(variant);
    let fit = study.problem(study.counts.clone()).fit(&axes_of(&study.variants, &set), &best.fit.at);
    fit.std_dev(Axis { variant, coordinate: 0 })
}
