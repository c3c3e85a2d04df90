//! The chain once more, in the most naive way: 4×4 products of complex numbers, so that complex steps give derivatives that
//! are exact to rounding. It shares nothing with what it checks but the definition.

use ballbar::{Approach, Body, Chain, JointKind, JointTerms, PARAMETERS_PER_JOINT, Pairing, TermKind};
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
    base_from_tool_displaced(kinds, parameters, q, &vec![C::ZERO; kinds.len()])
}

/// The same with joints that stand so far beside `offset + scale · q`.
pub fn base_from_tool_displaced(kinds: &[JointKind], parameters: &[C], q: &[f64], displacements: &[C]) -> M {
    base_from_frames(kinds, parameters, q, displacements)[kinds.len()]
}

/// Base from the frame behind each joint, and from the tool.
fn base_from_frames(kinds: &[JointKind], parameters: &[C], q: &[f64], displacements: &[C]) -> Vec<M> {
    let mut t = M::identity();
    let mut frames = Vec::new();
    for (i, p) in parameters.chunks(PARAMETERS_PER_JOINT).enumerate() {
        t = t * translation(p[0], p[1], p[2]) * rotation(2, p[3]) * rotation(1, p[4]) * rotation(0, p[5]);
        if let Some(kind) = kinds.get(i) {
            let theta = p[6] + p[7] * q[i] + displacements[i];
            t *= match kind {
                JointKind::Revolute => rotation(2, theta),
                JointKind::Prismatic => translation(C::ZERO, C::ZERO, theta),
            };
        }
        frames.push(t);
    }
    frames
}

/// `V = −Σ m g·c`, joules, of all links but the first and of the payload.
fn potential_energy(chain: &Chain<f64>, q: &[f64], displacements: &[C], terms: &JointTerms<f64>) -> C {
    let parameters: Vec<C> = chain.parameters().iter().map(|&p| p.into()).collect();
    let frames = base_from_frames(chain.joint_kinds(), &parameters, q, displacements);
    let bodies = terms.masses.links[..q.len()].iter().chain([&terms.masses.payload]);
    let energy = |(frame, Body { mass_kg, center_m }): (&M, &Body<f64>)| {
        let center = frame * Vector4::new(center_m.x, center_m.y, center_m.z, 1.0).map(C::from);
        (0..3).map(|axis| -center[axis] * terms.masses.gravity_base_m_s2[axis] * *mass_kg).sum::<C>()
    };
    frames.iter().zip(bodies).map(energy).sum()
}

/// What gravity does to each joint of the rigid arm, Nm or N: `−∂V/∂θ` by complex steps.
pub fn gravity_loads(chain: &Chain<f64>, q: &[f64], terms: &JointTerms<f64>) -> Vec<f64> {
    let load = |i| {
        let mut displacements = vec![C::ZERO; q.len()];
        displacements[i] = C::new(0.0, STEP);
        -potential_energy(chain, q, &displacements, terms).im / STEP
    };
    (0..q.len()).map(load).collect()
}

/// `Σ_k a_k φ_k` of each joint by the definition, with `a` of one joint's term raised by an imaginary step.
pub fn displacements(
    terms: &JointTerms<f64>,
    q: &[f64],
    loads: &[f64],
    approach: Approach,
    stepped: Option<(usize, TermKind)>,
) -> Vec<C> {
    let of_joint = |(i, (&q, &load)): (usize, (&f64, &f64))| {
        let phi = |term| match term {
            TermKind::SinQ => q.sin(),
            TermKind::CosQ => q.cos(),
            TermKind::Sin2Q => (2.0 * q).sin(),
            TermKind::Cos2Q => (2.0 * q).cos(),
            TermKind::Compliance => load,
            TermKind::Backlash => match approach.direction(i) {
                Some(ballbar::Direction::Rising) => -1.0,
                Some(ballbar::Direction::Falling) => 1.0,
                None => 0.0,
            },
        };
        let a = |term| C::new(terms.coefficient(i, term), if stepped == Some((i, term)) { STEP } else { 0.0 });
        TermKind::ALL.into_iter().map(|term| a(term) * phi(term)).sum()
    };
    q.iter().zip(loads).enumerate().map(of_joint).collect()
}

/// Small enough that its square is nothing.
pub const STEP: f64 = 1e-100;

fn length(kinds: &[JointKind], parameters: &[C], q: &[f64], pairing: &Pairing<f64>) -> C {
    length_displaced(kinds, parameters, q, &vec![C::ZERO; kinds.len()], pairing)
}

/// Length of the bar of joints that stand so far beside `offset + scale · q`.
pub fn length_displaced(kinds: &[JointKind], parameters: &[C], q: &[f64], displacements: &[C], pairing: &Pairing<f64>) -> C {
    let s = pairing.sphere_tool_m;
    let base_from_tool = base_from_tool_displaced(kinds, parameters, q, displacements);
    let point = base_from_tool * Vector4::new(s.x, s.y, s.z, 1.0).map(C::from);
    let squares = (0..3).map(|axis| point[axis] - pairing.chuck_base_m[axis]).map(|d| d * d);
    squares.sum::<C>().sqrt()
}

/// Length and gradient by complex steps, metres and SI units.
pub fn length_and_gradient(chain: &Chain<f64>, q: &[f64], pairing: &Pairing<f64>) -> (f64, Vec<f64>) {
    let kinds = chain.joint_kinds();
    let real: Vec<C> = chain.parameters().iter().map(|&p| p.into()).collect();
    let gradient = (0..real.len()).map(|i| {
        let mut stepped = real.clone();
        stepped[i].im = STEP;
        length(kinds, &stepped, q, pairing).im / STEP
    });
    (length(kinds, &real, q, pairing).re, gradient.collect())
}
