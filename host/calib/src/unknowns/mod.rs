//! What is not known of an experiment, as a list that is put together at run time, block by block.
//!
//! ```text
//! PoseRow ─ correct (each block) ─▶ Measurement ─ LengthRows (the chain's sweep) ─▶ residual, forces
//!                                                                                    │ columns (each block)
//!                                                                                    ▼
//!                                                            Rows over the wanted unknowns ─▶ equations, observation
//! ```
//!
//! A block alone knows what its unknowns are called, what they are trusted to, how they change a measurement and what their columns are. To
//! add a kind: one file with a [`Block`], and its lines in `list.rs`.

mod bar;
mod chain;
mod drift;
mod list;
mod rig;
mod sets;
mod terms;

use ballbar::{Chain, JointTerms, Kinematics, LANES, Lanes, LengthRows, Measurement, ParameterUnit, Rows};

pub use bar::{BarZero, Gain, Latency, RodZeros};
pub use chain::{ChainBlock, plausible_error};
pub use drift::Drift;
pub use list::{AnyBlock, Kind, UnknownError};
pub use rig::RigBlock;
pub use sets::SetOffsets;
pub use terms::TermsBlock;

use crate::model::{PoseRow, Rig};

/// Something that a fit may find out.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Unknown {
    /// What people call it, such as `gamma7` or `chuck B x`.
    pub name: String,
    /// Unit of its values.
    pub unit: ParameterUnit,
    /// What it is believed to be, SI.
    pub start: f64,
    /// Standard deviation of that belief, SI, where it counts as a measurement; `None`: lengths alone decide.
    pub tolerance: Option<f64>,
    /// How far the belief may plausibly be off, SI: lengths that tell it no better than that are not asked.
    pub plausible: f64,
}

/// Unknowns of one kind. Values have one entry an unknown, in the order of [`Block::unknowns`], SI.
pub trait Block {
    /// The unknowns.
    fn unknowns(&self) -> Vec<Unknown>;

    /// What a measurement is at these values, for the chain to be compared with: between other ends, of another length.
    fn correct(&self, values: &[f64], row: &PoseRow, measurement: &mut Measurement<f64>);

    /// `∂computed/∂unknown` for a block of rows, metres per SI unit: one column an unknown, all zero to begin with, one lane a row.
    /// Columns are at `values`, and of measurements that are corrected already.
    fn columns(&self, values: &[f64], rows: &[&PoseRow], swept: &LengthRows<f64>, columns: &mut [Lanes<f64>]);

    /// What a rig is at these values, for those who keep it; most unknowns are not a rig's.
    fn correct_rig(&self, _values: &[f64], _rig: &mut Rig) {}

    /// What joint terms are at these values, for those who keep them; most unknowns are none.
    fn correct_terms(&self, _values: &[f64], _terms: &mut JointTerms<f64>) {}
}

/// All unknowns of a fit: those of a chain, and those of other blocks behind them.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Unknowns {
    chain: ChainBlock,
    others: Vec<AnyBlock>,
    /// How many unknowns each of the others has.
    sizes: Vec<usize>,
    list: Vec<Unknown>,
}

impl Unknowns {
    /// The parameters of a design whose joints have these terms, and the unknowns of other blocks.
    pub fn new(design: &Chain<f64>, terms: &JointTerms<f64>, others: Vec<AnyBlock>) -> Self {
        let chain = ChainBlock::new(design.clone(), *terms);
        let of_others: Vec<Vec<Unknown>> = others.iter().map(|block| block.as_block().unknowns()).collect();
        let sizes = of_others.iter().map(Vec::len).collect();
        let list = chain.unknowns().into_iter().chain(of_others.into_iter().flatten()).collect();
        Self { chain, others, sizes, list }
    }

    /// The same and the unknowns of more blocks, behind all others.
    #[must_use]
    pub fn with(&self, more: impl IntoIterator<Item = AnyBlock>) -> Self {
        let mut with = self.clone();
        for block in more {
            let of_block = block.as_block().unknowns();
            with.sizes.push(of_block.len());
            with.list.extend(of_block);
            with.others.push(block);
        }
        with
    }

    /// The kinds of the other blocks, in their order.
    pub fn kinds(&self) -> Vec<Kind> {
        self.others.iter().map(AnyBlock::kind).collect()
    }

