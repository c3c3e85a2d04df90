//! Joint terms against their definition: 4×4 products of complex numbers, and loads that are derivatives of a potential energy.

use ballbar::{
    Approach, Body, Chain, Direction, JointKind, JointTerms, JointVector, Kinematics, MAX_PARAMETERS, Masses,
    PARAMETERS_PER_JOINT, ParameterKind, Quantity, TERMS_PER_JOINT, TermKind, TermsError, Vector3, term_basis,
};
use ballbar_tests::arms::{Arm, arms, config, pairings, points};
use ballbar_tests::naive::{self, STEP};
use host_cal::files::open_robot;
use num_complex::Complex;
use proptest::prelude::*;

fn bodies() -> impl Strategy<Value = Body<f64>> {
    (0.0..30.0, points(0.5)).prop_map(|(mass_kg, center_m)| Body { mass_kg, center_m })
}

/// All that there can be, far larger than any real joint has it: a mistake shows.
fn terms() -> impl Strategy<Value = JointTerms<f64>> {
    let coefficients = prop::collection::vec(prop::array::uniform6(-0.05..0.05), 8);
    (coefficients, prop::array::uniform8(bodies()), bodies(), points(9.81)).prop_map(|(coefficients, links, payload, gravity)| {
        let mut terms = JointTerms::none();
        for (joint, of_joint) in coefficients.into_iter().enumerate() {
            for (term, value) in TermKind::ALL.into_iter().zip(of_joint) {
                let value = if term == TermKind::Compliance { value / 50.0 } else { value };
                terms.set_coefficient(joint, term, value);
            }
        }
        terms.masses = Masses { links, payload, gravity_base_m_s2: gravity };
        terms
    })
}

fn approaches() -> impl Strategy<Value = Approach> {
    let direction = prop_oneof![Just(None), Just(Some(Direction::Rising)), Just(Some(Direction::Falling))];
    prop::collection::vec(direction, 8).prop_map(|directions| {
        directions.into_iter().enumerate().fold(Approach::UNKNOWN, |approach, (i, direction)| approach.with(i, direction))
    })
}

fn complex(chain: &Chain<f64>) -> Vec<Complex<f64>> {
    chain.parameters().iter().map(|&value| value.into()).collect()
}

/// Displacements of the rigid arm's loads, by the definition.
fn displaced(arm: &Arm, terms: &JointTerms<f64>, approach: Approach) -> Vec<Complex<f64>> {
    let loads = naive::gravity_loads(&arm.chain, &arm.q, terms);
    naive::displacements(terms, &arm.q, &loads, approach, None)
}

