//! NUMERICS §12: the patches around triangles that resist curvature, those of a packet side by side: their energies, what they ask of their folds, and what
//! they add to the matrix.

use cloth_core::{
    Model, NONE, NewtonStart, Real, TURNED,
    fabric::{
        FOLDS,
        bending::{self, COMES_AGAIN, FOLD_PLACES, PATCH},
        hinge,
    },
};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::folds::FoldState;
use crate::memory::{LANES, Lanes};

/// Where in a patch the vertices of each fold are, and where if it is turned.
const PLACES: [[[usize; 4]; FOLDS]; 2] = {
    let mut places = [FOLD_PLACES; 2];
    let mut fold = 0;
    while fold < FOLDS {
        let [a, b, c, d] = FOLD_PLACES[fold];
        places[1][fold] = [b, a, d, c];
        fold += 1;
    }
    places
};

/// Packets in one task.
const TASK: usize = 16;

/// All patches of a model, and what was last computed of them.
#[derive(Debug)]
pub(super) struct Patches<T> {
    packets: Vec<Packet<T>>,
    /// What each patch asks of its folds \[N m\].
    moments: Vec<[T; FOLDS]>,
    tangents: Vec<PatchTangent<T>>,
}

/// Patches at rest. In the last packet the last patch fills the places that are left.
#[derive(Debug)]
struct Packet<T> {
    /// Their folds; the number of folds where there is none.
    folds: [Lanes<u32>; FOLDS],
    /// Whether they have the vertices of these the other way around.
    turned: Lanes<[bool; FOLDS]>,
    /// What they make of these: [`cloth_core::fabric::CurvatureStiffness::rooted`].
    map: [[Lanes<T>; FOLDS]; 3],
    /// Rayleigh damping \[s\].
    damping: Lanes<T>,
    /// Patch, place and first place of each vertex that comes again.
    again: Vec<[usize; 3]>,
}

/// What a patch adds to the matrix: the sum of three products of a vector and itself, whose parts stand here for each particle \[kg^(1/2)\]. The fourth
/// numbers are zero, and so are those of a vertex that comes again: they are with the first ones.
pub(super) type PatchTangent<T> = [[[T; 4]; 3]; PATCH];

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
        let folds: Vec<_> = elements.turned_folds().collect();
        let (count, none) = (triangles.len(), elements.folds().len() as u32);
        let packet = |first: usize| {
            let number = |lane: usize| (first + lane).min(count - 1);
            let fold = |lane: usize, k: usize| match folds[number(lane)][k] {
                NONE => none,
                fold => fold & !TURNED,
            };
            let maps: Lanes<[[T; FOLDS]; 3]> =
                std::array::from_fn(|lane| triangles[number(lane)].bending.rooted());
            let fabric = |lane: usize| &elements.fabrics()[triangles[number(lane)].fabric as usize];
            let again = (0..LANES).flat_map(|lane| {
                let marked = bending::marked(&elements.patches()[number(lane)]);
                let again = marked.into_iter().enumerate().filter(|(_, at)| at & COMES_AGAIN != 0);
                again.map(move |(place, at)| [lane, place, (at & !COMES_AGAIN) as usize])
            });
            Packet {
                again: again.collect(),
                folds: std::array::from_fn(|k| std::array::from_fn(|lane| fold(lane, k))),
                turned: std::array::from_fn(|lane| {
                    folds[number(lane)].map(|fold| fold != NONE && fold & TURNED != 0)
                }),
                map: std::array::from_fn(|row| {
                    std::array::from_fn(|k| std::array::from_fn(|lane| maps[lane][row][k]))
                }),
                damping: std::array::from_fn(|lane| T::from_f64(fabric(lane).damping[1])),
            }
        };
        Self {
            packets: (0..count).step_by(LANES).map(packet).collect(),
            moments: vec![[T::ZERO; FOLDS]; count],
            tangents: Vec::new(),
        }
    }

    /// What all patches ask of their folds.
    pub(super) fn moments(&self) -> &[T] {
        self.moments.as_flattened()
    }

    /// Computes that.
    pub(super) fn moments_find(&mut self, states: &[FoldState<T>], arch: pulp::Arch) {
        let bent = Bent { still: T::ONE, moving: [T::ONE, T::ZERO] };
        let all = self.packets.par_iter().zip(self.moments.par_chunks_mut(LANES));
        all.with_min_len(TASK).for_each(|(packet, moments)| {
            arch.dispatch(MomentTask { packet, bent: &bent, states, moments });
        });
    }

    /// Linearises all patches for a substep of `length` \[s\]; moments become those of its impulses \[N m s\].
    pub(super) fn linearise(
        &mut self,
        states: &[FoldState<T>],
        (length, start): (T, NewtonStart),
        arch: pulp::Arch,
    ) {
        let Self { packets, moments, tangents } = self;
        tangents.resize(moments.len(), [[[T::ZERO; 4]; 3]; PATCH]);
        let square = length * length;
        let ahead = if start == NewtonStart::StepStart { square } else { T::ZERO };
        let bent = Bent { still: length, moving: [length, ahead] };
        let all = packets.par_iter().zip(moments.par_chunks_mut(LANES));
        let all = all.zip(tangents.par_chunks_mut(LANES));
        all.with_min_len(TASK).for_each(|((packet, moments), tangents)| {
            arch.dispatch(MomentTask { packet, bent: &bent, states, moments });
            arch.dispatch(TangentTask { packet, length, states, tangents });
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

    pub(super) fn tangent(&self, patch: usize) -> &PatchTangent<T> {
        &self.tangents[patch]
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

/// The tangents of a packet, one after the other, compiled for each instruction set: their numbers stand in memory as they are summed.
struct TangentTask<'a, T> {
    packet: &'a Packet<T>,
    length: T,
    states: &'a [FoldState<T>],
    tangents: &'a mut [PatchTangent<T>],
}

impl<T: Real> NullaryFnOnce for TangentTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { packet, length, states, tangents } = self;
        for (lane, tangent) in tangents.iter_mut().enumerate() {
            *tangent = [[[T::ZERO; 4]; 3]; PATCH];
            let root = (length * length + length * packet.damping[lane]).sqrt();
            for (fold, turned) in packet.turned[lane].into_iter().enumerate() {
                let FoldState { apexes: [near, far], feet, .. } =
                    states[packet.folds[fold][lane] as usize];
                let gradient = hinge::gradient_of(near, far, feet);
                let shares: [T; 3] = std::array::from_fn(|row| root * packet.map[row][fold][lane]);
                let places = &PLACES[usize::from(turned)][fold];
                for ([x, y, z], &place) in gradient.into_iter().zip(places) {
                    let gradient = [x, y, z, T::ZERO];
                    for (sum, share) in tangent[place].iter_mut().zip(shares) {
                        for column in 0..4 {
                            sum[column] += gradient[column] * share;
                        }
                    }
                }
            }
        }
        for &[lane, place, first] in &packet.again {
            let Some(tangent) = tangents.get_mut(lane) else { continue };
            let again = std::mem::replace(&mut tangent[place], [[T::ZERO; 4]; 3]);
            for (sum, other) in
                tangent[first].as_flattened_mut().iter_mut().zip(again.as_flattened())
            {
                *sum += *other;
            }
        }
    }
}
