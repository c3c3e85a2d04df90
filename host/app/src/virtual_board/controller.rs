//! The controller of a simulated robot, for `collect --robot-link sim`: see [`crate::robot_link::sim`] for what it is asked.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use ballbar_calib::model::{JointLimits, PairingId, Rig, Robot};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::driver::{Driver, Order};
use super::script::AttachedBar;
use crate::robot_link::JointSpeed;
use crate::robot_link::sim::{SimReply, SimRequest};

/// What a controller knows of its robot and what stands around it.
#[derive(Clone, Debug)]
pub struct ControllerOptions {
    /// The joints' limits, which it enforces.
    pub limits: Vec<JointLimits>,
    /// Where a bar can be attached.
    pub rig: Rig,
    /// Standard deviation of what the bar measures too much from pose to pose, metres.
    pub sigma_m: f64,
    /// How long the robot stands at a pose before its time passes as on the wall again, seconds.
    pub dwell_s: f64,
    /// The same seed and the same orders give the same errors.
    pub seed: u64,
}

impl ControllerOptions {
    /// The controller of a robot at a rig, without noise of its own.
    pub fn new(robot: &Robot, rig: &Rig) -> Self {
        Self { limits: robot.limits.clone(), rig: rig.clone(), sigma_m: 0.0, dwell_s: 1.0, seed: 0 }
    }
}

/// A controller that listens, on threads of its own that end with the process.
#[derive(Debug)]
pub struct Controller {
    address: SocketAddr,
}

struct Desk {
    driver: Driver,
    options: ControllerOptions,
    rng: ChaCha8Rng,
}

/// A request is far shorter.
const LONGEST_REQUEST: u64 = 4_096;

impl Controller {
    /// Listens at an address; at port 0 the system chooses one.
    ///
    /// # Errors
    /// The operating system's, when the address cannot be listened at.
    pub fn listen(address: &str, driver: Driver, options: ControllerOptions) -> std::io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        let address = listener.local_addr()?;
        let rng = ChaCha8Rng::seed_from_u64(options.seed);
        let desk = Arc::new(Mutex::new(Desk { driver, options, rng }));
        thread::Builder::new().name("controller".into()).spawn(move || {
            for stream in listener.incoming().flatten() {
                let desk = Arc::clone(&desk);
                // Without a thread the client finds its connection closed.
                let _ = thread::Builder::new().name("controller-client".into()).spawn(move || serve(&stream, &desk));
            }
        })?;
        Ok(Self { address })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

/// Answers one client until it leaves.
fn serve(stream: &TcpStream, desk: &Mutex<Desk>) {
    let _ = stream.set_nodelay(true);
    let mut lines = BufReader::new(stream);
    let mut writer = stream;
    loop {
        let mut line = String::new();
        match lines.by_ref().take(LONGEST_REQUEST).read_line(&mut line) {
            Ok(count) if count > 0 => {}
            _ => return,
        }
        let reply = match serde_json::from_str(&line) {
            Ok(request) => desk.lock().unwrap_or_else(PoisonError::into_inner).answer(&request),
            Err(error) => SimReply::Refused(format!("not understood: {error}")),
        };
        let Ok(mut text) = serde_json::to_string(&reply) else { return };
        text.push('\n');
        if writer.write_all(text.as_bytes()).is_err() {
            return;
        }
    }
}

impl Desk {
    fn answer(&mut self, request: &SimRequest) -> SimReply {
        let joints = self.options.limits.len();
        let order = match request {
            SimRequest::State => {
                let stance = self.driver.stance();
                return SimReply::State { is_moving: stance.is_moving, q: stance.q.as_array()[..joints].to_vec() };
            }
            SimRequest::Move { q, revolute_rad_s, prismatic_m_s } => {
                self.order_move(q, JointSpeed { revolute_rad_s: *revolute_rad_s, prismatic_m_s: *prismatic_m_s })
            }
            SimRequest::Halt => Ok(Order::Halt),
            SimRequest::Detach => Ok(Order::Detach),
            SimRequest::Attach { chuck, sphere, mid_m } => self.order_attach(chuck, sphere, *mid_m),
        };
        match order {
            Ok(order) => {
                self.driver.give(order);
                SimReply::Done
            }
            Err(words) => SimReply::Refused(words),
        }
    }

    fn order_move(&mut self, q: &[f64], speed: JointSpeed) -> Result<Order, String> {
        let limits = &self.options.limits;
        if q.len() != limits.len() {
            return Err(format!("{} joint values for {} joints", q.len(), limits.len()));
        }
        let is_positive = |speed: f64| speed > 0.0 && speed.is_finite();
        if !is_positive(speed.revolute_rad_s) || !is_positive(speed.prismatic_m_s) {
            return Err("the speed is not above zero".into());
        }
        if let Some(joint) = q.iter().zip(limits).position(|(&q, limits)| !limits.contain(q)) {
            return Err(format!("joint {} would be beyond its limits", joint + 1));
        }
        let mut vector = ballbar::JointVector::zero();
        vector.as_array_mut()[..q.len()].copy_from_slice(q);
        Ok(Order::Move { q: vector, speed, dwell_s: self.options.dwell_s, length_error_m: self.length_error_m() })
    }

    /// Play of the chucks and all else that differs from pose to pose.
    fn length_error_m(&mut self) -> f64 {
        let normal: f64 = StandardNormal.sample(&mut self.rng);
        self.options.sigma_m * normal
    }

    fn order_attach(&mut self, chuck: &str, sphere: &str, mid_m: f64) -> Result<Order, String> {
        let rig = &self.options.rig;
        let chuck = rig.chuck(chuck).ok_or("no chuck of that name")?;
        let sphere = rig.sphere(sphere).ok_or("no sphere of that name")?;
        if !(mid_m > 0.0 && mid_m.is_finite()) {
            return Err("the bar's length is not above zero".into());
        }
        let bar = AttachedBar { pairing: rig.pairing(PairingId { chuck, sphere }), mid_m };
        Ok(Order::Attach { bar, length_error_m: self.length_error_m() })
    }
}
