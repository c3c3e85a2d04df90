//! Arguments and habits that the commands with a board have in common.

use ballbar::StillnessCriteria;
use clap::Args;

use super::outcome::CommandError;
use crate::board::{BAUD, BoardLink};

/// Which board.
#[derive(Args)]
pub(super) struct PortArgs {
    /// Serial port of the board, as `host-cal ports` lists it: /dev/ttyUSB0, on macOS /dev/cu.usbserial-1, on Windows COM3
    pub(super) port: String,
    /// Bits a second
    #[arg(long, default_value_t = BAUD)]
    pub(super) baud: u32,
}

impl PortArgs {
    /// Opens the port and greets the board.
    pub(super) fn connect(&self) -> Result<BoardLink, CommandError> {
        Ok(BoardLink::connect(&self.port, self.baud)?)
    }
}

/// When the arm stands still.
#[derive(Args)]
pub(super) struct StillnessArgs {
    /// How long the arm must stand still, 10 to 60000 milliseconds
    #[arg(long, default_value_t = 500, value_name = "MS", value_parser = clap::value_parser!(u32).range(10..=60_000))]
    hold_ms: u32,
    /// Band of the encoders within which the arm stands still, counts
    #[arg(long, default_value_t = StillnessCriteria::default().band_counts, value_name = "N")]
    band_counts: u16,
    /// Band of the LVDT within which the arm stands still, codes of 65,536
    #[arg(long, default_value_t = StillnessCriteria::default().band_codes, value_name = "N")]
    band_codes: u16,
}

impl StillnessArgs {
    pub(super) fn criteria(&self) -> StillnessCriteria {
        let hold_us = self.hold_ms.saturating_mul(1_000);
        StillnessCriteria { hold_us, band_counts: self.band_counts, band_codes: self.band_codes }
    }
}
