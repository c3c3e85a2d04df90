//! Data that are wrong as a whole are never believed, and their mistake is named; good ones are never refused.

use ballbar::JointKind;
use ballbar_calib::assess::{Answer, Assessment, Evidence};
use ballbar_calib::identify::{FitOptions, fit};
use ballbar_calib::model::{Dataset, NamedPoint, PairingId, Rig};
use ballbar_tests::at_length::at_length;
use ballbar_tests::experiment::Cell;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn assess(cell: &Cell, dataset: &Dataset) -> Assessment {
    let fit = fit(&cell.design, dataset, &FitOptions::default()).expect("enough poses");
    Assessment::new(&Evidence::new(&cell.design, &cell.rig, dataset, &fit))
}

/// What people get wrong, of all rows alike.
#[derive(Clone, Copy, Debug)]
enum Mistake {
    Chucks(usize, usize),
    ChucksInARing,
    Spheres(usize, usize),
    SpheresInARing,
    Joints(usize, usize),
    Sign(usize),
    Shuffled,
    Shifted(isize),
    /// A coordinate of all chucks, or of all spheres.
    Mirrored(bool, usize),
    OtherRobot,
    Radians,
    DegreesTwice,
    /// How many millimetres the unit of the lengths has.
    Unit(f64),
    NoNominal,
    OtherRod(f64),
    /// Chucks exchanged and a joint's sign: two at once have no name.
    Two,
}

const ALL: [Mistake; 30] = [
    Mistake::Chucks(0, 1),
    Mistake::Chucks(1, 2),
    Mistake::ChucksInARing,
    Mistake::Spheres(0, 1),
    Mistake::Spheres(1, 2),
    Mistake::SpheresInARing,
    Mistake::Joints(0, 1),
    Mistake::Joints(1, 4),
    Mistake::Joints(4, 5),
    Mistake::Joints(3, 5),
    Mistake::Sign(0),
    Mistake::Sign(1),
    Mistake::Sign(3),
    Mistake::Sign(4),
    Mistake::Shuffled,
    Mistake::Shifted(1),
    Mistake::Shifted(-1),
    Mistake::Mirrored(true, 1),
    Mistake::Mirrored(true, 0),
    Mistake::Mirrored(false, 0),
    Mistake::OtherRobot,
    Mistake::Radians,
    Mistake::DegreesTwice,
    Mistake::Unit(25.4),
    Mistake::Unit(1000.0),
    Mistake::Unit(10.0),
    Mistake::NoNominal,
    Mistake::OtherRod(0.15),
    Mistake::Mirrored(true, 2),
    Mistake::Two,
];

/// Chucks and spheres of which no three are in a line and not all in a plane, at other heights.
fn room() -> Rig {
    let points = |points: &[(&str, [f64; 3])]| points.iter().map(|(name, at)| NamedPoint::new(*name, *at)).collect();
    let mut rig = Cell::new("puma560", 0).rig;
    rig.chucks =
        points(&[("A", [0.50, 0.05, 0.0]), ("B", [0.30, 0.33, 0.06]), ("C", [0.36, -0.28, 0.03]), ("D", [0.12, -0.42, 0.11])]);
    rig.spheres = points(&[("1", [0.07, 0.01, 0.06]), ("2", [-0.02, 0.055, 0.04]), ("3", [-0.035, -0.04, 0.07])]);
    rig
}

