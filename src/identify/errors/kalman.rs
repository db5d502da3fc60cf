//! The extended Kalman filter along one record: innovations, gains, transitions.

use crate::simulation::{Compiled, Record, State, Stretches};

/// Levels of noise, SI.
#[derive(Clone, Debug, PartialEq)]
pub struct NoiseLevels {
    /// Per state: root of the spectral density of the white noise on its rate, (state unit)/s * sqrt(s).
    pub process: Vec<f64>,
    /// Per measure of the study: standard deviation of its samples' noise.
    pub measured: Vec<f64>,
}

/// What the filter does at one compared sample, frozen.
#[derive(Clone, Debug)]
pub struct Gain {
    /// n x m column-major (m compared measures).
    pub gain: Vec<f64>,
    /// Inverse of the lower Cholesky factor of the innovation's covariance, m x m column-major.
    pub whitening: Vec<f64>,
    /// ln det of that covariance.
    pub log_determinant: f64,
}

/// A pass of the filter along one record, linearised along its own estimates.
#[derive(Clone, Debug, Default)]
pub struct Pass {
    pub gains: Vec<Gain>,
    /// Innovations, per sample m values.
    pub innovations: Vec<Vec<f64>>,
    /// dh/dy per sample, m x n.
    pub by_state: Vec<Vec<f64>>,
    /// From each compared sample (after its update) to the next.
    pub transitions: Vec<Vec<f64>>,
    /// Estimates after the update, per compared sample.
    pub estimates: Vec<Vec<f64>>,
}

/// Runs the filter with the given noise; the covariance of the start is zero: experiments say how they start.
///
/// # Errors
/// What ended a simulation, in words.
pub fn pass(compiled: &Compiled, record: &Record, theta: &[f64], noise: &NoiseLevels) -> Result<Pass, String> {
    let mut stretches = Stretches::new(compiled, record, theta);
    let mut state = stretches.start()?;
    state.sensitivity = vec![0.0; state.y.len() * theta.len()];
    let step = record.sample_step();
    let n = state.y.len();
    let mut covariance = vec![0.0; n * n];
    if record.first > 0 {
        let lead = stretches.advance(&state, 0, record.first, true)?;
        for transition in &lead.transitions {
            // Transitions of a longer stretch refer to its first state: one step of the noise is enough of an estimate
            // here.
            covariance = predicted(&vec![0.0; n * n], transition, &noise.process, step * record.first as f64);
        }
        state.y.clone_from(&lead.states[record.first - 1].y);
    }
    let mut pass = Pass::default();
    for k in 0..record.sample_count() {
        let at = record.first + k;
        let observation = stretches.observe(&state.y, at, true);
        let innovation: Vec<f64> =
            record.measured.iter().zip(&observation.values).map(|(channel, value)| channel[k] - value).collect();
        let levels: Vec<f64> = record.measures.iter().map(|&measure| noise.measured[measure]).collect();
        let gain = gain(&mut covariance, &observation.by_state, &levels)?;
        add_product(&mut state.y, &gain.gain, &innovation);
        pass.estimates.push(state.y.clone());
        pass.gains.push(gain);
        pass.innovations.push(innovation);
        pass.by_state.push(observation.by_state);
        if k + 1 < record.sample_count() {
            let stretch = stretches.advance(&state, at, at + 1, true)?;
            let transition = &stretch.transitions[0];
            covariance = predicted(&covariance, transition, &noise.process, step);
            state = State { y: stretch.states[0].y.clone(), sensitivity: state.sensitivity };
            pass.transitions.push(transition.clone());
        }
    }
    Ok(pass)
}

/// Gain of one sample; the covariance becomes that after the update (Joseph's form).
pub(super) fn gain(covariance: &mut Vec<f64>, by_state: &[f64], levels: &[f64]) -> Result<Gain, String> {
    let m = levels.len();
    let n = by_state.len() / m.max(1);
    // P H^T, n x m; S = H P H^T + R, m x m.
    let mut cross = vec![0.0; n * m];
    for c in 0..m {
        for i in 0..n {
            cross[c * n + i] = (0..n).map(|j| covariance[j * n + i] * by_state[j * m + c]).sum();
        }
    }
    let mut innovation = vec![0.0; m * m];
    for c in 0..m {
        for r in 0..m {
            innovation[c * m + r] = (0..n).map(|j| by_state[j * m + r] * cross[c * n + j]).sum();
        }
        innovation[c * m + c] += levels[c] * levels[c];
    }
    let (whitening, log_determinant) =
        whitening(m, &innovation).ok_or("the state estimator's covariance lost its definiteness")?;
    // K = P H^T S^-1, S^-1 = W^T W.
    let inverse = |r: usize, c: usize| (0..m).map(|k| whitening[r * m + k] * whitening[c * m + k]).sum::<f64>();
    let mut gain = vec![0.0; n * m];
    for c in 0..m {
        for i in 0..n {
            gain[c * n + i] = (0..m).map(|r| cross[r * n + i] * inverse(r, c)).sum();
        }
    }
    // (I - K H)
    let rest: Vec<f64> = (0..n * n)
        .map(|at| {
            let (i, j) = (at % n, at / n);
            let own = if i == j { 1.0 } else { 0.0 };
            own - (0..m).map(|c| gain[c * n + i] * by_state[j * m + c]).sum::<f64>()
        })
        .collect();
    let mut updated = sandwich(&rest, covariance, n);
    for j in 0..n {
        for i in 0..n {
            updated[j * n + i] +=
                (0..m).map(|c| gain[c * n + i] * levels[c] * levels[c] * gain[c * n + j]).sum::<f64>();
        }
    }
    *covariance = updated;
    Ok(Gain { gain, whitening, log_determinant })
}

