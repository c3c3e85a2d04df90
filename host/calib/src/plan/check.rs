//! A plan looked at once more, in another way than it was made: by fine steps from row to row, and with robots that are not nominal.

use ballbar::{JointVector, Kinematics};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::cell::Cell;
use super::contact::Contact;
use super::progress::{Ongoing, Stage, Tell};
use crate::plan::{PlanRow, RowKind};

/// Least margins over all rows and fine steps between them.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Found {
    /// Joint vectors looked at, rows among them.
    pub steps: usize,
    /// To the joints' limits, revolute joints, radians; below zero beyond them.
    #[cfg_attr(feature = "serde", serde(with = "crate::stored::infinite_as_none"))]
    pub limit_rad: f64,
    /// To the joints' limits, prismatic joints, metres.
    #[cfg_attr(feature = "serde", serde(with = "crate::stored::infinite_as_none"))]
    pub limit_m: f64,
    /// To the ends of the bar's travel, by the nominal robot, metres.
    #[cfg_attr(feature = "serde", serde(with = "crate::stored::infinite_as_none"))]
    pub travel_m: f64,
    /// To the ends of the bar's travel at the rows, by the worst of many plausible robots, metres.
    #[cfg_attr(feature = "serde", serde(with = "crate::stored::infinite_as_none"))]
    pub plausible_travel_m: f64,
    /// How many plausible robots that was.
    pub plausible_robots: usize,
    /// Between any two solids, metres.
    #[cfg_attr(feature = "serde", serde(with = "crate::stored::infinite_as_none"))]
    pub clearance_m: f64,
    /// Which these are.
    pub nearest: Contact,
    /// Smallest singular value at measured poses.
    #[cfg_attr(feature = "serde", serde(with = "crate::stored::infinite_as_none"))]
    pub singularity: f64,
    /// Row index before which the clearance is least.
    pub nearest_row: usize,
}

/// Looks at a plan in steps of a joint of at most `step`, radians or metres (no finer than a tenth of a milliradian or millimetre), and
/// with so many plausible robots.
///
/// The bar counts as attached between rows of one pairing and bar that both have a length.
///
/// # Panics
/// When a row's pairing is of another rig: [`super::CheckedPlan`] refuses such plans.
pub fn check(cell: &Cell<'_>, rows: &[PlanRow], step: f64, plausible_robots: usize, seed: u64, tell: &Tell<'_>) -> Found {
    let progress = Ongoing::begin(Stage::Check, rows.len() + plausible_robots, tell);
    let mut found = Found {
        steps: 0,
        limit_rad: f64::INFINITY,
        limit_m: f64::INFINITY,
        travel_m: f64::INFINITY,
        plausible_travel_m: f64::INFINITY,
        plausible_robots,
        clearance_m: f64::INFINITY,
        nearest: Contact::ToolTable,
        singularity: f64::INFINITY,
        nearest_row: 0,
    };
    for (i, row) in rows.iter().enumerate() {
        let is_same_bar = |before: &PlanRow| before.pairing == row.pairing && before.bar_m == row.bar_m && before.bar.is_some();
        let before = i.checked_sub(1).map(|i| &rows[i]);
        let stays_attached = row.bar.is_some() && before.is_some_and(is_same_bar);
        for q in before.map_or_else(Vec::new, |before| between(&before.q, &row.q, step)) {
            found.see(cell, row, &q, stays_attached, i);
        }
        found.see(cell, row, &row.q, row.bar.is_some(), i);
        if row.kind == RowKind::Measure {
            found.singularity = found.singularity.min(cell.singularity(&cell.posture(&row.q)));
        }
        progress.tick(1);
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for _ in 0..plausible_robots {
        let kinematics = Kinematics::with_terms(&cell.plausible_robot(&mut rng), &cell.robot.terms);
        for row in rows.iter().filter(|row| row.bar.is_some()) {
            let length_m = kinematics.length(&row.q, &cell.rig.pairing(row.pairing));
            found.plausible_travel_m = found.plausible_travel_m.min(cell.travel_m / 2.0 - (length_m - row.bar_m).abs());
        }
        progress.tick(1);
    }
    found
}

impl Found {
    fn see(&mut self, cell: &Cell<'_>, row: &PlanRow, q: &JointVector<f64>, is_attached: bool, index: usize) {
        self.steps += 1;
        let limits = cell.limit_margin(q);
        self.limit_rad = self.limit_rad.min(limits.turn_rad);
        self.limit_m = self.limit_m.min(limits.slide_m);
        if is_attached {
            let (length_m, _) = cell.length(q, &cell.rig.pairing(row.pairing));
            self.travel_m = self.travel_m.min(cell.travel_m / 2.0 - (length_m - row.bar_m).abs());
        }
        let nearest = cell.nearest(&cell.posture(q), is_attached.then_some(row.pairing));
        if nearest.gap_m < self.clearance_m {
            (self.clearance_m, self.nearest, self.nearest_row) = (nearest.gap_m, nearest.contact, index);
        }
    }
}

/// Joint vectors between two, without the ends.
fn between(a: &JointVector<f64>, b: &JointVector<f64>, step: f64) -> Vec<JointVector<f64>> {
    const FINEST: f64 = 1e-4;
    let step = if step > FINEST { step } else { FINEST };
    let largest = a.as_array().iter().zip(b.as_array()).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max);
    let pieces = (largest / step).ceil().max(1.0) as usize;
    let at = |piece: usize| {
        let share = piece as f64 / pieces as f64;
        let mut q = *a;
        for (value, b) in q.as_array_mut().iter_mut().zip(b.as_array()) {
            *value += share * (b - *value);
        }
        q
    };
    (1..pieces).map(at).collect()
}
