//! An emulated Universal Robots controller: secondary interface, RTDE and dashboard, each on a port of its own.

use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use host_cal::robot_link::urscript::UrPorts;

use super::{Arm, JOINTS, JointsAt, Mishap};

/// The widest that a UR's joints turn, radians per second and per second squared.
const SPEED_MAX_RAD_S: f64 = std::f64::consts::TAU;
const ACCELERATION_MAX_RAD_S2: f64 = 40.0;
/// A protective stop is not released earlier.
const RELEASE_AFTER: Duration = Duration::from_secs(5);

/// How a controller is.
#[derive(Clone, Copy, Debug)]
pub struct UrPeerOptions {
    /// Where the arm stands.
    pub q_rad: [f64; JOINTS],
    /// Data packages a second at most: 500 of an e-Series, 125 of a CB3.
    pub rate_max_hz: f64,
    /// How many times faster than in the world things go.
    pub pace: f64,
    /// Whether what it sends comes in pieces.
    pub is_split: bool,
}

impl Default for UrPeerOptions {
    fn default() -> Self {
        Self { q_rad: [0.0, -1.5, 1.5, -1.5, -1.5, 0.0], rate_max_hz: 500.0, pace: 20.0, is_split: false }
    }
}

/// A controller that runs until it is dropped.
pub struct UrPeer {
    shared: Arc<Shared>,
    ports: UrPorts,
    threads: Vec<JoinHandle<()>>,
}

pub(super) struct Shared {
    pub(super) options: UrPeerOptions,
    pub(super) arm: Arc<Mutex<Arm>>,
    world: Mutex<World>,
    is_ended: AtomicBool,
}

/// What there is besides the arm.
pub(super) struct World {
    pub(super) robot_mode: i32,
    pub(super) safety_mode: i32,
    protective_since: Option<Instant>,
    program: Option<Running>,
    next_mishap: Option<Mishap>,
    pub(super) is_silent: bool,
    pub(super) is_garbled: bool,
    /// Raised when all connections are to break.
    pub(super) drops: u32,
    /// The joints are reported off by so much, radians of joint 1.
    pub(super) claim_offset_rad: f64,
    /// A text for people that waits to be sent.
    pub(super) text: Option<&'static str>,
    /// What a client did against the protocol.
    problems: Vec<String>,
    programs: Vec<String>,
}

/// The program under way.
struct Running {
    half: Instant,
    end: Instant,
    mishap: Option<Mishap>,
}

/// What a program does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Command {
    MoveJ { q_rad: [f64; JOINTS], v_rad_s: f64, a_rad_s2: f64 },
    StopJ,
}

impl UrPeer {
    /// Switches a controller on.
    pub fn start(options: UrPeerOptions) -> Self {
        let shared = Arc::new(Shared {
            options,
            arm: Arc::new(Mutex::new(Arm::at_rest(options.q_rad, Instant::now()))),
            world: Mutex::new(World {
                robot_mode: 7,
                safety_mode: 1,
                protective_since: None,
                program: None,
                next_mishap: None,
                is_silent: false,
                is_garbled: false,
                drops: 0,
                claim_offset_rad: 0.0,
                text: None,
                problems: Vec::new(),
                programs: Vec::new(),
            }),
            is_ended: AtomicBool::new(false),
        });
        let (script, script_thread) = serve(&shared, super::ur_script::serve);
        let (rtde, rtde_thread) = serve(&shared, super::ur_rtde::serve);
        let (dashboard, dashboard_thread) = serve(&shared, super::ur_dashboard::serve);
        let threads = vec![script_thread, rtde_thread, dashboard_thread];
        Self { shared, ports: UrPorts { script, rtde, dashboard }, threads }
    }

    /// Where it listens, on 127.0.0.1.
    pub fn ports(&self) -> UrPorts {
        self.ports
    }

    /// Where the arm truly is.
    pub fn joints(&self) -> JointsAt {
        JointsAt(Arc::clone(&self.shared.arm))
    }

    /// Lets something go wrong with the next move.
    pub fn next(&self, mishap: Mishap) {
        self.shared.world().next_mishap = Some(mishap);
    }

    /// Sets the modes, as numbers of the RTDE guide.
    pub fn set_modes(&self, robot_mode: i32, safety_mode: i32) {
        let mut world = self.shared.world();
        (world.robot_mode, world.safety_mode) = (robot_mode, safety_mode);
    }

    /// What clients did against the protocol.
    pub fn problems(&self) -> Vec<String> {
        self.shared.world().problems.clone()
    }

    /// The programs that came, whole.
    pub fn programs(&self) -> Vec<String> {
        self.shared.world().programs.clone()
    }
}

