//! How many instructions the hot paths take on the board's processor, counted by an emulator that counts them.
#![cfg(unix)]

use ballbar::Measurement;
use ballbar_tests::emulator::{Image, is_skipped, loaded, output_of};
use host_cal::files::{open_rig, open_robot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// As `firmware/src/bin/an386-counts/main.rs` has it.
const POSES: usize = 200;

/// Most instructions that each may take.
const LIMITS: [(&str, f64); 4] = [
    ("forward kinematics", 2_000.0),
    ("gradient row", 2_500.0),
    ("row in a block of eight", 2_500.0),
    ("update of 36 columns in a block of eight", 6_500.0),
];

#[test]
fn hot_paths_stay_within_their_limits() {
    if is_skipped() {
        return;
    }
    let output = output_of(Image::An386Counts, &inputs());
    let mut rounded = String::new();
    for (line, (name, limit)) in output.lines().zip(LIMITS) {
        let (found, count) = line.split_once(": ").unwrap_or_else(|| panic!("no count: {output}"));
        let count: f64 = count.parse().unwrap_or_else(|_| panic!("no count: {output}"));
        assert_eq!(found, name);
        assert!(count <= limit, "{name}: {count} instructions, of {limit} allowed");
        rounded += &format!("{name}: {}\n", (count / 10.0).round() * 10.0);
    }
    assert_eq!(output.lines().count(), LIMITS.len(), "{output}");
    // A compiler of another version may well change these: look whether for the better, and accept with `cargo insta review`.
    insta::assert_snapshot!(rounded, @r"
    forward kinematics: 810
    gradient row: 1450
    row in a block of eight: 1680
    update of 36 columns in a block of eight: 2440
    ");
}

/// A PUMA 560 at random poses within its limits, with all pairings in turn: the memory that the program reads.
fn inputs() -> Vec<u8> {
    let (robot, rig) = (open_robot("puma560").unwrap(), open_rig("triangles").unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(560);
    let pairings = rig.all_pairings().into_iter().cycle().take(POSES);
    let poses: Vec<Measurement<f64>> = pairings
        .map(|pairing| {
            let q: Vec<f64> = robot.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
            let (pairing, q) = (rig.pairing(pairing), robot.chain.joint_vector(&q).unwrap());
            Measurement::new(pairing, q, 0.46)
        })
        .collect();
    loaded(&robot.chain, &poses)
}
