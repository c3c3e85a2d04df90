//! Predicted tool error over the workspace before and after, as slices.

use std::collections::BTreeMap;
use std::ops::Range;

use plotters::prelude::{Color, RGBColor, Rectangle, ViridisRGB};

use super::canvas::{Area, Axis, Failure, Labels, WIDTH, chart, decades, draw, frame};
use super::table::{Table, number};
use super::{Figure, FigureError, Frame};
use crate::report::facts::Facts;
use crate::report::workspace::{Slice, WorkspacePoint};
use crate::units::{fixed, mm_from_m};

const FRAME: Frame = Frame { name: "workspace", title: "Error of the tool over the workspace", wide: true };
/// Cells along the longest side.
const CELLS: f64 = 30.0;
/// The flattest that a slice is drawn.
const MOST_FLAT: f64 = 120.0;
/// The tallest that a slice is drawn.
const TALLEST: f64 = 860.0;
const SCALE_HEIGHT: u32 = 170;
/// A tenth of a micrometre; what is below has the lowest colour.
const SMALLEST_MM: f64 = 1e-4;

/// One square cell of a slice: its middle, and the RMS errors within it.
struct Cell {
    at_m: (f64, f64),
    before_mm: f64,
    after_mm: f64,
}

/// What a slice spans across and upwards, metres.
#[derive(Clone)]
struct Bounds {
    across_m: Range<f64>,
    up_m: Range<f64>,
}

impl Bounds {
    fn of(points: &[WorkspacePoint], slice: Slice) -> Self {
        let around = |of: fn((f64, f64)) -> f64| {
            let values = points.iter().map(|point| of(flat(point, slice)));
            let (low, high) =
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
            low..high
        };
        Self { across_m: around(|at| at.0), up_m: around(|at| at.1) }
    }

    fn largest_m(&self) -> f64 {
        length(&self.across_m).max(length(&self.up_m)).max(1e-6)
    }
}

fn length(range: &Range<f64>) -> f64 {
    range.end - range.start
}

/// A range about the same middle.
fn widened(range: &Range<f64>, to: f64) -> Range<f64> {
    let middle = f64::midpoint(range.start, range.end);
    middle - to / 2.0..middle + to / 2.0
}

pub(super) fn figure(facts: &Facts) -> Result<Figure, FigureError> {
    let at = [
        format!("about y = {} m", fixed(facts.workspace.side_y_m, 2)),
        format!("about z = {} m", fixed(facts.workspace.top_z_m, 2)),
    ];
    let slices = [(Slice::Side, "x, m", "z, m", "side"), (Slice::Top, "x, m", "y, m", "top")];
    if slices.iter().any(|(slice, ..)| facts.workspace.points(*slice).is_empty()) {
        return Ok(FRAME.missing("Not drawn: none of the joint vectors within the limits brings the tool into the slices."));
    }
    let bounds = slices.map(|(slice, ..)| Bounds::of(facts.workspace.points(slice), slice));
    let cell_m = bounds.iter().map(Bounds::largest_m).fold(0.0, f64::max) / CELLS;
    let slices = slices.map(|(slice, x, y, name)| (cells(facts.workspace.points(slice), slice, cell_m), x, y, name));
    let all = || slices.iter().flat_map(|(cells, ..)| cells);
    let range = decades(all().flat_map(|cell| [cell.before_mm, cell.after_mm]), SMALLEST_MM);
    let colour = |mm: f64| colour_of((mm.max(SMALLEST_MM).log10() - range.start) / (range.end - range.start));

    let layout = Layout::new(&bounds, cell_m);
    let height: u32 = layout.heights.iter().sum();
    let svg = draw(FRAME.name, (2 * WIDTH, height + SCALE_HEIGHT), |area| {
        let (maps, scale) = area.split_vertically(height);
        let (side, top) = maps.split_vertically(layout.heights[0]);
        for (line, (slice, (cells, x, y, _))) in [side, top].iter().zip(&slices).enumerate() {
            let panels = slice.split_evenly((1, 2));
            let captions = [format!("before, {}", at[line]), format!("after, {}", at[line])];
            let axes = layout.axes(line, &bounds[line], (x, y));
            map(&panels[0], &captions[0], &axes, cells, cell_m, |cell| colour(cell.before_mm))?;
            map(&panels[1], &captions[1], &axes, cells, cell_m, |cell| colour(cell.after_mm))?;
        }
        let x = Axis { title: "RMS error of the tool's position, mm", range: range.clone(), labels: Labels::Powers };
        let none: [String; 0] = [];
        let mut chart = chart(&scale, "", &x, &Axis { title: "", range: 0.0..1.0, labels: Labels::Names(&none) })?;
        let step = (range.end - range.start) / 100.0;
        chart.draw_series((0..100).map(|i| {
            let from = range.start + f64::from(i) * step;
            Rectangle::new([(from, 1.0), (from + step, 0.0)], colour_of((f64::from(i) + 0.5) / 100.0).filled())
        }))?;
        Ok(())
    })?;
    let mut data = Table::new(["slice", "x_mm", "y_or_z_mm", "before_mm", "after_mm"]);
    for (cells, _, _, name) in &slices {
        for Cell { at_m, before_mm, after_mm, .. } in cells {
            let [x, y, before, after] = [mm_from_m(at_m.0), mm_from_m(at_m.1), *before_mm, *after_mm].map(number);
            data.row([(*name).to_owned(), x, y, before, after]);
        }
    }
    let rms = |of: fn(&Cell) -> f64| (all().map(|cell| of(cell).powi(2)).sum::<f64>() / all().count() as f64).sqrt();
    let untold = facts.independent.saturating_sub(facts.told);
    let least = match untold {
        0 => "as the noise of the lengths alone would leave it".to_owned(),
        _ => format!("at least: by noise alone, without the {untold} parameters that these poses do not tell"),
    };
    let sentence = format!(
        "Darker is better, on one logarithmic scale: {:.2} mm RMS between the design's tool and the fit's before, {:.3} mm after, {least}.",
        rms(|cell| cell.before_mm),
        rms(|cell| cell.after_mm)
    );
    Ok(FRAME.drawn(svg, data, sentence))
}

