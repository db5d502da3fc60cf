//! Coefficients of the explicit Runge-Kutta pair of order 5 (4) of Tsitouras-2011, with its interpolant of order 4.

use super::dormand_prince::Row;

/// Stages, the last of which is the first of the next step.
pub(super) const STAGES: usize = 7;

/// Times of the stages as shares of the step.
pub(super) const NODES: [f64; STAGES] = [0.0, 0.161, 0.327, 0.9, 0.980_025_540_904_509_7, 1.0, 1.0];

const STAGE_2: [f64; 1] = [0.161];
const STAGE_3: [f64; 2] = [-0.008_480_655_492_356_989, 0.335_480_655_492_357];
const STAGE_4: [f64; 3] = [2.897_153_057_105_493_5, -6.359_448_489_975_075, 4.362_295_432_869_581_5];
const STAGE_5: [f64; 4] =
    [5.325_864_828_439_257, -11.748_883_564_062_828, 7.495_539_342_889_836_5, -0.092_495_066_361_755_25];
const STAGE_6: [f64; 5] = [
    5.861_455_442_946_42,
    -12.920_969_317_847_11,
    8.159_367_898_576_159,
    -0.071_584_973_281_401,
    -0.028_269_050_394_068_38,
];
/// The solution of order 5.
const WEIGHTS: [f64; 6] = [
    0.096_460_766_818_065_23,
    0.01,
    0.479_889_650_414_499_6,
    1.379_008_574_103_742,
    -3.290_069_515_436_081,
    2.324_710_524_099_774,
];
/// Difference to the solution of order 4.
const ERROR: [f64; STAGES] = [
    -0.001_780_011_052_225_777,
    -0.000_816_434_459_656_746_9,
    0.007_880_878_010_261_995,
    -0.144_711_007_173_262_9,
    0.582_357_165_452_555_2,
    -0.458_082_105_929_186_97,
    1.0 / 66.0,
];

/// Difference of the solution of order 3 of the first four stages.
const THIRD: [f64; STAGES - 1] = [
    -0.034_490_698_858_406_554,
    -0.043_458_252_500_075_116,
    0.164_006_662_733_602_84,
    -1.051_416_702_711_428,
    3.290_069_515_436_081,
    -2.324_710_524_099_774,
];

const fn row<const N: usize>(weights: [f64; N]) -> [(usize, f64); N] {
    let mut row = [(0, 0.0); N];
    let mut stage = 0;
    while stage < N {
        row[stage] = (stage, weights[stage]);
        stage += 1;
    }
    row
}

/// Weights of the earlier stages in the arguments of the stages from the second on; the last row is the solution.
pub(super) const ROWS: [Row; STAGES - 1] =
    [&row(STAGE_2), &row(STAGE_3), &row(STAGE_4), &row(STAGE_5), &row(STAGE_6), &row(WEIGHTS)];
pub(super) const ERROR_ROW: Row = &row(ERROR);
pub(super) const THIRD_ROW: Row = &row(THIRD);

/// The method is stable for real eigenvalues down to `-STABILITY / h`.
pub(super) const STABILITY: f64 = 3.5;

