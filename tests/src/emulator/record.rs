//! The plant's answers as bytes: the other half of `firmware/src/bin/an386/record.rs`, where the format is described.

use ballbar::CounterWidth;
use ballbar_firmware::ENCODERS;
use host_cal::virtual_board::{COUNTER_WIDTHS, PlantState};

/// Writes records; remembers what the board knows.
#[derive(Debug, Default)]
pub(super) struct RecordWriter {
    known: PlantState,
}

impl RecordWriter {
    /// What a board that knows all records before has to be told.
    pub(super) fn record(&mut self, state: &PlantState) -> Vec<u8> {
        let (mut flags, mut more_flags) = (0_u8, 0_u8);
        let mut numbers = Vec::new();
        for i in 0..ENCODERS {
            let change = difference(i, state.latch.counters[i], self.known.latch.counters[i]);
            if change != 0 {
                flags |= 1 << i;
                push_number(&mut numbers, change);
            }
        }
        let code_change = i32::from(state.scan.code) - i32::from(self.known.scan.code);
        if code_change != 0 {
            flags |= 1 << 6;
            push_number(&mut numbers, code_change);
        }
        for i in 0..ENCODERS {
            if let Some(at_index) = state.latch.at_index[i] {
                more_flags |= 1 << i;
                push_number(&mut numbers, difference(i, at_index, state.latch.counters[i]));
            }
        }
        if state.scan.saturated != self.known.scan.saturated {
            more_flags |= 1 << 6;
        }
        self.known = *state;
        let mut record = vec![flags];
        if more_flags != 0 {
            record[0] |= 1 << 7;
            record.push(more_flags);
        }
        record.extend(numbers);
        record
    }
}

/// From `b` to `a`, as the counter of encoder `i` wraps.
fn difference(i: usize, a: u32, b: u32) -> i32 {
    let difference = a.wrapping_sub(b);
    match COUNTER_WIDTHS[i] {
        CounterWidth::Bits16 => i32::from((difference as u16).cast_signed()),
        CounterWidth::Bits32 => difference.cast_signed(),
    }
}

fn push_number(bytes: &mut Vec<u8>, number: i32) {
    let mut zigzag = (number << 1 ^ number >> 31).cast_unsigned();
    while zigzag >= 0x80 {
        bytes.push(zigzag as u8 | 0x80);
        zigzag >>= 7;
    }
    bytes.push(zigzag as u8);
}

/// The firmware's reader, as it runs on the board.
#[cfg(test)]
#[path = "../../../firmware/src/bin/an386/record.rs"]
mod reader;

#[cfg(test)]
mod tests {
    use ballbar_firmware::{EncoderBank, EncoderLatch, LvdtScan};
    use proptest::prelude::*;

    use super::*;

    /// Counters as wide as the plant's.
    struct Bank;

    impl EncoderBank for Bank {
        const WIDTHS: [CounterWidth; ENCODERS] = COUNTER_WIDTHS;

        fn latch(&mut self) -> EncoderLatch {
            EncoderLatch::default()
        }
    }

    fn counters() -> impl Strategy<Value = [u32; ENCODERS]> {
        let near_and_far = prop_oneof![0..40_u32, any::<u32>()];
        prop::array::uniform6(near_and_far).prop_map(|counters| std::array::from_fn(|i| held(i, counters[i])))
    }

    fn held(i: usize, counter: u32) -> u32 {
        if COUNTER_WIDTHS[i] == CounterWidth::Bits16 { counter & 0xffff } else { counter }
    }

    fn state() -> impl Strategy<Value = PlantState> {
        let indices = prop::array::uniform6(prop::option::weighted(0.2, any::<u32>()));
        (counters(), indices, any::<u16>(), any::<bool>()).prop_map(|(counters, indices, code, saturated)| PlantState {
            latch: EncoderLatch { counters, at_index: std::array::from_fn(|i| indices[i].map(|at| held(i, at))) },
            scan: LvdtScan { code, saturated },
        })
    }

    proptest! {
        #[test]
        fn the_board_reads_what_the_plant_writes(states in prop::collection::vec(state(), 1..20)) {
            let (mut writer, mut inputs) = (RecordWriter::default(), reader::Inputs::default());
            for state in states {
                let mut bytes = writer.record(&state).into_iter();
                inputs.read::<Bank>(|| bytes.next().unwrap()).unwrap();
                prop_assert_eq!(bytes.next(), None);
                prop_assert_eq!(inputs, reader::Inputs { latch: state.latch, scan: state.scan });
            }
        }

        #[test]
        fn nothing_moved_is_one_byte(state in state()) {
            let still = PlantState { latch: EncoderLatch { at_index: [None; ENCODERS], ..state.latch }, ..state };
            let mut writer = RecordWriter::default();
            writer.record(&still);
            prop_assert_eq!(writer.record(&still), [0]);
        }

        #[test]
        fn no_bytes_make_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 200)) {
            let mut bytes = bytes.into_iter().chain(std::iter::repeat(0));
            let _ = reader::Inputs::default().read::<Bank>(|| bytes.next().unwrap());
        }
    }

    #[test]
    fn records_that_no_plant_writes_are_errors() {
        for (bytes, error) in [
            (&[0x80, 0x00][..], reader::RecordError::Flags(0)),
            (&[0x80, 0x80], reader::RecordError::Flags(0x80)),
            (&[0x01, 0xff, 0xff, 0xff, 0xff, 0x1f], reader::RecordError::Number),
            (&[0x40, 0x01], reader::RecordError::Code),
        ] {
            let mut bytes = bytes.iter().copied();
            assert_eq!(reader::Inputs::default().read::<Bank>(|| bytes.next().unwrap()), Err(error));
        }
    }
}
