//! The walk over a plan.

use std::collections::{HashMap, VecDeque};
use std::time::{Duration, Instant};

use ballbar::JointVector;
use ballbar_calib::plan::Cell;

use super::Nearness;
use super::board_watch::{BoardWatch, Stand, View};
use super::check_board::check_board;
use super::drive::Drive;
use super::errors::CollectError;
use super::follow::Guide;
use super::ledger::{Joined, Ledger, RowState};
use super::operator::{Event, Measured, Operator, Wish};
use super::repeat::Repeat;
use super::talker::Talker;
use super::track::TrackOptions;
use crate::board::{BoardError, StreamLosses};
use crate::robot_link::{JointSpeed, LinkError};
use crate::session::{Connection, MeasuredPose};
use crate::units::mm_from_m;

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

/// Where the bar is, as far as is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Bar {
    /// Nobody has said, and the LVDT tells nothing certain.
    Unknown,
    /// Taken off, as the operator has confirmed.
    Off,
    /// Attached, and the LVDT agrees.
    On(Joined),
}

/// How waiting for a rest ended.
pub(super) enum Rest {
    /// The arm stands.
    Still(Stand),
    /// It does not come to rest.
    Never,
    /// There is no bar within its travel.
    BarOff,
    /// The operator wants to end.
    Quit,
}

/// So long without a bar within its travel is no jolt, by the board's clock.
const OFF_US: u64 = 100_000;

/// Walks a plan.
pub struct Collector<'a, 'o> {
    pub(super) cell: &'a Cell<'a>,
    pub(super) ledger: Ledger<'a>,
    pub(super) board: BoardWatch,
    pub(super) operator: &'o mut dyn Operator,
    pub(super) options: CollectOptions,
    pub(super) bar: Bar,
    /// Wishes that came while none could be carried out.
    pub(super) wishes: VecDeque<Wish>,
    /// Time of the board at which the latest move began: what stood still before is no measurement of this place.
    pub(super) since_us: u64,
    pub(super) summary: Summary,
    /// How the arm stood when rows were measured in this run.
    pub(super) stands: HashMap<usize, Stand>,
    /// The row that the arm is to go to, or is at.
    pub(super) goal: Option<usize>,
    /// Joints of which it was said that they are beyond their limits.
    said_beyond: Vec<usize>,
    missed_in_a_row: usize,
    rows_done: usize,
    began: Instant,
    told: Instant,
    heard_talker: Instant,
}

/// Rows that may be missed one after the other before something must be wrong for all of them.
const MISSED_IN_A_ROW: usize = 3;
/// How often the operator is told how the arm stands.
const TELL: Duration = Duration::from_millis(100);
/// How often who talks besides the board is heard.
const HEAR: Duration = Duration::from_millis(50);

impl<'a, 'o> Collector<'a, 'o> {
    /// At a plan, of which some may be done, with a board that streams.
    pub fn new(ledger: Ledger<'a>, board: BoardWatch, operator: &'o mut dyn Operator, options: CollectOptions) -> Self {
        let (began, summary) = (Instant::now(), Summary::default());
        let (bar, since_us, missed_in_a_row) = (Bar::Unknown, 0, 0);
        let (stands, wishes) = (HashMap::new(), VecDeque::new());
        Self {
            cell: ledger.cell(),
            ledger,
            board,
            operator,
            options,
            bar,
            wishes,
            since_us,
            summary,
            stands,
            goal: None,
            said_beyond: Vec::new(),
            missed_in_a_row,
            rows_done: 0,
            began,
            told: began,
            heard_talker: began,
        }
    }

    /// Measures all that is left, by moving the robot.
    ///
    /// # Errors
    /// [`CollectError`] when it has to stop before; the robot was stopped then.
    pub fn drive(&mut self, robot: &mut dyn crate::robot_link::RobotLink) -> Result<Ended, CollectError> {
        let ended = self.check_board().and_then(|()| Drive::new(self, robot).run());
        quit_if_stopped(ended)
    }

    /// Measures all that is left, while somebody or something else moves the robot: every pose at which it stands still counts for
    /// the row within `near` of it.
    ///
    /// # Errors
    /// [`CollectError`] when it has to stop before.
    pub fn follow(&mut self, near: Nearness, guide: &Guide) -> Result<Ended, CollectError> {
        let ended = self.check_board().and_then(|()| self.follow_all(near, guide));
        quit_if_stopped(ended)
    }

    /// Ends the stream and the session. What came of the run, the plan with what is done of it, and whether the session could be
    /// closed.
    pub fn end(self) -> (Summary, Ledger<'a>, Result<(), CollectError>) {
        let (losses, closed) = self.board.end();
        (Summary { losses, ..self.summary }, self.ledger, closed)
    }

