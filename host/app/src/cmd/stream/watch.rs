//! The loop of `stream`: takes what comes, notices what does not, and gets over a lost port.

use std::time::{Duration, Instant};

use ballbar::wire::{Answer, BoardHello, Command, Refusal};
use miette::Diagnostic;
use thiserror::Error;

use super::account::Account;
use super::picture::picture;
use super::{FrameLine, StreamArgs, StreamReport, record_error};
use crate::board::{BoardError, BoardLink, PortError, RobotOnBoard};
use crate::cmd::outcome::CommandError;
use crate::session::{BoardDescription, Recorder};
use crate::terminal::EndRequest;
use crate::terminal::screen::{Key, Screen};

/// One run of `stream`.
pub(super) struct Watch<'a> {
    args: &'a StreamArgs,
    link: Link,
    account: Account,
    end: EndRequest,
    screen: Screen,
    /// Without samples only the board's status tells what the screen shows.
    is_blind: bool,
    asked: Instant,
    began: Instant,
    /// When the board last streamed anything that is believed.
    heard: Instant,
}

/// The board, or what is left of it while it is away.
enum Link {
    Up(Box<BoardLink>),
    Lost { hello: Box<BoardHello>, frames: FrameLine },
}

/// A port that is back, with something else behind it.
#[derive(Debug, Error, Diagnostic)]
enum Changed {
    #[error("{port}: another board is there now: {now}, before {before}")]
    #[diagnostic(help("What was recorded before is kept. Record the other board in a run of its own."))]
    Board { port: String, before: String, now: String },
    #[error("{port}: the board came back with other parameters")]
    #[diagnostic(help("What was recorded before is kept. Begin another run: joint angles mean something else now."))]
    Parameters { port: String },
}

/// The parameters that a board uses, and the frame that they came in.
pub(super) type RobotAndFrame = (RobotOnBoard, Vec<u8>);

/// After this much silence the board is asked how it is.
const SILENCE: Duration = Duration::from_secs(1);
/// How often it is asked where nothing else tells how the arm stands.
const ASK: Duration = Duration::from_millis(250);
/// How often a lost port is tried again.
const RETRY: Duration = Duration::from_millis(300);

impl<'a> Watch<'a> {
    pub(super) fn new(mut link: BoardLink, args: &'a StreamArgs, account: Account) -> Self {
        let now = Instant::now();
        let end = EndRequest::listen();
        link.heed(end.stop_flag());
        let screen = Screen::open(&end);
        let is_blind = screen.is_steady() && !args.selection().samples;
        Self { args, link: Link::Up(Box::new(link)), account, end, screen, is_blind, asked: now, began: now, heard: now }
    }

    /// Until the time is over, the poses are there, or the user has had enough.
    pub(super) fn run(&mut self) -> Result<(), CommandError> {
        if let Link::Up(link) = &mut self.link {
            match self.args.start(link) {
                // The loop below sees that the user wants to end.
                Ok(()) | Err(BoardError::Stopped) => {}
                Err(error) => return Err(error.into()),
            }
        }
        while !self.is_done() {
            self.show();
            let Link::Up(link) = &mut self.link else {
                self.wait_for_port()?;
                continue;
            };
            if self.is_blind && self.asked.elapsed() >= ASK {
                self.asked = Instant::now();
                if let Some(reason) = ask(link, &mut self.account)? {
                    self.lose(&reason)?;
                }
                continue;
            }
            let lost = match link.next_frame() {
                Ok(Some(frame)) => {
                    if frame.message.is_ok() {
                        self.heard = Instant::now();
                    }
                    self.account.count_losses(link.losses());
                    if let Some(words) = self.account.take(&frame)? {
                        self.screen.note(&words);
                    }
                    None
                }
                Ok(None) if self.heard.elapsed() >= SILENCE => {
                    self.heard = Instant::now();
                    ask(link, &mut self.account)?
                }
                Ok(None) => None,
                Err(PortError::Lost { reason, .. }) => Some(reason),
                Err(error) => return Err(error.into()),
            };
            if let Some(reason) = lost {
                self.lose(&reason)?;
            }
        }
        Ok(())
    }

