//! The whole firmware on hardware that does what a test says, tick by tick, and the host's end of its link.

use ballbar::wire::{
    Answer, BoardHello, Command, FrameReader, HostHello, MAX_FRAME, PROTOCOL, ParameterSet, Refusal, Reply, Request, ResetReason,
    Status, Stream, ToBoard, ToHost, decode, encode,
};
use ballbar::{LvdtReading, Sample};
use ballbar_firmware::{Board, ENCODERS, ParameterFlash, SampleQueue, Sampler};

use crate::fake_hardware::{FakeAdc, FakeClock, FakeEncoders, FakeMachine, Memory, empty_memory};
use crate::raw_payload::RawPayload;

/// A board and the host's end of its link.
pub struct FakeBoard<F: ParameterFlash> {
    sampler: Sampler<'static, FakeEncoders, FakeAdc, FakeClock>,
    board: Board<'static, FakeMachine<F>>,
    reader: FrameReader,
    /// Bytes of the wire that were read.
    read: usize,
    start: [i64; ENCODERS],
    /// Every sample as it was fed to the sampling interrupt.
    pub fed: Vec<Sample>,
    /// The number of the last request.
    pub last_id: u16,
    /// Stream messages that came, but for those that a test took.
    pub streamed: Vec<Stream>,
}

impl FakeBoard<Memory> {
    /// A board on erased memory that has just started.
    pub fn new() -> Self {
        Self::on(empty_memory())
    }
}

impl Default for FakeBoard<Memory> {
    fn default() -> Self {
        Self::new()
    }
}

impl<F: ParameterFlash> FakeBoard<F> {
    /// A board on this flash that has just started: the encoders at zero, the LVDT in the middle.
    pub fn on(flash: F) -> Self {
        Self::starting_at(FakeEncoders::default(), flash)
    }

    /// A board that finds the encoders' counters so when it starts.
    pub fn starting_at(encoders: FakeEncoders, flash: F) -> Self {
        // Sampler and board borrow their queue for ever, as the firmware's do.
        let (producer, consumer) = Box::leak(Box::new(SampleQueue::new())).split();
        let machine = FakeMachine::with(flash);
        Self {
            start: encoders.positions,
            fed: Vec::new(),
            sampler: Sampler::new(encoders, FakeAdc::default(), FakeClock::default(), producer),
            board: Board::new(machine, consumer, ResetReason::PowerOn),
            reader: FrameReader::new(),
            read: 0,
            last_id: 0,
            streamed: Vec::new(),
        }
    }

    /// What the encoders count.
    pub fn encoders(&mut self) -> &mut FakeEncoders {
        self.sampler.parts_mut().0
    }

    /// The LVDT's converter.
    pub fn adc(&mut self) -> &mut FakeAdc {
        self.sampler.parts_mut().1
    }

    /// The clock.
    pub fn clock(&mut self) -> &mut FakeClock {
        self.sampler.parts_mut().2
    }

    /// The rest of the hardware.
    pub fn machine(&mut self) -> &mut FakeMachine<F> {
        self.board.hardware_mut()
    }

    /// The sampling interrupt alone, one period after the last.
    pub fn sample(&mut self) {
        let period_us = 1_000_000 / u64::from(self.machine().rate_hz);
        self.clock().now_us += period_us;
        self.record();
        self.sampler.tick();
        self.machine().link.carry(period_us);
    }

    fn record(&mut self) {
        let (index, start) = (self.fed.len() as u32, self.start);
        let (encoders, adc, clock) = self.sampler.parts_mut();
        let count = |(position, start): (&i64, &i64)| (position - start) as i32;
        let saturated = adc.is_stuck || adc.input.saturated;
        let code = if adc.is_stuck { 0 } else { adc.input.code };
        self.fed.push(Sample {
            index,
            t_us: clock.now_us,
            counts: encoders.positions.iter().zip(&start).map(count).collect(),
            lvdt: LvdtReading { code, saturated },
        });
    }

    /// The main loop alone, once.
    pub fn poll(&mut self) {
        self.board.poll();
    }

    /// A sampling interrupt and the main loop behind it, so many times.
    pub fn run(&mut self, ticks: usize) {
        for _ in 0..ticks {
            self.sample();
            self.poll();
        }
    }

