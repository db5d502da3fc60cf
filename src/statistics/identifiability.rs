//! Which parameters, and which combinations of parameters, the data determine (method 7).

use crate::linear::{DecompositionError, SingularValueDecomposition, rounding_threshold};

/// Singular value analysis of the weighted, scaled gradient S Phi = U Sigma V^T (method 4.9).
#[derive(Clone, Debug, PartialEq)]
pub struct Identifiability {
    /// Descending, length p (padded with zeros where there are fewer residuals than parameters).
    pub singular_values: Vec<f64>,
    /// V, p x p column-major, in scaled parameters: column j belongs to `singular_values[j]`.
    pub directions: Vec<f64>,
    /// Number of determined directions; the last p - rank columns of `directions` are undetermined.
    pub rank: usize,
    /// diag(V Sigma^2 V^T) per parameter (4.15a), divided by the largest: 0 is no influence at all.
    pub measures: Vec<f64>,
    /// The directions below the threshold, in the user's terms (4.15b, 4.16b).
    pub undetermined: Vec<Undetermined>,
}

/// A set of parameters that the data do not determine one by one.
#[derive(Clone, Debug, PartialEq)]
pub struct Undetermined {
    /// Indices of the parameters that take part, ascending.
    pub parameters: Vec<usize>,
    /// Orthonormal basis of the undetermined directions, scaled parameters, each of length p.
    pub directions: Vec<Vec<f64>>,
    /// For example `only the sum c1 + c2 is determined`.
    pub description: String,
}

/// Components of a unit direction below this are noise of the gradient, not part of the direction.
const NEGLIGIBLE: f64 = 1e-3;
/// Relative agreement that makes a combination a plain sum, difference, product or ratio.
const PLAIN: f64 = 0.02;

/// Analyses a weighted gradient.
///
/// `gradient`: N x p column-major, weighted, per *unscaled* parameter. `scale`: width of each parameter's bounds (or
/// another typical width), > 0. `values`: the parameters at which the gradient was taken, `names` theirs.
/// `threshold`: singular values below this share of the largest count as zero; it must exceed the relative error of
/// the gradient (integration tolerance).
///
/// # Errors
/// When the gradient holds a number that is not finite.
pub fn identifiability(
    gradient: &[f64],
    scale: &[f64],
    values: &[f64],
    names: &[&str],
    threshold: f64,
) -> Result<Identifiability, DecompositionError> {
    let count = scale.len();
    let rows = gradient.len() / count.max(1);
    let scaled = scaled_gradient(gradient, scale);
    let (singular_values, directions) = full_directions(rows, count, &scaled)?;
    let limit = threshold.max(rounding_threshold(rows, count)) * singular_values.first().copied().unwrap_or(0.0);
    let rank = singular_values.iter().filter(|&&sigma| sigma > limit).count();
    let squared: Vec<f64> = scaled.chunks_exact(rows.max(1)).map(|column| super::matrix::dot(column, column)).collect();
    let largest = squared.iter().fold(0.0_f64, |a, &b| a.max(b));
    let measures = (0..count)
        .map(|j| if largest > 0.0 { squared.get(j).copied().unwrap_or(0.0) / largest } else { 0.0 })
        .collect();
    let null: Vec<&[f64]> = (rank..count).map(|j| &directions[j * count..(j + 1) * count]).collect();
    let undetermined = families(&null, count)
        .into_iter()
        .map(|parameters| describe(parameters, &null, scale, values, names))
        .collect();
    Ok(Identifiability { singular_values, directions, rank, measures, undetermined })
}

pub(super) fn scaled_gradient(gradient: &[f64], scale: &[f64]) -> Vec<f64> {
    let rows = (gradient.len() / scale.len().max(1)).max(1);
    gradient
        .chunks_exact(rows)
        .zip(scale)
        .flat_map(|(column, factor)| column.iter().map(move |value| value * factor))
        .collect()
}

