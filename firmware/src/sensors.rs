//! What the main loop keeps of every encoder and the LVDT: homing, index checks, losses, and whether the arm stands still.

use ballbar::wire::{CompiledParameters, EncoderStatus};
use ballbar::{Approach, Counts, IndexCheck, Sample, SettleDetector, SettledPose, StillnessCriteria};
use heapless::Vec;

use crate::approach_watch::ApproachWatch;
use crate::{ENCODERS, LatchedSample};

/// An encoder at rest may flicker by so many counts.
const FLICKER_COUNTS: u32 = 2;

/// The state of all channels.
pub(crate) struct Sensors {
    /// Added to the positions since start; set by presets.
    home_offsets: [i32; ENCODERS],
    homed: u8,
    index_checks: [IndexCheck; ENCODERS],
    approach: ApproachWatch,
    detector: SettleDetector,
    latest: Option<Sample>,
    /// Where the encoders stood at the start, or when one of them last moved by more than its flicker.
    stand: Option<Counts>,
    /// When that was; none before one did.
    moved_at_us: Option<u64>,
    overruns: u32,
    lvdt_faults: u32,
}

impl Sensors {
    pub(crate) fn new() -> Self {
        Self {
            home_offsets: [0; ENCODERS],
            homed: 0,
            index_checks: [IndexCheck::default(); ENCODERS],
            approach: ApproachWatch::new(),
            detector: SettleDetector::new(StillnessCriteria::default()),
            latest: None,
            stand: None,
            moved_at_us: None,
            overruns: 0,
            lvdt_faults: 0,
        }
    }

    /// Takes what the interrupt handed over; returns the pose when the arm has just settled. The sample is then the latest.
    pub(crate) fn take(&mut self, latched: &LatchedSample) -> Option<SettledPose> {
        let homed = |(&position, offset): (&i32, &i32)| position.wrapping_add(*offset);
        let sample = Sample {
            index: latched.index,
            t_us: latched.t_us,
            counts: latched.positions.iter().zip(&self.home_offsets).map(homed).collect(),
            lvdt: latched.lvdt,
        };
        for ((check, at), offset) in self.index_checks.iter_mut().zip(latched.at_index).zip(self.home_offsets) {
            if let Some(position) = at {
                check.pulse(position.wrapping_add(offset));
            }
        }
        if let Some(last) = &self.latest {
            self.overruns = self.overruns.wrapping_add(sample.index.wrapping_sub(last.index).wrapping_sub(1));
        }
        // Compared with where they last stood and not with the sample before, so that a slow joint moves too.
        let stand = self.stand.get_or_insert_with(|| sample.counts.clone());
        if sample.counts.iter().zip(&*stand).any(|(now, before)| now.abs_diff(*before) > FLICKER_COUNTS) {
            *stand = sample.counts.clone();
            self.moved_at_us = Some(sample.t_us);
        }
        self.lvdt_faults = self.lvdt_faults.wrapping_add(u32::from(sample.lvdt.saturated));
        self.approach.take(&sample.counts);
        let settled = self.detector.push(&sample);
        self.latest = Some(sample);
        settled
    }

    pub(crate) fn latest(&self) -> Option<&Sample> {
        self.latest.as_ref()
    }

    /// Encoder `joint` (from 0) stands at `counts` now. False when there is no such encoder.
    pub(crate) fn preset(&mut self, joint: u8, counts: i32) -> bool {
        let i = usize::from(joint);
        let Some(offset) = self.home_offsets.get_mut(i) else { return false };
        if let Some(position) = self.latest.as_mut().and_then(|latest| latest.counts.get_mut(i)) {
            *offset = offset.wrapping_add(counts.wrapping_sub(*position));
            *position = counts;
        } else {
            *offset = counts;
        }
        self.homed |= 1 << i;
        self.index_checks[i].restart();
        self.detector.restart();
        self.approach.preset(i, counts);
        // The jump is no motion.
        if let Some(place) = self.stand.as_mut().and_then(|stand| stand.get_mut(i)) {
            *place = counts;
        }
        true
    }

    /// From which sides the joints came to where they stand, as far as it was seen since start.
    pub(crate) fn approach(&self) -> Approach {
        self.approach.approach()
    }

    /// Takes over what the parameters say of the encoders.
    pub(crate) fn configure(&mut self, parameters: &CompiledParameters) {
        self.approach.configure(parameters);
        let spacings = parameters.encoders.encoders().iter().map(|encoder| encoder.counts_per_index).chain(core::iter::repeat(0));
        for (check, counts_per_index) in self.index_checks.iter_mut().zip(spacings) {
            check.set_counts_per_index(counts_per_index);
        }
    }

    /// The presets were counted with other encoder facts: they mean nothing any more.
    pub(crate) fn forget_homing(&mut self) {
        self.homed = 0;
    }

    /// Samples are missing that nobody counted: what the arm did meanwhile is not known.
    pub(crate) fn interrupted(&mut self) {
        self.detector.restart();
    }

    pub(crate) fn set_criteria(&mut self, criteria: StillnessCriteria) {
        self.detector = SettleDetector::new(criteria);
    }

    pub(crate) fn detector(&self) -> &SettleDetector {
        &self.detector
    }

    /// Bit i: encoder i was preset.
    pub(crate) fn homed(&self) -> u8 {
        self.homed
    }

    pub(crate) fn overruns(&self) -> u32 {
        self.overruns
    }

    pub(crate) fn lvdt_faults(&self) -> u32 {
        self.lvdt_faults
    }

    pub(crate) fn index_errors(&self) -> u32 {
        self.index_checks.iter().map(IndexCheck::errors).fold(0, u32::saturating_add)
    }

    /// Whether an encoder moved within the last `within_us` microseconds.
    pub(crate) fn moved(&self, within_us: u64) -> bool {
        self.latest.as_ref().zip(self.moved_at_us).is_some_and(|(latest, at_us)| latest.t_us.saturating_sub(at_us) < within_us)
    }

    pub(crate) fn encoder_status(&self) -> Vec<EncoderStatus, { ballbar::MAX_JOINTS }> {
        let status = |(i, check): (usize, &IndexCheck)| EncoderStatus {
            counts: self.latest.as_ref().and_then(|latest| latest.counts.get(i)).copied().unwrap_or_default(),
            is_homed: self.homed & (1 << i) != 0,
            index_pulses: check.pulses(),
            index_errors: check.errors(),
        };
        self.index_checks.iter().enumerate().map(status).collect()
    }
}
