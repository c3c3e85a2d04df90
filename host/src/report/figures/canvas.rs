//! What all figures share: colours, sizes, axes.
//!
//! Figures are drawn in the colours of light pages. Style sheets outrank SVG's colour attributes, so [`dark_rules`] turns them
//! into those of dark pages without touching the drawing.

use std::ops::Range;

use plotters::chart::ChartContext;
use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;

use super::FigureError;
use crate::units::fixed;

pub(super) type Area<'b> = DrawingArea<SVGBackend<'b>, Shift>;
pub(super) type Chart<'b> = ChartContext<'b, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
pub(super) type Failure = DrawingAreaErrorKind<std::io::Error>;

/// Axes and their labels.
pub(super) const INK: RGBColor = RGBColor(0x44, 0x4A, 0x50);
const GRID: RGBColor = RGBColor(0xDD, 0xE1, 0xE5);
/// What the design predicts.
pub(super) const BEFORE: RGBColor = RGBColor(0xC2, 0x57, 0x1A);
/// What the fit predicts.
pub(super) const AFTER: RGBColor = RGBColor(0x1F, 0x6F, 0xB2);
/// A theory or mean over data.
pub(super) const CURVE: RGBColor = RGBColor(0x11, 0x13, 0x15);

/// Each colour's counterpart on a dark page.
const DARK: [(RGBColor, RGBColor); 5] = [
    (INK, RGBColor(0xB6, 0xBE, 0xC6)),
    (GRID, RGBColor(0x33, 0x3A, 0x41)),
    (BEFORE, RGBColor(0xF0, 0x92, 0x4C)),
    (AFTER, RGBColor(0x5A, 0xA9, 0xF0)),
    (CURVE, RGBColor(0xF4, 0xF5, 0xF6)),
];

/// Width of a figure, in units of which the page shows about two a pixel: the library draws at whole units only.
pub(super) const WIDTH: u32 = 960;
/// Height of a figure with one chart.
pub(super) const HEIGHT: u32 = 600;
const TEXT: u32 = 31;
const LINE: u32 = 4;
const DOT: u32 = 4;
/// Labels of powers of ten that an axis has room for.
const MOST_POWERS: f64 = 8.0;

/// Style rules that turn the colours of the figures into those of a dark page.
pub(in crate::report) fn dark_rules() -> String {
    let hex = |RGBColor(r, g, b): RGBColor| format!("#{r:02X}{g:02X}{b:02X}");
    let rule = |(light, dark): &(RGBColor, RGBColor)| {
        let (light, dark) = (hex(*light), hex(*dark));
        format!("svg [fill=\"{light}\"]{{fill:{dark}}}svg [stroke=\"{light}\"]{{stroke:{dark}}}")
    };
    DARK.iter().map(rule).collect()
}

/// Draws a figure; the SVG carries its own rules for dark pages.
pub(super) fn draw(
    figure: &'static str,
    size: (u32, u32),
    paint: impl FnOnce(&Area<'_>) -> Result<(), Failure>,
) -> Result<String, FigureError> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        let drawn = paint(&area).and_then(|()| area.present());
        drawn.map_err(|error| FigureError { figure, reason: error.to_string() })?;
    }
    let style = format!("<style>@media screen and (prefers-color-scheme:dark){{{}}}</style>", dark_rules());
    Ok(svg.replacen(">\n", &format!(">\n{style}\n"), 1))
}

/// One axis of a chart.
pub(super) struct Axis<'t> {
    pub(super) title: &'t str,
    pub(super) range: Range<f64>,
    pub(super) labels: Labels<'t>,
}

/// What stands at an axis.
#[derive(Clone, Copy)]
pub(super) enum Labels<'t> {
    /// The numbers.
    Numbers,
    /// Powers of ten, of which the axis has the exponents.
    Powers,
    /// Names, at 0, 1, 2 and so on.
    Names(&'t [String]),
}

