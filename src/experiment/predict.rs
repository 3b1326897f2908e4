//! A model at work: poses of runs that nobody surveyed.

use super::simulator::{Simulator, task_of};
use crate::dataset::{Dataset, PoseLog, Run, SurveyFacts};
use crate::diagnose::{ForwardError, ForwardModel};
use crate::odometry::OdometryParameters;
use crate::scene::Robot;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The runs of `dataset` as `simulator` predicts them: end poses and, where there is an encoder log, a pose at every row of
/// it, each as the model's survey would read it in the frame of the start. Surveyed poses of the dataset are not looked at,
/// but for where in the room a run began. Runs that cannot be predicted are named with the reason.
///
/// # Errors
/// A run that cannot be simulated.
pub fn predict(dataset: &Dataset, simulator: &Simulator<'_>) -> Result<(Dataset, Vec<String>), ForwardError> {
    let scene = simulator.scene();
    let believed = dataset.campaign.odometry.unwrap_or(scene.robot.odometry);
    let counted = OdometryParameters {
        ticks_per_revolution: believed.ticks_per_revolution.or(scene.robot.odometry.ticks_per_revolution),
        ..believed
    };
    let (known, unknown): (Vec<_>, Vec<_>) =
        dataset.runs.iter().partition(|run| run.log().is_some() || run.protocol.nominal_end().is_some());
    let first_alike = |run: &Run| known.iter().position(|other| is_alike(&scene.robot, other, run));
    let zero = dataset.clock_zero();
    let firsts: Vec<Option<usize>> = known.iter().map(|run| first_alike(run)).collect();
    let simulated = known
        .par_iter()
        .enumerate()
        .filter(|(index, _)| firsts[*index] == Some(*index))
        .map(|(index, run)| {
            let trace = simulator.trace(scene, run, &counted)?;
            let start = trace.poses[0];
            let poses = run.log().map(|log| PoseLog {
                time: log.time.iter().map(|&time| zero + scene.survey.stamp(time - zero)).collect(),
                poses: log.time.iter().map(|&time| scene.survey.reading(start, trace.at(time)).into()).collect(),
            });
            let last = trace.poses[trace.poses.len() - 1];
            Ok((index, (scene.survey.reading(start, last), poses)))
        })
        .collect::<Result<BTreeMap<_, _>, ForwardError>>()?;
    let predicted = |(run, first): (&&Run, &Option<usize>)| {
        let (end, poses) = first.and_then(|first| simulated.get(&first)).expect("a run is like itself");
        Run { end: Some((*end).into()), poses: poses.clone(), ..(*run).clone() }
    };
    let runs = known.iter().zip(&firsts).map(predicted).collect();
    let mut campaign = dataset.campaign.clone();
    campaign.name = format!("{}-predicted", campaign.name);
    campaign.description = Some(format!("Predicted by treadmark with {}", scene.robot.file.display()));
    campaign.survey = SurveyFacts { method: Some("predicted".to_owned()), position_std: None, heading_std: None };
    let left_out = unknown.iter().map(|run| format!("run `{}`: without a log, its way is not known", run.name));
    Ok((Dataset { campaign, runs }, left_out.collect()))
}

/// Whether a simulation of `one`, which knows no noise, is one of `other`: both are driven by the robot itself, and alike.
fn is_alike(robot: &Robot, one: &Run, other: &Run) -> bool {
    let by_itself = one.log().is_none() && other.log().is_none();
    std::ptr::eq(one, other) || (by_itself && task_of(one).is_alike(&task_of(other), robot))
}
