//! Canonical frames: the same robot in them, the same frames from every way of writing it, and the way back.

use std::f64::consts::{FRAC_PI_2, TAU};

use ballbar::{Chain, Parameter, ParameterKind};
use ballbar_calib::kinematics::CanonicalFrames;
use ballbar_tests::at_length::at_length;
use ballbar_tests::frames::{random_chain, rewritten};
use ballbar_tests::solids::base_from_tool;
use host_cal::files::{ROBOTS, open_robot};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Frames are slid by up to so much.
const SLIDE_M: f64 = 100.0;
/// What eight frames slid so far may cost: some hundred units in the last place of a hundred metres.
const ROUNDING_M: f64 = 1e-11;

/// The largest entry by which the tool's poses differ over random joint vectors, metres or one.
fn difference(a: &Chain<f64>, b: &Chain<f64>, rng: &mut ChaCha8Rng) -> f64 {
    let one = |rng: &mut ChaCha8Rng| {
        let q: Vec<f64> = (0..a.joints()).map(|_| rng.random_range(-2.0..2.0)).collect();
        (base_from_tool(a, &q) - base_from_tool(b, &q)).amax()
    };
    (0..10).map(|_| one(rng)).fold(0.0, f64::max)
}

/// Between parameters, angles less whole turns.
fn off(a: &Chain<f64>, b: &Chain<f64>) -> f64 {
    let values = a.parameters().iter().zip(b.parameters()).enumerate();
    let off = values.map(|(index, (a, b))| match Parameter::from_index(index).kind() {
        ParameterKind::Alpha | ParameterKind::Beta | ParameterKind::Gamma => (a - b) - ((a - b) / TAU).round() * TAU,
        _ => a - b,
    });
    off.map(f64::abs).fold(0.0, f64::max)
}

/// Every parameter off by up to so much, metres or radians.
fn shaken(chain: &Chain<f64>, by: f64, rng: &mut ChaCha8Rng) -> Chain<f64> {
    let mut shaken = chain.clone();
    shaken.parameters_mut().iter_mut().for_each(|value| *value += rng.random_range(-by..=by));
    shaken
}

fn random_chains(count: usize, seed: u64) -> impl Iterator<Item = (Chain<f64>, ChaCha8Rng)> {
    (0..count as u64).map(move |i| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed + i);
        let joints = rng.random_range(1..=8);
        (random_chain(joints, &mut rng), rng)
    })
}

#[test]
fn a_robot_has_one_canonical_chain_however_it_is_written() {
    for (i, (chain, mut rng)) in random_chains(at_length(300), 1).enumerate() {
        let written = rewritten(&chain, SLIDE_M, &mut rng);
        assert!(difference(&chain, &written, &mut rng) < ROUNDING_M, "{i}: the test's own writing");
        let (one, other) = (CanonicalFrames::new(&chain), CanonicalFrames::new(&written));
        assert!(difference(&chain, one.chain(), &mut rng) < 1e-13, "{i}");
        assert!(off(one.chain(), other.chain()) < ROUNDING_M, "{i}: {:?}\n{:?}", one.chain(), other.chain());
        let again = CanonicalFrames::new(one.chain());
        assert!(off(one.chain(), again.chain()) < 1e-13, "{i}: canonical frames are their own");
    }
}

#[test]
fn canonical_links_are_upright_near_and_start_at_their_encoders_zero() {
    for (chain, _) in random_chains(at_length(300), 2) {
        let canonical = CanonicalFrames::new(&chain).chain().clone();
        for i in 0..chain.joints() {
            let (link, joint) = (canonical.link(i).unwrap(), canonical.joint(i).unwrap());
            assert!(link.beta_rad.abs() < 0.21 && joint.offset == 0.0 && joint.scale == chain.joint(i).unwrap().scale);
            assert!(i == 0 || link.translation_m.z == 0.0);
        }
        // From the tool inwards no frame is farther than its axis is from the frame before: nearer than the robot is long.
        let long_m: f64 = (0..=chain.joints()).map(|i| chain.link(i).unwrap().translation_m.norm() + 0.5).sum();
        let spread_m: f64 = (0..=chain.joints()).map(|i| canonical.link(i).unwrap().translation_m.norm()).fold(0.0, f64::max);
        assert!(spread_m < long_m, "{spread_m} {long_m}");
    }
}