    /// Ends the stream and the session, and says what came of it and whether all could be written.
    pub(super) fn finish(mut self) -> (StreamReport, Result<(), CommandError>) {
        self.screen.close();
        let mut written = Ok(());
        if let Link::Up(link) = &mut self.link {
            // A board that is gone by now needs no end.
            let _ = link.end_stream();
            self.account.count_losses(link.losses());
            // What the board had gathered came before its answer.
            for frame in link.take_frames() {
                written = written.and(self.account.take(&frame).map(drop));
            }
        }
        let (hello, frames) = match self.link {
            Link::Up(link) => (link.hello().clone(), link.frame_counts().into()),
            Link::Lost { hello, frames } => (*hello, frames),
        };
        let account = self.account;
        let report = StreamReport {
            port: self.args.port.port.clone(),
            board: hello.board.as_str().to_owned(),
            firmware: hello.firmware.as_str().to_owned(),
            robot: account.robot.as_ref().map(|robot| robot.set().name.as_str().to_owned()),
            rate_hz: self.args.rate,
            duration_s: self.began.elapsed().as_secs_f64(),
            samples: account.samples,
            measured_rate_hz: account.rate_hz(),
            settled: account.settled,
            tool_poses: account.tool_poses,
            poses_written: account.written,
            poses_recovered: account.recorder.as_ref().map_or(0, Recorder::recovered),
            poses_withheld: account.withheld,
            beyond_limits: account.limits.as_ref().map(|_| account.beyond_limits),
            losses: account.losses(),
            frames,
            gaps: account.gaps,
            latest: account.latest,
            session: self.args.session.as_ref().map(|session| session.display().to_string()),
        };
        let ended = account.recorder.map_or(Ok(()), Recorder::end).map_err(record_error);
        (report, written.and(ended))
    }

    fn is_done(&self) -> bool {
        self.end.is_made()
            || self.args.time.is_some_and(|time| self.began.elapsed() >= time)
            || self.args.poses.is_some_and(|poses| self.account.settled >= poses)
    }

    /// Shows how things stand, and hears the keys.
    fn show(&mut self) {
        while let Some(key) = self.screen.key() {
            if key == Key::Letter('q') {
                self.end.make();
            }
        }
        let (account, args, began) = (&self.account, self.args, self.began);
        match &self.link {
            Link::Up(link) => {
                self.screen.draw(|| picture(args, Some(link), account, began.elapsed()));
                self.screen.say(|| account.text());
            }
            Link::Lost { .. } => self.screen.draw(|| picture(args, None, account, began.elapsed())),
        }
    }

    fn lose(&mut self, reason: &str) -> Result<(), CommandError> {
        self.screen.note(&format!("{}: the board is away: {reason}; waiting for it", self.args.port.port));
        if let Link::Up(link) = &self.link {
            self.account.count_losses(link.losses());
            let lost = Link::Lost { hello: Box::new(link.hello().clone()), frames: link.frame_counts().into() };
            // Dropping the old link closes the port, without which it could not be opened again.
            self.link = lost;
        }
        self.account.lose()
    }

    /// Tries the port. A port that is away and a board that is silent are waited out; anything else is an error.
    fn wait_for_port(&mut self) -> Result<(), CommandError> {
        match self.regain() {
            Ok((link, robot)) => {
                self.check_same(link.hello())?;
                self.account.regain(link.hello_frame(), robot.as_ref())?;
                let mut note = format!("{}: the board is back", self.args.port.port);
                if link.hello().uptime_us < self.began.elapsed().as_micros() as u64 {
                    note += "; it was started anew, so its encoders are NOT HOMED unless somebody has done so since";
                }
                self.screen.note(&note);
                self.link = Link::Up(Box::new(link));
                self.heard = Instant::now();
            }
            Err(BoardError::Stopped) => {}
            Err(BoardError::Port(_) | BoardError::Silent { .. } | BoardError::NoReply { .. }) => std::thread::sleep(RETRY),
            Err(error) => return Err(error.into()),
        }
        Ok(())
    }

    /// What came back is the board that went away, with the parameters that it had.
    fn check_same(&self, now: &BoardHello) -> Result<(), Changed> {
        let Link::Lost { hello: before, .. } = &self.link else { return Ok(()) };
        let port = self.args.port.port.clone();
        let number = |hello: &BoardHello| BoardDescription::from(hello).unique_id;
        if before.unique_id != now.unique_id {
            return Err(Changed::Board { port, before: number(before), now: number(now) });
        }
        let crc = |hello: &BoardHello| hello.active.as_ref().map(|active| active.crc);
        if crc(before) != crc(now) {
            return Err(Changed::Parameters { port });
        }
        Ok(())
    }

    fn regain(&self) -> Result<(BoardLink, Option<RobotAndFrame>), BoardError> {
        let mut link = BoardLink::connect_until(&self.args.port.port, self.args.port.baud, self.end.stop_flag())?;
        let robot = RobotOnBoard::read(&mut link)?;
        self.args.start(&mut link)?;
        Ok((link, robot))
    }
}

/// Asks a silent board how it is; a reason when it has to be greeted anew.
fn ask(link: &mut BoardLink, account: &mut Account) -> Result<Option<String>, CommandError> {
    match link.request(Command::Status) {
        Ok(Answer::Status(status)) => {
            account.take_status(&status);
            Ok(status.streaming.is_none().then(|| "it does not stream any more".into()))
        }
        // The loop sees that the user wants to end.
        Ok(_) | Err(BoardError::Stopped) => Ok(None),
        Err(BoardError::Refused { refusal: Refusal::HelloFirst, .. }) => Ok(Some("it was reset".into())),
        Err(BoardError::Port(PortError::Lost { reason, .. })) => Ok(Some(reason)),
        Err(BoardError::NoReply { .. }) => Ok(Some("it does not answer".into())),
        Err(error) => Err(error.into()),
    }
}
