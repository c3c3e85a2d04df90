//! The longest messages fit into a frame, and the stream of a moving arm into half of the link.

use ballbar::wire::{
    Answer, BoardHello, Command, EncoderStatus, Event, LinkCounts, MAX_BATCH, MAX_FRAME, MAX_PAYLOAD, MAX_POSE_BATCH, PoseBatch,
    ProtocolVersion, Reply, Request, ResetReason, SampleBatch, SetIdentity, SlotState, Status, Stream, StreamSelection,
    StreamedPose, ToBoard, ToHost, ToolPose, encode,
};
use ballbar::{LvdtReading, Sample, SettledPose, Stillness, StillnessCriteria};
use ballbar_tests::parameter_sets;
use serde::Serialize;

/// The payload's bytes; fails when it does not fit into a frame.
fn payload_bytes(message: &impl Serialize) -> usize {
    let length = postcard::to_stdvec(message).unwrap().len();
    assert!(length <= MAX_PAYLOAD && encode(message, &mut [0; MAX_FRAME]).is_ok(), "{length} bytes");
    length
}

/// In a stream message whose own numbers are at their longest.
fn streamed(event: Event) -> ToHost {
    ToHost::Stream(Stream { sequence: u32::MAX, dropped: u32::MAX, overruns: u32::MAX, homed: u8::MAX, event })
}

fn reply(answer: Answer) -> ToHost {
    ToHost::Reply(Reply { id: u16::MAX, outcome: Ok(answer) })
}

/// A batch that is full, of so many encoders, of which each leaps by half of all there is between two samples, as the LVDT does by
/// all of its codes: every number takes the most bytes that it can.
fn worst_batch(encoders: usize) -> SampleBatch {
    let sample = |i: u32| Sample {
        index: u32::MAX - MAX_BATCH as u32 + i,
        t_us: u64::MAX - u64::from((MAX_BATCH as u32 - i) * 65_535),
        counts: (0..encoders).map(|_| if i.is_multiple_of(2) { i32::MIN } else { 0 }).collect(),
        lvdt: LvdtReading { code: if i.is_multiple_of(2) { u16::MAX } else { 0 }, saturated: true },
    };
    let mut batch = SampleBatch::new(sample(0));
    for i in 1..MAX_BATCH as u32 {
        assert!(batch.push(&sample(i - 1), &sample(i)), "the worst sample does not fit into its batch");
    }
    let sent: Vec<_> = (0..MAX_BATCH as u32).map(sample).collect();
    assert_eq!(batch.samples().collect::<Vec<_>>(), sent);
    batch
}

#[test]
fn the_worst_batch_of_samples_of_the_board_fits_into_a_frame() {
    let message = streamed(Event::Samples(worst_batch(ballbar_firmware::ENCODERS)));
    insta::assert_snapshot!(payload_bytes(&message), @"791");
    let mut buffer = [0; MAX_FRAME];
    let bytes_per_sample = encode(&message, &mut buffer).unwrap().len() as f64 / MAX_BATCH as f64;
    assert!(bytes_per_sample * 1_000.0 < LINK_BYTES_PER_S / 2.0, "even so it takes less than half of the link at 1 kHz");
}

#[test]
fn the_worst_batch_of_as_many_encoders_as_there_may_be_fits_into_a_frame() {
    payload_bytes(&streamed(Event::Samples(worst_batch(ballbar::MAX_JOINTS))));
}

#[test]
fn the_longest_batch_of_poses_fits_into_a_frame() {
    let pose = ToolPose { position_m: [-1.0; 3], x_axis: [-1.0; 3], y_axis: [-1.0; 3] };
    let streamed_pose = StreamedPose { dt_us: u32::MAX, pose, displacement_m: Some(-1.0) };
    let poses = core::iter::repeat_n(streamed_pose, MAX_POSE_BATCH).collect();
    let bytes = payload_bytes(&streamed(Event::Poses(PoseBatch { index: u32::MAX, stride: u16::MAX, t_us: u64::MAX, poses })));
    insta::assert_snapshot!(bytes, @"405");
}

#[test]
fn the_longest_settled_pose_fits_into_a_frame() {
    let pose = SettledPose {
        index: u32::MAX,
        t_us: u64::MAX,
        duration_us: u32::MAX,
        samples: u32::MAX,
        counts_mean: [-1.0; 8].into(),
        counts_std: [1.0; 8].into(),
        code_mean: 1.0,
        code_std: 1.0,
    };
    insta::assert_snapshot!(payload_bytes(&streamed(Event::Settled(pose))), @"153");
}

#[test]
fn the_longest_parameters_fit_into_a_frame_in_both_directions() {
    let set = parameter_sets::largest();
    let up = ToBoard::Request(Request { id: u16::MAX, command: Command::WriteParameters(set.clone()) });
    insta::assert_snapshot!(payload_bytes(&up), @"830");
    payload_bytes(&reply(Answer::Parameters(set)));
}

