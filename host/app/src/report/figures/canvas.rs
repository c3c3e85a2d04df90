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
use crate::text::visible;
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

/// Chucks and their poses, in turn; on a light page and on a dark one.
pub(in crate::report) const CHUCKS: [(RGBColor, RGBColor); 6] = [
    (RGBColor(0x2B, 0x6C, 0xB0), RGBColor(0x6F, 0xB1, 0xF5)),
    (RGBColor(0xB7, 0x54, 0x1B), RGBColor(0xF5, 0x9A, 0x5A)),
    (RGBColor(0x2F, 0x7D, 0x4F), RGBColor(0x6C, 0xCB, 0x93)),
    (RGBColor(0x8E, 0x3B, 0x8A), RGBColor(0xD9, 0x8B, 0xD5)),
    (RGBColor(0x8A, 0x6D, 0x1D), RGBColor(0xD9, 0xBB, 0x5A)),
    (RGBColor(0x3B, 0x3F, 0xA0), RGBColor(0x9A, 0x9D, 0xF0)),
];
/// Each other colour's counterpart on a dark page.
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
/// What a letter of that size takes at most, about.
const LETTER: u32 = 18;
/// Longer names are cut in figures; tables and data have them whole.
const LONGEST_NAME: usize = 14;
const LINE: u32 = 4;
const DOT: u32 = 4;
const FEW: usize = 100;
/// Of a line; a figure is not many more units wide.
const MOST_CORNERS: usize = 1500;
/// Labels of powers of ten that an axis has room for.
const MOST_POWERS: f64 = 8.0;

/// Style rules that turn the colours of the figures into those of a dark page.
pub(in crate::report) fn dark_rules() -> String {
    let rule = |(light, dark): &(RGBColor, RGBColor)| {
        let (light, dark) = (hex(*light), hex(*dark));
        format!("svg [fill=\"{light}\"]{{fill:{dark}}}svg [stroke=\"{light}\"]{{stroke:{dark}}}")
    };
    DARK.iter().chain(&CHUCKS).map(rule).collect()
}

