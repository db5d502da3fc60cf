//! One wheel of a vehicle on the table of a position-controlled shaker. Coordinates: table, wheel, chassis heights.

use super::mechanism::{Channel, Instant, Mechanism, Motion, Place, Schedule, Vector};
use std::f64::consts::TAU;

const PLACES: [Place; 7] = [
    Place { name: "table_guide", motion: Motion::Translational, incidence: [1.0, 0.0, 0.0] },
    Place { name: "wheel_guide", motion: Motion::Translational, incidence: [0.0, 1.0, 0.0] },
    Place { name: "chassis_guide", motion: Motion::Translational, incidence: [0.0, 0.0, 1.0] },
    Place { name: "shaker", motion: Motion::Translational, incidence: [1.0, 0.0, 0.0] },
    Place { name: "tyre", motion: Motion::Translational, incidence: [-1.0, 1.0, 0.0] },
    Place { name: "strut", motion: Motion::Translational, incidence: [0.0, -1.0, 1.0] },
    Place { name: "damper", motion: Motion::Translational, incidence: [0.0, -1.0, 1.0] },
];
const SHAKER: usize = 3;
const TYRE: usize = 4;
const STRUT: usize = 5;
const DAMPER: usize = 6;

const CHANNELS: [Channel; 3] = [
    Channel { name: "z_body", unit: "mm", factor: 1e-3 },
    Channel { name: "a_axle", unit: "m/s^2", factor: 1.0 },
    Channel { name: "F_tyre", unit: "kN", factor: 1e3 },
];

/// One branch of the damper.
#[derive(Clone, Copy)]
pub struct Branch {
    pub slope: f64,
    pub knee: f64,
    pub ratio: f64,
}

#[derive(Clone)]
pub struct QuarterVehicle {
    pub table_mass: f64,
    pub wheel_mass: f64,
    pub chassis_mass: f64,
    pub tyre_stiffness: f64,
    pub strut_stiffness: f64,
    pub compression: Branch,
    pub rebound: Branch,
    pub actuator_frequency: f64,
    pub actuator_damping: f64,
    pub force_limit: f64,
}

impl Default for QuarterVehicle {
    fn default() -> Self {
        Self {
            table_mass: 80.0,
            wheel_mass: 45.0,
            chassis_mass: 320.0,
            tyre_stiffness: 180e3,
            strut_stiffness: 24e3,
            compression: Branch { slope: 1100.0, knee: 0.15, ratio: 0.3 },
            rebound: Branch { slope: 2300.0, knee: 0.20, ratio: 0.25 },
            actuator_frequency: 24.0,
            actuator_damping: 0.65,
            force_limit: 3e3,
        }
    }
}

impl QuarterVehicle {
    fn damper(&self, v: f64) -> f64 {
        let branch = if v < 0.0 { self.compression } else { self.rebound };
        -branch.slope * v * (branch.ratio + (1.0 - branch.ratio) / (1.0 + (v / branch.knee).powi(2)).sqrt())
    }

    /// Position servo: the force that a second-order system of the table's mass would need, limited smoothly.
    fn shaker(&self, x: f64, v: f64, u: f64) -> f64 {
        let omega = TAU * self.actuator_frequency;
        let demand = self.table_mass * (omega * omega * (u - x) - 2.0 * self.actuator_damping * omega * v);
        self.force_limit * (demand / self.force_limit).tanh()
    }
}

impl Mechanism for QuarterVehicle {
    fn places(&self) -> &[Place] {
        &PLACES
    }

    fn input(&self) -> Channel {
        Channel { name: "u", unit: "mm", factor: 1e-3 }
    }

    fn channels(&self) -> &[Channel] {
        &CHANNELS
    }

    fn schedule(&self) -> Schedule {
        Schedule {
            band: (0.5, 14.0),
            lines: 18,
            slope: 1.0,
            rms: 18e-3,
            fade_in: 0.5,
            duration: 5.0,
            sampling: 200.0,
            substeps: 20,
        }
    }

    fn parameters(&self) -> Vec<(&'static str, f64)> {
        vec![
            ("c_tyre", self.tyre_stiffness),
            ("c_strut", self.strut_stiffness),
            ("d_compression", self.compression.slope),
            ("d_rebound", self.rebound.slope),
            ("f_act", self.actuator_frequency),
            ("d_act", self.actuator_damping),
        ]
    }

    fn law(&self, place: usize, x: f64, v: f64, u: f64) -> f64 {
        match place {
            SHAKER => self.shaker(x, v, u),
            TYRE => -self.tyre_stiffness * x,
            STRUT => -self.strut_stiffness * x,
            DAMPER => self.damper(v),
            _ => 0.0,
        }
    }

    fn accelerations(&self, _q: &Vector, _v: &Vector, force: &Vector) -> Vector {
        [force[0] / self.table_mass, force[1] / self.wheel_mass, force[2] / self.chassis_mass]
    }

    fn measure(&self, instant: &Instant) -> Vec<f64> {
        vec![instant.q[2], instant.a[1], instant.loads[TYRE]]
    }

    fn energy(&self, q: &Vector, v: &Vector) -> f64 {
        let kinetic = self.table_mass * v[0] * v[0] + self.wheel_mass * v[1] * v[1] + self.chassis_mass * v[2] * v[2];
        let stored = self.tyre_stiffness * (q[1] - q[0]).powi(2) + self.strut_stiffness * (q[2] - q[1]).powi(2);
        0.5 * (kinetic + stored)
    }
}
