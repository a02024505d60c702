//! NUMERICS §12: each fold once, those of a packet side by side: how far it is folded, and the forces for what the patches ask of it.
//!
//! A fold is in the patches of up to six triangles. So it is looked at first, then what the patches make of all folds (`bending.rs`), then what all
//! patches ask of each fold.

use cloth_core::{FOLD_PLACES_MAX, FabricFold, Incidence, Model, NONE, Real, fabric::hinge};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use crate::memory::{FieldView, LANES, Lanes, Motion};

/// Packets in one task.
const TASK: usize = 16;

/// Positions and velocities.
type MotionView<'a, T> = [FieldView<'a, T>; 2];

/// All folds of a model, and what was last computed of them.
#[derive(Debug)]
pub(super) struct Folds<T> {
    packets: Vec<FoldPacket<T>>,
    states: Vec<FoldState<T>>,
    /// The places of the moments of each fold.
    places: Vec<[u32; FOLD_PLACES_MAX]>,
    forces: Vec<[[T; 3]; 4]>,
    /// What each fold is in the matrix: stiffness \[N m\] and damping \[N m s\].
    stiffness: Vec<[T; 2]>,
    tangents: Vec<FoldTangent<T>>,
    /// The vertices of folds that each particle is.
    pub(super) around: Incidence,
}

/// Folds at rest. In the last packet the last fold fills the places that are left.
#[derive(Debug)]
struct FoldPacket<T> {
    particles: [Lanes<u32>; 4],
    angles: Lanes<T>,
}

/// A fold at one time.
#[derive(Clone, Copy, Debug)]
pub(super) struct FoldState<T> {
    /// How far it is folded beyond rest \[rad\], and how fast \[rad/s\].
    pub(super) difference: T,
    pub(super) rate: T,
    /// Its derivatives by the third vertices of both triangles \[1/m\], and the feet of their heights: [`hinge::gradient_of`].
    pub(super) apexes: [[T; 3]; 2],
    pub(super) feet: [T; 2],
}

/// What a fold adds to the matrix: the product of a vector and itself, whose parts stand here for each vertex \[kg^(1/2)\]. The fourth numbers are zero.
pub(super) type FoldTangent<T> = [[T; 4]; 4];

impl<T: Real> FoldState<T> {
    const NONE: Self =
        Self { difference: T::ZERO, rate: T::ZERO, apexes: [[T::ZERO; 3]; 2], feet: [T::ZERO; 2] };
}

impl<T: Real> Folds<T> {
    pub(super) fn new(model: &Model) -> Self {
        let elements = model.elements();
        let folds = elements.folds();
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
        Self {
            packets: (0..count).step_by(LANES).map(packet).collect(),
            states: vec![FoldState::NONE; count + 1],
            places: elements.fold_places(),
            forces: vec![[[T::ZERO; 3]; 4]; count],
            stiffness: folds.iter().map(|f| [f.stiffness, f.damping].map(T::from_f64)).collect(),
            tangents: Vec::new(),
            around: Incidence::of(&vertices, model.particle_count()),
        }
    }

    /// Looks at all folds in this motion.
    pub(super) fn look(&mut self, motion: &Motion<T>, arch: pulp::Arch) {
        Self::look_at(&self.packets, &mut self.states, motion, arch);
    }

    fn look_at(
        packets: &[FoldPacket<T>],
        states: &mut [FoldState<T>],
        motion: &Motion<T>,
        arch: pulp::Arch,
    ) {
        let motion = [FieldView::new(&motion.position), FieldView::new(&motion.velocity)];
        // Behind the last one is that of folds that are not there.
        let count = states.len() - 1;
        let all = packets.par_iter().zip(states[..count].par_chunks_mut(LANES));
        all.with_min_len(TASK).for_each(|(packet, states)| {
            arch.dispatch(StateTask { packet, motion, states });
        });
    }

