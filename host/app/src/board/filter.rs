//! The one place between decoding a board's message and believing it, on line and from a log.
//!
//! A message has to be plausible by itself ([`super::plausible`]), and a stream message has to follow the one before: numbers, indices
//! and times only go forward (numbers and indices wrap), agree with one another within the board's rates, and nothing comes twice. What is
//! refused is counted by its reason; a log keeps it as it came.
//!
//! What follows what was refused is not refused for ever: three messages in a row that follow one another, though not what was believed
//! before, begin anew. Either the board was started again unnoticed, or something false was believed.

use std::collections::VecDeque;

use ballbar::wire::{Answer, BoardHello, Event, Reply, Status, Stream, ToHost};

use super::plausible::{self, BoardFacts, Implausible};
use super::tally::StreamLosses;

/// Decides which messages of a board are believed, and counts what was lost.
#[derive(Clone, Debug, Default)]
pub struct MessageFilter {
    facts: BoardFacts,
    /// Time of the latest hello or status, microseconds.
    clock_us: u64,
    /// The end of what is believed.
    latest: Option<Position>,
    /// The end of a row of messages that do not follow it but one another, and how many they are.
    other: Option<(Position, u32)>,
    /// Numbers of messages that were refused since, a few.
    passed_over: Vec<u32>,
    /// Number and time of messages that are believed, the latest ones.
    believed: VecDeque<(u32, u64)>,
    losses: StreamLosses,
}

/// So many messages in a row begin anew.
const ROW: u32 = 3;
/// So many messages are remembered, so that those that come twice are known: more than any buffer on the way holds.
const REMEMBERED: usize = 4_096;
/// Of one sample come three messages at most: the batch of samples that it fills, the poses, and what settled with it.
const MESSAGES_PER_SAMPLE: u64 = 3;
/// Besides, commands make batches leave early.
const MORE_MESSAGES: u64 = 64;
/// So long may sampling rest: flash is erased, or a debugger is at work.
const REST_US: u64 = 60_000_000;
/// Wrapping numbers that are apart by more have gone back.
const HALF: u32 = 1 << 31;

/// The end of a row of messages.
#[derive(Clone, Copy, Debug)]
struct Position {
    sequence: u32,
    dropped: u32,
    overruns: u32,
    /// The latest sample told of, by kind of event: those of different kinds overtake one another.
    ticks: [Option<Tick>; 3],
}

/// A sample by its number and time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tick {
    index: u32,
    t_us: u64,
}

/// What a message says of its place in the stream.
#[derive(Clone, Copy, Debug)]
struct Place {
    sequence: u32,
    dropped: u32,
    overruns: u32,
    kind: usize,
    first: Tick,
    last: Tick,
}

impl MessageFilter {
    /// Another board may speak from here on, or the same one after it was started again: its numbers and its clock are others. Losses
    /// are counted on.
    pub fn begin_segment(&mut self) {
        *self = Self { losses: self.losses, ..Self::default() };
    }

    /// Another stream of the same board begins; what lies between is not counted.
    pub fn begin_stream(&mut self) {
        (self.latest, self.other) = (None, None);
        self.passed_over.clear();
        self.believed.clear();
    }

    /// What was lost and refused so far.
    pub fn losses(&self) -> StreamLosses {
        self.losses
    }

    /// Takes the next message.
    ///
    /// # Errors
    /// Why it is not to be believed.
    pub fn take(&mut self, message: &ToHost) -> Result<(), Implausible> {
        match message {
            ToHost::Hello(hello) => self.take_hello(hello),
            ToHost::Reply(reply) => self.take_reply(reply),
            ToHost::Stream(stream) => self.take_stream(stream),
            // The host's own.
            ToHost::Mark(_) => Ok(()),
        }
    }

    pub(super) fn take_hello(&mut self, hello: &BoardHello) -> Result<(), Implausible> {
        self.count(plausible::hello(hello))?;
        (self.facts, self.clock_us) = (hello.into(), hello.uptime_us);
        Ok(())
    }

