//! The simulated robot's controller, and the hand that attaches the bar to it: lines of JSON over TCP.
//!
//! It is the controller of `host-cal virtual-board --controller ADDRESS`, which answers every [`SimRequest`] with a [`SimReply`].

use std::time::{Duration, Instant};

use ballbar::JointVector;
use serde::{Deserialize, Serialize};

use super::patience::STOP_WAIT;
use super::tcp::{Tcp, TcpLines};
use super::{JointSpeed, LinkError, MoveState, RobotLink};
use crate::deadline::{Deadline, StopFlag};

/// What the controller is asked. SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SimRequest {
    /// Go to encoder outputs by joint interpolation.
    Move {
        /// Radians or metres, one a joint.
        q: Vec<f64>,
        /// The highest speed of revolute joints, radians per second.
        revolute_rad_s: f64,
        /// The highest speed of prismatic joints, metres per second.
        prismatic_m_s: f64,
    },
    /// How does the latest move stand?
    State,
    /// Stop on the way.
    Halt,
    /// Attach the bar between two points, `mid_m` long at mid travel.
    Attach {
        /// Name of the chuck.
        chuck: String,
        /// Name of the sphere.
        sphere: String,
        /// Metres.
        mid_m: f64,
    },
    /// Take the bar off.
    Detach,
}

/// What the controller answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SimReply {
    /// It is done, or begun.
    Done,
    /// It is not done.
    Refused(String),
    /// Where the robot is.
    State {
        /// Whether the latest move is under way.
        is_moving: bool,
        /// Radians or metres, one a joint.
        q: Vec<f64>,
    },
}

/// A connection to the controller.
pub struct SimClient {
    lines: TcpLines,
    /// Replies that have not come yet; those of requests that were given up among them.
    owed: usize,
}

/// How long the controller may take to answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// A reply is far shorter.
const LONGEST_REPLY: usize = 4_096;
const REPLY: &str = "a reply of host-cal virtual-board's controller";

impl SimClient {
    /// Connects.
    ///
    /// # Errors
    /// [`LinkError::Unreachable`].
    pub fn connect(address: &str) -> Result<Self, LinkError> {
        let tcp = Tcp::connect_to(address, PATIENCE, &StopFlag::default())?;
        Ok(Self { lines: TcpLines::new(tcp, LONGEST_REPLY), owed: 0 })
    }

    /// From here on no reply is waited for any longer once the flag is set.
    pub fn heed(&mut self, stop: &StopFlag) {
        self.lines.tcp.heed(stop);
    }

    /// Asks, and waits for the answer.
    ///
    /// # Errors
    /// [`LinkError`] when no answer comes whole in time, the connection is gone, or something else is at its other end.
    pub fn ask(&mut self, request: &SimRequest) -> Result<SimReply, LinkError> {
        let deadline = self.lines.tcp.deadline(PATIENCE);
        self.ask_until(request, &deadline)
    }

    fn ask_until(&mut self, request: &SimRequest, deadline: &Deadline) -> Result<SimReply, LinkError> {
        let address = self.address().to_owned();
        let unsaid = |error: serde_json::Error| LinkError::Lost { address, reason: error.to_string() };
        let line = serde_json::to_string(request).map_err(unsaid)? + "\n";
        self.lines.tcp.write_all(line.as_bytes())?;
        self.owed += 1;
        loop {
            let reply = self.lines.line(deadline, REPLY)?;
            self.owed -= 1;
            if self.owed == 0 {
                let found = || reply.chars().take(80).collect();
                return serde_json::from_str(&reply).map_err(|_| self.lines.tcp.unexpected(found(), REPLY));
            }
        }
    }

    fn address(&self) -> &str {
        self.lines.tcp.address()
    }

    /// Asks for something that is only done or refused.
    ///
    /// # Errors
    /// As [`SimClient::ask`]; and a refusal, as [`LinkError::Unexpected`].
    pub fn act(&mut self, request: &SimRequest) -> Result<(), LinkError> {
        let reply = self.ask(request)?;
        self.done(&reply)
    }

    /// As [`SimClient::act`], also when the user wants to end.
    fn act_regardless(&mut self, request: &SimRequest) -> Result<(), LinkError> {
        let reply = self.ask_until(request, &Deadline::regardless(STOP_WAIT))?;
        self.done(&reply)
    }

