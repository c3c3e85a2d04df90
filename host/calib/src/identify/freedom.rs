//! Which unknowns of a fit are free, and why the others are not.

use super::beliefs::Beliefs;
use super::hold::{Held, Hold};
use super::identifiability::Identifiability;
use super::noise::believed_sigma_m;
use super::observation::Observation;
use super::options::{FitOptions, PriorRule};
use super::prior::{ChainPrior, Part};
use super::reference::Dependence;
use crate::model::{Dataset, PoseRow, Robot};
use crate::unknowns::Unknowns;

/// What decides it, found out once for each fit.
pub(super) struct Freedom<'a> {
    hold: &'a Hold,
    /// Parameters of the chain.
    parameters: usize,
    /// Indices of what is held by name.
    named: Vec<usize>,
    dependence: Dependence,
    /// What the poses can tell, judged at the design values.
    pub(super) identifiability: Identifiability,
    /// What tolerances say; `None` where they are not asked.
    pub(super) prior: Option<ChainPrior>,
    /// Deviation of a length of weight one to begin with, metres.
    pub(super) usual_m: f64,
}

impl<'a> Freedom<'a> {
    pub(super) fn new(unknowns: &Unknowns, robot: &Robot, dataset: &Dataset, options: &'a FitOptions) -> Self {
        let design = unknowns.of_chain().design();
        let hold = &options.hold;
        let named: Vec<usize> = hold.names.iter().map(|name| name.index()).collect();
        let rows: Vec<&PoseRow> = dataset.rows.iter().collect();
        let dependence = Dependence::new(design, &robot.limits);
        let told = |sigma_m: f64| what_poses_tell(unknowns, &rows, &dependence, sigma_m, &named);
        let usual_m = usual_sigma_m(dataset, unknowns, |sigma_m| told(sigma_m).noise_m);
        let identifiability = told(usual_m);
        let prior = (options.prior == PriorRule::Tolerances)
            .then(|| ChainPrior::new(design, &dependence, &robot.tolerances, &robot.limits));
        Self { hold, parameters: unknowns.of_chain().len(), named, dependence, identifiability, prior, usual_m }
    }

    /// Indices of the free unknowns, ascending; of parameters that could stand for one another those at `first`.
    pub(super) fn free(&self, first: &[usize]) -> Vec<usize> {
        let reasons = self.reasons(first);
        (0..reasons.len()).filter(|&index| reasons[index].is_none()).collect()
    }

    /// Why each unknown is held; `None` for the free ones.
    pub(super) fn reasons(&self, first: &[usize]) -> Vec<Option<Held>> {
        match &self.prior {
            None => self.hold.reasons(self.parameters, &self.dependence.independent(&[], &[]), &self.identifiability),
            Some(prior) => {
                let exact: Vec<usize> = prior.exact().collect();
                let apart: Vec<usize> = self.named.iter().chain(&exact).copied().collect();
                let independent = self.dependence.independent(first, &apart);
                self.hold.reasons_beside_prior(self.parameters, &independent, &exact, &self.identifiability)
            }
        }
    }

    /// The parameters of some parts.
    pub(super) fn indices(&self, parts: &[Part]) -> Vec<usize> {
        self.prior.iter().flat_map(|prior| parts.iter().flat_map(|part| prior.indices(*part))).collect()
    }
}

/// What the poses can tell at the design, around the parameters at the indices `held`.
pub(super) fn what_poses_tell(
    unknowns: &Unknowns,
    rows: &[&PoseRow],
    dependence: &Dependence,
    sigma_m: f64,
    held: &[usize],
) -> Identifiability {
    let believed: Vec<usize> = (0..unknowns.list().len()).filter(|&index| unknowns.list()[index].tolerance.is_some()).collect();
    let beliefs = Beliefs::without_chain(unknowns, believed);
    let observation = Observation::of(unknowns, &unknowns.start(), rows, Some((&beliefs, sigma_m)));
    Identifiability::of(unknowns.of_chain(), unknowns.list(), &observation, dependence, held)
}

/// What a length of weight one deviates by, metres: as it is stated, or else as the lengths show it. Without meaning, and not looked for,
/// where nothing is weighed against it.
fn usual_sigma_m(dataset: &Dataset, unknowns: &Unknowns, shown_m: impl Fn(f64) -> f64) -> f64 {
    /// Each beside the one before; more change nothing that could be seen.
    const ROUNDS: usize = 2;
    if dataset.stated_sigma_m().is_some() || !unknowns.have_priors() {
        return believed_sigma_m(dataset);
    }
    (0..ROUNDS).fold(believed_sigma_m(dataset), |sigma_m, _| shown_m(sigma_m).max(f64::MIN_POSITIVE))
}
