//! What is believed of a robot before anything is measured, from the tolerances of its links and joints.
//!
//! ```text
//! Tolerances, canonical frames ─▶ Λ of all 8J+6 parameters, one block a part (a link's displacement, its rotation, an offset, a scale)
//!                                   │ redundant directions left to settle as they like (Schur complement)
//!                                   ▼
//!                                 Λ of N independent ones ─ A (reference experiment) ─▶ Λ of the free parameters, however frames are written
//! ```
//!
//! So the kinematics that come out depend neither on which redundant parameters are held nor on how frames are written.

use std::fmt;
use std::ops::Range;

use ballbar::{Chain, JointKind, PARAMETERS_PER_JOINT};
use nalgebra::{DMatrix, DVector};

use super::reference::Dependence;
use crate::kinematics::CanonicalFrames;
use crate::model::{JointLimits, Tolerances};

/// A part of a robot of which one tolerance speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Part {
    /// Displacement of a link, by its number.
    Displacement(usize),
    /// Rotation of a link, by its number.
    Rotation(usize),
    /// Offset of a joint, by its number: its zero.
    Offset(usize, JointKind),
    /// Scale of a joint, by its number.
    Scale(usize),
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Displacement(link) => write!(f, "the origin of link {link}"),
            Self::Rotation(link) => write!(f, "the orientation of link {link}"),
            Self::Offset(joint, _) => write!(f, "the zero of joint {joint}"),
            Self::Scale(joint) => write!(f, "the scale of joint {joint}"),
        }
    }
}

/// One block of `Λ`.
#[derive(Clone, Debug)]
struct PartTolerance {
    part: Part,
    /// Into the canonical parameters.
    indices: Range<usize>,
    tolerance: f64,
    /// Whether the common factor is for it: neither where the robot stands nor how its tool is mounted.
    is_inside: bool,
    /// Squared size of a change of these parameters is `changeᵀ · metric · change`.
    metric: DMatrix<f64>,
}

/// What the tolerances of a chain say, and how they are weighed.
#[derive(Clone, Debug)]
pub(super) struct ChainPrior {
    parts: Vec<PartTolerance>,
    /// Independent canonical parameters, and the redundant ones, which move along at will: together those that are not exactly known.
    independent: Vec<usize>,
    redundant: Vec<usize>,
    /// `∂independent/∂redundant`: what each redundant one is worth.
    exchange: DMatrix<f64>,
    /// `∂independent/∂written` of all parameters as they are written.
    independent_by_written: DMatrix<f64>,
}

/// How tolerances are weighed in one fit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Weighing {
    /// Of all tolerances inside the arm.
    pub(super) factor: f64,
    /// Parts that count as if nothing were known of them.
    pub(super) released: Vec<Part>,
}

impl Weighing {
    /// As the tolerances are stated.
    pub(super) fn as_stated() -> Self {
        Self { factor: 1.0, released: Vec::new() }
    }
}

/// What counts as exactly known where it cannot be held: a tenth of a micrometre or microradian.
const EXACT: f64 = 1e-7;
/// By how much more a released part may change: metres and turns, and no bound in practice.
const RELEASED: f64 = 1e3;

impl ChainPrior {
    /// Of a chain as it is written, of whose parameters `written_dependence` tells what is redundant.
    pub(super) fn new(
        written: &Chain<f64>,
        written_dependence: &Dependence,
        tolerances: &Tolerances,
        limits: &[JointLimits],
    ) -> Self {
        let frames = CanonicalFrames::new(written);
        let chain = frames.chain();
        let parts = parts(chain, tolerances);
        let own = (chain != written).then(|| Dependence::new(chain, limits));
        let dependence = own.as_ref().unwrap_or(written_dependence);
        let (jacobian, of_written) = (&dependence.jacobian, &written_dependence.jacobian);
        let independent = dependence.independent(&[], &[]);
        let redundant: Vec<usize> = (0..chain.parameter_count()).filter(|index| !independent.contains(index)).collect();
        let qr = jacobian.select_columns(&independent).qr();
        let in_terms = |columns: &DMatrix<f64>| {
            let by = qr.r().solve_upper_triangular(&(qr.q().transpose() * columns));
            by.unwrap_or_else(|| DMatrix::zeros(independent.len(), columns.ncols()))
        };
        let exchange = in_terms(&jacobian.select_columns(&redundant));
        let independent_by_written = in_terms(of_written);
        Self { parts, independent, redundant, exchange, independent_by_written }
    }

