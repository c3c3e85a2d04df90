//! The steady screen of `stream` and `collect`, at a terminal whose window is resized, whose port is lost, and that has to be sane
//! afterwards.
#![cfg(unix)]

use std::path::Path;

use ballbar_tests::simulated_cell::{SHORT_PLAN, SimulatedCell, design, plant};
use ballbar_tests::terminal::AtTerminal;
use host_cal::board::parameter_set;
use host_cal::session::Description;
use host_cal::virtual_board::{Pace, VirtualBoard, VirtualBoardOptions, driver};

const WIDE: (u16, u16) = (100, 24);

/// A board whose arm stands still, without a bar.
fn board(folder: &Path) -> VirtualBoard {
    let plant = plant(1);
    let parameters = Some(parameter_set(&design(), plant.lvdt()).expect("the robot fits a board"));
    let port_name = Some(folder.join("port"));
    let options = VirtualBoardOptions { parameters, port_name, ..VirtualBoardOptions::new(plant, Pace::Real) };
    VirtualBoard::start(options).expect("the board starts")
}

/// `host-cal collect` in a cell, with a plan of 24 poses and a robot slow enough to be interfered with.
fn collect(cell: &SimulatedCell, link: &str) -> AtTerminal {
    let args = cell.collect_args("session");
    let args: Vec<&str> = args.iter().map(|arg| if arg == "sim" { link } else { arg.as_str() }).collect();
    let quick = args.iter().position(|arg| *arg == "--speed-deg-s").expect("a speed");
    let args = [&args[..quick], &["--speed-deg-s", "20"], &args[quick + 2..]].concat();
    AtTerminal::start(cell.folder.path(), &args, WIDE)
}

fn snapshot(name: &str, text: &str) {
    insta::with_settings!({
        omit_expression => true,
        prepend_module_to_snapshot => false,
        filters => vec![(r"\d:\d\d:\d\d", "H:MM:SS"), (r"\d+ Hz", "#### Hz")],
    }, {
        insta::assert_snapshot!(format!("screens__{name}"), text);
    });
}

#[test]
fn stream_keeps_its_screen_in_any_window_until_ctrl_c() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let _board = board(folder.path());
    let mut run = AtTerminal::start(folder.path(), &["stream", "port"], WIDE);
    run.wait_for_frame("1000 Hz");
    assert!(run.is_steady());
    snapshot("stream_wide", &run.text());
    run.resize((40, 20));
    run.wait_for_frame("and host-cal home port");
    snapshot("stream_narrow", &run.text());
    run.resize((5, 2));
    std::thread::sleep(std::time::Duration::from_millis(300));
    run.resize((80, 24));
    run.wait_for("What happened");
    run.press("\u{3}");
    let (code, text) = run.finish();
    assert_eq!(code, 0, "{text}");
    assert!(text.starts_with("port (virtual") && text.contains("nothing lost"), "{text}");
}

#[test]
fn whatever_ends_a_run_the_terminal_is_sane_afterwards() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let _board = board(folder.path());
    for ending in ["q", "-TERM", "-HUP", "-INT"] {
        let mut run = AtTerminal::start(folder.path(), &["stream", "port"], WIDE);
        run.wait_for("1000 Hz");
        if ending == "q" {
            run.press("q")
        } else {
            run.signal(ending)
        }
        let (code, text) = run.finish();
        assert_eq!(code, 0, "{ending}: {text}");
        assert!(text.contains("samples at 1000"), "{ending}: {text}");
    }
}

#[test]
fn a_window_that_is_closed_ends_the_run_and_the_session_whole() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let _board = board(folder.path());
    let mut run = AtTerminal::start(folder.path(), &["stream", "port", "--session", "session"], WIDE);
    run.wait_for("1000 Hz");
    // No result can be printed any more.
    assert_eq!(run.hang_up(), 3);
    let description = Description::read(&folder.path().join("session")).expect("a session");
    assert!(description.runs[0].ended.is_some());
}

#[test]
fn a_sequence_broken_off_keeps_nothing_from_being_heard() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let _board = board(folder.path());
    let mut run = AtTerminal::start(folder.path(), &["stream", "port"], WIDE);
    run.wait_for("1000 Hz");
    run.press("\u{1b}[");
    run.press("\u{3}");
    assert_eq!(run.finish().0, 0);
}

#[test]
fn a_lost_port_is_shown_and_can_be_left() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let board = board(folder.path());
    let mut run = AtTerminal::start(folder.path(), &["stream", "port"], WIDE);
    run.wait_for("1000 Hz");
    drop(board);
    run.wait_for("> the board is away: plug it in again");
    run.press("q");
    let (code, text) = run.finish();
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("the port was lost 1 times"), "{text}");
}

#[test]
fn a_port_lost_while_collecting_leaves_the_reason_on_a_sane_terminal() {
    let mut cell = SimulatedCell::start(plant(1), 0.0, &SHORT_PLAN);
    let mut run = collect(&cell, "sim");
    run.wait_for("2/24 line");
    let other = board(&cell.path(""));
    drop(std::mem::replace(&mut cell.board, other));
    let (code, text) = run.finish();
    assert_eq!(code, 2, "{text}");
    assert!(text.contains("port") && text.contains("The same command goes on."), "{text}");
}

#[test]
fn without_samples_the_board_is_asked_how_it_is() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let _board = board(folder.path());
    let mut run = AtTerminal::start(folder.path(), &["stream", "port", "--settled", "--pose"], WIDE);
    run.wait_for("NOT HOMED");
    run.wait_for("6      0.000°");
    run.press("q");
    assert_eq!(run.finish().0, 0);
}

#[test]
fn a_terminal_that_can_draw_nothing_gets_lines() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let _board = board(folder.path());
    let mut run = AtTerminal::start_as("dumb", folder.path(), &["stream", "port"], WIDE);
    run.wait_for("1000 Hz  settled 0  lost 0");
    assert!(!run.is_steady());
    run.press("\u{3}");
    assert_eq!(run.finish().0, 0);
}

#[test]
fn collect_hears_keys_and_says_what_happens() {
    let cell = SimulatedCell::start(plant(1), 0.0, &SHORT_PLAN);
    let mut run = collect(&cell, "sim");
    run.wait_for("2/24 line");
    run.press("p");
    run.wait_for("> paused: r to go on");
    run.press("e");
    run.wait_for("the last pose is erased");
    run.press("x");
    run.press("r");
    run.wait_for("going on");
    run.wait_for("4/24 line");
    run.press("q");
    let (code, text) = run.finish();
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("The same command goes on."), "{text}");
}

#[test]
fn collect_asks_for_the_bar_and_for_the_place() {
    let (_driver, driven) = driver();
    let cell = SimulatedCell::driven_by_hand(plant(1), driven, &SHORT_PLAN);
    let mut run = collect(&cell, "manual");
    run.wait_for_frame("> Take off the bar, if it is on, then press Enter");
    snapshot("collect_by_hand", &run.text());
    run.press("\r");
    run.wait_for("line 2: drive to");
    run.wait_for("then Attach the bar A:1");
    run.press("\r");
    run.wait_for("the LVDT shows no bar within its travel");
    run.press("\u{3}");
    let (code, text) = run.finish();
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("0 of 24 planned poses are measured"), "{text}");
}
