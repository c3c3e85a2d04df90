//! Arguments and habits that the commands with a board have in common.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use ballbar::JointKind;
use clap::Args;

use super::outcome::CommandError;
use super::table::fixed;
use crate::board::{BAUD, BoardLink};
use crate::units::ScreenUnit;

/// Which board.
#[derive(Args)]
pub(super) struct PortArgs {
    /// Serial port of the board, as `host-cal ports` lists it
    pub(super) port: String,
    /// Bits a second
    #[arg(long, default_value_t = BAUD)]
    pub(super) baud: u32,
}

impl PortArgs {
    /// Opens the port and greets the board.
    pub(super) fn connect(&self) -> Result<BoardLink, CommandError> {
        Ok(BoardLink::connect(&self.port, self.baud)?)
    }
}

/// Whether the user wants to end: set by Ctrl-C and by the signals that ask a program to end.
#[derive(Clone)]
pub(super) struct EndRequest(Arc<AtomicBool>);

impl EndRequest {
    /// From here on Ctrl-C ends the work and not the program.
    pub(super) fn listen() -> Self {
        let flag = Arc::new(AtomicBool::new(false));
        let set = Arc::clone(&flag);
        // A second handler is refused; the first one then ends the program as it always did.
        let _ = ctrlc::set_handler(move || set.store(true, Ordering::Relaxed));
        Self(flag)
    }

    pub(super) fn is_made(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Joint values for people: `10.000 -40.000 … deg`, or with `mm` behind the values that are lengths.
pub(super) fn joints_text(kinds: &[JointKind], q: &[f64]) -> String {
    let value = |(&kind, &q): (&JointKind, &f64)| {
        let unit = ScreenUnit::from(kind);
        let number = fixed(unit.from_si(q), 3);
        if kind == JointKind::Prismatic { format!("{number} mm") } else { format!("{number}°") }
    };
    kinds.iter().zip(q).map(value).collect::<Vec<_>>().join(" ")
}
