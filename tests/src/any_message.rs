//! Arbitrary messages of both directions, for properties.

use ballbar::wire::{
    Answer, BoardHello, Check, CheckResult, Command, CurrentPose, EncoderStatus, Event, HostHello, LinkCounts, LogMark,
    MAX_BATCH, MAX_POSE_BATCH, ParameterSet, ParameterSetError, PoseBatch, ProtocolVersion, Refusal, Reply, Request, ResetReason,
    SampleBatch, SampleStep, SelfTest, SetIdentity, SlotState, Status, Stream, StreamSelection, StreamedPose, ToBoard, ToHost,
    ToolPose, WhichSet,
};
use ballbar::{
    Approach, Counts, Coupling, Direction, Encoder, EncoderError, JointKind, LvdtCurve, LvdtReading, Sample, SettledPose,
    Stillness, StillnessCriteria,
};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;

type Of<T> = BoxedStrategy<T>;

/// Any message to the board.
pub fn to_board() -> Of<ToBoard> {
    let hello = version().prop_map(|version| ToBoard::Hello(HostHello { version }));
    let request = (any::<u16>(), command()).prop_map(|(id, command)| ToBoard::Request(Request { id, command }));
    prop_oneof![1 => hello, 9 => request].boxed()
}

/// Any message to the host.
pub fn to_host() -> Of<ToHost> {
    let reply = (any::<u16>(), outcome()).prop_map(|(id, outcome)| ToHost::Reply(Reply { id, outcome }));
    prop_oneof![
        1 => board_hello().prop_map(ToHost::Hello),
        4 => reply,
        4 => stream().prop_map(ToHost::Stream),
        1 => mark().prop_map(ToHost::Mark),
    ]
    .boxed()
}

/// Any command.
pub fn command() -> Of<Command> {
    prop_oneof![
        Just(Command::Status),
        Just(Command::SelfTest),
        selection().prop_map(Command::StartStream),
        Just(Command::StopStream),
        any::<u16>().prop_map(|rate_hz| Command::SetRate { rate_hz }),
        criteria().prop_map(Command::SetStillness),
        (any::<u8>(), any::<i32>()).prop_map(|(joint, counts)| Command::PresetEncoder { joint, counts }),
        curve().prop_map(Command::SetLvdt),
        parameters().prop_map(Command::WriteParameters),
        which().prop_map(Command::ReadParameters),
        any::<u32>().prop_map(|crc| Command::Commit { crc }),
        Just(Command::Discard),
        Just(Command::CurrentPose),
        (which(), few(any::<f32>()), approach()).prop_map(|(set, q, approach)| Command::ForwardKinematics { set, q, approach }),
        Just(Command::Reset),
        Just(Command::ReadPrevious),
    ]
    .boxed()
}

fn mark() -> Of<LogMark> {
    prop_oneof![
        any::<u64>().prop_map(|unix_ms| LogMark::Opened { unix_ms }),
        any::<u64>().prop_map(|unix_ms| LogMark::Lost { unix_ms }),
        any::<u64>().prop_map(|unix_ms| LogMark::Back { unix_ms }),
    ]
    .boxed()
}

fn outcome() -> Of<Result<Answer, Refusal>> {
    let refusals = prop_oneof![
        Just(Refusal::HelloFirst),
        Just(Refusal::NotUnderstood),
        any::<(u16, u16)>().prop_map(|(min_hz, max_hz)| Refusal::Rate { min_hz, max_hz }),
        any::<u8>().prop_map(|joints| Refusal::Joint { joints }),
        any::<u8>().prop_map(|index| Refusal::Parameters(ParameterSetError::NotFinite { index })),
        any::<u8>().prop_map(|joint| Refusal::Parameters(ParameterSetError::Encoders(EncoderError::Coupling { joint }))),
        any::<(u8, u8)>().prop_map(|(joints, encoders)| Refusal::TooManyJoints { joints, encoders }),
        any::<u32>().prop_map(|staged| Refusal::OtherCrc { staged }),
        any::<u8>().prop_map(|longest| Refusal::Parameters(ParameterSetError::Reach { longest })),
        Just(Refusal::NoSample),
        Just(Refusal::NoPrevious),
    ];
    let current = (any::<u64>(), any::<u8>(), few(any::<f32>()), approach(), pose(), option::of(any::<f32>())).prop_map(
        |(t_us, homed, q, approach, pose, displacement_m)| CurrentPose { t_us, homed, q, approach, pose, displacement_m },
    );
    let answers = prop_oneof![
        Just(Answer::Done),
        status().prop_map(Answer::Status),
        vec(any::<bool>(), 0..=8).prop_map(self_test).prop_map(Answer::SelfTest),
        parameters().prop_map(Answer::Parameters),
        any::<u32>().prop_map(|crc| Answer::Staged { crc }),
        current.prop_map(Answer::CurrentPose),
        pose().prop_map(Answer::Pose),
    ];
    prop_oneof![answers.prop_map(Ok), refusals.prop_map(Err)].boxed()
}

