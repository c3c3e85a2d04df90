//! How long a whole answer may take, and the user's wish to end, which no wait outlasts.

use std::io::{Error, ErrorKind, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use thiserror::Error;

/// Set once when the user wants to end. Whoever waits for a peer looks at it.
#[derive(Clone, Debug, Default)]
pub struct StopFlag(Arc<AtomicBool>);

impl StopFlag {
    /// The user wants to end.
    pub fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether the user wants to end.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// The end of a wait. It belongs to an answer as a whole: bytes that trickle in do not put it off.
#[derive(Clone, Debug)]
pub struct Deadline {
    at: Instant,
    stop: StopFlag,
}

/// Why a wait is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum WaitOver {
    /// The answer has not come whole in time.
    #[error("no whole answer came in time")]
    Late,
    /// The user wants to end.
    #[error("ended by Ctrl-C or a signal")]
    Stopped,
}

impl Deadline {
    /// So long from now, or until the user wants to end.
    pub fn after(wait: Duration, stop: &StopFlag) -> Self {
        let now = Instant::now();
        // What no clock can hold is a day: longer than anything here is waited for.
        let at = now.checked_add(wait).unwrap_or(now + Duration::from_secs(86_400));
        Self { at, stop: stop.clone() }
    }

    /// So long from now, whatever the user wants: for the last words to a peer.
    pub fn regardless(wait: Duration) -> Self {
        Self::after(wait, &StopFlag::default())
    }

    /// The same wish to end, but no later than `wait` from now.
    pub fn at_most(&self, wait: Duration) -> Self {
        let sooner = Self::after(wait, &self.stop);
        Self { at: sooner.at.min(self.at), stop: sooner.stop }
    }

    /// Whether there is something left to wait.
    ///
    /// # Errors
    /// [`WaitOver`]; that the user wants to end comes first.
    pub fn check(&self) -> Result<(), WaitOver> {
        if self.stop.is_set() {
            return Err(WaitOver::Stopped);
        }
        if Instant::now() >= self.at { Err(WaitOver::Late) } else { Ok(()) }
    }
}

/// Whether a peer has only nothing to give, or no room, just now.
pub(crate) fn is_short_wait(error: &Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::WouldBlock)
}

/// Writes all bytes before a deadline.
///
/// # Errors
/// The operating system's reason, or that the peer takes no bytes.
pub(crate) fn write_before(deadline: &Deadline, peer: &mut (impl Write + ?Sized), mut bytes: &[u8]) -> Result<(), Error> {
    while !bytes.is_empty() {
        match peer.write(bytes) {
            Ok(count) => bytes = bytes.get(count..).unwrap_or_default(),
            Err(error) if is_short_wait(&error) => {}
            Err(error) => return Err(error),
        }
        if !bytes.is_empty() && deadline.check().is_err() {
            return Err(Error::new(ErrorKind::TimedOut, "it takes no bytes"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wait_ends_in_time_or_by_the_users_wish() {
        let stop = StopFlag::default();
        let long = Deadline::after(Duration::MAX, &stop);
        assert_eq!(long.check(), Ok(()));
        assert_eq!(long.at_most(Duration::ZERO).check(), Err(WaitOver::Late));
        assert_eq!(Deadline::after(Duration::ZERO, &stop).at_most(Duration::from_secs(9)).check(), Err(WaitOver::Late));
        stop.set();
        assert_eq!(long.check(), Err(WaitOver::Stopped));
        assert_eq!(Deadline::regardless(Duration::from_secs(9)).check(), Ok(()));
    }
}
