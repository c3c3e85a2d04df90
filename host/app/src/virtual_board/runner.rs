//! The thread of a virtual board: moves time on, ticks the board, and carries bytes between it and the port.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use ballbar::wire::{Command, HostHello, MAX_FRAME, PROTOCOL, ProtocolVersion, Request, ResetReason, ToBoard, encode};
use ballbar_firmware::{Board, SampleQueue, Sampler};

use super::driver::Driven;
use super::machine::{BitErrors, Clock, Converter, Encoders, Machine};
use super::plant::{Plant, PlantState};
use super::pty::Pty;
use super::{Pace, Play};

/// Ticks between two looks at the port, as fast as possible.
const TICKS_PER_TURN: usize = 64;
/// As fast as possible, time stands still while more bytes than this wait for the host.
const BACKLOG_BYTES: usize = 4_096;
/// Time between two looks at the port at real pace, at most.
const TURN: Duration = Duration::from_millis(2);
/// A process that was held up for longer goes on from where it was, instead of catching up.
const LATEST: Duration = Duration::from_millis(200);

/// What the thread and the board's owner both see.
#[derive(Debug, Default)]
pub(super) struct Shared {
    pub(super) is_stopped: AtomicBool,
    /// How many scripts were over, each with all that was played before it.
    pub(super) scripts_done: AtomicU64,
    /// Whether the latest look found nothing on its way to the host.
    pub(super) is_drained: AtomicBool,
    /// The plant's time, nanoseconds.
    pub(super) now_ns: AtomicU64,
    pub(super) flips: Arc<AtomicU64>,
}

/// All but the board itself, which does not outlive a reset.
pub(super) struct Runner {
    pub(super) plant: Plant,
    pub(super) pty: Pty,
    pub(super) pace: Pace,
    pub(super) plays: Receiver<Play>,
    pub(super) shared: Arc<Shared>,
    /// Who drives the robot besides the scripts.
    pub(super) driven: Option<Driven>,
    /// Goes into the link once the board is ready.
    pub(super) bit_errors: Option<BitErrors>,
    /// A script that waits for the host to stream.
    held: Option<Play>,
    scripts_begun: u64,
    /// Time of the latest tick since the plant's start, nanoseconds.
    now_ns: u64,
    /// A moment of real pace: wall time and plant time.
    anchor: Option<(Instant, u64)>,
}

impl Runner {
    pub(super) fn new(plant: Plant, pty: Pty, pace: Pace, plays: Receiver<Play>, shared: Arc<Shared>) -> Self {
        Self {
            plant,
            pty,
            pace,
            plays,
            shared,
            driven: None,
            bit_errors: None,
            held: None,
            scripts_begun: 0,
            now_ns: 0,
            anchor: None,
        }
    }

    /// Runs the board until it is stopped, over any number of resets. At power-up, and not after a reset, the encoders are preset
    /// where `is_homed` says so.
    pub(super) fn run(mut self, mut machine: Machine, is_homed: bool) {
        let mut reset_reason = ResetReason::PowerOn;
        let mut presets = if is_homed { self.presets() } else { Vec::new() };
        while !self.is_stopped() {
            machine.is_reset_asked = false;
            machine.link.incoming.clear();
            let mut queue = SampleQueue::new();
            let (producer, consumer) = queue.split();
            let encoders = Encoders(self.plant.at(self.now_ns / 1_000).latch);
            let mut powered = Powered {
                sampler: Sampler::new(encoders, Converter::default(), Clock::default(), producer),
                board: Board::new(&mut machine, consumer, reset_reason.clone()),
                start_ns: self.now_ns,
            };
            self.tell(&mut powered, &std::mem::take(&mut presets));
            if let Some(bit_errors) = self.bit_errors.take() {
                powered.machine().link.bit_errors = Some(bit_errors);
            }
            while !self.is_stopped() && !powered.machine().is_reset_asked {
                self.turn(&mut powered);
            }
            reset_reason = ResetReason::Software;
        }
    }

    fn is_stopped(&self) -> bool {
        self.shared.is_stopped.load(Ordering::Relaxed)
    }

    /// Requests that tell the board where the robot's joints are. The last hello is one of no version: it closes the
    /// conversation, so that the host finds the board as if nobody had spoken to it.
    fn presets(&self) -> Vec<ToBoard> {
        let hello = |version| ToBoard::Hello(HostHello { version });
        let preset = |(joint, counts)| {
            let command = Command::PresetEncoder { joint: joint as u8, counts };
            ToBoard::Request(Request { id: joint as u16, command })
        };
        let requests = self.plant.counts().into_iter().take(self.plant.joints()).enumerate().map(preset);
        let closing = hello(ProtocolVersion { number: 0, schema: [0; 8] });
        [hello(PROTOCOL)].into_iter().chain(requests).chain([closing]).collect()
    }

