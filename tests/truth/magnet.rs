//! The slider of `spring_slide` with a force over its position that the study does not have.

use super::mechanism::{Channel, Instant, Mechanism, Place, Schedule, Vector};
use super::spring_slide::SpringSlide;

#[derive(Clone)]
pub struct Pulled {
    slide: SpringSlide,
    /// N, at the position in m.
    force: fn(f64) -> f64,
}

impl Pulled {
    pub fn by(force: fn(f64) -> f64) -> Self {
        Self { slide: SpringSlide::default(), force }
    }
}

const STRENGTH: f64 = 25.0;
const PITCH: f64 = 4e-3;
const REACH: f64 = 12e-3;

/// A magnet that holds the slider in the middle and lets it go further out: no law of the catalogue.
pub fn magnet(x: f64) -> f64 {
    STRENGTH * (x / PITCH).sin() * (-(x / REACH).powi(2)).exp()
}

/// Of the cogging, m.
pub const TOOTH: f64 = 3e-3;

/// Cogging of a linear motor.
pub fn cogging(x: f64) -> f64 {
    8.0 * (std::f64::consts::TAU * x / TOOTH + 0.4).sin()
}

impl Mechanism for Pulled {
    fn places(&self) -> &[Place] {
        self.slide.places()
    }

    fn input(&self) -> Channel {
        self.slide.input()
    }

    fn channels(&self) -> &[Channel] {
        self.slide.channels()
    }

    fn schedule(&self) -> Schedule {
        self.slide.schedule()
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        self.slide.parameters()
    }

    fn law(&self, place: usize, x: f64, v: f64, u: f64) -> f64 {
        let guide = self.slide.place("guide");
        self.slide.law(place, x, v, u) + if Some(place) == guide { (self.force)(x) } else { 0.0 }
    }

    fn accelerations(&self, q: &Vector, v: &Vector, force: &Vector) -> Vector {
        self.slide.accelerations(q, v, force)
    }

    fn measure(&self, instant: &Instant) -> Vec<f64> {
        self.slide.measure(instant)
    }

    fn energy(&self, q: &Vector, v: &Vector) -> f64 {
        self.slide.energy(q, v)
    }
}
