//! The matrix of Newton's method, `dF/dy + c dF/dy'`, factorised.

use super::augmented::Augmented;
use super::newton::NewtonFailure;
use super::problem::FailureCause;
use super::stepper::first_not_finite;
use crate::linear::{Factorisation, SingularMatrix};

pub(super) struct IterationMatrix {
    n: usize,
    /// Made when first needed: explicit runs of large systems never do.
    factorisation: Option<Factorisation>,
    /// Leading coefficient the factors were made for.
    leading: Option<f64>,
    /// Columns of multipliers: scaled by the leading coefficient, so that the matrix stays well conditioned however
    /// short the step (Hairer-Wanner-1996, VII.4).
    is_multiplier: Vec<bool>,
    has_multipliers: bool,
    is_expanded: bool,
    values: Vec<f64>,
    /// Expanded: units of the components; right-hand sides with the further unknowns.
    scale: Vec<f64>,
    block: Vec<f64>,
}

impl IterationMatrix {
    pub fn new(system: &Augmented) -> Self {
        let expanded = system.dynamics.expanded_pattern();
        Self {
            n: system.n,
            factorisation: None,
            leading: None,
            is_multiplier: system.structure.is_multiplier.clone(),
            has_multipliers: system.structure.has_constraints(),
            is_expanded: expanded.is_some(),
            values: vec![0.0; expanded.map_or(0, |pattern| pattern.len())],
            scale: Vec::new(),
            block: Vec::new(),
        }
    }

    /// Leading coefficient of the present factors.
    pub fn leading(&self) -> Option<f64> {
        self.leading
    }

    pub fn forget(&mut self) {
        self.leading = None;
    }

    pub fn is_expanded(&self) -> bool {
        self.is_expanded
    }

    pub fn has_multipliers(&self) -> bool {
        self.has_multipliers
    }

    pub fn renew(
        &mut self,
        system: &mut Augmented,
        (t, y, y_prime): (f64, &[f64], &[f64]),
        leading: f64,
    ) -> Result<(), NewtonFailure> {
        self.leading = None;
        system.work.factorisations += 1;
        if self.is_expanded {
            let own = |scale: &f64, is_multiplier: bool| if is_multiplier { scale * leading } else { *scale };
            let scales = system.dynamics.scale().iter().enumerate();
            self.scale = scales.map(|(i, s)| own(s, self.is_multiplier.get(i) == Some(&true))).collect();
            system.linearise_expanded(t, y, leading, &self.scale, &mut self.values);
        } else {
            system.linearise(t, y, y_prime, leading);
            self.values.clone_from(&system.jacobian);
            if self.has_multipliers {
                for (value, &column) in self.values.iter_mut().zip(&system.jacobian_columns) {
                    *value *= if self.is_multiplier[column] { leading } else { 1.0 };
                }
            }
        }
        let dynamics = &*system.dynamics;
        let factorisation = self.factorisation.get_or_insert_with(|| {
            Factorisation::of_leading(dynamics.expanded_pattern().unwrap_or_else(|| dynamics.pattern()), system.n)
        });
        match factorisation.factor(&self.values) {
            Ok(()) => {
                self.leading = Some(leading);
                Ok(())
            }
            Err(singular) => Err(self.failure(system, singular)),
        }
    }

    fn failure(&self, system: &Augmented, singular: SingularMatrix) -> NewtonFailure {
        let of_component = |i: usize| (i < self.n).then_some(i);
        match first_not_finite(&self.values) {
            Some(entry) => {
                let row = if self.is_expanded { None } else { Some(system.jacobian_rows[entry]) };
                NewtonFailure { cause: FailureCause::NotFinite, component: row }
            }
            None => NewtonFailure { cause: FailureCause::SingularMatrix, component: of_component(singular.column) },
        }
    }

    /// Solves in place for `width` right-hand sides stored row by row (n x width).
    pub fn solve_block(&mut self, right_hand_sides: &mut [f64], width: usize) {
        let (Some(factorisation), Some(leading)) = (&mut self.factorisation, self.leading) else { return };
        if self.is_expanded {
            self.block.clear();
            self.block.extend_from_slice(right_hand_sides);
            self.block.resize(factorisation.dimension() * width, 0.0);
            factorisation.solve_block(&mut self.block, width);
            let rows = right_hand_sides.chunks_exact_mut(width).zip(self.block.chunks_exact(width));
            for ((target, solution), scale) in rows.zip(&self.scale) {
                target.iter_mut().zip(solution).for_each(|(t, s)| *t = scale * s);
            }
            return;
        }
        factorisation.solve_block(right_hand_sides, width);
        if self.has_multipliers {
            let rows = right_hand_sides.chunks_exact_mut(width).zip(&self.is_multiplier);
            rows.filter(|(_, is)| **is).for_each(|(row, _)| row.iter_mut().for_each(|value| *value *= leading));
        }
    }
}
