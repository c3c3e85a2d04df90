//! What the board streams is what was measured: no sample changed, every loss counted, poses by the parameters in use.

use ballbar::wire::{Answer, Command, Event, ParameterSet, PoseBatch, Stream, StreamSelection};
use ballbar::{Coupling, Encoder, JointEncoders, Kinematics, LvdtReading, Sample, SettledPose, StillnessCriteria};
use ballbar_firmware::{ENCODERS, ParameterFlash};
use ballbar_tests::fake_board::FakeBoard;
use ballbar_tests::fake_hardware::{FULL_SPEED, FakeEncoders, empty_memory};
use ballbar_tests::parameter_sets::{calibrated_puma, curve, puma};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SAMPLES: StreamSelection = StreamSelection { samples: true, settled: false, poses: false };
const POSES: StreamSelection = StreamSelection { samples: false, settled: false, poses: true };

/// Moves every encoder and the LVDT at random, and takes a sample; the main loop may come later.
fn shake(board: &mut FakeBoard<impl ParameterFlash>, rng: &mut ChaCha8Rng, fastest: i64) {
    for position in &mut board.encoders().positions {
        *position += rng.random_range(-fastest..=fastest);
    }
    board.adc().input.code = rng.random();
    board.adc().input.saturated = rng.random_ratio(1, 500);
    board.sample();
}

fn samples_of(streams: &[Stream]) -> Vec<Sample> {
    let batches = streams.iter().filter_map(|stream| match &stream.event {
        Event::Samples(batch) => Some(batch.samples()),
        _ => None,
    });
    batches.flatten().collect()
}

fn poses_of(streams: &[Stream]) -> Vec<PoseBatch> {
    streams.iter().filter_map(|stream| if let Event::Poses(batch) = &stream.event { Some(batch.clone()) } else { None }).collect()
}

fn settled_of(streams: &[Stream]) -> Vec<SettledPose> {
    streams.iter().filter_map(|stream| if let Event::Settled(pose) = &stream.event { Some(pose.clone()) } else { None }).collect()
}

fn assert_all_as_fed(board: &FakeBoard<impl ParameterFlash>, samples: &[Sample]) {
    for sample in samples {
        assert_eq!(*sample, board.fed[sample.index as usize]);
    }
}

/// Numbers without a gap, and nothing said to be lost.
fn assert_whole(streams: &[Stream]) {
    for pair in streams.windows(2) {
        assert_eq!(pair[1].sequence, pair[0].sequence.wrapping_add(1));
    }
    assert!(streams.iter().all(|stream| (stream.dropped, stream.overruns) == (0, 0)));
}

#[test]
fn sixty_thousand_samples_that_wrap_their_counters_arrive_as_they_were() {
    let mut rng = ChaCha8Rng::seed_from_u64(16);
    let positions = std::array::from_fn(|_| i64::from(rng.random::<u16>()));
    let mut board = FakeBoard::starting_at(FakeEncoders { positions, ..FakeEncoders::default() }, empty_memory()).settle_in();
    board.ask(Command::StartStream(SAMPLES)).unwrap();
    let first = board.fed.len();
    for i in 0..60_000 {
        // At times as fast as a 16-bit counter can tell, at times slowly.
        shake(&mut board, &mut rng, if i % 3_000 < 1_500 { 32_000 } else { 40 });
        board.poll();
    }
    board.ask(Command::StopStream).unwrap();
    let streams = board.take_streamed();
    assert_whole(&streams);
    let samples = samples_of(&streams);
    assert_all_as_fed(&board, &samples);
    assert!(samples[0].index as usize <= first && samples.len() >= 60_000, "{} samples", samples.len());
    assert!(samples.windows(2).all(|pair| pair[1].index == pair[0].index + 1));
}

#[test]
fn every_mix_of_streams_brings_what_was_asked_for_and_nothing_else() {
    for mix in 1..8_u8 {
        let selection = StreamSelection { samples: mix & 1 != 0, settled: mix & 2 != 0, poses: mix & 4 != 0 };
        let mut board = FakeBoard::new().settle_in();
        board.commit(&puma()).unwrap();
        board.ask(Command::SetStillness(StillnessCriteria { hold_us: 100_000, ..StillnessCriteria::default() })).unwrap();
        board.ask(Command::StartStream(selection)).unwrap();
        let first = board.fed.len();
        for pose in 1..=3 {
            board.encoders().positions = [pose * 1_000; ENCODERS];
            board.run(500);
        }
        board.ask(Command::StopStream).unwrap();
        // Some samples pass while the two answers are on their way.
        let fed = board.fed.len() - first;
        let streams = board.take_streamed();
        assert_whole(&streams);

        let samples = samples_of(&streams);
        assert_all_as_fed(&board, &samples);
        assert!(if selection.samples { samples.len().abs_diff(fed) < 20 } else { samples.is_empty() }, "{selection:?}");
        let poses: usize = poses_of(&streams).iter().map(|batch| batch.poses.len()).sum();
        assert!(if selection.poses { poses.abs_diff(fed) < 20 } else { poses == 0 }, "{selection:?}: {poses} of {fed}");
        let settled: Vec<_> = settled_of(&streams).iter().map(|pose| pose.counts_mean[5]).collect();
        // The pose at which the arm stood before may still settle under the new criteria.
        assert_eq!(settled.iter().filter(|&&mean| mean > 0.0).count(), if selection.settled { 3 } else { 0 }, "{selection:?}");
    }
}

