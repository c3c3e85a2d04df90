//! Unimation controllers with VAL or VAL II (PUMA 260, 560, 761 and their kind), by the serial line of their terminal.
//!
//! A move is what an operator would type:
//!
//! ```text
//! .WHERE                    where it is, so that it can be told whether it moved
//! .SPEED 25                 percent
//! .POINT #BBAR              a precision point: joint angles
//! CHANGE? 10.000,-45.000,…  degrees
//! CHANGE?
//! .DO MOVE #BBAR            joint-interpolated; MOVES would be straight in space
//! .WHERE                    again and again, until it stands
//! ```
//!
//! The prompt after `DO` may come at once or when the robot is there: it is not taken for an end. The robot has arrived when two
//! `WHERE`s in a row give the goal; it has failed when a message says so or when it stands elsewhere.
//!
//! Joint angles are VAL's, degrees, joints 1 to 6: robot.toml must have the same zeros and senses. The built-in `puma560` has C. S. G.
//! Lee's; whether a controller has these, `WHERE` beside `host-cal pose` tells.
//!
//! An envelope error, or arm power that is off, is for a person: power is switched on by a button, and nothing here is typed to get over
//! it. A soft envelope error leaves the power on (of V+: Adept's forum, t=137, 12 May 2009): so no move follows
//! either before somebody has looked.
//!
//! Sources: see the monitor's module beside this one.

use std::time::{Duration, Instant};

use ballbar::JointVector;

use super::patience::STOP_WAIT;
use super::speed::percent;
use super::val_monitor::{Heard, Monitor, is_complaint, where_deg};
use super::{Intervention, JointSpeed, LinkError, MoveState, Patience, RobotLink};

pub use super::val_monitor::VAL_BAUD;
use crate::deadline::StopFlag;

const JOINTS: usize = 6;
/// The precision point that moves go to. Six characters are what VAL's names may have.
const POINT: &str = "#BBAR";
/// The robot is where it was sent when no joint is off by more, degrees: VAL prints and keeps some thousandths.
const TOLERANCE_DEG: f64 = 0.05;
/// It stands when no joint has turned by more from one `WHERE` to the next, degrees.
const STANDING_DEG: f64 = 0.02;
/// From one `WHERE` to the next. The line carries one in a sixth of a second.
const LOOK_EVERY: Duration = Duration::from_millis(150);

/// What the controller's protection of arm and people says: whatever holds these words needs a person.
const PROTECTION: [&str; 3] = ["ENVELOPE", "POWER OFF", "PANIC"];

/// Lines from the first to `DO MOVE`, with some to spare.
const LINES_BEFORE_GO: u32 = 8;

/// How fast a robot's joints go at `SPEED 100`, which VAL's percentages are of. VAL does not tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValSpeeds {
    /// No joint is faster, radians per second: so a speed is turned into percent.
    pub fastest_rad_s: f64,
    /// The slowest joint, radians per second: so the time of a move is known.
    pub slowest_rad_s: f64,
}

impl Default for ValSpeeds {
    /// Assumed of a PUMA 560: its wrist stays below 240 degrees per second, its shoulder reaches 50.
    fn default() -> Self {
        Self { fastest_rad_s: 240_f64.to_radians(), slowest_rad_s: 50_f64.to_radians() }
    }
}

impl ValSpeeds {
    /// Whole percent of VAL's `SPEED` at which no joint is faster than `revolute_rad_s`; 1 at least, 100 at most.
    pub fn percent(&self, revolute_rad_s: f64) -> u8 {
        percent(revolute_rad_s, self.fastest_rad_s)
    }

    /// The longest that a way may take at a percentage, seconds.
    fn duration_s(&self, way_deg: f64, percent: u8) -> f64 {
        way_deg.to_radians() / (self.slowest_rad_s * f64::from(percent) / 100.0)
    }
}

/// A link to a VAL controller.
pub struct ValLink {
    monitor: Monitor,
    speeds: ValSpeeds,
    patience: Patience,
    course: Option<Course>,
}

/// The latest move.
struct Course {
    goal_deg: [f64; JOINTS],
    percent: u8,
    stage: Stage,
    started: Instant,
    /// When `DO MOVE` was typed, and how long the move may take from then.
    sent: Option<(Instant, Duration)>,
    from_deg: [f64; JOINTS],
    latest_deg: Option<[f64; JOINTS]>,
    has_moved: bool,
    stands_since: Option<Instant>,
    /// Messages of the controller.
    words: Vec<String>,
    state: MoveState,
}

/// Which reply is awaited.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// To an empty line, so that the prompt is there.
    Ready,
    /// To the first `WHERE`.
    From,
    Speed,
    Point,
    Values,
    Confirm,
    Go,
    Abort,
    /// None; the next `WHERE` is due then.
    Pause(Instant),
    /// To a later `WHERE`.
    Look,
}

