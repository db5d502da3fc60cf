//! Derivatives of the tape against differences of the tape; start values.

use crate::build::{Builder, GROUND, Random, assert_close};
use ident::expression::{Node, Unary};
use ident::integrate::Dynamics;
use ident::linear::{Factorisation, SparsityPattern};
use ident::mechanics::derive;
use ident::study::*;
use ident::tape::{Bound, DerivativeForm, InputSource, Model};

/// sin(3 t + i) and its derivatives.
struct Sines;

impl InputSource for Sines {
    fn sample(&self, input: u32, order: u8, t: f64) -> f64 {
        let quarter_turns = f64::from(order) * std::f64::consts::FRAC_PI_2;
        3.0_f64.powi(i32::from(order)) * (3.0 * t + f64::from(input) + quarter_turns).sin()
    }
}

const THETA: [f64; 6] = [7.0, 0.9, 0.03, 1.4, 2.5, 0.2];

/// A cart with a swinging arm: nonlinear springs, a Maxwell element, dry friction, a delayed input, a mass and a length
/// to identify, measured acceleration and force.
fn cart() -> Builder {
    let mut b = Builder::new();
    b.gravity([0.0, 0.0, -9.81]);
    let names = ["stiffness", "friction", "delay", "mass", "exponent", "start"];
    let theta: Vec<Node> = names.iter().zip(THETA).map(|(name, start)| b.parameter(name, start)).collect();
    let input = b.input("u");
    let cart = b.body("cart", 1.0, [0.0; 3], [0.0; 6]);
    b.study.bodies[cart].mass = theta[3];
    let arm = b.body("arm", 0.6, [0.0, 0.0, -0.4], [0.02, 0.03, 0.04, 0.0, 0.001, 0.0]);
    let (ground, on_cart) = (b.attach(GROUND, [0.0; 3]), b.attach(Some(cart), [0.0; 3]));
    let slide = b.joint("slide", Some(AxisMotion::Shift([1.0, 0.0, 0.0])), ground, on_cart);
    let hinge_end = b.attach(Some(arm), [0.0; 3]);
    let hinge = b.joint("hinge", Some(AxisMotion::Turn([0.0, 0.8, 0.6])), on_cart, hinge_end);
    let maxwell = b.state("maxwell.z");
    let t = b.study.graph.variable(b.study.time);
    let slide_force = b.force("motor", ForcePlace::Joint { joint: slide, axis: 0 }, |g, x, v| {
        let late = g.subtract(t, theta[2]);
        let u = g.sample(input, 0, late);
        let error = g.subtract(u, x);
        let drive = g.multiply(theta[0], error);
        let creep = g.constant(0.3);
        let slip = g.divide(v, creep);
        let slip = g.unary(Unary::Tanh, slip);
        let friction = g.multiply(theta[1], slip);
        g.subtract(drive, friction)
    });
    let tip = b.attach(Some(arm), [0.05, 0.0, -0.8]);
    let post = b.attach(GROUND, [0.4, 0.3, -0.9]);
    let rod = ForcePlace::Between { first: post, second: tip, along: None, free_length: None };
    b.force("rod", rod, |g, x, _| {
        let z = g.variable(maxwell);
        let stretch = g.subtract(x, z);
        let size = g.unary(Unary::Abs, stretch);
        let sign = g.unary(Unary::Sign, stretch);
        let grown = g.binary(ident::expression::Binary::Power, size, theta[4]);
        let load = g.multiply(grown, sign);
        let load = g.multiply(theta[0], load);
        g.negate(load)
    });
    let elongation = b.study.graph.variable(b.study.forces[1].coordinate);
    let z = b.study.graph.variable(maxwell);
    let rest = b.study.graph.subtract(elongation, z);
    b.study.states[0].derivative = b.study.graph.divide(rest, theta[5]);
    b.study.states[0].initial = elongation;
    let acceleration = b.study.graph.variable(b.symbols(slide).acceleration);
    b.measure("a", acceleration);
    let force = b.study.forces[slide_force].load;
    b.measure("F", force);
    b.measure_point("tip", tip, PointMotion::Acceleration);
    let doubled = b.study.graph.add(theta[5], theta[5]);
    let overrides = vec![(b.symbols(slide).position, theta[5]), (b.symbols(hinge).position, doubled)];
    b.experiment(Start { base: StartBase::Rest, overrides: overrides.clone() });
    b.experiment(Start { base: StartBase::Equilibrium, overrides: overrides[..1].to_vec() });
    b
}

fn cart_model() -> Model {
    Model::compile(&derive(&cart().study).expect("derivable"))
}

/// Central differences of `function` in every component of `x`, column-major.
fn differences(x: &[f64], mut function: impl FnMut(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let mut columns = Vec::new();
    for i in 0..x.len() {
        let h = 1e-5;
        let mut moved = x.to_vec();
        moved[i] = x[i] + h;
        let after = function(&moved);
        moved[i] = x[i] - h;
        let before = function(&moved);
        columns.extend(after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * h)));
    }
    columns
}

