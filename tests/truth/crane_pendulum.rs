//! A trolley on a spring-centred rail with a hanging load that swings far. Coordinates: trolley position `s` along x
//! and swing angle `phi` about y (right-handed: a positive angle moves the load towards -x).

use super::mechanism::{Channel, Instant, Mechanism, Motion, Place, Schedule, Vector};

const PLACES: [Place; 5] = [
    Place { name: "rail", motion: Motion::Translational, incidence: [1.0, 0.0, 0.0] },
    Place { name: "hook", motion: Motion::Rotational, incidence: [0.0, 1.0, 0.0] },
    Place { name: "drive", motion: Motion::Translational, incidence: [1.0, 0.0, 0.0] },
    Place { name: "centring", motion: Motion::Translational, incidence: [1.0, 0.0, 0.0] },
    Place { name: "rolling", motion: Motion::Translational, incidence: [1.0, 0.0, 0.0] },
];
const DRIVE: usize = 2;
const CENTRING: usize = 3;
const ROLLING: usize = 4;

const CHANNELS: [Channel; 2] = [
    Channel { name: "position", unit: "mm", factor: 1e-3 },
    Channel { name: "swing", unit: "deg", factor: std::f64::consts::PI / 180.0 },
];

#[derive(Clone)]
pub struct CranePendulum {
    pub trolley_mass: f64,
    pub load_mass: f64,
    pub load_inertia: f64,
    pub length: f64,
    pub gravity: f64,
    pub centring_stiffness: f64,
    pub rolling_resistance: f64,
}

impl Default for CranePendulum {
    fn default() -> Self {
        Self {
            trolley_mass: 8.0,
            load_mass: 5.5,
            load_inertia: 0.08,
            length: 0.9,
            gravity: 9.81,
            centring_stiffness: 200.0,
            rolling_resistance: 60.0,
        }
    }
}

impl Mechanism for CranePendulum {
    fn places(&self) -> &[Place] {
        &PLACES
    }

    fn input(&self) -> Channel {
        Channel { name: "drive_force", unit: "N", factor: 1.0 }
    }

    fn channels(&self) -> &[Channel] {
        &CHANNELS
    }

    fn schedule(&self) -> Schedule {
        Schedule {
            band: (0.25, 3.0),
            lines: 14,
            slope: 0.3,
            rms: 55.0,
            fade_in: 1.0,
            duration: 8.0,
            sampling: 100.0,
            substeps: 20,
        }
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        vec![
            ("m_load", self.load_mass),
            ("c_centring", self.centring_stiffness),
            ("d_rolling", self.rolling_resistance),
        ]
    }

    fn law(&self, place: usize, x: f64, v: f64, u: f64) -> f64 {
        match place {
            DRIVE => u,
            CENTRING => -self.centring_stiffness * x,
            ROLLING => -self.rolling_resistance * v,
            _ => 0.0,
        }
    }

    /// Lagrange's equations of the second kind, solved for the two accelerations by Cramer's rule.
    fn accelerations(&self, q: &Vector, v: &Vector, force: &Vector) -> Vector {
        let (sin, cos) = q[1].sin_cos();
        let moment = self.load_mass * self.length;
        let (m11, m12) = (self.trolley_mass + self.load_mass, -moment * cos);
        let m22 = moment * self.length + self.load_inertia;
        let right_1 = force[0] - moment * sin * v[1] * v[1];
        let right_2 = force[1] - moment * self.gravity * sin;
        let determinant = m11 * m22 - m12 * m12;
        [(right_1 * m22 - right_2 * m12) / determinant, (right_2 * m11 - right_1 * m12) / determinant, 0.0]
    }

    fn measure(&self, instant: &Instant) -> Vec<f64> {
        vec![instant.q[0], instant.q[1]]
    }

    fn energy(&self, q: &Vector, v: &Vector) -> f64 {
        let (sin, cos) = q[1].sin_cos();
        let (vx, vz) = (v[0] - self.length * cos * v[1], self.length * sin * v[1]);
        let kinetic = self.trolley_mass * v[0] * v[0]
            + self.load_mass * (vx * vx + vz * vz)
            + self.load_inertia * v[1] * v[1]
            + self.centring_stiffness * q[0] * q[0];
        0.5 * kinetic + self.load_mass * self.gravity * self.length * (1.0 - cos)
    }
}
