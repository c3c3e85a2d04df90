//! The firmware's image on an emulated Cortex-M4F, and the `host-cal` command at the other end of its serial port.
#![cfg(unix)]

use std::sync::{Mutex, MutexGuard, PoisonError};

use ballbar::Kinematics;
use ballbar_firmware::ENCODERS;
use ballbar_tests::at_length::at_length;
use ballbar_tests::emulator::{EmulatedBoard, is_skipped};
use ballbar_tests::scenarios::{self, Bench, host_cal, host_cal_run};
use ballbar_tests::simulated_cell::{self, DESIGN, SHORT_PLAN, SimulatedCell, poses_of};
use host_cal::files::read_poses;
use host_cal::virtual_board::{Driven, Plant, Script, driver};
use serde_json::Value;

/// A board, and the turn to have one: two that run at once on a machine of two cores take longer than one after the other.
struct Emulated(EmulatedBoard, #[expect(dead_code, reason = "held, not read")] MutexGuard<'static, ()>);

impl Bench for Emulated {
    fn board(&self) -> &'static str {
        "an386"
    }

    fn port(&self) -> String {
        self.0.port().to_owned()
    }
}

/// A board that was just switched on, and a plant as the robot stands at that moment; none when boards are to be skipped.
fn power_up(seed: u64) -> Option<(Emulated, Plant)> {
    power_up_driven(seed, None)
}

/// The same with somebody who drives the robot.
fn power_up_driven(seed: u64, driven: Option<Driven>) -> Option<(Emulated, Plant)> {
    static TURN: Mutex<()> = Mutex::new(());
    if is_skipped() {
        return None;
    }
    // A test that failed was the last user of its board all the same.
    let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let plant = scenarios::plant(seed);
    Some((Emulated(EmulatedBoard::start_driven(plant.clone(), driven), turn), plant))
}

/// One board through its life: greeted, given parameters, reset, streaming a minute at 1 kHz, streaming over a bad line, and led
/// astray by its plant.
#[test]
fn a_board_serves_its_host() {
    let Some((bench, plant)) = power_up(1) else { return };
    scenarios::greets_the_host(&bench);
    scenarios::keeps_parameters_over_a_reset(&bench, &plant);
    assert_eq!(bench.0.own_resets(), 1);
    scenarios::brings_back_the_parameters_before(&bench);
    assert_eq!(bench.0.own_resets(), 2);
    scenarios::home_at_rest(&bench, &plant);
    streams_a_minute(&bench);
    loses_damaged_frames_only(&bench);
    tells_of_a_panic(&bench);
    tells_of_the_reset_button(&bench);
}

fn streams_a_minute(bench: &Emulated) {
    let script = scenarios::script(12, 4.5, 3);
    bench.0.play_with_stream(script.clone());
    let (_, recording) = scenarios::record(bench, script.stations.len(), &["--rate", "1000"]);
    let ticks = bench.0.ticks();
    recording.has_every_sample(60_000);
    recording.has_true_samples(&ticks);
    recording.has_true_means(&ticks);
    recording.has_true_stations(&script);
}

/// The damaged frames are counted, each of them, and what was in the others arrives.
fn loses_damaged_frames_only(bench: &Emulated) {
    const DAMAGED: [usize; 6] = [3, 4, 5, 40, 77, 120];
    let script = scenarios::script(4, 1.3, 5);
    bench.0.play_with_stream(script.clone());
    bench.0.line().record(&DAMAGED);
    let (run, recording) = scenarios::record(bench, script.stations.len(), &["--rate", "1000"]);
    let streamed = bench.0.line().recorded();

    assert_eq!(run.code, 1, "losses are told by the exit code: {}", recording.report);
    let (frames, losses) = (&recording.report["frames"], &recording.report["losses"]);
    let damaged = ["crc", "malformed", "overlong", "not_understood"].map(|kind| frames[kind].as_u64().expect("a count"));
    assert_eq!(damaged.iter().sum::<u64>(), DAMAGED.len() as u64, "{frames}");
    assert_eq!(losses["lost_on_line"], DAMAGED.len());
    assert_eq!(losses["missing"], DAMAGED.len());
    let whole = streamed.iter().filter(|streamed| !streamed.is_damaged);
    let expected: Vec<_> = whole.flat_map(|streamed| samples_of(&streamed.message)).collect();
    assert!(streamed.len() > DAMAGED[5]);
    assert_eq!(recording.samples, expected);
    recording.has_true_samples(&bench.0.ticks());
}

fn samples_of(message: &ballbar::wire::Stream) -> Vec<ballbar::Sample> {
    match &message.event {
        ballbar::wire::Event::Samples(batch) => batch.samples().collect(),
        _ => Vec::new(),
    }
}

/// A plant that is out of step makes the driver panic; the next hello says where and why.
fn tells_of_a_panic(bench: &Emulated) {
    bench.0.answer_nonsense();
    bench.0.wait_for_own_resets(3);
    let started_by = started_by(bench);
    assert!(started_by.starts_with("a PANIC of the firmware: plant_link.rs:"), "{started_by}");
    assert!(started_by.ends_with("plant out of step: flags 0x80"), "{started_by}");
    // Told once: the next start is told of by its own reason.
    host_cal_run(bench, "status", &["--reset"]);
    assert_eq!(self::started_by(bench), "a reset that was asked for");
}

