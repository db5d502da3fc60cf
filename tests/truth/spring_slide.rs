//! A slider on a guide with spring and damper, pushed by a measured force. Coordinate: position of the slider.

use super::mechanism::{Channel, Instant, Mechanism, Motion, Place, Schedule, Vector};

const PLACES: [Place; 4] = [
    Place { name: "guide", motion: Motion::Translational, incidence: [1.0, 0.0, 0.0] },
    Place { name: "push", motion: Motion::Translational, incidence: [1.0, 0.0, 0.0] },
    Place { name: "return_spring", motion: Motion::Translational, incidence: [1.0, 0.0, 0.0] },
    Place { name: "damper", motion: Motion::Translational, incidence: [1.0, 0.0, 0.0] },
];
const PUSH: usize = 1;
const RETURN_SPRING: usize = 2;
const DAMPER: usize = 3;

const CHANNELS: [Channel; 2] = [
    Channel { name: "position", unit: "mm", factor: 1e-3 },
    Channel { name: "acceleration", unit: "m/s^2", factor: 1.0 },
];

#[derive(Clone)]
pub struct SpringSlide {
    pub mass: f64,
    pub stiffness: f64,
    pub damping: f64,
}

impl Default for SpringSlide {
    fn default() -> Self {
        Self { mass: 8.0, stiffness: 6.2e3, damping: 90.0 }
    }
}

impl Mechanism for SpringSlide {
    fn places(&self) -> &[Place] {
        &PLACES
    }

    fn input(&self) -> Channel {
        Channel { name: "push_force", unit: "N", factor: 1.0 }
    }

    fn channels(&self) -> &[Channel] {
        &CHANNELS
    }

    fn schedule(&self) -> Schedule {
        Schedule {
            band: (0.5, 14.0),
            lines: 18,
            slope: 0.0,
            rms: 60.0,
            fade_in: 0.4,
            duration: 4.0,
            sampling: 250.0,
            substeps: 20,
        }
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        vec![("m_slider", self.mass), ("c_return", self.stiffness), ("d_slide", self.damping)]
    }

    fn law(&self, place: usize, x: f64, v: f64, u: f64) -> f64 {
        match place {
            PUSH => u,
            RETURN_SPRING => -self.stiffness * x,
            DAMPER => -self.damping * v,
            _ => 0.0,
        }
    }

    fn accelerations(&self, _q: &Vector, _v: &Vector, force: &Vector) -> Vector {
        [force[0] / self.mass, 0.0, 0.0]
    }

    fn measure(&self, instant: &Instant) -> Vec<f64> {
        vec![instant.q[0], instant.a[0]]
    }

    fn energy(&self, q: &Vector, v: &Vector) -> f64 {
        0.5 * (self.mass * v[0] * v[0] + self.stiffness * q[0] * q[0])
    }
}
