//! What is said of noise: intervals hold what they promise, stated noise is tested at its rate, and groups of lengths are judged by the others.

use std::path::Path;

use ballbar::{Kinematics, Measurement};
use ballbar_calib::assess::{Answer, Assessment, Evidence, Refusal};
use ballbar_calib::identify::{Fit, FitOptions, GroupKind, Observation, fit};
use ballbar_calib::model::{Dataset, JointTolerance, LinkTolerance, NamedPoint, PairingId, PoseRow, Rig, Robot};
use ballbar_calib::simulate::Shells;
use ballbar_tests::at_length::at_length;
use ballbar_tests::data::real_data;
use ballbar_tests::experiment::Puma;
use host_cal::files::{open_rig, open_robot, read_poses};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const SIGMA_M: f64 = 84e-6;
/// How robots are built here, and their files say so: of the base, and of all else. Metres and radians; a scale.
const BASE: LinkTolerance = LinkTolerance { displacement_m: 5e-3, rotation_rad: 0.008_7 };
const ELSE: LinkTolerance = LinkTolerance { displacement_m: 0.5e-3, rotation_rad: 0.001_7 };
const SCALE: f64 = 1e-3;

/// One robot and its lengths.
struct Drawn {
    truth: Robot,
    lengths: Dataset,
}

/// A design whose file says how well it is built.
fn design(puma: &Puma) -> Robot {
    let mut design = puma.design.clone();
    design.tolerances.links.fill(ELSE);
    design.tolerances.links[0] = BASE;
    design.tolerances.joints.fill(JointTolerance { offset: ELSE.rotation_rad, scale: SCALE });
    design
}

/// A robot as its file says, and lengths on the small shells: one a configuration, or all nine in each of `configurations`, in which every joint
/// stands off by `joint_rad`.
fn drawn(puma: &Puma, design: &Robot, per_pairing: usize, configurations: Option<usize>, joint_rad: f64, seed: u64) -> Drawn {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut truth = design.clone();
    for (index, value) in truth.chain.parameters_mut().iter_mut().enumerate() {
        let of = if index < 6 { BASE } else { ELSE };
        let by = [of.displacement_m, of.displacement_m, of.displacement_m, of.rotation_rad, of.rotation_rad, of.rotation_rad];
        let by = by.into_iter().chain([ELSE.rotation_rad, SCALE]).nth(index % 8).unwrap();
        *value += by * rng.sample::<f64, _>(StandardNormal);
    }
    let pairings = puma.rig.all_pairings();
    let shells = Shells {
        planned_with: design,
        truth: &truth,
        rig: &puma.rig,
        pairings: &pairings,
        bar_m: 0.46,
        per_pairing,
        sigma_m: 0.0,
        seed,
    };
    let poses: Vec<PoseRow> = shells.simulate(|| ()).unwrap().into_iter().map(|pose| pose.row).collect();
    let count = configurations.unwrap_or(poses.len());
    let kinematics = Kinematics::new(&truth.chain);
    let mut rows = Vec::new();
    for row in (0..count).map(|i| &poses[i * poses.len() / count]) {
        let mut q = row.measurement.q;
        q.as_array_mut()[..6].iter_mut().for_each(|q| *q += joint_rad * rng.sample::<f64, _>(StandardNormal));
        for &pairing in pairings.iter().filter(|&&pairing| configurations.is_some() || pairing == row.pairing) {
            let mut own = PoseRow { pairing, sigma_m: Some(SIGMA_M), ..row.clone() };
            own.measurement.pairing = puma.rig.pairing(pairing);
            own.measurement.length_m =
                kinematics.length(&q, &own.measurement.pairing) + SIGMA_M * rng.sample::<f64, _>(StandardNormal);
            rows.push(own);
        }
    }
    Drawn { truth, lengths: Dataset::new("simulated", rows).unwrap() }
}

fn without_sigma(lengths: &Dataset) -> Dataset {
    let rows = lengths.rows.iter().map(|row| PoseRow { sigma_m: None, ..row.clone() }).collect();
    Dataset::new("simulated", rows).unwrap()
}

