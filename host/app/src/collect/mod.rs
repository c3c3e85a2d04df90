//! Walks a plan: moves the robot from row to row, waits until it stands still, and keeps what the bar then measures.
//!
//! ```text
//! plan.csv ─▶ Ledger (what is done, what is next) ─▶ Collector ─ start_move, poll, listen ─▶ RobotLink
//!                                                     │    ▲
//!                 Operator (attaches the bar; wishes) ┘    └ BoardWatch ◀─ frames ─ board
//!                                                               └─▶ Recorder (stream.bbl, poses.csv)
//! ```
//!
//! What the controller says of a move is never believed alone: the encoders have to agree, the LVDT has to show the length that the
//! model expects within what a robot may plausibly be off, and something has to arrive all the time. `docs/collecting.md` says how.

mod attach;
mod board_watch;
mod check_board;
mod collector;
mod drive;
mod errors;
mod follow;
mod go;
mod inspect;
mod lag;
mod ledger;
mod mover;
mod now;
mod operator;
mod repeat;
mod shell_programs;
mod talker;
mod track;

pub use board_watch::{BoardWatch, Stand, View};
pub use check_board::CheckedBoard;
pub use collector::{CollectOptions, Collector, Ended, Summary};
pub use errors::CollectError;
pub use follow::{Guide, ShellPrograms};
pub use lag::{Lag, estimate_lag, remove_lag};
pub use ledger::{Ledger, RowState, shells};
pub use mover::Mover;
pub use now::{Goal, Now};
pub use operator::{Event, Measured, Operator, Unattended, Wish};
pub use repeat::Repeat;
pub use shell_programs::{ProgramOptions, Programs, ShellProgram, plan_programs};
pub use track::{MovingPose, TrackOptions};

use ballbar::{JointKind, JointVector};

/// How far joints may be from where they were sent, and count as there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearness {
    /// Of revolute joints, radians.
    pub turn_rad: f64,
    /// Of prismatic joints, metres.
    pub slide_m: f64,
}

impl Nearness {
    /// The largest distance of a joint, as a share of what is allowed, and which joint, from 0.
    fn worst(&self, kinds: &[JointKind], a: &JointVector<f64>, b: &JointVector<f64>) -> (f64, usize) {
        let shares = kinds.iter().zip(a.as_array().iter().zip(b.as_array())).map(|(kind, (a, b))| match kind {
            JointKind::Revolute => (a - b).abs() / self.turn_rad,
            JointKind::Prismatic => (a - b).abs() / self.slide_m,
        });
        let worst = shares.enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b));
        worst.map_or((0.0, 0), |(joint, share)| (share, joint))
    }

    /// Whether all joints are near.
    fn holds(&self, kinds: &[JointKind], a: &JointVector<f64>, b: &JointVector<f64>) -> bool {
        self.worst(kinds, a, b).0 <= 1.0
    }
}
