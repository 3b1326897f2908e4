//! Figures as data, and as SVG that takes its colours from the page: light, dark or on paper.
//!
//! plotters writes fixed colours and font metrics of its own; a page that follows the reader's theme and shrinks to a
//! phone needs neither, so these few shapes are written out by a template.

use maud::{Markup, html};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// What a colour stands for; the same everywhere, and for colour-blind readers too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hue {
    /// Measured; neutral.
    Ink,
    /// Clockwise, or in reverse.
    Clockwise,
    /// Counter-clockwise, or forward.
    CounterClockwise,
    /// Neither way round.
    Other,
}

/// How points are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// Discs.
    Dots,
    /// Rings.
    Rings,
    /// A line through the points.
    Line,
    /// A dashed line through the points.
    Dashes,
    /// From the first point to the second.
    Arrow,
    /// An upright cross at each point.
    Crosses,
    /// Two standard deviations of the points about their mean, along their principal axes.
    Ellipse,
}

/// Points drawn alike.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mark {
    /// Colour.
    pub hue: Hue,
    /// As it was before; else as it is after.
    pub pale: bool,
    /// How it is drawn.
    pub shape: Shape,
    /// For the key; marks of one name are named once.
    pub name: String,
    /// In the figure's units.
    pub points: Vec<[f64; 2]>,
}

/// A figure of points and lines, x to the right, y up, the same scale along both.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plane {
    /// What it shows.
    pub title: String,
    /// Of both axes.
    pub unit: String,
    /// In drawing order.
    pub marks: Vec<Mark>,
}

/// A figure of one number over another, each in units of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// What stands along the axes, with units: x, y.
    pub axes: [String; 2],
    /// Whether an axis is logarithmic; what is not above 0 is not drawn then.
    pub logarithmic: [bool; 2],
    /// In drawing order. Ellipses and arrows have no meaning here.
    pub marks: Vec<Mark>,
}

/// How bars are scaled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scale {
    /// From zero.
    Linear,
    /// Points on a logarithmic scale.
    Logarithmic,
    /// Points about their own middle.
    Free,
}

/// A bar or point with its number in words.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bar {
    /// What it is of.
    pub label: String,
    /// `None`: there is no such number; the words say why.
    pub value: Option<f64>,
    /// 95 %.
    pub interval: Option<[f64; 2]>,
    /// The number in words, with its unit.
    pub words: String,
    /// As it was before.
    pub pale: bool,
}

/// A figure of bars.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bars {
    /// What it shows, with the unit.
    pub title: String,
    /// How they are scaled.
    pub scale: Scale,
    /// From top to bottom.
    pub rows: Vec<Bar>,
    /// A line across, and what it means.
    pub reference: Option<(f64, String)>,
    /// What has to be shown at least, so that figures beside each other have one scale.
    pub span: Option<[f64; 2]>,
}

impl Hue {
    /// Of a condition's words or a direction: `ccw`, `square 2 m cw`, ….
    pub fn of_words(words: &str) -> Hue {
        let is = |word: &str| words.split(|c: char| !c.is_alphanumeric()).any(|part| part == word);
        match () {
            () if is("cw") || is("reverse") => Hue::Clockwise,
            () if is("ccw") || is("forward") => Hue::CounterClockwise,
            () => Hue::Other,
        }
    }

    fn class(self) -> &'static str {
        match self {
            Hue::Ink => "ink",
            Hue::Clockwise => "cw",
            Hue::CounterClockwise => "ccw",
            Hue::Other => "other",
        }
    }
}

impl Mark {
    /// A mark of `points`.
    pub fn new(hue: Hue, pale: bool, shape: Shape, name: &str, points: Vec<[f64; 2]>) -> Mark {
        Mark { hue, pale, shape, name: name.to_owned(), points }
    }

    fn class(&self) -> String {
        let fill = if self.shape == Shape::Dots { "dot" } else { "line" };
        format!("{} {fill}{}", self.hue.class(), if self.pale { " pale" } else { "" })
    }
}

