//! What the report takes for a proof: lengths of one posture prove nothing of one another, and the worst proof decides.

use ballbar::Kinematics;
use ballbar_calib::assess::{Assessment, Evidence, ProofKind};
use ballbar_calib::identify::{Fit, FitOptions, fit};
use ballbar_calib::model::{Dataset, PairingId, PoseRow};
use ballbar_tests::at_length::at_length;
use ballbar_tests::command::host_cal_in;
use ballbar_tests::data::real_data;
use ballbar_tests::experiment::{Puma, dataset};
use ballbar_tests::shells::{DESIGN, puma, runs};
use host_cal::report::{Facts, Inputs};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Every posture of the shells measured to all three spheres: with an error that the three lengths share, and one of each.
fn three_lengths_a_posture(puma: &Puma, per_pairing: usize, jitter_rad: f64, seed: u64) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (shared, own) = (Normal::new(0.0, 300e-6).unwrap(), Normal::new(0.0, 30e-6).unwrap());
    let truth = Kinematics::new(&puma.truth.chain);
    let mut rows = Vec::new();
    for row in puma.shells(0.46, per_pairing, 0.0, seed).rows {
        let shared_m = shared.sample(&mut rng);
        for sphere in 0..puma.rig.spheres.len() {
            let pairing = PairingId { chuck: row.pairing.chuck, sphere };
            let mut other = PoseRow { pairing, ..row.clone() };
            other.measurement.pairing = puma.rig.pairing(pairing);
            other.measurement.length_m =
                truth.length(&row.measurement.q, &other.measurement.pairing) + shared_m + own.sample(&mut rng);
            other.measurement.q.as_array_mut()[0] += jitter_rad * sphere as f64;
            other.number = rows.len() + 1;
            rows.push(other);
        }
    }
    dataset(rows)
}

fn fitted(puma: &Puma, rows: &Dataset) -> Fit {
    fit(&puma.design, rows, &FitOptions::default()).expect("enough poses")
}

fn facts(puma: &Puma, rows: &Dataset, fit: &Fit, unseen: &[(String, &Dataset)]) -> Facts {
    let (robot, rig) = (&puma.design, &puma.rig);
    let assessment = Assessment::new(&Evidence { robot, rig, dataset: rows, fit, unseen, max_rms_m: None });
    Facts::new(&Inputs { robot, rig, rig_name: "triangles", dataset: rows, fit, assessment: &assessment, remarks: &[] })
}

fn kinds(facts: &Facts) -> Vec<ProofKind> {
    facts.assessment.proofs.iter().map(|proof| proof.kind).collect()
}

#[test]
fn an_encoders_jitter_makes_no_postures() {
    let puma = Puma::default();
    let proof_m = |jitter_rad| fitted(&puma, &three_lengths_a_posture(&puma, 8, jitter_rad, 5)).cross_validation.unwrap().rms_m;
    let (exact_m, jittered_m) = (proof_m(0.0), proof_m(2e-6));
    assert!((jittered_m / exact_m - 1.0).abs() < 0.05, "{jittered_m} against {exact_m}");
}

#[test]
fn other_lengths_of_fitted_postures_are_no_proof_to_go_by() {
    let puma = Puma::default();
    let (held_out, rows) = three_lengths_a_posture(&puma, 12, 2e-6, 5).split(|row| row.pairing.sphere == 2);
    let other_postures = three_lengths_a_posture(&puma, 4, 0.0, 6);
    let fit = fitted(&puma, &rows);
    let unseen = [("sphere 3".to_owned(), &held_out), ("other postures".to_owned(), &other_postures)];
    let facts = facts(&puma, &rows, &fit, &unseen);
    assert_eq!(kinds(&facts), [ProofKind::Apart, ProofKind::LeftOut, ProofKind::SamePostures]);
    let rms_m: Vec<f64> = facts.assessment.proofs.iter().map(|proof| proof.after_summary().rms_m).collect();
    assert!(rms_m[2] < rms_m[0].max(rms_m[1]), "what shares its errors with the fit looks better: {rms_m:?}");
    assert_ne!(facts.assessment.decisive_proof().unwrap().kind, ProofKind::SamePostures);
}

