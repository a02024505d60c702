//! Arrays of particles: structure of arrays, padded so that a vector load never leaves them.

use cloth_core::Real;
use rayon::prelude::*;

/// Particles that are worked on together. Two AVX registers of f32, enough independent work to
/// hide the latency of division and square root.
pub(crate) const LANES: usize = 16;

/// Particles in one task, and the unit of all sums: fixed, so that neither depends on threads.
pub(crate) const BLOCK: usize = 512;

/// One number for each of [`LANES`] particles.
pub(crate) type Lanes<T> = [T; LANES];

/// Number of whole packets of [`LANES`] that hold `count` particles.
pub(crate) const fn packets(count: usize) -> usize {
    count.div_ceil(LANES)
}

/// Three components of a vector for each particle. In memory every component has `margin` unused
/// entries on both sides, and the last packet is filled up, all with zeros.
#[derive(Debug)]
pub(crate) struct VectorField<T> {
    /// The components, one behind the other.
    values: Vec<T>,
    /// Where the first component begins.
    start: usize,
    /// From one component to the next.
    stride: usize,
    margin: usize,
    count: usize,
}

/// Entries in a line of the cache, if they are of single precision; whole lines also otherwise.
const LINE: usize = 16;
/// Lines after which the first level of the cache begins anew with the same places.
const LINES: usize = 64;

impl<T: Real> VectorField<T> {
    pub(crate) fn new(count: usize, margin: usize) -> Self {
        let margin = margin.next_multiple_of(LANES);
        let length = 2 * margin + packets(count) * LANES;
        // Passes read many arrays at the same index. If these lay at the same places of the cache they would
        // drive each other out, so components begin a third of it apart, and fields at places that differ.
        let stride =
            length + (LINES / 3 * LINE + LINES * LINE - length % (LINES * LINE)) % (LINES * LINE);
        let values = vec![T::ZERO; 3 * stride + (LINES + 1) * LINE];
        let address = values.as_ptr().addr();
        let start = values.as_ptr().align_offset(LINE * size_of::<f32>());
        let start = if start > LINE { 0 } else { start + ((address >> 12) * 11 % LINES) * LINE };
        Self { values, start, stride, margin, count }
    }

    /// A field without particles and without memory, to stand where another was taken out.
    pub(crate) const fn empty() -> Self {
        Self { values: Vec::new(), start: 0, stride: 0, margin: 0, count: 0 }
    }

    /// The components with margins. Particle i is at `margin + i`.
    pub(crate) fn padded(&self) -> [&[T]; 3] {
        let length = 2 * self.margin + packets(self.count) * LANES;
        std::array::from_fn(|axis| &self.values[self.start + axis * self.stride..][..length])
    }

    /// The same to write.
    pub(crate) fn padded_mut(&mut self) -> [&mut [T]; 3] {
        let length = 2 * self.margin + packets(self.count) * LANES;
        let (x, rest) = self.values[self.start..].split_at_mut(self.stride);
        let (y, z) = rest.split_at_mut(self.stride);
        [x, y, z].map(|component| &mut component[..length])
    }

    /// The components without margins.
    fn inner_mut(&mut self) -> [&mut [T]; 3] {
        let length = packets(self.count) * LANES;
        let (x, rest) = self.values[self.start + self.margin..].split_at_mut(self.stride);
        let (y, z) = rest.split_at_mut(self.stride);
        [x, y, z].map(|component| &mut component[..length])
    }

    pub(crate) const fn margin(&self) -> usize {
        self.margin
    }

    /// Number of particles.
    pub(crate) const fn count(&self) -> usize {
        self.count
    }

    /// Sets everything to zero.
    pub(crate) fn clear(&mut self) {
        self.values.fill(T::ZERO);
    }

    fn place(&self, axis: usize, particle: usize) -> usize {
        self.start + axis * self.stride + self.margin + particle
    }

    pub(crate) fn get(&self, particle: usize) -> [T; 3] {
        std::array::from_fn(|axis| self.values[self.place(axis, particle)])
    }

