//! Robust losses as a transformation of residuals, so that the cost stays a sum of squares.

use crate::study::Loss;
use statrs::statistics::{Data, OrderStatistics};

/// Residuals beyond so many standard deviations count linearly; 95 % efficient for normal noise (Huber-1964).
const HUBER_LIMIT: f64 = 1.345;
/// Degrees of freedom of the Student loss.
const STUDENT_FREEDOM: f64 = 4.0;
/// Standard deviation over median of the absolute value, for normal noise.
const MEDIAN_FACTOR: f64 = 1.482_602_218_505_602;

/// `s(r)` with `s^2 = 2 rho(r)` and the sign of r, and ds/dr; r in standard deviations of the noise.
pub fn transformed(loss: Loss, r: f64) -> (f64, f64) {
    match loss {
        Loss::Squares => (r, 1.0),
        Loss::Huber if r.abs() <= HUBER_LIMIT => (r, 1.0),
        Loss::Huber => {
            let value = (HUBER_LIMIT * (2.0 * r.abs() - HUBER_LIMIT)).sqrt();
            (value.copysign(r), HUBER_LIMIT / value)
        }
        Loss::Student => {
            let share = r * r / STUDENT_FREEDOM;
            let value = ((STUDENT_FREEDOM + 1.0) * share.ln_1p()).sqrt();
            let influence = (STUDENT_FREEDOM + 1.0) / STUDENT_FREEDOM * r / (1.0 + share);
            // Near zero both go to zero together; their ratio is the slope there.
            let at_zero = ((STUDENT_FREEDOM + 1.0) / STUDENT_FREEDOM).sqrt();
            (value.copysign(r), if value > 1e-8 { influence.abs() / value } else { at_zero })
        }
    }
}

/// The residual of which [`transformed`] makes `s`.
pub fn original(loss: Loss, s: f64) -> f64 {
    match loss {
        Loss::Squares => s,
        Loss::Huber if s.abs() <= HUBER_LIMIT => s,
        Loss::Huber => (0.5 * (s * s / HUBER_LIMIT + HUBER_LIMIT)).copysign(s),
        Loss::Student => (STUDENT_FREEDOM * (s * s / (STUDENT_FREEDOM + 1.0)).exp_m1()).sqrt().copysign(s),
    }
}

/// Standard deviation of residuals of which some are outliers, from the median of their absolute values (of the
/// residuals before the transformation).
pub fn robust_deviation(residuals: impl Iterator<Item = f64>) -> f64 {
    let sizes: Vec<f64> = residuals.map(f64::abs).collect();
    if sizes.is_empty() { 0.0 } else { MEDIAN_FACTOR * Data::new(sizes).median() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transformations_are_smooth_and_invertible() {
        for loss in [Loss::Squares, Loss::Huber, Loss::Student] {
            for r in [-30.0, -1.4, -1.3, -0.2, 1e-9, 0.7, 1.344, 1.346, 5.0, 200.0] {
                let (value, slope) = transformed(loss, r);
                let h = 1e-6 * (1.0 + f64::abs(r));
                let difference = (transformed(loss, r + h).0 - transformed(loss, r - h).0) / (2.0 * h);
                assert!((slope - difference).abs() < 1e-5, "{loss:?} {r}: {slope} {difference}");
                assert!((original(loss, value) - r).abs() < 1e-9 * (1.0 + r.abs()), "{loss:?} {r}");
            }
        }
    }
}
