//! The loop of `stream`: shows how the recording stands, hears the keys, and ends it.

use super::picture::picture;
use super::words::{news_text, standing_text};
use super::{StreamArgs, StreamReport};
use crate::board::BoardLink;
use crate::cmd::outcome::{CommandError, record_error};
use crate::record::{Account, Counts, Ended, Recording, RecordingError, StreamSettings};
use crate::terminal::EndRequest;
use crate::terminal::screen::{Key, Screen};

/// One run of `stream`.
pub(super) struct Watch<'a> {
    args: &'a StreamArgs,
    recording: Recording,
    end: EndRequest,
    screen: Screen,
}

impl<'a> Watch<'a> {
    pub(super) fn new(link: BoardLink, args: &'a StreamArgs, account: Account) -> Self {
        let end = EndRequest::listen();
        let screen = Screen::open(&end);
        let settings = StreamSettings {
            port: args.port.port.clone(),
            baud: args.port.baud,
            rate_hz: args.rate,
            selection: args.selection(),
            asks_status: screen.is_steady() && !args.selection().samples,
        };
        Self { args, recording: Recording::new(link, settings, account, end.stop_flag()), end, screen }
    }

    /// Until the time is over, the poses are there, or the user has had enough.
    pub(super) fn run(&mut self) -> Result<(), CommandError> {
        self.recording.begin().map_err(recording_error)?;
        while !self.is_done() {
            self.show();
            let stepped = self.recording.step();
            for news in self.recording.take_news() {
                self.screen.note(&news_text(&news, &self.args.port.port, self.recording.account()));
            }
            stepped.map_err(recording_error)?;
        }
        Ok(())
    }

    /// Ends the stream and the session, and says what came of it and whether all could be written.
    pub(super) fn finish(mut self) -> (StreamReport, Result<(), CommandError>) {
        self.screen.close();
        let (Ended { hello, frames, account, duration }, written) = self.recording.end();
        let Counts { samples, settled, tool_poses, written: poses_written, withheld, beyond_limits, gaps } = account.counts();
        let report = StreamReport {
            port: self.args.port.port.clone(),
            board: hello.board.as_str().to_owned(),
            firmware: hello.firmware.as_str().to_owned(),
            robot: account.robot().map(|robot| robot.set().name.as_str().to_owned()),
            rate_hz: self.args.rate,
            duration_s: duration.as_secs_f64(),
            samples,
            measured_rate_hz: account.rate_hz(),
            settled,
            tool_poses,
            poses_written,
            poses_recovered: account.recovered(),
            poses_withheld: withheld,
            beyond_limits: account.knows_limits().then_some(beyond_limits),
            losses: account.losses(),
            frames: frames.into(),
            gaps,
            latest: account.latest().clone(),
            session: self.args.session.as_ref().map(|session| session.display().to_string()),
        };
        (report, written.map_err(record_error))
    }

    fn is_done(&self) -> bool {
        self.end.is_made()
            || self.args.time.is_some_and(|time| self.recording.elapsed() >= time)
            || self.args.poses.is_some_and(|poses| self.recording.account().counts().settled >= poses)
    }

    /// Shows how things stand, and hears the keys.
    fn show(&mut self) {
        while let Some(key) = self.screen.key() {
            if key == Key::Letter('q') {
                self.end.make();
            }
        }
        self.screen.draw(|| picture(self.args, &self.recording));
        if self.recording.board().is_some() {
            self.screen.say(|| standing_text(self.recording.account()));
        }
    }
}

/// What cannot be written is no bad input.
fn recording_error(error: RecordingError) -> CommandError {
    match error {
        RecordingError::Record(error) => record_error(error),
        RecordingError::Board(error) => error.into(),
        RecordingError::Changed(error) => error.into(),
    }
}
