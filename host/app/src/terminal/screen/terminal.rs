//! The terminal while a steady screen has it, and how it is given back.

use std::collections::VecDeque;
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{EnterAlternateScreen, enable_raw_mode};

use super::layout;
use super::picture::Picture;
use crate::platform::{Key, Keyboard};
use crate::terminal::EndRequest;
use crate::terminal::given_back::{give_back, give_back_on_panic, lock};
use crate::terminal::out::terminal;

/// A terminal in raw mode that shows the alternate screen.
pub(super) struct Terminal {
    terminal: ratatui::Terminal<CrosstermBackend<Frames>>,
    pressed: Receiver<Key>,
    /// Taken from `pressed`, and not yet heard.
    keys: VecDeque<Key>,
    is_over: Arc<AtomicBool>,
    reader: Option<JoinHandle<()>>,
}

impl Terminal {
    /// Takes the terminal; Ctrl-C, which reaches the program as a key from here on, still asks it to end.
    pub(super) fn take(end: EndRequest) -> std::io::Result<Self> {
        give_back_on_panic();
        *lock() = true;
        let terminal = enable_raw_mode()
            .and_then(|()| execute!(terminal(), EnterAlternateScreen))
            .and_then(|()| ratatui::Terminal::new(CrosstermBackend::new(Frames::default())))
            .inspect_err(|_| give_back())?;
        let (sender, pressed) = channel();
        let is_over = Arc::new(AtomicBool::new(false));
        let reader = std::thread::Builder::new().name("keys".into()).spawn({
            let is_over = Arc::clone(&is_over);
            move || pass_keys(&sender, &end, &is_over)
        });
        let reader = Some(reader.inspect_err(|_| give_back())?);
        Ok(Self { terminal, pressed, keys: VecDeque::new(), is_over, reader })
    }

    /// Draws; the window may have changed its size.
    pub(super) fn draw(&mut self, picture: &Picture, notes: &[String]) {
        // A terminal that is gone shows nothing; the run is ended by the signal that comes with it.
        let _ = self.terminal.draw(|frame| layout::draw(frame, picture, notes));
    }

    /// The next key that was pressed.
    pub(super) fn key(&mut self) -> Option<Key> {
        self.keys.pop_front().or_else(|| self.pressed.try_recv().ok())
    }

    /// Forgets every press of a key so far.
    pub(super) fn forget(&mut self, key: Key) {
        self.keys.extend(self.pressed.try_iter());
        self.keys.retain(|other| *other != key);
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(reader) = self.reader.take() {
            let _ = reader.join();
        }
        give_back();
    }
}

/// Passes keys on until the screen is over, or the terminal gone, which asks the program to end as well.
fn pass_keys(pressed: &Sender<Key>, end: &EndRequest, is_over: &AtomicBool) {
    let mut keyboard = Keyboard::default();
    while !is_over.load(Ordering::Relaxed) {
        let Ok(keys) = keyboard.wait() else { return end.make() };
        for key in keys {
            match key {
                Key::End => end.insist(),
                key if pressed.send(key).is_err() => return,
                _ => {}
            }
        }
    }
}

/// Writes whole frames to stderr while the screen has the terminal. A terminal that is gone is no error: what it would show is said again
/// at the end.
#[derive(Default)]
struct Frames(Vec<u8>);

impl Write for Frames {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        let is_taken = lock();
        if *is_taken {
            let _ = terminal().write_all(&self.0);
        }
        self.0.clear();
        Ok(())
    }
}
