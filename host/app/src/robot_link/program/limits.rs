//! What a language can hold.

use ballbar::JointKind;

use super::axes::{Axis, axes};
use super::{Dialect, Program, ProgramError};

/// The longest that a robot may be told to stand, seconds. Fanuc's `WAIT` ends at 327.67.
const STAND_MAX_S: f64 = 300.0;

/// What a language can hold.
pub(super) struct Limits {
    pub(super) joints_min: usize,
    pub(super) joints_max: usize,
    /// Of the joints, how many may be external.
    pub(super) external_max: usize,
    /// Whether a linear joint can be among the arm's; external ones can be wherever there are any.
    pub(super) arm_prismatic: bool,
    /// Characters of a name.
    pub(super) name_max: usize,
    pub(super) name_has_underscores: bool,
    pub(super) steps_max: usize,
}

impl Limits {
    pub(super) fn check(&self, dialect: Dialect, program: &Program) -> Result<(), ProgramError> {
        self.check_joints(dialect, &program.kinds)?;
        self.check_name(dialect, &program.name)?;
        let is_speed = |speed: f64| speed.is_finite() && speed > 0.0;
        let speeds = [program.speed.revolute_rad_s, program.speed.prismatic_m_s];
        if !speeds.into_iter().chain(program.setup.fastest_rad_s).all(is_speed) {
            return Err(ProgramError::Speed);
        }
        if !(0.0..=STAND_MAX_S).contains(&program.stand_s) {
            return Err(ProgramError::Stand { found_s: program.stand_s, at_most_s: STAND_MAX_S });
        }
        if program.steps.is_empty() {
            return Err(ProgramError::NoSteps);
        }
        if program.steps.len() > self.steps_max {
            return Err(ProgramError::Steps { dialect, found: program.steps.len(), at_most: self.steps_max });
        }
        for (number, step) in (1..).zip(&program.steps) {
            // A million degrees or millimetres is more than any joint has, and room enough in every language's columns.
            if let Some(joint) = program.values(step).iter().position(|value| value.is_nan() || value.abs() > 1e6) {
                return Err(ProgramError::Value { step: number, joint: joint + 1 });
            }
        }
        Ok(())
    }

    fn check_joints(&self, dialect: Dialect, kinds: &[JointKind]) -> Result<(), ProgramError> {
        let joints = kinds.len();
        if !(self.joints_min..=self.joints_max).contains(&joints) {
            let (at_least, at_most) = (self.joints_min, self.joints_max);
            return Err(ProgramError::Joints { dialect, found: joints, at_least, at_most });
        }
        let axes = axes(kinds);
        // Rails alone are no arm.
        let has_arm = axes.iter().any(|axis| matches!(axis, Axis::Arm(_)));
        let holds = |axis: Axis| match axis {
            Axis::Arm(_) => self.arm_prismatic,
            Axis::External(_) => self.external_max > 0 && has_arm,
        };
        let wrong = |&(axis, kind): &(Axis, JointKind)| kind == JointKind::Prismatic && !holds(axis);
        if let Some(joint) = axes.iter().copied().zip(kinds.iter().copied()).position(|pair| wrong(&pair)) {
            return Err(ProgramError::Prismatic { dialect, joint: joint + 1 });
        }
        let external = axes.iter().filter(|axis| matches!(axis, Axis::External(_))).count();
        if external > self.external_max {
            return Err(ProgramError::External { dialect, found: external, at_most: self.external_max });
        }
        Ok(())
    }

    fn check_name(&self, dialect: Dialect, name: &str) -> Result<(), ProgramError> {
        let is_letter = |c: char| c.is_ascii_alphanumeric() || (c == '_' && self.name_has_underscores);
        let is_name =
            name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(is_letter) && name.len() <= self.name_max;
        if is_name {
            return Ok(());
        }
        let underscores = if self.name_has_underscores { ", digits and underscores" } else { " and digits" };
        Err(ProgramError::Name { dialect, found: name.to_owned(), at_most: self.name_max, underscores })
    }
}
