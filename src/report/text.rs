//! Tables for the terminal, and the same as markdown for the recording's text panel.

use super::grid::Grid;
use crate::calibrate::{Calibration, CentreOfGravity, Estimate, METHODS, MethodOutcome, Parameter, Score};
use crate::drive::SimulatedRun;
use crate::effect::{self, EFFECTS, Prior};
use crate::experiment::{Experiment, MethodResult, Stage};
use crate::geometry::Pose2;
use comfy_table::presets::{ASCII_MARKDOWN, UTF8_FULL_CONDENSED};
use comfy_table::{CellAlignment, ContentArrangement, Table};
use std::fmt::Write;

/// How tables are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// For a terminal.
    Terminal,
    /// Markdown.
    Markdown,
}

/// What the calibrations of an experiment gained and where the squares ended, for the stages that `shown` keeps.
pub fn experiment(experiment: &Experiment, style: Style, shown: impl Fn(&Stage) -> bool) -> String {
    experiment_grids(experiment, shown).iter().map(|grid| grid.draw(style)).collect()
}

/// Calibrations beyond which a table of all their squares is read by nobody.
const MANY: usize = 12;

/// The tables of [`experiment`].
pub(super) fn experiment_grids(experiment: &Experiment, shown: impl Fn(&Stage) -> bool) -> Vec<Grid> {
    let mut grids = Vec::new();
    if !experiment.methods.is_empty() {
        let mut grid = Grid::new(
            "What each calibration found, and gained at the side that it was calibrated on",
            &["method", "squares used", "E_d", "E_b", "E_s", "E_max,syst before", "after", "better by"],
        );
        for result in experiment.methods.iter().filter(|result| shown(&result.after)) {
            grid.row(gain(result, &experiment.before));
        }
        grids.push(
            grid.noted("corrections to what the robot believed: E_d = D_R/D_L, E_b track, E_s mean diameter; ± 1 σ"),
        );
    }
    let mut grid = Grid::new(
        "Where the squares ended: centres of gravity of surveyed − dead-reckoned end points [mm]",
        &["squares", "runs", "x cw", "y cw", "r cw", "x ccw", "y ccw", "r ccw", "E_max,syst"],
    );
    // Of many calibrations, those on the squares that served the best.
    let side = experiment.best().filter(|_| experiment.methods.len() > MANY).map(|best| best.calibrated_on_side);
    let on =
        |stage: &Stage| experiment.methods.iter().find(|it| it.after.name == stage.name)?.calibrated_on_side.into();
    let mut left_out = 0;
    for stage in experiment.stages().filter(|stage| shown(stage)) {
        if side.zip(on(stage)).is_some_and(|(side, on)| side != on) {
            left_out += 1;
            continue;
        }
        for side in &stage.sides {
            let mm = |value: f64| format!("{:.1}", 1e3 * value);
            let CentreOfGravity { x, y, .. } = side.cw;
            grid.row([
                format!("{}: {} m", stage.name.replace('_', " "), side.side),
                format!("{}+{}", side.cw.runs, side.ccw.runs),
                mm(x),
                mm(y),
                mm(side.cw.distance()),
                mm(side.ccw.x),
                mm(side.ccw.y),
                mm(side.ccw.distance()),
                mm(side.e_max_syst()),
            ]);
        }
    }
    let note = "E_max,syst is the larger of the two r";
    grids.push(match left_out {
        0 => grid.noted(note),
        left_out => grid.noted(format!("{note}; `--json` prints the {left_out} calibrations on other squares as well")),
    });
    if experiment.robot == PAPERS_ROBOT {
        grids.push(paper());
    }
    grids
}

/// The model of the robot that the paper measured: its table is nothing to compare another robot with.
const PAPERS_ROBOT: &str = "jnpf_4wd";

/// Table I of Bei, Ping & Gao: r_cg CW, r_cg CCW and E_max,syst as printed \[m\].
const TABLE_I: [(&str, f64, f64, f64); 3] = [
    ("before compensation", 0.4583, 0.5043, 0.5043),
    ("UMBmark method", 0.2019, 0.4175, 0.2019),
    ("proposed method", 0.0769, 0.1099, 0.1099),
];

