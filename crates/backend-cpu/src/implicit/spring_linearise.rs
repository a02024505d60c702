//! NUMERICS §5, `spring_linearise`: the factors of every spring.

use std::ops::Range;

use cloth_core::Real;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::spring_factors::{FactorsTask, SpringFactors};
use crate::{
    elasticity::{Elasticity, Linear},
    memory::{BLOCK, FieldView, LANES, Lanes},
    springs::{Column, Neighbours, SpringColumns},
};

/// Packets in one task.
const TASK: usize = BLOCK / LANES;

/// Computes all factors at these positions for a substep of `length` \[s\].
pub(super) fn run<T: Real>(
    factors: &mut SpringFactors<T>,
    springs: &SpringColumns<T>,
    position: FieldView<'_, T>,
    length: T,
    arch: pulp::Arch,
) {
    factors.position.copy_from(position);
    factors.step_set(springs, length);
    factors.tasks(TASK).enumerate().for_each(|(task, factors)| {
        let packets = task * TASK..((task + 1) * TASK).min(springs.packet_count());
        arch.dispatch(Task { springs, packets, position, length, factors });
    });
}

/// Some packets.
struct Task<'a, 'b, T> {
    springs: &'a SpringColumns<T>,
    packets: Range<usize>,
    position: FieldView<'a, T>,
    length: T,
    factors: FactorsTask<'b, T>,
}

impl<T: Real> NullaryFnOnce for Task<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        for (number, packet) in self.packets.enumerate() {
            let first = (packet * LANES) as isize;
            let (mut roots, mut alongs) = self.factors.packet_mut(number);
            for column in self.springs.packet(packet) {
                let [root, along] = linearise(column, self.position, first, self.length);
                if let Some(entry) = roots.next() {
                    *entry = root;
                }
                if let Some(entry) = alongs.as_mut().and_then(Iterator::next) {
                    *entry = along;
                }
            }
        }
    }
}

/// `root` of the springs of one column of the packet that starts at particle `first`, and the stiffness along them.
#[inline(always)]
fn linearise<T: Real>(
    column: &Column<T>,
    position: FieldView<'_, T>,
    first: isize,
    length: T,
) -> [Lanes<T>; 2] {
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
) -> [Lanes<T>; 2] {
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
) -> [Lanes<T>; 2] {
    let mut factors = [[T::ZERO; LANES]; 2];
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
        factors[0][lane] = root;
        factors[1][lane] = along;
    }
    factors
}