/// `Phi P Phi^T` and the process noise of one step by the trapezoidal rule.
pub(super) fn predicted(covariance: &[f64], transition: &[f64], process: &[f64], step: f64) -> Vec<f64> {
    let n = process.len();
    let mut sum = covariance.to_vec();
    (0..n).for_each(|i| sum[i * n + i] += 0.5 * step * process[i] * process[i]);
    let mut next = sandwich(transition, &sum, n);
    (0..n).for_each(|i| next[i * n + i] += 0.5 * step * process[i] * process[i]);
    next
}

/// `A P A^T`, symmetric.
fn sandwich(a: &[f64], p: &[f64], n: usize) -> Vec<f64> {
    let mut half = vec![0.0; n * n];
    for j in 0..n {
        for k in 0..n {
            let factor = p[j * n + k];
            if factor != 0.0 {
                (0..n).for_each(|i| half[j * n + i] += a[k * n + i] * factor);
            }
        }
    }
    let mut full = vec![0.0; n * n];
    for j in 0..n {
        for i in 0..=j {
            let value: f64 = (0..n).map(|k| half[k * n + i] * a[k * n + j]).sum();
            full[j * n + i] = value;
            full[i * n + j] = value;
        }
    }
    full
}

/// `target += A x`, A with as many rows as the target.
pub(super) fn add_product(target: &mut [f64], a: &[f64], x: &[f64]) {
    let rows = target.len();
    for (column, factor) in a.chunks_exact(rows.max(1)).zip(x) {
        target.iter_mut().zip(column).for_each(|(value, entry)| *value += entry * factor);
    }
}

/// Inverse of the lower Cholesky factor (column-major) and the logarithm of the determinant; `None` unless positive
/// definite.
fn whitening(m: usize, matrix: &[f64]) -> Option<(Vec<f64>, f64)> {
    let mut lower = vec![0.0_f64; m * m];
    let mut log_determinant = 0.0;
    for j in 0..m {
        let pivot = matrix[j * m + j] - (0..j).map(|k| lower[k * m + j].powi(2)).sum::<f64>();
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        let root = pivot.sqrt();
        log_determinant += pivot.ln();
        lower[j * m + j] = root;
        for i in j + 1..m {
            let rest = matrix[j * m + i] - (0..j).map(|k| lower[k * m + i] * lower[k * m + j]).sum::<f64>();
            lower[j * m + i] = rest / root;
        }
    }
    let mut inverse = vec![0.0; m * m];
    for c in 0..m {
        for r in c..m {
            let unit = if r == c { 1.0 } else { 0.0 };
            let sum: f64 = (c..r).map(|k| lower[k * m + r] * inverse[c * m + k]).sum();
            inverse[c * m + r] = (unit - sum) / lower[r * m + r];
        }
    }
    Some((inverse, log_determinant))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_whitening_matrix_inverts_the_covariance() {
        let matrix = [4.0, 1.0, -0.5, 1.0, 3.0, 0.2, -0.5, 0.2, 2.0];
        let (w, log_determinant) = whitening(3, &matrix).expect("positive definite");
        let inverse = |r: usize, c: usize| (0..3).map(|k| w[r * 3 + k] * w[c * 3 + k]).sum::<f64>();
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| matrix[k * 3 + i] * inverse(k, j)).sum();
                assert!((product - if i == j { 1.0 } else { 0.0 }).abs() < 1e-12);
            }
        }
        // det by Sarrus' rule.
        assert!((log_determinant - (24.0 - 0.1 - 0.1 - 0.75 - 0.16 - 2.0_f64).ln()).abs() < 1e-12);
        assert!(whitening(2, &[1.0, 2.0, 2.0, 1.0]).is_none());
    }

    /// A scalar random walk x' = w observed with noise: the stationary variance after the update solves
    /// P^2 + Q P - Q R = 0.
    #[test]
    fn the_stationary_gain_of_a_random_walk() {
        let (q, r) = (0.3_f64, 2.0_f64);
        let mut covariance = vec![0.0];
        for _ in 0..200 {
            covariance = predicted(&covariance, &[1.0], &[q.sqrt()], 1.0);
            gain(&mut covariance, &[1.0], &[r.sqrt()]).expect("a gain");
        }
        let expected = 0.5 * (-q + (q * q + 4.0 * q * r).sqrt());
        assert!((covariance[0] - expected).abs() < 1e-12, "{} {expected}", covariance[0]);
    }
}
