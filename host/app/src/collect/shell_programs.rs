//! A plan as programs of a controller: for each shell one that brings the robot there, without the bar, and one that measures.

use ballbar_calib::plan::{CheckedPlan, PlanRow, RowKind};

use super::ledger::shells;
use crate::robot_link::JointSpeed;
use crate::robot_link::program::{ControllerSetup, Program, ProgramStep};
use crate::session::Connection;

/// How a plan's programs go over its rows.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramOptions {
    /// No joint is faster.
    pub speed: JointSpeed,
    /// How long the robot stands at a measured row, seconds.
    pub stand_s: f64,
    /// Of the controller.
    pub setup: ControllerSetup,
}

/// The two programs of a shell.
#[derive(Clone, Debug, PartialEq)]
pub struct ShellProgram {
    /// `TOnn`: from where the shell before ends to where the bar is attached.
    pub approach: Program,
    /// `BARnn`: from there over the shell.
    pub measure: Program,
}

/// The programs of all shells of a plan, in its order. Each begins where the one before it ends.
pub fn plan_programs(plan: &CheckedPlan<'_>, options: &ProgramOptions) -> Vec<ShellProgram> {
    let (rows, rig, kinds) = (plan.rows(), plan.cell().rig, plan.cell().robot.chain.joint_kinds());
    let program = |name: String, steps, before, after| {
        let ProgramOptions { speed, stand_s, setup } = options.clone();
        Program { name, kinds: kinds.to_vec(), steps, speed, stand_s, before, after, setup }
    };
    let step = |row: &PlanRow| ProgramStep {
        q: row.q,
        is_measured: row.kind == RowKind::Measure,
        comment: format!("line {}, {}", row.line, rig.pairing_name(row.pairing)),
    };
    let on_the_way = |row: &PlanRow| ProgramStep { is_measured: false, ..step(row) };
    let shell_program = |(number, shell): (usize, std::ops::Range<usize>)| {
        let attached = shell.clone().find(|&row| rows[row].bar.is_some()).unwrap_or(shell.start);
        let way = &rows[shell.start.saturating_sub(1)..=attached];
        let PlanRow { pairing, bar_m, .. } = rows[attached];
        let (chuck, sphere) = (rig.chucks[pairing.chuck].name.clone(), rig.spheres[pairing.sphere].name.clone());
        let bar = Connection { chuck, sphere, bar_m };
        let (to, over) = (format!("TO{number:02}"), format!("BAR{number:02}"));
        ShellProgram {
            approach: program(
                to,
                way.iter().map(on_the_way).collect(),
                "take the bar OFF".into(),
                format!("attach the bar {bar}, next is {over}"),
            ),
            measure: program(
                over,
                rows[attached..shell.end].iter().map(step).collect(),
                format!("the bar has to be ON: {bar}"),
                "all poses done, take the bar OFF".into(),
            ),
        }
    };
    (1..).zip(shells(rows)).map(shell_program).collect()
}
