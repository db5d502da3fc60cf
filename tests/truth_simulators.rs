//! The truth simulators against analytic solutions, conservation laws and themselves at other steps.

mod truth;

use truth::crane_pendulum::CranePendulum;
use truth::effect::Effect;
use truth::mechanism::{Channel, Instant, Mechanism, Motion, Place, Schedule, Vector};
use truth::quarter_vehicle::{Branch, QuarterVehicle};
use truth::record::{Record, excite, rms, strength};
use truth::simulator::{simulate, simulate_from};
use truth::spring_slide::SpringSlide;
use truth::two_mass::TwoMass;

const MECHANISMS: [&str; 4] = ["quarter_vehicle", "two_mass", "crane_pendulum", "spring_slide"];

/// The same mechanism with another number of fine steps.
struct Refined<'a> {
    mechanism: &'a dyn Mechanism,
    factor: f64,
}

impl Mechanism for Refined<'_> {
    fn places(&self) -> &[Place] {
        self.mechanism.places()
    }
    fn input(&self) -> Channel {
        self.mechanism.input()
    }
    fn channels(&self) -> &[Channel] {
        self.mechanism.channels()
    }
    fn parameters(&self) -> Vec<(&'static str, f64)> {
        self.mechanism.parameters()
    }
    fn schedule(&self) -> Schedule {
        let schedule = self.mechanism.schedule();
        Schedule { substeps: (schedule.substeps as f64 * self.factor) as usize, ..schedule }
    }
    fn law(&self, place: usize, x: f64, v: f64, u: f64) -> f64 {
        self.mechanism.law(place, x, v, u)
    }
    fn accelerations(&self, q: &Vector, v: &Vector, force: &Vector) -> Vector {
        self.mechanism.accelerations(q, v, force)
    }
    fn measure(&self, instant: &Instant) -> Vec<f64> {
        self.mechanism.measure(instant)
    }
    fn energy(&self, q: &Vector, v: &Vector) -> f64 {
        self.mechanism.energy(q, v)
    }
}

/// A block on a moving belt, held by a spring: the coordinate is the block's position relative to the belt's motion.
struct BlockOnBelt {
    mass: f64,
    stiffness: f64,
    belt_speed: f64,
}

const BELT_CONTACT: [Place; 1] = [Place { name: "contact", motion: Motion::Translational, incidence: [1.0, 0.0, 0.0] }];
const BELT_CHANNELS: [Channel; 2] =
    [Channel { name: "slip", unit: "m", factor: 1.0 }, Channel { name: "load", unit: "N", factor: 1.0 }];

impl Mechanism for BlockOnBelt {
    fn places(&self) -> &[Place] {
        &BELT_CONTACT
    }
    fn input(&self) -> Channel {
        Channel { name: "time", unit: "s", factor: 1.0 }
    }
    fn channels(&self) -> &[Channel] {
        &BELT_CHANNELS
    }
    fn parameters(&self) -> Vec<(&'static str, f64)> {
        vec![]
    }
    fn schedule(&self) -> Schedule {
        Schedule {
            band: (1.0, 2.0),
            lines: 1,
            slope: 0.0,
            rms: 1.0,
            fade_in: 1.0,
            duration: 3.0,
            sampling: 1000.0,
            substeps: 10,
        }
    }
    /// The spring pulls on the block's absolute position `x + belt_speed * t`; the input is the time itself.
    fn law(&self, _place: usize, x: f64, _v: f64, t: f64) -> f64 {
        -self.stiffness * (x + self.belt_speed * t)
    }
    fn accelerations(&self, _q: &Vector, _v: &Vector, force: &Vector) -> Vector {
        [force[0] / self.mass, 0.0, 0.0]
    }
    fn measure(&self, instant: &Instant) -> Vec<f64> {
        vec![instant.q[0], instant.loads[0]]
    }
    fn energy(&self, _q: &Vector, v: &Vector) -> f64 {
        0.5 * self.mass * v[0] * v[0]
    }
}

/// With equal static and sliding friction the block is carried to `F/k`, where the spring balances the friction; from
/// there it oscillates about `F/k` with amplitude `v/omega` and only touches the belt's speed once per period.
#[test]
fn a_block_on_a_belt_sticks_and_slips_as_the_closed_solution_says() {
    let (mass, stiffness, belt_speed, friction) = (2.0_f64, 800.0, 0.1, 12.0);
    let belt = BlockOnBelt { mass, stiffness, belt_speed };
    let samples = simulate(&belt, &Effect::DryFriction { place: 0, load: friction }, &|t| t);
    let omega = (stiffness / mass).sqrt();
    let break_away = friction / (stiffness * belt_speed);
    for (sample, &t) in samples.time.iter().enumerate() {
        let position = samples.channels[0][sample] + belt_speed * t;
        let expected = if t < break_away {
            belt_speed * t
        } else {
            friction / stiffness + belt_speed / omega * (omega * (t - break_away)).sin()
        };
        assert!((position - expected).abs() < 1e-9, "t = {t}: {position} instead of {expected}");
    }
}

