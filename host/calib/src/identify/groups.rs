//! Groups of rows, each left out in turn: what is the same for all rows of a group, such as its bar, no proof by single poses can show.
//!
//! By linear theory at the solution, with the same beliefs: without the rows `O` the unknowns move by `−H₋⁻¹ J_Oᵀ f_O`, `H₋ = H − J_Oᵀ J_O`.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::beliefs::Beliefs;
use super::lines::lines;
use super::postures::postures;
use super::residual::Residual;
use super::uncertainty::{Uncertainty, inverse_root};
use crate::model::{Dataset, PairingId, PoseRow};
use crate::unknowns::Unknowns;

/// What rows of a group have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum GroupKind {
    /// The bar's length at mid travel.
    Bar,
    /// The part of the measurements.
    Set,
    /// Where they come from: a file, as a rule of one place.
    Place,
    /// Chuck and sphere.
    Pairing,
    /// They were measured in one go.
    Block,
}

/// Which rows a group is.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Group {
    /// Of a bar of this length at mid travel, metres.
    Bar(f64),
    /// Of this set.
    Set(String),
    /// Of the file with this index.
    Place(usize),
    /// Of this pairing.
    Pairing(PairingId),
    /// From this row to that one, indices from 0.
    Block(usize, usize),
}

impl Group {
    /// What its rows have in common.
    pub fn kind(&self) -> GroupKind {
        match self {
            Self::Bar(_) => GroupKind::Bar,
            Self::Set(_) => GroupKind::Set,
            Self::Place(_) => GroupKind::Place,
            Self::Pairing(_) => GroupKind::Pairing,
            Self::Block(..) => GroupKind::Block,
        }
    }
}

/// A group as the others predict it.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LeftOutGroup {
    /// Which.
    pub group: Group,
    /// Its rows that were fitted, indices from 0.
    pub rows: Vec<usize>,
    /// Their residuals by a fit without them.
    pub residuals: Vec<Residual>,
    /// The RMS that noise alone would leave there, and what beliefs do not know, metres.
    pub expected_m: f64,
    /// Whether other lengths of its configurations stayed in the fit, since without them too little would be left.
    pub shares_configurations: bool,
    /// Probability that independent noise takes the lengths of a group so far from their prediction.
    pub p_value: f64,
}

/// More groups of a kind are no groups any more.
const MOST: usize = 30;
/// Blocks are no smaller, in configurations, so that each proves something, and no more than so many.
const BLOCK: usize = 8;
const BLOCKS: usize = 10;

/// All groups of which the data have several, each predicted by the others. `kept` are the indices of the rows that were fitted.
pub(super) fn leave_groups_out(
    dataset: &Dataset,
    kept: &[usize],
    (unknowns, values): (&Unknowns, &[f64]),
    beliefs: &Beliefs,
    uncertainty: &Uncertainty,
) -> Vec<LeftOutGroup> {
    let Some(sigma_m) = uncertainty.sigma_m.filter(|&sigma_m| sigma_m > 0.0) else { return Vec::new() };
    let rows: Vec<&PoseRow> = kept.iter().map(|&row| &dataset.rows[row]).collect();
    let kinds = unknowns.of_chain().design().joint_kinds();
    let configurations = postures(kinds, rows.iter().map(|row| &row.measurement.q));
    let root = inverse_root(&uncertainty.spectrum);
    let (jacobian, residual_m) = lines(unknowns, values, &rows, beliefs.free());
    let fitted = Fitted {
        lines: jacobian * root,
        residual_m,
        weights: rows.iter().map(|row| row.measurement.weight).collect(),
        configurations: &configurations,
        sigma_m,
        freedom: uncertainty.freedom,
    };
    let groups = groups(kept, &rows, &configurations);
    let left_out = |(group, members): (Group, Vec<usize>)| fitted.without(group, &members, kept);
    groups.into_iter().filter_map(left_out).collect()
}

/// Rows that were fitted, in coordinates in which `H` is the identity.
struct Fitted<'a> {
    lines: DMatrix<f64>,
    residual_m: DVector<f64>,
    weights: Vec<f64>,
    configurations: &'a [usize],
    sigma_m: f64,
    freedom: f64,
}

