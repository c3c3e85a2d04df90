//! Every command of the board: what it does, and each of its refusals.

use ballbar::wire::{Answer, Check, Command, ParameterSet, ParameterSetError, Refusal, SlotState, StreamSelection, WhichSet};
use ballbar::{EncoderError, LvdtCurve, Stillness, StillnessCriteria};
use ballbar_firmware::Slots;
use ballbar_tests::fake_board::FakeBoard;
use ballbar_tests::fake_hardware::empty_memory;
use ballbar_tests::parameter_sets::{calibrated_puma, curve, largest, puma};
use ballbar_tests::power_cut::{MockFlash, Trouble};

mod poses;

const SAMPLES: StreamSelection = StreamSelection { samples: true, settled: false, poses: false };

/// A board on flash that stalls, with the PUMA in use.
fn puma_board() -> FakeBoard<MockFlash<4>> {
    let mut board = FakeBoard::on(MockFlash::new(1)).settle_in();
    assert_eq!(board.commit(&puma()), Ok(Answer::Done));
    board
}

#[test]
fn the_rate_can_be_set_from_100_to_5000_hz() {
    let mut board = FakeBoard::new().settle_in();
    for rate_hz in [100, 101, 999, 5_000] {
        assert_eq!(board.ask(Command::SetRate { rate_hz }), Ok(Answer::Done));
        assert_eq!((board.machine().rate_hz, board.status().rate_hz), (rate_hz, rate_hz));
    }
    for rate_hz in [0, 99, 5_001, u16::MAX] {
        assert_eq!(board.ask(Command::SetRate { rate_hz }), Err(Refusal::Rate { min_hz: 100, max_hz: 5_000 }));
        assert_eq!(board.machine().rate_hz, 5_000);
    }
}

#[test]
fn stillness_must_hold_for_10_ms_to_a_minute() {
    let mut board = FakeBoard::new().settle_in();
    for hold_us in [10_000, 60_000_000] {
        let criteria = StillnessCriteria { hold_us, band_counts: 1, band_codes: 2 };
        assert_eq!(board.ask(Command::SetStillness(criteria)), Ok(Answer::Done));
        assert_eq!(board.status().criteria, criteria);
    }
    let before = board.status().criteria;
    for hold_us in [0, 9_999, 60_000_001, u32::MAX] {
        let criteria = StillnessCriteria { hold_us, ..before };
        assert_eq!(board.ask(Command::SetStillness(criteria)), Err(Refusal::Stillness));
        assert_eq!(board.status().criteria, before);
    }
}

#[test]
fn a_stream_of_nothing_and_poses_without_parameters_are_refused() {
    let mut board = FakeBoard::new().settle_in();
    assert_eq!(board.ask(Command::StartStream(StreamSelection::default())), Err(Refusal::NothingSelected));
    let poses = StreamSelection { poses: true, ..SAMPLES };
    assert_eq!(board.ask(Command::StartStream(poses)), Err(Refusal::NoParameters));
    assert_eq!(board.status().streaming, None);
    assert_eq!(board.ask(Command::StartStream(SAMPLES)), Ok(Answer::Done));
    assert_eq!(board.status().streaming, Some(SAMPLES));
    assert_eq!(board.ask(Command::StopStream), Ok(Answer::Done));
    assert_eq!(board.status().streaming, None);
}

#[test]
fn a_preset_moves_one_encoder_and_homes_it() {
    let mut board = FakeBoard::new().settle_in();
    board.encoders().positions = [10, 20, 30, 40, 50, 60];
    board.run(3);
    for (joint, counts) in [(0, -5), (5, i32::MAX), (3, 7)] {
        assert_eq!(board.ask(Command::PresetEncoder { joint, counts }), Ok(Answer::Done));
    }
    let status = board.status();
    assert_eq!(status.encoders.iter().map(|encoder| encoder.counts).collect::<Vec<_>>(), [-5, 20, 30, 7, 50, i32::MAX]);
    let homed = [true, false, false, true, false, true];
    assert_eq!(status.encoders.iter().map(|encoder| encoder.is_homed).collect::<Vec<_>>(), homed);
    assert_eq!(status.stillness, Stillness::Settling, "a pose may not mix old positions with new ones");
    for joint in [6, 7, u8::MAX] {
        assert_eq!(board.ask(Command::PresetEncoder { joint, counts: 0 }), Err(Refusal::Joint { joints: 6 }));
    }
    board.encoders().positions[0] += 100;
    board.run(3);
    assert_eq!(board.status().encoders[0].counts, 95);
}

