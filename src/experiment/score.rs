//! Scoring of hidden-effect challenges against an oracle that knows the true scene.

use super::challenge::{CampaignKind, Challenge, DataKind, Draw, EffectsKind, drive_campaign, surveyed};
use super::predict::predict;
use super::simulator::Simulator;
use super::stage::campaign;
use crate::dataset::{Dataset, Run};
use crate::diagnose::{
    DiagnoseError, Diagnosis, ForwardError, ForwardModel, Library, NoiseModel, Options, Study, Verdict,
};
use crate::drive::{self, DriveError};
use crate::effect::Cause;
use crate::scene::{Contact, Doubt, Scene};
use rayon::prelude::*;
use std::collections::BTreeMap;
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

/// ln of the odds within which the oracle holds effects for alike: 50.
const ALIKE: f64 = 3.912_023_005_428_146;

/// Draws, diagnoses with these options and scores a range of seeds; `watch` is told of each.
///
/// # Errors
/// A run that cannot be driven or diagnosed.
pub fn score(
    base: &Scene,
    challenge: Challenge,
    seeds: std::ops::Range<u64>,
    options: &Options,
    watch: &mut dyn FnMut(&Scored),
    stop: &AtomicBool,
) -> Result<Score, ScoreError> {
    // The world is made of the model: but for another tyre law, nothing of it is in doubt.
    let mut base = base.clone();
    base.robot.doubt = Doubt::default();
    let base = &base;
    let simulator = Simulator::new(base, stop);
    let on_tyres = |contact| -> Result<Library, ScoreError> {
        let scene = Scene { contact, ..base.clone() };
        library(&Simulator::new(&scene, stop), challenge.campaign, challenge.data)
    };
    let libraries = Libraries {
        contact: base.contact,
        given: on_tyres(base.contact)?,
        // In a world of the diagnosis' own tyres hardly any draw comes to asking for others.
        other: challenge.mismatch.then(|| on_tyres(base.contact.other())).transpose()?,
    };
    let mut draws = Vec::new();
    // Side by side, told in order.
    let seeds: Vec<u64> = seeds.collect();
    for seeds in seeds.chunks(rayon::current_num_threads()) {
        let scored: Vec<Scored> = seeds
            .par_iter()
            .map(|&seed| one(base, &simulator, &libraries, Challenge { seed, ..challenge }, options, stop))
            .collect::<Result<_, _>>()?;
        scored.iter().for_each(&mut *watch);
        draws.extend(scored);
    }
    let nameable = |scored: &&Scored| {
        !scored.truth.is_empty() && scored.oracle_set.len() == scored.truth.len() && scored.strength >= 5.0
    };
    let oracle_nameable = draws.iter().filter(nameable).count();
    Ok(Score { draws, oracle_nameable })
}