    /// Hears the board and who else talks, and shows the operator the arm now and then.
    pub(super) fn listen(&mut self, talker: &mut dyn Talker) -> Result<(), CollectError> {
        self.board.listen()?;
        if self.heard_talker.elapsed() > HEAR {
            talker.hear()?;
            self.heard_talker = Instant::now();
        }
        if let Some(refusal) = self.board.take_refusal() {
            self.trouble(refusal)?;
        }
        if self.told.elapsed() > TELL
            && let Some(now) = self.now()
        {
            self.told = Instant::now();
            self.operator.tell(&Event::Now(&now))?;
            self.watch_limits(&now.view)?;
        }
        Ok(())
    }

    /// Says once of every joint that the encoders have it beyond its limits.
    fn watch_limits(&mut self, view: &View) -> Result<(), CollectError> {
        let robot = self.cell.robot;
        for beyond in robot.beyond_limits(view.q.as_array()).filter(|_| view.is_homed) {
            if !self.said_beyond.contains(&beyond.joint) {
                self.said_beyond.push(beyond.joint);
                self.trouble(format!("{beyond}: is the board homed where the robot stands?"))?;
            }
        }
        Ok(())
    }

    /// Whether the operator wants to end. Other wishes are kept for [`Collector::obey`].
    pub(super) fn wants_to_end(&mut self) -> bool {
        while let Some(wish) = self.operator.wish() {
            if wish == Wish::Quit {
                self.wishes.push_front(wish);
                return true;
            }
            self.wishes.push_back(wish);
        }
        false
    }

