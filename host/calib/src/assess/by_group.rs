//! How well groups of lengths are predicted by the others: bars, sets, places, pairings, and what was measured in one go.

use super::evidence::Evidence;
use super::proof::Proof;
use crate::identify::{Group, GroupKind, LeftOutGroup, Residual, postures};
use crate::units::{fixed, mm_from_m};

/// All groups of one kind, each predicted by a fit without it (linear theory at the fit).
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GroupProofs {
    /// What their lengths have in common.
    pub kind: GroupKind,
    /// All of them.
    pub groups: Vec<GroupProof>,
    /// RMS of their lengths with the design, metres.
    pub before_m: f64,
    /// RMS of their lengths while their group was left out, metres.
    pub after_m: f64,
}

impl GroupProofs {
    /// The group that is predicted worst.
    pub fn worst(&self) -> Option<&GroupProof> {
        self.groups.iter().max_by(|a, b| a.after_m.total_cmp(&b.after_m))
    }
}

/// One group, predicted by a fit without it.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct GroupProof {
    /// Which, to follow "lengths".
    pub name: String,
    /// How many lengths were fitted of it.
    pub rows: usize,
    /// RMS with the design, metres.
    pub before_m: f64,
    /// RMS while the group was left out, metres.
    pub after_m: f64,
    /// RMS of the same lengths while only parts of them were left out, metres, or what noise would leave where these were measured in one go.
    pub usual_m: f64,
    /// RMS that noise alone would leave, metres.
    pub expected_m: f64,
    /// Whether other lengths of its configurations were fitted.
    pub shares_configurations: bool,
    /// Whether it is predicted far worse than that, by more than chance.
    pub is_unlike: bool,
    /// Whether the design predicts it better than the others do, although they should.
    pub speaks_against: bool,
}

/// Whatever the groups' number, one dataset in a thousand accuses one by chance.
const FALSE_ALARMS: f64 = 1e-3;
/// What is predicted worse by less is not worth a sentence.
const MUCH_WORSE: f64 = 2.0;
/// Standard errors by which one has to be better than the other.
const SURELY: f64 = 3.0;
/// The others tell a group when noise, and what beliefs do not know, leaves less than so many deviations of a length there.
const TOLD: f64 = 2.0;

/// Of all kinds; `before` are the residuals of all rows with the design.
pub(super) fn by_group(evidence: &Evidence<'_>, before: &[Residual]) -> Vec<GroupProofs> {
    let fit = evidence.fit;
    let mut kinds: Vec<GroupProofs> = Vec::new();
    let mut squares = (0.0, 0.0, 0.0);
    for left_out in &fit.left_out_groups {
        let kind = left_out.group.kind();
        if kinds.last().is_none_or(|last| last.kind != kind) {
            kinds.push(GroupProofs { kind, groups: Vec::new(), before_m: 0.0, after_m: 0.0 });
            squares = (0.0, 0.0, 0.0);
        }
        let group = group_proof(evidence, before, left_out);
        let weight: f64 = left_out.residuals.iter().map(|residual| residual.weight).sum();
        squares.0 += weight;
        squares.1 += weight * group.before_m.powi(2);
        squares.2 += weight * group.after_m.powi(2);
        if let Some(last) = kinds.last_mut() {
            (last.before_m, last.after_m) = ((squares.1 / squares.0).sqrt(), (squares.2 / squares.0).sqrt());
            last.groups.push(group);
        }
    }
    kinds
}

/// Of groups that are predicted as well as noise allows, one in twenty is off by more.
const BEYOND_NOISE: f64 = 0.05;

