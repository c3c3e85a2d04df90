//! The paper's robot and a rig to go with it, in numbers: to try things with, and as a pattern for a robot of one's own.

use std::iter;

use ballbar::{Chain, JointKind};

use crate::model::{Bar, JointLimits, NamedPoint, Rig, Robot};
use crate::units::m_from_mm;

/// `x y z` in millimetres and `alpha beta gamma` in degrees of each link of a PUMA 560, from the base to the tool.
const PUMA560_LINKS: [([f64; 3], [f64; 3]); 7] = [
    ([0.0, 0.0, 660.4], [0.0, 0.0, 0.0]),
    ([-180.0, 0.0, 0.0], [90.0, 0.0, -90.0]),
    ([431.8, 0.0, -30.91], [0.0, 0.0, 0.0]),
    ([433.07, -20.32, 0.0], [90.0, 0.0, 90.0]),
    ([0.0, 0.0, 0.0], [0.0, 0.0, -90.0]),
    ([0.0, 0.0, 0.0], [0.0, 0.0, 90.0]),
    ([0.0, 0.0, 56.25], [0.0, 0.0, 0.0]),
];

/// Joint value at encoder output zero, and the limits of the encoder's output, degrees.
const PUMA560_JOINTS: [(f64, [f64; 2]); 6] = [
    (-90.0, [-160.0, 160.0]),
    (0.0, [-225.0, 45.0]),
    (-90.0, [-45.0, 225.0]),
    (0.0, [-110.0, 170.0]),
    (0.0, [-100.0, 100.0]),
    (0.0, [-266.0, 266.0]),
];

/// The Unimation PUMA 560 by its design: Table II of A. Goswami, A. Quaid and M. Peshkin, "Identifying Robot Parameters Using Partial Pose
/// Information", IEEE Control Systems 13(5), 1993, column "Parameters as supplied by the manufacturer" (its centimetres in millimetres).
/// The table has no limits; these are the ranges of the frames of K. S. Fu, R. C. Gonzalez and C. S. G. Lee, "Robotics", 1987. Its encoders are
/// taken as ideal.
pub fn puma560() -> Robot {
    const IDEAL: f64 = 1.0;
    let links = PUMA560_LINKS.iter().map(|(translation_mm, rotation_deg)| {
        translation_mm.iter().copied().map(m_from_mm).chain(rotation_deg.iter().copied().map(f64::to_radians))
    });
    let encoders = PUMA560_JOINTS.iter().map(|(offset_deg, _)| vec![offset_deg.to_radians(), IDEAL]);
    // The last link has no joint behind it.
    let encoders = encoders.chain(iter::once(Vec::new()));
    let parameters: Vec<f64> = links.zip(encoders).flat_map(|(link, encoder)| link.chain(encoder)).collect();
    let range = |(_, [min, max]): &(f64, [f64; 2])| JointLimits { min: min.to_radians(), max: max.to_radians() };
    let limits = PUMA560_JOINTS.iter().map(range).collect();
    #[expect(clippy::expect_used, reason = "a test sees that these constants are a robot")]
    let chain = Chain::new(&[JointKind::Revolute; 6], &parameters).expect("seven links and six joints of finite numbers");
    #[expect(clippy::expect_used, reason = "a test sees that these constants are a robot")]
    Robot::new("PUMA 560", chain, limits).expect("a range for each joint")
}

/// Three chucks before the base of a PUMA 560 and three spheres on its tool, each at the corners of an equilateral triangle, as in Fig. 1 of the
/// paper, which gives no positions; bars of 460 and 610 mm with the paper's travel of 75 mm.
pub fn triangles() -> Rig {
    const CHUCKS_MM: [(&str, [f64; 3]); 3] =
        [("A", [565.470054, 0.0, 0.0]), ("B", [392.264973, 100.0, 0.0]), ("C", [392.264973, -100.0, 0.0])];
    const SPHERES_MM: [(&str, [f64; 3]); 3] =
        [("1", [57.735027, 0.0, 50.0]), ("2", [-28.867513, 50.0, 50.0]), ("3", [-28.867513, -50.0, 50.0])];
    const LENGTHS_MM: [f64; 2] = [460.0, 610.0];
    const TRAVEL_MM: f64 = 75.0;
    let points = |points_mm: &[(&str, [f64; 3])]| {
        points_mm.iter().map(|(name, position_mm)| NamedPoint::new(*name, position_mm.map(m_from_mm))).collect()
    };
    let bar = Bar::new(LENGTHS_MM.map(m_from_mm).to_vec(), m_from_mm(TRAVEL_MM));
    #[expect(clippy::expect_used, reason = "a test sees that these constants are a rig")]
    Rig::new(points(&CHUCKS_MM), points(&SPHERES_MM), Some(bar)).expect("three named chucks and spheres")
}
