//! NUMERICS §5, `implicit_assemble`: the diagonal of the matrix, and the right-hand side.

use cloth_core::{NewtonStart, Real};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::{
    matrix::{BlockField, Matrix},
    spring_factors::{Factors, SpringFactors, across},
};
use crate::{
    aerodynamic_forces::Aerodynamics,
    elasticity::{Elasticity, Linear},
    memory::{BLOCK, FieldView, LANES, Lanes, Masses, VectorField, lanes, lanes_mut},
    springs::{Column, Neighbours, SpringColumns},
};

/// All that the stage reads but for the factors.
pub(super) struct Assembly<'a, T> {
    pub(super) springs: &'a SpringColumns<T>,
    pub(super) masses: &'a Masses<T>,
    pub(super) drag_rate: [T; 3],
    pub(super) aerodynamics: Option<&'a Aerodynamics<T>>,
    pub(super) position: FieldView<'a, T>,
    pub(super) velocity: FieldView<'a, T>,
    /// Velocities at the start of the substep.
    pub(super) velocity_start: FieldView<'a, T>,
    /// Forces without those of springs.
    pub(super) force: FieldView<'a, T>,
    pub(super) length: T,
    pub(super) start: NewtonStart,
    pub(super) count: usize,
}

impl<T: Real> Assembly<'_, T> {
    /// Fills the matrix and b.
    pub(super) fn run(
        &self,
        matrix: &mut Matrix<T>,
        right_side: &mut VectorField<T>,
        products: &mut Vec<[T; 3]>,
        arch: pulp::Arch,
    ) {
        self.base(&mut matrix.base);
        matrix.rows.products(self.velocity, products, arch);
        let products = &**products;
        let Matrix { factors, contacts, rows, base, diagonal, elements } = matrix;
        let off_diagonal =
            diagonal.off_diagonal.get_or_insert_with(|| VectorField::new(self.count, 0));
        right_side
            .chunks_mut(BLOCK)
            .zip(diagonal.diagonal.chunks_mut(BLOCK))
            .zip(off_diagonal.chunks_mut(BLOCK))
            .enumerate()
            .for_each(|(block, ((right_side, diagonal), off_diagonal))| {
                let task = BlockTask {
                    assembly: self,
                    factors,
                    contacts,
                    rows: (rows, products),
                    base,
                    elements: elements.as_ref().map_or(&[], |elements| &elements.diagonal),
                    start: block * BLOCK,
                    right_side,
                    diagonal,
                    off_diagonal,
                };
                arch.dispatch(task);
            });
        if let Some(elements) = elements {
            elements.right_side_add(right_side);
        }
    }

    /// B: mass, drag and air.
    fn base(&self, base: &mut BlockField<T>) {
        let BlockField { diagonal, off_diagonal } = base;
        diagonal.chunks_mut(BLOCK).enumerate().for_each(|(block, chunk)| {
            for local in (0..chunk[0].len()).step_by(LANES) {
                let mass = lanes(&self.masses.mass, block * BLOCK + local);
                for axis in 0..3 {
                    let factor = T::ONE + self.length * self.drag_rate[axis];
                    let out = lanes_mut(chunk[axis], local);
                    for lane in 0..LANES {
                        out[lane] = mass[lane] * factor;
                    }
                }
            }
        });
        let Some(off_diagonal) = off_diagonal else { return };
        off_diagonal.clear();
        if let Some(aerodynamics) = self.aerodynamics {
            for particle in 0..self.count {
                let [xx, yy, zz, xy, xz, yz] =
                    aerodynamics.jacobian(particle).map(|entry| self.length * entry);
                let [x, y, z] = diagonal.get(particle);
                diagonal.set(particle, [x + xx, y + yy, z + zz]);
                off_diagonal.set(particle, [xy, xz, yz]);
            }
        }
    }
}

