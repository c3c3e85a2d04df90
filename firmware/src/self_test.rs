//! What can be tested on a board without moving anything.

use core::f32::consts::FRAC_PI_2;

use ballbar::wire::{Check, CheckResult, SelfTest, SlotState};
use ballbar::{Chain, JointKind, Kinematics};
use heapless::Vec;

/// What the tests look at.
pub(crate) struct Findings {
    pub(crate) has_samples: bool,
    pub(crate) overruns: u32,
    pub(crate) is_lvdt_good: bool,
    pub(crate) index_errors: u32,
    pub(crate) active_crc: Option<u32>,
    pub(crate) stored_crc: Option<u32>,
    pub(crate) slots: [SlotState; 2],
    pub(crate) stack_unused_bytes: u32,
}

/// A quarter of the boards' stacks of 24 KiB.
const STACK_SPARE_BYTES: u32 = 6 * 1_024;

pub(crate) fn self_test(findings: &Findings) -> SelfTest {
    let is_whole = |slot: &SlotState| matches!(slot, SlotState::Good { .. });
    let results = [
        (Check::Sampling, findings.has_samples),
        (Check::Overruns, findings.overruns == 0),
        (Check::LvdtSignal, findings.is_lvdt_good),
        (Check::Index, findings.index_errors == 0),
        (Check::Parameters, findings.active_crc.is_some() && findings.active_crc == findings.stored_crc),
        (Check::Slots, findings.slots.iter().all(is_whole)),
        (Check::Kinematics, kinematics_is_right()),
        (Check::Stack, findings.stack_unused_bytes >= STACK_SPARE_BYTES),
    ];
    let results: Vec<_, 8> = results.into_iter().map(|(check, passed)| CheckResult { check, passed }).collect();
    SelfTest { results }
}

/// A planar arm of two links, turned up by a right angle, on a slide: its tool is where school trigonometry puts it.
fn kinematics_is_right() -> bool {
    const UPPER_M: f32 = 0.4318;
    const FORE_M: f32 = 0.4331;
    let link = |x, gamma| [x, 0.0, 0.0, 0.0, 0.0, gamma];
    let joint = [0.0, 1.0];
    let mut parameters: Vec<f32, 30> = Vec::new();
    for part in [&link(0.0, 0.0)[..], &joint, &link(0.0, FRAC_PI_2), &joint, &link(UPPER_M, 0.0), &joint, &link(FORE_M, 0.0)] {
        let _ = parameters.extend_from_slice(part);
    }
    let kinds = [JointKind::Prismatic, JointKind::Revolute, JointKind::Revolute];
    let Ok(chain) = Chain::new(&kinds, &parameters) else { return false };
    let Ok(q) = chain.joint_vector(&[0.25, 0.5, 0.7]) else { return false };
    let pose = Kinematics::new(&chain).base_from_tool(&q);
    // x = 0.4318 cos 0.5 + 0.4331 cos 1.2, z = 0.25 + 0.4318 sin 0.5 + 0.4331 sin 1.2; the x axis is (cos 1.2, 0, sin 1.2).
    let expected = [(pose.translation_m.x, 0.535_877_3), (pose.translation_m.y, 0.0), (pose.translation_m.z, 0.860_682_1)];
    let axis = [(pose.rotation[(0, 0)], 0.362_357_75), (pose.rotation[(1, 0)], 0.0), (pose.rotation[(2, 0)], 0.932_039_1)];
    expected.iter().chain(&axis).all(|(found, expected)| (found - expected).abs() < 2e-6)
}
