//! Margins in a table, and what `host-cal plan --check` prints.

use super::report::Report;
use crate::documents::{CheckDocument, Least, MarginLine};
use crate::terminal::table::{Columns, fixed};

impl Report for CheckDocument {
    fn text(&self) -> String {
        let verdict = if self.is_kept { "All margins are kept." } else { "Margins are NOT kept." };
        format!(
            "{}: {} rows for {}, {} of them to measure; looked at in {} steps\n\n{}\n{verdict}\n",
            self.plan,
            self.rows,
            self.robot,
            self.poses,
            self.least.steps,
            least_text(&self.least, &self.margins)
        )
    }
}

pub(super) fn least_text(least: &Least, margins: &MarginLine) -> String {
    let mut table = Columns::new(&["<margin", "asked for", "least found", "<where"]);
    let mut line = |what: &str, asked: f64, found: f64, decimals: usize, place: String| {
        table.row([what.to_owned(), fixed(asked, decimals), fixed(found, decimals), place]);
    };
    if let Some(limit_deg) = least.limit_deg {
        line("to joint limits, deg", margins.limit_deg, limit_deg, 1, String::new());
    }
    if let Some(limit_mm) = least.limit_mm {
        line("to slide limits, mm", margins.limit_mm, limit_mm, 1, String::new());
    }
    line("to the ends of travel, mm", margins.travel_mm, least.travel_mm, 1, "nominal robot".to_owned());
    let robots = format!("worst of {} plausible robots", least.plausible_robots);
    line("to the ends of travel, mm", margins.travel_mm, least.plausible_travel_mm, 1, robots);
    let nearest = format!("{}, on the way to row {}", least.nearest, least.nearest_row);
    line("between solids, mm", margins.clearance_mm, least.clearance_mm, 1, nearest);
    line("from singularities", margins.singularity, least.singularity, 3, "measured poses".to_owned());
    table.text()
}
