//! What the last model leaves, held against the sensors themselves: an offset or a gain of one record alone (no other
//! record could confirm it, so no extension is made of it), and channels that show a share of another one.

use crate::identify::{Block, Fitted};
use crate::quantities::format_number;
use crate::simulation::{Compiled, Record};

/// A relation that explains more than this share of what is left of a channel is worth a remark,
const NOTED: f64 = 0.5;
/// one that explains less than this of the same channel in other records is not there.
const ABSENT: f64 = 0.1;

/// Remarks on single records and on pairs of channels.
pub(super) fn remarks(compiled: &Compiled, fitted: &Fitted, records: &[&Record]) -> Vec<String> {
    let mut remarks: Vec<String> =
        fitted.blocks.iter().filter_map(|block| odd_record(compiled, fitted, records, block)).collect();
    for measure in 0..compiled.study.measures.len() {
        remarks.extend(mixed_in(compiled, fitted, records, measure));
    }
    remarks
}

/// How one column explains another: the factor, and the share of the other's sum of squares.
fn explained(columns: &[(Vec<f64>, &[f64])]) -> (f64, f64) {
    let sum = |value: &dyn Fn(f64, f64) -> f64| -> f64 {
        columns.iter().flat_map(|(cause, left)| cause.iter().zip(*left)).map(|(&c, &l)| value(c, l)).sum()
    };
    let (along, square, left) = (sum(&|c, l| c * l), sum(&|c, _| c * c), sum(&|_, l| l * l));
    if square > 0.0 && left > 0.0 { (along / square, along * along / (square * left)) } else { (0.0, 0.0) }
}

fn odd_record(compiled: &Compiled, fitted: &Fitted, records: &[&Record], block: &Block) -> Option<String> {
    let others: Vec<&Block> =
        fitted.blocks.iter().filter(|other| other.measure == block.measure && other.record != block.record).collect();
    if others.is_empty() {
        return None;
    }
    let measure = &compiled.study.measures[block.measure];
    let weight = fitted.weighting.weights[block.measure];
    let ones = |block: &Block| vec![weight; block.rows.len()];
    let signal = |block: &Block| channel(fitted, records, block, block.measure).unwrap_or_default();
    let of = |block: &Block, cause: Vec<f64>| explained(&[(cause, &fitted.residual[block.rows.clone()])]);
    let alone = |cause: &dyn Fn(&Block) -> Vec<f64>| {
        let (factor, share) = of(block, cause(block));
        let elsewhere = others.iter().map(|other| of(other, cause(other)).1).fold(0.0, f64::max);
        (share > NOTED && elsewhere < ABSENT).then_some(factor)
    };
    let (name, record) = (&measure.name, &records[block.record].name);
    if let Some(offset) = alone(&ones) {
        let value = format!("{} {}", format_number(measure.unit.from_si(offset), 3), measure.unit.symbol);
        return Some(format!(
            "`{name}` stands off by {value} in `{record}` and not in the other records: an offset of that record? `offsets = {{ {name} = .. }}` in the experiment lets the fit find it"
        ));
    }
    let gain = alone(&signal)?;
    Some(format!(
        "`{name}` shows {} % more than the model in `{record}` and not in the other records: another gain there?",
        format_number(100.0 * gain, 2)
    ))
}

/// The channel that `measure` seems to show a share of.
fn mixed_in(compiled: &Compiled, fitted: &Fitted, records: &[&Record], measure: usize) -> Option<String> {
    let own: Vec<&Block> = fitted.blocks.iter().filter(|block| block.measure == measure).collect();
    let (other, (factor, share)) = (0..compiled.study.measures.len())
        .filter(|other| *other != measure)
        .filter_map(|other| {
            let column = |block: &&Block| {
                let values = channel(fitted, records, block, other)?;
                Some((values, &fitted.residual[block.rows.clone()]))
            };
            Some((other, explained(&own.iter().map(column).collect::<Option<Vec<_>>>()?)))
        })
        .max_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
    if share < NOTED {
        return None;
    }
    let [mine, its] = [measure, other].map(|index| &compiled.study.measures[index]);
    let unit = if mine.unit.dimension == its.unit.dimension { "" } else { " (SI)" };
    Some(format!(
        "what is left of `{}` follows `{}`, {}{unit} of it ({} % of what is left): cross-talk of the sensors, or a cause that shows in both",
        mine.name,
        its.name,
        format_number(factor, 2),
        format_number(100.0 * share, 2)
    ))
}

/// A measured channel about its mean, filtered and weighted as the residual of `block` is.
fn channel(fitted: &Fitted, records: &[&Record], block: &Block, measure: usize) -> Option<Vec<f64>> {
    let record = records[block.record];
    let position = record.measures.iter().position(|&index| index == measure)?;
    let mut values = record.measured[position].clone();
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    values.iter_mut().for_each(|value| *value -= mean);
    fitted.filters[block.record].apply(&mut values);
    let weight = fitted.weighting.weights[block.measure];
    values.iter_mut().for_each(|value| *value *= weight);
    (values.len() == block.rows.len()).then_some(values)
}

#[cfg(test)]
mod tests {
    use super::explained;

    #[test]
    fn what_a_column_explains_is_its_share_of_the_squares() {
        let cause = vec![1.0, -1.0, 1.0, -1.0];
        let left = [2.0, -2.0, 4.0, -4.0];
        let (factor, share) = explained(&[(cause, &left)]);
        assert!((factor - 3.0).abs() < 1e-15 && (share - 36.0 / 40.0).abs() < 1e-15, "{factor} {share}");
        assert_eq!(explained(&[(vec![0.0; 2], &[1.0, 2.0])]), (0.0, 0.0));
    }
}
