//! A board whose robot has joint terms computes what the host computes, and sees by its encoders from where its joints came.

use ballbar::wire::{Answer, Command, CurrentPose, ParameterSet, ParameterSetError, Refusal, ToolPose, WhichSet, term_numbers};
use ballbar::{Approach, Direction, JointTerms, JointVector, Kinematics, TermKind};
use ballbar_tests::fake_board::FakeBoard;
use ballbar_tests::fake_hardware::Memory;
use ballbar_tests::parameter_sets::puma_with_terms;

fn board() -> FakeBoard<Memory> {
    let mut board = FakeBoard::new().settle_in();
    assert_eq!(board.commit(&puma_with_terms()), Ok(Answer::Done));
    board
}

fn kinematics(set: &ParameterSet) -> Kinematics<f64> {
    Kinematics::with_terms(&set.chain().unwrap().cast(), &set.joint_terms().unwrap().cast())
}

fn assert_near(pose: &ToolPose, q: &[f32], approach: Approach) {
    let mut vector = JointVector::<f64>::zero();
    vector.as_array_mut().iter_mut().zip(q).for_each(|(wide, q)| *wide = f64::from(*q));
    let expected = kinematics(&puma_with_terms()).base_from_tool_approached(&vector, approach);
    let off_m = (ballbar::Vector3::from(pose.position_m.map(f64::from)) - expected.translation_m).norm();
    assert!(off_m < 1e-6, "{off_m:e} m at {q:?}, {}", approach.signs(6));
}

fn approach(signs: &str) -> Approach {
    signs.chars().enumerate().fold(Approach::UNKNOWN, |approach, (i, sign)| match sign {
        '+' => approach.with(i, Some(Direction::Rising)),
        '-' => approach.with(i, Some(Direction::Falling)),
        _ => approach,
    })
}

#[test]
fn forward_kinematics_have_the_terms_and_the_approach() {
    let mut board = board();
    for (q, signs) in [
        ([0.3_f32, -1.1, 2.0, 0.4, -0.9, 1.7], "000000"),
        ([0.3, -1.1, 2.0, 0.4, -0.9, 1.7], "+-+-+-"),
        ([-2.1, 0.4, -0.3, 1.9, 0.8, -3.0], "-0-++0"),
    ] {
        let approach = approach(signs);
        let ask = Command::ForwardKinematics { set: WhichSet::Active, q: q.into_iter().collect(), approach };
        let Ok(Answer::Pose(pose)) = board.ask(ask) else { panic!("no pose") };
        assert_near(&pose, &q, approach);
    }
}

fn current(board: &mut FakeBoard<Memory>) -> CurrentPose {
    board.run(3);
    let Ok(Answer::CurrentPose(pose)) = board.ask(Command::CurrentPose) else { panic!("no pose") };
    assert_near(&pose.pose, &pose.q, pose.approach);
    pose
}

/// Encoders 1 and 3 of the PUMA fall as their joints rise. The gap of joint 2 is 2 · 0.175 mrad · 13,728 counts/rad: 4 counts.
#[test]
fn the_board_sees_from_where_its_joints_came() {
    let mut board = board();
    let signs = |board: &mut FakeBoard<Memory>| current(board).approach.signs(6).to_string();
    assert_eq!(signs(&mut board), "000000");
    board.encoders().positions[0] += 2;
    assert_eq!(signs(&mut board), "000000", "a flicker is no way");
    for i in 0..5 {
        board.encoders().positions[i] += 500;
    }
    assert_eq!(signs(&mut board), "-+-++0");
    board.encoders().positions[1] -= 4;
    assert_eq!(signs(&mut board), "-+-++0", "the joint is still at the other side of its gap");
    board.encoders().positions[1] -= 1;
    assert_eq!(signs(&mut board), "---++0");
    board.ask(Command::PresetEncoder { joint: 1, counts: 90_000 }).unwrap();
    assert_eq!(signs(&mut board), "---++0", "a preset is no way");
    for _ in 0..20 {
        board.encoders().positions[5] -= 1;
        board.run(2);
    }
    assert_eq!(signs(&mut board), "---++-", "a slow joint moves too");
}

#[test]
fn terms_that_no_joint_has_are_refused() {
    let mut board = board();
    let mut changed = |change: &dyn Fn(&mut JointTerms<f32>)| {
        let set = puma_with_terms();
        let mut terms = set.joint_terms().unwrap();
        change(&mut terms);
        board.ask(Command::WriteParameters(ParameterSet { terms: term_numbers(&terms, 6), ..set }))
    };
    let wrong = |error| Err(Refusal::Parameters(error));
    assert!(changed(&|_| ()).is_ok());
    for bad in [f32::NAN, 0.5] {
        assert_eq!(changed(&|terms| terms.set_coefficient(2, TermKind::SinQ, bad)), wrong(ParameterSetError::Terms));
    }
    assert_eq!(changed(&|terms| terms.masses.links[3].mass_kg = -1.0), wrong(ParameterSetError::Terms));
    assert_eq!(changed(&|terms| terms.masses.gravity_base_m_s2.x = f32::NAN), wrong(ParameterSetError::Terms));
    for numbers in [1, 66, 67, 77, 87] {
        let mut set = puma_with_terms();
        set.terms.resize(numbers, 0.0).unwrap();
        let expected = if numbers == 67 { Ok(()) } else { Err(Refusal::Parameters(ParameterSetError::Sizes)) };
        assert_eq!(board.ask(Command::WriteParameters(set)).map(|_| ()), expected, "{numbers}");
    }
}

#[test]
fn terms_come_through_their_numbers() {
    let set = puma_with_terms();
    assert_eq!(term_numbers(&set.joint_terms().unwrap(), 6), set.terms);
    assert_eq!(set.terms.len(), 67);
    assert!(term_numbers(&JointTerms::<f64>::none(), 6).is_empty());
}
