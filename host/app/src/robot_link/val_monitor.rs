//! The monitor of VAL and VAL II as a terminal has it: a prompt, typed lines that are echoed, and what is printed below them.
//!
//! A reply begins with the echo of the line that was sent and ends with the prompt (`.`, or `*` while a program runs) or with the
//! question for changes of a point. Whatever comes before the echo came by itself. The prompt `*` is also how messages begin (`*Envelope error*`):
//! it counts only when nothing has followed for a moment.
//!
//! Known from sources: the two prompts and when commands may be typed ("User's Guide to VAL", 398H2A, version 12, 1980, as others
//! quote it); that a point is printed, changed after the query `CHANGES?` by the values that are typed, and asked for again until
//! nothing is typed (V. Scheinman, VAL of March 1977, saildart.org, UNI2.V, command TRANS); that VAL II's successor asks with a
//! question mark, too, and takes `SPEED` and `DO MOVE` (public drivers of a Stäubli RX90); what messages look like (Adept, "V+
//! Language Reference Guide", system messages). The spelling of the question differs between versions: `CHANGE?`, `CHANGES?` and
//! `Change?` count alike.
//!
//! Not known from any source at hand: that `POINT` of a precision point goes through the dialogue of `TRANS`, that six values with
//! commas are taken in one line, the layout of `WHERE`, and when the prompt comes after `DO`. These are from memory: try them by hand
//! first.

use std::time::{Duration, Instant};

use super::LinkError;
use crate::board::{Port, PortError};
use crate::deadline::{Deadline, StopFlag, WaitOver};

/// Bits a second of a VAL terminal line as delivered.
pub const VAL_BAUD: u32 = 9600;
/// Nothing that the monitor prints at once is longer.
const HELD_MAX: usize = 4096;
/// A line that has been quiet for so long is at its end: many characters' time, and that of a USB converter's buffer.
const QUIET: Duration = Duration::from_millis(50);
/// Control-C: gives up what is being typed or printed.
const INTERRUPT: u8 = 0x03;

/// The monitor at the other end of a serial line.
pub(super) struct Monitor {
    port: Port,
    held: String,
    heard_at: Instant,
    asked: Option<Asked>,
    stop: StopFlag,
}

/// A line that waits for its reply.
struct Asked {
    line: String,
    /// For all of the reply.
    deadline: Deadline,
}

/// What has come.
#[derive(Debug, PartialEq)]
pub(super) enum Heard {
    /// Nothing whole yet.
    Nothing,
    /// Lines that came by themselves.
    Unasked(Vec<String>),
    /// The reply to the latest line, echo and prompt taken off.
    Reply {
        lines: Vec<String>,
        /// It ended with the question for changes instead of the prompt.
        is_question: bool,
    },
    /// There was no reply in time.
    Overdue,
}

impl Monitor {
    /// Opens a line and waits for a prompt.
    ///
    /// # Errors
    /// [`LinkError`].
    pub(super) fn open(port_name: &str, baud: u32, wait: Duration) -> Result<Self, LinkError> {
        let unreachable = |reason: String| LinkError::Unreachable { address: port_name.to_owned(), reason };
        let port = Port::open(port_name, baud).map_err(|error| unreachable(error.to_string()))?;
        let mut monitor = Self { port, held: String::new(), heard_at: Instant::now(), asked: None, stop: StopFlag::default() };
        if monitor.exchange("", wait)?.is_some() {
            return Ok(monitor);
        }
        if monitor.held.trim().is_empty() {
            Err(unreachable(format!("nothing answers at {baud} baud")))
        } else {
            Err(monitor.unexpected("VAL's prompt, a dot"))
        }
    }

    /// Name of the port.
    pub(super) fn port_name(&self) -> &str {
        self.port.name()
    }

    /// From here on no reply is waited for any longer once the flag is set.
    pub(super) fn heed(&mut self, stop: &StopFlag) {
        self.stop = stop.clone();
    }

    /// Types a line.
    ///
    /// # Errors
    /// [`LinkError::Lost`].
    pub(super) fn send(&mut self, line: &str, wait: Duration) -> Result<(), LinkError> {
        let deadline = Deadline::after(wait, &self.stop);
        self.send_until(line, deadline)
    }

