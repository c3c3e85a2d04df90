//! An emulated Universal Robots controller: secondary interface, RTDE and dashboard, each on a port of its own.
//!
//! As a real one it stays in a protective stop until the dashboard is asked to unlock it, its program paused; goes as fast as the
//! speed slider lets it; and takes programs only over connections that were made in remote control.

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
    /// Whether the dashboard knows of local and remote control: an e-Series from software 5.6 on.
    pub tells_control: bool,
}

impl Default for UrPeerOptions {
    fn default() -> Self {
        let q_rad = [0.0, -1.5, 1.5, -1.5, -1.5, 0.0];
        Self { q_rad, rate_max_hz: 500.0, pace: 20.0, is_split: false, tells_control: true }
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
    /// The program is paused: at the teach pendant, or by a protective stop.
    is_paused: bool,
    /// The speed slider, and the trajectory limiter, from 0 to 1.
    pub(super) slider: f64,
    pub(super) limiter: f64,
    pub(super) is_remote: bool,
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
    /// What the dashboard was asked.
    asked: Vec<String>,
}

/// The program under way. It ends with the arm's way, or at a time.
struct Running {
    end: Option<Instant>,
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
                is_paused: false,
                slider: 1.0,
                limiter: 1.0,
                is_remote: true,
                next_mishap: None,
                is_silent: false,
                is_garbled: false,
                drops: 0,
                claim_offset_rad: 0.0,
                text: None,
                problems: Vec::new(),
                programs: Vec::new(),
                asked: Vec::new(),
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
        world.protective_since = (safety_mode == 3).then(Instant::now);
    }

    /// Sets the speed slider and the trajectory limiter, from 0 to 1.
    pub fn set_speed(&self, slider: f64, limiter: f64) {
        self.shared.change_pace(|world| (world.slider, world.limiter) = (slider, limiter));
    }

    /// Pauses the program at the teach pendant, or goes on with it.
    pub fn set_paused(&self, is_paused: bool) {
        self.shared.change_pace(|world| world.is_paused = is_paused);
    }

    /// Lets RTDE say nothing, or go on.
    pub fn set_silent(&self, is_silent: bool) {
        self.shared.world().is_silent = is_silent;
    }

    /// Switches between local and remote control. Into local, connections that take programs are closed; into remote, those that
    /// were made in local stay, and stay deaf.
    pub fn set_remote(&self, is_remote: bool) {
        self.shared.world().is_remote = is_remote;
    }

    /// What the dashboard was asked, but for whether the controller is in remote control.
    pub fn asked(&self) -> Vec<String> {
        self.shared.world().asked.iter().filter(|line| *line != "is in remote control").cloned().collect()
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
                world.program = Some(Running { end: Some(now + Duration::from_millis(20)), mishap: None });
                world.is_paused = false;
                world.set_pace(&mut arm, now);
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
                world.program = Some(Running { end: None, mishap });
                world.is_paused = false;
                world.set_pace(&mut arm, now);
            }
        }
    }

    fn change_pace(&self, change: impl FnOnce(&mut World)) {
        let mut world = self.world();
        change(&mut world);
        world.set_pace(&mut self.arm.lock().unwrap(), Instant::now());
    }

    /// Notes what the dashboard was asked.
    pub(super) fn note_asked(&self, line: &str) {
        self.world().asked.push(line.to_owned());
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
        match self.program {
            Some(_) if self.is_paused => 4,
            Some(_) => 2,
            None => 1,
        }
    }

    /// Lets the arm go as fast as the program, the slider and the limiter allow.
    fn set_pace(&self, arm: &mut Arm, now: Instant) {
        let fraction = if self.is_paused { 0.0 } else { self.slider * self.limiter };
        arm.slow_to(fraction, now);
    }

    fn advance(&mut self, arm: &mut Arm, now: Instant) {
        let Some(program) = self.program.as_mut().filter(|_| !self.is_paused) else { return };
        if arm.share(now) >= 0.5 {
            match program.mishap.take() {
                Some(Mishap::FaultsHalfWay) => {
                    arm.halt(now);
                    self.safety_mode = 3;
                    self.protective_since = Some(now);
                    self.text = Some("C153A2: position deviates from path");
                    self.is_paused = true;
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
                    let mut stand_rad = arm.goal_rad();
                    stand_rad[0] -= offset_rad;
                    arm.divert(stand_rad, now);
                    self.claim_offset_rad = offset_rad;
                }
                Some(Mishap::Refuses) | None => {}
            }
        }
        let is_over = |program: &Running| program.end.map_or(arm.share(now) >= 1.0, |end| now >= end);
        if self.program.as_ref().is_some_and(is_over) {
            self.program = None;
        }
    }
}
