//! A diagnosis as tables.

use super::text::{Style, table};
use crate::diagnose::{Blind, Diagnosis, Gain, Verdict};
use crate::experiment::Candidate;
use std::fmt::Write;

/// The report, readable in a minute: the answer, where the model is wrong, what explains it, what it is worth.
pub fn diagnosis(diagnosis: &Diagnosis, gain: Option<&Gain>) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "{}\n", answer(diagnosis));
    let mm = |value: Option<f64>| value.map_or("–".to_owned(), |value| format!("{:.1}", 1e3 * value));
    let rows = diagnosis.misfit.conditions.iter().take(24).map(|c| {
        vec![
            c.label.clone(),
            c.runs.to_string(),
            format!("{} ± {:.1}", mm(c.residual[0]), 1e3 * c.std_dev[0]),
            format!("{} ± {:.1}", mm(c.residual[1]), 1e3 * c.std_dev[1]),
            format!("{} ± {:.1}", mm(c.residual[2]), 1e3 * c.std_dev[2]),
            format!("{} {} {}", mm(c.repeatability[0]), mm(c.repeatability[1]), mm(c.repeatability[2])),
        ]
    });
    let header = ["condition", "runs", "x [mm]", "y [mm]", "heading [mrad]", "runs stray by"];
    let _ = writeln!(out, "Surveyed less predicted end poses, as given\n{}", tabled(&header, rows.collect()));
    let more = diagnosis.misfit.conditions.len().saturating_sub(24);
    if more > 0 {
        let _ = writeln!(out, "… and {more} more conditions");
    }
    let m = &diagnosis.misfit;
    let _ = writeln!(out, "χ² {:.1} on {} degrees of freedom, p = {:.2e}\n", m.chi2, m.dof, m.p_value);
    let rows = diagnosis.ranking.iter().take(8).map(|r| {
        let effects = if r.effects.is_empty() { "nothing".to_owned() } else { r.effects.join(" + ") };
        vec![effects, format!("{:.1}", r.log_evidence), format!("{:.3}", r.probability)]
    });
    let _ = writeln!(out, "{}", tabled(&["what could explain it", "ln evidence", "probability"], rows.collect()));
    if let Some(next) = &diagnosis.next_experiment {
        let _ = writeln!(
            out,
            "Next experiment: {}, which separates {} by {:.1} σ in five runs.",
            next.protocol,
            next.separates.join(" from "),
            next.expected_sigma
        );
    }
    match gain {
        Some(gain) => {
            let sure = if gain.interval[0] > 0.0 { "" } else { ": none that is sure" };
            let _ = writeln!(
                out,
                "Held out ({}): position {:.1} → {:.1} mm, heading {:.1} → {:.1} mrad; gain {:.0} % ({:.0} to {:.0} %){sure}; \
                 noise floor {:.1} mm.",
                gain.held_out,
                1e3 * gain.position_before,
                1e3 * gain.position_after,
                1e3 * gain.heading_before,
                1e3 * gain.heading_after,
                100.0 * (1.0 - gain.position_after / gain.position_before),
                100.0 * gain.interval[0],
                100.0 * gain.interval[1],
                1e3 * gain.noise_floor
            );
        }
        None => {
            let _ = writeln!(out, "Gain: nothing could be held out.");
        }
    }
    let unseen: Vec<String> = diagnosis
        .blind_to
        .iter()
        .filter(|blind| blind.smallest_detectable > blind.plausible)
        .map(|blind| {
            let choice = if blind.choice.is_empty() { String::new() } else { format!(" ({})", blind.choice) };
            if blind.smallest_detectable.is_finite() {
                format!("{}{choice}.{} below {:.2e}", blind.effect, blind.parameter, blind.smallest_detectable)
            } else {
                format!("{}{choice}.{} of any size", blind.effect, blind.parameter)
            }
        })
        .collect();
    if !unseen.is_empty() {
        let _ = writeln!(out, "These data could not have shown: {}.", unseen.join("; "));
    }
    let noise = &diagnosis.noise;
    let _ = writeln!(
        out,
        "Noise: survey {:.2} mm, {:.2} mrad; scatter {:.2} mrad a corner, {:.2} mrad/√m, {:.3} % of distance; clocks {:.1} ms.",
        1e3 * noise.position_std,
        1e3 * noise.heading_std,
        1e3 * noise.scatter.heading_per_corner,
        1e3 * noise.scatter.heading_per_sqrt_metre,
        100.0 * noise.scatter.distance,
        1e3 * noise.clock_std
    );
    for left_out in &diagnosis.left_out {
        let _ = writeln!(out, "Left out: {left_out}.");
    }
    out
}