    fn send_until(&mut self, line: &str, deadline: Deadline) -> Result<(), LinkError> {
        self.asked = Some(Asked { line: line.to_owned(), deadline });
        self.port.write_all(format!("{line}\r").as_bytes()).map_err(lost)
    }

    /// Types control-C; the reply that was awaited does not count any more.
    ///
    /// # Errors
    /// [`LinkError::Lost`].
    pub(super) fn interrupt(&mut self) -> Result<(), LinkError> {
        self.asked = None;
        self.port.write_all(&[INTERRUPT]).map_err(lost)
    }

    /// Types a line and waits for its reply; `None` when there is none in time.
    ///
    /// # Errors
    /// [`LinkError`].
    pub(super) fn exchange(&mut self, line: &str, wait: Duration) -> Result<Option<Vec<String>>, LinkError> {
        self.send(line, wait)?;
        self.wait()
    }

    /// As [`Monitor::exchange`], also when the user wants to end: what stops the robot.
    ///
    /// # Errors
    /// [`LinkError`].
    pub(super) fn exchange_regardless(&mut self, line: &str, wait: Duration) -> Result<Option<Vec<String>>, LinkError> {
        self.send_until(line, Deadline::regardless(wait))?;
        self.wait()
    }

    fn wait(&mut self) -> Result<Option<Vec<String>>, LinkError> {
        loop {
            match self.hear()? {
                Heard::Reply { lines, .. } => return Ok(Some(lines)),
                Heard::Overdue => return Ok(None),
                Heard::Nothing | Heard::Unasked(_) => {}
            }
        }
    }

    /// Takes in what has come, waiting a moment.
    ///
    /// # Errors
    /// [`LinkError`], also when more comes without a prompt than any monitor prints.
    pub(super) fn hear(&mut self) -> Result<Heard, LinkError> {
        let mut bytes = [0; 512];
        let count = self.port.read(&mut bytes).map_err(lost)?;
        if count > 0 {
            self.heard_at = Instant::now();
            self.held.extend(bytes[..count].iter().filter_map(|byte| printable(*byte)));
        }
        if self.held.len() > HELD_MAX {
            return Err(self.unexpected("a prompt after a reply"));
        }
        let Some(asked) = &self.asked else { return Ok(self.unasked()) };
        if self.heard_at.elapsed() >= QUIET
            && let Some((lines, is_question)) = reply(&self.held, &asked.line)
        {
            self.held.clear();
            self.asked = None;
            return Ok(Heard::Reply { lines, is_question });
        }
        match asked.deadline.check() {
            Ok(()) => Ok(Heard::Nothing),
            Err(WaitOver::Late) => {
                self.asked = None;
                Ok(Heard::Overdue)
            }
            Err(WaitOver::Stopped) => Err(LinkError::Stopped),
        }
    }

    /// Cuts off whole lines.
    fn unasked(&mut self) -> Heard {
        let Some(end) = self.held.rfind('\n') else { return Heard::Nothing };
        let lines = lines(&self.held[..end]);
        self.held.drain(..=end);
        if lines.is_empty() { Heard::Nothing } else { Heard::Unasked(lines) }
    }

    /// What was heard is not VAL.
    pub(super) fn unexpected(&self, expected: &'static str) -> LinkError {
        let found = self.held.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(60).collect();
        LinkError::Unexpected { address: self.port.name().to_owned(), found, expected }
    }
}

/// Lines of the reply to `asked`, and whether it ends with a question; `None` when it has not come whole.
fn reply(held: &str, asked: &str) -> Option<(Vec<String>, bool)> {
    let (before, after) = if asked.is_empty() { ("", held) } else { held.split_once(asked)? };
    let (printed, last) = after.rsplit_once('\n')?;
    let is_question = asks_for_changes(last) || last.trim().is_empty() && asks_for_changes(printed);
    if is_question || [".", "*"].contains(&last.trim()) {
        Some((lines(before).into_iter().chain(lines(printed)).collect(), is_question))
    } else {
        None
    }
}

/// Whether a text ends with the question that versions spell `CHANGE?`, `CHANGES?` or `Change?`.
fn asks_for_changes(text: &str) -> bool {
    let upper = text.trim_end().to_ascii_uppercase();
    ["CHANGE?", "CHANGES?"].iter().any(|question| upper.ends_with(question))
}

fn lines(text: &str) -> Vec<String> {
    text.lines().map(str::trim).filter(|line| !line.is_empty()).map(str::to_owned).collect()
}