#[test]
fn parameters_go_from_staged_to_active() {
    let mut board = FakeBoard::new().settle_in();
    for which in [WhichSet::Active, WhichSet::Staged] {
        assert_eq!(board.ask(Command::ReadParameters(which)), Err(Refusal::NoParameters));
    }
    let Ok(Answer::Staged { crc }) = board.ask(Command::WriteParameters(puma())) else { panic!("not staged") };
    assert_eq!(crc, ballbar::crc32(&postcard::to_stdvec(&puma()).unwrap()));
    assert_eq!(board.ask(Command::ReadParameters(WhichSet::Staged)), Ok(Answer::Parameters(puma())));
    assert_eq!(board.ask(Command::ReadParameters(WhichSet::Active)), Err(Refusal::NoParameters));
    assert_eq!((board.status().staged, board.status().active), (Some(crc), None));

    assert_eq!(board.ask(Command::Commit { crc: crc ^ 1 }), Err(Refusal::OtherCrc { staged: crc }));
    assert_eq!(board.ask(Command::Commit { crc }), Ok(Answer::Done));
    let status = board.status();
    let active = status.active.expect("nothing is in use after a commit");
    assert_eq!((active.crc, active.sequence, active.joints, status.staged), (crc, 0, 6, None));
    assert_eq!(status.slots, [SlotState::Good { sequence: 0, crc }; 2]);
    assert_eq!(board.ask(Command::ReadParameters(WhichSet::Active)), Ok(Answer::Parameters(puma())));
    assert_eq!(board.ask(Command::Commit { crc }), Ok(Answer::Done), "a commit that is done has nothing left to do");
    assert_eq!(board.status().active.map(|active| active.sequence), Some(0));
}

#[test]
fn discarded_parameters_are_forgotten() {
    let mut board = puma_board();
    let Ok(Answer::Staged { crc }) = board.ask(Command::WriteParameters(calibrated_puma())) else { panic!("not staged") };
    assert_eq!(board.ask(Command::Discard), Ok(Answer::Done));
    assert_eq!(board.ask(Command::ReadParameters(WhichSet::Staged)), Err(Refusal::NoParameters));
    assert_eq!(board.ask(Command::Commit { crc }), Err(Refusal::NoParameters));
    assert_eq!(board.ask(Command::ReadParameters(WhichSet::Active)), Ok(Answer::Parameters(puma())));
}

#[test]
fn parameters_that_cannot_be_used_are_refused_and_what_was_staged_stays() {
    let mut board = puma_board();
    board.ask(Command::WriteParameters(calibrated_puma())).unwrap();
    let changed = |change: &dyn Fn(&mut ParameterSet)| {
        let mut set = puma();
        change(&mut set);
        set
    };
    let wrong = |error| Refusal::Parameters(error);
    let bad_coupling = EncoderError::Coupling { joint: 4 };
    let cases = [
        (changed(&|set| set.parameters.truncate(53)), wrong(ParameterSetError::Sizes)),
        (changed(&|set| set.kinds.clear()), wrong(ParameterSetError::Sizes)),
        (changed(&|set| set.encoders.truncate(5)), wrong(ParameterSetError::Sizes)),
        (changed(&|set| set.parameters[17] = f32::NAN), wrong(ParameterSetError::NotFinite { index: 17 })),
        (
            changed(&|set| set.encoders[2].counts_per_unit = 0.0),
            wrong(ParameterSetError::Encoders(EncoderError::CountsPerUnit { joint: 2 })),
        ),
        (
            changed(&|set| (set.couplings[0].joint, set.couplings[0].driven_by) = (4, 5)),
            wrong(ParameterSetError::Encoders(bad_coupling)),
        ),
        (changed(&|set| set.lvdt.code_max = 0), wrong(ParameterSetError::Lvdt)),
        (changed(&|set| set.lvdt.coefficients_m = [0.0; 6]), wrong(ParameterSetError::Lvdt)),
        (changed(&|set| set.parameters[16] = 3.4e38), wrong(ParameterSetError::Reach { longest: 16 })),
        (changed(&|set| set.parameters[18] = 432.0), wrong(ParameterSetError::Reach { longest: 18 })),
        (changed(&|set| set.parameters[19] = 1e30), wrong(ParameterSetError::Implausible { index: 19 })),
        (changed(&|set| set.parameters[7] = 0.0), wrong(ParameterSetError::Implausible { index: 7 })),
        (changed(&|set| set.couplings[0].ratio = 1e30), wrong(ParameterSetError::Encoders(EncoderError::Coupling { joint: 5 }))),
        (largest(), Refusal::TooManyJoints { joints: 8, encoders: 6 }),
    ];
    for (set, refusal) in cases {
        assert_eq!(board.ask(Command::WriteParameters(set)), Err(refusal));
        assert_eq!(board.ask(Command::ReadParameters(WhichSet::Staged)), Ok(Answer::Parameters(calibrated_puma())));
    }
}

