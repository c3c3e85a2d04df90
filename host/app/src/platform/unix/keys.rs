//! Keys in the bytes of a terminal.

use std::collections::VecDeque;

use crate::platform::Key;

/// Keys in the bytes that a terminal in raw mode sends. Sequences of other keys are passed over, whole or broken off.
#[derive(Debug, Default)]
pub(super) struct Decoder {
    state: State,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum State {
    #[default]
    Plain,
    /// ESC has come.
    Escaped,
    /// In a control sequence, up to its last byte, `@` to `~`.
    Sequence,
    /// One byte more belongs to it, as after ESC O.
    Last,
}

const ESCAPE: u8 = 0x1b;

impl Decoder {
    /// The keys that are complete now.
    pub(super) fn decode(&mut self, bytes: &[u8]) -> VecDeque<Key> {
        bytes.iter().filter_map(|&byte| self.take(byte)).collect()
    }

    /// Nothing came for a while: what was begun is no sequence.
    pub(super) fn rest(&mut self) {
        self.state = State::Plain;
    }

    fn take(&mut self, byte: u8) -> Option<Key> {
        // Whatever was begun: who presses these wants to get out.
        if matches!(byte, 0x03 | 0x1c) {
            self.state = State::Plain;
            return Some(Key::End);
        }
        let before = std::mem::take(&mut self.state);
        match (before, byte) {
            (_, ESCAPE) => self.state = State::Escaped,
            (State::Escaped, b'[') => self.state = State::Sequence,
            (State::Escaped, b'O') => self.state = State::Last,
            (State::Sequence, b'@'..=b'~') | (State::Escaped | State::Last, _) => {}
            (State::Sequence, _) => self.state = State::Sequence,
            (State::Plain, b'\r' | b'\n') => return Some(Key::Enter),
            (State::Plain, letter) if letter.is_ascii_graphic() => {
                return Some(Key::Letter(char::from(letter.to_ascii_lowercase())));
            }
            (State::Plain, _) => {}
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(bytes: &[u8]) -> Vec<Key> {
        Decoder::default().decode(bytes).into()
    }

    #[test]
    fn letters_enter_and_the_ways_out_are_keys() {
        let expected = [Key::Letter('s'), Key::Letter('q'), Key::Enter, Key::End, Key::End];
        assert_eq!(keys(b"sQ\r\x03\x1c"), expected);
    }

    #[test]
    fn arrows_function_keys_and_alt_are_none() {
        assert_eq!(keys(b"\x1b[A\x1bOP\x1b[15~\x1b[1;5q\x1bs"), []);
        assert_eq!(keys("äß€".as_bytes()), []);
    }

    #[test]
    fn a_sequence_broken_off_hides_neither_the_way_out_nor_what_comes_later() {
        assert_eq!(keys(b"\x1b[\x03"), [Key::End]);
        let mut decoder = Decoder::default();
        assert_eq!(decoder.decode(b"\x1b["), []);
        decoder.rest();
        assert_eq!(decoder.decode(b"p"), [Key::Letter('p')]);
    }
}
