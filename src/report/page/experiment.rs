//! The report of an experiment: squares before and after calibration.

use super::{Bar, Bars, Block, FORMAT, Hue, Mark, Page, Plane, Provenance, Scale, Section, Shape};
use crate::calibrate::{Score, SquareErrors};
use crate::dataset::SurveyedPose;
use crate::experiment::{Experiment, MethodResult, Stage};
use crate::report::{ros2, text};
use std::collections::BTreeMap;

/// The answer of an experiment in a sentence, and what stands beside it, a sentence each.
pub fn answer(experiment: &Experiment) -> (String, Vec<String>) {
    let best = experiment.best();
    let mut beside = Vec::new();
    if !experiment.complete {
        beside.push("Interrupted: this is what had been driven.".to_owned());
    }
    beside.extend(best.and_then(|best| elsewhere(best, &experiment.before)));
    (in_a_sentence(best, &experiment.before, experiment.methods.len()), beside)
}

/// The page of an experiment.
pub fn page(title: String, experiment: &Experiment, provenance: Provenance) -> Page {
    let best = experiment.best();
    let (answer, beside) = answer(experiment);
    let figures = experiment.before.sides.iter().flat_map(|side| scatter(experiment, best, side.side)).collect();
    let mut unable: Vec<String> = experiment
        .not_applicable
        .iter()
        .map(|(method, side, why)| format!("{method} on {side} m squares is not applicable: {why}"))
        .collect();
    let mut not_fixed: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for result in &experiment.methods {
        if let Some(words) = result.estimate.not_fixed {
            let methods = not_fixed.entry(words).or_default();
            if !methods.contains(&result.method) {
                methods.push(result.method);
            }
        }
    }
    unable.extend(not_fixed.into_iter().map(|(words, methods)| format!("{}: {words}", methods.join(", "))));
    let tables = text::experiment_grids(experiment, |_| true).into_iter().map(Block::Table).collect();
    let paste = best.map_or(String::new(), |best| yaml(best, &experiment.before));
    let sections = [
        Section::of(
            "Where the squares ended",
            vec![
                Block::Planes(figures),
                Block::Text(
                    "Surveyed less dead-reckoned end points; large crosses are centres of gravity, ellipses two standard deviations."
                        .to_owned(),
                ),
            ],
        ),
        Section::of("What calibrations gained", vec![Block::Bars(improvements(experiment))]),
        Section::of("Numbers", tables),
        Section::of("What it could not tell", vec![Block::List(unable)]),
        Section::of("Next experiment", vec![Block::Text(
            "The same squares with the real robot: `treadmark init` writes a campaign to fill in, `treadmark diagnose` says what this model gets wrong about it.".to_owned(),
        )]),
        Section::of(
            "Parameters to paste",
            vec![Block::Paste("For ROS 2's diff_drive_controller, by the best method:".to_owned(), paste)],
        ),
    ];
    Page {
        format: FORMAT.to_owned(),
        title,
        answer,
        beside,
        sections: sections.into_iter().flatten().collect(),
        provenance,
    }
}

fn e_max(stage: &Stage, side: f64) -> Option<f64> {
    Some(1e3 * stage.side(side)?.e_max_syst())
}

fn in_a_sentence(best: Option<&MethodResult>, before: &Stage, methods: usize) -> String {
    let words = best.and_then(|best| {
        let side = best.calibrated_on_side;
        Some(format!(
            "Calibrated by {} on {side} m squares, the robot's largest systematic end error falls from {:.1} to {:.1} mm: {:.1} times better, the best of {}.",
            best.method,
            e_max(before, side)?,
            e_max(&best.after, side)?,
            best.improvement(before)?,
            if methods == 1 { "one calibration".to_owned() } else { format!("{methods} calibrations") }
        ))
    });
    words.unwrap_or_else(|| "No calibration was driven to its end.".to_owned())
}

/// The best method at the sides that it did not see.
fn elsewhere(best: &MethodResult, before: &Stage) -> Option<String> {
    let others = before.sides.iter().map(|side| side.side).filter(|&side| side != best.calibrated_on_side);
    let words: Vec<String> = others
        .filter_map(|side| {
            let (from, to) = (e_max(before, side)?, e_max(&best.after, side)?);
            Some(format!("{side} m squares, which it did not see: {from:.1} to {to:.1} mm"))
        })
        .collect();
    (!words.is_empty()).then(|| format!("On {}.", words.join("; ")))
}

