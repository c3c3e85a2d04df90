//! What the steady screen of `collect` shows.

use std::time::Instant;

use ballbar::JointKind;
use ballbar_calib::model::Robot;

use crate::collect::Now;
use crate::terminal::screen::{Bar, Joint, Picture, Poses};
use crate::units::{ScreenUnit, mm_from_m};

/// What changes little during a run.
pub(crate) struct Still {
    /// The command, the port, the board, the robot.
    head: Vec<String>,
    /// Kind and limits of each joint, in the units of the screen.
    joints: Vec<(JointKind, [f64; 2])>,
    began: Instant,
    /// The operator has paused the run.
    pub(super) is_paused: bool,
}

/// What the person does with the robot, as far as anybody has said.
#[derive(Debug, Default)]
pub(super) enum Next {
    /// Nothing.
    #[default]
    Nothing,
    /// Drive the robot to where the arrows point.
    Drive { line: usize },
    /// Start a program.
    Start(String),
}

const KEYS: &[(&str, &str)] =
    &[("Enter", "done"), ("e", "erase the last pose"), ("s", "skip the next"), ("p", "pause"), ("r", "resume"), ("q", "quit")];

impl Still {
    pub(crate) fn new(head: Vec<String>, robot: &Robot) -> Self {
        let limits = |(&kind, limits): (&JointKind, &ballbar_calib::model::JointLimits)| {
            let unit = ScreenUnit::from(kind);
            (kind, [unit.from_si(limits.min), unit.from_si(limits.max)])
        };
        let joints = robot.chain.joint_kinds().iter().zip(&robot.limits).map(limits).collect();
        Self { head, joints, began: Instant::now(), is_paused: false }
    }

    pub(super) fn kinds(&self) -> Vec<JointKind> {
        self.joints.iter().map(|&(kind, _)| kind).collect()
    }
}

/// The picture of a moment; `asked` is what has to be confirmed before anything goes on.
pub(super) fn picture(still: &Still, now: &Now, next: &Next, asked: Option<&str>) -> Picture {
    let joint = |(i, &(kind, limits)): (usize, &(JointKind, [f64; 2]))| {
        let unit = ScreenUnit::from(kind);
        let goal = now.goal.map(|goal| unit.from_si(goal.q.as_array()[i]));
        Joint { limits: Some(limits), goal, ..Joint::new(kind, unit.from_si(now.view.q.as_array()[i])) }
    };
    let displacement_m = now.view.displacement_m;
    let joined = now.joined.as_ref();
    let (least_m, most_m) = now.travel_m;
    Picture {
        head: still.head.clone(),
        elapsed: still.began.elapsed(),
        joints: still.joints.iter().enumerate().map(joint).collect(),
        bar: Bar {
            name: joined.map(ToString::to_string),
            length_mm: joined.zip(displacement_m).map(|(bar, m)| mm_from_m(bar.bar_m + m)),
            displacement_mm: displacement_m.map(mm_from_m),
            travel_mm: Some([mm_from_m(least_m), mm_from_m(most_m)]),
            code: None,
        },
        tool_mm: None,
        rate_hz: now.rate_hz,
        lost: now.losses.lost(),
        stillness: Some(now.view.stillness),
        is_homed: Some(now.view.is_homed),
        residual_mm: now.residual_m.map(mm_from_m),
        poses: Poses { done: now.done as u64, of: Some(now.all as u64), left: now.left },
        next: words(still, now, next, asked),
        is_waiting: asked.is_some() || still.is_paused || !matches!(next, Next::Nothing),
        keys: KEYS,
    }
}

fn words(still: &Still, now: &Now, next: &Next, asked: Option<&str>) -> String {
    if still.is_paused {
        return "paused: r to go on".into();
    }
    let robot = match next {
        Next::Nothing => None,
        Next::Drive { line } => Some(format!("drive the robot to line {line} of the plan, to the values behind the arrows")),
        Next::Start(words) => Some(words.clone()),
    };
    match (robot, asked) {
        (Some(robot), Some(asked)) => format!("{robot}; then {asked}, and press Enter"),
        (Some(robot), None) => format!("{robot}, and let it stand still"),
        (None, Some(asked)) => format!("{asked}, then press Enter"),
        (None, None) => match now.goal {
            Some(goal) => format!("the robot is at line {} of the plan: stay clear", goal.line),
            None => "stay clear of the robot".into(),
        },
    }
}
