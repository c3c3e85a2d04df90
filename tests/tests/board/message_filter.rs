//! What the host believes of what a board says: message by message.

use ballbar::wire::{
    Answer, BoardHello, Command, CurrentPose, EncoderStatus, Event, PROTOCOL, ParameterSet, PoseBatch, Reply, ResetReason,
    SampleBatch, SelfTest, Status, Stream, StreamedPose, ToHost, ToolPose,
};
use ballbar::{Approach, Counts, LvdtReading, Sample, SettledPose};
use ballbar_tests::fake_board::FakeBoard;
use ballbar_tests::parameter_sets::puma;
use host_cal::board::{Implausible, MessageFilter, StreamLosses};

mod spoilt;

const ENCODERS: usize = 6;

fn hello(uptime_us: u64) -> BoardHello {
    BoardHello {
        version: PROTOCOL,
        firmware: "0.9.1".try_into().unwrap(),
        board: "test".try_into().unwrap(),
        unique_id: [7; 12],
        encoders: ENCODERS as u8,
        rate_min_hz: 100,
        rate_max_hz: 5_000,
        encoder_skew_ns: 0,
        lvdt_delay_ns: 0,
        uptime_us,
        reset: ResetReason::PowerOn,
        active: None,
    }
}

/// A filter that a board has greeted.
fn greeted() -> MessageFilter {
    let mut filter = MessageFilter::default();
    filter.take(&ToHost::Hello(hello(0))).unwrap();
    filter
}

/// A board at 1,000 samples a second that streams what a test asks for.
#[derive(Clone)]
struct Board {
    sequence: u32,
    index: u32,
    t_us: u64,
}

impl Board {
    fn at(sequence: u32, index: u32, t_us: u64) -> Self {
        Self { sequence, index, t_us }
    }

    fn sample(&mut self) -> Sample {
        self.index = self.index.wrapping_add(1);
        self.t_us += 1_000;
        Sample {
            index: self.index,
            t_us: self.t_us,
            counts: Counts::from_slice(&[5; ENCODERS]).unwrap(),
            lvdt: LvdtReading { code: 30_000, saturated: false },
        }
    }

    fn message(&mut self, event: Event) -> Stream {
        self.sequence = self.sequence.wrapping_add(1);
        Stream { sequence: self.sequence, dropped: 0, overruns: 0, homed: 0x3f, event }
    }

    fn samples(&mut self) -> Stream {
        let mut last = self.sample();
        let mut batch = SampleBatch::new(last.clone());
        while batch.len() < 20 {
            let next = self.sample();
            assert!(batch.push(&last, &next));
            last = next;
        }
        self.message(Event::Samples(batch))
    }

    fn settled(&mut self) -> Stream {
        let first = self.sample();
        for _ in 0..499 {
            self.sample();
        }
        self.message(Event::Settled(SettledPose {
            index: first.index,
            t_us: first.t_us,
            duration_us: (self.t_us - first.t_us) as u32,
            samples: 500,
            counts_mean: [5.25; ENCODERS].into_iter().collect(),
            counts_std: [0.5; ENCODERS].into_iter().collect(),
            code_mean: 30_000.5,
            code_std: 2.0,
        }))
    }

    fn poses(&mut self) -> Stream {
        let first = self.sample();
        let pose = StreamedPose { dt_us: 0, pose: tool_pose(), displacement_m: Some(0.01) };
        let poses = (0..8).map(|i| StreamedPose { dt_us: 1_000 * i, ..pose }).collect();
        for _ in 1..8 {
            self.sample();
        }
        self.message(Event::Poses(PoseBatch { index: first.index, stride: 1, t_us: first.t_us, poses }))
    }

    /// One of each kind, in turn.
    fn nth(&mut self, n: usize) -> Stream {
        match n % 3 {
            0 => self.samples(),
            1 => self.settled(),
            _ => self.poses(),
        }
    }
}

fn tool_pose() -> ToolPose {
    ToolPose { position_m: [0.5, -0.25, 1.125], x_axis: [0.0, 1.0, 0.0], y_axis: [0.0, 0.0, 1.0] }
}

fn settled_of(stream: &mut Stream) -> &mut SettledPose {
    match &mut stream.event {
        Event::Settled(pose) => pose,
        other => panic!("not settled, but {other:?}"),
    }
}

fn samples_of(stream: &mut Stream) -> &mut SampleBatch {
    match &mut stream.event {
        Event::Samples(batch) => batch,
        other => panic!("no samples, but {other:?}"),
    }
}

