//! What a fit finds out beside the robot: `--unknown`.

use ballbar_calib::model::{Dataset, Rig, Robot};
use ballbar_calib::unknowns::{AnyBlock, Kind};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use miette::Diagnostic;
use thiserror::Error;

use super::outcome::CommandError;
use crate::remedies::Remedied;

#[derive(Args)]
pub(super) struct UnknownArgs {
    /// What is not known beside the robot and is found out with it: the zero of the bar or of each rod, the bar's gain or latency, where
    /// chucks and spheres are (within `tolerance_mm` of the rig file), an offset of each set, a drift from the first pose to the last, how far
    /// joints yield to the masses they bear, encoders are off their axes, and joints lag behind them
    #[arg(long, value_name = "KIND,…", value_delimiter = ',', value_parser = kinds())]
    unknown: Vec<Kind>,
}

fn kinds() -> impl TypedValueParser<Value = Kind> {
    PossibleValuesParser::new(Kind::ALL.map(Kind::name)).try_map(|name| Kind::named(&name).ok_or("no kind of unknowns"))
}

/// Why a rig's file is not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error, Diagnostic)]
#[error("--out-rig without `--unknown rig`: the rig stays as its file has it")]
#[diagnostic(help("Ask for both, and give chucks and spheres that are not known exactly their `tolerance_mm` in rig.toml."))]
pub(super) struct RigIsKnown;

impl UnknownArgs {
    /// Whether unknowns of this kind are asked for.
    pub(super) fn has(&self, kind: Kind) -> bool {
        self.unknown.contains(&kind)
    }

    /// The unknowns that these poses have of each kind, kinds that stand twice once.
    pub(super) fn blocks(&self, robot: &Robot, rig: &Rig, dataset: &Dataset) -> Result<Vec<AnyBlock>, CommandError> {
        let asked = Kind::ALL.into_iter().filter(|&kind| self.has(kind));
        Ok(asked.map(|kind| kind.block(robot, rig, dataset).map_err(Remedied)).collect::<Result<_, _>>()?)
    }
}
