//! The dashboard server of a Universal Robots controller: lines of text on port 29999.
//!
//! A controller that goes from local to remote control still refuses orders over the connections that it has, so every use makes one of
//! its own ("please switch robot to Remote Control mode and reconnect to port 29999", a controller's own words).
//!
//! Source: Universal Robots, "Dashboard Server, port 29999", article 15690; the replies to `unlock protective stop` as UR's own
//! client library has them.

use std::time::Duration;

use super::LinkError;
use super::tcp::{Tcp, TcpLines};
use crate::deadline::StopFlag;

/// No line of the dashboard is longer.
const LINE_MAX: usize = 1024;

/// A connection to the dashboard.
pub(super) struct Dashboard {
    lines: TcpLines,
    wait: Duration,
}

impl Dashboard {
    /// Connects, and reads the line by which the server introduces itself. Every answer may take `wait`.
    ///
    /// # Errors
    /// [`LinkError`].
    pub(super) fn connect(host: &str, port: u16, wait: Duration, stop: &StopFlag) -> Result<Self, LinkError> {
        let mut dashboard = Self { lines: TcpLines::new(Tcp::connect(host, port, wait, stop)?, LINE_MAX), wait };
        let greeting = dashboard.line()?;
        if greeting.contains("Dashboard Server") {
            Ok(dashboard)
        } else {
            Err(dashboard.lines.tcp.unexpected(greeting, "Connected: Universal Robots Dashboard Server"))
        }
    }

    /// Sends a command and gives the line that answers it.
    ///
    /// # Errors
    /// [`LinkError`], also when no line comes whole in time.
    pub(super) fn ask(&mut self, command: &str) -> Result<String, LinkError> {
        self.lines.tcp.write_all(format!("{command}\n").as_bytes())?;
        self.line()
    }

    fn line(&mut self) -> Result<String, LinkError> {
        let deadline = self.lines.tcp.deadline(self.wait);
        self.lines.line(&deadline, "a line of text")
    }
}
