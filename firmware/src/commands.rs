//! What the board does when it is asked to.

use ballbar::wire::{
    Answer, Command, CurrentPose, LinkCounts, Refusal, Reply, Request, Status, StreamSelection, ToolPose, WhichSet,
};
use ballbar::{Approach, JointVector, StillnessCriteria};
use heapless::Vec;

use crate::board::Board;
use crate::hardware::{Hardware, ParameterFlash};
use crate::self_test::{Findings, self_test};
use crate::slots::Slots;
use crate::{ENCODERS, RATE_MAX_HZ, RATE_MIN_HZ};

/// Time between the answer to a reset and the reset, for the answer to leave, microseconds.
const RESET_DELAY_US: u64 = 50_000;
/// How long the encoders must have stood before a commit may stall their reading, microseconds.
const STANDSTILL_US: u64 = 200_000;
/// How long a pose may have to hold, microseconds.
const HOLD_US: core::ops::RangeInclusive<u32> = 10_000..=60_000_000;

impl<H: Hardware> Board<'_, H> {
    /// Carries out a request.
    pub(crate) fn request(&mut self, request: &Request) -> Reply {
        let id = request.id;
        if !self.conversation.is_open {
            return Reply { id, outcome: Err(Refusal::HelloFirst) };
        }
        self.conversation.count(id);
        Reply { id, outcome: self.answer_to(id, &request.command) }
    }

    fn answer_to(&mut self, id: u16, command: &Command) -> Result<Answer, Refusal> {
        match command {
            Command::Status => Ok(Answer::Status(self.status())),
            Command::SelfTest => Ok(Answer::SelfTest(self_test(&self.findings()))),
            Command::ReadParameters(which) => self.parameters.read(*which, self.hardware.flash()).map(Answer::Parameters),
            Command::ReadPrevious => self.parameters.read_previous(self.hardware.flash()).map(Answer::Parameters),
            Command::WriteParameters(set) => self.parameters.stage(set.clone()).map(|crc| Answer::Staged { crc }),
            Command::SetLvdt(curve) => {
                self.parameters.stage_lvdt(*curve, self.hardware.flash()).map(|crc| Answer::Staged { crc })
            }
            Command::CurrentPose => self.current_pose().map(Answer::CurrentPose),
            Command::ForwardKinematics { set, q, approach } => self.forward_kinematics(*set, q, *approach).map(Answer::Pose),
            action => self.act_once(id, action).map(|()| Answer::Done),
        }
    }

    /// Does what changes the board's state, unless this very request was carried out before.
    fn act_once(&mut self, id: u16, action: &Command) -> Result<(), Refusal> {
        if let Some((last_id, outcome)) = self.conversation.last_action
            && last_id == id
        {
            return outcome;
        }
        let outcome = self.act(action);
        self.conversation.last_action = Some((id, outcome));
        outcome
    }

    fn act(&mut self, action: &Command) -> Result<(), Refusal> {
        match *action {
            Command::StartStream(selection) => self.start_stream(selection),
            Command::StopStream => {
                self.streamer.stop(&self.sensors, &mut self.outbox);
                Ok(())
            }
            Command::SetRate { rate_hz } => self.set_rate(rate_hz),
            Command::SetStillness(criteria) => self.set_stillness(criteria),
            Command::PresetEncoder { joint, counts } => self.preset(joint, counts),
            Command::Commit { crc } => self.commit(crc),
            Command::Discard => {
                self.parameters.discard();
                Ok(())
            }
            Command::Reset => {
                // A link that is full of the stream would never let the answer out.
                self.streamer.stop(&self.sensors, &mut self.outbox);
                self.reset_at_us = Some(self.uptime_us() + RESET_DELAY_US);
                Ok(())
            }
            // The others change nothing and are answered above.
            _ => Err(Refusal::NotUnderstood),
        }
    }

    fn start_stream(&mut self, selection: StreamSelection) -> Result<(), Refusal> {
        if selection == StreamSelection::default() {
            return Err(Refusal::NothingSelected);
        }
        if selection.poses {
            self.parameters.compiled(WhichSet::Active)?;
        }
        self.streamer.start(selection, self.rate_hz, &self.sensors, &mut self.outbox);
        Ok(())
    }

    fn set_rate(&mut self, rate_hz: u16) -> Result<(), Refusal> {
        if !(RATE_MIN_HZ..=RATE_MAX_HZ).contains(&rate_hz) {
            return Err(Refusal::Rate { min_hz: RATE_MIN_HZ, max_hz: RATE_MAX_HZ });
        }
        self.rate_hz = rate_hz;
        self.hardware.set_rate_hz(rate_hz);
        self.streamer.set_rate(rate_hz);
        Ok(())
    }

    fn set_stillness(&mut self, criteria: StillnessCriteria) -> Result<(), Refusal> {
        if !HOLD_US.contains(&criteria.hold_us) {
            return Err(Refusal::Stillness);
        }
        self.sensors.set_criteria(criteria);
        Ok(())
    }

    fn preset(&mut self, joint: u8, counts: i32) -> Result<(), Refusal> {
        // Samples gathered so far belong to the old positions.
        self.streamer.flush(&self.sensors, &mut self.outbox);
        let is_preset = self.sensors.preset(joint, counts);
        is_preset.then_some(()).ok_or(Refusal::Joint { joints: ENCODERS as u8 })
    }

    fn commit(&mut self, crc: u32) -> Result<(), Refusal> {
        if self.parameters.is_committed(crc) {
            return Ok(());
        }
        if H::Flash::STALLS_SAMPLING {
            if self.streamer.selection().is_some() {
                return Err(Refusal::Streaming);
            }
            if self.sensors.moved(STANDSTILL_US) {
                return Err(Refusal::Moving);
            }
        }
        // Poses gathered so far belong to the old parameters.
        self.streamer.flush(&self.sensors, &mut self.outbox);
        let old_encoders = self.parameters.active().map(|active| active.encoders.clone());
        let committed = self.parameters.commit(crc, self.hardware.flash());
        if H::Flash::STALLS_SAMPLING {
            self.sensors.interrupted();
        }
        committed?;
        if let Some(active) = self.parameters.active() {
            self.sensors.configure(active);
            if old_encoders.is_some_and(|old| old != active.encoders) {
                self.sensors.forget_homing();
            }
        }
        Ok(())
    }

    fn current_pose(&self) -> Result<CurrentPose, Refusal> {
        let parameters = self.parameters.compiled(WhichSet::Active)?;
        let sample = self.sensors.latest().ok_or(Refusal::NoSample)?;
        let q = parameters.encoders.q(sample.counts.iter().map(|&counts| counts as f32));
        Ok(CurrentPose {
            t_us: sample.t_us,
            homed: self.sensors.homed(),
            q: q.as_array()[..parameters.joints].iter().copied().collect(),
            approach: self.sensors.approach(),
            pose: parameters.tool_pose(&q, self.sensors.approach()).ok_or(Refusal::NotFinite)?,
            displacement_m: parameters.lvdt.displacement_m(sample.lvdt).ok(),
        })
    }

    fn forward_kinematics(
        &self,
        set: WhichSet,
        q: &Vec<f32, { ballbar::MAX_JOINTS }>,
        approach: Approach,
    ) -> Result<ToolPose, Refusal> {
        let parameters = self.parameters.compiled(set)?;
        if q.len() != parameters.joints {
            return Err(Refusal::Joint { joints: parameters.joints as u8 });
        }
        if q.iter().any(|value| !value.is_finite()) {
            return Err(Refusal::NotFinite);
        }
        let mut vector = JointVector::zero();
        vector.as_array_mut()[..q.len()].copy_from_slice(q);
        parameters.tool_pose(&vector, approach).ok_or(Refusal::NotFinite)
    }

    fn status(&self) -> Status {
        let (stream_messages, dropped) = self.streamer.counts();
        let frames = self.frames.counts();
        let latest = self.sensors.latest();
        Status {
            uptime_us: self.uptime_us(),
            rate_hz: self.rate_hz,
            streaming: self.streamer.selection(),
            samples: latest.map_or(0, |sample| sample.index.wrapping_add(1)),
            overruns: self.sensors.overruns(),
            stream_messages,
            dropped,
            link: LinkCounts {
                good: frames.good,
                crc: frames.crc,
                malformed: frames.malformed.wrapping_add(frames.overlong),
                missing: self.conversation.missing,
            },
            encoders: self.sensors.encoder_status(),
            lvdt: latest.map(|sample| sample.lvdt).unwrap_or_default(),
            lvdt_faults: self.sensors.lvdt_faults(),
            stillness: self.sensors.detector().stillness(),
            criteria: self.sensors.detector().criteria(),
            active: self.parameters.identity().cloned(),
            staged: self.parameters.staged_crc(),
            slots: self.parameters.slots(),
            stack_unused_bytes: self.hardware.stack_unused_bytes(),
            previous: self.parameters.previous().cloned(),
        }
    }

    fn findings(&mut self) -> Findings {
        let slots = Slots::load(self.hardware.flash()).0;
        Findings {
            has_samples: self.sensors.latest().is_some(),
            overruns: self.sensors.overruns(),
            is_lvdt_good: self.sensors.latest().is_some_and(|sample| !sample.lvdt.saturated),
            index_errors: self.sensors.index_errors(),
            active_crc: self.parameters.identity().map(|identity| identity.crc),
            stored_crc: slots.active().map(|(_, crc)| crc),
            slots: slots.states(),
            stack_unused_bytes: self.hardware.stack_unused_bytes(),
        }
    }
}
