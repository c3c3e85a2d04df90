//! The shipped image on a strict emulator of its chip, and the `host-cal` command at the other end of its serial port.
#![cfg(unix)]

use ballbar_firmware::ENCODERS;
use ballbar_tests::f405_emulator::{F405Board, Start, is_skipped, module};
use ballbar_tests::readers::output;
use ballbar_tests::scenarios::{self, host_cal, host_cal_run};
use host_cal::files::ROBOTS;

/// FLASH_CR as a reset leaves it: locked, and nothing else.
const LOCKED: u32 = 1 << 31;
/// The sectors of the parameter slots.
const SLOTS: [u8; 2] = [1, 2];

/// A wrong program is no use as a proof that a right one is right unless it is seen to be wrong.
#[test]
fn every_misuse_is_reported_by_its_name() {
    if is_skipped() {
        return;
    }
    println!("{}", output(&mut module("f405_emulator.misuse")));
}

/// Greeted, given parameters again and again, reset: both slots are erased and written several times, and hold what they should.
#[test]
fn a_board_serves_its_host() {
    let Some(board) = F405Board::start(Start::PowerOn) else { return };
    scenarios::greets_the_host(&board);
    board.report().is_clean();
    scenarios::keeps_parameters_over_a_reset(&board, &scenarios::plant(1));
    board.report().is_clean();

    // New parameters erase a slot; those that the older slot holds already need no erasure to be in use again.
    let folder = tempfile::tempdir().expect("a folder for robots");
    let mut sequence = None;
    for (name, new_erases) in [("first", 1), ("second", 1), ("third", 1), ("second", 0)] {
        let robot = folder.path().join(name);
        std::fs::write(&robot, ROBOTS[0].1.replacen("name = ", &format!("name = \"{name}\" #"), 1)).expect("a robot's file");
        let erased = board.report().erases.len();
        let robot = robot.to_str().expect("a path in ASCII");
        let applied = host_cal(&board, "apply", &["--robot", robot, "--uncalibrated", "--vectors", "20"]);
        let next = applied["sequence"].as_u64().expect("a number");
        assert_eq!(sequence.replace(next).unwrap_or(next - 1) + 1, next);
        let report = board.report();
        report.is_clean();
        assert_eq!(report.erases.len(), erased + new_erases, "{name}: {report:?}");
    }

    let run = host_cal_run(&board, "status", &["--reset"]);
    let status = run.json();
    assert_eq!(status["robot"]["sequence"].as_u64(), sequence, "{}", run.transcript());
    let report = board.report();
    report.is_clean();
    for slot in SLOTS {
        let count = report.erases.iter().filter(|&&sector| sector == slot).count();
        assert!(count >= 2, "sector {slot}: {:?}", report.erases);
    }
    assert_eq!(report.flash_control, LOCKED);
    let causes: Vec<_> = report.resets.iter().map(|reset| reset.cause.as_str()).collect();
    assert_eq!(causes, ["software"; 2], "the two that were asked for");
}

/// The boot loader jumps with its own memory at address 0, its clocks running and its interrupts let in: the image resets itself.
#[test]
fn a_board_starts_after_dfu() {
    let Some(board) = F405Board::start(Start::AfterDfu) else { return };
    let report = board.report_at(0.1);
    report.is_clean();
    assert_eq!(report.resets.len(), 1, "{report:?}");
    scenarios::greets_the_host(&board);
    host_cal(&board, "apply", &["--robot", "puma560", "--uncalibrated", "--vectors", "20"]);
    let report = board.report();
    report.is_clean();
    assert_eq!(report.resets.len(), 1, "{report:?}");
}

/// The reset that cures a start after DFU is made once, whatever it cures.
#[test]
fn a_board_does_not_reset_itself_for_ever() {
    let Some(board) = F405Board::start(Start::AlwaysRemapped) else { return };
    let report = board.report_at(0.2);
    report.is_clean();
    assert_eq!(report.resets.len(), 1, "{report:?}");
    assert!(report.sampling_periods > 100, "{report:?}");
    host_cal_run(&board, "status", &[]).json();
    board.report().is_clean();
}

/// However fast index lines ring, one alone or all at once, and whether their pulses are long enough to be taken for an index or
/// not: each interrupts once a sampling period, and no period goes unserved.
#[test]
fn ringing_index_lines_leave_the_sampling_alone() {
    /// Time on the board, seconds: some periods of 1 ms.
    const RINGING_S: f64 = 0.012;
    let Some(board) = F405Board::start(Start::PowerOn) else { return };
    let all: Vec<usize> = (0..ENCODERS).collect();
    let lines = all.iter().map(std::slice::from_ref).chain([all.as_slice()]);
    for (joints, [pulses_per_s, high_ns]) in lines.zip([[1_500_000, 300], [3_000_000, 150], [400_000, 2_000]].into_iter().cycle())
    {
        board.report_at(0.1);
        joints.iter().for_each(|&joint| board.ring(joint, pulses_per_s, high_ns));
        // Once all ring: the board runs on while it is told.
        let before = board.report();
        let after = board.report_at(before.now_s + RINGING_S);
        joints.iter().for_each(|&joint| board.quiet(joint));

        let what = format!("joints {joints:?} from zero at {pulses_per_s} Hz, high for {high_ns} ns: {before:?}, {after:?}");
        after.is_clean();
        assert_eq!(after.missed_periods, before.missed_periods, "{what}");
        let periods = after.sampling_periods - before.sampling_periods;
        let interrupts = after.index_interrupts - before.index_interrupts;
        assert!(interrupts >= periods, "{what}");
        // Before the first latch and behind the last there is a part of a period.
        assert!(interrupts <= (periods + 1) * joints.len() as u64, "{what}");
    }
    let status = host_cal_run(&board, "status", &[]).json();
    assert_eq!(status["overruns"], 0);
    let report = board.report();
    report.is_clean();
    assert!(report.resets.is_empty(), "{report:?}");
}
