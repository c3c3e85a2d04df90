//! The sweeps of vectors against 4×4 products of complex numbers, over random chains: the pose, and derivatives that complex
//! steps make exact to rounding.

use ballbar::{Chain, Kinematics, MAX_PARAMETERS, Matrix3, Measurement, Pairing, Quantity, Vector3};
use ballbar_tests::arms::{Arm, arms, config, pairings, points};
use ballbar_tests::naive;
use nalgebra::Vector4;
use num_complex::Complex;
use proptest::prelude::*;

/// Largest difference allowed, relative to the largest entry or 1. The worst of 200,000 random cases was 1.7e-14.
const TOLERANCE: f64 = 1e-12;

/// What no column can be, so that it shows which entries were written.
const UNTOUCHED: f64 = -12_345.0;

fn complex(values: &[f64]) -> Vec<Complex<f64>> {
    values.iter().map(|&value| value.into()).collect()
}

fn naive_point(arm: &Arm, parameters: &[Complex<f64>], s: Vector3<f64>) -> Vector4<Complex<f64>> {
    let point = Vector4::new(s.x, s.y, s.z, 1.0).map(Complex::from);
    naive::base_from_tool(arm.chain.joint_kinds(), parameters, &arm.q) * point
}

/// All entries of `found` beside `expected`; those beyond it must not have been written.
fn assert_row(found: &[f64; MAX_PARAMETERS], expected: &[f64]) -> Result<(), TestCaseError> {
    let largest = expected.iter().fold(1.0_f64, |largest, entry| largest.max(entry.abs()));
    for (i, (&found, &expected)) in found.iter().zip(expected).enumerate() {
        let error = (found - expected).abs() / largest;
        prop_assert!(error <= TOLERANCE, "column {}: {found} beside {expected}, {error:e} of the largest", i);
    }
    prop_assert!(found[expected.len()..].iter().all(|&entry| entry == UNTOUCHED), "written beyond the chain's parameters");
    Ok(())
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn the_pose_is_the_product_of_the_matrices_and_its_rotation_is_one(arm in arms()) {
        let pose = Kinematics::new(&arm.chain).base_from_tool(&arm.q());
        let naive = naive::base_from_tool(arm.chain.joint_kinds(), &complex(arm.chain.parameters()), &arm.q).map(|c| c.re);
        let rotation_error = (pose.rotation - naive.fixed_view::<3, 3>(0, 0)).amax();
        let translation_error = (pose.translation_m - naive.fixed_view::<3, 1>(0, 3)).amax();
        prop_assert!(rotation_error <= 1e-13 && translation_error <= 1e-13, "{rotation_error:e}, {translation_error:e}");
        let gram_error = (pose.rotation.tr_mul(&pose.rotation) - Matrix3::identity()).amax();
        prop_assert!(gram_error <= 1e-13 && pose.rotation.determinant() > 0.0, "{gram_error:e}");
    }

    #[test]
    fn points_of_the_tool_follow_the_pose(arm in arms(), point_tool_m in points(0.5)) {
        let kinematics = Kinematics::new(&arm.chain);
        let pose = kinematics.base_from_tool(&arm.q());
        let point_m = kinematics.point_in_base(&arm.q(), &point_tool_m);
        let error = (pose.rotation * point_tool_m + pose.translation_m - point_m).amax();
        prop_assert!(error <= 1e-13, "{error:e}");
    }

    #[test]
    fn the_gradient_of_a_length_is_that_of_complex_steps(arm in arms(), pairing in pairings()) {
        let kinematics = Kinematics::new(&arm.chain);
        let (expected_m, expected) = naive::length_and_gradient(&arm.chain, &arm.q, &pairing);
        // The bar's direction is known to rounding over its length, for both.
        prop_assume!(expected_m > 0.05);
        let mut row = [UNTOUCHED; MAX_PARAMETERS];
        let length_m = kinematics.gradient(Quantity::Length, &arm.q(), &pairing, &mut row).value_m;
        prop_assert!((length_m - expected_m).abs() <= 1e-13 * expected_m.max(1.0), "{length_m} beside {expected_m}");
        prop_assert_eq!(length_m, kinematics.length(&arm.q(), &pairing));
        assert_row(&row, &expected)?;
    }

    #[test]
    fn the_gradient_of_a_position_is_that_of_complex_steps(arm in arms(), point_tool_m in points(0.3)) {
        const STEP: f64 = 1e-100;
        let kinematics = Kinematics::new(&arm.chain);
        let point_m = kinematics.point_in_base(&arm.q(), &point_tool_m);
        let parameters = complex(arm.chain.parameters());
        let derivatives: Vec<_> = (0..parameters.len()).map(|i| {
            let mut stepped = parameters.clone();
            stepped[i].im = STEP;
            naive_point(&arm, &stepped, point_tool_m).map(|c| c.im / STEP)
        }).collect();
        let mut rows = [[UNTOUCHED; MAX_PARAMETERS]; 3];
        let found_m = kinematics.position_gradient(&arm.q(), &point_tool_m, &mut rows);
        prop_assert!((found_m - point_m).amax() <= 1e-13);
        for (axis, row) in rows.iter().enumerate() {
            assert_row(row, &derivatives.iter().map(|derivative| derivative[axis]).collect::<Vec<_>>())?;
        }
    }

    #[test]
    fn a_residual_is_measured_less_computed(arm in arms(), pairing in pairings(), length_m in 0.0..5.0) {
        let kinematics = Kinematics::new(&arm.chain);
        let measurement = Measurement::new(pairing, arm.q(), length_m);
        let mut row = [UNTOUCHED; MAX_PARAMETERS];
        let (residual_m, _) = kinematics.residual_row(&measurement, &mut row);
        prop_assert_eq!(residual_m, length_m - kinematics.length(&arm.q(), &pairing));
        prop_assert_eq!(residual_m, kinematics.residual(&measurement));
        let mut gradient = [UNTOUCHED; MAX_PARAMETERS];
        kinematics.gradient(Quantity::Length, &arm.q(), &pairing, &mut gradient);
        prop_assert_eq!(row, gradient, "the row is the gradient of the computed length, not of the residual");
    }

    /// `Δp = t·Jᵀf` must lower `|f|²` by `2t·|Jᵀf|²`, to first order in t.
    #[test]
    fn a_small_step_along_jt_f_descends(arm in arms(), ends in prop::collection::vec((pairings(), -0.1..0.1), 1..4)) {
        let cost_and_descent = |chain: &Chain<f64>, measurements: &[Measurement<f64>]| {
            let kinematics = Kinematics::new(chain);
            let (mut cost, mut descent, mut size) = (0.0, [0.0; MAX_PARAMETERS], 0.0);
            for measurement in measurements {
                let mut row = [0.0; MAX_PARAMETERS];
                let (residual_m, _) = kinematics.residual_row(measurement, &mut row);
                cost += residual_m * residual_m;
                descent.iter_mut().zip(&row).for_each(|(sum, column)| *sum += residual_m * column);
                size += row.iter().map(|column| column * column).sum::<f64>();
            }
            (cost, descent, size)
        };
        let kinematics = Kinematics::new(&arm.chain);
        let lengths: Vec<f64> = ends.iter().map(|(pairing, _)| kinematics.length(&arm.q(), pairing)).collect();
        prop_assume!(lengths.iter().all(|&length_m| length_m > 0.2));
        let measurements: Vec<_> = ends.iter().zip(&lengths)
            .map(|(&(pairing, off_m), length_m)| Measurement::new(pairing, arm.q(), length_m + off_m))
            .collect();

        let (before, mut step, size) = cost_and_descent(&arm.chain, &measurements);
        let slope: f64 = step.iter().map(|g| g * g).sum();
        // Residuals may pull against each other; then there is little to gain and the next order shows.
        prop_assume!(before > 1e-8 && slope > 0.01 * size * before);
        let t = 1e-5 / size;
        step.iter_mut().for_each(|g| *g *= t);
        let mut stepped = arm.chain.clone();
        stepped.parameters_mut().iter_mut().zip(&step).for_each(|(value, by)| *value += by);
        let (after, ..) = cost_and_descent(&stepped, &measurements);
        let gain = (before - after) / (2.0 * t * slope);
        prop_assert!((gain - 1.0).abs() < 1e-3, "{gain} of what the gradient promises");
    }

    #[test]
    fn a_sphere_exactly_on_its_chuck_has_a_zero_gradient(arm in arms(), sphere_tool_m in points(0.3)) {
        let kinematics = Kinematics::new(&arm.chain);
        let chuck_base_m = kinematics.point_in_base(&arm.q(), &sphere_tool_m);
        let mut row = [UNTOUCHED; MAX_PARAMETERS];
        let pairing = Pairing { chuck_base_m, sphere_tool_m };
        let length_m = kinematics.gradient(Quantity::Length, &arm.q(), &pairing, &mut row).value_m;
        prop_assert_eq!(length_m, 0.0);
        // Compares equal to zero with either sign, and a NaN with nothing.
        assert_row(&row, &vec![0.0; arm.chain.parameter_count()])?;
        prop_assert!(row[..arm.chain.parameter_count()].iter().all(|&column| column == 0.0));
    }
}
