//! What a fit found: parameters, how sure they are, and what poses left out say of them.

use std::time::Duration;

use ballbar::{Chain, JointTerms, Parameter, ParameterKind, ParameterUnit};

use super::cross_validation::CrossValidation;
use super::groups::LeftOutGroup;
use super::hold::Held;
use super::identifiability::Identifiability;
use super::lm::Solution;
use super::prior::Part;
use super::residual::{Residual, ResidualSummary};
use super::residuals::{Outlier, PairingResiduals};
use super::robust::WrongRow;
use super::uncertainty::Uncertainty;
use crate::model::{Dataset, Rig, Robot};
use crate::unknowns::Unknowns;

/// One unknown before and after.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FittedParameter {
    /// What it is called; a chain's parameters stand first, in their order.
    pub name: String,
    /// Unit of the values.
    pub unit: ParameterUnit,
    /// Design value, SI.
    pub initial: f64,
    /// Fitted value, SI; the design value where held.
    pub fitted: f64,
    /// Standard deviation, SI; `None` where held or undetermined.
    pub std: Option<f64>,
    /// Why it was held; `None` where free.
    pub held: Option<Held>,
}

/// What tolerances had to say in a fit.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PriorFacts {
    /// By which those inside the arm were multiplied, as the lengths make likeliest.
    pub factor: f64,
    /// Deviation of a length of weight one that they were weighed against, metres.
    pub sigma_m: f64,
    /// Parts that were so far off that they were fitted as if nothing had been known of them.
    pub released: Vec<Released>,
}

/// A part whose tolerance was not believed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Released {
    /// Which.
    pub part: Part,
    /// By how much it is off, SI; a size where it is not a single number.
    pub change: f64,
    /// What its tolerance is, SI.
    pub tolerance: f64,
}

/// The result of a fit.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Fit {
    /// What could be found out.
    pub unknowns: Unknowns,
    /// The fitted chain and values, why the solve ended, its iterations and the course of its RMS.
    pub solution: Solution,
    /// Wall time of the solve alone.
    pub solve_time: Duration,
    /// What the poses can tell, judged at the design values.
    pub identifiability: Identifiability,
    /// What tolerances of the chain had to say; `None` where they were not asked.
    pub prior: Option<PriorFacts>,
    /// Rows that no fit explains together with the others: they were left out, and have weight zero below.
    pub wrong_rows: Vec<WrongRow>,
    /// Deviations and condition at the fitted values.
    pub uncertainty: Uncertainty,
    /// All unknowns, in order.
    pub parameters: Vec<FittedParameter>,
    /// Residuals with the design values.
    pub initial: ResidualSummary,
    /// Residuals with the fitted values.
    pub fitted: ResidualSummary,
    /// Residuals by pairing with the design values.
    pub initial_by_pairing: Vec<PairingResiduals>,
    /// Residuals by pairing with the fitted values.
    pub fitted_by_pairing: Vec<PairingResiduals>,
    /// Residuals of all rows with the fitted values.
    pub residuals: Vec<Residual>,
    /// Rows that stand out after the fit, and were fitted.
    pub outliers: Vec<Outlier>,
    /// Correlation of residuals with the next ones measured; `None` for too few. Far from zero, something drifts or jumps.
    pub neighbour_correlation: Option<f64>,
    /// Prediction of poses left out; `None` when too few are left to fit.
    pub cross_validation: Option<CrossValidation>,
    /// Residuals of all rows while they were left out; none where there is no cross-validation.
    pub left_out: Vec<Residual>,
    /// Bars, sets, files, pairings and what was measured in one go, as far as there are several: each predicted by the others.
    pub left_out_groups: Vec<LeftOutGroup>,
    /// Residuals when only where the robot's base stands is fitted, the six parameters of its first link; `None` when one of them is held by
    /// name.
    pub base_alone: Option<ResidualSummary>,
}

impl Fit {
    /// Number of free unknowns.
    pub fn free_parameters(&self) -> usize {
        self.uncertainty.spectrum.singular_values.len()
    }

    /// A design as it would be if its lost zeros had not been lost: with the offsets that were released as they were found.
    pub fn remastered(&self, design: &Chain<f64>) -> Chain<f64> {
        let mut remastered = design.clone();
        for released in self.prior.iter().flat_map(|prior| &prior.released) {
            if let Part::Offset(joint, _) = released.part
                && let Some(offset) = Parameter::new(joint, ParameterKind::Offset)
            {
                remastered.parameters_mut()[offset.index()] += released.change;
            }
        }
        remastered
    }

    /// The same residuals, those of rows that were left out with weight zero. One entry a row of the dataset.
    pub fn counted(&self, mut residuals: Vec<Residual>) -> Vec<Residual> {
        self.wrong_rows.iter().for_each(|wrong| residuals[wrong.row].weight = 0.0);
        residuals
    }

    /// Residuals of any rows that were measured with the same rig, with the fitted values of all unknowns.
    pub fn residuals_of(&self, dataset: &Dataset) -> Vec<Residual> {
        Residual::of_rows(&self.unknowns, &self.solution.values, dataset.rows.iter())
    }

    /// The terms of the robot's joints, with what was found beside those that it had.
    pub fn terms(&self, robot: &Robot) -> JointTerms<f64> {
        self.unknowns.terms(&self.solution.values, &robot.terms)
    }

    /// The rig as it was found to be.
    pub fn rig(&self, rig: &Rig) -> Rig {
        self.unknowns.rig(&self.solution.values, rig)
    }
}
