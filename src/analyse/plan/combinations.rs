//! Which of the offered tests and sensors belong together: exactly where the choices can be counted, else one after the
//! other.

use super::add;
use schemars::JsonSchema;
use serde::Serialize;

/// Choices of tests and sensors up to this number are all looked at.
const COUNTABLE: usize = 4096;
/// A larger choice is listed only where it is better by this share than every smaller one.
const WORTH: f64 = 0.05;
/// Tests of one choice.
const MOST_TESTS: usize = 3;

/// The best choice of so many tests and sensors by one measure.
#[derive(Clone, Debug, JsonSchema, PartialEq, Serialize)]
pub struct Combination {
    /// `D`, `A` or the name of a criterion.
    pub measure: String,
    /// Names of manoeuvres.
    pub excitations: Vec<String>,
    /// Names of measures.
    pub sensors: Vec<String>,
    /// D- or A-measure as a share of the bounds, or the criterion's standard deviation in its unit.
    pub value: f64,
    /// The same with everything that is offered.
    pub with_everything: f64,
    /// All choices of this size were looked at; otherwise the choice grew test by test and sensor by sensor.
    pub exact: bool,
}

/// What an information matrix is worth: directions that stay undetermined, and the measures (`None` where one is
/// infinite).
#[derive(Clone, Debug)]
pub(super) struct Worth {
    pub undetermined: usize,
    pub measures: Vec<Option<f64>>,
}

impl Worth {
    /// Smaller is better: first the measure itself, where it is finite; then what is still open.
    fn rank(&self, measure: usize) -> (usize, f64) {
        match self.measures[measure] {
            Some(value) => (0, value),
            None => (1 + self.undetermined, f64::INFINITY),
        }
    }
}

/// What is offered: information per test and sensor, beside what is known `before`.
pub(super) struct Offer<'a> {
    pub before: &'a [f64],
    /// Per test, per sensor.
    pub information: &'a [Vec<Vec<f64>>],
    pub worth: &'a (dyn Fn(&[f64]) -> Worth + Sync),
}

/// Indices of tests and sensors.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Choice {
    pub tests: Vec<usize>,
    pub sensors: Vec<usize>,
}

/// A choice with the value it has by one measure.
pub(super) struct Chosen {
    pub choice: Choice,
    pub value: f64,
    pub exact: bool,
}

impl Offer<'_> {
    fn worth_of(&self, choice: &Choice) -> Worth {
        let mut sum = self.before.to_vec();
        for &test in &choice.tests {
            choice.sensors.iter().for_each(|&sensor| add(&mut sum, &self.information[test][sensor]));
        }
        (self.worth)(&sum)
    }

    /// Per measure the best choices by growing size; of equal size in tests and sensors the best one, and only what
    /// smaller choices do not reach.
    pub fn best(&self, measures: usize) -> Vec<Vec<Chosen>> {
        let (tests, sensors) = (self.information.len(), self.information.first().map_or(0, Vec::len));
        let exact = tests + sensors < usize::BITS as usize && 1usize << (tests + sensors) <= COUNTABLE;
        let choices = if exact { Some(self.all(tests, sensors)) } else { None };
        let best_of = |measure: usize| -> Vec<(Choice, (usize, f64))> {
            match &choices {
                Some(all) => best_per_size(all, measure),
                None => self.grown(measure, tests, sensors),
            }
        };
        (0..measures).map(|measure| efficient(best_of(measure), exact)).collect()
    }

    fn all(&self, tests: usize, sensors: usize) -> Vec<(Choice, Worth)> {
        use rayon::prelude::*;
        let members = |set: usize, of: usize| (0..of).filter(|k| set >> k & 1 == 1).collect::<Vec<usize>>();
        let mut choices: Vec<Choice> = Vec::new();
        for test_set in 1..1usize << tests {
            for sensor_set in 1..1usize << sensors {
                choices.push(Choice { tests: members(test_set, tests), sensors: members(sensor_set, sensors) });
            }
        }
        choices.retain(|choice| choice.tests.len() <= MOST_TESTS || choice.tests.len() == tests);
        choices.into_par_iter().map(|choice| (choice.clone(), self.worth_of(&choice))).collect()
    }

    /// For one to three tests the sensors one after the other, each time the one that helps most, then exchanged as
    /// long as that helps.
    fn grown(&self, measure: usize, tests: usize, sensors: usize) -> Vec<(Choice, (usize, f64))> {
        let everything: Vec<usize> = (0..sensors).collect();
        let mut found = Vec::new();
        let mut chosen_tests: Vec<usize> = Vec::new();
        for _ in 0..MOST_TESTS.min(tests) {
            let next = best_addition(tests, &chosen_tests, |tests| {
                self.worth_of(&Choice { tests: tests.to_vec(), sensors: everything.clone() }).rank(measure)
            });
            let Some((_, next)) = next else { break };
            chosen_tests = next;
            let rank = |own: &[usize]| {
                self.worth_of(&Choice { tests: chosen_tests.clone(), sensors: own.to_vec() }).rank(measure)
            };
            let mut own: Vec<usize> = Vec::new();
            while let Some((value, grown)) = best_addition(sensors, &own, rank) {
                let (value, exchanged) = exchanged(sensors, grown, value, rank);
                found.push((Choice { tests: chosen_tests.clone(), sensors: exchanged.clone() }, value));
                own = exchanged;
            }
        }
        found
    }
}