/// Column by column: rows differ in magnitude, columns have one unit of the unknown.
#[track_caller]
fn assert_columns(actual: &[f64], expected: &[f64], rows: usize) {
    for (actual, expected) in actual.chunks(rows).zip(expected.chunks(rows)) {
        assert_close(actual, expected, 1e-7);
    }
}

fn residual(model: &Model, theta: &[f64], t: f64, y: &[f64], y_prime: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; y.len()];
    Bound::new(model, &Sines, theta).residual(t, y, y_prime, &mut out);
    out
}

#[test]
fn jacobian_and_parameter_derivatives_match_differences() {
    let model = cart_model();
    let n = model.dimension();
    let mut random = Random(21);
    let mut bound = Bound::new(&model, &Sines, &THETA);
    for _ in 0..10 {
        let (t, y, y_prime, c) = (random.next(), random.state(n), random.state(n), 3.0 + random.next());
        let mut values = vec![0.0; bound.pattern().len()];
        bound.jacobian(t, &y, &y_prime, c, &mut values);
        let mut dense = vec![0.0; n * n];
        let pattern = bound.pattern();
        for column in 0..n {
            for slot in pattern.starts[column]..pattern.starts[column + 1] {
                dense[column * n + pattern.rows[slot]] = values[slot];
            }
        }
        let mut expected = differences(&y, |y| residual(&model, &THETA, t, y, &y_prime));
        (0..n).for_each(|i| expected[i * n + i] += c);
        assert_columns(&dense, &expected, n);

        let mut by_parameter = vec![f64::NAN; n * THETA.len()];
        bound.parameter_derivative(t, &y, &y_prime, &mut by_parameter);
        let expected = differences(&THETA, |theta| residual(&model, theta, t, &y, &y_prime));
        assert_columns(&by_parameter, &expected, n);
    }
}

#[test]
fn output_sensitivity_matches_differences() {
    let model = cart_model();
    let (n, m, p) = (model.dimension(), model.output_count(), model.parameter_count());
    let mut random = Random(22);
    let (t, y, s) = (0.3, random.state(n), random.state(n * p));
    let mut actual = vec![f64::NAN; m * p];
    Bound::new(&model, &Sines, &THETA).output_sensitivity(t, &y, &s, &mut actual);
    for k in 0..p {
        let h = 1e-5;
        let outputs = |step: f64| {
            let mut theta = THETA;
            theta[k] += step;
            let y: Vec<f64> = (0..n).map(|i| y[i] + step * s[k * n + i]).collect();
            let mut out = vec![0.0; m];
            Bound::new(&model, &Sines, &theta).outputs(t, &y, &mut out);
            out
        };
        let (after, before) = (outputs(h), outputs(-h));
        let expected: Vec<f64> = after.iter().zip(&before).map(|(a, b)| (a - b) / (2.0 * h)).collect();
        assert_close(&actual[k * m..(k + 1) * m], &expected, 1e-7);
    }
}

#[test]
fn evaluation_order_and_repetition_do_not_change_results() {
    let model = cart_model();
    let n = model.dimension();
    let mut random = Random(23);
    let (a, b, zero) = (random.state(n), random.state(n), vec![0.0; n]);
    let mut bound = Bound::new(&model, &Sines, &THETA);
    let fresh = [residual(&model, &THETA, 0.1, &a, &zero), residual(&model, &THETA, 0.1, &b, &zero)];
    let mut out = vec![0.0; n];
    let mut scratch = vec![0.0; n * n * 6];
    for (y, expected) in [(&a, &fresh[0]), (&b, &fresh[1]), (&a, &fresh[0]), (&a, &fresh[0])] {
        bound.outputs(0.1, &b, &mut scratch[..model.output_count()]);
        bound.parameter_derivative(0.1, y, &zero, &mut scratch[..n * THETA.len()]);
        bound.start_values(0, 0.7);
        bound.residual(0.1, y, &zero, &mut out);
        assert_eq!(&out, expected);
    }
}

#[test]
fn start_values_follow_parameters_and_other_start_values() {
    let model = cart_model();
    let n = model.dimension();
    let mut bound = Bound::new(&model, &Sines, &THETA);
    let rest = bound.start_values(0, 0.0);
    assert_eq!(rest.equilibrium, vec![false; n]);
    assert_eq!(rest.values[..4], [0.2, 0.4, 0.0, 0.0]);
    // The Maxwell state starts at the rod's elongation, which follows from the given positions.
    let expected = differences(&THETA, |theta| Bound::new(&model, &Sines, theta).start_values(0, 0.0).values);
    assert_columns(&rest.derivatives, &expected, n);
    assert!(rest.values[4] != 0.0 && rest.derivatives[5 * n + 4] != 0.0);

    let balanced = bound.start_values(1, 0.0);
    assert_eq!(balanced.equilibrium, [false, true, true, true, true]);
    assert_eq!(balanced.values[0], 0.2);
}

