//! What a record hides. Places and channels are indices into the mechanism's own lists.

/// One effect at one place, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Effect {
    Nothing,
    /// Coulomb friction that sticks and slips; `load` is both the sliding and the break-away load.
    DryFriction {
        place: usize,
        load: f64,
    },
    /// `-slope v`
    ViscousDamping {
        place: usize,
        slope: f64,
    },
    /// `-factor v |v|`
    QuadraticDrag {
        place: usize,
        factor: f64,
    },
    /// `-factor x^3`
    CubicStiffness {
        place: usize,
        factor: f64,
    },
    /// The law at `place` feels its elongation only beyond `gap/2` on either side.
    Backlash {
        place: usize,
        gap: f64,
    },
    /// Elastic stops at `+-gap`.
    EndStop {
        place: usize,
        gap: f64,
        stiffness: f64,
    },
    /// The law's load grows with `ratio` of its slope beyond the transition velocity `knee`.
    DamperSaturation {
        place: usize,
        knee: f64,
        ratio: f64,
    },
    /// The law's load is clipped at `+-limit`.
    LoadLimit {
        place: usize,
        limit: f64,
    },
    /// The input reaches the mechanism late.
    InputDelay {
        time: f64,
    },
    SensorOffset {
        channel: usize,
        value: f64,
    },
    /// The channel passes a first-order lag.
    SensorLag {
        channel: usize,
        time: f64,
    },
    /// `amplitude sin(2 pi frequency t + phase)` as additional load.
    HarmonicDisturbance {
        place: usize,
        amplitude: f64,
        frequency: f64,
        phase: f64,
    },
}

impl Effect {
    /// Load at `place` as the effect leaves it; `law` is the undisturbed law as a function of its elongation, already
    /// evaluated at the other quantities. Dry friction is added by the simulator, which knows whether it sticks.
    pub fn load(&self, place: usize, x: f64, v: f64, t: f64, law: impl Fn(f64) -> f64) -> f64 {
        match *self {
            Effect::ViscousDamping { place: at, slope } if at == place => law(x) - slope * v,
            Effect::QuadraticDrag { place: at, factor } if at == place => law(x) - factor * v * v.abs(),
            Effect::CubicStiffness { place: at, factor } if at == place => law(x) - factor * x * x * x,
            Effect::Backlash { place: at, gap } if at == place => law(beyond(x, gap / 2.0)),
            Effect::EndStop { place: at, gap, stiffness } if at == place => law(x) - stiffness * beyond(x, gap),
            Effect::DamperSaturation { place: at, knee, ratio } if at == place => {
                law(x) * (ratio + (1.0 - ratio) / (1.0 + (v / knee).powi(2)).sqrt())
            }
            Effect::LoadLimit { place: at, limit } if at == place => law(x).clamp(-limit, limit),
            Effect::HarmonicDisturbance { place: at, amplitude, frequency, phase } if at == place => {
                law(x) + amplitude * (std::f64::consts::TAU * frequency * t + phase).sin()
            }
            _ => law(x),
        }
    }

    /// Which smooth piece of a kinked law holds; the simulator never steps across a change of it.
    pub fn piece(&self, place: usize, x: f64, unclipped: f64) -> i8 {
        let piece_of = |value: f64, limit: f64| i8::from(value > limit) - i8::from(value < -limit);
        match *self {
            Effect::Backlash { place: at, gap } if at == place => piece_of(x, gap / 2.0),
            Effect::EndStop { place: at, gap, .. } if at == place => piece_of(x, gap),
            Effect::LoadLimit { place: at, limit } if at == place => piece_of(unclipped, limit),
            _ => 0,
        }
    }

    /// Delay of the input in s.
    pub fn delay(&self) -> f64 {
        match *self {
            Effect::InputDelay { time } => time,
            _ => 0.0,
        }
    }

    /// Place and load of dry friction.
    pub fn dry_friction(&self) -> Option<(usize, f64)> {
        match *self {
            Effect::DryFriction { place, load } => Some((place, load)),
            _ => None,
        }
    }

    /// Channel and time constant of a lagging sensor.
    pub fn lag(&self) -> Option<(usize, f64)> {
        match *self {
            Effect::SensorLag { channel, time } => Some((channel, time)),
            _ => None,
        }
    }

    /// Offset of `channel`.
    pub fn offset(&self, channel: usize) -> f64 {
        match *self {
            Effect::SensorOffset { channel: at, value } if at == channel => value,
            _ => 0.0,
        }
    }
}

/// The part of `x` beyond `+-limit`.
fn beyond(x: f64, limit: f64) -> f64 {
    x - x.clamp(-limit, limit)
}
