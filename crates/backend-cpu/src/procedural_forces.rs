//! NUMERICS §3: force fields given as expressions.

use std::sync::Arc;

use cloth_core::{FieldInputs, FieldProgram, FieldRegisters, Model, Real, stepper::Substep};
use pulp::NullaryFnOnce;

use crate::{
    memory::{LANES, Lanes, Masses, lanes, lanes_mut},
    spring_forces::MotionView,
};

/// The programs of a model in one substep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Programs<'a, T> {
    programs: &'a [Arc<FieldProgram>],
    time: T,
    length: T,
}

/// Memory to run programs with; every block of particles has its own.
pub(crate) type Registers<T> = FieldRegisters<T, LANES>;

/// The programs of a model.
pub(crate) fn programs(model: &Model) -> Vec<Arc<FieldProgram>> {
    model.field_programs().cloned().collect()
}

impl<'a, T: Real> Programs<'a, T> {
    pub(crate) fn new(programs: &'a [Arc<FieldProgram>], substep: &Substep) -> Self {
        Self { programs, time: T::from_f64(substep.time), length: T::from_f64(substep.length) }
    }

    /// Memory for a block, none without programs. With a single program it stays prepared.
    #[inline(always)]
    pub(crate) fn registers(&self) -> Option<Registers<T>> {
        let first = self.programs.first()?;
        let mut registers = Registers::new();
        first.prepare(&mut registers, self.time, self.length);
        Some(registers)
    }

    /// Adds the forces on a packet that starts at particle `first`.
    #[inline(always)]
    pub(crate) fn packet(
        &self,
        registers: &mut Registers<T>,
        first: usize,
        mass: &Lanes<T>,
        motion: MotionView<'_, T>,
        force: &mut [Lanes<T>; 3],
    ) {
        let inputs = FieldInputs {
            position: motion.position(first),
            velocity: motion.velocity(first),
            mass,
            first,
        };
        for program in self.programs {
            if self.programs.len() > 1 {
                program.prepare(registers, self.time, self.length);
            }
            let more = program.run(registers, &inputs);
            for axis in 0..3 {
                for lane in 0..LANES {
                    // Lanes that fill up the last packet have no mass, and no sensible force.
                    let counts = mass[lane] > T::ZERO;
                    force[axis][lane] += if counts { more[axis][lane] } else { T::ZERO };
                }
            }
        }
    }
}

/// The stage on one block, compiled for each instruction set.
pub(crate) struct BlockTask<'a, 'b, T> {
    pub(crate) programs: Programs<'a, T>,
    pub(crate) masses: &'a Masses<T>,
    pub(crate) motion: MotionView<'a, T>,
    pub(crate) start: usize,
    pub(crate) force: [&'b mut [T]; 3],
}

impl<T: Real> NullaryFnOnce for BlockTask<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Some(mut registers) = self.programs.registers() else { return };
        for local in (0..self.force[0].len()).step_by(LANES) {
            let first = self.start + local;
            let mut packet = [[T::ZERO; LANES]; 3];
            for axis in 0..3 {
                packet[axis] = *lanes(self.force[axis], local);
            }
            let mass = lanes(&self.masses.mass, first);
            self.programs.packet(&mut registers, first, mass, self.motion, &mut packet);
            for axis in 0..3 {
                *lanes_mut(self.force[axis], local) = packet[axis];
            }
        }
    }
}
