//! The slider of `spring_slide` over a magnet that holds it in the middle and lets it go further out: a force over the position that
//! no law of the catalogue describes.

use super::mechanism::{Channel, Instant, Mechanism, Place, Schedule, Vector};
use super::spring_slide::SpringSlide;

#[derive(Clone, Default)]
pub struct OverMagnet {
    slide: SpringSlide,
}

const STRENGTH: f64 = 25.0;
const PITCH: f64 = 4e-3;
const REACH: f64 = 12e-3;

/// The magnet's force on the slider, N, at its position, m.
pub fn magnet(x: f64) -> f64 {
    STRENGTH * (x / PITCH).sin() * (-(x / REACH).powi(2)).exp()
}

impl Mechanism for OverMagnet {
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
        self.slide.law(place, x, v, u) + if Some(place) == guide { magnet(x) } else { 0.0 }
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