    /// All folds as they were last looked at; behind the last one, that of folds that are not there.
    pub(super) fn states(&self) -> &[FoldState<T>] {
        &self.states
    }

    /// All folds in another motion.
    pub(super) fn states_in(&self, motion: &Motion<T>, arch: pulp::Arch) -> Vec<FoldState<T>> {
        let mut states = vec![FoldState::NONE; self.states.len()];
        Self::look_at(&self.packets, &mut states, motion, arch);
        states
    }

    /// Computes the forces of all folds, as they were last looked at, for the moments that all patches ask of theirs.
    pub(super) fn push(&mut self, moments: &[T]) {
        let all = self.forces.par_iter_mut().zip(&self.states).zip(&self.places);
        all.with_min_len(TASK * LANES).for_each(|((forces, state), places)| {
            let mut sum = T::ZERO;
            for &place in places.iter().take_while(|&&place| place != NONE) {
                sum += moments[place as usize];
            }
            let gradient = hinge::gradient_of(state.apexes[0], state.apexes[1], state.feet);
            *forces = gradient.map(|gradient| gradient.map(|entry| entry * -sum));
        });
    }

    /// Linearises all folds, as they were last looked at, for a substep of `length` \[s\].
    pub(super) fn linearise(&mut self, length: T) {
        let Self { tangents, states, stiffness, .. } = self;
        let all = states.par_iter().zip(&*stiffness).with_min_len(TASK * LANES);
        let tangent = |(state, &stiffness): (&FoldState<T>, &[T; 2])| {
            let root = FabricFold::weight(stiffness, length).sqrt();
            let gradient = hinge::gradient_of(state.apexes[0], state.apexes[1], state.feet);
            gradient.map(|[x, y, z]| [root * x, root * y, root * z, T::ZERO])
        };
        all.map(tangent).collect_into_vec(tangents);
    }

    pub(super) fn tangent(&self, fold: usize) -> &FoldTangent<T> {
        &self.tangents[fold]
    }

    /// Forces on the vertices of each fold.
    pub(super) fn forces_of_all(&self) -> &[[T; 3]] {
        self.forces.as_flattened()
    }
}

/// How the folds of a packet are, compiled for each instruction set.
struct StateTask<'a, T> {
    packet: &'a FoldPacket<T>,
    motion: MotionView<'a, T>,
    states: &'a mut [FoldState<T>],
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
        let (mut gradients, mut feet) = ([zero; 4], [[T::ZERO; LANES]; 2]);
        for lane in 0..LANES {
            let [a, b, c, d] = &x;
            let fold = hinge::fold([
                [a[0][lane], a[1][lane], a[2][lane]],
                [b[0][lane], b[1][lane], b[2][lane]],
                [c[0][lane], c[1][lane], c[2][lane]],
                [d[0][lane], d[1][lane], d[2][lane]],
            ]);
            differences[lane] = hinge::difference_of_angles(fold.angle, packet.angles[lane]);
            for vertex in 0..4 {
                for axis in 0..3 {
                    gradients[vertex][axis][lane] = fold.gradient[vertex][axis];
                }
            }
            feet[0][lane] = fold.feet[0];
            feet[1][lane] = fold.feet[1];
        }
        for (vertex, ([gx, gy, gz], [vx, vy, vz])) in gradients.iter().zip(&v).enumerate() {
            for lane in 0..LANES {
                let rate = gx[lane] * vx[lane] + gy[lane] * vy[lane] + gz[lane] * vz[lane];
                rates[lane] = if vertex == 0 { rate } else { rates[lane] + rate };
            }
        }
        for (lane, state) in states.iter_mut().enumerate() {
            *state = FoldState {
                difference: differences[lane],
                rate: rates[lane],
                apexes: [&gradients[2], &gradients[3]].map(|side| {
                    let [x, y, z] = side;
                    [x[lane], y[lane], z[lane]]
                }),
                feet: feet.each_ref().map(|foot| foot[lane]),
            };
        }
    }
}