impl ValLink {
    /// Opens a serial port, 8 bits, no parity, one stop bit, and waits for VAL's prompt.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn open(port: &str, baud: u32, speeds: ValSpeeds, patience: Patience) -> Result<Self, LinkError> {
        Ok(Self { monitor: Monitor::open(port, baud, patience.answer)?, speeds, patience, course: None })
    }

    /// Takes the move one reply further.
    fn advance(&mut self) -> Result<(), LinkError> {
        let Some(course) = &mut self.course else { return Ok(()) };
        match self.monitor.hear()? {
            Heard::Nothing => {}
            Heard::Unasked(lines) => course.note(&lines),
            Heard::Overdue => course.time_out(),
            Heard::Reply { lines, is_question } => {
                // What was said before this move began does not belong to it.
                if course.stage != Stage::Ready {
                    course.note(&lines);
                }
                if matches!(course.stage, Stage::From | Stage::Look) && !course.look(&lines, &self.patience) {
                    return Err(LinkError::Unexpected {
                        address: self.monitor.port_name().to_owned(),
                        found: lines.join(" | ").chars().take(60).collect(),
                        expected: "WHERE's line of six numbers, and below it one of six joint angles",
                    });
                }
                course.next_stage(is_question);
                if course.state == MoveState::Moving {
                    self.type_line()?;
                }
            }
        }
        let Some(course) = &mut self.course else { return Ok(()) };
        let is_late = match course.sent {
            Some((at, allowed)) => at.elapsed() > allowed,
            None => course.started.elapsed() > self.patience.answer * LINES_BEFORE_GO,
        };
        if is_late {
            course.time_out();
        }
        if let Stage::Pause(due) = course.stage
            && Instant::now() >= due
            && course.state == MoveState::Moving
        {
            course.stage = Stage::Look;
            self.type_line()?;
        }
        Ok(())
    }

    /// Types what the stage asks for.
    fn type_line(&mut self) -> Result<(), LinkError> {
        let Some(course) = &mut self.course else { return Ok(()) };
        let mut wait = self.patience.answer;
        let line = match course.stage {
            Stage::Ready | Stage::Confirm => String::new(),
            Stage::From | Stage::Look => "WHERE".to_owned(),
            Stage::Speed => format!("SPEED {}", course.percent),
            Stage::Point => format!("POINT {POINT}"),
            Stage::Values => course.goal_deg.map(|q| format!("{q:.3}")).join(","),
            Stage::Go => {
                let way_deg = largest(&course.goal_deg, &course.from_deg);
                let allowed = self.patience.allowed(self.speeds.duration_s(way_deg, course.percent));
                course.sent = Some((Instant::now(), allowed));
                wait = allowed;
                format!("DO MOVE {POINT}")
            }
            Stage::Abort => "ABORT".to_owned(),
            Stage::Pause(_) => return Ok(()),
        };
        self.monitor.send(&line, wait)
    }
}

impl RobotLink for ValLink {
    fn name(&self) -> String {
        format!("val at {}", self.monitor.port_name())
    }

    /// Speeds are whole percents, one at least: below that the robot is faster than asked.
    fn start_move(&mut self, q: &JointVector<f64>, speed: &JointSpeed) -> Result<(), LinkError> {
        let mut goal_deg = [0.0; JOINTS];
        for (goal_deg, q_rad) in goal_deg.iter_mut().zip(q.as_array()) {
            *goal_deg = q_rad.to_degrees();
        }
        // Four digits before the point are more than any joint has, and fewer than a line of VAL holds.
        let is_sound = goal_deg.iter().all(|q| q.abs() < 10_000.0) && speed.revolute_rad_s > 0.0;
        self.course = Some(Course {
            goal_deg,
            percent: self.speeds.percent(speed.revolute_rad_s),
            stage: Stage::Ready,
            started: Instant::now(),
            sent: None,
            from_deg: goal_deg,
            latest_deg: None,
            has_moved: false,
            stands_since: None,
            words: Vec::new(),
            state: if is_sound { MoveState::Moving } else { MoveState::Refused("a move to or at what is no number".into()) },
        });
        if is_sound { self.type_line() } else { Ok(()) }
    }

    /// Before the first move, the robot is where it should be.
    fn poll(&mut self) -> Result<MoveState, LinkError> {
        self.advance()?;
        Ok(self.course.as_ref().map_or(MoveState::Reached, |course| course.state.clone()))
    }

    /// While a move is under way, what its latest `WHERE` said; otherwise it is asked, which takes a fifth of a second.
    fn joints(&mut self) -> Result<Option<JointVector<f64>>, LinkError> {
        let moving = self.course.as_ref().filter(|course| course.state == MoveState::Moving);
        let q_deg = match moving {
            Some(course) => course.latest_deg,
            None => self.monitor.exchange("WHERE", self.patience.answer)?.and_then(|lines| where_deg(&lines)),
        };
        Ok(q_deg.map(|q_deg| {
            let mut q = JointVector::zero();
            for (q_rad, q_deg) in q.as_array_mut().iter_mut().zip(q_deg) {
                *q_rad = q_deg.to_radians();
            }
            q
        }))
    }

