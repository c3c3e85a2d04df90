//! How large the things are that must not meet, for planning.

/// Sizes of what stands around the bar, metres. Neither robots nor rigs describe solids; the defaults are plain stand-ins, a little larger than
/// what is usual.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
