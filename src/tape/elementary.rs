//! Elementary functions without branches, so that a loop over them becomes vector instructions; exact to about two
//! units in the last place, and the same digits whatever the width of the vectors. Products are added without being
//! rounded, on every processor.
//!
//! Reduction and series after Cody-Waite-1980; the series are those of Taylor, long enough for the reduced range.

use multiversion::multiversion;

/// Adding and subtracting it rounds to the nearest integer, which then stands in the low bits.
const ROUNDING: f64 = 6_755_399_441_055_744.0;

/// Up to this argument the parts of pi/2 are exact enough.
pub(super) const LARGEST_ANGLE: f64 = 1e6;

const HALF_PI: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];

/// ln 2 in a part whose low 32 bits are zero, and the rest.
const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];

/// Beyond, the exponential is infinite or zero.
const EXPONENT_RANGE: (f64, f64) = (-746.0, 710.0);

/// From here on the hyperbolic tangent rounds to one.
const TANH_SATURATION: f64 = 20.0;

const fn factorial(n: u32) -> f64 {
    let (mut product, mut k) = (1.0, 2);
    while k <= n {
        product *= k as f64;
        k += 1;
    }
    product
}

/// 1 / (first + step k)!, with alternating signs where asked for; the constant term comes last.
const fn series<const N: usize>(first: u32, step: u32, alternating: bool) -> [f64; N] {
    let mut coefficients = [0.0; N];
    let mut k = 0;
    while k < N {
        let sign = if alternating && k % 2 == 1 { -1.0 } else { 1.0 };
        coefficients[N - 1 - k] = sign / factorial(first + step * k as u32);
        k += 1;
    }
    coefficients
}

const SINE: [f64; 7] = series(3, 2, true);
const COSINE: [f64; 7] = series(4, 2, true);
/// Of (e^r - 1 - r) / r^2.
const EXPONENTIAL: [f64; 12] = series(2, 1, false);

/// With neighbours combined first, so that few operations wait for each other (Estrin-1960).
#[inline(always)]
fn polynomial<const N: usize>(coefficients: &[f64; N], x: f64) -> f64 {
    let mut sums = *coefficients;
    let (mut count, mut power) = (N, x);
    while count > 1 {
        // Pairs from the end of the low powers; an odd one out stays the highest.
        let odd = count % 2;
        for k in 0..count / 2 {
            sums[odd + k] = sums[odd + 2 * k].mul_add(power, sums[odd + 2 * k + 1]);
        }
        count = odd + count / 2;
        power *= power;
    }
    sums[0]
}

/// Sine and cosine of the angle less its nearest multiple of pi/2, and that multiple in the low bits.
#[inline(always)]
fn reduced(x: f64) -> (f64, f64, u64) {
    let shifted = x.mul_add(std::f64::consts::FRAC_2_PI, ROUNDING);
    let quarter = shifted - ROUNDING;
    let r = HALF_PI.iter().fold(x, |rest, part| (-quarter).mul_add(*part, rest));
    let square = r * r;
    let sine = (-(r * square)).mul_add(polynomial(&SINE, square), r);
    let cosine = 1.0 - 0.5_f64.mul_add(square, -(square * square * polynomial(&COSINE, square)));
    (sine, cosine, shifted.to_bits())
}

/// For |x| up to [`LARGEST_ANGLE`].
#[inline(always)]
pub(super) fn sin(x: f64) -> f64 {
    let (sine, cosine, quarter) = reduced(x);
    let value = if quarter & 1 == 0 { sine } else { cosine };
    f64::from_bits(value.to_bits() ^ ((quarter & 2) << 62))
}

/// For |x| up to [`LARGEST_ANGLE`].
#[inline(always)]
pub(super) fn cos(x: f64) -> f64 {
    let (sine, cosine, quarter) = reduced(x);
    let value = if quarter & 1 == 0 { cosine } else { sine };
    f64::from_bits(value.to_bits() ^ ((quarter.wrapping_add(1) & 2) << 62))
}

#[multiversion(targets("x86_64+avx2+fma"))]
pub(super) fn sin_of_any(x: f64) -> f64 {
    if x.abs() <= LARGEST_ANGLE { sin(x) } else { x.sin() }
}

#[multiversion(targets("x86_64+avx2+fma"))]
pub(super) fn cos_of_any(x: f64) -> f64 {
    if x.abs() <= LARGEST_ANGLE { cos(x) } else { x.cos() }
}