/// One block, compiled for each instruction set.
struct BlockTask<'a, 'b, T> {
    assembly: &'a Assembly<'a, T>,
    factors: &'a SpringFactors<T>,
    contacts: &'a super::contact_linearise::ContactFactors<T>,
    /// And their products with the velocities.
    rows: (&'a super::contact_rows::ContactRows<T>, &'a [[T; 3]]),
    base: &'a BlockField<T>,
    /// The diagonal blocks of triangles, if there are any.
    elements: &'a [[T; 6]],
    start: usize,
    right_side: [&'b mut [T]; 3],
    diagonal: [&'b mut [T]; 3],
    off_diagonal: [&'b mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for BlockTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for local in (0..self.right_side[0].len()).step_by(LANES) {
            let sums = self.packet(self.start + local);
            for axis in 0..3 {
                *lanes_mut(self.right_side[axis], local) = sums.right_side[axis];
                *lanes_mut(self.diagonal[axis], local) = sums.diagonal[axis];
                *lanes_mut(self.off_diagonal[axis], local) = sums.off_diagonal[axis];
            }
        }
    }
}

/// Sums over the springs of a packet.
struct Sums<T> {
    right_side: [Lanes<T>; 3],
    diagonal: [Lanes<T>; 3],
    off_diagonal: [Lanes<T>; 3],
}

/// Position and velocity of a packet.
type PacketView<'a, T> = ([&'a Lanes<T>; 3], [&'a Lanes<T>; 3]);

impl<T: Real> BlockTask<'_, '_, T> {
    #[inline(always)]
    fn packet(&self, first: usize) -> Sums<T> {
        let assembly = self.assembly;
        let at = first as isize;
        let own = (assembly.position.packet(at), assembly.velocity.packet(at));
        let mut sums = self.start(first);
        let columns = assembly.springs.packet(first / LANES).iter();
        for (column, factors) in columns.zip(self.factors.packet(first / LANES)) {
            let factors = &factors;
            match &column.neighbours {
                Neighbours::Offset(offset) => {
                    let at = at + *offset as isize;
                    let other = (assembly.position.packet(at), assembly.velocity.packet(at));
                    self.column(&mut sums, column, factors, own, other);
                }
                Neighbours::Indices(indices) => {
                    let x = assembly.position.gather(indices);
                    let v = assembly.velocity.gather(indices);
                    let other = (x.each_ref(), v.each_ref());
                    self.column(&mut sums, column, factors, own, other);
                }
            }
        }
        if !self.contacts.is_empty() {
            for lane in 0..LANES.min(assembly.count - first) {
                self.contacts_of(&mut sums, first, lane);
            }
        }
        if !self.rows.0.is_empty() {
            for lane in 0..LANES.min(assembly.count - first) {
                self.rows_of(&mut sums, first, lane);
            }
        }
        sums
    }

    /// The sums before any spring: b from forces and inertia, D from B and triangles.
    #[inline(always)]
    fn start(&self, first: usize) -> Sums<T> {
        let assembly = self.assembly;
        let force = assembly.force.packet(first as isize);
        let mut right_side = [[T::ZERO; LANES]; 3];
        for axis in 0..3 {
            for lane in 0..LANES {
                right_side[axis][lane] = assembly.length * force[axis][lane];
            }
        }
        if assembly.start == NewtonStart::Iterate {
            let mass = lanes(&assembly.masses.mass, first);
            let now = assembly.velocity.packet(first as isize);
            let then = assembly.velocity_start.packet(first as isize);
            for axis in 0..3 {
                for lane in 0..LANES {
                    right_side[axis][lane] += -(mass[lane] * (now[axis][lane] - then[axis][lane]));
                }
            }
        }
        let view = |field| FieldView::new(field).packet(first as isize).map(|lanes| *lanes);
        let off_diagonal = self.base.off_diagonal.as_ref().map_or([[T::ZERO; LANES]; 3], view);
        let mut sums = Sums { right_side, diagonal: view(&self.base.diagonal), off_diagonal };
        let elements = self.elements.get(first..).unwrap_or_default();
        for (lane, &[xx, yy, zz, xy, xz, yz]) in elements.iter().take(LANES).enumerate() {
            for (axis, (own, across)) in [(xx, xy), (yy, xz), (zz, yz)].into_iter().enumerate() {
                sums.diagonal[axis][lane] += own;
                sums.off_diagonal[axis][lane] += across;
            }
        }
        sums
    }

    #[inline(always)]
    fn column(
        &self,
        sums: &mut Sums<T>,
        column: &Column<T>,
        factors: &Factors<'_, T>,
        own: PacketView<'_, T>,
        other: PacketView<'_, T>,
    ) {
        match &column.buckling {
            None => self.springs(sums, (column, &Linear), factors, own, other),
            Some(buckling) => self.springs(sums, (column, &**buckling), factors, own, other),
        }
    }

    #[inline(always)]
    fn springs(
        &self,
        sums: &mut Sums<T>,
        (column, elasticity): (&Column<T>, &impl Elasticity<T>),
        Factors { root, along }: &Factors<'_, T>,
        ([xi, yi, zi], [ai, bi, ci]): PacketView<'_, T>,
        ([xj, yj, zj], [aj, bj, cj]): PacketView<'_, T>,
    ) {
        let length = self.assembly.length;
        let iterate = self.assembly.start == NewtonStart::Iterate;
        let smallest = T::LENGTH_MIN * T::LENGTH_MIN;
        for lane in 0..LANES {
            let (dx, dy, dz) = (xj[lane] - xi[lane], yj[lane] - yi[lane], zj[lane] - zi[lane]);
            let (x, y, z) = (root[lane] * dx, root[lane] * dy, root[lane] * dz);
            let g = across(along[lane], [x, y, z]);
            let distance = (dx * dx + dy * dy + dz * dz).sqrt();
            let stretch = distance - column.rest_length[lane];
            let tension = elasticity.tension(lane, column.stiffness[lane], stretch);
            let pull = length * tension / distance.maximum(T::LENGTH_MIN);
            let (a, b, c) = (aj[lane] - ai[lane], bj[lane] - bi[lane], cj[lane] - ci[lane]);
            let mut product = x * a + y * b + z * c;
            let mut across = g;
            if iterate {
                let share =
                    length * column.damping[lane] / (x * x + y * y + z * z).maximum(smallest);
                product = share * product;
                across = T::ZERO;
            }
            sums.right_side[0][lane] += pull * dx + (across * a + x * product);
            sums.right_side[1][lane] += pull * dy + (across * b + y * product);
            sums.right_side[2][lane] += pull * dz + (across * c + z * product);
            sums.diagonal[0][lane] += g + x * x;
            sums.diagonal[1][lane] += g + y * y;
            sums.diagonal[2][lane] += g + z * z;
            sums.off_diagonal[0][lane] += x * y;
            sums.off_diagonal[1][lane] += x * z;
            sums.off_diagonal[2][lane] += y * z;
        }
    }

    /// The contacts of triangles of a particle.
    #[inline(always)]
    fn rows_of(&self, sums: &mut Sums<T>, first: usize, lane: usize) {
        let (rows, products) = self.rows;
        let Some((change, [xx, yy, zz, xy, xz, yz])) = rows.of_particle(first + lane, products)
        else {
            return;
        };
        for (axis, (own, across)) in [(xx, xy), (yy, xz), (zz, yz)].into_iter().enumerate() {
            sums.right_side[axis][lane] += change[axis];
            sums.diagonal[axis][lane] += own;
            sums.off_diagonal[axis][lane] += across;
        }
    }

    #[inline(always)]
    fn contacts_of(&self, sums: &mut Sums<T>, first: usize, lane: usize) {
        let velocity = self.assembly.velocity;
        let own = velocity.get(first + lane);
        let share = match self.assembly.start {
            NewtonStart::StepStart => self.contacts.stiffness_share(),
            NewtonStart::Iterate => T::ZERO,
        };
        for pair in self.contacts.of(first + lane) {
            let other = velocity.get(pair.partner);
            let u = pair.u;
            let along = u[0] * (other[0] - own[0])
                + u[1] * (other[1] - own[1])
                + u[2] * (other[2] - own[2]);
            for axis in 0..3 {
                sums.right_side[axis][lane] += share * (u[axis] * along);
                sums.diagonal[axis][lane] += u[axis] * u[axis];
            }
            sums.off_diagonal[0][lane] += u[0] * u[1];
            sums.off_diagonal[1][lane] += u[0] * u[2];
            sums.off_diagonal[2][lane] += u[1] * u[2];
        }
    }
}
