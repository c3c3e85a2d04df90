//! The scalar that everything else is generic over.

use nalgebra::RealField;

use crate::trig::sin_cos_f32;

/// `f32` on the board, `f64` on the host: the field operations of [`RealField`], and a sine and cosine whose cost is known.
///
/// Results are the same to the bit on every target: both implementations are made of IEEE additions and multiplications
/// without contraction, whatever `libm` the platform has.
pub trait Real: RealField + Copy {
    /// Difference between 1 and the next larger number.
    const EPSILON: Self;

    /// Sine and cosine of an angle in radians.
    fn sine_cosine(self) -> (Self, Self);

    /// The nearest value of this type.
    fn nearest(value: f64) -> Self;

    /// This value, exactly.
    fn widen(self) -> f64;
}

impl Real for f32 {
    const EPSILON: Self = f32::EPSILON;

    fn sine_cosine(self) -> (Self, Self) {
        sin_cos_f32(self)
    }

    fn nearest(value: f64) -> Self {
        value as f32
    }

    fn widen(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    const EPSILON: Self = f64::EPSILON;

    fn sine_cosine(self) -> (Self, Self) {
        libm::sincos(self)
    }

    fn nearest(value: f64) -> Self {
        value
    }

    fn widen(self) -> f64 {
        self
    }
}
