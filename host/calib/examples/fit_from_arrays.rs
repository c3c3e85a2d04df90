//! Arrays of joint values and lengths become parameters, with their deviations.
//!
//! `cargo run --example fit_from_arrays`
#![expect(clippy::print_stdout, reason = "an example shows what it finds")]

use std::error::Error;

use ballbar_calib::identify::{FitOptions, fit};
use ballbar_calib::model::{Bar, Dataset, JointLimits, NamedPoint, PairingId, PoseRow, Rig, Robot};
use ballbar_calib::units::{ScreenUnit, fixed, mm_from_m};
use ballbar_calib::{Chain, JointKind, Kinematics, Parameter, designs};

fn main() -> Result<(), Box<dyn Error>> {
    let robot = robot()?;
    let rig = rig()?;

    let mut rows = Vec::new();
    for Reading { chuck, sphere, q_rad, length_m } in measured(&robot, &rig)? {
        let q = robot.chain.joint_vector(&q_rad)?;
        rows.push(PoseRow::new(&rig, PairingId { chuck, sphere }, q, length_m)?);
    }
    let dataset = Dataset::new("measured", rows)?;

    let fit = fit(&robot, &dataset, &FitOptions::default())?;
    println!("{} lengths, {} of {} parameters free", dataset.rows.len(), fit.free_parameters(), fit.parameters.len());
    println!(
        "RMS residual: {:.4} mm with the design, {:.4} mm fitted",
        mm_from_m(fit.initial.rms_m),
        mm_from_m(fit.fitted.rms_m)
    );
    println!("\nparameter     design       fitted    deviation");
    for fitted in fit.parameters.iter().filter(|fitted| fitted.held.is_none()) {
        let unit = ScreenUnit::from(fitted.unit);
        let shown = |value: f64| fixed(unit.from_si(value), 4);
        let std = fitted.std.map_or("?".to_owned(), shown);
        println!("{:9} {:>10} {:>12} {std:>12} {}", fitted.name, shown(fitted.initial), shown(fitted.fitted), unit.name());
    }
    Ok(())
}

/// A robot from numbers: `x y z alpha beta gamma offset scale` of each link and its joint, `x y z alpha beta gamma` of the last link.
fn robot() -> Result<Robot, Box<dyn Error>> {
    const RIGHT_RAD: f64 = std::f64::consts::FRAC_PI_2;
    #[rustfmt::skip]
    let parameters = [
        0.0,     0.0,      0.6604,  0.0,       0.0, 0.0,        -RIGHT_RAD, 1.0,
        -0.18,   0.0,      0.0,     RIGHT_RAD, 0.0, -RIGHT_RAD, 0.0,        1.0,
        0.4318,  0.0,      -0.0309, 0.0,       0.0, 0.0,        -RIGHT_RAD, 1.0,
        0.43307, -0.02032, 0.0,     RIGHT_RAD, 0.0, RIGHT_RAD,  0.0,        1.0,
        0.0,     0.0,      0.0,     0.0,       0.0, -RIGHT_RAD, 0.0,        1.0,
        0.0,     0.0,      0.0,     0.0,       0.0, RIGHT_RAD,  0.0,        1.0,
        0.0,     0.0,      0.05625, 0.0,       0.0, 0.0,
    ];
    let chain = Chain::new(&[JointKind::Revolute; 6], &parameters)?;
    Ok(Robot::new("my arm", chain, vec![JointLimits { min: -2.0, max: 2.0 }; 6])?)
}

/// Chucks in the base frame, spheres in the tool frame, metres.
fn rig() -> Result<Rig, Box<dyn Error>> {
    let chucks = vec![
        NamedPoint::new("A", [0.565, 0.0, 0.0]),
        NamedPoint::new("B", [0.392, 0.1, 0.0]),
        NamedPoint::new("C", [0.392, -0.1, 0.0]),
    ];
    let spheres = vec![
        NamedPoint::new("1", [0.058, 0.0, 0.05]),
        NamedPoint::new("2", [-0.029, 0.05, 0.05]),
        NamedPoint::new("3", [-0.029, -0.05, 0.05]),
    ];
    Ok(Rig::new(chucks, spheres, Some(Bar::new(vec![0.46, 0.61], 0.075)))?)
}

/// One length, and where the arm stood.
struct Reading {
    chuck: usize,
    sphere: usize,
    q_rad: [f64; 6],
    length_m: f64,
}

/// What was read at each pose: here of an arm whose links differ a little from their design, to some hundredths of a
/// millimetre.
fn measured(robot: &Robot, rig: &Rig) -> Result<Vec<Reading>, Box<dyn Error>> {
    let mut truth = designs::puma560().chain;
    for (name, change) in [("x3", 0.0015), ("z1", -0.002), ("gamma4", 0.002), ("scale2", 0.001)] {
        truth.parameters_mut()[name.parse::<Parameter>()?.index()] += change;
    }
    let truth = Kinematics::new(&truth);
    let pose = |i: usize| {
        let (chuck, sphere) = (i % 3, i / 3 % 3);
        let q_rad = std::array::from_fn(|joint| 1.5 * (((joint + 2) as f64).sqrt() * (i * i + i) as f64).sin());
        let pairing = rig.pairing(PairingId { chuck, sphere });
        let noise_m = 30e-6 * (37.0 * (i * i) as f64).sin();
        let length_m = truth.length(&robot.chain.joint_vector(&q_rad)?, &pairing) + noise_m;
        Ok(Reading { chuck, sphere, q_rad, length_m })
    };
    (0..500).map(pose).collect()
}
