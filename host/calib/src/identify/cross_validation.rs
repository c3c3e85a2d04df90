//! Poses left out in turn, and how well a fit to the others predicts them.

use ballbar::LmOptions;

use super::lm::{Objective, solve};
use super::postures::postures;
use super::residual::Residual;
use crate::model::PoseRow;

/// How well a fit to some poses predicts the others.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CrossValidation {
    /// Parts that were left out in turn.
    pub folds: usize,
    /// Whether each part was measured in one go: where residuals follow one another, what was measured just before and after a pose
    /// shares its errors and proves nothing of it.
    pub in_blocks: bool,
    /// Weighted RMS residual of the poses while they were left out, metres.
    pub rms_m: f64,
}

/// Cross-validation in five parts, or in more where five would leave too few poses to fit; `None` where any would. Rows of the
/// same posture stay together: lengths to other spheres of one pose are no independent proof of it. Parts are taken in turn, or in
/// blocks of what was measured in one go.
pub(super) fn cross_validate(
    objective: &Objective<'_>,
    lm: &LmOptions,
    in_blocks: bool,
) -> Option<(CrossValidation, Vec<Residual>)> {
    let Objective { unknowns, rows, beliefs, .. } = *objective;
    let kinds = unknowns.of_chain().design().joint_kinds();
    let group_of_row = postures(kinds, rows.iter().map(|row| &row.measurement.q));
    let groups = group_of_row.iter().max().map_or(0, |last| last + 1);
    let fold_of = |group: usize, folds: usize| if in_blocks { group * folds / groups } else { group % folds };
    let kept = |folds: usize, fold: usize| group_of_row.iter().filter(|&&group| fold_of(group, folds) != fold).count();
    let is_enough = |rows: usize| rows + beliefs.believed() > beliefs.free().len();
    let enough = |&folds: &usize| folds <= groups && (0..folds).all(|fold| is_enough(kept(folds, fold)));
    let folds = [5, 10, groups].into_iter().find(enough)?;

    let mut left_out = vec![Residual { value_m: 0.0, weight: 1.0 }; rows.len()];
    for fold in 0..folds {
        let is_left_out = |row: usize| fold_of(group_of_row[row], folds) == fold;
        let (apart, kept): (Vec<usize>, Vec<usize>) = (0..rows.len()).partition(|&row| is_left_out(row));
        let kept: Vec<&PoseRow> = kept.into_iter().map(|row| rows[row]).collect();
        let values = solve(&Objective { rows: &kept, ..*objective }, lm).values;
        let residuals = Residual::of_rows(unknowns, &values, apart.iter().map(|&row| rows[row]));
        apart.into_iter().zip(residuals).for_each(|(row, residual)| left_out[row] = residual);
    }
    let squares: f64 = left_out.iter().map(|f| f.weight * f.value_m.powi(2)).sum();
    Some((CrossValidation { folds, in_blocks, rms_m: (squares / rows.len() as f64).sqrt() }, left_out))
}
