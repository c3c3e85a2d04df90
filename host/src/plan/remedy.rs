//! Why a shell cannot be measured, and what to change.

use super::cell::Cell;
use super::contact::Contact;
use super::posture::Hindrance;
use super::shell::ShellRoads;
use crate::units::mm_from_m;

/// What hindered at the points of a shell, with counts.
pub(super) fn reasons(road: &ShellRoads) -> String {
    let counts = road.hindrance_counts().into_iter();
    counts.map(|(hindrance, count)| format!("{hindrance} {count}")).collect::<Vec<_>>().join(", ")
}

/// What to change, by the cause of most of it.
pub(super) fn remedy(cell: &Cell<'_>, road: &ShellRoads) -> String {
    /// A plate that faces farther away than this has its spheres beside the last link or behind it.
    const FACES_AWAY_DEG: f64 = 60.0;
    let counts = road.hindrance_counts();
    let count = |is: fn(&Hindrance) -> bool| counts.iter().filter(|(what, _)| is(what)).map(|(_, count)| count).sum::<usize>();
    let away_deg = plate_off_last_axis_rad(cell).to_degrees();
    let are_out_of_reach = 2 * count(|what| *what == Hindrance::OutOfReach) > road.crossings.len();
    if away_deg > FACES_AWAY_DEG && !are_out_of_reach {
        return format!(
            "The plate with the spheres faces {away_deg:.0}° away from the axis of the last joint, as the tool's frame is turned in the \
             robot's file: turn the spheres' positions in rig.toml, not those of the chucks."
        );
    }
    let causes = [
        (count(is_of_reach), Cause::Reach),
        (count(is_of_links), Cause::Links),
        (count(|what| *what == Hindrance::Travel), Cause::Travel),
        (count(|what| *what == Hindrance::NoWay), Cause::Paths),
    ];
    let main = causes.into_iter().max_by_key(|(count, _)| *count).filter(|(count, _)| *count > 0);
    let solids = &cell.rig.solids;
    match main.map(|(_, cause)| cause) {
        Some(Cause::Links) => format!(
            "Every link counts as capsules of {:.0} mm radius, the last one of {:.0} mm: give the true ones as link_radius_mm and \
             last_link_radius_mm in the rig's [solids] table, or move the chucks away from the robot's foot.",
            mm_from_m(solids.link_radius_m),
            mm_from_m(solids.last_link_radius_m)
        ),
        Some(Cause::Travel) => format!(
            "Of the {:.1} mm of travel to either side {:.1} mm are kept as a margin, and what is left has to hold the lengths of all \
             plausible robots: ask for less with --travel-margin-mm, or take a bar with more travel.",
            mm_from_m(cell.travel_m) / 2.0,
            mm_from_m(cell.margins.travel_m)
        ),
        Some(Cause::Paths) => {
            "Postures were found, but no two that a path joins with the bar attached: ask for smaller margins, above \
             all --clearance-mm and --travel-margin-mm, or for more points with --per-pair."
                .to_owned()
        }
        Some(Cause::Reach) | None => {
            "Move the chucks nearer to the robot or away from its foot, take another bar length with --bar, or ask for \
             smaller margins."
                .to_owned()
        }
    }
}

enum Cause {
    Reach,
    Links,
    Travel,
    Paths,
}

fn is_of_reach(what: &Hindrance) -> bool {
    matches!(what, Hindrance::OutOfReach | Hindrance::Limits | Hindrance::Singular)
}

fn is_of_links(what: &Hindrance) -> bool {
    let Hindrance::Contact(contact) = what else { return false };
    match contact {
        Contact::BarLink(_)
        | Contact::LinkTable(_)
        | Contact::LinkChucks(_)
        | Contact::Links(..)
        | Contact::ToolLink(_)
        | Contact::SphereLink(_) => true,
        Contact::BarTable
        | Contact::BarChuckPlate
        | Contact::BarChuck
        | Contact::BarSpherePlate
        | Contact::BarSphere
        | Contact::ToolTable => false,
    }
}

/// Angle between the sphere plate's normal and the last joint's axis.
fn plate_off_last_axis_rad(cell: &Cell<'_>) -> f64 {
    let home = cell.posture(&ballbar::JointVector::zero());
    let normal = home.base_from_tool.rotation * cell.scene.sphere_plate_normal();
    home.axes().last().map_or(0.0, |axis| axis.direction.dot(&normal).abs().min(1.0).acos())
}
