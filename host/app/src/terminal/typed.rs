//! Lines that are typed while something else goes on.

use std::io::{BufRead, stdin};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

/// Lines of stdin; a thread reads them, since no read of a line can be given up. Closed when stdin is.
pub(crate) fn typed_lines() -> Receiver<String> {
    let (sender, receiver) = channel();
    let read = move || {
        for line in stdin().lock().lines() {
            let Ok(line) = line else { return };
            if sender.send(line).is_err() {
                return;
            }
        }
    };
    // Without the thread it is as if stdin were closed.
    let _ = thread::Builder::new().name("stdin".into()).spawn(read);
    receiver
}
