//! Times of two runs beside each other.

use comfy_table::{Table, presets::NOTHING};

use super::tables::digits;
use crate::record::{Record, Results, Statistics, Verdict};

/// Ratios of a run to an older one.
pub(crate) struct Comparison {
    rows: Vec<Ratio>,
    /// Cases of the older run that are not in the new one.
    missing: usize,
    /// Cases of the new run that are not in the older one.
    added: usize,
}

/// A case of both runs.
struct Ratio {
    key: String,
    times: [f64; 2],
    /// New over old, if each time were at the end of its quartiles that makes it smallest, and largest.
    bounds: [f64; 2],
}

impl Comparison {
    pub(crate) fn new(older: &Results, newer: &Results) -> Self {
        let mut comparison = Self { rows: Vec::new(), missing: 0, added: 0 };
        let valid = |record: &&Record| record.verdict != Verdict::Invalid;
        for new in newer.records.iter().filter(valid) {
            let key = new.key();
            match older.records.iter().filter(valid).find(|old| old.key() == key) {
                Some(old) => comparison.rows.push(ratio(key, old, new)),
                None => comparison.added += 1,
            }
        }
        comparison.missing = older.records.len().saturating_sub(comparison.rows.len());
        comparison
    }

    pub(crate) fn print(&self) {
        let mut table = Table::new();
        table
            .load_preset(NOTHING)
            .set_header(["case", "older ms", "newer ms", "ratio", "noise", ""]);
        for row in &self.rows {
            let [old, new] = row.times;
            table.add_row([
                row.key.clone(),
                digits(old),
                digits(new),
                digits(new / old),
                format!("{} - {}", digits(row.bounds[0]), digits(row.bounds[1])),
                row.word().to_owned(),
            ]);
        }
        println!("\nCompared with the older run: time of the newer one over that of the older one");
        println!("{}", table.trim_fmt());
        println!(
            "{} cases only in the older run, {} only in the newer one",
            self.missing, self.added
        );
    }
}

fn ratio(key: String, old: &Record, new: &Record) -> Ratio {
    // Quartiles of the best clock, or of single frames where that has none.
    let spread = |record: &Record| record.device.unwrap_or(record.frame);
    let times = [old.time(), new.time()];
    Ratio { key, times, bounds: bounds(times, [spread(old), spread(new)]) }
}

/// What the ratio would be with the new time at its lower quartile and the old one at its upper, and the other way.
fn bounds(times: [f64; 2], [old, new]: [Statistics; 2]) -> [f64; 2] {
    let relative = |new_end: f64, old_end: f64| {
        times[1] / times[0] * (new_end / new.median) / (old_end / old.median)
    };
    [relative(new.lower, old.upper), relative(new.upper, old.lower)]
}

impl Ratio {
    const fn word(&self) -> &'static str {
        match self.bounds {
            [_, high] if high < 1.0 => "faster",
            [low, _] if low > 1.0 => "slower",
            _ => "",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ratio_of(old: [f64; 3], new: [f64; 3]) -> Ratio {
        let spreads =
            [old, new].map(|[lower, median, upper]: [f64; 3]| Statistics { median, lower, upper });
        let times = spreads.map(|spread| spread.median);
        Ratio { key: String::new(), times, bounds: bounds(times, spreads) }
    }

    #[test]
    fn a_difference_within_the_quartiles_has_no_word() {
        assert_eq!(ratio_of([0.9, 1.0, 1.1], [0.95, 1.05, 1.15]).word(), "");
        assert_eq!(ratio_of([0.9, 1.0, 1.1], [1.9, 2.0, 2.1]).word(), "slower");
        assert_eq!(ratio_of([0.9, 1.0, 1.1], [0.4, 0.5, 0.6]).word(), "faster");
    }
}
