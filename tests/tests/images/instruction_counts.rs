//! How many instructions the hot paths take on the board's processor, counted by an emulator that counts them.
#![cfg(unix)]

use ballbar::{MAX_PARAMETERS, PARAMETERS_PER_JOINT, ParameterKind};
use ballbar_tests::emulator::{Image, is_skipped, output_of};
use host_cal::files::{open_rig, open_robot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// As `firmware/src/bin/an386-counts/inputs.rs` has it.
const POSES: usize = 200;

/// Most instructions that each may take.
const LIMITS: [(&str, f64); 3] = [("forward kinematics", 2_000.0), ("gradient row", 2_500.0), ("update of 36 columns", 6_500.0)];

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
    gradient row: 1530
    update of 36 columns: 5790
    ");
}

/// A PUMA 560 at random poses within its limits, with all pairings in turn: the memory that the program reads.
fn inputs() -> Vec<u8> {
    let (robot, rig) = (open_robot("puma560").unwrap(), open_rig("triangles").unwrap());
    let mut bytes = Vec::new();
    bytes.extend(f32_bytes(robot.chain.parameters()));
    bytes.extend(free_parameters(robot.chain.parameters().len()).iter().flat_map(|index| index.to_le_bytes()));
    let mut rng = ChaCha8Rng::seed_from_u64(560);
    for pairing in rig.all_pairings().into_iter().cycle().take(POSES) {
        let q: Vec<f64> = robot.limits.iter().map(|limits| rng.random_range(limits.min..limits.max)).collect();
        let pairing = rig.pairing(pairing);
        let ends = [pairing.chuck_base_m, pairing.sphere_tool_m];
        bytes.extend(f32_bytes(&q));
        bytes.extend(ends.iter().flat_map(|end| f32_bytes(end.as_slice())));
        bytes.extend(f32_bytes(&[0.46]));
    }
    bytes
}

fn f32_bytes(values: &[f64]) -> impl Iterator<Item = u8> + '_ {
    values.iter().flat_map(|&value| (value as f32).to_le_bytes())
}

/// All but those that move the tool as others do: offset, and the z and alpha behind it, of every joint.
fn free_parameters(count: usize) -> Vec<u32> {
    assert!(count <= MAX_PARAMETERS);
    let is_held = |index: usize| {
        let (part, kind) = (index / PARAMETERS_PER_JOINT, index % PARAMETERS_PER_JOINT);
        kind == ParameterKind::Offset as usize
            || part > 0 && (kind == ParameterKind::Z as usize || kind == ParameterKind::Alpha as usize)
    };
    let free: Vec<u32> = (0..count).filter(|&index| !is_held(index)).map(|index| index as u32).collect();
    assert_eq!(free.len(), 36);
    free
}
