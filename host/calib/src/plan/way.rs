//! The way from one joint vector to another, as joint vectors between which the robot interpolates its joints.
//!
//! With the bar attached the sphere has to stay near the shell. The straight way in joint space leaves it; so its middle is brought
//! back onto the shell, by the smallest change of the joints that does it, and both halves are looked at in turn, until each
//! piece keeps the bar inside its travel and everything clear.

use ballbar::JointVector;

use super::cell::{Cell, halfway};
use super::posture::Shell;
use super::swing::Swing;

/// Halvings of a way at most: up to 63 via points.
const DEEPEST: usize = 6;
/// Looked at no coarser than this between two rows, radians or metres of a joint (see [`SAMPLING_GUARD_M`]).
const COARSEST_STEP: f64 = 0.035;
/// What a length may bulge between two looks: `|d''| h²/8` with `h` of [`COARSEST_STEP`] and a curvature of 4 m per radian².
const SAMPLING_GUARD_M: f64 = 0.0007;
/// Where nothing is certain at this motion of any point, the way counts as blocked, metres.
const FINEST_MOTION_M: f64 = 0.002;

/// Via points from `a` to `b`, both of which keep all margins, with the bar attached; `None` when none were found.
pub(super) fn attached(
    cell: &Cell<'_>,
    shell: &Shell,
    a: &JointVector<f64>,
    b: &JointVector<f64>,
) -> Option<Vec<JointVector<f64>>> {
    let mut vias = Vec::new();
    bisect(cell, shell, a, b, DEEPEST, &mut vias).then_some(vias)
}

fn bisect(
    cell: &Cell<'_>,
    shell: &Shell,
    a: &JointVector<f64>,
    b: &JointVector<f64>,
    depth: usize,
    vias: &mut Vec<JointVector<f64>>,
) -> bool {
    if is_clear(cell, Some(shell), a, b) {
        return true;
    }
    if depth == 0 || cell.longest_motion_m(a, b) < FINEST_MOTION_M {
        return false;
    }
    let Some(middle) = onto_shell(cell, shell, halfway(a, b)).filter(|middle| is_sound(cell, Some(shell), middle, &Swing::NONE))
    else {
        return false;
    };
    bisect(cell, shell, a, &middle, depth - 1, vias) && {
        vias.push(middle);
        bisect(cell, shell, &middle, b, depth - 1, vias)
    }
}

/// Whether the joint-interpolated way between two sound joint vectors keeps all margins, with the bar on a shell or without it.
///
/// Looks at the middle: where what is free there exceeds the motion that is left to either end, the piece is clear for certain.
pub(super) fn is_clear(cell: &Cell<'_>, attached: Option<&Shell>, a: &JointVector<f64>, b: &JointVector<f64>) -> bool {
    let middle = halfway(a, b);
    let swing = Swing::between(cell.inverse.skeleton(), a, &middle);
    let largest_step = a.as_array().iter().zip(middle.as_array()).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max);
    let is_fine = attached.is_none() || 2.0 * largest_step <= COARSEST_STEP;
    if is_fine && is_sound(cell, attached, &middle, &swing) {
        return true;
    }
    if cell.longest_motion_m(a, &middle) < FINEST_MOTION_M || !is_sound(cell, attached, &middle, &Swing::NONE) {
        return false;
    }
    is_clear(cell, attached, a, &middle) && is_clear(cell, attached, &middle, b)
}

/// Whether a joint vector keeps the margins of a way, and those between solids for as long as the joints stay within `swing` of it.
pub(super) fn is_sound(cell: &Cell<'_>, attached: Option<&Shell>, q: &JointVector<f64>, swing: &Swing) -> bool {
    let keeps_travel =
        |shell: &Shell| cell.travel_margin_m(q, &shell.pairing, shell.bar_m) >= cell.margins.travel_m + SAMPLING_GUARD_M;
    cell.keeps_limits(q)
        && attached.is_none_or(keeps_travel)
        && cell.scene.keeps_apart(&cell.posture(q), attached.map(|shell| shell.id), cell.margins.clearance_m, swing)
}

/// The joint vector nearest to `q`, to first order, at which the bar is at mid travel.
fn onto_shell(cell: &Cell<'_>, shell: &Shell, mut q: JointVector<f64>) -> Option<JointVector<f64>> {
    const STEPS: usize = 10;
    const TOLERANCE_M: f64 = 1e-6;
    for _ in 0..STEPS {
        let posture = cell.posture(&q);
        let sphere_m = posture.point_in_base(&shell.pairing.sphere_tool_m);
        let bar_m = sphere_m - shell.pairing.chuck_base_m;
        let off_m = shell.bar_m - bar_m.norm();
        if off_m.abs() < TOLERANCE_M {
            return Some(q);
        }
        let along = bar_m.try_normalize(f64::MIN_POSITIVE)?;
        let slopes = posture.axes().iter().map(|axis| along.dot(&axis.point_column(&sphere_m)));
        let square: f64 = slopes.clone().map(|slope| slope * slope).sum();
        if square < f64::EPSILON {
            return None;
        }
        for (value, slope) in q.as_array_mut().iter_mut().zip(slopes) {
            *value += off_m * slope / square;
        }
    }
    None
}