/// Of how many coordinates of a sphere, of how many, in random joint vectors, intervals of 68.3 and 95.4 % hold the truth.
fn held(design: &Robot, puma: &Puma, truth: &Robot, found: &Fit, seed: u64) -> [usize; 3] {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let uncertainty = &found.uncertainty;
    let moved: Vec<usize> = (0..found.parameters.len()).filter(|&i| found.parameters[i].held.is_none()).collect();
    let (of_truth, of_fit) = (Kinematics::new(&truth.chain), Kinematics::new(&found.solution.chain));
    let mut counts = [0; 3];
    for at in 0..30 {
        let q: Vec<f64> = design.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
        // The distance from a point far away is a coordinate.
        let mut far_m = [0.0; 3];
        far_m[at % 3] = 100.0;
        let rig = Rig::new(vec![NamedPoint::new("A", far_m)], vec![puma.rig.spheres[0].clone()], None).unwrap();
        let pairing = rig.pairing(PairingId { chuck: 0, sphere: 0 });
        let measurement = Measurement::new(pairing, truth.chain.joint_vector(&q).unwrap(), 100.0);
        let by = Observation::new(&found.solution.chain, &[measurement]).columns(&moved);
        let deviation_m = (&by * &uncertainty.covariance * by.transpose())[(0, 0)].sqrt();
        let error_m = (of_fit.length(&measurement.q, &pairing) - of_truth.length(&measurement.q, &pairing)).abs();
        counts[0] += usize::from(error_m < uncertainty.interval(0.683) * deviation_m);
        counts[1] += usize::from(error_m < uncertainty.interval(0.954) * deviation_m);
        counts[2] += 1;
    }
    counts
}

#[test]
fn intervals_at_the_tool_hold_what_they_promise() {
    let puma = Puma::default();
    let design = design(&puma);
    for (name, per_pairing, configurations, joint_deg) in
        [("40 × 9, 0.01°", 5, Some(40), 0.01_f64), ("45", 5, None, 0.0), ("117", 13, None, 0.0)]
    {
        let mut counts = [0; 3];
        for seed in 0..at_length(40) as u64 {
            let drawn = drawn(&puma, &design, per_pairing, configurations, joint_deg.to_radians(), 1000 + seed);
            let found = fit(&design, &without_sigma(&drawn.lengths), &FitOptions::default()).unwrap();
            assert_eq!(found.uncertainty.shared.is_some(), configurations.is_some());
            let held = held(&design, &puma, &drawn.truth, &found, seed);
            counts.iter_mut().zip(held).for_each(|(sum, own)| *sum += own);
        }
        let [usual, most] = [0, 1].map(|i| counts[i] as f64 / counts[2] as f64);
        println!("{name}: {:.1} and {:.1} %", 100.0 * usual, 100.0 * most);
        // Thirty coordinates of one robot are no thirty proofs: they are off together.
        assert!((0.60..0.76).contains(&usual) && (0.91..0.985).contains(&most), "{name}: {usual} {most}");
    }
}

#[test]
fn errors_of_joints_are_found_and_said_and_independent_lengths_are_not_accused() {
    let puma = Puma::default();
    let design = design(&puma);
    let said = |drawn: &Drawn| {
        let lengths = without_sigma(&drawn.lengths);
        let found = fit(&design, &lengths, &FitOptions::default()).unwrap();
        let reasons = Assessment::new(&Evidence::new(&design, &puma.rig, &lengths, &found)).reasons;
        (found, reasons.into_iter().any(|reason| reason.starts_with("Lengths of one configuration share")))
    };
    for seed in 0..at_length(5) as u64 {
        let (found, is_said) = said(&drawn(&puma, &design, 5, Some(40), 0.01_f64.to_radians(), seed));
        let shared = found.uncertainty.shared.unwrap();
        assert!((shared.joint.to_degrees() - 0.01).abs() < 0.003 && (shared.own_m / SIGMA_M - 1.0).abs() < 0.2, "{shared:?}");
        assert!(shared.factor > 1.25 && is_said, "{shared:?}");
        let (found, is_said) = said(&drawn(&puma, &design, 5, Some(40), 0.0, seed));
        assert!(!is_said, "{:?}", found.uncertainty.shared);
    }
}

#[test]
fn noise_that_is_as_stated_is_not_called_wrong() {
    let puma = Puma::default();
    let design = design(&puma);
    for (per_pairing, runs) in [(5, at_length(60)), (90, at_length(6))] {
        let is_accused = |&seed: &u64| {
            let drawn = drawn(&puma, &design, per_pairing, None, 0.0, seed);
            let found = fit(&design, &drawn.lengths, &FitOptions::default()).unwrap();
            found.uncertainty.noise_test(SIGMA_M).is_some_and(|test| test.is_more() || test.is_less())
        };
        let accused = (0..runs as u64).filter(is_accused).count();
        println!("{} lengths: {accused} of {runs}", 9 * per_pairing);
        // One in a thousand is promised.
        assert!(accused <= 1 + runs / 200, "{per_pairing}: {accused} of {runs}");
    }
}