/// Written into flash by whatever did not ask: it is not taken into use, and neither is the set before it, but that can be had.
#[test]
fn parameters_in_flash_that_cannot_be_used_are_not_taken_into_use() {
    for (index, value) in [(0, 3.4e38), (16, 1e30), (3, 1e30), (7, 0.0), (50, 432.0)] {
        let mut absurd = calibrated_puma();
        absurd.parameters[index] = value;
        let mut flash = puma_board().machine().flash.clone();
        Slots::load(&mut flash).0.commit(&mut flash, &absurd).unwrap();
        let mut board = FakeBoard::on(flash).settle_in();
        assert_eq!(board.greet().active, None);
        assert_eq!(board.ask(Command::CurrentPose), Err(Refusal::NoParameters));
        let Ok(Answer::SelfTest(test)) = board.ask(Command::SelfTest) else { panic!("no self-test") };
        assert!(test.results.iter().any(|result| result.check == Check::Parameters && !result.passed));

        assert_eq!(board.ask(Command::ReadPrevious), Ok(Answer::Parameters(puma())));
        assert_eq!(board.commit(&puma()), Ok(Answer::Done));
        assert_eq!(board.status().active.map(|active| active.sequence), Some(2));
    }
}

#[test]
fn what_was_in_use_before_can_be_read_and_committed_again() {
    let mut board = FakeBoard::on(MockFlash::<4>::new(1)).settle_in();
    assert_eq!(board.ask(Command::ReadPrevious), Err(Refusal::NoPrevious));
    board.commit(&puma()).unwrap();
    assert_eq!(board.ask(Command::ReadPrevious), Err(Refusal::NoPrevious), "both slots hold the same");
    assert_eq!(board.status().previous, None);
    board.commit(&calibrated_puma()).unwrap();
    for i in 0..3 {
        let (now, before) = if i % 2 == 0 { (calibrated_puma(), puma()) } else { (puma(), calibrated_puma()) };
        let status = board.status();
        let (active, previous) = (status.active.unwrap(), status.previous.unwrap());
        assert_eq!((active.name, active.is_calibrated, active.sequence), (now.name, now.is_calibrated, i + 1));
        assert_eq!((&previous.name, previous.is_calibrated, previous.joints), (&before.name, before.is_calibrated, 6));
        assert_eq!(previous.crc, ballbar::crc32(&postcard::to_stdvec(&before).unwrap()));
        assert_eq!(board.ask(Command::ReadPrevious), Ok(Answer::Parameters(before.clone())));
        assert_eq!(board.commit(&before), Ok(Answer::Done));
        assert_eq!(board.ask(Command::ReadParameters(WhichSet::Active)), Ok(Answer::Parameters(before)));
    }
    // Over a reset too.
    let flash = board.machine().flash.clone();
    let mut board = FakeBoard::on(flash).settle_in();
    assert_eq!(board.status().previous.map(|previous| previous.name), Some(calibrated_puma().name));
    board.machine().flash.trouble = Trouble::Read;
    assert_eq!(board.ask(Command::ReadPrevious), Err(Refusal::Flash));
}

#[test]
fn another_lvdt_curve_is_staged_with_the_rest_of_the_set() {
    let mut board = FakeBoard::new().settle_in();
    let other = LvdtCurve { code_min: 77, ..curve() };
    assert_eq!(board.ask(Command::SetLvdt(other)), Err(Refusal::NoParameters));
    assert_eq!(board.ask(Command::SetLvdt(LvdtCurve { code_max: 0, ..other })), Err(Refusal::LvdtCurve));
    board.commit(&puma()).unwrap();
    let expected = ParameterSet { lvdt: other, ..puma() };
    let crc = ballbar::crc32(&postcard::to_stdvec(&expected).unwrap());
    assert_eq!(board.ask(Command::SetLvdt(other)), Ok(Answer::Staged { crc }));
    assert_eq!(board.ask(Command::ReadParameters(WhichSet::Staged)), Ok(Answer::Parameters(expected)));
    board.ask(Command::WriteParameters(calibrated_puma())).unwrap();
    board.ask(Command::SetLvdt(other)).unwrap();
    let expected = ParameterSet { lvdt: other, ..calibrated_puma() };
    assert_eq!(board.ask(Command::ReadParameters(WhichSet::Staged)), Ok(Answer::Parameters(expected)));
}

