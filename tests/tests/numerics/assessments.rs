//! Whether a fit is believed: measurements with a mistake in them are refused and the mistake is named, good ones are not accused.

use ballbar_calib::assess::{Answer, Assessment, Evidence, Refusal, RmsGround};
use ballbar_calib::identify::{FitOptions, Hold, fit};
use ballbar_calib::model::{Dataset, Rig, Robot};
use ballbar_tests::command::{Run, host_cal_in};
use ballbar_tests::data::real_data;
use ballbar_tests::experiment::{Cell, Puma};
use host_cal::files::calibration;

const SIGMA_M: f64 = 50e-6;

fn assess_cell(cell: &Cell, dataset: &Dataset) -> Assessment {
    assess(&cell.design, &cell.rig, dataset, Hold::default())
}

fn assess(robot: &Robot, rig: &Rig, dataset: &Dataset, hold: Hold) -> Assessment {
    let fit = fit(robot, dataset, &FitOptions { hold, ..FitOptions::default() }).expect("enough poses");
    Assessment::new(&Evidence { robot, rig, dataset, fit: &fit, unseen: &[], max_rms_m: None })
}

#[test]
fn rows_that_are_shuffled_or_shifted_are_told_apart() {
    for (robot, seed) in [("puma560", 3), ("ur5e", 4)] {
        let cell = Cell::new(robot, seed);
        let good = cell.measured(0.46, 20, SIGMA_M, seed);
        let lengths = |order: &dyn Fn(usize) -> usize| {
            let mut other = good.clone();
            let count = good.rows.len();
            other.rows.iter_mut().enumerate().for_each(|(i, row)| {
                row.measurement.length_m = good.rows[order(i) % count].measurement.length_m;
            });
            assess_cell(&cell, &other)
        };
        // 180 rows: 7 and 180 have no common factor.
        let shuffled = lengths(&|i| 7 * i + 50);
        assert_eq!(shuffled.answer, Answer::NotTrusted);
        assert!(shuffled.reasons.last().unwrap().contains("Were rows shuffled"), "{robot}: {:?}", shuffled.reasons);
        for (by, which) in [(1, "previous"), (179, "next")] {
            let shifted = lengths(&|i| i + by);
            assert_eq!(shifted.answer, Answer::NotTrusted);
            assert!(shifted.reasons.last().unwrap().contains(which), "{robot}: {:?}", shifted.reasons);
        }
    }
}

#[test]
fn joints_far_beyond_their_limits_are_never_calibrated_though_the_lengths_fit() {
    let cell = Cell::new("puma560", 3);
    let good = cell.measured(0.46, 20, SIGMA_M, 3);
    // Whole turns, up to what a scale's error lets pass: the lengths are those of the same pose.
    let wound = |every: usize| {
        let mut wound = good.clone();
        for row in wound.rows.iter_mut().step_by(every) {
            row.measurement.q.as_array_mut()[5] +=
                std::f64::consts::TAU * if row.measurement.q.as_array()[5] > 0.0 { 1.0 } else { -1.0 };
        }
        assess_cell(&cell, &wound)
    };
    let all = wound(1);
    assert_eq!(all.answer, Answer::NotTrusted);
    assert!(
        all.refusals.iter().any(|refusal| matches!(refusal, Refusal::BeyondLimits { rows: 180, of: 180, joint: 6, .. })),
        "{all:?}"
    );
    let one = wound(1000);
    assert_ne!(one.answer, Answer::Calibrated);
    assert!(one.reasons.join(" ").contains("1 of 180 poses have joints far beyond their limits"), "{:?}", one.reasons);
}

#[test]
fn changes_that_no_robot_has_are_refused_and_those_of_a_base_set_down_elsewhere_are_a_reservation() {
    let cell = Cell::new("puma560", 3);
    let good = cell.measured(0.46, 20, SIGMA_M, 3);
    let mut elsewhere = cell.design.clone();
    elsewhere.chain.parameters_mut()[0] += 0.2;
    let near = assess(&elsewhere, &cell.rig, &good, Hold::paper());
    assert_eq!(near.answer, Answer::Reserved, "{:?}", near.reasons);
    assert!(near.reasons.join(" ").contains("link 1, where the robot stands, by "), "{:?}", near.reasons);

    // An arm of another length: the fit finds it, and does not believe it.
    let mut other_arm = cell.design.clone();
    other_arm.chain.parameters_mut()[16] += 0.15;
    let plain = fit(&other_arm, &good, &FitOptions { hold: Hold::paper(), ..FitOptions::plain() }).expect("enough poses");
    let other = Assessment::new(&Evidence::new(&other_arm, &cell.rig, &good, &plain));
    assert_eq!(other.answer, Answer::NotTrusted, "{:?}", other.reasons);
    assert!(other.reasons.join(" ").contains("no such robot exists"), "{:?}", other.reasons);
    // Tolerances do not let it find one.
    let held_back = assess(&other_arm, &cell.rig, &good, Hold::paper());
    assert_eq!(held_back.answer, Answer::NotTrusted, "{:?}", held_back.reasons);
    assert!(held_back.reasons.join(" ").contains("do not belong together"), "{:?}", held_back.reasons);
}