/// A byte as text. Controllers of that time pad with zeros and ring the bell; what is no ASCII came damaged.
fn printable(byte: u8) -> Option<char> {
    match byte {
        b'\r' | b'\n' => Some('\n'),
        b'\t' | b' '..=b'~' => Some(char::from(byte)),
        0x80.. => Some('?'),
        _ => None,
    }
}

/// Whether a line says that something is wrong. VAL II puts its messages between asterisks; other words are for VAL's sake.
pub(super) fn is_complaint(line: &str) -> bool {
    const WORDS: [&str; 9] =
        ["ERROR", "OUT OF RANGE", "POWER OFF", "NOT CALIBRATED", "ABORTED", "ILLEGAL", "INVALID", "UNDEFINED", "PANIC"];
    let upper = line.to_uppercase();
    (line.starts_with('*') && line.len() > 1) || line.starts_with('?') || WORDS.iter().any(|word| upper.contains(word))
}

/// The joints that `WHERE` prints, degrees: the last line of six numbers and more, below the one of the location. A seventh number
/// is the hand's.
pub(super) fn where_deg(lines: &[String]) -> Option<[f64; 6]> {
    let numbers = |line: &String| -> Option<Vec<f64>> { line.split_whitespace().map(|word| word.parse().ok()).collect() };
    let rows: Vec<Vec<f64>> = lines.iter().filter_map(numbers).filter(|row| row.len() >= 6).collect();
    let [_location, .., joints] = &rows[..] else { return None };
    let joints: [f64; 6] = joints[..6].try_into().ok()?;
    joints.iter().all(|q| q.is_finite()).then_some(joints)
}

fn lost(error: PortError) -> LinkError {
    match error {
        PortError::Lost { name, reason } => LinkError::Lost { address: name, reason },
        other => LinkError::Lost { address: String::new(), reason: other.to_string() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reply_is_whole_with_its_echo_and_prompt() {
        assert_eq!(reply("SPEED 25\n\n.", "SPEED 25"), Some((vec![], false)));
        assert_eq!(reply("SPEED 25\n", "SPEED 25"), None);
        assert_eq!(reply("\n.", "SPEED 25"), None, "a prompt of before");
        assert_eq!(reply("DO X\n*Unknown instruction*\n.", "DO X"), Some((vec!["*Unknown instruction*".into()], false)));
        assert_eq!(reply("POINT #B\n 0 0\nCHANGE?", "POINT #B"), Some((vec!["0 0".into()], true)));
        for question in ["CHANGE?\n", "CHANGES?", "CHANGES?\n", "Change?", "Change? ", "change?\n"] {
            assert!(reply(&format!("POINT #B\n 0 0\n{question}"), "POINT #B").unwrap().1, "{question}");
        }
        assert_eq!(reply("POINT #B\n 0 0\nWhy?", "POINT #B"), None);
        let (lines, _) = reply("\n*Envelope error* Jt 2\n.WHERE\n 1 2\n.", "WHERE").unwrap();
        assert_eq!(lines, ["*Envelope error* Jt 2", ".", "1 2"]);
    }

    #[test]
    fn a_message_is_a_complaint_and_a_prompt_is_none() {
        for line in ["*Envelope error* Jt 2", "*COMP mode disabled*", "?", "Arm power off", "*Out of range*"] {
            assert!(is_complaint(line), "{line}");
        }
        for line in ["*", ".", "X/JT1 Y/JT2", "1.00 2.00", "PROGRAM COMPLETED"] {
            assert!(!is_complaint(line), "{line}");
        }
    }

    #[test]
    fn the_joints_stand_below_the_location() {
        let lines = |text: &str| super::lines(text);
        let printed = "X/JT1 Y/JT2 Z/JT3\n 1 2 3 4 5 6 0.0\n 10.0 -20.5 30 40 50 -60.125";
        assert_eq!(where_deg(&lines(printed)), Some([10.0, -20.5, 30.0, 40.0, 50.0, -60.125]));
        for broken in ["", "1 2 3 4 5 6", "1 2 3 4 5 6\n1 2 3 4 5", "1 2 3 4 5 6\n1 2 3 4 5 inf"] {
            assert_eq!(where_deg(&lines(broken)), None, "{broken}");
        }
    }
}
