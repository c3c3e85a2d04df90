//! What may come near what.

use std::fmt;

/// Two things that come near one another. Links are counted from 1, as in the robot's file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Contact {
    /// Bar and table.
    BarTable,
    /// Bar and the plate that carries the chucks.
    BarChuckPlate,
    /// Bar and a chuck that it is not in.
    BarChuck,
    /// Bar and the plate that carries the spheres.
    BarSpherePlate,
    /// Bar and a sphere that it is not on.
    BarSphere,
    /// Bar and a link.
    BarLink(usize),
    /// A link and the table.
    LinkTable(usize),
    /// A link and the chucks or their plate.
    LinkChucks(usize),
    /// Two links.
    Links(usize, usize),
    /// The plate with the spheres, or one of them, and table or chucks.
    ToolTable,
    /// The plate with the spheres, and a link.
    ToolLink(usize),
    /// A sphere and a link.
    SphereLink(usize),
}

impl fmt::Display for Contact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BarTable => f.write_str("bar near table"),
            Self::BarChuckPlate => f.write_str("bar near chuck plate"),
            Self::BarChuck => f.write_str("bar near another chuck"),
            Self::BarSpherePlate => f.write_str("bar near sphere plate"),
            Self::BarSphere => f.write_str("bar near another sphere"),
            Self::BarLink(link) => write!(f, "bar near link {link}"),
            Self::LinkTable(link) => write!(f, "link {link} near table"),
            Self::LinkChucks(link) => write!(f, "link {link} near chucks"),
            Self::Links(a, b) => write!(f, "link {a} near link {b}"),
            Self::ToolTable => f.write_str("tool near table or chucks"),
            Self::ToolLink(link) => write!(f, "tool near link {link}"),
            Self::SphereLink(link) => write!(f, "sphere near link {link}"),
        }
    }
}

/// The two things that are nearest to one another, surface to surface; below zero they meet.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Nearest {
    /// Gap between their surfaces, metres.
    pub gap_m: f64,
    /// Which.
    pub contact: Contact,
}
