//! Vectors and matrices of expressions.

use super::{Graph, Node, Unary};

pub(crate) type Vector = [Node; 3];
/// Rows of elements.
pub(crate) type Matrix = [[Node; 3]; 3];

pub(crate) fn zero(graph: &mut Graph) -> Vector {
    [graph.constant(0.0); 3]
}

pub(crate) fn constant(graph: &mut Graph, value: [f64; 3]) -> Vector {
    value.map(|component| graph.constant(component))
}

pub(crate) fn add(graph: &mut Graph, a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| graph.add(a[i], b[i]))
}

pub(crate) fn subtract(graph: &mut Graph, a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| graph.subtract(a[i], b[i]))
}

pub(crate) fn negate(graph: &mut Graph, a: Vector) -> Vector {
    a.map(|component| graph.negate(component))
}

pub(crate) fn scale(graph: &mut Graph, factor: Node, a: Vector) -> Vector {
    a.map(|component| graph.multiply(factor, component))
}

pub(crate) fn dot(graph: &mut Graph, a: Vector, b: Vector) -> Node {
    let products: Vector = std::array::from_fn(|i| graph.multiply(a[i], b[i]));
    let partial = graph.add(products[0], products[1]);
    graph.add(partial, products[2])
}

pub(crate) fn cross(graph: &mut Graph, a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let positive = graph.multiply(a[j], b[k]);
        let negative = graph.multiply(a[k], b[j]);
        graph.subtract(positive, negative)
    })
}

pub(crate) fn norm(graph: &mut Graph, a: Vector) -> Node {
    let square = dot(graph, a, a);
    graph.unary(Unary::Sqrt, square)
}

pub(crate) fn identity(graph: &mut Graph) -> Matrix {
    diagonal(graph, 1.0)
}

fn diagonal(graph: &mut Graph, value: f64) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| graph.constant(if i == j { value } else { 0.0 })))
}

pub(crate) fn zero_matrix(graph: &mut Graph) -> Matrix {
    diagonal(graph, 0.0)
}

pub(crate) fn transpose(a: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

pub(crate) fn apply(graph: &mut Graph, a: Matrix, b: Vector) -> Vector {
    a.map(|row| dot(graph, row, b))
}

/// `transpose(a) b`.
pub(crate) fn apply_transposed(graph: &mut Graph, a: Matrix, b: Vector) -> Vector {
    apply(graph, transpose(a), b)
}

pub(crate) fn multiply(graph: &mut Graph, a: Matrix, b: Matrix) -> Matrix {
    let columns = transpose(b);
    a.map(|row| columns.map(|column| dot(graph, row, column)))
}

pub(crate) fn add_matrix(graph: &mut Graph, a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|i| add(graph, a[i], b[i]))
}

pub(crate) fn subtract_matrix(graph: &mut Graph, a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|i| subtract(graph, a[i], b[i]))
}

/// The matrix of the cross product, `skew(a) b = a x b`.
pub(crate) fn skew(graph: &mut Graph, a: Vector) -> Matrix {
    let zero = graph.constant(0.0);
    let n = negate(graph, a);
    [[zero, n[2], a[1]], [a[2], zero, n[0]], [n[1], a[0], zero]]
}

/// Rotation by `angle` about the unit vector `axis` (Rodrigues): turned axes to original axes.
pub(crate) fn rotation(graph: &mut Graph, axis: Vector, angle: Node) -> Matrix {
    let cosine = graph.unary(Unary::Cos, angle);
    let sine = graph.unary(Unary::Sin, angle);
    let cross = skew(graph, axis);
    let unit = identity(graph);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let along = graph.multiply(axis[i.min(j)], axis[i.max(j)]);
            let across = graph.subtract(unit[i][j], along);
            let by_cosine = graph.multiply(across, cosine);
            let by_sine = graph.multiply(cross[i][j], sine);
            let turned = graph.add(by_cosine, by_sine);
            graph.add(along, turned)
        })
    })
}

/// Rotation by a quaternion (scalar first) of any length but zero: turned axes to original axes.
pub(crate) fn rotation_of_quaternion(graph: &mut Graph, quaternion: [Node; 4]) -> Matrix {
    let [w, x, y, z] = quaternion;
    let squares = quaternion.map(|q| graph.multiply(q, q));
    let norm = squares.into_iter().reduce(|sum, square| graph.add(sum, square)).unwrap_or(w);
    let two = graph.constant(2.0);
    let factor = graph.divide(two, norm);
    let one = graph.constant(1.0);
    let mut product = |a: Node, b: Node| {
        let product = graph.multiply(a, b);
        graph.multiply(factor, product)
    };
    let (xx, yy, zz) = (product(x, x), product(y, y), product(z, z));
    let (xy, xz, yz) = (product(x, y), product(x, z), product(y, z));
    let (wx, wy, wz) = (product(w, x), product(w, y), product(w, z));
    let mut diagonal = |a: Node, b: Node| {
        let sum = graph.add(a, b);
        graph.subtract(one, sum)
    };
    let (d0, d1, d2) = (diagonal(yy, zz), diagonal(xx, zz), diagonal(xx, yy));
    [
        [d0, graph.subtract(xy, wz), graph.add(xz, wy)],
        [graph.add(xy, wz), d1, graph.subtract(yz, wx)],
        [graph.subtract(xz, wy), graph.add(yz, wx), d2],
    ]
}

/// `rotation m transpose(rotation)`.
pub(crate) fn turn(graph: &mut Graph, rotation: Matrix, m: Matrix) -> Matrix {
    let left = multiply(graph, rotation, m);
    multiply(graph, left, transpose(rotation))
}

/// As [`turn`] for symmetric `m`: symmetric to the node, and a multiple of the identity stays one.
pub(crate) fn turn_symmetric(graph: &mut Graph, rotation: Matrix, m: Matrix) -> Matrix {
    let is_diagonal = (0..3).all(|i| (0..3).all(|j| i == j || graph.is_zero(m[i][j])));
    if is_diagonal && m[0][0] == m[1][1] && m[1][1] == m[2][2] {
        return m;
    }
    let full = turn(graph, rotation, m);
    mirrored(full)
}

/// The upper triangle mirrored into the lower.
pub(crate) fn mirrored(m: Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| m[i.min(j)][i.max(j)]))
}

/// Two unit vectors that make a right-handed triad with the unit vector `normal`: (first, second, normal).
pub(crate) fn perpendicular(normal: [f64; 3]) -> [[f64; 3]; 2] {
    let smallest = (0..3).min_by(|&i, &j| normal[i].abs().total_cmp(&normal[j].abs())).unwrap_or(0);
    let helper: [f64; 3] = std::array::from_fn(|i| if i == smallest { 1.0 } else { 0.0 });
    let product = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
    };
    let first = product(helper, normal);
    let length = first.iter().map(|x| x * x).sum::<f64>().sqrt();
    let first = first.map(|x| x / length);
    [first, product(normal, first)]
}
