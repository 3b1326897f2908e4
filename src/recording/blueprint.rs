//! The embedded blueprint: what the viewer shows when it opens the file.
//!
//! rerun's own builder has no way to say where a camera stands, which axes are linked or what a background is, so this
//! logs the blueprint's archetypes by itself, at the paths that the viewer reads.

use super::look::PAPER;
use super::stream::TIMELINE;
use super::{APPLICATION, Area, Outline, RunLabel, run, scatter};
use crate::scene::Robot;
use rerun::datatypes::{TimeRange, TimeRangeBoundary};
use rerun::external::re_log_types::{BlueprintActivationCommand, LogMsg};
use rerun::external::re_sdk_types::blueprint::archetypes::{
    Background, ContainerBlueprint, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend, TimeAxis,
    TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint,
};
use rerun::external::re_sdk_types::blueprint::components::{
    AutoLayout, AutoViews, BackgroundKind, ColumnShare, ContainerKind, Corner2D, Eye3DKind, IncludedContent, LoopMode,
    PanelState, PlayState, PlaybackSpeed, QueryExpression, RootContainer, RowShare, TimelineName, ViewClass,
};
use rerun::external::uuid::Uuid;
use rerun::{
    Archetype, AsComponents, RecordingStream, RecordingStreamBuilder, RecordingStreamResult, SerializedComponentBatch,
};

/// Faster than life when the viewer opens it: a 4 m square takes a quarter of a minute.
const PLAYBACK_SPEED: f64 = 4.0;
/// Half of the viewer's vertical field of view \[rad\].
const HALF_VIEW: f64 = 0.48;

/// A part of the window.
pub(super) enum Pane {
    Split { kind: ContainerKind, shares: Vec<f32>, panes: Vec<Pane>, name: Option<String> },
    View(View),
}

pub(super) struct View {
    class: &'static str,
    name: String,
    origin: String,
    contents: Vec<String>,
    properties: Vec<(&'static str, Vec<SerializedComponentBatch>)>,
}

impl View {
    pub(super) fn new(class: &'static str, name: impl Into<String>, origin: &str) -> View {
        let (name, origin) = (name.into(), origin.to_owned());
        View { class, name, origin, contents: vec!["$origin/**".to_owned()], properties: Vec::new() }
    }

    pub(super) fn contents(self, contents: Vec<String>) -> View {
        View { contents, ..self }
    }

    fn with<A: Archetype + AsComponents>(mut self, property: &A) -> View {
        self.properties.push((A::name().short_name(), property.as_serialized_batches()));
        self
    }

