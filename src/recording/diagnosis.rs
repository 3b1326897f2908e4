//! A diagnosis as a recording: measured against simulated, before and after.
//!
//! # What is in a file
//!
//! | entity | what | timeline |
//! |---|---|---|
//! | `/paths/{condition}/measured`, `…/before`, `…/after` | ways of its runs \[m\], or ends where these alone were surveyed | static |
//! | `/one_run/measured`, `…/before`, `…/after`, `…/name` | the same, one run at a time | `run`, from 1 |
//! | `/residuals/{condition}/before`, `…/after` | measured less predicted end \[mm, y downwards as the viewer's screen\]: an arrow a run, the mean in bold | static |
//! | `/series/position_residual_mm/{run}/before`, `…/after` | distance of measured and predicted position, of forty runs at most | `time_in_run` |
//! | `/series/heading_residual_mrad/{run}/before`, `…/after` | measured less predicted heading | `time_in_run` |
//! | `/by_run/position_residual_mm/before`, `…/after`, `/by_run/heading_residual_mrad/…` | the same of the ends | `run` |
//! | `/floor`, `/result`, `/how_to_read` | the room with what was found on its floor, the answer, the words | static |

use super::blueprint::{self, Pane, View};
use super::look::{self, BELIEF, INK, Rgb, Stage};
use super::stream::{Path, RUN, Stream, TIMELINE};
use super::{Area, Recording, RecordingError, lettering, scatter};
use crate::diagnose::{Diagnosis, RunReadings};
use crate::effect::Cause;
use crate::geometry::Pose2;
use crate::scene::Scene;
use rerun::external::re_sdk_types::blueprint::components::{ContainerKind, Corner2D};
use rerun::{
    Arrows2D, LineStrip2D, LineStrip3D, LineStrips2D, LineStrips3D, Points3D, Scalars, SeriesLines, SeriesPoints,
    TextDocument,
};
use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::path::Path as FilePath;

/// The stages of a diagnosis: as given, extended.
const BEFORE: Stage = Stage { index: 0, of: 2 };
const AFTER: Stage = Stage { index: 1, of: 2 };
/// Runs that are drawn along the run: more are a thicket, and hundreds keep a viewer from opening.
const ALONG: usize = 40;
/// How far a start may be off the room's origin for the room to be drawn under the ways \[m, rad\].
const ASTRAY: f64 = 0.05;
/// Readings from which on a way is drawn.
const WAY: usize = 3;

/// Writes the recording of `diagnosis` to a new file. Ways are drawn from their starts; where these are at the room's origin, the
/// floor is that of the extended `scene`, with what was found on it. `title` is of the recording; `result` is markdown for its panel.
///
/// # Errors
/// The file exists, or cannot be made or written.
pub fn diagnosis(
    path: &FilePath,
    title: &str,
    diagnosis: &Diagnosis,
    scene: &Scene,
    result: &str,
) -> Result<(), RecordingError> {
    let runs = &diagnosis.runs;
    let area = area(runs);
    let logged = runs.iter().any(|run| stamps(run).is_some());
    let layout = layout(title, &area, logged);
    let timeline = if logged { TIMELINE } else { RUN };
    let at_origin = |run: &RunReadings| run.start.x.hypot(run.start.y) < ASTRAY && run.start.heading.abs() < ASTRAY;
    let found = if runs.iter().all(at_origin) { &diagnosis.causes[..] } else { &[] };
    let scene = Cause::edit_all(found, scene);
    let stream = Recording::open(path, title, blueprint::messages_of(&layout, timeline, None), &scene, &area)?;
    stream.fixed(Path::of(["how_to_read"]), &TextDocument::from_markdown(HOW_TO_READ));
    stream.fixed(Path::of(["result"]), &TextDocument::from_markdown(result));
    for root in ["paths", "one_run"] {
        stream.tilt(&Path::of([root]));
    }
    paths(&stream, runs);
    one_run(&stream, runs);
    residuals(&stream, runs);
    for run in runs.iter().step_by(runs.len().div_ceil(ALONG).max(1)) {
        series(&stream, run);
    }
    by_run(&stream, runs);
    stream.finish()
}

