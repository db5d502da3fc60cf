//! Fixed-step integration with exact switching.

use super::effect::Effect;
use super::mechanism::{Instant, Mechanism, Vector};

/// No mechanism here has more coordinates.
pub const COORDINATES: usize = 3;

/// Steps are halved this often to locate a switching instant: 50 halvings of 0.1 ms are below the clock's resolution.
const BISECTIONS: usize = 50;

/// Progress past a switching instant in s, so that two at the same place cannot hold the clock.
const SHORTEST_STEP: f64 = 1e-13;

/// Sampled noise-free channels in SI.
pub struct Samples {
    pub time: Vec<f64>,
    pub input: Vec<f64>,
    /// `channels[channel][sample]`
    pub channels: Vec<Vec<f64>>,
    /// Motion and load of every place.
    pub places: Vec<PlaceHistory>,
}

/// Elongation, rate and load of a place at the samples.
#[derive(Clone, Default)]
pub struct PlaceHistory {
    pub x: Vec<f64>,
    pub v: Vec<f64>,
    pub load: Vec<f64>,
}

/// Contact state of the dry friction.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Contact {
    None,
    Stick,
    /// Direction of sliding.
    Slip(f64),
}

#[derive(Clone, Copy, Debug)]
struct State {
    q: Vector,
    v: Vector,
    /// Output of the lagging sensor.
    sensor: f64,
}

struct Motion {
    a: Vector,
    loads: Vec<f64>,
}

struct Simulator<'a> {
    mechanism: &'a dyn Mechanism,
    effect: &'a Effect,
    input: &'a dyn Fn(f64) -> f64,
}

/// Simulates from rest in the reference configuration; samples at `0, h, 2h, ..` with `h = 1/sampling`.
pub fn simulate(mechanism: &dyn Mechanism, effect: &Effect, input: &dyn Fn(f64) -> f64) -> Samples {
    let start = State { q: [0.0; COORDINATES], v: [0.0; COORDINATES], sensor: 0.0 };
    Simulator { mechanism, effect, input }.run(start)
}

/// Simulates from the given coordinates and velocities.
pub fn simulate_from(
    mechanism: &dyn Mechanism,
    effect: &Effect,
    input: &dyn Fn(f64) -> f64,
    q: Vector,
    v: Vector,
) -> Samples {
    Simulator { mechanism, effect, input }.run(State { q, v, sensor: 0.0 })
}

