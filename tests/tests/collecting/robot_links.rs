//! Links to robot controllers, against emulated ones that hold to the published syntax and fail when told to.

mod dribbling;
mod ur;
mod ur_safety;
mod ur_waits;
#[cfg(unix)]
mod val;

use std::time::{Duration, Instant};

use ballbar::JointVector;
use host_cal::robot_link::{LinkError, MoveState, Patience, RobotLink};

/// Far shorter than for real robots: the emulated ones are fast.
fn patience() -> Patience {
    Patience {
        answer: Duration::from_millis(800),
        begin: Duration::from_millis(600),
        stand: Duration::from_millis(250),
        margin: Duration::from_millis(1500),
        recover: Duration::from_secs(3),
    }
}

/// Polls until the move is over.
fn end_of_move(link: &mut dyn RobotLink) -> Result<MoveState, LinkError> {
    let deadline = Instant::now() + Duration::from_secs(20);
    loop {
        let begun = Instant::now();
        let state = link.poll()?;
        assert!(begun.elapsed() < Duration::from_millis(300), "a poll waits for nothing: {:?}", begun.elapsed());
        if state != MoveState::Moving {
            return Ok(state);
        }
        assert!(Instant::now() < deadline, "the move does not end");
    }
}

fn joint_vector(q_rad: &[f64]) -> JointVector<f64> {
    let mut q = JointVector::zero();
    q.as_array_mut()[..q_rad.len()].copy_from_slice(q_rad);
    q
}

/// The largest difference of a joint, radians.
fn largest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
