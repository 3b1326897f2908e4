//! End points of squares, as in UMBmark's plots: x to the right, y up, in millimetres.

use super::lettering;
use super::look::{self, INK, PAPER, Stage};
use super::stream::{Path, Stream};
use crate::dataset::Rotation;
use rerun::{LineStrip2D, LineStrips2D, Points2D};
use std::f64::consts::TAU;

/// The end points of one cluster of runs.
#[derive(Debug, Clone, PartialEq)]
pub struct EndPoints {
    /// `before`, `after_umbmark_2m`, …
    pub stage: String,
    /// Which way round.
    pub direction: Rotation,
    /// Errors, surveyed − dead-reckoned, in the frame of the start \[m\].
    pub errors: Vec<[f64; 2]>,
    /// Their mean \[m\].
    pub centre_of_gravity: [f64; 2],
}

/// Where the plot of a side \[m\] is.
pub(super) fn path(side: f64) -> Path {
    Path::of(["end_points", &format!("square_{side}m")])
}

/// Logs the plot of a side \[m\]; `stage` tells when the stage of that name comes.
pub(super) fn draw(stream: &Stream, side: f64, clusters: &[EndPoints], stage: impl Fn(&str) -> Stage) {
    let root = path(side);
    let bounds = Bounds::of(clusters);
    axes(stream, &root, &bounds);
    for cluster in clusters {
        // Words of later stages stand on the empty side of the y axis, at the height of their way round.
        let first = clusters.iter().find(|other| other.direction == cluster.direction).unwrap_or(cluster);
        let aside = [bounds.empty_side(), if first.centre_of_gravity[1] < 0.0 { -1.0 } else { 1.0 }];
        let root = root.child(&cluster.stage).child(cluster.direction.as_str());
        draw_cluster(stream, &root, cluster, stage(&cluster.stage), bounds.letters(), aside);
    }
}

fn draw_cluster(stream: &Stream, root: &Path, cluster: &EndPoints, stage: Stage, size: f64, aside: [f64; 2]) {
    let direction = cluster.direction.as_str();
    let points: Vec<[f64; 2]> = cluster.errors.iter().map(millimetres).collect();
    let centre = millimetres(&cluster.centre_of_gravity);
    let hollow = stage.is_before();
    let line = stage.tone(look::of_direction(direction));
    // Rings and words need all of a colour.
    let colour = if hollow { look::of_direction(direction) } else { line };

    let place = points.iter().map(|&point| at(point));
    let discs = Points2D::new(place.clone()).with_radii([look::points(7.0)]).with_colors([colour]);
    stream.fixed(root.child("runs"), &discs.with_draw_order(20.0));
    if hollow {
        let holes = Points2D::new(place).with_radii([look::points(4.0)]).with_colors([PAPER]);
        stream.fixed(root.child("runs").child("hollow"), &holes.with_draw_order(21.0));
    }
    let mut thin = vec![strip([[0.0, 0.0], centre])];
    if points.len() >= 3 {
        thin.push(ellipse(&points, centre));
    }
    let thin = LineStrips2D::new(thin).with_radii([look::points(1.0)]).with_colors([line]).with_draw_order(10.0);
    stream.fixed(root.child("spread"), &thin);

    let arm = 0.7 * size;
    let mut lines = vec![
        strip([[centre[0] - arm, centre[1]], [centre[0] + arm, centre[1]]]),
        strip([[centre[0], centre[1] - arm], [centre[0], centre[1] + arm]]),
    ];
    let words = format!("{direction} {:.0} mm", centre[0].hypot(centre[1]));
    let (anchor, align) = if stage.index == 0 {
        let up = if centre[1] < 0.0 { -1.0 } else { 1.0 };
        ([centre[0], centre[1] + up * 2.2 * size], 0.5)
    } else {
        let up = aside[1] * 1.7 * stage.index as f64;
        ([aside[0] * 1.5 * size, up * size], 0.5 - 0.5 * aside[0])
    };
    lines.extend(lettering::lines(&words, anchor, size, align).into_iter().map(strip));
    let lines = LineStrips2D::new(lines).with_radii([look::points(2.0)]).with_colors([colour]).with_draw_order(30.0);
    stream.fixed(root.child("centre_of_gravity"), &lines);
}

/// What a plot shows \[mm\].
struct Bounds {
    least: [f64; 2],
    greatest: [f64; 2],
}

impl Bounds {
    fn of(clusters: &[EndPoints]) -> Bounds {
        let mut bounds = Bounds { least: [0.0; 2], greatest: [0.0; 2] };
        for cluster in clusters {
            for point in cluster.errors.iter().chain([&cluster.centre_of_gravity]).map(millimetres) {
                for (axis, value) in point.into_iter().enumerate() {
                    bounds.least[axis] = bounds.least[axis].min(value);
                    bounds.greatest[axis] = bounds.greatest[axis].max(value);
                }
            }
        }
        bounds
    }

