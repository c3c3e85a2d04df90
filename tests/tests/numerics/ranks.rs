//! Rank: what random chains and all choices of pairings can identify.

use ballbar::{Chain, JointKind, Measurement, Pairing, Vector3};
use ballbar_calib::identify::{Finding, Identifiability, Observation, Spectrum, bound_by_ends, bound_by_pairings, remarks};
use ballbar_calib::model::JointLimits;
use ballbar_tests::experiment::Puma;
use host_cal::paper::PairingRanks;
use proptest::prelude::*;

fn point(reach_m: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-reach_m..reach_m).prop_map(Vector3::from)
}

/// Three points that do not nearly stand in one line.
fn triangle(reach_m: f64) -> impl Strategy<Value = [Vector3<f64>; 3]> {
    [point(reach_m), point(reach_m), point(reach_m)]
        .prop_filter("nearly in one line", move |[a, b, c]| (b - a).cross(&(c - a)).norm() > 0.1 * reach_m * reach_m)
}

fn chain() -> impl Strategy<Value = Chain<f64>> {
    prop::collection::vec(prop::bool::weighted(0.3), 1..=8).prop_flat_map(|prismatic| {
        let kinds: Vec<JointKind> =
            prismatic.iter().map(|&p| if p { JointKind::Prismatic } else { JointKind::Revolute }).collect();
        let parameters = prop::collection::vec(-1.0..1.0_f64, kinds.len() * 8 + 6);
        parameters.prop_map(move |mut parameters| {
            for scale in parameters.iter_mut().skip(7).step_by(8) {
                *scale = 1.0 + 0.1 * *scale;
            }
            Chain::new(&kinds, &parameters).unwrap()
        })
    })
}

fn measurements(chain: &Chain<f64>, chucks: &[Vector3<f64>], spheres: &[Vector3<f64>], q: &[[f64; 8]]) -> Vec<Measurement<f64>> {
    let rows = q.iter().enumerate();
    rows.map(|(i, q)| {
        let pairing = Pairing { chuck_base_m: chucks[i % chucks.len()], sphere_tool_m: spheres[i / 3 % spheres.len()] };
        Measurement::new(pairing, chain.joint_vector(&q[..chain.joints()]).unwrap(), 1.0)
    })
    .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn nine_pairings_identify_every_independent_parameter_of_a_random_chain(
        chain in chain(),
        chucks in triangle(2.0),
        spheres in triangle(0.5),
        q in prop::collection::vec(prop::array::uniform8(-2.5..2.5_f64), 180),
    ) {
        let limits = vec![JointLimits { min: -2.5, max: 2.5 }; chain.joints()];
        let found = Identifiability::new(&chain, &measurements(&chain, &chucks, &spheres, &q), &limits, &[]);
        prop_assert_eq!(found.spectrum.rank, chain.independent_parameters());
        let (last, first) = found.spectrum.gap().unwrap();
        prop_assert!(last > 1e6 * first, "a visible gap: {:e} {:e}", last, first);
        for (parameter, finding) in found.not_identified() {
            prop_assert!(matches!(finding, Finding::Redundant { .. } | Finding::Weak { .. }), "{} {:?}", parameter, finding);
            if matches!(finding, Finding::Redundant { .. }) {
                prop_assert!(chain.is_conventionally_held(parameter.parse().unwrap()), "{} is free in the paper", parameter);
            }
        }
    }

    #[test]
    fn fewer_chucks_or_spheres_identify_as_many_as_the_rule_says(
        chain in chain(),
        chucks in triangle(2.0),
        spheres in triangle(0.5),
        used in (1..=3_usize, 1..=3_usize),
        q in prop::collection::vec(prop::array::uniform8(-2.5..2.5_f64), 180),
    ) {
        // The rule is a bound that is met where the tool can be turned and moved enough: with four revolute joints or more.
        let kinds = chain.joint_kinds();
        prop_assume!(kinds.iter().filter(|&&kind| kind == JointKind::Revolute).count() >= 4);
        let rows = measurements(&chain, &chucks[..used.0], &spheres[..used.1], &q);
        let rank = Spectrum::new(&Observation::new(&chain, &rows).jacobian).rank;
        prop_assert_eq!(rank, bound_by_ends(&chain, used.0, used.1));
    }
}

#[test]
fn all_511_choices_of_pairings_follow_the_rule() {
    let puma = Puma::default();
    let poses = puma.shells(0.46, 40, 0.0, 1);
    let rows: Vec<_> = poses.rows.iter().map(|row| (row.pairing, row.measurement)).collect();
    let ranks = PairingRanks::new(&puma.design.chain, &rows);
    assert_eq!(ranks.subsets(), 511);
    let classes = ranks.classes(|| ());
    for class in &classes {
        let rule = bound_by_ends(&puma.design.chain, class.chucks, class.spheres);
        assert_eq!((class.min_rank, class.max_rank), (rule, rule), "{class:?}");
    }
    assert_eq!(classes.iter().map(|class| class.subsets).sum::<usize>(), 511);
}

#[test]
fn a_sphere_on_the_last_axis_costs_three_and_a_micrometre_beside_it_shows_in_the_value() {
    let puma = Puma::default();
    let poses = puma.shells(0.46, 40, 0.0, 1);
    let with_sphere = |x_m: f64| {
        let mut rows = poses.measurements();
        for row in &mut rows {
            row.pairing.sphere_tool_m = Vector3::new(x_m, 0.0, 0.05);
        }
        Spectrum::new(&Observation::new(&puma.design.chain, &rows).jacobian)
    };
    assert_eq!(with_sphere(0.05).rank, 33);
    assert_eq!(with_sphere(0.0).rank, 30);
    let beside = with_sphere(1e-6);
    assert_eq!(beside.rank, 33);
    let (last, _) = beside.gap().unwrap();
    assert!(last / beside.singular_values[0] < 1e-5);
}

#[test]
fn more_copies_of_one_pose_do_not_raise_the_rank() {
    let puma = Puma::default();
    let mut rows = puma.shells(0.46, 1, 0.0, 1).measurements();
    let copies: Vec<_> = rows.iter().cycle().take(90).copied().collect();
    rows.extend(copies);
    assert_eq!(Spectrum::new(&Observation::new(&puma.design.chain, &rows).jacobian).rank, 9);
}

#[test]
fn chucks_in_one_line_count_as_two_and_the_advice_says_so() {
    let puma = Puma::default();
    let mut poses = puma.shells(0.46, 20, 0.0, 1);
    let (first_m, second_m) = (puma.rig.chucks[0].position_m, puma.rig.chucks[1].position_m);
    for row in poses.rows.iter_mut().filter(|row| row.pairing.chuck == 2) {
        row.measurement.pairing.chuck_base_m = (first_m + second_m) / 2.0;
    }
    assert_eq!(bound_by_pairings(&puma.design.chain, &poses), 35);
    assert_eq!(Spectrum::new(&Observation::new(&puma.design.chain, &poses.measurements()).jacobian).rank, 35);
    let advice = remarks(&puma.design.chain, &poses, &puma.rig, &puma.design.limits).join(" ");
    assert!(advice.contains("All lengths begin at 3 chucks in one line"), "{advice}");
}
