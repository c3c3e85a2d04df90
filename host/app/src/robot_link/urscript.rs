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
use super::ur_course::{Course, largest, with_words};
use super::ur_script_port::{Control, ScriptPort};
use super::{Intervention, JointSpeed, LinkError, MoveState, Patience, RobotLink};
use crate::deadline::{Deadline, StopFlag, WaitOver};

/// Acceleration of moves, radians per second squared: `movej`'s default.
pub(super) const ACCELERATION_RAD_S2: f64 = 1.4;
/// Deceleration of stops, radians per second squared: 60 degrees per second end within a quarter of a second.
const STOP_RAD_S2: f64 = 4.0;
const LOCAL_CONTROL: &str = "the controller is in local control, and takes no programs";
/// So long at most is listened in one go, however much has gathered.
const LISTEN_WAIT: Duration = Duration::from_millis(100);
/// What was heard so lately is of now. A package comes in every eight milliseconds.
const NOW: Duration = Duration::from_millis(250);

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
    /// The latest state came no earlier. When it did come is not known where it was read later.
    heard_since: Instant,
    /// When nothing was left to be read.
    caught_up: Instant,
    /// What the controller told people since the move was sent, and the dashboard at the latest release.
    words: Vec<String>,
    /// Whether the protective stop that the latest intervention told of is there without a break: no other one is released.
    has_told_stop: bool,
    course: Option<Course>,
    moves: u64,
    stop: StopFlag,
}

impl UrLink {
    /// Connects to a controller and waits until it has said where its robot is.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn connect(host: &str, ports: UrPorts, patience: Patience) -> Result<Self, LinkError> {
        let began = Instant::now();
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
            heard_since: began,
            caught_up: began,
            words: Vec::new(),
            has_told_stop: false,
            course: None,
            moves: 0,
            stop: StopFlag::default(),
        })
    }

    /// Listens until the latest that is known of the robot is of now, as long as an answer may take.
    fn hear_now(&mut self) -> Result<(), LinkError> {
        let deadline = Deadline::after(self.patience.answer, &self.stop);
        loop {
            self.listen()?;
            if self.heard_since.elapsed() < NOW {
                return Ok(());
            }
            match deadline.check() {
                Ok(()) => {}
                Err(WaitOver::Late) => return Ok(()),
                Err(WaitOver::Stopped) => return Err(LinkError::Stopped),
            }
        }
    }

    /// Whether nothing was heard for longer than an answer may take, or what was heard may be older.
    fn is_out_of_date(&self) -> bool {
        self.heard_since.elapsed() > self.patience.answer
    }

    /// Whether the protective stop that the latest intervention told of is known to be there still.
    fn is_told_stop_there(&self) -> bool {
        self.has_told_stop && !self.is_out_of_date()
    }

    /// Why no move can begin now.
    fn obstacle(&self) -> Option<String> {
        if self.is_out_of_date() {
            return Some(format!("nothing heard of the robot for {:.1} s", self.heard_since.elapsed().as_secs_f64()));
        }
        self.latest.obstacle().map(|obstacle| with_words(obstacle, &self.words))
    }

    /// Asks the dashboard to release the protective stop that was told, as often as time allows.
    fn unlock(&mut self, deadline: &Deadline) -> Result<(), LinkError> {
        let mut dashboard = Dashboard::connect(&self.host, self.ports.dashboard, self.patience.answer, &self.stop)?;
        dashboard.ask("close safety popup")?;
        loop {
            self.hear_now()?;
            if !self.is_told_stop_there() {
                return Ok(());
            }
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
        }
    }
}

impl RobotLink for UrLink {
    fn name(&self) -> String {
        format!("urscript at {}", self.host)
    }