/// A campaign that nobody has driven: one run a condition without noise, and how many each stands for.
///
/// # Errors
/// A run that cannot be driven.
pub fn planned(
    scene: &Scene,
    kind: CampaignKind,
    data: DataKind,
    stop: &AtomicBool,
) -> Result<(Dataset, Vec<usize>), DriveError> {
    noise_free(scene, scene, kind, data, stop)
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
fn library(simulator: &Simulator<'_>, kind: CampaignKind, data: DataKind) -> Result<Library, ScoreError> {
    let scene = surveyed(simulator.scene());
    let (dataset, _) = noise_free(&scene, &scene, kind, data, simulator.stop())?;
    let study = Study::new(&[dataset], &[], simulator, Options::default(), None, &|_, _| {})?;
    Ok(study.library())
}

/// A campaign without noise: one run a condition, and how many of the campaign's runs it stands for. Where tyres grow, all.
fn noise_free(
    world: &Scene,
    base: &Scene,
    kind: CampaignKind,
    data: DataKind,
    stop: &AtomicBool,
) -> Result<(Dataset, Vec<usize>), DriveError> {
    let scene = world.clone().noise_free();
    let mut tasks: Vec<(drive::Task, usize)> = Vec::new();
    for task in kind.tasks(base) {
        let alike = |(known, _): &&mut (drive::Task, usize)| {
            scene.robot.tyre_growth == 0.0
                && known.protocol == task.protocol
                && known.speed == task.speed
                && known.turn_rate == task.turn_rate
        };
        match tasks.iter_mut().find(alike) {
            Some((_, count)) => *count += 1,
            None => tasks.push((task, 1)),
        }
    }
    let runs: Vec<Run> = tasks
        .par_iter()
        .map(|(task, _)| {
            let mut run = drive::run(&scene, task, 0, None, stop)?.measured;
            if data == DataKind::EndPoints {
                (run.encoders, run.poses) = (None, None);
            }
            Ok(run)
        })
        .collect::<Result<_, DriveError>>()?;
    let mut facts = campaign(world, "noise-free");
    facts.odometry = Some(base.robot.odometry);
    Ok((Dataset { campaign: facts, runs }, tasks.into_iter().map(|(_, count)| count).collect()))
}

fn one(
    base: &Scene,
    simulator: &Simulator<'_>,
    libraries: &Libraries,
    challenge: Challenge,
    options: &Options,
    stop: &AtomicBool,
) -> Result<Scored, ScoreError> {
    let draw = challenge.draw(base, stop)?;
    let began = Instant::now();
    // With another tyre law the model is first extended on a clean campaign of that world, as a user would.
    let extended = match &draw.clean_dataset {
        None => None,
        Some(clean) => {
            let mut study = study_of(clean, simulator, options, Some(libraries))?;
            let found = study.diagnose()?;
            let extended = found.extended(base, study.gain()?.map_or(0.0, |gain| gain.motion_error));
            // A model that was moved by more than responses may err answers causes otherwise.
            let is_near = found.doubt.response < options.response_error[1];
            Some((Simulator::new(&extended, stop), is_near.then_some(libraries)))
        }
    };
    let (model, known) = match &extended {
        None => (simulator, Some(libraries)),
        Some((model, known)) => (model, *known),
    };
    let mut study = study_of(&draw.dataset, model, options, known)?;
    let diagnosis = study.diagnose()?;
    let seconds = began.elapsed().as_secs_f64();
    let held_out = study.gain()?;
    drop(study);
    let given = model.scene();
    let answered =
        diagnosis.extended(given, held_out.as_ref().map_or(given.robot.doubt.motion, |gain| gain.motion_error));

    // The oracle knows the world without what was hidden, its noise, and what was hidden without noise.
    let (dataset, counts) = noise_free(&draw.world, &draw.clean, challenge.campaign, challenge.data, stop)?;
    let known = NoiseModel {
        position_std: draw.clean.survey.position_std,
        heading_std: draw.clean.survey.heading_std,
        correlation_time: draw.clean.survey.correlation_time,
        scatter: draw.clean.scatter,
        clock_std: 0.0,
    };
    let sure = Options { noise: Some(known), response_error: [0.0; 2], ..Options::default() };
    let truth_simulator = Simulator::new(&draw.clean, stop);
    let of_world = libraries.on(draw.clean.contact);
    let truth_model = if challenge.mismatch { &truth_simulator } else { simulator };
    let of_oracle = oracle_error(&draw.dataset, &dataset);
    // What a replay gets wrong of its own world is no response: the oracle is shown the world's replay, not its drive.
    let dataset = match challenge.data {
        DataKind::Logs => predict(&dataset, &Simulator::new(&draw.world, stop))?.0,
        DataKind::EndPoints => dataset,
    };
    let oracle = Study::new(&[dataset], &[], truth_model, sure, of_world, &|_, _| {})?.repeated(&counts);
    let mut scored = judge(&challenge, &draw, &diagnosis, &oracle, seconds);
    if scored.strength >= 5.0 && challenge.effects != EffectsKind::None {
        scored.gain = held_out.map(|gain| {
            let before = gain.position_before;
            [1.0 - gain.position_after / before, 1.0 - of_oracle / before]
        });
        let seed = drive::derived_seed(challenge.seed, "fresh");
        let fresh = drive_campaign(&draw.world, challenge.campaign, challenge.data, seed, "fresh", stop)?;
        let left = |scene| -> Result<f64, ScoreError> {
            Ok(error_of_ends(&fresh, &predict(&fresh, &Simulator::new(scene, stop))?.0))
        };
        let [before, after, of_oracle] = [given, &answered, &draw.world].map(left);
        let before = before?;
        scored.gain_on_fresh = Some([after?, of_oracle?].map(|left| 1.0 - left / before));
    }
    Ok(scored)
}

/// What the command works on: `known` responses, on the model's tyres and on others, serve where the misfit is not so strong
/// that they have to be simulated anew.
fn study_of<'m>(
    dataset: &Dataset,
    model: &'m Simulator<'_>,
    options: &Options,
    known: Option<&'m Libraries>,
) -> Result<Study<'m>, DiagnoseError> {
    let contact = model.scene().contact;
    let [known, other] = [contact, contact.other()].map(|contact| known.and_then(|known| known.on(contact)));
    let of = |known| Study::new(std::slice::from_ref(dataset), &[], model, options.clone(), known, &|_, _| {});
    let study = of(known)?;
    let study = if known.is_some() && !study.may_carry() { of(None)? } else { study };
    Ok(study.knowing_other_tyres(other))
}

