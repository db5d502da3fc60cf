//! What a simulator must know of a mechanism.

use super::simulator::COORDINATES;

/// Values per coordinate; mechanisms with fewer coordinates leave the rest zero.
pub type Vector = [f64; COORDINATES];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    Translational,
    Rotational,
}

/// Where a law stands or an effect may attach, under the name that the study gives it. Elongation (or joint
/// coordinate) is `incidence . q`; a load there acts as the generalised force `incidence * load`.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub name: &'static str,
    pub motion: Motion,
    pub incidence: Vector,
}

/// A recorded channel: column name, unit as written in the file, SI value of that unit.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    pub name: &'static str,
    pub unit: &'static str,
    pub factor: f64,
}

/// Position, velocity, acceleration of the coordinates and the load at every place, at one instant.
pub struct Instant<'a> {
    pub q: &'a Vector,
    pub v: &'a Vector,
    pub a: &'a Vector,
    pub loads: &'a [f64],
}

/// A record's excitation and sampling.
pub struct Schedule {
    pub band: (f64, f64),
    pub lines: usize,
    /// Amplitudes fall as `frequency^-slope`.
    pub slope: f64,
    /// rms value of the input in SI.
    pub rms: f64,
    pub fade_in: f64,
    pub duration: f64,
    pub sampling: f64,
    /// Fine steps per sample.
    pub substeps: usize,
}

pub trait Mechanism: Sync + Send {
    fn places(&self) -> &[Place];
    fn input(&self) -> Channel;
    fn channels(&self) -> &[Channel];
    fn schedule(&self) -> Schedule;
    /// The numbers that the study identifies, by its names, in SI.
    fn parameters(&self) -> Vec<(&'static str, f64)>;
    /// Load of the undisturbed law at `place` (zero where no law stands) at input value `u`.
    fn law(&self, place: usize, x: f64, v: f64, u: f64) -> f64;
    /// Accelerations under the generalised forces `force`.
    fn accelerations(&self, q: &Vector, v: &Vector, force: &Vector) -> Vector;
    /// Values of the channels in SI.
    fn measure(&self, instant: &Instant) -> Vec<f64>;
    /// Kinetic and potential energy with what conservative laws store.
    fn energy(&self, q: &Vector, v: &Vector) -> f64;

    /// Index of the place of this name.
    fn place(&self, name: &str) -> Option<usize> {
        self.places().iter().position(|place| place.name == name)
    }

    /// Index of the channel of this name.
    fn channel(&self, name: &str) -> Option<usize> {
        self.channels().iter().position(|channel| channel.name == name)
    }
}

impl Place {
    /// Elongation, rate or relative acceleration from the coordinates' values.
    pub fn of(&self, values: &Vector) -> f64 {
        self.incidence.iter().zip(values).map(|(incidence, value)| incidence * value).sum()
    }
}
