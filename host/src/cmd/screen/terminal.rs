//! The terminal while a steady screen has it, and how it is given back.

use std::io::{Stderr, stderr};
use std::sync::Arc;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::cursor::Show;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode};

use super::layout;
use super::picture::Picture;
use crate::cmd::port::EndRequest;

/// A key that means something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::cmd) enum Key {
    Enter,
    Letter(char),
}

/// Whether a screen has the terminal: whatever ends the program gives it back first.
static IS_TAKEN: AtomicBool = AtomicBool::new(false);
/// How long the reader of keys takes at most to notice that it is to end.
const READER: Duration = Duration::from_millis(50);

/// A terminal in raw mode that shows the alternate screen.
pub(super) struct Terminal {
    terminal: ratatui::Terminal<CrosstermBackend<Stderr>>,
    keys: Receiver<Key>,
    is_over: Arc<AtomicBool>,
    reader: Option<JoinHandle<()>>,
}

impl Terminal {
    /// Takes the terminal; Ctrl-C, which reaches the program as a key from here on, still asks it to end.
    pub(super) fn take(end: EndRequest) -> std::io::Result<Self> {
        give_back_on_panic();
        IS_TAKEN.store(true, Ordering::SeqCst);
        let terminal = enable_raw_mode()
            .and_then(|()| execute!(stderr(), EnterAlternateScreen))
            .and_then(|()| ratatui::Terminal::new(CrosstermBackend::new(stderr())))
            .inspect_err(|_| give_back())?;
        let (sender, keys) = channel();
        let is_over = Arc::new(AtomicBool::new(false));
        let reader = std::thread::Builder::new().name("keys".into()).spawn({
            let is_over = Arc::clone(&is_over);
            move || read_keys(&sender, &end, &is_over)
        });
        let reader = Some(reader.inspect_err(|_| give_back())?);
        Ok(Self { terminal, keys, is_over, reader })
    }

    /// Draws; the window may have changed its size.
    pub(super) fn draw(&mut self, picture: &Picture, notes: &[String]) {
        // A terminal that is gone shows nothing; the run goes on, or is ended by the signal that comes with it.
        let _ = self.terminal.draw(|frame| layout::draw(frame, picture, notes));
    }

    /// The next key that was pressed.
    pub(super) fn key(&self) -> Option<Key> {
        self.keys.try_recv().ok()
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

/// Gives the terminal back as it was, if a screen has it.
pub(in crate::cmd) fn give_back() {
    if IS_TAKEN.swap(false, Ordering::SeqCst) {
        // Whatever fails here cannot be told anywhere.
        let _ = execute!(stderr(), LeaveAlternateScreen, Show);
        let _ = disable_raw_mode();
    }
}

fn give_back_on_panic() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            give_back();
            before(panic);
        }));
    });
}

/// Passes keys on until the screen is over or the terminal gone, which asks the program to end as well.
fn read_keys(keys: &Sender<Key>, end: &EndRequest, is_over: &AtomicBool) {
    while !is_over.load(Ordering::Relaxed) {
        let event = match event::poll(READER) {
            Ok(false) => continue,
            Ok(true) => event::read(),
            Err(error) => Err(error),
        };
        match event {
            Ok(Event::Key(key)) if key.kind == KeyEventKind::Press => match meaning(key) {
                Some(Pressed::End) => end.insist(),
                Some(Pressed::Key(key)) if keys.send(key).is_err() => return,
                _ => {}
            },
            Ok(_) => {}
            Err(_) => return end.make(),
        }
    }
}

enum Pressed {
    End,
    Key(Key),
}

fn meaning(key: KeyEvent) -> Option<Pressed> {
    match key.code {
        KeyCode::Char('c' | '\\') if key.modifiers.contains(KeyModifiers::CONTROL) => Some(Pressed::End),
        KeyCode::Enter => Some(Pressed::Key(Key::Enter)),
        KeyCode::Char(letter) if !key.modifiers.intersects(KeyModifiers::CONTROL | KeyModifiers::ALT) => {
            Some(Pressed::Key(Key::Letter(letter.to_ascii_lowercase())))
        }
        _ => None,
    }
}
