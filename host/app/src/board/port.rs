//! A serial port.

use std::io::{ErrorKind, Read};
use std::time::Duration;

use serialport::{SerialPort, SerialPortType};

use super::errors::PortError;
use crate::deadline::{Deadline, is_short_wait, write_before};

/// Bits a second of the board's link.
pub const BAUD: u32 = 921_600;
/// How long one read or write waits before it says that nothing came or went.
const READ_WAIT: Duration = Duration::from_millis(10);
/// How long a write may take before the port counts as lost.
const WRITE_WAIT: Duration = Duration::from_secs(2);

/// An open serial port.
pub struct Port {
    name: String,
    inner: Box<dyn SerialPort>,
}

impl Port {
    /// Opens a port, and takes it for this program alone.
    ///
    /// # Errors
    /// [`PortError`] when it is absent, busy or not allowed.
    pub fn open(name: &str, baud: u32) -> Result<Self, PortError> {
        let opened = serialport::new(name, baud).timeout(READ_WAIT).open();
        let inner = opened.map_err(|error| match error.kind() {
            serialport::ErrorKind::NoDevice if !std::path::Path::new(name).exists() => absent(name),
            serialport::ErrorKind::Io(ErrorKind::NotFound) => absent(name),
            _ => PortError::Refused { name: name.to_owned(), reason: error.to_string() },
        })?;
        // What came before the port was opened belongs to nobody.
        let _ = inner.clear(serialport::ClearBuffer::Input);
        Ok(Self { name: name.to_owned(), inner })
    }

    /// The name it was opened by.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Reads what is there, waiting a moment; an idle line gives zero bytes.
    ///
    /// # Errors
    /// [`PortError::Lost`].
    pub fn read(&mut self, bytes: &mut [u8]) -> Result<usize, PortError> {
        match self.inner.read(bytes) {
            Ok(0) => Err(self.lost("it was closed at the other end")),
            Ok(count) => Ok(count),
            Err(error) if is_short_wait(&error) => Ok(0),
            Err(error) => Err(self.lost(&error.to_string())),
        }
    }

    /// Writes all bytes.
    ///
    /// # Errors
    /// [`PortError::Lost`], also when the line does not take them within two seconds.
    pub fn write_all(&mut self, bytes: &[u8]) -> Result<(), PortError> {
        self.write_until(bytes, &Deadline::regardless(WRITE_WAIT))
    }

    /// Writes all bytes before a deadline, and within two seconds.
    ///
    /// # Errors
    /// [`PortError::Lost`], also when the line does not take them by then.
    pub fn write_until(&mut self, bytes: &[u8], deadline: &Deadline) -> Result<(), PortError> {
        write_before(&deadline.at_most(WRITE_WAIT), &mut self.inner, bytes).map_err(|error| self.lost(&error.to_string()))
    }

    fn lost(&self, reason: &str) -> PortError {
        PortError::Lost { name: self.name.clone(), reason: reason.to_owned() }
    }
}

fn absent(name: &str) -> PortError {
    let ports = serialport::available_ports().unwrap_or_default();
    let known = match ports.iter().map(describe).collect::<Vec<_>>() {
        names if names.is_empty() => "No serial port is connected.".to_owned(),
        names => format!("There are: {}.", names.join(", ")),
    };
    PortError::Absent { name: name.to_owned(), known }
}

fn describe(port: &serialport::SerialPortInfo) -> String {
    match &port.port_type {
        SerialPortType::UsbPort(usb) => {
            format!("{} ({})", port.port_name, usb.product.as_deref().unwrap_or("USB"))
        }
        _ => port.port_name.clone(),
    }
}
