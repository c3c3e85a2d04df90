//! The poses that a board computes: for joint values that it is given, and for its latest sample.

use ballbar::wire::{Answer, Command, ParameterSet, Refusal, ToolPose, WhichSet};
use ballbar::{Approach, Coupling, Encoder, Kinematics, LvdtReading};
use ballbar_tests::fake_board::FakeBoard;
use ballbar_tests::parameter_sets::{calibrated_puma, curve, largest, puma};

use super::puma_board;

/// The set of the pose is the board's own, in f64.
fn expected_pose(set: &ParameterSet, q: &[f64]) -> [f64; 3] {
    let chain = set.chain().unwrap().cast::<f64>();
    Kinematics::new(&chain).base_from_tool(&chain.joint_vector(q).unwrap()).translation_m.into()
}

fn assert_near(pose: ToolPose, expected_m: [f64; 3]) {
    for (found, expected) in pose.position_m.into_iter().zip(expected_m) {
        assert!((f64::from(found) - expected).abs() < 1e-6, "{pose:?}, expected {expected_m:?}");
    }
}

#[test]
fn forward_kinematics_is_that_of_the_set_asked_for() {
    let mut board = puma_board();
    let q = [0.3_f32, -1.1, 2.0, 0.4, -0.9, 1.7];
    let wide = q.map(f64::from);
    let ask = |set, q: &[f32]| Command::ForwardKinematics { set, q: q.iter().copied().collect(), approach: Approach::UNKNOWN };
    assert_eq!(board.ask(ask(WhichSet::Staged, &q)), Err(Refusal::NoParameters));
    board.ask(Command::WriteParameters(calibrated_puma())).unwrap();
    for (which, set) in [(WhichSet::Active, puma()), (WhichSet::Staged, calibrated_puma())] {
        let Ok(Answer::Pose(pose)) = board.ask(ask(which, &q)) else { panic!("no pose") };
        assert_near(pose, expected_pose(&set, &wide));
    }
    for joints in [0, 5, 7] {
        assert_eq!(board.ask(ask(WhichSet::Active, &[0.0; 8][..joints])), Err(Refusal::Joint { joints: 6 }));
    }
    for bad in [f32::NAN, f32::INFINITY] {
        assert_eq!(board.ask(ask(WhichSet::Active, &[0.0, 0.0, bad, 0.0, 0.0, 0.0])), Err(Refusal::NotFinite));
    }
}

/// Six slides that drive each other on as hard as is taken.
fn slides() -> ParameterSet {
    let set = largest();
    ParameterSet {
        kinds: set.kinds[..6].iter().copied().collect(),
        parameters: set.parameters[..54].iter().copied().collect(),
        encoders: core::iter::repeat_n(Encoder { counts_per_unit: 1.0, counts_per_index: 0 }, 6).collect(),
        couplings: (1..6).map(|joint| Coupling { joint, driven_by: joint - 1, ratio: 1e4 }).collect(),
        terms: heapless::Vec::new(),
        ..set
    }
}

#[test]
fn a_pose_that_is_no_number_is_refused() {
    let mut board = FakeBoard::new().settle_in();
    board.commit(&slides()).unwrap();
    let ask = |q: f32| Command::ForwardKinematics { set: WhichSet::Active, q: [q; 6].into(), approach: Approach::UNKNOWN };
    assert!(matches!(board.ask(ask(1e6)), Ok(Answer::Pose(_))));
    assert_eq!(board.ask(ask(f32::MAX)), Err(Refusal::NotFinite));
}

#[test]
fn the_current_pose_is_a_number_wherever_the_encoders_stand() {
    let mut board = FakeBoard::new().settle_in();
    board.commit(&slides()).unwrap();
    for counts in [i32::MIN, i32::MAX] {
        (0..6).for_each(|joint| assert!(board.ask(Command::PresetEncoder { joint, counts }).is_ok()));
        let Ok(Answer::CurrentPose(found)) = board.ask(Command::CurrentPose) else { panic!("no pose") };
        assert!(found.q.iter().chain(&found.pose.position_m).all(|value| value.is_finite()), "{found:?}");
    }
}

#[test]
fn the_current_pose_is_that_of_the_latest_sample() {
    let mut board = puma_board();
    board.ask(Command::PresetEncoder { joint: 1, counts: 13_728 }).unwrap();
    board.adc().input.code = 40_000;
    board.run(10);
    let Ok(Answer::CurrentPose(found)) = board.ask(Command::CurrentPose) else { panic!("no pose") };
    assert_eq!((found.q.as_slice(), found.homed), ([0.0, 1.0, 0.0, 0.0, 0.0, 0.0].as_slice(), 0b10));
    assert_near(found.pose, expected_pose(&puma(), &[0.0, 1.0, 0.0, 0.0, 0.0, 0.0]));
    let reading = LvdtReading { code: 40_000, saturated: false };
    let expected_m: f64 = curve().displacement_m(reading).unwrap();
    assert!((f64::from(found.displacement_m.unwrap()) - expected_m).abs() < 1e-9);

    board.adc().input.code = 1_999;
    board.run(10);
    let Ok(Answer::CurrentPose(found)) = board.ask(Command::CurrentPose) else { panic!("no pose") };
    assert_eq!(found.displacement_m, None, "below the travel");
}

#[test]
fn a_current_pose_needs_parameters_and_a_sample() {
    assert_eq!(FakeBoard::new().settle_in().ask(Command::CurrentPose), Err(Refusal::NoParameters));
    let flash = puma_board().machine().flash.clone();
    let mut board = FakeBoard::on(flash);
    assert_eq!(board.ask_before_any_sample(Command::CurrentPose), Err(Refusal::NoSample));
}
