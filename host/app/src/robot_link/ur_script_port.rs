//! The interface of a Universal Robots controller that takes programs, and whether it takes them.
//!
//! A controller that knows local and remote control (e-Series) takes programs in remote control only. A connection that was made in
//! local control stays deaf as long as it lasts, also in remote control, and nothing on it says so; one that was made in remote control
//! is closed when the controller goes to local. Only the dashboard tells which it is. So it is asked before every program, and a
//! connection that was closed, or made in local control or without asking, is made anew first. What stops the robot is sent without
//! asking, and not over such a connection either.
//!
//! Sources: UniversalRobots/Universal_Robots_ROS_Driver, issue 459, "Headless mode is not working" (what becomes of connections, of the
//! primary interface; a maintainer on 2026-03-30), and issue 131 (the same of scripts); the reply to `is in remote control`, `true` or `false`, and that it came with software 5.6, as in
//! UniversalRobots/Universal_Robots_Client_Library: src/ur/dashboard_client_implementation_g5.cpp.

use std::time::Duration;

use super::LinkError;
use super::dashboard::Dashboard;
use super::patience::STOP_WAIT;
use super::tcp::Tcp;
use crate::deadline::StopFlag;

/// What it sends is read away; so much in one go.
const DISCARD_BYTES: usize = 1 << 16;

/// From where the controller takes programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Control {
    Remote,
    Local,
    /// The dashboard is out of reach, or older than the question.
    Unknown,
}

/// A connection over which programs go, made anew when it has to be.
pub(super) struct ScriptPort {
    host: String,
    port: u16,
    dashboard_port: u16,
    wait: Duration,
    /// `None` when it was closed.
    tcp: Option<Tcp>,
    /// Made in local control, or without asking: it may be deaf.
    is_doubtful: bool,
    /// The dashboard did not tell; it is not asked again before a program was not begun.
    is_untold: bool,
}

impl ScriptPort {
    /// Connects. Every answer may take `wait`.
    ///
    /// # Errors
    /// [`LinkError`].
    pub(super) fn connect(host: &str, port: u16, dashboard_port: u16, wait: Duration) -> Result<Self, LinkError> {
        let tcp = Some(Tcp::connect(host, port, wait, &StopFlag::default())?);
        Ok(Self { host: host.to_owned(), port, dashboard_port, wait, tcp, is_doubtful: false, is_untold: false })
    }

    /// Reads away what the controller sends, and notices when it has closed the connection.
    pub(super) fn discard(&mut self) {
        if self.tcp.as_mut().is_some_and(|tcp| tcp.discard(DISCARD_BYTES).is_err()) {
            self.tcp = None;
        }
    }

    /// Asks the dashboard.
    ///
    /// # Errors
    /// [`LinkError::Stopped`].
    pub(super) fn control(&mut self, stop: &StopFlag) -> Result<Control, LinkError> {
        if self.is_untold {
            return Ok(Control::Unknown);
        }
        let reply = Dashboard::connect(&self.host, self.dashboard_port, self.wait, stop)
            .and_then(|mut dashboard| dashboard.ask("is in remote control"));
        let control = match reply.as_deref() {
            Ok("true") => Control::Remote,
            Ok("false") => Control::Local,
            Err(LinkError::Stopped) => return Err(LinkError::Stopped),
            _ => Control::Unknown,
        };
        self.is_untold = control == Control::Unknown;
        self.is_doubtful |= control == Control::Local;
        Ok(control)
    }

    /// Sends a program over a connection that is of use; [`Control::Local`] when there is none.
    ///
    /// # Errors
    /// [`LinkError`].
    pub(super) fn send(&mut self, program: &str, stop: &StopFlag) -> Result<Control, LinkError> {
        let control = self.control(stop)?;
        if control != Control::Local {
            self.drop_doubtful();
            self.write(program, self.wait, stop)?;
        }
        Ok(control)
    }

    /// Sends what stops the robot, whatever the user wants and whether or not the controller takes it: in local control it runs no program
    /// of this link. Nothing is asked first, so a connection that is made for it is doubtful itself.
    ///
    /// # Errors
    /// [`LinkError`].
    pub(super) fn send_regardless(&mut self, program: &str) -> Result<(), LinkError> {
        self.discard();
        self.drop_doubtful();
        self.is_doubtful = self.tcp.is_none();
        self.write(program, STOP_WAIT, &StopFlag::default())
    }

    /// The connection is made anew for the next program: over this one none was begun.
    pub(super) fn forget(&mut self) {
        (self.tcp, self.is_doubtful, self.is_untold) = (None, false, false);
    }

    fn drop_doubtful(&mut self) {
        if std::mem::take(&mut self.is_doubtful) {
            self.tcp = None;
        }
    }

    fn write(&mut self, program: &str, wait: Duration, stop: &StopFlag) -> Result<(), LinkError> {
        let tcp = match &mut self.tcp {
            Some(tcp) => tcp,
            none => none.insert(Tcp::connect(&self.host, self.port, wait, stop)?),
        };
        tcp.write_all(program.as_bytes())
    }
}
