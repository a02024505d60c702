//! Scan conversion: which samples of a raster a triangle covers, and how near it is there.

use glam::Vec3;

/// A triangle on a raster: column and row of its corners \[sample\] and how near they are, which is
/// linear between them.
pub(super) struct ScanTriangle {
    /// Corners in the order of their rows.
    corners: [Vec3; 3],
    /// Change of nearness from one column to the next and from one row to the next.
    along: f32,
    down: f32,
    /// Least and greatest nearness: what rounding carries beyond them in slivers is cut off.
    nearness: [f32; 2],
    /// First row covered and the one after the last.
    rows: [usize; 2],
    /// First column covered and the one after the last.
    columns: [usize; 2],
}

impl ScanTriangle {
    /// The triangle with these corners, unless it covers no sample; samples are in the middle of the
    /// cells of the raster.
    #[inline]
    pub(super) fn new([mut a, mut b, mut c]: [Vec3; 3]) -> Option<Self> {
        let [rows, columns] = bounds([a, b, c]);
        if rows[0] >= rows[1] || columns[0] >= columns[1] {
            return None;
        }
        // An edge is always followed from its upper end, whichever triangle it belongs to, so that
        // neighbours leave no gap.
        if b.y < a.y {
            std::mem::swap(&mut a, &mut b);
        }
        if c.y < b.y {
            std::mem::swap(&mut b, &mut c);
            if b.y < a.y {
                std::mem::swap(&mut a, &mut b);
            }
        }
        let (ab, ac) = (b - a, c - a);
        let area = ab.x * ac.y - ab.y * ac.x;
        if area == 0.0 {
            return None;
        }
        let along = (ab.z * ac.y - ac.z * ab.y) / area;
        let down = (ac.z * ab.x - ab.z * ac.x) / area;
        let nearness = [a.z.min(b.z).min(c.z), a.z.max(b.z).max(c.z)];
        Some(Self { corners: [a, b, c], along, down, nearness, rows, columns })
    }

    /// First row covered and the one after the last.
    pub(super) fn rows(&self) -> [usize; 2] {
        self.rows
    }

    /// First column covered and the one after the last.
    pub(super) fn columns(&self) -> [usize; 2] {
        self.columns
    }

    /// Calls `span` for each row from `top` up to `bottom` that is covered, with the row, the first
    /// column covered, the one after the last, and the nearness along them.
    #[inline]
    pub(super) fn spans(
        &self,
        top: usize,
        bottom: usize,
        mut span: impl FnMut(usize, usize, usize, SpanNearness),
    ) {
        let [a, b, c] = self.corners;
        let slope = |from: Vec3, to: Vec3| (to.x - from.x) / (to.y - from.y);
        let (long, upper, lower) = (slope(a, c), slope(a, b), slope(b, c));
        let [low, high] = self.nearness;
        for row in self.rows[0].max(top)..self.rows[1].min(bottom) {
            let y = row as f32 + 0.5;
            let x = a.x + (y - a.y) * long;
            let other = if y < b.y { a.x + (y - a.y) * upper } else { b.x + (y - b.y) * lower };
            let (start, end) = (ceiling(x.min(other) - 0.5), ceiling(x.max(other) - 0.5));
            if start < end {
                let at_zero = a.z + self.along * (0.5 - a.x) + self.down * (y - a.y);
                span(row, start, end, SpanNearness { at_zero, along: self.along, low, high });
            }
        }
    }
}

/// Nearness along a row of a triangle.
#[derive(Clone, Copy)]
pub(super) struct SpanNearness {
    at_zero: f32,
    along: f32,
    low: f32,
    high: f32,
}

impl SpanNearness {
    /// The nearness in a column.
    #[inline]
    pub(super) fn at(self, column: usize) -> f32 {
        // As comparisons, for none of them is no number: `max` and `min` would ask for that.
        let nearness = self.at_zero + self.along * column as i32 as f32;
        let nearness = if nearness > self.low { nearness } else { self.low };
        if nearness < self.high { nearness } else { self.high }
    }
}

/// Samples that the bounds of a triangle hold: rows, then columns, each from the first to the one after the last.
#[inline]
pub(super) fn bounds([a, b, c]: [Vec3; 3]) -> [[usize; 2]; 2] {
    let (least, greatest) = (a.min(b).min(c), a.max(b).max(c));
    let range = |least: f32, greatest: f32| [ceiling(least - 0.5), ceiling(greatest - 0.5)];
    [range(least.y, greatest.y), range(least.x, greatest.x)]
}

