//! `host-cal paper`: the paper's experiment beside the paper's numbers.

use clap::Args;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print};
use crate::paper::{BesideThePaper, run};
use crate::terminal::progress;
use crate::terminal::table::{Columns, fixed};

/// Reproduce the paper's experiment, its tables and its numbers
#[derive(Args)]
#[command(
    after_help = "Example:\n  host-cal paper\n\nPoses on 46 and 61 cm shells are planned with Table II's design parameters, and lengths\nsimulated from its optimised ones with 0.084 mm of noise."
)]
pub(super) struct PaperArgs {
    /// Another seed gives other poses and other noise
    #[arg(long, default_value_t = 1993)]
    seed: u64,
    #[command(flatten)]
    output: OutputArgs,
}

impl PaperArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        const STEPS: f64 = 1000.0;
        let bar = progress(STEPS as u64, "the paper's experiment");
        let mut done = 0.0;
        let experiment = run(self.seed, |share| {
            done += share * STEPS;
            bar.set_position(done as u64);
        });
        bar.finish_and_clear();
        let report = BesideThePaper::new(self.seed, &experiment?)?;
        print(&report, self.output.json)?;
        Ok(Outcome::Good)
    }
}

impl Report for BesideThePaper {
    fn text(&self) -> String {
        let mut text =
            format!("The paper's experiment, simulated: {} poses on nine 46 cm shells, as many on 61 cm ones\n\n", self.poses);
        text += &numbers_text(self);
        text += "\nTable I: parameters identified, by class of pairings (all 511 subsets of the nine)\n";
        text += &table_one_text(self);
        text += "\nTable II: the free parameters, recovered from simulated lengths\n";
        text += &table_two_text(self);
        text += "\nFig. 3: residuals against the longitude of the shells\n";
        let mut table = Columns::new(&["from deg", "to deg", "poses", "mean mm", "RMS mm"]);
        for slice in &self.by_longitude {
            let numbers = [fixed(slice.mean_mm, 4), fixed(slice.rms_mm, 4)];
            table.row([slice.from_deg.to_string(), slice.to_deg.to_string(), slice.poses.to_string()].into_iter().chain(numbers));
        }
        text += &table.text();
        text += "\nWhere this differs from the paper's words\n";
        for difference in &self.differences {
            text += &format!("- {difference}\n");
        }
        text
    }
}

fn numbers_text(report: &BesideThePaper) -> String {
    let mut table = Columns::new(&["<", "<unit", "paper", "here", "<"]);
    for number in &report.numbers {
        let show = |value: f64| match value {
            whole if whole.fract() == 0.0 => format!("{whole:.0}"),
            tiny if tiny.abs() < 1e-4 => format!("{tiny:.0e}"),
            other => format!("{other:.3}"),
        };
        let paper = number.paper.map_or_else(|| "-".to_owned(), show);
        table.row([number.what.to_owned(), number.unit.to_owned(), paper, show(number.here), number.note.clone()]);
    }
    table.text()
}

fn table_one_text(report: &BesideThePaper) -> String {
    let mut table = Columns::new(&["pairings", "chucks", "spheres", "subsets", "identified", "rule"]);
    for class in &report.table_one {
        let identified = if class.min_rank == class.max_rank {
            class.max_rank.to_string()
        } else {
            format!("{}-{}", class.min_rank, class.max_rank)
        };
        let counts = [class.pairings, class.chucks, class.spheres, class.subsets].map(|count| count.to_string());
        table.row(counts.into_iter().chain([identified, class.rule.to_string()]));
    }
    table.text() + "  rule: N - 6 + g(chucks) + g(spheres), g(1, 2, 3) = 0, 2, 3\n"
}

fn table_two_text(report: &BesideThePaper) -> String {
    let mut table = Columns::new(&["<parameter", "<unit", "design", "Table II", "recovered", "difference", "std. dev."]);
    for line in &report.table_two {
        let digits = if line.unit == "mm" { 4 } else { 6 };
        let number = |value: f64| fixed(value, digits);
        let std = line.std.map_or_else(String::new, number);
        let numbers = [line.design, line.table_two, line.recovered, line.difference].map(number);
        table.row([line.name.clone(), line.unit.to_owned()].into_iter().chain(numbers).chain([std]));
    }
    table.text()
}
