//! Universal Robots controllers (CB3 from software 3.4 on, e-Series).
//!
//! A move is a program of one `movej`, sent to the secondary interface (port 30002), which runs it instead of what runs; `stopj`
//! stops it the same way. What comes of it is heard by RTDE (port 30004). It may take as long as its speed, slowed down by the speed
//! slider as that stands at every moment, asks for; a slider at 0 or a paused program is waited for.
//!
//! After a protective stop the dashboard (port 29999) is asked to release it, and only by [`RobotLink::release`], behind which stands
//! a person who has looked: "Protective stops must never be acknowledged and reset automatically, it must always be a deliberate action
//! by a user to resume after a protective stop". Nothing else that the controller's safety has done is reset from here.
//!
//! Joint angles are the controller's, radians, base to wrist 3: robot.toml must have the same zeros and senses, as the built-in
//! `ur5e` has.
//!
//! Sources: Universal Robots, "The URScript Programming Language" (`movej`, `stopj`; from memory); e-Series service manual, software
//! 5.21, "Ignoring protective stops" (quoted above), and "Protective Stop Service Note" of 24 July 2020 ("Setting up automatic reset of
//! Protective Stop warnings is prohibited"); and the sources of the modules beside this one.

use std::time::{Duration, Instant};

use ballbar::JointVector;

use super::dashboard::Dashboard;
use super::rtde::{Heard, JOINTS, RobotState, Rtde};
use super::ur_script_port::{Control, ScriptPort};
use super::{Intervention, JointSpeed, LinkError, MoveState, Patience, RobotLink};
use crate::deadline::{Deadline, StopFlag, WaitOver};

/// Acceleration of moves, radians per second squared: `movej`'s default.
pub(super) const ACCELERATION_RAD_S2: f64 = 1.4;
/// Deceleration of stops, radians per second squared: 60 degrees per second end within a quarter of a second.
const STOP_RAD_S2: f64 = 4.0;
/// The robot is where it was sent when no joint is off by more: far more than a UR's servos leave, far less than any planned step.
const TOLERANCE_RAD: f64 = 0.05 * std::f64::consts::PI / 180.0;
/// A joint slower than this stands, radians per second.
const STANDING_RAD_S: f64 = 0.01;
const LOCAL_CONTROL: &str = "the controller is in local control, and takes no programs";
/// Messages that one poll takes: seconds' worth.
const MESSAGES_A_POLL: usize = 512;

/// Where the controller's interfaces are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UrPorts {
    /// Secondary interface.
    pub script: u16,
    /// Real-Time Data Exchange.
    pub rtde: u16,
    /// Dashboard server.
    pub dashboard: u16,
}

impl Default for UrPorts {
    fn default() -> Self {
        Self { script: 30_002, rtde: 30_004, dashboard: 29_999 }
    }
}

/// A link to a Universal Robots controller.
pub struct UrLink {
    host: String,
    ports: UrPorts,
    patience: Patience,
    script: ScriptPort,
    rtde: Rtde,
    latest: RobotState,
    heard_at: Instant,
    /// What the controller told people since the move was sent, and the dashboard at the latest release.
    words: Vec<String>,
    /// Whether the latest intervention told of a protective stop: no other one is released.
    has_told_stop: bool,
    course: Option<Course>,
    moves: u64,
    stop: StopFlag,
}

