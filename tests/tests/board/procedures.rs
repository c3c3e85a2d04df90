//! What the procedures with a board refuse, whoever calls them: no caller has to think of a check.
#![cfg(unix)]

use std::num::NonZeroUsize;

use ballbar::LvdtCurve;
use ballbar::wire::{Answer, Command};
use ballbar_calib::model::Robot;
use ballbar_tests::data::real_data;
use ballbar_tests::frames::rewritten;
use ballbar_tests::scenarios;
use host_cal::board::{
    Admission, BAUD, BoardLink, HomeError, Homing, LvdtError, LvdtOrigin, LvdtPoint, RobotOnBoard, Upload, UploadError,
    UploadStep, fit_lvdt, nominal_lvdt, parameter_set, store_lvdt,
};
use host_cal::collect::{CheckedBoard, CollectError};
use host_cal::files::open_robot;
use host_cal::virtual_board::{Pace, VirtualBoard, VirtualBoardOptions};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const VECTORS: NonZeroUsize = NonZeroUsize::new(20).unwrap();

fn empty_board() -> (VirtualBoard, BoardLink) {
    let board = VirtualBoard::start(VirtualBoardOptions::new(scenarios::plant(1), Pace::Free)).unwrap();
    let link = BoardLink::connect(board.port(), BAUD).unwrap();
    (board, link)
}

fn board_with_the_design() -> (VirtualBoard, BoardLink) {
    let (board, mut link) = empty_board();
    let design = open_robot("puma560").unwrap();
    Upload::new(&design, Admission::Any, VECTORS).unwrap().put(&mut link, &mut |_| ()).unwrap();
    (board, link)
}

fn is_homed(link: &mut BoardLink) -> bool {
    let Answer::Status(status) = link.request(Command::Status).unwrap() else { panic!("a status") };
    status.encoders.iter().any(|encoder| encoder.is_homed)
}

fn curve(link: &mut BoardLink) -> LvdtCurve {
    RobotOnBoard::read(link).unwrap().unwrap().0.set().lvdt
}

#[test]
fn a_design_is_uploaded_only_where_that_is_said_and_compared_before_it_is_stored() {
    let (_board, mut link) = empty_board();
    let design = open_robot("puma560").unwrap();
    let refused = Upload::new(&design, Admission::Calibrated, VECTORS).unwrap_err();
    assert!(matches!(refused, UploadError::NotCalibrated { .. }), "{refused}");

    let mut steps = Vec::new();
    let uploaded = Upload::new(&design, Admission::Any, VECTORS).unwrap().put(&mut link, &mut |step| steps.push(step)).unwrap();
    assert_eq!((uploaded.replaced, uploaded.lvdt), (None, LvdtOrigin::Nominal));
    assert!(!uploaded.stored.is_calibrated);
    assert_eq!(steps[0], UploadStep::NominalLvdt);
    assert_eq!(steps[1..], [UploadStep::Compared; VECTORS.get()]);
    assert_eq!(uploaded.difference.vectors, VECTORS.get());
}

#[test]
fn frames_half_a_kilometre_away_cost_a_board_no_precision() {
    let Some(folder) = real_data("cases/far_frames") else { return };
    let [near, far] = ["near.toml", "far2.toml"].map(|name| Robot {
        // A UR5 says nothing of its encoders: those of six other joints will do.
        encoders: open_robot("puma560").unwrap().encoders,
        ..open_robot(folder.join(name).to_str().unwrap()).unwrap()
    });
    let (board, mut link) = empty_board();
    let mut put = |robot| Upload::new(robot, Admission::Any, VECTORS).unwrap().put(&mut link, &mut |_| ()).unwrap();
    for robot in [&near, &far] {
        let difference = put(robot).difference;
        assert!(difference.position_m < 1e-6 && difference.axis_rad < 1.5e-6, "{difference:?}");
    }
    drop(link);
    // Whoever has the same robot in other frames may collect with this board.
    let again = || BoardLink::connect(board.port(), BAUD).unwrap();
    Homing::begin(&mut again()).unwrap().at(&[0.0; 6], None).unwrap();
    assert!(CheckedBoard::read(again(), &near).is_ok() && CheckedBoard::read(again(), &far).is_ok());
}