    pub(super) fn on_paper(self) -> View {
        self.with(&Background::new(BackgroundKind::SolidColor).with_color(PAPER))
    }
}

impl From<View> for Pane {
    fn from(view: View) -> Pane {
        Pane::View(view)
    }
}

/// Panes above each other, or beside each other, with their shares.
pub(super) fn split(kind: ContainerKind, panes: Vec<(f32, Pane)>) -> Pane {
    let (shares, panes) = panes.into_iter().unzip();
    Pane::Split { kind, shares, panes, name: None }
}

/// Named panes behind each other, the first one in front.
pub(super) fn tabs(panes: Vec<(&str, Pane)>) -> Pane {
    let named = |(name, pane): (&str, Pane)| match pane {
        Pane::Split { kind, shares, panes, .. } => Pane::Split { kind, shares, panes, name: Some(name.to_owned()) },
        Pane::View(view) => Pane::View(View { name: name.to_owned(), ..view }),
    };
    let panes: Vec<Pane> = panes.into_iter().map(named).collect();
    Pane::Split { kind: ContainerKind::Tabs, shares: Vec::new(), panes, name: None }
}

/// The blueprint of `outline` as messages, ready for the head of a file.
pub(super) fn messages(outline: &Outline, robot: &Robot) -> RecordingStreamResult<Vec<LogMsg>> {
    messages_of(&layout(outline, robot), TIMELINE, Some(PLAYBACK_SPEED))
}

/// The blueprint of a window with `root`, on `timeline`; at rest without a speed.
pub(super) fn messages_of(root: &Pane, timeline: &str, speed: Option<f64>) -> RecordingStreamResult<Vec<LogMsg>> {
    let (stream, storage) = RecordingStreamBuilder::new(APPLICATION).blueprint().memory()?;
    stream.set_time_sequence("blueprint", 0);
    let mut writer = Writer { stream, ids: 0 };
    let (_, root) = writer.pane(root)?;
    let viewport = ViewportBlueprint::new()
        .with_root_container(RootContainer(root.into()))
        .with_auto_layout(AutoLayout(false.into()))
        .with_auto_views(AutoViews(false.into()));
    writer.stream.log("viewport", &viewport)?;
    for panel in ["blueprint_panel", "selection_panel"] {
        writer.stream.log(panel, &PanelBlueprint::new().with_state(PanelState::Hidden))?;
    }
    let time = TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline(TimelineName(timeline.into()))
        .with_playback_speed(PlaybackSpeed(speed.unwrap_or(1.0).into()))
        .with_play_state(if speed.is_some() { PlayState::Playing } else { PlayState::Paused })
        .with_loop_mode(LoopMode::All);
    writer.stream.log("time_panel", &time)?;
    let mut messages = storage.take();
    let id = messages.iter().find_map(|message| match message {
        LogMsg::SetStoreInfo(info) => Some(info.info.store_id.clone()),
        _ => None,
    });
    if let Some(blueprint_id) = id {
        messages.push(BlueprintActivationCommand { blueprint_id, make_active: true, make_default: true }.into());
    }
    Ok(messages)
}

fn layout(outline: &Outline, robot: &Robot) -> Pane {
    let text = View::new("TextDocument", "Result", "/result");
    let legend = View::new("TextDocument", "How to read this", "/how_to_read");
    // A single drive has room for both.
    let eyes: &[Eye] = if outline.sides.is_empty() { &[BESIDE, BELOW] } else { &[BELOW] };
    let mut below: Vec<_> = eyes.iter().map(|eye| (1.0, close_up(outline, robot, eye))).collect();
    below.extend(outline.sides.iter().map(|&side| {
        let name = format!("End points of {side} m squares");
        (1.0, View::new("2D", name, &scatter::path(side).escaped()).on_paper().into())
    }));
    let left =
        split(ContainerKind::Vertical, vec![(1.5, overview(outline)), (1.0, split(ContainerKind::Horizontal, below))]);
    // An experiment's tables are longer than a drive's.
    let share = if outline.sides.is_empty() { 0.36 } else { 0.65 };
    let right =
        split(ContainerKind::Vertical, vec![(share, text.into()), (0.24, legend.into()), (1.0, plots(outline))]);
    split(ContainerKind::Horizontal, vec![(1.2, left), (1.0, right)])
}

/// All runs on the floor, seen from behind the start.
fn overview(outline: &Outline) -> Pane {
    let mut contents = vec![
        "+ /**".to_owned(),
        "- /end_points/**".to_owned(),
        "- /result/**".to_owned(),
        "- /how_to_read/**".to_owned(),
    ];
    contents.extend(outline.featured.iter().map(|run| format!("- {}/**", run.path().child("series").escaped())));
    over(View::new("3D", outline.title.clone(), "/").contents(contents), &outline.area, 0.85, 0.6)
}

/// A view of an area of the floor from behind the start, at an angle of depression \[rad\], with a margin \[m\].
pub(super) fn over(view: View, area: &Area, depression: f64, margin: f64) -> Pane {
    let centre = [0, 1].map(|axis| 0.5 * (area.min[axis] + area.max[axis]));
    let size = [0, 1].map(|axis| area.max[axis] - area.min[axis] + margin);
    // In a pane about 1.7 times as wide as high.
    let (sin, cos) = depression.sin_cos();
    let distance = (0.5 * size[0] * sin).max(0.5 * size[1] / 1.7) / HALF_VIEW.tan() + 0.5 * size[0] * cos;
    // A little nearer than the middle, which the eye sees above its own.
    let centre = [centre[0] - 0.06 * size[0], centre[1]];
    let eye = [centre[0] - distance * cos, centre[1], distance * sin];
    view.with(&LineGrid3D::new().with_visible(false))
        .with(
            &EyeControls3D::new()
                .with_kind(Eye3DKind::Orbital)
                .with_position(eye.map(|value| value as f32))
                .with_look_target([centre[0] as f32, centre[1] as f32, 0.0])
                .with_eye_up([0.0, 0.0, 1.0]),
        )
        .on_paper()
        .into()
}

/// Where an eye stands that is fixed to the chassis, in radii of the robot, and which way is up for it.
struct Eye {
    name: &'static str,
    position: [f64; 3],
    up: [f32; 3],
    /// Hides the floor itself, as if it were of glass.
    glass: bool,
}

const BESIDE: Eye = Eye { name: "The robot", position: [-1.5, -2.1, 1.7], up: [0.0, 0.0, 1.0], glass: false };
const BELOW: Eye =
    Eye { name: "Its tyres, through a floor of glass", position: [-0.8, 0.0, -2.6], up: [1.0, 0.0, 0.0], glass: true };

/// The first featured robot and its patches.
fn close_up(outline: &Outline, robot: &Robot, eye: &Eye) -> Pane {
    let (_, half) = run::bounds(robot);
    let place = eye.position.map(|radii| (radii * half.norm()) as f32);
    let mut contents = vec!["+ /floor/**".to_owned()];
    if eye.glass {
        contents.extend(["plane", "grip", "obstacles"].map(|what| format!("- /floor/{what}")));
    }
    let mut origin = "/".to_owned();
    if let Some(run) = outline.featured.first() {
        let path = run.path();
        contents.push(format!("+ {}/**", path.escaped()));
        contents.push(format!("- {}/**", path.child("series").escaped()));
        origin = path.child("chassis").escaped();
    }
    let controls = EyeControls3D::new()
        .with_kind(Eye3DKind::Orbital)
        .with_position(place)
        .with_look_target([0.0, 0.0, -0.15 * half.norm() as f32])
        .with_eye_up(eye.up);
    View::new("3D", eye.name, &origin)
        .contents(contents)
        .with(&LineGrid3D::new().with_visible(false))
        .with(&controls)
        .on_paper()
        .into()
}

/// Series of the first featured run, and the errors of all of them.
fn plots(outline: &Outline) -> Pane {
    let first = outline.featured.first();
    let of_first = |name: &str| -> Vec<String> {
        first.map(|run| format!("+ {}", run.path().child("series").child(name).escaped())).into_iter().collect()
    };
    let of_all = |name: &str| -> Vec<String> {
        let path = |run: &RunLabel| format!("+ {}", run.path().child("series").child(name).escaped());
        outline.featured.iter().map(path).collect()
    };
    let beside = (outline.featured.len() > 1).then_some(Corner2D::LeftTop);
    let plot = |name: &str, contents: Vec<String>, legend: Option<Corner2D>| -> (f32, Pane) {
        (1.0, time_series(name, contents, legend))
    };
    let mut speeds = of_first("wheel_speed_commanded_rad_s");
    speeds.extend(of_first("wheel_speed_rad_s"));
    let column = |plots| (1.0, split(ContainerKind::Vertical, plots));
    split(
        ContainerKind::Horizontal,
        vec![
            column(vec![
                plot("Wheel speed [rad/s]", speeds, None),
                plot("Slip across the tyre [m/s]", of_first("slip_across_m_s"), None),
                plot("Heading error [mrad]", of_all("heading_error_mrad"), beside),
            ]),
            column(vec![
                plot("Encoders [ticks]", of_first("ticks"), Some(Corner2D::RightBottom)),
                plot("Force across the tyre [N]", of_first("force_across_n"), None),
                plot("Position error [mm]", of_all("position_error_mm"), beside),
            ]),
        ],
    )
}

/// A plot of all times.
pub(super) fn time_series(name: &str, contents: Vec<String>, legend: Option<Corner2D>) -> Pane {
    let legend = match legend {
        Some(corner) => PlotLegend::new().with_corner(corner),
        None => PlotLegend::new().with_visible(false),
    };
    // Left to itself the viewer shows a window of half a minute about the cursor.
    let whole = TimeRange { start: TimeRangeBoundary::Infinite, end: TimeRangeBoundary::Infinite };
    let view = View::new("TimeSeries", name, "/").contents(contents);
    view.with(&legend).with(&TimeAxis::new().with_view_range(whole)).into()
}

struct Writer {
    stream: RecordingStream,
    /// How many have been given away.
    ids: u128,
}

impl Writer {
    /// Logs a pane and what it holds; its path and id.
    fn pane(&mut self, pane: &Pane) -> RecordingStreamResult<(String, Uuid)> {
        self.ids += 1;
        let id = Uuid::from_u128(self.ids);
        let path = match pane {
            Pane::Split { kind, shares, panes, name } => {
                let mut contents = Vec::new();
                for pane in panes {
                    contents.push(IncludedContent(self.pane(pane)?.0.into()));
                }
                let mut container = ContainerBlueprint::new(*kind).with_contents(contents);
                if let Some(name) = name {
                    container = container.with_display_name(name.as_str());
                }
                container = match kind {
                    ContainerKind::Horizontal => {
                        container.with_col_shares(shares.iter().map(|&s| ColumnShare(s.into())))
                    }
                    ContainerKind::Vertical => container.with_row_shares(shares.iter().map(|&s| RowShare(s.into()))),
                    _ => container,
                };
                let path = format!("container/{id}");
                self.stream.log(path.as_str(), &container)?;
                path
            }
            Pane::View(view) => {
                let path = format!("view/{id}");
                let contents = view.contents.iter().map(|query| QueryExpression(query.as_str().into()));
                self.stream.log(format!("{path}/ViewContents"), &ViewContents::new(contents))?;
                let blueprint = ViewBlueprint::new(ViewClass(view.class.into()))
                    .with_display_name(view.name.as_str())
                    .with_space_origin(view.origin.as_str());
                self.stream.log(path.as_str(), &blueprint)?;
                for (name, batches) in &view.properties {
                    self.stream.log_serialized_batches(format!("{path}/{name}"), false, batches.iter().cloned())?;
                }
                path
            }
        };
        Ok((path, id))
    }
}