/// The latest move.
struct Course {
    goal_rad: [f64; JOINTS],
    sent: Instant,
    /// How long the move may take at the speed that it was sent with.
    allowed: Duration,
    /// How much of that has passed until `counted`: time while the robot is slowed down counts in proportion.
    spent: Duration,
    counted: Instant,
    /// Whether it was seen running.
    has_begun: bool,
    /// Since when the robot stands, without a program, elsewhere than at the goal.
    stands_since: Option<Instant>,
    /// Since when the robot stands because something holds the program, and what.
    held: Option<(Instant, &'static str)>,
    is_stopped_by_us: bool,
    /// The controller did not take the program.
    is_unheard: bool,
    state: MoveState,
}

impl UrLink {
    /// Connects to a controller and waits until it has said where its robot is.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn connect(host: &str, ports: UrPorts, patience: Patience) -> Result<Self, LinkError> {
        let mut script = ScriptPort::connect(host, ports.script, ports.dashboard, patience.answer)?;
        let mut rtde = Rtde::connect(host, ports.rtde, patience.answer)?;
        let latest = first_state(&mut rtde, patience.answer)?.ok_or_else(|| LinkError::Unexpected {
            address: format!("{host}:{}", ports.rtde),
            found: "nothing".into(),
            expected: "RTDE data packages after the start",
        })?;
        // In local control the connection is deaf, also later.
        script.control(&StopFlag::default())?;
        Ok(Self {
            host: host.to_owned(),
            ports,
            patience,
            script,
            rtde,
            latest,
            heard_at: Instant::now(),
            words: Vec::new(),
            has_told_stop: false,
            course: None,
            moves: 0,
            stop: StopFlag::default(),
        })
    }

    /// Takes in all that the controller has said.
    fn listen(&mut self) -> Result<(), LinkError> {
        self.script.discard();
        for _ in 0..MESSAGES_A_POLL {
            match self.rtde.next()? {
                None => break,
                Some(Heard::Text(text)) if self.words.len() < 8 => self.words.push(text),
                Some(Heard::Text(_)) => {}
                Some(Heard::State(state)) => {
                    self.latest = state;
                    self.heard_at = Instant::now();
                    if let Some(course) = &mut self.course {
                        course.follow(&state, &self.patience, &self.words);
                    }
                }
            }
        }
        Ok(())
    }

    /// Why no move can begin now.
    fn obstacle(&self) -> Option<String> {
        if self.heard_at.elapsed() > self.patience.answer {
            return Some(format!("nothing heard of the robot for {:.1} s", self.heard_at.elapsed().as_secs_f64()));
        }
        self.latest.obstacle().map(|obstacle| with_words(obstacle, &self.words))
    }

    /// Asks the dashboard to release a protective stop, as often as time allows.
    fn unlock(&mut self, deadline: &Deadline) -> Result<(), LinkError> {
        let mut dashboard = Dashboard::connect(&self.host, self.ports.dashboard, self.patience.answer, &self.stop)?;
        dashboard.ask("close safety popup")?;
        while self.latest.is_in_protective_stop() {
            let reply = dashboard.ask("unlock protective stop")?;
            if reply.starts_with("Protective stop releasing") {
                return Ok(());
            }
            match deadline.check() {
                Ok(()) => {}
                Err(WaitOver::Late) => {
                    self.words.push(reply);
                    return Ok(());
                }
                Err(WaitOver::Stopped) => return Err(LinkError::Stopped),
            }
            std::thread::sleep(Duration::from_millis(200));
            self.listen()?;
        }
        Ok(())
    }
}

impl RobotLink for UrLink {
    fn name(&self) -> String {
        format!("urscript at {}", self.host)
    }

