//! The past of a BDF integration as scaled divided differences, and the coefficients that follow from it.
//!
//! Fixed-leading-coefficient form of the variable-step BDF (Brenan-Campbell-Petzold-1996, 5.2; names there in
//! brackets).

pub(super) const MAXIMUM_ORDER: usize = 5;
/// Differences kept: orders 0 to 5.
const KEPT: usize = MAXIMUM_ORDER + 1;

pub(super) struct History {
    pub time: f64,
    /// Order and length of the step being tried (k, h).
    pub order: usize,
    pub step: f64,
    /// Of the last accepted step; 0 at the start.
    pub last_order: usize,
    pub last_step: f64,
    /// `y' = predicted' + leading (y - predicted)` (minus alpha_s / h).
    pub leading: f64,
    /// The local error is at most this times the difference between solution and prediction.
    pub error_constant: f64,
    /// Factors from a difference to the local error of each order (sigma).
    pub sigma: [f64; KEPT],
    /// Steps taken with this order and length, with the present one (ns).
    pub equal_steps: usize,
    /// Modified divided differences (phi), each of the length of the solution; behind it, what follows it linearly.
    pub differences: [Vec<f64>; KEPT],
    /// `t_n - t_{n-i}` (psi), i = 1 ...
    spans: [f64; KEPT],
    alpha: [f64; KEPT],
    beta: [f64; KEPT],
    gamma: [f64; KEPT],
}

impl History {
    pub fn new(length: usize) -> Self {
        Self {
            time: 0.0,
            order: 1,
            step: 0.0,
            last_order: 0,
            last_step: 0.0,
            leading: 0.0,
            error_constant: 0.0,
            sigma: [0.0; KEPT],
            equal_steps: 0,
            differences: std::array::from_fn(|_| vec![0.0; length]),
            spans: [0.0; KEPT],
            alpha: [0.0; KEPT],
            beta: [0.0; KEPT],
            gamma: [0.0; KEPT],
        }
    }

    /// Starts at order 1 from values and derivatives.
    pub fn restart(&mut self, time: f64, z: &[f64], z_prime: &[f64], step: f64) {
        self.time = time;
        self.order = 1;
        self.step = step;
        self.last_order = 0;
        self.last_step = 0.0;
        self.equal_steps = 0;
        self.differences[0][..z.len()].copy_from_slice(z);
        for (difference, derivative) in self.differences[1].iter_mut().zip(z_prime) {
            *difference = step * derivative;
        }
        self.spans[0] = step;
    }

    /// No step has been accepted since the start.
    pub fn is_fresh(&self) -> bool {
        self.last_order == 0
    }

    /// Changes the length of the step to be tried.
    pub fn resize(&mut self, step: f64) {
        if self.is_fresh() && step != self.step {
            let ratio = step / self.step;
            self.differences[1].iter_mut().for_each(|d| *d *= ratio);
            self.spans[0] = step;
        }
        self.step = step;
    }

    /// Coefficients for the step being tried; scales the differences to it. Undone by [`History::withdraw`].
    pub fn begin(&mut self) {
        let (k, h) = (self.order, self.step);
        if h != self.last_step || k != self.last_order {
            self.equal_steps = 0;
        }
        self.equal_steps = (self.equal_steps + 1).min(self.last_order + 2);
        if k + 1 >= self.equal_steps {
            self.renew_coefficients();
        }
        let leading_sum: f64 = -(0..k).map(|i| 1.0 / (i + 1) as f64).sum::<f64>();
        let alpha_sum: f64 = -self.alpha[..k].iter().sum::<f64>();
        self.leading = -leading_sum / h;
        self.error_constant = (self.alpha[k] + leading_sum - alpha_sum).abs().max(self.alpha[k]);
        for i in self.equal_steps..=k {
            let factor = self.beta[i];
            self.differences[i].iter_mut().for_each(|d| *d *= factor);
        }
    }

    fn renew_coefficients(&mut self) {
        let h = self.step;
        self.beta[0] = 1.0;
        self.alpha[0] = 1.0;
        self.gamma[0] = 0.0;
        self.sigma[0] = 1.0;
        let mut span = h;
        for i in 1..=self.order {
            let old = self.spans[i - 1];
            self.spans[i - 1] = span;
            self.beta[i] = self.beta[i - 1] * span / old;
            span = old + h;
            self.alpha[i] = h / span;
            self.sigma[i] = i as f64 * self.sigma[i - 1] * self.alpha[i];
            self.gamma[i] = self.gamma[i - 1] + self.alpha[i - 1] / h;
        }
        self.spans[self.order] = span;
    }

    /// Takes back [`History::begin`] after a failed attempt.
    pub fn withdraw(&mut self) {
        for i in 1..=self.order {
            self.spans[i - 1] = self.spans[i] - self.step;
        }
        for i in self.equal_steps..=self.order {
            let factor = 1.0 / self.beta[i];
            self.differences[i].iter_mut().for_each(|d| *d *= factor);
        }
    }

    /// Value and derivative of the predictor polynomial at the end of the step.
    pub fn predict(&self, z: &mut [f64], z_prime: &mut [f64]) {
        z.copy_from_slice(&self.differences[0][..z.len()]);
        z_prime.fill(0.0);
        for i in 1..=self.order {
            let gamma = self.gamma[i];
            for ((z, z_prime), d) in z.iter_mut().zip(z_prime.iter_mut()).zip(&self.differences[i]) {
                *z += d;
                *z_prime += gamma * d;
            }
        }
    }