    /// Number of parameters, 8·J + 6.
    pub(super) fn parameters(&self) -> usize {
        self.independent.len() + self.redundant.len()
    }

    /// The parameters of a part.
    pub(super) fn indices(&self, part: Part) -> Range<usize> {
        self.parts.iter().find(|own| own.part == part).map_or(0..0, |own| own.indices.clone())
    }

    /// Whether a part that was released is where a robot's may be.
    pub(super) fn is_conceivable(&self, share: &Share) -> bool {
        let is_inside = self.parts.iter().any(|own| own.part == share.part && own.is_inside);
        share.is_conceivable(is_inside)
    }

    /// Parameters that are known exactly.
    pub(super) fn exact(&self) -> impl Iterator<Item = usize> + '_ {
        self.parts.iter().filter(|part| part.tolerance == 0.0).flat_map(|part| part.indices.clone())
    }

    /// `Λ` of the parameters at the indices `free` as they are written, per SI unit squared.
    pub(super) fn precision(&self, free: &[usize], weighing: &Weighing) -> DMatrix<f64> {
        let (of_independent, _) = self.settled(weighing);
        let by_free = self.independent_by_written.select_columns(free);
        let mut precision = by_free.transpose() * of_independent * &by_free;
        if free.len() > self.independent.len() {
            // Redundant directions are free as well: something has to keep them from drifting along what curves in them.
            const PULL: f64 = 1e-3;
            for i in 0..free.len() {
                precision[(i, i)] *= 1.0 + PULL;
            }
        }
        (&precision + precision.transpose()) / 2.0
    }

    /// How a change of the parameters at `free` is shared among all parts, redundant ones included, in the likeliest way; in units of their
    /// tolerances as these are stated.
    pub(super) fn shares(&self, free: &[usize], change: &[f64], weighing: &Weighing) -> Vec<Share> {
        let (_, settle) = self.settled(weighing);
        let of_independent = self.independent_by_written.select_columns(free) * DVector::from_column_slice(change);
        let redundant = settle * &of_independent;
        let independent = of_independent - &self.exchange * &redundant;
        let mut all = DVector::zeros(self.parameters());
        self.independent.iter().zip(independent.iter()).for_each(|(&index, &by)| all[index] = by);
        self.redundant.iter().zip(redundant.iter()).for_each(|(&index, &by)| all[index] = by);
        let share = |part: &PartTolerance| {
            let own = all.rows(part.indices.start, part.indices.len());
            let size = (own.transpose() * &part.metric * own)[(0, 0)].sqrt();
            let sign = if part.indices.len() == 1 { own[0].signum() } else { 1.0 };
            Share { part: part.part, change: sign * size, tolerance: part.tolerance }
        };
        self.parts.iter().map(share).collect()
    }

    /// `Λ` of the independent parameters when the redundant ones are where they cost least, and `∂redundant/∂independent` there.
    fn settled(&self, weighing: &Weighing) -> (DMatrix<f64>, DMatrix<f64>) {
        let all = self.of_all(weighing);
        let blocks = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |row, column| all[(rows[row], columns[column])])
        };
        let own = blocks(&self.independent, &self.independent);
        // A redundant parameter that moves by r takes −C r of the independent ones along, so that nothing that is measured changes.
        let mixed = blocks(&self.redundant, &self.independent) - self.exchange.transpose() * &own;
        let mut among = blocks(&self.redundant, &self.redundant);
        let crossed = blocks(&self.redundant, &self.independent) * &self.exchange;
        among += self.exchange.transpose() * &own * &self.exchange - &crossed - crossed.transpose();
        // Two angles about one axis share a direction that costs nothing: any share of it will do.
        let least = 1e-12 * among.diagonal().amax();
        for i in 0..among.nrows() {
            among[(i, i)] += least;
        }
        match among.cholesky() {
            Some(among) => {
                let settle = -among.solve(&mixed);
                (&own + mixed.transpose() * &settle, settle)
            }
            None => (own.clone(), DMatrix::zeros(self.redundant.len(), self.independent.len())),
        }
    }

    /// `Λ` of all canonical parameters.
    fn of_all(&self, weighing: &Weighing) -> DMatrix<f64> {
        let count = self.parameters();
        let mut all = DMatrix::zeros(count, count);
        for PartTolerance { part, indices, tolerance, is_inside, metric } in &self.parts {
            let factor = if *is_inside { weighing.factor } else { 1.0 };
            let released = if weighing.released.contains(part) { RELEASED } else { 1.0 };
            let tolerance = (tolerance * factor * released).max(EXACT);
            let shape = (indices.len(), indices.len());
            all.view_mut((indices.start, indices.start), shape).copy_from(&(metric / (tolerance * tolerance)));
        }
        all
    }
}

