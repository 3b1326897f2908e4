//! A diagnosis in words and tables, readable in a minute: the answer, what it is worth, where the model is wrong, what
//! could explain it, what these data could not have shown.

use super::grid::Grid;
use super::text::{Style, decimals, parameter};
use crate::calibrate::Parameter;
use crate::diagnose::{Blind, Clock, Diagnosis, Finding, Gain, Remainder, Suspicion, Transient, Verdict};
use crate::effect::{Cause, Effect};
use crate::scene::Contact;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Conditions that a table shows; a report of hundreds of lines is read by nobody.
const MOST_CONDITIONS: usize = 24;
/// Answers that a table shows.
const MOST_ANSWERS: usize = 8;
/// Runs left out that are named.
const MOST_LEFT_OUT: usize = 6;
/// Answers that are no longer worth a line.
const NEGLIGIBLE: f64 = 5e-4;

/// The report for a terminal, after what looks wrong with the data themselves.
pub fn diagnosis(diagnosis: &Diagnosis, gain: Option<&Gain>, cautions: &[String]) -> String {
    let mut out = String::new();
    for words in first(cautions) {
        let _ = writeln!(out, "{words}\n");
    }
    let _ = writeln!(out, "{}\n", answer(diagnosis));
    let draw = |grid: Grid| if grid.rows.is_empty() { String::new() } else { grid.draw(Style::Terminal) };
    out.push_str(&draw(findings(diagnosis)));
    for words in notes(diagnosis) {
        let _ = writeln!(out, "{words}");
    }
    for words in worth(gain) {
        let _ = writeln!(out, "{words}");
    }
    if let Some(words) = next(diagnosis) {
        let _ = writeln!(out, "Next experiment: {words}");
    }
    out.push('\n');
    out.push_str(&draw(misfit(diagnosis)));
    out.push_str(&draw(ranking(diagnosis)));
    let unseen = unseen(diagnosis);
    if !unseen.is_empty() {
        out.push_str("What these data could not have shown\n");
        for words in unseen {
            let _ = writeln!(out, "  {words}");
        }
        out.push('\n');
    }
    let _ = writeln!(out, "Noise: {}.", noise(diagnosis));
    for words in left_out(diagnosis) {
        let _ = writeln!(out, "{words}");
    }
    out
}

/// What looks wrong with the data, as it stands before all that is said of them.
pub fn first(cautions: &[String]) -> impl Iterator<Item = String> {
    cautions.iter().map(|words| format!("Look at the data first. {words}"))
}

/// Runs, or parts of them, that take no part, and why: the first few.
pub fn left_out(diagnosis: &Diagnosis) -> Vec<String> {
    let all = &diagnosis.left_out;
    let shown = if all.len() > MOST_LEFT_OUT { MOST_LEFT_OUT - 1 } else { all.len() };
    let mut words: Vec<String> = all[..shown].iter().map(|run| format!("Left out: {run}.")).collect();
    if shown < all.len() {
        words.push(format!("Left out: {} more, listed in diagnosis.json.", all.len() - shown));
    }
    words
}

/// The same in short, for the recording's text panel.
pub fn markdown(diagnosis: &Diagnosis, gain: Option<&Gain>) -> String {
    let mut out = format!("**{}**\n\n{}\n\n", answer(diagnosis), worth(gain).join("\n\n"));
    for words in notes(diagnosis) {
        let _ = writeln!(out, "{words}\n");
    }
    let draw = |grid: Grid| if grid.rows.is_empty() { String::new() } else { grid.draw(Style::Markdown) };
    out.push_str(&draw(findings(diagnosis)));
    out.push_str(&draw(ranking(diagnosis)));
    if let Some(words) = next(diagnosis) {
        let _ = writeln!(out, "Next experiment: {words}");
    }
    out
}

/// With its sign of comparison; what no number can hold is below the least that one can.
fn p_value(value: f64) -> String {
    if value > 0.0 { format!("= {value:.1e}") } else { format!("< {:.0e}", f64::MIN_POSITIVE) }
}

/// A finding, with how probable it is where that is less than odds of 50 to 1: one beside others is given for less than a first.
fn named_as_far_as_sure(finding: &Finding) -> String {
    const SURE: f64 = 50.0 / 51.0;
    let name = named(finding);
    if finding.probability < SURE { format!("{name} ({})", share(finding.probability)) } else { name }
}

