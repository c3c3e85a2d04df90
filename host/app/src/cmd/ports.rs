//! `host-cal ports`: the serial ports of this machine.

use clap::Args;
use serde::Serialize;

use super::inputs::OutputArgs;
use super::outcome::{CommandError, Outcome};
use super::report::{Report, print};
use crate::board::{PortDescription, serial_ports};
use crate::terminal::table::Columns;

/// List the serial ports of this machine
#[derive(Args)]
#[command(after_help = "Example:\n  host-cal ports")]
pub(super) struct PortsArgs {
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct PortsReport {
    ports: Vec<PortDescription>,
}

impl PortsArgs {
    pub(super) fn run(&self) -> Result<Outcome, CommandError> {
        print(&PortsReport { ports: serial_ports()? }, self.output.json)?;
        Ok(Outcome::Good)
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
