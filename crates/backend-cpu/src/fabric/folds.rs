//! NUMERICS §12, `bending_forces`: each fold once, those of a packet side by side.
//!
//! A fold is in the patches of up to six triangles. So it is looked at first, then what the patches make of all folds, then what all patches
//! ask of each fold.

use cloth_core::{
    FOLD_PLACES_MAX, Incidence, Model, NONE, Real,
    fabric::{FOLDS, hinge},
};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use super::bending::{LaneVector, MotionView, Plate, view};
use crate::memory::{LANES, Lanes, Motion};

/// Packets in one task.
const TASK: usize = 16;

/// All folds of a model, and what was last computed of them.
#[derive(Debug)]
pub(super) struct Folds<T> {
    packets: Vec<FoldPacket<T>>,
    patches: Vec<[Lanes<u32>; FOLDS]>,
    /// How far each is folded beyond rest \[rad\], and how fast \[rad/s\]; the last one is that of folds that are not there.
    states: Vec<[T; 2]>,
    /// What each patch asks of its folds \[N m\].
    moments: Vec<[T; FOLDS]>,
    /// The places of the moments of each fold.
    places: Vec<[u32; FOLD_PLACES_MAX]>,
    forces: Vec<[[T; 3]; 4]>,
    /// The vertices of folds that each particle is.
    around: Incidence,
}

/// Folds at rest. In the last packet the last fold fills the places that are left.
#[derive(Debug)]
struct FoldPacket<T> {
    particles: [Lanes<u32>; 4],
    angles: Lanes<T>,
}

impl<T: Real> Folds<T> {
    pub(super) fn new(model: &Model) -> Self {
        let elements = model.elements();
        let (folds, patches) = (elements.folds(), elements.patch_folds());
        let count = folds.len();
        let vertices: Vec<_> = folds.iter().map(|fold| fold.particles).collect();
        let packet = |first: usize| {
            let fold = |lane: usize| &folds[(first + lane).min(count - 1)];
            FoldPacket {
                particles: std::array::from_fn(|vertex| {
                    std::array::from_fn(|lane| fold(lane).particles[vertex])
                }),
                angles: std::array::from_fn(|lane| T::from_f64(fold(lane).angle)),
            }
        };
        let patch = |first: usize| -> [Lanes<u32>; FOLDS] {
            let patch = |lane: usize| patches[(first + lane).min(patches.len() - 1)];
            let place = |fold: u32| if fold == NONE { count as u32 } else { fold };
            std::array::from_fn(|k| std::array::from_fn(|lane| place(patch(lane)[k])))
        };
        Self {
            packets: (0..count).step_by(LANES).map(packet).collect(),
            patches: (0..patches.len()).step_by(LANES).map(patch).collect(),
            states: vec![[T::ZERO; 2]; count + 1],
            moments: vec![[T::ZERO; FOLDS]; patches.len()],
            places: elements.fold_places(),
            forces: vec![[[T::ZERO; 3]; 4]; count],
            around: Incidence::of(&vertices, model.particle_count()),
        }
    }

    /// Computes the forces of all folds, whose patches make this of them.
    pub(super) fn forces(&mut self, plates: &[Plate<T>], motion: &Motion<T>, arch: pulp::Arch) {
        let Self { packets, patches, states, moments, places, forces, .. } = self;
        let count = forces.len();
        let motion = view(motion);
        let all = packets.par_iter().zip(states[..count].par_chunks_mut(LANES));
        all.with_min_len(TASK).for_each(|(packet, states)| {
            arch.dispatch(StateTask { packet, motion, states });
        });
        let states = &**states;
        let all = patches.par_iter().zip(plates).zip(moments.par_chunks_mut(LANES));
        all.with_min_len(TASK).for_each(|((folds, plate), moments)| {
            arch.dispatch(MomentTask { folds, plate, states, moments });
        });
        let moments = moments.as_flattened();
        let all = packets.par_iter().zip(places.par_chunks(LANES));
        let all = all.zip(forces.par_chunks_mut(LANES));
        all.with_min_len(TASK).for_each(|((packet, places), forces)| {
            arch.dispatch(ForceTask { packet, motion, moments: (places, moments), forces });
        });
    }

    /// The places among [`Self::forces_of_all`] that are those of a particle.
    pub(super) fn around(&self, particle: usize) -> &[u32] {
        self.around.row(particle)
    }

    /// Forces on the vertices of each fold.
    pub(super) fn forces_of_all(&self) -> &[[T; 3]] {
        self.forces.as_flattened()
    }
}