/// The answer in a sentence or two.
pub fn answer(diagnosis: &Diagnosis) -> String {
    let list = |findings: &[&Finding]| {
        let names: Vec<String> = findings.iter().map(|finding| named_as_far_as_sure(finding)).collect();
        joined(&names, "and")
    };
    let (alone, grouped): (Vec<&Finding>, Vec<&Finding>) =
        diagnosis.findings.iter().partition(|finding| finding.confounded_with.is_empty());
    let terms: Vec<String> = diagnosis.empirical.iter().map(ToString::to_string).collect();
    let beside = match terms.as_slice() {
        [] => String::new(),
        terms => format!(", beside a formula that no known effect stands for: {}", terms.join(", ")),
    };
    match diagnosis.verdict {
        Verdict::Explained => match &diagnosis.suspicion {
            None => "Explained: the model as given suffices, or nothing exceeds what these data can show.".to_owned(),
            Some(suspected) => format!(
                "Explained, as far as these data can tell: no cause is sure enough to be named, though {}.",
                speaks(suspected, "one")
            ),
        },
        Verdict::Unexplained => {
            let causes: Vec<String> =
                diagnosis.causes.iter().map(|cause| chosen(cause.effect.id, &cause.choice)).collect();
            let nearest = match (causes.as_slice(), terms.as_slice()) {
                ([], []) => "nothing comes near, and the extended model is the model as given".to_owned(),
                ([], terms) => format!("an empirical formula does what can be done: {}", terms.join(", ")),
                ([one], []) => format!("{one} comes nearest, and the extended model holds it"),
                (causes, []) => format!("{} come nearest, and the extended model holds them", joined(causes, "and")),
                ([one], terms) => format!("{one} comes nearest beside a formula, {}", terms.join(", ")),
                (causes, terms) => {
                    format!("{} come nearest beside a formula, {}", joined(causes, "and"), terms.join(", "))
                }
            };
            format!("Unexplained: no known effect takes the misfit away; {nearest}.")
        }
        Verdict::Named => {
            let s = if alone.len() == 1 { "s" } else { "" };
            format!("Named: {} explain{s} these data{beside}{}.", list(&alone), further(diagnosis))
        }
        Verdict::Ambiguous => {
            let groups = grouped.iter().map(|finding| {
                let mut names = vec![named(finding)];
                names.extend(finding.confounded_with.iter().map(|&other| other.to_owned()));
                joined(&names, "or")
            });
            let groups = groups.collect::<Vec<_>>().join("; ");
            let sure = if alone.is_empty() { String::new() } else { format!("{}; and beside that ", list(&alone)) };
            format!("Ambiguous: {sure}{groups}{beside}. These data cannot tell which{}.", further(diagnosis))
        }
    }
}

/// What speaks for a cause that is not named.
fn speaks(Suspicion { odds, effects }: &Suspicion, one: &str) -> String {
    let names: Vec<String> = effects.iter().map(|(id, p)| format!("{id} ({})", share(*p))).collect();
    format!("odds of {} to 1 speak for {one}, {}", digits(*odds), joined(&names, "or"))
}

/// The same of one beside those that are.
fn further(diagnosis: &Diagnosis) -> String {
    let suspected = diagnosis.suspicion.as_ref();
    suspected.map(|it| format!("; {}, which is not sure enough", speaks(it, "a further cause"))).unwrap_or_default()
}

/// What is to be said of the extended model.
pub(super) fn notes(diagnosis: &Diagnosis) -> Vec<String> {
    let remainder = diagnosis.remainder.and_then(remainder);
    let either_way = diagnosis.findings.iter().filter_map(either_way);
    let all = [tyres(diagnosis), sizes(diagnosis), clocks(diagnosis), transient(diagnosis), remainder];
    either_way.chain(all.into_iter().flatten()).collect()
}

