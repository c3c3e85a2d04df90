//! Frames: what is sent arrives, what is damaged never arrives as something else, and everything that can be said fits.

use ballbar::wire::{FrameCounts, FrameFault, FrameReader, MAX_FRAME, MAX_PAYLOAD, ToBoard, ToHost, decode, encode};
use ballbar_tests::any_message;
use ballbar_tests::raw_payload::RawPayload;
use proptest::collection::vec;
use proptest::prelude::*;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

fn frame_of(message: &impl Serialize) -> Vec<u8> {
    encode(message, &mut [0; MAX_FRAME]).unwrap().to_vec()
}

/// What a reader makes of bytes.
#[derive(Default)]
struct Read {
    payloads: Vec<Vec<u8>>,
    faults: Vec<FrameFault>,
    counts: FrameCounts,
}

fn read<'a>(bytes: impl IntoIterator<Item = &'a u8>) -> Read {
    let mut reader = FrameReader::new();
    let mut read = Read::default();
    for &byte in bytes {
        match reader.push(byte) {
            Some(Ok(payload)) => read.payloads.push(payload.to_vec()),
            Some(Err(fault)) => read.faults.push(fault),
            None => {}
        }
    }
    read.counts = reader.counts();
    read
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn any_message_arrives_as_it_was_sent(to_board in any_message::to_board(), to_host in any_message::to_host()) {
        let (a, b) = (frame_of(&to_board), frame_of(&to_host));
        let read = read(a.iter().chain(&b));
        prop_assert_eq!(decode::<ToBoard>(&read.payloads[0]), Some(to_board));
        prop_assert_eq!(decode::<ToHost>(&read.payloads[1]), Some(to_host));
        prop_assert_eq!(read.counts, FrameCounts { good: 2, ..FrameCounts::default() });
    }

    #[test]
    fn a_frame_has_one_zero_and_it_is_its_last_byte(message in any_message::to_host()) {
        let frame = frame_of(&message);
        prop_assert_eq!(frame.iter().position(|&byte| byte == 0), Some(frame.len() - 1));
    }

    #[test]
    fn a_flip_of_any_one_bit_never_makes_another_message(message in any_message::to_host()) {
        let frame = frame_of(&message);
        let payload = postcard::to_stdvec(&message).unwrap();
        let next = frame_of(&"the next one");
        for bit in 0..8 * frame.len() {
            let mut damaged = frame.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            let read = read(damaged.iter().chain(&next).chain(&next));
            let (last, before) = read.payloads.split_last().unwrap();
            prop_assert_eq!(decode::<String>(last), Some("the next one".to_owned()), "not in step again after bit {}", bit);
            let is_known = |found: &Vec<u8>| *found == payload || found == last;
            prop_assert!(before.iter().all(is_known), "bit {} made another message", bit);
        }
    }

    #[test]
    fn damage_of_any_kind_never_makes_another_message(
        messages in vec(any_message::to_board(), 1..6),
        seed in any::<u64>(),
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let payloads: Vec<_> = messages.iter().map(|message| postcard::to_stdvec(message).unwrap()).collect();
        let frames: Vec<_> = messages.iter().map(frame_of).collect();
        let mut wire = Vec::new();
        for frame in &frames {
            damage(frame, &mut wire, &mut rng);
        }
        wire.push(0);
        wire.extend(frame_of(&"in step"));
        let read = read(&wire);
        let (last, before) = read.payloads.split_last().unwrap();
        prop_assert_eq!(decode::<String>(last), Some("in step".to_owned()));
        prop_assert!(before.iter().all(|found| payloads.contains(found)));
    }

    #[test]
    fn the_counts_say_what_came_of_every_frame(
        pieces in vec((any::<u8>(), vec(1_u8..=255, 0..=MAX_FRAME + 10)), 0..12),
    ) {
        let mut wire = Vec::new();
        let (mut frames, mut overlong) = (0, 0);
        for (kind, bytes) in &pieces {
            if kind % 2 == 0 {
                wire.extend(frame_of(kind));
                frames += 1;
            } else {
                wire.extend(bytes);
                wire.push(0);
                frames += u32::from(!bytes.is_empty());
                overlong += u32::from(bytes.len() > MAX_FRAME);
            }
        }
        let read = read(&wire);
        prop_assert_eq!(read.counts.good + read.counts.thrown_away(), frames);
        prop_assert_eq!(read.counts.good as usize, read.payloads.len());
        prop_assert_eq!(read.counts.overlong, overlong);
        let faults_of = |kind| read.faults.iter().filter(|&&fault| fault == kind).count() as u32;
        prop_assert_eq!(read.counts.overlong, faults_of(FrameFault::Overlong));
        prop_assert_eq!(read.counts.malformed, faults_of(FrameFault::Malformed));
        prop_assert_eq!(read.counts.crc, faults_of(FrameFault::Crc));
    }
}

