//! Why rows were left out: faults of each kind, injected into simulated lengths, are named; gross errors without a cause are not.

mod faults;

use std::f64::consts::TAU;

use ballbar_calib::assess::{Cause, CauseKind, FittedRows, RowsOf, causes};
use ballbar_calib::identify::{LmOptions, WrongRow, residuals, solve_lengths};
use ballbar_calib::model::{Dataset, End, PairingId, Rig, Robot};
use ballbar_calib::{Encoder, FreeParameters, Parameter, Vector3};
use ballbar_tests::at_length::at_length;
use ballbar_tests::data::real_data;
use ballbar_tests::experiment::Puma;
use host_cal::files::{open_rig, open_robot, read_poses};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use faults::{Bench, Fault, gross};

/// A fit to the rows that are not wrong, and what is said of the others.
struct Told {
    /// Rows that were left out.
    left_out: Vec<usize>,
    causes: Vec<Cause>,
}

impl Told {
    /// Fits all rows but those that `is_wrong`, and leaves out what is then too far off.
    fn new(design: &Robot, rig: &Rig, dataset: &Dataset, sigma_m: f64, is_wrong: impl Fn(usize) -> bool) -> Self {
        let mut good = dataset.clone();
        let mut index = 0..;
        good.rows.retain(|_| !is_wrong(index.next().unwrap()));
        // What a fit of all that these rows identify would find, without what it finds out beside it.
        let is_free = |index: &usize| !design.chain.is_conventionally_held(Parameter::from_index(*index));
        let free = FreeParameters::from_indices((0..design.chain.parameter_count()).filter(is_free)).unwrap();
        let found = solve_lengths(&design.chain, &good.measurements(), &free, &LmOptions::default());
        Self::of(&Robot { chain: found.chain, ..design.clone() }, rig, dataset, sigma_m)
    }

    fn of(robot: &Robot, rig: &Rig, dataset: &Dataset, sigma_m: f64) -> Self {
        const FAR: f64 = 4.5; // standard deviations
        let residuals = residuals(&robot.kinematics(), dataset);
        let far = residuals.iter().map(|residual| residual.value_m / sigma_m).enumerate().filter(|(_, z)| z.abs() > FAR);
        let left_out: Vec<WrongRow> = far.map(|(row, deviations)| WrongRow { row, residual_m: 0.0, deviations }).collect();
        let fitted = FittedRows { robot, rig, dataset, residuals: &residuals, sigma_m };
        let causes = causes(&fitted, &left_out);
        let mut told: Vec<usize> = causes.iter().flat_map(|cause| cause.rows.iter().copied()).collect();
        told.sort_unstable();
        let left_out: Vec<usize> = left_out.iter().map(|one| one.row).collect();
        assert_eq!(told, left_out, "each row is in one cause");
        Self { left_out, causes }
    }

    fn text(&self) -> String {
        self.causes.iter().map(|cause| format!("{cause} [{:.1}, {} rows]\n", cause.log_odds, cause.rows.len())).collect()
    }

    /// Which share of the rows left out of `rows` is in causes of this kind.
    fn share(&self, rows: &[usize], is_it: impl Fn(&CauseKind) -> bool) -> f64 {
        let out = rows.iter().filter(|row| self.left_out.contains(row)).count();
        let right = self.causes.iter().filter(|cause| is_it(&cause.kind)).flat_map(|cause| &cause.rows);
        right.filter(|row| rows.contains(row)).count() as f64 / out.max(1) as f64
    }
}

/// What is counted of some runs.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    /// Runs in which nine of ten rows that were left out are given the right cause.
    named: usize,
    runs: usize,
    /// Gross errors beside them that are given a cause.
    accused: f64,
    gross: usize,
}

