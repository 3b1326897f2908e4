//! One run, as it goes.

use super::look::{self, BELIEF, FORCE, FORCE_SCALE, Rgb, Stage, TRACTION, TRACTION_SCALE, TYRE, WHITE};
use super::mesh::{Mesh, f32s};
use super::stream::{Path, Stream, xyzw};
use super::{Detail, Recording, RunLabel};
use crate::drive::{CELLS_ACROSS, CELLS_ALONG, Observer, SNAPSHOT_RATE, Snapshot, WheelSnapshot};
use crate::geometry::Pose2;
use crate::scene::{Body, Placement, Robot, Shape};
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use rerun::{Arrows3D, Boxes3D, FillMode, LineStrip3D, LineStrips3D, Points3D, Scalars, SeriesLines, Transform3D};
use std::time::{Duration, Instant};

/// Rate of the poses of bodies \[Hz\].
const BODY_RATE: f64 = 25.0;
/// Rate of tractions and forces as arrows \[Hz\].
const PATCH_RATE: f64 = 10.0;
/// The size of a patch is logged when it has changed by this share \[–\].
const PATCH_CHANGE: f64 = 0.05;
/// Rate at which paths grow \[Hz\].
const TRAIL_RATE: f64 = 5.0;
/// Rows are sent together, those of this much wall time. A viewer opens few large batches faster than many small ones, so
/// their number is limited only to bound memory.
const BATCH_ROWS: usize = 3_000;
const BATCH_TIME: Duration = Duration::from_secs(1);
/// Paths float above the floor \[m\], so that they do not fight with it: in order, all runs', featured ones, growing ones.
const LIFT: [f64; 3] = [3e-3, 5e-3, 8e-3];

/// Records one run; what it has not sent yet goes to the file when it is dropped.
///
/// Writing never fails the run: [`Recording::check`](super::Recording::check) tells whether all of it arrived.
pub struct RunRecorder {
    stream: Stream,
    root: Path,
    style: Style,
    /// room_from_base at the first snapshot.
    start: Option<Placement>,
    truth: Trail,
    belief: Trail,
    full: Option<Box<Full>>,
}

/// How the run is drawn.
struct Style {
    colour: Rgb,
    /// Of its path's line \[points\].
    width: f32,
    lift: f64,
}

impl RunRecorder {
    pub(super) fn new(recording: &Recording, label: &RunLabel, detail: Detail) -> RunRecorder {
        let stream = recording.stream.clone();
        let root = label.path();
        stream.tilt(&root);
        let stage = recording.stage(&label.stage);
        let colour = stage.tone(look::of_direction(&label.direction));
        let full = (detail == Detail::Full).then(|| {
            let robot = &recording.robot;
            let full = Full::new(&root, robot);
            full.dress(&stream, &root, robot, recording.tint.then_some(colour));
            full.name(&stream, robot, label, stage);
            full.draw_trails(&stream, colour);
            Box::new(full)
        });
        let style = match detail {
            Detail::Full => Style { colour, width: 2.5, lift: LIFT[1] },
            Detail::Path => Style { colour: colour.over(WHITE, 0.75), width: 1.75, lift: LIFT[0] },
        };
        RunRecorder { stream, root, style, start: None, truth: Trail::default(), belief: Trail::default(), full }
    }
}

impl Observer for RunRecorder {
    fn observe(&mut self, snapshot: &Snapshot<'_>) {
        let start = self.start.get_or_insert(snapshot.base);
        let climbed = snapshot.base.translation.z - start.translation.z;
        let believed = planar(start).compose(snapshot.odometry);
        let lift = self.style.lift;
        self.truth.push(
            snapshot.base.translation.x,
            snapshot.base.translation.y,
            climbed + lift,
            snapshot.truth.heading,
        );
        self.belief.push(believed.x, believed.y, lift, believed.heading);
        if let Some(full) = &mut self.full {
            let standing = start.translation.z;
            full.observe(snapshot, believed, standing, [&self.truth, &self.belief]);
            if full.times.len() >= BATCH_ROWS || full.sent.elapsed() >= BATCH_TIME {
                full.send(&self.stream);
            }
        }
    }
}