    pub(crate) fn set(&mut self, particle: usize, value: [T; 3]) {
        for (axis, value) in value.into_iter().enumerate() {
            let place = self.place(axis, particle);
            self.values[place] = value;
        }
    }

    /// Runs of `length` particles, a multiple of [`LANES`], the last one filled up to a whole
    /// packet.
    pub(crate) fn chunks_mut(
        &mut self,
        length: usize,
    ) -> impl IndexedParallelIterator<Item = [&mut [T]; 3]> + '_ {
        let [x, y, z] = self.inner_mut();
        (x.par_chunks_mut(length), y.par_chunks_mut(length), z.par_chunks_mut(length))
            .into_par_iter()
            .map(|(x, y, z)| [x, y, z])
    }

    pub(crate) fn write(&mut self, values: &[[f64; 3]]) {
        for (i, value) in values.iter().enumerate() {
            self.set(i, value.map(T::from_f64));
        }
    }

    /// Whether it has no memory for particles.
    pub(crate) const fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Takes over another field of as many particles.
    pub(crate) fn copy_from(&mut self, other: FieldView<'_, T>) {
        let from = other.range(0, packets(self.count) * LANES);
        for (component, from) in self.inner_mut().into_iter().zip(from) {
            component.copy_from_slice(from);
        }
    }

    pub(crate) fn read(&self, out: &mut Vec<[f64; 3]>) {
        out.clear();
        out.extend((0..self.count).map(|i| self.get(i).map(T::to_f64)));
    }
}

/// A [`VectorField`] to read from, with the components as slices.
#[derive(Clone, Copy)]
pub(crate) struct FieldView<'a, T> {
    components: [&'a [T]; 3],
    margin: usize,
}

impl<'a, T: Real> FieldView<'a, T> {
    #[inline(always)]
    pub(crate) fn new(field: &'a VectorField<T>) -> Self {
        Self::of(field.padded(), field.margin())
    }

    /// Of components with margins.
    #[inline(always)]
    pub(crate) const fn of(components: [&'a [T]; 3], margin: usize) -> Self {
        Self { components, margin }
    }

    /// Entries without margins, a multiple of [`LANES`].
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.components[0].len() - 2 * self.margin
    }

    /// The packet that starts at `first`, which can lie in the margin and need not be aligned.
    #[inline(always)]
    pub(crate) fn packet(&self, first: isize) -> [&'a Lanes<T>; 3] {
        let at = self.margin.wrapping_add_signed(first);
        let [x, y, z] = self.components;
        [lanes(x, at), lanes(y, at), lanes(z, at)]
    }

    /// `length` particles from `first` on.
    #[inline(always)]
    pub(crate) fn range(&self, first: isize, length: usize) -> [&'a [T]; 3] {
        let start = self.margin.wrapping_add_signed(first);
        let end = start + length;
        let [x, y, z] = self.components;
        [&x[start..end], &y[start..end], &z[start..end]]
    }

    /// The vectors of single particles.
    #[inline(always)]
    pub(crate) fn gather(&self, particles: &Lanes<u32>) -> [Lanes<T>; 3] {
        let mut gathered = [[T::ZERO; LANES]; 3];
        for lane in 0..LANES {
            let at = self.margin + particles[lane] as usize;
            for axis in 0..3 {
                gathered[axis][lane] = self.components[axis][at];
            }
        }
        gathered
    }

    #[inline(always)]
    pub(crate) fn get(&self, particle: usize) -> [T; 3] {
        // Not `map`, which is a call of its own within vector code.
        let [x, y, z] = self.components;
        let at = self.margin + particle;
        [x[at], y[at], z[at]]
    }
}

/// Positions and velocities.
#[derive(Debug)]
pub(crate) struct Motion<T> {
    pub(crate) position: VectorField<T>,
    pub(crate) velocity: VectorField<T>,
}

impl<T: Real> Motion<T> {
    pub(crate) fn new(count: usize, margin: usize) -> Self {
        Self {
            position: VectorField::new(count, margin),
            velocity: VectorField::new(count, margin),
        }
    }