impl Axis<'_> {
    fn label(&self, value: f64) -> String {
        let whole = value.round();
        let is_whole = (value - whole).abs() < 1e-6;
        match self.labels {
            Labels::Numbers => {
                let step = (self.range.end - self.range.start) / 8.0;
                fixed(value, (-step.log10().floor()).clamp(0.0, 9.0) as usize)
            }
            Labels::Powers if is_whole && (-3.0..=4.0).contains(&whole) => fixed(10_f64.powf(whole), (-whole).max(0.0) as usize),
            Labels::Powers if is_whole => format!("1e{whole}"),
            Labels::Names(names) if is_whole && whole >= 0.0 => names.get(whole as usize).cloned().unwrap_or_default(),
            Labels::Powers | Labels::Names(_) => String::new(),
        }
    }

    /// How many labels there may be.
    fn count(&self, room: usize) -> usize {
        match self.labels {
            Labels::Numbers => room,
            Labels::Powers => (self.range.end - self.range.start).ceil().clamp(1.0, MOST_POWERS) as usize + 1,
            Labels::Names(names) => names.len() + 1,
        }
    }
}

/// Axes with a grid, on an area.
pub(super) fn chart<'b>(area: &Area<'b>, caption: &str, x: &Axis<'_>, y: &Axis<'_>) -> Result<Chart<'b>, Failure> {
    let text = || ("sans-serif", TEXT).into_font().color(&INK);
    let mut builder = ChartBuilder::on(area);
    builder.margin_top(14).margin_right(34).margin_left(6).margin_bottom(4).x_label_area_size(84).y_label_area_size(112);
    if !caption.is_empty() {
        builder.caption(caption, text());
    }
    let mut chart = builder.build_cartesian_2d(x.range.clone(), y.range.clone())?;
    chart
        .configure_mesh()
        .max_light_lines(1)
        .bold_line_style(GRID.stroke_width(2))
        .axis_style(INK.stroke_width(2))
        .label_style(text())
        .axis_desc_style(text())
        .x_labels(x.count(7))
        .y_labels(y.count(6))
        .x_label_formatter(&|value| x.label(*value))
        .y_label_formatter(&|value| y.label(*value))
        .x_desc(x.title)
        .y_desc(y.title)
        .draw()?;
    Ok(chart)
}

/// Dots that add up where they meet.
pub(super) fn dots(chart: &mut Chart<'_>, colour: RGBColor, points: impl IntoIterator<Item = (f64, f64)>) -> Result<(), Failure> {
    chart.draw_series(points.into_iter().map(|point| Circle::new(point, DOT, colour.mix(0.55).filled())))?;
    Ok(())
}

/// A line through points.
pub(super) fn line(chart: &mut Chart<'_>, colour: RGBColor, points: impl IntoIterator<Item = (f64, f64)>) -> Result<(), Failure> {
    chart.draw_series(LineSeries::new(points, colour.stroke_width(LINE)))?;
    Ok(())
}

/// Words in a chart, from that point to the right.
pub(super) fn words(chart: &mut Chart<'_>, colour: RGBColor, at: (f64, f64), text: &str) -> Result<(), Failure> {
    let style = ("sans-serif", TEXT).into_font().color(&colour);
    chart.draw_series(std::iter::once(Text::new(text.to_owned(), at, style)))?;
    Ok(())
}

/// A range about zero that holds all values.
pub(super) fn about_zero(values: impl IntoIterator<Item = f64>) -> Range<f64> {
    let largest = values.into_iter().fold(0.0, |largest: f64, value| largest.max(value.abs())).max(1e-6) * 1.08;
    -largest..largest
}

/// Whole powers of ten around all values above zero, as exponents; `smallest` where there is none.
pub(super) fn decades(values: impl IntoIterator<Item = f64>, smallest: f64) -> Range<f64> {
    let logs: Vec<f64> = values.into_iter().map(|value| value.max(smallest).log10()).collect();
    let low = logs.iter().copied().fold(f64::INFINITY, f64::min).min(300.0).floor();
    let high = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max).max(low).ceil();
    low..high.max(low + 1.0)
}
