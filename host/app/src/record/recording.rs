//! Takes what comes, notices what does not, and gets over a lost port.

use std::time::{Duration, Instant};

use ballbar::StillnessCriteria;
use ballbar::wire::{Answer, BoardHello, Command, FrameCounts, Refusal, StreamSelection};
use miette::Diagnostic;
use thiserror::Error;

use super::account::Account;
use super::news::News;
use crate::board::{BoardError, BoardLink, PortError, RobotOnBoard};
use crate::deadline::StopFlag;
use crate::session::{BoardDescription, RecordError};

/// What a board is told, whenever it is there, besides when the arm stands still, which is the account's.
#[derive(Clone, Debug)]
pub struct StreamSettings {
    /// Its port.
    pub port: String,
    /// Bits a second.
    pub baud: u32,
    /// Samples a second.
    pub rate_hz: u16,
    /// What is streamed.
    pub selection: StreamSelection,
    /// Whether it is asked for its status all the time, since without samples nothing else tells how the arm stands.
    pub asks_status: bool,
}

/// One run.
pub struct Recording {
    settings: StreamSettings,
    link: Link,
    account: Account,
    /// Not told yet.
    news: Vec<News>,
    /// No wait outlasts it.
    stop: StopFlag,
    asked: Instant,
    began: Instant,
    /// When the board last streamed anything that is believed.
    heard: Instant,
}

/// The board, or what is left of it while it is away.
enum Link {
    Up(Box<BoardLink>),
    Lost { hello: Box<BoardHello>, frames: (FrameCounts, u32) },
}

/// What a run ended with.
pub struct Ended {
    /// What the board said of itself.
    pub hello: BoardHello,
    /// Frames of the last link by their fate, and payloads that were no message.
    pub frames: (FrameCounts, u32),
    /// The books.
    pub account: Account,
    /// From the beginning to the end.
    pub duration: Duration,
}

/// Why a run cannot go on.
#[derive(Debug, Error, Diagnostic)]
pub enum RecordingError {
    /// The board or its port.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Board(#[from] BoardError),
    /// The session.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Record(#[from] RecordError),
    /// The port is back with something else behind it.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Changed(#[from] Changed),
}

/// A port that is back, with something else behind it.
#[derive(Debug, Error, Diagnostic)]
pub enum Changed {
    /// Another board.
    #[error("{port}: another board is there now: {now}, before {before}")]
    #[diagnostic(help("What was recorded before is kept. Record the other board in a run of its own."))]
    Board {
        /// The port.
        port: String,
        /// Number of the board that went away.
        before: String,
        /// Number of the one that came.
        now: String,
    },
    /// Other parameters.
    #[error("{port}: the board came back with other parameters")]
    #[diagnostic(help("What was recorded before is kept. Begin another run: joint angles mean something else now."))]
    Parameters {
        /// The port.
        port: String,
    },
}

/// After this much silence the board is asked how it is.
const SILENCE: Duration = Duration::from_secs(1);
/// How often it is asked where nothing else tells how the arm stands.
const ASK: Duration = Duration::from_millis(250);
/// How often a lost port is tried again.
const RETRY: Duration = Duration::from_millis(300);

impl Recording {
    /// Of a board that has been greeted; it streams from [`Recording::begin`] on.
    pub fn new(mut link: BoardLink, settings: StreamSettings, account: Account, stop: &StopFlag) -> Self {
        link.heed(stop);
        let (link, now) = (Link::Up(Box::new(link)), Instant::now());
        Self { settings, link, account, news: Vec::new(), stop: stop.clone(), asked: now, began: now, heard: now }
    }

