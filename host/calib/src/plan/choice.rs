//! In which family of postures each shell is measured.

use nalgebra::DMatrix;

use super::cell::Cell;
use super::cores::on_all_cores;
use super::experience::NOISE_M;
use super::information::information;
use super::progress::{Ongoing, Stage, Tell};
use super::shell::ShellRoads;
use super::transfer;

/// Without the families that the arm cannot come to from most others even with the bar off, where a shell has another: they lie in
/// pockets that it cannot have come into.
pub(super) fn in_one_piece(cell: &Cell<'_>, all: Vec<Vec<ShellRoads>>, seed: u64, tell: &Tell<'_>) -> Vec<Vec<ShellRoads>> {
    let pieces = pieces(cell, &all, seed, tell);
    let count = |piece: usize| pieces.iter().flatten().filter(|other| **other == Some(piece)).count();
    let last = pieces.iter().flatten().flatten().max().copied();
    let Some(largest) = last.and_then(|last| (0..=last).rev().max_by_key(|&piece| count(piece))) else { return all };
    let keep = |(families, of): (Vec<ShellRoads>, &Vec<Option<usize>>)| -> Vec<ShellRoads> {
        let has_other = of.contains(&Some(largest));
        let kept = families.into_iter().zip(of).filter(|(_, piece)| !has_other || **piece == Some(largest));
        kept.map(|(roads, _)| roads).collect()
    };
    all.into_iter().zip(&pieces).map(keep).collect()
}

/// Of each shell's families the number of the piece that it lies in, pieces counted from 0; `None` for one without postures. A family
/// lies in the first piece to whose first family a way was found.
fn pieces(cell: &Cell<'_>, all: &[Vec<ShellRoads>], seed: u64, tell: &Tell<'_>) -> Vec<Vec<Option<usize>>> {
    let mut of: Vec<Vec<Option<usize>>> = all.iter().map(|families| vec![None; families.len()]).collect();
    let places = all.iter().enumerate().flat_map(|(shell, families)| (0..families.len()).map(move |family| (shell, family)));
    let first = |(shell, family): (usize, usize)| all[shell][family].nodes.first().map(|node| &node.q);
    let mut left: Vec<(usize, usize)> = places.filter(|&place| first(place).is_some()).collect();
    let progress = Ongoing::begin(Stage::Families, left.len(), tell);
    for piece in 0.. {
        let Some(from) = left.first().and_then(|&place| first(place)) else { break };
        let is_joined = on_all_cores(left.len(), |i| {
            let is_joined = i == 0 || first(left[i]).is_some_and(|to| transfer::free(cell, from, to, seed).is_some());
            progress.tick(usize::from(is_joined));
            is_joined
        });
        for ((shell, family), _) in left.iter().zip(&is_joined).filter(|(_, is_joined)| **is_joined) {
            of[*shell][*family] = Some(piece);
        }
        left.retain(|&(shell, family)| of[shell][family].is_none());
    }
    of
}

/// Of each shell's families the one that tells most beside those of the other shells: the arm stands otherwise on different shells
/// without the bar's being taken off more often.
pub(super) fn most_telling(parameters: usize, all: Vec<Vec<ShellRoads>>) -> Vec<ShellRoads> {
    const SWEEPS: usize = 5;
    let told_by = |roads: &ShellRoads| {
        let nodes = roads.one_per_crossing().into_iter();
        let rows: Vec<&[f64]> = nodes.map(|node| roads.nodes[node].row.as_slice()).collect();
        information(&rows, parameters) / (NOISE_M * NOISE_M)
    };
    let each: Vec<Vec<DMatrix<f64>>> = all.iter().map(|families| families.iter().map(told_by).collect()).collect();
    let mut chosen = vec![0; all.len()];
    let first = each.iter().filter_map(|families| families.first());
    let mut sum = first.fold(DMatrix::identity(parameters, parameters), |sum, one| sum + one);
    for _ in 0..SWEEPS {
        let before = chosen.clone();
        for (shell, families) in each.iter().enumerate().filter(|(_, families)| families.len() > 1) {
            let others = &sum - &families[chosen[shell]];
            let told = |family: &DMatrix<f64>| log_determinant(&others + family);
            let best = (0..families.len()).max_by(|&a, &b| told(&families[a]).total_cmp(&told(&families[b])));
            chosen[shell] = best.unwrap_or(chosen[shell]);
            sum = others + &families[chosen[shell]];
        }
        if chosen == before {
            break;
        }
    }
    all.into_iter()
        .zip(chosen)
        .filter_map(|(mut families, best)| (best < families.len()).then(|| families.swap_remove(best)))
        .collect()
}

fn log_determinant(information: DMatrix<f64>) -> f64 {
    information.cholesky().map_or(f64::NEG_INFINITY, |factor| factor.l().diagonal().iter().map(|pivot| pivot.ln()).sum())
}