fn poses_of(stream: &mut Stream) -> &mut PoseBatch {
    match &mut stream.event {
        Event::Poses(batch) => batch,
        other => panic!("no poses, but {other:?}"),
    }
}

fn take(filter: &mut MessageFilter, stream: &Stream) -> Result<(), Implausible> {
    filter.take(&ToHost::Stream(stream.clone()))
}

#[test]
fn what_a_board_streams_is_believed_also_where_its_counters_wrap() {
    for start in [Board::at(0, 0, 0), Board::at(u32::MAX - 40, u32::MAX - 3_000, 1 << 44)] {
        let (mut filter, mut board) = (greeted(), start);
        for n in 0..300 {
            assert_eq!(take(&mut filter, &board.nth(n)), Ok(()), "message {n}");
        }
        assert_eq!(filter.losses(), StreamLosses { messages: 300, ..StreamLosses::default() });
    }
}

#[test]
fn missing_dropped_and_overrun_are_counted_as_before() {
    let (mut filter, mut board) = (greeted(), Board::at(0, 0, 0));
    take(&mut filter, &board.samples()).unwrap();
    let mut dropped = 0;
    for _ in 0..5 {
        board.samples();
        dropped += 1;
    }
    board.samples();
    for _ in 0..30 {
        board.sample();
    }
    let mut next = board.samples();
    (next.dropped, next.overruns) = (dropped, 30);
    assert_eq!(take(&mut filter, &next), Ok(()));
    let losses = filter.losses();
    assert_eq!((losses.missing, losses.dropped_by_board, losses.lost_on_line, losses.overruns), (6, 5, 1, 30));
    assert_eq!(losses.lost(), 36);
}

#[test]
fn nothing_is_believed_twice_however_it_is_repeated() {
    let (mut filter, mut board) = (greeted(), Board::at(0, 0, 0));
    let told: Vec<Stream> = (0..60).map(|n| board.nth(n)).collect();
    for message in &told {
        take(&mut filter, message).unwrap();
    }
    // At once, again and again; one long past; a whole stretch, as of a buffer that is read twice.
    let last = told.last().unwrap().clone();
    let repeated: Vec<&Stream> = std::iter::repeat_n(&last, 50).chain([&told[4]]).chain(&told[10..50]).collect();
    for message in &repeated {
        assert_eq!(take(&mut filter, message), Err(Implausible::Repeated));
    }
    for n in 0..30 {
        assert_eq!(take(&mut filter, &board.nth(n)), Ok(()));
    }
    let losses = filter.losses();
    assert_eq!((losses.refused.repeated, losses.lost(), losses.messages), (repeated.len() as u64, 0, 90));
}

#[test]
fn a_board_that_was_started_again_unnoticed_is_believed_after_three_messages() {
    let (mut filter, mut board) = (greeted(), Board::at(9_000, 80_000, 80_000_000));
    for n in 0..30 {
        take(&mut filter, &board.nth(n)).unwrap();
    }
    let mut again = Board::at(0, 0, 0);
    let taken: Vec<bool> = (0..30).map(|n| take(&mut filter, &again.nth(n)).is_ok()).collect();
    assert_eq!(taken[..4], [false, false, true, true]);
    assert!(taken[2..].iter().all(|taken| *taken));
    let losses = filter.losses();
    assert_eq!((losses.missing, losses.lost(), losses.refused.went_back), (0, 2, 2), "{losses:?}");
}

#[test]
fn a_false_first_message_does_not_spoil_what_follows() {
    let spoils: [fn(&mut Stream); 2] = [
        |stream| stream.sequence = stream.sequence.wrapping_add(1 << 30),
        |stream| {
            let batch = samples_of(stream);
            batch.first.t_us += 1_000_000_000_000;
            batch.first.index = batch.first.index.wrapping_add(1 << 30);
        },
    ];
    for spoil in spoils {
        let (mut filter, mut board) = (greeted(), Board::at(5, 40, 40_000));
        let mut first = board.samples();
        spoil(&mut first);
        let _ = take(&mut filter, &first);
        let refused = (0..30).filter(|_| take(&mut filter, &board.samples()).is_err()).count();
        assert!(refused <= 2, "{refused}");
        assert!(filter.losses().lost() <= 3, "{:?}", filter.losses());
    }
}