/// The paper's own table, 2 m squares of the real robot, with E_max,syst as printed and as its eq 11 makes it.
fn paper() -> Grid {
    let mut grid = Grid::new(
        "For comparison, the paper's Table I: 2 m squares of the real JNPF-4WD [mm]",
        &["", "r cw", "r ccw", "E_max,syst printed", "recomputed", "better by, printed", "recomputed"],
    );
    let before = TABLE_I[0];
    for (label, cw, ccw, printed) in TABLE_I {
        let recomputed = cw.max(ccw);
        grid.row([
            label.to_owned(),
            format!("{:.1}", 1e3 * cw),
            format!("{:.1}", 1e3 * ccw),
            format!("{:.1}", 1e3 * printed),
            format!("{:.1}", 1e3 * recomputed),
            format!("{:.1} ×", before.3 / printed),
            format!("{:.1} ×", before.3 / recomputed),
        ]);
    }
    grid.noted("eq 11 is a maximum; the paper's UMBmark row prints the minimum")
}

/// One row of the gain table.
fn gain(result: &MethodResult, before: &Stage) -> [String; 8] {
    let side = result.calibrated_on_side;
    let e_max =
        |stage: &Stage| stage.side(side).map_or("–".into(), |entry| format!("{:.1} mm", 1e3 * entry.e_max_syst()));
    let estimate = &result.estimate;
    [
        result.method.to_owned(),
        format!("{side} m"),
        parameter(&estimate.diameter_ratio),
        parameter(&estimate.track_ratio),
        parameter(&estimate.distance_scale),
        e_max(before),
        e_max(&result.after),
        result.improvement(before).map_or("–".into(), |gain| format!("{gain:.1} ×")),
    ]
}

/// Five digits after the point, and no −0.
fn signed(value: f64) -> String {
    let words = format!("{value:+.5}");
    if words == "-0.00000" { "+0.00000".to_owned() } else { words }
}

/// A value with its σ, in the digits that the σ leaves.
pub(super) fn parameter(parameter: &Parameter) -> String {
    let Parameter { value, std_dev } = *parameter;
    if std_dev.is_infinite() {
        return if value == 1.0 { "1 (assumed)".to_owned() } else { format!("{value:.4} if E_s = 1") };
    }
    if std_dev.is_nan() || std_dev <= 0.0 {
        return format!("{value:.5}");
    }
    let digits = decimals(std_dev);
    format!("{value:.digits$} ± {std_dev:.digits$}")
}

/// Decimals of a value that a σ leaves.
pub(super) fn decimals(std_dev: f64) -> usize {
    (1.0 - std_dev.log10().floor()).clamp(2.0, 8.0) as usize
}

/// What every method found in data, how well it predicts, and which to take.
pub fn calibration(calibration: &Calibration) -> String {
    let grids = calibration_grids(calibration);
    let mut text: String = grids.iter().map(|grid| grid.draw(Style::Terminal)).collect();
    // No blank line between the table and what belongs to it.
    text.pop();
    for words in not_applicable(calibration) {
        let _ = writeln!(text, "not applicable: {words}");
    }
    text.push('\n');
    for words in calibration_words(calibration) {
        let _ = writeln!(text, "{words}");
    }
    text
}