    /// Whether it has no memory for particles.
    pub(crate) const fn is_empty(&self) -> bool {
        self.position.count == 0
    }

    /// Takes over another motion, with as much memory as that takes.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        let VectorField { count, margin, .. } = other.position;
        if self.position.count != count {
            *self = Self::new(count, margin);
        }
        self.position.copy_from(FieldView::new(&other.position));
        self.velocity.copy_from(FieldView::new(&other.velocity));
    }

    /// Positions and velocities of runs of `length` particles.
    pub(crate) fn chunks_mut(
        &mut self,
        length: usize,
    ) -> impl IndexedParallelIterator<Item = MotionChunk<'_, T>> + '_ {
        self.position
            .chunks_mut(length)
            .zip(self.velocity.chunks_mut(length))
            .map(|(position, velocity)| MotionChunk { position, velocity })
    }
}

/// Positions and velocities of a run of particles.
pub(crate) struct MotionChunk<'a, T> {
    pub(crate) position: [&'a mut [T]; 3],
    pub(crate) velocity: [&'a mut [T]; 3],
}

impl<T: Real> MotionChunk<'_, T> {
    /// The packet that starts at the particle `local` of this run.
    #[inline(always)]
    pub(crate) fn load(&self, local: usize) -> PacketMotion<T> {
        let mut motion =
            PacketMotion { position: [[T::ZERO; LANES]; 3], velocity: [[T::ZERO; LANES]; 3] };
        for axis in 0..3 {
            motion.position[axis] = *lanes(self.position[axis], local);
            motion.velocity[axis] = *lanes(self.velocity[axis], local);
        }
        motion
    }

    /// Writes that packet.
    #[inline(always)]
    pub(crate) fn store(&mut self, local: usize, motion: &PacketMotion<T>) {
        for axis in 0..3 {
            *lanes_mut(self.position[axis], local) = motion.position[axis];
            *lanes_mut(self.velocity[axis], local) = motion.velocity[axis];
        }
    }
}

/// Position and velocity of a packet.
pub(crate) struct PacketMotion<T> {
    pub(crate) position: [Lanes<T>; 3],
    pub(crate) velocity: [Lanes<T>; 3],
}

/// Masses \[kg\] and inverse masses \[1/kg\], the latter zero for held particles. Filled up to a
/// whole packet, the rest with mass and inverse mass zero.
#[derive(Clone, Debug)]
pub(crate) struct Masses<T> {
    pub(crate) mass: Vec<T>,
    pub(crate) inverse: Vec<T>,
}

impl<T: Real> Masses<T> {
    pub(crate) fn new(masses: &[f64]) -> Self {
        let length = packets(masses.len()) * LANES;
        let mut mass = vec![T::ZERO; length];
        for (entry, &value) in mass.iter_mut().zip(masses) {
            *entry = T::from_f64(value);
        }
        Self { mass, inverse: vec![T::ZERO; length] }
    }

    pub(crate) fn hold(&mut self, particle: usize, held: bool) {
        self.inverse[particle] = if held { T::ZERO } else { T::ONE / self.mass[particle] };
    }

    pub(crate) fn is_held(&self, particle: usize) -> bool {
        self.inverse[particle] == T::ZERO
    }
}

/// [`LANES`] entries of `values` from `start` on.
#[inline(always)]
pub(crate) fn lanes<T: Copy>(values: &[T], start: usize) -> &Lanes<T> {
    match values[start..].first_chunk() {
        Some(lanes) => lanes,
        // All arrays are padded to whole packets and to the farthest neighbour.
        None => unreachable!("load of a packet beyond the margin"),
    }
}

/// The same for writing.
#[inline(always)]
pub(crate) fn lanes_mut<T: Copy>(values: &mut [T], start: usize) -> &mut Lanes<T> {
    match values[start..].first_chunk_mut() {
        Some(lanes) => lanes,
        None => unreachable!("store of a packet beyond the block"),
    }
}