impl Drop for RunRecorder {
    fn drop(&mut self) {
        if let Some(full) = &mut self.full {
            full.send(&self.stream);
        }
        if self.start.is_none() {
            return;
        }
        let paths = self.root.child("path");
        let truth = LineStrips3D::new([self.truth.strip()])
            .with_radii([look::points(self.style.width)])
            .with_colors([self.style.colour]);
        self.stream.fixed(paths.child("true"), &truth);
        let belief = LineStrips3D::new(self.belief.dashes())
            .with_radii([look::points(self.style.width.min(1.5))])
            .with_colors([BELIEF]);
        self.stream.fixed(paths.child("dead_reckoned"), &belief);
        let end = Points3D::new([self.truth.tip]).with_radii([look::points(9.0)]).with_colors([self.style.colour]);
        self.stream.fixed(paths.child("true_end"), &end);
    }
}

/// A path, thinned: points at most 0.2 m apart, and one at each change of heading.
#[derive(Default)]
struct Trail {
    kept: Vec<[f32; 3]>,
    kept_heading: f64,
    tip: [f32; 3],
}

impl Trail {
    fn push(&mut self, x: f64, y: f64, z: f64, heading: f64) {
        self.tip = [x as f32, y as f32, z as f32];
        let moved = self.kept.last().map(|kept| (kept[0] - self.tip[0]).hypot(kept[1] - self.tip[1]));
        let turned = (heading - self.kept_heading).abs();
        if moved.is_none_or(|moved| moved > 0.2 || (moved > 2e-3 && turned > 0.05)) {
            self.kept.push(self.tip);
            self.kept_heading = heading;
        }
    }

    fn strip(&self) -> LineStrip3D {
        LineStrip3D::from_iter(self.kept.iter().chain([&self.tip]).copied())
    }

    /// 60 mm of line, 40 mm of gap.
    fn dashes(&self) -> Vec<LineStrip3D> {
        const PERIOD: f32 = 0.1;
        const DASH: f32 = 0.06;
        let mut dashes = Vec::new();
        let mut dash: Vec<[f32; 3]> = Vec::new();
        let mut phase = 0.0;
        let points: Vec<[f32; 3]> = self.kept.iter().chain([&self.tip]).copied().collect();
        for ends in points.windows(2) {
            let length = (ends[1][0] - ends[0][0]).hypot(ends[1][1] - ends[0][1]);
            let at = |done: f32| std::array::from_fn(|k| ends[0][k] + (ends[1][k] - ends[0][k]) * done / length);
            let mut done = 0.0;
            while done < length {
                let edge = if phase < DASH { DASH } else { PERIOD };
                let step = (edge - phase).min(length - done);
                if phase < DASH {
                    if dash.is_empty() {
                        dash.push(at(done));
                    }
                    dash.push(at(done + step));
                }
                done += step;
                phase += step;
                // Steps end at an edge but for rounding.
                if phase > edge - 1e-5 {
                    phase = if edge == DASH { DASH } else { 0.0 };
                    if edge == DASH {
                        dashes.push(LineStrip3D::from_iter(dash.drain(..)));
                    }
                }
            }
        }
        if !dash.is_empty() {
            dashes.push(LineStrip3D::from_iter(dash));
        }
        dashes
    }
}

/// Everything of a run, a batch at a time.
struct Full {
    /// Of the rows since the last batch \[ns\].
    times: Vec<i64>,
    body_times: Vec<i64>,
    patch_times: Vec<i64>,
    trail_times: Vec<i64>,
    /// Chassis, belief, the wheels, then forks of casters.
    bodies: Vec<BodyTrack>,
    wheel_series: [WheelSeries; 8],
    heading_error: Series,
    position_error: Series,
    patches: Vec<PatchTrack>,
    /// True, dead-reckoned.
    trails: [TrailTrack; 2],
    rows: usize,
    sent: Instant,
}

struct BodyTrack {
    path: Path,
    translations: Vec<[f32; 3]>,
    rotations: Vec<rerun::Quaternion>,
}

struct Series {
    path: Path,
    values: Vec<f64>,
}