    /// Tells the board what to stream.
    ///
    /// # Errors
    /// [`RecordingError::Board`].
    pub fn begin(&mut self) -> Result<(), RecordingError> {
        let Link::Up(link) = &mut self.link else { return Ok(()) };
        match self.settings.start(link, self.account.criteria()) {
            // Whoever asks for the next step sees that the user wants to end.
            Ok(()) | Err(BoardError::Stopped) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Waits for what comes next, for a moment at most, and takes it. A port that is away and a board that is silent are waited out.
    ///
    /// # Errors
    /// [`RecordingError`].
    pub fn step(&mut self) -> Result<(), RecordingError> {
        let Link::Up(link) = &mut self.link else { return self.wait_for_port() };
        let lost = if self.settings.asks_status && self.asked.elapsed() >= ASK {
            self.asked = Instant::now();
            ask(link, &mut self.account)?
        } else {
            match link.next_frame() {
                Ok(Some(frame)) => {
                    if frame.message.is_ok() {
                        self.heard = Instant::now();
                    }
                    self.account.count_losses(link.losses());
                    self.news.extend(self.account.take(&frame)?);
                    None
                }
                Ok(None) if self.heard.elapsed() >= SILENCE => {
                    self.heard = Instant::now();
                    ask(link, &mut self.account)?
                }
                Ok(None) => None,
                Err(PortError::Lost { reason, .. }) => Some(reason),
                Err(error) => return Err(BoardError::from(error).into()),
            }
        };
        lost.map_or(Ok(()), |reason| self.lose(reason))
    }

    /// What happened since this was last asked.
    pub fn take_news(&mut self) -> Vec<News> {
        std::mem::take(&mut self.news)
    }

    /// What the board says of itself, while it is there.
    pub fn board(&self) -> Option<&BoardHello> {
        match &self.link {
            Link::Up(link) => Some(link.hello()),
            Link::Lost { .. } => None,
        }
    }

    /// The books.
    pub fn account(&self) -> &Account {
        &self.account
    }

    /// Since the beginning.
    pub fn elapsed(&self) -> Duration {
        self.began.elapsed()
    }

    /// Ends the stream and the session, and says what came of it and whether all could be written.
    pub fn end(mut self) -> (Ended, Result<(), RecordError>) {
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
            Link::Up(link) => (link.hello().clone(), link.frame_counts()),
            Link::Lost { hello, frames } => (*hello, frames),
        };
        let duration = self.began.elapsed();
        let ended = self.account.end();
        (Ended { hello, frames, account: self.account, duration }, written.and(ended))
    }

    fn lose(&mut self, reason: String) -> Result<(), RecordingError> {
        self.news.push(News::Away { reason });
        if let Link::Up(link) = &self.link {
            self.account.count_losses(link.losses());
            // Dropping the old link closes the port, without which it could not be opened again.
            self.link = Link::Lost { hello: Box::new(link.hello().clone()), frames: link.frame_counts() };
        }
        Ok(self.account.lose()?)
    }

    /// Tries the port. What is neither a port that is away nor a board that is silent is an error.
    fn wait_for_port(&mut self) -> Result<(), RecordingError> {
        match self.regain() {
            Ok((link, robot_frame)) => {
                self.check_same(link.hello())?;
                self.account.regain(link.hello_frame(), robot_frame.as_deref())?;
                let is_started_anew = link.hello().uptime_us < self.began.elapsed().as_micros() as u64;
                self.news.push(News::Back { is_started_anew });
                self.link = Link::Up(Box::new(link));
                self.heard = Instant::now();
                Ok(())
            }
            Err(BoardError::Stopped) => Ok(()),
            Err(BoardError::Port(_) | BoardError::Silent { .. } | BoardError::NoReply { .. }) => {
                std::thread::sleep(RETRY);
                Ok(())
            }
            Err(error) => Err(error.into()),
        }
    }

    /// The board that is there now, and the frame in which it said what it uses.
    fn regain(&self) -> Result<(BoardLink, Option<Vec<u8>>), BoardError> {
        let mut link = BoardLink::connect_until(&self.settings.port, self.settings.baud, &self.stop)?;
        let robot = RobotOnBoard::read(&mut link)?;
        self.settings.start(&mut link, self.account.criteria())?;
        Ok((link, robot.map(|(_, frame)| frame)))
    }

    /// What came back is the board that went away, with the parameters that it had.
    fn check_same(&self, now: &BoardHello) -> Result<(), Changed> {
        let Link::Lost { hello: before, .. } = &self.link else { return Ok(()) };
        let port = self.settings.port.clone();
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
}

impl StreamSettings {
    fn start(&self, link: &mut BoardLink, criteria: StillnessCriteria) -> Result<(), BoardError> {
        link.act(Command::SetRate { rate_hz: self.rate_hz })?;
        link.act(Command::SetStillness(criteria))?;
        link.start_stream(self.selection)
    }
}

/// Asks a silent board how it is; a reason when it has to be greeted anew.
fn ask(link: &mut BoardLink, account: &mut Account) -> Result<Option<String>, BoardError> {
    match link.request(Command::Status) {
        Ok(Answer::Status(status)) => {
            account.take_status(&status);
            Ok(status.streaming.is_none().then(|| "it does not stream any more".into()))
        }
        // Whoever asks for the next step sees that the user wants to end.
        Ok(_) | Err(BoardError::Stopped) => Ok(None),
        Err(BoardError::Refused { refusal: Refusal::HelloFirst, .. }) => Ok(Some("it was reset".into())),
        Err(BoardError::Port(PortError::Lost { reason, .. })) => Ok(Some(reason)),
        Err(BoardError::NoReply { .. }) => Ok(Some("it does not answer".into())),
        Err(error) => Err(error),
    }
}
