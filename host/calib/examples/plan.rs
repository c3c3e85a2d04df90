//! Which poses to measure, and the way between them, checked.
//!
//! `cargo run --release --example plan`
#![expect(clippy::print_stdout, reason = "an example shows what it finds")]

use std::error::Error;

use ballbar_calib::designs;
use ballbar_calib::model::PairingId;
use ballbar_calib::plan::{Cell, CheckedPlan, PlanOptions, RowKind, plan};
use ballbar_calib::units::mm_from_m;

fn main() -> Result<(), Box<dyn Error>> {
    let (robot, rig) = (designs::puma560(), designs::triangles());
    let bar = rig.bar.as_ref().ok_or("the rig has no bar")?;
    let pairings = vec![PairingId { chuck: 0, sphere: 0 }, PairingId { chuck: 1, sphere: 1 }];
    // 90 poses on each of nine shells are the usual plan; fewer are quicker to look at.
    let options = PlanOptions { bars_m: vec![bar.lengths_m[0]], ..PlanOptions::new(pairings, bar, 20) };

    let plan = plan(&robot, &rig, &options, &|_| ())?;
    for shell in &plan.shells {
        println!(
            "{}: {} of {} points measured, {} via points, {:.0} s",
            rig.pairing_name(shell.pairing),
            shell.measured,
            shell.points,
            shell.vias,
            shell.duration_s
        );
    }
    println!("these poses tell {} of {} parameters", plan.expectation.rank, plan.expectation.independent);

    // Whoever has made or changed a plan: a robot moves along what was looked at in fine steps, and nothing else.
    let cell = Cell::new(&robot, &rig, options.travel_m, options.margins, options.pace)?;
    let checked = CheckedPlan::new(&cell, &plan.rows)?;
    println!("\nthe first rows, all of them clear:");
    for row in checked.rows().iter().take(8) {
        let kind = if row.kind == RowKind::Measure { "measure" } else { "via" };
        let length = row.bar.map_or("no bar".to_owned(), |bar| format!("{:.2} mm", mm_from_m(bar.length_m)));
        let q_deg: Vec<f64> = row.q.as_array()[..robot.chain.joints()].iter().map(|q_rad| q_rad.to_degrees()).collect();
        println!("{kind:8} {q_deg:7.1?} {length}");
    }
    Ok(())
}
