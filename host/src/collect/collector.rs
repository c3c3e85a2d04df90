//! The walk over a plan.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use ballbar::JointVector;

use super::board_watch::{BoardWatch, Stand};
use super::errors::CollectError;
use super::ledger::{Joined, Ledger, RowState};
use super::operator::{Event, Measured, Operator, Wish};
use super::repeat::Repeat;
use super::track::TrackOptions;
use super::{Nearness, drive};
use crate::board::StreamLosses;
use crate::plan::Cell;
use crate::robot_link::JointSpeed;
use crate::session::{Connection, MeasuredPose};

/// How a plan is walked.
#[derive(Clone, Debug)]
pub struct CollectOptions {
    /// How fast the robot goes; with `track`, while the bar is on.
    pub speed: JointSpeed,
    /// How fast it goes without the bar.
    pub free_speed: JointSpeed,
    /// How near the encoders have to be to where the robot was sent.
    pub near: Nearness,
    /// How far the robot may be off the straight way in joint space.
    pub way: Nearness,
    /// How long the arm may take to stand still.
    pub patience: Duration,
    /// Measure while the robot moves.
    pub track: Option<TrackOptions>,
    /// Return to one pose of every shell before it is left.
    pub repeat: bool,
}

impl Default for CollectOptions {
    fn default() -> Self {
        let speed = JointSpeed { revolute_rad_s: 30_f64.to_radians(), prismatic_m_s: 0.1 };
        Self {
            speed,
            free_speed: speed,
            near: Nearness { turn_rad: 0.5_f64.to_radians(), slide_m: 1e-3 },
            way: Nearness { turn_rad: 5_f64.to_radians(), slide_m: 0.02 },
            patience: Duration::from_secs(20),
            track: None,
            repeat: true,
        }
    }
}

/// How a run ended that no error ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// Nothing of the plan is left but what was missed or skipped.
    Done,
    /// The operator wanted it.
    Quit,
}

/// What came of a run.
#[derive(Clone, Debug, Default)]
pub struct Summary {
    /// Poses written, those erased again not counted.
    pub written: usize,
    /// Poses returned to.
    pub repeats: Vec<Repeat>,
    /// What the controller or the bar did, in words.
    pub troubles: Vec<String>,
    /// Lost between board and host.
    pub losses: StreamLosses,
}

/// Walks a plan.
pub struct Collector<'a, 'o> {
    pub(super) cell: &'a Cell<'a>,
    pub(super) ledger: Ledger<'a>,
    pub(super) board: BoardWatch,
    pub(super) operator: &'o mut dyn Operator,
    pub(super) options: CollectOptions,
    pub(super) attached: Option<Joined>,
    /// Time of the board at which the latest move began: what stood still before is no measurement of this place.
    pub(super) since_us: u64,
    pub(super) summary: Summary,
    /// How the arm stood when rows were measured in this run.
    pub(super) stands: HashMap<usize, Stand>,
    pub(super) missed_in_a_row: usize,
    began: Instant,
    told: Instant,
}

/// Rows that may be missed one after the other before something must be wrong for all of them.
const MISSED_IN_A_ROW: usize = 3;
/// How often the operator is told how the arm stands.
const TELL: Duration = Duration::from_millis(100);

impl<'a, 'o> Collector<'a, 'o> {
    /// At a plan, of which some may be done, with a board that streams.
    pub fn new(
        cell: &'a Cell<'a>,
        ledger: Ledger<'a>,
        board: BoardWatch,
        operator: &'o mut dyn Operator,
        options: CollectOptions,
    ) -> Self {
        let (began, summary) = (Instant::now(), Summary::default());
        let (attached, since_us, missed_in_a_row) = (None, 0, 0);
        let stands = HashMap::new();
        Self { cell, ledger, board, operator, options, attached, since_us, summary, stands, missed_in_a_row, began, told: began }
    }

    /// Measures all that is left, by moving the robot.
    ///
    /// # Errors
    /// [`CollectError`] when it has to stop before; the robot was stopped then.
    pub fn drive(&mut self, robot: &mut dyn crate::robot_link::RobotLink) -> Result<Ended, CollectError> {
        self.check_board()?;
        drive::Drive::new(self, robot).run()
    }

