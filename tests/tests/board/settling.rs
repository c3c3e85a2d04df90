//! When the arm counts as standing still, and what is said of it then.

use ballbar::{LvdtReading, Sample, SettleDetector, SettledPose, Stillness, StillnessCriteria};
use proptest::collection::vec;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const CRITERIA: StillnessCriteria = StillnessCriteria { hold_us: 100_000, band_counts: 6, band_codes: 40 };

/// Samples of two encoders at a constant rate.
struct Arm {
    rate_hz: u32,
    index: u32,
    t_us: u64,
}

impl Arm {
    fn at_rate(rate_hz: u32) -> Self {
        Self { rate_hz, index: 0, t_us: 0 }
    }

    fn sample(&mut self, counts: [i32; 2], code: u16) -> Sample {
        self.index += 1;
        self.t_us += 1_000_000 / u64::from(self.rate_hz);
        let lvdt = LvdtReading { code, saturated: false };
        Sample { index: self.index, t_us: self.t_us, counts: counts.as_slice().try_into().unwrap(), lvdt }
    }

    /// How many poses `detector` finds while the arm stands there for so long.
    fn stand(&mut self, detector: &mut SettleDetector, counts: [i32; 2], time_us: u32) -> Vec<SettledPose> {
        let samples = u64::from(time_us) * u64::from(self.rate_hz) / 1_000_000;
        (0..samples).filter_map(|_| detector.push(&self.sample(counts, 30_000))).collect()
    }
}

/// Mean and deviation by definition.
fn statistics(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt())
}

fn is_near(found: impl Into<f64>, expected: f64) -> bool {
    (found.into() - expected).abs() <= 1e-6 * expected.abs().max(1e-3)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn mean_deviation_and_count_are_those_of_the_samples(
        rate_hz in prop_oneof![Just(100), Just(1_000), Just(5_000), 100..5_000_u32],
        at in [-2_000_000_000..2_000_000_000_i32, -500..500_i32],
        code in 100..65_000_u16,
        seed in any::<u64>(),
    ) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (mut arm, mut detector) = (Arm::at_rate(rate_hz), SettleDetector::new(CRITERIA));
        let mut seen = Vec::new();
        let pose = loop {
            let noise = |rng: &mut ChaCha8Rng| rng.random_range(0..=i32::from(CRITERIA.band_counts));
            let counts = at.map(|at| at + noise(&mut rng));
            let sample = arm.sample(counts, code + rng.random_range(0..=CRITERIA.band_codes));
            seen.push(sample.clone());
            if let Some(pose) = detector.push(&sample) {
                break pose;
            }
            prop_assert!(seen.len() < 2_000, "noise within the band never settled");
        };
        prop_assert_eq!((pose.index, pose.t_us, pose.samples as usize), (seen[0].index, seen[0].t_us, seen.len()));
        prop_assert_eq!(u64::from(pose.duration_us), seen.last().unwrap().t_us - seen[0].t_us);
        prop_assert!(pose.duration_us >= CRITERIA.hold_us && pose.duration_us < CRITERIA.hold_us + 2 * 1_000_000 / rate_hz);
        for joint in 0..2 {
            let (mean, deviation) = statistics(&seen.iter().map(|sample| f64::from(sample.counts[joint])).collect::<Vec<_>>());
            prop_assert!((pose.counts_mean[joint] - mean).abs() < 1e-5);
            prop_assert!((f64::from(pose.counts_std[joint]) - deviation).abs() < 1e-4);
        }
        let (mean, deviation) = statistics(&seen.iter().map(|sample| f64::from(sample.lvdt.code)).collect::<Vec<_>>());
        prop_assert!(is_near(pose.code_mean, mean) && is_near(pose.code_std, deviation), "{pose:?}, {mean}, {deviation}");
    }

    /// Whatever the arm does: a pose comes exactly where every channel has stayed in its band for the whole time since a channel
    /// last left it, and once each.
    #[test]
    fn poses_come_where_a_look_at_all_samples_finds_them(
        steps in vec((0..12_i32, -1..=1_i32, 1..50_usize), 1..40),
        saturated_every in 20..2_000_usize,
        hold_samples in 3..40_u32,
    ) {
        let criteria = StillnessCriteria { hold_us: hold_samples * 1_000, ..CRITERIA };
        let (mut arm, mut detector) = (Arm::at_rate(1_000), SettleDetector::new(criteria));
        let (mut window, mut is_reported): (Vec<Sample>, bool) = (Vec::new(), false);
        let mut position = 0;
        for (leap, direction, stay) in steps {
            position += leap * direction;
            for i in 0..stay {
                let mut sample = arm.sample([position + (i % 3) as i32, -position], 30_000 + (i % 20) as u16);
                sample.lvdt.saturated = (sample.index as usize).is_multiple_of(saturated_every);
                let found = detector.push(&sample);

                let grown = [&window[..], std::slice::from_ref(&sample)].concat();
                if sample.lvdt.saturated {
                    (window, is_reported) = (Vec::new(), false);
                } else if !is_still(&grown, &criteria) {
                    (window, is_reported) = (vec![sample.clone()], false);
                } else if !is_reported {
                    window = grown;
                }
                let is_long = window.len() > 1 && sample.t_us - window[0].t_us >= u64::from(criteria.hold_us);
                prop_assert_eq!(found.is_some(), is_long && !is_reported, "at sample {}", sample.index);
                if let Some(pose) = found {
                    prop_assert_eq!((pose.index, pose.samples as usize), (window[0].index, window.len()));
                }
                is_reported |= is_long;
            }
        }
    }

    #[test]
    fn a_slow_drift_beyond_the_band_never_settles(counts_per_s in 80..5_000_i32, rate_hz in 100..5_000_u32) {
        let (mut arm, mut detector) = (Arm::at_rate(rate_hz), SettleDetector::new(CRITERIA));
        // Within the hold of 0.1 s the drift is more than the band of 6 counts, and a count of rounding.
        for i in 0..i64::from(rate_hz) * 3 {
            let drifted = (i * i64::from(counts_per_s) / i64::from(rate_hz)) as i32;
            prop_assert!(detector.push(&arm.sample([drifted, 0], 30_000)).is_none());
        }
    }

    #[test]
    fn jumps_of_time_neither_panic_nor_shorten_the_hold(times in vec(any::<u64>(), 2..200)) {
        let (mut arm, mut detector) = (Arm::at_rate(1_000), SettleDetector::new(CRITERIA));
        for t_us in times {
            let sample = Sample { t_us, ..arm.sample([5, 5], 30_000) };
            if let Some(pose) = detector.push(&sample) {
                prop_assert!(pose.duration_us >= CRITERIA.hold_us && pose.samples >= 2);
            }
        }
    }
}