/// Of the faults at each share of rows, with as many gross errors beside them as follows.
#[test]
fn faults_of_each_kind_are_named() {
    let runs = at_length(2) as u64;
    for (share, more) in [(0.01, 0.0), (0.05, 0.02), (0.2, 0.03)] {
        let mut tallies = [Tally::default(); Fault::ALL.len()];
        for (sigma_m, seed) in [0.05e-3, 0.084e-3].into_iter().flat_map(|sigma_m| (0..runs).map(move |seed| (sigma_m, seed))) {
            let mut bench = Bench::new(seed, sigma_m);
            for (tally, fault) in tallies.iter_mut().zip(Fault::ALL) {
                let mut spoiled = bench.clean.clone();
                let (wrong, is_it) = fault.inject(&mut bench, &mut spoiled, share);
                let gross = gross(&mut bench, &mut spoiled, more, &wrong);
                let told = bench.told(&spoiled, &[&wrong[..], &gross].concat());
                if wrong.iter().filter(|row| told.left_out.contains(row)).count() < fault.fewest() {
                    continue;
                }
                let right = told.share(&wrong, &is_it);
                if right < 0.9 {
                    println!("{fault:?}, {right:.2} of {} rows: {}", wrong.len(), told.text());
                }
                tally.named += usize::from(right >= 0.9);
                tally.runs += 1;
                tally.accused += told.share(&gross, |kind| *kind != CauseKind::Unknown) * gross.len() as f64;
                tally.gross += gross.len();
            }
        }
        Fault::ALL.iter().zip(&tallies).for_each(|(fault, tally)| println!("{share} {fault:?}: {tally:?}"));
        let sum = |of: fn(&Tally) -> f64| tallies.iter().map(of).sum::<f64>();
        let (named, all) = (sum(|tally| tally.named as f64), sum(|tally| tally.runs as f64));
        let (accused, gross) = (sum(|tally| tally.accused), sum(|tally| tally.gross as f64));
        println!("{share}: {named} of {all} named, {accused} of {gross} gross errors accused");
        assert!(named >= 0.9 * all, "{share}: {named} of {all}");
        assert!(accused <= 0.05 * gross, "{share}: {accused} of {gross}");
    }
}

#[test]
fn gross_errors_have_no_cause() {
    let runs = at_length(10) as u64;
    let (mut accused, mut all) = (0.0, 0);
    for sigma_m in [0.05e-3, 0.084e-3] {
        let mut bench = Bench::new(0, sigma_m);
        for share in [0.003, 0.01, 0.05, 0.2] {
            let (mut named, mut of) = (0.0, 0);
            let runs = if share < 0.02 { 5 * runs } else { runs };
            for _ in 0..runs {
                let mut spoiled = bench.clean.clone();
                let wrong = gross(&mut bench, &mut spoiled, share, &[]);
                let told = bench.told(&spoiled, &wrong);
                named += told.share(&wrong, |kind| *kind != CauseKind::Unknown) * wrong.len() as f64;
                of += wrong.len();
                if told.causes[0].kind != CauseKind::Unknown {
                    println!("{}", told.text());
                }
            }
            println!("{:.0} um, {share} of rows: {named} of {of}", sigma_m * 1e6);
            (accused, all) = (accused + named, all + of);
        }
    }
    assert!(accused <= 0.03 * f64::from(all as u32), "{accused} of {all}");
}

/// What people sent: `(wrong rows by number, the cause)` of a file of `cases`.
fn told_of_case(folder: &str, file: &str, is_wrong: impl Fn(usize) -> bool) -> Option<Told> {
    let folder = real_data("cases")?.join(folder);
    let design = open_robot(folder.join("design.toml").to_str().unwrap()).unwrap();
    let rig = Puma::default().rig;
    let dataset = read_poses([folder.join(file).as_path()], &design, &rig).unwrap();
    let told = Told::new(&design, &rig, &dataset, 0.05e-3, |row| is_wrong(dataset.rows[row].number));
    println!("{file}: {}", told.text());
    Some(told)
}