/// One scale for both directions and all panels, in units of the drawing a metre.
struct Layout {
    scale: f64,
    heights: [u32; 2],
}

impl Layout {
    fn new(bounds: &[Bounds; 2], cell_m: f64) -> Self {
        let frames = bounds.each_ref().map(|bounds| frame(&axis("z, m", &bounds.up_m), true));
        let across = f64::from(WIDTH - frames[0].0.max(frames[1].0));
        let room_m = |range: &Range<f64>| length(range) + 2.0 * cell_m;
        let widest_m = bounds.iter().map(|bounds| room_m(&bounds.across_m)).fold(0.0, f64::max);
        let highest_m = bounds.iter().map(|bounds| room_m(&bounds.up_m)).fold(0.0, f64::max);
        let scale = (across / widest_m).min(TALLEST / highest_m);
        let height = |i: usize| (room_m(&bounds[i].up_m) * scale).max(MOST_FLAT) as u32 + frames[i].1;
        Self { scale, heights: [height(0), height(1)] }
    }

    fn axes<'t>(&self, line: usize, bounds: &Bounds, (x, y): (&'t str, &'t str)) -> (Axis<'t>, Axis<'t>) {
        let around = frame(&axis(y, &bounds.up_m), true).1;
        let up = axis(y, &widened(&bounds.up_m, f64::from(self.heights[line] - around) / self.scale));
        // Labels differ in width: what they leave of the panel decides how many metres it shows across.
        let across = f64::from(WIDTH - frame(&up, true).0);
        (axis(x, &widened(&bounds.across_m, across / self.scale)), up)
    }
}

fn axis<'t>(title: &'t str, range: &Range<f64>) -> Axis<'t> {
    Axis { title, range: range.clone(), labels: Labels::Numbers }
}

fn map(
    area: &Area<'_>,
    caption: &str,
    (x, y): &(Axis<'_>, Axis<'_>),
    cells: &[Cell],
    cell_m: f64,
    colour: impl Fn(&Cell) -> RGBColor,
) -> Result<(), Failure> {
    chart(area, caption, x, y)?.draw_series(cells.iter().map(|cell| {
        let (x, y) = cell.at_m;
        let half_m = cell_m / 2.0;
        Rectangle::new([(x - half_m, y + half_m), (x + half_m, y - half_m)], colour(cell).filled())
    }))?;
    Ok(())
}

fn colour_of(share: f64) -> RGBColor {
    ViridisRGB::get_color(share.clamp(0.0, 1.0))
}

fn flat(point: &WorkspacePoint, slice: Slice) -> (f64, f64) {
    match slice {
        Slice::Side => (point.position_m.x, point.position_m.z),
        Slice::Top => (point.position_m.x, point.position_m.y),
    }
}

/// The cells that hold points, on a grid with a corner at zero.
fn cells(points: &[WorkspacePoint], slice: Slice, cell_m: f64) -> Vec<Cell> {
    let mut sums: BTreeMap<(i64, i64), (f64, f64, u32)> = BTreeMap::new();
    for point in points {
        let (x, y) = flat(point, slice);
        let index = |value: f64| (value / cell_m).floor() as i64;
        let sum = sums.entry((index(x), index(y))).or_default();
        *sum = (sum.0 + point.before_m.powi(2), sum.1 + point.after_m.powi(2), sum.2 + 1);
    }
    let cell = |((x, y), (before, after, count)): ((i64, i64), (f64, f64, u32))| {
        let middle = |index: i64| (index as f64 + 0.5) * cell_m;
        let rms_mm = |square: f64| mm_from_m((square / f64::from(count)).sqrt());
        Cell { at_m: (middle(x), middle(y)), before_mm: rms_mm(before), after_mm: rms_mm(after) }
    };
    sums.into_iter().map(cell).collect()
}
