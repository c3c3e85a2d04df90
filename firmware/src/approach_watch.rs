//! From which side each joint came to where it stands.

use ballbar::wire::CompiledParameters;
use ballbar::{Approach, Counts, Direction, MAX_JOINTS};

/// An encoder at rest may flicker by so many counts; a servo that holds its place reverses by no more.
const FLICKER_COUNTS: u32 = 2;

/// Follows every encoder's turns.
///
/// An encoder has turned when it is farther back from where it came to than it flickers, and than the gap of its joint: on the way
/// through the gap the joint does not follow, and stands as it stood before.
pub(crate) struct ApproachWatch {
    /// Where each encoder came to on its way, counts; where it started, while its way is not known; empty before the first sample.
    farthest: Counts,
    /// Of counts, not of joint values.
    counts: Approach,
    gap_counts: [u32; MAX_JOINTS],
    /// Bit i: counts of encoder i fall as its joint rises.
    falling_encoders: u8,
}

impl ApproachWatch {
    pub(crate) fn new() -> Self {
        Self { farthest: Counts::new(), counts: Approach::UNKNOWN, gap_counts: [FLICKER_COUNTS; MAX_JOINTS], falling_encoders: 0 }
    }

    /// Takes over what the parameters say of encoders and gaps. A gap is one of the joint's angle, which a scale near one makes one of
    /// the encoder output.
    pub(crate) fn configure(&mut self, parameters: &CompiledParameters) {
        self.falling_encoders = 0;
        for (i, encoder) in parameters.encoders.encoders().iter().enumerate() {
            self.configure_encoder(i, encoder.counts_per_unit, parameters.backlash.get(i).copied().unwrap_or_default());
        }
    }

    /// Not inlined, as [`ApproachWatch::follow`].
    #[inline(never)]
    fn configure_encoder(&mut self, i: usize, counts_per_unit: f32, backlash: f32) {
        if let Some(gap_counts) = self.gap_counts.get_mut(i) {
            // A float that is too large ends at the largest whole number.
            *gap_counts = ((2.0 * backlash * counts_per_unit).abs() as u32).max(FLICKER_COUNTS);
            self.falling_encoders |= u8::from(counts_per_unit < 0.0) << i;
        }
    }

    pub(crate) fn take(&mut self, counts: &Counts) {
        if self.farthest.is_empty() {
            self.farthest = counts.clone();
        }
        for (i, now) in counts.iter().enumerate() {
            self.follow(i, *now);
        }
    }

    /// Not inlined, so that it is in flash once and not once for each encoder.
    #[inline(never)]
    fn follow(&mut self, i: usize, now: i32) {
        let (Some(farthest), Some(gap_counts)) = (self.farthest.get_mut(i), self.gap_counts.get(i)) else { return };
        let way = now.wrapping_sub(*farthest);
        let direction = if way > 0 { Direction::Rising } else { Direction::Falling };
        let goes_on = way != 0 && self.counts.direction(i) == Some(direction);
        if goes_on || way.unsigned_abs() > *gap_counts {
            *farthest = now;
            self.counts = self.counts.with(i, Some(direction));
        }
    }

    /// Encoder `i` stands at `counts` now, without having moved.
    pub(crate) fn preset(&mut self, i: usize, counts: i32) {
        if let Some(farthest) = self.farthest.get_mut(i) {
            *farthest = counts;
        }
    }

    /// Of joint values.
    pub(crate) fn approach(&self) -> Approach {
        self.counts.reversed(self.falling_encoders)
    }
}
