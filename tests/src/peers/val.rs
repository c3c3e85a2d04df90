//! An emulated VAL controller behind a pseudo-terminal: echo, prompt, questions, and VAL's words for what is wrong.

use std::collections::{BTreeMap, VecDeque};
use std::io::{ErrorKind, Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rustix::fd::OwnedFd;
use rustix::fs::{Mode, OFlags};
use rustix::termios::ioctl_tiocnxcl;
use serialport::{SerialPort, TTYPort};

use super::{Arm, JOINTS, JointsAt, Mishap};

/// Joint speeds at `SPEED 100`, degrees per second.
const SPEED_100_DEG_S: [f64; JOINTS] = [82.0, 54.0, 122.0, 228.0, 240.0, 228.0];
/// Joint limits of a PUMA 560, degrees.
const LIMITS_DEG: [(f64, f64); JOINTS] =
    [(-160.0, 160.0), (-225.0, 45.0), (-45.0, 225.0), (-110.0, 170.0), (-100.0, 100.0), (-266.0, 266.0)];
/// A line that an operator may type.
const LINE_MAX: usize = 80;
const LOOK: Duration = Duration::from_millis(2);

/// How a controller is.
#[derive(Clone, Copy, Debug)]
pub struct ValPeerOptions {
    /// Where the arm stands, degrees.
    pub q_deg: [f64; JOINTS],
    /// How many times faster than in the world the arm goes.
    pub pace: f64,
    /// What one character takes on the line: 1.04 ms at 9600 baud.
    pub character: Duration,
    /// Whether the prompt after `DO` waits for the end of the move.
    pub prompts_at_end: bool,
    /// The prompt while a move is under way, `*` where `DO` counts as a program.
    pub prompts_busy: bool,
    /// What it asks after a point, which versions spell differently.
    pub question: &'static str,
}

impl Default for ValPeerOptions {
    fn default() -> Self {
        Self {
            q_deg: [0.0, -90.0, 90.0, 0.0, 0.0, 0.0],
            pace: 20.0,
            character: Duration::ZERO,
            prompts_at_end: false,
            prompts_busy: false,
            question: "CHANGE?\r\n",
        }
    }
}

/// A controller that runs until it is dropped.
pub struct ValPeer {
    port: String,
    arm: Arc<Mutex<Arm>>,
    wishes: Arc<Wishes>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Wishes {
    is_ended: AtomicBool,
    /// As an envelope error leaves it, until a person switches it on.
    is_power_off: AtomicBool,
    next_mishap: Mutex<Option<Mishap>>,
    lines: Mutex<Vec<String>>,
}

impl ValPeer {
    /// Switches a controller on.
    pub fn start(options: ValPeerOptions) -> Self {
        let (mut terminal, host_end) = TTYPort::pair().expect("the system has pseudo-terminals");
        terminal.set_timeout(LOOK).expect("a terminal takes a time limit");
        let port = host_end.name().expect("a pseudo-terminal has a name");
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        // Held open, so that the other end does not fail while no host is there.
        let host_end = rustix::fs::open(&port, flags, Mode::empty()).expect("a pseudo-terminal can be opened");
        let arm = Arc::new(Mutex::new(Arm::at_rest(options.q_deg.map(f64::to_radians), Instant::now())));
        let wishes = Arc::new(Wishes::default());
        let controller = Controller {
            options,
            terminal,
            host_end,
            arm: Arc::clone(&arm),
            wishes: Arc::clone(&wishes),
            typed: String::new(),
            question: None,
            points: BTreeMap::new(),
            percent: 100.0,
            under_way: None,
            is_silent: false,
            claim_offset_deg: 0.0,
        };
        let thread = std::thread::spawn(move || controller.run());
        Self { port, arm, wishes, thread: Some(thread) }
    }

    /// Name of the serial port.
    pub fn port(&self) -> &str {
        &self.port
    }

    /// Where the arm truly is.
    pub fn joints(&self) -> JointsAt {
        JointsAt(Arc::clone(&self.arm))
    }

    /// Lets something go wrong with the next move.
    pub fn next(&self, mishap: Mishap) {
        *self.wishes.next_mishap.lock().unwrap() = Some(mishap);
    }

    /// Switches arm power on, by the button.
    pub fn switch_power_on(&self) {
        self.wishes.is_power_off.store(false, Ordering::Relaxed);
    }

    /// The lines that were typed, without the empty ones and `WHERE`.
    pub fn lines(&self) -> Vec<String> {
        self.wishes.lines.lock().unwrap().iter().filter(|line| !line.is_empty() && *line != "WHERE").cloned().collect()
    }
}

impl Drop for ValPeer {
    fn drop(&mut self) {
        self.wishes.is_ended.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

struct Controller {
    options: ValPeerOptions,
    terminal: TTYPort,
    host_end: OwnedFd,
    arm: Arc<Mutex<Arm>>,
    wishes: Arc<Wishes>,
    typed: String,
    /// The point that `CHANGE?` is asked of.
    question: Option<String>,
    points: BTreeMap<String, [f64; JOINTS]>,
    percent: f64,
    under_way: Option<UnderWay>,
    is_silent: bool,
    claim_offset_deg: f64,
}

struct UnderWay {
    half: Instant,
    end: Instant,
    mishap: Option<Mishap>,
    owes_prompt: bool,
}

impl Controller {
    fn run(mut self) {
        let mut freed = Instant::now();
        let mut waiting = VecDeque::new();
        while !self.wishes.is_ended.load(Ordering::Relaxed) {
            let mut bytes = [0; 256];
            match self.terminal.read(&mut bytes) {
                Ok(count) => waiting.extend(&bytes[..count]),
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock) => {}
                // The host has closed; another may open.
                Err(_) => std::thread::sleep(LOOK),
            }
            while let Some(byte) = waiting.pop_front() {
                self.take(byte);
            }
            if self.watch().is_break() {
                return;
            }
            if freed.elapsed() > Duration::from_millis(20) {
                freed = Instant::now();
                ioctl_tiocnxcl(&self.host_end).expect("a terminal can be shared");
            }
        }
    }

    fn print(&mut self, text: &str) {
        if self.is_silent {
            return;
        }
        if self.options.character.is_zero() {
            let _ = self.terminal.write_all(text.as_bytes());
            return;
        }
        for byte in text.bytes() {
            std::thread::sleep(self.options.character);
            let _ = self.terminal.write_all(&[byte]);
        }
    }

    fn prompt(&mut self) {
        let is_busy = self.options.prompts_busy && self.under_way.is_some();
        self.print(if is_busy { "*" } else { "." });
    }

    fn take(&mut self, byte: u8) {
        match byte {
            0x03 => {
                self.typed.clear();
                self.question = None;
                self.print("^C\r\n");
                self.prompt();
            }
            b'\r' => {
                self.print("\r\n");
                let line = std::mem::take(&mut self.typed);
                self.wishes.lines.lock().unwrap().push(line.clone());
                match self.question.take() {
                    Some(point) => self.change(point, &line),
                    None => self.obey(&line),
                }
            }
            b' '..=b'~' if self.typed.len() < LINE_MAX => {
                self.typed.push(char::from(byte));
                self.print(&char::from(byte).to_string());
            }
            _ => self.print("\x07"),
        }
    }

    fn obey(&mut self, line: &str) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let complaint = match words[..] {
            [] => None,
            ["WHERE"] => {
                self.print_where();
                None
            }
            ["SPEED", percent] => match percent.parse::<f64>() {
                Ok(percent) if (0.1..=327.0).contains(&percent) => {
                    self.percent = percent;
                    None
                }
                _ => Some("*Invalid argument*".to_owned()),
            },
            ["POINT", name] if is_point(name) => {
                self.ask(name);
                return;
            }
            ["DO", "MOVE", name] => match self.set_out(name) {
                Ok(()) if self.options.prompts_at_end => return,
                Ok(()) => None,
                Err(complaint) => Some(complaint),
            },
            ["ABORT"] => {
                self.arm.lock().unwrap().halt(Instant::now());
                self.under_way = None;
                None
            }
            _ => Some("*Unknown instruction*".to_owned()),
        };
        if let Some(complaint) = complaint {
            self.print(&format!("{complaint}\r\n"));
        }
        self.prompt();
    }

    fn print_where(&mut self) {
        let mut q_deg = self.arm.lock().unwrap().at(Instant::now()).map(f64::to_degrees);
        q_deg[0] += self.claim_offset_deg;
        let joints: String = q_deg.iter().map(|q| format!("{q:9.3}")).collect();
        self.print(&format!(
            "  X/JT1    Y/JT2    Z/JT3    O/JT4    A/JT5    T/JT6    HAND\r\n   411.50   149.09   433.13  -90.000   90.000    0.000     0.00\r\n{joints}\r\n"
        ));
    }

    /// Prints a point and asks for changes.
    fn ask(&mut self, name: &str) {
        let values = self.points.entry(name.to_owned()).or_insert([0.0; JOINTS]);
        let values: String = values.iter().map(|value| format!("{value:9.3}")).collect();
        self.question = Some(name.to_owned());
        self.print(&format!("  X/JT1    Y/JT2    Z/JT3    O/JT4    A/JT5    T/JT6\r\n{values}\r\n{}", self.options.question));
    }

    /// Takes the answer to `CHANGE?`; an empty one leaves the point as it is.
    fn change(&mut self, name: String, line: &str) {
        if line.trim().is_empty() {
            self.prompt();
            return;
        }
        let values: Option<Vec<f64>> = line.split(',').map(|value| value.trim().parse().ok()).collect();
        match values.and_then(|values| values.try_into().ok()) {
            Some(values) => {
                self.points.insert(name.clone(), values);
            }
            None => self.print("*Invalid argument*\r\n"),
        }
        self.ask(&name);
    }

    fn set_out(&mut self, name: &str) -> Result<(), String> {
        let goal_deg = *self.points.get(name).ok_or("*Undefined value in this context*")?;
        let outside = goal_deg.iter().zip(LIMITS_DEG).position(|(q, (min, max))| !(min..=max).contains(q));
        if let Some(joint) = outside {
            return Err(format!("*Position out of range* Jt {}", joint + 1));
        }
        let mishap = self.wishes.next_mishap.lock().unwrap().take();
        if mishap == Some(Mishap::Refuses) || self.wishes.is_power_off.load(Ordering::Relaxed) {
            return Err("*Arm power off*".into());
        }
        let now = Instant::now();
        let mut arm = self.arm.lock().unwrap();
        let from_rad = arm.at(now);
        let alone_s = |i: usize| (goal_deg[i] - from_rad[i].to_degrees()).abs() / (SPEED_100_DEG_S[i] * self.percent / 100.0);
        let duration_s = (0..JOINTS).map(alone_s).fold(0.0, f64::max) / self.options.pace;
        arm.go(goal_deg.map(f64::to_radians), Duration::from_secs_f64(duration_s), now);
        let (half, end) = arm.half_and_end();
        self.under_way = Some(UnderWay { half, end, mishap, owes_prompt: self.options.prompts_at_end });
        Ok(())
    }

    /// Follows the move under way; breaks when the line does.
    fn watch(&mut self) -> std::ops::ControlFlow<()> {
        let now = Instant::now();
        let Some(under_way) = &mut self.under_way else { return std::ops::ControlFlow::Continue(()) };
        if now >= under_way.half {
            match under_way.mishap.take() {
                Some(Mishap::FaultsHalfWay) => {
                    self.arm.lock().unwrap().halt(now);
                    self.under_way = None;
                    self.wishes.is_power_off.store(true, Ordering::Relaxed);
                    self.print("\r\n*Envelope error* Jt 2\r\n");
                    self.prompt();
                    return std::ops::ControlFlow::Continue(());
                }
                Some(Mishap::EndsHalfWay) => {
                    self.arm.lock().unwrap().halt(now);
                    under_way.end = now;
                }
                Some(Mishap::GoesSilent) => self.is_silent = true,
                Some(Mishap::DropsTheLine) => return std::ops::ControlFlow::Break(()),
                Some(Mishap::TalksGarbage) => {
                    let _ = self.terminal.write_all(&[0xe6; 3000]);
                    let _ = self.terminal.write_all(&[0x1b; 100]);
                    let _ = self.terminal.write_all(&[0xff; 3000]);
                    self.is_silent = true;
                }
                Some(Mishap::StandsElsewhereByMrad(mrad)) => {
                    let offset_rad = f64::from(mrad) * 1e-3;
                    let mut arm = self.arm.lock().unwrap();
                    let mut stand_rad = arm.at(under_way.end);
                    stand_rad[0] -= offset_rad;
                    arm.go(stand_rad, under_way.end.saturating_duration_since(now), now);
                    self.claim_offset_deg = offset_rad.to_degrees();
                }
                Some(Mishap::Refuses) | None => {}
            }
        }
        if let Some(over) = self.under_way.take_if(|under_way| now >= under_way.end)
            && over.owes_prompt
        {
            self.prompt();
        }
        std::ops::ControlFlow::Continue(())
    }
}

/// `#` and a name of six characters at most.
fn is_point(name: &str) -> bool {
    name.strip_prefix('#').is_some_and(|name| {
        (1..=6).contains(&name.len())
            && name.starts_with(|c: char| c.is_ascii_uppercase())
            && name.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit())
    })
}
