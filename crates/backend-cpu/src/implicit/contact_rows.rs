//! NUMERICS §15, `contact_linearise`: contacts of triangles as part of the matrix, up to four particles each.

use cloth_core::{
    NewtonStart, Real,
    contact::{BodyMotion, ContactEquation, ContactSet},
};

use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::{block_matrix::times, matrix::Symmetric};
use crate::memory::FieldView;

/// Contacts in one task.
const TASK: usize = 512;

/// Blocks w_a w_b S, kept as weights and S; each particle finds the contacts that it is part of.
#[derive(Debug)]
pub(super) struct ContactRows<T> {
    contacts: Vec<Row<T>>,
    /// Contacts of each particle: where they start, and each with the weight there.
    offsets: Vec<u32>,
    places: Vec<(u32, T)>,
    /// Whether the right-hand side has the velocities at the start.
    from_start: bool,
}

#[derive(Clone, Copy, Debug)]
struct Row<T> {
    /// As those of [`ContactEquation`].
    particles: [u32; 4],
    weights: [T; 4],
    rows: Symmetric<T>,
    carried: [T; 3],
    /// Sum of the weights: 0, or 1 or -1 where the other side is a body.
    total: T,
}

impl<T: Real> Row<T> {
    /// S sum w_b v_b.
    #[inline(always)]
    fn times(&self, vector: FieldView<'_, T>) -> [T; 3] {
        let [a, b, c, d] = self.particles;
        let [a, b] = [vector.get(a as usize), vector.get(b as usize)];
        let [c, d] = [vector.get(c as usize), vector.get(d as usize)];
        let [wa, wb, wc, wd] = self.weights;
        let relative = std::array::from_fn(|k| ((wa * a[k] + wb * b[k]) + wc * c[k]) + wd * d[k]);
        times(&self.rows, relative)
    }
}

impl<T: Real> ContactRows<T> {
    /// No contacts, of so many particles.
    pub(super) fn new(count: usize) -> Self {
        Self {
            contacts: Vec::new(),
            offsets: vec![0; count + 1],
            places: Vec::new(),
            from_start: false,
        }
    }

    /// Forgets all contacts.
    pub(super) fn clear(&mut self) {
        self.contacts.clear();
    }

    /// Takes in what contacts do now.
    pub(super) fn fill(
        &mut self,
        (set, bodies, start): (&ContactSet<T>, &BodyMotion<T>, NewtonStart),
        length: T,
    ) {
        self.from_start = start == NewtonStart::StepStart;
        self.contacts.clear();
        self.contacts.extend(set.states().iter().enumerate().map(|(contact, state)| {
            let ContactEquation { particles, weights, carried } =
                set.equation(contact, bodies, length);
            let [a, b, c, d] = weights.map(T::to_f64);
            let total = T::from_f64((a + b + c + d).round());
            Row { particles, weights, rows: state.action.rows, carried, total }
        }));
        self.places.clear();
        for particle in 0..self.offsets.len() - 1 {
            self.offsets[particle] = self.places.len() as u32;
            self.places.extend(set.of(particle).map(|(contact, weight)| (contact as u32, weight)));
        }
        if let Some(last) = self.offsets.last_mut() {
            *last = self.places.len() as u32;
        }
    }

    #[inline(always)]
    pub(super) fn is_empty(&self) -> bool {
        self.contacts.is_empty()
    }

    #[inline(always)]
    fn of(&self, particle: usize) -> &[(u32, T)] {
        if self.is_empty() {
            return &[];
        }
        &self.places[self.offsets[particle] as usize..self.offsets[particle + 1] as usize]
    }

    /// S sum w_b v_b of each contact, of which the rows of its particles take their shares.
    pub(super) fn products(
        &self,
        vector: FieldView<'_, T>,
        products: &mut Vec<[T; 3]>,
        arch: pulp::Arch,
    ) {
        products.resize(self.contacts.len(), [T::ZERO; 3]);
        products.par_chunks_mut(TASK).enumerate().for_each(|(task, products)| {
            self.products_of(TASK * task, vector, products, arch);
        });
    }

    /// The same of the contacts from `first` on.
    pub(super) fn products_of(
        &self,
        first: usize,
        vector: FieldView<'_, T>,
        products: &mut [[T; 3]],
        arch: pulp::Arch,
    ) {
        let contacts = &self.contacts[first..first + products.len()];
        arch.dispatch(ProductsTask { contacts, vector, products });
    }

    /// How many contacts there are.
    pub(super) fn len(&self) -> usize {
        self.contacts.len()
    }

    /// The row of a particle times a vector, of which these are the products, if it touches anything.
    #[inline(always)]
    pub(super) fn times(&self, particle: usize, products: &[[T; 3]]) -> Option<[T; 3]> {
        let places = self.of(particle);
        if places.is_empty() {
            return None;
        }
        let mut sum = [T::ZERO; 3];
        for &(contact, weight) in places {
            let product = products[contact as usize];
            for axis in 0..3 {
                sum[axis] += weight * product[axis];
            }
        }
        Some(sum)
    }

    /// What a particle adds to the right-hand side and to the diagonal block, if it touches anything; the products are those of the
    /// velocities.
    #[inline(always)]
    pub(super) fn of_particle(
        &self,
        particle: usize,
        products: &[[T; 3]],
    ) -> Option<([T; 3], Symmetric<T>)> {
        let places = self.of(particle);
        if places.is_empty() {
            return None;
        }
        let change = match self.from_start {
            true => {
                let mut sum = self.times(particle, products)?;
                for &(contact, weight) in places {
                    let carried = self.contacts[contact as usize].carried;
                    for axis in 0..3 {
                        sum[axis] += weight * carried[axis];
                    }
                }
                sum.map(|component| -component)
            }
            false => [T::ZERO; 3],
        };
        let mut block = [T::ZERO; 6];
        for &(contact, weight) in places {
            let rows = &self.contacts[contact as usize].rows;
            for entry in 0..6 {
                block[entry] += (weight * weight) * rows[entry];
            }
        }
        Some((change, block))
    }

    /// The sum of all blocks of a row, the diagonal included: what bodies do to a particle.
    pub(super) fn row_sum(&self, particle: usize) -> Symmetric<T> {
        let mut sum = [T::ZERO; 6];
        for &(contact, weight) in self.of(particle) {
            let row = &self.contacts[contact as usize];
            let factor = weight * row.total;
            (0..6).for_each(|entry| sum[entry] += factor * row.rows[entry]);
        }
        sum
    }

    /// The blocks of a row off the diagonal; a column can come several times.
    pub(super) fn row(&self, particle: usize, mut visit: impl FnMut(usize, Symmetric<T>)) {
        for &(contact, weight) in self.of(particle) {
            let row = &self.contacts[contact as usize];
            for (other, other_weight) in row.particles.into_iter().zip(row.weights) {
                if other as usize != particle && other_weight != T::ZERO {
                    let factor = weight * other_weight;
                    visit(other as usize, row.rows.map(|entry| factor * entry));
                }
            }
        }
    }
}

/// Products of some contacts, compiled for each instruction set.
struct ProductsTask<'a, 'b, T> {
    contacts: &'a [Row<T>],
    vector: FieldView<'a, T>,
    products: &'b mut [[T; 3]],
}

impl<T: Real> NullaryFnOnce for ProductsTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (product, contact) in self.products.iter_mut().zip(self.contacts) {
            *product = contact.times(self.vector);
        }
    }
}
