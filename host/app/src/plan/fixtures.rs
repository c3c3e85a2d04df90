//! Fixtures, and what is wrong with a rig wherever the robot stands.

use std::fmt;

use ballbar::Vector3;
use miette::Diagnostic;
use thiserror::Error;

use super::geometry::Disc;
use super::scene::{CONSTANT_M, Gap, Scene, Thing, What};
use crate::files::Rig;
use crate::kinematics::Posture;
use crate::units::mm_from_m;

/// The rig cannot be as it is described.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{one} and {other} are too near{}: {gap_mm:.1} mm between them, expected {wanted_mm:.1} mm or more", if *.always { " in every posture" } else { "" })]
pub struct FixturesOverlap {
    one: String,
    other: String,
    gap_mm: f64,
    wanted_mm: f64,
    always: bool,
    /// Of the plate with the spheres, where it is the cause.
    turned: Option<TurnedPlate>,
}

impl Diagnostic for FixturesOverlap {
    fn help(&self) -> Option<Box<dyn fmt::Display + '_>> {
        const SIZES: &str = "Check the positions in rig.toml, or give the true sizes in its [solids] table (docs/files.md).";
        Some(match self.turned {
            Some(turned) => Box::new(turned),
            None => Box::new(SIZES),
        })
    }
}

/// The plate with the spheres faces away from the last joint's axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TurnedPlate {
    away_rad: f64,
}

impl TurnedPlate {
    /// Farther away than this the spheres are beside the last link or behind it.
    const FACES_AWAY_RAD: f64 = std::f64::consts::FRAC_PI_3;

    pub(super) fn of(scene: &Scene, home: &Posture) -> Option<Self> {
        let normal = home.base_from_tool.rotation * scene.sphere_plate_normal();
        let away_rad = home.axes().last()?.direction.dot(&normal).abs().min(1.0).acos();
        (away_rad > Self::FACES_AWAY_RAD).then_some(Self { away_rad })
    }
}

impl fmt::Display for TurnedPlate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "The plate with the spheres faces {:.0}° away from the axis of the last joint, as the tool's frame is turned in the robot's \
             file: turn the spheres' positions in rig.toml, not those of the chucks.",
            self.away_rad.to_degrees()
        )
    }
}

fn part(one: &str, other: &str, gap_m: f64, wanted_m: f64, always: bool) -> Result<(), FixturesOverlap> {
    if gap_m >= wanted_m {
        return Ok(());
    }
    let (gap_mm, wanted_mm) = (mm_from_m(gap_m), mm_from_m(wanted_m));
    Err(FixturesOverlap { one: one.to_owned(), other: other.to_owned(), gap_mm, wanted_mm, always, turned: None })
}

/// What no posture could part.
pub(super) fn check_fixtures(
    scene: &Scene,
    rig: &Rig,
    home: &Posture,
    gaps: &[Gap],
    clearance_m: f64,
) -> Result<(), FixturesOverlap> {
    let solids = scene.solids();
    let ends = [("chuck", &rig.chucks, solids.chuck_radius_m), ("sphere", &rig.spheres, solids.sphere_radius_m)];
    for (what, points, radius_m) in ends {
        for (i, a) in points.iter().enumerate() {
            for b in &points[..i] {
                let gap_m = (a.position_m - b.position_m).norm() - 2.0 * radius_m;
                part(&format!("{what} {}", b.name), &format!("{what} {}", a.name), gap_m, 0.0, false)?;
            }
        }
    }
    check_foot(scene, rig, home, gaps, clearance_m)?;
    check_ends(scene, rig, home, clearance_m)?;
    check_still_links(scene, rig, gaps, clearance_m)?;
    for gap in gaps {
        let (link, tool) = gap.of(scene.things());
        let is_on_tool = matches!(tool.what, What::SpherePlate(_) | What::Sphere { .. });
        if !matches!(link.what, What::Link(_)) || !is_on_tool {
            continue;
        }
        // Where motion changes nothing, what is not within one another has to do; a last link that is flush with the plate is fitted some
        // micrometres into it.
        let wanted_m = if gap.has_constant_part() { -CONSTANT_M } else { clearance_m };
        part(&name(link, rig), &name(tool, rig), gap.whole.most_m, wanted_m, true)
            .map_err(|overlap| FixturesOverlap { turned: TurnedPlate::of(scene, home), ..overlap })?;
    }
    Ok(())
}