    fn done(&self, reply: &SimReply) -> Result<(), LinkError> {
        match reply {
            SimReply::Done => Ok(()),
            other => Err(self.lines.tcp.unexpected(format!("{other:?}"), "`done`")),
        }
    }
}

/// The hand that attaches the bar.
pub struct SimHand(SimClient);

/// Attaching takes a tenth of a second.
const HAND_PATIENCE: Duration = Duration::from_secs(5);

impl SimHand {
    /// Connects to the controller.
    ///
    /// # Errors
    /// [`LinkError::Unreachable`].
    pub fn connect(address: &str) -> Result<Self, LinkError> {
        SimClient::connect(address).map(Self)
    }

    /// From here on nothing is waited for any longer once the flag is set.
    pub fn heed(&mut self, stop: &StopFlag) {
        self.0.heed(stop);
    }

    /// Has something attached or taken off, and waits until it is.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn act(&mut self, request: &SimRequest) -> Result<(), LinkError> {
        self.0.act(request)?;
        let began = Instant::now();
        while let SimReply::State { is_moving: true, .. } = self.0.ask(&SimRequest::State)? {
            if began.elapsed() > HAND_PATIENCE {
                return Err(LinkError::Lost { address: self.0.address().to_owned(), reason: "its time stands still".into() });
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(())
    }
}

/// The simulated robot.
pub struct SimLink {
    client: SimClient,
    joints: usize,
    latest: MoveState,
    deadline: Instant,
    patience: Duration,
}

/// At a free pace the robot's time is shorter than the wall's, and at a real one a move takes some ten seconds.
const LONGEST_MOVE: Duration = Duration::from_secs(120);

impl SimLink {
    /// Connects to the controller of a robot of so many joints.
    ///
    /// # Errors
    /// [`LinkError::Unreachable`].
    pub fn connect(address: &str, joints: usize) -> Result<Self, LinkError> {
        let client = SimClient::connect(address)?;
        Ok(Self { client, joints, latest: MoveState::Reached, deadline: Instant::now(), patience: LONGEST_MOVE })
    }

    fn state(&mut self) -> Result<(bool, JointVector<f64>), LinkError> {
        match self.client.ask(&SimRequest::State)? {
            SimReply::State { is_moving, q } if q.len() == self.joints => {
                let mut vector = JointVector::zero();
                vector.as_array_mut()[..q.len()].copy_from_slice(&q);
                Ok((is_moving, vector))
            }
            other => Err(LinkError::Unexpected {
                address: self.client.address().to_owned(),
                found: format!("{other:?}"),
                expected: "the state of a robot with as many joints",
            }),
        }
    }
}

impl RobotLink for SimLink {
    fn name(&self) -> String {
        format!("sim at {}", self.client.address())
    }

    fn start_move(&mut self, q: &JointVector<f64>, speed: &JointSpeed) -> Result<(), LinkError> {
        let JointSpeed { revolute_rad_s, prismatic_m_s } = *speed;
        let request = SimRequest::Move { q: q.as_array()[..self.joints].to_vec(), revolute_rad_s, prismatic_m_s };
        self.latest = match self.client.ask(&request)? {
            SimReply::Refused(words) => MoveState::Refused(words),
            _ => MoveState::Moving,
        };
        self.deadline = Instant::now() + self.patience;
        Ok(())
    }

    fn poll(&mut self) -> Result<MoveState, LinkError> {
        if self.latest == MoveState::Moving {
            if !self.state()?.0 {
                self.latest = MoveState::Reached;
            } else if Instant::now() > self.deadline {
                self.latest = MoveState::TimedOut(self.patience);
            }
        }
        Ok(self.latest.clone())
    }

    fn joints(&mut self) -> Result<Option<JointVector<f64>>, LinkError> {
        Ok(Some(self.state()?.1))
    }

    fn stop(&mut self) -> Result<(), LinkError> {
        if self.latest == MoveState::Moving {
            self.latest = MoveState::Fault("stopped on the way".into());
        }
        self.client.act_regardless(&SimRequest::Halt)
    }

    fn recover(&mut self) -> Result<(), LinkError> {
        Ok(())
    }

    fn heed(&mut self, stop: &StopFlag) {
        self.client.heed(stop);
    }
}