fn close(found: f64, expected: f64) -> Result<(), TestCaseError> {
    prop_assert!((found - expected).abs() <= 1e-11 * expected.abs().max(1.0), "{found} beside {expected}");
    Ok(())
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn loads_are_the_derivative_of_the_potential_energy(arm in arms(), terms in terms()) {
        let found = Kinematics::new(&arm.chain).gravity_loads(&terms.masses, &arm.q());
        for (found, expected) in found.as_array().iter().zip(naive::gravity_loads(&arm.chain, &arm.q, &terms)) {
            close(*found / 1e3, expected / 1e3)?;
        }
    }

    #[test]
    fn pose_point_and_length_are_those_of_the_displaced_joints(
        arm in arms(), terms in terms(), approach in approaches(), pairing in pairings()
    ) {
        let kinematics = Kinematics::with_terms(&arm.chain, &terms);
        let (q, parameters, kinds) = (arm.q(), complex(&arm.chain), arm.chain.joint_kinds());
        let at = kinematics.configuration(&q, approach);
        let displacements = displaced(&arm, &terms, approach);
        let expected = naive::base_from_tool_displaced(kinds, &parameters, &arm.q, &displacements).map(|c| c.re);
        let pose = at.base_from_tool();
        prop_assert!((pose.rotation - expected.fixed_view::<3, 3>(0, 0)).amax() <= 1e-11);
        prop_assert!((pose.translation_m - expected.fixed_view::<3, 1>(0, 3)).amax() <= 1e-11);
        let point_m = pose.rotation * pairing.sphere_tool_m + pose.translation_m;
        prop_assert!((at.point_in_base(&pairing.sphere_tool_m) - point_m).amax() <= 1e-12);
        close(at.length(&pairing), naive::length_displaced(kinds, &parameters, &arm.q, &displacements, &pairing).re)?;
    }

    #[test]
    fn without_an_approach_none_is_known(arm in arms(), terms in terms(), pairing in pairings()) {
        let kinematics = Kinematics::with_terms(&arm.chain, &terms);
        let q = arm.q();
        let at = kinematics.configuration(&q, Approach::UNKNOWN);
        prop_assert_eq!(kinematics.base_from_tool(&q), at.base_from_tool());
        prop_assert_eq!(kinematics.length(&q, &pairing), at.length(&pairing));
        let mut rows = [[0.0; MAX_PARAMETERS]; 2];
        let lengths = [kinematics.gradient(Quantity::Length, &q, &pairing, &mut rows[0]).value_m, at.gradient(Quantity::Length, &pairing, &mut rows[1]).value_m];
        prop_assert_eq!(lengths[0], lengths[1]);
        prop_assert_eq!(rows[0], rows[1]);
    }

    /// With loads held fixed, as a fit holds them, the geometric columns and those of the terms are exact.
    #[test]
    fn columns_are_those_of_complex_steps(arm in arms(), terms in terms(), approach in approaches(), pairing in pairings()) {
        let kinematics = Kinematics::with_terms(&arm.chain, &terms);
        let (q, parameters, kinds) = (arm.q(), complex(&arm.chain), arm.chain.joint_kinds());
        let loads = naive::gravity_loads(&arm.chain, &arm.q, &terms);
        let displacements = naive::displacements(&terms, &arm.q, &loads, approach, None);
        let mut row = [0.0; MAX_PARAMETERS];
        let length_m = kinematics.configuration(&q, approach).gradient(Quantity::Length, &pairing, &mut row).value_m;
        prop_assume!(length_m > 0.05);
        for i in 0..parameters.len() {
            let mut stepped = parameters.clone();
            stepped[i].im = STEP;
            close(row[i], naive::length_displaced(kinds, &stepped, &arm.q, &displacements, &pairing).im / STEP)?;
        }
        for joint in 0..kinds.len() {
            let offset = row[joint * PARAMETERS_PER_JOINT + ParameterKind::Offset as usize];
            let basis = term_basis(arm.q[joint], loads[joint], approach.sign(joint));
            for (term, phi) in TermKind::ALL.into_iter().zip(basis) {
                let stepped = naive::displacements(&terms, &arm.q, &loads, approach, Some((joint, term)));
                let expected = naive::length_displaced(kinds, &parameters, &arm.q, &stepped, &pairing).im / STEP;
                close(offset * phi / 1e3, expected / 1e3)?;
            }
        }
    }

    #[test]
    fn terms_of_zero_leave_every_bit_as_it_was(arm in arms(), terms in terms(), approach in approaches()) {
        let mut masses_only = JointTerms::none();
        masses_only.masses = terms.masses;
        let with = Kinematics::with_terms(&arm.chain, &masses_only);
        let q = arm.q();
        let rigid = Kinematics::new(&arm.chain).base_from_tool(&q);
        prop_assert_eq!(with.base_from_tool(&q), rigid);
        prop_assert_eq!(with.configuration(&q, approach).base_from_tool(), rigid);
    }

    /// Joints of a metre and the terms of a real robot: what the board computes is what the host does.
    #[test]
    fn poses_in_f32_are_close_to_those_in_f64(terms in terms(), approach in approaches(), q in prop::array::uniform6(-3.0..3.0)) {
        let robot = open_robot("puma560").unwrap();
        let mut real = terms;
        for joint in 0..8 {
            for term in TermKind::ALL {
                let value = if joint < 6 { terms.coefficient(joint, term) / 50.0 } else { 0.0 };
                real.set_coefficient(joint, term, value);
            }
        }
        let q32 = robot.chain.joint_vector(&q).unwrap().cast::<f32>();
        let q64: JointVector<f64> = q32.cast();
        let rounded = Kinematics::with_terms(&robot.chain.cast::<f32>(), &real.cast::<f32>());
        let rounded_m = rounded.configuration(&q32, approach).base_from_tool().translation_m;
        let exact = Kinematics::with_terms(&robot.chain, &real);
        let error_m = (rounded_m.cast::<f64>() - exact.configuration(&q64, approach).base_from_tool().translation_m).norm();
        prop_assert!(error_m <= 1e-6, "{error_m:e}");
    }
}

