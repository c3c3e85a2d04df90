//! From a row to a row: lengths that are off by one number, a chuck or a sphere that has moved.

use std::f64::consts::{PI, TAU};

use ballbar::{Matrix3, Vector3};

use super::case::Case;
use super::kind::{CauseKind, RowsOf};
use super::weigh::{Candidate, ONE_KIND, against_good, against_gross, alternatives, range_of_size};
use crate::model::End;

pub(super) fn candidates(case: &Case<'_>, open: &[usize]) -> Vec<Candidate> {
    let scopes = scopes(case);
    let cost = ONE_KIND + alternatives(scopes.len());
    let offsets = scopes.iter().filter_map(|of| Scope::new(case, open, of.clone())?.offset(cost));
    let ends = scopes.iter().filter_map(|of| match *of {
        RowsOf::Chuck(chuck) => Some((End::Chuck, chuck)),
        RowsOf::Sphere(sphere) => Some((End::Sphere, sphere)),
        _ => None,
    });
    let displaced = ends.filter_map(|(end, which)| Scope::new(case, open, RowsOf::end(end, which))?.displaced(end, which, cost));
    offsets.chain(displaced).collect()
}

/// Rows that something may have happened to together.
fn scopes(case: &Case<'_>) -> Vec<RowsOf> {
    let mut sets: Vec<&String> = case.dataset.rows.iter().filter_map(|row| row.set.as_ref()).collect();
    sets.sort_unstable();
    sets.dedup();
    let of_sets = sets.iter().map(|&set| RowsOf::Set(set.clone())).filter(|_| sets.len() > 1);
    let of_files = (0..case.dataset.files.len()).map(RowsOf::File).filter(|_| case.dataset.files.len() > 1);
    let chucks = (0..case.rig.chucks.len()).map(RowsOf::Chuck);
    let spheres = (0..case.rig.spheres.len()).map(RowsOf::Sphere);
    let pairings = case.dataset.pairings().into_iter().map(RowsOf::Pairing);
    [RowsOf::All].into_iter().chain(of_sets).chain(of_files).chain(chucks).chain(spheres).chain(pairings).collect()
}

/// One of them, in the order of measurement, without what is explained already.
struct Scope<'a> {
    case: &'a Case<'a>,
    of: RowsOf,
    rows: Vec<usize>,
    /// What it says for a run that a row in it was left out: by chance few are.
    rare: f64,
}

/// Rows of a scope, from one to another of [`Scope::rows`], and what they say.
#[derive(Clone, Copy)]
struct Run {
    first: usize,
    last: usize,
    says: f64,
}

impl<'a> Scope<'a> {
    /// `None` where too few of its rows are open.
    fn new(case: &'a Case<'a>, open: &[usize], of: RowsOf) -> Option<Self> {
        let is_in = |row: &usize| of.has(case.dataset, *row) && (!case.is_left_out(*row) || open.contains(row));
        let rows: Vec<usize> = (0..case.count()).filter(is_in).collect();
        let found = rows.iter().filter(|&&row| case.is_left_out(row)).count();
        let rare = (case.count() as f64 / open.len() as f64).ln();
        (found >= FEWEST).then_some(Self { case, of, rows, rare })
    }

    fn open(&self) -> Vec<usize> {
        self.rows.iter().copied().filter(|&row| self.case.is_left_out(row)).collect()
    }

    /// What a row of a run says for it. No row says more against it than that something else is wrong with it, too.
    fn says(&self, row: usize, without_m: f64) -> f64 {
        const BROKEN: f64 = -3.0;
        const CONTRADICTS: f64 = -6.0;
        if self.case.is_left_out(row) {
            (against_gross(self.case, row, without_m) + self.rare).max(BROKEN)
        } else {
            against_good(self.case, row, without_m).max(CONTRADICTS)
        }
    }

