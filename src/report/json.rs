//! The JSON of each command. Keys carry their units; they are part of the interface.

use super::check::CheckJson;
use crate::calibrate::{Calibration, CentreOfGravity, Estimate, MethodOutcome, Parameter, Score};
use crate::diagnose::{Blind, Diagnosis, Gain, Verdict};
use crate::drive::SimulatedRun;
use crate::effect::{Choice, Effect, Prior};
use crate::experiment::sweep::{Merged, Swept};
use crate::experiment::{Candidate, Experiment, MethodResult, SideResult, Stage};
use crate::geometry::Pose2;
use crate::odometry::OdometryCorrection;
use crate::scene::Contact;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// A planar pose.
#[derive(Debug, Clone, Serialize)]
pub struct PoseJson {
    x_m: f64,
    y_m: f64,
    heading_rad: f64,
}

/// `table-one --json`.
pub fn table_one(candidates: &[Candidate]) -> serde_json::Value {
    let entry = |c: &Candidate| {
        let causes: Vec<String> = c.causes.iter().map(crate::effect::Cause::line).collect();
        let effects: Vec<&str> = c.on_top().iter().map(|cause| cause.effect.id).collect();
        serde_json::json!({
            "effects": effects,
            "causes": causes,
            "distances_m": c.distances,
            "chi2": c.chi2,
            "strain_sigma": c.strain,
            "log_evidence": c.log_evidence,
        })
    };
    serde_json::json!({"candidates": candidates.iter().map(entry).collect::<Vec<_>>()})
}

/// `power --json`.
pub fn power(blind: &[Blind], alike: &[(String, String, f64)]) -> serde_json::Value {
    let sizes: Vec<serde_json::Value> = blind
        .iter()
        .map(|b| {
            serde_json::json!({
                "effect": b.effect,
                "choice": b.choice,
                "parameter": b.parameter,
                "smallest_detectable": finite(b.smallest_detectable),
                "plausible": b.plausible,
            })
        })
        .collect();
    let pairs: Vec<serde_json::Value> = alike
        .iter()
        .map(|(one, other, angle)| serde_json::json!({"effects": [one, other], "angle_rad": angle}))
        .collect();
    serde_json::json!({"smallest_detectable": sizes, "alike": pairs})
}

/// `diagnose --json`: the contract's keys. A number that is infinite or undefined is `null`.
#[derive(Debug, Clone, Serialize)]
pub struct DiagnosisJson {
    verdict: &'static str,
    misfit: MisfitJson,
    findings: Vec<FindingJson>,
    ranking: Vec<RankedJson>,
    blind_to: Vec<BlindJson>,
    next_experiment: Option<NextJson>,
    gain: Option<GainJson>,
    empirical: Vec<String>,
    other_tyres: Option<OtherTyresJson>,
    noise: NoiseJson,
    /// Where clocks disagree in several campaigns, by how much in each.
    clocks: Vec<ClockJson>,
    /// What is likelier than nothing where nothing is named.
    suspicion: Option<SuspicionJson>,
    /// Errors that are made good by a run's end, as which what is left is likelier, where the answer leaves much.
    transient: Option<TransientJson>,
    /// What is left of the ends of these runs, by the fit and by the extended model.
    remainder: Option<RemainderJson>,
    left_out: Vec<String>,
    /// What looks wrong with the campaigns themselves, and may be behind the answer.
    looks_wrong: Vec<CheckJson>,
    extended_model: String,
}

#[derive(Debug, Clone, Serialize)]
struct SuspicionJson {
    odds: f64,
    effects: BTreeMap<&'static str, f64>,
}

#[derive(Debug, Clone, Serialize)]
struct TransientJson {
    share: f64,
    log_odds: f64,
}

#[derive(Debug, Clone, Serialize)]
struct RemainderJson {
    position_rmse_fitted_m: f64,
    position_rmse_simulated_m: f64,
}

#[derive(Debug, Clone, Serialize)]
struct OtherTyresJson {
    contact: Contact,
    log_odds: f64,
}

#[derive(Debug, Clone, Serialize)]
struct MisfitJson {
    chi2: f64,
    dof: usize,
    p_value: Option<f64>,
    conditions: Vec<ConditionJson>,
}

