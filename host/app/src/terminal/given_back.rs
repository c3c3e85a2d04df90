//! A terminal that a screen has taken is given back, however the program ends.

use std::sync::{Mutex, MutexGuard, Once, TryLockError};
use std::time::{Duration, Instant};

use ratatui::crossterm::cursor::Show;
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{LeaveAlternateScreen, disable_raw_mode};

use super::out::terminal;

/// Whether a screen has the terminal. Held while a frame is written, so that nothing is written into the middle of one, and nothing after
/// the terminal was given back.
static IS_TAKEN: Mutex<bool> = Mutex::new(false);
/// A terminal that takes no bytes must not keep the program from ending.
const PATIENCE: Duration = Duration::from_millis(200);

/// Gives the terminal back as it was, if a screen has it.
pub(super) fn give_back() {
    let began = Instant::now();
    let mut is_taken = loop {
        match IS_TAKEN.try_lock() {
            Ok(is_taken) => break Some(is_taken),
            Err(TryLockError::Poisoned(poisoned)) => break Some(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) if began.elapsed() < PATIENCE => std::thread::sleep(Duration::from_millis(1)),
            Err(TryLockError::WouldBlock) => break None,
        }
    };
    if is_taken.as_mut().is_none_or(|is_taken| std::mem::take(&mut **is_taken)) {
        // Whatever fails here cannot be told anywhere.
        let _ = disable_raw_mode();
        let _ = execute!(terminal(), LeaveAlternateScreen, Show);
    }
}

pub(super) fn lock() -> MutexGuard<'static, bool> {
    IS_TAKEN.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

pub(super) fn give_back_on_panic() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            give_back();
            before(panic);
        }));
    });
}