#[test]
fn a_robot_that_is_right_already_is_kept_as_it_is() {
    let puma = Puma::default();
    for (per_pairing, sigma_m, hold) in [(20, 84e-6, Hold::default()), (5, 0.5e-3, Hold::paper())] {
        let mut robot = puma.design.clone();
        robot.chain = puma.truth.chain.clone();
        let poses = puma.shells(0.46, per_pairing, sigma_m, 8);
        let fitted = fit(&robot, &poses, &FitOptions { hold, ..FitOptions::default() }).expect("enough poses");
        let (rig, robot) = (&puma.rig, &robot);
        let evidence = Evidence { robot, rig, dataset: &poses, fit: &fitted, unseen: &[], max_rms_m: None };
        let told = Assessment::new(&evidence);
        assert_eq!(told.answer, Answer::Unchanged, "{:?}", told.reasons);
        let (chain, calibration) = calibration(&evidence, &told).expect("nothing against it");
        assert_eq!(chain, &robot.chain, "what a fit to noise would change is not written");
        assert_eq!(calibration.rms_mm, calibration.rms_initial_mm);
        assert!(calibration.reasons[0].contains("as well as a fit"), "{calibration:?}");
    }
}

#[test]
fn the_rms_that_is_believed_is_stated_by_the_poses_or_asked_for() {
    let puma = Puma::default();
    let assess_with = |sigma_m: f64, stated_m: Option<f64>, max_rms_m: Option<f64>| {
        let mut dataset = puma.shells(0.46, 20, sigma_m, 3);
        dataset.rows.iter_mut().for_each(|row| row.sigma_m = stated_m);
        let fit = fit(&puma.design, &dataset, &FitOptions::default()).expect("enough poses");
        let (robot, rig) = (&puma.design, &puma.rig);
        Assessment::new(&Evidence { robot, rig, dataset: &dataset, fit: &fit, unseen: &[], max_rms_m })
    };
    let is_too_large = |told: &Assessment| told.refusals.iter().any(|refusal| matches!(refusal, Refusal::TooLarge { .. }));
    let cases = [
        (2e-3, None, None, RmsGround::Usual, true),
        (0.5e-3, None, None, RmsGround::Usual, false),
        (0.5e-3, Some(20e-6), None, RmsGround::StatedNoise, true),
        (0.5e-3, Some(100e-6), None, RmsGround::StatedNoise, false),
        (2e-3, Some(1e-3), None, RmsGround::StatedNoise, false),
        (2e-3, None, Some(3e-3), RmsGround::Asked, false),
        (0.5e-3, Some(0.5e-3), Some(0.1e-3), RmsGround::Asked, true),
    ];
    for (sigma_m, stated_m, max_rms_m, ground, expected) in cases {
        let told = assess_with(sigma_m, stated_m, max_rms_m);
        assert_eq!((told.rms_limit.ground, is_too_large(&told)), (ground, expected), "{sigma_m} {stated_m:?} {max_rms_m:?}");
        assert_eq!(told.answer == Answer::NotTrusted, expected, "{:?}", told.reasons);
    }
}

/// `fit` and `report` of a file that must not be believed: both say so, and no robot is written.
fn refused(robot: &str, rig: &str, poses: &str, more: &[&str], words: &str) {
    let Some(folder) = real_data("cases/wrong_data") else { return };
    let out = tempfile::tempdir().expect("a temporary folder");
    let path = |name: &str| out.path().join(name).display().to_string();
    let args = ["--robot", robot, "--rig", rig, poses, "--json", "--out"];
    let run =
        |command: &str, file: &str| -> Run { host_cal_in(&folder, &[&[command], &args[..], &[&path(file)], more].concat()) };
    let (fit, page) = (run("fit", "fitted.toml"), run("report", "page.html"));
    assert_eq!((fit.code, page.code), (1, 1), "{poses}: {}", fit.stdout);
    assert!(!out.path().join("fitted.toml").exists(), "{poses}");
    for told in [fit.json(), page.json()] {
        assert_eq!(told["verdict"], "not_trusted", "{poses}");
        assert!(told["reasons"].to_string().contains(words), "{poses}: {}", told["reasons"]);
    }
}

#[test]
fn files_that_people_sent_are_refused_with_their_mistake() {
    refused("design.toml", "triangles", "chucks_exchanged.csv", &[], "look exchanged");
    refused("design.toml", "triangles", "joints_2_3_exchanged.csv", &[], "joints 2 and 3 look exchanged");
    refused("design.toml", "triangles", "joint_2_sign.csv", &[], "joint 2 looks as if it were counted with the wrong sign");
    refused("puma560", "triangles", "puma_shuffled.csv", &[], "Were rows shuffled");
    refused("puma560", "triangles", "puma_chucks_exchanged.csv", &[], "look exchanged");
    for hold in ["auto", "paper"] {
        refused("puma560", "beyond_limits_rig.toml", "beyond_limits.csv", &["--hold", hold], "joints far beyond their limits");
    }
}
