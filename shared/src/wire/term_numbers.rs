//! Joint terms as they travel and as they stand in flash: a row of numbers, which costs the board least to read and write.
//!
//! Of J joints 10·J + 7, or none where the terms add nothing:
//!
//! | numbers | |
//! | --- | --- |
//! | J times 6 | coefficients of `sin q`, `cos q`, `sin 2q`, `cos 2q`, of the load, of the direction of approach; rad or m, per Nm or N |
//! | J times 4 | mass, kg, and centre of mass, m, of links 2 to J + 1, each in the frame that moves with the joint before it |
//! | 4 | mass and centre of the payload, in the tool frame |
//! | 3 | acceleration of free fall in the base frame, m/s² |

use heapless::Vec;

use crate::{Body, JointTerms, MAX_JOINTS, Real, TERMS_PER_JOINT, Vector3};

/// The most numbers that terms have.
pub const MAX_TERM_NUMBERS: usize = (TERMS_PER_JOINT + 4) * MAX_JOINTS + 7;

/// The terms of a chain of so many joints, rounded.
pub fn term_numbers<S: Real>(terms: &JointTerms<S>, joints: usize) -> Vec<f32, MAX_TERM_NUMBERS> {
    let terms: JointTerms<f32> = terms.cast();
    if terms.are_zero() {
        return Vec::new();
    }
    let masses = &terms.masses;
    let coefficients = (0..joints).flat_map(|joint| terms.of_joint(joint));
    let bodies = masses.links.iter().take(joints).chain([&masses.payload]);
    let bodies = bodies.flat_map(|body| [body.mass_kg, body.center_m.x, body.center_m.y, body.center_m.z]);
    coefficients.chain(bodies).chain(masses.gravity_base_m_s2.iter().copied()).take(MAX_TERM_NUMBERS).collect()
}

/// The terms of so many joints; none where the numbers are more or fewer.
pub(super) fn terms_of(numbers: &[f32], joints: usize) -> Option<JointTerms<f32>> {
    let mut terms = JointTerms::none();
    if numbers.is_empty() {
        return Some(terms);
    }
    if numbers.len() != (TERMS_PER_JOINT + 4) * joints + 7 || joints > MAX_JOINTS {
        return None;
    }
    let (coefficients, rest) = numbers.split_at(TERMS_PER_JOINT * joints);
    let (bodies, gravity) = rest.split_at(4 * (joints + 1));
    for (term, value) in terms.coefficients.as_flattened_mut().iter_mut().zip(coefficients) {
        *term = *value;
    }
    for (i, body) in bodies.chunks(4).enumerate() {
        let body = Body { mass_kg: body[0], center_m: Vector3::new(body[1], body[2], body[3]) };
        match terms.masses.links.get_mut(i).filter(|_| i < joints) {
            Some(link) => *link = body,
            None => terms.masses.payload = body,
        }
    }
    terms.masses.gravity_base_m_s2 = Vector3::new(gravity[0], gravity[1], gravity[2]);
    Some(terms)
}