/// By school mechanics: a horizontal arm of 2 m about a vertical and then a horizontal axis, 10 kg at its middle and 3 kg at its end.
#[test]
fn a_horizontal_arm_bends_its_shoulder_and_not_its_waist() {
    use std::f64::consts::FRAC_PI_2;
    let link = |x, gamma| [x, 0.0, 0.0, 0.0, 0.0, gamma];
    let joint = [0.0, 1.0];
    let parameters = [&link(0.0, 0.0)[..], &joint, &link(0.0, FRAC_PI_2), &joint, &link(2.0, 0.0)].concat();
    let chain = Chain::new(&[JointKind::Revolute; 2], &parameters).unwrap();
    let mut terms = JointTerms::none();
    terms.masses.links[1] = Body { mass_kg: 10.0, center_m: Vector3::new(1.0, 0.0, 0.0) };
    terms.masses.payload = Body { mass_kg: 3.0, center_m: Vector3::zeros() };
    let q = chain.joint_vector(&[0.3, 0.0]).unwrap();
    let loads = Kinematics::new(&chain).gravity_loads(&terms.masses, &q);
    // The axis points to −y: up is the positive way, and gravity pulls the negative one.
    let expected_nm = -(10.0 * 1.0 + 3.0 * 2.0) * 9.806_65;
    assert!(loads.as_array()[0].abs() < 1e-12 && (loads.as_array()[1] - expected_nm).abs() < 1e-12, "{loads:?}");
    terms.set_coefficient(1, TermKind::Compliance, 1e-5);
    let sag_m = Kinematics::with_terms(&chain, &terms).base_from_tool(&q).translation_m.z;
    assert!((sag_m - 2.0 * (1e-5 * expected_nm).sin()).abs() < 1e-12, "{sag_m}");
}

#[test]
fn a_joint_with_backlash_lags_behind_its_encoder() {
    let robot = open_robot("puma560").unwrap();
    let mut terms = JointTerms::none();
    terms.set_coefficient(0, TermKind::Backlash, 1e-4);
    let kinematics = Kinematics::with_terms(&robot.chain, &terms);
    let q = JointVector::zero();
    let azimuth = |direction| {
        let m = kinematics.configuration(&q, Approach::UNKNOWN.with(0, direction)).base_from_tool().translation_m;
        m.y.atan2(m.x)
    };
    let middle = azimuth(None);
    assert!((azimuth(Some(Direction::Rising)) - (middle - 1e-4)).abs() < 1e-12);
    assert!((azimuth(Some(Direction::Falling)) - (middle + 1e-4)).abs() < 1e-12);
}

#[test]
fn terms_that_no_robot_has_are_refused_by_name() {
    let kinds = [JointKind::Revolute, JointKind::Prismatic];
    let check = |change: &dyn Fn(&mut JointTerms<f64>)| {
        let mut terms = JointTerms::none();
        terms.masses.payload.mass_kg = 1.0;
        change(&mut terms);
        terms.check(&kinds)
    };
    assert_eq!(check(&|_| ()), Ok(()));
    for term in TermKind::ALL {
        assert_eq!(check(&|terms| terms.set_coefficient(0, term, 0.005)), Ok(()), "{term:?}");
        for bad in [0.2, -0.2, f64::NAN, f64::INFINITY] {
            assert_eq!(check(&|terms| terms.set_coefficient(0, term, bad)), Err(TermsError::Size { joint: 0, term }));
        }
        let slide = check(&|terms| terms.set_coefficient(1, term, 0.005));
        let expected = if term.is_eccentricity() { Err(TermsError::EccentricSlide { joint: 1 }) } else { Ok(()) };
        assert_eq!(slide, expected, "{term:?}");
        assert_eq!(check(&|terms| terms.set_coefficient(2, term, 0.005)), Err(TermsError::NoSuchJoint { joint: 2 }));
    }
    let unloaded = |terms: &mut JointTerms<f64>| {
        terms.masses = Masses::none();
        terms.masses.links[0].mass_kg = 5.0;
        terms.set_coefficient(0, TermKind::Compliance, 1e-5);
    };
    assert_eq!(check(&unloaded), Ok(()));
    let beyond = |terms: &mut JointTerms<f64>| {
        unloaded(terms);
        terms.set_coefficient(1, TermKind::Compliance, 1e-5);
    };
    assert_eq!(check(&beyond), Err(TermsError::NoLoad { joint: 1 }));
    for bad in [-1.0, 2e5, f64::NAN] {
        assert_eq!(check(&|terms| terms.masses.links[1].mass_kg = bad), Err(TermsError::Mass { joint: 1 }));
        assert_eq!(check(&|terms| terms.masses.payload.mass_kg = bad), Err(TermsError::Mass { joint: 2 }));
    }
    assert_eq!(check(&|terms| terms.masses.links[0].center_m.y = 1001.0), Err(TermsError::Mass { joint: 0 }));
    assert_eq!(check(&|terms| terms.masses.links[2].mass_kg = 1.0), Err(TermsError::NoSuchJoint { joint: 2 }));
    assert_eq!(check(&|terms| terms.masses.gravity_base_m_s2.x = f64::NAN), Err(TermsError::Gravity));
}

#[test]
fn the_terms_of_a_joint_are_as_many_as_their_kinds() {
    let places: Vec<usize> = TermKind::ALL.into_iter().map(|term| term as usize).collect();
    assert_eq!(places, (0..TERMS_PER_JOINT).collect::<Vec<_>>());
}
