//! What a fit believes beside the lengths, and what it does with lengths that contradict the others.

use ballbar_calib::identify::{Loss, PriorRule};
use clap::{Args, ValueEnum};

#[derive(Args)]
pub(super) struct BeliefArgs {
    /// What is believed of the robot's parameters beforehand: what the tolerances of its file say, or nothing, as in the paper
    #[arg(long, value_enum, default_value_t = PriorArg::Tolerances)]
    prior: PriorArg,
    /// What becomes of lengths that contradict the others: they are left out (Tukey's biweight, then a test), or fitted like all
    #[arg(long, value_enum, default_value_t = LossArg::Tukey)]
    loss: LossArg,
}

#[derive(Clone, Copy, ValueEnum)]
enum PriorArg {
    Tolerances,
    None,
}

#[derive(Clone, Copy, ValueEnum)]
enum LossArg {
    Tukey,
    None,
}

impl BeliefArgs {
    pub(super) fn prior(&self) -> PriorRule {
        match self.prior {
            PriorArg::Tolerances => PriorRule::Tolerances,
            PriorArg::None => PriorRule::None,
        }
    }

    pub(super) fn loss(&self) -> Loss {
        match self.loss {
            LossArg::Tukey => Loss::Tukey,
            LossArg::None => Loss::None,
        }
    }
}
