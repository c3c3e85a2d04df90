//! The operator at a terminal: keys and a steady screen, or lines in and lines out; and the hand of the simulation.

mod picture;

use std::sync::mpsc::{Receiver, TryRecvError};

use ballbar::JointKind;

use crate::collect::{Event, Operator, Wish};
use crate::deadline::StopFlag;
use crate::robot_link::LinkError;
use crate::robot_link::sim::{SimHand, SimRequest};
use crate::session::Connection;
use crate::terminal::screen::{Key, Screen};
use crate::terminal::{EndRequest, typed_lines};
use crate::units::{fixed, joints_text, mm_from_m};
pub(crate) use picture::Still;
use picture::{Next, picture};

/// What lines do that are typed, for the start of a run.
const KEYS: &str =
    "Type and press Enter: nothing = done, e = erase last, s = skip, p = pause, r = resume, q = quit (Ctrl-C too).";

/// Who attaches the bar.
pub(crate) enum Hand {
    /// The person at the terminal.
    Person,
    /// Nobody has to be asked.
    Nobody,
    /// The simulation's.
    Sim(SimHand),
}

impl Hand {
    /// From here on nothing is waited for any longer once the flag is set.
    pub(crate) fn heed(&mut self, stop: &StopFlag) {
        if let Self::Sim(hand) = self {
            hand.heed(stop);
        }
    }
}

/// A person at the terminal, or none, with a hand.
pub(crate) struct Terminal {
    hand: Hand,
    still: Still,
    kinds: Vec<JointKind>,
    end: EndRequest,
    /// Lines typed, where there is no steady screen.
    lines: Option<Receiver<String>>,
    screen: Screen,
    /// A confirmation of what the hand did by itself.
    is_done: bool,
    /// What the person was asked to do with the bar, until it is confirmed.
    asked: Option<String>,
    /// What the person does with the robot.
    next: Next,
}

impl Terminal {
    pub(crate) fn new(hand: Hand, still: Still, end: EndRequest) -> Self {
        let mut screen = Screen::open(&end);
        if matches!(hand, Hand::Person) && !screen.is_steady() {
            screen.note(KEYS);
        }
        let lines = (!screen.is_steady()).then(typed_lines);
        let (kinds, next) = (still.kinds(), Next::default());
        Self { hand, still, kinds, end, lines, screen, is_done: false, asked: None, next }
    }

    /// Gives the terminal back.
    pub(crate) fn close(&mut self) {
        self.screen.close();
    }

    fn attach(&mut self, bar: Option<&Connection>) -> Result<(), LinkError> {
        match &mut self.hand {
            Hand::Person => {}
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

    fn ask(&mut self, words: String) {
        if !matches!(self.hand, Hand::Person) {
            return self.screen.note(&words);
        }
        self.screen.note(&format!("{words}. Enter when done."));
        // Pressed before it was asked: meant for something else, or held down.
        self.screen.forget(Key::Enter);
        self.asked = Some(words);
    }

    /// Whatever was typed before the robot stopped does not release it.
    fn forget_typed(&mut self) {
        [Key::Letter('y'), Key::Letter('r')].into_iter().for_each(|key| self.screen.forget(key));
        if let Some(lines) = &self.lines {
            while lines.try_recv().is_ok() {}
        }
    }
}

impl Operator for Terminal {
    fn tell(&mut self, event: &Event<'_>) -> Result<(), LinkError> {
        match event {
            Event::Attach(bar) => {
                self.ask(format!("Attach {}", words(bar)));
                self.attach(Some(bar))?;
            }
            Event::Detach(bar) => {
                self.ask(format!("Take off {}", bar.map_or("the bar, if it is on".into(), words)));
                self.attach(None)?;
            }
            Event::Inspect { place, needed } => {
                self.forget_typed();
                self.screen.note(&format!("THE ROBOT STANDS {place}: {}", needed.what));
                self.ask(needed.remedy.to_owned());
            }
            Event::Attached(bar) => self.screen.note(&format!("attached: {}", words(bar))),
            Event::Drive { line, q } => {
                self.screen.note(&format!("line {line}: drive to {}", joints_text(&self.kinds, q.as_array())));
                self.next = Next::Drive { line: *line };
            }
            Event::Start(program) => {
                let words = format!("start the program {program} at the robot's controller");
                self.screen.note(&words);
                self.next = Next::Start(words);
            }
            Event::Measured(pose) => {
                self.next = Next::Nothing;
                let [inwards, outwards] = pose.travel_left_m.map(|m| fixed(mm_from_m(m), 1));
                self.screen.note(&format!(
                    "{}/{} line {}: {} mm, {inwards} | {outwards} mm left, residual {:+.3} mm, {} to go",
                    pose.done,
                    pose.all,
                    pose.line,
                    fixed(mm_from_m(pose.length_m), 4),
                    mm_from_m(pose.residual_m),
                    indicatif::HumanDuration(pose.left),
                ));
            }
            Event::Missed { line, why } => self.screen.note(&format!("line {line}: NOT MEASURED: {why}")),
            Event::Done(wish) => {
                self.still.is_paused = *wish == Wish::Pause || self.still.is_paused && *wish != Wish::Resume;
                self.screen.note(match wish {
                    Wish::EraseLast => "the last pose is erased",
                    Wish::Skip => "a pose is skipped",
                    Wish::Pause if self.screen.is_steady() => "paused",
                    Wish::Pause => "paused; r and Enter to go on",
                    Wish::Resume => "going on",
                    Wish::Confirm | Wish::Quit => "",
                });
            }
            Event::Trouble(words) => self.screen.note(words),
            Event::Repeated(m) => self.screen.note(&format!("a pose returned to: {:+.4} mm", mm_from_m(*m))),
            Event::Now(now) => {
                let (still, next, asked) = (&self.still, &self.next, self.asked.as_deref());
                self.screen.draw(|| picture(still, now, next, asked));
            }
        }
        Ok(())
    }

    fn is_present(&self) -> bool {
        matches!(self.hand, Hand::Person)
    }

    fn wish(&mut self) -> Option<Wish> {
        if self.end.is_made() {
            return Some(Wish::Quit);
        }
        if std::mem::take(&mut self.is_done) {
            return Some(Wish::Confirm);
        }
        let typed = match self.lines.as_ref().map(Receiver::try_recv) {
            None => match self.screen.key()? {
                Key::Enter => String::new(),
                Key::Letter(letter) => letter.to_string(),
                Key::End => return Some(Wish::Quit),
            },
            Some(Ok(line)) => line,
            // Nobody is there any more: nobody can attach the bar.
            Some(Err(TryRecvError::Disconnected)) if self.asked.is_some() => return Some(Wish::Quit),
            Some(Err(_)) => return None,
        };
        self.read(&typed)
    }
}

impl Terminal {
    fn read(&mut self, typed: &str) -> Option<Wish> {
        let wish = match typed.trim().to_ascii_lowercase().as_str() {
            "" | "ok" | "y" => Wish::Confirm,
            "e" => Wish::EraseLast,
            "s" => Wish::Skip,
            "p" => Wish::Pause,
            "r" => Wish::Resume,
            "q" => Wish::Quit,
            _ if self.screen.is_steady() => return None,
            other => {
                self.screen.note(&format!("`{other}` is no key. {KEYS}"));
                return None;
            }
        };
        if matches!(wish, Wish::Confirm | Wish::Resume) {
            self.asked = None;
        }
        Some(wish)
    }
}

fn words(bar: &Connection) -> String {
    format!("the bar {bar}")
}