/// Copies a frame, or half of it, or without its end, or with other bytes in it.
fn damage(frame: &[u8], wire: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    match rng.random_range(0..6) {
        0 => wire.extend(frame),
        1 => wire.extend(&frame[..rng.random_range(0..frame.len())]),
        2 => wire.extend(&frame[rng.random_range(0..frame.len())..]),
        3 => wire.extend(&frame[..frame.len() - 1]),
        4 => {
            let at = rng.random_range(0..=frame.len());
            let mut bytes = vec![0; rng.random_range(1..40)];
            rng.fill_bytes(&mut bytes);
            wire.extend(frame[..at].iter().chain(&bytes).chain(&frame[at..]));
        }
        _ => {
            let mut frame = frame.to_vec();
            let burst = rng.random_range(1..=frame.len().min(20));
            let start = rng.random_range(0..=frame.len() - burst);
            rng.fill_bytes(&mut frame[start..start + burst]);
            wire.extend(frame);
        }
    }
}

#[test]
fn random_bytes_are_no_message() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut bytes = vec![0; 2_000_000];
    rng.fill_bytes(&mut bytes);
    let read = read(&bytes);
    assert!(read.payloads.is_empty(), "a CRC fits by chance once in four thousand million frames");
    assert_eq!(read.faults.len() as u32, read.counts.thrown_away());
    assert!(read.faults.len() > 7_000, "{:?}", read.counts);
}

#[test]
fn zeros_before_and_between_frames_are_no_frames() {
    let frame = frame_of(&7_u32);
    let read = read([0, 0, 0].iter().chain(&frame).chain(&[0, 0]).chain(&frame));
    assert_eq!(read.counts, FrameCounts { good: 2, ..FrameCounts::default() });
}

#[test]
fn two_frames_that_lost_the_zero_between_them_are_thrown_away_together() {
    let (first, second, third) = (frame_of(&1_u32), frame_of(&2_u32), frame_of(&3_u32));
    let read = read(first[..first.len() - 1].iter().chain(&second).chain(&third));
    assert_eq!(read.payloads, [vec![3]]);
    assert_eq!(read.counts.thrown_away(), 1);
}

#[test]
fn an_overlong_frame_is_one_fault_however_long_it_is() {
    for length in [MAX_FRAME + 1, MAX_FRAME + 2, 10 * MAX_FRAME] {
        let read = read(vec![b'x'; length].iter().chain(&[0]).chain(&frame_of(&5_u32)));
        assert_eq!(read.faults, [FrameFault::Overlong], "{length}");
        assert_eq!(read.payloads, [vec![5]]);
    }
}

#[test]
fn a_frame_too_short_for_its_checksum_is_malformed() {
    for frame in [&[1, 0][..], &[2, b'a', 0], &[4, b'a', b'b', b'c', 0]] {
        assert_eq!(read(frame).faults, [FrameFault::Malformed], "{frame:?}");
    }
}

/// Without a zero among them, COBS has the most to add.
#[test]
fn the_longest_payload_just_fits_and_one_byte_more_does_not() {
    let longest = [b'x'; MAX_PAYLOAD];
    let mut buffer = [0; MAX_FRAME];
    let frame = encode(&RawPayload(&longest), &mut buffer).unwrap();
    assert_eq!(frame.len(), MAX_FRAME);
    assert_eq!(read(frame).payloads, [longest]);
    assert!(encode(&RawPayload(&[b'x'; MAX_PAYLOAD + 1]), &mut [0; MAX_FRAME]).is_err());
}

#[test]
fn the_longest_payload_of_zeros_fits() {
    let mut buffer = [0; MAX_FRAME];
    assert_eq!(read(encode(&RawPayload(&[0; MAX_PAYLOAD]), &mut buffer).unwrap()).payloads, [[0; MAX_PAYLOAD]]);
}

#[test]
fn a_payload_that_only_fits_because_of_its_zeros_is_read_too() {
    let mut buffer = [0; MAX_FRAME];
    let frame = encode(&RawPayload(&[0; MAX_PAYLOAD + 4]), &mut buffer).unwrap();
    assert_eq!(read(frame).payloads, [[0; MAX_PAYLOAD + 4]]);
    assert!(encode(&RawPayload(&[0; MAX_PAYLOAD + 6]), &mut [0; MAX_FRAME]).is_err());
}

#[test]
fn a_message_with_a_byte_behind_it_is_none() {
    let mut payload =
        postcard::to_stdvec(&ToBoard::Hello(ballbar::wire::HostHello { version: ballbar::wire::PROTOCOL })).unwrap();
    assert!(decode::<ToBoard>(&payload).is_some());
    payload.push(0);
    assert!(decode::<ToBoard>(&payload).is_none());
}