/// Width and height of the drawing, in its own units, and its margins: left, top, right, bottom.
const WIDTH: f64 = 380.0;
const MARGIN: [f64; 4] = [54.0, 10.0, 14.0, 40.0];
/// Height of a bar's row, and of what stands above and below all of them.
const ROW: f64 = 36.0;

impl Plane {
    /// What is shown: least and greatest, with a margin.
    fn bounds(&self) -> [[f64; 2]; 2] {
        let (mut least, mut greatest) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for mark in &self.marks {
            let outline = if mark.shape == Shape::Ellipse { ellipse(&mark.points) } else { mark.points.clone() };
            for point in outline {
                least = std::array::from_fn(|axis| least[axis].min(point[axis]));
                greatest = std::array::from_fn(|axis| greatest[axis].max(point[axis]));
            }
        }
        if !least[0].is_finite() {
            return [[-1.0; 2], [1.0; 2]];
        }
        let reach = (0..2).map(|axis| greatest[axis] - least[axis]).fold(1e-9, f64::max);
        // No flatter than one to two.
        let margin: [f64; 2] =
            std::array::from_fn(|axis| 0.5 * (0.5 * reach - (greatest[axis] - least[axis])).max(0.0) + 0.06 * reach);
        let least = std::array::from_fn(|axis| least[axis] - margin[axis]);
        [least, std::array::from_fn(|axis| greatest[axis] + margin[axis])]
    }

    /// The figure.
    pub(super) fn svg(&self) -> Markup {
        let [least, greatest] = self.bounds();
        let [left, top, right, bottom] = MARGIN;
        let inner = WIDTH - left - right;
        let across = greatest[0] - least[0];
        let up = greatest[1] - least[1];
        // Tall figures are made narrower than the page rather than taller than the screen.
        let scale = (inner / across).min(1.1 * inner / up);
        let shift = 0.5 * (inner - scale * across);
        let height = scale * up;
        let at = |[x, y]: [f64; 2]| [left + shift + scale * (x - least[0]), top + scale * (greatest[1] - y)];
        let (from, to) = (left + shift, left + shift + scale * across);
        let step = nice_step(across.max(up) / 5.0);
        let ticks = |axis: usize| ticks(least[axis], greatest[axis], step);
        html! {
            svg viewBox=(format!("0 0 {WIDTH} {:.1}", top + height + bottom)) role="img" aria-label=(self.title) {
                @for x in ticks(0) {
                    @let px = at([x, 0.0])[0];
                    path class=(if x == 0.0 { "zero" } else { "mesh" }) d=(format!("M{px:.1} {top}V{:.1}", top + height)) {}
                    text x=(one(px)) y=(one(top + height + 15.0)) text-anchor="middle" { (number(x, step)) }
                }
                @for y in ticks(1) {
                    @let py = at([0.0, y])[1];
                    path class=(if y == 0.0 { "zero" } else { "mesh" }) d=(format!("M{from:.1} {py:.1}H{to:.1}")) {}
                    text x=(one(from - 6.0)) y=(one(py + 4.0)) text-anchor="end" { (number(y, step)) }
                }
                text x=(one(0.5 * (from + to))) y=(one(top + height + 33.0)) text-anchor="middle" { "x [" (self.unit) "]" }
                text x="0" y="0" text-anchor="middle"
                    transform=(format!("translate({:.1} {:.1}) rotate(-90)", from - 44.0, top + 0.5 * height)) { "y [" (self.unit) "]" }
                @for mark in &self.marks { (draw(mark, &at)) }
            }
        }
    }
}

/// Height of a chart's field, in the drawing's units.
const FIELD: f64 = 220.0;

