//! Vectors and matrices of expressions.

use crate::expression::{Graph, Node, Unary};

pub(super) type Vector = [Node; 3];
/// Rows of elements.
pub(super) type Matrix = [[Node; 3]; 3];

pub(super) fn zero(graph: &mut Graph) -> Vector {
    [graph.constant(0.0); 3]
}

pub(super) fn constant(graph: &mut Graph, value: [f64; 3]) -> Vector {
    value.map(|component| graph.constant(component))
}

pub(super) fn add(graph: &mut Graph, a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| graph.add(a[i], b[i]))
}

pub(super) fn subtract(graph: &mut Graph, a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| graph.subtract(a[i], b[i]))
}

pub(super) fn negate(graph: &mut Graph, a: Vector) -> Vector {
    a.map(|component| graph.negate(component))
}

pub(super) fn scale(graph: &mut Graph, factor: Node, a: Vector) -> Vector {
    a.map(|component| graph.multiply(factor, component))
}

pub(super) fn dot(graph: &mut Graph, a: Vector, b: Vector) -> Node {
    let products: Vector = std::array::from_fn(|i| graph.multiply(a[i], b[i]));
    let partial = graph.add(products[0], products[1]);
    graph.add(partial, products[2])
}

pub(super) fn cross(graph: &mut Graph, a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let positive = graph.multiply(a[j], b[k]);
        let negative = graph.multiply(a[k], b[j]);
        graph.subtract(positive, negative)
    })
}

pub(super) fn norm(graph: &mut Graph, a: Vector) -> Node {
    let square = dot(graph, a, a);
    graph.unary(Unary::Sqrt, square)
}

pub(super) fn identity(graph: &mut Graph) -> Matrix {
    diagonal(graph, 1.0)
}

fn diagonal(graph: &mut Graph, value: f64) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| graph.constant(if i == j { value } else { 0.0 })))
}

pub(super) fn zero_matrix(graph: &mut Graph) -> Matrix {
    diagonal(graph, 0.0)
}

pub(super) fn transpose(a: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

pub(super) fn apply(graph: &mut Graph, a: Matrix, b: Vector) -> Vector {
    a.map(|row| dot(graph, row, b))
}

/// `transpose(a) b`.
pub(super) fn apply_transposed(graph: &mut Graph, a: Matrix, b: Vector) -> Vector {
    apply(graph, transpose(a), b)
}

pub(super) fn multiply(graph: &mut Graph, a: Matrix, b: Matrix) -> Matrix {
    let columns = transpose(b);
    a.map(|row| columns.map(|column| dot(graph, row, column)))
}

pub(super) fn add_matrix(graph: &mut Graph, a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|i| add(graph, a[i], b[i]))
}

pub(super) fn subtract_matrix(graph: &mut Graph, a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|i| subtract(graph, a[i], b[i]))
}

/// The matrix of the cross product, `skew(a) b = a x b`.
pub(super) fn skew(graph: &mut Graph, a: Vector) -> Matrix {
    let zero = graph.constant(0.0);
    let n = negate(graph, a);
    [[zero, n[2], a[1]], [a[2], zero, n[0]], [n[1], a[0], zero]]
}

/// Rotation by `angle` about the unit vector `axis` (Rodrigues): turned axes to original axes.
pub(super) fn rotation(graph: &mut Graph, axis: [f64; 3], angle: Node) -> Matrix {
    let cosine = graph.unary(Unary::Cos, angle);
    let sine = graph.unary(Unary::Sin, angle);
    let [x, y, z] = axis;
    let cross = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let along = axis[i] * axis[j];
            let across = if i == j { 1.0 - along } else { -along };
            let [along, across, cross] = [along, across, cross[i][j]].map(|value| graph.constant(value));
            let by_cosine = graph.multiply(across, cosine);
            let by_sine = graph.multiply(cross, sine);
            let turned = graph.add(by_cosine, by_sine);
            graph.add(along, turned)
        })
    })
}

/// `rotation m transpose(rotation)`.
pub(super) fn turn(graph: &mut Graph, rotation: Matrix, m: Matrix) -> Matrix {
    let left = multiply(graph, rotation, m);
    multiply(graph, left, transpose(rotation))
}

/// As [`turn`] for symmetric `m`: symmetric to the node, and a multiple of the identity stays one.
pub(super) fn turn_symmetric(graph: &mut Graph, rotation: Matrix, m: Matrix) -> Matrix {
    let is_diagonal = (0..3).all(|i| (0..3).all(|j| i == j || graph.is_zero(m[i][j])));
    if is_diagonal && m[0][0] == m[1][1] && m[1][1] == m[2][2] {
        return m;
    }
    let full = turn(graph, rotation, m);
    mirrored(full)
}

/// The upper triangle mirrored into the lower.
pub(super) fn mirrored(m: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| m[i.min(j)][i.max(j)]))
}
