//! Piecewise polynomials through points.

/// How a table goes between its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Linear,
    /// Cubic pieces with slopes that keep the data's monotony (Fritsch-Carlson-1980).
    Monotone,
    /// Cubic spline with continuous second derivative, zero at the ends (Boor-2001).
    Cubic,
}

/// Coefficients of each piece in powers of `x - x_i`. At least two points, arguments growing.
pub(super) fn pieces(points: &[(f64, f64)], shape: Shape) -> Vec<[f64; 4]> {
    let slopes = match shape {
        Shape::Linear => {
            return points.windows(2).map(|pair| [pair[0].1, secant(pair), 0.0, 0.0]).collect();
        }
        Shape::Monotone => monotone_slopes(points),
        Shape::Cubic => spline_slopes(points),
    };
    let hermite = |(pair, ends): (&[(f64, f64)], &[f64])| {
        let (width, rise) = (pair[1].0 - pair[0].0, secant(pair));
        let square = (3.0 * rise - 2.0 * ends[0] - ends[1]) / width;
        let cube = (ends[0] + ends[1] - 2.0 * rise) / (width * width);
        [pair[0].1, ends[0], square, cube]
    };
    points.windows(2).zip(slopes.windows(2)).map(hermite).collect()
}

fn secant(pair: &[(f64, f64)]) -> f64 {
    (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0)
}

/// Means of the neighbouring secants, reduced until no piece overshoots: the slopes of a piece, in units of its secant,
/// stay within the circle of radius 3.
fn monotone_slopes(points: &[(f64, f64)]) -> Vec<f64> {
    let secants: Vec<f64> = points.windows(2).map(secant).collect();
    let last = secants.len() - 1;
    let mut slopes = vec![secants[0]];
    for pair in secants.windows(2) {
        slopes.push(if pair[0] * pair[1] <= 0.0 { 0.0 } else { 0.5 * (pair[0] + pair[1]) });
    }
    slopes.push(secants[last]);
    for (at, secant) in secants.iter().enumerate() {
        if *secant == 0.0 {
            slopes[at] = 0.0;
            slopes[at + 1] = 0.0;
            continue;
        }
        let (a, b) = (slopes[at] / secant, slopes[at + 1] / secant);
        let radius = a.hypot(b);
        if radius > 3.0 {
            slopes[at] = 3.0 / radius * a * secant;
            slopes[at + 1] = 3.0 / radius * b * secant;
        }
    }
    slopes
}

/// Slopes of the natural spline: the tridiagonal system of continuous curvature.
fn spline_slopes(points: &[(f64, f64)]) -> Vec<f64> {
    let count = points.len();
    let widths: Vec<f64> = points.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    let secants: Vec<f64> = points.windows(2).map(secant).collect();
    let (mut diagonal, mut right) = (vec![2.0; count], vec![0.0; count]);
    let (mut lower, mut upper) = (vec![0.0; count], vec![0.0; count]);
    upper[0] = 1.0;
    right[0] = 3.0 * secants[0];
    for at in 1..count - 1 {
        let (before, behind) = (widths[at - 1], widths[at]);
        lower[at] = behind / (before + behind);
        upper[at] = before / (before + behind);
        right[at] = 3.0 * (lower[at] * secants[at - 1] + upper[at] * secants[at]);
    }
    lower[count - 1] = 1.0;
    right[count - 1] = 3.0 * secants[count - 2];
    for at in 1..count {
        let factor = lower[at] / diagonal[at - 1];
        diagonal[at] -= factor * upper[at - 1];
        right[at] -= factor * right[at - 1];
    }
    let mut slopes = vec![0.0; count];
    for at in (0..count).rev() {
        let behind = if at + 1 < count { upper[at] * slopes[at + 1] } else { 0.0 };
        slopes[at] = (right[at] - behind) / diagonal[at];
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(points: &[(f64, f64)], pieces: &[[f64; 4]], x: f64) -> f64 {
        let at = points.iter().rposition(|point| point.0 <= x).unwrap_or(0).min(pieces.len() - 1);
        let (d, [a, b, c, e]) = (x - points[at].0, pieces[at]);
        a + d * (b + d * (c + d * e))
    }

    /// The data of Fritsch and Carlson (1980, table 1, RPN 14): values that rise monotonically and steeply.
    #[test]
    fn monotone_data_stay_monotone_where_a_spline_overshoots() {
        let points = [
            (7.99, 0.0),
            (8.09, 2.76429e-5),
            (8.19, 4.37498e-2),
            (8.7, 0.169183),
            (9.2, 0.469428),
            (10.0, 0.943740),
            (12.0, 0.998636),
            (15.0, 0.999919),
            (20.0, 0.999994),
        ];
        let sampled = |shape: Shape| -> Vec<f64> {
            let pieces = pieces(&points, shape);
            (0..2000).map(|at| value(&points, &pieces, 7.99 + 12.01 * f64::from(at) / 1999.0)).collect()
        };
        let falls = |values: &[f64]| values.windows(2).any(|pair| pair[1] < pair[0] - 1e-12);
        assert!(!falls(&sampled(Shape::Monotone)) && !falls(&sampled(Shape::Linear)));
        assert!(falls(&sampled(Shape::Cubic)));
    }

    #[test]
    fn every_shape_passes_through_its_points() {
        let points = [(-1.0, 3.0), (0.0, 0.0), (0.5, -1.0), (2.0, -1.0), (2.5, 4.0)];
        for shape in [Shape::Linear, Shape::Monotone, Shape::Cubic] {
            let pieces = pieces(&points, shape);
            for (at, point) in points.iter().enumerate() {
                let [a, b, c, d] = pieces[at.min(pieces.len() - 1)];
                let x = point.0 - points[at.min(pieces.len() - 1)].0;
                assert!((a + x * (b + x * (c + x * d)) - point.1).abs() < 1e-12, "{shape:?} at {point:?}");
            }
        }
    }

    /// The natural spline of a sine over whole periods is known to fourth order in the distance of the points.
    #[test]
    fn the_spline_has_fourth_order_and_continuous_curvature() {
        let error = |count: i32| {
            let point = |at: i32| {
                let x = std::f64::consts::TAU * f64::from(at) / f64::from(count);
                (x, x.sin())
            };
            let points: Vec<(f64, f64)> = (0..=count).map(point).collect();
            let pieces = pieces(&points, Shape::Cubic);
            for (pair, ends) in pieces.windows(2).zip(points.windows(2)) {
                let width = ends[1].0 - ends[0].0;
                assert!((2.0 * pair[0][2] + 6.0 * pair[0][3] * width - 2.0 * pair[1][2]).abs() < 1e-9);
            }
            (0..1000)
                .map(|at| std::f64::consts::TAU * f64::from(at) / 1000.0)
                .fold(0.0, |worst: f64, x| worst.max((value(&points, &pieces, x) - x.sin()).abs()))
        };
        let ratio = error(16) / error(32);
        assert!((13.0..19.0).contains(&ratio), "{ratio}");
    }
}
