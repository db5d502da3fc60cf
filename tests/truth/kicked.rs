//! A mechanism with one coordinate that noise pushes at random.

/// The states (coordinate, rate) at all samples, one after the other: the drift by classical Runge-Kutta, the kicks
/// (root of the spectral density of the acceleration) by Euler and Maruyama, `substeps` of `h` between samples.
pub fn kicked(
    rates: impl Fn([f64; 2]) -> [f64; 2],
    start: [f64; 2],
    kick: f64,
    (substeps, h): (usize, f64),
    mut normal: impl FnMut() -> f64,
) -> impl Iterator<Item = [f64; 2]> {
    let mut state = start;
    let mut first = true;
    std::iter::from_fn(move || {
        for _ in 0..if std::mem::take(&mut first) { 0 } else { substeps } {
            let moved = |rate: [f64; 2], h: f64| [state[0] + h * rate[0], state[1] + h * rate[1]];
            let a = rates(state);
            let b = rates(moved(a, 0.5 * h));
            let c = rates(moved(b, 0.5 * h));
            let d = rates(moved(c, h));
            (0..2).for_each(|i| state[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
            if kick > 0.0 {
                state[1] += kick * h.sqrt() * normal();
            }
        }
        Some(state)
    })
}
