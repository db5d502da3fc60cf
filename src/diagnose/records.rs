//! Which record fits, which decides, which is only looked at.

use crate::simulation::Record;
use crate::study::Role;

/// With a single record, this share of it is fitted and screened, the rest decides.
const FITTED_SHARE: f64 = 0.6;

/// Records by their role.
pub(super) struct Roles {
    estimation: Vec<Record>,
    validation: Vec<Record>,
    test: Vec<Record>,
    /// One sentence for the answer.
    pub description: String,
}

impl Roles {
    /// As the study declares them. Without any validation record the estimation records are cut in two: the first
    /// part is fitted and screened, the second decides; the description says so.
    pub(super) fn assign(records: &[Record]) -> Self {
        let of = |role: Role| records.iter().filter(|record| record.role == role).cloned().collect::<Vec<_>>();
        let (mut estimation, mut validation, test) = (of(Role::Estimation), of(Role::Validation), of(Role::Test));
        let names =
            |records: &[Record]| records.iter().map(|record| record.name.as_str()).collect::<Vec<_>>().join(", ");
        let mut description;
        if validation.is_empty() {
            description = format!(
                "no validation record: the first {:.0} % of {} are fitted and screened, the rest decides",
                100.0 * FITTED_SHARE,
                names(&estimation)
            );
            let whole = std::mem::take(&mut estimation);
            for record in whole {
                let cut = (record.sample_count() as f64 * FITTED_SHARE) as usize;
                estimation.push(record.part(0..cut, "fitted part"));
                validation.push(record.part(cut..record.sample_count(), "deciding part"));
            }
        } else {
            description = format!("{}: fitted and screened; {}: decides", names(&estimation), names(&validation));
        }
        if !test.is_empty() {
            description.push_str(&format!("; {}: only looked at", names(&test)));
        }
        Self { estimation, validation, test, description }
    }

    pub(super) fn estimation(&self) -> Vec<&Record> {
        self.estimation.iter().collect()
    }

    pub(super) fn validation(&self) -> Vec<&Record> {
        self.validation.iter().collect()
    }

    pub(super) fn all(&self) -> Vec<&Record> {
        self.estimation.iter().chain(&self.validation).chain(&self.test).collect()
    }
}