#[test]
fn a_commit_to_a_flash_that_fails_is_refused_and_the_old_set_stays_in_use() {
    for trouble in [Trouble::Erase, Trouble::Write { words: 3 }, Trouble::StuckBit] {
        let mut board = puma_board();
        board.machine().flash.trouble = trouble;
        assert_eq!(board.commit(&calibrated_puma()), Err(Refusal::Flash));
        board.machine().flash.trouble = Trouble::None;
        assert_eq!(board.status().active.map(|active| active.is_calibrated), Some(false));
        assert_eq!(board.ask(Command::ReadParameters(WhichSet::Active)), Ok(Answer::Parameters(puma())));
        // What was staged is still there, for another try.
        let crc = board.status().staged.expect("nothing is staged any more");
        assert_eq!(board.ask(Command::Commit { crc }), Ok(Answer::Done));
    }
}

#[test]
fn a_flash_that_stalls_is_not_written_while_streaming_or_moving() {
    let mut board = puma_board();
    board.ask(Command::StartStream(SAMPLES)).unwrap();
    assert_eq!(board.commit(&calibrated_puma()), Err(Refusal::Streaming));
    board.ask(Command::StopStream).unwrap();
    for _ in 0..10 {
        board.encoders().positions[4] += 3;
        board.run(1);
    }
    let crc = board.status().staged.unwrap();
    assert_eq!(board.ask(Command::Commit { crc }), Err(Refusal::Moving));
    board.run(150);
    assert_eq!(board.ask(Command::Commit { crc }), Err(Refusal::Moving));
    for i in 0..200 {
        // The flicker of one count is no motion.
        board.encoders().positions[4] += if i % 2 == 0 { 1 } else { -1 };
        board.run(1);
    }
    assert_eq!(board.ask(Command::Commit { crc }), Ok(Answer::Done));
}

#[test]
fn a_flash_that_stalls_is_not_written_while_an_encoder_creeps_after_a_leap() {
    let mut board = puma_board();
    board.encoders().positions[0] += 100;
    board.run(1_000);
    creep_and_commit(&mut board);
}

#[test]
fn a_flash_that_stalls_is_not_written_while_an_encoder_creeps() {
    creep_and_commit(&mut puma_board());
}

/// One count a sample is 1,000 counts a second at 1 kHz.
fn creep_and_commit(board: &mut FakeBoard<MockFlash<4>>) {
    for _ in 0..1_000 {
        board.encoders().positions[4] += 1;
        board.run(1);
    }
    assert_eq!(board.commit(&calibrated_puma()), Err(Refusal::Moving));
    board.run(300);
    let crc = board.status().staged.unwrap();
    assert_eq!(board.ask(Command::Commit { crc }), Ok(Answer::Done));
}

#[test]
fn a_preset_is_no_motion() {
    let mut board = puma_board();
    board.ask(Command::WriteParameters(calibrated_puma())).unwrap();
    let crc = board.status().staged.unwrap();
    board.ask(Command::PresetEncoder { joint: 2, counts: 50_000 }).unwrap();
    assert_eq!(board.ask(Command::Commit { crc }), Ok(Answer::Done));
}

#[test]
fn other_facts_of_the_encoders_make_presets_void() {
    let mut board = puma_board();
    let homed = |board: &mut FakeBoard<_>| board.status().encoders.iter().filter(|encoder| encoder.is_homed).count();
    (0..6).for_each(|joint| assert!(board.ask(Command::PresetEncoder { joint, counts: 5 }).is_ok()));
    assert_eq!(board.commit(&calibrated_puma()), Ok(Answer::Done));
    assert_eq!(homed(&mut board), 6, "the same encoders");
    let mut other = puma();
    other.encoders[3].counts_per_unit *= -1.0;
    assert_eq!(board.commit(&other), Ok(Answer::Done));
    assert_eq!(homed(&mut board), 0);
}

#[test]
fn a_flash_that_does_not_stall_is_written_at_any_time() {
    let mut board = FakeBoard::on(empty_memory()).settle_in();
    board.ask(Command::StartStream(SAMPLES)).unwrap();
    board.encoders().positions[0] += 5_000;
    assert_eq!(board.commit(&calibrated_puma()), Ok(Answer::Done));
}