    pub(super) fn take_reply(&mut self, reply: &Reply) -> Result<(), Implausible> {
        self.count(self.facts.reply(reply))?;
        match &reply.outcome {
            Ok(Answer::Status(status)) if status.uptime_us < self.clock_us => self.count(Err(Implausible::WentBack("its time"))),
            Ok(Answer::Status(status)) => {
                self.clock_us = status.uptime_us;
                self.facts.joints = status.active.as_ref().map(|active| usize::from(active.joints));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    pub(super) fn take_stream(&mut self, stream: &Stream) -> Result<(), Implausible> {
        let place = Place::of(stream);
        let content = self.facts.event(&stream.event);
        let step = content.and_then(|()| self.follow(&place)).inspect_err(|_| self.pass_over(&place));
        let step = self.count(step)?;
        self.count_step(&place, step);
        self.latest = Some(self.latest.unwrap_or(Position::before(&place)).moved_to(&place));
        self.losses.messages += 1;
        if self.believed.len() >= REMEMBERED {
            self.believed.pop_front();
        }
        self.believed.push_back((place.sequence, place.first.t_us));
        Ok(())
    }

    fn count<T>(&mut self, checked: Result<T, Implausible>) -> Result<T, Implausible> {
        checked.inspect_err(|&reason| self.losses.refused.count(reason))
    }

    /// The stream has ended; `status` was asked for behind it. What is missing behind the last message shows here only.
    pub fn end_stream(&mut self, status: &Status) {
        let Some(latest) = self.latest.take() else { return };
        let sample = Tick { index: status.samples.wrapping_sub(1), t_us: status.uptime_us };
        let samples = latest.ticks.iter().flatten().map(|tick| sample.index.wrapping_sub(tick.index)).filter(|&n| n < HALF).min();
        let place = Place {
            sequence: status.stream_messages,
            dropped: status.dropped,
            overruns: status.overruns,
            kind: 0,
            first: sample,
            last: sample,
        };
        let counted =
            latest.advance(&place).and_then(|step| step.check_samples(samples.map_or(u64::MAX, u64::from)).map(|()| step));
        if let Ok(step) = self.count(counted) {
            self.count_step(&place, step);
        }
    }

    /// From what is believed to a message that follows it, or begins anew.
    fn follow(&mut self, place: &Place) -> Result<Step, Implausible> {
        let Some(latest) = self.latest else { return Ok(Step::FIRST) };
        let step = latest.step_to(place, self.facts.rate_hz);
        if step.is_ok() {
            self.other = None;
            return step;
        }
        if self.believed.contains(&(place.sequence, place.first.t_us)) {
            return Err(Implausible::Repeated);
        }
        if self.begins_anew(place) {
            self.begin_stream();
            return Ok(Step::FIRST);
        }
        step
    }

    /// A message that is refused has come all the same: where it may be one of the next, its number is not missing.
    fn pass_over(&mut self, place: &Place) {
        let is_next = |latest: Position| latest.advance(place).is_ok_and(|step| u64::from(step.messages) <= MORE_MESSAGES);
        if self.latest.is_some_and(is_next) && !self.passed_over.contains(&place.sequence) {
            self.passed_over.push(place.sequence);
        }
    }

    /// Counts what lies between the latest message and one that is believed.
    fn count_step(&mut self, place: &Place, step: Step) {
        let is_between = |number: &&u32| place.sequence.wrapping_sub(**number).wrapping_sub(1) < step.messages - 1;
        let come = self.passed_over.iter().filter(is_between).count() as u64;
        self.passed_over.clear();
        let missing = u64::from(step.messages - 1).saturating_sub(come);
        let dropped = u64::from(step.dropped).min(missing);
        self.losses.missing += missing;
        self.losses.dropped_by_board += dropped;
        self.losses.lost_on_line += missing - dropped;
        self.losses.overruns += u64::from(step.overruns);
    }

    /// Whether this is the last of a row of messages that follow one another and not what is believed.
    fn begins_anew(&mut self, place: &Place) -> bool {
        let rate_hz = self.facts.rate_hz;
        let (position, row) = match self.other {
            Some((before, row)) if before.step_to(place, rate_hz).is_ok() => (before.moved_to(place), row + 1),
            _ => (Position::before(place).moved_to(place), 1),
        };
        self.other = (row < ROW).then_some((position, row));
        row >= ROW
    }
}

/// From one message to the next.
#[derive(Clone, Copy, Debug)]
struct Step {
    /// Numbers from the one to the other, one at least; the messages between them are missing, unless they were refused.
    messages: u32,
    /// Of these, dropped by the board.
    dropped: u32,
    /// Samples lost between.
    overruns: u32,
}

impl Step {
    /// To the first message, before which nothing is known to be missing.
    const FIRST: Self = Self { messages: 1, dropped: 0, overruns: 0 };

    /// That many samples lie between the two.
    fn check_samples(&self, samples: u64) -> Result<(), Implausible> {
        let most = samples.saturating_mul(MESSAGES_PER_SAMPLE).saturating_add(MORE_MESSAGES);
        if u64::from(self.messages) > most {
            return Err(Implausible::OutOfRange("its number"));
        }
        if u64::from(self.overruns) > samples.saturating_add(MORE_MESSAGES) {
            return Err(Implausible::OutOfRange("its number of lost samples"));
        }
        Ok(())
    }
}

impl Position {
    /// Of nothing before this message.
    fn before(place: &Place) -> Self {
        let Place { sequence, dropped, overruns, .. } = *place;
        Self { sequence, dropped, overruns, ticks: [None; 3] }
    }

    /// Behind this message.
    fn moved_to(self, place: &Place) -> Self {
        let mut ticks = self.ticks;
        ticks[place.kind] = Some(place.last);
        Self { ticks, ..Self::before(place) }
    }

    /// How far it is to a message, if it follows.
    fn step_to(&self, place: &Place, rate_hz: (u16, u16)) -> Result<Step, Implausible> {
        let step = self.advance(place)?;
        self.check_time(place, step, rate_hz)?;
        Ok(step)
    }

    /// How far it is to a message, by its numbers alone.
    fn advance(&self, place: &Place) -> Result<Step, Implausible> {
        let messages = place.sequence.wrapping_sub(self.sequence);
        if messages == 0 || messages >= HALF {
            return Err(Implausible::WentBack("its number"));
        }
        let dropped = place.dropped.wrapping_sub(self.dropped);
        if dropped >= messages {
            return Err(Implausible::OutOfRange("its number of dropped messages"));
        }
        let overruns = place.overruns.wrapping_sub(self.overruns);
        if overruns >= HALF {
            return Err(Implausible::WentBack("its number of lost samples"));
        }
        Ok(Step { messages, dropped, overruns })
    }

    /// Whether number, index and time of a message have gone on together since the one of its kind.
    fn check_time(&self, place: &Place, step: Step, (least_hz, most_hz): (u16, u16)) -> Result<(), Implausible> {
        let Some(before) = self.ticks[place.kind] else { return Ok(()) };
        let samples = place.first.index.wrapping_sub(before.index);
        if samples == 0 || samples >= HALF {
            return Err(Implausible::WentBack("its index"));
        }
        if place.first.t_us <= before.t_us {
            return Err(Implausible::WentBack("its time"));
        }
        // Half and twice what the rates say, for clocks that are not the board's own.
        let elapsed_us = place.first.t_us - before.t_us;
        let least_us = u64::from(samples) * 1_000_000 / u64::from(most_hz) / 2;
        let most_us = u64::from(samples) * 1_000_000 / u64::from(least_hz) * 2 + REST_US;
        if !(least_us..=most_us).contains(&elapsed_us) {
            return Err(Implausible::OutOfRange("its time"));
        }
        step.check_samples(u64::from(place.last.index.wrapping_sub(before.index)))
    }
}

impl Place {
    /// Times are those of a plausible message; of another they may be anything.
    fn of(stream: &Stream) -> Self {
        let (kind, first, last) = match &stream.event {
            Event::Samples(batch) => {
                let first = Tick { index: batch.first.index, t_us: batch.first.t_us };
                let t_us = batch.rest.iter().fold(first.t_us, |t_us, step| t_us.saturating_add(u64::from(step.dt_us)));
                (0, first, Tick { index: first.index.wrapping_add(batch.rest.len() as u32), t_us })
            }
            Event::Settled(pose) => {
                let t_us = pose.t_us.saturating_add(u64::from(pose.duration_us));
                let index = pose.index.wrapping_add(pose.samples.saturating_sub(1));
                (1, Tick { index: pose.index, t_us: pose.t_us }, Tick { index, t_us })
            }
            Event::Poses(batch) => {
                let strides = batch.poses.len().saturating_sub(1) as u32;
                let t_us = batch.t_us.saturating_add(batch.poses.last().map_or(0, |pose| u64::from(pose.dt_us)));
                let index = batch.index.wrapping_add(strides.wrapping_mul(u32::from(batch.stride)));
                (2, Tick { index: batch.index, t_us: batch.t_us }, Tick { index, t_us })
            }
        };
        Self { sequence: stream.sequence, dropped: stream.dropped, overruns: stream.overruns, kind, first, last }
    }
}
