//! Joint values of another sign, joint, unit, or off by something.

use std::f64::consts::{PI, TAU};

use ballbar::JointKind;

use super::case::Case;
use super::kind::{AngleUnit, CauseKind};
use super::weigh::{Candidate, ONE_KIND, alternatives, candidate};
use crate::model::EncoderFacts;

pub(super) fn candidates(case: &Case<'_>, open: &[usize]) -> Vec<Candidate> {
    let kinds = case.robot.chain.joint_kinds();
    let joints = kinds.len();
    let mut tried: Vec<(CauseKind, f64)> = Vec::new();
    let mut add = |alike: Vec<CauseKind>| {
        let cost = ONE_KIND + alternatives(alike.len());
        tried.extend(alike.into_iter().map(|kind| (kind, cost)));
    };
    add((0..joints).map(|joint| CauseKind::JointSign { joint }).collect());
    let pairs = (0..joints).flat_map(|a| (a + 1..joints).map(move |b| [a, b]));
    add(pairs.filter(|[a, b]| kinds[*a] == kinds[*b]).map(|between| CauseKind::JointsExchanged { between }).collect());
    if kinds.contains(&JointKind::Revolute) {
        add(AngleUnit::ALL.map(CauseKind::AngleUnit).to_vec());
    }
    add(encoder_turns(case));
    let mut candidates: Vec<Candidate> = tried.into_iter().filter_map(|(kind, cost)| candidate(case, open, kind, cost)).collect();
    candidates.extend((0..joints).filter_map(|joint| any_offset(case, open, joint)));
    candidates
}

/// A few whole turns of each encoder, from index to index.
fn encoder_turns(case: &Case<'_>) -> Vec<CauseKind> {
    const MOST: i32 = 3;
    /// Less, and it could not be told from noise.
    const LEAST: f64 = 1e-6;
    let of_joint = |(joint, facts): (usize, &EncoderFacts)| {
        let turn = facts.encoder.map_or(0.0, |encoder| f64::from(encoder.counts_per_index) / encoder.counts_per_unit.abs());
        let some = (-MOST..=MOST).filter(move |&turns| turns != 0 && turn.is_finite() && turn > LEAST);
        some.map(move |turns| CauseKind::EncoderTurns { joint, turns, by: f64::from(turns) * turn })
    };
    case.robot.encoders.iter().enumerate().flat_map(of_joint).collect()
}

/// An angle (or length of a slide) at which a row would fit, and how sharply.
#[derive(Clone, Copy)]
struct Solution {
    by: f64,
    deviation: f64,
}

/// The one number by which a joint's value is off in the most rows: each row alone fits at two at most, and many at one by no chance.
fn any_offset(case: &Case<'_>, open: &[usize], joint: usize) -> Option<Candidate> {
    /// With fewer rows, one unknown explains too much.
    const FEWEST: usize = 3;
    /// More rows would not tell more.
    const ENOUGH: usize = 150;
    let asked = open.len().min(ENOUGH);
    let asked = (0..asked).map(|i| open[i * open.len() / asked]);
    let solutions: Vec<Solution> = asked.flat_map(|row| solutions(case, row, joint)).collect();
    let joints = case.robot.chain.joints();
    let fitted = peaks(&solutions).into_iter().filter_map(|by| {
        let (by, deviation) = refined(case, open, joint, by)?;
        let cost = ONE_KIND + alternatives(joints) + sharpness(by, deviation);
        candidate(case, open, CauseKind::JointOffset { joint, by }, cost)
    });
    let enough = fitted.filter(|found| found.parts.iter().all(|(_, rows)| rows.len() >= FEWEST));
    enough.max_by(|a, b| a.log_odds.total_cmp(&b.log_odds))
}

/// What a fitted number costs: its prior range, where sizes from 1e-5 to one turn (or metre) are alike, in units of its deviation.
fn sharpness(by: f64, deviation: f64) -> f64 {
    const SIZES: f64 = 13.0;
    (2.0 * SIZES * by.abs() / (deviation * TAU.sqrt())).ln().max(0.0)
}

/// By what the joint's value may be too large, so that the row fits: the squared length is `a + b cos + c sin` of the angle, and of a slide `a + b t + c t²`, so
/// that three lengths give all. Terms of the joint are as they were; [`refined`] sees to them.
fn solutions(case: &Case<'_>, row: usize, joint: usize) -> Vec<Solution> {
    /// Beyond, the row says next to nothing.
    const BLUNT: f64 = 0.02;
    let square = |by: f64| {
        let measured_m = case.measured_m(row);
        let length_m = measured_m - case.with_joints(row, |q| q[joint] -= by);
        length_m * length_m
    };
    let measured_m = case.measured_m(row);
    let wanted = measured_m * measured_m;
    let deviation_m = case.rows[row].deviation_m;
    let solution = |by: f64, slope: f64| {
        let deviation = 2.0 * measured_m.abs() * deviation_m / slope.abs();
        (deviation < BLUNT).then_some(Solution { by, deviation })
    };
    if case.robot.chain.joint_kinds()[joint] == JointKind::Prismatic {
        const STEP_M: f64 = 0.1;
        let [before, at, behind] = [-STEP_M, 0.0, STEP_M].map(square);
        let (b, c) = ((behind - before) / (2.0 * STEP_M), (behind + before - 2.0 * at) / (2.0 * STEP_M * STEP_M));
        let root = (b * b - 4.0 * c * (at - wanted)).max(0.0).sqrt();
        return [root, -root].into_iter().filter_map(|root| solution((root - b) / (2.0 * c), root)).collect();
    }
    let scale = case.robot.chain.joint(joint).map_or(1.0, |joint| joint.scale);
    let squares: [f64; 3] = std::array::from_fn(|i| square(i as f64 * TAU / 3.0 / scale));
    let part = |of: fn(f64) -> f64| squares.iter().enumerate().map(|(i, y)| y * of(i as f64 * TAU / 3.0)).sum::<f64>() / 1.5;
    let (a, b, c) = (squares.iter().sum::<f64>() / 3.0, part(f64::cos), part(f64::sin));
    let (radius, phase) = (b.hypot(c), c.atan2(b));
    let away = ((wanted - a) / radius).clamp(-1.0, 1.0).acos();
    let slope = radius * away.sin() * scale;
    let wrapped = |angle: f64| (angle + PI).rem_euclid(TAU) - PI;
    [away, -away].into_iter().filter_map(|away| solution(wrapped(phase + away) / scale, slope)).collect()
}

