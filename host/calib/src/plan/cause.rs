//! Why a shell cannot be measured.

use super::cell::Cell;
use super::contact::Contact;
use super::posture::Hindrance;
use super::shell::ShellRoads;

/// What keeps most points of a shell from being measured.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Cause {
    /// The plate with the spheres faces so far away from the axis of the last joint, radians: its spheres are beside the last link.
    TurnedPlate(f64),
    /// The arm does not come there, or only with straightened joints.
    Reach,
    /// Links are too thick for where they would have to be.
    Links {
        /// Radius of their capsules, metres.
        radius_m: f64,
        /// Of those of the last link, metres.
        last_radius_m: f64,
    },
    /// Links would be in the table.
    Table {
        /// How far the table is below the lowest chuck, metres.
        below_chucks_m: f64,
    },
    /// The lengths of all plausible robots do not fit in the bar's travel.
    Travel {
        /// From end to end, metres.
        travel_m: f64,
        /// Kept free at either end, metres.
        margin_m: f64,
    },
    /// No path joins the postures with the bar attached.
    Paths,
}

impl Cause {
    pub(super) fn of(cell: &Cell<'_>, road: &ShellRoads) -> Self {
        let counts = road.hindrance_counts();
        let out_of_reach: usize = counts.iter().filter(|(what, _)| *what == Hindrance::OutOfReach).map(|(_, count)| count).sum();
        if let Some(away_rad) = cell.scene.turned_plate_rad(&cell.posture(&ballbar::JointVector::zero()))
            && 2 * out_of_reach <= road.crossings.len()
        {
            return Self::TurnedPlate(away_rad);
        }
        let (solids, margins) = (&cell.rig.solids, &cell.margins);
        let count =
            |is: fn(&Hindrance) -> bool| counts.iter().filter(|(what, _)| is(what)).map(|(_, count)| count).sum::<usize>();
        let causes = [
            (count(is_of_reach), Self::Reach),
            (count(is_of_links), Self::Links { radius_m: solids.link_radius_m, last_radius_m: solids.last_link_radius_m }),
            (count(is_of_table), Self::Table { below_chucks_m: solids.table_below_chucks_m }),
            (count(|what| *what == Hindrance::Travel), Self::Travel { travel_m: cell.travel_m, margin_m: margins.travel_m }),
            (count(|what| *what == Hindrance::NoWay), Self::Paths),
        ];
        most(causes)
    }
}

/// The cause with the largest count.
fn most(causes: [(usize, Cause); 5]) -> Cause {
    causes.into_iter().max_by_key(|(count, _)| *count).filter(|(count, _)| *count > 0).map_or(Cause::Reach, |(_, cause)| cause)
}

fn is_of_table(what: &Hindrance) -> bool {
    matches!(what, Hindrance::Contact(Contact::LinkTable(_)))
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
    fn each_hindrance_has_one_cause() {
        let contacts =
            [Contact::BarLink(4), Contact::Links(2, 5), Contact::LinkChucks(3), Contact::ToolLink(4), Contact::SphereLink(4)];
        assert!(contacts.into_iter().all(|contact| is_of_links(&Hindrance::Contact(contact))));
        let reach = [Hindrance::OutOfReach, Hindrance::Limits, Hindrance::Singular];
        assert!(reach.iter().all(is_of_reach));
        let all = contacts.map(Hindrance::Contact).into_iter().chain(reach).chain([
            Hindrance::Contact(Contact::LinkTable(3)),
            Hindrance::Travel,
            Hindrance::NoWay,
        ]);
        for what in all {
            let kinds = [is_of_reach(&what), is_of_links(&what), is_of_table(&what)];
            assert!(kinds.into_iter().filter(|is| *is).count() <= 1, "{what}");
        }
    }

    #[test]
    fn the_largest_count_is_the_cause() {
        let counts = |counts: [usize; 5]| {
            let causes = [
                Cause::Reach,
                Cause::Links { radius_m: 0.06, last_radius_m: 0.04 },
                Cause::Table { below_chucks_m: 0.06 },
                Cause::Travel { travel_m: 0.075, margin_m: 0.008 },
                Cause::Paths,
            ];
            let mut both = counts.into_iter().zip(causes);
            most(std::array::from_fn(|_| both.next().unwrap()))
        };
        assert!(matches!(counts([4, 35, 0, 30, 0]), Cause::Links { .. }));
        assert!(matches!(counts([0, 30, 40, 0, 0]), Cause::Table { .. }));
        assert!(matches!(counts([0, 4, 0, 5, 0]), Cause::Travel { .. }));
        assert_eq!(counts([8, 0, 0, 0, 9]), Cause::Paths);
        assert_eq!(counts([0; 5]), Cause::Reach);
    }
}