#[test]
fn identified_exponent_has_a_derivative_at_zero() {
    let mut b = Builder::new();
    let exponent = b.parameter("exponent", 1.7);
    let body = b.body("body", 2.0, [0.0; 3], [0.0; 6]);
    let (ground, end) = (b.attach(GROUND, [0.0; 3]), b.attach(Some(body), [0.0; 3]));
    let slide = b.joint("slide", Some(AxisMotion::Shift([0.0, 0.0, 1.0])), ground, end);
    b.force("drag", ForcePlace::Joint { joint: slide, axis: 0 }, |g, _, v| {
        let size = g.unary(Unary::Abs, v);
        g.binary(ident::expression::Binary::Power, size, exponent)
    });
    let model = Model::compile(&derive(&b.study).expect("derivable"));
    let mut values = [f64::NAN; 2];
    Bound::new(&model, &Sines, &[1.7]).parameter_derivative(0.0, &[0.0, 0.0], &[0.0; 2], &mut values);
    assert_eq!(values, [0.0, 0.0]);
}

#[test]
fn reach_tells_which_parameter_moves_which_output() {
    let mut b = cart();
    let idle = b.parameter("idle", 1.0);
    assert_eq!(b.study.graph.constant_value(idle), None);
    let model = Model::compile(&derive(&b.study).expect("derivable"));
    let reach = model.parameter_reach();
    assert!(reach[..6].iter().all(|outputs| outputs.iter().all(|&reached| reached)));
    assert!(reach[6].iter().all(|&reached| !reached));
}

fn dense_jacobian(model: &Model, theta: &[f64], t: f64, y: &[f64]) -> Vec<f64> {
    let mut bound = Bound::new(model, &Sines, theta);
    let pattern = bound.pattern().clone();
    let mut values = vec![0.0; pattern.len()];
    bound.jacobian(t, y, &vec![0.0; y.len()], 0.7, &mut values);
    let mut dense = vec![0.0; y.len() * y.len()];
    for ((row, column), value) in pattern.entries().zip(values) {
        dense[column * y.len() + row] = value;
    }
    dense
}

/// The matrix with intermediate results as further unknowns has the solution of the Jacobian itself.
#[test]
fn expanded_jacobian_has_the_solution_of_the_jacobian() {
    let system = derive(&cart().study).expect("derivable");
    let model = Model::compile_with(&system, DerivativeForm::Swept);
    let mut random = Random(5);
    let n = model.dimension();
    for trial in 0..10 {
        let (t, c) = (0.3 * f64::from(trial), 0.7 + 10.0 * f64::from(trial));
        let y: Vec<f64> = (0..n).map(|_| random.next()).collect();
        let scale: Vec<f64> = (0..n).map(|i| 10f64.powi(i as i32 % 5 - 2)).collect();
        let right: Vec<f64> = (0..n).map(|_| random.next()).collect();
        let mut bound = Bound::new(&model, &Sines, &THETA);
        let solve = |pattern: &SparsityPattern, values: &[f64]| {
            let mut factorisation = Factorisation::new(pattern);
            factorisation.factor(values).expect("regular");
            let mut solution = right.clone();
            solution.resize(pattern.column_count, 0.0);
            factorisation.solve(&mut solution);
            solution
        };
        let pattern = bound.expanded_pattern().expect("a large model's form").clone();
        let mut values = vec![0.0; pattern.len()];
        bound.expanded_jacobian(t, &y, c, &scale, &mut values);
        let expanded: Vec<f64> = solve(&pattern, &values).iter().zip(&scale).map(|(x, s)| x * s).collect();
        let pattern = bound.pattern().clone();
        let mut values = vec![0.0; pattern.len()];
        bound.jacobian(t, &y, &vec![0.0; n], c, &mut values);
        assert_close(&expanded, &solve(&pattern, &values), 1e-11);
    }
}

/// Both forms of derivatives are the same numbers: by variables, by parameters, of rates and of measures.
#[test]
fn swept_derivatives_equal_symbolic_ones() {
    let system = derive(&cart().study).expect("derivable");
    let [symbolic, swept] =
        [DerivativeForm::Symbolic, DerivativeForm::Swept].map(|form| Model::compile_with(&system, form));
    let mut random = Random(3);
    let (n, p, m) = (symbolic.dimension(), THETA.len(), symbolic.output_count());
    for trial in 0..20 {
        let t = 0.3 * f64::from(trial);
        let y: Vec<f64> = (0..n).map(|_| random.next()).collect();
        assert_close(&dense_jacobian(&swept, &THETA, t, &y), &dense_jacobian(&symbolic, &THETA, t, &y), 1e-13);
        let by_parameter = |model: &Model| {
            let mut values = vec![0.0; n * p];
            Bound::new(model, &Sines, &THETA).parameter_derivative(t, &y, &vec![0.0; n], &mut values);
            values
        };
        assert_close(&by_parameter(&swept), &by_parameter(&symbolic), 1e-13);
        let of_outputs = |model: &Model| {
            let (mut by_state, mut by_parameter) = (vec![0.0; m * n], vec![0.0; m * p]);
            Bound::new(model, &Sines, &THETA).output_derivatives(t, &y, &mut by_state, &mut by_parameter);
            [by_state, by_parameter].concat()
        };
        assert_close(&of_outputs(&swept), &of_outputs(&symbolic), 1e-13);
    }
    assert_eq!(swept.parameter_reach(), symbolic.parameter_reach());
}
