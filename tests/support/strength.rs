//! How strong a hidden effect is: the share of the outputs that it changes, everything else being equal.

use crate::truth::effect::Effect;
use crate::truth::mechanism::Mechanism;
use crate::truth::record::{excite, rms, strength};
use crate::truth::simulator::{PlaceHistory, Samples};

/// Class of strength by the rms change of the outputs; the noise is 1 % of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strength {
    /// About the noise.
    Weak,
    /// 3 to 10 %
    Medium,
    /// More than 10 %
    Strong,
}

impl Strength {
    /// Change of the outputs that a case of this class aims at.
    fn aim(self) -> f64 {
        match self {
            Strength::Weak => 0.012,
            Strength::Medium => 0.06,
            Strength::Strong => 0.18,
        }
    }

    /// Whether a measured change belongs to this class.
    pub fn contains(self, change: f64) -> bool {
        match self {
            Strength::Weak => (0.005..0.02).contains(&change),
            Strength::Medium => (0.03..0.10).contains(&change),
            Strength::Strong => change > 0.10,
        }
    }
}

/// Intensities searched: an effect's number is its natural scale times the intensity.
const INTENSITIES: (f64, f64) = (1e-5, 1e2);
/// The search ends when the change is this near to the aim.
const TOLERANCE: f64 = 0.1;
const BISECTIONS: usize = 20;

/// Shorter lags would be stiff for the simulator's fixed step, s.
const SHORTEST_LAG: f64 = 3e-4;

/// The effect with numbers such that it changes the outputs as much as its class says, and the change it makes.
pub fn calibrated(mechanism: &dyn Mechanism, effect: &str, place: &str, class: Strength, seed: u64) -> (Effect, f64) {
    let undisturbed = excite(mechanism, &Effect::Nothing, seed, 1.0);
    let change = |intensity: f64| {
        let candidate = scaled(mechanism, &undisturbed, effect, place, intensity, seed);
        let change = strength(&undisturbed, &excite(mechanism, &candidate, seed, 1.0));
        if change.is_finite() { (candidate, change) } else { (candidate, f64::INFINITY) }
    };
    let (mut low, mut high) = (INTENSITIES.0.ln(), INTENSITIES.1.ln());
    let mut reached = change((0.5 * (low + high)).exp());
    for _ in 0..BISECTIONS {
        if (reached.1 / class.aim() - 1.0).abs() < TOLERANCE {
            break;
        }
        let middle = 0.5 * (low + high);
        if reached.1 < class.aim() {
            low = middle
        } else {
            high = middle
        }
        reached = change((0.5 * (low + high)).exp());
    }
    reached
}

/// The effect of this name at this place, its strength `intensity` times the place's natural scale.
fn scaled(
    mechanism: &dyn Mechanism,
    undisturbed: &Samples,
    effect: &str,
    place: &str,
    intensity: f64,
    seed: u64,
) -> Effect {
    match effect {
        "input_delay" => Effect::InputDelay { time: 0.1 * intensity },
        "sensor_offset" | "sensor_lag" => {
            let channel = mechanism.channel(place).unwrap_or_else(|| panic!("no channel {place}"));
            match effect {
                "sensor_lag" => Effect::SensorLag { channel, time: (0.1 * intensity).max(SHORTEST_LAG) },
                _ => Effect::SensorOffset { channel, value: intensity * rms(&undisturbed.channels[channel]) },
            }
        }
        _ => {
            let index = mechanism.place(place).unwrap_or_else(|| panic!("no place {place}"));
            let load = typical_load(mechanism, undisturbed, index);
            at_place(effect, index, &undisturbed.places[index], load, intensity, seed)
        }
    }
}

fn at_place(effect: &str, place: usize, history: &PlaceHistory, load: f64, intensity: f64, seed: u64) -> Effect {
    let (x, v) = (rms(&history.x), rms(&history.v));
    match effect {
        "dry_friction" => Effect::DryFriction { place, load: intensity * load },
        "viscous_damping" => Effect::ViscousDamping { place, slope: intensity * load / v },
        "quadratic_drag" => Effect::QuadraticDrag { place, factor: intensity * load / (v * v) },
        "cubic_stiffness" => Effect::CubicStiffness { place, factor: intensity * load / x.powi(3) },
        "backlash" => Effect::Backlash { place, gap: intensity * x },
        "end_stop" => Effect::EndStop { place, gap: peak(&history.x) / (1.0 + intensity), stiffness: 20.0 * load / x },
        "damper_saturation" => Effect::DamperSaturation { place, knee: v / intensity, ratio: 0.25 },
        "actuator_limit" => Effect::LoadLimit { place, limit: peak(&history.load) / (1.0 + intensity) },
        "harmonic_disturbance" => {
            // A frequency that no excitation line is tied to, different from case to case.
            let frequency = 2.0 + (seed % 7) as f64 * 0.43;
            Effect::HarmonicDisturbance { place, amplitude: intensity * load, frequency, phase: 0.7 }
        }
        other => panic!("no truth for {other}"),
    }
}

/// rms load of the strongest law that moves the place's coordinate in the same kind of motion.
fn typical_load(mechanism: &dyn Mechanism, undisturbed: &Samples, place: usize) -> f64 {
    let motion = mechanism.places()[place].motion;
    let loads = mechanism.places().iter().zip(&undisturbed.places);
    let strongest = loads.filter(|(other, _)| other.motion == motion).map(|(_, history)| rms(&history.load));
    let largest = strongest.fold(0.0, f64::max);
    // The crane's swing is driven by gravity alone: 1 N*m is of its order.
    if largest > 0.0 { largest } else { 1.0 }
}

fn peak(values: &[f64]) -> f64 {
    values.iter().map(|value| value.abs()).fold(0.0, f64::max)
}