impl<T: Real> FoldPacket<T> {
    /// The folds of a packet with these positions.
    #[inline(always)]
    fn of_lane(x: &[LaneVector<T>; 4], lane: usize) -> hinge::Fold<T> {
        let [a, b, c, d] = x;
        hinge::fold([
            [a[0][lane], a[1][lane], a[2][lane]],
            [b[0][lane], b[1][lane], b[2][lane]],
            [c[0][lane], c[1][lane], c[2][lane]],
            [d[0][lane], d[1][lane], d[2][lane]],
        ])
    }
}

/// How far the folds of a packet are folded, and how fast, compiled for each instruction set.
struct StateTask<'a, T> {
    packet: &'a FoldPacket<T>,
    motion: MotionView<'a, T>,
    states: &'a mut [[T; 2]],
}

impl<T: Real> NullaryFnOnce for StateTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { packet, motion: [position, velocity], states } = self;
        let zero = [[T::ZERO; LANES]; 3];
        let (mut x, mut v) = ([zero; 4], [zero; 4]);
        for vertex in 0..4 {
            x[vertex] = position.gather(&packet.particles[vertex]);
            v[vertex] = velocity.gather(&packet.particles[vertex]);
        }
        let (mut differences, mut rates) = ([T::ZERO; LANES], [T::ZERO; LANES]);
        for lane in 0..LANES {
            let fold = FoldPacket::of_lane(&x, lane);
            differences[lane] = hinge::difference_of_angles(fold.angle, packet.angles[lane]);
            for (vertex, v) in v.iter().enumerate() {
                let [gx, gy, gz] = fold.gradient[vertex];
                let rate = gx * v[0][lane] + gy * v[1][lane] + gz * v[2][lane];
                rates[lane] = if vertex == 0 { rate } else { rates[lane] + rate };
            }
        }
        for (lane, state) in states.iter_mut().enumerate() {
            *state = [differences[lane], rates[lane]];
        }
    }
}

/// What the patches of a packet ask of their folds, compiled for each instruction set.
struct MomentTask<'a, T> {
    folds: &'a [Lanes<u32>; FOLDS],
    plate: &'a Plate<T>,
    states: &'a [[T; 2]],
    moments: &'a mut [[T; FOLDS]],
}

impl<T: Real> NullaryFnOnce for MomentTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { folds, plate, states, moments } = self;
        let mut bent = [[T::ZERO; LANES]; FOLDS];
        for (bent, folds) in bent.iter_mut().zip(folds) {
            let mut rates = [T::ZERO; LANES];
            for lane in 0..LANES {
                [bent[lane], rates[lane]] = states[folds[lane] as usize];
            }
            for lane in 0..LANES {
                let damping = plate.damping[lane];
                if damping > T::ZERO {
                    bent[lane] += damping * rates[lane];
                }
            }
        }
        let of_folds = plate.moments(&bent);
        for (lane, moments) in moments.iter_mut().enumerate() {
            for (moment, of_fold) in moments.iter_mut().zip(&of_folds) {
                *moment = of_fold[lane];
            }
        }
    }
}

/// Forces of the folds of a packet, compiled for each instruction set.
struct ForceTask<'a, T> {
    packet: &'a FoldPacket<T>,
    motion: MotionView<'a, T>,
    /// Where the moments of each fold are, and all moments.
    moments: (&'a [[u32; FOLD_PLACES_MAX]], &'a [T]),
    forces: &'a mut [[[T; 3]; 4]],
}

impl<T: Real> NullaryFnOnce for ForceTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { packet, motion: [position, _], moments: (places, all), forces } = self;
        let mut sums = [T::ZERO; LANES];
        for (sum, places) in sums.iter_mut().zip(places) {
            for &place in places.iter().take_while(|&&place| place != NONE) {
                *sum += all[place as usize];
            }
        }
        let mut x = [[[T::ZERO; LANES]; 3]; 4];
        for vertex in 0..4 {
            x[vertex] = position.gather(&packet.particles[vertex]);
        }
        let mut out = [[[T::ZERO; LANES]; 3]; 4];
        for lane in 0..LANES {
            let fold = FoldPacket::of_lane(&x, lane);
            for vertex in 0..4 {
                for axis in 0..3 {
                    out[vertex][axis][lane] = fold.gradient[vertex][axis] * -sums[lane];
                }
            }
        }
        for (lane, forces) in forces.iter_mut().enumerate() {
            for (force, [x, y, z]) in forces.iter_mut().zip(&out) {
                *force = [x[lane], y[lane], z[lane]];
            }
        }
    }
}
