//! NUMERICS §10: figures of a state.

use cloth_core::{Measures, Model, Real};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use crate::{
    collider_response::{ColliderAt, penetration},
    elasticity::Elasticity,
    fabric::FabricFigures,
    memory::{BLOCK, LANES, Lanes, Masses, lanes},
    spring_forces::{ColumnVisitor, MotionView, PacketView, Spring, visit_columns},
    springs::{Column, SpringColumns},
};

/// What is measured, and memory for the partial results.
pub(crate) struct Measure<'a, T> {
    pub(crate) model: &'a Model,
    pub(crate) springs: &'a SpringColumns<T>,
    pub(crate) masses: &'a Masses<T>,
    pub(crate) colliders: &'a [ColliderAt<T>],
    pub(crate) offsets: &'a [T],
    pub(crate) motion: MotionView<'a, T>,
    /// Sum of gravity and uniform fields \[m/s^2\].
    pub(crate) acceleration: [f64; 3],
}

/// What is summed up.
#[derive(Clone, Copy, Debug)]
struct Sums<T> {
    strain: T,
    spring_ends: T,
    kinetic: T,
    elastic: T,
    potential: T,
    momentum: [T; 3],
    force: [T; 3],
    force_magnitude: T,
}

/// Over the particles that have the same place in their packets, so that the loop over a packet is vector code.
type LaneSums = Sums<[f64; LANES]>;

impl<T: Copy> Sums<T> {
    const fn all(value: T) -> Self {
        Self {
            strain: value,
            spring_ends: value,
            kinetic: value,
            elastic: value,
            potential: value,
            momentum: [value; 3],
            force: [value; 3],
            force_magnitude: value,
        }
    }

    fn map<U>(self, of: impl Fn(T) -> U) -> Sums<U> {
        Sums {
            strain: of(self.strain),
            spring_ends: of(self.spring_ends),
            kinetic: of(self.kinetic),
            elastic: of(self.elastic),
            potential: of(self.potential),
            momentum: self.momentum.map(&of),
            force: self.force.map(&of),
            force_magnitude: of(self.force_magnitude),
        }
    }
}

impl Sums<f64> {
    fn add(&mut self, other: &Self) {
        self.strain += other.strain;
        self.spring_ends += other.spring_ends;
        self.kinetic += other.kinetic;
        self.elastic += other.elastic;
        self.potential += other.potential;
        for axis in 0..3 {
            self.momentum[axis] += other.momentum[axis];
            self.force[axis] += other.force[axis];
        }
        self.force_magnitude += other.force_magnitude;
    }
}

/// Figures of one block, or of several.
#[derive(Clone, Copy, Debug)]
struct Partial {
    non_finite: Option<u32>,
    strain_max: f64,
    strain_particle: u32,
    penetration: f64,
    sums: Sums<f64>,
}

impl Default for Partial {
    fn default() -> Self {
        let sums = Sums::all(0.0);
        Self { non_finite: None, strain_max: -1.0, strain_particle: 0, penetration: 0.0, sums }
    }
}

