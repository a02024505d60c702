//! Which groups are near each other: a spatial hash of their boxes.

use cloth_core::Real;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::{
    bounds::Bounds,
    groups::{CLUSTER, Groups},
};

/// Groups with a half extent above this multiple of the mean are kept out of the hash, which would
/// need huge cells for them, and are compared with every group.
const LARGE: f64 = 4.0;

/// Cells along each axis at most; the hash is periodic beyond.
const CELLS_MAX: usize = 1 << 10;

/// For each group the groups whose boxes are within reach, ascending, itself included.
#[derive(Debug)]
pub(super) struct BroadPhase<T> {
    hash: Hash<T>,
    lists: Vec<ClusterList>,
}

/// The lists of the groups of one cluster, one after the other.
#[derive(Clone, Debug, Default)]
struct ClusterList {
    offsets: Vec<u32>,
    groups: Vec<u32>,
}

/// Groups sorted by the cell of their centre.
#[derive(Debug)]
struct Hash<T> {
    cell_size: T,
    /// Cells along each axis, powers of two.
    dimensions: [usize; 3],
    cell_offsets: Vec<u32>,
    sorted: Vec<u32>,
    cell_of: Vec<u32>,
    large: Vec<u32>,
}

impl<T: Real> BroadPhase<T> {
    pub(super) fn new(cluster_count: usize) -> Self {
        let hash = Hash {
            cell_size: T::ONE,
            dimensions: [4; 3],
            cell_offsets: Vec::new(),
            sorted: Vec::new(),
            cell_of: Vec::new(),
            large: Vec::new(),
        };
        Self { hash, lists: vec![ClusterList::default(); cluster_count] }
    }

    /// Builds the lists of all groups nearer than `reach` \[m\].
    pub(super) fn build(&mut self, groups: &Groups<T>, reach: T, arch: pulp::Arch) {
        self.hash.fill(groups, reach);
        let hash = &self.hash;
        let bounds = groups.bounds();
        let reach_squared = reach * reach;
        self.lists.par_iter_mut().enumerate().for_each(|(cluster, list)| {
            arch.dispatch(ListTask { hash, bounds, reach_squared, cluster, list });
        });
    }

    /// The groups near `group`, itself included.
    #[inline(always)]
    pub(super) fn candidates(&self, group: usize) -> &[u32] {
        let list = &self.lists[group / CLUSTER];
        let local = group % CLUSTER;
        &list.groups[list.offsets[local] as usize..list.offsets[local + 1] as usize]
    }

    /// Unordered pairs of groups in the lists.
    pub(super) fn pair_count(&self) -> u64 {
        let entries: usize = self.lists.iter().map(|list| list.groups.len()).sum();
        let own: usize = self.lists.iter().map(|list| list.offsets.len().saturating_sub(1)).sum();
        ((entries - own) / 2 + own) as u64
    }
}

impl<T: Real> Hash<T> {
    /// Sorts the groups by cells of such a size that two groups within `reach` lie in the same or
    /// in neighbouring cells.
    fn fill(&mut self, groups: &Groups<T>, reach: T) {
        let bounds = groups.bounds();
        let mut everything = Bounds::empty();
        let mut sum = 0.0;
        for bounds in bounds {
            everything.merge(bounds);
            sum += bounds.half_extent().to_f64();
        }
        let limit = T::from_f64(LARGE * sum / bounds.len() as f64);
        self.large.clear();
        let mut largest = T::ZERO;
        for (g, bounds) in bounds.iter().enumerate() {
            let extent = bounds.half_extent();
            if extent <= limit {
                largest = largest.maximum(extent);
            } else {
                self.large.push(g as u32);
            }
        }
        // A little larger than needed, so that rounding of a cell index cannot matter.
        self.cell_size = (largest + largest + reach) * T::from_f64(1.001);
        for axis in 0..3 {
            let side = (everything.high[axis] - everything.low[axis]) / self.cell_size;
            let cells = side.floor_to_i32().max(0) as usize + 1;
            // At least four, so that a cell and its two neighbours differ.
            self.dimensions[axis] = cells.next_power_of_two().clamp(4, CELLS_MAX);
        }
        // No more cells than twice the groups: the hash is periodic, a smaller period costs only
        // more candidates to reject.
        let cell_limit = (2 * bounds.len()).next_power_of_two().max(64);
        while self.dimensions.iter().product::<usize>() > cell_limit {
            let longest = (0..3).max_by_key(|&axis| self.dimensions[axis]).unwrap_or(0);
            self.dimensions[longest] /= 2;
        }
        self.counting_sort(bounds);
    }

