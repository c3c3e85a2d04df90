//! What may have made a row wrong.

use crate::model::{Dataset, End, PairingId};

/// A cause, with what there is to know of it. Chucks, spheres and joints are by index, from 0; SI units.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum CauseKind {
    /// Each of two chucks, or of two spheres, was taken for the other.
    EndsExchanged {
        /// Chucks or spheres.
        end: End,
        /// The two.
        between: [usize; 2],
    },
    /// One chuck or sphere is named where it was another.
    OtherEnd {
        /// Chucks or spheres.
        end: End,
        /// What the rows name.
        named: usize,
        /// What it was.
        really: usize,
    },
    /// One pairing is named where it was another.
    OtherPairing {
        /// What the rows name.
        named: PairingId,
        /// What it was.
        really: PairingId,
    },
    /// Each row names another pairing than it was.
    OtherPairings {
        /// What it was, row by row.
        really: Vec<PairingId>,
    },
    /// Lengths are of another unit.
    LengthUnit(LengthUnit),
    /// The bar's nominal length is missing.
    RodMissing {
        /// That length.
        rod_m: f64,
    },
    /// Lengths were made with another rod's nominal length.
    OtherRod {
        /// By how much it is longer than the right one's.
        longer_by_m: f64,
    },
    /// There was hardly any length.
    NoLength,
    /// A length is that of the row before, to the last digit.
    LengthRepeated,
    /// A length is that of another pose in the order of measurement.
    LengthShifted {
        /// How many rows further on; negative: before.
        by: isize,
    },
    /// A joint was counted with the wrong sign.
    JointSign {
        /// Which.
        joint: usize,
    },
    /// Two joints were taken for one another.
    JointsExchanged {
        /// The two.
        between: [usize; 2],
    },
    /// Angles of all joints are of another unit.
    AngleUnit(AngleUnit),
    /// A joint's value is too large by whole turns of its encoder, from index to index.
    EncoderTurns {
        /// Which.
        joint: usize,
        /// How many.
        turns: i32,
        /// What they are at the joint.
        by: f64,
    },
    /// A joint's value is too large by something.
    JointOffset {
        /// Which.
        joint: usize,
        /// By what, negative: too small.
        by: f64,
    },
    /// Lengths are too long by something, from a row to a row.
    LengthOffset {
        /// By what, negative: too short.
        by_m: f64,
        /// The rows that it concerns, as far as they lie between.
        of: RowsOf,
        /// From this row, by index.
        first: usize,
        /// To this one.
        last: usize,
    },
    /// A chuck or sphere stands elsewhere, from a row to a row.
    Displaced {
        /// Chuck (base frame) or sphere (tool frame).
        end: End,
        /// Which.
        which: usize,
        /// By what.
        by_m: [f64; 3],
        /// From this row, by index.
        first: usize,
        /// To this one.
        last: usize,
    },
    /// Nothing that was tried explains it.
    Unknown,
}

/// What lengths were written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum LengthUnit {
    /// Metres.
    Metre,
    /// Centimetres.
    Centimetre,
    /// Inches.
    Inch,
    /// Tenths of a millimetre: a decimal point too far to the right.
    TenthOfMillimetre,
    /// Micrometres.
    Micrometre,
}

impl LengthUnit {
    pub(super) const ALL: [Self; 5] = [Self::Metre, Self::Inch, Self::Centimetre, Self::TenthOfMillimetre, Self::Micrometre];

    /// How many millimetres it has.
    pub fn millimetres(self) -> f64 {
        match self {
            Self::Metre => 1e3,
            Self::Centimetre => 10.0,
            Self::Inch => 25.4,
            Self::TenthOfMillimetre => 0.1,
            Self::Micrometre => 1e-3,
        }
    }

    pub(super) fn plural(self) -> &'static str {
        match self {
            Self::Metre => "metres",
            Self::Centimetre => "centimetres",
            Self::Inch => "inches",
            Self::TenthOfMillimetre => "tenths of a millimetre",
            Self::Micrometre => "micrometres",
        }
    }
}

/// What angles of joints were written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum AngleUnit {
    /// Radians, taken for degrees.
    Radian,
    /// Degrees, taken for radians.
    Degree,
}

impl AngleUnit {
    pub(super) const ALL: [Self; 2] = [Self::Radian, Self::Degree];

    /// What an angle has to be multiplied by.
    pub(super) fn factor(self) -> f64 {
        match self {
            Self::Radian => 1f64.to_degrees(),
            Self::Degree => 1f64.to_radians(),
        }
    }
}

/// Rows that have something in common.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum RowsOf {
    /// That they are rows.
    All,
    /// The chuck.
    Chuck(usize),
    /// The sphere.
    Sphere(usize),
    /// Both.
    Pairing(PairingId),
    /// The set, by name.
    Set(String),
    /// The file.
    File(usize),
}

impl RowsOf {
    /// Those of one chuck or sphere.
    pub(super) fn end(end: End, which: usize) -> Self {
        match end {
            End::Chuck => Self::Chuck(which),
            End::Sphere => Self::Sphere(which),
        }
    }

    /// Whether a row, by index, is one of them.
    pub fn has(&self, dataset: &Dataset, row: usize) -> bool {
        let row = &dataset.rows[row];
        match self {
            Self::All => true,
            Self::Chuck(chuck) => row.pairing.chuck == *chuck,
            Self::Sphere(sphere) => row.pairing.sphere == *sphere,
            Self::Pairing(pairing) => row.pairing == *pairing,
            Self::Set(set) => row.set.as_ref() == Some(set),
            Self::File(file) => row.file == *file,
        }
    }
}
