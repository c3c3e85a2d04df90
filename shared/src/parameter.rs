//! Names, order and units of a chain's parameters.

use core::fmt;
use core::str::FromStr;

use serde::de::{Error, Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::{JointKind, MAX_JOINTS, PARAMETERS_PER_JOINT};

/// Which of a link's six or a joint's two parameters; the order is that of the paper's Table II.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ParameterKind {
    /// Translation of the link along x of the frame before it, metres.
    X,
    /// Translation of the link along y of the frame before it, metres.
    Y,
    /// Translation of the link along z of the frame before it, metres.
    Z,
    /// Rotation about z after the translation, radians.
    Alpha,
    /// Rotation about y after alpha, radians.
    Beta,
    /// Rotation about x after beta, radians.
    Gamma,
    /// Joint value at encoder output zero, radians or metres (θ₀ in the paper's eq. 2).
    Offset,
    /// Joint value per encoder output, unit-free (k in the paper's eq. 2).
    Scale,
}

impl ParameterKind {
    /// All kinds, in parameter order.
    pub const ALL: [Self; PARAMETERS_PER_JOINT] =
        [Self::X, Self::Y, Self::Z, Self::Alpha, Self::Beta, Self::Gamma, Self::Offset, Self::Scale];

    const fn stem(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::Alpha => "alpha",
            Self::Beta => "beta",
            Self::Gamma => "gamma",
            Self::Offset => "offset",
            Self::Scale => "scale",
        }
    }

    /// The SI unit of this parameter; an offset's depends on the joint it belongs to.
    pub const fn unit(self, joint: JointKind) -> ParameterUnit {
        match (self, joint) {
            (Self::X | Self::Y | Self::Z, _) | (Self::Offset, JointKind::Prismatic) => ParameterUnit::Metre,
            (Self::Alpha | Self::Beta | Self::Gamma, _) | (Self::Offset, JointKind::Revolute) => ParameterUnit::Radian,
            (Self::Scale, _) => ParameterUnit::One,
        }
    }
}

/// The SI unit of a parameter, or of another unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ParameterUnit {
    /// A length.
    Metre,
    /// An angle.
    Radian,
    /// A ratio.
    One,
    /// A time.
    Second,
    /// An angle by a moment.
    RadianPerNewtonMetre,
    /// A length by a force.
    MetrePerNewton,
}

/// One parameter of a chain: a kind, and the number of its link or joint counted from 1. Written `x1`, `gamma7`, `scale6`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Parameter {
    number: u8,
    kind: ParameterKind,
}

impl Parameter {
    /// The parameter at `index` in parameter order; any index below [`crate::MAX_PARAMETERS`] is one.
    pub const fn from_index(index: usize) -> Self {
        Self { number: (index / PARAMETERS_PER_JOINT) as u8 + 1, kind: ParameterKind::ALL[index % PARAMETERS_PER_JOINT] }
    }

    /// The parameter of link or joint `number`, from 1. `None` when no chain has it.
    pub const fn new(number: usize, kind: ParameterKind) -> Option<Self> {
        let last = match kind {
            ParameterKind::Offset | ParameterKind::Scale => MAX_JOINTS,
            _ => MAX_JOINTS + 1,
        };
        if number == 0 || number > last { None } else { Some(Self { number: number as u8, kind }) }
    }

    /// Position in parameter order, from 0.
    pub const fn index(self) -> usize {
        (self.number as usize - 1) * PARAMETERS_PER_JOINT + self.kind as usize
    }

    /// Number of the link or joint, from 1.
    pub const fn number(self) -> usize {
        self.number as usize
    }

    /// Which of the link's or joint's parameters.
    pub const fn kind(self) -> ParameterKind {
        self.kind
    }
}

/// As its name, `gamma7`.
impl Serialize for Parameter {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Parameter {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_str(NameVisitor)
    }
}

struct NameVisitor;

impl Visitor<'_> for NameVisitor {
    type Value = Parameter;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the name of a parameter, such as gamma7")
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Parameter, E> {
        name.parse().map_err(|_| E::invalid_value(Unexpected::Str(name), &self))
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.kind.stem(), self.number)
    }
}

/// The text is not the name of a parameter of any chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownParameter;

impl fmt::Display for UnknownParameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("not a parameter: expected x, y, z, alpha, beta, gamma, offset or scale and a link number, as in `gamma7`")
    }
}

impl core::error::Error for UnknownParameter {}

impl FromStr for Parameter {
    type Err = UnknownParameter;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let digits_at = text.find(|c: char| c.is_ascii_digit()).ok_or(UnknownParameter)?;
        let (stem, digits) = text.split_at(digits_at);
        let kind = ParameterKind::ALL.into_iter().find(|kind| kind.stem() == stem).ok_or(UnknownParameter)?;
        if digits.starts_with('0') {
            return Err(UnknownParameter);
        }
        let number = digits.parse().map_err(|_| UnknownParameter)?;
        Self::new(number, kind).ok_or(UnknownParameter)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::MAX_PARAMETERS;
    use std::string::ToString;

    #[test]
    fn every_index_has_one_name_and_back() {
        for index in 0..MAX_PARAMETERS {
            let parameter = Parameter::from_index(index);
            assert_eq!(parameter.index(), index);
            assert_eq!(parameter.to_string().parse(), Ok(parameter));
        }
    }

    #[test]
    fn the_order_is_that_of_table_ii() {
        let names: std::vec::Vec<_> = (0..10).map(|i| Parameter::from_index(i).to_string()).collect();
        assert_eq!(names, ["x1", "y1", "z1", "alpha1", "beta1", "gamma1", "offset1", "scale1", "x2", "y2"]);
        assert_eq!(Parameter::from_index(53).to_string(), "gamma7");
    }

    #[test]
    fn names_of_no_parameter_are_refused() {
        for text in ["", "x", "7", "x0", "x01", "x10", "offset9", "scale9", "delta1", "gamma-1", "x1.0", "X1", "x99999999999"] {
            assert_eq!(text.parse::<Parameter>(), Err(UnknownParameter), "{text}");
        }
        assert!("gamma9".parse::<Parameter>().is_ok(), "the last link of an eight-joint chain");
    }
}