impl Simulator<'_> {
    fn run(&self, mut state: State) -> Samples {
        let schedule = self.mechanism.schedule();
        let samples = (schedule.duration * schedule.sampling).round() as usize + 1;
        let step = 1.0 / (schedule.sampling * schedule.substeps as f64);
        let mut contact = self.initial_contact(&state);
        let mut out = Samples {
            time: vec![],
            input: vec![],
            channels: vec![vec![]; self.mechanism.channels().len()],
            places: vec![PlaceHistory::default(); self.mechanism.places().len()],
        };
        for sample in 0..samples {
            let t = sample as f64 / schedule.sampling;
            out.time.push(t);
            out.input.push((self.input)(t));
            for (channel, value) in self.measured(t, &state, contact).into_iter().enumerate() {
                out.channels[channel].push(value);
            }
            self.observe_places(t, &state, contact, &mut out.places);
            for substep in 0..schedule.substeps {
                self.advance(t + substep as f64 * step, step, &mut state, &mut contact);
            }
        }
        out
    }

    fn observe_places(&self, t: f64, state: &State, contact: Contact, histories: &mut [PlaceHistory]) {
        let loads = self.motion(t, state, contact).loads;
        for ((place, history), load) in self.mechanism.places().iter().zip(histories).zip(loads) {
            history.x.push(place.of(&state.q));
            history.v.push(place.of(&state.v));
            history.load.push(load);
        }
    }

    fn initial_contact(&self, state: &State) -> Contact {
        match self.effect.dry_friction() {
            None => Contact::None,
            Some(_) => self.contact_at_rest(0.0, state),
        }
    }

    /// One fine step, cut at every switching instant inside it.
    fn advance(&self, mut t: f64, step: f64, state: &mut State, contact: &mut Contact) {
        let end = t + step;
        while end - t > 1e-15 {
            let remaining = end - t;
            let next = self.runge_kutta(t, remaining, state, *contact);
            if !self.switches(t, state, t + remaining, &next, *contact) {
                *state = next;
                return;
            }
            let (mut inside, mut outside) = (0.0, remaining);
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (inside + outside);
                let candidate = self.runge_kutta(t, middle, state, *contact);
                if self.switches(t, state, t + middle, &candidate, *contact) {
                    outside = middle;
                } else {
                    inside = middle;
                }
            }
            let outside = outside.max(SHORTEST_STEP);
            let reached = self.runge_kutta(t, outside, state, *contact);
            t += outside;
            *contact = match *contact {
                Contact::Slip(direction) if direction * self.friction_rate(&reached) <= 0.0 => {
                    self.contact_at_rest(t, &reached)
                }
                Contact::Stick if self.breaks_away(t, &reached) => self.slip_from_rest(t, &reached),
                same => same,
            };
            *state = reached;
        }
    }

    /// Whether contact or the piece of a kinked law changes between two states.
    fn switches(&self, t0: f64, first: &State, t1: f64, second: &State, contact: Contact) -> bool {
        let contact_ends = match contact {
            Contact::None => false,
            Contact::Stick => self.breaks_away(t1, second),
            Contact::Slip(direction) => direction * self.friction_rate(second) <= 0.0,
        };
        contact_ends || self.pieces(t0, first).ne(self.pieces(t1, second))
    }

    fn pieces<'b>(&'b self, t: f64, state: &'b State) -> impl Iterator<Item = i8> + 'b {
        let input = (self.input)(t - self.effect.delay());
        self.mechanism.places().iter().enumerate().map(move |(index, place)| {
            let (x, v) = (place.of(&state.q), place.of(&state.v));
            self.effect.piece(index, x, self.mechanism.law(index, x, v, input))
        })
    }

    fn friction_rate(&self, state: &State) -> f64 {
        self.effect.dry_friction().map_or(0.0, |(place, _)| self.mechanism.places()[place].of(&state.v))
    }

    /// Stick if the break-away load can hold the contact, else slip.
    fn contact_at_rest(&self, t: f64, state: &State) -> Contact {
        if self.breaks_away(t, state) { self.slip_from_rest(t, state) } else { Contact::Stick }
    }

    /// Sliding starts against the holding load.
    fn slip_from_rest(&self, t: f64, state: &State) -> Contact {
        Contact::Slip(-self.holding_load(t, state).signum())
    }

    fn breaks_away(&self, t: f64, state: &State) -> bool {
        self.effect.dry_friction().is_some_and(|(_, load)| self.holding_load(t, state).abs() > load)
    }

    /// Friction load that keeps the relative velocity of the contact constant; the acceleration is affine in it.
    fn holding_load(&self, t: f64, state: &State) -> f64 {
        let Some((index, _)) = self.effect.dry_friction() else { return 0.0 };
        let place = &self.mechanism.places()[index];
        let free = place.of(&self.motion_with_friction(t, state, 0.0).a);
        let unit = place.of(&self.motion_with_friction(t, state, 1.0).a);
        -free / (unit - free)
    }

    fn motion(&self, t: f64, state: &State, contact: Contact) -> Motion {
        let friction = match (contact, self.effect.dry_friction()) {
            (Contact::Stick, _) => self.holding_load(t, state),
            (Contact::Slip(direction), Some((_, load))) => -direction * load,
            _ => 0.0,
        };
        self.motion_with_friction(t, state, friction)
    }

    fn motion_with_friction(&self, t: f64, state: &State, friction: f64) -> Motion {
        let input = (self.input)(t - self.effect.delay());
        let friction_place = self.effect.dry_friction().map(|(place, _)| place);
        let mut force = [0.0; COORDINATES];
        let mut loads = Vec::with_capacity(self.mechanism.places().len());
        for (index, place) in self.mechanism.places().iter().enumerate() {
            let (x, v) = (place.of(&state.q), place.of(&state.v));
            let mut load = self.effect.load(index, x, v, t, |x| self.mechanism.law(index, x, v, input));
            if friction_place == Some(index) {
                load += friction;
            }
            for (total, incidence) in force.iter_mut().zip(place.incidence) {
                *total += incidence * load;
            }
            loads.push(load);
        }
        Motion { a: self.mechanism.accelerations(&state.q, &state.v, &force), loads }
    }

    /// Channels before the sensors.
    fn true_channels(&self, t: f64, state: &State, contact: Contact) -> (Vector, Vec<f64>) {
        let motion = self.motion(t, state, contact);
        let instant = Instant { q: &state.q, v: &state.v, a: &motion.a, loads: &motion.loads };
        let values = self.mechanism.measure(&instant);
        (motion.a, values)
    }

    fn measured(&self, t: f64, state: &State, contact: Contact) -> Vec<f64> {
        let (_, mut values) = self.true_channels(t, state, contact);
        if let Some((channel, _)) = self.effect.lag() {
            values[channel] = state.sensor;
        }
        for (channel, value) in values.iter_mut().enumerate() {
            *value += self.effect.offset(channel);
        }
        values
    }

    fn derivative(&self, t: f64, state: &State, contact: Contact) -> State {
        match self.effect.lag() {
            None => State { q: state.v, v: self.motion(t, state, contact).a, sensor: 0.0 },
            Some((channel, time)) => {
                let (a, values) = self.true_channels(t, state, contact);
                State { q: state.v, v: a, sensor: (values[channel] - state.sensor) / time }
            }
        }
    }

    fn runge_kutta(&self, t: f64, step: f64, state: &State, contact: Contact) -> State {
        let k1 = self.derivative(t, state, contact);
        let k2 = self.derivative(t + 0.5 * step, &shifted(state, 0.5 * step, &k1), contact);
        let k3 = self.derivative(t + 0.5 * step, &shifted(state, 0.5 * step, &k2), contact);
        let k4 = self.derivative(t + step, &shifted(state, step, &k3), contact);
        let sum = shifted(&shifted(&shifted(&k1, 2.0, &k2), 2.0, &k3), 1.0, &k4);
        shifted(state, step / 6.0, &sum)
    }
}

/// `state + factor * rate`
fn shifted(state: &State, factor: f64, rate: &State) -> State {
    let mut result = *state;
    for index in 0..COORDINATES {
        result.q[index] += factor * rate.q[index];
        result.v[index] += factor * rate.v[index];
    }
    result.sensor += factor * rate.sensor;
    result
}
