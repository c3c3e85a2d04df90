//! The LVDT: from converter codes to the bar's displacement.

use core::fmt;

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::Real;

/// One oversampled code of the LVDT.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct LvdtReading {
    /// 16 bits, mid travel near the middle.
    pub code: u16,
    /// The converter stood at an end of its range, or gave nothing: the code means nothing.
    pub saturated: bool,
}

/// Coefficients of the curve: up to the fifth power.
pub const LVDT_COEFFICIENTS: usize = 6;

/// Displacement from the bar's mid travel as a polynomial of the code: `Σ c_k u^k` metres, `u = (code − 32,768) / 32,768`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct LvdtCurve {
    /// Lowest code inside the travel.
    pub code_min: u16,
    /// Highest code inside the travel.
    pub code_max: u16,
    /// `c_0` to `c_5`, metres.
    pub coefficients_m: [f32; LVDT_COEFFICIENTS],
}

/// Why a reading gives no displacement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum LvdtFault {
    /// The converter stood at an end of its range.
    Saturated,
    /// Below the lowest code inside the travel: the bar is pushed in too far, or nothing is connected.
    BelowTravel,
    /// Above the highest code inside the travel: the bar is drawn out too far, or has come off.
    BeyondTravel,
}

impl fmt::Display for LvdtFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Saturated => "the LVDT's signal is at the end of the converter's range",
            Self::BelowTravel => "the LVDT is below its travel",
            Self::BeyondTravel => "the LVDT is beyond its travel",
        })
    }
}

/// No LVDT of a bar is longer than two metres.
const MAX_DISPLACEMENT_M: f32 = 1.0;
/// Nor is one shorter than a code of the longest.
const MIN_TRAVEL_M: f32 = 1e-6;
/// Steps in which a curve is looked at.
const VALID_STEPS: u8 = 16;

impl LvdtCurve {
    /// What a curve that is not valid lacks, in words.
    pub const VALID: &str =
        "the LVDT's curve must have a range of codes, rise or fall throughout it, and stay within a metre of mid travel";

    /// Whether the curve is one of an LVDT: over a range of codes that is not empty the displacement rises throughout, or falls
    /// throughout, by a micrometre at least, and stays within a metre of mid travel. Looked at in 16 steps.
    pub fn is_valid(&self) -> bool {
        if self.code_min >= self.code_max || !self.coefficients_m.iter().all(|c| c.is_finite()) {
            return false;
        }
        let (first, last) = (f32::from(self.code_min), f32::from(self.code_max));
        let at = |step: u8| {
            let code = first + (last - first) * f32::from(step) / f32::from(VALID_STEPS);
            self.displacement_of_code_m(code).unwrap_or(f32::NAN)
        };
        let travel_m = at(VALID_STEPS) - at(0);
        let is_steady = |step: u8| (at(step + 1) - at(step)) * travel_m >= 0.0 && at(step).abs() <= MAX_DISPLACEMENT_M;
        travel_m.abs() >= MIN_TRAVEL_M && at(VALID_STEPS).abs() <= MAX_DISPLACEMENT_M && (0..VALID_STEPS).all(is_steady)
    }

    /// Displacement from mid travel, metres, of one reading.
    ///
    /// # Errors
    /// [`LvdtFault`] when the reading is not one of the bar inside its travel.
    pub fn displacement_m<S: Real>(&self, reading: LvdtReading) -> Result<S, LvdtFault> {
        if reading.saturated {
            return Err(LvdtFault::Saturated);
        }
        self.displacement_of_code_m(S::nearest(f64::from(reading.code)))
    }

    /// Displacement from mid travel, metres, of a code that may be a mean.
    ///
    /// # Errors
    /// As [`LvdtCurve::displacement_m`].
    pub fn displacement_of_code_m<S: Real>(&self, code: S) -> Result<S, LvdtFault> {
        if code < S::nearest(f64::from(self.code_min)) {
            return Err(LvdtFault::BelowTravel);
        }
        if code > S::nearest(f64::from(self.code_max)) {
            return Err(LvdtFault::BeyondTravel);
        }
        let u = Self::normalised(code);
        let horner = |sum: S, &c: &f32| sum * u + S::nearest(f64::from(c));
        Ok(self.coefficients_m.iter().rev().fold(S::zero(), horner))
    }

    /// `u` of the polynomial: −1 to 1 over the codes.
    pub fn normalised<S: Real>(code: S) -> S {
        (code - S::nearest(32_768.0)) / S::nearest(32_768.0)
    }

    /// Displacements at the lowest and the highest code inside the travel, metres.
    pub fn travel_m<S: Real>(&self) -> (S, S) {
        let at = |code: u16| self.displacement_of_code_m(S::nearest(f64::from(code))).unwrap_or(S::zero());
        let (a, b) = (at(self.code_min), at(self.code_max));
        if a < b { (a, b) } else { (b, a) }
    }
}