/// p singular values and all p right singular vectors, also for fewer rows than columns.
pub(super) fn full_directions(
    rows: usize,
    count: usize,
    scaled: &[f64],
) -> Result<(Vec<f64>, Vec<f64>), DecompositionError> {
    let padded_rows = rows.max(count);
    let mut padded = vec![0.0; padded_rows * count];
    for (target, column) in padded.chunks_exact_mut(padded_rows.max(1)).zip(scaled.chunks_exact(rows.max(1))) {
        target[..rows].copy_from_slice(column);
    }
    let decomposition = SingularValueDecomposition::new(padded_rows, count, &padded)?;
    Ok((decomposition.singular_values, decomposition.v))
}

/// Parameters that share undetermined directions, as sets: linked where the projector on the null space couples them.
fn families(null: &[&[f64]], count: usize) -> Vec<Vec<usize>> {
    let coupling = |i: usize, j: usize| null.iter().map(|vector| vector[i] * vector[j]).sum::<f64>().abs();
    let mut family = vec![usize::MAX; count];
    let mut families: Vec<Vec<usize>> = Vec::new();
    for first in 0..count {
        if family[first] != usize::MAX || coupling(first, first) < NEGLIGIBLE * NEGLIGIBLE {
            continue;
        }
        let index = families.len();
        let mut members = Vec::new();
        let mut pending = vec![first];
        family[first] = index;
        while let Some(i) = pending.pop() {
            members.push(i);
            for (j, own) in family.iter_mut().enumerate() {
                if *own == usize::MAX && coupling(i, j) > NEGLIGIBLE * NEGLIGIBLE {
                    *own = index;
                    pending.push(j);
                }
            }
        }
        members.sort_unstable();
        families.push(members);
    }
    families
}

fn describe(parameters: Vec<usize>, null: &[&[f64]], scale: &[f64], values: &[f64], names: &[&str]) -> Undetermined {
    let directions = restricted_basis(&parameters, null, scale.len());
    let free = directions.len();
    let label = |j: usize| names.get(j).map_or_else(|| format!("parameter {j}"), |name| (*name).to_owned());
    let listed = parameters.iter().map(|&j| format!("`{}`", label(j))).collect::<Vec<_>>().join(", ");
    let description = if parameters.len() == free {
        let verb = if free == 1 { "has" } else { "have" };
        format!("{listed} {verb} no influence on the compared data")
    } else if parameters.len() == free + 1 {
        let combination = determined_combination(&parameters, &directions, scale);
        one_combination(&parameters, &combination, scale, values, &label)
    } else {
        let words =
            directions.iter().map(|direction| linear(&parameters, direction, scale, &label)).collect::<Vec<_>>();
        format!("of {listed} the data do not determine: {}", words.join("; "))
    };
    Undetermined { parameters, directions, description }
}

/// Orthonormal basis of the null space restricted to the family, from the projector's columns.
fn restricted_basis(parameters: &[usize], null: &[&[f64]], count: usize) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for &j in parameters {
        let mut column = vec![0.0; count];
        for vector in null {
            for &i in parameters {
                column[i] += vector[i] * vector[j];
            }
        }
        for known in &basis {
            let overlap = super::matrix::dot(known, &column);
            column.iter_mut().zip(known).for_each(|(value, entry)| *value -= overlap * entry);
        }
        let length = super::matrix::dot(&column, &column).sqrt();
        if length > NEGLIGIBLE.sqrt() {
            column.iter_mut().for_each(|value| *value /= length);
            basis.push(column);
        }
    }
    basis
}

