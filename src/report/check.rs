//! What a campaign looks like: its runs, where they ended, and what is suspicious.

use super::grid::Grid;
use crate::calibrate::{CentreOfGravity, SquareErrors, Suspicion, Training};
use crate::dataset::{Dataset, Protocol, Run, SurveyedPose};
use serde::Serialize;
use std::fmt::Write;

/// `check --json`.
#[derive(Debug, Clone, Serialize)]
pub struct CheckJson {
    dataset: String,
    runs: usize,
    surveyed: usize,
    suspicions: Vec<SuspicionJson>,
}

#[derive(Debug, Clone, Serialize)]
struct SuspicionJson {
    kind: &'static str,
    runs: Vec<String>,
    seen: f64,
    expected: f64,
    message: String,
}

impl CheckJson {
    /// The JSON of what was found in `dataset`.
    pub fn new(dataset: &Dataset, suspicions: &[Suspicion]) -> Self {
        let suspicion = |found: &Suspicion| SuspicionJson {
            kind: found.kind.as_str(),
            runs: found.runs.clone(),
            seen: found.seen,
            expected: found.expected,
            message: found.to_string(),
        };
        CheckJson {
            dataset: dataset.campaign.name.clone(),
            runs: dataset.runs.len(),
            surveyed: dataset.runs.iter().filter(|run| run.end.is_some()).count(),
            suspicions: suspicions.iter().map(suspicion).collect(),
        }
    }
}

/// What looks wrong with campaigns, a sentence or a few each, for whoever goes on with them nevertheless.
pub fn cautions(campaigns: &[(&Dataset, Vec<Suspicion>)]) -> Vec<String> {
    let of_one = |(dataset, suspicions): &(&Dataset, Vec<Suspicion>)| -> Vec<String> {
        suspicions.iter().map(|suspicion| format!("{}: {suspicion}", dataset.campaign.name)).collect()
    };
    campaigns.iter().flat_map(of_one).collect()
}

/// A description of the campaign, then what is suspicious.
pub fn check(dataset: &Dataset, suspicions: &[Suspicion]) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "{}: {}", dataset.campaign.name, counted(dataset.runs.len(), "run"));
    for (what, count, surveyed) in kinds(dataset) {
        let note = match count - surveyed {
            0 => String::new(),
            missing => format!(", {missing} without a surveyed end"),
        };
        let _ = writeln!(text, "  {count} × {what}{note}");
    }
    let _ = writeln!(text, "  {}", logged(dataset));
    for words in ends(dataset) {
        let _ = writeln!(text, "  {words}");
    }
    text.push('\n');
    if suspicions.is_empty() {
        text.push_str(if !is_unsurveyed(dataset) {
            "nothing looks wrong\n"
        } else if dataset.runs.iter().any(|run| run.encoders.is_some()) {
            "nothing looks wrong with the logs; no run has a surveyed end (x_m and y_m in runs.csv) to check them against\n"
        } else {
            "nothing can be checked yet: no run has a surveyed end (x_m and y_m in runs.csv)\n"
        });
        return text;
    }
    let _ = writeln!(
        text,
        "{} look{} wrong:",
        counted(suspicions.len(), "thing"),
        if suspicions.len() == 1 { "s" } else { "" }
    );
    for (number, suspicion) in suspicions.iter().enumerate() {
        let _ = writeln!(text, "{}. {suspicion}", number + 1);
    }
    text
}

/// Whether nothing has been measured.
pub fn is_unsurveyed(dataset: &Dataset) -> bool {
    dataset.runs.iter().all(|run| run.end.is_none())
}

pub(super) fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// What was driven, how often, and how many of these have a surveyed end; in file order.
fn kinds(dataset: &Dataset) -> Vec<(String, usize, usize)> {
    let mut kinds: Vec<(String, usize, usize)> = Vec::new();
    for run in &dataset.runs {
        let what = kind(run);
        let surveyed = usize::from(run.end.is_some());
        match kinds.iter_mut().find(|(known, ..)| *known == what) {
            Some((_, count, with)) => (*count, *with) = (*count + 1, *with + surveyed),
            None => kinds.push((what, 1, surveyed)),
        }
    }
    kinds
}

/// What was driven, in words.
pub(super) fn kind(run: &Run) -> String {
    let size = match run.protocol {
        Protocol::Square { side, .. } => format!(" of {side} m"),
        Protocol::Straight { length, .. } => format!(" of {length} m"),
        Protocol::Spin { turn, .. } => format!(" by {turn:.4} rad"),
        Protocol::Circle { radius, .. } => format!(" of radius {radius} m"),
        Protocol::Path => String::new(),
    };
    let direction = run.protocol.direction().map_or(String::new(), |direction| format!(", {direction}"));
    format!("{}{size}{direction}", run.protocol.kind())
}

/// What was driven, as a table.
pub(super) fn driven(dataset: &Dataset) -> Grid {
    let mut grid = Grid::new("", &["driven", "runs", "with a surveyed end"]);
    for (what, count, surveyed) in kinds(dataset) {
        grid.row([what, count.to_string(), surveyed.to_string()]);
    }
    grid.noted(logged(dataset))
}

/// Where squares ended from dead reckoning, a sentence a side and way round; or why that is not known.
pub(super) fn ends(dataset: &Dataset) -> Vec<String> {
    match Training::new(std::slice::from_ref(dataset)) {
        Ok(training) => SquareErrors::of(&training).iter().flat_map(squares).collect(),
        Err(error) => vec![error.to_string()],
    }
}

fn logged(dataset: &Dataset) -> String {
    let with = |has: fn(&Run) -> bool| dataset.runs.iter().filter(|run| has(run)).count();
    format!(
        "{} with encoder logs, {} with poses on the way, {} with an end heading",
        with(|run| run.encoders.is_some()),
        with(|run| run.poses.is_some()),
        with(|run| run.end.is_some_and(|end| end.heading.is_some()))
    )
}

/// Centre of gravity and spread of the end errors, a line a direction.
fn squares(group: &SquareErrors) -> Vec<String> {
    let both = [("cw", group.cw_centre(), &group.cw), ("ccw", group.ccw_centre(), &group.ccw)];
    let words = |(direction, centre, errors): (&str, Option<CentreOfGravity>, &Vec<SurveyedPose>)| {
        let CentreOfGravity { x, y, heading, runs } = centre?;
        let heading = heading.map_or(String::new(), |heading| format!(", heading {:+.1} mrad", 1e3 * heading));
        let spread = match runs {
            1 => "a single run has no spread".to_owned(),
            _ => {
                let square = errors.iter().map(|e| (e.x - x).powi(2) + (e.y - y).powi(2)).sum::<f64>();
                format!("spread {:.1} mm", 1e3 * (square / (runs as f64 - 1.0)).sqrt())
            }
        };
        Some(format!(
            "squares of {} m, {direction}: end on average at x {:+.1} mm, y {:+.1} mm from dead reckoning{heading}; {spread}",
            group.side,
            1e3 * x,
            1e3 * y
        ))
    };
    both.into_iter().filter_map(words).collect()
}
