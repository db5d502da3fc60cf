//! p-values and quantiles.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};

/// Probability that a chi-square variable exceeds `statistic`; degrees of freedom 0: the variable is zero.
pub fn chi_square_p(statistic: f64, degrees_of_freedom: usize) -> f64 {
    if statistic.is_nan() {
        return f64::NAN;
    }
    if degrees_of_freedom == 0 {
        return f64::from(statistic <= 0.0);
    }
    ChiSquared::new(degrees_of_freedom as f64).map_or(f64::NAN, |distribution| distribution.sf(statistic.max(0.0)))
}

/// p-value of a score or likelihood ratio whose `one_sided` of the `degrees_of_freedom` strengths are restricted to one
/// sign (0 or 1 of them): half the mass lies one degree of freedom lower (Self-Liang-1987).
pub fn mixture_p(statistic: f64, degrees_of_freedom: usize, one_sided: bool) -> f64 {
    let full = chi_square_p(statistic, degrees_of_freedom);
    if !one_sided || degrees_of_freedom == 0 {
        return full;
    }
    0.5 * full + 0.5 * chi_square_p(statistic, degrees_of_freedom - 1)
}

/// F test of a cost reduction by `added` parameters with `remaining` degrees of freedom left in the extended model.
pub fn f_test_p(base_cost: f64, extended_cost: f64, added: usize, remaining: f64) -> f64 {
    let statistic = (base_cost - extended_cost) / added as f64 / (extended_cost / remaining);
    if statistic.is_nan() {
        return f64::NAN;
    }
    FisherSnedecor::new(added as f64, remaining).map_or(f64::NAN, |distribution| distribution.sf(statistic.max(0.0)))
}

/// Likelihood-ratio test with unknown variance: `effective_count * ln(base_cost / extended_cost)` is chi-square with
/// `added` degrees of freedom (Wilks-1938).
pub fn likelihood_ratio_p(base_cost: f64, extended_cost: f64, effective_count: f64, added: usize) -> f64 {
    chi_square_p(effective_count * (base_cost / extended_cost).ln(), added)
}

/// Beyond so many degrees of freedom the expansion below is good to twelve digits, and the library's inversion of the
/// incomplete beta function no longer is.
const MANY_DEGREES_OF_FREEDOM: f64 = 1000.0;

/// Quantile of Student's distribution; of the normal one for infinite (or no positive) degrees of freedom.
pub fn student_quantile(probability: f64, degrees_of_freedom: f64) -> f64 {
    if !(degrees_of_freedom.is_finite() && degrees_of_freedom > 0.0) {
        return normal_quantile(probability);
    }
    if degrees_of_freedom > MANY_DEGREES_OF_FREEDOM {
        return expanded_student_quantile(normal_quantile(probability), degrees_of_freedom);
    }
    StudentsT::new(0.0, 1.0, degrees_of_freedom).map_or(f64::NAN, |distribution| distribution.inverse_cdf(probability))
}

/// Probability that a standard normal variable is below `value`.
pub fn normal_probability(value: f64) -> f64 {
    Normal::new(0.0, 1.0).map_or(f64::NAN, |distribution| distribution.cdf(value))
}

pub fn normal_quantile(probability: f64) -> f64 {
    Normal::new(0.0, 1.0).map_or(f64::NAN, |distribution| distribution.inverse_cdf(probability))
}

/// Student's quantile from the normal one (Abramowitz-Stegun-1964, 26.7.5).
fn expanded_student_quantile(z: f64, degrees_of_freedom: f64) -> f64 {
    let square = z * z;
    let first = z * (square + 1.0) / 4.0;
    let second = z * (3.0 + square * (16.0 + square * 5.0)) / 96.0;
    let third = z * (-15.0 + square * (17.0 + square * (19.0 + square * 3.0))) / 384.0;
    z + (first + (second + third / degrees_of_freedom) / degrees_of_freedom) / degrees_of_freedom
}
