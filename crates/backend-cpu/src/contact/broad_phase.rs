//! Which groups are near each other: a spatial hash of their boxes.

use std::ops::Range;

use cloth_core::Real;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::{
    bounds::Bounds,
    groups::{CLUSTER, Groups},
};
use crate::memory::{LANES, lanes};

/// Groups with a half extent above this multiple of the mean are kept out of the hash, which would
/// need huge cells for them, and are compared with every group.
const LARGE: f64 = 2.0;

/// Cells along each axis at most; the hash is periodic beyond.
const CELLS_MAX: usize = 1 << 10;

/// For each group itself and the later groups whose boxes are within reach, ascending.
#[derive(Debug)]
pub(super) struct BroadPhase<T> {
    hash: Hash<T>,
    lists: Vec<ClusterList<T>>,
}

/// The lists of the groups of one cluster, one after the other.
#[derive(Clone, Debug)]
pub(super) struct ClusterList<T> {
    offsets: Vec<u32>,
    groups: Vec<Candidate<T>>,
}

/// A group near another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate<T> {
    pub(super) group: u32,
    /// Lower bound of the distance of any two of their particles, less the contact distance \[m\].
    /// Kept by the narrow phase; zero when the list is new.
    pub(super) clearance: T,
}

/// Groups sorted by the cell of their centre.
#[derive(Debug)]
struct Hash<T> {
    cell_size: T,
    /// Cells along each axis, powers of two.
    dimensions: [usize; 3],
    cell_offsets: Vec<u32>,
    sorted: Vec<u32>,
    /// Boxes of the sorted groups, low then high, padded to read whole packets.
    sorted_bounds: [Vec<T>; 6],
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
            sorted_bounds: std::array::from_fn(|_| Vec::new()),
            cell_of: Vec::new(),
            large: Vec::new(),
        };
        Self {
            hash,
            lists: vec![ClusterList { offsets: Vec::new(), groups: Vec::new() }; cluster_count],
        }
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

    /// The lists of each cluster.
    pub(super) fn lists_mut(&mut self) -> &mut [ClusterList<T>] {
        &mut self.lists
    }

    /// Pairs of groups in the lists.
    pub(super) fn pair_count(&self) -> u64 {
        self.lists.iter().map(|list| list.groups.len() as u64).sum()
    }
}

impl<T> ClusterList<T> {
    /// A group of the cluster, counted from its first, and the later groups near it.
    #[inline(always)]
    pub(super) fn candidates_mut(&mut self, local: usize) -> &mut [Candidate<T>] {
        &mut self.groups[self.offsets[local] as usize..self.offsets[local + 1] as usize]
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
        for (k, values) in self.sorted_bounds.iter_mut().enumerate() {
            values.clear();
            values.extend(self.sorted.iter().map(|&group| {
                let Bounds { low, high } = &bounds[group as usize];
                if k < 3 { low[k] } else { high[k - 3] }
            }));
            values.resize(self.sorted.len() + LANES, T::ZERO);
        }
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

    /// The sorted groups in the cells from `x` to `x + 2` of a row, as one run, or two where the
    /// period of the hash lies between.
    #[inline(always)]
    fn runs(&self, [x, y, z]: [i32; 3]) -> [Range<usize>; 2] {
        let last = self.cell([x.wrapping_add(2), y, z]);
        let first = self.cell([x, y, z]);
        let offset = |cell: usize| self.cell_offsets[cell] as usize;
        if first + 2 == last {
            return [offset(first)..offset(last + 1), 0..0];
        }
        let row = self.cell([0, y, z]);
        [offset(first)..offset(row + self.dimensions[0]), offset(row)..offset(last + 1)]
    }
}

/// The lists of one cluster.
struct ListTask<'a, T> {
    hash: &'a Hash<T>,
    bounds: &'a [Bounds<T>],
    reach_squared: T,
    cluster: usize,
    list: &'a mut ClusterList<T>,
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
                for candidate in group as u32..self.bounds.len() as u32 {
                    self.test(group, candidate);
                }
            } else {
                self.around(group);
                for &candidate in &self.hash.large {
                    self.test(group, candidate);
                }
            }
            self.list.groups[start..].sort_unstable_by_key(|candidate| candidate.group);
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
                let start = [x.wrapping_sub(1), y.wrapping_add(dy), z.wrapping_add(dz)];
                for run in hash.runs(start) {
                    self.test_run(group, run);
                }
            }
        }
    }

    /// Tests a run of sorted groups, a packet at a time.
    #[inline(always)]
    fn test_run(&mut self, group: usize, run: Range<usize>) {
        let Bounds { low, high } = self.bounds[group];
        let [lx, ly, lz, hx, hy, hz] = &self.hash.sorted_bounds;
        for start in run.clone().step_by(LANES) {
            let [lx, ly, lz] = [lanes(lx, start), lanes(ly, start), lanes(lz, start)];
            let [hx, hy, hz] = [lanes(hx, start), lanes(hy, start), lanes(hz, start)];
            let mut near = [false; LANES];
            for lane in 0..LANES {
                let dx = (low[0] - hx[lane]).maximum(lx[lane] - high[0]).maximum(T::ZERO);
                let dy = (low[1] - hy[lane]).maximum(ly[lane] - high[1]).maximum(T::ZERO);
                let dz = (low[2] - hz[lane]).maximum(lz[lane] - high[2]).maximum(T::ZERO);
                near[lane] = dx * dx + dy * dy + dz * dz < self.reach_squared;
            }
            let used = LANES.min(run.end - start);
            for (&near, &candidate) in near[..used].iter().zip(&self.hash.sorted[start..]) {
                if near && candidate as usize >= group {
                    self.push(candidate);
                }
            }
        }
    }

    /// Lists the candidate if it is near and not an earlier group.
    #[inline(always)]
    fn test(&mut self, group: usize, candidate: u32) {
        if (candidate as usize) < group {
            return;
        }
        let gap_squared = self.bounds[group].gap_squared(&self.bounds[candidate as usize]);
        if gap_squared < self.reach_squared {
            self.push(candidate);
        }
    }

    #[inline(always)]
    fn push(&mut self, candidate: u32) {
        self.list.groups.push(Candidate { group: candidate, clearance: T::ZERO });
    }
}
