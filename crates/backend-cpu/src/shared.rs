//! Memory that several threads write, each its part, and that all read at other times.
#![allow(unsafe_code)]

use std::{marker::PhantomData, ops::Range, slice};

use cloth_core::Real;

use crate::memory::{FieldView, VectorField};

/// A slice that is lent to threads part by part.
pub(crate) struct SharedSlice<'a, T> {
    start: *mut T,
    length: usize,
    of: PhantomData<&'a mut [T]>,
}

// SAFETY: it stands for a slice that is borrowed for as long as it lives; who takes entries out of it answers for it that nobody else has them.
unsafe impl<T: Send + Sync> Sync for SharedSlice<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send + Sync> Send for SharedSlice<'_, T> {}

impl<'a, T> SharedSlice<'a, T> {
    pub(crate) const fn new(slice: &'a mut [T]) -> Self {
        Self { start: slice.as_mut_ptr(), length: slice.len(), of: PhantomData }
    }

    pub(crate) const fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// All of it, to read.
    ///
    /// # Safety
    /// Nobody writes to it as long as this is there.
    pub(crate) unsafe fn all(&self) -> &[T] {
        // SAFETY: the slice that was borrowed, of which the caller says that nobody writes to it.
        unsafe { slice::from_raw_parts(self.start, self.length) }
    }

    /// A part of it, to write.
    ///
    /// # Safety
    /// Nobody else has any of these entries as long as this is there.
    #[allow(clippy::mut_from_ref)]
    pub(crate) unsafe fn part(&self, range: Range<usize>) -> &mut [T] {
        assert!(range.start <= range.end && range.end <= self.length, "no part of it");
        // SAFETY: within the slice that was borrowed; the caller says that nobody else has these entries.
        unsafe { slice::from_raw_parts_mut(self.start.add(range.start), range.len()) }
    }
}

/// The same of vectors of particles.
pub(crate) struct SharedField<'a, T> {
    components: [SharedSlice<'a, T>; 3],
    margin: usize,
    /// Entries without margins.
    length: usize,
}

impl<'a, T: Real> SharedField<'a, T> {
    pub(crate) fn new(field: &'a mut VectorField<T>) -> Self {
        let margin = field.margin();
        let components = field.padded_mut().map(SharedSlice::new);
        let length = components[0].length - 2 * margin;
        Self { components, margin, length }
    }

    /// Entries without margins.
    pub(crate) const fn len(&self) -> usize {
        self.length
    }

    /// All of it, to read.
    ///
    /// # Safety
    /// As [`SharedSlice::all`].
    pub(crate) unsafe fn view(&self) -> FieldView<'_, T> {
        // SAFETY: as the caller says.
        let components = self.components.each_ref().map(|component| unsafe { component.all() });
        FieldView::of(components, self.margin)
    }

    /// Up to `length` particles from `start` on, to write.
    ///
    /// # Safety
    /// As [`SharedSlice::part`].
    #[allow(clippy::mut_from_ref)]
    pub(crate) unsafe fn chunk(&self, start: usize, length: usize) -> [&mut [T]; 3] {
        let end = (start + length).min(self.length);
        let range = self.margin + start..self.margin + end;
        // SAFETY: as the caller says.
        self.components.each_ref().map(|component| unsafe { component.part(range.clone()) })
    }
}
