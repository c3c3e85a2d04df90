//! What would be measured, and how far off the tool is before and after.
//!
//! `cargo run --release --example simulate`
#![expect(clippy::print_stdout, reason = "an example shows what it finds")]

use std::error::Error;

use ballbar_calib::identify::{FitOptions, fit};
use ballbar_calib::model::{Dataset, Robot};
use ballbar_calib::simulate::{Shells, tool_error};
use ballbar_calib::units::mm_from_m;
use ballbar_calib::unknowns::plausible_error;
use ballbar_calib::{Chain, Parameter, designs};

fn main() -> Result<(), Box<dyn Error>> {
    let (design, rig) = (designs::puma560(), designs::triangles());
    let truth = Robot { name: "as it is".to_owned(), chain: as_built(&design.chain), ..design.clone() };
    let off = |chain: &Chain<f64>| tool_error(&truth.chain, chain, &design.limits, 1000, 0);
    println!("the design's tool is off by {:.3} mm RMS", mm_from_m(off(&design.chain).rms_m));

    let pairings = rig.all_pairings();
    for per_pairing in [10, 30, 90] {
        let shells = Shells {
            planned_with: &design,
            truth: &truth,
            rig: &rig,
            pairings: &pairings,
            bar_m: 0.46,
            per_pairing,
            sigma_m: 84e-6,
            seed: 1,
        };
        let poses = shells.simulate(|| ())?;
        let dataset = Dataset::new("simulated", poses.into_iter().map(|pose| pose.row).collect())?;
        let fit = fit(&design, &dataset, &FitOptions::default())?;
        let left = off(&fit.solution.chain);
        println!(
            "{:3} lengths that scatter by 0.084 mm: residual {:.4} mm RMS, tool {:.3} mm RMS, {:.3} mm at most",
            dataset.rows.len(),
            mm_from_m(fit.fitted.rms_m),
            mm_from_m(left.rms_m),
            mm_from_m(left.max_m)
        );
    }
    Ok(())
}

/// The design, every parameter of it off by a part of what is plausible.
fn as_built(design: &Chain<f64>) -> Chain<f64> {
    let mut chain = design.clone();
    for (index, value) in chain.parameters_mut().iter_mut().enumerate() {
        let share = (1.7 * index as f64).sin() / 3.0;
        *value += share * plausible_error(design.unit(Parameter::from_index(index)));
    }
    chain
}
