//! Tables of two arguments: values on a grid, interpolated along both (the tensor product of the curves, Boor-2001).

use super::curve::{self, Shape};
use super::polynomials::{Piecewise, constants};
use crate::expression::{Beyond, Graph, Node};

/// Values over a grid.
pub(super) struct Surface {
    arguments: [Vec<f64>; 2],
    /// Per interval of the second argument and power of the distance from its begin: a curve over the first argument.
    coefficients: Vec<[Vec<[f64; 4]>; 4]>,
    beyond: Beyond,
}

impl Surface {
    /// From points (first argument, second argument, value) in any order.
    ///
    /// # Errors
    /// What keeps them from being a grid.
    pub fn new(points: &[Vec<f64>], shape: Shape, beyond: Beyond) -> Result<Self, String> {
        let arguments = [0, 1].map(|at| {
            let mut values: Vec<f64> = points.iter().map(|point| point[at]).collect();
            values.sort_by(f64::total_cmp);
            values.dedup();
            values
        });
        let [rows, columns] = [arguments[0].len(), arguments[1].len()];
        if rows < 2 || columns < 2 {
            return Err("a table of two arguments has at least two values of each".to_owned());
        }
        let mut grid = vec![vec![None; columns]; rows];
        for point in points {
            let place = |at: usize| arguments[at].binary_search_by(|value| value.total_cmp(&point[at])).unwrap_or(0);
            let cell = &mut grid[place(0)][place(1)];
            if cell.replace(point[2]).is_some() {
                return Err(format!("the point of {} and {} is there twice", point[0], point[1]));
            }
        }
        let mut values = Vec::new();
        for (row, first) in grid.iter().zip(&arguments[0]) {
            let mut line = Vec::new();
            for (cell, second) in row.iter().zip(&arguments[1]) {
                line.push(cell.ok_or_else(|| format!("there is no point of {first} and {second} (SI units)"))?);
            }
            values.push(line);
        }
        // Pieces along the second argument for every value of the first, then their coefficients along the first.
        let curve = |xs: &[f64], ys: &[f64]| -> Vec<[f64; 4]> {
            let points: Vec<(f64, f64)> = xs.iter().copied().zip(ys.iter().copied()).collect();
            curve::pieces(&points, shape)
        };
        let along: Vec<Vec<[f64; 4]>> = values.iter().map(|line| curve(&arguments[1], line)).collect();
        let coefficients = (0..columns - 1).map(|interval| {
            std::array::from_fn(|power| {
                let over: Vec<f64> = along.iter().map(|pieces| pieces[interval][power]).collect();
                curve(&arguments[0], &over)
            })
        });
        let coefficients = coefficients.collect();
        Ok(Self { arguments, coefficients, beyond })
    }

    pub fn at(&self, graph: &mut Graph, [x, y]: [Node; 2]) -> Option<Node> {
        let mut pieces = Vec::new();
        for interval in &self.coefficients {
            let mut own = [graph.constant(0.0); 4];
            for (slot, over) in own.iter_mut().zip(interval) {
                if over.iter().flatten().all(|coefficient| *coefficient == 0.0) {
                    continue;
                }
                let over = constants(graph, over);
                let curve = Piecewise { arguments: &self.arguments[0], pieces: &over, beyond: self.beyond };
                *slot = curve.at(graph, x)?;
            }
            pieces.push(own);
        }
        Piecewise { arguments: &self.arguments[1], pieces: &pieces, beyond: self.beyond }.at(graph, y)
    }
}