    /// Hears first where the robot is now, and asks the dashboard whether the controller takes programs, which takes some milliseconds.
    /// A controller that says nothing is waited for as long as [`Patience::answer`], and so is, once, a dashboard that does not answer.
    fn start_move(&mut self, q: &JointVector<f64>, speed: &JointSpeed) -> Result<(), LinkError> {
        self.hear_now()?;
        let mut goal_rad = [0.0; JOINTS];
        goal_rad.copy_from_slice(&q.as_array()[..JOINTS]);
        let v_rad_s = speed.revolute_rad_s;
        let way_rad = largest(&goal_rad, &self.latest.q_rad);
        let mut course = Course::new(goal_rad, self.patience.allowed(way_rad / v_rad_s + v_rad_s / ACCELERATION_RAD_S2));
        let is_sound = goal_rad.iter().all(|q| q.is_finite()) && v_rad_s.is_finite() && v_rad_s > 0.0;
        let obstacle = if is_sound { self.obstacle() } else { Some("a move to or at what is no number".into()) };
        self.words.clear();
        if let Some(obstacle) = obstacle {
            course.refuse(obstacle);
        } else {
            self.moves += 1;
            let joints = goal_rad.map(|q| format!("{q:.8}")).join(", ");
            let number = self.moves;
            let program =
                format!("def ballbar_{number}():\n  movej([{joints}], a={ACCELERATION_RAD_S2:.3}, v={v_rad_s:.6})\nend\n");
            if self.script.send(&program, &self.stop)? == Control::Local {
                course.refuse(LOCAL_CONTROL.into());
            }
            // The dashboard may have taken its time to answer.
            course.restart();
        }
        self.course = Some(course);
        Ok(())
    }

    /// Before the first move, the robot is where it should be.
    fn poll(&mut self) -> Result<MoveState, LinkError> {
        self.listen()?;
        let Some(course) = &mut self.course else { return Ok(MoveState::Reached) };
        course.lapse();
        if course.is_unheard() {
            self.script.forget();
        }
        Ok(course.told(&self.patience))
    }

    fn joints(&mut self) -> Result<Option<JointVector<f64>>, LinkError> {
        self.hear_now()?;
        let mut q = JointVector::zero();
        q.as_array_mut()[..JOINTS].copy_from_slice(&self.latest.q_rad);
        Ok((!self.is_out_of_date()).then_some(q))
    }

    fn stop(&mut self) -> Result<(), LinkError> {
        if let Some(course) = &mut self.course {
            course.note_stop();
        }
        self.script.send_regardless(&format!("stopj({STOP_RAD_S2:.1})\n"))
    }

    /// Ends what runs. What the controller's safety has stopped stays as it is.
    fn recover(&mut self) -> Result<(), LinkError> {
        self.hear_now()?;
        if self.latest.obstacle().is_none() { self.stop() } else { Ok(()) }
    }

    fn intervention(&mut self) -> Result<Option<Intervention>, LinkError> {
        self.hear_now()?;
        self.has_told_stop = self.latest.is_in_protective_stop();
        if let Some(obstacle) = self.obstacle() {
            let remedy = if self.is_told_stop_there() {
                "Look at the robot, and remove what made it stop: it is released when you confirm"
            } else {
                "See to it at the controller, until the robot is ready to move"
            };
            return Ok(Some(Intervention { what: obstacle, remedy }));
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
        self.hear_now()?;
        if !self.is_told_stop_there() {
            return Ok(());
        }
        self.words.clear();
        match self.unlock(&deadline) {
            Ok(()) => {}
            Err(LinkError::Stopped) => return Err(LinkError::Stopped),
            Err(error) => self.words.push(error.to_string()),
        }
        while self.has_told_stop {
            match deadline.check() {
                Ok(()) => self.listen()?,
                Err(WaitOver::Late) => break,
                Err(WaitOver::Stopped) => return Err(LinkError::Stopped),
            }
        }
        // The next one to be released is one that is told of first.
        self.has_told_stop = false;
        if self.latest.obstacle().is_none() { self.stop() } else { Ok(()) }
    }

    /// Takes in all that the controller has said.
    fn listen(&mut self) -> Result<(), LinkError> {
        self.script.discard();
        let deadline = Deadline::regardless(LISTEN_WAIT);
        while deadline.check().is_ok() {
            match self.rtde.next()? {
                None => {
                    if self.rtde.is_between_packages() {
                        self.caught_up = Instant::now();
                    }
                    break;
                }
                Some(Heard::Text(text)) if self.words.len() < 8 => self.words.push(text),
                Some(Heard::Text(_)) => {}
                Some(Heard::State(state)) => {
                    self.latest = state;
                    // It was not there yet when nothing was left, and may have come soon after.
                    self.heard_since = self.caught_up;
                    self.has_told_stop &= state.is_in_protective_stop();
                    if let Some(course) = &mut self.course {
                        course.follow(&state, &self.patience, &self.words);
                    }
                }
            }
        }
        Ok(())
    }

    fn heed(&mut self, stop: &StopFlag) {
        self.stop = stop.clone();
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
