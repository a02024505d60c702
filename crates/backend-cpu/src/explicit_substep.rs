//! The composite stage `explicit_substep`, fused: all forces, integration and colliders in one pass
//! over the particles. It does the arithmetic of the single stages in their order.

use std::sync::atomic::{AtomicBool, Ordering};

use cloth_core::{ColliderImpulse, Real};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use crate::{
    aerodynamic_forces::Aerodynamics,
    block_impulses::BlockImpulses,
    collider_response::{self, ColliderAt},
    collider_sweep::PathStart,
    contact::{
        Contact,
        response::{self, Penalty},
    },
    fabric::Fabric,
    field_forces::{self, FieldSum},
    integrate_explicit,
    memory::{BLOCK, LANES, Lanes, Masses, Motion, MotionChunk, PacketMotion, lanes},
    procedural_forces::{Programs, Registers},
    spring_forces::{self, MotionView},
    springs::SpringColumns,
    triangle_contact::TriangleContact,
};

/// All that the pass reads.
pub(crate) struct ExplicitPass<'a, T> {
    pub(crate) count: usize,
    pub(crate) springs: &'a SpringColumns<T>,
    pub(crate) fields: &'a FieldSum<T>,
    pub(crate) programs: Programs<'a, T>,
    pub(crate) masses: &'a Masses<T>,
    pub(crate) fabric: Option<&'a Fabric<T>>,
    pub(crate) aerodynamics: Option<&'a Aerodynamics<T>>,
    pub(crate) contact: Option<(&'a Contact<T>, Penalty<T>)>,
    pub(crate) triangles: Option<&'a TriangleContact<T>>,
    pub(crate) colliders: &'a [ColliderAt<T>],
    pub(crate) offsets: &'a [T],
    pub(crate) motion: MotionView<'a, T>,
    pub(crate) length: T,
}

impl<T: Real> ExplicitPass<'_, T> {
    /// Computes the next positions and velocities; says whether they are all finite.
    ///
    /// Each block adds to its own `impulses`.
    pub(crate) fn run(
        &self,
        next: &mut Motion<T>,
        impulses: &mut BlockImpulses,
        arch: pulp::Arch,
    ) -> bool {
        let finite = AtomicBool::new(true);
        let blocks = next.chunks_mut(BLOCK).zip(impulses.blocks_mut());
        blocks.enumerate().for_each(|(block, (mut chunk, impulses))| {
            let start = block * BLOCK;
            let task = BlockTask { pass: self, start, chunk: &mut chunk, impulses };
            if !arch.dispatch(task) {
                finite.store(false, Ordering::Relaxed);
            }
        });
        finite.into_inner()
    }

    /// Computes one block; says whether all is finite.
    #[inline(always)]
    fn block(
        &self,
        start: usize,
        chunk: &mut MotionChunk<'_, T>,
        mut impulses: Option<&mut [ColliderImpulse]>,
    ) -> bool {
        let mut finite = true;
        let mut registers = self.programs.registers();
        for local in (0..chunk.position[0].len()).step_by(LANES) {
            let first = start + local;
            let force = self.forces(first, registers.as_mut());
            let inverse_mass = lanes(&self.masses.inverse, first);
            let mut moved = integrate_explicit::packet(
                self.length,
                inverse_mass,
                &force,
                self.motion.position(first),
                self.motion.velocity(first),
            );
            let offsets = lanes(self.offsets, first);
            let impulses = impulses.as_deref_mut();
            let start = PathStart { position: self.motion.position(first), length: self.length };
            let colliders = self.colliders;
            collider_response::packet(
                colliders,
                offsets,
                inverse_mass,
                Some(start),
                &mut moved,
                impulses,
            );
            finite &= is_finite(&moved);
            chunk.store(local, &moved);
        }
        finite
    }

    #[inline(always)]
    fn forces(&self, first: usize, registers: Option<&mut Registers<T>>) -> [Lanes<T>; 3] {
        let mass = lanes(&self.masses.mass, first);
        let mut force = field_forces::packet(self.fields, mass, self.motion.velocity(first));
        if let Some(registers) = registers {
            self.programs.packet(registers, first, mass, self.motion, &mut force);
        }
        spring_forces::packet(self.springs, self.motion, first, &mut force);
        let used = LANES.min(self.count - first);
        if let Some(fabric) = self.fabric {
            for lane in 0..used {
                add(&mut force, lane, fabric.membrane_force(first + lane));
            }
            for lane in 0..used {
                add(&mut force, lane, fabric.bending_force(first + lane));
            }
        }
        if let Some(aerodynamics) = self.aerodynamics {
            for lane in 0..used {
                add(&mut force, lane, aerodynamics.force(first + lane));
            }
        }
        if let Some((contact, penalty)) = self.contact
            && contact.any_in_packet(first)
        {
            for lane in 0..used {
                if let Some(sum) = response::force(contact, penalty, self.motion, first + lane) {
                    add(&mut force, lane, sum);
                }
            }
        }
        if let Some(triangles) = self.triangles {
            for lane in 0..used {
                if let Some(sum) = triangles.force(first + lane) {
                    add(&mut force, lane, sum);
                }
            }
        }
        force
    }
}

/// One block, compiled for each instruction set.
struct BlockTask<'a, 'b, T> {
    pass: &'a ExplicitPass<'a, T>,
    start: usize,
    chunk: &'a mut MotionChunk<'b, T>,
    impulses: Option<&'a mut [ColliderImpulse]>,
}

impl<T: Real> NullaryFnOnce for BlockTask<'_, '_, T> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        self.pass.block(self.start, self.chunk, self.impulses)
    }
}

#[inline(always)]
fn add<T: Real>(force: &mut [Lanes<T>; 3], lane: usize, sum: [T; 3]) {
    for axis in 0..3 {
        force[axis][lane] += sum[axis];
    }
}

#[inline(always)]
fn is_finite<T: Real>(moved: &PacketMotion<T>) -> bool {
    let mut finite = true;
    for values in moved.position.iter().chain(&moved.velocity) {
        for value in values {
            finite &= value.abs() <= T::MAX;
        }
    }
    finite
}