impl Chart {
    /// The figure.
    pub(super) fn svg(&self) -> Markup {
        let [left, top, right, bottom] = MARGIN;
        let of = |axis: usize, value: f64| if self.logarithmic[axis] { value.log10() } else { value };
        let shown = |point: &[f64; 2]| (0..2).all(|axis| of(axis, point[axis]).is_finite());
        let (mut least, mut greatest) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for point in self.marks.iter().flat_map(|mark| &mark.points).filter(|point| shown(point)) {
            least = std::array::from_fn(|axis| least[axis].min(of(axis, point[axis])));
            greatest = std::array::from_fn(|axis| greatest[axis].max(of(axis, point[axis])));
        }
        for axis in 0..2 {
            let reach = greatest[axis] - least[axis];
            let margin = if reach > 0.0 { 0.05 * reach } else { (0.1 * least[axis].abs()).max(1e-9) };
            (least[axis], greatest[axis]) =
                if least[axis].is_finite() { (least[axis] - margin, greatest[axis] + margin) } else { (0.0, 1.0) };
        }
        let size = [WIDTH - left - right, FIELD];
        let along = |axis: usize, value: f64| (of(axis, value) - least[axis]) / (greatest[axis] - least[axis]);
        let at = |[x, y]: [f64; 2]| [left + size[0] * along(0, x), top + size[1] * (1.0 - along(1, y))];
        let foot = top + FIELD;
        html! {
            svg viewBox=(format!("0 0 {WIDTH} {:.1}", foot + bottom)) role="img" aria-label=(self.title) {
                @for (x, words) in marked(least[0], greatest[0], self.logarithmic[0]) {
                    @let px = at([x, 1.0])[0];
                    path class=(if x == 0.0 { "zero" } else { "mesh" }) d=(format!("M{px:.1} {top}V{foot:.1}")) {}
                    text x=(one(px)) y=(one(foot + 15.0)) text-anchor="middle" { (words) }
                }
                @for (y, words) in marked(least[1], greatest[1], self.logarithmic[1]) {
                    @let py = at([1.0, y])[1];
                    path class=(if y == 0.0 { "zero" } else { "mesh" }) d=(format!("M{left:.1} {py:.1}H{:.1}", left + size[0])) {}
                    text x=(one(left - 6.0)) y=(one(py + 4.0)) text-anchor="end" { (words) }
                }
                text x=(one(left + 0.5 * size[0])) y=(one(foot + 33.0)) text-anchor="middle" { (self.axes[0]) }
                text x="0" y="0" text-anchor="middle"
                    transform=(format!("translate({:.1} {:.1}) rotate(-90)", left - 44.0, top + 0.5 * FIELD)) { (self.axes[1]) }
                @for mark in &self.marks {
                    (draw(&Mark { points: mark.points.iter().filter(|point| shown(point)).copied().collect(), ..mark.clone() }, &at))
                }
            }
        }
    }
}

/// Where an axis is marked, and with which words; ends of a logarithmic one are powers of ten.
fn marked(least: f64, greatest: f64, logarithmic: bool) -> Vec<(f64, String)> {
    if !logarithmic {
        let step = nice_step((greatest - least) / 5.0);
        return ticks(least, greatest, step).into_iter().map(|value| (value, number(value, step))).collect();
    }
    let decades = (least.floor() as i32)..=(greatest.ceil() as i32);
    // Halves of a decade where there are few of them.
    let digits: &[f64] = if greatest - least < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let values = decades.flat_map(|decade| digits.iter().map(move |digit| digit * 10f64.powi(decade)));
    let values = values.filter(|value| (least..=greatest).contains(&value.log10()));
    values
        .map(|value| (value, if (1e-4..1e5).contains(&value) { format!("{value}") } else { format!("{value:e}") }))
        .collect()
}

/// What marks of figures mean, each name once.
pub(super) fn key<'a>(marks: impl Iterator<Item = &'a Mark>) -> Markup {
    let mut named: Vec<&Mark> = Vec::new();
    for mark in marks.filter(|mark| !mark.name.is_empty()) {
        if !named.iter().any(|known| known.name == mark.name) {
            named.push(mark);
        }
    }
    html! {
        @if !named.is_empty() {
            ul.key {
                @for mark in named {
                    li {
                        svg.swatch viewBox="0 0 28 14" aria-hidden="true" {
                            (draw(&sample(mark), &|[x, y]| [x, 7.0 - y]))
                        }
                        (mark.name)
                    }
                }
            }
        }
    }
}

