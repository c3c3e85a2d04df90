//! The screen as text, at several sizes of the window.

use std::time::Duration;

use ballbar::{JointKind, Stillness};
use ratatui::Terminal;
use ratatui::backend::TestBackend;

use super::{Bar, Joint, Picture, Poses, layout};

fn text(picture: &Picture, notes: &[String], (width, height): (u16, u16)) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| layout::draw(frame, picture, notes)).unwrap();
    terminal.backend().to_string()
}

fn collecting() -> Picture {
    let joint =
        |value, min, max, goal| Joint { limits: Some([min, max]), goal: Some(goal), ..Joint::new(JointKind::Revolute, value) };
    Picture {
        head: vec!["collect".into(), "/dev/ttyUSB0".into(), "val".into(), "puma560".into()],
        elapsed: Duration::from_secs(4_271),
        joints: vec![
            joint(12.345, -160.0, 160.0, 12.345),
            joint(-101.25, -225.0, 45.0, -90.0),
            joint(90.0, -45.0, 225.0, 91.0),
            joint(-110.0, -110.0, 170.0, 0.0),
            joint(0.0, -100.0, 100.0, 12.0),
            joint(266.0, -266.0, 266.0, -266.0),
        ],
        bar: Bar {
            name: Some("A:1, 460 mm".into()),
            length_mm: Some(478.1234),
            displacement_mm: Some(18.1234),
            travel_mm: Some([-37.5, 37.5]),
            code: None,
        },
        tool_mm: None,
        rate_hz: Some(499.97),
        lost: 0,
        stillness: Some(Stillness::Settling),
        is_homed: Some(true),
        residual_mm: Some(-1.2345),
        poses: Poses { done: 405, of: Some(1620), left: Some(Duration::from_secs(5_400)) },
        next: "take off the bar A:1, 460 mm, then press Enter".into(),
        is_waiting: true,
        keys: &[("Enter", "done"), ("e", "erase the last pose"), ("s", "skip the next"), ("q", "quit")],
    }
}

/// A prismatic joint, losses, encoders that are not homed, and no bar.
fn troubled() -> Picture {
    Picture {
        joints: vec![Joint::new(JointKind::Revolute, -90.0), Joint::new(JointKind::Prismatic, 412.75)],
        bar: Bar { travel_mm: Some([-37.5, 37.5]), ..Bar::default() },
        tool_mm: Some([412.75, -150.0, 1_021.5]),
        lost: 12,
        stillness: Some(Stillness::Moving),
        is_homed: Some(false),
        residual_mm: None,
        poses: Poses { done: 3, of: None, left: None },
        next: "bring the arm to a known pose, end, and host-cal home /dev/ttyUSB0 --q …".into(),
        ..collecting()
    }
}

fn notes() -> Vec<String> {
    (1..=9).map(|i| format!("{i}/1620 line {}: 478.12{i}4 mm, 55.6 | 19.4 mm left, residual -1.234 mm", 2 * i)).collect()
}

#[test]
fn wide() {
    insta::assert_snapshot!(text(&collecting(), &notes(), (100, 24)));
}

#[test]
fn as_wide_as_a_terminal_is_without_asking() {
    insta::assert_snapshot!(text(&troubled(), &notes(), (80, 24)));
}

#[test]
fn narrow() {
    insta::assert_snapshot!(text(&collecting(), &notes(), (40, 30)));
}

#[test]
fn small() {
    insta::assert_snapshot!(text(&collecting(), &notes(), (40, 12)));
}

#[test]
fn what_to_do_is_shown_in_any_window_and_none_is_too_small() {
    for width in 1..90 {
        for height in 1..40 {
            let shown = text(&collecting(), &notes(), (width, height));
            assert!(width < 12 || height < 6 || shown.contains("take off"), "{width} by {height}:\n{shown}");
        }
    }
}

#[test]
fn what_would_move_the_cursor_is_not_drawn() {
    let notes = vec!["line 7: \u{1b}[2J\u{7}\u{8} said the controller\r\n".to_owned()];
    let shown = text(&collecting(), &notes, (100, 24));
    assert!(!shown.contains(['\u{1b}', '\u{7}', '\u{8}', '\r']), "{shown:?}");
}

#[test]
fn what_boards_and_controllers_are_called_moves_no_cursor() {
    let hostile = "\u{1b}]0;pwned\u{7}\u{9b}2J\u{202e}a\nb\r\u{2028}\u{200b}";
    let picture = Picture {
        head: vec![hostile.into()],
        bar: Bar { name: Some(hostile.into()), ..collecting().bar },
        next: hostile.into(),
        ..collecting()
    };
    // So wide that no box cuts a name.
    let shown = text(&picture.made_visible(), &[], (200, 24));
    assert_eq!(shown.chars().find(|&c| c != '\n' && crate::text::is_hidden(c)), None, "{shown}");
    assert_eq!(shown.matches("\\u{1b}]0;pwned\\u{7}\\u{9b}2J\\u{202e}a\\nb\\r\\u{2028}\\u{200b}").count(), 3, "{shown}");
}
