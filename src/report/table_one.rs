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
        "ln evidence",
    ];
    let mut grid = Grid::new("Distances r_cg in mm", &header);
    let line = |name: String, distances: &[f64; 6], rest: [String; 2]| {
        [name].into_iter().chain(distances.map(|d| format!("{:.0}", 1e3 * d))).chain(rest).collect::<Vec<_>>()
    };
    grid.row(line("Table I".to_owned(), measured, [String::new(), String::new()]));
    for candidate in candidates {
        let own = candidate.causes.iter().skip(3).map(crate::effect::Cause::line).next();
        let name = own.unwrap_or_else(|| "nothing more".to_owned());
        let rest = [format!("{:.1}", candidate.chi2), format!("{:.1}", candidate.log_evidence)];
        grid.row(line(name, &candidate.distances, rest));
    }
    let near = candidates.iter().filter(|c| candidates[0].log_evidence - c.log_evidence < 3.0).count();
    let mut out = grid.draw(style);
    let _ = writeln!(
        out,
        "Six distances against {} free numbers a candidate: they can rule causes out, and they cannot name one that {} others \
         match as well (within a factor of 20). They carry no direction: a cause and its mirror image are alike.",
        candidates[0].causes.iter().map(|cause| cause.values.len()).sum::<usize>(),
        near.saturating_sub(1),
    );
    if let Some(alone) = candidates.iter().find(|c| c.effect.is_none()) {
        let _ = writeln!(out, "Unequal tyres, scale and track alone leave χ² {:.0} on 6 distances.", alone.chi2);
    }
    out
}