    /// The run that says the most, less the choice of it: Kadane's algorithm. `to_the_end`: what has moved stays where it is.
    fn run(&self, to_the_end: bool, residual: impl Fn(usize) -> f64) -> Run {
        let says: Vec<f64> = self.rows.iter().map(|&row| self.says(row, residual(row))).collect();
        let count = self.rows.len();
        let choice = alternatives(count);
        let mut best = Run { first: 0, last: 0, says: f64::NEG_INFINITY };
        let (mut first, mut sum) = (0, 0.0);
        for (last, value) in says.iter().enumerate() {
            if sum <= 0.0 {
                (first, sum) = (last, 0.0);
            }
            sum += value;
            let cost = if last + 1 == count { choice } else { 2.0 * choice };
            if (last + 1 == count || !to_the_end) && sum - cost > best.says {
                best = Run { first, last, says: sum - cost };
            }
        }
        // In a suffix, what comes before is of no help.
        if to_the_end {
            let mut sum = 0.0;
            for first in (0..count).rev() {
                sum += says[first];
                if sum - choice > best.says {
                    best = Run { first, last: count - 1, says: sum - choice };
                }
            }
        }
        self.trimmed(best, &says)
    }

    /// Without good rows at its ends that fit a little better by chance.
    fn trimmed(&self, mut run: Run, says: &[f64]) -> Run {
        const CHANCE: f64 = 2.0;
        let is_chance = |at: usize| !self.case.is_left_out(self.rows[at]) && says[at] < CHANCE;
        let is_last = run.last + 1 == self.rows.len();
        while run.first < run.last && is_chance(run.first) {
            run.says -= says[run.first];
            run.first += 1;
        }
        while run.first < run.last && !is_last && is_chance(run.last) {
            run.says -= says[run.last];
            run.last -= 1;
        }
        run
    }

    /// Rows of a run that were left out and that the cause explains.
    fn explained(&self, run: Run, residual: impl Fn(usize) -> f64) -> Vec<usize> {
        let rows = self.rows[run.first..=run.last].iter().copied();
        rows.filter(|&row| self.case.is_left_out(row) && against_gross(self.case, row, residual(row)) > 0.0).collect()
    }

    fn offset(&self, cost: f64) -> Option<Candidate> {
        let residual = |row: usize, by_m: f64| self.case.rows[row].residual_m - by_m;
        let mut seeds_m: Vec<f64> = self.open().into_iter().map(|row| self.case.rows[row].residual_m).collect();
        seeds_m.sort_by(f64::total_cmp);
        // Seeds closer than a deviation find the same.
        let nearest_m = self.rows.iter().map(|&row| self.case.rows[row].deviation_m).fold(f64::INFINITY, f64::min);
        seeds_m.dedup_by(|a, b| (*a - *b).abs() < nearest_m);
        let tried = seeds_m.into_iter().map(|by_m| (by_m, self.run(false, |row| residual(row, by_m))));
        let (mut by_m, mut run) = tried.max_by(|a, b| a.1.says.total_cmp(&b.1.says))?;
        let mut weight = 0.0;
        for _ in 0..STEPS {
            let members = self.members(run, |row| residual(row, by_m));
            let inverse = |row: &usize| self.case.rows[*row].deviation_m.powi(-2);
            weight = members.iter().map(inverse).sum::<f64>();
            by_m = members.iter().map(|row| inverse(row) * self.case.rows[*row].residual_m).sum::<f64>() / weight;
            run = self.run(false, |row| residual(row, by_m));
        }
        let sharpness = (range_of_size(by_m) * (weight / TAU).sqrt()).ln().max(0.0);
        let rows = self.explained(run, |row| residual(row, by_m));
        let kind = CauseKind::LengthOffset { by_m, of: self.of.clone(), first: self.rows[run.first], last: self.rows[run.last] };
        let log_odds = run.says - cost - sharpness;
        (rows.len() >= FEWEST && log_odds.is_finite()).then(|| self.candidate(kind, rows, log_odds))
    }

    fn candidate(&self, kind: CauseKind, rows: Vec<usize>, log_odds: f64) -> Candidate {
        // Rows of other causes are as rare.
        let rank = log_odds - self.rare * rows.len() as f64;
        Candidate { parts: vec![(kind, rows)], log_odds, rank }
    }

    /// Rows of a run that fit it, whether they were left out or not.
    fn members(&self, run: Run, residual: impl Fn(usize) -> f64) -> Vec<usize> {
        const NEAR: f64 = 4.0;
        let rows = self.rows[run.first..=run.last].iter().copied();
        rows.filter(|&row| residual(row).abs() < NEAR * self.case.rows[row].deviation_m).collect()
    }

