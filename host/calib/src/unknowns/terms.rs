//! What joints' angles have beside offset and scale: eccentricity, compliance, backlash ([`JointTerms`]).

use ballbar::{JointKind, JointTerms, JointVector, Lanes, LengthRows, Measurement, ParameterUnit, TermKind, term_basis};

use super::chain::plausible_error;
use super::{Block, ChainBlock, Kind, Unknown, UnknownError};
use crate::model::{Dataset, PoseRow, Robot};

/// Some terms of some joints, as changes of those that the robot has. The loads that compliance yields to are those of the design: they
/// depend on the parameters by so little that a fit need not follow.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TermsBlock {
    design: ChainBlock,
    terms: Vec<Term>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Term {
    /// From 0.
    joint: usize,
    /// Into [`TermKind::ALL`].
    kind: usize,
}

impl TermsBlock {
    /// How far each joint that bears a mass yields to it.
    ///
    /// # Errors
    /// [`UnknownError::NoMasses`] when no joint bears any.
    pub fn compliance(robot: &Robot) -> Result<Self, UnknownError> {
        let bears = |joint: usize| robot.terms.masses.load_joint(joint);
        Self::of(robot, &[TermKind::Compliance], bears).ok_or(UnknownError::NoMasses)
    }

    /// How far the encoders' discs are off their axes.
    ///
    /// # Errors
    /// [`UnknownError::NoDiscs`] when all joints are prismatic.
    pub fn eccentricity(robot: &Robot) -> Result<Self, UnknownError> {
        let turns = |joint: usize| robot.chain.joint_kinds()[joint] == JointKind::Revolute;
        let kinds: Vec<TermKind> = TermKind::ALL.into_iter().filter(|kind| kind.is_eccentricity()).collect();
        Self::of(robot, &kinds, turns).ok_or(UnknownError::NoDiscs)
    }

    /// By how much joints lag behind their encoders, of those that came from both sides.
    ///
    /// # Errors
    /// [`UnknownError::NoApproach`] when no joint is known to have.
    pub fn backlash(robot: &Robot, dataset: &Dataset) -> Result<Self, UnknownError> {
        let came = |joint: usize, sign: f64| dataset.rows.iter().any(|row| row.approach.sign::<f64>(joint) == sign);
        Self::of(robot, &[TermKind::Backlash], |joint| came(joint, 1.0) && came(joint, -1.0)).ok_or(UnknownError::NoApproach)
    }

    fn of(robot: &Robot, kinds: &[TermKind], has: impl Fn(usize) -> bool) -> Option<Self> {
        let joints = (0..robot.chain.joints()).filter(|&joint| has(joint));
        let terms: Vec<Term> =
            joints.flat_map(|joint| kinds.iter().map(move |&kind| Term { joint, kind: kind as usize })).collect();
        let design = ChainBlock::new(robot.chain.clone(), robot.terms);
        (!terms.is_empty()).then_some(Self { design, terms })
    }

    /// All terms of a block are of one kind.
    pub(super) fn kind(&self) -> Kind {
        match self.terms.first().map(|term| TermKind::ALL[term.kind]) {
            Some(TermKind::Compliance) => Kind::Compliance,
            Some(TermKind::Backlash) => Kind::Backlash,
            _ => Kind::Eccentricity,
        }
    }

    /// `φ` of each term where a row was measured.
    fn basis(&self, row: &PoseRow) -> impl Iterator<Item = f64> + '_ {
        let q = row.measurement.q;
        let needs_loads = self.terms.iter().any(|term| TermKind::ALL[term.kind] == TermKind::Compliance);
        let loads = if needs_loads { self.design.loads(&q) } else { JointVector::zero() };
        let approach = row.approach;
        self.terms.iter().map(move |&Term { joint, kind }| {
            term_basis(q.as_array()[joint], loads.as_array()[joint], approach.sign(joint))[kind]
        })
    }

    fn unit(&self, Term { joint, kind }: Term) -> ParameterUnit {
        match (TermKind::ALL[kind], self.design.design().joint_kinds()[joint]) {
            (TermKind::Compliance, JointKind::Revolute) => ParameterUnit::RadianPerNewtonMetre,
            (TermKind::Compliance, JointKind::Prismatic) => ParameterUnit::MetrePerNewton,
            (_, JointKind::Revolute) => ParameterUnit::Radian,
            (_, JointKind::Prismatic) => ParameterUnit::Metre,
        }
    }
}

impl Block for TermsBlock {
    fn unknowns(&self) -> Vec<Unknown> {
        let unknown = |&term: &Term| {
            let unit = self.unit(term);
            let name = format!("{}{}", TermKind::ALL[term.kind].name(), term.joint + 1);
            Unknown { name, unit, start: 0.0, tolerance: None, plausible: plausible_error(unit) }
        };
        self.terms.iter().map(unknown).collect()
    }

    fn correct(&self, values: &[f64], row: &PoseRow, measurement: &mut Measurement<f64>) {
        let displacements = measurement.joint_terms.as_array_mut();
        for ((term, basis), value) in self.terms.iter().zip(self.basis(row)).zip(values) {
            displacements[term.joint] += value * basis;
        }
    }

    fn columns(&self, _: &[f64], rows: &[&PoseRow], swept: &LengthRows<f64>, columns: &mut [Lanes<f64>]) {
        for (lane, row) in rows.iter().enumerate() {
            for ((term, basis), column) in self.terms.iter().zip(self.basis(row)).zip(&mut *columns) {
                column[lane] = swept.joint(term.joint)[lane] * basis;
            }
        }
    }

    fn correct_terms(&self, values: &[f64], terms: &mut JointTerms<f64>) {
        for (Term { joint, kind }, value) in self.terms.iter().zip(values) {
            let kind = TermKind::ALL[*kind];
            terms.set_coefficient(*joint, kind, terms.coefficient(*joint, kind) + value);
        }
    }
}
