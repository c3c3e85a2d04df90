//! The shells with their poses in space, as seen at first; `scene.js` turns the same points and lines on the page.

use ballbar::Vector3;
use plotters::prelude::{Circle, Color, IntoFont, PathElement, Rectangle, Text};

use super::canvas::{CHUCKS, HEIGHT, INK, WIDTH, draw, shortened};
use super::table::{Table, number};
use super::thin::{drawn, drawn_words};
use super::{Figure, FigureError, Frame};
use crate::report::facts::{Facts, Shell};
use crate::units::mm_from_m;

const FRAME: Frame = Frame { name: "scene", title: "The shells and their poses", wide: true };
const SIZE: (u32, u32) = (2 * WIDTH, 2 * HEIGHT - 100);
/// The first view, radians; as in `scene.js`.
const TURN: f64 = 0.7;
const TILT: f64 = 0.45;
/// Of the drawing's height, from its middle to the farthest point.
const FILLED: f64 = 0.46;
const TEXT: u32 = 34;

pub(super) fn figure(facts: &Facts) -> Result<Figure, FigureError> {
    let view = View::of(facts);
    let largest_m = facts.rows.iter().fold(1e-12, |largest: f64, row| largest.max(row.after_m.abs()));
    let mut dots = drawn(facts);
    dots.sort_by(|&a, &b| view.depth(&facts.rows[b].sphere_m).total_cmp(&view.depth(&facts.rows[a].sphere_m)));
    let chuck_of = |row: usize| facts.pairings[facts.rows[row].pairing].1;
    let svg = draw(FRAME.name, SIZE, |area| {
        for shell in &facts.shells {
            for wire in wires_m(facts, shell) {
                let points: Vec<(i32, i32)> = wire.iter().map(|at| view.at(at)).collect();
                area.draw(&PathElement::new(points, CHUCKS[shell.chuck % CHUCKS.len()].0.mix(0.3).stroke_width(2)))?;
            }
        }
        for row in dots {
            let fact = &facts.rows[row];
            let size = 5.0 + 9.0 * fact.after_m.abs() / largest_m;
            let colour = CHUCKS[chuck_of(row) % CHUCKS.len()].0.mix(0.65);
            area.draw(&Circle::new(view.at(&fact.sphere_m), size as i32, colour.filled()))?;
        }
        for (i, (name, at)) in facts.chucks.iter().enumerate() {
            let (x, y) = view.at(at);
            area.draw(&Rectangle::new([(x - 11, y - 11), (x + 11, y + 11)], CHUCKS[i % CHUCKS.len()].0.filled()))?;
            area.draw(&Text::new(shortened(name), (x + 16, y - 40), ("sans-serif", TEXT).into_font().color(&INK)))?;
        }
        Ok(())
    })?;
    let mut data = Table::new(["row", "pairing", "x_mm", "y_mm", "z_mm", "residual_after_mm"]);
    for row in &facts.rows {
        let [x, y, z, after] = [row.sphere_m.x, row.sphere_m.y, row.sphere_m.z, row.after_m].map(|m| number(mm_from_m(m)));
        data.row([row.number.to_string(), facts.pairings[row.pairing].0.clone(), x, y, z, after]);
    }
    let shells = match facts.shells.as_slice() {
        [] => " No shells are drawn: the lengths about one chuck differ too much to lie on one.".to_owned(),
        shells => {
            let largest = shells.iter().fold(0.0, |largest: f64, shell| largest.max(shell.radius_m));
            format!(" The half spheres have the median length as radius, up to {:.0} mm.", mm_from_m(largest))
        }
    };
    let sentence = format!(
        "Each dot is the tool's sphere in one pose, by the fit, in the colour of its chuck and larger for a larger residual (up to \
         {:.3} mm): gaps are places that nothing was measured at.{shells}{}",
        mm_from_m(largest_m),
        drawn_words(facts)
    );
    Ok(FRAME.drawn(svg, data, sentence))
}

/// Lines of a half sphere about its chuck: parallels and meridians. Base frame, metres.
pub(in crate::report) fn wires_m(facts: &Facts, shell: &Shell) -> Vec<Vec<Vector3<f64>>> {
    const STEPS: u32 = 36;
    let centre_m = facts.chucks[shell.chuck].1;
    let at = |longitude: f64, latitude: f64| {
        let direction = Vector3::new(latitude.cos() * longitude.cos(), latitude.cos() * longitude.sin(), latitude.sin());
        centre_m + direction * shell.radius_m
    };
    let along = |length: f64| (0..=STEPS).map(move |step| length * f64::from(step) / f64::from(STEPS));
    let parallels =
        [0.0, 30.0, 60.0].map(|latitude: f64| along(std::f64::consts::TAU).map(|l| at(l, latitude.to_radians())).collect());
    let meridians = [0.0, 45.0, 90.0, 135.0]
        .map(|longitude: f64| along(std::f64::consts::PI).map(|l| at(longitude.to_radians(), l)).collect());
    parallels.into_iter().chain(meridians).collect()
}

/// From metres in the base frame to the drawing.
struct View {
    middle_m: Vector3<f64>,
    scale: f64,
}

impl View {
    /// All dots, chucks and shells within the drawing.
    fn of(facts: &Facts) -> Self {
        let wires: Vec<Vector3<f64>> = facts.shells.iter().flat_map(|shell| wires_m(facts, shell)).flatten().collect();
        let all = || facts.rows.iter().map(|row| &row.sphere_m).chain(facts.chucks.iter().map(|chuck| &chuck.1)).chain(&wires);
        let low = all().fold(Vector3::repeat(f64::INFINITY), |low, at| low.inf(at));
        let high = all().fold(Vector3::repeat(f64::NEG_INFINITY), |high, at| high.sup(at));
        let middle_m = (low + high) / 2.0;
        let reach_m = all().fold(1e-6, |reach: f64, at| reach.max((at - middle_m).norm()));
        Self { middle_m, scale: FILLED * f64::from(SIZE.1) / reach_m }
    }

    /// Right and away of the eye, and up.
    fn turned(&self, at: &Vector3<f64>) -> (f64, f64, f64) {
        let from = (at - self.middle_m) * self.scale;
        let (sin, cos) = TURN.sin_cos();
        (from.x * cos - from.y * sin, from.x * sin + from.y * cos, from.z)
    }

    fn at(&self, at: &Vector3<f64>) -> (i32, i32) {
        let (right, away, up) = self.turned(at);
        let across = f64::from(SIZE.0) / 2.0 + right;
        let down = f64::from(SIZE.1) / 2.0 - (up * TILT.cos() + away * TILT.sin());
        (across as i32, down as i32)
    }

    fn depth(&self, at: &Vector3<f64>) -> f64 {
        let (_, away, up) = self.turned(at);
        away * TILT.cos() - up * TILT.sin()
    }
}
