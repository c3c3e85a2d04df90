//! The operator at a terminal: lines in, lines out; and the hand of the simulation.

use std::io::{BufRead, stdin};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

use ballbar::JointKind;

use crate::cmd::live_line::LiveLine;
use crate::cmd::port::EndRequest;
use crate::collect::{Event, Operator, View, Wish};
use crate::robot_link::LinkError;
use crate::robot_link::sim::{SimHand, SimRequest};
use crate::session::Connection;
use crate::units::{fixed, joints_text, mm_from_m, tidy};

/// What the keys do, for the start of a run.
pub(super) const KEYS: &str =
    "Type and press Enter: nothing = done, e = erase last, s = skip, p = pause, r = resume, q = quit (Ctrl-C too).";

/// Who attaches the bar.
pub(super) enum Hand {
    /// The person at the terminal.
    Person,
    /// Nobody has to be asked.
    Nobody,
    /// The simulation's.
    Sim(SimHand),
}

/// A person at the terminal, or none, with a hand.
pub(super) struct Terminal {
    hand: Hand,
    kinds: Vec<JointKind>,
    end: EndRequest,
    /// Lines typed.
    lines: Receiver<String>,
    line: LiveLine,
    /// A confirmation of what the hand did by itself.
    is_done: bool,
    /// A confirmation is waited for.
    is_asked: bool,
}

impl Terminal {
    pub(super) fn new(hand: Hand, kinds: &[JointKind], end: EndRequest) -> Self {
        let kinds = kinds.to_vec();
        Self { hand, kinds, end, lines: typed_lines(), line: LiveLine::new(), is_done: false, is_asked: false }
    }

    pub(super) fn clear(&self) {
        self.line.clear();
    }

    fn attach(&mut self, bar: Option<&Connection>) -> Result<(), LinkError> {
        match &mut self.hand {
            Hand::Person => self.is_asked = true,
            Hand::Nobody => self.is_done = true,
            Hand::Sim(hand) => {
                let request = match bar {
                    Some(Connection { chuck, sphere, bar_m }) => {
                        SimRequest::Attach { chuck: chuck.clone(), sphere: sphere.clone(), mid_m: *bar_m }
                    }
                    None => SimRequest::Detach,
                };
                hand.act(&request)?;
                self.is_done = true;
            }
        }
        Ok(())
    }

    fn ask(&mut self, what: &str, bar: String) {
        let ending = if matches!(self.hand, Hand::Person) { ". Enter when done." } else { "" };
        self.line.note(&format!("{what} {bar}{ending}"));
    }

    fn show(&mut self, view: &View) {
        let kinds = &self.kinds;
        self.line.draw(|| {
            let bar = view.displacement_m.map_or("no bar within its travel".into(), |m| format!("bar {:+.3} mm", mm_from_m(m)));
            format!("{}  {bar}", joints_text(kinds, view.q.as_array()))
        });
    }
}

impl Operator for Terminal {
    fn tell(&mut self, event: &Event<'_>) -> Result<(), LinkError> {
        match event {
            Event::Attach(bar) => {
                self.ask("Attach", words(bar));
                self.attach(Some(bar))?;
            }
            Event::Detach(bar) => {
                self.ask("Take off", bar.map_or("the bar, if it is on".into(), words));
                self.attach(None)?;
            }
            Event::Attached(bar) => self.line.note(&format!("attached: {}", words(bar))),
            Event::Drive { line, q } => {
                self.line.note(&format!("line {line}: drive to {}", joints_text(&self.kinds, q.as_array())));
            }
            Event::Start(program) => self.line.note(&format!("start the program {program} at the robot's controller")),
            Event::Measured(pose) => {
                let [inwards, outwards] = pose.travel_left_m.map(|m| fixed(mm_from_m(m), 1));
                self.line.note(&format!(
                    "{}/{} line {}: {} mm, {inwards} | {outwards} mm left, residual {:+.3} mm, {} to go",
                    pose.done,
                    pose.all,
                    pose.line,
                    fixed(mm_from_m(pose.length_m), 4),
                    mm_from_m(pose.residual_m),
                    indicatif::HumanDuration(pose.left),
                ));
            }
            Event::Missed { line, why } => self.line.note(&format!("line {line}: NOT MEASURED: {why}")),
            Event::Done(wish) => self.line.note(match wish {
                Wish::EraseLast => "the last pose is erased",
                Wish::Skip => "a pose is skipped",
                Wish::Pause => "paused; r and Enter to go on",
                Wish::Resume => "going on",
                Wish::Confirm | Wish::Quit => "",
            }),
            Event::Trouble(words) => self.line.note(words),
            Event::Repeated(m) => self.line.note(&format!("a pose returned to: {:+.4} mm", mm_from_m(*m))),
            Event::Now(view) => self.show(view),
        }
        Ok(())
    }

    fn wish(&mut self) -> Option<Wish> {
        if self.end.is_made() {
            return Some(Wish::Quit);
        }
        if std::mem::take(&mut self.is_done) {
            return Some(Wish::Confirm);
        }
        match self.lines.try_recv() {
            Ok(line) => self.read(&line),
            Err(TryRecvError::Empty) => None,
            // Nobody is there any more: nobody can attach the bar.
            Err(TryRecvError::Disconnected) if self.is_asked => Some(Wish::Quit),
            Err(TryRecvError::Disconnected) => None,
        }
    }
}

impl Terminal {
    fn read(&mut self, line: &str) -> Option<Wish> {
        let wish = match line.trim().to_ascii_lowercase().as_str() {
            "" | "ok" | "y" => Wish::Confirm,
            "e" => Wish::EraseLast,
            "s" => Wish::Skip,
            "p" => Wish::Pause,
            "r" => Wish::Resume,
            "q" => Wish::Quit,
            other => {
                self.line.note(&format!("`{other}` is no key. {KEYS}"));
                return None;
            }
        };
        self.is_asked &= wish != Wish::Confirm;
        Some(wish)
    }
}

/// Lines of stdin; a thread reads them, since no read of a line can be given up.
fn typed_lines() -> Receiver<String> {
    let (sender, receiver) = channel();
    let read = move || {
        for line in stdin().lock().lines() {
            let Ok(line) = line else { return };
            if sender.send(line).is_err() {
                return;
            }
        }
    };
    // Without the thread it is as if stdin were closed.
    let _ = thread::Builder::new().name("stdin".into()).spawn(read);
    receiver
}

fn words(bar: &Connection) -> String {
    format!("the bar {}:{}, {} mm", bar.chuck, bar.sphere, tidy(mm_from_m(bar.bar_m)))
}
