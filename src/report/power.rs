//! What a campaign could show, as a table.

use super::grid::Grid;
use super::text::Style;
use crate::diagnose::Blind;
use std::fmt::Write;

/// The smallest size of each effect that shows, and effects that act alike (angle between their responses \[rad\]).
pub fn power(blind: &[Blind], alike: &[(String, String, f64)]) -> String {
    let size = |value: f64| if value.is_finite() { format!("{value:.2e}") } else { "any".to_owned() };
    let mut grid = Grid::new("", &["effect", "smallest that shows", "plausible size", "shows"]);
    for b in blind {
        let choice = if b.choice.is_empty() { String::new() } else { format!(" ({})", b.choice) };
        let seen = match b.smallest_detectable {
            smallest if !smallest.is_finite() => "no",
            smallest if smallest < b.plausible => "yes",
            _ => "only if large",
        };
        let effect = format!("{}{choice}.{}", b.effect, b.parameter);
        grid.row([effect, size(b.smallest_detectable), format!("{:.2e}", b.plausible), seen.to_owned()]);
    }
    let mut out = grid.draw(Style::Terminal);
    if alike.is_empty() {
        out.push_str("No two effects act alike in these data.\n");
    }
    for (one, other, angle) in alike {
        let _ = writeln!(out, "{one} and {other} act alike: their responses are {:.1}° apart.", angle.to_degrees());
    }
    out
}
