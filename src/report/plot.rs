//! Figures in SVG.

use crate::experiment::certify::{Curve, Sweeps};
use plotters::coord::Shift;
use plotters::prelude::*;

type Failure = DrawingAreaErrorKind<std::io::Error>;

/// A figure that could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("the figure cannot be drawn: {0}")]
pub struct PlotError(#[from] Failure);

/// One panel: what is plotted over what.
#[derive(Debug, Clone, Copy)]
pub struct Panel<'a> {
    /// Above it.
    pub title: &'a str,
    /// Of the horizontal axis.
    pub over: &'a str,
    /// Curves with their names.
    pub curves: &'a [(&'a str, Curve)],
    /// b_eff/b of the closed form, drawn as a level line.
    pub theory: f64,
}

const COLOURS: [RGBColor; 5] = [
    RGBColor(31, 119, 180),
    RGBColor(214, 85, 39),
    RGBColor(44, 140, 80),
    RGBColor(130, 90, 170),
    RGBColor(150, 110, 40),
];
const GREY: RGBColor = RGBColor(120, 120, 120);
const SIZE: (u32, u32) = (460, 400);

/// Effective track against turn radius, load offset and friction ratio, side by side.
///
/// # Errors
/// It cannot be drawn.
pub fn sweeps(sweeps: &Sweeps) -> Result<String, PlotError> {
    let curve = |curve: &Curve| [("simulated", curve.clone())];
    let (radius, offset, ratio) =
        (curve(&sweeps.turn_radius), curve(&sweeps.load_offset), curve(&sweeps.friction_ratio));
    let panel = |title, over, curves| Panel { title, over, curves, theory: sweeps.theory_factor };
    let mut panels = vec![panel("Turn radius", "radius of the turn over effective track [–]", &radius)];
    if !sweeps.load_offset.is_empty() {
        panels.push(panel("Load offset", "mass centre ahead of the middle, over wheelbase [–]", &offset));
    }
    panels.push(panel("Friction", "friction across over along [–]", &ratio));
    figure(&format!("{}: effective track over track", sweeps.robot), &panels)
}

/// Panels side by side under a title, as the text of an SVG file.
///
/// # Errors
/// It cannot be drawn.
pub fn figure(title: &str, panels: &[Panel<'_>]) -> Result<String, PlotError> {
    let mut svg = String::new();
    let size = (SIZE.0 * panels.len() as u32, SIZE.1);
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let below = root.titled(title, ("sans-serif", 20))?;
        for (area, panel) in below.split_evenly((1, panels.len())).iter().zip(panels) {
            draw(area, panel)?;
        }
        root.present()?;
    }
    Ok(svg)
}

fn draw(area: &DrawingArea<SVGBackend<'_>, Shift>, panel: &Panel<'_>) -> Result<(), Failure> {
    let points = || panel.curves.iter().flat_map(|(_, curve)| curve.iter().copied());
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        let margin = (0.06 * (high - low)).max(1e-3);
        low - margin..high + margin
    };
    let across = range(&mut points().map(|(x, _)| x));
    let up = range(&mut points().map(|(_, y)| y).chain([panel.theory]));
    // Room for the legend above the curves.
    let up = up.start..up.end + (0.09 * panel.curves.len() as f64 + 0.12) * (up.end - up.start);
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .caption(panel.title, ("sans-serif", 16))
        .x_label_area_size(42)
        .y_label_area_size(58)
        .build_cartesian_2d(across.clone(), up)?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .x_desc(panel.over)
        .y_desc("b_eff / b [–]")
        .x_labels(6)
        .y_labels(6)
        .x_label_formatter(&|value| format!("{}", (1e3 * value).round() / 1e3 + 0.0))
        .y_label_formatter(&|value| format!("{value:.3}"))
        .draw()?;
    chart
        .draw_series(LineSeries::new([(across.start, panel.theory), (across.end, panel.theory)], GREY))?
        .label("1 + (l/b)²")
        .legend(|(x, y)| PathElement::new([(x, y), (x + 16, y)], GREY));
    for ((name, curve), colour) in panel.curves.iter().zip(COLOURS.iter().cycle()) {
        chart
            .draw_series(LineSeries::new(curve.iter().copied(), colour.stroke_width(2)))?
            .label(*name)
            .legend(|(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2)));
        chart.draw_series(curve.iter().map(|point| Circle::new(*point, 3, colour.filled())))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .border_style(GREY)
        .draw()?;
    Ok(())
}