/// Free decay under Coulomb friction: the amplitude falls by `2 F/k` every half period, and the motion ends inside the
/// dead zone `F/k`.
#[test]
fn free_decay_loses_the_same_amplitude_every_half_period() {
    let slide = SpringSlide { damping: 0.0, ..SpringSlide::default() };
    let (load, start) = (7.0, 0.02);
    let effect = Effect::DryFriction { place: 0, load };
    let samples = simulate_from(&slide, &effect, &|_| 0.0, [start, 0.0, 0.0], [0.0; 3]);
    let (dead_zone, omega) = (load / slide.stiffness, (slide.stiffness / slide.mass).sqrt());
    let half_period = std::f64::consts::PI / omega;
    let swings = ((start - dead_zone) / (2.0 * dead_zone)).ceil();
    for (&t, &position) in samples.time.iter().zip(&samples.channels[0]) {
        let swing = (t / half_period).floor().min(swings);
        let direction = if swing % 2.0 == 0.0 { 1.0 } else { -1.0 };
        let turning = direction * (start - 2.0 * dead_zone * swing);
        let centre = direction * dead_zone;
        let expected = if swing == swings {
            turning
        } else {
            centre + (turning - centre) * (omega * (t - swing * half_period)).cos()
        };
        assert!((position - expected).abs() < 1e-9, "t = {t}: {position} instead of {expected}");
    }
}

/// An elastic stop turns the motion into two joined harmonic arcs; the period is known in closed form.
#[test]
fn an_end_stop_shortens_the_period_as_the_closed_solution_says() {
    let slide = SpringSlide { damping: 0.0, ..SpringSlide::default() };
    let (gap, stop, start) = (0.008, 90e3, 0.008_f64);
    let effect = Effect::EndStop { place: 0, gap, stiffness: stop };
    let speed = 1.0;
    let samples = simulate_from(&slide, &effect, &|_| 0.0, [start, 0.0, 0.0], [speed, 0.0, 0.0]);
    let soft = (slide.stiffness / slide.mass).sqrt();
    let hard = ((slide.stiffness + stop) / slide.mass).sqrt();
    // At the stop: x = gap, v = speed. Beyond it the equilibrium of both springs together is at `rest`.
    let rest = stop * gap / (slide.stiffness + stop);
    let half_contact = (speed / (hard * (gap - rest))).atan() / hard;
    let free_flight = 2.0 * (soft * gap / speed).atan() / soft;
    let period = 2.0 * (2.0 * half_contact + free_flight);
    // The sample before the return lies on the arc that ends at the stop with the same speed.
    let index = (period * slide.schedule().sampling).floor() as usize;
    let remaining = soft * (period - samples.time[index]);
    let expected = gap * remaining.cos() - speed / soft * remaining.sin();
    let reached = samples.channels[0][index];
    assert!((reached - expected).abs() < 1e-7 * gap, "{reached} instead of {expected}");
}

#[test]
fn energy_is_kept_without_losses() {
    let vehicle = QuarterVehicle {
        compression: Branch { slope: 0.0, knee: 1.0, ratio: 1.0 },
        rebound: Branch { slope: 0.0, knee: 1.0, ratio: 1.0 },
        actuator_damping: 0.0,
        ..QuarterVehicle::default()
    };
    let drive = TwoMass { coupling_damping: 0.0, bearing_damping: 0.0, ..TwoMass::default() };
    let crane = CranePendulum { rolling_resistance: 0.0, ..CranePendulum::default() };
    // The shaker's servo stores energy of its own; its stiffness is taken out by a very low frequency.
    let vehicle = QuarterVehicle { actuator_frequency: 1e-9, ..vehicle };
    let cases: [(&dyn Mechanism, Vector, Vector); 3] = [
        (&vehicle, [0.01, -0.01, 0.02], [0.1, 0.2, -0.1]),
        (&drive, [0.1, -0.1, 0.0], [3.0, -2.0, 0.0]),
        (&crane, [0.2, 2.5, 0.0], [0.5, 1.0, 0.0]),
    ];
    for (mechanism, q, v) in cases {
        let observed = EnergyOf { mechanism };
        let samples = simulate_from(&observed, &Effect::Nothing, &|_| 0.0, q, v);
        let energy = &samples.channels[0];
        let drift = energy.iter().map(|value| (value - energy[0]).abs()).fold(0.0, f64::max);
        assert!(drift < 1e-7 * energy[0], "{}: {drift}", mechanism.places()[0].name);
    }
}

/// Measures the energy instead of the channels.
struct EnergyOf<'a> {
    mechanism: &'a dyn Mechanism,
}

const ENERGY: [Channel; 1] = [Channel { name: "energy", unit: "J", factor: 1.0 }];