impl Drop for UrPeer {
    fn drop(&mut self) {
        self.shared.is_ended.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

/// Gives every client of a port, one after another, to `talk`.
fn serve(shared: &Arc<Shared>, talk: fn(&Shared, TcpStream)) -> (u16, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.set_nonblocking(true).unwrap();
    let port = listener.local_addr().unwrap().port();
    let shared = Arc::clone(shared);
    let thread = std::thread::spawn(move || {
        while !shared.is_ended() {
            match listener.accept() {
                Ok((stream, _)) => {
                    stream.set_nonblocking(false).unwrap();
                    stream.set_nodelay(true).unwrap();
                    stream.set_read_timeout(Some(Duration::from_millis(1))).unwrap();
                    talk(&shared, stream);
                }
                Err(_) => std::thread::sleep(Duration::from_millis(2)),
            }
        }
    });
    (port, thread)
}

impl Shared {
    pub(super) fn is_ended(&self) -> bool {
        self.is_ended.load(Ordering::Relaxed)
    }

    /// The world as it is now.
    pub(super) fn world(&self) -> MutexGuard<'_, World> {
        let mut world = self.world.lock().unwrap();
        world.advance(&mut self.arm.lock().unwrap(), Instant::now());
        world
    }

    pub(super) fn problem(&self, what: impl Into<String>) {
        self.world().problems.push(what.into());
    }

    /// Runs a program instead of what runs.
    pub(super) fn run(&self, text: &str, command: Command) {
        let now = Instant::now();
        let mut world = self.world();
        let mut arm = self.arm.lock().unwrap();
        world.programs.push(text.to_owned());
        if world.robot_mode != 7 || ![1, 2].contains(&world.safety_mode) {
            return;
        }
        match command {
            Command::StopJ => {
                arm.halt(now);
                world.program = Some(Running { half: now, end: now + Duration::from_millis(20), mishap: None });
            }
            Command::MoveJ { q_rad, v_rad_s, a_rad_s2 } => {
                let mishap = world.next_mishap.take();
                if mishap == Some(Mishap::Refuses) {
                    return;
                }
                if !(0.0..=SPEED_MAX_RAD_S).contains(&v_rad_s) || !(0.0..=ACCELERATION_MAX_RAD_S2).contains(&a_rad_s2) {
                    world.problems.push(format!("speed {v_rad_s} or acceleration {a_rad_s2} is out of range"));
                    return;
                }
                let lead_rad = arm.at(now).iter().zip(q_rad).map(|(from, to)| (to - from).abs()).fold(0.0, f64::max);
                arm.go(q_rad, Duration::from_secs_f64(lead_rad / v_rad_s / self.options.pace + 0.02), now);
                let (half, end) = arm.half_and_end();
                world.program = Some(Running { half, end, mishap });
            }
        }
    }

    /// The dashboard's `unlock protective stop`: whether it is released.
    pub(super) fn unlock(&self) -> bool {
        let mut world = self.world();
        let wait = RELEASE_AFTER.div_f64(self.options.pace);
        let is_over = world.protective_since.is_some_and(|since| since.elapsed() >= wait);
        if is_over && world.safety_mode == 3 {
            world.safety_mode = 1;
            world.protective_since = None;
        }
        is_over
    }
}

impl World {
    pub(super) fn runtime_state(&self) -> u32 {
        if self.program.is_some() { 2 } else { 1 }
    }

    fn advance(&mut self, arm: &mut Arm, now: Instant) {
        let Some(program) = &mut self.program else { return };
        if now >= program.half {
            match program.mishap.take() {
                Some(Mishap::FaultsHalfWay) => {
                    arm.halt(now);
                    self.safety_mode = 3;
                    self.protective_since = Some(now);
                    self.text = Some("C153A2: position deviates from path");
                    self.program = None;
                    return;
                }
                Some(Mishap::EndsHalfWay) => {
                    arm.halt(now);
                    self.program = None;
                    return;
                }
                Some(Mishap::GoesSilent) => self.is_silent = true,
                Some(Mishap::DropsTheLine) => self.drops += 1,
                Some(Mishap::TalksGarbage) => self.is_garbled = true,
                Some(Mishap::StandsElsewhereByMrad(mrad)) => {
                    let offset_rad = f64::from(mrad) * 1e-3;
                    let (_, end) = arm.half_and_end();
                    let mut stand_rad = arm.at(end);
                    stand_rad[0] -= offset_rad;
                    arm.go(stand_rad, end - now, now);
                    self.claim_offset_rad = offset_rad;
                }
                Some(Mishap::Refuses) | None => {}
            }
        }
        if self.program.as_ref().is_some_and(|program| now >= program.end) {
            self.program = None;
        }
    }
}
