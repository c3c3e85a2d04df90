//! What tolerances are worth where lengths say little, and that they cost nothing where lengths say enough.

use std::path::Path;

use ballbar::{Chain, JointKind, Kinematics, Vector3};
use ballbar_calib::assess::{Answer, Assessment, Evidence};
use ballbar_calib::identify::{Fit, FitOptions, Hold, HoldRule, Part, fit};
use ballbar_calib::model::{Dataset, LinkTolerance, PairingId, Rig, Robot};
use ballbar_tests::at_length::at_length;
use ballbar_tests::data::real_data;
use ballbar_tests::experiment::{Cell, Puma};
use ballbar_tests::tool::{at_spheres_aligned_m, at_spheres_m};
use host_cal::files::{open_rig, open_robot, read_poses};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const SIGMA_M: f64 = 84e-6;

/// A robot as it may be built: 0.5 mm, 0.1° and 1e-3 from its design, and standing 5 mm and 0.5° from where its file says.
fn as_built(design: &Chain<f64>, seed: u64) -> Chain<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut built = design.clone();
    for (index, value) in built.parameters_mut().iter_mut().enumerate() {
        let base = if index < 6 { 10.0 } else { 1.0 };
        let angle = if index < 6 { 5.0 } else { 1.0 };
        let by = match index % 8 {
            0..3 => 0.5e-3 * base,
            3..7 => 0.1_f64.to_radians() * angle,
            _ => 1e-3,
        };
        *value += by * rng.sample::<f64, _>(StandardNormal);
    }
    built
}

/// Lengths of some pairings on the small shell.
fn lengths(puma: &Puma, truth: &Robot, pairings: &[PairingId], per_pairing: usize, seed: u64) -> Dataset {
    let cell = Cell { design: puma.design.clone(), truth: truth.clone(), rig: puma.rig.clone() };
    cell.measured_at(pairings, 0.46, per_pairing, SIGMA_M, seed)
}

/// Errors at the spheres of the design and of a fit, metres, for many robots as they may be built.
fn errors(pairings: &[PairingId], per_pairing: usize, runs: usize) -> Vec<(f64, f64)> {
    let puma = Puma::default();
    let run = |seed: u64| {
        let truth = Robot { chain: as_built(&puma.design.chain, seed), ..puma.design.clone() };
        let poses = lengths(&puma, &truth, pairings, per_pairing, seed);
        let found = fit(&puma.design, &poses, &FitOptions::default()).unwrap();
        let error = |chain: &Chain<f64>| at_spheres_m(&truth.chain, chain, &puma.design, &puma.rig);
        (error(&puma.design.chain), error(&found.solution.chain))
    };
    (0..runs as u64).map(run).collect()
}

fn open(path: &Path) -> Robot {
    open_robot(path.to_str().unwrap()).unwrap()
}

