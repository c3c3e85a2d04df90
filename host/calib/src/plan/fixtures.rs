//! Fixtures, and what is wrong with a rig wherever the robot stands.

use thiserror::Error;

use super::scene::{CONSTANT_M, Gap, Scene, Thing, What};
use crate::kinematics::Posture;
use crate::model::Rig;
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
    turned_plate_rad: Option<f64>,
}

impl FixturesOverlap {
    /// How far the plate with the spheres faces away from the last joint's axis, radians, where that is the cause.
    pub fn turned_plate_rad(&self) -> Option<f64> {
        self.turned_plate_rad
    }
}

fn part(one: &str, other: &str, gap_m: f64, wanted_m: f64, always: bool) -> Result<(), FixturesOverlap> {
    if gap_m >= wanted_m {
        return Ok(());
    }
    let (gap_mm, wanted_mm) = (mm_from_m(gap_m), mm_from_m(wanted_m));
    Err(FixturesOverlap { one: one.to_owned(), other: other.to_owned(), gap_mm, wanted_mm, always, turned_plate_rad: None })
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
            .map_err(|overlap| FixturesOverlap { turned_plate_rad: scene.turned_plate_rad(home), ..overlap })?;
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