#[derive(Debug, Clone, Serialize)]
struct ConditionJson {
    condition: String,
    runs: usize,
    x_m: Option<f64>,
    y_m: Option<f64>,
    heading_rad: Option<f64>,
    std_dev: [Option<f64>; 3],
    repeatability: [Option<f64>; 3],
}

#[derive(Debug, Clone, Serialize)]
struct FindingJson {
    effect: &'static str,
    parameters: BTreeMap<&'static str, serde_json::Value>,
    probability: f64,
    confounded_with: Vec<&'static str>,
}

#[derive(Debug, Clone, Serialize)]
struct RankedJson {
    effects: Vec<String>,
    /// The same with wheel, side or place.
    causes: Vec<String>,
    log_evidence: f64,
    probability: f64,
}

#[derive(Debug, Clone, Serialize)]
struct BlindJson {
    effect: &'static str,
    #[serde(skip_serializing_if = "String::is_empty")]
    choice: String,
    parameter: &'static str,
    smallest_detectable: Option<f64>,
    plausible: f64,
}

#[derive(Debug, Clone, Serialize)]
struct NextJson {
    protocol: String,
    separates: Vec<String>,
    expected_sigma: f64,
}

#[derive(Debug, Clone, Serialize)]
struct GainJson {
    position_rmse_before_m: f64,
    position_rmse_after_m: f64,
    heading_rmse_before_rad: Option<f64>,
    heading_rmse_after_rad: Option<f64>,
    interval: [f64; 2],
    noise_floor_m: f64,
    /// What was to be left after, by the answer's own intervals.
    position_rmse_expected_m: f64,
    held_out: String,
    /// The same on repeats, where other conditions show no sure gain.
    on_repeats: Option<Box<GainJson>>,
}

impl From<&Gain> for GainJson {
    fn from(gain: &Gain) -> Self {
        GainJson {
            position_rmse_before_m: gain.position_before,
            position_rmse_after_m: gain.position_after,
            heading_rmse_before_rad: finite(gain.heading_before),
            heading_rmse_after_rad: finite(gain.heading_after),
            interval: gain.interval,
            noise_floor_m: gain.noise_floor,
            position_rmse_expected_m: gain.position_expected,
            held_out: gain.held_out.clone(),
            on_repeats: gain.on_repeats.as_deref().map(|gain| Box::new(GainJson::from(gain))),
        }
    }
}

#[derive(Debug, Clone, Serialize)]
struct NoiseJson {
    position_std_m: f64,
    heading_std_rad: f64,
    correlation_time_s: f64,
    heading_per_corner_rad: f64,
    heading_per_sqrt_metre_rad: f64,
    distance: f64,
    clock_std_s: f64,
}