fn open_rig_at(path: &Path) -> Rig {
    open_rig(path.to_str().unwrap()).unwrap()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn few_lengths_of_one_pairing_do_no_harm() {
    let found = errors(&[PairingId { chuck: 0, sphere: 0 }], 90, at_length(10));
    let worse = found.iter().filter(|(before, after)| after > before).count();
    let (before, after) = (median(found.iter().map(|e| e.0).collect()), median(found.iter().map(|e| e.1).collect()));
    println!("one pairing: {worse} of {} worse; median {:.2} mm, design {:.2}", found.len(), after * 1e3, before * 1e3);
    // One in fifty at most.
    assert!(worse * 50 <= found.len().max(50), "{worse} of {}: {found:?}", found.len());
    assert!(after < 0.85 * before, "{after} {before}");
}

#[test]
fn one_sphere_and_few_lengths_of_nine_pairings_are_fitted_far_better_than_without_tolerances() {
    let chucks: Vec<PairingId> = (0..3).map(|chuck| PairingId { chuck, sphere: 0 }).collect();
    let one_sphere = median(errors(&chucks, 30, at_length(10)).into_iter().map(|e| e.1).collect());
    let nine = median(errors(&Puma::default().rig.all_pairings(), 5, at_length(10)).into_iter().map(|e| e.1).collect());
    println!("one sphere {:.3} mm, nine pairings {:.3} mm", one_sphere * 1e3, nine * 1e3);
    assert!(one_sphere < 0.62e-3, "{one_sphere}");
    assert!(nine < 1.35e-3, "{nine}");
}

#[test]
fn many_lengths_decide_by_themselves() {
    let puma = Puma::default();
    let poses = puma.shells(0.46, 90, SIGMA_M, 3);
    let [with, without] =
        [FitOptions::default(), FitOptions::plain()].map(|options| fit(&puma.design, &poses, &options).unwrap());
    let apart_m = at_spheres_m(&with.solution.chain, &without.solution.chain, &puma.design, &puma.rig);
    assert!(apart_m < 0.02e-3, "{apart_m:e}");
    assert!(with.uncertainty.told > 35.5, "{}", with.uncertainty.told);
    assert_eq!(without.uncertainty.told, 36.0);
}

/// How far the tools of two fits are apart, metres.
fn apart_m(a: &Fit, b: &Fit, puma: &Puma) -> f64 {
    at_spheres_m(&a.solution.chain, &b.solution.chain, &puma.design, &puma.rig)
}

#[test]
fn the_result_does_not_depend_on_which_redundant_parameters_are_held() {
    let puma = Puma::default();
    // So few that tolerances matter.
    let truth = Robot { chain: as_built(&puma.design.chain, 4), ..puma.design.clone() };
    let poses = lengths(&puma, &truth, &puma.rig.all_pairings(), 5, 4);
    let usual = fit(&puma.design, &poses, &FitOptions::default()).unwrap();
    assert_eq!(usual.free_parameters(), 36);
    let around = |rule: HoldRule, names: &[&str]| {
        let names = names.iter().map(|name| name.parse().unwrap()).collect();
        fit(&puma.design, &poses, &FitOptions { hold: Hold { rule, names }, ..FitOptions::default() }).unwrap()
    };
    // What is held is redundant to first order: behind a turn of a tenth of a degree, a link of 0.4 m is off by a micrometre.
    const SECOND_ORDER_M: f64 = 3e-6;
    for (rule, names) in [(HoldRule::Paper, &[][..]), (HoldRule::Auto, &["alpha2"]), (HoldRule::Auto, &["beta2"])] {
        let other = around(rule, names);
        assert_eq!(other.free_parameters(), 36, "{names:?}");
        assert!(apart_m(&usual, &other, &puma) < SECOND_ORDER_M, "{names:?}: {:e}", apart_m(&usual, &other, &puma));
    }
}

#[test]
fn a_part_that_is_known_exactly_stays() {
    let puma = Puma::default();
    let mut design = puma.design.clone();
    design.tolerances.links[2] = LinkTolerance { displacement_m: 0.0, rotation_rad: 0.0 };
    design.tolerances.joints[4].scale = 0.0;
    let found = fit(&design, &puma.shells(0.46, 20, SIGMA_M, 5), &FitOptions::default()).unwrap();
    // What is known of it in other frames is how far apart its two axes are, which are parallel, and that they are.
    let link = |chain: &Chain<f64>| chain.link(2).unwrap();
    let distance_m = |chain: &Chain<f64>| link(chain).translation_m.xy().norm();
    let apart_m = distance_m(&found.solution.chain) - distance_m(&design.chain);
    assert!(apart_m.abs() < 1e-9, "{apart_m:e}");
    assert!(link(&found.solution.chain).beta_rad.abs() < 1e-9);
    assert_eq!(found.solution.chain.joint(4).unwrap().scale, design.chain.joint(4).unwrap().scale);
    assert!(found.free_parameters() < 36);
}

#[test]
fn a_lost_zero_is_found_and_named() {
    let puma = Puma::default();
    for (joint, by_deg) in [(2, 25.0_f64), (3, -12.0), (5, 6.0), (4, 30.0)] {
        let mut truth = Robot { chain: as_built(&puma.design.chain, joint as u64), ..puma.design.clone() };
        truth.chain.parameters_mut()[(joint - 1) * 8 + 6] += by_deg.to_radians();
        let poses = lengths(&puma, &truth, &puma.rig.all_pairings(), 20, 1);
        let found = fit(&puma.design, &poses, &FitOptions::default()).unwrap();
        let released = &found.prior.as_ref().unwrap().released;
        let lost: Vec<_> = released.iter().filter(|released| matches!(released.part, Part::Offset(..))).collect();
        assert_eq!(lost.len(), 1, "joint {joint}: {released:?}");
        assert_eq!(lost[0].part, Part::Offset(joint, JointKind::Revolute));
        assert!((lost[0].change.to_degrees() - by_deg).abs() < 1.0, "joint {joint}: {released:?}");
        let off_m = at_spheres_m(&truth.chain, &found.solution.chain, &puma.design, &puma.rig);
        assert!(off_m < 0.5e-3, "joint {joint}: {off_m:e}");
        let assessment = Assessment::new(&Evidence::new(&puma.design, &puma.rig, &poses, &found));
        assert_eq!(assessment.answer, Answer::Reserved, "{:?}", assessment.reasons);
        let named = format!("The zero of joint {joint} is off by");
        assert!(assessment.reasons.iter().any(|reason| reason.starts_with(&named)), "{:?}", assessment.reasons);
    }
}

#[test]
fn a_zero_that_somebody_lost_is_found_and_named() {
    let Some(folder) = real_data("cases/mastering") else { return };
    let (design, truth) = (open(&folder.join("design.toml")), open(&folder.join("true.toml")));
    let rig = open_rig("triangles").unwrap();
    let poses = read_poses([folder.join("poses.csv").as_path()], &design, &rig).unwrap();
    let found = fit(&design, &poses, &FitOptions::default()).unwrap();
    assert!((found.fitted.rms_m - 43.6e-6).abs() < 0.5e-6, "{:e}", found.fitted.rms_m);
    let off_m = at_spheres_aligned_m(&truth.chain, &found.solution.chain, &design, &rig);
    assert!(off_m < 0.07e-3, "{off_m:e}");
    let assessment = Assessment::new(&Evidence::new(&design, &rig, &poses, &found));
    let said = assessment.reasons.iter().any(|reason| reason.starts_with("The zero of joint 2 is off by +25.0°"));
    assert!(assessment.answer == Answer::Reserved && said, "{:?}", assessment.reasons);
}

/// Scatter of the ball in its sockets, as a robot's parameters have it: RMS distance from where it is on average in each, metres.
fn scatter_m(folder: &Path, place: &str, chain: &Chain<f64>, sphere: &Vector3<f64>) -> f64 {
    let text = std::fs::read_to_string(folder.join("sockets.csv")).unwrap();
    let kinematics = Kinematics::new(chain);
    let mut sockets: [Vec<Vector3<f64>>; 2] = Default::default();
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        if cells[0] == place {
            let q: Vec<f64> = cells[2..].iter().map(|deg| deg.parse::<f64>().unwrap().to_radians()).collect();
            let tool = kinematics.base_from_tool(&chain.joint_vector(&q).unwrap());
            sockets[cells[1].parse::<usize>().unwrap()].push(tool.rotation * sphere + tool.translation_m);
        }
    }
    let squares = sockets.iter().flat_map(|points_m| {
        let centre_m = points_m.iter().sum::<Vector3<f64>>() / points_m.len() as f64;
        points_m.iter().map(move |point_m| (point_m - centre_m).norm_squared())
    });
    let squares: Vec<f64> = squares.collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

#[test]
fn real_robots_fitted_at_one_place_are_better_at_the_others() {
    for (robot, fitted, elsewhere) in [
        ("panda_6", "front", &[("left", 0.248e-3), ("right", 0.315e-3)][..]),
        ("kuka_14", "front", &[("raised_left", 0.5e-3), ("left_back", 0.2e-3)]),
    ] {
        let Some(folder) = real_data(&format!("mukca/{robot}")) else { return };
        let design = open(&folder.join("robot.toml"));
        let rig = open_rig_at(&folder.join(format!("rig_{fitted}.toml")));
        let poses = read_poses([folder.join(format!("poses_{fitted}.csv")).as_path()], &design, &rig).unwrap();
        let found = fit(&design, &poses, &FitOptions::default()).unwrap();
        for (place, most_m) in elsewhere {
            let off_m = scatter_m(&folder, place, &found.solution.chain, &rig.spheres[0].position_m);
            println!("{robot} {place}: {:.3} mm", off_m * 1e3);
            assert!(off_m <= *most_m, "{robot} {place}: {off_m:e}");
        }
    }
}

#[test]
fn all_recordings_of_real_pandas_reach_a_minimum() {
    for robot in ["panda_2", "panda_6"] {
        let Some(folder) = real_data(&format!("mukca/{robot}")) else { return };
        let design = open(&folder.join("robot.toml"));
        for entry in std::fs::read_dir(&folder).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            let Some(place) = name.strip_prefix("rig_").and_then(|name| name.strip_suffix(".toml")) else { continue };
            let rig = open_rig_at(&folder.join(&name));
            let poses = read_poses([folder.join(format!("poses_{place}.csv")).as_path()], &design, &rig).unwrap();
            let found = fit(&design, &poses, &FitOptions::default()).unwrap();
            assert!(found.solution.status.is_minimum(), "{robot} {place}: {:?}", found.solution.status);
        }
    }
}