fn points(errors: &[SurveyedPose]) -> Vec<[f64; 2]> {
    errors.iter().map(|error| [1e3 * error.x, 1e3 * error.y]).collect()
}

/// End errors of one side's squares before and after the best calibration \[mm\].
fn scatter(experiment: &Experiment, best: Option<&MethodResult>, side: f64) -> Vec<Plane> {
    let cluster = |errors: &SquareErrors, after: bool, words: &str| {
        let mut marks = Vec::new();
        let both = [
            (Hue::Clockwise, "cw", &errors.cw, errors.cw_centre()),
            (Hue::CounterClockwise, "ccw", &errors.ccw, errors.ccw_centre()),
        ];
        for (hue, way, errors, centre) in both {
            let shape = if after { Shape::Dots } else { Shape::Rings };
            marks.push(Mark::new(hue, !after, Shape::Ellipse, "", points(errors)));
            marks.push(Mark::new(hue, !after, shape, &format!("{words}, {way}"), points(errors)));
            let centre = centre.map(|centre| [1e3 * centre.x, 1e3 * centre.y]);
            marks.push(Mark::new(hue, !after, Shape::Crosses, "", centre.into_iter().collect()));
        }
        marks
    };
    let plane = |title: String, marks: Vec<Mark>| Plane { title, unit: "mm".to_owned(), marks };
    let Some(before) = experiment.before.side(side).map(|entry| cluster(&entry.errors, false, "before")) else {
        return Vec::new();
    };
    let after = best.and_then(|best| Some((best, cluster(&best.after.side(side)?.errors, true, "after"))));
    let Some((best, after)) = after else { return vec![plane(format!("{side} m squares"), before)] };
    let by = format!("{} on {} m", best.method, best.calibrated_on_side);
    vec![
        plane(format!("{side} m squares, before and after {by}"), [before, after.clone()].concat()),
        // What is left is too small to be seen beside what was.
        plane(format!("{side} m squares, after {by}, closer"), after),
    ]
}

/// How many times better each method makes the side that it saw.
fn improvements(experiment: &Experiment) -> Vec<Bars> {
    let mut sides: Vec<f64> = experiment.methods.iter().map(|result| result.calibrated_on_side).collect();
    sides.dedup();
    let figure = |side: f64| Bars {
        title: format!("E_max,syst before over after, {side} m squares"),
        scale: Scale::Linear,
        rows: experiment
            .methods
            .iter()
            .filter(|result| result.calibrated_on_side == side)
            .filter_map(|result| {
                let gain = result.improvement(&experiment.before)?;
                Some(Bar {
                    label: result.method.to_owned(),
                    value: Some(gain),
                    interval: None,
                    words: format!("{gain:.1} ×"),
                    pale: gain <= 1.0,
                })
            })
            .collect(),
        reference: Some((1.0, "no better".to_owned())),
        span: None,
    };
    sides.into_iter().map(figure).collect()
}

/// Parameters by `best`, with the covariance that its own squares leave.
fn yaml(best: &MethodResult, before: &Stage) -> String {
    let rms = |stage: &Stage| {
        let Some(entry) = stage.side(best.calibrated_on_side) else { return [f64::NAN; 2] };
        let errors: Vec<SurveyedPose> = entry.errors.cw.iter().chain(&entry.errors.ccw).copied().collect();
        let root = |squares: Vec<f64>| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        [
            root(errors.iter().map(|error| error.x * error.x + error.y * error.y).collect()),
            root(errors.iter().filter_map(|error| error.heading).map(|heading| heading * heading).collect()),
        ]
    };
    let ([position_rmse_before, heading_rmse_before], [position_rmse_after, heading_rmse_after]) =
        (rms(before), rms(&best.after));
    let score = Score {
        position_rmse_before,
        position_rmse_after,
        heading_rmse_before,
        heading_rmse_after,
        e_max_syst_before: None,
        e_max_syst_after: None,
    };
    ros2::diff_drive_controller(best.method, &before.odometry, &best.estimate, &score)
}
