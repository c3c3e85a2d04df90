//! Why a shell cannot be measured, and what to change.

use super::cell::Cell;
use super::contact::Contact;
use super::fixtures::TurnedPlate;
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
    let counts = road.hindrance_counts();
    let out_of_reach: usize = counts.iter().filter(|(what, _)| *what == Hindrance::OutOfReach).map(|(_, count)| count).sum();
    let home = cell.posture(&ballbar::JointVector::zero());
    if let Some(turned) = TurnedPlate::of(&cell.scene, &home)
        && 2 * out_of_reach <= road.crossings.len()
    {
        return turned.to_string();
    }
    let solids = &cell.rig.solids;
    match main_cause(&counts) {
        Some(Cause::Links) => format!(
            "Every link counts as capsules of {:.0} mm radius, the last one of {:.0} mm: give the true ones as link_radius_mm and \
             last_link_radius_mm in the rig's [solids] table, or move the chucks away from the robot's foot.",
            mm_from_m(solids.link_radius_m),
            mm_from_m(solids.last_link_radius_m)
        ),
        Some(Cause::Table) => format!(
            "The table counts as an endless plane {:.0} mm below the lowest chuck: give its true height as table_below_chucks_mm in the \
             rig's [solids] table, and the links' true link_radius_mm, or set the chucks lower or farther out.",
            mm_from_m(solids.table_below_chucks_m)
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

#[derive(Clone, Copy, Debug, PartialEq)]
enum Cause {
    Reach,
    Links,
    Table,
    Travel,
    Paths,
}

/// What hinders at most of the points.
fn main_cause(counts: &[(Hindrance, usize)]) -> Option<Cause> {
    let count = |is: fn(&Hindrance) -> bool| counts.iter().filter(|(what, _)| is(what)).map(|(_, count)| count).sum::<usize>();
    let causes = [
        (count(is_of_reach), Cause::Reach),
        (count(is_of_links), Cause::Links),
        (count(|what| matches!(what, Hindrance::Contact(Contact::LinkTable(_)))), Cause::Table),
        (count(|what| *what == Hindrance::Travel), Cause::Travel),
        (count(|what| *what == Hindrance::NoWay), Cause::Paths),
    ];
    causes.into_iter().filter(|(count, _)| *count > 0).max_by_key(|(count, _)| *count).map(|(_, cause)| cause)
}

fn is_of_reach(what: &Hindrance) -> bool {
    matches!(what, Hindrance::OutOfReach | Hindrance::Limits | Hindrance::Singular)
}

fn is_of_links(what: &Hindrance) -> bool {
    let Hindrance::Contact(contact) = what else { return false };
    match contact {
        Contact::BarLink(_) | Contact::LinkChucks(_) | Contact::Links(..) | Contact::ToolLink(_) | Contact::SphereLink(_) => true,
        Contact::BarTable
        | Contact::LinkTable(_)
        | Contact::BarChuckPlate
        | Contact::BarChuck
        | Contact::BarSpherePlate
        | Contact::BarSphere
        | Contact::ToolTable => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_remedy_follows_from_what_hinders_most() {
        let contact = Hindrance::Contact;
        let cases = [
            (
                vec![(contact(Contact::BarLink(4)), 20), (contact(Contact::Links(2, 5)), 15), (Hindrance::Travel, 30)],
                Cause::Links,
            ),
            (vec![(contact(Contact::LinkTable(3)), 40), (contact(Contact::LinkChucks(3)), 30)], Cause::Table),
            (vec![(Hindrance::Travel, 5), (contact(Contact::SphereLink(4)), 4)], Cause::Travel),
            (vec![(Hindrance::NoWay, 9), (Hindrance::OutOfReach, 4), (Hindrance::Limits, 4)], Cause::Paths),
            (vec![(Hindrance::NoWay, 9), (Hindrance::OutOfReach, 4), (Hindrance::Limits, 6)], Cause::Reach),
        ];
        for (counts, cause) in cases {
            assert_eq!(main_cause(&counts), Some(cause), "{counts:?}");
        }
        assert_eq!(main_cause(&[]), None);
    }
}
