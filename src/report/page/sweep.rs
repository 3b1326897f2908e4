//! The report of a sweep: what came out over what was varied, and which parameter matters.

use super::{Bar, Bars, Block, Chart, FORMAT, Hue, Mark, Page, Provenance, Scale, Section, Shape};
use crate::experiment::sweep::{Plan, PointKind};
use crate::report::grid::Grid;
use crate::table::{Cell, Table};

/// Charts at most; those of what matters most come first.
const MOST_CHARTS: usize = 12;
/// Dots of a chart at most, evenly taken from more.
const MOST_DOTS: usize = 2000;
/// Groups that a number's range is cut into, and values that are groups of their own.
const GROUPS: usize = 12;
/// What two parameters have to explain together beyond each by itself to be worth a row.
const NOTABLE: f64 = 0.05;
/// Ratio of greatest to least from which on an axis is logarithmic.
const WIDE: f64 = 100.0;

/// The page of a sweep's `table`, made by `plan`.
pub fn page(plan: &Plan, table: &Table, provenance: Provenance) -> Page {
    let sweep = Columns::of(plan, table);
    let robots = sweep.words_of("robot", plan);
    let title = format!("Sweep of {} {}: {robots}", table.rows.len(), sweep.points_are);
    let failures = sweep.failures();
    let mut beside = sweep.shares_in_words();
    if !failures.is_empty() {
        beside.push(format!("{} points could not be done.", failures.len()));
    }
    let (charts, left_out) = sweep.charts();
    let left_out = match left_out {
        0 => String::new(),
        count => format!("{count} more charts, of what matters less, are left out."),
    };
    let unable: Vec<String> =
        failures.iter().take(5).map(|(point, reason)| format!("point {point}: {reason}")).collect();
    let sections = [
        Section::of(
            "What came out over what was varied",
            vec![
                Block::Bars(sweep.bars()),
                Block::Charts(charts),
                Block::Text("A dot a point; lines are medians of groups of points.".to_owned()),
                Block::Text(left_out),
            ]
            .into_iter()
            .filter(|block| sweep.has_figures() || !matches!(block, Block::Text(_)))
            .collect(),
        ),
        Section::of("What matters", vec![Block::Table(sweep.influence())]),
        Section::of("Numbers", vec![Block::Table(sweep.summary()), Block::Table(sweep.counts())]),
        Section::of("Points to look at", vec![Block::Table(sweep.extremes())]),
        Section::of("What could not be done", vec![Block::List(unable)]),
        Section::of(
            "The plan",
            vec![Block::Paste("plan.toml; it gives the same bytes on any machine:".to_owned(), plan.text.clone())],
        ),
    ];
    Page {
        format: FORMAT.to_owned(),
        title,
        answer: sweep.answer(),
        beside,
        sections: sections.into_iter().flatten().collect(),
        provenance,
    }
}

/// Something that was varied.
struct Input {
    /// As the plan has it: `tyre.friction_across`.
    name: String,
    column: usize,
    /// Words rather than numbers.
    text: bool,
    /// Different values, numbers in order, words as they come.
    values: Vec<String>,
}

/// What came out at a point, from its row; `None` where nothing did.
type Of = dyn Fn(&[Cell]) -> Option<f64>;

/// Something that came out, in a reader's unit.
struct Output {
    name: &'static str,
    unit: &'static str,
    of: Box<Of>,
}

struct Columns<'a> {
    table: &'a Table,
    kind: PointKind,
    points_are: &'static str,
    inputs: Vec<Input>,
    outputs: Vec<Output>,
}

