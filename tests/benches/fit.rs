//! Solving 810 poses: ours, over incremental normal equations, beside the `levenberg-marquardt` crate, which factors the
//! Jacobian itself. Both get the same analytic rows, the same start and the same data, and their minima are compared first.
//!
//! Run with `cargo bench -p ballbar-tests`. Quote ratios: times depend on the machine and what else it does.

use ballbar::{
    Chain, FreeParameters, Kinematics, LANES, LengthRows, MAX_PARAMETERS, Measurement, NormalEquations, Parameter, Quantity,
};
use ballbar_calib::identify::{Identifiability, LmOptions, solve_lengths};
use ballbar_tests::experiment::Puma;
use criterion::{Criterion, criterion_group, criterion_main};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra_of_peer::{DMatrix, DVector, Dyn, Owned};

/// The same problem in the peer's terms.
#[derive(Clone)]
struct PeerProblem<'a> {
    chain: Chain<f64>,
    free: &'a FreeParameters,
    measurements: &'a [Measurement<f64>],
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for PeerProblem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, parameters: &DVector<f64>) {
        for (index, &value) in self.free.indices().zip(parameters.iter()) {
            self.chain.parameters_mut()[index] = value;
        }
    }

    fn params(&self) -> DVector<f64> {
        DVector::from_iterator(self.free.len(), self.free.indices().map(|index| self.chain.parameters()[index]))
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let kinematics = Kinematics::new(&self.chain);
        let residuals = self.measurements.iter().map(|measurement| -kinematics.residual(measurement));
        Some(DVector::from_iterator(self.measurements.len(), residuals))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let kinematics = Kinematics::new(&self.chain);
        let mut jacobian = DMatrix::zeros(self.measurements.len(), self.free.len());
        let mut row = [0.0; MAX_PARAMETERS];
        for (i, measurement) in self.measurements.iter().enumerate() {
            kinematics.gradient(Quantity::Length, &measurement.q, &measurement.pairing, &mut row);
            for (j, index) in self.free.indices().enumerate() {
                jacobian[(i, j)] = row[index];
            }
        }
        Some(jacobian)
    }
}

fn fits(criterion: &mut Criterion) {
    let puma = Puma::default();
    let chain = &puma.design.chain;
    let measurements = puma.shells(0.46, 90, 0.084e-3, 7).measurements();
    let as_in_paper = (0..54).filter(|&index| !chain.is_conventionally_held(Parameter::from_index(index)));
    let sets = [(36, FreeParameters::from_indices(as_in_paper).expect("ascending")), (54, FreeParameters::all(54))];

    let mut group = criterion.benchmark_group("fit of 810 poses");
    for (count, free) in &sets {
        let problem = PeerProblem { chain: chain.clone(), free, measurements: &measurements };
        let (peer, report) = LevenbergMarquardt::new().minimize(problem.clone());
        let ours = solve_lengths(chain, &measurements, free, &LmOptions::default());
        let rms = |chain: &Chain<f64>| {
            let kinematics = Kinematics::new(chain);
            measurements.iter().map(|m| kinematics.residual(m).powi(2)).sum::<f64>()
        };
        assert!(report.termination.was_successful(), "{:?}", report.termination);
        assert!((rms(&peer.chain) / rms(&ours.chain) - 1.0).abs() < 1e-6, "both at the minimum");

        group.bench_function(format!("host-cal, {count} free"), |bencher| {
            bencher.iter(|| solve_lengths(chain, &measurements, free, &LmOptions::default()));
        });
        group.bench_function(format!("levenberg-marquardt crate, {count} free"), |bencher| {
            bencher.iter(|| LevenbergMarquardt::new().minimize(problem.clone()));
        });
    }
    group.finish();

    let kinematics = Kinematics::new(chain);
    let mut rows = LengthRows::default();
    let mut group = criterion.benchmark_group("a block of eight poses");
    group.bench_function("rows", |bencher| bencher.iter(|| rows.compute(&kinematics, &measurements[..LANES])));
    for (count, free) in &sets {
        let mut memory = vec![0.0; NormalEquations::<f64>::memory(free.len())];
        let mut equations = NormalEquations::new(free.len(), &mut memory).expect("as long as was asked for");
        let columns: Vec<_> = free.indices().map(|index| *rows.chain(index)).collect();
        group.bench_function(format!("update of {count} columns"), |bencher| {
            bencher.iter(|| equations.add(&rows.over(&columns)));
        });
    }
    group.finish();
    criterion.bench_function("what 810 poses identify", |bencher| {
        bencher.iter(|| Identifiability::new(chain, &measurements, &puma.design.limits, &[]));
    });
}

criterion_group!(benches, fits);
criterion_main!(benches);