/// A series with an instance a wheel.
struct WheelSeries {
    series: Series,
    name: &'static str,
    unit: &'static str,
    of: fn(&WheelSnapshot) -> f64,
}

/// A patch in its own frame: x along, y across.
struct PatchTrack {
    frame: BodyTrack,
    tractions: Path,
    outline: Path,
    force: Path,
    vectors: Vec<[f32; 3]>,
    vector_counts: Vec<usize>,
    forces: Vec<[f32; 3]>,
    force_counts: Vec<usize>,
    /// Half length and width as last logged \[m\].
    size: [f64; 2],
    size_times: Vec<i64>,
    origins: Vec<[f32; 3]>,
    outlines: Vec<LineStrip3D>,
}

struct TrailTrack {
    path: Path,
    strips: Vec<LineStrip3D>,
}

/// Name with unit, legend's words, unit, and what is plotted.
type WheelQuantity = (&'static str, &'static str, &'static str, fn(&WheelSnapshot) -> f64);

const WHEEL_QUANTITIES: [WheelQuantity; 8] = [
    ("wheel_speed_rad_s", "", "rad/s", |wheel| wheel.speed),
    ("wheel_speed_commanded_rad_s", "commanded", "rad/s", |wheel| wheel.commanded_speed),
    ("ticks", "", "ticks", |wheel| wheel.ticks as f64),
    ("slip_along_m_s", "along", "m/s", |wheel| wheel.slip_along),
    ("slip_across_m_s", "across", "m/s", |wheel| wheel.slip_across),
    ("load_n", "", "N", |wheel| wheel.load),
    ("force_along_n", "along", "N", |wheel| wheel.force_along),
    ("force_across_n", "across", "N", |wheel| wheel.force_across),
];

impl Full {
    fn new(root: &Path, robot: &Robot) -> Full {
        let series = root.child("series");
        let named = |name: &str| Series { path: series.child(name), values: Vec::new() };
        let track = |path: Path| BodyTrack { path, translations: Vec::new(), rotations: Vec::new() };
        let wheels = robot.wheels.iter().map(|wheel| track(root.child("wheels").child(&wheel.name)));
        let swivels = robot.casters.iter().filter(|caster| caster.swivel.is_some());
        let forks = swivels.map(|caster| track(root.child("casters").child(&caster.link)));
        let patches = robot.wheels.iter().map(|wheel| {
            let patch = root.child("patches").child(&wheel.name);
            PatchTrack {
                tractions: patch.child("tractions"),
                outline: patch.child("outline"),
                force: patch.child("force"),
                frame: track(patch),
                vectors: Vec::new(),
                vector_counts: Vec::new(),
                forces: Vec::new(),
                force_counts: Vec::new(),
                size: [0.0; 2],
                size_times: Vec::new(),
                origins: Vec::new(),
                outlines: Vec::new(),
            }
        });
        let trail = |name: &str| TrailTrack { path: root.child("path").child(name), strips: Vec::new() };
        Full {
            times: Vec::new(),
            body_times: Vec::new(),
            patch_times: Vec::new(),
            trail_times: Vec::new(),
            bodies: [track(root.child("chassis")), track(root.child("believed"))]
                .into_iter()
                .chain(wheels)
                .chain(forks)
                .collect(),
            wheel_series: WHEEL_QUANTITIES.map(|(path, name, unit, of)| WheelSeries {
                series: named(path),
                name,
                unit,
                of,
            }),
            heading_error: named("heading_error_mrad"),
            position_error: named("position_error_mm"),
            patches: patches.collect(),
            trails: [trail("true_so_far"), trail("dead_reckoned_so_far")],
            rows: 0,
            sent: Instant::now(),
        }
    }

    /// Logs shapes, which do not change.
    fn dress(&self, stream: &Stream, root: &Path, robot: &Robot, tint: Option<Rgb>) {
        let own = |colour: Option<[f64; 4]>, otherwise: Rgb| colour.map_or(otherwise, Rgb::from_urdf);
        let mut chassis = Mesh::default();
        for (index, visual) in robot.chassis.visuals.iter().enumerate() {
            let colour = match tint {
                Some(tint) if index == 0 => tint,
                _ => own(visual.colour, look::CHASSIS),
            };
            chassis.shape(visual, colour);
        }
        stream.fixed(root.child("chassis").child("shape"), &chassis.into_rerun());
        let mark = tint.unwrap_or(WHITE);
        for (wheel, track) in robot.wheels.iter().zip(&self.bodies[2..]) {
            let rubber = |colour| own(colour, TYRE);
            let mut mesh = Mesh::default();
            for visual in &wheel.body.visuals {
                match visual.shape {
                    Shape::Cylinder { radius, length } => {
                        mesh.wheel(&visual.placement, radius, length, rubber(visual.colour), mark);
                    }
                    _ => mesh.shape(visual, rubber(visual.colour)),
                }
            }
            if mesh.is_empty() {
                let along_axle = UnitQuaternion::rotation_between(&Vector3::z(), &wheel.axle).unwrap_or_default();
                let place = Placement::from_parts(Translation3::identity(), along_axle);
                mesh.wheel(&place, wheel.tyre.free_radius, wheel.tyre.width, TYRE, mark);
            }
            stream.fixed(track.path.child("shape"), &mesh.into_rerun());
        }
        let swivels = robot.casters.iter().filter_map(|caster| caster.swivel.as_ref());
        for (swivel, track) in swivels.zip(&self.bodies[2 + robot.wheels.len()..]) {
            let mut mesh = Mesh::default();
            swivel.visuals.iter().for_each(|visual| mesh.shape(visual, own(visual.colour, look::CHASSIS)));
            stream.fixed(track.path.child("shape"), &mesh.into_rerun());
        }
        let (centre, half) = bounds(robot);
        let frame = Boxes3D::from_centers_and_half_sizes([f32s(&centre)], [f32s(&half)])
            .with_fill_mode(FillMode::MajorWireframe)
            .with_radii([look::points(1.5)])
            .with_colors([BELIEF]);
        stream.fixed(root.child("believed").child("frame"), &frame);

        for patch in &self.patches {
            let style = Arrows3D::update_fields().with_radii([look::metres(3e-3)]).with_colors([TRACTION]);
            stream.fixed(patch.tractions.clone(), &style);
            let style = LineStrips3D::update_fields().with_radii([look::points(1.5)]).with_colors([TRACTION]);
            stream.fixed(patch.outline.clone(), &style);
            let style = Arrows3D::update_fields().with_radii([look::metres(0.012)]).with_colors([FORCE]);
            stream.fixed(patch.force.clone(), &style);
        }
    }

    fn draw_trails(&self, stream: &Stream, colour: Rgb) {
        for (trail, (colour, width)) in self.trails.iter().zip([(colour, 4.0), (BELIEF, 2.0)]) {
            let style = LineStrips3D::update_fields().with_radii([look::points(width)]).with_colors([colour]);
            stream.fixed(trail.path.clone(), &style);
        }
    }

    /// Logs names and colours of series.
    fn name(&self, stream: &Stream, robot: &Robot, label: &RunLabel, stage: Stage) {
        let styles = look::of_wheels(robot);
        for series in &self.wheel_series {
            let commanded = series.name == "commanded";
            let names = robot.wheels.iter().map(|wheel| {
                let gap = if series.name.is_empty() { "" } else { " " };
                format!("{}{gap}{} [{}]", look::words(&wheel.name), series.name, series.unit)
            });
            let style = |&(colour, width): &(Rgb, f32)| if commanded { (look::RIM, 1.0) } else { (colour, width) };
            let lines = SeriesLines::new()
                .with_names(names)
                .with_colors(styles.iter().map(|own| style(own).0))
                .with_widths(styles.iter().map(|own| style(own).1));
            stream.fixed(series.series.path.clone(), &lines);
        }
        for (series, unit) in [(&self.heading_error, "mrad"), (&self.position_error, "mm")] {
            let lines = SeriesLines::new()
                .with_names([format!("{} [{unit}]", label.words())])
                .with_colors([stage.tone_of_line(look::of_direction(&label.direction))])
                .with_widths([2.0]);
            stream.fixed(series.path.clone(), &lines);
        }
    }

    fn observe(&mut self, snapshot: &Snapshot<'_>, believed: Pose2, standing: f64, trails: [&Trail; 2]) {
        let time = (1e9 * snapshot.time).round() as i64;
        self.times.push(time);
        let every = |rate: f64| (SNAPSHOT_RATE / rate).round().max(1.0) as usize;
        if self.rows.is_multiple_of(every(BODY_RATE)) {
            self.body_times.push(time);
            let upright = UnitQuaternion::from_euler_angles(0.0, 0.0, believed.heading);
            let believed = Placement::from_parts(Translation3::new(believed.x, believed.y, standing), upright);
            let wheels = snapshot.wheels.iter().map(|wheel| &wheel.placement);
            let placements = [&snapshot.base, &believed].into_iter().chain(wheels).chain(snapshot.forks);
            for (track, placement) in self.bodies.iter_mut().zip(placements) {
                track.push(placement);
            }
        }
        for series in &mut self.wheel_series {
            series.series.values.extend(snapshot.wheels.iter().map(series.of));
        }
        self.heading_error.values.push(1e3 * (snapshot.odometry.heading - snapshot.truth.heading));
        self.position_error.values.push(1e3 * snapshot.odometry.distance(snapshot.truth));
        if self.rows.is_multiple_of(every(PATCH_RATE)) {
            self.patch_times.push(time);
            for (track, wheel) in self.patches.iter_mut().zip(snapshot.wheels) {
                track.push(time, wheel);
            }
        }
        if self.rows.is_multiple_of(every(TRAIL_RATE)) {
            self.trail_times.push(time);
            for (track, trail) in self.trails.iter_mut().zip(trails) {
                track.strips.push(trail.strip());
            }
        }
        self.rows += 1;
    }

    /// Sends what has come together, and starts over with the same buffers. What shows most goes first, should the disk fill.
    fn send(&mut self, stream: &Stream) {
        self.sent = Instant::now();
        if !self.body_times.is_empty() {
            for track in &mut self.bodies {
                track.send(stream, &self.body_times);
            }
            self.body_times.clear();
        }
        if !self.trail_times.is_empty() {
            for track in &mut self.trails {
                let strips = LineStrips3D::update_fields().with_strips(track.strips.drain(..));
                stream.columns(&track.path, &self.trail_times, strips.columns_of_unit_batches());
            }
            self.trail_times.clear();
        }
        if !self.patch_times.is_empty() {
            for track in &mut self.patches {
                track.send(stream, &self.patch_times);
            }
            self.patch_times.clear();
        }
        let times = &self.times;
        if !times.is_empty() {
            let singles = [&mut self.heading_error, &mut self.position_error];
            for series in self.wheel_series.iter_mut().map(|series| &mut series.series).chain(singles) {
                let width = series.values.len() / times.len();
                let scalars = Scalars::new(series.values.drain(..));
                stream.columns(&series.path, times, scalars.columns(times.iter().map(|_| width)));
            }
            self.times.clear();
        }
    }
}

impl BodyTrack {
    fn push(&mut self, placement: &Placement) {
        self.translations.push(f32s(&placement.translation.vector));
        self.rotations.push(xyzw(&placement.rotation));
    }

    fn send(&mut self, stream: &Stream, times: &[i64]) {
        let poses = Transform3D::update_fields()
            .with_many_translation(self.translations.drain(..))
            .with_many_quaternion(self.rotations.drain(..))
            .columns_of_unit_batches();
        stream.columns(&self.path, times, poses);
    }
}

impl PatchTrack {
    fn push(&mut self, time: i64, wheel: &WheelSnapshot) {
        let Some(patch) = &wheel.patch else {
            self.frame.push(&wheel.placement);
            self.vector_counts.push(0);
            self.force_counts.push(0);
            self.resize(time, [0.0; 2]);
            return;
        };
        let axes = [patch.along, patch.across].map(Vector3::from);
        let rotation = UnitQuaternion::from_basis_unchecked(&[axes[0], axes[1], axes[0].cross(&axes[1])]);
        self.frame.push(&Placement::from_parts(Vector3::from(patch.centre).into(), rotation));
        let vector = |x: f64, y: f64, scale: f64| [(x * scale) as f32, (y * scale) as f32, 0.0];
        self.vectors.extend(patch.tractions.iter().flatten().map(|&[x, y]| vector(x, y, TRACTION_SCALE)));
        self.vector_counts.push(CELLS_ALONG * CELLS_ACROSS);
        self.forces.push(vector(wheel.force_along, wheel.force_across, FORCE_SCALE));
        self.force_counts.push(1);
        self.resize(time, [patch.half_length, patch.width]);
    }

    /// Logs outline and cells where they have changed.
    fn resize(&mut self, time: i64, size: [f64; 2]) {
        let changed = (0..2).any(|k| (size[k] - self.size[k]).abs() > PATCH_CHANGE * self.size[k]);
        if !changed {
            return;
        }
        self.size = size;
        self.size_times.push(time);
        let at = |along: f64, across: f64| [(along * size[0]) as f32, (0.5 * across * size[1]) as f32, 0.0];
        let middle = |cell: usize, cells: usize| (2 * cell + 1) as f64 / cells as f64 - 1.0;
        for i in 0..CELLS_ALONG {
            self.origins.extend((0..CELLS_ACROSS).map(|j| at(middle(i, CELLS_ALONG), middle(j, CELLS_ACROSS))));
        }
        let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (1.0, 1.0)];
        self.outlines.push(LineStrip3D::from_iter(corners.map(|(along, across)| at(along, across))));
    }

    fn send(&mut self, stream: &Stream, times: &[i64]) {
        self.frame.send(stream, times);
        let tractions = Arrows3D::update_fields().with_vectors(self.vectors.drain(..));
        stream.columns(&self.tractions, times, tractions.columns(self.vector_counts.iter().copied()));
        self.vector_counts.clear();
        let forces = Arrows3D::update_fields().with_vectors(self.forces.drain(..));
        stream.columns(&self.force, times, forces.columns(self.force_counts.iter().copied()));
        self.force_counts.clear();
        if !self.size_times.is_empty() {
            let cells = Arrows3D::update_fields().with_origins(self.origins.drain(..));
            let counts = self.size_times.iter().map(|_| CELLS_ALONG * CELLS_ACROSS);
            stream.columns(&self.tractions, &self.size_times, cells.columns(counts));
            let outlines = LineStrips3D::update_fields().with_strips(self.outlines.drain(..));
            stream.columns(&self.outline, &self.size_times, outlines.columns_of_unit_batches());
            self.size_times.clear();
        }
    }
}

