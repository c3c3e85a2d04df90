//! What the steady screen of `stream` shows.

use ballbar::Stillness;

use super::StreamArgs;
use crate::board::RobotOnBoard;
use crate::record::{Account, Latest, Recording};
use crate::terminal::screen::{Bar, Joint, Picture, Poses};
use crate::units::mm_from_m;

/// The picture of a moment.
pub(super) fn picture(args: &StreamArgs, recording: &Recording) -> Picture {
    let (account, board, elapsed) = (recording.account(), recording.board(), recording.elapsed());
    let (away, robot) = (Latest::default(), account.robot());
    let latest = if board.is_some() { account.latest() } else { &away };
    let mut head = vec!["stream".to_owned(), args.port.port.clone()];
    head.extend(board.map(|board| format!("{} {}", board.board, board.firmware)));
    head.extend(robot.map(|robot| robot.set().name.as_str().to_owned()));
    let joints = match (&latest.q, robot) {
        (Some(q), Some(robot)) => robot.kinds().iter().zip(q).map(|(&kind, &q)| Joint::new(kind, q)).collect(),
        _ => latest.counts.iter().map(|&counts| Joint::of_counts(counts)).collect(),
    };
    let travel_mm = robot.map(|robot| {
        let (least_m, most_m) = robot.set().lvdt.travel_m::<f64>();
        [mm_from_m(least_m), mm_from_m(most_m)]
    });
    Picture {
        head,
        elapsed,
        joints,
        bar: Bar {
            name: account.connection().map(ToString::to_string),
            length_mm: latest.length_mm,
            displacement_mm: latest.displacement_mm,
            travel_mm,
            code: latest.code.filter(|_| robot.is_none()),
        },
        tool_mm: latest.position_mm,
        rate_hz: account.rate_hz(),
        lost: account.losses().lost(),
        stillness: latest.stillness,
        is_homed: account.is_homed().filter(|_| board.is_some()),
        residual_mm: account.residual_mm().filter(|_| board.is_some()),
        poses: Poses { done: account.counts().settled, of: args.poses, left: args.time.map(|time| time.saturating_sub(elapsed)) },
        next: next(args, board.is_some(), account, robot),
        is_waiting: board.is_none(),
        keys: &[("q", "end")],
    }
}

fn next(args: &StreamArgs, is_there: bool, account: &Account, robot: Option<&RobotOnBoard>) -> String {
    if !is_there {
        return "the board is away: plug it in again; what was recorded is kept".into();
    }
    let port = &args.port.port;
    if robot.is_none() {
        return format!("the board knows no robot: end, and host-cal apply {port} --robot robot.toml --uncalibrated");
    }
    if account.is_homed() == Some(false) {
        return format!("bring the arm to a known pose, end, and host-cal home {port} --q …");
    }
    if !args.selection().settled {
        return "watch".into();
    }
    if account.latest().counts.is_empty() {
        return "the board is asked".into();
    }
    if account.latest().displacement_mm.is_none() {
        return "attach the bar, or move the arm until the bar is within its travel".into();
    }
    match account.latest().stillness {
        Some(Stillness::Settled) => "the arm stands still: move it to the next pose".into(),
        Some(Stillness::Settling) => "hold still".into(),
        _ => "move the arm to a pose, and let it stand still".into(),
    }
}