/// As style sheets and the library write it.
pub(in crate::report) fn hex(RGBColor(r, g, b): RGBColor) -> String {
    format!("#{r:02X}{g:02X}{b:02X}")
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
    let style = format!(
        "<style>rect{{shape-rendering:crispEdges}}@media screen and (prefers-color-scheme:dark){{{}}}</style>",
        dark_rules()
    );
    Ok(visible(&svg).replacen(">\n", &format!(">\n{style}\n"), 1))
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
    /// The label at a value, of which `every` how many-th name has room.
    fn label(&self, value: f64, every: usize) -> String {
        let whole = value.round();
        let is_whole = (value - whole).abs() < 1e-6;
        match self.labels {
            Labels::Numbers => number_label(value, self.range.end - self.range.start),
            Labels::Powers if is_whole && (-3.0..=4.0).contains(&whole) => fixed(10_f64.powf(whole), (-whole).max(0.0) as usize),
            Labels::Powers if is_whole => format!("1e{whole}"),
            Labels::Names(names) if is_whole && whole >= 0.0 && (whole as usize).is_multiple_of(every) => {
                names.get(whole as usize).map(|name| shortened(name)).unwrap_or_default()
            }
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

    /// Width of the widest label, about.
    fn label_width(&self) -> u32 {
        let letters = match self.labels {
            Labels::Numbers | Labels::Powers => {
                [self.range.start, self.range.end].map(|end| self.label(end, 1).chars().count()).into_iter().max()
            }
            Labels::Names(names) => names.iter().map(|name| shortened(name).chars().count()).max(),
        };
        LETTER * letters.unwrap_or_default() as u32
    }

    /// How many-th name is written, so that they do not meet along a side of that length.
    fn every(&self, side: u32, each: u32) -> usize {
        match self.labels {
            Labels::Names(names) => (names.len() as u32 * each).div_ceil(side.max(1)).max(1) as usize,
            Labels::Numbers | Labels::Powers => 1,
        }
    }
}

fn number_label(value: f64, range: f64) -> String {
    const MOST_DECIMALS: f64 = 3.0;
    let decimals = -(range / 8.0).log10().floor();
    if decimals <= MOST_DECIMALS {
        return fixed(value, decimals.max(0.0) as usize);
    }
    if value.abs() < range * 1e-6 { "0".to_owned() } else { format!("{value:.1e}").replace(".0e", "e") }
}

/// A name that fits into a figure.
pub(super) fn shortened(name: &str) -> String {
    if name.chars().count() <= LONGEST_NAME {
        return name.to_owned();
    }
    name.chars().take(LONGEST_NAME - 1).chain(['…']).collect()
}

/// What a number below an axis takes, and the space around it.
const ROOM_OF_LABEL: u32 = 130;
const MARGIN_TOP: u32 = 20;
const MARGIN_RIGHT: u32 = 40;
const MARGIN_LEFT: u32 = 6;
const MARGIN_BOTTOM: u32 = 4;
/// What the library takes for one line of that size above a chart.
const CAPTION: u32 = 35;

/// What the labels of a chart take at its left, title included, and below it.
fn label_areas(y: &Axis<'_>) -> (u32, u32) {
    let title = if y.title.is_empty() { 0 } else { TEXT + 12 };
    (y.label_width().max(3 * LETTER) + title + 14, 84)
}

/// Width and height that a chart with this axis at its left needs around the part that it draws in.
pub(super) fn frame(y: &Axis<'_>, has_caption: bool) -> (u32, u32) {
    let (left, below) = label_areas(y);
    let caption = if has_caption { CAPTION } else { 0 };
    (left + MARGIN_LEFT + MARGIN_RIGHT, below + MARGIN_TOP + MARGIN_BOTTOM + caption)
}

/// Axes with a grid, on an area.
pub(super) fn chart<'b>(area: &Area<'b>, caption: &str, x: &Axis<'_>, y: &Axis<'_>) -> Result<Chart<'b>, Failure> {
    let text = || ("sans-serif", TEXT).into_font().color(&INK);
    let mut builder = ChartBuilder::on(area);
    let (width, height) = area.dim_in_pixel();
    let (left, below) = label_areas(y);
    builder.margin_top(MARGIN_TOP).margin_right(MARGIN_RIGHT).margin_left(MARGIN_LEFT).margin_bottom(MARGIN_BOTTOM);
    builder.x_label_area_size(below).y_label_area_size(left);
    let every_x = x.every(width.saturating_sub(left + MARGIN_LEFT + MARGIN_RIGHT), x.label_width() + LETTER / 2);
    let every_y = y.every(height.saturating_sub(below + MARGIN_TOP + MARGIN_BOTTOM), TEXT + 4);
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
        .x_labels(x.count((width / ROOM_OF_LABEL).clamp(3, 7) as usize))
        .y_labels(y.count(6))
        .x_label_formatter(&|value| x.label(*value, every_x))
        .y_label_formatter(&|value| y.label(*value, every_y))
        .x_desc(x.title)
        .y_desc(y.title)
        .draw()?;
    Ok(chart)
}

/// Dots that add up where they meet; few are drawn larger and darker, so that they are seen.
pub(super) fn dots(chart: &mut Chart<'_>, colour: RGBColor, points: impl IntoIterator<Item = (f64, f64)>) -> Result<(), Failure> {
    let points: Vec<(f64, f64)> = points.into_iter().collect();
    let (size, shade) = if points.len() < FEW { (DOT + 2, 0.8) } else { (DOT, 0.55) };
    chart.draw_series(points.into_iter().map(|point| Circle::new(point, size, colour.mix(shade).filled())))?;
    Ok(())
}

/// A line through points, or through some of very many; where there is only one, a dot.
pub(super) fn line(chart: &mut Chart<'_>, colour: RGBColor, points: impl IntoIterator<Item = (f64, f64)>) -> Result<(), Failure> {
    let points: Vec<(f64, f64)> = points.into_iter().collect();
    if points.len() == 1 {
        return dots(chart, colour, points);
    }
    let (every, last) = (points.len().div_ceil(MOST_CORNERS).max(1), points.len().saturating_sub(1));
    let corners = points.into_iter().enumerate().filter(|(i, _)| i % every == 0 || *i == last).map(|(_, point)| point);
    chart.draw_series(LineSeries::new(corners, colour.stroke_width(LINE)))?;
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
