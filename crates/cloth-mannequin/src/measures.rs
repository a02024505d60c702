//! What a tailor measures.

use std::ops::RangeInclusive;

/// Edges that a mannequin can have \[m\]: its hands are lost with longer ones, memory with shorter ones.
pub const EDGE: RangeInclusive<f64> = 0.005..=0.03;

/// The measures of a body \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measures {
    /// From the soles to the crown.
    pub height: f64,
    /// Girth of the neck, halfway up.
    pub neck: f64,
    /// Girth of the chest, at its fullest.
    pub chest: f64,
    /// Girth of the waist, at its narrowest.
    pub waist: f64,
    /// Girth of the hips, at their fullest.
    pub hips: f64,
    /// Breadth of the shoulders, from one acromion to the other.
    pub shoulders: f64,
}

/// The values between which each measure lies: those of adults, with some to spare.
const RANGES: [(&str, RangeInclusive<f64>); 6] = [
    ("height", 1.4..=2.1),
    ("neck", 0.28..=0.5),
    ("chest", 0.7..=1.4),
    ("waist", 0.55..=1.4),
    ("hips", 0.75..=1.5),
    ("shoulders", 0.3..=0.5),
];

/// Pairs of which the first is at most so many times the second: beyond, one part of the trunk would stand out of the other like a shelf.
const RATIOS: [(&str, &str, f64); 5] = [
    ("waist", "chest", 1.2),
    ("waist", "hips", 1.15),
    ("chest", "waist", 1.6),
    ("hips", "waist", 1.7),
    ("neck", "chest", 0.5),
];

/// What is wrong with measures.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MannequinError {
    /// A measure that no adult has.
    #[error("is {value}: give {least} to {most} m")]
    OutOfRange {
        /// Its name, as that of a field of [`Measures`], or `edge`.
        what: &'static str,
        /// Its value \[m\].
        value: f64,
        /// The least one.
        least: f64,
        /// The largest one.
        most: f64,
    },
    /// Two measures that do not go together.
    #[error(
        "of {value} m is too much for the {other} of {beside} m: give at most {most:.3} m, or more to the {other}"
    )]
    OutOfProportion {
        /// The name of the one that is too large.
        what: &'static str,
        /// Its value \[m\].
        value: f64,
        /// The name of the one that it is too large for.
        other: &'static str,
        /// Its value \[m\].
        beside: f64,
        /// What would go with it \[m\].
        most: f64,
    },
}

impl MannequinError {
    /// The name of the measure.
    #[must_use]
    pub const fn what(&self) -> &'static str {
        match self {
            Self::OutOfRange { what, .. } | Self::OutOfProportion { what, .. } => what,
        }
    }
}

impl Default for Measures {
    /// Between the usual sizes of women and men.
    fn default() -> Self {
        Self { height: 1.72, neck: 0.36, chest: 0.92, waist: 0.76, hips: 0.96, shoulders: 0.38 }
    }
}

impl Measures {
    /// Those of [`default`](Self::default), scaled to a height \[m\].
    #[must_use]
    pub fn of_height(height: f64) -> Self {
        let Self { height: usual, neck, chest, waist, hips, shoulders } = Self::default();
        let [neck, chest, waist, hips, shoulders] =
            [neck, chest, waist, hips, shoulders].map(|girth| girth * height / usual);
        Self { height, neck, chest, waist, hips, shoulders }
    }

    fn named(&self, name: &str) -> f64 {
        match name {
            "height" => self.height,
            "neck" => self.neck,
            "chest" => self.chest,
            "waist" => self.waist,
            "hips" => self.hips,
            _ => self.shoulders,
        }
    }

    /// Whether an adult can have them.
    ///
    /// # Errors
    /// A [`MannequinError`] that names the measure.
    pub fn check(&self) -> Result<(), MannequinError> {
        for (what, range) in RANGES {
            range_check(what, self.named(what), &range)?;
        }
        for (what, other, ratio) in RATIOS {
            let [value, beside] = [what, other].map(|name| self.named(name));
            let most = ratio * beside;
            if value > most {
                return Err(MannequinError::OutOfProportion { what, value, other, beside, most });
            }
        }
        Ok(())
    }
}

pub(crate) fn edge_check(edge: f64) -> Result<(), MannequinError> {
    range_check("edge", edge, &EDGE)
}

fn range_check(
    what: &'static str,
    value: f64,
    range: &RangeInclusive<f64>,
) -> Result<(), MannequinError> {
    if range.contains(&value) {
        return Ok(());
    }
    Err(MannequinError::OutOfRange { what, value, least: *range.start(), most: *range.end() })
}
