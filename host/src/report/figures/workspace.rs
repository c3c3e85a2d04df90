//! Predicted tool error over the workspace before and after, as slices.

use plotters::prelude::{Color, RGBColor, Rectangle, ViridisRGB};

use super::canvas::{Area, Axis, Failure, Labels, WIDTH, chart, decades, draw};
use super::table::{Table, number};
use super::{Figure, FigureError};
use crate::report::facts::Facts;
use crate::report::workspace::{Slice, WorkspacePoint};
use crate::units::mm_from_m;

const NAME: &str = "workspace";
const CELLS: usize = 28;
const PANEL: u32 = 800;
const SCALE_HEIGHT: u32 = 170;
/// A tenth of a micrometre; what is below has the lowest colour.
const SMALLEST_MM: f64 = 1e-4;

/// One cell of a slice: its middle, and the RMS errors within it.
struct Cell {
    at_m: (f64, f64),
    half_m: (f64, f64),
    before_mm: f64,
    after_mm: f64,
}

pub(super) fn figure(facts: &Facts) -> Result<Option<Figure>, FigureError> {
    let slices = [(Slice::Side, "x, m", "z, m", "side"), (Slice::Top, "x, m", "y, m", "top")];
    let slices = slices.map(|(slice, x, y, name)| (cells(facts.workspace.points(slice), slice), x, y, name));
    if slices.iter().any(|(cells, ..)| cells.is_empty()) {
        return Ok(None);
    }
    let all = || slices.iter().flat_map(|(cells, ..)| cells);
    let range = decades(all().flat_map(|cell| [cell.before_mm, cell.after_mm]), SMALLEST_MM);
    let colour = |mm: f64| colour_of((mm.max(SMALLEST_MM).log10() - range.start) / (range.end - range.start));

    let svg = draw(NAME, (2 * WIDTH, 2 * PANEL + SCALE_HEIGHT), |area| {
        let (maps, scale) = area.split_vertically(2 * PANEL);
        let panels = maps.split_evenly((2, 2));
        for (line, (cells, x, y, name)) in slices.iter().enumerate() {
            let captions = [format!("before, from the {name}"), format!("after, from the {name}")];
            map(&panels[2 * line], &captions[0], (x, y), cells, |cell| colour(cell.before_mm))?;
            map(&panels[2 * line + 1], &captions[1], (x, y), cells, |cell| colour(cell.after_mm))?;
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
    let sentence = format!(
        "Darker is better, on one logarithmic scale: {:.2} mm RMS between the design's tool and the fit's before, {:.3} mm after as the \
         noise of the lengths alone would leave it.",
        rms(|cell| cell.before_mm),
        rms(|cell| cell.after_mm)
    );
    Ok(Some(Figure { name: NAME, title: "Error of the tool over the workspace", sentence, svg, data, wide: true }))
}

fn map(
    area: &Area<'_>,
    caption: &str,
    (x_title, y_title): (&str, &str),
    cells: &[Cell],
    colour: impl Fn(&Cell) -> RGBColor,
) -> Result<(), Failure> {
    // The same metres a unit both ways would leave most of a panel empty; the axes say what is what.
    let bound = |of: fn(&Cell) -> (f64, f64)| {
        cells.iter().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |all, (low, high)| (all.0.min(low), all.1.max(high)))
    };
    let (left, right) = bound(|cell| (cell.at_m.0 - cell.half_m.0, cell.at_m.0 + cell.half_m.0));
    let (low, high) = bound(|cell| (cell.at_m.1 - cell.half_m.1, cell.at_m.1 + cell.half_m.1));
    let x = Axis { title: x_title, range: left..right, labels: Labels::Numbers };
    let y = Axis { title: y_title, range: low..high, labels: Labels::Numbers };
    chart(area, caption, &x, &y)?.draw_series(cells.iter().map(|cell| {
        let Cell { at_m: (x, y), half_m: (half_x, half_y), .. } = *cell;
        Rectangle::new([(x - half_x, y + half_y), (x + half_x, y - half_y)], colour(cell).filled())
    }))?;
    Ok(())
}

fn colour_of(share: f64) -> RGBColor {
    ViridisRGB::get_color(share.clamp(0.0, 1.0))
}

fn cells(points: &[WorkspacePoint], slice: Slice) -> Vec<Cell> {
    let flat = |point: &WorkspacePoint| match slice {
        Slice::Side => (point.position_m.x, point.position_m.z),
        Slice::Top => (point.position_m.x, point.position_m.y),
    };
    let bounds = |of: fn((f64, f64)) -> f64| {
        let values = points.iter().map(|point| of(flat(point)));
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
    };
    let (x, y) = (bounds(|at| at.0), bounds(|at| at.1));
    let size = |(low, high): (f64, f64)| ((high - low) / CELLS as f64).max(1e-9);
    let (width_m, height_m) = (size(x), size(y));
    let index = |value: f64, low: f64, step: f64| (((value - low) / step) as usize).min(CELLS - 1);

    let mut sums = vec![(0.0, 0.0, 0_u32); CELLS * CELLS];
    for point in points {
        let (at_x, at_y) = flat(point);
        let sum = &mut sums[index(at_y, y.0, height_m) * CELLS + index(at_x, x.0, width_m)];
        *sum = (sum.0 + point.before_m.powi(2), sum.1 + point.after_m.powi(2), sum.2 + 1);
    }
    let cell = |(i, &(before, after, count)): (usize, &(f64, f64, u32))| {
        let middle = |number: usize, low: f64, step: f64| low + (number as f64 + 0.5) * step;
        let rms_mm = |square: f64| mm_from_m((square / f64::from(count)).sqrt());
        (count > 0).then(|| Cell {
            at_m: (middle(i % CELLS, x.0, width_m), middle(i / CELLS, y.0, height_m)),
            half_m: (width_m / 2.0, height_m / 2.0),
            before_mm: rms_mm(before),
            after_mm: rms_mm(after),
        })
    };
    sums.iter().enumerate().filter_map(cell).collect()
}
