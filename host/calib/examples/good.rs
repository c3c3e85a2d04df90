#![allow(warnings, clippy::all, clippy::pedantic)]
use ballbar_calib::assess::*;
use ballbar_calib::designs;
use ballbar_calib::identify::{FitOptions, fit};
use ballbar_calib::model::*;
use ballbar_calib::simulate::Shells;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
fn main() {
    let (design, rig) = (designs::puma560(), designs::triangles());
    let pairings = rig.all_pairings();
    for scale in [1.0, 0.1, 0.03] { for jit in [0.0f64, 0.01, ] { for per_pairing in [8, 30] {
        let (mut unlike, mut against, mut ans, mut said) = (0, 0, [0; 4], vec![]);
        let runs = 40;
        for seed in 0..runs {
            let mut rng = ChaCha8Rng::seed_from_u64(500 + seed);
            let mut truth = design.clone();
            for (i, v) in truth.chain.parameters_mut().iter_mut().enumerate() {
                let by = match i % 8 { 0..3 => if i < 6 { 5e-3 } else { 0.5e-3 }, 3..7 => if i < 6 { 8.7e-3 } else { 1.7e-3 }, _ => 1e-3 };
                *v += scale * by * rng.sample::<f64, _>(StandardNormal);
            }
            let mut data = Dataset::default();
            for bar_m in [0.46, 0.61] {
                let shells = Shells { planned_with: &design, truth: &truth, rig: &rig, pairings: &pairings, bar_m, per_pairing: per_pairing / 2, sigma_m: 84e-6, seed };
                let kin = ballbar::Kinematics::new(&truth.chain);
                let rows = shells.simulate(|| ()).unwrap().into_iter().map(|p| { let mut r = p.row; r.bar_m = Some(bar_m);
                    let mut q = r.measurement.q.clone(); for v in q.as_array_mut()[..6].iter_mut() { *v += jit.to_radians() * rng.sample::<f64, _>(StandardNormal); }
                    r.measurement.length_m += kin.length(&q, &r.measurement.pairing) - kin.length(&r.measurement.q, &r.measurement.pairing); r }).collect();
                data.append("s", rows).unwrap();
            }
            let f = fit(&design, &data, &FitOptions::default()).unwrap();
            let a = Assessment::new(&Evidence::new(&design, &rig, &data, &f));
            let g: Vec<_> = a.by_group.iter().flat_map(|k| &k.groups).collect();
            unlike += g.iter().any(|g| g.is_unlike) as i32; against += g.iter().any(|g| g.speaks_against) as i32;
            ans[match a.answer { Answer::Calibrated => 0, Answer::Reserved => 1, Answer::Unchanged => 2, _ => 3 }] += 1;
            if a.answer == Answer::NotTrusted && said.len() < 2 { said = a.reasons.clone(); }
        }
        println!("scale {scale} joint {jit} rows {}: unlike {unlike} against {against} of {runs}; calibrated, reserved, unchanged, refused {ans:?} {said:?}", 9 * 2 * (per_pairing / 2));
    } } }
}
