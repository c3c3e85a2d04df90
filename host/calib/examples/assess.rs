//! A fit that is good, one that is not, and what is wrong with its data.
//!
//! `cargo run --release --example assess`
#![expect(clippy::print_stdout, reason = "an example shows what it finds")]

use std::error::Error;

use ballbar_calib::assess::{Assessment, Evidence};
use ballbar_calib::designs;
use ballbar_calib::identify::{FitOptions, explanation, fit};
use ballbar_calib::model::{Dataset, PairingId, PoseRow, Rig, Robot};
use ballbar_calib::simulate::Shells;
use ballbar_calib::units::mm_from_m;

fn main() -> Result<(), Box<dyn Error>> {
    let (design, rig) = (designs::puma560(), designs::triangles());
    let mut truth = design.clone();
    for (index, value) in truth.chain.parameters_mut().iter_mut().enumerate() {
        *value += 1e-3 * (1.7 * index as f64).sin();
    }
    let pairings = rig.all_pairings();
    let measured = |bar_m: f64, seed: u64| {
        let shells = Shells {
            planned_with: &design,
            truth: &truth,
            rig: &rig,
            pairings: &pairings,
            bar_m,
            per_pairing: 40,
            sigma_m: 50e-6,
            seed,
        };
        Ok::<_, Box<dyn Error>>(shells.simulate(|| ())?.into_iter().map(|pose| pose.row).collect::<Vec<_>>())
    };
    // The other rod's poses are kept apart, to prove the result on them.
    let unseen = Dataset::new("the longer bar", measured(0.61, 2)?)?;

    println!("As measured:");
    let rows = measured(0.46, 1)?;
    assess(&design, &rig, &Dataset::new("the shorter bar", rows.clone())?, &unseen)?;

    println!("\nWith two chucks called by one another's name:");
    let exchanged = rows.into_iter().map(|row| exchange_chucks(&rig, row)).collect();
    assess(&design, &rig, &Dataset::new("the shorter bar", exchanged)?, &unseen)
}

fn assess(design: &Robot, rig: &Rig, dataset: &Dataset, unseen: &Dataset) -> Result<(), Box<dyn Error>> {
    let fit = fit(design, dataset, &FitOptions::default())?;
    let unseen = [("the longer bar".to_owned(), unseen)];
    let assessment = Assessment::new(&Evidence { unseen: &unseen, ..Evidence::new(design, rig, dataset, &fit) });
    println!("{} ({}).", assessment.answer.words(), explanation(fit.solution.status));
    for proof in &assessment.proofs {
        let [before_mm, after_mm] = [proof.before_summary(), proof.after_summary()].map(|summary| mm_from_m(summary.rms_m));
        println!("  on {}: {before_mm:.3} mm by the design, {after_mm:.3} mm by the fit", proof.name);
    }
    for reason in &assessment.reasons {
        println!("  {reason}");
    }
    Ok(())
}

fn exchange_chucks(rig: &Rig, mut row: PoseRow) -> PoseRow {
    let chuck = match row.pairing.chuck {
        0 => 1,
        1 => 0,
        other => other,
    };
    row.pairing = PairingId { chuck, ..row.pairing };
    row.measurement.pairing = rig.pairing(row.pairing);
    row
}
