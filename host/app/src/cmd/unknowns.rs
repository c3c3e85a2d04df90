//! What a fit finds out beside the robot: `--unknown`.

use ballbar_calib::identify::{Fit, FitOptions, fit, fit_paying_unknowns, unknown_scores};
use ballbar_calib::model::{Dataset, Rig, Robot};
use ballbar_calib::unknowns::{AnyBlock, Kind};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use miette::Diagnostic;
use thiserror::Error;

use super::outcome::CommandError;
use crate::documents::{TriedLine, UnknownsDocument};
use crate::remedies::Remedied;

#[derive(Args)]
pub(super) struct UnknownArgs {
    /// What is not known beside the robot and is found out with it: the zero of the bar or of each rod, the bar's gain or latency, where
    /// chucks and spheres are (within `tolerance_mm` of the rig file), an offset of each set, a drift from the first pose to the last, how far
    /// joints yield to the masses they bear, encoders are off their axes, and joints lag behind them. `auto` takes those, beside what is
    /// named, that predict poses left out better
    #[arg(long, value_name = "KIND|auto,…", value_delimiter = ',', value_parser = asked())]
    unknown: Vec<Asked>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Asked {
    Kind(Kind),
    Auto,
}

const AUTO: &str = "auto";

fn asked() -> impl TypedValueParser<Value = Asked> {
    let parse = |name: String| match name.as_str() {
        AUTO => Ok(Asked::Auto),
        name => Kind::named(name).map(Asked::Kind).ok_or("no kind of unknowns"),
    };
    PossibleValuesParser::new(Kind::ALL.map(Kind::name).into_iter().chain([AUTO])).try_map(parse)
}

/// Why a rig's file is not written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error, Diagnostic)]
#[error("--out-rig without `--unknown rig`: the rig stays as its file has it")]
#[diagnostic(help("Ask for both, and give chucks and spheres that are not known exactly their `tolerance_mm` in rig.toml."))]
pub(super) struct RigIsKnown;

impl UnknownArgs {
    /// Whether unknowns of this kind are asked for, or may be taken by themselves.
    pub(super) fn may_have(&self, kind: Kind) -> bool {
        self.unknown.contains(&Asked::Kind(kind)) || self.is_auto()
    }

    fn is_auto(&self) -> bool {
        self.unknown.contains(&Asked::Auto)
    }

    /// A fit with the unknowns that are asked for, kinds that stand twice once, and with those that pay where that is asked for; and what else
    /// may be unknown. Those of `options` are not looked at.
    pub(super) fn fit(
        &self,
        robot: &Robot,
        rig: &Rig,
        dataset: &Dataset,
        options: &FitOptions,
    ) -> Result<(Fit, UnknownsDocument), CommandError> {
        let asked = Kind::ALL.into_iter().filter(|&kind| self.unknown.contains(&Asked::Kind(kind)));
        let blocks = asked.map(|kind| kind.block(robot, rig, dataset).map_err(Remedied)).collect::<Result<Vec<_>, _>>()?;
        let fit_with = |unknowns: Vec<AnyBlock>| fit(robot, dataset, &FitOptions { unknowns, ..options.clone() });
        if self.is_auto() {
            let paying = fit_paying_unknowns(robot, rig, dataset, blocks, fit_with).map_err(Remedied)?;
            let unknowns = UnknownsDocument::new(Some(&paying), &unknown_scores(robot, rig, dataset, &paying.fit));
            return Ok((paying.fit, unknowns));
        }
        let fit = fit_with(blocks).map_err(Remedied)?;
        let unknowns = UnknownsDocument::new(None, &unknown_scores(robot, rig, dataset, &fit));
        Ok((fit, unknowns))
    }
}

/// What was taken in and what else would explain residuals, in lines; empty where there is nothing to say.
pub(super) fn unknowns_text(unknowns: &UnknownsDocument) -> String {
    let mut text = String::new();
    let tried = |line: &TriedLine| {
        format!(
            "{}, {:.0} standard deviations; poses left out: RMS {:.4} mm before, {:.4} mm with it\n",
            line.what, line.score.deviations, line.left_out_before_mm, line.left_out_mm
        )
    };
    for line in &unknowns.taken {
        text += &format!("taken by auto: {}", tried(line));
    }
    for line in &unknowns.left {
        text += &format!("not taken by auto, poses left out are predicted no better: {}", tried(line));
    }
    let mut others =
        unknowns.would_explain.iter().filter(|score| !unknowns.left.iter().any(|left| left.score.kind == score.kind));
    if let Some(first) = others.next() {
        text += "what else would explain the residuals\n";
        for score in std::iter::once(first).chain(others) {
            text += &format!("  {} (--unknown {})\n", score.sentence, score.kind);
        }
    }
    if text.is_empty() { text } else { format!("\n{text}") }
}
