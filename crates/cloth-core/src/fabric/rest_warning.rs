//! What is allowed in a rest shape but looks like a slip.

use std::{collections::HashMap, fmt};

use glam::DVec2;

/// Something about a rest shape that looks like a slip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RestWarning {
    /// The pattern is much larger or smaller than the cloth in space: its coordinates are hardly metres.
    Scale {
        /// Square root of the area of the pattern over that in space.
        ratio: f64,
    },
    /// Triangles whose bending stiffness had to be limited, as their neighbours leave their curvature nearly undetermined.
    Limited {
        /// How many.
        triangles: usize,
    },
    /// Triangles much longer than they are high.
    Needles {
        /// How many.
        triangles: usize,
        /// The worst one.
        worst: usize,
        /// Its height over its longest edge.
        ratio: f64,
    },
    /// Triangles whose middle lies in another one of the pattern.
    Overlap {
        /// How many.
        triangles: usize,
        /// The first one, and one in which it lies.
        first: [usize; 2],
    },
}

/// Ratio of sizes from which on pattern coordinates are hardly metres.
const SUSPICIOUS_SCALE: f64 = 10.0;

/// Height over the longest edge below which a triangle is a needle.
const NEEDLE: f64 = 0.02;

/// Cells of the search that one triangle may cover. What covers more is far larger than the others, and is left out.
const CELLS_MAX: f64 = 4096.0;

impl RestWarning {
    /// For the ratio of the size of a pattern to that of the cloth in space.
    pub(super) fn of_scale(ratio: f64) -> Option<Self> {
        let is_usual = (1.0 / SUSPICIOUS_SCALE..=SUSPICIOUS_SCALE).contains(&ratio);
        (!is_usual).then_some(Self::Scale { ratio })
    }
}

/// Triangles that are needles at rest.
pub(super) fn needles(corners: &[[[f64; 2]; 3]]) -> Option<RestWarning> {
    let ratio = |corners: &[[f64; 2]; 3]| {
        let [a, b, c] = corners.map(DVec2::from);
        let longest =
            [b - a, c - b, a - c].map(DVec2::length_squared).into_iter().fold(0.0, f64::max);
        (b - a).perp_dot(c - a).abs() / longest
    };
    let needles = corners.iter().map(ratio).enumerate().filter(|(_, ratio)| *ratio < NEEDLE);
    let mut worst: Option<(usize, f64)> = None;
    let mut triangles = 0;
    for (triangle, ratio) in needles {
        triangles += 1;
        if worst.is_none_or(|(_, least)| ratio < least) {
            worst = Some((triangle, ratio));
        }
    }
    worst.map(|(worst, ratio)| RestWarning::Needles { triangles, worst, ratio })
}

/// Triangles of a pattern that lie on others.
pub(super) fn overlap(corners: &[[[f64; 2]; 3]]) -> Option<RestWarning> {
    let area = |corners: &[[f64; 2]; 3]| {
        let [a, b, c] = corners.map(DVec2::from);
        (b - a).perp_dot(c - a).abs()
    };
    let cell = (corners.iter().map(area).sum::<f64>() / corners.len().max(1) as f64).sqrt();
    let mut cells: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
    for (triangle, corners) in corners.iter().enumerate() {
        let [a, b, c] = corners.map(|corner| DVec2::from(corner) / cell);
        let [low, high] = [a.min(b).min(c).floor(), a.max(b).max(c).floor()];
        let sides = high - low + 1.0;
        // Not finite where no triangle has an area, which is refused elsewhere.
        let is_covered = sides.x * sides.y <= CELLS_MAX;
        if !is_covered {
            continue;
        }
        for x in low.x as i64..=high.x as i64 {
            for y in low.y as i64..=high.y as i64 {
                cells.entry([x, y]).or_default().push(triangle);
            }
        }
    }
    let mut triangles = 0;
    let mut first = None;
    for (triangle, own) in corners.iter().enumerate() {
        let [a, b, c] = own.map(DVec2::from);
        let middle = (a + b + c) / 3.0;
        let place = (middle / cell).floor();
        let near = cells.get(&[place.x as i64, place.y as i64]);
        let below = near
            .into_iter()
            .flatten()
            .find(|&&other| other != triangle && contains(corners[other], middle));
        if let Some(&below) = below {
            triangles += 1;
            first = first.or(Some([triangle, below]));
        }
    }
    first.map(|first| RestWarning::Overlap { triangles, first })
}

/// Whether a point is inside a triangle, and not on its border.
fn contains(corners: [[f64; 2]; 3], point: DVec2) -> bool {
    let [a, b, c] = corners.map(DVec2::from);
    let whole = (b - a).perp_dot(c - a);
    let parts =
        [[a, b], [b, c], [c, a]].map(|[from, to]| (to - from).perp_dot(point - from) / whole);
    parts.into_iter().all(|part| part > 1e-6)
}

impl fmt::Display for RestWarning {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scale { ratio } => write!(
                formatter,
                "the pattern is {ratio:.3e} times as large as the cloth in space: if its coordinates are not metres, give the scale that \
                 makes them so, about {:.3e}",
                1.0 / ratio
            ),
            Self::Limited { triangles } => write!(
                formatter,
                "{triangles} triangles bend more easily than the fabric, as of their neighbours some lie nearly on one conic with them: \
                 mesh the cloth more evenly"
            ),
            Self::Needles { triangles, worst, ratio } => write!(
                formatter,
                "{triangles} triangles are needles, triangle {worst} the thinnest with a height of {ratio:.1e} times its length: they make \
                 explicit steps short and bend like nothing; mesh the cloth more evenly"
            ),
            Self::Overlap { triangles, first } => write!(
                formatter,
                "{triangles} triangles lie on others in the pattern, triangle {} on {} first: right for panels cut from several layers; \
                 else move the panels apart",
                first[0], first[1]
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn needles_are_counted_and_the_worst_is_named() {
        let tall = |height: f64| [[0.0, 0.0], [1.0, 0.0], [0.5, height]];
        assert_eq!(needles(&[tall(0.5), tall(0.03)]), None);
        let found = needles(&[tall(0.5), tall(0.01), tall(0.001), tall(0.015)]);
        let Some(RestWarning::Needles { triangles: 3, worst: 2, ratio }) = found else {
            panic!("{found:?}");
        };
        assert!((ratio - 0.001).abs() < 1e-12);
    }

    #[test]
    fn panels_on_each_other_are_seen_and_neighbours_are_not() {
        let square = |x: f64, y: f64| {
            let [a, b, c, d] = [[x, y], [x + 1.0, y], [x + 1.0, y + 1.0], [x, y + 1.0]];
            [[a, b, c], [a, c, d]]
        };
        let sheet: Vec<_> =
            (0..40).flat_map(|i| square(f64::from(i % 8), f64::from(i / 8))).collect();
        assert_eq!(overlap(&sheet), None);
        let mut twice = sheet.clone();
        twice.extend(square(2.25, 1.25));
        let found = overlap(&twice);
        assert!(matches!(found, Some(RestWarning::Overlap { first: [_, _], .. })), "{found:?}");
        assert_eq!(overlap(&[]), None);
        // One far larger than the others is left out of the search, and does not fill memory.
        let mut giant = sheet;
        giant.push([[0.0, -1.0], [1e9, -1.0], [1e9, -1.0 - 1e-9]]);
        assert_eq!(overlap(&giant), None);
    }
}
