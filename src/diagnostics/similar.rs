//! Suggestions for misspelt names.

/// The candidate most like `name`, when it is near enough to be what was meant. Of equally near ones the first.
pub fn similar_name<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let wanted = name.to_lowercase();
    let mut best: Option<(usize, &str)> = None;
    for candidate in candidates {
        let distance = strsim::damerau_levenshtein(&wanted, &candidate.to_lowercase());
        if distance <= tolerance(&wanted, candidate) && best.is_none_or(|(nearest, _)| distance < nearest) {
            best = Some((distance, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// As [`similar_name`], else the shortest candidate that the word begins, or one of the same stem: `accel` for
/// `acceleration`, `couple` for `coupling`.
pub fn similar_word<'a>(word: &str, candidates: &[&'a str]) -> Option<&'a str> {
    let alike = |candidate: &str| word.chars().zip(candidate.chars()).take_while(|(a, b)| a == b).count();
    let of_stem = |candidate: &&&str| alike(candidate) >= STEM && 2 * alike(candidate) > candidate.chars().count();
    let is_begun = |candidate: &&&str| word.chars().count() >= BEGINNING && candidate.starts_with(word);
    let begun = || candidates.iter().filter(is_begun).min_by_key(|candidate| candidate.len());
    let similar = similar_name(word, candidates.iter().copied());
    similar.or_else(|| begun().or_else(|| candidates.iter().find(of_stem)).copied())
}

/// Letters at least that begin a word.
const BEGINNING: usize = 3;

/// Letters at least that words of one stem share.
const STEM: usize = 5;

/// Edits that still count as a slip: one in three letters of the shorter word. A wholly different letter case is no
/// edit.
fn tolerance(name: &str, candidate: &str) -> usize {
    name.chars().count().min(candidate.chars().count()).div_ceil(3).min(3)
}

#[cfg(test)]
mod tests {
    use super::{similar_name, similar_word};

    #[test]
    fn slips_are_recognised_and_other_words_are_not() {
        let bodies = ["wheel", "chassis", "table"];
        assert_eq!(similar_name("whel", bodies), Some("wheel"));
        assert_eq!(similar_name("CHASSIS", bodies), Some("chassis"));
        assert_eq!(similar_name("chasiss", bodies), Some("chassis"));
        assert_eq!(similar_name("engine", bodies), None);
        assert_eq!(similar_name("", bodies), None);
        assert_eq!(similar_name("x", []), None);
    }

    #[test]
    fn words_of_one_stem_are_recognised() {
        let keywords = ["force", "coupling", "experiment"];
        assert_eq!(similar_word("couple", &keywords), Some("coupling"));
        assert_eq!(similar_word("forse", &keywords), Some("force"));
        assert_eq!(similar_word("experimental_data", &keywords), Some("experiment"));
        assert_eq!(similar_word("expert", &keywords), None);
        assert_eq!(similar_word("cup", &keywords), None);
        assert_eq!(similar_word("exp", &keywords), Some("experiment"));
        assert_eq!(similar_word("ex", &keywords), None);
    }
}
