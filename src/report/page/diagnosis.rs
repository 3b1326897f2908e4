//! The report of a diagnosis.

use super::{Bar, Bars, Block, FORMAT, Hue, Mark, Page, Plane, Provenance, Scale, Section, Shape};
use crate::diagnose::{Diagnosis, Gain, RunReadings};
use crate::report::diagnosis as words;

/// Conditions that are drawn.
const MOST_FIGURES: usize = 12;
/// Probabilities that are no longer drawn.
const NEGLIGIBLE: f64 = 5e-4;

/// The page. `cautions` say what looks wrong with the data themselves, `extended_model` is the text of the extended model.
pub fn page(
    title: String,
    diagnosis: &Diagnosis,
    gain: Option<&Gain>,
    cautions: &[String],
    extended_model: &str,
    provenance: Provenance,
) -> Page {
    let conditions = conditions(&diagnosis.runs);
    let more = match conditions.len().saturating_sub(MOST_FIGURES) {
        0 => String::new(),
        more => format!("{more} more conditions are in the recording."),
    };
    let drawn = &conditions[..conditions.len().min(MOST_FIGURES)];
    let mut beside: Vec<String> = words::first(cautions).collect();
    beside.extend(words::worth(gain));
    beside.extend(words::notes(diagnosis));
    beside.extend(words::next(diagnosis).map(|next| format!("Next experiment: {next}")));
    let mut notes = vec![capital(words::noise(diagnosis))];
    notes.extend(words::left_out(diagnosis));
    let sections = [
        Section::of("What is named", vec![Block::Table(words::findings(diagnosis))]),
        Section::of("What the extension is worth", vec![Block::Bars(gain.map(worth).unwrap_or_default())]),
        Section::of(
            "Where the model is wrong",
            vec![
                Block::Planes(drawn.iter().map(|condition| condition.residuals()).collect()),
                Block::Text(
                    "Arrows are means; a model that is right ends at the cross of the axes, but for the noise."
                        .to_owned(),
                ),
                Block::Table(words::misfit(diagnosis)),
                Block::Planes(drawn.iter().map(|condition| condition.paths()).collect()),
                Block::Text(more),
            ],
        ),
        Section::of(
            "What could explain it",
            vec![Block::Bars(vec![probabilities(diagnosis)]), Block::Table(words::ranking(diagnosis))],
        ),
        Section::of("What these data could not have shown", {
            let mut blocks = vec![Block::List(words::unseen(diagnosis))];
            blocks.push(Block::Bars(visibility(diagnosis)));
            blocks
        }),
        Section::of(
            "Next experiment",
            vec![Block::Text(words::next(diagnosis).map(capital).unwrap_or_else(|| {
                "These data leave no two answers that a single protocol would have to tell apart.".to_owned()
            }))],
        ),
        Section::of("Noise", vec![Block::List(notes)]),
        Section::of(
            "The extended model",
            vec![Block::Paste(
                "extended_model.toml; every command takes it as --robot.".to_owned(),
                extended_model.to_owned(),
            )],
        ),
    ];
    Page {
        format: FORMAT.to_owned(),
        title,
        answer: words::answer(diagnosis),
        beside,
        sections: sections.into_iter().flatten().collect(),
        provenance,
    }
}

/// As a sentence begins.
fn capital(words: String) -> String {
    let mut letters = words.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// Runs that drove the same.
struct Condition<'a> {
    label: &'a str,
    runs: Vec<&'a RunReadings>,
}

fn conditions(runs: &[RunReadings]) -> Vec<Condition<'_>> {
    let mut list: Vec<Condition<'_>> = Vec::new();
    for run in runs {
        match list.iter_mut().find(|known| known.label == run.condition) {
            Some(known) => known.runs.push(run),
            None => list.push(Condition { label: &run.condition, runs: vec![run] }),
        }
    }
    list
}

impl Condition<'_> {
    /// End poses: surveyed less predicted \[mm\].
    fn residuals(&self) -> Plane {
        let hue = Hue::of_words(self.label);
        let ends = |after: bool| -> Vec<[f64; 2]> {
            let end = |run: &&RunReadings| {
                let predicted = if after { run.after.last()? } else { run.before.last()? };
                let measured = run.measured.last()?;
                Some([1e3 * (measured.x - predicted.x), 1e3 * (measured.y - predicted.y)])
            };
            self.runs.iter().filter_map(end).collect()
        };
        let (before, after) = (ends(false), ends(true));
        let arrow = |ends: &[[f64; 2]]| {
            let count = ends.len().max(1) as f64;
            let mean = ends.iter().fold([0.0; 2], |[x, y], end| [x + end[0] / count, y + end[1] / count]);
            vec![[0.0; 2], mean]
        };
        let way = way(self.label);
        let marks = vec![
            Mark::new(hue, true, Shape::Arrow, "", arrow(&before)),
            Mark::new(hue, false, Shape::Arrow, "", arrow(&after)),
            Mark::new(hue, true, Shape::Rings, &format!("model as given{way}"), before),
            Mark::new(hue, false, Shape::Dots, &format!("extended model{way}"), after),
        ];
        Plane { title: format!("{}: surveyed − predicted end", self.label), unit: "mm".to_owned(), marks }
    }

    /// Ways where they were surveyed, ends where these alone were \[m\].
    fn paths(&self) -> Plane {
        let hue = Hue::of_words(self.label);
        let way = way(self.label);
        let mut marks = Vec::new();
        let names = ["measured".to_owned(), format!("model as given{way}"), format!("extended model{way}")];
        for run in &self.runs {
            let measured: Vec<[f64; 2]> = run.measured.iter().map(|pose| [pose.x, pose.y]).collect();
            let predicted = |poses: &[crate::geometry::Pose2]| poses.iter().map(|pose| [pose.x, pose.y]).collect();
            let on_the_way = measured.len() > 2;
            let [of_measured, of_before, of_after] = if on_the_way {
                [Shape::Line, Shape::Line, Shape::Dashes]
            } else {
                [Shape::Crosses, Shape::Rings, Shape::Dots]
            };
            marks.push(Mark::new(hue, true, of_before, &names[1], predicted(&run.before)));
            marks.push(Mark::new(Hue::Ink, false, of_measured, &names[0], measured));
            marks.push(Mark::new(hue, false, of_after, &names[2], predicted(&run.after)));
        }
        let what = if marks.iter().any(|mark| mark.points.len() > 2) { "ways" } else { "ends" };
        Plane { title: format!("{}: {what}", self.label), unit: "m".to_owned(), marks }
    }
}

