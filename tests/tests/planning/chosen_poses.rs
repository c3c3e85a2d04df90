//! D-optimal poses, and the noise that a plan says will reach the tool.

use ballbar::Measurement;
use ballbar_calib::identify::{FitOptions, Hold, fit};
use ballbar_calib::model::PoseRow;
use ballbar_calib::plan::{Cell, Expectation, Margins, Pace, Quality, d_optimal};
use ballbar_calib::simulate::tool_error;
use ballbar_tests::at_length::at_length;
use ballbar_tests::experiment::{Puma, dataset};
use rand::SeedableRng;
use rand::seq::index::sample;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Poses of a PUMA, their gradients times plausible deviations over what they tell, and which parameters these are.
struct Pool {
    poses: Vec<PoseRow>,
    rows: Vec<Vec<f64>>,
    subset: Vec<usize>,
}

fn pool(puma: &Puma) -> Pool {
    let poses = puma.shells(0.46, 40, 0.0, 4).rows;
    let measurements: Vec<Measurement<f64>> = poses.iter().map(|pose| pose.measurement).collect();
    let subset = Expectation::new(&puma.design.chain, &measurements, &puma.design.limits).identified;
    let cell = Cell::new(&puma.design, &puma.rig, 0.075, Margins::default(), Pace::default()).unwrap();
    let row = |pose: &PoseRow| {
        let row = cell.plausible_rows(&[pose.measurement.q], &pose.measurement.pairing).remove(0);
        subset.iter().map(|&column| row[column]).collect()
    };
    Pool { rows: poses.iter().map(row).collect(), poses, subset }
}

/// RMS error of the tool, metres, that noise leaves after fits to these poses of the pool.
fn recovered_m(puma: &Puma, pool: &Pool, chosen: &[usize], fits: u64) -> f64 {
    const SIGMA_M: f64 = 0.084e-3;
    let square = |seed: u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let noise = Normal::new(0.0, SIGMA_M).unwrap();
        let mut rows: Vec<PoseRow> = chosen.iter().map(|&i| pool.poses[i].clone()).collect();
        rows.iter_mut().for_each(|row| row.measurement.length_m += noise.sample(&mut rng));
        let hold = FitOptions { hold: Hold::paper(), ..FitOptions::default() };
        let found = fit(&puma.design, &dataset(rows), &hold).unwrap();
        tool_error(&puma.truth.chain, &found.solution.chain, &puma.truth.limits, 300, seed).rms_m.powi(2)
    };
    ((0..fits).map(square).sum::<f64>() / fits as f64).sqrt()
}

#[test]
fn d_optimal_poses_recover_the_tool_better_than_random_ones() {
    const POSES: usize = 60;
    let puma = Puma::default();
    let pool = pool(&puma);
    let best = d_optimal(&pool.rows, POSES);
    let by_best_m = recovered_m(&puma, &pool, &best, 12);
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    let by_random_m: Vec<f64> = (0..6)
        .map(|_| {
            let any: Vec<usize> = sample(&mut rng, pool.poses.len(), POSES).into_iter().collect();
            recovered_m(&puma, &pool, &any, 12)
        })
        .collect();
    let mean_m = by_random_m.iter().sum::<f64>() / by_random_m.len() as f64;
    println!("D-optimal {:.3} mm, random {:?} mm", by_best_m * 1e3, by_random_m.iter().map(|m| m * 1e3).collect::<Vec<_>>());
    assert!(by_random_m.iter().all(|&random_m| by_best_m < random_m), "{by_best_m} {by_random_m:?}");
    assert!(by_best_m < 0.8 * mean_m, "{by_best_m} {mean_m}");
}

#[test]
fn noise_at_the_tool_is_what_was_expected() {
    const SIGMA_MM: f64 = 0.084;
    let puma = Puma::default();
    let pool = pool(&puma);
    let chosen = d_optimal(&pool.rows, 90);
    let measurements: Vec<Measurement<f64>> = chosen.iter().map(|&i| pool.poses[i].measurement).collect();
    let quality = Quality::new(&puma.design.chain, &measurements, &puma.design.limits, &pool.subset).unwrap();
    let fits = at_length(100) as u64;
    let (expected_mm, found_mm) = (quality.amplification * SIGMA_MM, recovered_m(&puma, &pool, &chosen, fits) * 1e3);
    println!("expected {expected_mm:.3} mm, found {found_mm:.3} mm");
    assert!((found_mm / expected_mm - 1.0).abs() < 0.2, "{found_mm} {expected_mm}");
}
