//! Fits of simulated lengths: accuracy, honesty of the deviations, reasons for ending, outliers.

use ballbar::{Chain, Damping, FreeParameters, JointKind, Kinematics, Parameter};
use ballbar_calib::identify::{
    Finding, Fit, FitError, FitOptions, Hold, HoldRule, LmOptions, Loss, Observation, OutlierTest, ResidualSummary, Status,
    Uncertainty, fit, residuals, solve_lengths,
};
use ballbar_calib::model::Dataset;
use ballbar_calib::simulate::tool_error;
use ballbar_tests::at_length::at_length;
use ballbar_tests::experiment::{Puma, worst_parameter_difference};

const SIGMA_M: f64 = 0.084e-3;

fn hold(rule: HoldRule, names: &[&str]) -> FitOptions {
    let names = names.iter().map(|name| name.parse().unwrap()).collect();
    FitOptions { hold: Hold { rule, names }, ..FitOptions::plain() }
}

fn fit_puma(puma: &Puma, dataset: &Dataset, options: &FitOptions) -> Fit {
    fit(&puma.design, dataset, options).unwrap()
}

#[test]
fn table_ii_is_recovered_from_noisy_lengths_and_proves_itself_on_the_other_radius() {
    let puma = Puma::default();
    for seed in [1, 7, 23] {
        let result = fit_puma(&puma, &puma.shells(0.46, 90, SIGMA_M, seed), &FitOptions::default());
        let rms_mm = result.fitted.rms_m * 1e3;
        assert!((0.078..=0.086).contains(&rms_mm), "seed {seed}: {rms_mm}");
        assert!(matches!(result.solution.status, Status::Converged(_)));

        let other = puma.shells(0.61, 90, SIGMA_M, seed + 1000);
        let other_mm = ResidualSummary::new(&residuals(&Kinematics::new(&result.solution.chain), &other)).rms_m * 1e3;
        assert!(other_mm < 0.10, "seed {seed}: {other_mm} on the other shells");

        let tool = |chain: &Chain<f64>| tool_error(&puma.truth.chain, chain, &puma.truth.limits, 3000, 1).rms_m * 1e3;
        let (before, after) = (tool(&puma.design.chain), tool(&result.solution.chain));
        assert!((15.0..19.0).contains(&before), "{before} mm at the tool before");
        assert!(after < 0.5, "seed {seed}: {after} mm at the tool after");
    }
}

#[test]
fn noise_free_lengths_give_the_truth_itself() {
    let puma = Puma::default();
    let poses = puma.shells(0.46, 30, 0.0, 3);
    for damping in [Damping::Identity, Damping::Diagonal] {
        let result = fit_puma(&puma, &poses, &FitOptions { hold: Hold::paper(), damping, ..FitOptions::plain() });
        let worst = worst_parameter_difference(&result.solution.chain, &puma.truth.chain);
        assert!(worst < 1e-9, "{damping:?}: {worst:e}");
        assert!(result.solution.status.is_minimum());
    }
}

#[test]
fn auto_frees_what_the_paper_frees() {
    let puma = Puma::default();
    let result = fit_puma(&puma, &puma.shells(0.46, 20, SIGMA_M, 5), &FitOptions::default());
    for parameter in &result.parameters {
        let held_in_paper = puma.design.chain.is_conventionally_held(parameter.name.parse().unwrap());
        assert_eq!(parameter.held.is_some(), held_in_paper, "{}", parameter.name);
        assert_eq!(parameter.std.is_some(), !held_in_paper, "{}", parameter.name);
    }
}

#[test]
fn all_54_and_the_36_reach_the_same_cost_and_the_same_kinematics() {
    let puma = Puma::default();
    let poses = puma.shells(0.46, 40, SIGMA_M, 11);
    let few = fit_puma(&puma, &poses, &hold(HoldRule::Paper, &[]));
    for damping in [Damping::Identity, Damping::Diagonal] {
        let all = fit_puma(&puma, &poses, &FitOptions { hold: Hold::none(), damping, ..FitOptions::plain() });
        assert!((all.fitted.rms_m - few.fitted.rms_m).abs() < 1e-13, "{damping:?}");
        let difference = tool_error(&few.solution.chain, &all.solution.chain, &puma.design.limits, 500, 2);
        assert!(difference.max_m < 1e-8, "{damping:?}: {:e} m", difference.max_m);
        assert!(worst_parameter_difference(&few.solution.chain, &all.solution.chain) > 1e-4, "other values all the same");
        assert_eq!(all.identifiability.spectrum.rank, 36);
        let undetermined = all.parameters.iter().filter(|parameter| parameter.std.is_none()).count();
        assert!(undetermined > 18, "redundant parameters and their partners have no deviation of their own");
    }
}