    /// Measures all that is left, while somebody or something else moves the robot: every pose at which it stands still counts for
    /// the row within `near` of it. `load` is called for each shell before it is begun.
    ///
    /// # Errors
    /// [`CollectError`] when it has to stop before.
    pub fn follow(&mut self, near: Nearness, load: &mut dyn FnMut(Joined)) -> Result<Ended, CollectError> {
        self.check_board()?;
        self.follow_all(near, load)
    }

    /// Ends the stream and the session. What came of the run, and the plan with what is done of it.
    ///
    /// # Errors
    /// [`CollectError::Record`].
    pub fn end(self) -> Result<(Summary, Ledger<'a>), CollectError> {
        let losses = self.board.end()?;
        Ok((Summary { losses, ..self.summary }, self.ledger))
    }

    /// Hears the board, and shows the operator the arm now and then.
    pub(super) fn listen(&mut self) -> Result<(), CollectError> {
        self.board.listen()?;
        if self.told.elapsed() > TELL
            && let Some(view) = self.board.latest()
        {
            self.told = Instant::now();
            self.operator.tell(&Event::Now(view))?;
        }
        Ok(())
    }

    /// Carries out what the operator wishes meanwhile. True when the run is to end.
    pub(super) fn obey(&mut self, target: Option<usize>) -> Result<bool, CollectError> {
        while let Some(wish) = self.operator.wish() {
            match wish {
                Wish::Quit => return Ok(true),
                Wish::EraseLast => self.erase_last()?,
                Wish::Skip => self.skip(target)?,
                Wish::Pause if self.pause()? => return Ok(true),
                Wish::Pause | Wish::Confirm | Wish::Resume => {}
            }
        }
        Ok(false)
    }

    fn erase_last(&mut self) -> Result<(), CollectError> {
        let line = self.board.recorder().erase_last()?;
        if let Some(row) = line.and_then(|line| self.ledger.row_of_line(line)) {
            self.ledger.set(row, RowState::Todo);
            self.summary.written = self.summary.written.saturating_sub(1);
        }
        // An arm that still stands there is measured anew.
        self.rearm()?;
        Ok(self.operator.tell(&Event::Done(Wish::EraseLast))?)
    }

    fn skip(&mut self, target: Option<usize>) -> Result<(), CollectError> {
        if let Some(row) = target {
            self.board.recorder().skip(self.ledger.rows()[row].line)?;
            self.ledger.set(row, RowState::Skipped);
        }
        Ok(self.operator.tell(&Event::Done(Wish::Skip))?)
    }

    /// Waits for the operator. True when the run is to end.
    fn pause(&mut self) -> Result<bool, CollectError> {
        self.operator.tell(&Event::Done(Wish::Pause))?;
        loop {
            self.listen()?;
            match self.operator.wish() {
                Some(Wish::Resume | Wish::Confirm) => {
                    self.operator.tell(&Event::Done(Wish::Resume))?;
                    return Ok(false);
                }
                Some(Wish::Quit) => return Ok(true),
                Some(Wish::EraseLast) => self.erase_last()?,
                _ => {}
            }
        }
    }

    /// Waits until the arm stands still near a joint vector; `None` when it does not.
    pub(super) fn stand_at(&mut self, q: &JointVector<f64>) -> Result<Option<Stand>, CollectError> {
        let kinds = self.cell.robot.chain.joint_kinds();
        let began = Instant::now();
        while began.elapsed() < self.options.patience {
            self.listen()?;
            let Some(stand) = self.board.take_stand() else { continue };
            if stand.began_us >= self.since_us && self.options.near.holds(kinds, &stand.q, q) {
                return Ok(Some(stand));
            }
        }
        Ok(None)
    }

    /// From here on a pose counts only if the arm stands still anew.
    pub(super) fn rearm(&mut self) -> Result<(), CollectError> {
        self.since_us = self.board.rearm()?;
        Ok(())
    }

