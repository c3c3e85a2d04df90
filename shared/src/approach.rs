//! From which side each joint came to where it stands.

use core::fmt;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::{MAX_JOINTS, Number};

/// Which way an encoder output last changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// It rose.
    Rising,
    /// It fell.
    Falling,
}

/// For each joint, which way its encoder output last changed, where that is known. Backlash depends on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Schema)]
pub struct Approach {
    /// Bit i: joint i, from 0, came up from lower values.
    rising: u8,
    /// Bit i: joint i came down from higher ones. A joint of which both bits are set is not known.
    falling: u8,
}

impl Approach {
    /// Nothing is known of any joint.
    pub const UNKNOWN: Self = Self { rising: 0, falling: 0 };

    /// The way of joint `joint`, from 0; `None` where it is not known.
    pub fn direction(self, joint: usize) -> Option<Direction> {
        match (is_set(self.rising, joint), is_set(self.falling, joint)) {
            (true, false) => Some(Direction::Rising),
            (false, true) => Some(Direction::Falling),
            _ => None,
        }
    }

    /// +1 for a joint that rose, −1 for one that fell, 0 where it is not known.
    pub fn sign<S: Number>(self, joint: usize) -> S {
        match self.direction(joint) {
            Some(Direction::Rising) => S::one(),
            Some(Direction::Falling) => -S::one(),
            None => S::zero(),
        }
    }

    /// The same with another way of joint `joint`, from 0; joints from [`MAX_JOINTS`] on are passed over.
    #[must_use]
    pub fn with(mut self, joint: usize, direction: Option<Direction>) -> Self {
        if joint < MAX_JOINTS {
            let bit = 1 << joint;
            self.rising &= !bit;
            self.falling &= !bit;
            match direction {
                Some(Direction::Rising) => self.rising |= bit,
                Some(Direction::Falling) => self.falling |= bit,
                None => {}
            }
        }
        self
    }

    /// The same with the ways of these joints turned about; bit i is joint i.
    #[must_use]
    pub fn reversed(self, joints: u8) -> Self {
        let turned = |own, other| own & !joints | other & joints;
        Self { rising: turned(self.rising, self.falling), falling: turned(self.falling, self.rising) }
    }

    /// One of `+`, `-` and `0` for each of the first `joints`.
    pub fn signs(self, joints: usize) -> impl fmt::Display {
        Signs { approach: self, joints }
    }
}

fn is_set(bits: u8, joint: usize) -> bool {
    joint < MAX_JOINTS && bits & (1 << joint) != 0
}

struct Signs {
    approach: Approach,
    joints: usize,
}

impl fmt::Display for Signs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (0..self.joints).try_for_each(|joint| {
            f.write_str(match self.approach.direction(joint) {
                Some(Direction::Rising) => "+",
                Some(Direction::Falling) => "-",
                None => "0",
            })
        })
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    #[test]
    fn each_joint_has_a_way_of_its_own() {
        let approach = Approach::UNKNOWN
            .with(0, Some(Direction::Rising))
            .with(2, Some(Direction::Rising))
            .with(2, Some(Direction::Falling))
            .with(3, Some(Direction::Falling))
            .with(3, None)
            .with(8, Some(Direction::Rising));
        assert_eq!(approach.signs(5).to_string(), "+0-00");
        assert_eq!([0, 1, 2, 3, 8, 64].map(|joint| approach.sign::<f64>(joint)), [1.0, 0.0, -1.0, 0.0, 0.0, 0.0]);
        assert_eq!(approach.reversed(0b110).signs(5).to_string(), "+0+00");
        let contradiction = Approach { rising: 1, falling: 1 };
        assert_eq!(contradiction.direction(0), None);
    }
}
