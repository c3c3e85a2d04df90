//! The serial ports of this machine.

use miette::Diagnostic;
use serde::Serialize;
use serialport::SerialPortType;
use thiserror::Error;

/// A serial port, and what is known of what is plugged in.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PortDescription {
    /// By which it is opened.
    pub name: String,
    /// `usb`, `pci`, `bluetooth` or `unknown`.
    pub kind: &'static str,
    /// Of a USB device.
    pub manufacturer: Option<String>,
    /// Of a USB device.
    pub product: Option<String>,
    /// Of a USB device.
    pub serial_number: Option<String>,
}

/// The operating system does not say which ports there are.
#[derive(Debug, Error, Diagnostic)]
#[error("the serial ports cannot be listed: {0}")]
pub struct PortsError(serialport::Error);

/// The serial ports of this machine.
///
/// # Errors
/// [`PortsError`] with the operating system's reason.
pub fn serial_ports() -> Result<Vec<PortDescription>, PortsError> {
    Ok(serialport::available_ports().map_err(PortsError)?.into_iter().map(PortDescription::from).collect())
}

impl From<serialport::SerialPortInfo> for PortDescription {
    fn from(port: serialport::SerialPortInfo) -> Self {
        let of_kind = |kind| Self { name: port.port_name.clone(), kind, manufacturer: None, product: None, serial_number: None };
        match port.port_type {
            SerialPortType::UsbPort(usb) => {
                Self { manufacturer: usb.manufacturer, product: usb.product, serial_number: usb.serial_number, ..of_kind("usb") }
            }
            SerialPortType::PciPort => of_kind("pci"),
            SerialPortType::BluetoothPort => of_kind("bluetooth"),
            SerialPortType::Unknown => of_kind("unknown"),
        }
    }
}