    /// How many unknowns each of the other blocks has.
    pub(crate) fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// The unknowns, the chain's first, in parameter order.
    pub fn list(&self) -> &[Unknown] {
        &self.list
    }

    /// The chain's own.
    pub fn of_chain(&self) -> &ChainBlock {
        &self.chain
    }

    /// What they are believed to be, SI.
    pub fn start(&self) -> Vec<f64> {
        self.list.iter().map(|unknown| unknown.start).collect()
    }

    /// The chain at these values.
    pub fn chain(&self, values: &[f64]) -> Chain<f64> {
        self.chain.at(values)
    }

    /// What a row's measurement is at these values.
    pub fn corrected(&self, values: &[f64], row: &PoseRow) -> Measurement<f64> {
        let mut measurement = row.measurement;
        measurement.joint_terms = self.chain.displacements(row);
        for (block, own) in self.other_blocks(values) {
            block.correct(own, row, &mut measurement);
        }
        measurement
    }

    /// `1/tolerance²` of each unknown times the variance `sigma_m²` of a length of weight one, square metres; zero where lengths alone decide.
    pub fn precision(&self, sigma_m: f64) -> Vec<f64> {
        self.list.iter().map(|unknown| unknown.tolerance.map_or(0.0, |tolerance| (sigma_m / tolerance).powi(2))).collect()
    }

    /// The most that can be told apart, whatever is measured at the tool: `N` of the chain (eq. 1) and all others.
    pub fn independent(&self) -> usize {
        self.chain.design().independent_parameters() + self.list.len() - self.chain.len()
    }

    /// Whether something is believed of an unknown as firmly as if it had been measured.
    pub fn have_priors(&self) -> bool {
        self.list.iter().any(|unknown| unknown.tolerance.is_some())
    }

    /// Joint terms with what was found beside them at these values.
    pub fn terms(&self, values: &[f64], terms: &JointTerms<f64>) -> JointTerms<f64> {
        let mut found = *terms;
        self.other_blocks(values).for_each(|(block, own)| block.correct_terms(own, &mut found));
        found
    }

    /// The rig at these values.
    pub fn rig(&self, values: &[f64], rig: &Rig) -> Rig {
        let mut found = rig.clone();
        self.other_blocks(values).for_each(|(block, own)| block.correct_rig(own, &mut found));
        found
    }

    /// Hands all rows to `take`, block by block, with the columns of the wanted unknowns (indices into [`Unknowns::list`]) in their order.
    pub fn for_each_block(&self, values: &[f64], rows: &[&PoseRow], wanted: &[usize], mut take: impl FnMut(&Rows<'_, f64>)) {
        let kinematics = Kinematics::new(&self.chain(values));
        let mut swept = LengthRows::default();
        let mut of_others = vec![[0.0; LANES]; self.list.len() - self.chain.len()];
        let mut columns = vec![[0.0; LANES]; wanted.len()];
        let mut measurements = Vec::with_capacity(LANES);
        for block in rows.chunks(LANES) {
            measurements.clear();
            measurements.extend(block.iter().map(|row| self.corrected(values, row)));
            swept.compute(&kinematics, &measurements);
            self.columns_of_others(values, block, &swept, &mut of_others);
            for (column, &index) in columns.iter_mut().zip(wanted) {
                *column = index.checked_sub(self.chain.len()).map_or_else(|| *swept.chain(index), |other| of_others[other]);
            }
            take(&swept.over(&columns));
        }
    }

    fn columns_of_others(&self, values: &[f64], rows: &[&PoseRow], swept: &LengthRows<f64>, mut columns: &mut [Lanes<f64>]) {
        columns.fill([0.0; LANES]);
        for (block, own) in self.other_blocks(values) {
            let (of_block, rest) = columns.split_at_mut(own.len());
            block.columns(own, rows, swept, of_block);
            columns = rest;
        }
    }

    /// The other blocks, each with its own part of the values.
    fn other_blocks<'a>(&'a self, values: &'a [f64]) -> impl Iterator<Item = (&'a dyn Block, &'a [f64])> {
        let mut rest = &values[self.chain.len()..];
        self.others.iter().zip(&self.sizes).map(move |(block, &size)| {
            let (own, others) = rest.split_at(size);
            rest = others;
            (block.as_block(), own)
        })
    }
}