    /// Asks the dashboard first whether the controller takes programs, which takes some milliseconds; of one that does not answer,
    /// [`Patience::answer`], once.
    fn start_move(&mut self, q: &JointVector<f64>, speed: &JointSpeed) -> Result<(), LinkError> {
        self.listen()?;
        let mut goal_rad = [0.0; JOINTS];
        goal_rad.copy_from_slice(&q.as_array()[..JOINTS]);
        let v_rad_s = speed.revolute_rad_s;
        let way_rad = largest(&goal_rad, &self.latest.q_rad);
        let now = Instant::now();
        let mut course = Course {
            goal_rad,
            sent: now,
            spent: Duration::ZERO,
            counted: now,
            allowed: self.patience.allowed(way_rad / v_rad_s + v_rad_s / ACCELERATION_RAD_S2),
            has_begun: false,
            stands_since: None,
            held: None,
            is_stopped_by_us: false,
            is_unheard: false,
            state: MoveState::Moving,
        };
        let is_sound = goal_rad.iter().all(|q| q.is_finite()) && v_rad_s.is_finite() && v_rad_s > 0.0;
        let obstacle = if is_sound { self.obstacle() } else { Some("a move to or at what is no number".into()) };
        self.words.clear();
        if let Some(obstacle) = obstacle {
            course.state = MoveState::Refused(obstacle);
        } else {
            self.moves += 1;
            let joints = goal_rad.map(|q| format!("{q:.8}")).join(", ");
            let number = self.moves;
            let program =
                format!("def ballbar_{number}():\n  movej([{joints}], a={ACCELERATION_RAD_S2:.3}, v={v_rad_s:.6})\nend\n");
            if self.script.send(&program, &self.stop)? == Control::Local {
                course.state = MoveState::Refused(LOCAL_CONTROL.into());
            }
            // The dashboard may have taken its time to answer.
            (course.sent, course.counted) = (Instant::now(), Instant::now());
        }
        self.course = Some(course);
        Ok(())
    }

    /// Before the first move, the robot is where it should be.
    fn poll(&mut self) -> Result<MoveState, LinkError> {
        self.listen()?;
        let Some(course) = &mut self.course else { return Ok(MoveState::Reached) };
        course.lapse();
        if course.is_unheard {
            self.script.forget();
        }
        Ok(course.told(&self.patience))
    }

    fn joints(&mut self) -> Result<Option<JointVector<f64>>, LinkError> {
        self.listen()?;
        let mut q = JointVector::zero();
        q.as_array_mut()[..JOINTS].copy_from_slice(&self.latest.q_rad);
        Ok((self.heard_at.elapsed() < self.patience.answer).then_some(q))
    }

    fn stop(&mut self) -> Result<(), LinkError> {
        if let Some(course) = &mut self.course {
            course.is_stopped_by_us = true;
        }
        self.script.send_regardless(&format!("stopj({STOP_RAD_S2:.1})\n"))
    }

    /// Ends what runs. What the controller's safety has stopped stays as it is.
    fn recover(&mut self) -> Result<(), LinkError> {
        self.listen()?;
        if self.latest.obstacle().is_none() { self.stop() } else { Ok(()) }
    }

    fn intervention(&mut self) -> Result<Option<Intervention>, LinkError> {
        self.listen()?;
        self.has_told_stop = self.latest.is_in_protective_stop();
        if let Some(obstacle) = self.latest.obstacle() {
            let remedy = if self.has_told_stop {
                "Look at the robot, and remove what made it stop: it is released when you confirm"
            } else {
                "See to it at the controller, until the robot is ready to move"
            };
            return Ok(Some(Intervention { what: with_words(obstacle, &self.words), remedy }));
        }
        let is_local = self.script.control(&self.stop)? == Control::Local;
        let remedy = "Switch it to remote control, at the top right of the teach pendant";
        Ok(is_local.then(|| Intervention { what: LOCAL_CONTROL.into(), remedy }))
    }

    /// Has the dashboard release the protective stop that was told, and ends the program that it had paused; one that came since is for
    /// the next question. Takes as long as [`Patience::recover`] at most: a controller does not release a protective stop within the first
    /// five seconds. Where the dashboard does not answer, nothing is released.
    fn release(&mut self) -> Result<(), LinkError> {
        let deadline = Deadline::after(self.patience.recover, &self.stop);
        self.listen()?;
        if !std::mem::take(&mut self.has_told_stop) || !self.latest.is_in_protective_stop() {
            return Ok(());
        }
        self.words.clear();
        match self.unlock(&deadline) {
            Ok(()) => {}
            Err(LinkError::Stopped) => return Err(LinkError::Stopped),
            Err(error) => self.words.push(error.to_string()),
        }
        while self.latest.is_in_protective_stop() {
            match deadline.check() {
                Ok(()) => self.listen()?,
                Err(WaitOver::Late) => break,
                Err(WaitOver::Stopped) => return Err(LinkError::Stopped),
            }
        }
        if self.latest.obstacle().is_none() { self.stop() } else { Ok(()) }
    }