#[test]
fn what_did_not_move_comes_back_bit_for_bit() {
    for (chain, mut rng) in random_chains(at_length(100), 3) {
        let written = rewritten(&chain, SLIDE_M, &mut rng);
        let frames = CanonicalFrames::new(&written);
        assert_eq!(frames.in_user_frames(frames.chain()), written);
    }
    for (name, _) in ROBOTS {
        let chain = open_robot(name).unwrap().chain;
        let frames = CanonicalFrames::new(&chain);
        assert_eq!(frames.in_user_frames(frames.chain()), chain, "{name}");
        // A tool that is longer by a millimetre changes no link but its own, and that by a millimetre.
        let mut longer = frames.chain().clone();
        let last = longer.parameter_count() - 6;
        longer.parameters_mut()[last] += 1e-3;
        let changed = frames.in_user_frames(&longer);
        assert_eq!(changed.parameters()[..last], chain.parameters()[..last], "{name}");
        let tool_m = |chain: &Chain<f64>| chain.link(chain.joints()).unwrap().translation_m;
        assert!(((tool_m(&changed) - tool_m(&chain)).norm() - 1e-3).abs() < 1e-12, "{name}");
        assert_eq!(changed.parameters()[last + 3..], chain.parameters()[last + 3..], "{name}");
    }
}

#[test]
fn a_changed_robot_comes_back_as_it_is_with_redundant_parameters_as_they_were() {
    for (i, (chain, mut rng)) in random_chains(at_length(300), 4).enumerate() {
        let written = rewritten(&chain, SLIDE_M, &mut rng);
        let frames = CanonicalFrames::new(&written);
        let changed = shaken(frames.chain(), 2e-3, &mut rng);
        let returned = frames.in_user_frames(&changed);
        assert!(difference(&changed, &returned, &mut rng) < ROUNDING_M, "{i}");
        for (index, (value, user)) in returned.parameters().iter().zip(written.parameters()).enumerate() {
            let parameter = Parameter::from_index(index);
            let is_steep = |link: usize| {
                link.checked_sub(1).and_then(|i| written.link(i)).is_some_and(|link| link.beta_rad.cos().abs() <= 0.1)
            };
            let gives_way = parameter.kind() == ParameterKind::Alpha
                && ([parameter.number(), parameter.number() - 1].into_iter().any(is_steep));
            if written.is_conventionally_held(parameter) && !gives_way {
                assert_eq!(value, user, "{i}: {parameter}");
            }
        }
        // And the other way: as it is in the design's canonical frames, however the user writes it.
        let again = frames.in_canonical_frames(&returned);
        assert!(difference(&changed, &again, &mut rng) < ROUNDING_M, "{i}");
        assert!(off(&again, frames.chain()) < 0.1, "{i}: {again:?}");
    }
}

#[test]
fn a_right_angle_of_beta_changes_no_more_than_the_robot_does() {
    // Links of beta = ±90°, some one after another, gamma anywhere but at a right angle.
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for i in 0..at_length(200) {
        let mut chain = random_chain(6, &mut rng);
        for link in 0..6 {
            let p = &mut chain.parameters_mut()[link * 8..link * 8 + 6];
            let steep = if rng.random() { FRAC_PI_2 } else { -FRAC_PI_2 };
            let off = rng.random_range(-0.02..0.02);
            p[4] = [steep, steep + off, 0.3][rng.random_range(0..3)];
            p[5] = [0.0, 3.0, rng.random_range(-1.2..1.2)][rng.random_range(0..3)];
        }
        let frames = CanonicalFrames::new(&chain);
        let changed = shaken(frames.chain(), 1e-5, &mut rng);
        let returned = frames.in_user_frames(&changed);
        assert!(difference(&changed, &returned, &mut rng) < 1e-13, "{i}");
        // The worst handle on a turn is that of gamma at 1.2 rad from the right angle's worst, link after link.
        assert!(off(&returned, &chain) < 1e-2, "{i}: {} {chain:?} {returned:?}", off(&returned, &chain));
    }
}

#[test]
fn derivatives_move_user_parameters_as_the_robot_moves() {
    // To first order D·h moves the user's chain as h moves the canonical one: poses agree to second order.
    for (i, (chain, mut rng)) in random_chains(at_length(60), 6).enumerate() {
        let written = rewritten(&chain, 1.0, &mut rng);
        let is_steep = (0..=chain.joints()).any(|link| written.link(link).unwrap().beta_rad.cos().abs() < 0.3);
        if is_steep {
            continue;
        }
        let frames = CanonicalFrames::new(&written);
        let at = shaken(frames.chain(), 1e-3, &mut rng);
        let (derivative, at_user) = (frames.user_by_canonical(&at), frames.in_user_frames(&at));
        let step: Vec<f64> = (0..at.parameter_count()).map(|_| rng.random_range(-1e-5..1e-5)).collect();
        let (mut moved, mut moved_user) = (at.clone(), at_user.clone());
        let user_step = derivative * nalgebra::DVector::from_column_slice(&step);
        moved.parameters_mut().iter_mut().zip(&step).for_each(|(value, step)| *value += step);
        moved_user.parameters_mut().iter_mut().zip(user_step.iter()).for_each(|(value, step)| *value += step);
        let (first, second) = (difference(&at, &moved, &mut rng), difference(&moved, &moved_user, &mut rng));
        assert!(first > 1e-7 && second < 3e-3 * first, "{i}: {second} of {first}");
    }
}
