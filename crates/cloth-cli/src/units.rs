//! Numbers for people.

/// `bytes` with a unit, such as `3.5 GiB`.
pub(crate) fn bytes_text(bytes: u64) -> String {
    indicatif::BinaryBytes(bytes).to_string()
}

/// `number` with three digits or so and a power of a thousand in words, such as `12.3 million`.
pub(crate) fn number_text(number: f64) -> String {
    for (limit, word) in [(1e9, "billion"), (1e6, "million"), (1e3, "thousand")] {
        if number >= limit {
            return format!("{:.1} {word}", number / limit);
        }
    }
    format!("{number:.1}")
}

/// `count` and the thing that is counted.
pub(crate) fn count_text(count: u64, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_by_people() {
        assert_eq!(number_text(12_345_678.0), "12.3 million");
        assert_eq!(number_text(0.0), "0.0");
        assert_eq!(bytes_text(3 << 29), "1.50 GiB");
        assert_eq!(count_text(1, "frame"), "1 frame");
        assert_eq!(count_text(2, "frame"), "2 frames");
    }
}
