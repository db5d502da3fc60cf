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
        let ladder = burg_ladder(samples, order.min(samples.len() / 2));
        Self::from_ladder(ladder)
    }

    /// Order 0 ..= `largest_order` with the smallest BIC.
    pub fn choose(samples: &[f64], largest_order: usize) -> Self {
        let count = samples.len() as f64;
        let mut ladder = burg_ladder(samples, largest_order.min(samples.len() / 4));
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

    fn from_ladder(ladder: Vec<(Vec<f64>, f64)>) -> Self {
        let (coefficients, variance) = ladder.last().cloned().unwrap_or((Vec::new(), 1.0));
        let relative = |own: f64| if variance > 0.0 { own / variance } else { 1.0 };
        let predictors = ladder.into_iter().map(|(predictor, own)| (predictor, relative(own))).collect();
        Self { coefficients, variance, predictors }
    }

    pub fn order(&self) -> usize {
        self.coefficients.len()
    }

    /// Replaces a column by its prediction errors: the noise of this model becomes white with [`AutoRegression::variance`],
    /// from the first sample on (lower orders predict the first samples). Linear: apply it to gradient columns too.
    pub fn whiten(&self, column: &mut [f64]) {
        for t in (0..column.len()).rev() {
            let (predictor, relative_variance) = &self.predictors[t.min(self.order())];
            let prediction: f64 = predictor.iter().enumerate().map(|(k, a)| a * column[t - 1 - k]).sum();
            column[t] = (column[t] - prediction) / relative_variance.sqrt();
        }
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

/// Predictors of the orders 0 ..= `order` with their error variances. Stops early where the signal is predicted
/// perfectly.
fn burg_ladder(samples: &[f64], order: usize) -> Vec<(Vec<f64>, f64)> {
    let count = samples.len();
    let power = samples.iter().map(|value| value * value).sum::<f64>() / count.max(1) as f64;
    let mut ladder = vec![(Vec::new(), power)];
    let (mut forward, mut backward) = (samples.to_vec(), samples.to_vec());
    for m in 1..=order {
        let (mut product, mut energy) = (0.0, 0.0);
        for t in m..count {
            product += forward[t] * backward[t - 1];
            energy += forward[t] * forward[t] + backward[t - 1] * backward[t - 1];
        }
        let (previous, variance) = ladder[m - 1].clone();
        if energy <= 0.0 || variance <= 0.0 {
            break;
        }
        let reflection = 2.0 * product / energy;
        for t in (m..count).rev() {
            let (f, b) = (forward[t], backward[t - 1]);
            forward[t] = f - reflection * b;
            backward[t] = b - reflection * f;
        }
        let mut coefficients: Vec<f64> = (0..m - 1).map(|k| previous[k] - reflection * previous[m - 2 - k]).collect();
        coefficients.push(reflection);
        ladder.push((coefficients, variance * (1.0 - reflection * reflection)));
    }
    ladder
}
