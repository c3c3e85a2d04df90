//! The `[solids]` table of `rig.toml`: how large the things are that must not meet, for planning.

use ballbar_calib::model::Solids;
use serde::Deserialize;
use toml::Spanned;

use super::numbers::{Range, in_range};
use super::source::{InputError, Source};
use crate::units::m_from_mm;

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