/// Candidates for the paper's Table I, with what six distances can and cannot say.
pub fn table_one(candidates: &[Candidate], measured: &[f64; 6]) -> String {
    let mm = |distances: &[f64; 6]| -> Vec<String> { distances.iter().map(|d| format!("{:.0}", 1e3 * d)).collect() };
    let mut rows = vec![[vec!["Table I".to_owned()], mm(measured), vec![String::new(); 2]].concat()];
    rows.extend(candidates.iter().map(|c| {
        let own = c.causes.iter().skip(3).map(crate::effect::Cause::line).next();
        let name = own.unwrap_or_else(|| "unequal tyres, scale and track alone".to_owned());
        [vec![name], mm(&c.distances), vec![format!("{:.1}", c.chi2), format!("{:.1}", c.log_evidence)]].concat()
    }));
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
    let mut out = tabled(&header, rows);
    let alone = candidates.iter().find(|c| c.effect.is_none());
    let near = candidates.iter().filter(|c| candidates[0].log_evidence - c.log_evidence < 3.0).count();
    let _ = write!(
        out,
        "\nr_cg in mm. Six distances against {} free numbers a candidate: they can rule causes out, and they cannot name one that \
         {} others match as well (within a factor of 20). They carry no direction: a cause and its mirror image are alike.\n",
        candidates[0].causes.iter().map(|cause| cause.values.len()).sum::<usize>(),
        near.saturating_sub(1),
    );
    if let Some(alone) = alone {
        let _ = writeln!(out, "Unequal tyres, scale and track alone leave χ² {:.0} on 6 distances.", alone.chi2);
    }
    out
}

/// What a campaign could show: the smallest size of each effect, and effects that act alike.
pub fn power(blind: &[Blind], alike: &[(String, String, f64)]) -> String {
    let size = |value: f64| if value.is_finite() { format!("{value:.2e}") } else { "any".to_owned() };
    let rows = blind.iter().map(|b| {
        let choice = if b.choice.is_empty() { String::new() } else { format!(" ({})", b.choice) };
        let seen = if b.smallest_detectable < b.plausible { "yes" } else { "only if large" };
        let seen = if b.smallest_detectable.is_finite() { seen } else { "no" };
        let effect = format!("{}{choice}.{}", b.effect, b.parameter);
        vec![effect, size(b.smallest_detectable), format!("{:.2e}", b.plausible), seen.to_owned()]
    });
    let header = ["effect", "smallest that shows", "plausible size", "shows"];
    let mut out = tabled(&header, rows.collect());
    out.push('\n');
    if alike.is_empty() {
        out.push_str("No two effects act alike in these data.\n");
    }
    for (one, other, angle) in alike {
        let _ = writeln!(out, "{one} and {other} act alike: their responses are {:.1}° apart.", angle.to_degrees());
    }
    out
}

fn tabled(header: &[&str], rows: Vec<Vec<String>>) -> String {
    let mut table = table(Style::Terminal, header);
    table.add_rows(rows);
    table.to_string()
}

/// The answer in a sentence or two.
pub fn answer(diagnosis: &Diagnosis) -> String {
    match diagnosis.verdict {
        Verdict::Explained => {
            "Explained: the model as given suffices, or nothing exceeds what these data can show.".to_owned()
        }
        Verdict::Unexplained => {
            let terms: Vec<String> = diagnosis.empirical.iter().map(ToString::to_string).collect();
            format!(
                "Unexplained: no known effect takes the misfit away. An empirical formula does: {}.",
                terms.join(", ")
            )
        }
        _ => {
            let lines = diagnosis.findings.iter().map(|finding| {
                let numbers: Vec<String> = finding
                    .parameters
                    .iter()
                    .filter_map(|found| Some(format!("{} = {:.5} ± {:.5}", found.name, found.value, found.std_dev?)))
                    .collect();
                let choice = if finding.choice.is_empty() { String::new() } else { format!(" ({})", finding.choice) };
                let or = if finding.confounded_with.is_empty() {
                    String::new()
                } else {
                    format!("; these data cannot tell it from {}", finding.confounded_with.join(", "))
                };
                format!(
                    "  {}{choice}: {} (probability {:.3}){or}",
                    finding.effect,
                    numbers.join(", "),
                    finding.probability
                )
            });
            let word = if diagnosis.verdict == Verdict::Named { "Named" } else { "Ambiguous" };
            format!("{word}:\n{}", lines.collect::<Vec<_>>().join("\n"))
        }
    }
}
