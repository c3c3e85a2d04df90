//! Pairings on the command line.

use ballbar_calib::model::{NamedPoint, PairingId, Rig};
use miette::Diagnostic;
use thiserror::Error;

/// Why a list of pairings cannot be used.
#[derive(Debug, Error, Diagnostic)]
pub(super) enum PairingError {
    /// A pairing that is not `chuck:sphere` of this rig.
    #[error("`{0}` is no pairing of this rig, expected chuck:sphere as in A:1,B:2")]
    #[diagnostic(help("The rig has chucks {1} and spheres {2}."))]
    Unknown(String, String, String),
    /// The same pairing twice.
    #[error("pairing `{0}` stands there twice")]
    Repeated(String),
}

/// Reads `A:1,B:2`.
pub(super) fn parse_pairings(text: &str, rig: &Rig) -> Result<Vec<PairingId>, PairingError> {
    let mut pairings = Vec::new();
    for word in text.split(',').map(str::trim) {
        let ends = word.split_once(':').and_then(|(chuck, sphere)| Some((rig.chuck(chuck)?, rig.sphere(sphere)?)));
        let Some((chuck, sphere)) = ends else {
            let names = |points: &[NamedPoint]| points.iter().map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(PairingError::Unknown(word.to_owned(), names(&rig.chucks), names(&rig.spheres)));
        };
        let pairing = PairingId { chuck, sphere };
        if pairings.contains(&pairing) {
            return Err(PairingError::Repeated(word.to_owned()));
        }
        pairings.push(pairing);
    }
    Ok(pairings)
}