fn encoders_in_f64(set: &ParameterSet) -> JointEncoders<f64> {
    let encoder = |encoder: &Encoder<f32>| Encoder {
        counts_per_unit: f64::from(encoder.counts_per_unit),
        counts_per_index: encoder.counts_per_index,
    };
    let coupling = |coupling: &Coupling<f32>| Coupling {
        joint: coupling.joint,
        driven_by: coupling.driven_by,
        ratio: f64::from(coupling.ratio),
    };
    let encoders: Vec<_> = set.encoders.iter().map(encoder).collect();
    let couplings: Vec<_> = set.couplings.iter().map(coupling).collect();
    JointEncoders::new(&encoders, &couplings).unwrap()
}

#[test]
fn streamed_poses_are_those_of_the_parameters_in_f64_at_every_rate() {
    let set = puma();
    let chain = set.chain().unwrap().cast::<f64>();
    let kinematics = Kinematics::new(&chain);
    let encoders = encoders_in_f64(&set);
    let mut worst_m = 0.0_f64;

    for rate_hz in [100, 999, 1_000, 1_001, 1_999, 2_000, 3_333, 5_000] {
        let mut rng = ChaCha8Rng::seed_from_u64(u64::from(rate_hz));
        let mut board = FakeBoard::new().settle_in();
        board.commit(&set).unwrap();
        board.machine().link.bytes_per_s = 10 * FULL_SPEED;
        board.ask(Command::SetRate { rate_hz }).unwrap();
        board.ask(Command::StartStream(POSES)).unwrap();
        board.take_streamed();
        for _ in 0..rate_hz {
            for position in &mut board.encoders().positions {
                // Up to three radians either side.
                *position = (*position + rng.random_range(-9_000..9_000)).clamp(-30_000, 30_000);
            }
            board.adc().input.code = rng.random();
            board.run(1);
        }
        board.run(200);
        let streams = board.take_streamed();
        assert_whole(&streams);
        let mut poses = 0;
        for batch in poses_of(&streams) {
            for (k, streamed) in batch.poses.iter().enumerate() {
                let sample = &board.fed[batch.index as usize + k * usize::from(batch.stride)];
                assert_eq!(batch.t_us + u64::from(streamed.dt_us), sample.t_us);
                let q = encoders.q(sample.counts.iter().map(|&counts| f64::from(counts)));
                let expected = kinematics.base_from_tool(&q);
                for i in 0..3 {
                    let error_m = (f64::from(streamed.pose.position_m[i]) - expected.translation_m[i]).abs();
                    worst_m = worst_m.max(error_m);
                    assert!((f64::from(streamed.pose.x_axis[i]) - expected.rotation[(i, 0)]).abs() < 3e-6);
                    assert!((f64::from(streamed.pose.y_axis[i]) - expected.rotation[(i, 1)]).abs() < 3e-6);
                }
                let displacement_m: Option<f64> = curve().displacement_m(sample.lvdt).ok();
                assert_eq!(streamed.displacement_m.is_some(), displacement_m.is_some());
                let error_m = streamed.displacement_m.map_or(0.0, f64::from) - displacement_m.unwrap_or(0.0);
                assert!(error_m.abs() < 1e-8);
                poses += 1;
            }
        }
        // In a second and its fifth: half of the rate at least, never more than a thousand a second.
        let most = 1_000 + 1_000 * 200 / usize::from(rate_hz) + 2;
        assert!(poses <= most && poses >= usize::from(rate_hz).min(1_000) / 2, "{rate_hz} Hz: {poses} poses");
    }
    println!("worst: {:.3} µm", worst_m * 1e6);
    assert!(worst_m < 1e-6, "{:.3} µm", worst_m * 1e6);
}

