//! Where keys come from.

use std::collections::VecDeque;

use super::keys::Key;

#[cfg(unix)]
pub(super) use unix::Keyboard;
#[cfg(not(unix))]
pub(super) use windows::Keyboard;

/// The bytes of stdin. Not crossterm's events: with those a terminal that is gone, or a sequence broken off, is waited for without end.
#[cfg(unix)]
mod unix {
    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::io::Errno;

    use super::super::keys::Decoder;
    use super::*;

    #[derive(Default)]
    pub(in crate::cmd::screen) struct Keyboard {
        decoder: Decoder,
    }

    const WAIT: Timespec = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };

    impl Keyboard {
        /// The keys of the next 50 milliseconds; an error when there is no terminal any more.
        pub(in crate::cmd::screen) fn wait(&mut self) -> std::io::Result<VecDeque<Key>> {
            let stdin = std::io::stdin();
            let mut ready = [PollFd::new(&stdin, PollFlags::IN)];
            match poll(&mut ready, Some(&WAIT)) {
                Ok(0) | Err(Errno::INTR) => {
                    self.decoder.rest();
                    return Ok(VecDeque::new());
                }
                polled => polled?,
            };
            let mut bytes = [0; 64];
            match rustix::io::read(&stdin, &mut bytes) {
                Ok(0) => Err(std::io::ErrorKind::UnexpectedEof.into()),
                Ok(count) => Ok(self.decoder.decode(&bytes[..count])),
                Err(Errno::INTR | Errno::AGAIN) => Ok(VecDeque::new()),
                Err(error) => Err(error.into()),
            }
        }
    }
}

#[cfg(not(unix))]
mod windows {
    use std::time::Duration;

    use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};

    use super::*;

    #[derive(Default)]
    pub(in crate::cmd::screen) struct Keyboard;

    const WAIT: Duration = Duration::from_millis(50);

    impl Keyboard {
        /// The key of the next 50 milliseconds; an error when there is no terminal any more.
        pub(in crate::cmd::screen) fn wait(&mut self) -> std::io::Result<VecDeque<Key>> {
            if !event::poll(WAIT)? {
                return Ok(VecDeque::new());
            }
            let Event::Key(key) = event::read()? else { return Ok(VecDeque::new()) };
            let is_plain = !key.modifiers.intersects(KeyModifiers::CONTROL | KeyModifiers::ALT);
            let key = match key.code {
                _ if key.kind != KeyEventKind::Press => None,
                KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Some(Key::End),
                KeyCode::Enter => Some(Key::Enter),
                KeyCode::Char(letter) if is_plain => Some(Key::Letter(letter.to_ascii_lowercase())),
                _ => None,
            };
            Ok(key.into_iter().collect())
        }
    }
}
