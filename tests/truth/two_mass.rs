//! Motor and load inertia on an elastic coupling, driven by a motor torque. Coordinates: the absolute angles of both.

use super::mechanism::{Channel, Instant, Mechanism, Motion, Place, Schedule, Vector};

const PLACES: [Place; 6] = [
    Place { name: "bearing", motion: Motion::Rotational, incidence: [1.0, 0.0, 0.0] },
    Place { name: "shaft", motion: Motion::Rotational, incidence: [-1.0, 1.0, 0.0] },
    Place { name: "motor_torque", motion: Motion::Rotational, incidence: [1.0, 0.0, 0.0] },
    Place { name: "bearing_drag", motion: Motion::Rotational, incidence: [1.0, 0.0, 0.0] },
    Place { name: "coupling", motion: Motion::Rotational, incidence: [-1.0, 1.0, 0.0] },
    Place { name: "coupling_loss", motion: Motion::Rotational, incidence: [-1.0, 1.0, 0.0] },
];
const MOTOR_TORQUE: usize = 2;
const BEARING_DRAG: usize = 3;
const COUPLING: usize = 4;
const COUPLING_LOSS: usize = 5;

const CHANNELS: [Channel; 3] = [
    Channel { name: "motor_angle", unit: "rad", factor: 1.0 },
    Channel { name: "motor_speed", unit: "rad/s", factor: 1.0 },
    Channel { name: "load_speed", unit: "rad/s", factor: 1.0 },
];

#[derive(Clone)]
pub struct TwoMass {
    pub motor_inertia: f64,
    pub load_inertia: f64,
    pub stiffness: f64,
    pub coupling_damping: f64,
    pub bearing_damping: f64,
}

impl Default for TwoMass {
    fn default() -> Self {
        Self {
            motor_inertia: 0.012,
            load_inertia: 0.021,
            stiffness: 28.0,
            coupling_damping: 0.03,
            bearing_damping: 0.05,
        }
    }
}

impl Mechanism for TwoMass {
    fn places(&self) -> &[Place] {
        &PLACES
    }

    fn input(&self) -> Channel {
        Channel { name: "torque", unit: "N*m", factor: 1.0 }
    }

    fn channels(&self) -> &[Channel] {
        &CHANNELS
    }

    fn schedule(&self) -> Schedule {
        Schedule {
            band: (0.3, 15.0),
            lines: 20,
            slope: 0.3,
            rms: 2.0,
            fade_in: 0.4,
            duration: 5.0,
            sampling: 200.0,
            substeps: 20,
        }
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        vec![
            ("J_load", self.load_inertia),
            ("c_coupling", self.stiffness),
            ("d_coupling", self.coupling_damping),
            ("d_bearing", self.bearing_damping),
        ]
    }

    fn law(&self, place: usize, x: f64, v: f64, u: f64) -> f64 {
        match place {
            MOTOR_TORQUE => u,
            BEARING_DRAG => -self.bearing_damping * v,
            COUPLING => -self.stiffness * x,
            COUPLING_LOSS => -self.coupling_damping * v,
            _ => 0.0,
        }
    }

    fn accelerations(&self, _q: &Vector, _v: &Vector, force: &Vector) -> Vector {
        [force[0] / self.motor_inertia, force[1] / self.load_inertia, 0.0]
    }

    fn measure(&self, instant: &Instant) -> Vec<f64> {
        vec![instant.q[0], instant.v[0], instant.v[1]]
    }

    fn energy(&self, q: &Vector, v: &Vector) -> f64 {
        let kinetic = self.motor_inertia * v[0] * v[0] + self.load_inertia * v[1] * v[1];
        0.5 * (kinetic + self.stiffness * (q[1] - q[0]).powi(2))
    }
}
