//! The command on real measurements, where the folder with them is there.

use ballbar_tests::command::{Run, host_cal_in};
use ballbar_tests::data::real_data;
use serde_json::Value;

fn fit_json(set: &str, more: &[&str]) -> Option<Run> {
    let folder = real_data(set)?;
    let fixed = ["fit", "--robot", "robot.toml", "--rig", "rig.toml", "poses.csv", "--json"];
    Some(host_cal_in(&folder, &[&fixed, more].concat()))
}

fn number(json: &Value, key: &str) -> f64 {
    json[key].as_f64().unwrap_or_else(|| panic!("{key} is not a number"))
}

#[test]
fn a_real_irb_120_goes_from_3_232_to_0_137_mm() {
    let Some(run) = fit_json("irb120", &["--prior", "none"]) else { return };
    assert_eq!(run.code, 0, "{}", run.stderr);
    let fit = run.json();
    assert_eq!(fit["status"], "converged");
    assert_eq!((&fit["rank"], &fit["free_parameters"], &fit["poses"]), (&36.into(), &36.into(), &234.into()));
    assert_eq!(fit["parameters"].as_array().unwrap().len(), 54);
    // 3.2319804 and 0.1371515 by an independent computation with NumPy.
    assert!((number(&fit, "rms_initial_mm") - 3.231_980_4).abs() < 1e-6);
    assert!((number(&fit, "rms_mm") - 0.137_151_52).abs() < 1e-7);
    assert_eq!(fit["outliers"].as_array().unwrap().len(), 0);
    assert!(fit["verdict"] == "calibrated" || fit["verdict"] == "reserved", "{}", fit["reasons"]);
    assert!((number(&fit["held_out"], "rms_mm") - 0.349).abs() < 5e-4, "{}", fit["held_out"]);
}

#[test]
fn all_54_parameters_of_the_irb_120_give_the_same_residual() {
    let Some(run) = fit_json("irb120", &["--hold", "none", "--prior", "none", "--loss", "none"]) else { return };
    let fit = run.json();
    assert_eq!((&fit["status"], &fit["free_parameters"]), (&"converged".into(), &54.into()));
    assert!((number(&fit, "rms_mm") - 0.137_151_52).abs() < 1e-7);
    assert!(fit["condition"].is_null(), "dependent columns have no condition number");
}

#[test]
fn a_cable_set_of_one_pairing_is_told_its_bounds_and_does_not_run_away() {
    let Some(run) = fit_json("robotcali_irb120", &["--prior", "none", "--loss", "none"]) else { return };
    // Parts measured in one go are predicted worse than by the design, though every fifth row is predicted better.
    assert_eq!(run.code, 1, "{}", run.stderr);
    let fit = run.json();
    assert_eq!((&fit["status"], &fit["verdict"]), (&"converged".into(), &"not_trusted".into()));
    assert!(number(&fit["held_out"], "rms_mm") > number(&fit, "rms_initial_mm"), "{}", fit["held_out"]);
    let remarks = fit["remarks"].to_string();
    assert!(remarks.contains("One pairing (A:1) can identify at most 30 parameters"), "{remarks}");
    assert!(remarks.contains("Residuals follow one another"), "{remarks}");
    assert!(fit["rank"].as_u64().unwrap() <= 30);

    let not_identified: Vec<&str> =
        fit["not_identified"].as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap()).collect();
    for name in ["scale6", "beta7", "gamma7", "alpha1"] {
        assert!(not_identified.contains(&name), "{name} is not in {not_identified:?}");
    }
    // Row 28 is the gross outlier: 4 mm beside its neighbours, whose scatter is 0.4 mm.
    assert!(fit["outliers"].as_array().unwrap().contains(&28.into()), "{}", fit["outliers"]);
    for parameter in fit["parameters"].as_array().unwrap() {
        let limit = match parameter["unit"].as_str().unwrap() {
            "mm" => 60.0,
            "deg" => 5.0,
            _ => 0.05,
        };
        assert!(number(parameter, "change").abs() < limit, "{parameter}");
    }
}

#[test]
fn a_cable_set_is_refused_by_default_and_no_parameter_runs_away() {
    let Some(run) = fit_json("robotcali_irb120", &[]) else { return };
    assert_eq!(run.code, 1, "{}", run.stderr);
    let fit = run.json();
    assert_eq!(fit["verdict"], "not_trusted");
    assert!(!fit["reasons"].to_string().contains("no such robot exists"), "{}", fit["reasons"]);
}

#[test]
fn freeing_everything_on_the_cable_set_is_called_what_it_is() {
    let Some(run) = fit_json("robotcali_irb120", &["--hold", "none", "--prior", "none", "--loss", "none"]) else { return };
    let fit = run.json();
    assert_eq!(run.code, 1);
    assert_ne!(fit["status"], "converged");
    assert!(fit["reasons"].to_string().contains("no such robot exists"), "{}", fit["reasons"]);
}