/// The pose of a placement seen from above.
fn planar(placement: &Placement) -> Pose2 {
    let forward = placement.rotation * Vector3::x();
    Pose2::new(placement.translation.x, placement.translation.y, forward.y.atan2(forward.x))
}

/// Centre and half size of the box around all that a robot shows, in its base frame \[m\].
pub(super) fn bounds(robot: &Robot) -> (Vector3<f64>, Vector3<f64>) {
    let (mut least, mut greatest) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
    let mut include = |centre: Point3<f64>, reach: Vector3<f64>| {
        least = least.inf(&(centre.coords - reach));
        greatest = greatest.sup(&(centre.coords + reach));
    };
    let mut body = |base_from_body: &Placement, body: &Body| {
        for visual in &body.visuals {
            let place = base_from_body * visual.placement;
            let half = match visual.shape {
                Shape::Box { size } => Vector3::from(size) * 0.5,
                Shape::Cylinder { radius, length } => Vector3::new(radius, radius, 0.5 * length),
                Shape::Sphere { radius } => Vector3::repeat(radius),
            };
            include(place.translation.vector.into(), place.rotation.to_rotation_matrix().matrix().abs() * half);
        }
    };
    body(&Placement::identity(), &robot.chassis);
    for wheel in &robot.wheels {
        body(&wheel.base_from_wheel, &wheel.body);
    }
    for wheel in &robot.wheels {
        include(wheel.base_from_wheel.translation.vector.into(), Vector3::new(1.0, 0.0, 1.0) * wheel.tyre.free_radius);
    }
    ((least + greatest) * 0.5, (greatest - least) * 0.5)
}