impl<'a> Columns<'a> {
    fn of(plan: &Plan, table: &'a Table) -> Columns<'a> {
        let inputs = plan.keys().map(|key| {
            let name = key.name().to_owned();
            let column = position(table, &name.replace('.', "_"));
            let text = key.takes_text();
            let mut cells: Vec<&Cell> = Vec::new();
            for cell in table.rows.iter().filter_map(|row| row.get(column)) {
                if cells.len() <= GROUPS && !cells.contains(&cell) {
                    cells.push(cell);
                }
            }
            if !text {
                cells.sort_by(|one, other| value(one).unwrap_or(0.0).total_cmp(&value(other).unwrap_or(0.0)));
            }
            Input { name, column, text, values: cells.into_iter().map(words).collect() }
        });
        let column = |name: &'static str, unit: &'static str, shown: &'static str, factor: f64| {
            let column = position(table, name);
            let of = move |row: &[Cell]| row.get(column).and_then(value).map(|value| factor * value);
            Output { name: shown, unit, of: Box::new(of) }
        };
        let (points_are, outputs) = match plan.kind {
            PointKind::Run => {
                let parts = ["error_x_m", "error_y_m"].map(|name| position(table, name));
                let error = move |row: &[Cell]| {
                    let [x, y] = parts.map(|column| row.get(column).and_then(value));
                    Some(1e3 * x?.hypot(y?))
                };
                let position = Output { name: "position error", unit: "mm", of: Box::new(error) };
                ("runs", vec![position, column("error_heading_rad", "mrad", "heading error", 1e3)])
            }
            PointKind::Campaign => (
                "campaigns",
                vec![
                    column("e_max_syst_after_m", "mm", "E_max,syst after", 1e3),
                    column("e_max_syst_before_m", "mm", "E_max,syst before", 1e3),
                    column("diameter_ratio", "", "E_d", 1.0),
                    column("track_ratio", "", "E_b", 1.0),
                    column("distance_scale", "", "E_s", 1.0),
                ],
            ),
            PointKind::Challenge => (
                "challenges",
                vec![
                    column("strength_sigma", "σ", "strength of what was hidden", 1.0),
                    column("set_size", "", "causes named", 1.0),
                    column("log_score_regret", "", "log-score regret", 1.0),
                ],
            ),
        };
        Columns { table, kind: plan.kind, points_are, inputs: inputs.collect(), outputs }
    }

    /// What was varied under `key`, or what holds everywhere.
    fn words_of(&self, key: &str, plan: &Plan) -> String {
        let varied = self.inputs.iter().find(|input| input.name == key).map(|input| input.values.join(", "));
        varied.unwrap_or_else(|| plan.base(key))
    }

    /// Pairs of a point's row and what came out.
    fn pairs(&self, output: &Output) -> Vec<(&'a [Cell], f64)> {
        self.table.rows.iter().filter_map(|row| Some((row.as_slice(), (output.of)(row)?))).collect()
    }

    fn answer(&self) -> String {
        let count = self.table.rows.len();
        let spread = |output: &Output| {
            let values = sorted(self.pairs(output).into_iter().map(|(_, value)| value));
            (!values.is_empty()).then(|| [0.5, 0.05, 0.95].map(|share| quantile(&values, share)))
        };
        let words = match self.kind {
            PointKind::Run => spread(&self.outputs[0]).map(|[median, low, high]| {
                format!("Over {count} runs dead reckoning ends {median:.1} mm off in the median; nine in ten runs, from {low:.1} to {high:.1} mm.")
            }),
            PointKind::Campaign => {
                spread(&self.outputs[1]).zip(spread(&self.outputs[0])).map(|([before, ..], [after, low, high])| {
                    format!("Over {count} campaigns calibration takes E_max,syst from {before:.1} to {after:.1} mm in the median; nine in ten end from {low:.1} to {high:.1} mm.")
                })
            }
            PointKind::Challenge => {
                let tally = self.tally("tally");
                let parts: Vec<String> =
                    tally.iter().map(|(word, times)| format!("{times} {}", word.replace('_', " "))).collect();
                (!parts.is_empty()).then(|| format!("Of {count} challenges: {}.", parts.join(", ")))
            }
        };
        words.unwrap_or_else(|| format!("None of {count} points could be done."))
    }