    /// Carries out what the operator wished meanwhile; `target` finds the row that would be measured next. True when the run is to
    /// end.
    pub(super) fn obey(
        &mut self,
        target: impl Fn(&Ledger<'_>) -> Option<usize>,
        talker: &mut dyn Talker,
    ) -> Result<bool, CollectError> {
        while let Some(wish) = self.wishes.pop_front().or_else(|| self.operator.wish()) {
            match wish {
                Wish::Quit => return Ok(true),
                Wish::EraseLast => self.erase_last()?,
                Wish::Skip => self.skip(target(&self.ledger))?,
                Wish::Pause if self.pause(talker)? => return Ok(true),
                Wish::Pause | Wish::Confirm | Wish::Resume => {}
            }
        }
        Ok(false)
    }

    fn erase_last(&mut self) -> Result<(), CollectError> {
        let erased = self.board.recorder().erase_last()?;
        if erased.poses() == 0 {
            return Ok(self.operator.tell(&Event::Trouble("there is no pose to erase"))?);
        }
        self.summary.written = self.summary.written.saturating_sub(erased.poses());
        if let Some(row) = erased.plan_row.and_then(|line| self.ledger.row_of_line(line)) {
            self.ledger.set(row, RowState::Todo);
            self.stands.remove(&row);
        }
        // An arm that still stands there is measured anew.
        self.rearm()?;
        Ok(self.operator.tell(&Event::Done(Wish::EraseLast))?)
    }

    fn skip(&mut self, target: Option<usize>) -> Result<(), CollectError> {
        let Some(row) = target else { return Ok(()) };
        self.board.recorder().skip(self.ledger.rows()[row].line)?;
        self.ledger.set(row, RowState::Skipped);
        Ok(self.operator.tell(&Event::Done(Wish::Skip))?)
    }

    /// Waits for the operator. True when the run is to end.
    fn pause(&mut self, talker: &mut dyn Talker) -> Result<bool, CollectError> {
        self.operator.tell(&Event::Done(Wish::Pause))?;
        let mut later = Vec::new();
        loop {
            self.listen(talker)?;
            match self.wishes.pop_front().or_else(|| self.operator.wish()) {
                Some(Wish::Resume | Wish::Confirm) => {
                    self.operator.tell(&Event::Done(Wish::Resume))?;
                    self.wishes.extend(later);
                    return Ok(false);
                }
                Some(Wish::Quit) => return Ok(true),
                Some(Wish::EraseLast) => self.erase_last()?,
                Some(Wish::Skip) => later.push(Wish::Skip),
                Some(Wish::Pause) | None => {}
            }
        }
    }

    /// Waits until the arm stands still near a joint vector, since the latest move.
    pub(super) fn rest_at(&mut self, q: &JointVector<f64>, talker: &mut dyn Talker) -> Result<Rest, CollectError> {
        let kinds = self.cell.robot.chain.joint_kinds();
        let began = Instant::now();
        while began.elapsed() < self.options.patience {
            self.listen(talker)?;
            if self.wants_to_end() {
                return Ok(Rest::Quit);
            }
            if self.is_bar_gone()? {
                return Ok(Rest::BarOff);
            }
            let Some(stand) = self.board.take_stand() else { continue };
            if stand.began_us >= self.since_us && self.options.near.holds(kinds, &stand.q, q) {
                return Ok(Rest::Still(stand));
            }
        }
        Ok(Rest::Never)
    }

    /// Whether the bar that should be on has not been within its travel for some time.
    pub(super) fn is_bar_gone(&mut self) -> Result<bool, CollectError> {
        let view = self.board.view()?;
        let is_off = view.off_since_us.is_some_and(|since_us| view.t_us.saturating_sub(since_us) >= OFF_US);
        Ok(is_off && matches!(self.bar, Bar::On(_)))
    }

    /// From here on a pose counts only if the arm stands still anew.
    pub(super) fn rearm(&mut self) -> Result<(), CollectError> {
        self.since_us = self.board.rearm()?;
        Ok(())
    }

    /// Keeps a pose for a row, unless it cannot be one.
    pub(super) fn keep(&mut self, row: usize, stand: Stand) -> Result<(), CollectError> {
        let planned = &self.ledger.rows()[row];
        let Some(displacement_m) = stand.displacement_m else { return self.miss(row, "the bar is beyond its travel there") };
        let (residual_m, reserve_m) = self.residual_m(row, &stand.q, displacement_m);
        if residual_m.abs() > reserve_m {
            let (residual_mm, reserve_mm) = (mm_from_m(residual_m), mm_from_m(reserve_m));
            let why = format!(
                "the bar is {residual_mm:+.1} mm longer than computed, more than any robot's parameters are plausibly off ({reserve_mm:.1} mm)"
            );
            return self.miss(row, &why);
        }
        let (t_s, plan_row) = (stand.t_s, Some(planned.line));
        let (q, approach) = (stand.q, stand.approach);
        self.board.recorder().poses(&[MeasuredPose { q, approach, displacement_m, t_s, rate_m_s: None, plan_row }])?;
        self.stands.insert(row, stand);
        self.summary.written += 1;
        self.done(row, displacement_m, residual_m)
    }

    /// Measured less computed by the current model, and how far plausible robots may be off, metres.
    pub(super) fn residual_m(&self, row: usize, q: &JointVector<f64>, displacement_m: f64) -> (f64, f64) {
        let planned = &self.ledger.rows()[row];
        let (computed_m, reserve_m) = self.cell.length(q, &self.cell.rig.pairing(planned.pairing));
        (planned.bar_m + displacement_m - computed_m, reserve_m)
    }

    /// A row is measured.
    pub(super) fn done(&mut self, row: usize, displacement_m: f64, residual_m: f64) -> Result<(), CollectError> {
        self.ledger.set(row, RowState::Measured);
        self.missed_in_a_row = 0;
        self.rows_done += 1;
        let planned = &self.ledger.rows()[row];
        let measured = Measured {
            line: planned.line,
            done: self.ledger.count(&RowState::Measured),
            all: self.ledger.measurable(),
            length_m: planned.bar_m + displacement_m,
            travel_left_m: self.board.travel_left_m(displacement_m),
            residual_m,
            left: self.time_left().unwrap_or_default(),
        };
        Ok(self.operator.tell(&Event::Measured(&measured))?)
    }

    /// Gives a row up for this run.
    pub(super) fn miss(&mut self, row: usize, why: &str) -> Result<(), CollectError> {
        let line = self.ledger.rows()[row].line;
        if *self.ledger.state(row) != RowState::Todo {
            return Ok(());
        }
        self.ledger.set(row, RowState::Missed(why.to_owned()));
        self.operator.tell(&Event::Missed { line, why })?;
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

    /// At the pace of this run, once there is one.
    pub(super) fn time_left(&self) -> Option<Duration> {
        let per_row = self.began.elapsed().div_f64(self.rows_done.max(1) as f64);
        (self.rows_done > 0).then(|| per_row.mul_f64(self.ledger.count(&RowState::Todo) as f64))
    }

    /// The board's robot is the plan's, and knows where it is.
    fn check_board(&mut self) -> Result<(), CollectError> {
        let is_homed = self.board.view()?.is_homed;
        check_board(self.cell.robot, self.board.robot(), is_homed)
    }
}

/// A wait that the user has ended is no error.
fn quit_if_stopped(ended: Result<Ended, CollectError>) -> Result<Ended, CollectError> {
    match ended {
        Err(CollectError::Board(BoardError::Stopped) | CollectError::Robot(LinkError::Stopped)) => Ok(Ended::Quit),
        ended => ended,
    }
}
