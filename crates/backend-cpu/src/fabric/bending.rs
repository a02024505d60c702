//! NUMERICS §12: the patches around triangles that resist curvature, those of a packet side by side: their energies, and what they ask of their folds.

use cloth_core::{Model, NONE, NewtonStart, Real, fabric::FOLDS};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::folds::FoldState;
use crate::memory::{LANES, Lanes};

/// Packets in one task.
const TASK: usize = 16;

/// All patches of a model, and what was last computed of them.
#[derive(Debug)]
pub(super) struct Patches<T> {
    packets: Vec<Packet<T>>,
    /// What each patch asks of its folds \[N m\].
    moments: Vec<[T; FOLDS]>,
}

/// Patches at rest. In the last packet the last patch fills the places that are left.
#[derive(Debug)]
struct Packet<T> {
    /// Their folds; the number of folds where there is none.
    folds: [Lanes<u32>; FOLDS],
    /// What they make of these: [`cloth_core::fabric::CurvatureStiffness::rooted`].
    map: [[Lanes<T>; FOLDS]; 3],
    /// Rayleigh damping \[s\].
    damping: Lanes<T>,
}

/// What is asked of patches: `still` times how far folds are from rest, and `moving` times their rates; of each patch.
struct Bent<T> {
    still: T,
    /// Times the damping, and what is added to that.
    moving: [T; 2],
}

impl<T: Real> Patches<T> {
    pub(super) fn new(model: &Model) -> Self {
        let elements = model.elements();
        let triangles = elements.triangles();
        let folds = elements.patch_folds();
        let (count, none) = (triangles.len(), elements.folds().len() as u32);
        let packet = |first: usize| {
            let number = |lane: usize| (first + lane).min(count - 1);
            let fold = |lane: usize, k: usize| match folds[number(lane)][k] {
                NONE => none,
                fold => fold,
            };
            let maps: Lanes<[[T; FOLDS]; 3]> =
                std::array::from_fn(|lane| triangles[number(lane)].bending.rooted());
            let fabric = |lane: usize| &elements.fabrics()[triangles[number(lane)].fabric as usize];
            Packet {
                folds: std::array::from_fn(|k| std::array::from_fn(|lane| fold(lane, k))),
                map: std::array::from_fn(|row| {
                    std::array::from_fn(|k| std::array::from_fn(|lane| maps[lane][row][k]))
                }),
                damping: std::array::from_fn(|lane| T::from_f64(fabric(lane).damping[1])),
            }
        };
        Self {
            packets: (0..count).step_by(LANES).map(packet).collect(),
            moments: vec![[T::ZERO; FOLDS]; count],
        }
    }

    /// What all patches ask of their folds.
    pub(super) fn moments(&self) -> &[T] {
        self.moments.as_flattened()
    }

    /// Computes that.
    pub(super) fn moments_find(&mut self, states: &[FoldState<T>], arch: pulp::Arch) {
        self.find(states, &Bent { still: T::ONE, moving: [T::ONE, T::ZERO] }, arch);
    }

    /// The same with moments of impulses \[N m s\] for a substep of `length` \[s\] that is linearised.
    pub(super) fn impulses_find(
        &mut self,
        states: &[FoldState<T>],
        (length, start): (T, NewtonStart),
        arch: pulp::Arch,
    ) {
        let square = length * length;
        let ahead = if start == NewtonStart::StepStart { square } else { T::ZERO };
        self.find(states, &Bent { still: length, moving: [length, ahead] }, arch);
    }

    fn find(&mut self, states: &[FoldState<T>], bent: &Bent<T>, arch: pulp::Arch) {
        let all = self.packets.par_iter().zip(self.moments.par_chunks_mut(LANES));
        all.with_min_len(TASK).for_each(|(packet, moments)| {
            arch.dispatch(MomentTask { packet, bent, states, moments });
        });
    }

    /// Energy of each patch \[J\].
    pub(super) fn energies(&self, states: &[FoldState<T>], arch: pulp::Arch) -> Vec<T> {
        let of_packet = |packet| arch.dispatch(EnergyTask { packet, states });
        let mut energies: Vec<Lanes<T>> = Vec::new();
        self.packets.par_iter().with_min_len(TASK).map(of_packet).collect_into_vec(&mut energies);
        let mut energies = energies.into_flattened();
        energies.truncate(self.moments.len());
        energies
    }
}

impl<T: Real> Packet<T> {
    /// The three numbers half of whose squares are the energy, for folds that are so far from rest.
    #[inline(always)]
    fn numbers(&self, states: &[FoldState<T>], bent: &Bent<T>) -> [Lanes<T>; 3] {
        let mut numbers = [[T::ZERO; LANES]; 3];
        for (fold, at) in self.folds.iter().enumerate() {
            let (mut differences, mut rates) = ([T::ZERO; LANES], [T::ZERO; LANES]);
            for lane in 0..LANES {
                let state = &states[at[lane] as usize];
                (differences[lane], rates[lane]) = (state.difference, state.rate);
            }
            let mut all = [T::ZERO; LANES];
            for lane in 0..LANES {
                let moving = bent.moving[0] * self.damping[lane] + bent.moving[1];
                all[lane] = bent.still * differences[lane] + moving * rates[lane];
            }
            for (row, sum) in numbers.iter_mut().enumerate() {
                let map = &self.map[row][fold];
                for lane in 0..LANES {
                    sum[lane] += map[lane] * all[lane];
                }
            }
        }
        numbers
    }
}

/// What the patches of a packet ask of their folds, compiled for each instruction set.
struct MomentTask<'a, T> {
    packet: &'a Packet<T>,
    bent: &'a Bent<T>,
    states: &'a [FoldState<T>],
    moments: &'a mut [[T; FOLDS]],
}

impl<T: Real> NullaryFnOnce for MomentTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { packet, bent, states, moments } = self;
        let [p, q, r] = packet.numbers(states, bent);
        let mut all = [[T::ZERO; LANES]; FOLDS];
        for (fold, moment) in all.iter_mut().enumerate() {
            let [a, b, c] = packet.map.each_ref().map(|row| &row[fold]);
            for lane in 0..LANES {
                moment[lane] = a[lane] * p[lane] + b[lane] * q[lane] + c[lane] * r[lane];
            }
        }
        for (lane, moments) in moments.iter_mut().enumerate() {
            *moments = all.each_ref().map(|moment| moment[lane]);
        }
    }
}

/// Energies of a packet, compiled for each instruction set.
struct EnergyTask<'a, T> {
    packet: &'a Packet<T>,
    states: &'a [FoldState<T>],
}

impl<T: Real> NullaryFnOnce for EnergyTask<'_, T> {
    type Output = Lanes<T>;

    #[inline(always)]
    fn call(self) -> Lanes<T> {
        let bent = Bent { still: T::ONE, moving: [T::ZERO; 2] };
        let [p, q, r] = self.packet.numbers(self.states, &bent);
        std::array::from_fn(|lane| {
            let squares = p[lane] * p[lane] + q[lane] * q[lane] + r[lane] * r[lane];
            T::from_f64(0.5) * squares
        })
    }
}
