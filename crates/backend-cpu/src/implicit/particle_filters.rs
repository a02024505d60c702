//! The filter S of every particle, for what assembles S A S.

use cloth_core::Real;

use super::{filter::Filter, matrix::Symmetric};

/// S by particle; most have the identity.
#[derive(Debug, Default)]
pub(crate) struct ParticleFilters<T> {
    /// Place of each particle's filter, [`NONE`] for the identity.
    places: Vec<u32>,
    filters: Vec<(u32, Symmetric<T>)>,
}

const NONE: u32 = u32::MAX;

impl<T: Real> ParticleFilters<T> {
    /// Filters of `count` particles, all the identity.
    pub(crate) fn new(count: usize) -> Self {
        Self { places: vec![NONE; count], filters: Vec::new() }
    }

    /// Whether there are no particles.
    pub(super) const fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Takes the filters of held and constrained particles.
    pub(super) fn fill(&mut self, filter: &Filter<'_, T>) {
        self.clear();
        for particle in (0..self.places.len()).filter(|&particle| filter.masses.is_held(particle)) {
            self.set(particle, [T::ZERO; 6]);
        }
        for constraint in filter.constraints.iter() {
            self.set(constraint.particle(), constraint.filter());
        }
    }

    fn clear(&mut self) {
        for (particle, _) in self.filters.drain(..) {
            self.places[particle as usize] = NONE;
        }
    }

    /// Gives a particle a filter.
    pub(super) fn set(&mut self, particle: usize, filter: Symmetric<T>) {
        if self.places[particle] == NONE {
            self.places[particle] = self.filters.len() as u32;
            self.filters.push((particle as u32, filter));
        } else {
            self.filters[self.places[particle] as usize].1 = filter;
        }
    }

    /// S of a particle, `None` for the identity.
    #[inline(always)]
    pub(super) fn get(&self, particle: usize) -> Option<&Symmetric<T>> {
        match self.places[particle] {
            NONE => None,
            place => Some(&self.filters[place as usize].1),
        }
    }

    /// The filters that are not the identity, with their particles.
    pub(super) fn iter(&self) -> impl Iterator<Item = &(u32, Symmetric<T>)> {
        self.filters.iter()
    }

    /// S_i B S_j of a block off the diagonal, row by row.
    #[inline(always)]
    pub(super) fn block(&self, i: usize, j: usize, block: Symmetric<T>) -> [[T; 3]; 3] {
        self.full(i, j, rows(&block))
    }

    /// The same of a block that is not symmetric.
    #[inline(always)]
    pub(super) fn full(&self, i: usize, j: usize, mut full: [[T; 3]; 3]) -> [[T; 3]; 3] {
        if let Some(filter) = self.get(i) {
            full = product(&rows(filter), &full);
        }
        if let Some(filter) = self.get(j) {
            full = product(&full, &rows(filter));
        }
        full
    }
}

/// A symmetric matrix, row by row.
#[inline(always)]
pub(super) fn rows<T: Real>(&[xx, yy, zz, xy, xz, yz]: &Symmetric<T>) -> [[T; 3]; 3] {
    [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
}

/// a b.
#[inline(always)]
fn product<T: Real>(a: &[[T; 3]; 3], b: &[[T; 3]; 3]) -> [[T; 3]; 3] {
    std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            a[row][0] * b[0][column] + a[row][1] * b[1][column] + a[row][2] * b[2][column]
        })
    })
}
