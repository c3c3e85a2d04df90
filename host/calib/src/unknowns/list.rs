//! The kinds of unknowns that there are beside a chain's: the one list to add to.

use thiserror::Error;

use super::{BarZero, Block, Drift, Gain, Latency, RigBlock, RodZeros, SetOffsets, TermsBlock};
use crate::model::{Dataset, Rig, Robot};

/// A kind of unknowns that a fit may be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Kind {
    /// By how much all lengths are too long.
    BarZero,
    /// By how much each rod makes lengths too long.
    RodZeros,
    /// By which part displacements are shown too large.
    BarGain,
    /// By how much the LVDT's signal comes late.
    Latency,
    /// Where chucks and spheres are, within their tolerances.
    Rig,
    /// By how much the lengths of each set are too long.
    Sets,
    /// By how much lengths grow too long from the first to the last.
    Drift,
    /// How far joints yield to gravity.
    Compliance,
    /// How far encoders' discs are off their axes.
    Eccentricity,
    /// By how much joints lag behind their encoders.
    Backlash,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 10] = [
        Self::BarZero,
        Self::RodZeros,
        Self::BarGain,
        Self::Latency,
        Self::Rig,
        Self::Sets,
        Self::Drift,
        Self::Compliance,
        Self::Eccentricity,
        Self::Backlash,
    ];

    /// What it is called: `bar-zero`, `rod-zeros`, `bar-gain`, `latency`, `rig`, `sets`, `drift`,
    /// `compliance`, `eccentricity`, `backlash`.
    pub fn name(self) -> &'static str {
        match self {
            Self::BarZero => "bar-zero",
            Self::RodZeros => "rod-zeros",
            Self::BarGain => "bar-gain",
            Self::Latency => "latency",
            Self::Rig => "rig",
            Self::Sets => "sets",
            Self::Drift => "drift",
            Self::Compliance => "compliance",
            Self::Eccentricity => "eccentricity",
            Self::Backlash => "backlash",
        }
    }

    /// The kind of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// The unknowns of this kind that a robot, a rig and a dataset have.
    ///
    /// # Errors
    /// [`UnknownError`] when it has none.
    pub fn block(self, robot: &Robot, rig: &Rig, dataset: &Dataset) -> Result<AnyBlock, UnknownError> {
        Ok(match self {
            Self::BarZero => AnyBlock::BarZero(BarZero::new(rig, dataset)?),
            Self::RodZeros => AnyBlock::RodZeros(RodZeros::new(rig, dataset)?),
            Self::BarGain => AnyBlock::Gain(Gain::new(rig, dataset)?),
            Self::Latency => AnyBlock::Latency(Latency::new(dataset)?),
            Self::Rig => AnyBlock::Rig(RigBlock::new(rig, dataset)?),
            Self::Sets => AnyBlock::Sets(SetOffsets::new(dataset)?),
            Self::Drift => AnyBlock::Drift(Drift::new(dataset)?),
            Self::Compliance => AnyBlock::Terms(Box::new(TermsBlock::compliance(robot)?)),
            Self::Eccentricity => AnyBlock::Terms(Box::new(TermsBlock::eccentricity(robot)?)),
            Self::Backlash => AnyBlock::Terms(Box::new(TermsBlock::backlash(robot, dataset)?)),
        })
    }
}

/// Unknowns of one of the kinds.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum AnyBlock {
    /// [`Kind::BarZero`].
    BarZero(BarZero),
    /// [`Kind::RodZeros`].
    RodZeros(RodZeros),
    /// [`Kind::BarGain`].
    Gain(Gain),
    /// [`Kind::Latency`].
    Latency(Latency),
    /// [`Kind::Rig`].
    Rig(RigBlock),
    /// [`Kind::Sets`].
    Sets(SetOffsets),
    /// [`Kind::Drift`].
    Drift(Drift),
    /// [`Kind::Compliance`], [`Kind::Eccentricity`] or [`Kind::Backlash`].
    Terms(Box<TermsBlock>),
}

impl AnyBlock {
    /// Of which kind the unknowns are.
    pub fn kind(&self) -> Kind {
        match self {
            Self::BarZero(_) => Kind::BarZero,
            Self::RodZeros(_) => Kind::RodZeros,
            Self::Gain(_) => Kind::BarGain,
            Self::Latency(_) => Kind::Latency,
            Self::Rig(_) => Kind::Rig,
            Self::Sets(_) => Kind::Sets,
            Self::Drift(_) => Kind::Drift,
            Self::Terms(block) => block.kind(),
        }
    }

    pub(super) fn as_block(&self) -> &dyn Block {
        match self {
            Self::BarZero(block) => block,
            Self::RodZeros(block) => block,
            Self::Gain(block) => block,
            Self::Latency(block) => block,
            Self::Rig(block) => block,
            Self::Sets(block) => block,
            Self::Drift(block) => block,
            Self::Terms(block) => block.as_ref(),
        }
    }
}

/// Why measurements have no unknowns of some kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum UnknownError {
    /// Every chuck and sphere in use is known exactly, or nobody says how well.
    #[error("no chuck or sphere of the rig has a tolerance")]
    NoTolerance,
    /// The rig has no bar, and rows say nothing of theirs.
    #[error("nothing says how long the bar is at mid travel")]
    NoRods,
    /// The rig says of the bar's zeros, or of its gain, that they are known exactly.
    #[error("the rig says of {} that it is known exactly", .0.name())]
    KnownExactly(Kind),
    /// No length changed while it was measured.
    #[error("no length was measured in motion")]
    NoMotion,
    /// No row belongs to a set.
    #[error("no row names a set")]
    NoSets,
    /// Nothing tells the first row from the last.
    #[error("neither times nor numbers of the rows tell the first from the last")]
    NoOrder,
    /// No joint bears a mass.
    #[error("no mass is known that a joint bears")]
    NoMasses,
    /// No joint has a disc that could be off its axis.
    #[error("all joints are prismatic")]
    NoDiscs,
    /// No joint is known to have come to its poses from both sides.
    #[error("no joint is known to have come from both sides")]
    NoApproach,
}
