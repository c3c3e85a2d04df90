//! The stream: batches of samples and poses, numbered, and dropped whole when the link is slow.

use ballbar::wire::{
    CompiledParameters, Event, MAX_BATCH, MAX_FRAME, MAX_POSE_BATCH, PoseBatch, SampleBatch, Stream, StreamSelection,
    StreamedPose, ToHost, encode,
};
use ballbar::{Sample, SettledPose};

use crate::outbox::Outbox;
use crate::sensors::Sensors;

/// A batch leaves when it is full or this old, microseconds, so that a slow rate still looks alive.
const BATCH_AGE_US: u64 = 50_000;
/// Poses a second, at most.
const POSE_RATE_HZ: u16 = 1_000;

/// Makes stream messages of what the sensors give.
pub(crate) struct Streamer {
    selection: Option<StreamSelection>,
    samples: Option<SampleBatch>,
    last: Sample,
    poses: Option<PoseBatch>,
    stride: u16,
    sequence: u32,
    dropped: u32,
}

impl Streamer {
    pub(crate) fn new() -> Self {
        Self { selection: None, samples: None, last: Sample::default(), poses: None, stride: 1, sequence: 0, dropped: 0 }
    }

    pub(crate) fn selection(&self) -> Option<StreamSelection> {
        self.selection
    }

    /// Begins another stream; what was gathered for the old one leaves first.
    pub(crate) fn start(&mut self, selection: StreamSelection, rate_hz: u16, sensors: &Sensors, outbox: &mut Outbox) {
        self.flush(sensors, outbox);
        self.selection = Some(selection);
        self.set_rate(rate_hz);
    }

    pub(crate) fn stop(&mut self, sensors: &Sensors, outbox: &mut Outbox) {
        self.flush(sensors, outbox);
        self.selection = None;
    }

    /// Poses come every so many samples that there are no more than a thousand a second.
    pub(crate) fn set_rate(&mut self, rate_hz: u16) {
        self.stride = rate_hz.div_ceil(POSE_RATE_HZ).max(1);
    }

    /// Messages made, and of these dropped.
    pub(crate) fn counts(&self) -> (u32, u32) {
        (self.sequence, self.dropped)
    }

    /// Streams the sensors' latest sample, and the pose that settled with it.
    pub(crate) fn take(
        &mut self,
        settled: Option<SettledPose>,
        parameters: Option<&CompiledParameters>,
        sensors: &Sensors,
        outbox: &mut Outbox,
    ) {
        let (Some(selection), Some(sample)) = (self.selection, sensors.latest()) else { return };
        if selection.samples {
            self.take_sample(sample, sensors, outbox);
        }
        if selection.poses
            && let Some(parameters) = parameters
            && sample.index.is_multiple_of(u32::from(self.stride))
        {
            self.take_pose(sample, parameters, sensors, outbox);
        }
        if selection.settled
            && let Some(pose) = settled
        {
            self.emit(Event::Settled(pose), sensors, outbox);
        }
    }

    /// Sends what was gathered so far: positions or parameters are about to change their meaning.
    pub(crate) fn flush(&mut self, sensors: &Sensors, outbox: &mut Outbox) {
        if let Some(batch) = self.samples.take() {
            self.emit(Event::Samples(batch), sensors, outbox);
        }
        if let Some(batch) = self.poses.take() {
            self.emit(Event::Poses(batch), sensors, outbox);
        }
    }

    fn take_sample(&mut self, sample: &Sample, sensors: &Sensors, outbox: &mut Outbox) {
        let fits = self.samples.as_mut().is_some_and(|batch| batch.push(&self.last, sample));
        if !fits && let Some(full) = self.samples.replace(SampleBatch::new(sample.clone())) {
            self.emit(Event::Samples(full), sensors, outbox);
        }
        self.last = sample.clone();
        let is_due =
            |batch: &SampleBatch| batch.len() == MAX_BATCH || sample.t_us.saturating_sub(batch.first.t_us) >= BATCH_AGE_US;
        if let Some(batch) = self.samples.take_if(|batch| is_due(batch)) {
            self.emit(Event::Samples(batch), sensors, outbox);
        }
    }

    fn take_pose(&mut self, sample: &Sample, parameters: &CompiledParameters, sensors: &Sensors, outbox: &mut Outbox) {
        let q = parameters.encoders.q(sample.counts.iter().map(|&counts| counts as f32));
        // One that is no number is not streamed: a gap in the indices.
        let Some(pose) = parameters.tool_pose(&q, sensors.approach()) else { return };
        let displacement_m = parameters.lvdt.displacement_m(sample.lvdt).ok();
        let follows = |batch: &PoseBatch| {
            let expected = batch.index.wrapping_add(u32::from(batch.stride) * batch.poses.len() as u32);
            sample.index == expected && batch.stride == self.stride
        };
        if let Some(broken) = self.poses.take_if(|batch| !follows(batch)) {
            self.emit(Event::Poses(broken), sensors, outbox);
        }
        let stride = self.stride;
        let batch = self.poses.get_or_insert_with(|| PoseBatch {
            index: sample.index,
            stride,
            t_us: sample.t_us,
            poses: heapless::Vec::new(),
        });
        let age_us = sample.t_us.saturating_sub(batch.t_us);
        let _ = batch.poses.push(StreamedPose { dt_us: age_us as u32, pose, displacement_m });
        let is_due = batch.poses.len() == MAX_POSE_BATCH || age_us >= BATCH_AGE_US;
        if let Some(batch) = self.poses.take_if(|_| is_due) {
            self.emit(Event::Poses(batch), sensors, outbox);
        }
    }

    /// Numbers a message and queues it; when the link has no room, the message is dropped and counted. Not inlined, so that its
    /// kilobytes of message and frame do not lie on the stack of every caller.
    #[inline(never)]
    fn emit(&mut self, event: Event, sensors: &Sensors, outbox: &mut Outbox) {
        let message = ToHost::Stream(Stream {
            sequence: self.sequence,
            dropped: self.dropped,
            overruns: sensors.overruns(),
            homed: sensors.homed(),
            event,
        });
        self.sequence = self.sequence.wrapping_add(1);
        let mut buffer = [0; MAX_FRAME];
        let is_queued = encode(&message, &mut buffer).is_ok_and(|frame| outbox.push_stream(frame));
        if !is_queued {
            self.dropped = self.dropped.wrapping_add(1);
        }
    }
}
