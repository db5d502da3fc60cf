//! Numbers as an engineer writes them: as many digits as mean something, no more.

/// `value` rounded to `digits` significant digits; plain notation between 1e-4 and 1e6, powers of ten outside.
///
/// Non-finite values are named (`not a number`, `infinite`), never printed as if they were results.
pub fn significant(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "not a number".into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "infinite".into() } else { "-infinite".into() };
    }
    if value == 0.0 {
        return "0".into();
    }
    let digits = digits.max(1);
    let scientific = format!("{value:.*e}", digits - 1);
    let (mantissa, exponent) = match scientific.split_once('e') {
        Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().unwrap_or(0)),
        None => (scientific.as_str(), 0),
    };
    if (-4..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        // Through the rounded mantissa, so that 12345 to three digits is 12300.
        let rounded = scientific.parse::<f64>().unwrap_or(value);
        format!("{rounded:.decimals$}")
    } else {
        format!("{mantissa}e{exponent}")
    }
}

/// At most `digits` significant digits, without trailing zeros after the point.
pub fn short(value: f64, digits: usize) -> String {
    let text = significant(value, digits);
    if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    } else {
        text
    }
}

/// A value with as many digits as its standard deviation supports (two digits of it), four where there is none.
pub fn with_deviation(value: f64, standard_deviation: Option<f64>) -> String {
    match standard_deviation {
        Some(deviation) if deviation.is_finite() && deviation > 0.0 && value.is_finite() && value != 0.0 => {
            let digits = value.abs().log10().floor() - deviation.log10().floor() + 2.0;
            significant(value, digits.clamp(2.0, 7.0) as usize)
        }
        _ => significant(value, 4),
    }
}

/// Both ends of an interval at the same decimal place, chosen from its width (two digits of it).
pub fn interval(low: f64, high: f64) -> (String, String) {
    let width = (high - low).abs();
    let largest = low.abs().max(high.abs());
    if !width.is_finite() || width == 0.0 || !(1e-4..1e6).contains(&largest) {
        return (significant(low, 4), significant(high, 4));
    }
    let decimals = (1.0 - width.log10().floor()).clamp(0.0, 10.0) as usize;
    (fixed(low, decimals), fixed(high, decimals))
}

/// `low .. high` of an interval, or the words for its absence.
pub fn interval_text(interval_of: Option<(f64, f64)>) -> String {
    match interval_of {
        Some((low, high)) => {
            let (low, high) = interval(low, high);
            format!("{low} .. {high}")
        }
        None => "undetermined".into(),
    }
}

/// Fixed decimals, without a minus before zero.
pub fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return significant(value, 3);
    }
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| c == '0' || c == '.') => rest.into(),
        _ => text,
    }
}

/// A figure in per cent with two to three digits: `17.1 %`, `4.63 %`, `0.052 %`.
pub fn percent(value: f64) -> String {
    format!("{} %", percent_digits(value))
}

/// As [`percent`], without the sign: for columns whose head carries it.
pub fn percent_digits(value: f64) -> String {
    let magnitude = value.abs();
    if !value.is_finite() || magnitude >= 1e4 {
        significant(value, 3)
    } else if magnitude >= 100.0 {
        fixed(value, 0)
    } else if magnitude >= 10.0 {
        fixed(value, 1)
    } else if magnitude >= 1.0 || magnitude == 0.0 {
        fixed(value, 2)
    } else {
        significant(value, 2)
    }
}

/// A probability; very small ones as a power of ten bound.
pub fn probability(value: f64) -> String {
    if !value.is_finite() {
        significant(value, 3)
    } else if value < 1e-12 {
        "< 1e-12".into()
    } else if value < 1e-3 {
        format!("{value:.0e}")
    } else {
        significant(value, 2)
    }
}

/// With an explicit sign: for changes.
pub fn signed(value: f64, text: String) -> String {
    if value > 0.0 && value.is_finite() { format!("+{text}") } else { text }
}

/// Thousands set apart by a thin space: `25 000`.
pub fn count(value: usize) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) && digits.len() > 4 {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn significant_digits_keep_plain_notation_in_the_usual_range() {
        assert_eq!(significant(95.108_93, 4), "95.11");
        assert_eq!(significant(-0.001_234_5, 3), "-0.00123");
        assert_eq!(significant(123_456.0, 3), "123000");
        assert_eq!(significant(9.9996, 4), "10.00");
        assert_eq!(significant(1.5e-7, 3), "1.50e-7");
        assert_eq!(significant(f64::NAN, 3), "not a number");
    }

    #[test]
    fn digits_follow_the_deviation() {
        assert_eq!(with_deviation(95.108_93, Some(0.12)), "95.11");
        assert_eq!(with_deviation(20_361.7, Some(35.0)), "20362");
        assert_eq!(with_deviation(3.0, Some(10.0)), "3.0");
        assert_eq!(with_deviation(5.432_19, None), "5.432");
    }

    #[test]
    fn both_ends_of_an_interval_share_their_decimals() {
        assert_eq!(interval(94.871_2, 95.353_9), ("94.87".into(), "95.35".into()));
        assert_eq!(interval(-3.0, 12.0), ("-3".into(), "12".into()));
        assert_eq!(interval(-0.0001, 12.0), ("0".into(), "12".into()));
    }

    #[test]
    fn percentages_and_counts() {
        assert_eq!(percent(17.123), "17.1 %");
        assert_eq!(percent(4.631), "4.63 %");
        assert_eq!(percent(0.051_9), "0.052 %");
        assert_eq!(count(25_000), "25\u{202f}000");
        assert_eq!(count(1234), "1234");
    }
}