/// That the data tell that a cause is there and not which way it goes, where its one size may be on either side of nothing.
fn either_way(finding: &Finding) -> Option<String> {
    let mut sizes = finding.parameters.iter().filter_map(|found| Some((found.name, found.value, found.std_dev?)));
    let (Some((name, value, std_dev)), None) = (sizes.next(), sizes.next()) else { return None };
    let effect = Effect::named(finding.effect)?;
    let parameter = effect.parameters.iter().find(|parameter| parameter.name == name)?;
    let (least, most, nothing) = (value - 1.96 * std_dev, value + 1.96 * std_dev, effect.neutral(parameter));
    (least < nothing && nothing < most).then(|| {
        let decimals = decimals(std_dev);
        format!(
            "Which way {}.{name} goes these data do not tell, though that something is there: {least:.decimals$} to \
             {most:.decimals$}, its 95 % interval, holds {nothing}, which does nothing.",
            named(finding)
        )
    })
}

/// That the extended model is not what was fitted, where it is not.
fn remainder(remainder: Remainder) -> Option<String> {
    let Remainder { fitted, simulated } = remainder;
    remainder.is_other().then(|| {
        format!(
            "The extended model, simulated as a whole, ends {:.1} mm RMS from these very runs, not {:.1} mm as it was fitted: \
             what its parts do together is more than single parts and pairs of them do. Trust `predict` with it no farther than \
             that.",
            1e3 * simulated,
            1e3 * fitted
        )
    })
}

/// What is left, where it may be made good.
fn transient(diagnosis: &Diagnosis) -> Option<String> {
    diagnosis.transient.map(|Transient { share, log_odds }| {
        format!(
            "What is left is e^{log_odds:.0} times likelier as errors of the motion that are made good by the end of a run, as \
             play, wind-up and delay are. If that is true of this robot, `transient = {share}` under `[doubt]` in its file says so: \
             diagnose again with it."
        )
    })
}

/// Clocks of several campaigns, of which a finding states the mean.
fn clocks(diagnosis: &Diagnosis) -> Option<String> {
    let of = |clock: &Clock| {
        let [offset, std_dev] = [clock.offset, clock.std_dev].map(|seconds| 1e3 * seconds);
        format!("{offset:.0} ± {std_dev:.0} ms in {}", clock.campaign)
    };
    let all: Vec<String> = diagnosis.clocks.iter().map(of).collect();
    (!all.is_empty()).then(|| {
        format!("Each campaign has clocks of its own: {}; the extended model holds their mean.", all.join(", "))
    })
}

/// Sizes in the extended model that are beyond 1 σ of what was found.
fn sizes(diagnosis: &Diagnosis) -> Option<String> {
    let mut other = Vec::new();
    for finding in &diagnosis.findings {
        let is_it = |cause: &&Cause| cause.effect.id == finding.effect && cause.choice == finding.choice;
        let Some(cause) = diagnosis.causes.iter().find(is_it) else { continue };
        for (parameter, value) in cause.effect.parameters.iter().zip(&cause.values) {
            let found = finding.parameters.iter().find(|found| found.name == parameter.name);
            let Some((found, std_dev)) = found.and_then(|found| Some((found.value, found.std_dev?))) else { continue };
            if parameter.difference(*value, found).abs() > std_dev {
                let decimals = decimals(std_dev);
                other.push(format!("{}.{} = {value:.decimals$}", named(finding), parameter.name));
            }
        }
    }
    (!other.is_empty()).then(|| {
        format!(
            "The extended model holds {}: so it predicts these runs best as it is; the values above allow for what is in \
             doubt of its tyres and responses.",
            joined(&other, "and")
        )
    })
}

/// That the tyres are not the model's, where they are not.
fn tyres(diagnosis: &Diagnosis) -> Option<String> {
    let other = diagnosis.other_tyres?;
    let law = |contact: Contact| match contact {
        Contact::Patch => "on patches of rubber",
        Contact::Rigid => "like rigid cylinders",
    };
    Some(format!(
        "Tyres: these wheels meet the ground {}, not {} as the model has it: e^{:.0} times likelier. The answer stands on that, \
         and so does the extended model.",
        law(other.contact),
        law(other.contact.other()),
        other.log_odds
    ))
}

/// A finding with its wheel or side.
fn named(finding: &Finding) -> String {
    chosen(finding.effect, &finding.choice)
}

fn chosen(effect: &str, choice: &str) -> String {
    if choice.is_empty() { effect.to_owned() } else { format!("{effect} ({choice})") }
}