/// What of a change is one part's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Share {
    pub(super) part: Part,
    /// Its size, of a single number with its sign; SI.
    pub(super) change: f64,
    /// As it is stated, SI.
    pub(super) tolerance: f64,
}

impl Share {
    /// Whether a robot may be so far off: a lost zero by 60° or half a metre, what is inside the arm by twenty of its tolerances, what is at its
    /// ends, which are wide, by ten.
    pub(super) fn is_conceivable(&self, is_inside: bool) -> bool {
        match self.part {
            Part::Offset(_, JointKind::Revolute) => self.change.abs() < 60_f64.to_radians(),
            Part::Offset(_, JointKind::Prismatic) => self.change.abs() < 0.5,
            _ => self.tolerances() < if is_inside { 20.0 } else { 10.0 },
        }
    }

    /// Size in tolerances; what is known exactly has no part in it.
    pub(super) fn tolerances(&self) -> f64 {
        if self.tolerance > 0.0 { self.change.abs() / self.tolerance } else { 0.0 }
    }
}

fn parts(canonical: &Chain<f64>, tolerances: &Tolerances) -> Vec<PartTolerance> {
    let joints = canonical.joints();
    let mut parts = Vec::new();
    for (i, link) in tolerances.links.iter().enumerate() {
        let first = i * PARAMETERS_PER_JOINT;
        let is_inside = i > 0 && i < joints;
        let beta = canonical.parameters()[first + 4];
        parts.push(PartTolerance {
            part: Part::Displacement(i + 1),
            indices: first..first + 3,
            tolerance: link.displacement_m,
            is_inside,
            metric: DMatrix::identity(3, 3),
        });
        parts.push(PartTolerance {
            part: Part::Rotation(i + 1),
            indices: first + 3..first + 6,
            tolerance: link.rotation_rad,
            is_inside,
            metric: rotation_metric(beta),
        });
    }
    for (j, (joint, &kind)) in tolerances.joints.iter().zip(canonical.joint_kinds()).enumerate() {
        let first = j * PARAMETERS_PER_JOINT + 6;
        for (part, index, tolerance) in
            [(Part::Offset(j + 1, kind), first, joint.offset), (Part::Scale(j + 1), first + 1, joint.scale)]
        {
            let metric = DMatrix::identity(1, 1);
            parts.push(PartTolerance { part, indices: index..index + 1, tolerance, is_inside: true, metric });
        }
    }
    parts
}

/// Of changes of alpha, beta, gamma: the squared size of the rotation vector that they make. Its components are about z, y and the axis
/// that `Ry(beta)` makes of x.
fn rotation_metric(beta: f64) -> DMatrix<f64> {
    let shared = -beta.sin();
    DMatrix::from_row_slice(3, 3, &[1.0, 0.0, shared, 0.0, 1.0, 0.0, shared, 0.0, 1.0])
}