#[derive(Debug, Clone, Serialize)]
struct ClockJson {
    campaign: String,
    offset_s: f64,
    std_dev: f64,
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

impl DiagnosisJson {
    /// `looks_wrong` is of the campaigns with which something does, `extended_model` the absolute path of the written model.
    pub fn new(
        diagnosis: &Diagnosis,
        gain: Option<&Gain>,
        looks_wrong: Vec<CheckJson>,
        extended_model: &Path,
    ) -> DiagnosisJson {
        let finding = |finding: &crate::diagnose::Finding| {
            let mut parameters: BTreeMap<&'static str, serde_json::Value> = BTreeMap::new();
            for found in &finding.parameters {
                let std_dev = found.std_dev.and_then(finite);
                parameters.insert(found.name, serde_json::json!({"value": finite(found.value), "std_dev": std_dev}));
            }
            if let Some(choice) = Effect::named(finding.effect).and_then(|effect| effect.choice) {
                parameters.insert(choice.key(), serde_json::json!({"value": finding.choice, "std_dev": null}));
            }
            FindingJson {
                effect: finding.effect,
                parameters,
                probability: finding.probability,
                confounded_with: finding.confounded_with.clone(),
            }
        };
        let noise = &diagnosis.noise;
        DiagnosisJson {
            verdict: match diagnosis.verdict {
                Verdict::Explained => "explained",
                Verdict::Named => "named",
                Verdict::Ambiguous => "ambiguous",
                Verdict::Unexplained => "unexplained",
            },
            misfit: MisfitJson {
                chi2: diagnosis.misfit.chi2,
                dof: diagnosis.misfit.dof,
                p_value: finite(diagnosis.misfit.p_value),
                conditions: diagnosis
                    .misfit
                    .conditions
                    .iter()
                    .map(|c| ConditionJson {
                        condition: c.label.clone(),
                        runs: c.runs,
                        x_m: c.residual[0],
                        y_m: c.residual[1],
                        heading_rad: c.residual[2],
                        std_dev: c.std_dev.map(finite),
                        repeatability: c.repeatability,
                    })
                    .collect(),
            },
            findings: diagnosis.findings.iter().map(finding).collect(),
            ranking: diagnosis
                .ranking
                .iter()
                .map(|r| RankedJson {
                    effects: r.effects.clone(),
                    causes: r.causes.clone(),
                    log_evidence: r.log_evidence,
                    probability: r.probability,
                })
                .collect(),
            blind_to: diagnosis
                .blind_to
                .iter()
                .map(|b| BlindJson {
                    effect: b.effect,
                    choice: b.choice.clone(),
                    parameter: b.parameter,
                    smallest_detectable: finite(b.smallest_detectable),
                    plausible: b.plausible,
                })
                .collect(),
            next_experiment: diagnosis.next_experiment.as_ref().map(|next| NextJson {
                protocol: next.protocol.clone(),
                separates: next.separates.clone(),
                expected_sigma: next.expected_sigma,
            }),
            gain: gain.map(GainJson::from),
            empirical: diagnosis.empirical.iter().map(ToString::to_string).collect(),
            other_tyres: diagnosis
                .other_tyres
                .map(|other| OtherTyresJson { contact: other.contact, log_odds: other.log_odds }),
            noise: NoiseJson {
                position_std_m: noise.position_std,
                heading_std_rad: noise.heading_std,
                correlation_time_s: noise.correlation_time,
                heading_per_corner_rad: noise.scatter.heading_per_corner,
                heading_per_sqrt_metre_rad: noise.scatter.heading_per_sqrt_metre,
                distance: noise.scatter.distance,
                clock_std_s: noise.clock_std,
            },
            clocks: diagnosis
                .clocks
                .iter()
                .map(|c| ClockJson { campaign: c.campaign.clone(), offset_s: c.offset, std_dev: c.std_dev })
                .collect(),
            suspicion: diagnosis
                .suspicion
                .as_ref()
                .map(|it| SuspicionJson { odds: it.odds, effects: it.effects.iter().copied().collect() }),
            transient: diagnosis.transient.map(|it| TransientJson { share: it.share, log_odds: it.log_odds }),
            remainder: diagnosis
                .remainder
                .map(|it| RemainderJson { position_rmse_fitted_m: it.fitted, position_rmse_simulated_m: it.simulated }),
            left_out: diagnosis.left_out.clone(),
            looks_wrong,
            extended_model: extended_model.to_string_lossy().into_owned(),
        }
    }
}

/// `drive --json`.
#[derive(Debug, Clone, Serialize)]
pub struct DriveJson {
    actual: PoseJson,
    odometry: PoseJson,
    simulated_s: f64,
    wall_s: f64,
    steps: u64,
}

/// A centre of gravity of end-point errors.
#[derive(Debug, Clone, Serialize)]
pub struct CentreJson {
    x_m: f64,
    y_m: f64,
    heading_rad: Option<f64>,
    r_m: f64,
}

/// The squares of one side length.
#[derive(Debug, Clone, Serialize)]
pub struct SideJson {
    side_m: f64,
    cw: CentreJson,
    ccw: CentreJson,
    e_max_syst_m: f64,
}

/// Corrections to what the robot believed.
#[derive(Debug, Clone, Serialize)]
pub struct EstimateJson {
    diameter_ratio: f64,
    track_ratio: f64,
    distance_scale: f64,
}

/// One method calibrated on one side.
#[derive(Debug, Clone, Serialize)]
pub struct MethodJson {
    method: &'static str,
    calibrated_on_side_m: f64,
    estimate: EstimateJson,
    after: Vec<SideJson>,
    improvement: Option<f64>,
}

/// `experiment --json`.
#[derive(Debug, Clone, Serialize)]
pub struct ExperimentJson {
    robot: String,
    seed: u64,
    before: Vec<SideJson>,
    methods: Vec<MethodJson>,
}

impl From<Pose2> for PoseJson {
    fn from(pose: Pose2) -> Self {
        PoseJson { x_m: pose.x, y_m: pose.y, heading_rad: pose.heading }
    }
}

impl From<&SimulatedRun> for DriveJson {
    fn from(run: &SimulatedRun) -> Self {
        DriveJson {
            actual: run.actual.into(),
            odometry: run.odometry.into(),
            simulated_s: run.simulated,
            wall_s: run.wall.as_secs_f64(),
            steps: run.steps,
        }
    }
}

impl From<&CentreOfGravity> for CentreJson {
    fn from(centre: &CentreOfGravity) -> Self {
        CentreJson { x_m: centre.x, y_m: centre.y, heading_rad: centre.heading, r_m: centre.distance() }
    }
}

impl From<&SideResult> for SideJson {
    fn from(side: &SideResult) -> Self {
        SideJson { side_m: side.side, cw: (&side.cw).into(), ccw: (&side.ccw).into(), e_max_syst_m: side.e_max_syst() }
    }
}

impl From<&OdometryCorrection> for EstimateJson {
    fn from(estimate: &OdometryCorrection) -> Self {
        EstimateJson {
            diameter_ratio: estimate.diameter_ratio,
            track_ratio: estimate.track_ratio,
            distance_scale: estimate.distance_scale,
        }
    }
}

impl ExperimentJson {
    /// The JSON of `experiment` driven with `seed`.
    pub fn new(seed: u64, experiment: &Experiment) -> Self {
        let sides = |stage: &Stage| stage.sides.iter().map(SideJson::from).collect();
        let method = |result: &MethodResult| MethodJson {
            method: result.method,
            calibrated_on_side_m: result.calibrated_on_side,
            estimate: (&result.estimate.correction()).into(),
            after: sides(&result.after),
            improvement: result.improvement(&experiment.before),
        };
        ExperimentJson {
            robot: experiment.robot.clone(),
            seed,
            before: sides(&experiment.before),
            methods: experiment.methods.iter().map(method).collect(),
        }
    }
}

/// A corrected quantity; an infinite or unknown σ is `null`.
#[derive(Debug, Clone, Serialize)]
pub struct ParameterJson {
    value: f64,
    std_dev: Option<f64>,
}

/// Corrections with their σ.
#[derive(Debug, Clone, Serialize)]
pub struct UncertainJson {
    diameter_ratio: ParameterJson,
    track_ratio: ParameterJson,
    distance_scale: ParameterJson,
    not_fixed: Option<&'static str>,
}

/// Errors of predicted end points before and after; an undefined one is `null`.
#[derive(Debug, Clone, Serialize)]
pub struct ScoreJson {
    position_rmse_before_m: f64,
    position_rmse_after_m: f64,
    heading_rmse_before_rad: Option<f64>,
    heading_rmse_after_rad: Option<f64>,
    e_max_syst_before_m: Option<f64>,
    e_max_syst_after_m: Option<f64>,
}

/// What a method's approximations bias its estimate by.
#[derive(Debug, Clone, Serialize)]
pub struct BiasJson {
    diameter_ratio: f64,
    track_over_scale: f64,
    distance_scale: f64,
}

/// One method of `calibrate --json`.
#[derive(Debug, Clone, Serialize)]
pub struct OutcomeJson {
    method: &'static str,
    applicable: bool,
    reason: Option<String>,
    estimate: Option<UncertainJson>,
    bias: Option<BiasJson>,
    in_sample: Option<ScoreJson>,
    held_out: Option<ScoreJson>,
}

/// `calibrate --json`.
#[derive(Debug, Clone, Serialize)]
pub struct CalibrationJson {
    methods: Vec<OutcomeJson>,
    best: Option<&'static str>,
    held_out_by: &'static str,
    model_is_enough: Option<bool>,
}

impl From<&Parameter> for ParameterJson {
    fn from(parameter: &Parameter) -> Self {
        ParameterJson { value: parameter.value, std_dev: Some(parameter.std_dev).filter(|std_dev| std_dev.is_finite()) }
    }
}

impl From<&Estimate> for UncertainJson {
    fn from(estimate: &Estimate) -> Self {
        UncertainJson {
            diameter_ratio: (&estimate.diameter_ratio).into(),
            track_ratio: (&estimate.track_ratio).into(),
            distance_scale: (&estimate.distance_scale).into(),
            not_fixed: estimate.not_fixed,
        }
    }
}

impl From<&Score> for ScoreJson {
    fn from(score: &Score) -> Self {
        let finite = |value: f64| Some(value).filter(|value| value.is_finite());
        ScoreJson {
            position_rmse_before_m: score.position_rmse_before,
            position_rmse_after_m: score.position_rmse_after,
            heading_rmse_before_rad: finite(score.heading_rmse_before),
            heading_rmse_after_rad: finite(score.heading_rmse_after),
            e_max_syst_before_m: score.e_max_syst_before,
            e_max_syst_after_m: score.e_max_syst_after,
        }
    }
}

impl From<&Calibration> for CalibrationJson {
    fn from(calibration: &Calibration) -> Self {
        let outcome = |outcome: &MethodOutcome| OutcomeJson {
            method: outcome.method.name,
            applicable: outcome.estimate.is_ok(),
            reason: outcome.estimate.as_ref().err().map(ToString::to_string),
            estimate: outcome.estimate.as_ref().ok().map(UncertainJson::from),
            bias: outcome.bias.map(|[diameter_ratio, track_over_scale, distance_scale]| BiasJson {
                diameter_ratio,
                track_over_scale,
                distance_scale,
            }),
            in_sample: outcome.in_sample.as_ref().map(ScoreJson::from),
            held_out: outcome.held_out.as_ref().map(ScoreJson::from),
        };
        CalibrationJson {
            methods: calibration.outcomes.iter().map(outcome).collect(),
            best: calibration.best().map(|best| best.method.name),
            held_out_by: if calibration.held_out_by_name { "dataset" } else { "folds by run" },
            model_is_enough: calibration.model_is_enough(),
        }
    }
}

/// `effects --json`: one entry of the registry.
#[derive(Debug, Clone, Serialize)]
pub struct EffectJson {
    effect: &'static str,
    family: &'static str,
    cause: &'static str,
    shown_by: &'static str,
    source: &'static str,
    choice: Option<&'static str>,
    parameters: Vec<EffectParameterJson>,
}

/// One parameter of an effect; its name carries its unit.
#[derive(Debug, Clone, Serialize)]
pub struct EffectParameterJson {
    name: &'static str,
    meaning: &'static str,
    least: f64,
    greatest: f64,
    prior: &'static str,
    prior_mean: Option<f64>,
    prior_std_dev: Option<f64>,
}

impl EffectJson {
    /// The entry of `effect`.
    pub fn new(effect: &Effect) -> EffectJson {
        let parameters = effect.parameters.iter().map(|parameter| {
            let (prior, prior_mean, prior_std_dev) = match parameter.prior {
                Prior::Normal { mean, std_dev } => ("normal", Some(mean), Some(std_dev)),
                Prior::HalfNormal { std_dev } => ("half_normal", None, Some(std_dev)),
                Prior::AnyHeading => ("any_heading", None, None),
                Prior::OnPath => ("on_path", None, None),
                Prior::Known(value) => ("known", Some(value), None),
            };
            let [least, greatest] = parameter.bounds;
            let (name, meaning) = (parameter.name, parameter.meaning);
            EffectParameterJson { name, meaning, least, greatest, prior, prior_mean, prior_std_dev }
        });
        EffectJson {
            effect: effect.id,
            family: effect.family.as_str(),
            cause: effect.cause,
            shown_by: effect.shown_by,
            source: effect.source,
            choice: effect.choice.map(Choice::key),
            parameters: parameters.collect(),
        }
    }
}

/// `sweep --json`.
#[derive(Debug, Clone, Serialize)]
pub struct SweptJson {
    points: usize,
    done_before: usize,
    failures: usize,
    simulated_s: Option<f64>,
    wall_s: Option<f64>,
    table: Option<String>,
}

impl SweptJson {
    /// Of a sweep that took `wall`.
    pub fn new(swept: &Swept, wall: std::time::Duration) -> SweptJson {
        SweptJson {
            points: swept.progress.points,
            done_before: swept.progress.before,
            failures: swept.failures.len(),
            simulated_s: Some(swept.progress.simulated),
            wall_s: Some(wall.as_secs_f64()),
            table: swept.table.as_ref().map(|table| table.display().to_string()),
        }
    }

    /// Of shards put together.
    pub fn merged(merged: &Merged) -> SweptJson {
        SweptJson {
            points: merged.points,
            done_before: merged.points,
            failures: merged.failures,
            simulated_s: None,
            wall_s: None,
            table: Some(merged.table.display().to_string()),
        }
    }
}
