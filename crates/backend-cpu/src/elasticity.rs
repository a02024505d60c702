//! NUMERICS §2: tension and energy of the springs of a column, with buckling or without.

use cloth_core::{Buckling, Real};

use crate::memory::{LANES, Lanes};

/// What a column of springs does when its lengths change. A type for each case rather than a test in
/// every lane, so that columns without buckling do nothing for it.
pub(crate) trait Elasticity<T> {
    /// Elastic tension \[N\] of the spring of a lane; zero in a lane without stiffness.
    fn tension(&self, lane: usize, stiffness: T, stretch: T) -> T;

    /// Derivative of the tension by the length \[N/m\].
    fn tension_derivative(&self, lane: usize, stiffness: T, stretch: T) -> T;

    /// Twice its elastic energy \[J\].
    fn energy_doubled(&self, lane: usize, stiffness: T, stretch: T) -> T;
}

/// No spring of the column buckles.
pub(crate) struct Linear;

impl<T: Real> Elasticity<T> for Linear {
    #[inline(always)]
    fn tension(&self, _lane: usize, stiffness: T, stretch: T) -> T {
        stiffness * stretch
    }

    #[inline(always)]
    fn tension_derivative(&self, _lane: usize, stiffness: T, _stretch: T) -> T {
        stiffness
    }

    #[inline(always)]
    fn energy_doubled(&self, _lane: usize, stiffness: T, stretch: T) -> T {
        stiffness * stretch * stretch
    }
}

/// Some springs of the column buckle; the others have [`Buckling::never`].
#[derive(Clone, Debug)]
pub(crate) struct BucklingLanes<T> {
    force_scale: Lanes<T>,
    inverse_rest_length: Lanes<T>,
    energy_offset: Lanes<T>,
    stiff_compression: Lanes<T>,
    stiff_energy: Lanes<T>,
}

impl<T: Real> BucklingLanes<T> {
    /// No lane buckles.
    pub(crate) fn never() -> Self {
        let never = Buckling::never();
        Self {
            force_scale: [never.force_scale; LANES],
            inverse_rest_length: [never.inverse_rest_length; LANES],
            energy_offset: [never.energy_offset; LANES],
            stiff_compression: [never.stiff_compression; LANES],
            stiff_energy: [never.stiff_energy; LANES],
        }
    }

    pub(crate) fn set(&mut self, lane: usize, buckling: Buckling<T>) {
        self.force_scale[lane] = buckling.force_scale;
        self.inverse_rest_length[lane] = buckling.inverse_rest_length;
        self.energy_offset[lane] = buckling.energy_offset;
        self.stiff_compression[lane] = buckling.stiff_compression;
        self.stiff_energy[lane] = buckling.stiff_energy;
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> Buckling<T> {
        Buckling {
            force_scale: self.force_scale[lane],
            inverse_rest_length: self.inverse_rest_length[lane],
            energy_offset: self.energy_offset[lane],
            stiff_compression: self.stiff_compression[lane],
            stiff_energy: self.stiff_energy[lane],
        }
    }
}

impl<T: Real> Elasticity<T> for BucklingLanes<T> {
    #[inline(always)]
    fn tension(&self, lane: usize, stiffness: T, stretch: T) -> T {
        self.get(lane).tension(stiffness, stretch)
    }

    #[inline(always)]
    fn tension_derivative(&self, lane: usize, stiffness: T, stretch: T) -> T {
        self.get(lane).tension_derivative(stiffness, stretch)
    }

    #[inline(always)]
    fn energy_doubled(&self, lane: usize, stiffness: T, stretch: T) -> T {
        let energy = self.get(lane).energy(stiffness, stretch);
        energy + energy
    }
}