/// The links that no motion brings nearer to the chucks, or farther from them: of most robots the column that it stands on.
fn check_foot(scene: &Scene, rig: &Rig, home: &Posture, gaps: &[Gap], clearance_m: f64) -> Result<(), FixturesOverlap> {
    let wanted_m = |fixture: &What| match fixture {
        What::ChuckPlate(_) => Some(0.0),
        What::Chuck { .. } => Some(clearance_m),
        _ => None,
    };
    let foot = || "the robot's foot".to_owned();
    for gap in gaps.iter().filter(|gap| gap.whole.is_constant()) {
        if let (fixture, link @ Thing { what: What::Link(_), .. }) = gap.of(scene.things())
            && let Some(wanted_m) = wanted_m(&fixture.what)
        {
            let link = if scene.is_foot(link) { foot() } else { name(link, rig) };
            part(&link, &name(fixture, rig), gap.whole.least_m, wanted_m, false)?;
        }
    }
    let standing = || scene.things().iter().filter(|thing| thing.joints == 0);
    for link in standing().filter(|thing| matches!(thing.what, What::Link(_))) {
        for fixture in standing() {
            let Some(wanted_m) = wanted_m(&fixture.what) else { continue };
            let gap_m = fixture.what.place(home).distance_m(&link.what.place(home)) - fixture.radius_m - link.radius_m;
            part(&foot(), &name(fixture, rig), gap_m, wanted_m, false)?;
        }
    }
    Ok(())
}

/// Either end of the bar, and what stands still beside it.
fn check_ends(scene: &Scene, rig: &Rig, home: &Posture, clearance_m: f64) -> Result<(), FixturesOverlap> {
    for end in scene.things() {
        let Some(bar) = bar_at(end, rig) else { continue };
        let is_other = |other: &&Thing| other.joints == end.joints && name(other, rig) != name(end, rig);
        for other in scene.things().iter().filter(is_other) {
            let gap_m = other.what.place(home).distance_m(&end.what.place(home)) - other.radius_m - scene.solids().bar_radius_m;
            part(&bar, &name(other, rig), gap_m, clearance_m, false)?;
        }
    }
    Ok(())
}

/// Either end of the bar, and links that turn about it, or about which it turns.
fn check_still_links(scene: &Scene, rig: &Rig, gaps: &[Gap], clearance_m: f64) -> Result<(), FixturesOverlap> {
    for gap in gaps.iter().filter(|gap| gap.whole.is_constant()) {
        let (a, b) = gap.of(scene.things());
        for (end, link) in [(a, b), (b, a)] {
            if let (Some(bar), What::Link(_)) = (bar_at(end, rig), link.what) {
                let gap_m = gap.whole.least_m + end.radius_m - scene.solids().bar_radius_m;
                part(&bar, &name(link, rig), gap_m, clearance_m, true)?;
            }
        }
    }
    Ok(())
}

fn bar_at(end: &Thing, rig: &Rig) -> Option<String> {
    match end.what {
        What::Chuck { .. } => Some(format!("a bar in {}", name(end, rig))),
        What::Sphere { .. } => Some(format!("a bar on {}", name(end, rig))),
        _ => None,
    }
}

fn name(thing: &Thing, rig: &Rig) -> String {
    match thing.what {
        What::Table { .. } => "the table".to_owned(),
        What::ChuckPlate(_) => "the chuck plate".to_owned(),
        What::Chuck { index, .. } => format!("chuck {}", rig.chucks[index].name),
        What::Link(body) => format!("link {}", body.link + 1),
        What::SpherePlate(_) => "the sphere plate".to_owned(),
        What::Sphere { index, .. } => format!("sphere {}", rig.spheres[index].name),
    }
}

/// The disc that carries some points at `height_m` behind them; `side` says where before is.
pub(super) fn carrier(points_m: &[Vector3<f64>], side: Vector3<f64>, height_m: f64, rim_m: f64) -> Disc {
    let centre_m = points_m.iter().sum::<Vector3<f64>>() / points_m.len() as f64;
    let normal = plane_normal(points_m).map_or(side, |normal| if normal.dot(&side) < 0.0 { -normal } else { normal });
    let widest_m = points_m.iter().map(|point_m| (point_m - centre_m).norm()).fold(0.0, f64::max);
    Disc { centre_m: centre_m - normal * height_m, normal, radius_m: widest_m + rim_m }
}

/// From the tool's origin to its spheres; along its z when they are about it.
pub(super) fn outward(spheres_tool_m: &[Vector3<f64>]) -> Vector3<f64> {
    let sum_m = spheres_tool_m.iter().sum::<Vector3<f64>>();
    sum_m.try_normalize(1e-9).unwrap_or(Vector3::z())
}

/// Unit normal of the plane through the points that span the largest triangle; `None` when they are in one line.
fn plane_normal(points_m: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let (first_m, others_m) = points_m.split_first()?;
    let mut largest = Vector3::zeros();
    for (i, a_m) in others_m.iter().enumerate() {
        for b_m in &others_m[..i] {
            let across = (a_m - first_m).cross(&(b_m - first_m));
            if across.norm() > largest.norm() {
                largest = across;
            }
        }
    }
    largest.try_normalize(1e-9)
}