fn joined(names: &[String], word: &str) -> String {
    match names {
        [] => String::new(),
        [name] => name.clone(),
        [first @ .., last] => format!("{} {word} {last}", first.join(", ")),
    }
}

/// What is named, a line a parameter.
pub(super) fn findings(diagnosis: &Diagnosis) -> Grid {
    let header = ["cause", "parameter", "value ± 1 σ", "probability", "or"];
    let alone = diagnosis.findings.iter().all(|finding| finding.confounded_with.is_empty());
    let columns = if alone { header.len() - 1 } else { header.len() };
    let mut grid = Grid::new("", &header[..columns]);
    for finding in &diagnosis.findings {
        // What was not sought is nothing, or where and how large a spot is.
        let stated = finding.parameters.iter().filter(|found| found.std_dev.is_some() || found.value != 0.0);
        for (index, found) in stated.enumerate() {
            let first = |words: String| if index == 0 { words } else { String::new() };
            let value = match found.std_dev {
                Some(std_dev) => parameter(&Parameter { value: found.value, std_dev }),
                None => significant(found.value, 3),
            };
            let cells = [
                first(named(finding)),
                found.name.to_owned(),
                value,
                first(share(finding.probability)),
                first(finding.confounded_with.join(", ")),
            ];
            grid.row(cells.into_iter().take(columns));
        }
    }
    grid
}

fn share(probability: f64) -> String {
    match probability {
        p if p > 0.9995 => "> 0.999".to_owned(),
        p if p < NEGLIGIBLE => "< 0.001".to_owned(),
        p => format!("{p:.3}"),
    }
}

/// What the extension is worth on runs that took no part in it, and on repeats where those do not show it.
pub(super) fn worth(gain: Option<&Gain>) -> Vec<String> {
    let Some(gain) = gain else { return vec!["Gain: nothing could be held out.".to_owned()] };
    let on_repeats = gain.on_repeats.as_deref().map(|gain| worth_on(gain, "repeats"));
    [worth_on(gain, "runs held out")].into_iter().chain(on_repeats).collect()
}

fn worth_on(gain: &Gain, runs: &str) -> String {
    let sure = if gain.interval[0] > 0.0 { "" } else { ", so none that is sure" };
    let heading = if gain.heading_before.is_finite() {
        format!(", heading {:.1} → {:.1} mrad", 1e3 * gain.heading_before, 1e3 * gain.heading_after)
    } else {
        String::new()
    };
    let account = match gain.surprise() {
        None => String::new(),
        Some(times) => {
            format!(
                ": {times:.1} times as much is left, so that what the answer says of such runs is surer than it should be"
            )
        }
    };
    format!(
        "Gain on {runs} ({}): position {:.1} → {:.1} mm{heading}; {}{sure}. Noise floor {:.1} mm; by its own intervals the \
         answer was to leave {:.1} mm{account}.",
        gain.held_out,
        1e3 * gain.position_before,
        1e3 * gain.position_after,
        share_gained(gain),
        1e3 * gain.noise_floor,
        1e3 * gain.position_expected
    )
}

/// The gain in position with its interval.
pub(super) fn share_gained(gain: &Gain) -> String {
    // Adding zero makes −0 a 0.
    let percent = |share: f64| (100.0 * share).round() + 0.0;
    let [low, high] = gain.interval.map(percent);
    format!("{} % ({low} to {high} %)", percent(1.0 - gain.position_after / gain.position_before))
}

/// What to drive next, where two answers stand, or one that is suspected.
pub(super) fn next(diagnosis: &Diagnosis) -> Option<String> {
    let next = diagnosis.next_experiment.as_ref()?;
    // Both answers hold what is not in question.
    let answers: Vec<Vec<&str>> = next.separates.iter().map(|answer| answer.split(" and ").collect()).collect();
    let apart = |answer: &Vec<&str>| {
        let own: Vec<&str> = answer
            .iter()
            .copied()
            .filter(|part| answers.len() < 2 || answers.iter().any(|other| !other.contains(part)))
            .collect();
        if own.is_empty() { "nothing more".to_owned() } else { own.join(" and ") }
    };
    let separates: Vec<String> = answers.iter().map(apart).collect();
    Some(format!(
        "{}; five runs would tell {} by {:.1} σ.",
        next.protocol,
        separates.join(" from "),
        next.expected_sigma
    ))
}