    fn heed(&mut self, stop: &StopFlag) {
        self.stop = stop.clone();
    }
}

impl Course {
    /// Draws the conclusions of one data package.
    fn follow(&mut self, robot: &RobotState, patience: &Patience, words: &[String]) {
        if self.state != MoveState::Moving {
            return;
        }
        self.count(robot.pace());
        let is_standing = robot.qd_rad_s.iter().all(|qd| qd.abs() < STANDING_RAD_S);
        self.held =
            robot.hold().filter(|_| is_standing).map(|what| (self.held.map_or_else(Instant::now, |(since, _)| since), what));
        self.has_begun |= robot.is_playing() || !is_standing;
        if let Some(obstacle) = robot.obstacle() {
            self.state = self.ended(with_words(obstacle, words));
            return;
        }
        let is_idle = is_standing && robot.is_stopped();
        let is_there = [&robot.q_rad, &robot.target_q_rad].iter().all(|q| largest(&self.goal_rad, q) < TOLERANCE_RAD);
        if is_idle && is_there {
            // A robot that was there already need not be seen moving.
            if self.has_begun || self.sent.elapsed() > patience.stand {
                self.state = MoveState::Reached;
            }
            return;
        }
        if !is_idle {
            self.stands_since = None;
            return;
        }
        let stands_for = self.stands_since.get_or_insert_with(Instant::now).elapsed();
        if self.has_begun && stands_for > patience.stand {
            let what = if self.is_stopped_by_us { "stopped as asked" } else { "the program ended before the robot was there" };
            self.state = self.ended(with_words(what.into(), words));
        } else if !self.has_begun && self.sent.elapsed() > patience.begin {
            let what = "the controller did not begin the move; is it in remote control?";
            self.state = self.ended(with_words(what.into(), words));
            self.is_unheard = true;
        }
    }

    /// Refused or Fault, as the move has begun or not.
    fn ended(&self, words: String) -> MoveState {
        if self.has_begun { MoveState::Fault(words) } else { MoveState::Refused(words) }
    }

    /// Counts the time since it was counted last, in which the robot went at this fraction of the speed asked for.
    fn count(&mut self, pace: f64) {
        let now = Instant::now();
        self.spent += now.saturating_duration_since(self.counted).mul_f64(pace);
        self.counted = now;
    }

    /// Ends a move that takes too long. Time in which nothing is heard counts in full.
    fn lapse(&mut self) {
        if self.state == MoveState::Moving && self.spent + self.counted.elapsed() > self.allowed {
            self.state = MoveState::TimedOut(self.sent.elapsed());
        }
    }

    /// How the move stands, for others.
    fn told(&self, patience: &Patience) -> MoveState {
        match self.held {
            Some((since, what)) if self.state == MoveState::Moving && since.elapsed() > patience.stand => {
                MoveState::Held(what.to_owned())
            }
            _ => self.state.clone(),
        }
    }
}

fn first_state(rtde: &mut Rtde, wait: Duration) -> Result<Option<RobotState>, LinkError> {
    let deadline = Instant::now() + wait;
    while Instant::now() < deadline {
        if let Some(Heard::State(state)) = rtde.next()? {
            return Ok(Some(state));
        }
    }
    Ok(None)
}

/// The largest difference of a joint, radians.
fn largest(a: &[f64; JOINTS], b: &[f64; JOINTS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn with_words(what: String, words: &[String]) -> String {
    if words.is_empty() { what } else { format!("{what} ({})", words.join("; ")) }
}
