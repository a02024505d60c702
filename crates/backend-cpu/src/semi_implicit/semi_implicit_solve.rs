//! NUMERICS §6, `semi_implicit_solve`: the right-hand side of the constant system.

use cloth_core::Real;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::SemiImplicit;
use crate::{
    elasticity::Elasticity,
    memory::{BLOCK, LANES, Lanes, Masses, VectorField, lanes, lanes_mut},
    spring_forces::{ColumnVisitor, MotionView, PacketView, visit_columns},
    springs::{Column, SpringColumns},
};

/// All that the right-hand side is made of.
pub(crate) struct RightSide<'a, T> {
    pub(crate) springs: &'a SpringColumns<T>,
    pub(crate) masses: &'a Masses<T>,
    pub(crate) motion: MotionView<'a, T>,
    /// All forces of the present state \[N\].
    pub(crate) force: &'a VectorField<T>,
    /// Length of the substep \[s\].
    pub(crate) length: T,
}

impl<T: Real> RightSide<'_, T> {
    /// Writes b = h f + h^2 sum k (v_j - v_i), zero for held particles.
    pub(crate) fn fill(&self, into: &mut SemiImplicit<T>, arch: pulp::Arch) {
        let mut right_side = std::mem::replace(&mut into.right_side, VectorField::new(0, 0));
        let system = &*into;
        right_side.chunks_mut(BLOCK).enumerate().for_each(|(block, chunk)| {
            arch.dispatch(BlockTask { right_side: self, system, start: block * BLOCK, chunk });
        });
        into.right_side = right_side;
    }

    /// The sum of k (v_j - v_i) over the triangles of fabric around a particle.
    #[inline(always)]
    fn of_fabric(&self, system: &SemiImplicit<T>, particle: usize) -> [T; 3] {
        let MotionView { v, margin, .. } = self.motion;
        let (neighbours, stiffness) = system.fabric_row(particle);
        let mut sum = [T::ZERO; 3];
        for (&other, &stiffness) in neighbours.iter().zip(stiffness) {
            for axis in 0..3 {
                let own = v[axis][margin + particle];
                sum[axis] += stiffness * (v[axis][margin + other as usize] - own);
            }
        }
        sum
    }

    #[inline(always)]
    fn packet(&self, system: &SemiImplicit<T>, first: usize) -> [Lanes<T>; 3] {
        let mut sum =
            VelocitySum { velocity: self.motion.velocity(first), sum: [[T::ZERO; LANES]; 3] };
        visit_columns(self.springs, self.motion, first, &mut sum);
        // Beyond the last particle there is room, but nothing is read from it.
        for lane in 0..LANES.min(system.len().saturating_sub(first)) {
            let of_fabric = self.of_fabric(system, first + lane);
            for axis in 0..3 {
                sum.sum[axis][lane] += of_fabric[axis];
            }
        }
        let square = self.length * self.length;
        let inverse_mass = lanes(&self.masses.inverse, first);
        let (force, margin) = (self.force.padded(), self.force.margin());
        let mut result = [[T::ZERO; LANES]; 3];
        for axis in 0..3 {
            let force = lanes(force[axis], margin + first);
            for lane in 0..LANES {
                let value = self.length * force[lane] + square * sum.sum[axis][lane];
                let is_held = inverse_mass[lane] == T::ZERO;
                result[axis][lane] = if is_held { T::ZERO } else { value };
            }
        }
        result
    }
}

/// Sum of k (v_j - v_i) over the springs of a packet.
struct VelocitySum<'a, T> {
    velocity: [&'a Lanes<T>; 3],
    sum: [Lanes<T>; 3],
}

impl<T: Real> ColumnVisitor<T> for VelocitySum<'_, T> {
    #[inline(always)]
    fn visit(
        &mut self,
        column: &Column<T>,
        _: &impl Elasticity<T>,
        (_, velocity): PacketView<'_, T>,
    ) {
        for axis in 0..3 {
            for lane in 0..LANES {
                let difference = velocity[axis][lane] - self.velocity[axis][lane];
                // A lane without a spring has stiffness zero.
                self.sum[axis][lane] += column.stiffness[lane] * difference;
            }
        }
    }
}

/// One block, compiled for each instruction set.
struct BlockTask<'a, T> {
    right_side: &'a RightSide<'a, T>,
    system: &'a SemiImplicit<T>,
    start: usize,
    chunk: [&'a mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for BlockTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        for local in (0..self.chunk[0].len()).step_by(LANES) {
            let packet = self.right_side.packet(self.system, self.start + local);
            for (values, packet) in self.chunk.iter_mut().zip(packet) {
                *lanes_mut(values, local) = packet;
            }
        }
    }
}