/// Where the model as given is wrong.
pub(super) fn misfit(diagnosis: &Diagnosis) -> Grid {
    let mut grid = Grid::new(
        "Where the model as given is wrong: surveyed less predicted end poses, mean ± 1 σ",
        &["condition", "runs", "x [mm]", "y [mm]", "heading [mrad]", "a run strays by x, y, heading"],
    );
    let m = &diagnosis.misfit;
    let milli = |value: Option<f64>| value.map_or("–".to_owned(), |value| format!("{:.1}", 1e3 * value));
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    let twice = |label: &str| m.conditions.iter().filter(|c| c.label == label).count() > 1;
    for c in m.conditions.iter().take(MOST_CONDITIONS) {
        let number = seen.entry(&c.label).and_modify(|number| *number += 1).or_insert(1);
        // The same on paper, driven differently.
        let label = if twice(&c.label) { format!("{} #{number}", c.label) } else { c.label.clone() };
        let part = |index: usize| match c.residual[index] {
            Some(value) => format!("{:.1} ± {:.1}", 1e3 * value, 1e3 * c.std_dev[index]),
            None => "–".to_owned(),
        };
        let strays = match c.repeatability {
            [None, None, None] => "–".to_owned(),
            [x, y, heading] => format!("{}, {}, {}", milli(x), milli(y), milli(heading)),
        };
        grid.row([label, c.runs.to_string(), part(0), part(1), part(2), strays]);
    }
    let more = match m.conditions.len().saturating_sub(MOST_CONDITIONS) {
        0 => String::new(),
        more => format!("… and {more} more conditions. "),
    };
    grid.noted(format!("{more}χ² {:.1} on {} degrees of freedom, p {}", m.chi2, m.dof, p_value(m.p_value)))
}

/// The answers that were weighed, without what they all hold.
pub(super) fn ranking(diagnosis: &Diagnosis) -> Grid {
    let worth_a_line = diagnosis.ranking.iter().take_while(|ranked| ranked.probability >= NEGLIGIBLE).count();
    let shown = &diagnosis.ranking[..diagnosis.ranking.len().min(worth_a_line.clamp(3, MOST_ANSWERS))];
    let common: Vec<&String> = match shown {
        [first, _, ..] => {
            first.causes.iter().filter(|cause| shown.iter().all(|ranked| ranked.causes.contains(cause))).collect()
        }
        _ => Vec::new(),
    };
    let mut grid = Grid::new("What could explain it", &["causes", "ln evidence", "probability"]);
    for ranked in shown {
        let own: Vec<String> =
            ranked.causes.iter().filter(|cause| !common.contains(cause)).map(String::clone).collect();
        let words = match (own.is_empty(), common.is_empty()) {
            (false, _) => own.join(" + "),
            (true, true) => "nothing".to_owned(),
            (true, false) => "nothing more".to_owned(),
        };
        grid.row([words, format!("{:.1}", ranked.log_evidence), share(ranked.probability)]);
    }
    let mut notes = Vec::new();
    if !common.is_empty() {
        let common: Vec<String> = common.into_iter().cloned().collect();
        notes.push(format!("each together with {}", joined(&common, "and")));
    }
    match diagnosis.ranking.len() - shown.len() {
        0 => {}
        more => notes.push(format!("{more} less probable answers are left out")),
    }
    grid.noted(notes.join("; "))
}

/// An effect's parameter, wheels and sides together.
pub(super) struct Unseen {
    pub effect: &'static str,
    pub parameter: &'static str,
    /// Over all choices, the worst.
    pub smallest_detectable: f64,
    pub plausible: f64,
}

/// Smallest detectable and plausible sizes, the least visible first.
pub(super) fn visibility(blind: &[Blind]) -> Vec<Unseen> {
    let mut list: Vec<Unseen> = Vec::new();
    for blind in blind {
        match list.iter_mut().find(|known| (known.effect, known.parameter) == (blind.effect, blind.parameter)) {
            Some(known) => known.smallest_detectable = known.smallest_detectable.max(blind.smallest_detectable),
            None => list.push(Unseen {
                effect: blind.effect,
                parameter: blind.parameter,
                smallest_detectable: blind.smallest_detectable,
                plausible: blind.plausible,
            }),
        }
    }
    let ratio = |unseen: &Unseen| unseen.smallest_detectable / unseen.plausible;
    list.sort_by(|one, other| ratio(other).total_cmp(&ratio(one)));
    list
}

