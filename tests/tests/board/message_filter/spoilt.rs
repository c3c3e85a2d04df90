//! Messages with one field that cannot be true: each is refused, counted once, and costs nothing that follows.

use ballbar::wire::Stream;
use host_cal::board::RefusedMessages;

use super::{Board, greeted, poses_of, samples_of, settled_of, take};

/// A change that makes a message one that cannot be true, and the counter that it goes to.
type Spoils = (&'static str, fn(&mut Board) -> Stream, fn(&mut Stream), fn(&RefusedMessages) -> u64);

fn wrong_count(refused: &RefusedMessages) -> u64 {
    refused.wrong_count
}

fn not_finite(refused: &RefusedMessages) -> u64 {
    refused.not_finite
}

fn out_of_range(refused: &RefusedMessages) -> u64 {
    refused.out_of_range
}

fn went_back(refused: &RefusedMessages) -> u64 {
    refused.went_back
}

const SPOILT: &[Spoils] = &[
    ("two means", Board::settled, |s| settled_of(s).counts_mean.truncate(2), wrong_count),
    ("two deviations", Board::settled, |s| settled_of(s).counts_std.truncate(2), wrong_count),
    (
        "two of both",
        Board::settled,
        |s| (settled_of(s).counts_mean.truncate(2), settled_of(s).counts_std.truncate(2)).0,
        wrong_count,
    ),
    ("eight means", Board::settled, |s| settled_of(s).counts_mean.extend([0.0; 2]), wrong_count),
    ("no encoders", Board::samples, |s| samples_of(s).first.counts.clear(), wrong_count),
    ("a short step", Board::samples, |s| samples_of(s).rest[7].counts.truncate(5), wrong_count),
    ("a mean NaN", Board::settled, |s| settled_of(s).counts_mean[3] = f64::NAN, not_finite),
    ("a mean infinite", Board::settled, |s| settled_of(s).counts_mean[0] = f64::NEG_INFINITY, not_finite),
    ("a deviation NaN", Board::settled, |s| settled_of(s).counts_std[5] = f32::NAN, not_finite),
    ("the code NaN", Board::settled, |s| settled_of(s).code_mean = f64::NAN, not_finite),
    ("the code's deviation infinite", Board::settled, |s| settled_of(s).code_std = f32::INFINITY, not_finite),
    ("a position NaN", Board::poses, |s| poses_of(s).poses[2].pose.position_m[1] = f32::NAN, not_finite),
    ("an axis NaN", Board::poses, |s| poses_of(s).poses[7].pose.y_axis[0] = f32::NAN, not_finite),
    ("a displacement infinite", Board::poses, |s| poses_of(s).poses[0].displacement_m = Some(f32::INFINITY), not_finite),
    ("a mean no encoder has", Board::settled, |s| settled_of(s).counts_mean[1] = 1e300, out_of_range),
    ("a deviation below zero", Board::settled, |s| settled_of(s).counts_std[1] = -1.0, out_of_range),
    ("a code no converter has", Board::settled, |s| settled_of(s).code_mean = 65_536.0, out_of_range),
    ("one sample", Board::settled, |s| settled_of(s).samples = 1, out_of_range),
    ("too many samples for its time", Board::settled, |s| settled_of(s).samples = 400_000_000, out_of_range),
    ("the end of time", Board::settled, |s| settled_of(s).t_us = u64::MAX, out_of_range),
    ("an hour ahead", Board::settled, |s| settled_of(s).t_us += 3_600_000_000, out_of_range),
    ("samples a year ahead", Board::samples, |s| samples_of(s).first.t_us += 31_000_000_000_000, out_of_range),
    ("a code beyond 16 bits", Board::samples, |s| samples_of(s).rest[0].code = 40_000, out_of_range),
    ("no time between samples", Board::samples, |s| samples_of(s).rest[4].dt_us = 0, out_of_range),
    ("axes that are none", Board::poses, |s| poses_of(s).poses[1].pose.x_axis = [0.0; 3], out_of_range),
    ("a tool at 3.4e38 m", Board::poses, |s| poses_of(s).poses[1].pose.position_m[2] = f32::MAX, out_of_range),
    ("no poses", Board::poses, |s| poses_of(s).poses.clear(), out_of_range),
    ("dropped at once", Board::samples, |s| s.dropped = 1 << 31, out_of_range),
    ("dropped less than before", Board::samples, |s| s.dropped = u32::MAX, out_of_range),
    ("overruns at once", Board::samples, |s| s.overruns = 1 << 30, out_of_range),
    ("overruns less than before", Board::samples, |s| s.overruns = u32::MAX, went_back),
    ("a number far ahead", Board::samples, |s| s.sequence = s.sequence.wrapping_add(1 << 16), out_of_range),
    ("a number half around", Board::settled, |s| s.sequence = s.sequence.wrapping_add(1 << 31), went_back),
    ("a number back", Board::samples, |s| s.sequence = s.sequence.wrapping_sub(70_000), went_back),
    ("an index back", Board::samples, |s| samples_of(s).first.index = 3, went_back),
    ("a time back", Board::settled, |s| settled_of(s).t_us = 17, went_back),
];

#[test]
fn what_cannot_be_true_is_refused_and_nothing_that_follows() {
    for (what, make, spoil, counter) in SPOILT {
        let (mut filter, mut board) = (greeted(), Board::at(100_000, 500_000, 600_000_000));
        for n in 0..9 {
            take(&mut filter, &board.nth(n)).unwrap();
        }
        let sound = make(&mut board);
        let mut spoilt = sound.clone();
        spoil(&mut spoilt);
        assert!(take(&mut filter, &spoilt).is_err(), "{what}");
        assert_eq!((counter(&filter.losses().refused), filter.losses().refused.all()), (1, 1), "{what}");
        // The message itself, should it come all the same, and what follows it.
        assert_eq!(take(&mut filter, &sound), Ok(()), "behind {what}");
        for n in 0..9 {
            assert_eq!(take(&mut filter, &board.nth(n)), Ok(()), "behind {what}");
        }
        let losses = filter.losses();
        assert_eq!((losses.missing, losses.overruns, losses.lost()), (0, 0, 1), "{what}: {losses:?}");
    }
}

#[test]
fn a_message_that_is_refused_is_not_missing_as_well() {
    for (what, make, spoil, _) in SPOILT {
        let (mut filter, mut board) = (greeted(), Board::at(100_000, 500_000, 600_000_000));
        for n in 0..9 {
            take(&mut filter, &board.nth(n)).unwrap();
        }
        let before = board.sequence;
        let mut spoilt = make(&mut board);
        let is_number_sound = {
            let number = spoilt.sequence;
            spoil(&mut spoilt);
            spoilt.sequence == number && spoilt.dropped == 0 && spoilt.overruns < 1 << 31
        };
        take(&mut filter, &spoilt).unwrap_err();
        for n in 0..9 {
            take(&mut filter, &board.nth(n)).unwrap();
        }
        assert_eq!(board.sequence, before + 10);
        let losses = filter.losses();
        assert_eq!(losses.missing, u64::from(!is_number_sound), "{what}: {losses:?}");
        assert!(losses.lost() <= 2, "{what}: never four billion: {losses:?}");
    }
}
