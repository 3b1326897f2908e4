//! What a campaign looks like: its runs, where they ended, and what is suspicious.

use crate::calibrate::{CentreOfGravity, SquareErrors, Suspicion, Training};
use crate::dataset::{Dataset, Protocol};
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
    let with = |has: fn(&crate::dataset::Run) -> bool| dataset.runs.iter().filter(|run| has(run)).count();
    let _ = writeln!(
        text,
        "  {} with encoder logs, {} with poses on the way, {} with an end heading",
        with(|run| run.encoders.is_some()),
        with(|run| run.poses.is_some()),
        with(|run| run.end.is_some_and(|end| end.heading.is_some()))
    );
    match Training::new(std::slice::from_ref(dataset)) {
        Ok(training) => {
            for group in &SquareErrors::of(&training) {
                squares(&mut text, group);
            }
        }
        Err(error) => {
            let _ = writeln!(text, "  {error}");
        }
    }
    text.push('\n');
    if suspicions.is_empty() {
        text.push_str("nothing looks wrong\n");
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

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// What was driven, how often, and how many of these have a surveyed end; in file order.
fn kinds(dataset: &Dataset) -> Vec<(String, usize, usize)> {
    let mut kinds: Vec<(String, usize, usize)> = Vec::new();
    for run in &dataset.runs {
        let size = match run.protocol {
            Protocol::Square { side, .. } => format!(" of {side} m"),
            Protocol::Straight { length, .. } => format!(" of {length} m"),
            Protocol::Spin { turn, .. } => format!(" by {turn:.4} rad"),
            Protocol::Circle { radius, .. } => format!(" of radius {radius} m"),
            Protocol::Path => String::new(),
        };
        let direction = run.protocol.direction().map_or(String::new(), |direction| format!(", {direction}"));
        let what = format!("{}{size}{direction}", run.protocol.kind());
        let surveyed = usize::from(run.end.is_some());
        match kinds.iter_mut().find(|(known, ..)| *known == what) {
            Some((_, count, with)) => (*count, *with) = (*count + 1, *with + surveyed),
            None => kinds.push((what, 1, surveyed)),
        }
    }
    kinds
}

/// Centre of gravity and spread of the end errors, a line a direction.
fn squares(text: &mut String, group: &SquareErrors) {
    for (direction, centre, errors) in [("cw", group.cw_centre(), &group.cw), ("ccw", group.ccw_centre(), &group.ccw)] {
        let Some(centre) = centre else { continue };
        let CentreOfGravity { x, y, heading, runs } = centre;
        let heading = heading.map_or(String::new(), |heading| format!(", heading {:+.1} mrad", 1e3 * heading));
        let spread = match runs {
            1 => "a single run has no spread".to_owned(),
            _ => {
                let square = errors.iter().map(|e| (e.x - x).powi(2) + (e.y - y).powi(2)).sum::<f64>();
                format!("spread {:.1} mm", 1e3 * (square / (runs as f64 - 1.0)).sqrt())
            }
        };
        let _ = writeln!(
            text,
            "  squares of {} m, {direction}: end on average at x {:+.1} mm, y {:+.1} mm from dead reckoning{heading}; {spread}",
            group.side,
            1e3 * x,
            1e3 * y
        );
    }
}
