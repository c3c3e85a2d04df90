//! The dashboard server of a Universal Robots controller: lines of text on port 29999.
//!
//! Source: Universal Robots, "Dashboard Server, port 29999", article 15690; the replies to `unlock protective stop` as UR's own
//! client library has them.

use std::time::{Duration, Instant};

use super::LinkError;
use super::tcp::Tcp;

/// No line of the dashboard is longer.
const LINE_MAX: usize = 1024;

/// A connection to the dashboard.
pub(super) struct Dashboard {
    tcp: Tcp,
    heard: Vec<u8>,
    wait: Duration,
}

impl Dashboard {
    /// Connects, and reads the line by which the server introduces itself.
    ///
    /// # Errors
    /// [`LinkError`].
    pub(super) fn connect(host: &str, port: u16, wait: Duration) -> Result<Self, LinkError> {
        let mut dashboard = Self { tcp: Tcp::connect(host, port, wait)?, heard: Vec::new(), wait };
        let greeting = dashboard.line()?;
        if greeting.contains("Dashboard Server") {
            Ok(dashboard)
        } else {
            Err(dashboard.tcp.unexpected(greeting, "Connected: Universal Robots Dashboard Server"))
        }
    }

    /// Sends a command and gives the line that answers it.
    ///
    /// # Errors
    /// [`LinkError`], also when no line comes in time.
    pub(super) fn ask(&mut self, command: &str) -> Result<String, LinkError> {
        self.tcp.write_all(format!("{command}\n").as_bytes())?;
        self.line()
    }

    fn line(&mut self) -> Result<String, LinkError> {
        let deadline = Instant::now() + self.wait;
        loop {
            if let Some(end) = self.heard.iter().position(|byte| *byte == b'\n') {
                let line: Vec<u8> = self.heard.drain(..=end).collect();
                return Ok(String::from_utf8_lossy(&line).trim().to_owned());
            }
            if Instant::now() > deadline || self.heard.len() > LINE_MAX {
                let found: String = String::from_utf8_lossy(&self.heard).chars().take(60).collect();
                return Err(self.tcp.unexpected(found, "a line of text"));
            }
            let mut bytes = [0; 256];
            let count = self.tcp.read(&mut bytes)?;
            self.heard.extend_from_slice(&bytes[..count]);
        }
    }
}
