//! Piecewise polynomials of one argument, kept as data: what tables become, however many points they have.

/// What a curve is beyond its ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beyond {
    /// The value at the end.
    Constant,
    /// A line with the slope at the end.
    Linear,
    /// Not a number, so that a simulation stops there.
    Undefined,
}

/// A function of one argument, SI.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    pub name: String,
    /// Where the pieces begin, and where the last one ends; growing.
    knots: Vec<f64>,
    /// Per piece the coefficients of the powers of the distance from its begin.
    pieces: Vec<[f64; 4]>,
    beyond: Beyond,
    /// Derivatives of a higher order are zero everywhere.
    pub degree: u8,
}

/// Relative jumps of the slope that count as kinks.
const KINK: f64 = 1e-9;

impl Curve {
    /// One more knot than pieces, at least one piece.
    ///
    /// # Panics
    /// Otherwise.
    pub fn new(name: &str, knots: Vec<f64>, pieces: Vec<[f64; 4]>, beyond: Beyond) -> Self {
        assert!(!pieces.is_empty() && knots.len() == pieces.len() + 1, "a knot at every end of a piece");
        let is_used = |power: &usize| pieces.iter().any(|piece| piece[*power] != 0.0);
        let degree = (0..4).rev().find(is_used).unwrap_or(0) as u8;
        Self { name: name.to_owned(), knots, pieces, beyond, degree }
    }

    /// Value (order 0) or derivative at `x`. At a knot the piece to its right counts, at the last one that to its left.
    pub fn evaluate(&self, x: f64, order: u8) -> f64 {
        if x.is_nan() {
            return f64::NAN;
        }
        let (first, last) = (self.knots[0], self.knots[self.pieces.len()]);
        if (first..=last).contains(&x) {
            let piece = (self.knots.partition_point(|knot| *knot <= x).max(1) - 1).min(self.pieces.len() - 1);
            return polynomial(&self.pieces[piece], x - self.knots[piece], usize::from(order));
        }
        let (end, piece) = if x < first { (first, 0) } else { (last, self.pieces.len() - 1) };
        let at_end = |order: u8| polynomial(&self.pieces[piece], end - self.knots[piece], usize::from(order));
        match (self.beyond, order) {
            (Beyond::Undefined, _) => f64::NAN,
            (Beyond::Constant, 0) => at_end(0),
            (Beyond::Linear, 0) => at_end(0) + at_end(1) * (x - end),
            (Beyond::Linear, 1) => at_end(1),
            _ => 0.0,
        }
    }

    /// Arguments at which the slope jumps.
    pub fn kinks(&self) -> Vec<f64> {
        let slopes = |at: usize| {
            let before = match (at, self.beyond) {
                (0, Beyond::Linear) => return [0.0; 2],
                (0, _) => 0.0,
                _ => polynomial(&self.pieces[at - 1], self.knots[at] - self.knots[at - 1], 1),
            };
            let behind = match (self.pieces.get(at), self.beyond) {
                (Some(piece), _) => piece[1],
                (None, Beyond::Linear) => before,
                (None, _) => 0.0,
            };
            [before, behind]
        };
        let is_kink = |at: &usize| {
            let [before, behind] = slopes(*at);
            (behind - before).abs() > KINK * before.abs().max(behind.abs())
        };
        (0..self.knots.len()).filter(is_kink).map(|at| self.knots[at]).collect()
    }
}

/// `a + b x + c x^2 + d x^3` or its derivative of this order.
pub(crate) fn polynomial([a, b, c, d]: &[f64; 4], x: f64, order: usize) -> f64 {
    match order {
        0 => a + x * (b + x * (c + x * d)),
        1 => b + x * (2.0 * c + x * 3.0 * d),
        2 => 2.0 * c + 6.0 * d * x,
        3 => 6.0 * d,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_derivatives_and_what_is_beyond() {
        // x^2 from 1 to 2, then 4 + 4 (x - 2) to 4.
        let pieces = vec![[1.0, 2.0, 1.0, 0.0], [4.0, 4.0, 0.0, 0.0]];
        let curve = |beyond| Curve::new("c", vec![1.0, 2.0, 4.0], pieces.clone(), beyond);
        let linear = curve(Beyond::Linear);
        assert_eq!([0.0, 1.0, 1.5, 2.0, 4.0, 5.0].map(|x| linear.evaluate(x, 0)), [-1.0, 1.0, 2.25, 4.0, 12.0, 16.0]);
        assert_eq!([0.0, 1.5, 2.0, 5.0].map(|x| linear.evaluate(x, 1)), [2.0, 3.0, 4.0, 4.0]);
        assert_eq!((linear.evaluate(1.5, 2), linear.evaluate(3.0, 2), linear.degree), (2.0, 0.0, 2));
        let constant = curve(Beyond::Constant);
        assert_eq!([0.0, 5.0].map(|x| [constant.evaluate(x, 0), constant.evaluate(x, 1)]), [[1.0, 0.0], [12.0, 0.0]]);
        assert!(curve(Beyond::Undefined).evaluate(4.1, 0).is_nan());
        assert_eq!((linear.kinks(), constant.kinks()), (vec![], vec![1.0, 4.0]));
    }
}
