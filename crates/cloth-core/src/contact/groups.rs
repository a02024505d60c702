//! `contact_groups` (NUMERICS §15): triangles in groups that lie close together at the start.

use std::ops::Range;

use super::ContactSurface;

impl ContactSurface {
    /// All triangles of cloths, so ordered that each `size` of them lie close together at the start, and so do the groups below each node of a binary
    /// tree over the groups, filled up to a power of two with empty ones.
    #[must_use]
    pub fn groups(&self, size: usize) -> Vec<u32> {
        self.groups_of(0..self.cloth_triangles() as u32, size)
    }

    /// The same of the triangles of bodies.
    #[must_use]
    pub fn body_groups(&self, size: usize) -> Vec<u32> {
        self.groups_of(self.cloth_triangles() as u32..self.triangles().len() as u32, size)
    }

    fn groups_of(&self, triangles: Range<u32>, size: usize) -> Vec<u32> {
        let centres: Vec<[f64; 3]> = (self.triangles().iter())
            .map(|corners| {
                let [a, b, c] = corners.map(|corner| self.start(corner));
                std::array::from_fn(|k| a[k] + b[k] + c[k])
            })
            .collect();
        let mut order: Vec<u32> = triangles.collect();
        bisect(&centres, &mut order, size.max(1));
        order
    }
}

/// Sorts by recursive bisection across the longest side, so that halves are those of the tree.
fn bisect(centres: &[[f64; 3]], order: &mut [u32], size: usize) {
    let groups = order.len().div_ceil(size).next_power_of_two();
    if groups <= 1 {
        return;
    }
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for &triangle in &*order {
        for axis in 0..3 {
            low[axis] = low[axis].min(centres[triangle as usize][axis]);
            high[axis] = high[axis].max(centres[triangle as usize][axis]);
        }
    }
    let side = |axis: usize| high[axis] - low[axis];
    let axis = (1..3).fold(0, |most, axis| if side(axis) > side(most) { axis } else { most });
    let middle = groups / 2 * size;
    order.select_nth_unstable_by(middle, |&a, &b| {
        let key = |triangle: u32| centres[triangle as usize][axis];
        key(a).total_cmp(&key(b)).then(a.cmp(&b))
    });
    let (left, right) = order.split_at_mut(middle);
    bisect(centres, left, size);
    bisect(centres, right, size);
}
