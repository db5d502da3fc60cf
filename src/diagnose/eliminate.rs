//! Causes accepted early are tried again beside those accepted later: the first of two causes is judged while the
//! second is still missing, and may have stood in for it (backward elimination, Miller-2002, chapter 3).

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

/// The model without the causes that would not be accepted any more; the last one accepted is not questioned. `first`
/// is the model without any.
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

#[cfg(test)]
mod tests {
    use super::super::{adopt, candidates, first_model, refit, round::Round, screen, typical};
    use super::{Model, Roles, eliminate};
    use crate::diagnose::course::Course;
    use crate::simulation::{Compiled, prepare};
    use crate::study::{check, load};
    use std::fmt::Write;

    const STUDY: &str = "study slide
input push [N]
body mass { mass = 1 kg }
joint guide: prismatic(x) ground -> mass
actuator drive: external_load on guide { value = push }
force spring: spring_damper on guide { stiffness = c, damping = d }
measure x [m] = guide.position
experiment one estimation { data = \"one.csv\", start = rest }
experiment two validation { data = \"two.csv\", start = rest }
identify {
  c in 10 .. 1000 N/m from 80 N/m
  d in 0.1 .. 50 N*s/m from 1 N*s/m
}
";
    /// Hidden in the data, N/m^3.
    const CUBIC: f64 = 40.0;
    const STEP: f64 = 0.02;

    fn push(t: f64, level: f64) -> f64 {
        level * (1.0 - (-t).exp()) * ((5.0 * t).sin() + (8.3 * t).sin() + (13.1 * t).sin())
    }

    /// Classical Runge-Kutta with steps of a millisecond; errors of 1 mm spread evenly, the same at each run.
    fn data(level: f64, drag: f64, seed: u32) -> String {
        let acceleration =
            |t: f64, [x, v]: [f64; 2]| push(t, level) - 100.0 * x - 2.0 * v - CUBIC * x.powi(3) - drag * v * v.abs();
        let h = STEP / 20.0;
        let (mut state, mut t, mut random) = ([0.0, 0.0], 0.0, seed);
        let mut text = "t [s],push [N],x [m]\n".to_owned();
        for _ in 0..400 {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let error = 2e-3 * (f64::from(random) / f64::from(u32::MAX) - 0.5);
            let _ = writeln!(text, "{t},{},{}", push(t, level), state[0] + error);
            for _ in 0..20 {
                let slope = |t: f64, s: [f64; 2]| [s[1], acceleration(t, s)];
                let ahead = |k: [f64; 2], by: f64| [state[0] + by * k[0], state[1] + by * k[1]];
                let first = slope(t, state);
                let second = slope(t + h / 2.0, ahead(first, h / 2.0));
                let third = slope(t + h / 2.0, ahead(second, h / 2.0));
                let fourth = slope(t + h, ahead(third, h));
                let sum = |i: usize| first[i] + 2.0 * second[i] + 2.0 * third[i] + fourth[i];
                state = [state[0] + h / 6.0 * sum(0), state[1] + h / 6.0 * sum(1)];
                t += h;
            }
        }
        text
    }

    fn accept(model: &Model, name: &str, roles: &Roles) -> Model {
        let records = roles.estimation();
        let round = Round::new(&model.loaded, &model.variant, &model.compiled, &records, &model.fitted);
        let all = candidates::candidates(
            &model.compiled.study,
            &typical::typical(&model.compiled, &records, &model.fitted.theta),
        );
        let index = all.iter().position(|candidate| candidate.name == name).expect("it is a candidate");
        let screened = screen::screen(&round, &all[index]).expect("it can be screened");
        let refitted = refit::refit(&round, index, &all[index], &screened, None, 30).expect("it can be fitted");
        adopt(model, &all[index], &refitted, &records).expect("it can be adopted").0
    }

    /// What stays of drag and, behind it, hardening where `drag` is in the data.
    fn kept(drag: f64) -> Vec<String> {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("it is written");
        write("slide.ident", STUDY);
        write("one.csv", &data(10.0, drag, 1));
        write("two.csv", &data(11.0, drag, 2));
        let loaded = load(&folder.path().join("slide.ident"));
        let study = check(&loaded, None).expect("the study is right").study;
        let (records, _) = prepare(&study, folder.path(), &[]);
        let roles = Roles::assign(&records);
        let compiled = Compiled::new(study).expect("it compiles");
        let first = first_model(&loaded, "base", compiled, &roles, &|_| {}).expect("it can be fitted");
        let model = accept(&first, "quadratic_drag at guide", &roles);
        let model = accept(&model, "cubic_stiffness at guide", &roles);
        let model = eliminate(&first, model, &roles, &mut Course::default()).expect("it can be fitted again");
        model.accepted.into_iter().map(|kept| kept.candidate.name).collect()
    }

    #[test]
    fn a_cause_that_is_not_there_is_taken_out_again() {
        assert_eq!(kept(0.0), ["cubic_stiffness at guide"]);
    }

    #[test]
    fn a_cause_that_is_there_stays() {
        assert_eq!(kept(2.0), ["quadratic_drag at guide", "cubic_stiffness at guide"]);
    }
}
