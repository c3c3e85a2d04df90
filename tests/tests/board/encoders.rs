//! Positions stay true however the counters wrap, and a count that was lost shows at the next index pulse.

use ballbar::{CounterWidth, ExtendedCounter, IndexCheck};
use ballbar_firmware::{ENCODERS, LatchedSample, LvdtScan, SampleQueue, Sampler};
use ballbar_tests::fake_hardware::{FakeAdc, FakeClock, FakeEncoders};
use proptest::collection::vec;
use proptest::prelude::*;

/// Counts between two samples that a 16-bit counter still tells apart, with room to spare.
const FASTEST: i64 = 32_000;

fn sixteen_bits(position: i64) -> u32 {
    u32::from(position as u16)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn the_extended_position_of_a_16_bit_counter_is_the_true_one(start in any::<u16>(), moves in vec(-FASTEST..=FASTEST, 1..500)) {
        let mut counter = ExtendedCounter::new(CounterWidth::Bits16, u32::from(start));
        let mut position = 0;
        for moved in moves {
            position += moved;
            prop_assert_eq!(i64::from(counter.update(sixteen_bits(i64::from(start) + position))), position);
        }
    }

    #[test]
    fn the_extended_position_of_a_32_bit_counter_is_the_true_one(start in any::<u32>(), moves in vec(any::<i32>(), 1..500)) {
        let mut counter = ExtendedCounter::new(CounterWidth::Bits32, start);
        let mut position = 0_i32;
        for moved in moves {
            position = position.wrapping_add(moved);
            prop_assert_eq!(counter.update(start.wrapping_add(position as u32)), position);
        }
    }

    #[test]
    fn a_position_shortly_before_or_after_the_last_is_the_true_one(start in any::<u16>(), moved in -FASTEST..=FASTEST, near in -700_i64..700) {
        let mut counter = ExtendedCounter::new(CounterWidth::Bits16, u32::from(start));
        counter.update(sixteen_bits(i64::from(start) + moved));
        prop_assert_eq!(i64::from(counter.position_at(sixteen_bits(i64::from(start) + moved + near))), moved + near);
    }

    #[test]
    fn index_pulses_whole_turns_apart_are_no_errors(
        first in -1_000_000..1_000_000_i32,
        per_index in 20..5_000_u32,
        turns in vec((-40..40_i32, -2..=2_i32), 0..50),
    ) {
        let mut check = IndexCheck::new(per_index);
        check.pulse(first);
        let mut position = first;
        for (turns, edge) in &turns {
            position += turns * per_index as i32;
            check.pulse(position + edge);
        }
        prop_assert_eq!((check.errors(), check.pulses()), (0, 1 + turns.len() as u32));
    }

    #[test]
    fn a_slip_beyond_the_tolerance_counts_once(
        first in -1_000_000..1_000_000_i32,
        per_index in 20..5_000_u32,
        before in vec(-40..40_i32, 0..20),
        slip in 5..10_i32,
        is_lost in any::<bool>(),
        after in vec(-40..40_i32, 1..20),
    ) {
        let mut check = IndexCheck::new(per_index);
        let mut position = first;
        check.pulse(position);
        for turns in before {
            position += turns * per_index as i32;
            check.pulse(position);
        }
        position += if is_lost { -slip } else { slip };
        for turns in after {
            position += turns * per_index as i32;
            check.pulse(position);
        }
        prop_assert_eq!(check.errors(), 1);
    }

    #[test]
    fn slips_after_a_restart_are_not_held_against_the_pulses_before(first in any::<i16>(), slip in any::<i16>()) {
        let mut check = IndexCheck::new(1_000);
        check.pulse(i32::from(first));
        check.restart();
        check.pulse(i32::from(first) + i32::from(slip));
        prop_assert_eq!((check.errors(), check.pulses()), (0, 2));
    }

    #[test]
    fn without_a_known_distance_pulses_are_counted_and_not_checked(positions in vec(any::<i32>(), 0..50)) {
        let mut check = IndexCheck::new(0);
        positions.iter().for_each(|&position| check.pulse(position));
        prop_assert_eq!((check.errors(), check.pulses()), (0, positions.len() as u32));
    }

    /// The queue is emptied only now and then, and sometimes too late: samples are lost then, and nothing else.
    #[test]
    fn the_sampler_hands_over_true_positions_also_when_samples_are_lost(
        start in any::<[u16; ENCODERS]>(),
        moves in vec([-FASTEST..=FASTEST, -FASTEST..=FASTEST, -9..=9_i64, -FASTEST..=FASTEST, -500..=500, -FASTEST..=FASTEST], 200..600),
        rounds in vec(1..150_usize, 1..20),
    ) {
        let mut queue = SampleQueue::new();
        let (producer, mut consumer) = queue.split();
        let room = consumer.capacity();
        let start = start.map(i64::from);
        let encoders = FakeEncoders { positions: start, ..FakeEncoders::default() };
        let mut sampler = Sampler::new(encoders, FakeAdc::default(), FakeClock::default(), producer);

        let mut fed = Vec::new();
        let mut position = [0; ENCODERS];
        let mut rounds = rounds.into_iter().cycle();
        let (mut until_emptied, mut waiting) = (rounds.next().unwrap(), 0);
        for (i, moved) in moves.into_iter().enumerate() {
            for joint in 0..ENCODERS {
                position[joint] += moved[joint];
            }
            let (encoders, adc, clock) = sampler.parts_mut();
            encoders.positions = std::array::from_fn(|joint| start[joint] + position[joint]);
            // A pulse in the middle of the way from the last sample.
            encoders.at_index = std::array::from_fn(|joint| (i % 7 == joint).then_some(encoders.positions[joint] - moved[joint] / 2));
            adc.input = LvdtScan { code: i as u16, saturated: false };
            clock.now_us = 200 * i as u64;
            sampler.tick();
            fed.push((position, std::array::from_fn(|joint| (i % 7 == joint).then_some(position[joint] - moved[joint] / 2))));

            waiting += usize::from(i > 0);
            until_emptied -= 1;
            if until_emptied == 0 {
                until_emptied = rounds.next().unwrap();
                let came: Vec<_> = std::iter::from_fn(|| consumer.dequeue()).collect();
                prop_assert_eq!(came.len(), waiting.min(room), "lost without need");
                for sample in &came {
                    let (position, at_index): ([i64; ENCODERS], [Option<i64>; ENCODERS]) = fed[sample.index as usize];
                    prop_assert_eq!(sample.positions.map(i64::from), position);
                    prop_assert_eq!(sample.at_index.map(|at| at.map(i64::from)), at_index);
                    prop_assert_eq!(sample.t_us, 200 * u64::from(sample.index));
                    prop_assert_eq!(sample.lvdt.code, sample.index as u16, "the LVDT of another sample");
                }
                let is_in_order = |pair: &[LatchedSample]| pair[1].index == pair[0].index + 1;
                prop_assert!(came.windows(2).all(is_in_order), "lost from the middle");
                waiting = 0;
            }
        }
    }
}

#[test]
fn a_conversion_that_is_not_done_in_time_saturates_its_own_sample_only() {
    let mut queue = SampleQueue::new();
    let (producer, mut consumer) = queue.split();
    let mut sampler = Sampler::new(FakeEncoders::default(), FakeAdc::default(), FakeClock::default(), producer);
    for i in 0..5 {
        sampler.parts_mut().1.is_stuck = i == 2;
        sampler.tick();
    }
    let saturated: Vec<_> = std::iter::from_fn(|| consumer.dequeue()).map(|sample| sample.lvdt.saturated).collect();
    assert_eq!(saturated, [false, false, true, false]);
}

#[test]
fn a_counter_that_wraps_through_both_ends_for_a_hundred_turns_ends_where_it_began() {
    let mut counter = ExtendedCounter::new(CounterWidth::Bits16, 65_000);
    let mut position = 0;
    // There and back, some fifty turns of the counter each way.
    for i in 0..2_000 {
        position += if i < 1_000 { 3_277 } else { -3_277 };
        assert_eq!(i64::from(counter.update(sixteen_bits(65_000 + position))), position);
    }
    assert_eq!(position, 0);
}