const HOW_TO_READ: &str = "Dark and wide is what was measured, coloured is simulated: **vermillion** counter-clockwise or \
    forward, **blue** clockwise or in reverse, green neither; **pale** by the model as given, **strong** by the extended \
    one. Where a strong line runs inside the dark one, the extended model is right. What was found on the floor lies there. \
    Arrows lead from where a run was predicted to end to where it ended, thin for each run, bold for their mean; the ring is \
    the scale. Timeline `time_in_run` is for series along a run, of forty at most, `run` for one run at a time and for the ends \
    run by run.";

/// The colour of what a condition is.
fn hue(condition: &str) -> Rgb {
    let mut words = condition.split(|c: char| !c.is_alphanumeric());
    match words.find(|word| ["cw", "ccw", "reverse", "forward"].contains(word)) {
        Some(direction) => look::of_direction(direction),
        None => look::GREEN,
    }
}

fn area(runs: &[RunReadings]) -> Area {
    let mut area = Area { min: [-0.1; 2], max: [0.1; 2] };
    for run in runs {
        run.measured.iter().for_each(|pose| area.include([pose.x, pose.y]));
        run.before.iter().chain(&run.after).for_each(|pose| area.include([pose.x, pose.y]));
    }
    area
}

/// Since its first reading \[s\], where a run was surveyed on the way.
fn stamps(run: &RunReadings) -> Option<Vec<Option<f64>>> {
    let first = run.stamps.iter().copied().flatten().next()?;
    let stamped = run.stamps.iter().flatten().count();
    (stamped >= WAY).then(|| run.stamps.iter().map(|stamp| stamp.map(|stamp| stamp - first)).collect())
}

fn layout(title: &str, area: &Area, logged: bool) -> Pane {
    let plots = |root: &str, position: &str, heading: &str, legend: bool| {
        let plot = |name: &str, series: &str| {
            (
                1.0,
                blueprint::time_series(
                    name,
                    vec![format!("+ /{root}/{series}/**")],
                    legend.then_some(Corner2D::LeftTop),
                ),
            )
        };
        let panes = vec![plot(position, "position_residual_mm"), plot(heading, "heading_residual_mrad")];
        blueprint::split(ContainerKind::Vertical, panes)
    };
    let along = plots("series", "Position residual along the run [mm]", "Heading residual along the run [mrad]", false);
    let by_run = plots(
        "by_run",
        "Position residual of ends, run by run [mm]",
        "Heading residual of ends, run by run [mrad]",
        true,
    );
    let series = if logged {
        blueprint::tabs(vec![("Along the run", along), ("Run by run (timeline run)", by_run)])
    } else {
        by_run
    };
    let margin = 0.15 * (0..2).map(|axis| area.max[axis] - area.min[axis]).fold(0.1, f64::max);
    let floor = ["+ /floor/**".to_owned()];
    let view = |name: &str, root: &str| {
        let contents = floor.iter().cloned().chain([format!("+ /{root}/**")]).collect();
        blueprint::over(View::new("3D", name, "/").contents(contents), area, STEEP, margin)
    };
    let name: Pane = View::new("TextDocument", "Which run", "/one_run/name").into();
    let one_run = blueprint::split(ContainerKind::Vertical, vec![(1.0, view("One run", "one_run")), (0.14, name)]);
    let floor_tabs =
        blueprint::tabs(vec![(title, view(title, "paths")), ("One run at a time (timeline run)", one_run)]);
    let residuals: Pane =
        View::new("2D", "Measured less predicted ends, by condition [mm]", "/residuals").on_paper().into();
    let left = blueprint::split(ContainerKind::Vertical, vec![(1.5, floor_tabs), (1.0, residuals)]);
    let texts = vec![
        (1.15, View::new("TextDocument", "Diagnosis", "/result").into()),
        (0.27, View::new("TextDocument", "How to read this", "/how_to_read").into()),
        (0.95, series),
    ];
    let right = blueprint::split(ContainerKind::Vertical, texts);
    blueprint::split(ContainerKind::Horizontal, vec![(1.15, left), (1.0, right)])
}

/// Angle at which the floor is looked down upon \[rad\]: ways differ by millimetres, so hardly any perspective.
const STEEP: f64 = 1.3;

/// One of the three ways of a run as it is drawn.
struct Way {
    name: &'static str,
    points: fn(&RunReadings) -> Vec<[f64; 2]>,
    colour: fn(&str) -> Rgb,
    width: f32,
    /// Later ones lie above \[m\].
    height: f32,
}

