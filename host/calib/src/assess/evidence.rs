//! What a fit is judged from: all that the other files here look at.

use crate::identify::Fit;
use crate::model::{Dataset, Rig, Robot};

/// What a fit is judged from.
#[derive(Clone, Copy, Debug)]
pub struct Evidence<'a> {
    /// The robot that the fit began with: its design, as a rule.
    pub robot: &'a Robot,
    /// Chucks and spheres.
    pub rig: &'a Rig,
    /// The poses that were fitted.
    pub dataset: &'a Dataset,
    /// The fit to them.
    pub fit: &'a Fit,
    /// Poses that the fit has not seen, and what to call them; none is empty.
    pub unseen: &'a [(String, &'a Dataset)],
    /// The largest RMS residual that is believed, metres, in place of the usual one ([`super::RmsLimit`]).
    pub max_rms_m: Option<f64>,
}

impl<'a> Evidence<'a> {
    /// A fit and what it was made from; [`fit`](crate::identify::fit()) has to have made it of just these. What it has not seen is set in
    /// [`Evidence::unseen`].
    pub fn new(robot: &'a Robot, rig: &'a Rig, dataset: &'a Dataset, fit: &'a Fit) -> Self {
        Self { robot, rig, dataset, fit, unseen: &[], max_rms_m: None }
    }
}
