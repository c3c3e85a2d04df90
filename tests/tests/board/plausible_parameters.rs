//! What is believed of parameters before they are used: every robot that makes sense is taken, also one whose own table has lengths
//! of half a kilometre, and nothing that cannot be computed with.

use ballbar::wire::{MAX_REACH_M, ParameterSet, ParameterSetError};
use ballbar::{
    Chain, Coupling, Encoder, EncoderError, JointKind, Kinematics, LvdtCurve, Parameter, ParameterKind, ParameterUnit,
};
use ballbar_tests::parameter_sets::{calibrated_puma, curve, largest, puma, two_joints};
use host_cal::board::nominal_lvdt;
use host_cal::files::open_robot;
use proptest::prelude::*;

const BUILT_IN: [&str; 6] = ["puma560", "puma560-optimised", "irb120", "ur5e", "stanford", "scara"];

fn set_of(chain: &Chain<f64>) -> ParameterSet {
    let joints = chain.joints();
    ParameterSet {
        kinds: chain.joint_kinds().iter().copied().collect(),
        parameters: chain.parameters().iter().map(|&value| value as f32).collect(),
        encoders: core::iter::repeat_n(Encoder { counts_per_unit: 10_000.0, counts_per_index: 0 }, joints).collect(),
        couplings: heapless::Vec::new(),
        ..puma()
    }
}

/// Any robot: links of up to a metre, turned anyhow, joints of both kinds.
fn robot() -> BoxedStrategy<Chain<f64>> {
    let kind = prop_oneof![4 => Just(JointKind::Revolute), 1 => Just(JointKind::Prismatic)];
    (proptest::collection::vec(kind, 1..=8), any::<[u64; 2]>())
        .prop_map(|(kinds, seed)| {
            let mut random = unit_numbers(seed[0] ^ seed[1].rotate_left(32));
            let value = |index: usize| match Parameter::from_index(index).kind() {
                ParameterKind::X | ParameterKind::Y | ParameterKind::Z => random(),
                ParameterKind::Scale => (1.0 + 0.01 * random()) * random().signum(),
                _ => 3.2 * random(),
            };
            let parameters: Vec<f64> = (0..kinds.len() * 8 + 6).map(value).collect();
            Chain::new(&kinds, &parameters).unwrap()
        })
        .boxed()
}