    /// Sends a message.
    pub fn send(&mut self, message: &ToBoard) {
        let mut buffer = [0; MAX_FRAME];
        let frame = encode(message, &mut buffer).unwrap();
        self.machine().link.to_board.extend(frame);
    }

    /// Sends these bytes in a frame that is whole.
    pub fn send_payload(&mut self, payload: &[u8]) {
        let mut buffer = [0; MAX_FRAME];
        let frame = encode(&RawPayload(payload), &mut buffer).unwrap();
        self.machine().link.to_board.extend(frame);
    }

    /// Says hello with the right version.
    pub fn send_hello(&mut self) {
        self.send(&ToBoard::Hello(HostHello { version: PROTOCOL }));
    }

    /// Everything that arrived since the last call; a frame that is no message fails the test.
    pub fn receive(&mut self) -> Vec<ToHost> {
        let bytes = self.board.hardware_mut().link.on_the_wire[self.read..].to_vec();
        self.read += bytes.len();
        let mut messages = Vec::new();
        for byte in bytes {
            if let Some(payload) = self.reader.push(byte) {
                messages.push(decode(payload.expect("a damaged frame from the board")).expect("no message of the board"));
            }
        }
        messages
    }

    /// Runs until a message that is no stream's comes, at most three seconds. Those of the stream are put aside.
    pub fn next_answer(&mut self) -> Option<ToHost> {
        for _ in 0..3 * u32::from(self.machine().rate_hz) {
            self.run(1);
            let mut answer = None;
            for message in self.receive() {
                match message {
                    ToHost::Stream(stream) => self.streamed.push(stream),
                    other => assert!(answer.replace(other).is_none(), "two answers at once"),
                }
            }
            if answer.is_some() {
                return answer;
            }
        }
        None
    }

    /// Says hello and waits for the answer.
    pub fn greet(&mut self) -> BoardHello {
        self.send_hello();
        match self.next_answer() {
            Some(ToHost::Hello(hello)) => hello,
            other => panic!("no hello, but {other:?}"),
        }
    }

    /// Sends a request under this number and waits for its reply.
    pub fn ask_as(&mut self, id: u16, command: Command) -> Result<Answer, Refusal> {
        self.last_id = id;
        self.send(&ToBoard::Request(Request { id, command }));
        match self.next_answer() {
            Some(ToHost::Reply(Reply { id: found, outcome })) if found == id => outcome,
            other => panic!("no reply to {id}, but {other:?}"),
        }
    }

    /// Sends a request under the next number and waits for its reply.
    pub fn ask(&mut self, command: Command) -> Result<Answer, Refusal> {
        self.ask_as(self.last_id.wrapping_add(1), command)
    }

    /// Stream messages that have come.
    pub fn take_streamed(&mut self) -> Vec<Stream> {
        for message in self.receive() {
            match message {
                ToHost::Stream(stream) => self.streamed.push(stream),
                other => panic!("nobody asked for {other:?}"),
            }
        }
        std::mem::take(&mut self.streamed)
    }

    /// Says hello, and stands still until the board believes it.
    pub fn settle_in(mut self) -> Self {
        self.greet();
        self.run(300);
        self
    }

    /// Sends a hello and a request, and waits for the reply while the sampling interrupt never comes.
    pub fn ask_before_any_sample(&mut self, command: Command) -> Result<Answer, Refusal> {
        self.send_hello();
        self.send(&ToBoard::Request(Request { id: 1, command }));
        self.poll();
        self.machine().link.carry(1_000_000);
        match self.receive().pop() {
            Some(ToHost::Reply(reply)) => reply.outcome,
            other => panic!("no reply, but {other:?}"),
        }
    }

    /// Writes and commits a set.
    pub fn commit(&mut self, set: &ParameterSet) -> Result<Answer, Refusal> {
        match self.ask(Command::WriteParameters(set.clone()))? {
            Answer::Staged { crc } => self.ask(Command::Commit { crc }),
            other => panic!("not staged, but {other:?}"),
        }
    }

    /// The board's status.
    pub fn status(&mut self) -> Status {
        match self.ask(Command::Status) {
            Ok(Answer::Status(status)) => status,
            other => panic!("no status, but {other:?}"),
        }
    }
}
