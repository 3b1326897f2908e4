//! The report of a calibration from datasets.

use super::{Bar, Bars, Block, FORMAT, Hue, Mark, Page, Plane, Provenance, Scale, Section, Shape};
use crate::calibrate::{Calibration, Estimate, MethodOutcome, Parameter, Training};
use crate::odometry::OdometryCorrection;
use crate::report::{ros2, text};

/// z of a two-sided 95 % interval.
const Z: f64 = 1.959_964;

/// The page of `calibration` on `training`, checked on `hold_out` where there is one.
pub fn page(
    title: String,
    training: &Training,
    hold_out: Option<&Training>,
    calibration: &Calibration,
    provenance: Provenance,
) -> Page {
    let mut words = text::calibration_words(calibration).into_iter();
    let answer = words.next().unwrap_or_default();
    let beside: Vec<String> = words.collect();
    let best = best(calibration);
    let mut planes = Vec::new();
    if let Some((outcome, estimate)) = best {
        let correction = estimate.correction();
        planes.push(scatter(
            format!("Runs that {} was fitted to", outcome.method.name),
            training,
            training,
            &correction,
        ));
        let unseen = |hold_out| scatter("Runs that were held out".to_owned(), training, hold_out, &correction);
        planes.extend(hold_out.map(unseen));
    }
    let [corrections, errors] = text::calibration_grids(calibration);
    let mut unable = text::not_applicable(calibration);
    unable.extend(best.and_then(|(_, estimate)| Some(format!("Not fixed by these data: {}.", estimate.not_fixed?))));
    let paste = best
        .and_then(|(outcome, estimate)| {
            let score = outcome.held_out.or(outcome.in_sample)?;
            Some(ros2::diff_drive_controller(outcome.method.name, &training.odometry, estimate, &score))
        })
        .unwrap_or_default();
    let sections = [
        Section::of(
            "Where runs ended, from where they were predicted",
            vec![
                Block::Planes(planes),
                Block::Text("Surveyed less predicted end points.".to_owned()),
                Block::Bars(errors_of(calibration)),
            ],
        ),
        Section::of(
            "What the robot should have believed",
            vec![Block::Bars(parameters(calibration)), Block::Table(corrections)],
        ),
        Section::of("How well it predicts", vec![Block::Table(errors)]),
        Section::of("What it could not tell", vec![Block::List(unable)]),
        Section::of("Next experiment", vec![Block::Text(next(calibration).to_owned())]),
        Section::of("Parameters to paste", vec![Block::Paste("For ROS 2's diff_drive_controller:".to_owned(), paste)]),
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

/// The best method, or the first that could be applied.
fn best(calibration: &Calibration) -> Option<(&MethodOutcome, &Estimate)> {
    let found = calibration.best().or(calibration.outcomes.iter().find(|outcome| outcome.estimate.is_ok()))?;
    Some((found, found.estimate.as_ref().ok()?))
}

fn next(calibration: &Calibration) -> &'static str {
    match (calibration.model_is_enough(), best(calibration)) {
        (Some(false), _) => {
            "Wheel diameters and track are not enough: `treadmark diagnose` with the same data looks for the cause and says what to drive."
        }
        (_, Some((_, Estimate { not_fixed: Some(_), .. }))) => {
            "A straight, measured with a tape, parts the distance scale from the track."
        }
        (None, _) => {
            "Other shapes or sizes, named with --hold-out: only they show whether diameters and track are enough."
        }
        (Some(true), _) => "None is called for: what was held out is predicted as well as what was fitted.",
    }
}

/// End errors before and after \[mm\].
fn scatter(title: String, training: &Training, runs: &Training, correction: &OdometryCorrection) -> Plane {
    let mut marks = Vec::new();
    for (hue, way) in [(Hue::Clockwise, "cw"), (Hue::CounterClockwise, "ccw"), (Hue::Other, "other")] {
        let of_hue =
            || runs.runs.iter().filter(move |run| Hue::of_words(run.protocol.direction().unwrap_or_default()) == hue);
        let before: Vec<[f64; 2]> =
            of_hue().map(|run| run.believed_error()).map(|error| [1e3 * error.x, 1e3 * error.y]).collect();
        let after: Vec<[f64; 2]> = of_hue()
            .map(|run| run.error(&training.odometry, correction))
            .map(|error| [1e3 * error.x, 1e3 * error.y])
            .collect();
        for (pale, shape, words, points) in
            [(true, Shape::Rings, "before", before), (false, Shape::Dots, "after", after)]
        {
            if points.is_empty() {
                continue;
            }
            marks.push(Mark::new(hue, pale, Shape::Ellipse, "", points.clone()));
            marks.push(Mark::new(hue, pale, shape, &format!("{words}, {way}"), points));
        }
    }
    Plane { title, unit: "mm".to_owned(), marks }
}

/// Position errors of every method in sample and on runs that it did not see.
fn errors_of(calibration: &Calibration) -> Vec<Bars> {
    let figure = |title: &str, held_out: bool| {
        let score = |outcome: &MethodOutcome| if held_out { outcome.held_out } else { outcome.in_sample };
        let bar = |label: &str, value: f64, pale: bool| Bar {
            label: label.to_owned(),
            value: Some(1e3 * value),
            interval: None,
            words: format!("{:.1} mm", 1e3 * value),
            pale,
        };
        let mut rows = Vec::new();
        if let Some(first) = calibration.outcomes.iter().find_map(score) {
            rows.push(bar("before", first.position_rmse_before, true));
        }
        let after =
            |outcome: &MethodOutcome| Some(bar(outcome.method.name, score(outcome)?.position_rmse_after, false));
        rows.extend(calibration.outcomes.iter().filter_map(after));
        Bars { title: title.to_owned(), scale: Scale::Linear, rows, reference: None, span: None }
    };
    let unseen = if calibration.held_out_by_name { "held out" } else { "each run from the others" };
    vec![
        figure("Position error RMS, in sample", false),
        figure(&format!("Position error RMS, {unseen}: not seen by the fit"), true),
    ]
}

/// Corrections of every method with their 95 % intervals.
fn parameters(calibration: &Calibration) -> Vec<Bars> {
    type Of = fn(&Estimate) -> &Parameter;
    let which: [(&str, Of); 3] = [
        ("E_d = D_R/D_L, 95 % interval", |estimate| &estimate.diameter_ratio),
        ("E_b, track, 95 % interval", |estimate| &estimate.track_ratio),
        ("E_s, mean diameter, 95 % interval", |estimate| &estimate.distance_scale),
    ];
    let figure = |(title, of): (&str, Of)| Bars {
        title: title.to_owned(),
        scale: Scale::Free,
        rows: calibration
            .outcomes
            .iter()
            .filter_map(|outcome| Some((outcome.method.name, of(outcome.estimate.as_ref().ok()?))))
            .map(|(method, parameter)| Bar {
                label: method.to_owned(),
                value: Some(parameter.value),
                interval: Some([parameter.value - Z * parameter.std_dev, parameter.value + Z * parameter.std_dev])
                    .filter(|_| parameter.std_dev.is_finite() && parameter.std_dev > 0.0),
                words: text::parameter(parameter),
                pale: !parameter.std_dev.is_finite(),
            })
            .collect(),
        reference: Some((1.0, "as believed".to_owned())),
        span: None,
    };
    which.into_iter().map(figure).collect()
}
