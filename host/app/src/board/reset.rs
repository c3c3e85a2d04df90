//! Starting a board anew.

use std::thread::sleep;
use std::time::{Duration, Instant};

use ballbar::wire::Command;
use thiserror::Error;

use super::errors::BoardError;
use super::link::BoardLink;

/// How often a board is greeted that is starting, and for how long.
const LOOK: Duration = Duration::from_millis(100);
const PATIENCE: Duration = Duration::from_secs(20);

/// Why a board is not known to have started anew.
#[derive(Debug, Error)]
pub enum ResetError {
    /// The board.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// It answered, and did not carry it out, or did not come back.
    #[error("{port}: the board was asked to reset and did not start anew within {} s", PATIENCE.as_secs())]
    NotBack {
        /// The port.
        port: String,
    },
}

/// Resets the board; returns when it has started anew, with a new conversation at `baud` bits a second.
///
/// # Errors
/// [`ResetError`].
pub fn reset(mut link: BoardLink, baud: u32) -> Result<BoardLink, ResetError> {
    let (uptime_us, port) = (link.hello().uptime_us, link.port_name().to_owned());
    link.act(Command::Reset)?;
    drop(link);
    let began = Instant::now();
    while began.elapsed() < PATIENCE {
        sleep(LOOK);
        // A board that is just starting does not answer, and a port may be away for a moment.
        if let Ok(link) = BoardLink::connect(&port, baud)
            && link.hello().uptime_us < uptime_us
        {
            return Ok(link);
        }
    }
    Err(ResetError::NotBack { port })
}
