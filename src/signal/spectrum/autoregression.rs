//! Autoregressive models of coloured residuals, and whitening with them.

/// `x_t = sum_k a_k x_{t-k} + e_t` with white `e` of the given variance; stationary by construction.
#[derive(Clone, Debug, PartialEq)]
pub struct AutoRegression {
    /// a_1 ..= a_p.
    pub coefficients: Vec<f64>,
    /// Variance of e.
    pub variance: f64,
    /// Predictors of the orders 0 ..= p and their error variances relative to the last, for the first samples.
    predictors: Vec<(Vec<f64>, f64)>,
}

impl AutoRegression {
    /// White noise of variance one: whitening does nothing.
    pub fn white() -> Self {
        Self { coefficients: Vec::new(), variance: 1.0, predictors: vec![(Vec::new(), 1.0)] }
    }

    /// Fit of a given order (cut to N/2) by Burg's method (Burg-1975), to the samples as they are: take a mean out
    /// before if it is not part of the signal.
    pub fn burg(samples: &[f64], order: usize) -> Self {
        let ladder = burg_ladder(&[samples], order.min(samples.len() / 2));
        Self::from_ladder(ladder)
    }

    /// Order 0 ..= `largest_order` with the smallest BIC.
    pub fn choose(samples: &[f64], largest_order: usize) -> Self {
        Self::choose_over(&[samples], samples.len(), largest_order)
    }

    /// As [`AutoRegression::choose`] from several stretches of one process, together worth `independent` samples.
    pub fn choose_over(stretches: &[&[f64]], independent: usize, largest_order: usize) -> Self {
        let count = independent as f64;
        let mut ladder = burg_ladder(stretches, largest_order.min(independent / 4));
        let criterion = |order: usize, variance: f64| count * variance.ln() + order as f64 * count.ln();
        let best = ladder
            .iter()
            .enumerate()
            .filter(|(_, (_, variance))| *variance > 0.0)
            .min_by(|(i, a), (j, b)| criterion(*i, a.1).total_cmp(&criterion(*j, b.1)))
            .map_or(0, |(order, _)| order);
        ladder.truncate(best + 1);
        Self::from_ladder(ladder)
    }

    /// The predictor of a process with this autocovariance (lags 0 ..= order), by Levinson's recursion; a lower order
    /// where the process is predicted perfectly.
    pub fn from_autocovariance(autocovariance: &[f64]) -> Self {
        let mut ladder = vec![(Vec::new(), autocovariance.first().copied().unwrap_or(1.0))];
        for m in 1..autocovariance.len() {
            let (previous, variance): (Vec<f64>, f64) = ladder[m - 1].clone();
            let predicted: f64 = previous.iter().enumerate().map(|(k, a)| a * autocovariance[m - 1 - k]).sum();
            let reflection = (autocovariance[m] - predicted) / variance;
            if !(variance > 0.0 && reflection.abs() < 1.0) {
                break;
            }
            let mut coefficients: Vec<f64> =
                (0..m - 1).map(|k| previous[k] - reflection * previous[m - 2 - k]).collect();
            coefficients.push(reflection);
            ladder.push((coefficients, variance * (1.0 - reflection * reflection)));
        }
        Self::from_ladder(ladder)
    }

    /// Variance of the process.
    pub fn power(&self) -> f64 {
        let impulse: Vec<f64> = self.colour(&[1.0]);
        impulse.iter().map(|value| value * value).sum()
    }

    fn from_ladder(ladder: Vec<(Vec<f64>, f64)>) -> Self {
        let (coefficients, variance) = ladder.last().cloned().unwrap_or((Vec::new(), 1.0));
        let relative = |own: f64| if variance > 0.0 { own / variance } else { 1.0 };
        let predictors = ladder.into_iter().map(|(predictor, own)| (predictor, relative(own))).collect();
        Self { coefficients, variance, predictors }
    }

    pub fn order(&self) -> usize {
        self.coefficients.len()
    }

