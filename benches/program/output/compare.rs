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
    let clocks = |record: &Record| (record.device, record.in_a_row, record.frame);
    let (times, spreads) = by_one_clock(clocks(old), clocks(new));
    Ratio { key, times, bounds: bounds(times, spreads) }
}

/// A frame by the clock of the device, in a row of them, and by itself \[ms\].
type Clocks = (Option<Statistics>, Option<f64>, Statistics);

/// Times by the best clock that both runs have, and what they vary by: single frames where that clock has only a mean.
fn by_one_clock(old: Clocks, new: Clocks) -> ([f64; 2], [Statistics; 2]) {
    let frames = [old.2, new.2];
    let medians = |spreads: [Statistics; 2]| spreads.map(|spread| spread.median);
    match (old.0.zip(new.0), old.1.zip(new.1)) {
        (Some((old, new)), _) => (medians([old, new]), [old, new]),
        (None, Some((old, new))) => ([old, new], frames),
        (None, None) => (medians(frames), frames),
    }
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
    fn runs_are_compared_by_a_clock_that_both_have() {
        let at = |median| Statistics { median, lower: median, upper: median };
        let (with, without) = ((Some(at(1.0)), Some(2.0), at(3.0)), (None, Some(2.5), at(3.5)));
        assert_eq!(by_one_clock(with, with).0, [1.0, 1.0]);
        assert_eq!(by_one_clock(without, with), ([2.5, 2.0], [at(3.5), at(3.0)]));
        assert_eq!(by_one_clock((None, None, at(4.0)), with).0, [4.0, 3.0]);
    }

    #[test]
    fn a_difference_within_the_quartiles_has_no_word() {
        assert_eq!(ratio_of([0.9, 1.0, 1.1], [0.95, 1.05, 1.15]).word(), "");
        assert_eq!(ratio_of([0.9, 1.0, 1.1], [1.9, 2.0, 2.1]).word(), "slower");
        assert_eq!(ratio_of([0.9, 1.0, 1.1], [0.4, 0.5, 0.6]).word(), "faster");
    }
}