#[test]
fn the_worst_proof_decides_whatever_comes_first() {
    let puma = Puma::default();
    let rows = puma.shells(0.46, 20, 84e-6, 3);
    let fit = fitted(&puma, &rows);
    let (good, bad) = (puma.shells(0.61, 5, 84e-6, 4), puma.shells(0.61, 5, 3e-3, 5));
    let names = |unseen: [(&str, &Dataset); 2]| {
        let facts = facts(&puma, &rows, &fit, &unseen.map(|(name, rows)| (name.to_owned(), rows)));
        (facts.assessment.decisive_proof().unwrap().name.clone(), facts.assessment.reasons.len())
    };
    let expected = ("bad".to_owned(), 1);
    assert_eq!(names([("good", &good), ("bad", &bad)]), expected);
    assert_eq!(names([("bad", &bad), ("good", &good)]), expected);
}

#[test]
fn the_standard_error_is_that_of_postures_and_not_of_lengths() {
    let puma = Puma::default();
    // The scatter of the RMS from set to set, of sets of 36 postures each with three lengths.
    let rows = puma.shells(0.46, 20, 10e-6, 3);
    let fit = fitted(&puma, &rows);
    let sets: Vec<(f64, f64)> = (0..at_length(40) as u64)
        .map(|seed| {
            let set = three_lengths_a_posture(&puma, 4, 0.0, 100 + seed);
            let facts = facts(&puma, &rows, &fit, &[("set".to_owned(), &set)]);
            (facts.assessment.proofs[0].after_summary().rms_m, facts.assessment.proofs[0].rms_error_m().unwrap())
        })
        .collect();
    let count = sets.len() as f64;
    let mean_m = sets.iter().map(|set| set.0).sum::<f64>() / count;
    let scatter_m = (sets.iter().map(|set| (set.0 - mean_m).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
    let said_m = sets.iter().map(|set| set.1).sum::<f64>() / count;
    assert!((0.7..1.4).contains(&(said_m / scatter_m)), "said {said_m}, found {scatter_m}");
    let as_if_independent_m = mean_m / (2.0 * 108.0_f64).sqrt();
    assert!(said_m > 1.4 * as_if_independent_m, "said {said_m}, of independent lengths {as_if_independent_m}");
}

#[test]
fn a_robot_that_only_stands_elsewhere_is_said_to() {
    let mut puma = Puma::default();
    puma.truth = puma.design.clone();
    puma.truth.chain.parameters_mut()[0] += 0.010;
    let rows = puma.shells(0.46, 20, 20e-6, 3);
    let fit = fitted(&puma, &rows);
    assert!(fit.initial.rms_m > 2e-3);
    let base_m = fit.base_alone.expect("nothing is held by name").rms_m;
    assert!((base_m - 20e-6).abs() < 3e-6, "{base_m}");
}

#[test]
fn a_robot_calibrated_already_is_no_design() {
    let folder = puma();
    runs(&folder, &[&["fit", "poses.csv", "--out", "calibrated.toml"], &DESIGN]);
    let page = ["report", "poses.csv", "--robot", "calibrated.toml", "--rig", "triangles", "--out", "r.html", "--json"];
    let told = runs(&folder, &[&page]).json();
    let reasons = told["reasons"].to_string();
    assert!(reasons.contains("calibrated already"), "{reasons}");
}

#[test]
fn a_pairing_held_out_of_a_real_irb_120_does_not_make_it_calibrated() {
    let Some(folder) = real_data("irb120") else { return };
    let out = tempfile::tempdir().expect("a temporary folder");
    let page = out.path().join("page.html").display().to_string();
    let args = ["report", "--robot", "robot.toml", "--rig", "rig.toml", "poses.csv", "--hold-out", "pairing=A:1", "--out", &page];
    let run = host_cal_in(&folder, &[&args[..], &["--json"]].concat());
    assert_eq!(run.code, 0, "{}", run.transcript());
    let told = run.json();
    assert_eq!(told["verdict"], "reserved");
    // Of 26 lengths, each in a posture of which eight others were fitted; 0.183 by an independent computation with NumPy.
    let last = told["unseen"].as_array().unwrap().last().unwrap();
    assert!(last["name"].as_str().unwrap().ends_with("other lengths of fitted postures"));
    assert!((last["rms_mm"].as_f64().unwrap() - 0.183).abs() < 5e-4);
}
