//! Anything at all on the link: nobody panics, and the board still answers a hello.
//!
//! Under `cargo test` each runs for a bounded number of random inputs. The first two run until they are stopped, guided by coverage,
//! with cargo-bolero (`cargo install cargo-bolero`), also on a stable toolchain:
//!
//! ```text
//! cargo bolero test --package ballbar-tests --profile release --rustc-bootstrap anything_on_the_link_of_a_board
//! ```

use ballbar::wire::{FrameReader, ToBoard, ToHost, decode, hello_version};
use ballbar_tests::any_message;
use ballbar_tests::at_length::at_length;
use ballbar_tests::fake_board::FakeBoard;
use ballbar_tests::parameter_sets::puma;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;

#[test]
fn anything_in_a_frame_reader_and_in_both_decoders() {
    bolero::check!().with_iterations(at_length(200_000)).with_max_len(2_000).for_each(|bytes: &[u8]| {
        understand(bytes);
        let mut reader = FrameReader::new();
        let mut frames = 0;
        for &byte in bytes {
            if let Some(Ok(payload)) = reader.push(byte) {
                understand(payload);
            }
            frames += u32::from(byte == 0);
        }
        let counts = reader.counts();
        assert!(counts.good + counts.thrown_away() <= frames);
    });
}

/// What decodes encodes again to what decodes to the same.
fn understand(payload: &[u8]) {
    let _ = hello_version(payload);
    if let Some(message) = decode::<ToBoard>(payload) {
        let again = postcard::to_stdvec(&message).unwrap();
        assert_eq!(again, postcard::to_stdvec(&decode::<ToBoard>(&again).unwrap()).unwrap());
    }
    if let Some(message) = decode::<ToHost>(payload) {
        let again = postcard::to_stdvec(&message).unwrap();
        assert_eq!(again, postcard::to_stdvec(&decode::<ToHost>(&again).unwrap()).unwrap());
    }
}

/// The first byte says how the rest is to be taken: as it comes from the wire, as payloads whose frames are whole, or as the
/// contents of commands, so that what lies behind the checksum is reached too.
#[test]
fn anything_on_the_link_of_a_board() {
    bolero::check!().with_iterations(at_length(3_000)).with_max_len(600).for_each(|bytes: &[u8]| {
        let Some((kind, bytes)) = bytes.split_first() else { return };
        let mut board = FakeBoard::new();
        board.greet();
        board.commit(&puma()).unwrap();
        match kind % 3 {
            0 => board.machine().link.to_board.extend(bytes),
            1 => bytes.chunks(usize::from(kind / 3) % 40 + 1).for_each(|payload| board.send_payload(payload)),
            _ => {
                for (id, command) in bytes.chunks(usize::from(kind / 3) % 40 + 1).enumerate() {
                    board.send_payload(&[&[1, id as u8 % 128, command[0] % 16], &command[1..]].concat());
                }
            }
        }
        board.run(60);
        board.machine().link.to_board.push_back(0);
        board.run(300);
        board.receive();
        board.send_hello();
        let is_hello = |message: &ToHost| matches!(message, ToHost::Hello(_));
        assert!((0..100).any(|_| {
            board.run(30);
            board.receive().iter().any(is_hello)
        }));
    });
}

/// Commands that are whole, in any order, with any numbers in them, while the arm moves.
#[test]
fn any_commands_in_any_order() {
    let commands = vec((any::<u16>(), any_message::command(), any::<[i16; 6]>()), 1..30);
    let config = ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(150) };
    TestRunner::new(config)
        .run(&commands, |commands| {
            let mut board = FakeBoard::new();
            board.greet();
            board.commit(&puma()).unwrap();
            for (id, command, moved) in commands {
                for (position, moved) in board.encoders().positions.iter_mut().zip(moved) {
                    *position += i64::from(moved);
                }
                board.ask_as(id, command).ok();
            }
            board.greet();
            Ok(())
        })
        .unwrap();
}