#[test]
fn what_people_sent_is_named() {
    const GROSS: [usize; 36] = [
        7, 16, 23, 45, 56, 84, 87, 88, 89, 103, 117, 119, 158, 177, 188, 190, 192, 202, 208, 225, 241, 251, 258, 261, 264, 267,
        277, 281, 296, 297, 304, 315, 332, 340, 346, 360,
    ];
    let Some(told) = told_of_case("outliers", "out10.csv", |row| GROSS.contains(&row)) else { return };
    assert_eq!((told.left_out.len(), told.causes.len()), (36, 1));
    assert_eq!(told.causes[0].kind, CauseKind::Unknown);
    let told = told_of_case("outliers", "onepair.csv", |row| row == 6).unwrap();
    assert_eq!(told.causes[0].kind, CauseKind::OtherEnd { end: End::Sphere, named: 1, really: 0 });
    let told = told_of_case("outliers", "slip.csv", |row| {
        (201..=220).contains(&row) || (261..=280).contains(&row) || (321..=340).contains(&row)
    })
    .unwrap();
    assert!(told.text().starts_with("the lengths of sphere 2 from row 201 on are 1.49"), "{}", told.text());
    let CauseKind::LengthOffset { by_m, ref of, .. } = told.causes[0].kind else { panic!("{}", told.text()) };
    assert!((by_m - 1.5e-3).abs() < 0.05e-3 && *of == RowsOf::Sphere(1) && told.causes[0].rows.len() == 60, "{}", told.text());
}

/// Chucks exchanged in the first of two sets: the rows of the other say what the robot is.
#[test]
fn chucks_exchanged_in_one_set_are_named() {
    let Some(folder) = real_data("cases") else { return };
    let folder = folder.join("wrong_data");
    let design = open_robot(folder.join("design.toml").to_str().unwrap()).unwrap();
    let rig = Puma::default().rig;
    let mut dataset = read_poses([folder.join("chucks_exchanged.csv").as_path()], &design, &rig).unwrap();
    for row in dataset.rows.iter_mut().filter(|row| row.set.as_deref() == Some("610") && row.pairing.chuck < 2) {
        row.pairing.chuck = 1 - row.pairing.chuck;
        row.measurement.pairing = rig.pairing(row.pairing);
    }
    let wrong: Vec<bool> = dataset.rows.iter().map(|row| row.set.as_deref() == Some("460") && row.pairing.chuck < 2).collect();
    let told = Told::new(&design, &rig, &dataset, 0.05e-3, |row| wrong[row]);
    let [only] = &told.causes[..] else { panic!("{}", told.text()) };
    assert_eq!(only.to_string(), "chucks A and B look exchanged in all rows of set 460");
    assert_eq!(only.kind, CauseKind::EndsExchanged { end: End::Chuck, between: [0, 1] });
}

/// A real robot, whose residuals are not its noise alone: a tenth of its rows with gross errors, and a tenth with another chuck.
#[test]
fn a_real_robot_is_no_different() {
    let Some(folder) = real_data("irb120") else { return };
    let design = open_robot(folder.join("robot.toml").to_str().unwrap()).unwrap();
    let rig = open_rig(folder.join("rig.toml").to_str().unwrap()).unwrap();
    let clean = read_poses([folder.join("poses.csv").as_path()], &design, &rig).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut spoiled, mut renamed) = (clean.clone(), clean.clone());
    let wrong = |row: usize| row % 10 == 3;
    for row in (0..clean.rows.len()).filter(|row| wrong(*row)) {
        spoiled.rows[row].measurement.length_m += rng.random_range(1e-3..20e-3);
        let PairingId { chuck, sphere } = clean.rows[row].pairing;
        let pairing = PairingId { chuck: (chuck + 1) % rig.chucks.len(), sphere };
        (renamed.rows[row].pairing, renamed.rows[row].measurement.pairing) = (pairing, rig.pairing(pairing));
    }
    let of = |dataset: &Dataset, is_it: &dyn Fn(&CauseKind) -> bool| {
        let told = Told::new(&design, &rig, dataset, 0.15e-3, wrong);
        let wrong: Vec<usize> = told.left_out.iter().copied().filter(|row| wrong(*row)).collect();
        println!("{}", told.text());
        told.share(&wrong, is_it)
    };
    let accused = of(&spoiled, &|kind| *kind != CauseKind::Unknown);
    assert!(accused < 0.05, "{accused}");
    let is_pairing = |kind: &CauseKind| {
        matches!(
            kind,
            CauseKind::OtherEnd { .. }
                | CauseKind::OtherPairing { .. }
                | CauseKind::OtherPairings { .. }
                | CauseKind::EndsExchanged { .. }
        )
    };
    let named = of(&renamed, &is_pairing);
    assert!(named >= 0.9, "{named}");
}