fn is_still(window: &[Sample], criteria: &StillnessCriteria) -> bool {
    let spread = |channel: &dyn Fn(&Sample) -> i32| {
        let values = || window.iter().map(channel);
        values().max().unwrap_or(0) - values().min().unwrap_or(0)
    };
    (0..2).all(|joint| spread(&|sample| sample.counts[joint]) <= i32::from(criteria.band_counts))
        && spread(&|sample| i32::from(sample.lvdt.code)) <= i32::from(criteria.band_codes)
}

#[test]
fn each_pose_is_reported_once_at_every_rate() {
    for rate_hz in [100, 250, 1_000, 5_000] {
        let (mut arm, mut detector) = (Arm::at_rate(rate_hz), SettleDetector::new(CRITERIA));
        for pose in 0..5 {
            let found = arm.stand(&mut detector, [1_000 * pose, -7 * pose], 1_000_000);
            assert_eq!(found.len(), 1, "{rate_hz} Hz");
            assert_eq!(found[0].counts_mean.as_slice(), [f64::from(1_000 * pose), f64::from(-7 * pose)]);
            assert_eq!(detector.stillness(), Stillness::Settled);
        }
    }
}

#[test]
fn leaving_the_band_and_coming_back_is_another_pose() {
    let (mut arm, mut detector) = (Arm::at_rate(1_000), SettleDetector::new(CRITERIA));
    assert_eq!(arm.stand(&mut detector, [0, 0], 300_000).len(), 1);
    assert_eq!(arm.stand(&mut detector, [7, 0], 1_000).len(), 0);
    assert_eq!(detector.stillness(), Stillness::Moving);
    assert_eq!(arm.stand(&mut detector, [0, 0], 300_000).len(), 1);
}

#[test]
fn motion_within_the_band_after_a_pose_is_no_other_pose() {
    let (mut arm, mut detector) = (Arm::at_rate(1_000), SettleDetector::new(CRITERIA));
    assert_eq!(arm.stand(&mut detector, [0, 0], 300_000).len(), 1);
    for i in 0..1_000 {
        assert_eq!(detector.push(&arm.sample([3 * (i % 3), -6 * (i % 2)], 30_000)), None);
    }
}

#[test]
fn ringing_delays_the_pose_until_it_has_decayed_into_the_band() {
    let (mut arm, mut detector) = (Arm::at_rate(1_000), SettleDetector::new(CRITERIA));
    let ringing = |i: u32| (200.0 * (-f64::from(i) / 300.0).exp() * (f64::from(i) * 0.12).cos()).round() as i32;
    let pose = (0..5_000).find_map(|i| detector.push(&arm.sample([ringing(i), 0], 30_000))).expect("never settled");
    // 200 exp(-i / 300) falls to ±3 counts after 1.26 s; the rounding to counts and the phase leave some room.
    assert!((1_050..1_300).contains(&pose.index), "{pose:?}");
    assert!(pose.counts_mean[0].abs() < 1.0 && pose.counts_std[0] > 0.1);
}

#[test]
fn a_saturated_lvdt_starts_the_time_anew() {
    let (mut arm, mut detector) = (Arm::at_rate(1_000), SettleDetector::new(CRITERIA));
    for _ in 0..20 {
        assert_eq!(arm.stand(&mut detector, [0, 0], 90_000).len(), 0);
        let mut sample = arm.sample([0, 0], 30_000);
        sample.lvdt.saturated = true;
        assert_eq!(detector.push(&sample), None);
        assert_eq!(detector.stillness(), Stillness::Moving);
    }
    let found = arm.stand(&mut detector, [0, 0], 300_000);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].index, arm.index - 299);
}

#[test]
fn a_restart_brings_the_same_pose_again() {
    let (mut arm, mut detector) = (Arm::at_rate(1_000), SettleDetector::new(CRITERIA));
    assert_eq!(arm.stand(&mut detector, [0, 0], 300_000).len(), 1);
    detector.restart();
    assert_eq!(arm.stand(&mut detector, [0, 0], 300_000).len(), 1);
}

#[test]
fn a_gap_in_the_samples_starts_the_time_anew() {
    let (mut arm, mut detector) = (Arm::at_rate(1_000), SettleDetector::new(CRITERIA));
    assert_eq!(arm.stand(&mut detector, [0, 0], 1_000).len(), 0);
    arm.t_us += 500_000;
    arm.index += 500;
    assert_eq!(detector.push(&arm.sample([0, 0], 30_000)), None, "nobody knows what the arm did in between");
}