    /// Replaces a column by its prediction errors: the noise of this model becomes white with
    /// [`AutoRegression::variance`], from the first sample on (lower orders predict the first samples). Linear: apply
    /// it to gradient columns too.
    pub fn whiten(&self, column: &mut [f64]) {
        for t in (0..column.len()).rev() {
            let (predictor, relative_variance) = &self.predictors[t.min(self.order())];
            let prediction: f64 = predictor.iter().enumerate().map(|(k, a)| a * column[t - 1 - k]).sum();
            column[t] = (column[t] - prediction) / relative_variance.sqrt();
        }
    }

    /// The column shaped by the model, backward in time and with the decaying rest before its first sample, such that
    /// scalar products of shaped columns are `x^T R y` with R the covariance matrix of the process.
    pub fn colour(&self, column: &[f64]) -> Vec<f64> {
        let deviation = self.variance.max(0.0).sqrt();
        if self.coefficients.is_empty() {
            return column.iter().map(|value| deviation * value).collect();
        }
        let mut shaped: Vec<f64> = Vec::with_capacity(2 * column.len());
        let mut largest = 0.0_f64;
        let rest = (REST * column.len()).max(SHORTEST_REST);
        for t in 0..column.len() + rest {
            let input = column.len().checked_sub(t + 1).map_or(0.0, |index| deviation * column[index]);
            let memory: f64 = self.coefficients.iter().enumerate().take(t).map(|(k, a)| a * shaped[t - 1 - k]).sum();
            shaped.push(input + memory);
            largest = largest.max(shaped[t].abs());
            let settled = |values: &[f64]| values.iter().all(|value| value.abs() <= SETTLED * largest);
            if t >= column.len() + self.order() && settled(&shaped[t - self.order()..]) {
                break;
            }
        }
        shaped
    }

    /// Power spectral density (one-sided, per Hz) at a frequency.
    pub fn density(&self, frequency: f64, sampling_rate: f64) -> f64 {
        let angle = std::f64::consts::TAU * frequency / sampling_rate;
        let (mut real, mut imaginary) = (1.0, 0.0);
        for (k, a) in self.coefficients.iter().enumerate() {
            let (sine, cosine) = (angle * (k + 1) as f64).sin_cos();
            real -= a * cosine;
            imaginary += a * sine;
        }
        2.0 * self.variance / sampling_rate / (real * real + imaginary * imaginary)
    }
}

/// The rest of a shaped column ends where it has decayed to this share.
const SETTLED: f64 = 1e-7;
/// or after so many lengths of the column.
const REST: usize = 4;
/// but not before so many samples.
const SHORTEST_REST: usize = 2000;

/// Predictors of the orders 0 ..= `order` with their error variances. Stops early where the signal is predicted
/// perfectly.
fn burg_ladder(stretches: &[&[f64]], order: usize) -> Vec<(Vec<f64>, f64)> {
    let count: usize = stretches.iter().map(|samples| samples.len()).sum();
    let power = stretches.iter().flat_map(|samples| samples.iter()).map(|value| value * value).sum::<f64>();
    let mut ladder = vec![(Vec::new(), power / count.max(1) as f64)];
    let mut errors: Vec<(Vec<f64>, Vec<f64>)> =
        stretches.iter().map(|samples| (samples.to_vec(), samples.to_vec())).collect();
    for m in 1..=order {
        let (mut product, mut energy) = (0.0, 0.0);
        for (forward, backward) in &errors {
            for t in m..forward.len() {
                product += forward[t] * backward[t - 1];
                energy += forward[t] * forward[t] + backward[t - 1] * backward[t - 1];
            }
        }
        let (previous, variance) = ladder[m - 1].clone();
        if energy <= 0.0 || variance <= 0.0 {
            break;
        }
        let reflection = 2.0 * product / energy;
        for (forward, backward) in &mut errors {
            for t in (m..forward.len()).rev() {
                let (f, b) = (forward[t], backward[t - 1]);
                forward[t] = f - reflection * b;
                backward[t] = b - reflection * f;
            }
        }
        let mut coefficients: Vec<f64> = (0..m - 1).map(|k| previous[k] - reflection * previous[m - 2 - k]).collect();
        coefficients.push(reflection);
        ladder.push((coefficients, variance * (1.0 - reflection * reflection)));
    }
    ladder
}
