//! The slow side: what the main loop does.

use ballbar::wire::{BoardHello, FrameReader, MAX_FRAME, PROTOCOL, ResetReason, ToBoard, ToHost, decode, encode, hello_version};
use embedded_hal::digital::OutputPin;
use embedded_io::{Read, ReadReady, Write};
use heapless::String;
use heapless::spsc::Consumer;

use crate::conversation::Conversation;
use crate::hardware::Hardware;
use crate::log::info;
use crate::outbox::Outbox;
use crate::parameters::Parameters;
use crate::sensors::Sensors;
use crate::streamer::Streamer;
use crate::{ENCODERS, LatchedSample, RATE_DEFAULT_HZ, RATE_MAX_HZ, RATE_MIN_HZ};

/// The board: takes samples from the interrupt and commands from the link, and streams.
pub struct Board<'q, H> {
    pub(crate) hardware: H,
    queue: Consumer<'q, LatchedSample>,
    pub(crate) sensors: Sensors,
    pub(crate) streamer: Streamer,
    pub(crate) parameters: Parameters,
    pub(crate) outbox: Outbox,
    pub(crate) frames: FrameReader,
    pub(crate) conversation: Conversation,
    pub(crate) rate_hz: u16,
    reset_reason: ResetReason,
    has_loaded: bool,
    /// When a reset that was asked for is due, microseconds since start.
    pub(crate) reset_at_us: Option<u64>,
}

/// Bytes that are taken from the link at once.
const READ_BYTES: usize = 64;
/// Blinks of the lamp, microseconds: it is on through the first part of the period.
const READY_BLINK_US: (u64, u64) = (100_000, 1_000_000);
const NO_PARAMETERS_BLINK_US: (u64, u64) = (100_000, 250_000);

impl<'q, H: Hardware> Board<'q, H> {
    /// Begins to sample at [`RATE_DEFAULT_HZ`]; the first round takes up the parameters in flash. `queue` is the other end of the
    /// sampler's.
    pub fn new(mut hardware: H, queue: Consumer<'q, LatchedSample>, reset_reason: ResetReason) -> Self {
        hardware.set_rate_hz(RATE_DEFAULT_HZ);
        info!("started");
        Self {
            hardware,
            queue,
            sensors: Sensors::new(),
            streamer: Streamer::new(),
            parameters: Parameters::none(),
            outbox: Outbox::new(),
            frames: FrameReader::new(),
            conversation: Conversation::default(),
            rate_hz: RATE_DEFAULT_HZ,
            reset_reason,
            has_loaded: false,
            reset_at_us: None,
        }
    }

    /// One round of the main loop; never blocks. To be called after every sampling interrupt, and after bytes from the link.
    pub fn poll(&mut self) {
        if !self.has_loaded {
            self.load_parameters();
        }
        self.take_samples();
        self.read_link();
        self.outbox.drain(self.hardware.link());
        self.reset_when_due();
    }

    /// Not while the board is made: who makes it holds all of it on the stack, and reading flash takes 6 KiB besides.
    #[inline(never)]
    fn load_parameters(&mut self) {
        self.parameters = Parameters::load(self.hardware.flash());
        if let Some(active) = self.parameters.active() {
            self.sensors.configure(active);
        }
        self.has_loaded = true;
    }

    /// The hardware, for a simulation that moves it between rounds.
    pub fn hardware_mut(&mut self) -> &mut H {
        &mut self.hardware
    }

    /// As many as the queue holds at most: a main loop that is always behind must still come to the link.
    fn take_samples(&mut self) {
        for _ in 0..self.queue.capacity() {
            let Some(latched) = self.queue.dequeue() else { return };
            self.take_sample(&latched);
        }
    }

    fn take_sample(&mut self, latched: &LatchedSample) {
        let settled = self.sensors.take(latched);
        self.streamer.take(settled, self.parameters.active(), &self.sensors, &mut self.outbox);
        // Fed by samples, so that the watchdog guards the interrupt as well as the main loop.
        self.hardware.feed_watchdog();
        self.light_lamp(latched.t_us);
    }

    fn light_lamp(&mut self, t_us: u64) {
        let shines = |(on, period): (u64, u64)| t_us % period < on;
        let on = match (self.streamer.selection(), self.parameters.active()) {
            (Some(_), _) => true,
            (None, Some(_)) => shines(READY_BLINK_US),
            (None, None) => shines(NO_PARAMETERS_BLINK_US),
        };
        // A lamp that cannot be lit is no reason to stop.
        let _ = self.hardware.lamp().set_state(on.into());
    }

    fn read_link(&mut self) {
        let mut bytes = [0; READ_BYTES];
        while matches!(self.hardware.link().read_ready(), Ok(true)) {
            let Ok(count @ 1..) = self.hardware.link().read(&mut bytes) else { return };
            for &byte in &bytes[..count] {
                self.take_byte(byte);
            }
            // A row of requests without an end does not keep the samples waiting.
            self.take_samples();
        }
    }

    fn take_byte(&mut self, byte: u8) {
        // Damaged frames are counted by the reader.
        let Some(Ok(payload)) = self.frames.push(byte) else { return };
        if let Some(version) = hello_version(payload) {
            self.conversation.greet(version == PROTOCOL);
            let hello = ToHost::Hello(self.hello());
            self.answer(&hello);
            return;
        }
        let reply = match decode(payload) {
            Some(ToBoard::Request(request)) => self.request(&request),
            _ => self.conversation.not_understood(payload),
        };
        self.answer(&ToHost::Reply(reply));
    }

    /// A reply for which there is no room is lost; the host asks again under the same number. Not inlined, so that the frame does
    /// not lie on the stack while the reply is made.
    #[inline(never)]
    fn answer(&mut self, message: &ToHost) {
        let mut buffer = [0; MAX_FRAME];
        if let Ok(frame) = encode(message, &mut buffer) {
            let _ = self.outbox.push_reply(frame);
        }
    }

    fn hello(&self) -> BoardHello {
        let facts = self.hardware.facts();
        BoardHello {
            version: PROTOCOL,
            firmware: String::try_from(env!("CARGO_PKG_VERSION")).unwrap_or_default(),
            board: String::try_from(facts.name).unwrap_or_default(),
            unique_id: facts.unique_id,
            encoders: ENCODERS as u8,
            rate_min_hz: RATE_MIN_HZ,
            rate_max_hz: RATE_MAX_HZ,
            encoder_skew_ns: facts.encoder_skew_ns,
            lvdt_delay_ns: facts.lvdt_delay_ns,
            uptime_us: self.uptime_us(),
            reset: self.reset_reason.clone(),
            active: self.parameters.identity().cloned(),
        }
    }

    pub(crate) fn uptime_us(&self) -> u64 {
        self.sensors.latest().map_or(0, |sample| sample.t_us)
    }

    fn reset_when_due(&mut self) {
        if self.reset_at_us.is_some_and(|at_us| self.uptime_us() >= at_us) && self.outbox.is_empty() {
            self.reset_at_us = None;
            // The answer may still be on its way behind the outbox.
            let _ = self.hardware.link().flush();
            self.hardware.reset();
        }
    }
}
