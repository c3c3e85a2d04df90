//! Which parameters the poses can tell, and in words why the others not.

use std::fmt;

use ballbar::{Chain, JointTerms, Measurement, ParameterUnit};
use nalgebra::DMatrix;

use super::observation::Observation;
use super::pivoting::PivotedColumns;
use super::reference::{Dependence, independent_columns};
use super::spectrum::{Spectrum, is_zero_column};
use crate::model::{Dataset, JointLimits, PoseRow, Robot};
use crate::units::ScreenUnit;
use crate::unknowns::{ChainBlock, Unknown, Unknowns};

/// What the poses say of one unknown.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Finding {
    /// It belongs to the independent subset.
    Identified,
    /// It is held by name, and the subset was chosen without it.
    LeftOut,
    /// Whatever is measured at the tool, the parameters of the subset named here move it in the same way.
    Redundant {
        /// Those that mimic it, strongest first.
        with: Vec<String>,
    },
    /// Other measurements could tell it; in these poses the parameters named here change the lengths in the same way.
    NotExcited {
        /// Those that mimic it, strongest first.
        with: Vec<String>,
    },
    /// No length of these poses changes with it.
    NoEffect,
    /// Independent, but so weakly that noise would drown it.
    Weak {
        /// Standard deviation that these poses alone would give it, given the stronger ones; SI.
        std: f64,
        /// What the design value is trusted to; SI.
        plausible: f64,
        /// The parameter's unit.
        unit: ParameterUnit,
    },
}

impl Finding {
    /// A word for machines: `identified`, `left_out`, `redundant`, `not_excited`, `no_effect`, `weak`.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Identified => "identified",
            Self::LeftOut => "left_out",
            Self::Redundant { .. } => "redundant",
            Self::NotExcited { .. } => "not_excited",
            Self::NoEffect => "no_effect",
            Self::Weak { .. } => "weak",
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Identified => f.write_str("identified"),
            Self::LeftOut => f.write_str("left out by name"),
            Self::Redundant { with } => write!(f, "redundant with {}", list(with)),
            Self::NotExcited { with } => write!(f, "not excited: in these poses it acts like {}", list(with)),
            Self::NoEffect => f.write_str("not excited: no length of these poses changes with it"),
            Self::Weak { std, plausible, unit } => {
                let screen = ScreenUnit::from(*unit);
                let (std, plausible) = (screen.from_si(*std), screen.from_si(*plausible));
                let unit = if screen == ScreenUnit::One { String::new() } else { format!(" {}", screen.name()) };
                write!(
                    f,
                    "weakly excited: its deviation would be {}{unit}, the design is trusted to {plausible}{unit}",
                    significant(std)
                )
            }
        }
    }
}