/// What these data could not have shown at a plausible size.
pub(super) fn unseen(diagnosis: &Diagnosis) -> Vec<String> {
    let list = visibility(&diagnosis.blind_to);
    let (never, large): (Vec<&Unseen>, Vec<&Unseen>) = list
        .iter()
        .filter(|unseen| unseen.smallest_detectable > unseen.plausible)
        .partition(|unseen| unseen.smallest_detectable.is_infinite());
    let mut lines = Vec::new();
    if !never.is_empty() {
        let names: Vec<String> = never.iter().map(|unseen| format!("{}.{}", unseen.effect, unseen.parameter)).collect();
        lines.push(format!("of any size: {}", names.join(", ")));
    }
    lines.extend(large.iter().map(|unseen| {
        let Unseen { effect, parameter, smallest_detectable, plausible } = unseen;
        format!("{effect}.{parameter} below {} (plausible: {})", digits(*smallest_detectable), brief(*plausible))
    }));
    lines
}

/// As short as it is stated, or in two significant digits.
pub(super) fn brief(value: f64) -> String {
    let stated = value.to_string();
    if stated.len() <= 6 { stated } else { digits(value) }
}

/// Two significant digits.
pub(super) fn digits(value: f64) -> String {
    significant(value, 2)
}

/// So many significant digits, or all before the decimal point.
fn significant(value: f64, digits: u8) -> String {
    if !value.is_finite() || value == 0.0 {
        return "–".to_owned();
    }
    let decimals = (f64::from(digits) - 1.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.decimals$}")
}

/// What runs of one kind differ by.
pub(super) fn noise(diagnosis: &Diagnosis) -> String {
    let noise = &diagnosis.noise;
    format!(
        "survey {:.2} mm, {:.2} mrad; scatter {:.2} mrad a corner, {:.2} mrad/√m, {:.3} % of distance; clocks {:.1} ms",
        1e3 * noise.position_std,
        1e3 * noise.heading_std,
        1e3 * noise.scatter.heading_per_corner,
        1e3 * noise.scatter.heading_per_sqrt_metre,
        100.0 * noise.scatter.distance,
        1e3 * noise.clock_std
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::Found;

    #[test]
    fn an_extended_model_that_is_not_what_was_fitted_is_said_to_be_so() {
        let words = remainder(Remainder { fitted: 0.0556, simulated: 0.1914 }).expect("it is another");
        assert!(words.contains("ends 191.4 mm RMS from these very runs, not 55.6 mm as it was fitted"), "{words}");
        assert!(!words.contains("  "), "{words}");
        assert_eq!(remainder(Remainder { fitted: 0.0327, simulated: 0.0324 }), None);
    }

    #[test]
    fn a_size_on_either_side_of_nothing_is_said_to_be_so() {
        let spot = |ratio, std_dev| Finding {
            effect: "floor_grip_patch",
            choice: String::new(),
            parameters: vec![
                Found { name: "x_m", value: 1.65, std_dev: None },
                Found { name: "ratio", value: ratio, std_dev: Some(std_dev) },
            ],
            probability: 1.0,
            confounded_with: Vec::new(),
        };
        let words = either_way(&spot(1.05, 0.17)).expect("it may grip more or less");
        assert!(
            words.starts_with("Which way floor_grip_patch.ratio goes") && words.contains("0.72 to 1.38"),
            "{words}"
        );
        assert!(words.contains("holds 1,") && !words.contains("  "), "{words}");
        assert_eq!(either_way(&spot(0.65, 0.17)), None);
    }

    #[test]
    fn a_name_that_is_less_than_sure_says_so() {
        let finding = |probability| Finding {
            effect: "floor_slope",
            choice: String::new(),
            parameters: Vec::new(),
            probability,
            confounded_with: Vec::new(),
        };
        assert_eq!(named_as_far_as_sure(&finding(0.985)), "floor_slope");
        assert_eq!(named_as_far_as_sure(&finding(0.748)), "floor_slope (0.748)");
    }
}