    /// How often each word of a column of text comes, the most frequent first.
    fn tally(&self, name: &str) -> Vec<(String, usize)> {
        let column = position(self.table, name);
        let mut counts: Vec<(String, usize)> = Vec::new();
        for row in &self.table.rows {
            let Some(Cell::Text(word)) = row.get(column) else { continue };
            match counts.iter_mut().find(|(known, _)| known == word) {
                Some((_, count)) => *count += 1,
                None => counts.push((word.clone(), 1)),
            }
        }
        counts.sort_by(|one, other| other.1.cmp(&one.1).then(one.0.cmp(&other.0)));
        counts
    }

    fn failures(&self) -> Vec<(usize, String)> {
        let column = position(self.table, "failure");
        let failure = |(index, row): (usize, &Vec<Cell>)| match row.get(column) {
            Some(Cell::Text(reason)) => Some((index, reason.clone())),
            _ => None,
        };
        self.table.rows.iter().enumerate().filter_map(failure).collect()
    }

    /// The share of an output's variance between groups of an input's values.
    fn share(&self, input: &Input, output: &Output) -> Option<f64> {
        let groups: Vec<Vec<f64>> = self
            .groups(input, self.pairs(output))
            .into_iter()
            .map(|group| group.into_iter().map(|(_, value)| value).collect())
            .collect();
        explained(&groups)
    }

    /// The same of groups of values of two; `None` where there are too few points for it.
    fn share_together(&self, one: &Input, other: &Input, output: &Output) -> Option<f64> {
        let groups = self.groups(one, self.pairs(output)).into_iter().flat_map(|part| self.groups(other, part));
        let groups: Vec<Vec<f64>> = groups.map(|group| group.into_iter().map(|(_, value)| value).collect()).collect();
        let points: usize = groups.iter().map(Vec::len).sum();
        explained(&groups).filter(|_| points >= 2 * groups.len())
    }