fn group_proof(evidence: &Evidence<'_>, before: &[Residual], left_out: &LeftOutGroup) -> GroupProof {
    let Evidence { robot, dataset, fit, .. } = evidence;
    let LeftOutGroup { rows, residuals, expected_m, shares_configurations, p_value, .. } = left_out;
    let select = |of: &[Residual]| -> Vec<Residual> { rows.iter().map(|&row| of[row]).collect() };
    let configurations = postures(robot.chain.joint_kinds(), rows.iter().map(|&row| &dataset.rows[row].measurement.q));
    let beside = |other: &[Residual]| Proof::of_group(select(other), residuals.clone(), configurations.clone());
    let by_design = beside(before);
    let (before_m, after_m) = (by_design.before_summary().rms_m, by_design.after_summary().rms_m);
    // Where poses were left out in blocks, whole groups were nearly, too: then what noise would leave is to compare with.
    let by_poses = fit.cross_validation.is_some_and(|proof| !proof.in_blocks);
    let usual = if by_poses {
        beside(&fit.left_out)
    } else {
        let of_noise = residuals.iter().map(|by| Residual { value_m: expected_m / by.weight.sqrt(), ..*by }).collect();
        Proof::of_group(of_noise, residuals.clone(), configurations.clone())
    };
    let usual_m = usual.before_summary().rms_m;
    let is_told = fit.uncertainty.sigma_m.is_some_and(|sigma_m| *expected_m < TOLD * sigma_m);
    let chance = FALSE_ALARMS / fit.left_out_groups.len() as f64;
    GroupProof {
        name: name(evidence, &left_out.group),
        rows: rows.len(),
        before_m,
        after_m,
        usual_m,
        expected_m: *expected_m,
        shares_configurations: *shares_configurations,
        is_unlike: after_m > MUCH_WORSE * usual_m && usual.is_worse_by(SURELY) && *p_value < chance,
        // What lies within its own noise speaks against nothing, however well the design does.
        speaks_against: !shares_configurations && is_told && *p_value < BEYOND_NOISE && by_design.is_worse_by(SURELY),
    }
}

fn name(evidence: &Evidence<'_>, group: &Group) -> String {
    let Evidence { rig, dataset, .. } = evidence;
    match group {
        Group::Bar(bar_m) => format!("of bar {}", fixed(mm_from_m(*bar_m), 3).trim_end_matches('0').trim_end_matches('.')),
        Group::Set(set) => format!("of set {set}"),
        Group::Place(file) => format!("of {}", dataset.files[*file]),
        Group::Pairing(pairing) => format!("of {}", rig.pairing_name(*pairing)),
        Group::Block(first, last) => format!("from {} to {}", dataset.place(*first), dataset.place(*last)),
    }
}

/// The group that is least like the others, of the first kind that has one, and what to ask then.
pub(super) fn unlike(kinds: &[GroupProofs]) -> Option<String> {
    let of_kind = kinds.iter().map(|kind| (kind.kind, kind.groups.iter().filter(|group| group.is_unlike)));
    let (kind, groups) =
        of_kind.map(|(kind, groups)| (kind, groups.collect::<Vec<_>>())).find(|(_, groups)| !groups.is_empty())?;
    let factor = |group: &GroupProof| group.after_m / group.usual_m;
    let worst = groups.iter().max_by(|a, b| factor(a).total_cmp(&factor(b)))?;
    let question = match kind {
        GroupKind::Bar => "is the zero of each bar right?",
        GroupKind::Set | GroupKind::Place => "did something move or change between them?",
        GroupKind::Pairing => "are its chuck and its sphere where the rig's file says?",
        GroupKind::Block => "did something move or change meanwhile?",
    };
    Some(format!(
        "Lengths {} are predicted {:.1} times worse when none of them is fitted (RMS {} mm): {question}",
        worst.name,
        factor(worst),
        fixed(mm_from_m(worst.after_m), 3)
    ))
}

/// The group that the design predicts better by the most, although the others should.
pub(super) fn design_is_better(kinds: &[GroupProofs]) -> Option<&GroupProof> {
    let against = kinds.iter().flat_map(|kind| &kind.groups).filter(|group| group.speaks_against);
    against.max_by(|a, b| (a.after_m / a.before_m).total_cmp(&(b.after_m / b.before_m)))
}
