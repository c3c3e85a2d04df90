//! Measuring while the robot moves, beside stopping at every pose of the same plan: what it gains and costs, and the LVDT's lag.
#![cfg(unix)]

use std::time::Duration;

use ballbar_calib::identify::{FitOptions, fit};
use ballbar_calib::model::Dataset;
use ballbar_calib::simulate::tool_error;
use ballbar_tests::simulated_cell::{SimulatedCell, column, controller, design, plan_text, plant, rig, truth};
use host_cal::files::read_poses;
use host_cal::virtual_board::ControllerOptions;
use serde_json::Value;

/// What the ends of the bar play, standard deviation.
const SIGMA_M: f64 = 7e-5;
const BACKLASH_DEG: f64 = 0.004;
const LAG_MS: f64 = 4.0;
/// What the arm takes to stand still and be measured: time that is of the robot, and not of the host that waits for it.
const STANDING_S: f64 = 0.6;

/// What a way of collecting came to.
struct Way {
    cell: SimulatedCell,
    report: Value,
    poses: Dataset,
    robot_s: f64,
}

/// What a fit came to.
#[derive(Debug)]
struct Fitted {
    rms_mm: f64,
    /// RMS distance of the tool from where it is, over the joints' ranges.
    tool_mm: f64,
}

/// The plan, walked by a robot that stands so long after each move.
fn collect(plan: &str, dwell_s: f64, more: &[&str]) -> Way {
    let plant = plant(5).with_backlash(BACKLASH_DEG.to_radians()).with_lvdt_lag(Duration::from_secs_f64(LAG_MS * 1e-3));
    let cell = SimulatedCell::with_controller(plant, ControllerOptions { sigma_m: SIGMA_M, dwell_s, ..controller() }, plan);
    // The command is built before the time counts.
    cell.host_cal(&["--version"]);
    let began = cell.board.robot_time();
    let run = cell.collect_as("session", &[&["--rate", "500", "--json"], more].concat());
    let robot_s = (cell.board.robot_time() - began).as_secs_f64();
    assert_eq!(run.code, 0, "{}", run.transcript());
    let report = run.json();
    assert_eq!((&report["measured"], &report["losses"]["missing"]), (&report["planned"], &0.into()));
    let poses = read_poses([cell.path("session/poses.csv").as_path()], &design(), &rig()).unwrap();
    Way { cell, report, poses, robot_s }
}

fn fitted(poses: &Dataset) -> Fitted {
    let fit = fit(&design(), poses, &FitOptions::default()).unwrap();
    let error = tool_error(&truth().chain, &fit.solution.chain, &truth().limits, 10_000, 1);
    Fitted { rms_mm: fit.fitted.rms_m * 1e3, tool_mm: error.rms_m * 1e3 }
}

fn numbers(cell: &SimulatedCell, name: &str) -> Vec<Option<f64>> {
    column(&cell.path("session"), name).iter().map(|text| text.parse().ok()).collect()
}

/// The same poses with the lag left in their lengths.
fn as_measured(poses: &Dataset) -> Dataset {
    let mut poses = poses.clone();
    for row in &mut poses.rows {
        if let Some(motion) = row.motion {
            row.measurement.length_m -= motion.removed_lag_s * motion.rate_m_s;
        }
    }
    poses
}