fn sample(mark: &Mark) -> Mark {
    let points = match mark.shape {
        Shape::Dots | Shape::Rings | Shape::Crosses => vec![[14.0, 0.0]],
        Shape::Ellipse => vec![[8.0, -2.0], [20.0, -2.0], [8.0, 2.0], [20.0, 2.0]],
        _ => vec![[2.0, 0.0], [26.0, 0.0]],
    };
    Mark { points, ..mark.clone() }
}

fn draw(mark: &Mark, at: &dyn Fn([f64; 2]) -> [f64; 2]) -> Markup {
    let class = mark.class();
    let points: Vec<[f64; 2]> = mark.points.iter().map(|&point| at(point)).collect();
    let through = |points: &[[f64; 2]]| {
        let mut path = String::new();
        for (index, [x, y]) in points.iter().enumerate() {
            path.push_str(&format!("{}{x:.1} {y:.1}", if index == 0 { "M" } else { "L" }));
        }
        path
    };
    html! {
        @match mark.shape {
            Shape::Dots => { @for [x, y] in &points { circle class=(class) cx=(one(*x)) cy=(one(*y)) r="3.2" {} } }
            Shape::Rings => { @for [x, y] in &points { circle class=(class) cx=(one(*x)) cy=(one(*y)) r="3.4" {} } }
            Shape::Line => { path class=(class) d=(through(&points)) {} }
            Shape::Dashes => { path class=(format!("{class} dashes")) d=(through(&points)) {} }
            Shape::Crosses => {
                @for [x, y] in &points {
                    path class=(format!("{class} thick"))
                        d=(format!("M{:.1} {y:.1}H{:.1}M{x:.1} {:.1}V{:.1}", x - 6.0, x + 6.0, y - 6.0, y + 6.0)) {}
                }
            }
            Shape::Arrow => { path class=(format!("{class} thick")) d=(arrow(&points)) {} }
            Shape::Ellipse => {
                @if points.len() > 2 { path class=(format!("{class} thin")) d=(format!("{}Z", through(&ellipse(&points)))) {} }
            }
        }
    }
}

/// A shaft and a head; a short arrow has a short head.
fn arrow(points: &[[f64; 2]]) -> String {
    let [[x0, y0], [x1, y1]] = [points[0], points[points.len() - 1]];
    let (dx, dy) = (x1 - x0, y1 - y0);
    let length = dx.hypot(dy);
    if length < 0.5 {
        return String::new();
    }
    let head = 8f64.min(0.6 * length) / length;
    let wing = |side: f64| [x1 - head * (dx - side * 0.45 * dy), y1 - head * (dy + side * 0.45 * dx)];
    let ([ax, ay], [bx, by]) = (wing(1.0), wing(-1.0));
    format!("M{x0:.1} {y0:.1}L{x1:.1} {y1:.1}M{ax:.1} {ay:.1}L{x1:.1} {y1:.1}L{bx:.1} {by:.1}")
}

/// Two standard deviations of `points` about their mean.
fn ellipse(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let count = points.len() as f64;
    let mean = nalgebra::Vector2::from(points.iter().fold([0.0; 2], |[x, y], p| [x + p[0] / count, y + p[1] / count]));
    let covariance = points.iter().fold(nalgebra::Matrix2::zeros(), |sum, &point| {
        let off = nalgebra::Vector2::from(point) - mean;
        sum + off * off.transpose() / (count - 1.0).max(1.0)
    });
    let axes = covariance.symmetric_eigen();
    let half = axes.eigenvalues.map(|variance| 2.0 * variance.max(0.0).sqrt());
    (0..48)
        .map(|step| {
            let (sin, cos) = (TAU * f64::from(step) / 48.0).sin_cos();
            let at = mean + axes.eigenvectors * nalgebra::Vector2::new(half.x * cos, half.y * sin);
            [at.x, at.y]
        })
        .collect()
}

