//! What came of an experiment.

use std::fmt;

use crate::MeshKind;

/// Everything that an experiment found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// What was measured.
    pub measurements: Vec<Measurement>,
    /// Pictures of it.
    pub plots: Vec<Plot>,
}

/// One number beside what it should be.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// What it is of.
    pub case: String,
    /// How the piece was meshed.
    pub mesh: MeshKind,
    /// Cells of the mesh along what matters most, for the trend.
    pub cells: u32,
    /// The number.
    pub measured: f64,
    /// What it should be.
    pub expected: Expected,
    /// Unit of both, empty for none.
    pub unit: &'static str,
}

/// What a number should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Expected {
    /// A value, within a share of it.
    Value {
        /// The value.
        value: f64,
        /// Largest relative deviation.
        tolerance: f64,
    },
    /// Anything between two numbers.
    Between {
        /// The smaller one.
        low: f64,
        /// The larger one.
        high: f64,
    },
}

/// Curves over one axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plot {
    /// What is shown.
    pub title: String,
    /// Names of the axes, with units.
    pub axes: [String; 2],
    /// Which axes are logarithmic.
    pub logarithmic: [bool; 2],
    /// The curves.
    pub curves: Vec<Curve>,
}

/// Points that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// Their name.
    pub name: String,
    /// How they are drawn.
    pub style: CurveStyle,
    /// The points.
    pub points: Vec<[f64; 2]>,
}

/// How a curve is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CurveStyle {
    /// Single points: what was measured.
    #[default]
    Marks,
    /// A line: theory.
    Line,
}

impl Outcome {
    /// Whether every number is what it should be.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.measurements.iter().all(Measurement::passes)
    }

    /// Adds a number that should have a value, within a share of it; `of` is mesh and cells.
    pub fn value(
        &mut self,
        case: impl Into<String>,
        of: (MeshKind, u32),
        unit: &'static str,
        measured: f64,
        [value, tolerance]: [f64; 2],
    ) {
        self.add(case.into(), of, unit, measured, Expected::Value { value, tolerance });
    }

    /// Adds a number that should lie between two.
    pub fn between(
        &mut self,
        case: impl Into<String>,
        of: (MeshKind, u32),
        unit: &'static str,
        measured: f64,
        [low, high]: [f64; 2],
    ) {
        self.add(case.into(), of, unit, measured, Expected::Between { low, high });
    }

    fn add(
        &mut self,
        case: String,
        (mesh, cells): (MeshKind, u32),
        unit: &'static str,
        measured: f64,
        expected: Expected,
    ) {
        self.measurements.push(Measurement { case, mesh, cells, measured, expected, unit });
    }

    /// Measurements of one case on one kind of mesh, in the order of the cases; each from coarse to fine.
    #[must_use]
    pub fn trends(&self) -> Vec<Vec<&Measurement>> {
        let mut trends: Vec<Vec<&Measurement>> = Vec::new();
        for row in &self.measurements {
            let key = |other: &Measurement| (&other.case, other.mesh) == (&row.case, row.mesh);
            match trends.iter_mut().find(|trend| key(trend[0])) {
                Some(trend) => trend.push(row),
                None => trends.push(vec![row]),
            }
        }
        for trend in &mut trends {
            trend.sort_by_key(|row| row.cells);
        }
        trends
    }
}

impl Measurement {
    /// Whether it is what it should be; a number that is none never is.
    #[must_use]
    pub fn passes(&self) -> bool {
        match self.expected {
            Expected::Value { value, tolerance } => {
                (self.measured - value).abs() <= tolerance * value.abs()
            }
            Expected::Between { low, high } => (low..=high).contains(&self.measured),
        }
    }

    /// Relative deviation from the value that is expected, or beyond the nearer bound; 0 within bounds.
    #[must_use]
    pub fn error(&self) -> f64 {
        match self.expected {
            Expected::Value { value, .. } => (self.measured - value) / value.abs(),
            Expected::Between { low, high } => {
                let beyond = self.measured - self.measured.clamp(low, high);
                let scale = low.abs().max(high.abs());
                if scale > 0.0 { beyond / scale } else { beyond }
            }
        }
    }
}

/// A number with as many digits as matter.
#[must_use]
pub(crate) fn number(value: f64) -> String {
    match value.abs() {
        _ if value.is_nan() => "no rest".to_owned(),
        0.0 => "0".to_owned(),
        size if !(1e-3..1e5).contains(&size) => format!("{value:.2e}"),
        size => format!("{value:.*}", (4 - size.log10().floor() as i32).clamp(0, 6) as usize),
    }
}

impl fmt::Display for Expected {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Value { value, tolerance } => {
                write!(
                    formatter,
                    "{} ± {} %",
                    number(value),
                    number(100.0 * tolerance).trim_end_matches('0').trim_end_matches('.')
                )
            }
            Self::Between { low, high } if low == f64::NEG_INFINITY => {
                write!(formatter, "at most {}", number(high))
            }
            Self::Between { low, high } => write!(formatter, "{} to {}", number(low), number(high)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_fails() {
        let mut outcome = Outcome::default();
        let of = (MeshKind::Regular, 8);
        outcome.value("a", of, "", 1.01, [1.0, 0.02]);
        outcome.between("b", of, "", 0.5, [0.0, 1.0]);
        assert!(outcome.passes());
        for wrong in [1.03, f64::NAN, f64::INFINITY] {
            let mut outcome = outcome.clone();
            outcome.value("c", of, "", wrong, [1.0, 0.02]);
            assert!(!outcome.passes(), "{wrong}");
        }
        outcome.between("d", of, "", f64::NAN, [0.0, 1.0]);
        assert!(!outcome.passes());
    }

    #[test]
    fn a_trend_goes_from_coarse_to_fine() {
        let mut outcome = Outcome::default();
        for (case, cells) in [("a", 8), ("b", 4), ("a", 4)] {
            outcome.value(case, (MeshKind::Regular, cells), "", 1.0, [1.0, 0.02]);
        }
        let cells: Vec<Vec<u32>> = outcome
            .trends()
            .iter()
            .map(|rows| rows.iter().map(|row| row.cells).collect())
            .collect();
        assert_eq!(cells, [vec![4, 8], vec![4]]);
    }

    #[test]
    fn numbers_are_written_with_the_digits_that_matter() {
        let all = [0.0, 0.0125, 7.8373, 1066.8, 1.5e-6, f64::NAN].map(number);
        assert_eq!(all, ["0", "0.012500", "7.8373", "1066.8", "1.50e-6", "no rest"]);
        let expected = Expected::Value { value: 7.8373, tolerance: 0.02 };
        assert_eq!(expected.to_string(), "7.8373 ± 2 %");
    }
}