    fn counting_sort(&mut self, bounds: &[Bounds<T>]) {
        let cell_count = self.dimensions.iter().product::<usize>();
        self.cell_offsets.clear();
        self.cell_offsets.resize(cell_count + 1, 0);
        self.cell_of.clear();
        let mut large = self.large.iter().peekable();
        for (g, bounds) in bounds.iter().enumerate() {
            let is_large = large.next_if(|&&next| next as usize == g).is_some();
            let cell = if is_large { u32::MAX } else { self.cell(self.coordinates(bounds)) as u32 };
            self.cell_of.push(cell);
            if !is_large {
                self.cell_offsets[cell as usize + 1] += 1;
            }
        }
        for cell in 0..cell_count {
            self.cell_offsets[cell + 1] += self.cell_offsets[cell];
        }
        self.sorted.clear();
        self.sorted.resize(self.cell_offsets[cell_count] as usize, 0);
        // Offsets are used as cursors and shifted back after that.
        for (g, &cell) in self.cell_of.iter().enumerate().filter(|(_, cell)| **cell != u32::MAX) {
            let cursor = &mut self.cell_offsets[cell as usize];
            self.sorted[*cursor as usize] = g as u32;
            *cursor += 1;
        }
        self.cell_offsets.copy_within(0..cell_count, 1);
        self.cell_offsets[0] = 0;
    }

    #[inline(always)]
    fn coordinates(&self, bounds: &Bounds<T>) -> [i32; 3] {
        bounds.centre().map(|value| (value / self.cell_size).floor_to_i32())
    }

    #[inline(always)]
    fn cell(&self, [x, y, z]: [i32; 3]) -> usize {
        let wrap = |value: i32, axis: usize| value as usize & (self.dimensions[axis] - 1);
        (wrap(z, 2) * self.dimensions[1] + wrap(y, 1)) * self.dimensions[0] + wrap(x, 0)
    }

    /// The groups in one cell.
    #[inline(always)]
    fn groups_in(&self, coordinates: [i32; 3]) -> &[u32] {
        let cell = self.cell(coordinates);
        &self.sorted[self.cell_offsets[cell] as usize..self.cell_offsets[cell + 1] as usize]
    }
}

/// The lists of one cluster.
struct ListTask<'a, T> {
    hash: &'a Hash<T>,
    bounds: &'a [Bounds<T>],
    reach_squared: T,
    cluster: usize,
    list: &'a mut ClusterList,
}

impl<T: Real> NullaryFnOnce for ListTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        self.list.offsets.clear();
        self.list.groups.clear();
        self.list.offsets.push(0);
        let first = self.cluster * CLUSTER;
        for group in first..(first + CLUSTER).min(self.bounds.len()) {
            let start = self.list.groups.len();
            if self.hash.large.binary_search(&(group as u32)).is_ok() {
                for candidate in 0..self.bounds.len() as u32 {
                    self.test(group, candidate);
                }
            } else {
                self.around(group);
                for &candidate in &self.hash.large {
                    self.test(group, candidate);
                }
            }
            self.list.groups[start..].sort_unstable();
            self.list.offsets.push(self.list.groups.len() as u32);
        }
    }
}

impl<T: Real> ListTask<'_, T> {
    /// Tests all groups in the 27 cells around the centre of a group.
    #[inline(always)]
    fn around(&mut self, group: usize) {
        let hash = self.hash;
        let [x, y, z] = hash.coordinates(&self.bounds[group]);
        for dz in -1..=1 {
            for dy in -1..=1 {
                for dx in -1..=1 {
                    let cell = [x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz)];
                    for &candidate in hash.groups_in(cell) {
                        self.test(group, candidate);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn test(&mut self, group: usize, candidate: u32) {
        let gap_squared = self.bounds[group].gap_squared(&self.bounds[candidate as usize]);
        if gap_squared < self.reach_squared {
            self.list.groups.push(candidate);
        }
    }
}