#[test]
fn the_longest_status_fits_into_a_frame() {
    let encoder = EncoderStatus { counts: i32::MIN, is_homed: true, index_pulses: u32::MAX, index_errors: u32::MAX };
    let link = LinkCounts { good: u32::MAX, crc: u32::MAX, malformed: u32::MAX, missing: u32::MAX };
    let status = Status {
        uptime_us: u64::MAX,
        rate_hz: u16::MAX,
        streaming: Some(StreamSelection { samples: true, settled: true, poses: true }),
        samples: u32::MAX,
        overruns: u32::MAX,
        stream_messages: u32::MAX,
        dropped: u32::MAX,
        link,
        encoders: [encoder; 8].into(),
        lvdt: LvdtReading { code: u16::MAX, saturated: true },
        lvdt_faults: u32::MAX,
        stillness: Stillness::Settled,
        criteria: StillnessCriteria { hold_us: u32::MAX, band_counts: u16::MAX, band_codes: u16::MAX },
        active: Some(longest_identity()),
        staged: Some(u32::MAX),
        slots: [SlotState::Good { sequence: u32::MAX, crc: u32::MAX }; 2],
        stack_unused_bytes: u32::MAX,
        previous: Some(longest_identity()),
    };
    insta::assert_snapshot!(payload_bytes(&reply(Answer::Status(status))), @"338");
}

#[test]
fn a_hello_with_the_longest_last_words_fits_into_a_frame() {
    let hello = BoardHello {
        version: ProtocolVersion { number: u16::MAX, schema: [0xff; 8] },
        firmware: "v".repeat(16).as_str().try_into().unwrap(),
        board: "b".repeat(16).as_str().try_into().unwrap(),
        unique_id: [0xff; 12],
        encoders: u8::MAX,
        rate_min_hz: u16::MAX,
        rate_max_hz: u16::MAX,
        encoder_skew_ns: u32::MAX,
        lvdt_delay_ns: u32::MAX,
        uptime_us: u64::MAX,
        reset: ResetReason::Panic("p".repeat(96).as_str().try_into().unwrap()),
        active: Some(longest_identity()),
    };
    insta::assert_snapshot!(payload_bytes(&ToHost::Hello(hello)), @"229");
}

fn longest_identity() -> SetIdentity {
    let name = "n".repeat(32).as_str().try_into().unwrap();
    SetIdentity { name, is_calibrated: true, joints: u8::MAX, sequence: u32::MAX, crc: u32::MAX }
}

/// Bytes a second that the link carries.
const LINK_BYTES_PER_S: f64 = 92_160.0;

/// Samples of an arm whose joints all swing at once by about a radian, at up to 1.6 rad and some 20,000 counts a second, while the
/// LVDT's code sweeps over its range with eight codes of noise.
fn moving_arm(rate_hz: u32) -> impl Iterator<Item = Sample> {
    const AMPLITUDES: [f64; 6] = [9_000.0, 13_000.0, 8_000.0, 12_000.0, 11_000.0, 12_000.0];
    (0..60 * rate_hz).map(move |i| {
        let t_s = f64::from(i) / f64::from(rate_hz);
        let position = |(joint, amplitude): (usize, f64)| (amplitude * (1.6 * t_s + joint as f64).sin()) as i32;
        let noise = (i.wrapping_mul(2_654_435_761) >> 28) as f64 - 8.0;
        Sample {
            index: i,
            t_us: u64::from(i) * 1_000_000 / u64::from(rate_hz),
            counts: AMPLITUDES.into_iter().enumerate().map(position).collect(),
            lvdt: LvdtReading { code: (32_768.0 + 20_000.0 * (0.9 * t_s).sin() + noise) as u16, saturated: false },
        }
    })
}

/// Frames' bytes a sample, and samples.
fn bytes_per_sample(samples: impl Iterator<Item = Sample>) -> f64 {
    let (mut bytes, mut count, mut sequence) = (0, 0, 0);
    let mut send = |batch: SampleBatch| {
        let message = ToHost::Stream(Stream { sequence, dropped: 0, overruns: 0, homed: 0x3f, event: Event::Samples(batch) });
        sequence += 1;
        bytes += encode(&message, &mut [0; MAX_FRAME]).unwrap().len();
    };
    let (mut batch, mut last): (Option<SampleBatch>, _) = (None, Sample::default());
    for sample in samples {
        count += 1;
        match &mut batch {
            Some(batch) => assert!(batch.push(&last, &sample)),
            None => batch = Some(SampleBatch::new(sample.clone())),
        }
        if let Some(full) = batch.take_if(|batch| batch.len() == MAX_BATCH) {
            send(full);
        }
        last = sample;
    }
    batch.into_iter().for_each(&mut send);
    f64::from(bytes as u32) / f64::from(count)
}

#[test]
fn the_stream_of_a_moving_arm_at_1_khz_takes_less_than_half_of_the_link() {
    let bytes = bytes_per_sample(moving_arm(1_000));
    assert!(bytes * 1_000.0 < LINK_BYTES_PER_S / 2.0, "{bytes} bytes a sample");
    insta::assert_snapshot!(format!("{bytes:.2} bytes a sample, {:.1} % of the link", bytes * 1e5 / LINK_BYTES_PER_S), @"12.44 bytes a sample, 13.5 % of the link");
}

#[test]
fn the_stream_of_a_moving_arm_at_5_khz_takes_less_than_the_link() {
    let bytes = bytes_per_sample(moving_arm(5_000));
    assert!(bytes * 5_000.0 < LINK_BYTES_PER_S, "{bytes} bytes a sample");
    insta::assert_snapshot!(format!("{bytes:.2} bytes a sample, {:.1} % of the link", bytes * 5e5 / LINK_BYTES_PER_S), @"12.45 bytes a sample, 67.6 % of the link");
}