    /// Points grouped by an input's value: by itself where there are few, else in groups of about the same size.
    fn groups(&self, input: &Input, mut pairs: Vec<(&'a [Cell], f64)>) -> Vec<Vec<(&'a [Cell], f64)>> {
        if input.text || input.values.len() <= GROUPS {
            let of =
                |name: &String| pairs.iter().filter(|(row, _)| words(&row[input.column]) == *name).copied().collect();
            return input.values.iter().map(of).collect();
        }
        pairs.sort_by(|one, other| {
            value(&one.0[input.column]).unwrap_or(0.0).total_cmp(&value(&other.0[input.column]).unwrap_or(0.0))
        });
        let count = (pairs.len() / 8).clamp(2, GROUPS);
        (0..count).map(|k| pairs[k * pairs.len() / count..(k + 1) * pairs.len() / count].to_vec()).collect()
    }

    /// Inputs that vary, with their share of an output, the greatest first.
    fn ranked(&self, output: &Output) -> Vec<(&Input, f64)> {
        let mut ranked: Vec<(&Input, f64)> =
            self.inputs.iter().filter_map(|input| Some((input, self.share(input, output)?))).collect();
        ranked.sort_by(|one, other| other.1.total_cmp(&one.1));
        ranked
    }

    fn shares_in_words(&self) -> Vec<String> {
        let output = &self.outputs[0];
        let ranked = self.ranked(output);
        let parts: Vec<String> = ranked
            .iter()
            .take(3)
            .filter(|(_, share)| *share >= 0.01)
            .map(|(input, share)| format!("{} {:.0} %", input.name, 100.0 * share))
            .collect();
        match ranked.len() {
            0 => Vec::new(),
            _ if parts.is_empty() => {
                vec![format!("No parameter explains a hundredth of the {}'s variance by itself.", output.name)]
            }
            _ => vec![format!("Of the {}'s variance each explains by itself: {}.", output.name, parts.join(", "))],
        }
    }

    fn influence(&self) -> Grid {
        let mut header = vec!["parameter"];
        header.extend(self.outputs.iter().map(|output| output.name));
        let mut grid = Grid::new(
            "Share of the variance that a parameter explains by itself, or two together where that is much more",
            &header,
        );
        let mut inputs: Vec<&Input> = self.inputs.iter().filter(|input| input.values.len() > 1).collect();
        let of_first = |input: &Input| self.share(input, &self.outputs[0]).unwrap_or(0.0);
        inputs.sort_by(|one, other| of_first(other).total_cmp(&of_first(one)));
        for input in inputs {
            let cell = |output: &Output| {
                self.share(input, output).map_or("–".to_owned(), |share| format!("{:.0} %", 100.0 * share))
            };
            grid.row([input.name.clone()].into_iter().chain(self.outputs.iter().map(cell)));
        }
        for (one, other) in pairs(&self.inputs) {
            let together = |output: &Output| {
                let alone = self.share(one, output)? + self.share(other, output)?;
                self.share_together(one, other, output).filter(|share| *share > alone + NOTABLE)
            };
            let shares: Vec<Option<f64>> = self.outputs.iter().map(together).collect();
            if shares.iter().any(Option::is_some) {
                let cell = |share: &Option<f64>| share.map_or(String::new(), |share| format!("{:.0} %", 100.0 * share));
                let name = format!("{} with {}", one.name, other.name);
                grid.row([name].into_iter().chain(shares.iter().map(cell)));
            }
        }
        grid.noted("correlation ratio of groups of its values, less what chance would give; the rest is noise, and what more than two do together")
    }

    fn summary(&self) -> Grid {
        let mut grid = Grid::new("What came out", &["", "points", "least", "5 %", "median", "95 %", "greatest"]);
        for output in &self.outputs {
            let values = sorted(self.pairs(output).into_iter().map(|(_, value)| value));
            if values.is_empty() {
                continue;
            }
            let numbers = [0.0, 0.05, 0.5, 0.95, 1.0].map(|share| figure(quantile(&values, share), output.unit));
            grid.row([labelled(output), values.len().to_string()].into_iter().chain(numbers));
        }
        grid
    }

    /// What was answered, where points are challenges.
    fn counts(&self) -> Grid {
        let mut grid = Grid::new("How it was answered", &["tally", "challenges", "share"]);
        if self.kind == PointKind::Challenge {
            for (word, count) in self.tally("tally") {
                let share = 100.0 * count as f64 / self.table.rows.len() as f64;
                grid.row([word.replace('_', " "), count.to_string(), format!("{share:.0} %")]);
            }
        }
        grid
    }

    /// Points where the first output is greatest and least.
    fn extremes(&self) -> Grid {
        let output = &self.outputs[0];
        let mut header = vec!["point".to_owned(), "seed".to_owned(), labelled(output)];
        header.extend(self.inputs.iter().map(|input| input.name.clone()));
        let header: Vec<&str> = header.iter().map(String::as_str).collect();
        let mut grid = Grid::new(format!("Greatest and least {}", output.name), &header);
        let mut pairs = self.pairs(output);
        pairs.sort_by(|one, other| other.1.total_cmp(&one.1));
        let count = pairs.len();
        let chosen = pairs.iter().enumerate().filter(|(place, _)| *place < 5 || place + 3 >= count);
        for (_, (row, came_out)) in chosen {
            let cells = [words(&row[0]), words(&row[2]), figure(*came_out, output.unit)];
            grid.row(cells.into_iter().chain(self.inputs.iter().map(|input| words(&row[input.column]))));
        }
        grid.noted("a row's seed and values drive it again")
    }

    /// Whether anything is drawn.
    fn has_figures(&self) -> bool {
        self.inputs.iter().any(|input| !input.text && input.values.len() > 1)
    }

    /// Medians of the first output for words that vary.
    fn bars(&self) -> Vec<Bars> {
        let output = &self.outputs[0];
        let figure = |input: &Input| Bars {
            title: format!("{}, median and 5 to 95 %, by {}", labelled(output), input.name),
            scale: Scale::Linear,
            rows: input
                .values
                .iter()
                .zip(self.groups(input, self.pairs(output)))
                .filter(|(_, group)| !group.is_empty())
                .map(|(name, group)| {
                    let values = sorted(group.into_iter().map(|(_, value)| value));
                    let median = quantile(&values, 0.5);
                    Bar {
                        label: name.clone(),
                        value: Some(median),
                        interval: Some([quantile(&values, 0.05), quantile(&values, 0.95)]),
                        words: self::figure(median, output.unit),
                        pale: false,
                    }
                })
                .collect(),
            reference: None,
            span: None,
        };
        self.inputs.iter().filter(|input| input.text && input.values.len() > 1).map(figure).collect()
    }

    /// Every output over every number that varies, and how many of them there was no room for.
    fn charts(&self) -> (Vec<Chart>, usize) {
        let mut charts: Vec<Chart> = Vec::new();
        let mut count = 0;
        for output in &self.outputs {
            for (input, _) in self.ranked(output) {
                if input.text || input.values.len() < 2 {
                    continue;
                }
                count += 1;
                if charts.len() < MOST_CHARTS {
                    charts.push(self.chart(input, output));
                }
            }
        }
        let left_out = count - charts.len();
        (charts, left_out)
    }

    fn chart(&self, input: &Input, output: &Output) -> Chart {
        let pairs = self.pairs(output);
        let across = |row: &[Cell]| row.get(input.column).and_then(value).unwrap_or(f64::NAN);
        let is_wide = |values: Vec<f64>| {
            let (least, greatest) = (quantile(&values, 0.0), quantile(&values, 1.0));
            least > 0.0 && greatest / least >= WIDE
        };
        let logarithmic = [
            is_wide(sorted(pairs.iter().map(|(row, _)| across(row)))),
            is_wide(sorted(pairs.iter().map(|(_, value)| *value))),
        ];
        // Words that vary have colours, where there are few.
        let tinted = self.inputs.iter().find(|other| other.text && (2..=4).contains(&other.values.len()));
        let every = pairs.len().div_ceil(MOST_DOTS).max(1);
        let mut marks = Vec::new();
        let parts = tinted.map_or(vec![String::new()], |input| input.values.clone());
        for (index, word) in parts.iter().enumerate() {
            let hue = match Hue::of_words(word) {
                Hue::Other => [Hue::Clockwise, Hue::CounterClockwise, Hue::Other, Hue::Ink][index % 4],
                hue => hue,
            };
            let part: Vec<(&[Cell], f64)> = pairs
                .iter()
                .filter(|(row, _)| tinted.is_none_or(|input| words(&row[input.column]) == *word))
                .copied()
                .collect();
            let dots = part.iter().step_by(every).map(|(row, value)| [across(row), *value]).collect();
            let medians = self.groups(input, part).into_iter().filter(|group| !group.is_empty()).map(|group| {
                let median = |values: Vec<f64>| quantile(&values, 0.5);
                [
                    median(sorted(group.iter().map(|(row, _)| across(row)))),
                    median(sorted(group.iter().map(|(_, value)| *value))),
                ]
            });
            marks.push(Mark::new(hue, true, Shape::Dots, word, dots));
            marks.push(Mark::new(hue, false, Shape::Line, "", medians.collect()));
        }
        // Lines above all dots.
        marks.sort_by_key(|mark| mark.shape == Shape::Line);
        Chart {
            title: format!("{} over {}", output.name, input.name),
            axes: [input.name.clone(), labelled(output)],
            logarithmic,
            marks,
        }
    }
}

/// Every two inputs that vary.
fn pairs(inputs: &[Input]) -> impl Iterator<Item = (&Input, &Input)> {
    let varied = |input: &&Input| input.values.len() > 1;
    let rest = move |index: usize| inputs[index + 1..].iter().filter(varied);
    inputs
        .iter()
        .enumerate()
        .filter(move |(_, input)| varied(input))
        .flat_map(move |(index, one)| rest(index).map(move |other| (one, other)))
}

/// With its unit.
fn labelled(output: &Output) -> String {
    if output.unit.is_empty() { output.name.to_owned() } else { format!("{} [{}]", output.name, output.unit) }
}

/// In the digits that its unit deserves.
fn figure(value: f64, unit: &str) -> String {
    let digits = match unit {
        "mm" | "mrad" => 1,
        "σ" => 2,
        _ => 5,
    };
    format!("{:.digits$}", value + 0.0)
}

/// Where the column of that name is; past the end where there is none.
fn position(table: &Table, name: &str) -> usize {
    table.columns.iter().position(|column| column.name == name).unwrap_or(table.columns.len())
}

fn value(cell: &Cell) -> Option<f64> {
    match cell {
        Cell::Number(value) => Some(*value),
        Cell::Whole(value) => Some(*value as f64),
        Cell::Text(_) | Cell::Absent => None,
    }
}

fn words(cell: &Cell) -> String {
    match cell {
        // Five digits tell a point; all of them are in the table.
        Cell::Number(value) => format!("{}", format!("{value:.4e}").parse::<f64>().unwrap_or(*value)),
        Cell::Whole(value) => value.to_string(),
        Cell::Text(text) => text.clone(),
        Cell::Absent => "–".to_owned(),
    }
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Of sorted values, between neighbours by their distance; NaN of none.
fn quantile(values: &[f64], share: f64) -> f64 {
    let place = share * values.len().saturating_sub(1) as f64;
    let at = |index: usize| values.get(index).copied().unwrap_or(f64::NAN);
    let (below, part) = (place.floor() as usize, place.fract());
    if part == 0.0 { at(below) } else { (1.0 - part) * at(below) + part * at(below + 1) }
}

/// Correlation ratio η² of groups, less what groups without any meaning would have; `None` where it says nothing.
fn explained(groups: &[Vec<f64>]) -> Option<f64> {
    let groups: Vec<&Vec<f64>> = groups.iter().filter(|group| !group.is_empty()).collect();
    let count: usize = groups.iter().map(|group| group.len()).sum();
    if groups.len() < 2 || count <= groups.len() {
        return None;
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let all = groups.iter().flat_map(|group| group.iter()).sum::<f64>() / count as f64;
    let total: f64 = groups.iter().flat_map(|group| group.iter()).map(|value| (value - all).powi(2)).sum();
    let within: f64 =
        groups.iter().map(|group| group.iter().map(|value| (value - mean(group)).powi(2)).sum::<f64>()).sum();
    let left = (within / (count - groups.len()) as f64) / (total / (count - 1) as f64);
    (total > 0.0).then(|| (1.0 - left).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_those_of_a_sum_of_known_parts() {
        // y = a + b with a in {0, 3} and b in {0, 1}: variances 2.25 and 0.25, and no noise.
        let by_a: Vec<Vec<f64>> = [0.0, 3.0].map(|a| [0.0, 1.0].repeat(50).iter().map(|b| a + b).collect()).into();
        let by_b: Vec<Vec<f64>> = [0.0, 1.0].map(|b| [0.0, 3.0].repeat(50).iter().map(|a| a + b).collect()).into();
        // The correction for chance is of the order of groups over points.
        assert!((explained(&by_a).unwrap_or(0.0) - 0.9).abs() < 0.01);
        assert!((explained(&by_b).unwrap_or(0.0) - 0.1).abs() < 0.01);
        assert_eq!(explained(&[vec![1.0, 2.0]]), None);
        assert_eq!(explained(&[vec![1.0, 1.0], vec![1.0]]), None);
    }

    #[test]
    fn quantiles_lie_between_neighbours() {
        let values = [1.0, 2.0, 4.0];
        assert_eq!([0.0, 0.25, 0.5, 0.75, 1.0].map(|share| quantile(&values, share)), [1.0, 1.5, 2.0, 3.0, 4.0]);
        assert!(quantile(&[], 0.5).is_nan());
    }
}