#[test]
fn deviations_are_as_large_as_the_errors_that_they_stand_for() {
    let puma = Puma::default();
    let (mut squares, mut count) = (0.0, 0_u32);
    for seed in 0..at_length(24) as u64 {
        let result = fit_puma(&puma, &puma.shells(0.46, 10, SIGMA_M, seed), &hold(HoldRule::Paper, &[]));
        for parameter in result.parameters.iter().filter(|parameter| parameter.held.is_none()) {
            let truth = puma.truth.chain.parameters()[parameter.name.parse::<Parameter>().unwrap().index()];
            squares += ((parameter.fitted - truth) / parameter.std.unwrap()).powi(2);
            count += 1;
        }
    }
    // 864 correlated squares of mean 1; their mean scatters by some 0.08 (36 of a fit are strongly correlated).
    let mean = squares / f64::from(count);
    assert!((0.75..1.3).contains(&mean), "mean square of error over deviation: {mean}");
}

#[test]
fn poses_left_out_are_predicted_worse_than_those_fitted_but_far_better_than_by_the_design() {
    let puma = Puma::default();
    let result = fit_puma(&puma, &puma.shells(0.46, 20, SIGMA_M, 2), &FitOptions::default());
    let held_out = result.cross_validation.unwrap();
    assert_eq!(held_out.folds, 5);
    assert!(held_out.rms_m > result.fitted.rms_m && held_out.rms_m < 1.5 * SIGMA_M, "{held_out:?}");
}

#[test]
fn a_start_at_the_minimum_is_not_called_converged() {
    let puma = Puma::default();
    let poses = puma.shells(0.46, 20, SIGMA_M, 4);
    let mut robot = puma.design.clone();
    robot.chain = fit_puma(&puma, &poses, &hold(HoldRule::Paper, &[])).solution.chain;
    let again = fit(&robot, &poses, &hold(HoldRule::Paper, &[])).unwrap();
    assert_eq!(again.solution.status, Status::AlreadyOptimal);
    assert_eq!(again.solution.chain, robot.chain);
}

#[test]
fn a_fit_without_a_free_parameter_says_that_nothing_is_observable() {
    let puma = Puma::default();
    let every_name: Vec<String> = (0..54).map(|index| Parameter::from_index(index).to_string()).collect();
    let result = fit_puma(
        &puma,
        &puma.shells(0.46, 10, SIGMA_M, 4),
        &hold(HoldRule::None, &every_name.iter().map(String::as_str).collect::<Vec<_>>()),
    );
    assert_eq!(result.solution.status, Status::NothingObservable);
    assert_eq!(result.solution.chain, puma.design.chain);
    assert!(!result.solution.status.is_minimum());
}

#[test]
fn parameters_without_effect_are_never_moved() {
    // A sphere at the origin of the last frame: its turns change no length.
    let chain = Chain::new(&[JointKind::Revolute], &[0.0; 14]).unwrap();
    let free = FreeParameters::from_indices([11, 12, 13]).unwrap();
    let q = chain.joint_vector(&[0.3]).unwrap();
    let pairing = ballbar::Pairing {
        chuck_base_m: ballbar::Vector3::new(1.0, 0.0, 0.0),
        sphere_tool_m: ballbar::Vector3::new(0.0, 0.0, 0.0),
    };
    let rows = vec![ballbar::Measurement::new(pairing, q, 1.1); 5];
    let solution = solve_lengths(&chain, &rows, &free, &LmOptions::default());
    assert_eq!(solution.status, Status::NothingObservable);
    assert_eq!(solution.chain, chain);
}

#[test]
fn steps_that_run_out_are_no_minimum() {
    let puma = Puma::default();
    let measurements = puma.shells(0.46, 10, SIGMA_M, 4).measurements();
    let options = LmOptions { max_iterations: 1, ..LmOptions::default() };
    let solution = solve_lengths(&puma.design.chain, &measurements, &FreeParameters::all(54), &options);
    assert_eq!(solution.status, Status::IterationLimit);
    assert!(!solution.status.is_minimum());
    assert_eq!(solution.rms_history_m.len(), 2);
}

#[test]
fn lengths_that_are_no_numbers_end_the_solve_at_once() {
    let puma = Puma::default();
    let mut measurements = puma.shells(0.46, 10, SIGMA_M, 4).measurements();
    measurements[3].length_m = f64::NAN;
    let solution = solve_lengths(&puma.design.chain, &measurements, &FreeParameters::all(54), &LmOptions::default());
    assert_eq!(solution.status, Status::NotFinite);
    assert_eq!(solution.chain, puma.design.chain);
}

#[test]
fn as_many_poses_as_free_parameters_are_refused() {
    let puma = Puma::default();
    let mut poses = puma.shells(0.46, 4, SIGMA_M, 4);
    let refused = fit(&puma.design, &poses, &hold(HoldRule::Paper, &[])).unwrap_err();
    assert_eq!(refused, FitError::NoRedundancy { rows: 36, free: 36 });
    poses.rows.extend(puma.shells(0.46, 1, SIGMA_M, 5).rows);
    assert!(fit(&puma.design, &poses, &hold(HoldRule::Paper, &[])).is_ok());
}