impl Bars {
    /// The figure: words above each bar, so that it can be read on a phone.
    pub(super) fn svg(&self) -> Markup {
        let of = |value: f64| if self.scale == Scale::Logarithmic { value.log10() } else { value };
        let numbers = self.rows.iter().flat_map(|bar| bar.value.into_iter().chain(bar.interval.into_iter().flatten()));
        let numbers = numbers.chain(self.reference.as_ref().map(|(value, _)| *value));
        let numbers = numbers.chain(self.span.into_iter().flatten());
        let zero = (self.scale == Scale::Linear).then_some(0.0);
        let shown: Vec<f64> = numbers.chain(zero).map(of).filter(|value| value.is_finite()).collect();
        let low = shown.iter().copied().fold(f64::INFINITY, f64::min);
        let high = shown.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (low, high) = if high > low { (low, high) } else { (low - 0.5, low + 0.5) };
        let pad = if self.scale == Scale::Linear { 0.0 } else { 0.04 * (high - low) };
        let (low, high) = (low - pad, high + pad);
        let at = |value: f64| 4.0 + (WIDTH - 8.0) * (of(value) - low) / (high - low);
        let top = 6.0;
        let foot = top + ROW * self.rows.len() as f64;
        let height = foot + if self.reference.is_some() { 22.0 } else { 4.0 };
        html! {
            svg viewBox=(format!("0 0 {WIDTH} {height:.1}")) role="img" aria-label=(self.title) {
                @if let Some((value, words)) = &self.reference {
                    @let x = at(*value);
                    @let anchor = if x > 0.66 * WIDTH { "end" } else if x < 0.33 * WIDTH { "start" } else { "middle" };
                    // Beside the bars, not through their words.
                    @let beside = |row: usize| top + ROW * row as f64 + 17.0;
                    path class="zero dashes" d=((0..self.rows.len()).map(|row| format!("M{x:.1} {:.1}v14", beside(row))).collect::<String>()) {}
                    text x=(one(x)) y=(one(foot + 15.0)) text-anchor=(anchor) { (words) }
                }
                @for (index, bar) in self.rows.iter().enumerate() {
                    @let y = top + ROW * index as f64;
                    @let middle = y + 24.0;
                    text.label x="4" y=(one(y + 13.0)) { (bar.label) }
                    text.label x=(one(WIDTH - 4.0)) y=(one(y + 13.0)) text-anchor="end" { (bar.words) }
                    path.mesh d=(format!("M4 {middle:.1}H{:.1}", WIDTH - 4.0)) {}
                    @if let Some(value) = bar.value {
                        @let class = if bar.pale { "bar pale" } else { "bar" };
                        @if self.scale == Scale::Linear {
                            @let (from, to) = (at(value.min(0.0)), at(value.max(0.0)));
                            rect class=(class) x=(one(from)) y=(one(middle - 4.5)) width=(one((to - from).max(1.0))) height="9" rx="1.5" {}
                        } @else {
                            circle class=(class) cx=(one(at(value))) cy=(one(middle)) r="4.5" {}
                        }
                        @if let Some([from, to]) = bar.interval {
                            @let ends = (at(from), at(to), middle - 4.0);
                            path.whisker d=(format!("M{0:.1} {middle:.1}H{1:.1}M{0:.1} {2:.1}v8M{1:.1} {2:.1}v8", ends.0, ends.1, ends.2)) {}
                        }
                    }
                }
            }
        }
    }
}

fn one(value: f64) -> String {
    format!("{value:.1}")
}

/// 1, 2 or 5 times a power of ten, not less than `least`.
fn nice_step(least: f64) -> f64 {
    let decade = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|digit| digit * decade).into_iter().find(|&step| step >= least).unwrap_or(least)
}

fn ticks(least: f64, greatest: f64, step: f64) -> Vec<f64> {
    // Adding zero makes −0 a 0.
    ((least / step).ceil() as i64..=(greatest / step).floor() as i64).map(|count| count as f64 * step + 0.0).collect()
}

/// In the digits that the step has.
fn number(value: f64, step: f64) -> String {
    let digits = (-step.log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{value:.digits$}").replace('-', "−")
}
