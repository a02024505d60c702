//! NUMERICS §5, `spring_linearise`: direction and factors of every spring.

use cloth_core::Real;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::spring_factors::{Factors, NONE, SpringFactors};
use crate::{
    elasticity::{Elasticity, Linear},
    memory::{BLOCK, FieldView, LANES, Lanes, lanes_mut},
    springs::{Column, Neighbours, SpringColumns},
};

/// Computes all factors at these positions for a substep of `length` \[s\].
pub(super) fn run<T: Real>(
    factors: &mut SpringFactors<T>,
    springs: &SpringColumns<T>,
    position: FieldView<'_, T>,
    length: T,
    arch: pulp::Arch,
) {
    let SpringFactors { bands, own, own_keys, .. } = factors;
    let columns = springs.columns();
    for band in bands {
        let margin = band.u.margin();
        let inner = margin..margin + band.columns.len() * LANES;
        band.u
            .chunks_mut(BLOCK)
            .zip(band.e[inner].par_chunks_mut(BLOCK))
            .zip(band.columns.par_chunks(BLOCK / LANES))
            .enumerate()
            .for_each(|(block, ((u, e), packets))| {
                let first = band.first + block * BLOCK;
                arch.dispatch(BandTask { columns, packets, position, length, first, u, e });
            });
    }
    own.par_chunks_mut(64).zip(own_keys.par_chunks(64)).for_each(|(own, keys)| {
        arch.dispatch(OwnTask { columns, keys, position, length, own });
    });
}

/// A block of a band.
struct BandTask<'a, 'b, T> {
    columns: &'a [Column<T>],
    packets: &'a [u32],
    position: FieldView<'a, T>,
    length: T,
    first: usize,
    u: [&'b mut [T]; 3],
    e: &'b mut [T],
}

impl<T: Real> NullaryFnOnce for BandTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (number, &column) in self.packets.iter().enumerate() {
            let local = number * LANES;
            if column == NONE {
                continue;
            }
            let factors = linearise(
                &self.columns[column as usize],
                self.position,
                (self.first + local) as isize,
                self.length,
            );
            for axis in 0..3 {
                *lanes_mut(self.u[axis], local) = factors.u[axis];
            }
            *lanes_mut(self.e, local) = factors.e;
        }
    }
}

/// Some columns that packets keep for themselves.
struct OwnTask<'a, 'b, T> {
    columns: &'a [Column<T>],
    keys: &'a [[u32; 2]],
    position: FieldView<'a, T>,
    length: T,
    own: &'b mut [Factors<T>],
}

impl<T: Real> NullaryFnOnce for OwnTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for (own, &[packet, column]) in self.own.iter_mut().zip(self.keys) {
            let first = packet as isize * LANES as isize;
            *own = linearise(&self.columns[column as usize], self.position, first, self.length);
        }
    }
}

/// The springs of one column of the packet that starts at particle `first`.
#[inline(always)]
fn linearise<T: Real>(
    column: &Column<T>,
    position: FieldView<'_, T>,
    first: isize,
    length: T,
) -> Factors<T> {
    match &column.buckling {
        None => elastic(column, &Linear, position, first, length),
        Some(buckling) => elastic(column, &**buckling, position, first, length),
    }
}

#[inline(always)]
fn elastic<T: Real>(
    column: &Column<T>,
    elasticity: &impl Elasticity<T>,
    position: FieldView<'_, T>,
    first: isize,
    length: T,
) -> Factors<T> {
    let own = position.packet(first);
    match &column.neighbours {
        Neighbours::Offset(offset) => {
            let other = position.packet(first + *offset as isize);
            factors(column, elasticity, own, other, length)
        }
        Neighbours::Indices(indices) => {
            let other = position.gather(indices);
            factors(column, elasticity, own, other.each_ref(), length)
        }
    }
}

#[inline(always)]
fn factors<T: Real>(
    column: &Column<T>,
    elasticity: &impl Elasticity<T>,
    [xi, yi, zi]: [&Lanes<T>; 3],
    [xj, yj, zj]: [&Lanes<T>; 3],
    step: T,
) -> Factors<T> {
    let mut factors = Factors { u: [[T::ZERO; LANES]; 3], e: [T::ZERO; LANES] };
    let square = step * step;
    for lane in 0..LANES {
        let dx = xj[lane] - xi[lane];
        let dy = yj[lane] - yi[lane];
        let dz = zj[lane] - zi[lane];
        let length = (dx * dx + dy * dy + dz * dz).sqrt();
        let inverse_length = T::ONE / length.maximum(T::LENGTH_MIN);
        let stretch = length - column.rest_length[lane];
        let tension = elasticity.tension(lane, column.stiffness[lane], stretch);
        let slope = elasticity.tension_derivative(lane, column.stiffness[lane], stretch);
        let e = square * tension * inverse_length;
        let along = square * slope + step * column.damping[lane];
        let root = (along - e.maximum(T::ZERO)).maximum(T::ZERO).sqrt() * inverse_length;
        factors.u[0][lane] = root * dx;
        factors.u[1][lane] = root * dy;
        factors.u[2][lane] = root * dz;
        factors.e[lane] = e;
    }
    factors
}
