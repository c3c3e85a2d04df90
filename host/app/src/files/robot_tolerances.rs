//! Tolerances of a `robot.toml`: how well its links and joints are known.

use ballbar::JointKind;
use ballbar_calib::model::{JointTolerance, LinkTolerance, Tolerances};
use serde::Deserialize;
use toml::Spanned;

use super::numbers::{Range, tolerance};
use super::source::{InputError, Source};
use crate::units::{ScreenUnit, m_from_mm};

/// Once for a file, in its table `[tolerances]`: of links inside the arm and of joints that say nothing of their own.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TolerancesToml {
    link_mm: Option<Spanned<f64>>,
    link_deg: Option<Spanned<f64>>,
    /// Of revolute joints.
    offset_deg: Option<Spanned<f64>>,
    /// Of prismatic joints.
    offset_mm: Option<Spanned<f64>>,
    scale: Option<Spanned<f64>>,
}

impl TolerancesToml {
    /// The tolerances of a robot whose links and joints say nothing of their own. Where it stands and how its tool is mounted is no matter
    /// of how an arm is made: the first link and the last one keep theirs.
    pub(super) fn of_robot(&self, source: &Source, kinds: &[JointKind]) -> Result<Tolerances, InputError> {
        let mut all = Tolerances::usual(kinds);
        let mut inside = LinkTolerance::INSIDE;
        set_link(source, &mut inside, ("link_mm", &self.link_mm), ("link_deg", &self.link_deg))?;
        let last = all.links.len() - 1;
        all.links.iter_mut().take(last).skip(1).for_each(|link| *link = inside);
        // Both offsets are looked at, whichever kinds of joints there are.
        let [mut turn, mut slide] = [JointKind::Revolute, JointKind::Prismatic].map(JointTolerance::usual);
        set_joint(source, &mut turn, ScreenUnit::Degree, ("offset_deg", &self.offset_deg), ("scale", &self.scale))?;
        set_joint(source, &mut slide, ScreenUnit::Millimetre, ("offset_mm", &self.offset_mm), ("scale", &self.scale))?;
        for (joint, kind) in all.joints.iter_mut().zip(kinds) {
            *joint = match kind {
                JointKind::Revolute => turn,
                JointKind::Prismatic => slide,
            };
        }
        Ok(all)
    }
}

/// A key of the file and what stands there.
type Key<'a> = (&'static str, &'a Option<Spanned<f64>>);

/// Takes what a file says of a link.
pub(super) fn set_link(source: &Source, link: &mut LinkTolerance, mm: Key<'_>, deg: Key<'_>) -> Result<(), InputError> {
    if let (key, Some(number)) = mm {
        link.displacement_m = m_from_mm(tolerance(source, key, number, Range::Tolerance)?);
    }
    if let (key, Some(number)) = deg {
        link.rotation_rad = tolerance(source, key, number, Range::Tolerance)?.to_radians();
    }
    Ok(())
}

/// Takes what a file says of a joint whose offset has this unit.
pub(super) fn set_joint(
    source: &Source,
    joint: &mut JointTolerance,
    unit: ScreenUnit,
    offset: Key<'_>,
    scale: Key<'_>,
) -> Result<(), InputError> {
    if let (key, Some(number)) = offset {
        joint.offset = unit.to_si(tolerance(source, key, number, Range::Tolerance)?);
    }
    if let (key, Some(number)) = scale {
        joint.scale = tolerance(source, key, number, Range::PartTolerance)?;
    }
    Ok(())
}
