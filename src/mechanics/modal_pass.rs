//! Modal coordinates in the articulated-body algorithm: what is not eliminated yet on the way inwards.

use super::articulated::{Inertia, Wrench};
use super::kinematics::FrameMotion;
use super::topology::Tree;
use crate::expression::vector::Vector;
use crate::expression::{Graph, Node};
use std::collections::BTreeMap;

/// Equations of the modal coordinates still open, `m q'' + C . a + b = load`, per link of a mode.
pub(super) struct Modes {
    /// Per link, by the mode's link: the wrench on the link that goes with the mode's acceleration.
    coupling: Vec<BTreeMap<usize, Wrench>>,
    mass: BTreeMap<(usize, usize), Node>,
    bias: BTreeMap<usize, Node>,
    /// Per eliminated mode what it took to solve for it: coupling to the link, and to the modes further in.
    solved: BTreeMap<usize, (Wrench, Vec<(usize, Node)>)>,
}

/// A link's inertia and bias force after one of its coordinates has been dealt with.
pub(super) struct Reduced {
    pub inertia: Inertia,
    pub bias: Wrench,
}

impl Modes {
    pub fn new(graph: &mut Graph, tree: &Tree) -> Self {
        let zero = graph.constant(0.0);
        let mut modes = Self {
            coupling: vec![BTreeMap::new(); tree.links.len()],
            mass: BTreeMap::new(),
            bias: BTreeMap::new(),
            solved: BTreeMap::new(),
        };
        for modal in &tree.modal {
            for (k, &link) in modal.links.iter().enumerate() {
                modes.coupling[modal.seat()].insert(link, modal.coupling[k]);
                modes.bias.insert(link, zero);
                for (l, &other) in modal.links.iter().enumerate() {
                    modes.mass.insert((link, other), modal.mass[k][l]);
                }
            }
        }
        modes
    }

    fn mass(&self, graph: &mut Graph, k: usize, l: usize) -> Node {
        self.mass.get(&(k, l)).copied().unwrap_or_else(|| graph.constant(0.0))
    }

    fn add_mass(&mut self, graph: &mut Graph, k: usize, l: usize, amount: Node) {
        let sum = self.mass(graph, k, l);
        let sum = graph.add(sum, amount);
        self.mass.insert((k, l), sum);
    }

    fn add_bias(&mut self, graph: &mut Graph, k: usize, amount: Node) {
        let before = self.bias.get(&k).copied().unwrap_or_else(|| graph.constant(0.0));
        let sum = graph.add(before, amount);
        self.bias.insert(k, sum);
    }

    /// A link whose coordinate is a weighted sum of modes, about `axis`: its motion goes over to the modes.
    pub fn follow(
        &mut self,
        graph: &mut Graph,
        (link, axis): (usize, (Vector, Vector)),
        weights: &[(usize, Node)],
        frame: &FrameMotion,
        (inertia, bias): (Inertia, Wrench),
    ) -> Reduced {
        let own = std::mem::take(&mut self.coupling[link]);
        let by_motion = inertia.apply(graph, axis);
        let moved = by_motion.on(graph, axis);
        let weight_of: BTreeMap<usize, Node> = weights.iter().copied().collect();
        let zero = graph.constant(0.0);
        let keys: Vec<usize> = own
            .keys()
            .chain(weight_of.keys())
            .copied()
            .collect::<std::collections::BTreeSet<_>>()
            .into_iter()
            .collect();
        let terms: Vec<(usize, Node, Node)> = keys
            .iter()
            .map(|&k| {
                let along = own.get(&k).map_or(zero, |wrench| wrench.on(graph, axis));
                (k, weight_of.get(&k).copied().unwrap_or(zero), along)
            })
            .collect();
        for &(k, w_k, c_k) in &terms {
            for &(l, w_l, c_l) in &terms {
                let both = graph.multiply(w_k, w_l);
                let both = graph.multiply(both, moved);
                let first = graph.multiply(w_k, c_l);
                let second = graph.multiply(c_k, w_l);
                let sum = graph.add(first, second);
                let sum = graph.add(both, sum);
                self.add_mass(graph, k, l, sum);
            }
        }
        let by_bias = inertia.apply(graph, (frame.angular_bias, frame.bias));
        let total = bias.add(graph, by_bias);
        let driven = total.on(graph, axis);
        for &(k, w_k, _) in &terms {
            let by_load = graph.multiply(w_k, driven);
            self.add_bias(graph, k, by_load);
            let mut wrench = Wrench::zero(graph);
            if let Some(own) = own.get(&k) {
                let by_frame = own.on(graph, (frame.angular_bias, frame.bias));
                self.add_bias(graph, k, by_frame);
                wrench = *own;
            }
            let share = by_motion.scale(graph, w_k);
            let sum = wrench.add(graph, share);
            self.coupling[link].insert(k, sum);
        }
        Reduced { inertia, bias: total }
    }