impl<T: Real> Measure<'_, T> {
    pub(crate) fn run(&self, arch: pulp::Arch, fabric: Option<FabricFigures>) -> Measures {
        let count = self.model.particle_count();
        let partials: Vec<Partial> = (0..count.div_ceil(BLOCK))
            .into_par_iter()
            .map(|block| arch.dispatch(BlockTask { measure: self, block }))
            .collect();
        let mut total = partials.into_iter().fold(Partial::default(), Partial::merge);
        let fabric = fabric.unwrap_or_default();
        if fabric.strain_max.0 > total.strain_max {
            (total.strain_max, total.strain_particle) = fabric.strain_max;
        }
        let sums = total.sums;
        let length = |vector: [f64; 3]| vector.iter().map(|c| c * c).sum::<f64>().sqrt();
        Measures {
            non_finite_particle: total.non_finite,
            non_finite_step: None,
            // Still where it began: no strain was measured.
            strain_max: if total.strain_max > -1.0 { total.strain_max } else { 0.0 },
            strain_mean: (sums.strain + 2.0 * fabric.strain_sum[0])
                / (sums.spring_ends + 2.0 * fabric.strain_sum[1]).max(1.0),
            strain_particle: total.strain_particle,
            penetration_max: total.penetration,
            energy_kinetic: sums.kinetic,
            energy_elastic: sums.elastic + fabric.energy,
            energy_potential: sums.potential,
            momentum: sums.momentum,
            momentum_drift: length(sums.force) / sums.force_magnitude.max(f64::MIN_POSITIVE),
        }
    }

    #[inline(always)]
    fn block(&self, block: usize) -> Partial {
        let mut partial = Partial::default();
        let mut sums = LaneSums::all([0.0; LANES]);
        let end = ((block + 1) * BLOCK).min(self.model.particle_count());
        for first in (block * BLOCK..end).step_by(LANES) {
            self.springs(first, &mut partial, &mut sums);
            self.particles(first, LANES.min(end - first), &mut partial, &mut sums);
        }
        partial.sums = sums.map(|lanes| lanes.into_iter().fold(0.0, |sum, lane| sum + lane));
        partial
    }

    #[inline(always)]
    fn springs(&self, first: usize, partial: &mut Partial, sums: &mut LaneSums) {
        let mut sum = SpringSum {
            motion: (self.motion.position(first), self.motion.velocity(first)),
            strain_max: [-T::ONE; LANES],
            strain_sum: [T::ZERO; LANES],
            elastic: [T::ZERO; LANES],
            force: [[T::ZERO; LANES]; 3],
            magnitude: [T::ZERO; LANES],
            ends: [T::ZERO; LANES],
        };
        visit_columns(self.springs, self.motion, first, &mut sum);
        for lane in 0..LANES {
            if sum.strain_max[lane].to_f64() > partial.strain_max {
                partial.strain_max = sum.strain_max[lane].to_f64();
                partial.strain_particle = (first + lane) as u32;
            }
        }
        for lane in 0..LANES {
            sums.strain[lane] += sum.strain_sum[lane].to_f64();
            // Both ends of a spring count twice its energy.
            sums.elastic[lane] += 0.25 * sum.elastic[lane].to_f64();
            sums.force_magnitude[lane] += sum.magnitude[lane].to_f64();
            sums.spring_ends[lane] += sum.ends[lane].to_f64();
            for axis in 0..3 {
                sums.force[axis][lane] += sum.force[axis][lane].to_f64();
            }
        }
    }

    /// Figures of the particles of a packet, `used` of them.
    #[inline(always)]
    fn particles(&self, first: usize, used: usize, partial: &mut Partial, sums: &mut LaneSums) {
        let position = self.motion.position(first);
        let velocity = self.motion.velocity(first);
        let mass = lanes(&self.masses.mass, first);
        let mut checked = [T::ZERO; LANES];
        let mut kinetic = [0.0; LANES];
        let mut potential = [0.0; LANES];
        for axis in 0..3 {
            let acceleration = self.acceleration[axis];
            for lane in 0..LANES {
                let (x, v) = (position[axis][lane], velocity[axis][lane]);
                // Zero for every finite number, NaN for all others.
                checked[lane] += (x + v) * T::ZERO;
                // Lanes without a particle have no mass.
                let [mass, x, v] = [mass[lane].to_f64(), x.to_f64(), v.to_f64()];
                sums.momentum[axis][lane] += mass * v;
                kinetic[lane] += 0.5 * (mass * v * v);
                potential[lane] -= mass * (acceleration * x);
            }
        }
        for lane in 0..LANES {
            sums.kinetic[lane] += kinetic[lane];
            sums.potential[lane] += potential[lane];
        }
        for lane in 0..used {
            if checked[lane] != T::ZERO {
                partial.non_finite = partial.non_finite.or(Some((first + lane) as u32));
            }
        }
        let depth = penetration(
            self.colliders,
            lanes(self.offsets, first),
            lanes(&self.masses.inverse, first),
            position,
        );
        partial.penetration = partial.penetration.max(depth.to_f64());
    }
}

/// Sums over the springs of a packet.
struct SpringSum<'a, T> {
    motion: PacketView<'a, T>,
    strain_max: Lanes<T>,
    strain_sum: Lanes<T>,
    elastic: Lanes<T>,
    force: [Lanes<T>; 3],
    magnitude: Lanes<T>,
    ends: Lanes<T>,
}

impl<T: Real> ColumnVisitor<T> for SpringSum<'_, T> {
    #[inline(always)]
    fn visit(
        &mut self,
        column: &Column<T>,
        elasticity: &impl Elasticity<T>,
        neighbours: PacketView<'_, T>,
    ) {
        for lane in 0..LANES {
            let spring = Spring::new(column, elasticity, self.motion, neighbours, lane);
            let active = column.active[lane];
            let strain = spring.stretch / column.rest_length[lane];
            let largest = strain.maximum(self.strain_max[lane]);
            let measured = column.measured[lane] != T::ZERO;
            self.strain_max[lane] = if measured { largest } else { self.strain_max[lane] };
            self.strain_sum[lane] += active * strain.abs();
            self.elastic[lane] +=
                elasticity.energy_doubled(lane, column.stiffness[lane], spring.stretch);
            self.magnitude[lane] += spring.tension.abs();
            self.ends[lane] += active;
            let [fx, fy, fz] = spring.force();
            self.force[0][lane] += fx;
            self.force[1][lane] += fy;
            self.force[2][lane] += fz;
        }
    }
}

/// One block, compiled for each instruction set.
struct BlockTask<'a, T> {
    measure: &'a Measure<'a, T>,
    block: usize,
}

impl<T: Real> NullaryFnOnce for BlockTask<'_, T> {
    type Output = Partial;

    #[inline(always)]
    fn call(self) -> Partial {
        self.measure.block(self.block)
    }
}

impl Partial {
    /// `self` is the earlier block.
    fn merge(mut self, other: Self) -> Self {
        self.non_finite = self.non_finite.or(other.non_finite);
        if other.strain_max > self.strain_max {
            self.strain_max = other.strain_max;
            self.strain_particle = other.strain_particle;
        }
        self.penetration = self.penetration.max(other.penetration);
        self.sums.add(&other.sums);
        self
    }
}
