//! Turns equations written once for any scalar into [`Dynamics`].

use crate::scalar::{Dual, Scalar};
use ident::integrate::{Dynamics, Start};
use ident::linear::SparsityPattern;

pub trait Equations {
    fn dimension(&self) -> usize;

    fn differential(&self) -> Vec<bool> {
        vec![true; self.dimension()]
    }

    fn scale(&self) -> Vec<f64> {
        vec![1.0; self.dimension()]
    }

    /// `y' = f` where the system has this form.
    fn rates<S: Scalar>(&self, _t: f64, _y: &[S], _theta: &[S]) -> Option<Vec<S>> {
        None
    }

    fn residual<S: Scalar>(&self, t: f64, y: &[S], y_prime: &[S], theta: &[S]) -> Vec<S> {
        let rates = self.rates(t, y, theta).expect("either rates or a residual");
        y_prime.iter().zip(rates).map(|(&a, b)| a - b).collect()
    }
}

pub struct System<E> {
    pub equations: E,
    pub theta: Vec<f64>,
    scale: Vec<f64>,
    parameter_scale: Vec<f64>,
    differential: Vec<bool>,
    pattern: SparsityPattern,
}

impl<E: Equations> System<E> {
    pub fn new(equations: E, theta: &[f64]) -> Self {
        let n = equations.dimension();
        let entries = structure(&equations, theta);
        Self {
            scale: equations.scale(),
            differential: equations.differential(),
            theta: theta.to_vec(),
            parameter_scale: theta.iter().map(|t| t.abs().max(1e-3)).collect(),
            pattern: SparsityPattern::from_entries(n, n, &entries),
            equations,
        }
    }

    /// Leaves the scale of the sensitivities to the integrator.
    pub fn without_parameter_scale(mut self) -> Self {
        self.parameter_scale.clear();
        self
    }

    pub fn start(&mut self, y: &[f64]) -> Start {
        let mut y_prime = vec![0.0; y.len()];
        self.explicit_rates(0.0, y, &mut y_prime);
        Start { time: 0.0, y: y.to_vec(), y_prime, sensitivity: Vec::new() }
    }

    pub fn start_with_sensitivity(&mut self, y: &[f64]) -> Start {
        let size = y.len() * self.theta.len();
        Start { sensitivity: vec![0.0; size], ..self.start(y) }
    }

    fn residual_slope(&self, t: f64, y: &[Dual], y_prime: &[Dual], theta: &[Dual]) -> Vec<f64> {
        self.equations.residual(t, y, y_prime, theta).iter().map(|r| r.slope).collect()
    }
}

/// Entries of the Jacobian that are not zero at some odd point, and the diagonal.
fn structure<E: Equations>(equations: &E, theta: &[f64]) -> Vec<(usize, usize)> {
    let n = equations.dimension();
    let mut y: Vec<Dual> = (0..n).map(|i| Dual::from(0.3 + 0.1 * (7.0 * i as f64).sin())).collect();
    let mut y_prime = y.clone();
    let mut entries: Vec<(usize, usize)> = (0..n).map(|i| (i, i)).collect();
    for column in 0..n {
        (y[column].slope, y_prime[column].slope) = (1.0, 0.7);
        let slopes = equations.residual(0.123, &y, &y_prime, &constants(theta));
        entries.extend((0..n).filter(|&row| slopes[row].slope != 0.0).map(|row| (row, column)));
        (y[column].slope, y_prime[column].slope) = (0.0, 0.0);
    }
    entries
}

fn constants(values: &[f64]) -> Vec<Dual> {
    values.iter().map(|&v| Dual::from(v)).collect()
}

impl<E: Equations> Dynamics for System<E> {
    fn dimension(&self) -> usize {
        self.equations.dimension()
    }

    fn parameter_count(&self) -> usize {
        self.theta.len()
    }

    fn differential(&self) -> &[bool] {
        &self.differential
    }

    fn scale(&self) -> &[f64] {
        &self.scale
    }

    fn parameter_scale(&self) -> &[f64] {
        &self.parameter_scale
    }

    fn residual(&mut self, t: f64, y: &[f64], y_prime: &[f64], residual: &mut [f64]) {
        residual.copy_from_slice(&self.equations.residual(t, y, y_prime, &self.theta));
    }

    fn pattern(&self) -> &SparsityPattern {
        &self.pattern
    }

    fn jacobian(&mut self, t: f64, y: &[f64], y_prime: &[f64], c: f64, values: &mut [f64]) {
        let n = self.dimension();
        let (mut y, mut y_prime, theta) = (constants(y), constants(y_prime), constants(&self.theta));
        for column in 0..n {
            y[column].slope = 1.0;
            y_prime[column].slope = c;
            let slopes = self.residual_slope(t, &y, &y_prime, &theta);
            for entry in self.pattern.starts[column]..self.pattern.starts[column + 1] {
                values[entry] = slopes[self.pattern.rows[entry]];
            }
            y[column].slope = 0.0;
            y_prime[column].slope = 0.0;
        }
    }

    fn parameter_derivative(&mut self, t: f64, y: &[f64], y_prime: &[f64], values: &mut [f64]) {
        let n = self.dimension();
        let (y, y_prime, mut theta) = (constants(y), constants(y_prime), constants(&self.theta));
        for j in 0..theta.len() {
            theta[j].slope = 1.0;
            values[j * n..(j + 1) * n].copy_from_slice(&self.residual_slope(t, &y, &y_prime, &theta));
            theta[j].slope = 0.0;
        }
    }

    fn explicit_rates(&mut self, t: f64, y: &[f64], rates: &mut [f64]) -> bool {
        match self.equations.rates(t, y, &self.theta) {
            Some(values) => {
                rates.copy_from_slice(&values);
                true
            }
            None => false,
        }
    }
}