/// The tables of [`calibration`]: corrections, and errors of predicted end points.
pub(super) fn calibration_grids(calibration: &Calibration) -> [Grid; 2] {
    let mut corrections = Grid::new(
        "Corrections to what the robot believed: E_d = D_R/D_L, E_b track, E_s mean diameter; ± 1 σ",
        &["method", "E_d", "E_b", "E_s", "its own bias: E_d", "E_b/E_s"],
    );
    let applicable =
        || calibration.outcomes.iter().filter_map(|outcome| Some((outcome, outcome.estimate.as_ref().ok()?)));
    for (outcome, estimate) in applicable() {
        corrections.row([
            outcome.method.name.to_owned(),
            parameter(&estimate.diameter_ratio),
            parameter(&estimate.track_ratio),
            parameter(&estimate.distance_scale),
            outcome.bias.map_or("–".to_owned(), |bias| signed(bias[0])),
            outcome.bias.map_or("–".to_owned(), |bias| signed(bias[1])),
        ]);
    }
    let corrections = corrections
        .noted("own bias: what the method finds less what went in, on noise-free end poses of a robot like this one");

    let held_out = if calibration.held_out_by_name { "held out" } else { "each run from the others" };
    let mut errors = Grid::new(
        format!(
            "Errors of predicted end points: position [mm] and heading [mrad] RMS, E_max,syst [mm]; {held_out}: not seen by the fit"
        ),
        &["method", "in sample", "heading", "E_max,syst", held_out, "heading", "E_max,syst"],
    );
    if let Some(first) = calibration.outcomes.iter().find(|outcome| outcome.in_sample.is_some()) {
        errors.row(score_row("before", first, |score| {
            (score.position_rmse_before, score.heading_rmse_before, score.e_max_syst_before)
        }));
    }
    for (outcome, _) in applicable() {
        errors.row(score_row(outcome.method.name, outcome, |score| {
            (score.position_rmse_after, score.heading_rmse_after, score.e_max_syst_after)
        }));
    }
    [corrections, errors]
}

/// Methods that could not be applied, and why.
pub(super) fn not_applicable(calibration: &Calibration) -> Vec<String> {
    let why = |outcome: &MethodOutcome| Some(format!("{}: {}", outcome.method.name, outcome.estimate.as_ref().err()?));
    calibration.outcomes.iter().filter_map(why).collect()
}

/// Which method to take, and what these data could not say, a sentence each.
pub(super) fn calibration_words(calibration: &Calibration) -> Vec<String> {
    let Some(best) = calibration.best() else {
        return vec!["No method could be checked on runs that it had not seen.".to_owned()];
    };
    let mut words = Vec::new();
    if let (Some(selection), Some(before)) = (best.selection, best.in_sample) {
        words.push(format!(
            "Take {}: it predicts each run from the others to {:.1} mm RMS, {:.1} times better than before.",
            best.method.name,
            1e3 * selection,
            before.position_rmse_before / selection
        ));
    }
    if let Ok(Estimate { not_fixed: Some(not_fixed), .. }) = &best.estimate {
        words.push(format!("Not fixed by these data: {not_fixed}."));
    }
    if let (Some(false), Some(held_out), Some(selection)) =
        (calibration.model_is_enough(), best.held_out, best.selection)
    {
        words.push(format!(
            "Wheel diameters and track are not enough for these data: what predicts the training runs to {:.1} mm predicts the held-out ones to {:.1} mm only. `treadmark diagnose` looks for the cause.",
            1e3 * selection,
            1e3 * held_out.position_rmse_after
        ));
    }
    words
}

/// A row of the error table.
fn score_row(label: &str, outcome: &MethodOutcome, of: impl Fn(&Score) -> (f64, f64, Option<f64>)) -> [String; 7] {
    let milli = |value: f64| if value.is_finite() { format!("{:.1}", 1e3 * value) } else { "–".to_owned() };
    let cells = |score: &Option<Score>| match score {
        Some(score) => {
            let (position, heading, e_max) = of(score);
            [milli(position), milli(heading), milli(e_max.unwrap_or(f64::NAN))]
        }
        None => ["–", "–", "–"].map(str::to_owned),
    };
    let ([a, b, c], [d, e, f]) = (cells(&outcome.in_sample), cells(&outcome.held_out));
    [label.to_owned(), a, b, c, d, e, f]
}

/// Every method with its source, what it needs and what it cannot see.
pub fn methods() -> String {
    let mut table = table(Style::Terminal, &["method", "source", "needs", "cannot see"]);
    for column in table.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Left);
    }
    table.set_content_arrangement(ContentArrangement::Dynamic).set_width(140);
    for method in &METHODS {
        table.add_row([method.name, method.source, method.needs, method.blind_to]);
    }
    format!("{table}\n")
}