/// Numbers from −1 to 1, the same for the same seed.
fn unit_numbers(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// The same robot with the frame of a joint slid along the joint's axis, as the common normals of nearly parallel axes do it.
fn slid(chain: &Chain<f64>, joint: usize, by_m: f64) -> Chain<f64> {
    let mut far = chain.clone();
    let link = chain.link(joint).unwrap();
    let (sa, ca) = link.alpha_rad.sin_cos();
    let (sb, cb) = link.beta_rad.sin_cos();
    let (sg, cg) = link.gamma_rad.sin_cos();
    let axis = [sa * sg + ca * sb * cg, sa * sb * cg - ca * sg, cb * cg];
    for (i, component) in axis.into_iter().enumerate() {
        far.parameters_mut()[8 * joint + i] += by_m * component;
    }
    far.parameters_mut()[8 * (joint + 1) + 2] -= by_m;
    far
}

/// A little changed everywhere, as by a calibration: millimetres and degrees.
fn changed(chain: &Chain<f64>, seed: u64) -> Chain<f64> {
    let mut random = unit_numbers(seed);
    let mut other = chain.clone();
    for value in other.parameters_mut() {
        *value += 0.005 * random();
    }
    other
}

fn assert_taken(chain: &Chain<f64>) {
    assert_eq!(set_of(chain).compile().map(|_| ()), Ok(()), "{:?}", chain.parameters());
}

#[test]
fn every_robot_that_is_built_in_and_every_set_of_the_tests_is_taken() {
    for name in BUILT_IN {
        let chain = open_robot(name).unwrap().chain;
        assert_taken(&chain);
        (0..50).for_each(|seed| assert_taken(&changed(&chain, seed)));
        for joint in (0..chain.joints()).filter(|&joint| chain.joint_kinds()[joint] == JointKind::Revolute) {
            for by_m in [574.24, -507.36, -66.77, 999.0] {
                assert_taken(&slid(&chain, joint, by_m));
            }
        }
    }
    for set in [puma(), calibrated_puma(), two_joints(), largest()] {
        assert_eq!(set.compile().map(|_| ()), Ok(()));
    }
}

#[test]
fn frames_that_were_slid_leave_the_robot_as_it_is() {
    let near = open_robot("ur5e").unwrap().chain;
    let far = slid(&slid(&near, 1, 574.0), 2, -507.0);
    let q = near.joint_vector(&[0.3, -1.1, 2.0, 0.4, -0.9, 1.7]).unwrap();
    let [near_m, far_m] = [&near, &far].map(|chain| Kinematics::new(chain).base_from_tool(&q).translation_m);
    assert!((near_m - far_m).norm() < 1e-9);
    assert!(far.parameters().iter().any(|value| value.abs() > 500.0));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, ..ProptestConfig::default() })]

    #[test]
    fn a_robot_that_makes_sense_is_taken(chain in robot(), seed: u64, joints in any::<[u8; 3]>(), by_m in [-600.0..600.0, -600.0..600.0, -600.0..600.0]) {
        assert_taken(&chain);
        assert_taken(&changed(&chain, seed));
        let slide = |chain: Chain<f64>, (joint, by_m): (&u8, f64)| slid(&chain, usize::from(*joint) % chain.joints(), by_m);
        assert_taken(&joints.iter().zip(by_m).filter(|(joint, _)| {
            chain.joint_kinds()[usize::from(**joint) % chain.joints()] == JointKind::Revolute
        }).fold(chain.clone(), slide));
    }

    #[test]
    fn a_parameter_that_cannot_be_computed_with_is_refused(chain in robot(), index: usize, far: bool) {
        let chain = if far && chain.joint_kinds()[0] == JointKind::Revolute { slid(&chain, 0, 500.0) } else { chain };
        let index = index % chain.parameter_count();
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 3.4e38, -1e30, 1e30, 1e20, -1e10, 1e6, 2_000.0] {
            let mut set = set_of(&chain);
            set.parameters[index] = bad;
            prop_assert!(set.compile().is_err(), "{} = {bad}", Parameter::from_index(index));
        }
        if Parameter::from_index(index).kind() == ParameterKind::Scale {
            for bad in [0.0, -0.0, 1e-4, f32::MIN_POSITIVE] {
                let mut set = set_of(&chain);
                set.parameters[index] = bad;
                prop_assert_eq!(set.compile().map(|_| ()), Err(ParameterSetError::Implausible { index: index as u8 }));
            }
        }
    }

    /// In single precision nothing is left of the robot, though its tool stays near.
    #[test]
    fn lengths_that_cancel_and_take_the_digits_with_them_are_refused(chain in robot(), joint: usize, exponent in 4.0..37.0) {
        let joint = joint % chain.joints();
        prop_assume!(chain.joint_kinds()[joint] == JointKind::Revolute);
        let set = set_of(&slid(&chain, joint, f64::powf(10.0, exponent)));
        let refusal = set.compile().map(|_| ());
        prop_assert!(matches!(refusal, Err(ParameterSetError::Precision { .. } | ParameterSetError::Reach { .. })), "{refusal:?}");
    }
}