    /// Keeps a pose for a row, unless it cannot be one.
    pub(super) fn keep(&mut self, row: usize, stand: Option<Stand>) -> Result<(), CollectError> {
        let planned = &self.ledger.rows()[row];
        let Some(stand) = stand else { return self.miss(row, "the arm did not come to stand still there") };
        let Some(displacement_m) = stand.displacement_m else { return self.miss(row, "the bar is beyond its travel there") };
        let (computed_m, reserve_m) = self.cell.length(&stand.q, &self.cell.rig.pairing(planned.pairing));
        let length_m = planned.bar_m + displacement_m;
        let residual_m = length_m - computed_m;
        if residual_m.abs() > reserve_m {
            let why = format!(
                "the bar is {:+.1} mm longer than computed, more than any robot's parameters are plausibly off ({:.1} mm)",
                residual_m * 1e3,
                reserve_m * 1e3
            );
            return self.miss(row, &why);
        }
        let pose = MeasuredPose { q: stand.q, displacement_m, t_s: stand.t_s, rate_m_s: None, plan_row: Some(planned.line) };
        self.board.recorder().poses(&[pose])?;
        self.stands.insert(row, stand);
        self.ledger.set(row, RowState::Measured);
        self.summary.written += 1;
        self.missed_in_a_row = 0;
        let measured = Measured {
            line: planned.line,
            done: self.ledger.count(&RowState::Measured),
            all: self.ledger.measurable(),
            length_m,
            travel_left_m: self.board.travel_left_m(displacement_m),
            residual_m,
            left: self.time_left(),
        };
        Ok(self.operator.tell(&Event::Measured(&measured))?)
    }

    /// Gives a row up for this run.
    pub(super) fn miss(&mut self, row: usize, why: &str) -> Result<(), CollectError> {
        let line = self.ledger.rows()[row].line;
        if *self.ledger.state(row) == RowState::Todo {
            self.ledger.set(row, RowState::Missed(why.to_owned()));
            self.operator.tell(&Event::Missed { line, why })?;
        }
        self.missed_in_a_row += 1;
        if self.missed_in_a_row >= MISSED_IN_A_ROW {
            return Err(CollectError::TooManyMissed { count: self.missed_in_a_row, line, why: why.to_owned() });
        }
        Ok(())
    }

    /// Says what went wrong, and goes on.
    pub(super) fn trouble(&mut self, words: String) -> Result<(), CollectError> {
        self.operator.tell(&Event::Trouble(&words))?;
        self.summary.troubles.push(words);
        Ok(())
    }

    /// Names of what a bar joins.
    pub(super) fn connection(&self, (pairing, bar_m): Joined) -> Connection {
        let rig = self.cell.rig;
        Connection { chuck: rig.chucks[pairing.chuck].name.clone(), sphere: rig.spheres[pairing.sphere].name.clone(), bar_m }
    }

    /// At the pace of this run.
    pub(super) fn time_left(&self) -> Duration {
        let per_pose = self.began.elapsed().div_f64(self.summary.written.max(1) as f64);
        per_pose.mul_f64(self.ledger.count(&RowState::Todo) as f64)
    }

    /// The board's robot is the plan's, and knows where it is.
    fn check_board(&mut self) -> Result<(), CollectError> {
        let (board, robot) = (self.board.robot(), self.cell.robot);
        let other = |what: String| Err(CollectError::OtherRobot { what });
        let (found, expected) = (board.kinds(), robot.chain.joint_kinds());
        if found != expected {
            return other(format!(
                "{} joints {found:?}, the plan's robot has {} joints {expected:?}",
                found.len(),
                expected.len()
            ));
        }
        let encoders = board.set().encoders.iter().zip(&robot.encoders).enumerate();
        for (i, (on_board, facts)) in encoders {
            let expected = facts.encoder.map(|encoder| encoder.counts_per_unit as f32);
            let found = on_board.counts_per_unit;
            if let Some(expected) = expected.filter(|&expected| expected != found) {
                return other(format!("joint {} has {found} counts a radian or metre, in the plan's robot {expected}", i + 1));
            }
        }
        if !self.board.view()?.is_homed {
            return Err(CollectError::NotHomed);
        }
        Ok(())
    }
}