/// Lengths of two bars, of which one is off by so much; in what looks like two places.
fn of_two_bars(puma: &Puma, off_m: f64, seed: u64) -> Dataset {
    let rows = |bar_m: f64, off_m: f64| {
        let mut rows = puma.shells(bar_m, 20, SIGMA_M, seed).rows;
        rows.iter_mut().for_each(|row| {
            row.bar_m = Some(bar_m);
            row.measurement.length_m += off_m;
        });
        rows
    };
    let mut lengths = Dataset::new("short", rows(0.46, 0.0)).unwrap();
    lengths.append("long", rows(0.61, off_m)).unwrap();
    lengths
}

#[test]
fn a_bar_that_is_off_is_said_and_good_ones_are_not() {
    let puma = Puma::default();
    let assessed = |off_m: f64, seed: u64| {
        let lengths = of_two_bars(&puma, off_m, seed);
        let found = fit(&puma.design, &lengths, &FitOptions::default()).unwrap();
        Assessment::new(&Evidence::new(&puma.design, &puma.rig, &lengths, &found))
    };
    for seed in 0..at_length(6) as u64 {
        let good = assessed(0.0, seed);
        let kinds: Vec<GroupKind> = good.by_group.iter().map(|kind| kind.kind).collect();
        // Two files are the same parts as two bars.
        assert_eq!(kinds, [GroupKind::Bar, GroupKind::Pairing, GroupKind::Block]);
        assert_eq!(good.answer, Answer::Calibrated, "{:?}", good.reasons);
        let bars = &good.by_group[0];
        assert!(bars.after_m < 0.2e-3 && bars.before_m > 5e-3 && bars.groups.len() == 2, "{bars:?}");
        let off = assessed(1e-3, seed);
        let said = off.reasons.iter().find(|reason| reason.starts_with("Lengths of bar "));
        assert!(said.is_some_and(|said| said.contains("times worse when none of them is fitted")), "{:?}", off.reasons);
    }
}

#[test]
fn a_group_that_the_design_predicts_better_is_refused() {
    let puma = Puma::default();
    // The design is right, and a long bar is not.
    let right = Puma { truth: puma.design.clone(), ..Puma::default() };
    let lengths = of_two_bars(&right, 3e-3, 1);
    let found = fit(&right.design, &lengths, &FitOptions::default()).unwrap();
    let assessment = Assessment::new(&Evidence::new(&right.design, &right.rig, &lengths, &found));
    println!("{:?} {:#?}", assessment.refusals, assessment.reasons);
    let is_group = |refusal: &Refusal| matches!(refusal, Refusal::Worse { name, .. } if name.contains("while none of them"));
    assert!(assessment.refusals.iter().any(is_group), "{:?}", assessment.reasons);
}

/// What is said of a set of real or sent measurements.
fn reasons(robot: &str, rig: &str, poses: &str) -> Option<Vec<String>> {
    let folder = real_data(".")?;
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let (robot, rig) =
        (open_robot(&path(robot)).unwrap(), open_rig(&if rig == "triangles" { rig.to_owned() } else { path(rig) }).unwrap());
    let lengths = read_poses([Path::new(&path(poses))], &robot, &rig).unwrap();
    let found = fit(&robot, &lengths, &FitOptions::default()).unwrap();
    let assessment = Assessment::new(&Evidence::new(&robot, &rig, &lengths, &found));
    println!("{poses}: {:?} {:#?} {:?}", assessment.answer, assessment.reasons, found.uncertainty.shared);
    for kind in &assessment.by_group {
        println!("{:?} {:.3} {:.3} {:?}", kind.kind, kind.before_m * 1e3, kind.after_m * 1e3, kind.worst());
    }
    Some(assessment.reasons)
}

#[test]
fn joints_that_hardly_moved_are_said_of_the_cable_set_alone() {
    let Some(of_cable) = reasons("robotcali_irb120/robot.toml", "robotcali_irb120/rig.toml", "robotcali_irb120/poses.csv") else {
        return;
    };
    let of_probe = reasons("irb120/robot.toml", "irb120/rig.toml", "irb120/poses.csv").unwrap();
    let is_narrow = |reason: &String| reason.starts_with("Joints were measured in less than a fifth of their range");
    assert!(of_cable.last().is_some_and(is_narrow), "{of_cable:?}");
    assert!(!of_probe.iter().any(is_narrow), "{of_probe:?}");
}

#[test]
fn a_chuck_that_is_off_is_told_from_stated_noise() {
    let case = "cases/chuck_off";
    let Some(said) = reasons(&format!("{case}/design.toml"), &format!("{case}/rig_B_2mm_off.toml"), &format!("{case}/poses.csv"))
    else {
        return;
    };
    assert!(said.iter().any(|reason| reason.contains("times the noise that the poses state (χ²")), "{said:?}");
}
