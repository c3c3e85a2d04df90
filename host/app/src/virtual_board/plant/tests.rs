//! The plant by itself: what its inputs show along a script.

use ballbar::{CounterWidth, ExtendedCounter, Pairing, Vector3};

use super::*;
use crate::files::{open_rig, open_robot};
use crate::virtual_board::counters::COUNTER_WIDTHS;

use ballbar_calib::simulate::Shells;

const TRAVEL_M: f64 = 0.075;

fn puma() -> Robot {
    open_robot("puma560-optimised").unwrap()
}

fn plant() -> Plant {
    Plant::new(&puma(), TRAVEL_M, 1).unwrap()
}

/// Three poses of one pairing on a shell, and one of another pairing.
fn script(dwell_s: f64, revolute_deg_s: f64) -> Script {
    let (robot, rig) = (puma(), open_rig("triangles").unwrap());
    let pairings = rig.all_pairings();
    let stations = [(0, 3), (4, 1)].map(|(pairing, per_pairing)| {
        let shells = Shells {
            planned_with: &robot,
            truth: &robot,
            rig: &rig,
            pairings: &pairings[pairing..=pairing],
            bar_m: 0.46,
            per_pairing,
            sigma_m: 1e-4,
            seed: 3,
        };
        Script::from_shells(&shells, dwell_s, JointSpeed::default(), || ()).unwrap().stations
    });
    let speed = JointSpeed { revolute_rad_s: revolute_deg_s.to_radians(), ..JointSpeed::default() };
    Script { stations: stations.concat(), speed }
}

/// States every millisecond until the script is over.
fn states(mut plant: Plant, script: Script) -> Vec<(PlantState, [i32; ENCODERS], bool)> {
    plant.play(script);
    let mut states = Vec::new();
    for t_ms in 0.. {
        let state = plant.at(t_ms * 1_000);
        states.push((state, plant.counts(), matches!(plant.phase, Phase::Rest(_))));
        if plant.is_done() {
            break;
        }
    }
    states
}

#[test]
fn a_robot_at_rest_shows_the_station_and_the_true_length() {
    let (robot, script) = (puma(), script(1.0, 60.0));
    let (encoders, truth) = (joint_encoders(&robot).unwrap(), Kinematics::new(&robot.chain));
    let mut plant = plant();
    let mut t_us = 0;
    for station in &script.stations {
        plant.play(Script { stations: vec![*station], speed: script.speed });
        while !plant.is_done() {
            t_us += 1_000;
            plant.at(t_us);
        }
        let expected = encoders.counts(&station.q);
        for (found, expected) in plant.counts().iter().zip(expected) {
            assert!((f64::from(*found) - expected).abs() <= 0.5, "{found} for {expected}");
        }
        let codes = 400;
        let mean = (0..codes).map(|i| f64::from(plant.at(t_us + i).scan.code)).sum::<f64>() / codes as f64;
        let length_m = 0.46 + plant.lvdt().displacement_of_code_m::<f64>(mean).unwrap();
        let q = encoders.q(plant.counts().iter().map(|&counts| f64::from(counts)));
        let expected_m = truth.length(&q, &station.bar.unwrap().pairing) + station.length_error_m;
        assert!((length_m - expected_m).abs() < 0.5e-6, "{length_m} for {expected_m}");
    }
}

#[test]
fn counters_start_at_zero_and_extended_follow_the_robot_over_many_wraps() {
    let start = plant().counts();
    let states = states(plant(), script(0.2, 400.0));
    let mut wraps = 0;
    for i in 0..ENCODERS {
        let mut counter = ExtendedCounter::new(COUNTER_WIDTHS[i], 0);
        assert_eq!(states[0].0.latch.counters[i], 0);
        let mut before = 0;
        for (state, counts, _) in &states {
            let now = state.latch.counters[i];
            assert_eq!(counter.update(now), counts[i] - start[i]);
            let is_narrow = COUNTER_WIDTHS[i] == CounterWidth::Bits16;
            wraps += u32::from(is_narrow && now.abs_diff(before) > 40_000);
            assert!(!is_narrow || now < 65_536);
            before = now;
        }
    }
    assert!(wraps >= 4, "{wraps}");
}