#[test]
fn weak_parameters_stay_at_their_design_values() {
    // One joint hardly moves: its scale is independent of the rest, but only just.
    let puma = Puma::default();
    let mut poses = puma.shells(0.46, 40, SIGMA_M, 9);
    let truth = Kinematics::new(&puma.truth.chain);
    for (i, row) in poses.rows.iter_mut().enumerate() {
        row.measurement.q.as_array_mut()[3] *= 1e-4;
        let noise_m = if i % 2 == 0 { SIGMA_M } else { -SIGMA_M };
        row.measurement.length_m = truth.length(&row.measurement.q, &row.measurement.pairing) + noise_m;
    }
    let result = fit_puma(&puma, &poses, &FitOptions::plain());
    let scale4 = "scale4".parse::<Parameter>().unwrap().index();
    assert!(
        matches!(result.identifiability.findings[scale4], Finding::Weak { .. }),
        "{:?}",
        result.identifiability.findings[scale4]
    );
    assert_eq!(result.parameters[scale4].fitted, result.parameters[scale4].initial);
    assert_eq!(result.identifiability.spectrum.rank, 36, "weak is not the same as dependent");
}

#[test]
fn a_wrong_row_is_found_and_good_rows_are_not_accused() {
    let puma = Puma::default();
    let mut poses = puma.shells(0.46, 90, SIGMA_M, 6);
    let clean = fit_puma(&puma, &poses, &FitOptions::default());
    assert!(clean.outliers.is_empty(), "{:?}", clean.outliers);
    assert!(clean.neighbour_correlation.unwrap().abs() < 0.15);

    poses.rows[123].measurement.length_m += 3e-3;
    let result = fit_puma(&puma, &poses, &FitOptions::default());
    assert_eq!(result.wrong_rows.iter().map(|wrong| wrong.row).collect::<Vec<_>>(), [123]);
    let rest = ballbar_tests::experiment::dataset(poses.rows.iter().filter(|row| row.number != 124).cloned().collect());
    assert_eq!(
        result.solution.values,
        fit_puma(&puma, &rest, &FitOptions::default()).solution.values,
        "as if it had not been measured"
    );
    let kept = fit_puma(&puma, &poses, &FitOptions { loss: Loss::None, ..FitOptions::default() });
    assert_eq!(kept.outliers.iter().map(|outlier| outlier.row).collect::<Vec<_>>(), [123]);
}

#[test]
fn a_wrong_row_hidden_by_a_jump_of_the_zero_is_found_among_its_neighbours() {
    let puma = Puma::default();
    let mut poses = puma.shells(0.46, 60, SIGMA_M, 6);
    for (i, row) in poses.rows.iter_mut().enumerate() {
        // The zero of the bar jumps by 3 mm every thirty rows.
        row.measurement.length_m += if i / 30 % 2 == 0 { 1.5e-3 } else { -1.5e-3 };
    }
    poses.rows[75].measurement.length_m -= 4e-3;
    let result = fit_puma(&puma, &poses, &FitOptions::plain());
    assert!(result.neighbour_correlation.unwrap() > 0.5);
    let found = result.outliers.iter().find(|outlier| outlier.row == 75).unwrap();
    assert_eq!(found.test, OutlierTest::Neighbours);
}

#[test]
fn a_subset_is_chosen_around_parameters_held_by_name() {
    let puma = Puma::default();
    let poses = puma.shells(0.46, 20, SIGMA_M, 7);
    let auto = fit_puma(&puma, &poses, &FitOptions::plain());
    for names in [&["alpha1"][..], &["alpha1", "z1"]] {
        let around = fit_puma(&puma, &poses, &hold(HoldRule::Auto, names));
        assert_eq!(around.free_parameters(), 36, "{names:?}");
        assert!((around.fitted.rms_m - auto.fitted.rms_m).abs() < 1e-11, "{names:?}: {:e}", around.fitted.rms_m);
    }
    let scale = fit_puma(&puma, &poses, &hold(HoldRule::Auto, &["scale3"]));
    assert_eq!(scale.free_parameters(), 35, "nothing stands in for a scale");
    assert!(scale.identifiability.not_identified().all(|(parameter, _)| parameter != "scale3"));
}

#[test]
fn free_columns_of_rounding_only_are_no_columns() {
    // The sphere at the origin of the last frame of a chain whose numbers are all odd: its turns change no length but by rounding.
    let puma = Puma::default();
    let mut measurements = puma.shells(0.46, 20, SIGMA_M, 7).measurements();
    for measurement in &mut measurements {
        measurement.pairing.sphere_tool_m = ballbar::Vector3::zeros();
    }
    let of = |name: &str| name.parse::<Parameter>().unwrap().index();
    let free = FreeParameters::from_indices(["alpha7", "beta7", "gamma7"].map(of)).unwrap();
    let solution = solve_lengths(&puma.truth.chain, &measurements, &free, &LmOptions::default());
    assert_eq!(solution.status, Status::NothingObservable);
    assert_eq!(solution.chain, puma.truth.chain);
    let uncertainty = Uncertainty::new(&Observation::new(&puma.truth.chain, &measurements), &free.indices().collect::<Vec<_>>());
    assert_eq!((uncertainty.spectrum.rank, uncertainty.std), (0, vec![None; 3]), "rounding has no deviation");
}
