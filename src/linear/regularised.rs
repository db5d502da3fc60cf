//! Smooth solutions of ill-posed least-squares problems.

use nalgebra::{DMatrix, DVector};

/// Regularisation strengths tried, relative to the ratio of the traces, from weak to strong.
const STRENGTHS: [f64; 13] = [1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1, 1.0, 10.0];

/// Minimises `|target - columns x|^2 + lambda |D x|^2` with second differences D and lambda by generalised
/// cross-validation (Golub-Heath-Wahba-1979). `columns` is rows x count column-major; `independent` is the number of
/// independent rows (coloured residuals have fewer than `rows`).
///
/// Returns the solution and the share of the target's sum of squares that it explains; `None` for non-finite input.
pub fn smooth_least_squares(columns: &[f64], rows: usize, target: &[f64], independent: f64) -> Option<(Vec<f64>, f64)> {
    if rows == 0 || columns.iter().chain(target).any(|value| !value.is_finite()) {
        return None;
    }
    let count = columns.len() / rows;
    let matrix = DMatrix::from_column_slice(rows, count, columns);
    let vector = DVector::from_column_slice(target);
    let normal = matrix.tr_mul(&matrix);
    let right = matrix.tr_mul(&vector);
    let roughness = second_differences(count);
    let scale = normal.trace() / roughness.trace().max(f64::MIN_POSITIVE);
    let total = vector.norm_squared();
    let mut best: Option<(f64, Vec<f64>, f64)> = None;
    for strength in STRENGTHS {
        let Some(factor) = (&normal + &roughness * (strength * scale)).cholesky() else {
            continue;
        };
        let solution = factor.solve(&right);
        let rest = total - 2.0 * solution.dot(&right) + solution.dot(&(&normal * &solution));
        let freedom = factor.solve(&normal).trace();
        if freedom >= 0.9 * independent {
            continue;
        }
        let score = rest.max(0.0) / (1.0 - freedom / independent).powi(2);
        if best.as_ref().is_none_or(|(previous, _, _)| score < *previous) {
            best = Some((score, solution.iter().copied().collect(), 1.0 - rest / total.max(f64::MIN_POSITIVE)));
        }
    }
    best.map(|(_, solution, share)| (solution, share.clamp(0.0, 1.0)))
}

/// `D^T D` of second differences, with a whisper of the identity so that straight lines do not make it singular.
fn second_differences(count: usize) -> DMatrix<f64> {
    let mut product = DMatrix::identity(count, count) * 1e-6;
    for row in 0..count.saturating_sub(2) {
        let stencil = [1.0, -2.0, 1.0];
        for (i, a) in stencil.iter().enumerate() {
            for (j, b) in stencil.iter().enumerate() {
                product[(row + i, row + j)] += a * b;
            }
        }
    }
    product
}

#[cfg(test)]
mod tests {
    use super::smooth_least_squares;

    #[test]
    fn a_smooth_signal_is_found_through_an_integrating_operator_with_noise() {
        // y = cumulative sum of f plus a small deterministic disturbance; f is smooth.
        let count = 60;
        let truth: Vec<f64> = (0..count).map(|i| (i as f64 * 0.2).sin()).collect();
        let mut columns = vec![0.0; count * count];
        for j in 0..count {
            for i in j..count {
                columns[j * count + i] = 1.0;
            }
        }
        let target: Vec<f64> =
            (0..count).map(|i| truth[..=i].iter().sum::<f64>() + 0.05 * ((i * 7919 % 13) as f64 / 6.0 - 1.0)).collect();
        let (solution, share) = smooth_least_squares(&columns, count, &target, count as f64).expect("finite");
        let error: f64 = solution.iter().zip(&truth).map(|(s, t)| (s - t).powi(2)).sum::<f64>() / count as f64;
        assert!(error.sqrt() < 0.15, "{error}");
        assert!(share > 0.99, "{share}");
    }
}
