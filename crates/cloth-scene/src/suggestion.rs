//! The word that was probably meant.

/// Below this similarity (0 to 1) a known word is no better guess than any other.
const SIMILARITY_MIN: f64 = 0.7;

/// The one of `known` that is most like `word`, if any is like it.
pub(crate) fn suggestion<'a>(
    word: &str,
    known: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    let word = word.to_lowercase();
    known
        .into_iter()
        .map(|candidate| (strsim::jaro_winkler(&word, candidate), candidate))
        .filter(|(similarity, _)| *similarity > SIMILARITY_MIN)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate.to_owned())
}

#[cfg(test)]
mod tests {
    use super::suggestion;

    #[test]
    fn slips_are_mended_and_nonsense_is_not() {
        let known = ["stiffness", "damping"];
        assert_eq!(suggestion("stifness", known).as_deref(), Some("stiffness"));
        assert_eq!(suggestion("Dampening", known).as_deref(), Some("damping"));
        assert_eq!(suggestion("quux", known), None);
    }
}
