//! Joints whose motions fall together: three turns in gimbal lock, two shifts that a turn between them makes parallel.

use super::run::Compiled;
use crate::expression::{Graph, vector};
use crate::linear::SingularValueDecomposition;
use crate::study::{AxisMotion, Joint};

/// Smallest over largest singular value of a joint's motions (angular velocity, velocity in 1 m) from which on two of
/// them count as one.
const DEPENDENT: f64 = 0.02;

/// What to say of a joint whose motions fall together in this state, with the coordinate `blamed` (index of the
/// variable) among them.
pub(super) fn singular_joint(compiled: &Compiled, y: &[f64], blamed: Option<usize>) -> Option<String> {
    let variables = compiled.model.variables();
    let blamed = variables.get(blamed?)?.symbol;
    let is_blamed = |joint: &&Joint| {
        joint.axes.iter().any(|axis| axis.symbols.velocity == blamed || axis.symbols.position == blamed)
    };
    let joint = compiled.study.joints.iter().find(is_blamed)?;
    let position = |axis: &crate::study::JointAxis| {
        let at = variables.iter().position(|variable| variable.symbol == axis.symbols.position)?;
        y.get(at).copied()
    };
    let positions: Vec<f64> = joint.axes.iter().map(position).collect::<Option<_>>()?;
    let motions: Vec<AxisMotion> = joint.axes.iter().map(|axis| axis.motion).collect();
    if independence(&motions, &positions)? > DEPENDENT {
        return None;
    }
    let names: Vec<String> = joint.axes.iter().map(|axis| format!("`{}`", axis.name)).collect();
    Some(format!(
        "in this position the motions {} of joint `{}` are not independent: two of them move its child alike, and the joint has fewer \
         freedoms than coordinates; choose axes that stay independent, or start and keep away from there",
        names.join(", "),
        joint.name
    ))
}

/// Smallest over largest singular value of the motions of a joint at these coordinates; none for fewer than two.
fn independence(motions: &[AxisMotion], positions: &[f64]) -> Option<f64> {
    if motions.len() < 2 {
        return None;
    }
    let mut graph = Graph::new();
    let mut axes = vector::identity(&mut graph);
    let mut place = vector::zero(&mut graph);
    let mut columns = Vec::new();
    for (motion, &position) in motions.iter().zip(positions) {
        let way = vector::constant(&mut graph, motion.direction());
        let way = vector::apply(&mut graph, axes, way);
        let position = graph.constant(position);
        match motion {
            AxisMotion::Shift(_) => {
                columns.extend(vector::zero(&mut graph).into_iter().chain(way));
                let shift = vector::scale(&mut graph, position, way);
                place = vector::add(&mut graph, place, shift);
            }
            AxisMotion::Turn(_) => {
                columns.extend(way.into_iter().chain(vector::cross(&mut graph, place, way)));
                let turn = vector::rotation(&mut graph, way, position);
                axes = vector::multiply(&mut graph, turn, axes);
            }
        }
    }
    let columns: Vec<f64> = columns.into_iter().map(|node| graph.constant_value(node)).collect::<Option<_>>()?;
    let svd = SingularValueDecomposition::new(6, motions.len(), &columns).ok()?;
    Some(svd.singular_values.last()? / svd.singular_values.first()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gimbal_lock_and_parallel_shifts() {
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let gimbals = [AxisMotion::Turn(x), AxisMotion::Turn(y), AxisMotion::Turn(z)];
        let at = |angle: f64| independence(&gimbals, &[0.4, angle, 0.7]).expect("three motions");
        // The first and the last axis enclose a right angle plus the second turn.
        for angle in [0.0_f64, 0.5, 1.2] {
            let expected = ((1.0 - angle.sin()) / (1.0 + angle.sin())).sqrt();
            assert!((at(angle) - expected).abs() < 1e-12, "{} instead of {expected}", at(angle));
        }
        let shifts = [AxisMotion::Shift(x), AxisMotion::Turn(z), AxisMotion::Shift(x)];
        assert!(independence(&shifts, &[0.3, 0.0, 0.2]).expect("three motions") < 1e-12);
        assert!(independence(&shifts, &[0.0, 1.5, 0.0]).expect("three motions") > 0.9);
    }
}
