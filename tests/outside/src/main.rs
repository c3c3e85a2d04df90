//! Fits arrays of joint values and lengths, and prints what the result is worth.

use ballbar_calib::assess::{Answer, Assessment, Evidence};
use ballbar_calib::identify::{FitOptions, fit};
use ballbar_calib::model::{Dataset, PairingId, PoseRow};
use ballbar_calib::{Kinematics, designs};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (robot, rig) = (designs::puma560(), designs::triangles());
    let mut truth = robot.chain.clone();
    truth.parameters_mut().iter_mut().enumerate().for_each(|(i, value)| *value += 1e-3 * (1.7 * i as f64).sin());
    let truth = Kinematics::new(&truth);

    let mut rows = Vec::new();
    for i in 0..400_u32 {
        let pairing = PairingId { chuck: i as usize % 3, sphere: i as usize / 3 % 3 };
        let q: Vec<f64> = (1..7).map(|joint| (f64::from(joint).sqrt() * f64::from(i * i + i)).sin()).collect();
        let q = robot.chain.joint_vector(&q)?;
        // Of many sines that never meet, as good as normal: some hundredths of a millimetre.
        let noise_m =
            25e-6 * [2.0, 3.0, 5.0, 7.0, 11.0, 13.0].map(|n: f64| (n.sqrt() * f64::from(i * i)).sin()).iter().sum::<f64>();
        rows.push(PoseRow::new(&rig, pairing, q, truth.length(&q, &rig.pairing(pairing)) + noise_m)?);
    }
    let dataset = Dataset::new("arrays", rows)?;

    let result = fit(&robot, &dataset, &FitOptions::default())?;
    let assessment = Assessment::new(&Evidence::new(&robot, &rig, &dataset, &result));
    println!("{}. {}", assessment.answer.words(), assessment.reasons.join(" "));
    for proof in &assessment.proofs {
        let [before_mm, after_mm] = [proof.before_summary(), proof.after_summary()].map(|summary| 1e3 * summary.rms_m);
        println!("On {}: {before_mm:.3} mm before, {after_mm:.3} mm after.", proof.name);
    }
    if assessment.answer == Answer::NotTrusted { Err("the fit is not to be trusted".into()) } else { Ok(()) }
}
