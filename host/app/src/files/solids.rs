//! The `[solids]` table of `rig.toml`: how large the things are that must not meet, for planning.

use serde::Deserialize;
use toml::Spanned;

use super::numbers::{Range, in_range};
use super::source::{InputError, Source};
use crate::units::m_from_mm;

/// Sizes of what stands around the bar, metres. Neither robots nor rigs describe solids; these are plain stand-ins, a little larger than
/// what is usual, for a file to replace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solids {
    /// Of the bar, a capsule from chuck to sphere.
    pub bar_radius_m: f64,
    /// Of every link, capsules between joint origins.
    pub link_radius_m: f64,
    /// Of the last link, whose capsule ends flush with the tool frame's origin.
    pub last_link_radius_m: f64,
    /// Height of the lowest chuck's centre above the table.
    pub table_below_chucks_m: f64,
    /// Of a ball about a chuck's centre that holds the chuck.
    pub chuck_radius_m: f64,
    /// Height of the chucks' centres above the disc that carries them.
    pub chuck_plate_below_m: f64,
    /// How far that disc reaches beyond the outermost chuck.
    pub chuck_plate_rim_m: f64,
    /// Of the spheres on the tool.
    pub sphere_radius_m: f64,
    /// Height of the spheres' centres above the disc on the tool that carries them.
    pub sphere_plate_behind_m: f64,
    /// How far that disc reaches beyond the outermost sphere.
    pub sphere_plate_rim_m: f64,
}

impl Default for Solids {
    fn default() -> Self {
        Self {
            bar_radius_m: 0.015,
            link_radius_m: 0.060,
            last_link_radius_m: 0.040,
            table_below_chucks_m: 0.060,
            chuck_radius_m: 0.020,
            chuck_plate_below_m: 0.050,
            chuck_plate_rim_m: 0.030,
            sphere_radius_m: 0.0127,
            sphere_plate_behind_m: 0.035,
            sphere_plate_rim_m: 0.015,
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SolidsToml {
    bar_radius_mm: Option<Spanned<f64>>,
    link_radius_mm: Option<Spanned<f64>>,
    last_link_radius_mm: Option<Spanned<f64>>,
    table_below_chucks_mm: Option<Spanned<f64>>,
    chuck_radius_mm: Option<Spanned<f64>>,
    chuck_plate_below_mm: Option<Spanned<f64>>,
    chuck_plate_rim_mm: Option<Spanned<f64>>,
    sphere_radius_mm: Option<Spanned<f64>>,
    sphere_plate_behind_mm: Option<Spanned<f64>>,
    sphere_plate_rim_mm: Option<Spanned<f64>>,
}

impl SolidsToml {
    /// The sizes, those that the file does not give being the stand-ins.
    pub(super) fn read(&self, source: &Source) -> Result<Solids, InputError> {
        let or = |key: &'static str, given: &Option<Spanned<f64>>, default_m: f64| match given {
            Some(number) => in_range(source, key, number, Range::Positive).map(m_from_mm),
            None => Ok(default_m),
        };
        let usual = Solids::default();
        Ok(Solids {
            bar_radius_m: or("bar_radius_mm", &self.bar_radius_mm, usual.bar_radius_m)?,
            link_radius_m: or("link_radius_mm", &self.link_radius_mm, usual.link_radius_m)?,
            last_link_radius_m: or("last_link_radius_mm", &self.last_link_radius_mm, usual.last_link_radius_m)?,
            table_below_chucks_m: or("table_below_chucks_mm", &self.table_below_chucks_mm, usual.table_below_chucks_m)?,
            chuck_radius_m: or("chuck_radius_mm", &self.chuck_radius_mm, usual.chuck_radius_m)?,
            chuck_plate_below_m: or("chuck_plate_below_mm", &self.chuck_plate_below_mm, usual.chuck_plate_below_m)?,
            chuck_plate_rim_m: or("chuck_plate_rim_mm", &self.chuck_plate_rim_mm, usual.chuck_plate_rim_m)?,
            sphere_radius_m: or("sphere_radius_mm", &self.sphere_radius_mm, usual.sphere_radius_m)?,
            sphere_plate_behind_m: or("sphere_plate_behind_mm", &self.sphere_plate_behind_mm, usual.sphere_plate_behind_m)?,
            sphere_plate_rim_m: or("sphere_plate_rim_mm", &self.sphere_plate_rim_mm, usual.sphere_plate_rim_m)?,
        })
    }
}
