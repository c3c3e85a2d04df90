//! Sets of parameters of different robots and lengths.

use ballbar::wire::{ParameterSet, term_numbers};
use ballbar::{Body, Coupling, Encoder, JointKind, JointTerms, LvdtCurve, TermKind, Vector3};
use heapless::Vec;
use host_cal::files::open_robot;

/// Counts per joint radian of a PUMA 560 and counts per motor turn: gear ratios and encoders as its manual has them.
const PUMA_ENCODERS: [(f32, u32); 6] =
    [(-9_965.0, 1_000), (13_728.0, 800), (-8_547.0, 1_000), (12_101.0, 1_000), (11_447.0, 1_000), (12_205.0, 1_000)];

/// A PUMA 560 by its design, with the encoders of the interface board.
pub fn puma() -> ParameterSet {
    let chain = open_robot("puma560").unwrap().chain.cast::<f32>();
    ParameterSet {
        name: "PUMA 560".try_into().unwrap(),
        is_calibrated: false,
        kinds: chain.joint_kinds().iter().copied().collect(),
        parameters: chain.parameters().iter().copied().collect(),
        encoders: PUMA_ENCODERS.map(|(counts_per_unit, counts_per_index)| Encoder { counts_per_unit, counts_per_index }).into(),
        couplings: Vec::from_slice(&[Coupling { joint: 5, driven_by: 4, ratio: 13.0 / 72.0 }]).unwrap(),
        lvdt: curve(),
        terms: Vec::new(),
    }
}

/// The same with every kind of term, and masses: of a gear, a disc and a gap of a real arm's size.
pub fn puma_with_terms() -> ParameterSet {
    let mut terms = JointTerms::none();
    for joint in 0..6 {
        let size = 1e-4 * (joint + 1) as f64;
        let of_joint = [size, -size / 2.0, size / 3.0, -size / 4.0, 1e-5, 2e-4 - size / 8.0];
        TermKind::ALL.into_iter().zip(of_joint).for_each(|(term, value)| terms.set_coefficient(joint, term, value));
        terms.masses.links[joint] = Body { mass_kg: 12.0 / (joint + 1) as f64, center_m: Vector3::new(0.05, -0.1, 0.02) };
    }
    terms.masses.payload = Body { mass_kg: 2.5, center_m: Vector3::new(0.0, 0.0, 0.04) };
    ParameterSet { name: "PUMA 560 of metal".try_into().unwrap(), terms: term_numbers(&terms, 6), ..puma() }
}

/// Another set of the same robot.
pub fn calibrated_puma() -> ParameterSet {
    let mut set = puma();
    for (i, value) in set.parameters.iter_mut().enumerate() {
        *value += 1e-4 * (i as f32 + 1.0);
    }
    ParameterSet { name: "PUMA 560, calibrated".try_into().unwrap(), is_calibrated: true, ..set }
}

/// A short set: two joints.
pub fn two_joints() -> ParameterSet {
    let set = puma();
    ParameterSet {
        name: "two".try_into().unwrap(),
        kinds: set.kinds[..2].iter().copied().collect(),
        parameters: set.parameters[..22].iter().copied().collect(),
        encoders: set.encoders[..2].iter().copied().collect(),
        couplings: Vec::new(),
        ..set
    }
}

/// The longest set that there can be: everything full, and every number that varies in size at its largest. Its eight slides of a
/// metre make sense.
pub fn largest() -> ParameterSet {
    ParameterSet {
        name: "n".repeat(32).as_str().try_into().unwrap(),
        is_calibrated: true,
        kinds: core::iter::repeat_n(JointKind::Prismatic, 8).collect(),
        parameters: core::iter::repeat_n(1.0, 70).collect(),
        encoders: core::iter::repeat_n(Encoder { counts_per_unit: -1.5, counts_per_index: u32::MAX }, 8).collect(),
        couplings: core::iter::repeat_n(Coupling { joint: 7, driven_by: 6, ratio: -0.5 }, 8).collect(),
        lvdt: LvdtCurve { code_min: 60_000, code_max: u16::MAX, ..curve() },
        terms: {
            let mut terms = JointTerms::none();
            for joint in 0..8 {
                terms.set_coefficient(joint, TermKind::Compliance, -1e-5);
                terms.set_coefficient(joint, TermKind::Backlash, 1e-4);
            }
            terms.masses.payload = Body { mass_kg: 2.0, center_m: Vector3::new(0.1, 0.2, -0.3) };
            term_numbers(&terms, 8)
        },
    }
}

/// 5 mm of travel either side of the middle, a little bent.
pub fn curve() -> LvdtCurve {
    LvdtCurve { code_min: 2_000, code_max: 63_500, coefficients_m: [1e-5, 5.0e-3, -2e-6, 3e-5, 1e-6, -4e-6] }
}
