//! `host-cal ports`: the serial ports of this machine.

use clap::Args;
use miette::Diagnostic;
use serde::Serialize;
use serialport::SerialPortType;
use thiserror::Error;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print};
use crate::terminal::table::Columns;

/// List the serial ports of this machine
#[derive(Args)]
#[command(after_help = "Example:\n  host-cal ports")]
pub(super) struct PortsArgs {
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Error, Diagnostic)]
#[error("the serial ports cannot be listed: {0}")]
struct ListFailed(serialport::Error);

#[derive(Serialize)]
struct PortsReport {
    ports: Vec<PortLine>,
}

#[derive(Serialize)]
struct PortLine {
    name: String,
    /// usb, pci, bluetooth or unknown.
    kind: &'static str,
    manufacturer: Option<String>,
    product: Option<String>,
    serial_number: Option<String>,
}

impl PortsArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        let ports = serialport::available_ports().map_err(ListFailed)?;
        print(&PortsReport { ports: ports.into_iter().map(PortLine::from).collect() }, self.output.json)?;
        Ok(Outcome::Good)
    }
}

impl From<serialport::SerialPortInfo> for PortLine {
    fn from(port: serialport::SerialPortInfo) -> Self {
        let line = |kind| Self { name: port.port_name.clone(), kind, manufacturer: None, product: None, serial_number: None };
        match port.port_type {
            SerialPortType::UsbPort(usb) => {
                Self { manufacturer: usb.manufacturer, product: usb.product, serial_number: usb.serial_number, ..line("usb") }
            }
            SerialPortType::PciPort => line("pci"),
            SerialPortType::BluetoothPort => line("bluetooth"),
            SerialPortType::Unknown => line("unknown"),
        }
    }
}

impl Report for PortsReport {
    fn text(&self) -> String {
        if self.ports.is_empty() {
            return "No serial port is connected. `host-cal virtual-board` makes one with a simulated board behind it.\n".into();
        }
        let mut table = Columns::new(&["<port", "<kind", "<maker", "<product", "<serial number"]);
        let or_dash = |text: &Option<String>| text.clone().unwrap_or_else(|| "-".into());
        for port in &self.ports {
            let details = [&port.manufacturer, &port.product, &port.serial_number].map(or_dash);
            table.row([port.name.clone(), port.kind.to_owned()].into_iter().chain(details));
        }
        table.text()
    }
}