/// Every effect of the registry by family: parameters with bounds and prior, cause, what shows it, source.
pub fn effects() -> String {
    let mut text = String::new();
    for (index, group) in EFFECTS.chunk_by(|one, other| one.family == other.family).enumerate() {
        if index > 0 {
            text.push('\n');
        }
        heading(&mut text, Style::Terminal, group[0].family.as_str());
        let header = ["effect", "parameters", "bounds", "prior", "cause", "shown by", "source"];
        let mut table = table(Style::Terminal, &header);
        for column in table.column_iter_mut() {
            column.set_cell_alignment(CellAlignment::Left);
        }
        table.set_content_arrangement(ContentArrangement::Dynamic).set_width(180);
        for effect in group {
            let lines = |of: &dyn Fn(&effect::Parameter) -> String| {
                effect.parameters.iter().map(of).collect::<Vec<_>>().join("\n")
            };
            let mut names = lines(&|parameter| parameter.name.to_owned());
            if let Some(choice) = effect.choice {
                names = format!("{names}\n{}", choice.key());
            }
            table.add_row([
                effect.id.to_owned(),
                names,
                lines(&|parameter| format!("{} … {}", parameter.bounds[0], parameter.bounds[1])),
                lines(&|parameter| prior(parameter.prior)),
                effect.cause.to_owned(),
                effect.shown_by.to_owned(),
                effect.source.to_owned(),
            ]);
        }
        let _ = writeln!(text, "{table}");
    }
    text.push_str("\n--set EFFECT.PARAMETER=VALUE puts one into a scene; x forward, y left, angles counter-clockwise; units stand in the names\n");
    text
}

/// What is plausible of a parameter, in a word.
fn prior(prior: Prior) -> String {
    match prior {
        Prior::Normal { mean: 0.0, std_dev } => format!("σ {std_dev}"),
        Prior::Normal { mean, std_dev } => format!("{mean} ± {std_dev}"),
        Prior::HalfNormal { std_dev } => format!("σ {std_dev}, positive"),
        Prior::AnyHeading => "any heading".to_owned(),
        Prior::OnPath => "on the path".to_owned(),
        Prior::Known(value) => format!("{value}, known"),
    }
}

/// Where one run ended, by truth, by dead reckoning and by survey.
pub fn drive(run: &SimulatedRun, style: Style) -> String {
    let mut text = String::new();
    heading(&mut text, style, &format!("Where {} ended, in the frame of its start", run.measured.name));
    let mut table = table(style, &["", "x [mm]", "y [mm]", "heading [mrad]"]);
    let mut row = |label: &str, pose: Pose2| {
        table.add_row([
            label.to_owned(),
            format!("{:.2}", 1e3 * pose.x),
            format!("{:.2}", 1e3 * pose.y),
            format!("{:.2}", 1e3 * pose.heading),
        ]);
    };
    row("truly", run.actual);
    row("by dead reckoning", run.odometry);
    row("error (truth − dead reckoning)", run.true_error());
    if let Some(end) = run.measured.end {
        row("as surveyed", Pose2::new(end.x, end.y, end.heading.unwrap_or(f64::NAN)));
    }
    push(&mut text, &table, style);
    let wall = run.wall.as_secs_f64();
    let _ = writeln!(
        text,
        "{:.1} s simulated in {:.2} s ({:.0} × real time), {} steps of {:.2} µs",
        run.simulated,
        wall,
        run.simulated / wall,
        run.steps,
        1e6 * wall / run.steps as f64
    );
    text
}

pub(super) fn table(style: Style, header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(match style {
        Style::Terminal => UTF8_FULL_CONDENSED,
        Style::Markdown => ASCII_MARKDOWN,
    });
    table.set_header(header.iter().copied());
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

fn heading(text: &mut String, style: Style, words: &str) {
    let prefix = if style == Style::Markdown { "### " } else { "" };
    let _ = writeln!(text, "{prefix}{words}");
    if style == Style::Markdown {
        text.push('\n');
    }
}

fn push(text: &mut String, table: &Table, style: Style) {
    let _ = writeln!(text, "{table}");
    if style == Style::Markdown {
        text.push('\n');
    }
}