#[test]
fn index_pulses_come_whole_turns_apart_and_as_often_as_turns_were_passed() {
    let robot = puma();
    let encoders = joint_encoders(&robot).unwrap();
    let states = states(plant(), script(0.2, 60.0));
    for (i, encoder) in encoders.encoders().iter().enumerate() {
        let mut counter = ExtendedCounter::new(COUNTER_WIDTHS[i], 0);
        let mut first = None;
        let mut pulses = 0;
        for (state, ..) in &states {
            counter.update(state.latch.counters[i]);
            let Some(at) = state.latch.at_index[i].map(|at| counter.position_at(at)) else { continue };
            let apart = at - *first.get_or_insert(at);
            assert_eq!(apart.unsigned_abs() % encoder.counts_per_index, 0);
            pulses += 1;
        }
        let way: u32 = states.windows(2).map(|pair| pair[0].1[i].abs_diff(pair[1].1[i])).sum();
        assert!(way / encoder.counts_per_index <= pulses + 8, "{way} counts, {pulses} pulses");
    }
}

#[test]
fn the_arm_rings_after_a_move_and_then_stands() {
    let states = states(plant(), script(1.0, 60.0));
    let arrived = states.iter().rposition(|(.., is_rest)| !is_rest).unwrap() + 1;
    let spread = |range: std::ops::Range<usize>| {
        let codes = states[range].iter().map(|(state, ..)| i32::from(state.scan.code));
        codes.clone().max().unwrap() - codes.min().unwrap()
    };
    assert!(spread(arrived..arrived + 80) > 64);
    assert!(spread(arrived + 500..arrived + 999) < 16);
    assert!(states[arrived + 500..].windows(2).all(|pair| pair[0].1 == pair[1].1));
}

#[test]
fn the_bar_is_off_until_it_is_first_attached_and_between_pairings() {
    let states = states(plant(), script(0.3, 60.0));
    let is_off = |state: &PlantState| state.scan.saturated && (state.scan.code == 0 || state.scan.code == u16::MAX);
    let first_rest = states.iter().skip(1).position(|(.., is_rest)| *is_rest).unwrap() + 1;
    assert!(states[1..first_rest].iter().all(|(state, ..)| is_off(state)));
    assert!(states.iter().skip(first_rest).filter(|(.., is_rest)| *is_rest).all(|(state, ..)| !state.scan.saturated));
    let last_move = states.iter().rposition(|(.., is_rest)| !is_rest).unwrap();
    assert!(is_off(&states[last_move].0));
}

#[test]
fn the_same_seed_gives_the_same_states() {
    let run = |seed| states(Plant::new(&puma(), TRAVEL_M, seed).unwrap(), script(0.2, 200.0));
    assert_eq!(run(5), run(5));
    assert_ne!(run(5), run(6));
}

#[test]
fn a_script_takes_the_place_of_the_one_before() {
    let mut plant = plant();
    let q = JointVector::zero();
    let pairing = Pairing { chuck_base_m: Vector3::zeros(), sphere_tool_m: Vector3::zeros() };
    let bar = Some(AttachedBar { pairing, mid_m: 1.0 });
    let station = Station { q, bar, dwell_s: 100.0, length_error_m: 0.0 };
    let script = |dwell_s| Script { stations: vec![Station { dwell_s, ..station }], speed: JointSpeed::default() };
    assert!(plant.is_done());
    plant.play(script(100.0));
    assert!(!plant.is_done());
    plant.at(1_000_000);
    plant.play(script(1.0));
    plant.at(2_000_000);
    assert!(!plant.is_done());
    plant.at(2_100_000);
    assert!(plant.is_done());
}

#[test]
fn robots_that_no_board_can_count_are_refused() {
    let error = Plant::new(&open_robot("ur5e").unwrap(), TRAVEL_M, 0).unwrap_err();
    assert!(matches!(error, PlantError::NoEncoders(_)));
}
