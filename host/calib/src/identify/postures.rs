//! Which lengths belong to one posture of the arm: they share its errors, so they prove nothing of one another.

use ballbar::{JointKind, JointVector};

/// Postures that differ by less in every joint are one: more than encoders jitter by, less than anybody moves between two poses.
/// Radians (0.05°) and metres.
const SAME: (f64, f64) = (0.000_873, 0.000_05);

/// The posture of every joint vector (radians or metres, as `kinds` of the chain's joints has it), numbered from 0 as they come first.
pub fn postures<'a>(kinds: &[JointKind], rows: impl IntoIterator<Item = &'a JointVector<f64>>) -> Vec<usize> {
    let rows: Vec<&[f64]> = rows.into_iter().map(|q| &q.as_array()[..kinds.len()]).collect();
    let same = |kind: JointKind| if kind == JointKind::Revolute { SAME.0 } else { SAME.1 };
    let is_same = |a: &[f64], b: &[f64]| kinds.iter().zip(a).zip(b).all(|((&kind, a), b)| (a - b).abs() < same(kind));

    // Ordered by the joint that tells most of them apart, only few neighbours have to be compared.
    let joint = (0..kinds.len()).max_by(|&a, &b| spread(&rows, a, same(kinds[a])).total_cmp(&spread(&rows, b, same(kinds[b]))));
    let Some(joint) = joint else { return vec![0; rows.len()] };
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|&a, &b| rows[a][joint].total_cmp(&rows[b][joint]));
    let mut first: Vec<usize> = (0..rows.len()).collect();
    for (at, &a) in order.iter().enumerate() {
        let near = order[at + 1..].iter().take_while(|&&b| rows[b][joint] - rows[a][joint] < same(kinds[joint]));
        for &b in near.filter(|&&b| is_same(rows[a], rows[b])) {
            join(&mut first, a, b);
        }
    }
    let mut numbers = vec![None; rows.len()];
    let mut next = 0;
    (0..rows.len())
        .map(|row| {
            *numbers[root(&first, row)].get_or_insert_with(|| {
                next += 1;
                next - 1
            })
        })
        .collect()
}

/// Fewer postures tell neither a standard error nor which of two models is better.
pub(crate) const FEWEST_POSTURES: usize = 8;

/// Mean of a value over the rows, whose postures these are, and its standard error, rows of one posture taken together; `None` for too few
/// postures.
pub(crate) fn mean_and_error(postures: &[usize], value: impl Fn(usize) -> f64) -> Option<(f64, f64)> {
    let rows = postures.len() as f64;
    let count = postures.iter().max().map_or(0, |last| last + 1);
    if count < FEWEST_POSTURES {
        return None;
    }
    let mean = (0..postures.len()).map(&value).sum::<f64>() / rows;
    let mut off = vec![0.0; count];
    for (row, &posture) in postures.iter().enumerate() {
        off[posture] += value(row) - mean;
    }
    let count = count as f64;
    let squares: f64 = off.iter().map(|off| off * off).sum();
    Some((mean, (count / (count - 1.0) * squares).sqrt() / rows))
}

/// How many steps of `same` a joint's values go over.
fn spread(rows: &[&[f64]], joint: usize, same: f64) -> f64 {
    let values = rows.iter().map(|row| row[joint]);
    let (least, most) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), q| (least.min(q), most.max(q)));
    (most - least) / same
}

/// The first row known to be of the same posture.
fn root(first: &[usize], mut row: usize) -> usize {
    while first[row] != row {
        row = first[row];
    }
    row
}

fn join(first: &mut [usize], a: usize, b: usize) {
    let (a, b) = (root(first, a), root(first, b));
    first[a.max(b)] = a.min(b);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn posture(values: [f64; 2]) -> JointVector<f64> {
        let mut q = JointVector::zero();
        q.as_array_mut()[..2].copy_from_slice(&values);
        q
    }

    #[test]
    fn what_jitters_is_one_posture_and_what_moves_is_two() {
        let kinds = [JointKind::Revolute, JointKind::Prismatic];
        let q = [[0.5, 0.1], [1.0, 0.1], [0.5 + 1e-5, 0.1 - 1e-6], [0.5, 0.102], [0.502, 0.1], [1.0, 0.1]].map(posture);
        assert_eq!(postures(&kinds, &q), [0, 1, 0, 2, 3, 1]);
        assert_eq!(postures(&kinds, &[]), [0; 0]);
    }

    #[test]
    fn numbers_follow_the_order_of_the_rows() {
        let kinds = [JointKind::Revolute; 2];
        let q: Vec<_> = [3.0, -1.0, 2.0, -1.0, 3.0, 0.0].iter().map(|&value| posture([value, 0.0])).collect();
        assert_eq!(postures(&kinds, &q), [0, 1, 2, 1, 0, 3]);
    }
}