fn self_test(passed: Vec<bool>) -> SelfTest {
    const CHECKS: [Check; 8] = [
        Check::Sampling,
        Check::Overruns,
        Check::LvdtSignal,
        Check::Index,
        Check::Parameters,
        Check::Slots,
        Check::Kinematics,
        Check::Stack,
    ];
    SelfTest { results: CHECKS.into_iter().zip(passed).map(|(check, passed)| CheckResult { check, passed }).collect() }
}

fn board_hello() -> Of<BoardHello> {
    let reset = prop_oneof![
        Just(ResetReason::PowerOn),
        Just(ResetReason::Watchdog),
        text(96).prop_map(|said| ResetReason::Panic(said.as_str().try_into().unwrap())),
    ];
    let words = (text(16), text(16), any::<[u8; 12]>(), any::<(u8, u16, u16, u32, u32, u64)>());
    (version(), words, reset, option::of(identity()))
        .prop_map(|(version, (firmware, board, unique_id, numbers), reset, active)| BoardHello {
            version,
            firmware: firmware.as_str().try_into().unwrap(),
            board: board.as_str().try_into().unwrap(),
            unique_id,
            encoders: numbers.0,
            rate_min_hz: numbers.1,
            rate_max_hz: numbers.2,
            encoder_skew_ns: numbers.3,
            lvdt_delay_ns: numbers.4,
            uptime_us: numbers.5,
            reset,
            active,
        })
        .boxed()
}

fn status() -> Of<Status> {
    let slot = || {
        prop_oneof![
            Just(SlotState::Empty),
            Just(SlotState::Damaged),
            any::<(u32, u32)>().prop_map(|(sequence, crc)| SlotState::Good { sequence, crc }),
        ]
    };
    let encoder = any::<(i32, bool, u32, u32)>().prop_map(|(counts, is_homed, index_pulses, index_errors)| EncoderStatus {
        counts,
        is_homed,
        index_pulses,
        index_errors,
    });
    let channels = (few(encoder), reading(), criteria(), option::of(identity()), [slot(), slot()]);
    let sets = (option::of(any::<u32>()), option::of(identity()));
    (any::<(u64, u16, [u32; 8])>(), option::of(selection()), channels, sets)
        .prop_map(|((uptime_us, rate_hz, n), streaming, (encoders, lvdt, criteria, active, slots), (staged, previous))| Status {
            uptime_us,
            rate_hz,
            streaming,
            samples: n[0],
            overruns: n[1],
            stream_messages: n[2],
            dropped: n[3],
            link: LinkCounts { good: n[4], crc: n[5], malformed: n[6], missing: n[7] },
            encoders,
            lvdt,
            lvdt_faults: n[0] ^ n[7],
            stillness: [Stillness::Moving, Stillness::Settling, Stillness::Settled][n[0] as usize % 3],
            criteria,
            active,
            staged,
            slots,
            stack_unused_bytes: n[1] ^ n[6],
            previous,
        })
        .boxed()
}

fn stream() -> Of<Stream> {
    let event =
        prop_oneof![samples().prop_map(Event::Samples), settled().prop_map(Event::Settled), poses().prop_map(Event::Poses),];
    (any::<(u32, u32, u32, u8)>(), event)
        .prop_map(|((sequence, dropped, overruns, homed), event)| Stream { sequence, dropped, overruns, homed, event })
        .boxed()
}

fn samples() -> Of<SampleBatch> {
    let step = (any::<(u16, i32, bool)>(), few(any::<i32>())).prop_map(|((dt_us, code, saturated), counts)| SampleStep {
        dt_us,
        counts,
        code,
        saturated,
    });
    (sample(), vec(step, 0..MAX_BATCH / 2)).prop_map(|(first, rest)| SampleBatch { first, rest: bounded(rest) }).boxed()
}

/// Any sample of so many encoders as it likes.
pub fn sample() -> Of<Sample> {
    (any::<(u32, u64)>(), few(any::<i32>()), reading())
        .prop_map(|((index, t_us), counts, lvdt): (_, Counts, _)| Sample { index, t_us, counts, lvdt })
        .boxed()
}