/// The one combination (coefficients per *unscaled* parameter, largest 1) orthogonal to all undetermined directions.
fn determined_combination(parameters: &[usize], directions: &[Vec<f64>], scale: &[f64]) -> Vec<f64> {
    let mut best = vec![0.0; parameters.len()];
    let mut best_length = 0.0;
    for trial in 0..parameters.len() {
        let mut candidate = vec![0.0; parameters.len()];
        candidate[trial] = 1.0;
        for direction in directions {
            let overlap = direction[parameters[trial]];
            for (value, &j) in candidate.iter_mut().zip(parameters) {
                *value -= overlap * direction[j];
            }
        }
        let length = super::matrix::dot(&candidate, &candidate).sqrt();
        if length > best_length {
            (best, best_length) = (candidate, length);
        }
    }
    for (value, &j) in best.iter_mut().zip(parameters) {
        *value /= scale[j];
    }
    let largest = best.iter().copied().fold(0.0_f64, |a, b| if b.abs() > a.abs() { b } else { a });
    best.iter_mut().for_each(|value| *value /= largest);
    best
}

fn one_combination(
    parameters: &[usize],
    combination: &[f64],
    scale: &[f64],
    values: &[f64],
    label: &dyn Fn(usize) -> String,
) -> String {
    let equal = |weights: &[f64], signs: &dyn Fn(f64) -> f64| {
        weights.iter().all(|&weight| (signs(weight) - weights[0].abs()).abs() <= PLAIN * weights[0].abs())
    };
    let joined = |sign: &str| parameters.iter().map(|&j| label(j)).collect::<Vec<_>>().join(sign);
    let oriented: Vec<f64> = combination.iter().map(|weight| weight * combination[0].signum()).collect();
    if equal(&oriented, &|weight| weight) {
        return format!("only the sum `{}` is determined", joined(" + "));
    }
    let pair = parameters.len() == 2;
    if pair && equal(&oriented, &f64::abs) {
        return format!("only the difference `{}` is determined", joined(" - "));
    }
    // d ln of a product: weights times values are equal.
    let logarithmic: Vec<f64> = oriented.iter().zip(parameters).map(|(weight, &j)| weight * values[j]).collect();
    if logarithmic[0] != 0.0 && equal(&logarithmic, &|weight| weight * logarithmic[0].signum()) {
        return format!("only the product `{}` is determined", joined(" * "));
    }
    // d of a sum of reciprocals: weights times squared values are equal.
    let reciprocal: Vec<f64> = logarithmic.iter().zip(parameters).map(|(weight, &j)| weight * values[j]).collect();
    if reciprocal[0] != 0.0 && equal(&reciprocal, &|weight| weight * reciprocal[0].signum()) {
        let terms = parameters.iter().map(|&j| format!("1/{}", label(j))).collect::<Vec<_>>().join(" + ");
        return format!("only the series `1/({terms})` is determined");
    }
    if pair && logarithmic[0] != 0.0 && equal(&logarithmic, &f64::abs) {
        return format!("only the ratio `{}` is determined", joined(" / "));
    }
    let mut full = vec![0.0; scale.len()];
    parameters.iter().zip(&oriented).for_each(|(&j, weight)| full[j] = weight * scale[j]);
    let words = linear(parameters, &full, scale, label);
    format!("only one combination of {} is determined, near the optimum {words}", joined(", "))
}

/// `a + 0.5 b - 2 c` of a direction given in scaled parameters; shown per unit of the first parameter.
fn linear(parameters: &[usize], direction: &[f64], scale: &[f64], label: &dyn Fn(usize) -> String) -> String {
    let present: Vec<usize> = parameters.iter().copied().filter(|&j| direction[j].abs() > NEGLIGIBLE).collect();
    let Some(&first) = present.first() else { return String::new() };
    let unit = direction[first] / scale[first];
    let mut text = String::new();
    for &j in &present {
        let weight = direction[j] / scale[j] / unit;
        let sign = if weight < 0.0 { "-" } else { "+" };
        let size = crate::quantities::format_number(weight.abs(), 3);
        let factor = if size == "1" { String::new() } else { format!("{size} ") };
        if text.is_empty() {
            text = format!("{factor}{}", label(j));
        } else {
            text.push_str(&format!(" {sign} {factor}{}", label(j)));
        }
    }
    format!("`{text}`")
}