/// Two significant digits, without an exponent.
fn significant(value: f64) -> String {
    let digits = (1.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}

fn list(names: &[String]) -> String {
    const SHOWN: usize = 4;
    let shown = names[..names.len().min(SHOWN)].join(", ");
    match names.len().saturating_sub(SHOWN) {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// What a set of poses can tell: the rank of its Jacobian, an independent subset of its columns, and what is with the others.
///
/// ```
/// use ballbar_calib::designs;
/// use ballbar_calib::identify::Identifiability;
/// use ballbar_calib::simulate::Shells;
///
/// let (robot, rig) = (designs::puma560(), designs::triangles());
/// let pairings = rig.all_pairings();
/// let shells = Shells {
///     planned_with: &robot, truth: &robot, rig: &rig, pairings: &pairings, bar_m: 0.46, per_pairing: 20, sigma_m: 0.0, seed: 1,
/// };
/// let poses: Vec<_> = shells.simulate(|| ())?.into_iter().map(|pose| pose.row.measurement).collect();
/// let found = Identifiability::new(&robot.chain, &poses, &robot.limits, &[]);
/// assert_eq!((found.spectrum.rank, robot.chain.independent_parameters()), (36, 36));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Identifiability {
    /// Names of the unknowns, in order.
    pub names: Vec<String>,
    /// Singular values of all columns.
    pub spectrum: Spectrum,
    /// One finding an unknown, in their order.
    pub findings: Vec<Finding>,
    /// RMS of what no linear change of the independent unknowns explains, metres: the noise as the data show it. Zero when
    /// there are no more rows than independent unknowns.
    pub noise_m: f64,
}

impl Identifiability {
    /// Judges all parameters of `chain` by the weighted Jacobian at its present values. The subset is chosen around the
    /// parameters at the indices `held`, which are not free whatever the poses say.
    pub fn new(chain: &Chain<f64>, measurements: &[Measurement<f64>], limits: &[JointLimits], held: &[usize]) -> Self {
        let block = ChainBlock::new(chain.clone(), JointTerms::none());
        let dependence = Dependence::new(chain, limits);
        Self::of(&block, &block.unknowns(), &Observation::new(chain, measurements), &dependence, held)
    }

    /// Judges all parameters of a robot, whose joints may have terms, by poses; as [`Identifiability::new`].
    pub fn of_robot(robot: &Robot, dataset: &Dataset) -> Self {
        let unknowns = Unknowns::new(&robot.chain, &robot.terms, Vec::new());
        let rows: Vec<&PoseRow> = dataset.rows.iter().collect();
        let observation = Observation::of(&unknowns, &unknowns.start(), &rows, None);
        let dependence = Dependence::new(&robot.chain, &robot.limits);
        Self::of(unknowns.of_chain(), unknowns.list(), &observation, &dependence, &[])
    }

    /// Judges all unknowns, those of a chain and others behind them, by an observation of them all and by what of the chain is always dependent.
    pub(super) fn of(
        chain: &ChainBlock,
        unknowns: &[Unknown],
        observation: &Observation,
        dependence: &Dependence,
        held: &[usize],
    ) -> Self {
        let all = (0..unknowns.len()).filter(|index| !held.contains(index));
        let (last, first): (Vec<usize>, Vec<usize>) = all.partition(|&index| chain.is_held_in_paper(index));
        let names: Vec<String> = unknowns.iter().map(|unknown| unknown.name.clone()).collect();
        let spectrum = Spectrum::new(&observation.jacobian);
        let independent = independent_columns(&[first, last], &observation.jacobian, spectrum.rank);
        let noise_m = unexplained_rms(observation, &independent);

        let always_independent = dependence.independent(&[], held);
        let is_redundant = |index: usize| index < chain.len() && !always_independent.contains(&index);
        let called = |indices: Vec<usize>| indices.into_iter().map(|index| names[index].clone()).collect();

        let mut findings = vec![Finding::Identified; unknowns.len()];
        for (index, std) in weak_columns(unknowns, &observation.jacobian, &independent, noise_m) {
            let Unknown { plausible, unit, .. } = unknowns[index];
            findings[index] = Finding::Weak { std, plausible, unit };
        }
        let largest = observation.jacobian.column_iter().map(|column| column.norm()).fold(0.0, f64::max);
        for index in (0..unknowns.len()).filter(|index| !independent.contains(index)) {
            findings[index] = if held.contains(&index) {
                Finding::LeftOut
            } else if is_redundant(index) {
                Finding::Redundant { with: called(mimics(&dependence.jacobian, &always_independent, index)) }
            } else if is_zero_column(observation.jacobian.column(index).norm(), largest) {
                Finding::NoEffect
            } else {
                Finding::NotExcited { with: called(mimics(&observation.jacobian, &independent, index)) }
            };
        }
        Self { names, spectrum, findings, noise_m }
    }

    /// The unknowns that the data identify, ascending.
    pub fn identified(&self) -> Vec<usize> {
        (0..self.findings.len()).filter(|&index| self.findings[index] == Finding::Identified).collect()
    }

    /// The unknowns that the data do not identify, by name, with the reason.
    pub fn not_identified(&self) -> impl Iterator<Item = (&str, &Finding)> + '_ {
        let findings = self.names.iter().zip(&self.findings);
        let missed = findings.filter(|(_, finding)| !matches!(finding, Finding::Identified | Finding::LeftOut));
        missed.map(|(name, finding)| (name.as_str(), finding))
    }
}

/// RMS of the residual's part outside the span of the columns, per degree of freedom.
fn unexplained_rms(observation: &Observation, independent: &[usize]) -> f64 {
    let freedom = (observation.count + observation.beliefs.nrows()).saturating_sub(independent.len());
    if freedom == 0 {
        return 0.0;
    }
    let q = observation.columns(independent).qr().q();
    let unexplained = &observation.residual_m - &q * (q.transpose() * &observation.residual_m);
    (unexplained.norm_squared() / freedom as f64).sqrt()
}

/// Of the independent columns those that noise would drown, with the standard deviation it would leave them.
///
/// Columns are scaled by the plausible error, so that a pivot is the size, over all rows, of what a plausible error of the
/// parameter does to the lengths and the stronger parameters cannot do; `noise / pivot` is then its standard deviation in
/// units of the plausible error.
fn weak_columns(unknowns: &[Unknown], jacobian: &DMatrix<f64>, independent: &[usize], noise_m: f64) -> Vec<(usize, f64)> {
    let plausible: Vec<f64> = independent.iter().map(|&index| unknowns[index].plausible).collect();
    let mut effects = jacobian.select_columns(independent);
    for (mut column, plausible) in effects.column_iter_mut().zip(&plausible) {
        column *= *plausible;
    }
    let PivotedColumns { order, pivots, .. } = PivotedColumns::new(effects, 0.0);
    let drowned = order.into_iter().zip(pivots).filter(|&(_, pivot)| pivot < noise_m);
    drowned.map(|(column, pivot)| (independent[column], plausible[column] * noise_m / pivot)).collect()
}

/// Which columns of the subset make up another column, strongest first.
pub(super) fn mimics(jacobian: &DMatrix<f64>, subset: &[usize], index: usize) -> Vec<usize> {
    let columns = jacobian.select_columns(subset);
    let target = jacobian.column(index).into_owned();
    let qr = columns.clone().qr();
    let Some(coefficients) = qr.r().solve_upper_triangular(&(qr.q().transpose() * &target)) else { return Vec::new() };
    let mut shares: Vec<(usize, f64)> = subset
        .iter()
        .zip(columns.column_iter())
        .zip(coefficients.iter())
        .map(|((&i, column), c)| (i, c.abs() * column.norm()))
        .collect();
    shares.sort_by(|a, b| b.1.total_cmp(&a.1));
    // A thousandth part is not what makes a column look like another.
    let strongest = shares.first().map_or(0.0, |share| share.1);
    shares.iter().take_while(|share| share.1 > 1e-3 * strongest).map(|share| share.0).collect()
}
