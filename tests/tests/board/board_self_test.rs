//! The self-test: it passes on a board that is well, and each check fails for its own reason. The check of the kinematics is about
//! the program alone, so nothing that happens to a board makes it fail.

use ballbar::wire::{Answer, Check, Command, Refusal, SelfTest, WhichSet};
use ballbar_firmware::ParameterFlash;
use ballbar_tests::fake_board::FakeBoard;
use ballbar_tests::parameter_sets::{calibrated_puma, curve, puma};
use ballbar_tests::power_cut::MockFlash;

type Flash = MockFlash<4>;

/// A board with the PUMA in use, which is the newest in slot 0 and stands in slot 1 as well.
fn puma_board() -> FakeBoard<Flash> {
    let mut board = FakeBoard::on(MockFlash::new(1)).settle_in();
    assert_eq!(board.commit(&puma()), Ok(Answer::Done));
    board
}

fn failed(answer: Result<Answer, Refusal>) -> Vec<Check> {
    let Ok(Answer::SelfTest(SelfTest { results })) = answer else { panic!("no self-test, but {answer:?}") };
    assert_eq!(results.len(), 8);
    results.iter().filter(|result| !result.passed).map(|result| result.check).collect()
}

/// A bit of the set in this slot falls over.
fn damage(flash: &mut Flash, slot: usize) {
    flash.memory[slot * Flash::SLOT_BYTES as usize + 100] ^= 1;
}

#[test]
fn the_self_test_passes_on_a_board_that_is_well() {
    assert_eq!(failed(puma_board().ask(Command::SelfTest)), []);
}

#[test]
fn each_check_fails_for_its_own_reason() {
    type Harm = fn(&mut FakeBoard<Flash>);
    let harms: [(Check, Harm); 5] = [
        (Check::Overruns, |board| (0..100).for_each(|_| board.sample())),
        (Check::LvdtSignal, |board| board.adc().input.saturated = true),
        (Check::LvdtSignal, |board| board.adc().is_stuck = true),
        (Check::Index, |board| {
            for position in [0, 1_000, 2_005] {
                board.encoders().at_index[0] = Some(position);
                board.run(2);
            }
        }),
        (Check::Stack, |board| board.machine().stack_unused_bytes = 6 * 1_024 - 1),
    ];
    for (check, harm) in harms {
        let mut board = puma_board();
        harm(&mut board);
        board.run(3);
        assert_eq!(failed(board.ask(Command::SelfTest)), [check]);
    }
}

#[test]
fn before_the_first_sample_neither_sampling_nor_the_lvdt_is_known_to_work() {
    let flash = puma_board().machine().flash.clone();
    let answer = FakeBoard::on(flash).ask_before_any_sample(Command::SelfTest);
    assert_eq!(failed(answer), [Check::Sampling, Check::LvdtSignal]);
}

#[test]
fn a_board_without_parameters_fails_by_them_and_by_its_slots() {
    let mut board = FakeBoard::new().settle_in();
    assert_eq!(failed(board.ask(Command::SelfTest)), [Check::Parameters, Check::Slots]);
}

#[test]
fn a_board_that_starts_with_one_slot_damaged_works_and_fails_by_its_slots() {
    for slot in [0, 1] {
        let mut flash = puma_board().machine().flash.clone();
        damage(&mut flash, slot);
        let mut board = FakeBoard::on(flash).settle_in();
        assert_eq!(board.ask(Command::ReadParameters(WhichSet::Active)), Ok(Answer::Parameters(puma())));
        assert_eq!(failed(board.ask(Command::SelfTest)), [Check::Slots]);
        board.commit(&calibrated_puma()).unwrap();
        assert_eq!(failed(board.ask(Command::SelfTest)), [], "a commit makes the damaged slot whole");
    }
}

#[test]
fn flash_that_no_longer_holds_what_is_in_use_fails_by_the_parameters() {
    let mut board = puma_board();
    board.commit(&calibrated_puma()).unwrap();
    damage(&mut board.machine().flash, 1);
    assert!(failed(board.ask(Command::SelfTest)).contains(&Check::Parameters));
}

#[test]
fn a_slot_that_is_damaged_while_the_board_runs_fails_by_the_slots() {
    let mut board = puma_board();
    damage(&mut board.machine().flash, 1);
    assert_eq!(failed(board.ask(Command::SelfTest)), [Check::Slots]);
}

#[test]
fn a_set_that_is_not_in_use_is_never_read_back_as_the_active_one() {
    let mut board = puma_board();
    board.commit(&calibrated_puma()).unwrap();
    damage(&mut board.machine().flash, 1);
    assert_eq!(board.ask(Command::ReadParameters(WhichSet::Active)), Err(Refusal::Flash));
    assert_eq!(board.ask(Command::SetLvdt(curve())), Err(Refusal::Flash), "nor is it what another curve is put into");
    board.commit(&calibrated_puma()).unwrap();
    assert_eq!(board.ask(Command::ReadParameters(WhichSet::Active)), Ok(Answer::Parameters(calibrated_puma())));
}

#[test]
fn a_commit_does_not_forget_lost_counts() {
    let mut board = puma_board();
    for position in [0, 1_000, 2_005] {
        board.encoders().at_index[0] = Some(position);
        board.run(2);
    }
    board.run(300);
    board.commit(&calibrated_puma()).unwrap();
    assert_eq!(board.status().encoders[0].index_errors, 1);
}