/// Where the most solutions lie together.
fn peaks(solutions: &[Solution]) -> Vec<f64> {
    const TRIED: usize = 3;
    const NEAR: f64 = 3.0;
    let near = |at: &Solution| {
        let is_near = |other: &&Solution| (other.by - at.by).abs() < NEAR * at.deviation.hypot(other.deviation);
        let others: Vec<&Solution> = solutions.iter().filter(is_near).collect();
        // One that is near to much because it is blunt is no peak.
        let says: f64 = others.iter().map(|other| -(at.deviation.hypot(other.deviation)).ln()).sum();
        let sum: f64 = others.iter().map(|other| other.deviation.powi(-2)).sum();
        (says, others.iter().map(|other| other.by * other.deviation.powi(-2)).sum::<f64>() / sum)
    };
    let mut all: Vec<(f64, f64)> = solutions.iter().map(near).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut peaks: Vec<f64> = Vec::new();
    for (_, by) in all {
        const APART: f64 = 1e-3;
        if peaks.len() < TRIED && peaks.iter().all(|other| (other - by).abs() > APART) {
            peaks.push(by);
        }
    }
    peaks
}

/// The number that rows near it agree on, by least squares, and its standard deviation.
fn refined(case: &Case<'_>, open: &[usize], joint: usize, mut by: f64) -> Option<(f64, f64)> {
    const STEPS: usize = 4;
    const NEAR: f64 = 4.0;
    const STEP: f64 = 1e-5;
    let mut weight = 0.0;
    for step in 0..STEPS {
        // At first what terms of the joint do is not in it yet.
        let near = if step == 0 { 4.0 * NEAR } else { NEAR };
        let mut sum = 0.0;
        weight = 0.0;
        for &row in open {
            let at = |by: f64| case.with_joints(row, |q| q[joint] -= by);
            let (deviation_m, without_m) = (case.rows[row].deviation_m, at(by));
            if without_m.abs() < near * deviation_m {
                let slope = (at(by + STEP) - at(by - STEP)) / (2.0 * STEP);
                sum -= without_m * slope / deviation_m.powi(2);
                weight += (slope / deviation_m).powi(2);
            }
        }
        by += if weight > 0.0 { sum / weight } else { return None };
    }
    Some((by, weight.sqrt().recip()))
}

#[cfg(test)]
mod tests {
    use super::super::{FittedRows, WrongRow};
    use super::*;
    use crate::designs;
    use crate::identify::residuals;
    use crate::model::{Dataset, PairingId, PoseRow};

    /// Whatever the joint and its scale, one of the two numbers at which a row fits is by what it is off.
    #[test]
    fn a_row_alone_fits_at_what_its_joint_is_off_by() {
        const BY: f64 = 0.3;
        let (mut robot, rig) = (designs::puma560(), designs::triangles());
        robot.chain.parameters_mut()[2 * 8 + 7] = -1.02;
        let kinematics = robot.kinematics();
        let pairing = PairingId { chuck: 1, sphere: 2 };
        let at = [0.4, -0.9, 1.3, 0.7, 0.8, -0.5];
        let mut found = 0;
        for joint in 0..5 {
            let q = robot.chain.joint_vector(&at).unwrap();
            let length_m = kinematics.length(&q, &rig.pairing(pairing));
            let mut off = q;
            off.as_array_mut()[joint] += BY;
            let dataset = Dataset::new("computed", vec![PoseRow::new(&rig, pairing, off, length_m).unwrap()]).unwrap();
            let residuals = residuals(&kinematics, &dataset);
            let fitted = FittedRows { robot: &robot, rig: &rig, dataset: &dataset, residuals: &residuals, sigma_m: 5e-5 };
            let case = Case::new(&fitted, &[WrongRow { row: 0, residual_m: 0.0, deviations: 1e3 }]);
            let solutions = solutions(&case, 0, joint);
            assert!(solutions.len() <= 2);
            found += usize::from(solutions.iter().any(|solution| (solution.by - BY).abs() < 1e-9));
        }
        assert_eq!(found, 5);
    }
}