/// How near a triangle is at the one sample that its bounds hold, unless it leaves that out. Most triangles of a fine
/// cloth on a small map are of this kind, and following their edges would take several times as long.
#[inline]
pub(super) fn single([a, b, c]: [Vec3; 3], row: usize, column: usize) -> Option<f32> {
    let (x, y) = (column as f32 + 0.5, row as f32 + 0.5);
    let side =
        |from: Vec3, to: Vec3| (to.x - from.x) * (y - from.y) - (to.y - from.y) * (x - from.x);
    let (of_c, of_a, of_b) = (side(a, b), side(b, c), side(c, a));
    let sum = of_a + of_b + of_c;
    let inside = of_a.min(of_b).min(of_c) >= 0.0 || of_a.max(of_b).max(of_c) <= 0.0;
    if !inside || sum == 0.0 {
        return None;
    }
    Some((of_a * a.z + of_b * b.z + of_c * c.z) / sum)
}

/// The least index that is not below `x`; zero for what is not a number.
#[inline]
pub(super) fn ceiling(x: f32) -> usize {
    // The conversion saturates. Rounding functions are slow on processors that have no instruction
    // for them.
    let below = x as i32;
    below.saturating_add(i32::from((below as f32) < x)).max(0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles of a square cover each sample of it once.
    #[test]
    fn neighbours_share_no_sample_and_leave_no_gap() {
        let corner = |x: f32, y: f32| Vec3::new(x, y, x + 2.0 * y);
        let [a, b, c, d] =
            [corner(1.3, 2.1), corner(17.9, 4.4), corner(15.2, 19.7), corner(2.6, 16.3)];
        let mut seen = vec![0; 20 * 20];
        for corners in [[a, b, c], [c, d, a]] {
            let triangle = ScanTriangle::new(corners).unwrap();
            triangle.spans(0, 20, |row, start, end, nearness| {
                for column in start..end {
                    seen[row * 20 + column] += 1;
                    let expected = column as f32 + 0.5 + 2.0 * (row as f32 + 0.5);
                    assert!((nearness.at(column) - expected).abs() < 1e-3);
                }
            });
        }
        let inside = |x: f32, y: f32| {
            let corners = [a, b, c, d];
            (0..4).all(|k| {
                let (from, to) = (corners[k], corners[(k + 1) % 4]);
                (to.x - from.x) * (y - from.y) - (to.y - from.y) * (x - from.x) > 0.0
            })
        };
        for row in 0..20 {
            for column in 0..20 {
                let expected = i32::from(inside(column as f32 + 0.5, row as f32 + 0.5));
                assert_eq!(seen[row * 20 + column], expected, "row {row}, column {column}");
            }
        }
    }

    /// A triangle around one sample is as near there as its row says, and one beside it leaves it out.
    #[test]
    fn a_single_sample_is_as_near_as_in_its_row() {
        let around = |shift: f32| {
            [(3.1, 4.2), (3.9, 4.3), (3.4, 4.95)].map(|(x, y)| Vec3::new(x + shift, y, x - 2.0 * y))
        };
        let corners = around(0.0);
        assert_eq!(bounds(corners), [[4, 5], [3, 4]]);
        let near = single(corners, 4, 3).unwrap();
        let mut in_row = None;
        let triangle = ScanTriangle::new(corners).unwrap();
        triangle.spans(0, 9, |_, start, _, nearness| in_row = Some(nearness.at(start)));
        assert!((near - in_row.unwrap()).abs() < 1e-5, "{near} {in_row:?}");
        assert!((near - (3.5 - 2.0 * 4.5)).abs() < 1e-5, "{near}");
        let turned = [corners[0], corners[2], corners[1]];
        assert!((single(turned, 4, 3).unwrap() - near).abs() < 1e-5);
        assert_eq!(single(around(0.35), 4, 3), None);
    }

    #[test]
    fn rows_outside_the_band_are_left_out() {
        let corners = [Vec3::ZERO, Vec3::new(9.0, 0.0, 0.0), Vec3::new(0.0, 9.0, 0.0)];
        let mut rows = Vec::new();
        let triangle = ScanTriangle::new(corners).unwrap();
        assert_eq!(triangle.rows(), [0, 9]);
        triangle.spans(3, 6, |row, _, _, _| rows.push(row));
        assert_eq!(rows, [3, 4, 5]);
        assert!(ScanTriangle::new([Vec3::ONE; 3]).is_none());
        assert!(ScanTriangle::new([Vec3::NAN; 3]).is_none());
    }
}
