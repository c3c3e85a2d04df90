//! From which sides the joints came to their poses, and the gears' play that this lets a fit find.
#![cfg(unix)]

use ballbar::{Approach, Direction, TermKind};
use ballbar_calib::model::PoseRow;
use ballbar_tests::command::Run;
use ballbar_tests::simulated_cell::{SimulatedCell, column, design, plan_text, plant, rig};
use host_cal::files::{open_robot, read_poses};
use serde_json::Value;

/// Of all joints, from one end of the play to the other.
const PLAY_DEG: f64 = 0.04;
const SIGMA_M: f64 = 5e-5;
/// A joint that goes less far says nothing of where it came from.
const FAR_RAD: f64 = 0.002;

fn good(run: Run) -> Value {
    assert_eq!(run.code, 0, "{}", run.transcript());
    run.json()
}

fn cell(poses_per_shell: usize, pairings: usize) -> SimulatedCell {
    let pairings: Vec<(usize, usize)> = (0..pairings).map(|i| (i / 3, i % 3)).collect();
    let plan = plan_text(poses_per_shell, &[0.46], &pairings);
    SimulatedCell::start(plant(3).with_backlash(PLAY_DEG.to_radians()), SIGMA_M, &plan)
}

fn poses(cell: &SimulatedCell) -> Vec<PoseRow> {
    read_poses([cell.path("session/poses.csv").as_path()], &design(), &rig()).unwrap().rows
}

/// How many joints came from the side that the way between two places leads from, of those that it moves far.
fn right(from: &[f64; 8], to: &[f64; 8], approach: Approach) -> (usize, usize) {
    let ways = (0..6).map(|joint| (to[joint] - from[joint], approach.direction(joint)));
    let far: Vec<bool> = ways
        .filter(|(way, _)| way.abs() > FAR_RAD)
        .map(|(way, direction)| direction == Some(if way > 0.0 { Direction::Rising } else { Direction::Falling }))
        .collect();
    (far.iter().filter(|is_right| **is_right).count(), far.len())
}

fn sum(counts: impl Iterator<Item = (usize, usize)>) -> (usize, usize) {
    counts.fold((0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1))
}

#[test]
fn a_collection_keeps_the_directions_by_which_a_fit_finds_the_play() {
    let cell = cell(20, 9);
    assert_eq!(good(cell.collect("session", &["--json"]))["measured"], 180);
    // The plan's rows say from where each was come to.
    let (rows, lines) = (cell.rows(), column(&cell.path("session"), "plan_row"));
    let of_pose = |(pose, line): (PoseRow, String)| {
        let at = rows.iter().position(|row| row.line.to_string() == line).unwrap();
        let before = rows[..at].last().map_or([0.0; 8], |row| *row.q.as_array());
        right(&before, rows[at].q.as_array(), pose.approach)
    };
    let (told, all) = sum(poses(&cell).into_iter().zip(lines).map(of_pose));
    println!("{told} of {all} directions are those of the plan's ways");
    assert!(all > 900 && told == all, "{told} of {all}");

    let fit = good(cell.host_cal(&["fit", "session", "--unknown", "backlash", "--out", "found.toml", "--json"]));
    let without = good(cell.host_cal(&["fit", "session", "--out", "without.toml", "--json"]));
    let (with_mm, without_mm) = (fit["rms_mm"].as_f64().unwrap(), without["rms_mm"].as_f64().unwrap());
    println!("RMS {with_mm:.4} mm with backlash, {without_mm:.4} without");
    assert!(with_mm < 1.1 * SIGMA_M * 1e3 && without_mm > 2.0 * with_mm, "{with_mm} {without_mm}");
    let found = open_robot(&cell.path("found.toml").display().to_string()).unwrap();
    for joint in 0..6 {
        let half_deg = found.terms.coefficient(joint, TermKind::Backlash).to_degrees();
        println!("joint {}: half of the play is {half_deg:.4} deg", joint + 1);
        // The joints of the wrist move the spheres by a tenth of a metre a radian.
        let near_deg = if joint < 3 { 0.003 } else { 0.008 };
        assert!((half_deg - PLAY_DEG / 2.0).abs() < near_deg, "joint {}: {half_deg}", joint + 1);
    }
}

#[test]
fn poses_on_the_way_have_the_direction_in_which_the_arm_goes() {
    let cell = cell(4, 1);
    good(cell.collect_as("session", &["--rate", "500", "--continuous", "--json"]));
    let poses = poses(&cell);
    let moving: Vec<&[PoseRow]> = poses
        .windows(2)
        .filter(|pair| pair.iter().all(|pose| pose.motion.is_some()) && pair[1].t_s.unwrap() - pair[0].t_s.unwrap() < 0.6)
        .collect();
    let (told, all) = sum(moving.iter().map(|pair| {
        let [from, to] = [0, 1].map(|i| pair[i].measurement.q);
        right(from.as_array(), to.as_array(), pair[1].approach)
    }));
    println!("{told} of {all} directions on the way, {} poses", poses.len());
    // Between two of them the arm may have passed a corner.
    assert!(all > 100 && told * 100 > all * 95, "{told} of {all}");
}
