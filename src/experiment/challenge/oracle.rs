//! Whoever knows the world: what a draw could show, and what of its ends can be foretold at best.

use super::campaign::{DataKind, noise_free};
use super::score::ScoreError;
use super::{Challenge, Draw};
use crate::dataset::Dataset;
use crate::diagnose::{Library, NoiseModel, Options, Study};
use crate::experiment::{Simulator, predict};
use crate::scene::Scene;
use std::sync::atomic::AtomicBool;

/// The world as it is without noise, held against the world without what was hidden, which `clean` simulates, by one who knows
/// both and the noise.
pub(super) fn oracle<'m>(
    challenge: &Challenge,
    draw: &Draw,
    clean: &'m Simulator<'_>,
    library: Option<&Library>,
) -> Result<Study<'m>, ScoreError> {
    let stop = clean.stop();
    let (dataset, counts) = noise_free(&draw.world, &draw.clean, challenge.campaign, challenge.data, stop)?;
    // What a replay gets wrong of its own world is no response: the oracle is shown the world's replay, not its drive.
    let dataset = match challenge.data {
        DataKind::Logs => predict(&dataset, &Simulator::new(&draw.world, stop))?.0,
        DataKind::EndPoints => dataset,
    };
    let noise = NoiseModel {
        position_std: draw.clean.survey.position_std,
        heading_std: draw.clean.survey.heading_std,
        correlation_time: draw.clean.survey.correlation_time,
        scatter: draw.clean.scatter,
        clock_std: 0.0,
    };
    let sure = Options { noise: Some(noise), response_error: [0.0; 2], ..Options::default() };
    Ok(Study::new(&[dataset], &[], clean, sure, library, &|_, _| {})?.repeated(&counts))
}

/// RMS distance of surveyed ends from those of the same runs as `scene` predicts them \[m\].
pub(super) fn left_by(scene: &Scene, measured: &Dataset, stop: &AtomicBool) -> Result<f64, ScoreError> {
    let (predicted, _) = predict(measured, &Simulator::new(scene, stop))?;
    let squares: Vec<f64> = predicted
        .runs
        .iter()
        .filter_map(|run| {
            let end = measured.runs.iter().find(|known| known.name == run.name)?.end?;
            let predicted = run.end?;
            Some((end.x - predicted.x).powi(2) + (end.y - predicted.y).powi(2))
        })
        .collect();
    Ok((squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt())
}
