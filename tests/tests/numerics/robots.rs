//! The built-in robots: where they stand beside independent numbers, and what can be identified of each.

use ballbar::{JointKind, JointVector, Kinematics, Matrix3, Measurement, Pairing, Vector3};
use ballbar_calib::identify::Identifiability;
use ballbar_calib::model::Robot;
use host_cal::files::{ROBOTS, open_robot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Where a robot's tool stands. The numbers were computed apart from this library: from the Denavit-Hartenberg rows that the
/// robot's file names as its source and, for `puma560-optimised`, from Table II.
struct Golden {
    robot: &'static str,
    /// Degrees, or millimetres of a prismatic joint.
    q: &'static [f64],
    position_mm: [f64; 3],
    /// Rows; base from tool.
    rotation: Option<[[f64; 3]; 3]>,
}

const fn at(robot: &'static str, q: &'static [f64], position_mm: [f64; 3]) -> Golden {
    Golden { robot, q, position_mm, rotation: None }
}

impl Golden {
    const fn turned(self, rotation: [[f64; 3]; 3]) -> Self {
        Self { rotation: Some(rotation), ..self }
    }
}

const GOLDEN: [Golden; 17] = [
    at("puma560", &[0.0; 6], [411.48, 149.09, 1149.72]).turned([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    at("puma560", &[10.0, -40.0, 100.0, 20.0, -30.0, 50.0], [689.412934395, 263.184344755, 1219.333350337]),
    at("puma560", &[-120.0, -150.0, 60.0, -75.0, 80.0, -200.0], [491.170281668, 659.567647805, 870.317393876]).turned([
        [0.675869317141, 0.007467391486, -0.736983652609],
        [0.678365689114, 0.384619656231, 0.626009354463],
        [0.288133056037, -0.923044938291, 0.254887002244],
    ]),
    at("puma560-optimised", &[0.0; 6], [422.726744372, 147.713408221, 1153.332444392]),
    at("puma560-optimised", &[10.0, -40.0, 100.0, 20.0, -30.0, 50.0], [703.922751499, 262.322290436, 1228.266724090]).turned([
        [0.292331403491, -0.798829534883, 0.525750629796],
        [0.952310581674, 0.293438008639, -0.083658180226],
        [-0.087446592648, 0.525133801316, 0.846514963926],
    ]),
    at("irb120", &[0.0; 6], [374.0, 0.0, 630.0]).turned([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
    at("irb120", &[10.0, 20.0, -30.0, 40.0, 50.0, 60.0], [417.819599647, 109.672868487, 631.522418878]),
    at("irb120", &[-120.0, 75.0, -90.0, -110.0, -65.0, 200.0], [-231.676471708, -523.913126424, 491.977018909]),
    at("ur5e", &[0.0; 6], [-817.2, -232.9, 62.8]).turned([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    at("ur5e", &[10.0, -80.0, 70.0, -60.0, 50.0, 30.0], [-536.751505297, -295.009422693, 686.745394537]),
    at("ur5e", &[-135.0, -45.0, -110.0, 200.0, -75.0, 310.0], [-249.282378232, -24.311580151, 626.300783283]),
    at("stanford", &[0.0, 0.0, 500.0, 0.0, 0.0, 0.0], [0.0, 154.0, 1175.0]).turned([
        [0.0, 1.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
    ]),
    at("stanford", &[30.0, 60.0, 700.0, -40.0, 50.0, 20.0], [595.881117716, 343.645604614, 958.678782626]).turned([
        [-0.253277765429, 0.787200899739, 0.562285618694],
        [-0.934376149672, -0.048509292089, -0.352970337996],
        [-0.250582490337, -0.614785809881, 0.747828070819],
    ]),
    at("scara", &[0.0; 4], [600.0, 0.0, 387.0]).turned([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]),
    at("scara", &[30.0, -60.0, 120.0, 45.0], [519.615242271, 25.0, 267.0]),
    at("scara", &[-95.0, 140.0, 210.0, -300.0], [166.128748433, -129.308912054, 177.0]),
    // A whole turn of every joint of the robot that has room for it leads back to where it was.
    at("ur5e", &[360.0; 6], [-817.2, -232.9, 62.8]).turned([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
];

/// A joint vector of file units, SI.
fn joint_vector(robot: &Robot, q: &[f64]) -> JointVector<f64> {
    let to_si = |(kind, value): (&JointKind, &f64)| match kind {
        JointKind::Revolute => value.to_radians(),
        JointKind::Prismatic => value / 1e3,
    };
    assert_eq!(q.len(), robot.chain.joints());
    robot.chain.joint_vector(&robot.chain.joint_kinds().iter().zip(q).map(to_si).collect::<Vec<_>>()).unwrap()
}

#[test]
fn every_robot_stands_where_its_sources_say() {
    for (name, _) in ROBOTS {
        assert!(GOLDEN.iter().any(|golden| golden.robot == name), "no numbers for {name}");
    }
    for Golden { robot: name, q, position_mm, rotation } in GOLDEN {
        let robot = open_robot(name).unwrap();
        let pose = Kinematics::new(&robot.chain).base_from_tool(&joint_vector(&robot, q));
        let off_mm = (pose.translation_m * 1e3 - Vector3::from(position_mm)).amax();
        assert!(off_mm <= 1e-6, "{name} at {q:?}: {} mm, off by {off_mm:e}", pose.translation_m.transpose() * 1e3);
        if let Some(rows) = rotation {
            let off = (pose.rotation - Matrix3::from_fn(|row, column| rows[row][column])).amax();
            assert!(off <= 1e-9, "{name} at {q:?}: rotation {}, off by {off:e}", pose.rotation);
        }
    }
}

/// Product manual IRB 120, 3HAC035728-001 revision W, section 2.2.2: angles of axes 2 and 3 in degrees, x and z in millimetres.
/// Its positions D and H are misprints (see `host/app/robots/irb120.toml`).
const ABB_WRIST_CENTRES: [(char, [f64; 2], [f64; 2]); 7] = [
    ('A', [0.0, 0.0], [302.0, 630.0]),
    ('B', [0.0, -77.0], [0.0, 870.0]),
    ('C', [0.0, 70.0], [169.0, 300.0]),
    ('E', [110.0, -77.0], [545.0, 91.0]),
    ('F', [-110.0, -110.0], [-440.0, -50.0]),
    ('G', [-110.0, 70.0], [-67.0, 445.0]),
    ('J', [-110.0, -77.0], [-545.0, 91.0]),
];

#[test]
fn the_irb120s_wrist_centre_is_where_abb_prints_it() {
    let robot = open_robot("irb120").unwrap();
    let kinematics = Kinematics::new(&robot.chain);
    // The wrist centre lies 72 mm behind the flange.
    let wrist_tool_m = Vector3::new(0.0, 0.0, -0.072);
    for (position, [q2, q3], [x_mm, z_mm]) in ABB_WRIST_CENTRES {
        let q = joint_vector(&robot, &[0.0, q2, q3, 0.0, 0.0, 0.0]);
        let found_mm = kinematics.point_in_base(&q, &wrist_tool_m) * 1e3;
        let off_mm = (found_mm - Vector3::new(x_mm, 0.0, z_mm)).amax();
        assert!(off_mm <= 1.0, "{position}: {} mm, off by {off_mm}", found_mm.transpose());
    }
}

#[test]
fn limits_are_one_a_joint_and_include_their_ends_and_middle() {
    for (name, _) in ROBOTS {
        let robot = open_robot(name).unwrap();
        assert_eq!(robot.limits.len(), robot.chain.joints(), "{name}");
        assert_eq!(robot.encoders.len(), robot.chain.joints(), "{name}");
        for limits in &robot.limits {
            let (middle, range) = ((limits.min + limits.max) / 2.0, limits.max - limits.min);
            assert!([limits.min, middle, limits.max].iter().all(|&q| limits.contain(q)), "{name}: {limits:?}");
            assert!(
                ![limits.min - 1e-9 * range, limits.max + 1e-9 * range, f64::NAN].iter().any(|&q| limits.contain(q)),
                "{name}"
            );
            // Degrees taken for radians, or millimetres for metres, would show here: the widest is the IRB 120's ±400°.
            assert!(range <= 14.0, "{name}: {limits:?}");
        }
    }
}

/// Lengths of all nine pairings of three random chucks and three random spheres, at random poses within the limits.
fn random_measurements(robot: &Robot, seed: u64) -> Vec<Measurement<f64>> {
    const POSES: usize = 40;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut points = |reach_m: f64| -> [Vector3<f64>; 3] {
        std::array::from_fn(|_| Vector3::from_fn(|_, _| rng.random_range(-reach_m..reach_m)))
    };
    let (chucks, spheres) = (points(0.5), points(0.15));
    let kinematics = Kinematics::new(&robot.chain);
    let pairings = (0..9).map(|i| Pairing { chuck_base_m: chucks[i / 3], sphere_tool_m: spheres[i % 3] });
    let measurement = |pairing: Pairing<f64>| {
        let q: Vec<f64> = robot.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
        let q = robot.chain.joint_vector(&q).unwrap();
        Measurement::new(pairing, q, kinematics.length(&q, &pairing))
    };
    pairings.flat_map(|pairing| [pairing; POSES]).map(measurement).collect()
}

#[test]
fn nine_pairings_identify_all_that_is_independent_and_nothing_but_redundancy_is_left() {
    for (name, _) in ROBOTS {
        let robot = open_robot(name).unwrap();
        for seed in 0..3 {
            let found = Identifiability::new(&robot.chain, &random_measurements(&robot, seed), &robot.limits, &[]);
            let independent = robot.chain.independent_parameters();
            let values = &found.spectrum.singular_values;
            assert_eq!(found.spectrum.rank, independent, "{name}, seed {seed}: {values:?}");
            assert_eq!(found.identified().len(), independent, "{name}, seed {seed}");
            for (parameter, finding) in found.not_identified() {
                assert_eq!(finding.kind(), "redundant", "{name}, seed {seed}, {parameter}: {finding}");
            }
        }
    }
}
