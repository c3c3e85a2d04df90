//! From which side each joint came to where it stands, by the samples of a stream.
//!
//! The board keeps the same for the poses that it computes itself (`firmware/src/approach_watch.rs`), by its encoders' counts. What is recorded is
//! computed here, so that a log yields it again, and of joint values, which a coupled encoder's counts do not always follow.

use ballbar::{Approach, Direction, JointVector, MAX_JOINTS, Sample, StillnessCriteria};

use super::robot_on_board::RobotOnBoard;

/// An arm that arrives rings; a joint that reverses by so many times the band of an encoder at rest has not turned.
const RINGING_BANDS: f64 = 2.0;

/// Follows every joint's turns.
///
/// A joint has turned when it is farther back from where it came to than it rings, and than its gap: on the way through the gap the
/// link does not follow, and stands as it stood before.
#[derive(Clone, Debug)]
pub struct ApproachWatch {
    /// How far each joint goes back without having turned, radians or metres.
    gaps: [f64; MAX_JOINTS],
    /// Where each joint came to on its way, radians or metres; where it was first seen, while its way is not known.
    farthest: Option<JointVector<f64>>,
    /// Index of the sample that comes next, unless some are lost.
    next_index: u32,
    approach: Approach,
}

impl ApproachWatch {
    /// At a robot that counts as standing still by these criteria. Nothing is known of its joints yet.
    pub fn new(robot: &RobotOnBoard, criteria: &StillnessCriteria) -> Self {
        let (encoders, backlash) = (robot.encoders().encoders(), robot.backlash());
        let ringing = |i: usize| {
            let counts = RINGING_BANDS * f64::from(criteria.band_counts);
            encoders.get(i).map_or(0.0, |encoder| (counts / encoder.counts_per_unit).abs())
        };
        let gaps = std::array::from_fn(|i| ringing(i).max(2.0 * backlash[i].abs()));
        Self { gaps, farthest: None, next_index: 0, approach: Approach::UNKNOWN }
    }

    /// Takes the next sample, at joint values `q`. What the arm did while samples were lost nobody knows.
    pub fn take(&mut self, sample: &Sample, q: &JointVector<f64>) {
        if sample.index != self.next_index {
            (self.farthest, self.approach) = (None, Approach::UNKNOWN);
        }
        self.next_index = sample.index.wrapping_add(1);
        let farthest = self.farthest.get_or_insert(*q);
        for (i, (farthest, &now)) in farthest.as_array_mut().iter_mut().zip(q.as_array()).enumerate() {
            let way = now - *farthest;
            let direction = if way > 0.0 { Direction::Rising } else { Direction::Falling };
            let goes_on = way != 0.0 && self.approach.direction(i) == Some(direction);
            if goes_on || way.abs() > self.gaps[i] {
                *farthest = now;
                self.approach = self.approach.with(i, Some(direction));
            }
        }
    }

    /// From which sides the joints came to where the latest sample has them, as far as it was seen.
    pub fn approach(&self) -> Approach {
        self.approach
    }
}

#[cfg(test)]
mod tests {
    use ballbar::TermKind;

    use super::*;
    use crate::board::{nominal_lvdt, parameter_set};
    use crate::files::open_robot;

    /// Joints 1 and 2 go so many hundredths of a degree; a PUMA's encoders have some 1.7 counts in each.
    fn watch(backlash_deg: f64, ways: &[[f64; 2]]) -> String {
        let mut robot = open_robot("puma560").unwrap();
        robot.terms.set_coefficient(0, TermKind::Backlash, backlash_deg.to_radians());
        let robot = RobotOnBoard::new(parameter_set(&robot, nominal_lvdt(0.075)).unwrap()).unwrap();
        let mut watch = ApproachWatch::new(&robot, &StillnessCriteria::default());
        for (index, way) in (0..).zip(ways) {
            let mut q = JointVector::zero();
            q.as_array_mut()[..2].copy_from_slice(&way.map(|hundredths| (hundredths * 0.01).to_radians()));
            watch.take(&Sample { index, ..Sample::default() }, &q);
        }
        watch.approach().signs(3).to_string()
    }

    #[test]
    fn a_joint_that_rings_has_not_turned_and_one_that_goes_back_has() {
        assert_eq!(watch(0.0, &[[0.0, 0.0]]), "000");
        assert_eq!(watch(0.0, &[[0.0, 0.0], [2.0, -2.0]]), "000", "that little is no way");
        assert_eq!(watch(0.0, &[[0.0, 0.0], [100.0, -100.0]]), "+-0");
        assert_eq!(watch(0.0, &[[0.0, 0.0], [100.0, -100.0], [101.0, -101.0], [99.0, -99.0]]), "+-0");
        assert_eq!(watch(0.0, &[[0.0, 0.0], [100.0, -100.0], [93.0, -93.0]]), "-+0");
    }

    #[test]
    fn a_gap_that_is_known_has_to_be_crossed() {
        let there_and_back = [[0.0, 0.0], [100.0, 100.0], [93.0, 93.0]];
        assert_eq!(watch(0.05, &there_and_back), "+-0");
        assert_eq!(watch(0.05, &[&there_and_back[..], &[[89.0, 93.0]]].concat()), "--0");
    }

    #[test]
    fn nothing_is_known_once_samples_are_lost() {
        let robot = RobotOnBoard::new(parameter_set(&open_robot("puma560").unwrap(), nominal_lvdt(0.075)).unwrap()).unwrap();
        let mut watch = ApproachWatch::new(&robot, &StillnessCriteria::default());
        let mut signs = |index, joint_1: f64| {
            let mut q = JointVector::zero();
            q.as_array_mut()[0] = joint_1;
            watch.take(&Sample { index, ..Sample::default() }, &q);
            watch.approach().signs(1).to_string()
        };
        assert_eq!([signs(7, 0.0), signs(8, 0.1), signs(10, 0.2), signs(11, 0.1)], ["0", "+", "0", "-"]);
    }
}