    /// The longer edge.
    fn reach(&self) -> f64 {
        (0..2).map(|axis| self.greatest[axis] - self.least[axis]).fold(1.0, f64::max)
    }

    /// On which side of the y axis there is less: −1 or 1.
    fn empty_side(&self) -> f64 {
        if self.least[0] + self.greatest[0] < 0.0 { 1.0 } else { -1.0 }
    }

    /// Height of letters.
    fn letters(&self) -> f64 {
        0.035 * self.reach()
    }
}

/// Axes through the origin, with ticks and words.
fn axes(stream: &Stream, root: &Path, bounds: &Bounds) {
    let step = nice_step(bounds.reach() / 4.0);
    let size = bounds.letters();
    let margin = 4.0 * size;
    let (least, greatest) = (bounds.least.map(|value| value - margin), bounds.greatest.map(|value| value + margin));
    let mut lines = vec![strip([[least[0], 0.0], [greatest[0], 0.0]]), strip([[0.0, least[1]], [0.0, greatest[1]]])];
    // Numbers stand on the side of an axis where there are fewer points, names opposite, at the far end.
    let beside_y = bounds.empty_side();
    for axis in 0..2 {
        let on_axis = |along: f64, beside: f64| if axis == 0 { [along, beside] } else { [beside, along] };
        for count in (least[axis] / step).ceil() as i64..=(greatest[axis] / step).floor() as i64 {
            let along = count as f64 * step;
            lines.push(strip([on_axis(along, -0.35 * size), on_axis(along, 0.35 * size)]));
            let free = if axis == 0 { true } else { greatest[1] - along > 2.5 * size };
            if count != 0 && free {
                let (beside, align) =
                    if axis == 0 { (-1.7 * size, 0.5) } else { (beside_y * 1.2 * size, 0.5 - 0.5 * beside_y) };
                let text = along.to_string();
                lines.extend(lettering::lines(&text, on_axis(along, beside), size, align).into_iter().map(strip));
            }
        }
    }
    let x_end = if beside_y > 0.0 { (least[0], 0.0) } else { (greatest[0], 1.0) };
    let names = [("x [mm]", [x_end.0, 1.6 * size], x_end.1)].into_iter().chain([(
        "y [mm]",
        [beside_y * 1.2 * size, greatest[1] - 0.5 * size],
        0.5 - 0.5 * beside_y,
    )]);
    for (name, anchor, align) in names {
        lines.extend(lettering::lines(name, anchor, size, align).into_iter().map(strip));
    }
    let lines = LineStrips2D::new(lines).with_radii([look::points(1.25)]).with_colors([INK]).with_draw_order(1.0);
    stream.fixed(root.child("axes"), &lines);
    // The viewer leaves no margin around what it shows.
    let (least, greatest) = (least.map(|value| value - size), greatest.map(|value| value + size));
    let frame = [least, [greatest[0], least[1]], greatest, [least[0], greatest[1]], least];
    let frame = LineStrips2D::new([strip(frame)]).with_radii([look::points(0.5)]).with_colors([PAPER]);
    stream.fixed(root.child("margin"), &frame.with_draw_order(0.0));
}

/// 1, 2 or 5 times a power of ten, not less than `least`.
pub(super) fn nice_step(least: f64) -> f64 {
    let decade = 10f64.powf(least.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|digit| digit * decade).into_iter().find(|&step| step >= least).unwrap_or(least)
}

/// Two standard deviations of the points about `centre`, along their principal axes.
fn ellipse(points: &[[f64; 2]], centre: [f64; 2]) -> LineStrip2D {
    let mut covariance = nalgebra::Matrix2::zeros();
    for point in points {
        let off = nalgebra::Vector2::new(point[0] - centre[0], point[1] - centre[1]);
        covariance += off * off.transpose() / (points.len() - 1) as f64;
    }
    let axes = covariance.symmetric_eigen();
    let half = axes.eigenvalues.map(|variance| 2.0 * variance.max(0.0).sqrt());
    LineStrip2D::from_iter((0..=48).map(|step| {
        let (sin, cos) = (TAU * f64::from(step) / 48.0).sin_cos();
        let off = axes.eigenvectors * nalgebra::Vector2::new(half.x * cos, half.y * sin);
        at([centre[0] + off.x, centre[1] + off.y])
    }))
}

fn millimetres(point: &[f64; 2]) -> [f64; 2] {
    point.map(|metres| 1e3 * metres)
}

/// The viewer's y points down the screen.
fn at([x, y]: [f64; 2]) -> [f32; 2] {
    [x as f32, -y as f32]
}

fn strip(points: impl IntoIterator<Item = [f64; 2]>) -> LineStrip2D {
    LineStrip2D::from_iter(points.into_iter().map(at))
}
