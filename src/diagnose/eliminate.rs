//! Causes accepted early are tried again beside those accepted later: the first of two causes is judged while the second is still
//! missing, and may have stood in for it (backward elimination, Miller-2002, chapter 3).

use super::course::Course;
use super::judge::{self, HeldOut};
use super::records::Roles;
use super::round::{deviance, effective_counts};
use super::{Model, extension};
use crate::diagnostics::Diagnostic;
use crate::fit::Control;
use crate::identify::{Fitted, Settings, fit};
use crate::simulation::Compiled;
use crate::study;

/// The model without the causes that would not be accepted any more; the last one accepted is not questioned. `first` is the model
/// without any.
pub(super) fn eliminate(
    first: &Model,
    mut model: Model,
    roles: &Roles,
    course: &mut Course,
) -> Result<Model, Vec<Diagnostic>> {
    'again: loop {
        for index in 0..model.accepted.len().saturating_sub(1) {
            let shorter = without(first, &model, index)?;
            if let Some(next) = shorter.fitted_in_place_of(&model, index, roles, course)? {
                course.eliminate(index, &shorter.texts, &model.accepted);
                model = next;
                continue 'again;
            }
        }
        return Ok(model);
    }
}

/// A model with a cause less, not fitted yet.
struct Shorter {
    texts: Vec<String>,
    compiled: Compiled,
    start: Vec<f64>,
    loaded: study::Loaded,
    variant: String,
}

fn without(first: &Model, model: &Model, index: usize) -> Result<Shorter, Vec<Diagnostic>> {
    let (mut loaded, mut variant) = (first.loaded.clone(), first.variant.clone());
    let mut texts = Vec::new();
    for (_, kept) in model.accepted.iter().enumerate().filter(|(position, _)| *position != index) {
        let (compiled, theta) = (&model.compiled, &model.fitted.theta);
        let text = extension::variant_text(&kept.variant, &variant, &kept.candidate, compiled, theta);
        loaded = loaded.with_text(&text);
        variant.clone_from(&kept.variant);
        texts.push(text);
    }
    let compiled = Compiled::new(study::check(&loaded, Some(&variant))?.study)?;
    let known = || model.compiled.study.parameters.iter().zip(&model.fitted.theta);
    let value_of = |name: &str| known().find(|(parameter, _)| parameter.name == name).map(|(_, value)| *value);
    let parameters = &compiled.study.parameters;
    let start = parameters.iter().map(|parameter| value_of(&parameter.name).unwrap_or(parameter.start)).collect();
    Ok(Shorter { texts, compiled, start, loaded, variant })
}

impl Shorter {
    /// The shorter model fitted, where the cause that it lacks is not needed.
    fn fitted_in_place_of(
        &self,
        model: &Model,
        index: usize,
        roles: &Roles,
        course: &mut Course,
    ) -> Result<Option<Model>, Vec<Diagnostic>> {
        let records = roles.estimation();
        let refit = |settings: Settings| fit(&self.compiled, &records, &settings, &mut |_| Control::Continue);
        let start = Some(self.start.clone());
        let weights = Some(model.fitted.weighting.clone());
        let Ok(fitted) = refit(Settings { start, weights, ..Settings::default() }) else { return Ok(None) };
        course.simulations += fitted.simulations;
        let saved = model.accepted[index].candidate.unknowns.len();
        if evidence(model, &fitted, saved) > judge::MINIMUM_BIC_GAIN && self.transfers_worse(&fitted, model, roles) {
            return Ok(None);
        }
        let start = Some(fitted.theta);
        let first_weights = Some(fitted.weighting);
        let fitted =
            refit(Settings { start, first_weights, ..Settings::default() }).map_err(|finding| vec![finding])?;
        course.simulations += fitted.simulations;
        let mut accepted = model.accepted.clone();
        accepted.remove(index);
        let strengths = accepted.iter().flat_map(|kept| kept.candidate.strengths()).collect();
        let (loaded, variant) = (self.loaded.clone(), self.variant.clone());
        Ok(Some(Model { loaded, variant, compiled: self.compiled.clone(), fitted, strengths, accepted }))
    }

    /// Whether the held-out records lose what a cause must gain there.
    fn transfers_worse(&self, fitted: &Fitted, model: &Model, roles: &Roles) -> bool {
        let (weights, validation) = (&model.fitted.weighting.weights, roles.validation());
        let Some(before) = HeldOut::with_weights(&self.compiled, fitted, weights, &validation) else { return true };
        let after = judge::held_out_residual(&model.compiled, &model.fitted, weights, &validation);
        let change = after.and_then(|after| before.change(&after, judge::INTERVAL));
        change.is_none_or(|change| judge::transfers(&change))
    }
}

/// By how much the BIC of the longer model is better, of which `saved` parameters were taken.
fn evidence(model: &Model, shorter: &Fitted, saved: usize) -> f64 {
    let own = &model.fitted;
    let effective = effective_counts(model.compiled.study.measures.len(), own, &own.residual);
    let total: f64 = effective.iter().sum();
    let gain = deviance(own, &shorter.residual, &effective) - deviance(own, &own.residual, &effective);
    gain - saved as f64 * total.max(1.0).ln()
}
