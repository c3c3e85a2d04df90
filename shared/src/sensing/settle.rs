//! When the arm stands still, and what it measured then.

use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::sample::{Counts, Sample};
use crate::MAX_JOINTS;

/// What counts as standing still: every channel stays within its band for the whole time.
///
/// The paper waits two seconds at each pose; here the arm's own vibration says when it is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct StillnessCriteria {
    /// How long, microseconds. The pose is the mean over this time.
    pub hold_us: u32,
    /// Width of the band of every encoder, counts.
    pub band_counts: u16,
    /// Width of the band of the LVDT, codes.
    pub band_codes: u16,
}

impl Default for StillnessCriteria {
    /// Half a second within 3 counts, 0.015 degrees of a PUMA's joint, and within 64 codes, 0.1 % of the LVDT's range.
    fn default() -> Self {
        Self { hold_us: 500_000, band_counts: 3, band_codes: 64 }
    }
}

/// A pose at which the arm stood still: means and deviations over the time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SettledPose {
    /// Index of the first sample.
    pub index: u32,
    /// Time of the first sample, microseconds.
    pub t_us: u64,
    /// Time from the first sample to the last, microseconds.
    pub duration_us: u32,
    /// Samples averaged.
    pub samples: u32,
    /// Mean encoder positions, counts.
    pub counts_mean: Vec<f64, MAX_JOINTS>,
    /// Standard deviations of the positions, counts.
    pub counts_std: Vec<f32, MAX_JOINTS>,
    /// Mean code of the LVDT.
    pub code_mean: f64,
    /// Standard deviation of the code.
    pub code_std: f32,
}

/// Where the detector is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum Stillness {
    /// A channel left its band a moment ago, or the LVDT is saturated.
    Moving,
    /// Still, but not yet for the whole time.
    Settling,
    /// Still for the whole time; the pose was reported.
    Settled,
}

/// Finds the poses at which the arm stands still; each is reported once, when its time is full.
#[derive(Clone, Debug)]
pub struct SettleDetector {
    criteria: StillnessCriteria,
    window: Option<Window>,
    is_reported: bool,
}

/// The samples since a channel last left its band; of the samples only sums are kept.
#[derive(Clone, Debug)]
struct Window {
    index: u32,
    t_us: u64,
    /// Index of the latest sample: what was not seen may have been motion.
    last_index: u32,
    samples: u32,
    counts: Vec<Spread, MAX_JOINTS>,
    code: Spread,
}

/// Sums of one channel's differences from its first value. They stay within the band, so that nothing overflows.
#[derive(Clone, Copy, Debug)]
struct Spread {
    first: i32,
    min: i32,
    max: i32,
    sum: i64,
    sum_of_squares: u64,
}

impl SettleDetector {
    /// A detector that has seen nothing.
    pub fn new(criteria: StillnessCriteria) -> Self {
        Self { criteria, window: None, is_reported: false }
    }

    /// What counts as still.
    pub fn criteria(&self) -> StillnessCriteria {
        self.criteria
    }

    /// Takes the next sample; returns a pose when the arm has now stood still for the whole time.
    pub fn push(&mut self, sample: &Sample) -> Option<SettledPose> {
        if sample.lvdt.saturated {
            self.restart();
            return None;
        }
        match &mut self.window {
            Some(window) if window.admits(sample, &self.criteria) => {
                // Once reported, the window only watches for motion.
                if !self.is_reported {
                    window.add(sample);
                }
                window.last_index = sample.index;
            }
            _ => {
                self.window = Some(Window::new(sample));
                self.is_reported = false;
            }
        }
        let window = self.window.as_ref()?;
        let duration_us = sample.t_us.saturating_sub(window.t_us);
        if self.is_reported || duration_us < u64::from(self.criteria.hold_us) || window.samples < 2 {
            return None;
        }
        self.is_reported = true;
        Some(window.pose(duration_us))
    }

    /// Forgets what was seen: positions were preset, or the bar was moved elsewhere.
    pub fn restart(&mut self) {
        self.window = None;
        self.is_reported = false;
    }

    /// Where the detector is.
    pub fn stillness(&self) -> Stillness {
        match &self.window {
            Some(_) if self.is_reported => Stillness::Settled,
            Some(window) if window.samples > 1 => Stillness::Settling,
            _ => Stillness::Moving,
        }
    }
}

impl Window {
    fn new(sample: &Sample) -> Self {
        Self {
            index: sample.index,
            t_us: sample.t_us,
            last_index: sample.index,
            samples: 1,
            counts: sample.counts.iter().map(|&counts| Spread::new(counts)).collect(),
            code: Spread::new(i32::from(sample.lvdt.code)),
        }
    }

    /// Whether the sample follows, and every channel would stay in its band.
    fn admits(&self, sample: &Sample, criteria: &StillnessCriteria) -> bool {
        sample.index == self.last_index.wrapping_add(1)
            && self.counts.len() == sample.counts.len()
            && self.code.admits(i32::from(sample.lvdt.code), criteria.band_codes)
            && channels(&self.counts, &sample.counts).all(|(spread, counts)| spread.admits(counts, criteria.band_counts))
    }

    fn add(&mut self, sample: &Sample) {
        self.samples = self.samples.saturating_add(1);
        for (spread, &counts) in self.counts.iter_mut().zip(&sample.counts) {
            spread.add(counts);
        }
        self.code.add(i32::from(sample.lvdt.code));
    }

    fn pose(&self, duration_us: u64) -> SettledPose {
        SettledPose {
            index: self.index,
            t_us: self.t_us,
            duration_us: u32::try_from(duration_us).unwrap_or(u32::MAX),
            samples: self.samples,
            counts_mean: self.counts.iter().map(|spread| spread.mean(self.samples)).collect(),
            counts_std: self.counts.iter().map(|spread| spread.deviation(self.samples)).collect(),
            code_mean: self.code.mean(self.samples),
            code_std: self.code.deviation(self.samples),
        }
    }
}

fn channels<'a>(spreads: &'a [Spread], counts: &'a Counts) -> impl Iterator<Item = (&'a Spread, i32)> {
    spreads.iter().zip(counts.iter().copied())
}

impl Spread {
    fn new(first: i32) -> Self {
        Self { first, min: first, max: first, sum: 0, sum_of_squares: 0 }
    }

    fn admits(&self, value: i32, band: u16) -> bool {
        self.max.max(value).abs_diff(self.min.min(value)) <= u32::from(band)
    }

    fn add(&mut self, value: i32) {
        self.min = self.min.min(value);
        self.max = self.max.max(value);
        let difference = i64::from(value) - i64::from(self.first);
        self.sum += difference;
        self.sum_of_squares += difference.unsigned_abs().pow(2);
    }

    fn mean(&self, samples: u32) -> f64 {
        f64::from(self.first) + self.sum as f64 / f64::from(samples)
    }

    /// Standard deviation of one value, with n − 1.
    fn deviation(&self, samples: u32) -> f32 {
        let mean = self.sum as f64 / f64::from(samples);
        let squares = self.sum_of_squares as f64 - mean * self.sum as f64;
        let variance = (squares / (f64::from(samples) - 1.0)).max(0.0);
        libm::sqrtf(variance as f32)
    }
}