#[test]
fn a_board_is_told_the_same_of_the_same_robot() {
    let design = open_robot("puma560").unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let other = Robot { chain: rewritten(&design.chain, 100.0, &mut rng), ..design.clone() };
    let told = |robot| parameter_set(robot, nominal_lvdt(0.075)).unwrap();
    let parameters = [told(&design), told(&other)].map(|set| set.parameters);
    assert!(parameters[0].iter().zip(&parameters[1]).all(|(a, b)| (a - b).abs() < 1e-7), "{parameters:?}");
}

#[test]
fn homing_refuses_what_cannot_be_the_boards_robot_and_presets_nothing() {
    let (_board, mut link) = empty_board();
    assert!(matches!(Homing::begin(&mut link), Err(HomeError::NoParameters)));

    let (_board, mut link) = board_with_the_design();
    let mut home = |q: &[f64], limits: Option<&str>| {
        let limits = limits.map(|name| open_robot(name).unwrap());
        Homing::begin(&mut link).unwrap().at(q, limits.as_ref())
    };
    for joints in [0, 5, 7, 100] {
        let found = home(&vec![0.0; joints], None);
        assert!(matches!(found, Err(HomeError::Joints { found, expected: 6 }) if found == joints), "{found:?}");
    }
    assert!(matches!(home(&[0.0; 6], Some("scara")), Err(HomeError::OtherRobot(_))));
    for far in [f64::NAN, f64::INFINITY, 1e9] {
        let found = home(&[0.0, 0.0, far, 0.0, 0.0, 0.0], None);
        assert!(matches!(found, Err(HomeError::OutOfRange { .. })), "{found:?}");
    }
    assert!(!is_homed(&mut link));

    // Beyond its limits the arm may stand all the same, and they are named.
    let puma = open_robot("puma560").unwrap();
    let homed = Homing::begin(&mut link).unwrap().at(&[9.0, 0.0, 0.0, 0.0, 0.0, 0.0], Some(&puma)).unwrap();
    assert_eq!(homed.beyond_limits.map(|joints| joints.len()), Some(1));
    assert!(is_homed(&mut link));
}

#[test]
fn a_curve_is_stored_only_within_its_tolerance() {
    let (_board, mut link) = board_with_the_design();
    let before = curve(&mut link);
    // The middle one of seven lengths is a millimetre off, of which a line takes up a seventh.
    let point = |i: i32| {
        let code = 32_000.0 + 9_000.0 * f64::from(i);
        LvdtPoint { displacement_m: 0.01 * f64::from(i) + if i == 0 { 1e-3 } else { 0.0 }, code }
    };
    let measured: Vec<LvdtPoint> = (-3..=3).map(point).collect();
    let fit = fit_lvdt(&measured, 1).unwrap();
    assert!((fit.largest_m() - 6e-3 / 7.0).abs() < 1e-8, "{}", fit.largest_m());
    for tolerance_m in [0.8e-3, f64::NAN] {
        let refused = store_lvdt(&mut link, &fit, tolerance_m).unwrap_err();
        assert!(matches!(refused, LvdtError::TooFarOff { .. }), "{refused}");
    }
    // A code that no curve reaches leaves a length of which nothing is known.
    let beyond: Vec<LvdtPoint> = measured.iter().map(|point| LvdtPoint { code: point.code + 12_000.0, ..*point }).collect();
    let refused = store_lvdt(&mut link, &fit_lvdt(&beyond, 1).unwrap(), f64::INFINITY).unwrap_err();
    assert!(matches!(refused, LvdtError::TooFarOff { largest_m: f64::INFINITY, .. }), "{refused}");
    assert_eq!(curve(&mut link), before);
    store_lvdt(&mut link, &fit, 0.9e-3).unwrap();
    assert_eq!(curve(&mut link), *fit.curve());
}

#[test]
fn a_collection_begins_only_with_a_homed_board_that_has_the_plans_robot() {
    let (_board, link) = empty_board();
    let [puma, scara] = ["puma560", "scara"].map(|name| open_robot(name).unwrap());
    assert!(matches!(CheckedBoard::read(link, &puma), Err(CollectError::NoParameters)));

    let (board, link) = board_with_the_design();
    assert!(matches!(CheckedBoard::read(link, &puma), Err(CollectError::NotHomed)));
    let again = || BoardLink::connect(board.port(), BAUD).unwrap();
    Homing::begin(&mut again()).unwrap().at(&[0.0; 6], None).unwrap();
    assert!(matches!(CheckedBoard::read(again(), &scara), Err(CollectError::OtherRobot { .. })));
    let checked = CheckedBoard::read(again(), &puma).unwrap();
    assert_eq!(checked.robot().kinds(), puma.chain.joint_kinds());
}