impl Mistake {
    /// Data that are wrong in this way, and words of which one names it. `None` where this robot or rig cannot be wrong so.
    fn make(self, cell: &Cell, good: &Dataset, seed: u64) -> Option<(Dataset, Vec<String>)> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let kinds = cell.design.chain.joint_kinds();
        let (chucks, spheres) = (cell.rig.chucks.len(), cell.rig.spheres.len());
        let mut wrong = good.clone();
        let mut rename = |to: &dyn Fn(PairingId) -> PairingId| {
            for row in &mut wrong.rows {
                row.pairing = to(row.pairing);
                row.measurement.pairing = cell.rig.pairing(row.pairing);
            }
        };
        let exchanged = |index: usize, a: usize, b: usize| {
            if index == a {
                b
            } else if index == b {
                a
            } else {
                index
            }
        };
        let name = |points: &[NamedPoint], index: usize| points[index].name.clone();
        let unrelated = "have nothing to do with the joint values".to_owned();
        let words = match self {
            Self::Chucks(a, b) => {
                rename(&|of| PairingId { chuck: exchanged(of.chuck, a, b), ..of });
                vec![format!("chucks {} and {} look exchanged", name(&cell.rig.chucks, a), name(&cell.rig.chucks, b))]
            }
            Self::Spheres(a, b) => {
                rename(&|of| PairingId { sphere: exchanged(of.sphere, a, b), ..of });
                vec![format!("spheres {} and {} look exchanged", name(&cell.rig.spheres, a), name(&cell.rig.spheres, b))]
            }
            Self::ChucksInARing => {
                rename(&|of| PairingId { chuck: if of.chuck < 3 { (of.chuck + 1) % 3 } else { of.chuck }, ..of });
                vec!["chucks A, B and C look exchanged".to_owned()]
            }
            Self::SpheresInARing => {
                rename(&|of| PairingId { sphere: (of.sphere + 1) % spheres, ..of });
                vec!["spheres 1, 2 and 3 look exchanged".to_owned()]
            }
            Self::Joints(a, b) => {
                (b < kinds.len() && kinds[a] == kinds[b]).then_some(())?;
                wrong.rows.iter_mut().for_each(|row| row.measurement.q.as_array_mut().swap(a, b));
                vec![format!("joints {} and {} look exchanged", a + 1, b + 1)]
            }
            Self::Sign(joint) => {
                (joint < kinds.len()).then_some(())?;
                wrong.rows.iter_mut().for_each(|row| row.measurement.q.as_array_mut()[joint] *= -1.0);
                vec![format!("joint {} looks as if it were counted with the wrong sign", joint + 1)]
            }
            Self::Shuffled | Self::Shifted(_) => {
                let count = good.rows.len();
                let mut order: Vec<usize> = (0..count).collect();
                match self {
                    Self::Shifted(by) => {
                        order.iter_mut().for_each(|row| *row = row.wrapping_add_signed(by + count as isize) % count)
                    }
                    _ => order.shuffle(&mut rng),
                }
                for (row, from) in wrong.rows.iter_mut().zip(order) {
                    row.measurement.length_m = good.rows[from].measurement.length_m;
                }
                match self {
                    Self::Shifted(by) => {
                        vec![if by > 0 { "that of the previous pose" } else { "that of the next pose" }.to_owned()]
                    }
                    _ => vec![unrelated],
                }
            }
            Self::Mirrored(are_chucks, axis) => {
                let points = if are_chucks { &cell.rig.chucks } else { &cell.rig.spheres };
                (points.iter().any(|point| point.position_m[axis] != 0.0)).then_some(())?;
                for row in &mut wrong.rows {
                    let pairing = &mut row.measurement.pairing;
                    if are_chucks { pairing.chuck_base_m[axis] *= -1.0 } else { pairing.sphere_tool_m[axis] *= -1.0 }
                }
                // Of a triangle in a plane it is two of its corners exchanged, or a turn.
                vec!["look mirrored".to_owned(), "look exchanged".to_owned(), "link 1, where the robot stands,".to_owned()]
            }
            Self::OtherRobot => {
                (kinds.len() == 6).then_some(())?;
                let other = Cell::new(if cell.design.name.to_lowercase().contains("ur5e") { "irb120" } else { "ur5e" }, seed);
                let other = Cell { rig: cell.rig.clone(), ..other };
                wrong = other.measured(0.46, good.rows.len() / (chucks * spheres), SIGMA_M, seed);
                vec![unrelated, "another robot".to_owned()]
            }
            Self::Radians | Self::DegreesTwice => {
                for row in &mut wrong.rows {
                    let turns =
                        row.measurement.q.as_array_mut().iter_mut().zip(kinds).filter(|(_, kind)| **kind == JointKind::Revolute);
                    turns.for_each(|(q, _)| *q = if matches!(self, Self::Radians) { q.to_radians() } else { q.to_degrees() });
                }
                let how = if matches!(self, Self::Radians) { "radians where degrees" } else { "degrees converted once more" };
                vec![format!("look like {how}")]
            }
            Self::Unit(mm) => {
                wrong.rows.iter_mut().for_each(|row| row.measurement.length_m /= mm);
                let unit = if mm == 25.4 {
                    "inches"
                } else if mm == 10.0 {
                    "centimetres"
                } else {
                    "metres"
                };
                vec![format!("lengths look like {unit}")]
            }
            Self::NoNominal => {
                wrong.rows.iter_mut().for_each(|row| row.measurement.length_m -= 0.46);
                vec!["460 mm too short: the bar's nominal length is missing".to_owned()]
            }
            Self::OtherRod(by_m) => {
                wrong.rows.iter_mut().for_each(|row| row.measurement.length_m += by_m);
                vec!["150 mm too long: another rod".to_owned()]
            }
            Self::Two => {
                rename(&|of| PairingId { chuck: exchanged(of.chuck, 0, 1), ..of });
                wrong.rows.iter_mut().for_each(|row| row.measurement.q.as_array_mut()[1] *= -1.0);
                vec![String::new()]
            }
        };
        Some((wrong, words))
    }
}