/// From below to above.
const WAYS: [Way; 3] = [
    Way {
        name: "measured",
        points: |run| run.measured.iter().map(|pose| [pose.x, pose.y]).collect(),
        colour: |_| BELIEF,
        width: 4.0,
        height: 2e-3,
    },
    Way {
        name: "before",
        points: |run| flat(&run.before),
        colour: |condition| BEFORE.tone(hue(condition)),
        width: 2.0,
        height: 3e-3,
    },
    Way {
        name: "after",
        points: |run| flat(&run.after),
        colour: |condition| AFTER.tone(hue(condition)),
        width: 2.0,
        height: 4e-3,
    },
];

fn flat(poses: &[Pose2]) -> Vec<[f64; 2]> {
    poses.iter().map(|pose| [pose.x, pose.y]).collect()
}

impl Way {
    fn on_floor(&self, run: &RunReadings) -> Vec<[f32; 3]> {
        (self.points)(run).into_iter().map(|[x, y]| [x as f32, y as f32, self.height]).collect()
    }
}

/// All runs at once, an entity a condition and way.
fn paths(stream: &Stream, runs: &[RunReadings]) {
    let conditions: BTreeSet<&str> = runs.iter().map(|run| run.condition.as_str()).collect();
    for condition in conditions {
        let of_condition = || runs.iter().filter(|run| run.condition == condition);
        for way in &WAYS {
            let path = Path::of(["paths", condition, way.name]);
            let colour = (way.colour)(condition);
            let drawn: Vec<Vec<[f32; 3]>> = of_condition().map(|run| way.on_floor(run)).collect();
            // An end that no way leads to has to catch the eye by itself.
            let size = |points: &Vec<[f32; 3]>| match points.len() {
                WAY.. => look::points(1.2 * way.width + 2.0),
                _ => look::points(2.0 * way.width + 5.0),
            };
            let ended = || drawn.iter().filter(|points| !points.is_empty());
            let ends = Points3D::new(ended().map(|points| points[points.len() - 1]));
            stream.fixed(path.child("end"), &ends.with_colors([colour]).with_radii(ended().map(size)));
            let lines: Vec<LineStrip3D> =
                drawn.iter().filter(|points| points.len() >= WAY).map(LineStrip3D::from_iter).collect();
            if !lines.is_empty() {
                let lines = LineStrips3D::new(lines);
                stream.fixed(path, &lines.with_colors([colour]).with_radii([look::points(way.width)]));
            }
        }
    }
}

/// One run after the other.
fn one_run(stream: &Stream, runs: &[RunReadings]) {
    let numbers: Vec<i64> = (1..=runs.len() as i64).collect();
    let root = Path::of(["one_run"]);
    let names = runs.iter().map(|run| format!("{}, {}", run.condition, run.name));
    let names = TextDocument::update_fields().with_many_text(names);
    stream.columns_by_run(&root.child("name"), &numbers, names.columns_of_unit_batches());
    for way in &WAYS {
        // A single point is no line: a line to itself is drawn as its end.
        let strip = |run: &RunReadings| {
            let points = way.on_floor(run);
            if points.len() >= WAY { LineStrip3D::from_iter(points) } else { cross(points.last().copied()) }
        };
        let lines = LineStrips3D::new(runs.iter().map(strip))
            .with_colors(runs.iter().map(|run| (way.colour)(&run.condition)))
            .with_radii(runs.iter().map(|_| look::points(way.width)));
        stream.columns_by_run(&root.child(way.name), &numbers, lines.columns_of_unit_batches());
    }
}

/// A small upright cross in one stroke.
fn cross(at: Option<[f32; 3]>) -> LineStrip3D {
    const ARM: f32 = 0.03;
    let Some([x, y, z]) = at else { return LineStrip3D::from_iter(Vec::<[f32; 3]>::new()) };
    let arms = [[0.0, 0.0], [ARM, 0.0], [-ARM, 0.0], [0.0, 0.0], [0.0, ARM], [0.0, -ARM]];
    LineStrip3D::from_iter(arms.map(|[dx, dy]| [x + dx, y + dy, z]))
}

/// What a plot of arrows shows of a condition.
struct Cell<'a> {
    condition: &'a str,
    /// Measured less predicted \[mm\], a run each.
    before: Vec<[f64; 2]>,
    after: Vec<[f64; 2]>,
}

