//! A robot's certificate: what was measured, why, and one verdict a line; published multipliers beside it.

use super::text::{Style, table};
use crate::experiment::certify::{Certificate, Check, LiteratureRow};
use comfy_table::CellAlignment;
use serde::Serialize;
use std::fmt::Write;

/// `certify --json`. A number that could not be found is `null`.
#[derive(Debug, Clone, Serialize)]
pub struct CertifyJson {
    robot: String,
    effective_track_m: f64,
    track_factor: f64,
    theory_factor: f64,
    contributions: Vec<ContributionJson>,
    rolling_radius_m: f64,
    checks: Vec<CheckJson>,
}

#[derive(Debug, Clone, Serialize)]
struct ContributionJson {
    cause: &'static str,
    delta: f64,
}

#[derive(Debug, Clone, Serialize)]
struct CheckJson {
    name: &'static str,
    value: f64,
    limit: f64,
    pass: bool,
}

impl From<&Certificate> for CertifyJson {
    fn from(certificate: &Certificate) -> Self {
        let contributions = certificate.contributions.iter();
        let check = |check: &Check| CheckJson {
            name: check.name,
            value: check.value,
            limit: check.limit,
            pass: check.passed(),
        };
        CertifyJson {
            robot: certificate.robot.clone(),
            effective_track_m: certificate.effective_track,
            track_factor: certificate.track_factor,
            theory_factor: certificate.theory_factor,
            contributions: contributions.map(|one| ContributionJson { cause: one.cause, delta: one.delta }).collect(),
            rolling_radius_m: certificate.rolling_radius,
            checks: certificate.checks.iter().map(check).collect(),
        }
    }
}

/// What was measured, why it differs from theory, and the verdicts.
pub fn certificate(certificate: &Certificate) -> String {
    let mut text = String::new();
    let shown = |value: f64, digits: usize| known(value, |value| format!("{value:.digits$}"));
    let _ = writeln!(
        text,
        "{}: effective track {} m in a spin on the spot, {} times the track of {:.4} m; theory says {:.5}",
        certificate.robot,
        shown(certificate.effective_track, 4),
        shown(certificate.track_factor, 5),
        certificate.track_width,
        certificate.theory_factor
    );
    let _ = writeln!(text, "  why: {} =", signed(certificate.track_factor - certificate.theory_factor));
    for one in &certificate.contributions {
        let _ = writeln!(text, "    {}  {}", signed(one.delta), in_words(one.cause));
    }
    let list = |points: &[(f64, f64)], digits: usize, unit: &str| {
        let each = points.iter().map(|&(at, factor)| format!("{} at {at:.digits$} {unit}", shown(factor, 5)));
        each.collect::<Vec<_>>().join(", ")
    };
    let _ = writeln!(text, "  in spins: {}", list(&certificate.spins, 2, "rad/s"));
    let _ = writeln!(text, "  in arcs: {}", list(&certificate.arcs, 2, "m"));
    let milliseconds: Vec<(f64, f64)> = certificate.steps.iter().map(|(step, factor)| (1e3 * step, *factor)).collect();
    let _ = writeln!(text, "  by step: {}", list(&milliseconds, 4, "ms"));
    let _ = writeln!(
        text,
        "  rolling radius {} mm, by the tyres' squash {} mm; on a straight it turns by {} mrad/m as built",
        shown(1e3 * certificate.rolling_radius, 4),
        shown(1e3 * certificate.rolling_radius_theory, 4),
        signed(1e3 * certificate.drift)
    );
    text.push('\n');
    for check in &certificate.checks {
        let verdict = if check.passed() { "pass" } else { "FAIL" };
        let _ = writeln!(text, "{verdict}  {:<16} {}  {}", check.name, against(check), check.note);
    }
    let failed = certificate.checks.iter().filter(|check| !check.passed()).count();
    text.push('\n');
    let _ = match failed {
        0 => writeln!(text, "all {} checks passed", certificate.checks.len()),
        _ => writeln!(text, "{failed} of {} checks failed", certificate.checks.len()),
    };
    text
}

/// A number that was found, as `format` writes it.
fn known(value: f64, format: impl Fn(f64) -> String) -> String {
    if value.is_nan() { "unknown".to_owned() } else { format(value) }
}

/// With its sign and five digits; a zero has none but plus.
fn signed(value: f64) -> String {
    known(value, |value| format!("{:+.5}", (1e5 * value).round() / 1e5 + 0.0))
}

fn against(check: &Check) -> String {
    let sign = match check.passed() {
        true => "≤",
        false if check.value.is_nan() => "?",
        false => ">",
    };
    format!("{:>8} {sign} {:<7}", known(check.value, number), number(check.limit))
}

fn number(value: f64) -> String {
    match value.abs() {
        size if (0.01..1.0).contains(&size) => format!("{value:.3}"),
        size if size == 0.0 || (1.0..1e4).contains(&size) => format!("{value:.2}"),
        _ => format!("{value:.1e}"),
    }
}

fn in_words(cause: &str) -> &str {
    match cause {
        "time_step" => "the time step",
        "unequal_tyres" => "tyres that differ from each other",
        "load_offset" => "the mass centre's offset from the middle of the wheels",
        "caster_drag" => "drag of casters",
        "friction_ratio" => "friction across that differs from friction along",
        "slip_stiffness" => "rubber that sticks before it slides",
        "patch_size" => "length and width of the patches",
        "remainder" => "what is left: patches as small as a point, and the engine",
        other => other,
    }
}

/// Published multipliers beside prediction and theory, and what it would take to reach them.
pub fn literature(rows: &[LiteratureRow]) -> String {
    let header = [
        "robot",
        "published",
        "as",
        "theory",
        "predicted",
        "published − predicted",
        "− theory",
        "mass offset that would",
        "friction across/along",
        "by 1 + k²(l/b)²",
        "patch size",
    ];
    let mut table = table(Style::Terminal, &header);
    if let Some(column) = table.column_mut(2) {
        column.set_cell_alignment(CellAlignment::Left);
    }
    for row in rows {
        let published = row.published.factor;
        let patch = |scale: f64| {
            let [width, length] = row.patch.map(|size| 1e3 * size * scale);
            format!("× {scale:.2}: {length:.0} long, {width:.0} mm wide")
        };
        table.add_row([
            row.published.robot.to_owned(),
            format!("{published:.3}"),
            row.published.source.to_owned(),
            format!("{:.4}", row.theory),
            known(row.predicted, |factor| format!("{factor:.4}")),
            known(published - row.predicted, |off| format!("{off:+.4}")),
            format!("{:+.4}", published - row.theory),
            row.load_offset.map_or("no offset does".to_owned(), |offset| format!("{:.1} % of l", 1e2 * offset)),
            row.friction_ratio.map_or("no ratio does".to_owned(), |ratio| format!("{ratio:.3}")),
            row.friction_ratio_of_most_dissipation.map_or("no ratio does".to_owned(), |ratio| format!("{ratio:.3}")),
            row.patch_scale.map_or("no size does".to_owned(), patch),
        ]);
    }
    format!(
        "b_eff/b as published, by 1 + (l/b)², and simulated; then what alone would give the published figure\n{table}\n\
         No robot is tuned to its figure. Multipliers are rounded and were found on one floor: read them as bands.\n"
    )
}
