//! Plans, and the robots that they are made for, in the tests of planning.

use ballbar::{Chain, Kinematics, Measurement, ParameterUnit};
use ballbar_calib::identify::{FitOptions, fit};
use ballbar_calib::model::{PairingId, PoseRow, Rig, Robot};
use ballbar_calib::plan::{Grid, Margins, Pace, Plan, PlanOptions, PlanRow, plan};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

use crate::experiment::dataset;
use crate::solids::NaiveCell;

const LATITUDES_DEG: [f64; 3] = [20.0, 45.0, 70.0];

/// Of shells of a rig by names, 75 mm of travel.
pub fn options(rig: &Rig, pairings: &[(&str, &str)], bars_m: &[f64], poses_per_shell: usize) -> PlanOptions {
    let id = |(chuck, sphere): &(&str, &str)| PairingId { chuck: rig.chuck(chuck).unwrap(), sphere: rig.sphere(sphere).unwrap() };
    PlanOptions {
        pairings: pairings.iter().map(id).collect(),
        bars_m: bars_m.to_vec(),
        travel_m: 0.075,
        grid: Grid::of(&LATITUDES_DEG, poses_per_shell),
        poses_per_shell,
        optimal: None,
        margins: Margins::default(),
        pace: Pace::default(),
        seed: 0,
    }
}

/// A plan that has to be found.
pub fn planned(robot: &Robot, rig: &Rig, options: &PlanOptions) -> Plan {
    plan(robot, rig, options, &|_| ()).unwrap()
}

/// Joint vectors from the row before to a row, at most `step` of a joint apart, the row's own among them; and whether the bar is on.
/// Joint vectors from the row before to a row, at most `step` of a joint apart, the row's own among them; and whether the bar is on.
fn way<'a>(rows: &'a [PlanRow], i: usize, joints: usize, step: f64) -> impl Iterator<Item = (Vec<f64>, bool)> + 'a {
    let to = rows[i].q.as_array()[..joints].to_vec();
    let before = if i > 0 { &rows[i - 1] } else { &rows[i] };
    let from = before.q.as_array()[..joints].to_vec();
    let stays_on =
        before.bar.is_some() && rows[i].bar.is_some() && before.pairing == rows[i].pairing && before.bar_m == rows[i].bar_m;
    let farthest = from.iter().zip(&to).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max);
    let pieces = (farthest / step).ceil().max(1.0) as usize;
    (1..=pieces).map(move |piece| {
        let share = piece as f64 / pieces as f64;
        let q = from.iter().zip(&to).map(|(a, b)| a + (b - a) * share).collect();
        (q, if piece == pieces { rows[i].bar.is_some() } else { stays_on })
    })
}

/// The least gap, metres, and the least rest of travel, metres, over all rows and fine steps between them.
pub fn least_by_naive_cell(robot: &Robot, rig: &Rig, rows: &[PlanRow], step: f64) -> ((f64, String), f64) {
    let cell = NaiveCell::new(robot, rig, Margins::default().clearance_m);
    assert!(cell.pairs() > 0);
    let (mut gap, mut travel_m) = ((f64::INFINITY, String::new()), f64::INFINITY);
    for (i, row) in rows.iter().enumerate() {
        for (q, is_on) in way(rows, i, robot.chain.joints(), step) {
            let here = cell.gap_m(&q, is_on.then_some(row.pairing));
            if here.0 < gap.0 {
                gap = (here.0, format!("{} before row {}", here.1, i + 1));
            }
            if is_on {
                travel_m = travel_m.min(0.0375 - (cell.length_m(&q, row.pairing) - row.bar_m).abs());
            }
        }
    }
    (gap, travel_m)
}

fn plausible_deviation(unit: ParameterUnit) -> f64 {
    match unit {
        ParameterUnit::Metre => 5e-3 / 3.0,
        ParameterUnit::Radian => 0.5_f64.to_radians() / 3.0,
        ParameterUnit::One => 0.5e-2 / 3.0,
        ParameterUnit::Second | ParameterUnit::RadianPerNewtonMetre | ParameterUnit::MetrePerNewton => {
            unreachable!("no parameter of a chain is in {unit:?}")
        }
    }
}

/// A robot as it may be when `design` is what was meant. Parameters that only do what others do keep their value.
pub fn plausible_robot(design: &Chain<f64>, rng: &mut ChaCha8Rng) -> Chain<f64> {
    let mut chain = design.clone();
    for i in 0..design.parameter_count() {
        let parameter = ballbar::Parameter::from_index(i);
        if !design.is_conventionally_held(parameter) {
            chain.parameters_mut()[i] += Normal::new(0.0, plausible_deviation(design.unit(parameter))).unwrap().sample(rng);
        }
    }
    chain
}

/// The robot with parameters off as far as a design plausibly is: what a fit finds.
pub fn fitted(design: &Robot, rig: &Rig, seed: u64) -> Robot {
    const SIGMA_M: f64 = 0.084e-3;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let truth = Kinematics::new(&plausible_robot(&design.chain, &mut rng));
    let noise = Normal::new(0.0, SIGMA_M).unwrap();
    let pose = |number: usize| {
        let q: Vec<f64> = design.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
        let id = rig.all_pairings()[number % rig.all_pairings().len()];
        let (pairing, q) = (rig.pairing(id), design.chain.joint_vector(&q).unwrap());
        let length_m = truth.length(&q, &pairing) + noise.sample(&mut rng);
        PoseRow {
            pairing: id,
            measurement: Measurement::new(pairing, q, length_m),
            approach: ballbar::Approach::UNKNOWN,
            sigma_m: None,
            set: None,
            t_s: None,
            bar_m: None,
            motion: None,
            file: 0,
            line: number,
            number,
        }
    };
    let rows = (1..=200).map(pose).collect();
    let found = fit(design, &dataset(rows), &FitOptions::default()).unwrap();
    let mut robot = design.clone();
    robot.chain = found.solution.chain;
    robot
}
