//! Which parameters some poses can tell, and why not the others.
//!
//! `cargo run --example rank`
#![expect(clippy::print_stdout, reason = "an example shows what it finds")]

use std::error::Error;

use ballbar_calib::designs;
use ballbar_calib::identify::{Identifiability, remarks};
use ballbar_calib::model::{Dataset, PairingId};
use ballbar_calib::simulate::Shells;

fn main() -> Result<(), Box<dyn Error>> {
    let (robot, rig) = (designs::puma560(), designs::triangles());
    let one = [PairingId { chuck: 0, sphere: 0 }];
    for (what, pairings) in [("one pairing", &one[..]), ("all nine pairings", &rig.all_pairings())] {
        // Nothing has to be measured: what poses can tell depends on the poses alone.
        let shells = Shells {
            planned_with: &robot,
            truth: &robot,
            rig: &rig,
            pairings,
            bar_m: 0.46,
            per_pairing: 540 / pairings.len(),
            sigma_m: 0.0,
            seed: 1,
        };
        let poses = Dataset::new("shell", shells.simulate(|| ())?.into_iter().map(|pose| pose.row).collect())?;

        let found = Identifiability::new(&robot.chain, &poses.measurements(), &robot.limits, &[]);
        println!(
            "{} poses of {what}: rank {} of {}",
            poses.rows.len(),
            found.spectrum.rank,
            robot.chain.independent_parameters()
        );
        if let Some((last, first)) = found.spectrum.gap() {
            println!("  the last singular value that counts is {last:.1e}, the next one {first:.1e}");
        }
        for (parameter, finding) in found.not_identified() {
            println!("  {:8} {finding}", parameter.to_string());
        }
        for remark in remarks(&robot.chain, &poses, &rig, &robot.limits) {
            println!("  {remark}");
        }
        println!();
    }
    Ok(())
}