#[test]
fn millimetres_that_were_taken_for_metres_are_refused_by_the_length_that_stands_out() {
    let mut set = puma();
    let metres: Vec<usize> = (0..set.parameters.len())
        .filter(|&i| set.chain().unwrap().unit(Parameter::from_index(i)) == ParameterUnit::Metre)
        .collect();
    metres.iter().for_each(|&i| set.parameters[i] *= 1e3);
    let Err(error) = set.compile() else { panic!("taken") };
    let ParameterSetError::Reach { longest } = error else { panic!("{error:?}") };
    let largest_m = metres.iter().map(|&i| set.parameters[i].abs()).fold(0.0, f32::max);
    assert!(largest_m > MAX_REACH_M && set.parameters[usize::from(longest)].abs() == largest_m);
    let words =
        format!("more than 100 m away from the base; the largest length is {}", Parameter::from_index(usize::from(longest)));
    assert!(error.to_string().contains(&words), "{error}");
}

#[test]
fn only_poses_that_the_limits_allow_count_where_they_are_known() {
    // A slide that may go 300 m, and the usual metre of which makes sense.
    let chain = open_robot("stanford").unwrap().chain;
    let set = set_of(&chain);
    let mut ranges = set.usual_ranges();
    let slide = chain.joint_kinds().iter().position(|&kind| kind == JointKind::Prismatic).unwrap();
    assert!(set.compile_within(&ranges).is_ok());
    ranges[slide] = 0.0..=300.0;
    assert!(matches!(set.compile_within(&ranges).map(|_| ()), Err(ParameterSetError::Reach { .. })));
}

#[test]
fn encoders_and_couplings_that_no_robot_has_are_refused() {
    for counts_per_unit in [0.0, -0.0, 1e-30, -0.5, 1e10, 1e30, f32::MAX, f32::NAN, f32::NEG_INFINITY] {
        let mut set = puma();
        set.encoders[3].counts_per_unit = counts_per_unit;
        let expected = ParameterSetError::Encoders(EncoderError::CountsPerUnit { joint: 3 });
        assert_eq!(set.compile().map(|_| ()), Err(expected), "{counts_per_unit}");
    }
    for ratio in [1e5, -1e30, f32::MAX, f32::NAN, f32::INFINITY] {
        let mut set = puma();
        set.couplings[0] = Coupling { ratio, ..set.couplings[0] };
        let expected = ParameterSetError::Encoders(EncoderError::Coupling { joint: 5 });
        assert_eq!(set.compile().map(|_| ()), Err(expected), "{ratio}");
    }
}

#[test]
fn curves_that_no_lvdt_has_are_refused() {
    let nominal = nominal_lvdt(0.075);
    let with = |change: &dyn Fn(&mut LvdtCurve)| {
        let mut curve = nominal;
        change(&mut curve);
        curve
    };
    let falling = with(&|curve| curve.coefficients_m[1] *= -1.0);
    let short = with(&|curve| (curve.code_min, curve.code_max) = (40_000, 40_001));
    for good in [nominal, curve(), falling, short, nominal_lvdt(0.5), nominal_lvdt(1e-3)] {
        assert!(good.is_valid(), "{good:?}");
    }
    let mut bad = vec![
        with(&|curve| curve.coefficients_m = [0.0; 6]),
        with(&|curve| curve.coefficients_m = [0.01, 0.0, 0.0, 0.0, 0.0, 0.0]),
        with(&|curve| curve.coefficients_m[1] = 1e-30),
        with(&|curve| curve.coefficients_m[2] = 0.1),
        with(&|curve| curve.coefficients_m[0] = 2.0),
        with(&|curve| curve.code_max = curve.code_min),
        with(&|curve| (curve.code_min, curve.code_max) = (curve.code_max, curve.code_min)),
    ];
    for power in 0..6 {
        for value in [f32::NAN, f32::INFINITY, f32::MAX, 3.4e38, -1e30, 1e6] {
            bad.push(with(&|curve| curve.coefficients_m[power] = value));
        }
    }
    for curve in bad {
        assert!(!curve.is_valid(), "{curve:?}");
        assert_eq!(ParameterSet { lvdt: curve, ..puma() }.compile().map(|_| ()), Err(ParameterSetError::Lvdt));
    }
}