/// The stages with their weights for the solution at the share `x` of the step.
pub(super) fn interpolation(x: f64) -> [(usize, f64); STAGES] {
    let square = x * x;
    let weights = [
        -1.053_088_497_729_021_6
            * x
            * (x - 1.329_989_018_975_141)
            * (square - 1.436_402_854_171_635_1 * x + 0.713_981_691_707_420_9),
        0.1017 * square * (square - 2.196_656_833_824_975_4 * x + 1.294_985_250_737_463),
        2.490_627_285_651_253 * square * (square - 2.385_356_454_720_616_5 * x + 1.578_034_682_080_925),
        -16.548_102_889_244_902 * (x - 1.217_129_272_955_332_4) * (x - 0.616_204_060_378_000_9) * square,
        47.379_521_962_819_28 * (x - 1.203_071_208_372_362_6) * (x - 0.658_047_292_653_547_4) * square,
        -34.870_657_861_496_61 * (x - 1.2) * (x - 2.0 / 3.0) * square,
        2.5 * (x - 1.0) * (x - 0.6) * square,
    ];
    std::array::from_fn(|stage| (stage, weights[stage]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows() -> Vec<Vec<f64>> {
        let mut rows = vec![vec![]];
        rows.extend([&STAGE_2[..], &STAGE_3, &STAGE_4, &STAGE_5, &STAGE_6, &WEIGHTS].map(<[f64]>::to_vec));
        rows
    }

    /// `A v`
    fn apply(v: &[f64]) -> Vec<f64> {
        rows().iter().map(|row| row.iter().zip(v).map(|(a, b)| a * b).sum()).collect()
    }

    fn dot(weights: &[f64], v: &[f64]) -> f64 {
        weights.iter().zip(v).map(|(a, b)| a * b).sum()
    }

    fn times(a: &[f64], b: &[f64]) -> Vec<f64> {
        a.iter().zip(b).map(|(a, b)| a * b).collect()
    }

    /// Elementary weights of all rooted trees up to order 5 with the values an exact solution has
    /// (Hairer-Norsett-Wanner-1993, table II.2.2).
    fn trees() -> Vec<(usize, Vec<f64>, f64)> {
        let one = vec![1.0; STAGES];
        let c = NODES.to_vec();
        let c2 = times(&c, &c);
        let c3 = times(&c2, &c);
        let (ac, ac2, ac3) = (apply(&c), apply(&c2), apply(&c3));
        let (aac, aac2) = (apply(&ac), apply(&ac2));
        vec![
            (1, one, 1.0),
            (2, c.clone(), 2.0),
            (3, c2.clone(), 3.0),
            (3, ac.clone(), 6.0),
            (4, c3.clone(), 4.0),
            (4, times(&c, &ac), 8.0),
            (4, ac2.clone(), 12.0),
            (4, aac.clone(), 24.0),
            (5, times(&c3, &c), 5.0),
            (5, times(&c2, &ac), 10.0),
            (5, times(&c, &ac2), 15.0),
            (5, times(&c, &aac), 30.0),
            (5, times(&ac, &ac), 20.0),
            (5, ac3, 20.0),
            (5, apply(&times(&c, &ac)), 40.0),
            (5, aac2, 60.0),
            (5, apply(&aac), 120.0),
        ]
    }

    #[test]
    fn rows_sum_to_the_nodes() {
        for (row, node) in rows().iter().zip(NODES) {
            assert!((row.iter().sum::<f64>() - node).abs() < 1e-14);
        }
    }

    #[test]
    fn solution_has_order_5_and_the_error_estimate_order_4() {
        let mut weights = WEIGHTS.to_vec();
        weights.push(0.0);
        let mut seen = 0.0f64;
        for (order, tree, density) in trees() {
            assert!((dot(&weights, &tree) - 1.0 / density).abs() < 1e-14, "order {order}, density {density}");
            let error = dot(&ERROR, &tree).abs();
            if order <= 4 {
                assert!(error < 1e-14, "order {order}, density {density}: {error}");
            } else {
                seen = seen.max(error);
            }
        }
        assert!(seen > 1e-5, "the estimate sees terms of order 5");
    }

    #[test]
    fn the_second_estimate_has_order_3() {
        let mut weights = THIRD.to_vec();
        weights.push(0.0);
        for (order, tree, density) in trees().into_iter().filter(|(order, ..)| *order <= 4) {
            let error = dot(&weights, &tree).abs();
            assert_eq!(error < 1e-13, order <= 3, "order {order}, density {density}: {error}");
        }
    }

    #[test]
    fn interpolant_has_order_4_everywhere_and_meets_the_ends() {
        for step in 0..=10 {
            let x = step as f64 / 10.0;
            let weights = interpolation(x).map(|(_, weight)| weight);
            for (order, tree, density) in trees().into_iter().filter(|(order, ..)| *order <= 4) {
                let exact = x.powi(order as i32) / density;
                assert!((dot(&weights, &tree) - exact).abs() < 1e-13, "x {x}, order {order}");
            }
        }
        for ((_, a), b) in interpolation(1.0).into_iter().zip(WEIGHTS) {
            assert!((a - b).abs() < 1e-13);
        }
    }
}