impl Fitted<'_> {
    /// `None` where nothing would be left that tells what the group is predicted by.
    fn without(&self, group: Group, members: &[usize], kept: &[usize]) -> Option<LeftOutGroup> {
        let rows = self.configurations.len();
        let mut of_group = vec![false; self.configurations.iter().max()? + 1];
        members.iter().for_each(|&row| of_group[self.configurations[row]] = true);
        let with_them: Vec<usize> = (0..rows).filter(|&row| of_group[self.configurations[row]]).collect();
        // At least half of what the other groups have has to stay.
        let may_go = 2 * (rows - with_them.len()) >= rows - members.len();
        let out = if may_go { &with_them[..] } else { members };

        let (lines, residual_m) = (self.lines.select_rows(out), self.residual_m.select_rows(out));
        let size = lines.ncols();
        let left = DMatrix::identity(size, size) - lines.tr_mul(&lines);
        let left = left.cholesky().filter(|left| left.l_dirty().diagonal().min() > 1e-6)?;
        let moved = -left.solve(&lines.tr_mul(&residual_m));
        let own = self.lines.select_rows(members);
        let predicted_m = self.residual_m.select_rows(members) - &own * moved;
        let half = left.l_dirty().solve_lower_triangular(&own.transpose())?;
        let count = members.len() as f64;
        let expected_m = self.sigma_m * (1.0 + half.norm_squared() / count).sqrt();
        // fᵀ (1 + Y H₋⁻¹ Yᵀ)⁻¹ f, by M. A. Woodbury's formula.
        let inner = DMatrix::identity(size, size) + &half * half.transpose();
        let pull = &half * &predicted_m;
        let chi2 = (predicted_m.norm_squared() - pull.dot(&inner.cholesky()?.solve(&pull))) / self.sigma_m.powi(2);
        let others = (self.freedom - count).max(1.0);
        // σ² by what the others leave.
        let ratio = (chi2 / count) / ((self.freedom - chi2).max(1e-3 * others) / others);
        let p_value = FisherSnedecor::new(count, others).map_or(1.0, |f| f.sf(ratio.max(0.0)));
        let residual = |(&row, f): (&usize, &f64)| {
            let weight = self.weights[row];
            Residual { value_m: f / weight.sqrt(), weight }
        };
        Some(LeftOutGroup {
            group,
            rows: members.iter().map(|&row| kept[row]).collect(),
            residuals: members.iter().zip(predicted_m.iter()).map(residual).collect(),
            expected_m,
            shares_configurations: !may_go,
            p_value,
        })
    }
}

/// Groups and their rows, indices into `rows`; a kind that parts the rows as one before it does is not taken.
fn groups(kept: &[usize], rows: &[&PoseRow], configurations: &[usize]) -> Vec<(Group, Vec<usize>)> {
    /// Bars whose lengths differ by less are one.
    const SAME_M: f64 = 1e-6;
    let all = |of: &dyn Fn(&PoseRow) -> Option<Group>| -> Option<Vec<Group>> { rows.iter().map(|&row| of(row)).collect() };
    let count = configurations.iter().max().map_or(0, |last| last + 1);
    let blocks = (count / BLOCK).clamp(1, BLOCKS);
    let block_of: Vec<usize> = configurations.iter().map(|configuration| configuration * blocks / count.max(1)).collect();
    let ends = |block: usize| {
        let mut own = (0..rows.len()).filter(|&row| block_of[row] == block);
        let first = own.next().unwrap_or_default();
        Group::Block(kept[first], kept[own.next_back().unwrap_or(first)])
    };
    let ends: Vec<Group> = if rows.is_empty() { Vec::new() } else { (0..blocks).map(ends).collect() };
    let kinds = [
        all(&|row| row.bar_m.map(|bar_m| Group::Bar((bar_m / SAME_M).round() * SAME_M))),
        all(&|row| row.set.clone().map(Group::Set)),
        all(&|row| Some(Group::Place(row.file))),
        all(&|row| Some(Group::Pairing(row.pairing))),
        // Configurations that were come back to make no blocks.
        block_of.is_sorted().then(|| block_of.iter().map(|&block| ends[block].clone()).collect()),
    ];
    let mut seen: Vec<Vec<Vec<usize>>> = Vec::new();
    let mut groups = Vec::new();
    for kind in kinds.into_iter().flatten() {
        let mut of_kind: Vec<(Group, Vec<usize>)> = Vec::new();
        for (row, group) in kind.into_iter().enumerate() {
            match of_kind.iter_mut().find(|(other, _)| *other == group) {
                Some((_, members)) => members.push(row),
                None => of_kind.push((group, vec![row])),
            }
        }
        let parts: Vec<Vec<usize>> = of_kind.iter().map(|(_, members)| members.clone()).collect();
        if (2..=MOST).contains(&parts.len()) && !seen.contains(&parts) {
            groups.extend(of_kind);
            seen.push(parts);
        }
    }
    groups
}
