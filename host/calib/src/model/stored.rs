//! What is read of stored robots, rigs and datasets, before it is found to be one.

use ballbar::{Chain, JointTerms};
use serde::Deserialize;
use thiserror::Error;

use super::{
    Bar, Calibration, Dataset, EncoderFacts, JointLimits, NamedPoint, PoseRow, Rig, RigError, Robot, RobotError, Solids,
    Tolerances,
};

#[derive(Deserialize)]
pub(super) struct RobotParts {
    name: String,
    source: String,
    chain: Chain<f64>,
    #[serde(default = "JointTerms::none")]
    terms: JointTerms<f64>,
    tolerances: Option<Tolerances>,
    limits: Vec<JointLimits>,
    encoders: Vec<EncoderFacts>,
    calibration: Option<Calibration>,
}

impl TryFrom<RobotParts> for Robot {
    type Error = RobotError;

    fn try_from(parts: RobotParts) -> Result<Self, RobotError> {
        let RobotParts { name, source, chain, terms, tolerances, limits, encoders, calibration } = parts;
        let tolerances = tolerances.unwrap_or_else(|| Tolerances::usual(chain.joint_kinds()));
        Self { name, source, chain, terms, tolerances, limits, encoders, calibration }.checked()
    }
}

#[derive(Deserialize)]
pub(super) struct RigParts {
    chucks: Vec<NamedPoint>,
    spheres: Vec<NamedPoint>,
    bar: Option<Bar>,
    solids: Solids,
}

impl TryFrom<RigParts> for Rig {
    type Error = RigError;

    fn try_from(parts: RigParts) -> Result<Self, RigError> {
        let RigParts { chucks, spheres, bar, solids } = parts;
        Self { chucks, spheres, bar, solids }.checked()
    }
}

#[derive(Deserialize)]
pub(super) struct DatasetParts {
    rows: Vec<PoseRow>,
    files: Vec<String>,
}

impl TryFrom<DatasetParts> for Dataset {
    type Error = NoSuchFile;

    fn try_from(parts: DatasetParts) -> Result<Self, NoSuchFile> {
        let DatasetParts { rows, files } = parts;
        match rows.iter().find(|row| row.file >= files.len()) {
            Some(row) => Err(NoSuchFile { number: row.number, file: row.file }),
            None => Ok(Self { rows, files }),
        }
    }
}

/// A row of a stored dataset is from a file that the dataset does not name.
#[derive(Debug, Error)]
#[error("row {number} is of file {file} (from 0), which the dataset does not name")]
pub(super) struct NoSuchFile {
    number: usize,
    file: usize,
}