    /// Accepts the step; `correction` is the solution minus its prediction.
    pub fn accept(&mut self, end: f64, correction: &[f64]) {
        let k = self.order;
        self.time = end;
        self.last_order = k;
        self.last_step = self.step;
        if k < MAXIMUM_ORDER {
            self.differences[k + 1].copy_from_slice(correction);
        }
        for (d, c) in self.differences[k].iter_mut().zip(correction) {
            *d += c;
        }
        for j in (0..k).rev() {
            let (low, high) = self.differences.split_at_mut(j + 1);
            for (d, above) in low[j].iter_mut().zip(&high[0]) {
                *d += above;
            }
        }
    }

    /// The interpolating polynomial of the last step's order.
    pub fn interpolate(&self, t: f64, z: &mut [f64]) {
        let distance = t - self.time;
        let mut factor = 1.0;
        let mut ratio = distance / self.spans[0];
        z.copy_from_slice(&self.differences[0][..z.len()]);
        for j in 1..=self.last_order {
            factor *= ratio;
            ratio = (distance + self.spans[j - 1]) / self.spans[j];
            for (z, d) in z.iter_mut().zip(&self.differences[j]) {
                *z += factor * d;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of unequal length, mildly growing and shrinking.
    const STEPS: [f64; 8] = [0.1, 0.13, 0.12, 0.09, 0.11, 0.14, 0.1, 0.12];

    /// A history of order `order` that has followed the exact solution.
    fn following(order: usize, steps: &[f64], start: f64, exact: impl Fn(f64) -> f64, slope: f64) -> History {
        let mut history = History::new(1);
        history.restart(start, &[exact(start)], &[slope], steps[0]);
        for (k, &step) in steps.iter().enumerate() {
            history.order = order.min(k + 1);
            history.resize(step);
            history.begin();
            let (mut z, mut z_prime) = ([0.0], [0.0]);
            history.predict(&mut z, &mut z_prime);
            let end = history.time + step;
            history.accept(end, &[exact(end) - z[0]]);
        }
        history.order = order;
        history
    }

    /// Largest error of predictor, derivative formula and interpolation on `t^degree`.
    fn defect(order: usize, degree: i32) -> (f64, f64, f64) {
        let exact = |t: f64| t.powi(degree);
        let mut history = following(order, &STEPS, 0.3, exact, degree as f64 * 0.3f64.powi(degree - 1));
        let inside = history.time - 0.4 * STEPS[7];
        let mut z = [0.0];
        history.interpolate(inside, &mut z);
        let interpolation = (z[0] - exact(inside)).abs();
        history.resize(0.105);
        history.begin();
        let mut z_prime = [0.0];
        history.predict(&mut z, &mut z_prime);
        let end = history.time + 0.105;
        let derivative = z_prime[0] + history.leading * (exact(end) - z[0]);
        ((z[0] - exact(end)).abs(), (derivative - degree as f64 * end.powi(degree - 1)).abs(), interpolation)
    }

    #[test]
    fn order_k_is_exact_on_polynomials_of_degree_k_at_unequal_steps() {
        for order in 1..=MAXIMUM_ORDER {
            for degree in 1..=order as i32 {
                let (predictor, derivative, interpolation) = defect(order, degree);
                assert!(
                    predictor < 1e-12 && derivative < 1e-11 && interpolation < 1e-12,
                    "order {order}, degree {degree}"
                );
            }
            let (predictor, derivative, interpolation) = defect(order, order as i32 + 1);
            assert!(predictor > 1e-7 && derivative > 1e-7 && interpolation > 1e-9, "order {order} is not exact above");
        }
    }

    #[test]
    fn taking_a_step_back_restores_the_history() {
        let mut history = following(4, &STEPS, 0.0, f64::cos, 0.0);
        let before = (history.differences.clone(), history.spans);
        history.resize(0.05);
        history.begin();
        history.withdraw();
        for (a, b) in before.0[..=4].iter().zip(&history.differences) {
            assert!((a[0] - b[0]).abs() < 1e-15);
        }
        for (a, b) in before.1[..4].iter().zip(&history.spans) {
            assert!((a - b).abs() < 1e-15);
        }
    }

    /// Error at t = 2 for y' = -y with equal steps, from exact values at the first ones.
    fn decay_error(order: usize, count: usize) -> f64 {
        let step = 2.0 / count as f64;
        let exact = |t: f64| (-t).exp();
        let mut history = following(order, &vec![step; order + 1], 0.0, exact, -1.0);
        for _ in order + 1..count {
            history.order = order;
            history.resize(step);
            history.begin();
            let (mut z, mut z_prime) = ([0.0], [0.0]);
            history.predict(&mut z, &mut z_prime);
            // predicted' + leading e = -(predicted + e)
            let correction = -(z_prime[0] + z[0]) / (history.leading + 1.0);
            let end = history.time + step;
            history.accept(end, &[correction]);
        }
        (history.differences[0][0] - exact(history.time)).abs()
    }

    #[test]
    fn every_order_converges_with_its_power() {
        for order in 1..=MAXIMUM_ORDER {
            let observed = (decay_error(order, 40) / decay_error(order, 80)).log2();
            assert!((observed - order as f64).abs() < 0.3, "order {order}: {observed}");
        }
    }
}
