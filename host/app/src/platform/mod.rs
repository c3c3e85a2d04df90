//! What differs between operating systems: one file a kind, with the same items. Everything else in this crate is written once for Linux,
//! macOS and Windows, but for the virtual board and the demonstration: their serial port is a pseudo-terminal, so that they are built on
//! Unix alone, and `cmd` says so elsewhere.

#[cfg(not(unix))]
mod other;
#[cfg(unix)]
mod unix;

#[cfg(not(unix))]
pub(crate) use other::{Keyboard, with_usual_permissions};
#[cfg(unix)]
pub(crate) use unix::{Keyboard, with_usual_permissions};

/// A key that means something while a steady screen has the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Key {
    Enter,
    Letter(char),
    /// Ctrl-C, Ctrl-\ and the end of input.
    End,
}