/// For the key: which way round, where there is one.
fn way(label: &str) -> String {
    let words = ["ccw", "cw", "forward", "reverse"];
    let mut parts = label.split(|c: char| !c.is_alphanumeric());
    parts.find(|part| words.contains(part)).map_or(String::new(), |way| format!(", {way}"))
}

/// Errors on held-out runs, and the gain with its interval.
fn worth(gain: &Gain) -> Vec<Bars> {
    let bar = |label: &str, value: f64, unit: &str, pale: bool| Bar {
        label: label.to_owned(),
        value: value.is_finite().then_some(1e3 * value),
        interval: None,
        words: if value.is_finite() { format!("{:.1} {unit}", 1e3 * value) } else { "not surveyed".to_owned() },
        pale,
    };
    let pair = |title: &str, [before, after]: [f64; 2], unit: &str, reference: Option<(f64, String)>| Bars {
        title: title.to_owned(),
        scale: Scale::Linear,
        rows: vec![bar("model as given", before, unit, true), bar("extended model", after, unit, false)],
        reference,
        span: None,
    };
    let floor = (1e3 * gain.noise_floor, "noise floor".to_owned());
    let share = 1.0 - gain.position_after / gain.position_before;
    let mut list = vec![
        pair("Position error of held-out ends, RMS", [gain.position_before, gain.position_after], "mm", Some(floor)),
        Bars {
            title: "Gain in position, 95 % interval".to_owned(),
            scale: Scale::Linear,
            rows: vec![Bar {
                label: "1 − after/before".to_owned(),
                value: Some(100.0 * share),
                interval: Some(gain.interval.map(|end| 100.0 * end)),
                words: words::share_gained(gain),
                pale: gain.interval[0] <= 0.0,
            }],
            reference: Some((0.0, "none".to_owned())),
            span: None,
        },
    ];
    if gain.heading_before.is_finite() {
        let heading = [gain.heading_before, gain.heading_after];
        list.insert(1, pair("Heading error of held-out ends, RMS", heading, "mrad", None));
    }
    list
}

/// Causes with their probability to be at work.
fn probabilities(diagnosis: &Diagnosis) -> Bars {
    let named = |id: Option<&str>| diagnosis.findings.iter().any(|finding| Some(finding.effect) == id);
    let mut rows: Vec<Bar> = diagnosis
        .probabilities
        .iter()
        .filter(|(_, probability)| *probability >= NEGLIGIBLE)
        .map(|(id, probability)| Bar {
            label: id.unwrap_or("nothing").to_owned(),
            value: Some(100.0 * probability),
            interval: None,
            words: format!("{:.1} %", 100.0 * probability),
            pale: !named(*id),
        })
        .collect();
    rows.sort_by(|one, other| other.value.partial_cmp(&one.value).unwrap_or(std::cmp::Ordering::Equal));
    Bars {
        title: "Probability of each cause to be at work; strong: named".to_owned(),
        scale: Scale::Linear,
        rows,
        reference: None,
        span: None,
    }
}

/// Smallest detectable over plausible sizes, in two columns.
fn visibility(diagnosis: &Diagnosis) -> Vec<Bars> {
    let list = words::visibility(&diagnosis.blind_to);
    let bar = |unseen: &words::Unseen| {
        let ratio = unseen.smallest_detectable / unseen.plausible;
        Bar {
            label: format!("{}.{}", unseen.effect, unseen.parameter),
            value: ratio.is_finite().then_some(ratio),
            interval: None,
            words: match unseen.smallest_detectable {
                smallest if smallest.is_finite() => {
                    format!("{} of {}", words::digits(smallest), words::brief(unseen.plausible))
                }
                _ => "at no size".to_owned(),
            },
            pale: ratio > 1.0,
        }
    };
    // Both columns on one scale.
    let ratios = || list.iter().map(|unseen| unseen.smallest_detectable / unseen.plausible).filter(|r| r.is_finite());
    let span = [ratios().fold(1.0, f64::min), ratios().fold(1.0, f64::max)];
    let half = list.len().div_ceil(2);
    list.chunks(half.max(1))
        .enumerate()
        .map(|(index, part)| Bars {
            title: match index {
                0 => "Smallest detectable size over plausible size".to_owned(),
                _ => "… continued".to_owned(),
            },
            scale: Scale::Logarithmic,
            rows: part.iter().map(bar).collect(),
            reference: Some((1.0, "as large as is plausible".to_owned())),
            span: Some(span),
        })
        .collect()
}
