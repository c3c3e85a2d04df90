//! The user's wish to end.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::given_back::give_back;
use crate::deadline::StopFlag;

/// Exit code of a command that Ctrl-C or a signal ended before it had done anything: what shells expect.
pub(crate) const INTERRUPTED: u8 = 130;

/// Whether the user wants to end: set by Ctrl-C and by the signals that ask a program to end.
#[derive(Clone, Default)]
pub(crate) struct EndRequest {
    /// By whatever means.
    stop: StopFlag,
    /// By Ctrl-C or a signal.
    is_insisted: Arc<AtomicBool>,
}

impl EndRequest {
    /// From here on Ctrl-C ends the work and not the program.
    pub(crate) fn listen() -> Self {
        let request = Self::default();
        let heard = request.clone();
        // A second handler is refused; the first one then ends the program as it always did.
        let _ = ctrlc::set_handler(move || heard.insist());
        request
    }

    /// The user wants to end.
    pub(crate) fn make(&self) {
        self.stop.set();
    }

    /// The user wants to end; asked twice, whatever the work waits for is not worth it.
    pub(crate) fn insist(&self) {
        self.make();
        if self.is_insisted.swap(true, Ordering::Relaxed) {
            give_back();
            std::process::exit(INTERRUPTED.into());
        }
    }

    pub(crate) fn is_made(&self) -> bool {
        self.stop.is_set()
    }

    /// For whoever waits for a board or a controller.
    pub(crate) fn stop_flag(&self) -> &StopFlag {
        &self.stop
    }
}