#[test]
fn a_new_segment_begins_with_other_numbers_and_nothing_is_lost_between() {
    let (mut filter, mut board) = (greeted(), Board::at(4_000_000_000, 80_000, 80_000_000));
    take(&mut filter, &board.samples()).unwrap();
    filter.begin_segment();
    filter.take(&ToHost::Hello(BoardHello { encoders: 4, ..hello(3) })).unwrap();
    let mut again = Board::at(0, 0, 0);
    let mut of_four = again.samples();
    let batch = samples_of(&mut of_four);
    batch.first.counts.truncate(4);
    batch.rest.iter_mut().for_each(|step| step.counts.truncate(4));
    assert_eq!(take(&mut filter, &of_four), Ok(()));
    assert!(take(&mut filter, &again.samples()).is_err(), "six encoders on a board of four");
    assert_eq!((filter.losses().messages, filter.losses().missing), (2, 0));
}

fn answer(answer: Answer) -> ToHost {
    ToHost::Reply(Reply { id: 3, outcome: Ok(answer) })
}

#[test]
fn hellos_and_answers_that_cannot_be_true_are_refused() {
    let mut board = FakeBoard::new().settle_in();
    board.commit(&puma()).unwrap();
    let greeting = board.greet();
    let status = board.status();
    let Ok(Answer::SelfTest(self_test)) = board.ask(Command::SelfTest) else { panic!("no self-test") };
    let sound = greeting.clone();

    let hellos: [fn(&mut BoardHello); 6] = [
        |hello| hello.encoders = 0,
        |hello| hello.encoders = 255,
        |hello| (hello.rate_min_hz, hello.rate_max_hz) = (u16::MAX, 0),
        |hello| hello.rate_min_hz = 0,
        |hello| hello.uptime_us = u64::MAX,
        |hello| hello.active.as_mut().unwrap().joints = 7,
    ];
    for (n, spoil) in hellos.iter().enumerate() {
        let mut hello = greeting.clone();
        spoil(&mut hello);
        assert!(MessageFilter::default().take(&ToHost::Hello(hello)).is_err(), "hello {n}");
    }

    let pose = CurrentPose {
        t_us: 5_000_000,
        homed: 0x3f,
        q: [0.25; 6].into_iter().collect(),
        approach: Approach::UNKNOWN,
        pose: tool_pose(),
        displacement_m: Some(0.01),
    };
    let with_pose = |change: fn(&mut CurrentPose)| {
        let mut pose = pose.clone();
        change(&mut pose);
        Answer::CurrentPose(pose)
    };
    let with_set = |change: fn(&mut ParameterSet)| {
        let mut set = puma();
        change(&mut set);
        Answer::Parameters(set)
    };
    let mut filter = MessageFilter::default();
    filter.take(&ToHost::Hello(sound)).unwrap();
    for good in [
        Answer::Status(status.clone()),
        Answer::SelfTest(self_test.clone()),
        Answer::CurrentPose(pose.clone()),
        Answer::Pose(pose.pose),
        Answer::Parameters(puma()),
    ] {
        assert_eq!(filter.take(&answer(good.clone())), Ok(()), "{good:?}");
    }
    let bad = [
        with_pose(|pose| pose.q.truncate(2)),
        with_pose(|pose| pose.q[4] = f32::NAN),
        with_pose(|pose| pose.pose.position_m[0] = f32::NAN),
        with_pose(|pose| pose.pose.position_m = [f32::MAX; 3]),
        with_pose(|pose| pose.pose.x_axis[2] = f32::INFINITY),
        with_pose(|pose| pose.pose.y_axis = pose.pose.x_axis),
        with_pose(|pose| pose.displacement_m = Some(f32::NAN)),
        with_pose(|pose| pose.t_us = u64::MAX),
        Answer::Pose(ToolPose { position_m: [f32::NEG_INFINITY, 0.0, 0.0], ..tool_pose() }),
        with_set(|set| set.parameters[8] = f32::NAN),
        with_set(|set| set.parameters.truncate(40)),
        with_set(|set| set.encoders[2].counts_per_unit = 0.0),
        with_set(|set| set.lvdt.coefficients_m[3] = f32::MAX),
        with_set(|set| set.lvdt.coefficients_m[0] = f32::NAN),
        Answer::Status(Status { uptime_us: 0, ..status.clone() }),
        Answer::Status(Status { rate_hz: 0, ..status.clone() }),
        Answer::Status(Status { encoders: [EncoderStatus::default(); 2].into_iter().collect(), ..status.clone() }),
        Answer::SelfTest(SelfTest { results: self_test.results.iter().take(3).copied().collect() }),
        Answer::SelfTest(SelfTest { results: heapless::Vec::new() }),
    ];
    for (n, bad) in bad.into_iter().enumerate() {
        assert!(filter.take(&answer(bad.clone())).is_err(), "answer {n}: {bad:?}");
    }
}