/// The set with the member that ranks best added; `None` where nothing is left to add.
fn best_addition(
    of: usize,
    set: &[usize],
    rank: impl Fn(&[usize]) -> (usize, f64),
) -> Option<((usize, f64), Vec<usize>)> {
    let with = |k: usize| -> Vec<usize> {
        let mut grown: Vec<usize> = set.iter().copied().chain([k]).collect();
        grown.sort_unstable();
        grown
    };
    let candidates = (0..of).filter(|k| !set.contains(k)).map(with);
    candidates.map(|grown| (rank(&grown), grown)).min_by(|a, b| compared(&a.0, &b.0))
}

/// Single members exchanged for others while the rank improves.
fn exchanged(
    of: usize,
    mut set: Vec<usize>,
    mut value: (usize, f64),
    rank: impl Fn(&[usize]) -> (usize, f64),
) -> ((usize, f64), Vec<usize>) {
    loop {
        let mut better = None;
        for place in 0..set.len() {
            for k in (0..of).filter(|k| !set.contains(k)) {
                let mut other = set.clone();
                other[place] = k;
                other.sort_unstable();
                let own = rank(&other);
                if compared(&own, better.as_ref().map_or(&value, |(best, _)| best)).is_lt() {
                    better = Some((own, other));
                }
            }
        }
        match better {
            Some((own, other)) => (value, set) = (own, other),
            None => return (value, set),
        }
    }
}

fn compared(a: &(usize, f64), b: &(usize, f64)) -> std::cmp::Ordering {
    a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
}

/// Of every size the choice that ranks best; of equals the first.
fn best_per_size(all: &[(Choice, Worth)], measure: usize) -> Vec<(Choice, (usize, f64))> {
    let mut best: Vec<(Choice, (usize, f64))> = Vec::new();
    for (choice, worth) in all {
        let rank = worth.rank(measure);
        let same = |other: &(Choice, (usize, f64))| {
            other.0.tests.len() == choice.tests.len() && other.0.sensors.len() == choice.sensors.len()
        };
        match best.iter_mut().find(|other| same(other)) {
            Some(other) if compared(&rank, &other.1).is_lt() => *other = (choice.clone(), rank),
            Some(_) => {}
            None => best.push((choice.clone(), rank)),
        }
    }
    best
}

/// Choices that determine the measure and that no choice with as few tests and as few sensors reaches but for a trifle.
fn efficient(mut found: Vec<(Choice, (usize, f64))>, exact: bool) -> Vec<Chosen> {
    found.retain(|(_, (open, _))| *open == 0);
    found.sort_by_key(|(choice, _)| (choice.tests.len() + choice.sensors.len(), choice.tests.len()));
    let mut kept: Vec<Chosen> = Vec::new();
    for (choice, (_, value)) in found {
        let reached = |other: &Chosen| {
            other.choice.tests.len() <= choice.tests.len()
                && other.choice.sensors.len() <= choice.sensors.len()
                && other.value <= (1.0 + WORTH) * value
        };
        if !kept.iter().any(reached) {
            kept.push(Chosen { choice, value, exact });
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three parameters, each seen by one sensor; the measure is the sum of the variances.
    fn worth(information: &[f64]) -> Worth {
        let diagonal: Vec<f64> = (0..3).map(|j| information[4 * j]).collect();
        let undetermined = diagonal.iter().filter(|value| **value <= 0.0).count();
        let sum = diagonal.iter().map(|value| 1.0 / value).sum();
        Worth { undetermined, measures: vec![(undetermined == 0).then_some(sum)] }
    }

    fn information(diagonal: [f64; 3]) -> Vec<f64> {
        let mut matrix = vec![0.0; 9];
        (0..3).for_each(|j| matrix[4 * j] = diagonal[j]);
        matrix
    }

    fn offered() -> Vec<Vec<Vec<f64>>> {
        let test = |strength: f64| {
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.9, 0.9]]
                .map(|own| information(own.map(|value| strength * value)))
                .to_vec()
        };
        vec![test(1.0), test(10.0)]
    }

    #[test]
    fn counting_and_growing_find_the_same() {
        let (before, offered) = (vec![0.0; 9], offered());
        let offer = Offer { before: &before, information: &offered, worth: &worth };
        let counted = &offer.best(1)[0];
        // The strong test with the sensor of the first parameter and the one that sees the two others.
        assert_eq!(counted[0].choice, Choice { tests: vec![1], sensors: vec![0, 3] });
        assert!((counted[0].value - (0.1 + 2.0 / 9.0)).abs() < 1e-12 && counted[0].exact);
        let grown = efficient(offer.grown(0, 2, 4), false);
        for (a, b) in counted.iter().zip(&grown).take(3) {
            assert_eq!(a.choice, b.choice);
        }
        // More is listed only where it helps.
        for (k, larger) in counted.iter().enumerate() {
            let contained = |smaller: &&Chosen| {
                let (own, of) = (&smaller.choice, &larger.choice);
                own.tests.len() <= of.tests.len() && own.sensors.len() <= of.sensors.len()
            };
            assert!(counted[..k].iter().filter(contained).all(|smaller| larger.value < smaller.value));
        }
        assert!(counted.len() > 2);
    }
}
