//! Candidates for the paper's Table I as a table, with what six distances can and cannot say.

use super::grid::Grid;
use super::text::Style;
use crate::experiment::Candidate;
use std::fmt::Write;

/// The measured distances \[m\], then each candidate's, best first.
pub fn table_one(candidates: &[Candidate], measured: &[f64; 6], style: Style) -> String {
    let header = [
        "on top of unequal tyres, scale and track",
        "before CW",
        "CCW",
        "UMBmark CW",
        "CCW",
        "paper's CW",
        "CCW",
        "χ²",
        "σ from plausible",
        "ln evidence",
    ];
    let mut grid = Grid::new("Distances r_cg in mm", &header);
    let line = |name: String, distances: &[f64; 6], rest: [String; 3]| {
        [name].into_iter().chain(distances.map(|d| format!("{:.0}", 1e3 * d))).chain(rest).collect::<Vec<_>>()
    };
    grid.row(line("Table I".to_owned(), measured, [const { String::new() }; 3]));
    for candidate in candidates.iter().take(MOST).chain(candidates.iter().skip(MOST).filter(|c| c.on_top().is_empty()))
    {
        let numbers = [candidate.chi2, candidate.strain, candidate.log_evidence].map(|value| format!("{value:.1}"));
        grid.row(line(name(candidate), &candidate.distances, numbers));
    }
    let mut out = grid.draw(style);
    if candidates.len() > MOST {
        let _ = writeln!(out, "{} candidates were fitted; table_one.json has them all.", candidates.len());
    }
    let best = &candidates[0];
    let near: Vec<String> =
        candidates[1..].iter().filter(|c| best.log_evidence - c.log_evidence < ALIKE).map(name).collect();
    let alone = match near.as_slice() {
        [] => "no other comes within odds of 20 to 1".to_owned(),
        near => format!("within odds of 20 to 1 of it: {}", near.join("; ")),
    };
    let _ = writeln!(out, "Nearest: {}, with χ² {:.0} on six distances; {alone}.", name(best), best.chi2);
    if best.chi2 > MUCH {
        let _ = writeln!(
            out,
            "A χ² so far above six says that it is not the cause either, or not alone: nothing that was tried ends where the \
             paper's robot did."
        );
    }
    if let Some(alone) = candidates.iter().find(|c| c.on_top().is_empty()) {
        let _ = writeln!(out, "Unequal tyres, scale and track alone leave χ² {:.0}.", alone.chi2);
    }
    let _ = writeln!(
        out,
        "What six distances can say: which causes cannot have done it. What they cannot: which one did, where as many numbers \
         are free; nor to which side, for a distance has no direction and a cause and its mirror image are alike."
    );
    out
}

/// Candidates that a table shows.
const MOST: usize = 16;
/// ln of the odds of 20 to 1.
const ALIKE: f64 = 2.995_732_273_553_991;
/// χ² of six distances that one robot in a million leaves by chance.
const MUCH: f64 = 38.3;

/// What is on top, in words.
fn name(candidate: &Candidate) -> String {
    let lines: Vec<String> = candidate.on_top().iter().map(crate::effect::Cause::line).collect();
    if lines.is_empty() { "nothing more".to_owned() } else { lines.join(" & ") }
}
