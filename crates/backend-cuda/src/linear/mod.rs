//! Memory of the linear system of an implicit step.

mod data;
mod elements;
mod launch;

use std::collections::HashMap;

use cloth_core::{LinearVector, Model, Preconditioner, Result};

use crate::{
    layout::{BLOCK, CudaReal, Real4},
    memory::Memory,
    queue::{Buffer, Launch},
    schwarz::SchwarzMemory,
    solver_form::SolverForm,
    triangle_contact::ContactTable,
};

use data::LinearData;
pub(crate) use data::Outcome;
use elements::ElementMemory;
pub(crate) use launch::choose;

/// Particles of the smallest unit of sums.
const SUM_UNIT: usize = BLOCK / 4;
/// Sums of an iteration.
const SUMS: usize = 3;
/// Numbers of a contact with a collider.
const TOUCH: usize = 11;
/// Contacts with colliders that count for a particle.
const TOUCHES_MAX: usize = 4;

/// Device memory of the system.
pub(crate) struct LinearMemory<T> {
    pub(crate) data: LinearData<T>,
    /// `roots`, and `across` after each where the rows of springs do not have `along`.
    pub(crate) factors: Buffer<T>,
    pub(crate) along: Option<Buffer<T>>,
    pub(crate) origin: Buffer<Real4<T>>,
    pub(crate) diagonal: [Buffer<Real4<T>>; 2],
    pub(crate) vectors: [Buffer<Real4<T>>; LinearVector::ALL.len()],
    pub(crate) outcome: Buffer<Outcome>,
    pub(crate) partials: Buffer<f64>,
    pub(crate) touch_counts: Buffer<u32>,
    pub(crate) base: [Buffer<Real4<T>>; 2],
    pub(crate) filter: [Buffer<Real4<T>>; 2],
    pub(crate) pairs: Option<PairMemory<T>>,
    /// What triangles of fabric add, if there are any.
    pub(crate) elements: Option<ElementMemory<T>>,
    /// Launches of the solvers that have been used, for each of their forms.
    pub(crate) launches: HashMap<(&'static str, SolverForm), Launch>,
    /// The preconditioner of that name, if it was ever asked for.
    pub(crate) schwarz: Option<Box<SchwarzMemory>>,
    /// The one that is there.
    pub(crate) preconditioner: Preconditioner,
    _others: Vec<Buffer<Real4<T>>>,
    _links: Buffer<[u32; 2]>,
    _constraints: Buffer<T>,
    pub(crate) released: u64,
}

/// Memory of the pairs in contact.
pub(crate) struct PairMemory<T> {
    pub(crate) partners: Buffer<u32>,
    pub(crate) factors: Buffer<Real4<T>>,
    pub(crate) counts: Buffer<u32>,
    pub(crate) capacity: usize,
}

impl<T: CudaReal> LinearMemory<T> {
    /// Memory for a model.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn new(memory: &Memory<T>, model: &Model) -> Result<Self> {
        let queue = &memory.queue;
        let n = model.particle_count();
        let tables = &memory.tables.springs;
        let places = tables.slot_count as usize * n + tables.own_count as usize;
        let links: Vec<[u32; 2]> = tables
            .entries
            .iter()
            .zip(&tables.slots)
            .map(|(&[offset, _], &slot)| [offset, slot])
            .collect();
        let field = || Buffer::<Real4<T>>::zeros(queue, n);
        let pair = || Ok::<_, cloth_core::Error>([field()?, field()?]);
        let has_colliders = !model.colliders().is_empty();
        let constrained = if has_colliders { n } else { 0 };
        let (base, diagonal, inverse) = (pair()?, pair()?, pair()?);
        let filter = [Buffer::zeros(queue, constrained)?, Buffer::zeros(queue, constrained)?];
        let target = Buffer::zeros(queue, constrained)?;
        let constraints = Buffer::zeros(queue, constrained * TOUCHES_MAX * TOUCH)?;
        let touch_counts = Buffer::zeros(queue, constrained)?;
        // Springs that buckle differ in the stiffness along them, and where particles share no rows it is not less to read.
        let shares = !tables.can_buckle && tables.entries.len() <= n;
        let factors = Buffer::zeros(queue, if shares { places } else { 2 * places })?;
        let along = shares.then(|| Buffer::zeros(queue, tables.entries.len())).transpose()?;
        let origin = Buffer::zeros(queue, n)?;
        let links = Buffer::of(queue, &links)?;
        let mut vectors = Vec::with_capacity(LinearVector::ALL.len());
        for _ in LinearVector::ALL {
            vectors.push(field()?);
        }
        let vectors: [_; LinearVector::ALL.len()] = match vectors.try_into() {
            Ok(vectors) => vectors,
            Err(_) => unreachable!("one for each"),
        };
        let outcome = Buffer::zeros(queue, 1)?;
        let partials = Buffer::zeros(queue, SUMS * n.div_ceil(BLOCK) * (BLOCK / SUM_UNIT))?;
        let mut data = LinearData {
            roots: factors.address(),
            along: along.as_ref().map_or(0, Buffer::address),
            origin: origin.address(),
            links: links.address(),
            base: base.each_ref().map(Buffer::address),
            diagonal: diagonal.each_ref().map(Buffer::address),
            inverse: inverse.each_ref().map(Buffer::address),
            vectors: vectors.each_ref().map(Buffer::address),
            constraints: constraints.address(),
            touch_counts: touch_counts.address(),
            filter: filter.each_ref().map(Buffer::address),
            target: target.address(),
            pair_partners: 0,
            pair_factors: 0,
            pair_counts: 0,
            outcome: outcome.address(),
            partials: partials.address(),
            membrane_tangents: 0,
            fold_stiffness: 0,
            fold_tangents: 0,
            element_sums: 0,
            term_offsets: 0,
            terms: 0,
            element_slices: 0,
            element_columns: 0,
            element_blocks: 0,
            contacts: ContactTable::default(),
            schwarz: 0,
            slot_count: tables.slot_count,
            is_full: u32::from(has_colliders || model.air().is_some() || model.has_fabric()),
            has_constraints: u32::from(has_colliders),
            has_pairs: 0,
            has_blocks: 1,
            has_elements: 0,
            has_contacts: 0,
            length: T::ONE,
            pair_share: T::ZERO,
        };
        let elements = model.has_fabric().then(|| ElementMemory::new(queue, model)).transpose()?;
        if let Some(elements) = &elements {
            elements.describe(&mut data);
        }
        let mut others: Vec<_> = inverse.into_iter().collect();
        others.push(target);
        Ok(Self {
            data,
            factors,
            along,
            origin,
            diagonal,
            vectors,
            outcome,
            partials,
            touch_counts,
            base,
            filter,
            pairs: None,
            elements,
            launches: HashMap::new(),
            schwarz: None,
            preconditioner: Preconditioner::Block,
            _others: others,
            _links: links,
            _constraints: constraints,
            released: 0,
        })
    }

    /// Whether the preconditioner that is there is `schwarz`.
    pub(crate) fn is_schwarz(&self) -> bool {
        self.preconditioner == Preconditioner::Schwarz
    }

    /// The length of the step that the springs are about to be linearised for.
    pub(crate) fn length_set(&mut self, length: T) {
        self.data.length = length;
    }

    /// Room for so many pairs in contact of each particle.
    ///
    /// # Errors
    /// `OutOfMemory`.
    pub(crate) fn pairs_prepare(&mut self, memory: &Memory<T>, capacity: usize) -> Result<()> {
        if self.pairs.as_ref().is_some_and(|pairs| pairs.capacity >= capacity) {
            return Ok(());
        }
        let (queue, n) = (&memory.queue, memory.data.count as usize);
        queue.synchronize()?;
        self.pairs = None;
        let pairs = PairMemory {
            partners: Buffer::zeros(queue, capacity * n)?,
            factors: Buffer::zeros(queue, capacity * n)?,
            counts: Buffer::zeros(queue, n)?,
            capacity,
        };
        self.data.pair_partners = pairs.partners.address();
        self.data.pair_factors = pairs.factors.address();
        self.data.pair_counts = pairs.counts.address();
        self.pairs = Some(pairs);
        Ok(())
    }
}