fn settled() -> Of<SettledPose> {
    (any::<(u32, u64, u32, u32)>(), few(any::<f64>()), few(any::<f32>()), any::<(f64, f32)>())
        .prop_map(|((index, t_us, duration_us, samples), counts_mean, counts_std, (code_mean, code_std))| SettledPose {
            index,
            t_us,
            duration_us,
            samples,
            counts_mean,
            counts_std,
            code_mean,
            code_std,
        })
        .boxed()
}

fn poses() -> Of<PoseBatch> {
    let streamed = (any::<u32>(), pose(), option::of(any::<f32>())).prop_map(|(dt_us, pose, displacement_m)| StreamedPose {
        dt_us,
        pose,
        displacement_m,
    });
    (any::<(u32, u16, u64)>(), vec(streamed, 0..=MAX_POSE_BATCH))
        .prop_map(|((index, stride, t_us), poses)| PoseBatch { index, stride, t_us, poses: bounded(poses) })
        .boxed()
}

fn parameters() -> Of<ParameterSet> {
    let kind = prop_oneof![Just(JointKind::Revolute), Just(JointKind::Prismatic)];
    let encoder =
        any::<(f32, u32)>().prop_map(|(counts_per_unit, counts_per_index)| Encoder { counts_per_unit, counts_per_index });
    let coupling = any::<(u8, u8, f32)>().prop_map(|(joint, driven_by, ratio)| Coupling { joint, driven_by, ratio });
    (
        text(32),
        any::<bool>(),
        few(kind),
        vec(any::<f32>(), 0..=70),
        few(encoder),
        few(coupling),
        curve(),
        vec(any::<f32>(), 0..=87),
    )
        .prop_map(|(name, is_calibrated, kinds, parameters, encoders, couplings, lvdt, terms)| ParameterSet {
            name: name.as_str().try_into().unwrap(),
            is_calibrated,
            kinds,
            parameters: bounded(parameters),
            encoders,
            couplings,
            lvdt,
            terms: bounded(terms),
        })
        .boxed()
}

fn approach() -> Of<Approach> {
    let way = prop_oneof![Just(None), Just(Some(Direction::Rising)), Just(Some(Direction::Falling))];
    vec(way, 8)
        .prop_map(|ways| ways.into_iter().enumerate().fold(Approach::UNKNOWN, |approach, (i, way)| approach.with(i, way)))
        .boxed()
}

fn identity() -> Of<SetIdentity> {
    (text(32), any::<(bool, u8, u32, u32)>())
        .prop_map(|(name, (is_calibrated, joints, sequence, crc))| SetIdentity {
            name: name.as_str().try_into().unwrap(),
            is_calibrated,
            joints,
            sequence,
            crc,
        })
        .boxed()
}

fn version() -> Of<ProtocolVersion> {
    any::<(u16, [u8; 8])>().prop_map(|(number, schema)| ProtocolVersion { number, schema }).boxed()
}

fn selection() -> Of<StreamSelection> {
    any::<[bool; 3]>().prop_map(|[samples, settled, poses]| StreamSelection { samples, settled, poses }).boxed()
}

fn criteria() -> Of<StillnessCriteria> {
    any::<(u32, u16, u16)>()
        .prop_map(|(hold_us, band_counts, band_codes)| StillnessCriteria { hold_us, band_counts, band_codes })
        .boxed()
}

fn reading() -> Of<LvdtReading> {
    any::<(u16, bool)>().prop_map(|(code, saturated)| LvdtReading { code, saturated }).boxed()
}

fn curve() -> Of<LvdtCurve> {
    any::<(u16, u16, [f32; 6])>()
        .prop_map(|(code_min, code_max, coefficients_m)| LvdtCurve { code_min, code_max, coefficients_m })
        .boxed()
}

fn pose() -> Of<ToolPose> {
    any::<[[f32; 3]; 3]>().prop_map(|[position_m, x_axis, y_axis]| ToolPose { position_m, x_axis, y_axis }).boxed()
}

fn which() -> Of<WhichSet> {
    prop_oneof![Just(WhichSet::Active), Just(WhichSet::Staged)].boxed()
}

/// Text of at most so many bytes, some of them of characters that take several.
fn text(bytes: usize) -> Of<String> {
    vec(prop_oneof![Just('a'), Just('0'), Just('µ'), Just('骨')], 0..=bytes / 3).prop_map(String::from_iter).boxed()
}

/// Up to eight, as of joints.
fn few<T: std::fmt::Debug + 'static>(one: impl Strategy<Value = T> + 'static) -> Of<heapless::Vec<T, 8>> {
    vec(one, 0..=8).prop_map(bounded).boxed()
}

fn bounded<T, const N: usize>(many: Vec<T>) -> heapless::Vec<T, N> {
    many.into_iter().collect()
}