/// RMS distance of surveyed ends from the truth's without noise \[m\]: what an oracle leaves.
fn oracle_error(measured: &Dataset, noise_free: &Dataset) -> f64 {
    let mut squares = Vec::new();
    for run in &measured.runs {
        let alike = |known: &&Run| {
            known.protocol == run.protocol && known.speed == run.speed && known.turn_rate == run.turn_rate
        };
        let all: Vec<&Run> = noise_free.runs.iter().filter(alike).collect();
        let truth = all.iter().find(|known| known.started == run.started).or(all.first());
        if let (Some(end), Some(truth)) = (run.end, truth.and_then(|truth| truth.end)) {
            squares.push((end.x - truth.x).powi(2) + (end.y - truth.y).powi(2));
        }
    }
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// The name that an effect goes by: friction across is the effective track on two axles.
fn class<'a>(id: &'a str, scene: &Scene) -> &'a str {
    if id == "tyre_grip_anisotropy" && scene.robot.wheelbase() > 0.0 { "effective_track" } else { id }
}

/// RMS distance of surveyed ends from those of the same runs as predicted \[m\].
fn error_of_ends(measured: &Dataset, predicted: &Dataset) -> f64 {
    let squares: Vec<f64> = predicted
        .runs
        .iter()
        .filter_map(|run| {
            let end = measured.runs.iter().find(|known| known.name == run.name)?.end?;
            let predicted = run.end?;
            Some((end.x - predicted.x).powi(2) + (end.y - predicted.y).powi(2))
        })
        .collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

fn judge(challenge: &Challenge, draw: &Draw, diagnosis: &Diagnosis, oracle: &Study<'_>, seconds: f64) -> Scored {
    let truth: Vec<&str> = draw.causes.iter().map(|cause| class(cause.effect.id, &draw.clean)).collect();
    let strength = oracle.strength();
    let (nothing, evidences) = oracle.single_evidences();
    let evidence_of = |id: &str| evidences.iter().find(|(known, _)| *known == id).map(|(_, value)| *value);
    let pair = <[&str; 2]>::try_from(truth.as_slice()).ok().and_then(|pair| oracle.pair_evidence(pair));
    let oracle_set: Vec<&'static str> = match truth.as_slice() {
        [_, _] if pair.is_some_and(|pair| pair.both > pair.fewer.max(pair.other) + ALIKE) => {
            draw.causes.iter().map(|cause| cause.effect.id).collect()
        }
        [id] => {
            // A spot on the floor has no single evidence without its place: what the data say at best is all of the misfit.
            let own = evidence_of(id).unwrap_or(nothing + 0.5 * strength * strength - 8.0);
            let mut set: Vec<&'static str> = evidences
                .iter()
                .filter(|(known, value)| known == id || *value > own - ALIKE)
                .map(|(k, _)| *k)
                .collect();
            if !set.contains(id) {
                set.push(draw.causes[0].effect.id);
            }
            set
        }
        _ => Vec::new(),
    };
    let answers: Vec<Vec<&str>> = diagnosis
        .findings
        .iter()
        .map(|finding| std::iter::once(finding.effect).chain(finding.confounded_with.iter().copied()).collect())
        .collect();
    let holds = |answer: &[&str], id: &str| {
        answer.contains(&id) || (id == "load_offset_longitudinal" && answer.contains(&"effective_track"))
    };
    let silent = answers.is_empty() && diagnosis.verdict != Verdict::Unexplained;
    let wrong = answers.iter().any(|answer| !truth.iter().any(|id| holds(answer, id)));
    let tally = match (challenge.effects, truth.as_slice()) {
        (EffectsKind::Outside, _) => {
            // A mimic is true if it takes away what can be taken away.
            let mimic = answers.len() == 1 && {
                let best = evidences.iter().map(|(_, value)| *value).fold(nothing, f64::max);
                answers[0].iter().any(|id| evidence_of(id).is_some_and(|value| value > best - ALIKE))
                    && best > nothing + 0.4 * strength * strength
            };
            match () {
                () if strength < 5.0 && silent => Tally::SilentRightly,
                () if diagnosis.verdict == Verdict::Unexplained || mimic => Tally::Unexplained,
                () if silent => Tally::Missed,
                () => Tally::Wrong,
            }
        }
        (_, []) if silent => Tally::Clean,
        (_, []) => Tally::FalseAlarm,
        (_, [id]) => match () {
            () if silent && strength >= 5.0 => Tally::Missed,
            () if silent => Tally::SilentRightly,
            () if wrong || answers.is_empty() || strength < 1.0 => Tally::Wrong,
            () => {
                let size = answers.iter().filter(|answer| holds(answer, id)).map(Vec::len).max().unwrap_or(0);
                match () {
                    () if size == 1 => Tally::Named,
                    () if size <= oracle_set.len() + 1 => Tally::RightGroup,
                    () if size <= 2 * oracle_set.len() => Tally::Half,
                    // Below 5 σ only a wrong name counts against an answer.
                    () if strength < 5.0 => Tally::SilentRightly,
                    () => Tally::Missed,
                }
            }
        },
        (_, both) => {
            let all = both.iter().all(|id| answers.iter().any(|answer| holds(answer, id)));
            let called_for = pair.is_some_and(|pair| pair.both > pair.fewer + ALIKE);
            match () {
                () if wrong => Tally::Wrong,
                () if !called_for => Tally::AsFarAsCalledFor,
                () if all && answers.len() == both.len() && answers.iter().all(|answer| answer.len() == 1) => {
                    Tally::BothExact
                }
                () if all => Tally::BothInSets,
                () => Tally::Missed,
            }
        }
    };
    let mut intervals = Vec::new();
    for cause in &draw.causes {
        let finding = diagnosis.findings.iter().find(|f| f.effect == cause.effect.id && f.choice == cause.choice);
        let Some(finding) = finding.filter(|finding| finding.confounded_with.is_empty()) else { continue };
        for ((found, &value), parameter) in finding.parameters.iter().zip(&cause.values).zip(cause.effect.parameters) {
            if let Some(std_dev) = found.std_dev {
                let off = parameter.difference(found.value, value) / std_dev;
                intervals.push(Interval { effect: finding.effect, parameter: found.name, off });
            }
        }
    }
    let regret = match truth.as_slice() {
        [] => diagnosis.probabilities.iter().find(|(id, _)| id.is_none()).map(|(_, p)| -p.max(1e-6).ln()),
        [id] if strength >= 5.0 => {
            let total: f64 =
                evidences.iter().map(|(_, value)| (value - evidence_of(id).unwrap_or(nothing)).exp()).sum();
            diagnosis
                .probabilities
                .iter()
                .find(|(known, _)| known.as_deref() == Some(id))
                .map(|(_, p)| -total.max(1.0).ln() - p.max(1e-6).ln())
        }
        _ => None,
    };
    let detectable_ratio = ratios(diagnosis, oracle);
    let answer = match diagnosis.findings.as_slice() {
        [] => format!("{:?}", diagnosis.verdict).to_lowercase(),
        findings => findings
            .iter()
            .map(|f| {
                let mut line = f.effect.to_owned();
                if !f.confounded_with.is_empty() {
                    line = format!("{line} or {}", f.confounded_with.join(" or "));
                }
                line
            })
            .collect::<Vec<_>>()
            .join(" and "),
    };
    let mut described: Vec<String> = draw.causes.iter().map(Cause::line).collect();
    described.extend(draw.outside.clone());
    Scored {
        seed: challenge.seed,
        truth: described,
        strength,
        oracle_set,
        answer,
        tally,
        intervals,
        set_size: answers.iter().map(Vec::len).max(),
        regret,
        detectable_ratio,
        gain: None,
        gain_on_fresh: None,
        seconds,
    }
}

/// Smallest detectable sizes of the diagnosis over the oracle's.
fn ratios(diagnosis: &Diagnosis, oracle: &Study<'_>) -> Vec<f64> {
    let of_oracle: BTreeMap<(&str, String, &str), f64> = oracle
        .blind()
        .into_iter()
        .map(|blind| ((blind.effect, blind.choice, blind.parameter), blind.smallest_detectable))
        .collect();
    diagnosis
        .blind_to
        .iter()
        .filter_map(|blind| {
            let known = of_oracle.get(&(blind.effect, blind.choice.clone(), blind.parameter))?;
            let ratio = blind.smallest_detectable / known;
            ratio.is_finite().then_some(ratio)
        })
        .collect()
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
