//! The numbers that everything else is generic over.

use nalgebra::{ComplexField, Field, RealField, Scalar};

use crate::trig::sin_cos_f32;

/// What the kinematics computes with: a field with a sine, a cosine and a square root. Nothing here orders or compares, so that several
/// poses may stand side by side in one value, or a complex step in its imaginary part.
pub trait Number: Scalar + Field + Copy {
    /// Sine and cosine of an angle in radians.
    fn sine_cosine(self) -> (Self, Self);

    /// The square root.
    fn square_root(self) -> Self;

    /// One over this value, and zero over zero: what a direction is scaled by that is none where it has no length.
    fn inverse(self) -> Self;

    /// The nearest value of this type.
    fn nearest(value: f64) -> Self;
}

/// `f32` on the board, `f64` on the host: a [`Number`] that compares, with a sine and cosine whose cost is known.
///
/// Results are the same to the bit on every target: both implementations are made of IEEE additions and multiplications
/// without contraction, whatever `libm` the platform has.
pub trait Real: Number + RealField {
    /// Difference between 1 and the next larger number.
    const EPSILON: Self;

    /// This value, exactly.
    fn widen(self) -> f64;
}

impl Number for f32 {
    fn sine_cosine(self) -> (Self, Self) {
        sin_cos_f32(self)
    }

    fn square_root(self) -> Self {
        ComplexField::sqrt(self)
    }

    fn inverse(self) -> Self {
        if self > 0.0 { 1.0 / self } else { 0.0 }
    }

    fn nearest(value: f64) -> Self {
        value as f32
    }
}

impl Real for f32 {
    const EPSILON: Self = f32::EPSILON;

    fn widen(self) -> f64 {
        f64::from(self)
    }
}

impl Number for f64 {
    fn sine_cosine(self) -> (Self, Self) {
        libm::sincos(self)
    }

    fn square_root(self) -> Self {
        ComplexField::sqrt(self)
    }

    fn inverse(self) -> Self {
        if self > 0.0 { 1.0 / self } else { 0.0 }
    }

    fn nearest(value: f64) -> Self {
        value
    }
}

impl Real for f64 {
    const EPSILON: Self = f64::EPSILON;

    fn widen(self) -> f64 {
        self
    }
}
