//! Where the tool is, and which joints bring it there.
//!
//! `cargo run --example forward_kinematics`
#![expect(clippy::print_stdout, reason = "an example shows what it finds")]

use std::error::Error;

use ballbar_calib::kinematics::{InverseKinematics, Thoroughness, apart, link_angles};
use ballbar_calib::units::mm_from_m;
use ballbar_calib::{ChaCha8Rng, JointVector, Kinematics, SeedableRng, designs};

fn main() -> Result<(), Box<dyn Error>> {
    let robot = designs::puma560();
    let kinematics = Kinematics::new(&robot.chain);

    let q = robot.chain.joint_vector(&[0.3, -0.5, 0.4, 0.2, -0.6, 1.0])?;
    let base_from_tool = kinematics.base_from_tool(&q);
    println!("joints, degrees: {}", degrees(&q));
    println!("tool, mm: {:.2?}", base_from_tool.translation_m.map(mm_from_m).as_slice());
    println!("turned by Rz·Ry·Rx, degrees: {:.2?}", link_angles(&base_from_tool.rotation).map(f64::to_degrees));

    // Of an arm without a closed form branches are looked for from random starts: hence the generator.
    let inverse = InverseKinematics::new(&robot);
    let found = inverse.branches(&base_from_tool, Thoroughness::ALL, &mut ChaCha8Rng::seed_from_u64(0));
    let how = if inverse.is_closed_form() { "in closed form" } else { "from random starts" };
    println!(
        "\n{} joint vectors within limits lead there ({how}), {} more beyond them:",
        found.within_limits.len(),
        found.beyond_limits
    );
    for q in &found.within_limits {
        let (off_m, turned_rad) = apart(&kinematics.base_from_tool(q), &base_from_tool);
        println!("{}   off by {:.0e} mm, {turned_rad:.0e} rad", degrees(q), mm_from_m(off_m));
    }
    Ok(())
}

fn degrees(q: &JointVector<f64>) -> String {
    q.as_array()[..6].iter().map(|q_rad| format!("{:8.2}", q_rad.to_degrees())).collect()
}