    /// Solves for the mode of `link`, whose frame does not move by itself: divisor, and load less what is known.
    pub fn eliminate(
        &mut self,
        graph: &mut Graph,
        link: usize,
        load: Node,
        (inertia, bias): (Inertia, Wrench),
    ) -> (Reduced, Node, Node) {
        let own = self.coupling[link].remove(&link).unwrap_or_else(|| Wrench::zero(graph));
        let divisor = self.mass(graph, link, link);
        let known = self.bias.get(&link).copied().unwrap_or_else(|| graph.constant(0.0));
        let driving = graph.subtract(load, known);
        let one = graph.constant(1.0);
        let inverse = graph.divide(one, divisor);
        let scaled = own.scale(graph, inverse);
        let reduced = inertia.without(graph, own, scaled);
        let by_drive = scaled.scale(graph, driving);
        let open: Vec<usize> = self.coupling[link].keys().copied().collect();
        let masses: Vec<(usize, Node)> = open.iter().map(|&j| (j, self.mass(graph, link, j))).collect();
        for &(j, m_j) in &masses {
            let share = graph.multiply(m_j, inverse);
            let by_drive = graph.multiply(share, driving);
            self.add_bias(graph, j, by_drive);
            let taken = own.scale(graph, share);
            if let Some(wrench) = self.coupling[link].get(&j).copied() {
                let rest = wrench.subtract(graph, taken);
                self.coupling[link].insert(j, rest);
            }
            for &(l, m_l) in &masses {
                let product = graph.multiply(share, m_l);
                let product = graph.negate(product);
                self.add_mass(graph, j, l, product);
            }
        }
        self.solved.insert(link, (own, masses));
        (Reduced { inertia: reduced, bias: bias.add(graph, by_drive) }, divisor, driving)
    }

    /// Hands what is open at `link` to its predecessor.
    pub fn carry_back(&mut self, graph: &mut Graph, link: usize, predecessor: usize, frame: &FrameMotion) {
        for (mode, wrench) in std::mem::take(&mut self.coupling[link]) {
            let carried = wrench.carried_back(graph, frame);
            let sum = match self.coupling[predecessor].get(&mode) {
                Some(before) => before.add(graph, carried),
                None => carried,
            };
            self.coupling[predecessor].insert(mode, sum);
        }
    }

    /// On the way outwards: what the link's motion and the modes further in take of the load on an eliminated mode.
    pub fn taken(
        &self,
        graph: &mut Graph,
        link: usize,
        motion: (Vector, Vector),
        acceleration: impl Fn(usize) -> Node,
    ) -> Node {
        let zero = graph.constant(0.0);
        let Some((own, masses)) = self.solved.get(&link) else { return zero };
        let mut sum = own.on(graph, motion);
        for &(other, mass) in masses {
            let share = graph.multiply(mass, acceleration(other));
            sum = graph.add(sum, share);
        }
        sum
    }
}