    /// Sends messages to the board in the host's place, and takes the answers.
    fn tell(&mut self, powered: &mut Powered<'_>, messages: &[ToBoard]) {
        let mut buffer = [0; MAX_FRAME];
        for message in messages {
            if let Ok(frame) = encode(message, &mut buffer) {
                powered.machine().link.incoming.extend(frame.iter());
            }
            self.tick(powered);
            powered.machine().link.outgoing.clear();
        }
    }

    /// Some ticks, then a look at the port, then a rest where there is time for one.
    fn turn(&mut self, powered: &mut Powered<'_>) {
        self.take_plays(powered);
        if let Some(driven) = &self.driven {
            driven.attend(&mut self.plant);
        }
        // Without this, a time that stands still would leave the host's requests unread.
        powered.board.poll();
        if self.pace == Pace::Free && !self.plant.is_done() {
            self.anchor = None;
            let is_held_up = powered.machine().link.outgoing.len() > BACKLOG_BYTES;
            if !is_held_up {
                self.ticks(powered, TICKS_PER_TURN, u64::MAX);
            }
            self.carry(powered);
            if is_held_up {
                self.pty.wait(true, TURN);
            }
        } else {
            let until_ns = self.real_time_ns();
            self.ticks(powered, usize::MAX, until_ns);
            self.carry(powered);
            self.pty.wait(!powered.machine().link.outgoing.is_empty(), TURN);
        }
        self.pty.share();
        self.shared.now_ns.store(self.now_ns, Ordering::Relaxed);
        if self.plant.is_done() && self.held.is_none() {
            self.shared.scripts_done.store(self.scripts_begun, Ordering::Release);
        }
    }

    fn take_plays(&mut self, powered: &mut Powered<'_>) {
        while let Ok(play) = self.plays.try_recv() {
            self.scripts_begun += 1;
            self.held = Some(play);
        }
        let machine = powered.machine();
        let streams = machine.lamp.shines_steadily(machine.rate_hz);
        if let Some(play) = self.held.take_if(|play| streams || !play.with_stream) {
            self.plant.play(play.script);
        }
    }

    /// The plant's time that wall time has reached.
    fn real_time_ns(&mut self) -> u64 {
        let (began, at_ns) = *self.anchor.get_or_insert_with(|| (Instant::now(), self.now_ns));
        let reached_ns = at_ns + began.elapsed().as_nanos() as u64;
        if reached_ns.saturating_sub(self.now_ns) < LATEST.as_nanos() as u64 {
            return reached_ns;
        }
        self.anchor = Some((Instant::now(), self.now_ns));
        self.now_ns
    }

    fn ticks(&mut self, powered: &mut Powered<'_>, count: usize, until_ns: u64) {
        for _ in 0..count {
            if self.now_ns >= until_ns || powered.machine().is_reset_asked {
                return;
            }
            self.tick(powered);
        }
    }

    fn tick(&mut self, powered: &mut Powered<'_>) {
        self.now_ns += 1_000_000_000 / u64::from(powered.machine().rate_hz);
        let state = self.plant.at(self.now_ns / 1_000);
        powered.tick(self.now_ns, &state);
    }

    /// Bytes from the host to the board and from the board to the host.
    fn carry(&mut self, powered: &mut Powered<'_>) {
        let link = &mut powered.machine().link;
        let mut bytes = [0; 4_096];
        let count = self.pty.read(&mut bytes);
        link.incoming.extend(&bytes[..count]);
        while !link.outgoing.is_empty() {
            let count = self.pty.write(link.outgoing.as_slices().0);
            if count == 0 {
                break;
            }
            link.outgoing.drain(..count);
        }
        let is_drained = link.outgoing.is_empty() && !self.pty.has_unread();
        self.shared.is_drained.store(is_drained, Ordering::Release);
    }
}

/// A board from one reset to the next.
struct Powered<'a> {
    sampler: Sampler<'a, Encoders, Converter, Clock>,
    board: Board<'a, &'a mut Machine>,
    start_ns: u64,
}

impl Powered<'_> {
    fn machine(&mut self) -> &mut Machine {
        self.board.hardware_mut()
    }

    fn tick(&mut self, now_ns: u64, state: &PlantState) {
        let (encoders, converter, clock) = self.sampler.parts_mut();
        encoders.0 = state.latch;
        converter.input = state.scan;
        clock.0 = (now_ns - self.start_ns) / 1_000;
        self.sampler.tick();
        self.board.poll();
    }
}
