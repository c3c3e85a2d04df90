//! The solids of a scene: what stands about the bar, and where.

use ballbar::Vector3;

use crate::kinematics::{Posture, Skeleton};
use crate::model::Solids;
use crate::plan::bodies::{Body, bodies};
use crate::plan::geometry::{Core, Disc, carrier, outward};
use crate::plan::swing::Reach;

/// One solid: all points within `radius_m` of a core.
#[derive(Clone, Debug)]
pub(in crate::plan) struct Thing {
    pub(in crate::plan) what: What,
    /// How many joints move it.
    pub(in crate::plan) joints: usize,
    pub(in crate::plan) radius_m: f64,
    pub(in crate::plan) reach: Reach,
}

/// What a thing is, and where.
#[derive(Clone, Copy, Debug)]
pub(in crate::plan) enum What {
    Table {
        z_m: f64,
    },
    ChuckPlate(Disc),
    Chuck {
        index: usize,
        centre_m: Vector3<f64>,
    },
    Link(Body),
    /// Tool frame.
    SpherePlate(Disc),
    /// Tool frame.
    Sphere {
        index: usize,
        centre_m: Vector3<f64>,
    },
}

impl What {
    pub(in crate::plan) fn place(&self, posture: &Posture) -> Core {
        match self {
            Self::Table { z_m } => Core::Below(*z_m),
            Self::ChuckPlate(disc) => Core::Disc(*disc),
            Self::Chuck { centre_m, .. } => Core::Point(*centre_m),
            Self::Link(body) => Core::Segment(body.segment(posture)),
            Self::SpherePlate(disc) => Core::Disc(Disc {
                centre_m: posture.point_in_base(&disc.centre_m),
                normal: posture.base_from_tool.rotation * disc.normal,
                radius_m: disc.radius_m,
            }),
            Self::Sphere { centre_m, .. } => Core::Point(posture.point_in_base(centre_m)),
        }
    }
}

/// All of them, in an order that they keep.
pub(super) fn all_things(
    skeleton: &Skeleton,
    solids: &Solids,
    chucks_m: &[Vector3<f64>],
    spheres_tool_m: &[Vector3<f64>],
    thing: &impl Fn(What, usize, f64) -> Thing,
) -> Vec<Thing> {
    let lowest_m = chucks_m.iter().map(|chuck_m| chuck_m.z).fold(f64::INFINITY, f64::min);
    let chuck_plate =
        carrier(chucks_m, Vector3::z(), solids.chuck_plate_below_m, solids.chuck_radius_m + solids.chuck_plate_rim_m);
    let sphere_rim_m = solids.sphere_radius_m + solids.sphere_plate_rim_m;
    let sphere_plate = carrier(spheres_tool_m, outward(spheres_tool_m), solids.sphere_plate_behind_m, sphere_rim_m);
    let tool = skeleton.joints();
    let mut things = vec![
        thing(What::Table { z_m: lowest_m - solids.table_below_chucks_m }, 0, 0.0),
        thing(What::ChuckPlate(chuck_plate), 0, 0.0),
    ];
    let chuck = |(index, &centre_m): (usize, &Vector3<f64>)| thing(What::Chuck { index, centre_m }, 0, solids.chuck_radius_m);
    things.extend(chucks_m.iter().enumerate().map(chuck));
    things.extend(bodies(skeleton, solids).into_iter().map(|body| thing(What::Link(body), body.link, body.radius_m)));
    things.push(thing(What::SpherePlate(sphere_plate), tool, 0.0));
    let sphere =
        |(index, &centre_m): (usize, &Vector3<f64>)| thing(What::Sphere { index, centre_m }, tool, solids.sphere_radius_m);
    things.extend(spheres_tool_m.iter().enumerate().map(sphere));
    things
}