    fn displaced(&self, end: End, which: usize, cost: f64) -> Option<Candidate> {
        let residual = |row: usize, by_m: Vector3<f64>| self.case.measured_m(row) - self.case.displaced_m(row, end, by_m);
        let tried = self.seeds(end).into_iter().map(|by_m| (by_m, self.run(true, |row| residual(row, by_m))));
        let (mut by_m, mut run) = tried.max_by(|a, b| a.1.says.total_cmp(&b.1.says))?;
        let mut information = Matrix3::zeros();
        for _ in 0..STEPS {
            let members = self.members(run, |row| residual(row, by_m));
            (by_m, information) = self.fitted(end, &members, by_m)?;
            run = self.run(true, |row| residual(row, by_m));
        }
        // In space, sizes of a displacement are alike, and its directions: the density is 1/(4π D |δ|³), 2 D = range_of_size(1).
        let range_m3 = 2.0 * PI * range_of_size(by_m.norm()) * by_m.norm_squared();
        let sharpness = (range_m3 * (information / TAU).determinant().sqrt()).ln().max(0.0);
        let rows = self.explained(run, |row| residual(row, by_m));
        let (first, last) = (self.rows[run.first], self.rows[run.last]);
        let kind = CauseKind::Displaced { end, which, by_m: by_m.into(), first, last };
        let log_odds = run.says - cost - sharpness;
        (rows.len() >= FEWEST_DISPLACED && log_odds.is_finite()).then(|| self.candidate(kind, rows, log_odds))
    }

    /// Displacements that some rows left out, one after the other, would fit.
    fn seeds(&self, end: End) -> Vec<Vector3<f64>> {
        /// So many starts at most, and so many rows from each.
        const STARTS: usize = 24;
        const ROWS: [usize; 3] = [5, 10, 20];
        let open = self.open();
        let starts = open.len().min(STARTS);
        let starts = (0..starts).map(|i| i * open.len() / starts);
        let windows = starts.flat_map(|start| ROWS.map(|rows| &open[start..open.len().min(start + rows)]));
        let few = windows.filter(|rows| rows.len() >= FEWEST_DISPLACED);
        let fitted = |rows: &[usize]| {
            let mut by_m = Vector3::zeros();
            for _ in 0..STEPS {
                by_m = self.fitted(end, rows, by_m)?.0;
            }
            Some(by_m)
        };
        few.filter_map(fitted).collect()
    }

    /// One step of least squares from a displacement, and the information that these rows have of it, `JᵀS⁻¹J`.
    fn fitted(&self, end: End, rows: &[usize], by_m: Vector3<f64>) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        /// A direction in which no bar of these rows pointed is left alone: as if known to a metre.
        const PRIOR: f64 = 1.0;
        let (mut information, mut gradient) = (Matrix3::identity() * PRIOR, -by_m * PRIOR);
        for &row in rows {
            let CaseBar { along, residual_m, deviation_m } = self.bar(end, row, by_m);
            information += along * along.transpose() / deviation_m.powi(2);
            gradient += along * residual_m / deviation_m.powi(2);
        }
        let found_m = by_m + information.cholesky()?.solve(&gradient);
        found_m.iter().all(|x| x.is_finite()).then_some((found_m, information))
    }

    /// How the computed length grows with the displacement, and what it leaves.
    fn bar(&self, end: End, row: usize, by_m: Vector3<f64>) -> CaseBar {
        let of = &self.case.rows[row];
        let along = match end {
            End::Chuck => -(of.bar_m - by_m).normalize(),
            End::Sphere => of.base_from_tool.transpose() * (of.bar_m + of.base_from_tool * by_m).normalize(),
        };
        let residual_m = self.case.measured_m(row) - self.case.displaced_m(row, end, by_m);
        CaseBar { along, residual_m, deviation_m: of.deviation_m }
    }
}

/// One number that is fitted takes three rows at least to be seen in, three numbers five.
const FEWEST: usize = 3;
const FEWEST_DISPLACED: usize = 5;
/// Fit and choice of the run, in turns.
const STEPS: usize = 3;

struct CaseBar {
    along: Vector3<f64>,
    residual_m: f64,
    deviation_m: f64,
}