#[test]
fn a_slow_link_loses_whole_batches_and_nobody_is_left_in_the_dark() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut board = FakeBoard::new().settle_in();
    board.ask(Command::StartStream(SAMPLES)).unwrap();
    let mut answers = 0;
    for round in 0..20 {
        board.machine().link.bytes_per_s = [2_000, 8_000, 0, 30_000][round % 4];
        for _ in 0..1_000 {
            shake(&mut board, &mut rng, 20_000);
            board.poll();
        }
        if board.machine().link.bytes_per_s >= 8_000 {
            // The answer comes through although the stream takes all that the link has.
            assert_eq!(board.ask(Command::SetRate { rate_hz: 1_000 }), Ok(Answer::Done));
            answers += 1;
        }
    }
    board.machine().link.bytes_per_s = FULL_SPEED;
    board.run(1_000);
    let fed = board.fed.len();
    let status = board.status();
    board.ask(Command::StopStream).unwrap();
    let streams = board.take_streamed();

    assert_eq!(answers, 10);
    assert!(status.overruns == 0 && status.samples as usize >= fed, "sampling waited for the link");
    assert!(status.dropped > 300, "{}", status.dropped);
    for pair in streams.windows(2) {
        let gap = pair[1].sequence - pair[0].sequence - 1;
        assert_eq!(gap, pair[1].dropped - pair[0].dropped, "a message that is missing was not counted");
    }
    assert_eq!(streams.last().unwrap().dropped, status.dropped);
    assert_all_as_fed(&board, &samples_of(&streams));
}

#[test]
fn samples_that_the_main_loop_was_too_slow_for_are_counted_in_the_stream_and_the_status() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let mut board = FakeBoard::new().settle_in();
    board.ask(Command::StartStream(SAMPLES)).unwrap();
    let mut lost = 0;
    for round in 0..50 {
        let asleep = 20 + 3 * round;
        for _ in 0..asleep {
            shake(&mut board, &mut rng, 32_000);
        }
        board.poll();
        lost += u32::saturating_sub(asleep, 63);
    }
    board.run(200);
    assert_eq!(board.status().overruns, lost);
    board.ask(Command::StopStream).unwrap();
    let streams = board.take_streamed();
    assert_eq!(streams.last().unwrap().overruns, lost);

    let samples = samples_of(&streams);
    assert_all_as_fed(&board, &samples);
    let missing: u32 = samples.windows(2).map(|pair| pair[1].index - pair[0].index - 1).sum();
    assert_eq!(missing, lost, "what is missing in the stream is what was counted");
}

#[test]
fn presets_rates_and_parameters_that_change_within_a_stream_spoil_no_sample() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut board = FakeBoard::new().settle_in();
    board.commit(&puma()).unwrap();
    board.machine().link.bytes_per_s = 10 * FULL_SPEED;
    board.ask(Command::StartStream(StreamSelection { samples: true, settled: true, poses: true })).unwrap();
    let mut offsets = [0; ENCODERS];
    for round in 0..60 {
        let joint = round % ENCODERS;
        let command = match round % 4 {
            0 | 1 => Command::PresetEncoder { joint: joint as u8, counts: 1_000_000 },
            2 => Command::SetRate { rate_hz: [200, 3_000, 1_000][round % 3] },
            _ => Command::WriteParameters(calibrated_puma()),
        };
        let is_preset = matches!(command, Command::PresetEncoder { .. });
        assert!(board.ask(command).is_ok());
        // The arm stands while it is asked; what left before the answer has the positions from before it.
        board.streamed.clear();
        if is_preset {
            offsets[joint] = 1_000_000 - board.fed.last().unwrap().counts[joint];
        }
        for _ in 0..rng.random_range(1..100) {
            shake(&mut board, &mut rng, 300);
            board.poll();
        }
        board.run(2);
        for sample in samples_of(&board.take_streamed()) {
            let raw = &board.fed[sample.index as usize];
            assert_eq!((sample.t_us, sample.lvdt), (raw.t_us, raw.lvdt), "round {round}");
            let offset = |joint: usize| sample.counts[joint] - raw.counts[joint];
            assert_eq!(std::array::from_fn(offset), offsets, "round {round}");
        }
    }
}

#[test]
fn a_settled_pose_is_the_mean_of_the_samples_that_were_streamed_with_it() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let mut board = FakeBoard::new().settle_in();
    board.ask(Command::StartStream(StreamSelection { samples: true, settled: true, poses: false })).unwrap();
    board.encoders().positions[3] = 70_000;
    for _ in 0..2_000 {
        board.encoders().positions[0] = 500 + rng.random_range(0..=3);
        board.adc().input.code = 40_000 + rng.random_range(0..=60);
        board.run(1);
    }
    board.ask(Command::StopStream).unwrap();
    let streams = board.take_streamed();
    let (samples, settled) = (samples_of(&streams), settled_of(&streams));
    let pose = settled.last().expect("never settled");
    let averaged: Vec<_> =
        samples.iter().filter(|sample| (pose.index..pose.index + pose.samples).contains(&sample.index)).collect();
    assert_eq!(averaged.len(), pose.samples as usize);
    let mean = |value: &dyn Fn(&Sample) -> f64| averaged.iter().map(|sample| value(sample)).sum::<f64>() / averaged.len() as f64;
    assert!((pose.counts_mean[0] - mean(&|sample| f64::from(sample.counts[0]))).abs() < 1e-9);
    assert_eq!(pose.counts_mean[3], 70_000.0);
    assert!((pose.code_mean - mean(&|sample| f64::from(sample.lvdt.code))).abs() < 1e-9);
    assert!(averaged.iter().all(|sample| sample.lvdt != LvdtReading::default()));
}