const ROBOTS: [&str; 4] = ["puma560", "ur5e", "stanford", "irb120"];
const SIGMA_M: f64 = 84e-6;

/// A robot, a rig and good lengths of it: 60 to 300.
fn measured(seed: u64) -> (Cell, Dataset) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut cell = Cell::new(ROBOTS[seed as usize % ROBOTS.len()], seed);
    if seed / 4 % 2 == 1 {
        cell.rig = room();
    }
    let pairings = cell.rig.all_pairings().len();
    let per_pairing = rng.random_range(60_usize.div_ceil(pairings)..=300 / pairings);
    let mut good = cell.measured(0.46, per_pairing, SIGMA_M, seed);
    if rng.random_bool(0.5) {
        good.rows.iter_mut().for_each(|row| row.sigma_m = Some(SIGMA_M));
    }
    (cell, good)
}

#[test]
fn wrong_data_are_never_believed_and_their_mistake_is_named() {
    let (mut runs, mut named) = (0, 0);
    let mut believed = Vec::new();
    // Each mistake with another robot, rig and number of rows: 7 and 30 have no common factor.
    for seed in 0..at_length(ALL.len()) as u64 {
        let (cell, good) = measured(seed * 7 + seed / 8);
        let mistake = ALL[seed as usize % ALL.len()];
        let Some((wrong, words)) = mistake.make(&cell, &good, seed) else { continue };
        let told = assess(&cell, &wrong);
        let last = told.reasons.last().cloned().unwrap_or_default();
        let is_named = words.iter().any(|words| last.contains(words.as_str()));
        println!("{seed} {} {mistake:?} {} rows, {:?}, {is_named}: {last}", cell.design.name, wrong.rows.len(), told.answer);
        if told.answer != Answer::NotTrusted {
            believed.push(format!("{seed} {} {mistake:?}: {:?}", cell.design.name, told.reasons));
        }
        runs += 1;
        named += usize::from(is_named);
    }
    println!("{named} of {runs} named");
    assert!(believed.is_empty(), "{believed:#?}");
    assert!(named * 10 >= runs * 9, "{named} of {runs}");
}

#[test]
fn good_data_are_never_refused() {
    let runs = at_length(20);
    let mut reserved = 0;
    for seed in 0..runs as u64 {
        let (cell, good) = measured(seed);
        let told = assess(&cell, &good);
        assert_ne!(told.answer, Answer::NotTrusted, "{seed} {}, {} rows: {:?}", cell.design.name, good.rows.len(), told.reasons);
        if told.answer != Answer::Calibrated {
            println!("{seed} {}, {} rows: {:?}", cell.design.name, good.rows.len(), told.reasons);
            reserved += 1;
        }
    }
    println!("{reserved} of {runs} with reservations");
}

/// Chucks in a plane, or all but one of them, may be mirrored and still fit, by a robot that stands elsewhere: that is a mistake all the same. A
/// robot that stands elsewhere with nothing wrong is believed, with a reservation.
#[test]
fn what_a_robot_that_stands_elsewhere_explains_may_be_a_mistake() {
    let (mut cell, good) = measured(1268);
    let (wrong, _) = Mistake::Mirrored(true, 2).make(&cell, &good, 0).expect("chucks at several heights");
    let told = assess(&cell, &wrong);
    assert_eq!(told.answer, Answer::NotTrusted, "{:?}", told.reasons);
    assert!(told.reasons.last().is_some_and(|last| last.contains("all chucks look mirrored: their z")), "{:?}", told.reasons);

    for (parameter, by) in [(0, 0.2), (1, -0.15), (3, 0.3), (50, 0.13), (51, 0.4)] {
        let design = cell.design.clone();
        cell.design.chain.parameters_mut()[parameter] += by;
        let told = assess(&cell, &good);
        assert_eq!(told.answer, Answer::Reserved, "{parameter} by {by}: {:?}", told.reasons);
        cell.design = design;
    }
}