fn cells(runs: &[RunReadings]) -> Vec<Cell<'_>> {
    let mut cells: Vec<Cell<'_>> = Vec::new();
    for run in runs {
        let (Some(measured), Some(before), Some(after)) = (run.measured.last(), run.before.last(), run.after.last())
        else {
            continue;
        };
        let off = |predicted: &Pose2| [1e3 * (measured.x - predicted.x), 1e3 * (measured.y - predicted.y)];
        let index = cells.iter().position(|cell| cell.condition == run.condition).unwrap_or_else(|| {
            cells.push(Cell { condition: &run.condition, before: Vec::new(), after: Vec::new() });
            cells.len() - 1
        });
        cells[index].before.push(off(before));
        cells[index].after.push(off(after));
    }
    cells
}

/// Arrows of every condition about a cross of their own, all at one scale.
fn residuals(stream: &Stream, runs: &[RunReadings]) {
    let cells = cells(runs);
    let reach = cells.iter().flat_map(|cell| cell.before.iter().chain(&cell.after)).map(|[x, y]| x.hypot(*y));
    let reach = reach.fold(1e-3, f64::max);
    let size = 2.3 * reach;
    let letters = size / 21.0;
    let pitch = [1.06 * size, size + 5.5 * letters];
    // As wide as the pane: about two and a half times its height.
    let columns = ((2.5 * cells.len() as f64).sqrt().ceil() as usize).clamp(1, cells.len().max(1));
    let columns = if cells.len() <= 4 { cells.len() } else { columns };
    let ring = scatter::nice_step(0.4 * reach);
    let root = Path::of(["residuals"]);
    for (index, cell) in cells.iter().enumerate() {
        let centre = [(index % columns.max(1)) as f64 * pitch[0], -((index / columns.max(1)) as f64) * pitch[1]];
        let place = |[x, y]: [f64; 2]| [centre[0] + x, centre[1] + y];
        let path = root.child(cell.condition);
        let half = 0.5 * size;
        let mut lines = vec![vec![[-half, 0.0], [half, 0.0]], vec![[0.0, -half], [0.0, half]]];
        lines
            .push((0..=48).map(|k| (TAU * f64::from(k) / 48.0).sin_cos()).map(|(s, c)| [ring * c, ring * s]).collect());
        let thin = lines.into_iter().map(|line| strip(line.into_iter().map(place)));
        let thin = LineStrips2D::new(thin).with_radii([look::points(1.0)]).with_colors([look::GRID]);
        stream.fixed(path.child("axes"), &thin.with_draw_order(0.0));

        // The viewer leaves no margin around what it shows.
        let (side, foot) = (1.06 * half, half + 4.6 * letters);
        let frame = [[-side, half], [side, half], [side, -foot], [-side, -foot]];
        let frame = LineStrips2D::new([strip(frame.map(place))]).with_radii([look::points(0.5)]);
        stream.fixed(path.child("margin"), &frame.with_colors([look::PAPER]).with_draw_order(-1.0));

        let mut words = Vec::new();
        for (row, part) in cell.condition.split(", ").enumerate() {
            words.extend(lettering::lines(part, [0.0, -half - letters * (1.2 + 1.7 * row as f64)], letters, 0.5));
        }
        words.extend(lettering::lines(&format!("{ring} mm"), [0.74 * ring, 0.74 * ring + letters], 0.8 * letters, 0.0));
        words.extend(lettering::lines("x", [half - 0.5 * letters, letters], 0.8 * letters, 0.5));
        words.extend(lettering::lines("y", [letters, half - 0.5 * letters], 0.8 * letters, 0.5));
        let words = words.into_iter().map(|line| strip(line.into_iter().map(place)));
        let words = LineStrips2D::new(words).with_radii([look::points(1.25)]).with_colors([INK]);
        stream.fixed(path.child("words"), &words.with_draw_order(1.0));

        for (name, ends, stage, order) in [("before", &cell.before, BEFORE, 10.0), ("after", &cell.after, AFTER, 20.0)]
        {
            let count = ends.len() as f64;
            let mean = ends.iter().fold([0.0; 2], |[x, y], end| [x + end[0] / count, y + end[1] / count]);
            let arrows = ends.iter().chain([&mean]);
            let arrows = Arrows2D::from_vectors(arrows.map(|&[x, y]| [x as f32, -y as f32]))
                .with_origins(std::iter::repeat_n(down(centre), ends.len() + 1))
                .with_colors([stage.tone(hue(cell.condition))])
                .with_radii(ends.iter().map(|_| look::points(1.2)).chain([look::points(4.0)]))
                .with_draw_order(order);
            stream.fixed(path.child(name), &arrows);
        }
    }
}