impl Mechanism for EnergyOf<'_> {
    fn places(&self) -> &[Place] {
        self.mechanism.places()
    }
    fn input(&self) -> Channel {
        self.mechanism.input()
    }
    fn channels(&self) -> &[Channel] {
        &ENERGY
    }
    fn parameters(&self) -> Vec<(&'static str, f64)> {
        self.mechanism.parameters()
    }
    fn schedule(&self) -> Schedule {
        self.mechanism.schedule()
    }
    fn law(&self, place: usize, x: f64, v: f64, u: f64) -> f64 {
        self.mechanism.law(place, x, v, u)
    }
    fn accelerations(&self, q: &Vector, v: &Vector, force: &Vector) -> Vector {
        self.mechanism.accelerations(q, v, force)
    }
    fn measure(&self, instant: &Instant) -> Vec<f64> {
        vec![self.mechanism.energy(instant.q, instant.v)]
    }
    fn energy(&self, q: &Vector, v: &Vector) -> f64 {
        self.mechanism.energy(q, v)
    }
}

/// Halving the step changes kinked and sticking motions by less than a thousandth of the noise.
#[test]
fn the_step_is_fine_enough_for_every_kind_of_effect() {
    for name in MECHANISMS {
        let mechanism = truth::mechanism(name).expect("known name");
        for effect in typical_effects(mechanism.as_ref()) {
            let coarse = excite(mechanism.as_ref(), &effect, 11, 1.0);
            let fine = excite(&Refined { mechanism: mechanism.as_ref(), factor: 2.0 }, &effect, 11, 1.0);
            let change = strength(&fine, &coarse);
            assert!(change < 1e-5, "{name} with {effect:?}: {change:e}");
        }
    }
}

/// Effects of clearly visible strength, scaled by the mechanism's own motion.
fn typical_effects(mechanism: &dyn Mechanism) -> Vec<Effect> {
    let samples = excite(mechanism, &Effect::Nothing, 11, 1.0);
    let travel = rms(&samples.channels[0]);
    let place = mechanism.places().iter().position(|place| place.name.ends_with("guide")).unwrap_or(0);
    let load = mechanism.schedule().rms * if mechanism.input().unit == "mm" { 2e4 } else { 0.3 };
    vec![
        Effect::DryFriction { place, load },
        Effect::EndStop { place, gap: travel, stiffness: load / travel },
        Effect::HarmonicDisturbance { place, amplitude: load, frequency: 3.3, phase: 0.4 },
        Effect::SensorLag { channel: 0, time: 5e-3 },
        Effect::InputDelay { time: 7.3e-3 },
    ]
}

#[test]
fn a_record_carries_the_noise_it_claims() {
    let mechanism = truth::mechanism("two_mass").expect("known name");
    let record = Record::measure(mechanism.as_ref(), &Effect::Nothing, 5, 1.0);
    for (measured, exact) in record.columns[2..].iter().zip(&record.noise_free) {
        let noise: Vec<f64> = measured.iter().zip(exact).map(|(a, b)| a - b).collect();
        let share = rms(&noise) / rms(exact);
        assert!((share - truth::record::NOISE).abs() < 0.001, "{share}");
    }
    let again = Record::measure(mechanism.as_ref(), &Effect::Nothing, 5, 1.0);
    assert_eq!(record.columns, again.columns);
}

/// The files in the repository are what `cargo run --example make_data` writes.
#[test]
fn shipped_records_are_up_to_date() {
    for shipped in truth::shipped::records() {
        let path = format!("{}/studies/{}/data/{}", env!("CARGO_MANIFEST_DIR"), shipped.study, shipped.file);
        let text = std::fs::read_to_string(&path).expect("a shipped record is readable");
        let mut lines = text.lines();
        assert_eq!(lines.next().unwrap_or_default(), shipped.record.heads.join(","), "{path}");
        let rows: Vec<Vec<f64>> =
            lines.map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect()).collect();
        for (column, values) in shipped.record.columns.iter().enumerate() {
            assert_eq!(rows.len(), values.len(), "{path}");
            let tolerance = 1e-4 * rms(values);
            for (row, value) in rows.iter().zip(values) {
                assert!((row[column] - value).abs() <= tolerance, "{path}: {} instead of {value}", row[column]);
            }
        }
    }
}

/// Likewise the modes of the elastic arm; they belong to a beam whose finite elements have the same frequencies: the
/// lowest two, of which six elements know the second to 0.05 % and the third only to 0.2 %.
#[test]
fn shipped_modes_are_up_to_date() {
    for (path, text) in truth::shipped::further() {
        let path = format!("{}/studies/{path}", env!("CARGO_MANIFEST_DIR"));
        assert_eq!(std::fs::read_to_string(&path).expect("a shipped file is readable"), text, "{path}");
        let own = truth::elastic_arm::frequencies_of_elements();
        let rows = text.lines().skip(2).map(|line| line.split(',').nth(1).and_then(|cell| cell.parse::<f64>().ok()));
        for (row, own) in rows.zip(own).take(2) {
            let drawn = row.expect("a frequency") * truth::elastic_arm::FREQUENCY_SCALE;
            assert!((own / drawn - 1.0).abs() < 1e-3, "{own} instead of {drawn}");
        }
    }
}