/// 2^k for an integer k that a double of normal range can hold, given as k + [`ROUNDING`].
#[inline(always)]
fn power_of_two(shifted: f64) -> f64 {
    f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52)
}

/// e^r - 1 for the rest r of `x` beyond k ln 2, and k + [`ROUNDING`].
#[inline(always)]
fn reduced_exponential(x: f64) -> (f64, f64) {
    let shifted = x.mul_add(std::f64::consts::LOG2_E, ROUNDING);
    let k = shifted - ROUNDING;
    let r = LN_2.iter().fold(x, |rest, part| (-k).mul_add(*part, rest));
    ((r * r).mul_add(polynomial(&EXPONENTIAL, r), r), shifted)
}

#[inline(always)]
pub(super) fn exp(x: f64) -> f64 {
    let (low, high) = EXPONENT_RANGE;
    let x = if x < low { low } else { x };
    let x = if x > high { high } else { x };
    let (rest, shifted) = reduced_exponential(x);
    // In two factors, so that results near overflow and underflow come out right.
    let k = shifted - ROUNDING;
    let half = 0.5_f64.mul_add(k, ROUNDING);
    let other = (k - (half - ROUNDING)) + ROUNDING;
    (1.0 + rest) * power_of_two(half) * power_of_two(other)
}

#[inline(always)]
pub(super) fn tanh(x: f64) -> f64 {
    let size = x.abs();
    let size = if size > TANH_SATURATION { TANH_SATURATION } else { size };
    let (rest, shifted) = reduced_exponential(2.0 * size);
    let power = power_of_two(shifted);
    // e^(2|x|) - 1, without cancellation near zero.
    let growth = power.mul_add(rest, power - 1.0);
    (growth / (growth + 2.0)).copysign(x)
}

/// [`exp`] as a call, with the instructions that the processor has.
#[multiversion(targets("x86_64+avx2+fma"))]
pub(super) fn exp_of_one(x: f64) -> f64 {
    exp(x)
}

/// [`tanh`] in the same way.
#[multiversion(targets("x86_64+avx2+fma"))]
pub(super) fn tanh_of_one(x: f64) -> f64 {
    tanh(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worst(own: fn(f64) -> f64, library: fn(f64) -> f64, low: f64, high: f64) -> f64 {
        let count = 200_001;
        let points = (0..count).map(|i| low + (high - low) * f64::from(i) / f64::from(count - 1));
        let error = |x: f64| {
            let (a, b) = (own(x), library(x));
            if a == b { 0.0 } else { (a - b).abs() / b.abs().max(f64::MIN_POSITIVE) / f64::EPSILON }
        };
        points.map(error).fold(0.0, f64::max)
    }

    #[test]
    fn functions_are_exact_to_two_units() {
        for (low, high) in [(-1e-3, 1e-3), (-1.0, 1.0), (-30.0, 30.0), (-700.0, 700.0)] {
            assert!(worst(exp, f64::exp, low, high) <= 2.0, "exp in {low} .. {high}");
            assert!(worst(tanh, f64::tanh, low, high) <= 3.0, "tanh in {low} .. {high}");
        }
        for (low, high) in [(-1e-3, 1e-3), (-0.8, 0.8), (-30.0, 30.0), (-1e4, 1e4), (9e5, LARGEST_ANGLE)] {
            assert!(worst(sin, f64::sin, low, high) <= 2.0, "sin in {low} .. {high}");
            assert!(worst(cos, f64::cos, low, high) <= 2.0, "cos in {low} .. {high}");
        }
    }

    #[test]
    fn ends_of_the_range_are_those_of_the_library() {
        for x in [0.0, -0.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 710.0, -745.0, 709.7, -708.0, -740.0, 1e-320] {
            for (own, library) in [(exp as fn(f64) -> f64, f64::exp as fn(f64) -> f64), (tanh, f64::tanh)] {
                let (a, b) = (own(x), library(x));
                let equal = a == b || (a.is_nan() && b.is_nan());
                assert!(equal || (a - b).abs() <= 4.0 * f64::EPSILON * b.abs() + 1e-323, "{x}: {a} and {b}");
                assert_eq!(a.is_sign_negative() && !a.is_nan(), b.is_sign_negative() && !b.is_nan(), "{x}");
            }
        }
        assert!(sin(f64::NAN).is_nan() && cos(f64::INFINITY).is_nan());
    }
}
