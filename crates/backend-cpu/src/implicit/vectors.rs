//! The vectors of the linear system.

use cloth_core::{LinearVector, Real};

use crate::memory::VectorField;

/// One field for each [`LinearVector`].
#[derive(Debug)]
pub(crate) struct LinearVectors<T> {
    fields: [VectorField<T>; LinearVector::ALL.len()],
}

impl<T: Real> LinearVectors<T> {
    pub(crate) fn new(count: usize, margin: usize) -> Self {
        Self { fields: std::array::from_fn(|_| VectorField::new(count, margin)) }
    }

    pub(crate) fn get(&self, vector: LinearVector) -> &VectorField<T> {
        &self.fields[vector as usize]
    }

    pub(crate) fn get_mut(&mut self, vector: LinearVector) -> &mut VectorField<T> {
        &mut self.fields[vector as usize]
    }

    /// Takes a field out, so that it can be written while others are read. It has to be put back.
    pub(crate) fn take(&mut self, vector: LinearVector) -> VectorField<T> {
        std::mem::replace(self.get_mut(vector), VectorField::empty())
    }

    /// Puts a field back.
    pub(crate) fn put(&mut self, vector: LinearVector, field: VectorField<T>) {
        *self.get_mut(vector) = field;
    }

    /// All fields, in the order of [`LinearVector::ALL`].
    pub(crate) fn all_mut(&mut self) -> &mut [VectorField<T>; LinearVector::ALL.len()] {
        &mut self.fields
    }
}