/// The viewer's y points down the screen.
fn down([x, y]: [f64; 2]) -> [f32; 2] {
    [x as f32, -y as f32]
}

fn strip(points: impl IntoIterator<Item = [f64; 2]>) -> LineStrip2D {
    LineStrip2D::from_iter(points.into_iter().map(down))
}

/// Measured less predicted at each reading: distance \[mm\], heading \[mrad\].
fn off(run: &RunReadings, predicted: &[Pose2]) -> Vec<(f64, Option<f64>)> {
    let off = |(measured, predicted): (&crate::dataset::SurveyedPose, &Pose2)| {
        let position = (measured.x - predicted.x).hypot(measured.y - predicted.y);
        (1e3 * position, measured.heading.map(|heading| 1e3 * (heading - predicted.heading)))
    };
    run.measured.iter().zip(predicted).map(off).collect()
}

/// Residuals along a run that was surveyed on the way.
fn series(stream: &Stream, run: &RunReadings) {
    let Some(stamps) = stamps(run) else { return };
    for (name, predicted, stage) in [("before", &run.before, BEFORE), ("after", &run.after, AFTER)] {
        let off = off(run, predicted);
        let timed = || stamps.iter().zip(&off).filter_map(|(stamp, off)| Some(((*stamp)?, off)));
        let position: Vec<(f64, f64)> = timed().map(|(stamp, off)| (stamp, off.0)).collect();
        let heading: Vec<(f64, f64)> = timed().filter_map(|(stamp, off)| Some((stamp, off.1?))).collect();
        for (what, unit, values) in
            [("position_residual_mm", "mm", position), ("heading_residual_mrad", "mrad", heading)]
        {
            if values.is_empty() {
                continue;
            }
            let path = Path::of(["series", what, &run.name, name]);
            let style = SeriesLines::new()
                .with_names([format!("{} {name} [{unit}]", short(&run.name))])
                .with_colors([stage.tone_of_line(hue(&run.condition))])
                .with_widths([1.5]);
            stream.fixed(path.clone(), &style);
            let times: Vec<i64> = values.iter().map(|(stamp, _)| (1e9 * stamp).round() as i64).collect();
            let values = Scalars::new(values.iter().map(|(_, value)| *value));
            stream.columns(&path, &times, values.columns_of_unit_batches());
        }
    }
}

/// Without its campaign's name.
fn short(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

/// Residuals of the ends over the number of the run.
fn by_run(stream: &Stream, runs: &[RunReadings]) {
    for (name, before) in [("before", true), ("after", false)] {
        let end = |run: &RunReadings| off(run, if before { &run.before } else { &run.after }).last().copied();
        let ends: Vec<(i64, (f64, Option<f64>))> =
            (1..).zip(runs).filter_map(|(number, run)| Some((number, end(run)?))).collect();
        let position: Vec<(i64, f64)> = ends.iter().map(|(number, end)| (*number, end.0)).collect();
        let heading: Vec<(i64, f64)> = ends.iter().filter_map(|(number, end)| Some((*number, end.1?))).collect();
        for (what, unit, values) in
            [("position_residual_mm", "mm", position), ("heading_residual_mrad", "mrad", heading)]
        {
            if values.is_empty() {
                continue;
            }
            let path = Path::of(["by_run", what, name]);
            let stage = if before { BEFORE } else { AFTER };
            let style = SeriesPoints::new()
                .with_names([format!("{name} [{unit}]")])
                .with_colors([stage.tone_of_line(look::BLUE)])
                .with_marker_sizes([if before { 2.5 } else { 4.5 }]);
            stream.fixed(path.clone(), &style);
            let numbers: Vec<i64> = values.iter().map(|(number, _)| *number).collect();
            let values = Scalars::new(values.iter().map(|(_, value)| *value));
            stream.columns_by_run(&path, &numbers, values.columns_of_unit_batches());
        }
    }
}