    /// Types control-C and `ABORT`. By what is published of VAL II's successor, `ABORT` may let the step under way end: the
    /// emergency stop is the button, not this.
    fn stop(&mut self) -> Result<(), LinkError> {
        self.monitor.interrupt()?;
        match &mut self.course {
            Some(course) if course.state == MoveState::Moving => {
                course.words.push("stopped as asked".into());
                course.stage = Stage::Abort;
                self.type_line()
            }
            _ => self.monitor.exchange_regardless("ABORT", STOP_WAIT).map(|_| ()),
        }
    }

    /// Brings the monitor back to its prompt, and nothing else.
    fn recover(&mut self) -> Result<(), LinkError> {
        self.monitor.interrupt()?;
        self.monitor.exchange("", self.patience.recover)?;
        Ok(())
    }

    /// VAL does not tell whether arm power is on but by refusing a move: what the latest one ended with is what is known.
    fn intervention(&mut self) -> Result<Option<Intervention>, LinkError> {
        let words = match self.course.as_ref().map(|course| &course.state) {
            Some(MoveState::Fault(words) | MoveState::Refused(words)) => words.to_uppercase(),
            _ => return Ok(None),
        };
        let needs_person = PROTECTION.iter().any(|word| words.contains(word));
        Ok(self.course.as_ref().filter(|_| needs_person).map(|course| Intervention {
            what: course.words.join("; "),
            remedy: "Look at the robot, remove what made it stop, and switch arm power on if it is off",
        }))
    }

    /// Nothing is typed: the person has done it.
    fn release(&mut self) -> Result<(), LinkError> {
        self.course = None;
        Ok(())
    }

    fn heed(&mut self, stop: &StopFlag) {
        self.monitor.heed(stop);
    }
}

impl Course {
    /// Keeps what the controller complains of.
    fn note(&mut self, lines: &[String]) {
        let room = 8_usize.saturating_sub(self.words.len());
        self.words.extend(lines.iter().filter(|line| is_complaint(line)).take(room).cloned());
    }

    /// Takes in a `WHERE`; false when it is none.
    fn look(&mut self, lines: &[String], patience: &Patience) -> bool {
        let Some(q_deg) = where_deg(lines) else { return !self.words.is_empty() };
        let before_deg = self.latest_deg.replace(q_deg);
        if self.stage == Stage::From {
            self.from_deg = q_deg;
            return true;
        }
        self.has_moved |= largest(&q_deg, &self.from_deg) > TOLERANCE_DEG;
        let is_standing = before_deg.is_some_and(|before| largest(&q_deg, &before) < STANDING_DEG);
        let is_there = largest(&q_deg, &self.goal_deg) < TOLERANCE_DEG;
        if !is_standing {
            self.stands_since = None;
            return true;
        }
        let stands_for = self.stands_since.get_or_insert_with(Instant::now).elapsed();
        let since_sent = self.sent.map_or(Duration::ZERO, |(at, _)| at.elapsed());
        if !self.words.is_empty() {
            self.conclude();
        } else if is_there {
            self.state = MoveState::Reached;
        } else if self.has_moved && stands_for > patience.stand {
            self.words.push("the robot stands before it is there".into());
            self.conclude();
        } else if !self.has_moved && since_sent > patience.begin {
            self.words.push("the robot does not move".into());
            self.conclude();
        }
        true
    }

    /// Goes on to the stage after a reply.
    fn next_stage(&mut self, is_question: bool) {
        if self.state != MoveState::Moving {
            return;
        }
        let is_before_go = matches!(self.stage, Stage::From | Stage::Speed | Stage::Point | Stage::Values | Stage::Confirm);
        if is_before_go && !self.words.is_empty() {
            self.conclude();
            return;
        }
        self.stage = match self.stage {
            // A question of before is answered with another empty line.
            Stage::Ready | Stage::Confirm if is_question => self.stage,
            Stage::Ready => Stage::From,
            Stage::From => Stage::Speed,
            Stage::Speed => Stage::Point,
            Stage::Point if is_question => Stage::Values,
            Stage::Values if is_question => Stage::Confirm,
            Stage::Point | Stage::Values => {
                self.words.push("POINT does not ask for changes".into());
                self.conclude();
                return;
            }
            Stage::Confirm => Stage::Go,
            Stage::Go | Stage::Abort | Stage::Look | Stage::Pause(_) => Stage::Pause(Instant::now() + LOOK_EVERY),
        };
    }

    /// Refused or Fault, as the robot has moved or not.
    fn conclude(&mut self) {
        let words = self.words.join("; ");
        self.state = if self.has_moved { MoveState::Fault(words) } else { MoveState::Refused(words) };
    }

    fn time_out(&mut self) {
        if self.state != MoveState::Moving {
            return;
        }
        if self.words.is_empty() {
            self.state = MoveState::TimedOut(self.started.elapsed());
        } else {
            self.conclude();
        }
    }
}

/// The largest difference of a joint, degrees.
fn largest(a: &[f64; JOINTS], b: &[f64; JOINTS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