/// At 20 deg/s, by which the way takes about as long as stopping at every pose with 30, there are ten times the poses, and the robot is
/// found better; the lag is told apart from all parameters, and lengths without it fit better. (The tool's RMS error over plans of 10, 12, 14
/// and 18 poses a shell: 0.32 mm by stopping, 0.24 mm on the way. One plan alone may go either way, as that of 12 does, since these errors
/// follow one another along a way.)
#[test]
fn a_robot_is_measured_on_the_way_in_the_time_of_stopping_and_better() {
    let pairings: Vec<(usize, usize)> = (0..3).flat_map(|chuck| (0..3).map(move |sphere| (chuck, sphere))).collect();
    let plan = plan_text(14, &[0.46], &pairings);
    let stopping = collect(&plan, STANDING_S, &[]);
    let moving = collect(&plan, 0.0, &["--continuous", "--slow-deg-s", "20"]);
    let (stopped, moved) = (fitted(&stopping.poses), fitted(&moving.poses));
    let with_lag = fitted(&as_measured(&moving.poses));
    let [lag_ms, std_ms] = ["lag_ms", "lag_std_ms"].map(|key| moving.report[key].as_f64().unwrap());
    println!("stopping: {:.0} s of the robot, {} poses, {stopped:?}", stopping.robot_s, stopping.poses.rows.len());
    println!("on the way: {:.0} s, {} poses, {moved:?}", moving.robot_s, moving.poses.rows.len());
    println!("lag {lag_ms:.3} ± {std_ms:.3} ms; left in: {with_lag:?}");

    assert!((0.8..1.25).contains(&(moving.robot_s / stopping.robot_s)), "{} and {} s", moving.robot_s, stopping.robot_s);
    assert!(moving.poses.rows.len() > 8 * stopping.poses.rows.len());
    assert!(moved.tool_mm < stopped.tool_mm && moved.tool_mm < 0.4, "{stopped:?}, {moved:?}");
    let off_ms = (lag_ms - LAG_MS).abs();
    assert!(off_ms < 4.0 * std_ms && off_ms < 1.0, "{lag_ms} ± {std_ms} ms");
    assert!(moved.rms_mm < 0.97 * with_lag.rms_mm, "{moved:?}, {with_lag:?}");
    assert_eq!(stopping.report.get("lag_ms"), None);
    assert!(numbers(&stopping.cell, "lag_ms").iter().all(Option::is_none));
}

/// Lengths of which the lag is removed, and those of another run of which it is not yet, end alike; and nothing changes any more.
#[test]
fn a_lag_is_removed_once_however_often_a_session_is_gone_on_with() {
    const SLOWLY: [&str; 4] = ["--continuous", "--slow-deg-s", "20", "--json"];
    let plan = plan_text(20, &[0.46], &[(0, 0), (1, 1), (2, 2)]);
    let cell = collect(&plan, 0.0, &SLOWLY[..3]).cell;
    // As if the first run had been killed two thirds on its way: the rest is in the log.
    let path = cell.path("session/poses.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    let kept = text.lines().count() * 2 / 3;
    std::fs::write(&path, text.lines().take(kept).map(|line| format!("{line}\n")).collect::<String>()).unwrap();

    let rest = cell.collect_as("session", &SLOWLY);
    assert_eq!(rest.code, 0, "{}", rest.transcript());
    let report = rest.json();
    assert_eq!(report["measured"], report["planned"]);
    assert!(report["poses_recovered"].as_u64().unwrap() > 100, "{report}");
    let lag_ms = report["lag_ms"].as_f64().unwrap();
    let (rates, removed) = (numbers(&cell, "rate_mm_s"), numbers(&cell, "lag_ms"));
    for (rate, removed) in rates.into_iter().zip(removed) {
        assert_eq!(rate.is_some(), removed.is_some());
        assert!(removed.is_none_or(|removed_ms| (removed_ms - lag_ms).abs() < 1e-5), "{removed:?}, reported {lag_ms}");
    }

    let lengths_mm = numbers(&cell, "length_mm");
    for _ in 0..2 {
        let again = cell.collect_as("session", &SLOWLY);
        assert_eq!((again.code, &again.json()["poses_written"]), (0, &0.into()), "{}", again.transcript());
        let same = again.json()["lag_ms"].as_f64().unwrap();
        assert!((same - lag_ms).abs() < 1e-5, "{same}, before {lag_ms}");
        // Files have lengths to a nanometre.
        for (now, before) in numbers(&cell, "length_mm").iter().zip(&lengths_mm) {
            assert!((now.unwrap() - before.unwrap()).abs() < 2e-6, "{now:?}, before {before:?}");
        }
    }
}
