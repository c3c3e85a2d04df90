//! The chain once more, in the most naive way: 4×4 products of complex numbers, so that complex steps give derivatives that
//! are exact to rounding. It shares nothing with what it checks but the definition.

use ballbar::{Chain, JointKind, PARAMETERS_PER_JOINT, Pairing};
use nalgebra::{Matrix4, Vector4};
use num_complex::Complex;

type C = Complex<f64>;
type M = Matrix4<C>;

fn rotation(axis: usize, angle: C) -> M {
    let (s, c) = (angle.sin(), angle.cos());
    let (i, j) = [(1, 2), (2, 0), (0, 1)][axis];
    let mut m = M::identity();
    m[(i, i)] = c;
    m[(j, j)] = c;
    m[(i, j)] = -s;
    m[(j, i)] = s;
    m
}

fn translation(x: C, y: C, z: C) -> M {
    let mut m = M::identity();
    m[(0, 3)] = x;
    m[(1, 3)] = y;
    m[(2, 3)] = z;
    m
}

/// `T = L1 J1 … L(J+1)` for complex parameters.
pub fn base_from_tool(kinds: &[JointKind], parameters: &[C], q: &[f64]) -> M {
    let zero = C::new(0.0, 0.0);
    let mut t = M::identity();
    for (i, p) in parameters.chunks(PARAMETERS_PER_JOINT).enumerate() {
        t = t * translation(p[0], p[1], p[2]) * rotation(2, p[3]) * rotation(1, p[4]) * rotation(0, p[5]);
        if let Some(kind) = kinds.get(i) {
            let theta = p[6] + p[7] * q[i];
            t *= match kind {
                JointKind::Revolute => rotation(2, theta),
                JointKind::Prismatic => translation(zero, zero, theta),
            };
        }
    }
    t
}

fn length(kinds: &[JointKind], parameters: &[C], q: &[f64], pairing: &Pairing<f64>) -> C {
    let s = pairing.sphere_tool_m;
    let point = base_from_tool(kinds, parameters, q) * Vector4::new(s.x.into(), s.y.into(), s.z.into(), C::new(1.0, 0.0));
    let squares = (0..3).map(|axis| point[axis] - pairing.chuck_base_m[axis]).map(|d| d * d);
    squares.sum::<C>().sqrt()
}

/// Length and gradient by complex steps, metres and SI units.
pub fn length_and_gradient(chain: &Chain<f64>, q: &[f64], pairing: &Pairing<f64>) -> (f64, Vec<f64>) {
    const STEP: f64 = 1e-100;
    let kinds = chain.joint_kinds();
    let real: Vec<C> = chain.parameters().iter().map(|&p| p.into()).collect();
    let gradient = (0..real.len()).map(|i| {
        let mut stepped = real.clone();
        stepped[i].im = STEP;
        length(kinds, &stepped, q, pairing).im / STEP
    });
    (length(kinds, &real, q, pairing).re, gradient.collect())
}