fn tells_of_the_reset_button(bench: &Emulated) {
    bench.0.press_reset();
    assert_eq!(started_by(bench), "the reset pin");
}

fn started_by(bench: &Emulated) -> String {
    let status = host_cal_run(bench, "status", &[]).json();
    status["started_by"].as_str().expect("a text").to_owned()
}

/// Minutes of the robot at 100 Hz with everything streamed, more than three, and at length ten: no memory is used up, nothing is lost,
/// and all poses of the tool are right.
#[test]
fn minutes_leave_the_board_as_it_was() {
    const STAY_S: usize = 19;
    let Some((bench, plant)) = power_up(2) else { return };
    scenarios::make_ready(&bench, &plant);
    let everything = ["--rate", "100", "--pose"];
    let stations = scenarios::script(at_length(10).min(30), STAY_S as f64, 7).stations;
    let (first, rest) = stations.split_at(3);

    let play = |bench: &Emulated, stations: &[_]| {
        let script = Script { stations: stations.to_vec(), ..scenarios::script(0, 1.0, 7) };
        bench.0.play_with_stream(script.clone());
        let (_, recording) = scenarios::record(bench, stations.len(), &everything);
        recording.has_true_stations(&script);
        recording
    };
    play(&bench, first);
    // A status shows the stack as the one before has left it.
    host_cal_run(&bench, "status", &[]);
    let early = host_cal_run(&bench, "status", &[]).json();
    let recording = play(&bench, rest);
    let late = host_cal_run(&bench, "status", &[]).json();

    let ticks = bench.0.ticks();
    // With its way to it, a station takes a second more; a recording ends within its last stay.
    let least_s = (STAY_S + 1) * stations.len();
    assert!(ticks.len() >= 100 * least_s, "{} ticks", ticks.len());
    recording.has_every_sample(100 * (STAY_S * rest.len() - 13));
    recording.has_true_samples(&ticks);
    recording.has_true_means(&ticks);
    assert!(recording.poses.len() + 10 > recording.samples.len());
    let largest_m = recording.has_true_poses(&ticks);
    println!("largest difference of a tool pose: {:.3} µm", largest_m * 1e6);

    println!("stack never used: {} bytes", late["stack_unused_bytes"]);
    assert_eq!(late["stack_unused_bytes"], early["stack_unused_bytes"]);
    assert!(late["uptime_s"].as_f64().expect("a number") > least_s as f64);
    // On its way between far stations the bar leaves its travel.
    let saturated = ticks[1..].iter().filter(|tick| tick.scan.saturated).count();
    assert_eq!(late["lvdt_faults"], saturated);
    for counter in ["overruns", "dropped", "started_by"] {
        assert_eq!(late[counter], early[counter], "{counter}");
    }
    for counter in ["crc", "malformed", "missing"] {
        assert_eq!(late["frames"][counter], early["frames"][counter], "frames: {counter}");
    }
    let index_errors = |status: &Value| -> Vec<Value> {
        status["encoders"].as_array().expect("a list").iter().map(|encoder| encoder["index_errors"].clone()).collect()
    };
    assert_eq!(index_errors(&late), vec![Value::from(0); ENCODERS]);
    assert_eq!(bench.0.own_resets(), 0);
    assert_eq!(host_cal(&bench, "pose", &[])["homed"], true);
}

/// A plan is walked with the board's own image watching the robot: every row once, nothing lost, and each length is the true one at
/// the joint values beside it.
#[test]
fn a_plan_is_collected() {
    /// Two steps of the LVDT's code, and what is left of the arm's ringing.
    const WITHIN_M: f64 = 3e-6;
    let (driver, driven) = driver();
    let Some((bench, plant)) = power_up_driven(4, Some(driven)) else { return };
    scenarios::make_ready(&bench, &plant);
    host_cal(&bench, "apply", &["--robot", DESIGN, "--uncalibrated"]);
    let address = simulated_cell::listen(driver, simulated_cell::controller());
    let port = bench.port();
    let cell = SimulatedCell::around(bench, &port, address, &SHORT_PLAN);

    let still = ["--band-counts", "1", "--band-codes", "24"];
    let run = cell.collect_as("session", &[&["--speed-deg-s", "90", "--rate", "200", "--json"][..], &still].concat());
    assert_eq!(run.code, 0, "{}", run.transcript());
    let report = run.json();
    assert_eq!((&report["measured"], &report["troubles"]), (&poses_of(&SHORT_PLAN).into(), &serde_json::json!([])));
    assert_eq!((&report["losses"]["missing"], &report["losses"]["overruns"]), (&0.into(), &0.into()));
    cell.assert_all_measured("session");

    let (truth, rig) = (simulated_cell::truth(), simulated_cell::rig());
    let kinematics = Kinematics::new(&truth.chain);
    let poses = read_poses([cell.path("session/poses.csv").as_path()], &truth, &rig).unwrap();
    let off_m = |m: ballbar::Measurement<f64>| (m.length_m - kinematics.length(&m.q, &m.pairing)).abs();
    let largest_m = poses.measurements().into_iter().map(off_m).fold(0.0, f64::max);
    println!("largest error of a length: {:.2} µm", largest_m * 1e6);
    assert!(largest_m < WITHIN_M, "{largest_m}");
    assert_eq!(cell.board.0.own_resets(), 0);
}
