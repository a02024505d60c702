//! NUMERICS §12: the patches around triangles that resist curvature, those of a packet side by side: their energies, and what they add to the matrix.

use cloth_core::{
    Model, NewtonStart, Real,
    fabric::{
        FOLDS,
        bending::{FOLD_PLACES, PATCH},
        hinge,
    },
};
use pulp::NullaryFnOnce;
use rayon::prelude::*;

use crate::memory::{FieldView, LANES, Lanes, Motion};

/// Packets in one task.
const TASK: usize = 16;

/// A vector of each patch of a packet.
pub(super) type LaneVector<T> = [Lanes<T>; 3];

/// All patches of a model, and what was last computed of them.
#[derive(Debug)]
pub(super) struct Patches<T> {
    packets: Vec<Packet<T>>,
    plates: Vec<Plate<T>>,
    tangents: Vec<PatchTangent<T>>,
    count: usize,
}

/// What patches are at rest. In the last packet the last patch fills the places that are left.
#[derive(Debug)]
struct Packet<T> {
    particles: [Lanes<u32>; PATCH],
    /// The place of each particle if these ascend.
    ranks: [Lanes<u8>; PATCH],
    angles: [Lanes<T>; FOLDS],
}

/// What the patches of a packet make of their folds.
#[derive(Debug)]
pub(super) struct Plate<T> {
    map: [[Lanes<T>; FOLDS]; 3],
    rigidity: [Lanes<T>; 4],
    pub(super) damping: Lanes<T>,
}

/// What a patch adds to the matrix and to the right-hand side, its particles ascending: then the blocks of a row are one behind the other.
#[derive(Clone, Debug)]
pub(super) struct PatchTangent<T> {
    /// Derivatives of the three curvatures by the particles \[1/m^2\]. The fourth numbers are zero.
    pub(super) gradients: [[[T; 4]; PATCH]; 3],
    /// (h^2 + h beta) A D: 11, 22, 12, 66.
    pub(super) plate: [T; 4],
    /// What it adds to the right-hand side \[N s\].
    pub(super) impulses: [[T; 3]; PATCH],
}

impl<T: Real> PatchTangent<T> {
    const ZERO: Self = Self {
        gradients: [[[T::ZERO; 4]; PATCH]; 3],
        plate: [T::ZERO; 4],
        impulses: [[T::ZERO; 3]; PATCH],
    };
}

/// The places of a patch with its particles ascending, of equal ones in their order.
pub(super) fn ascending(patch: &[u32; PATCH]) -> [usize; PATCH] {
    let mut order: [usize; PATCH] = std::array::from_fn(|place| place);
    order.sort_by_key(|&place| patch[place]);
    order
}

impl<T: Real> Patches<T> {
    pub(super) fn new(model: &Model) -> Self {
        let elements = model.elements();
        let (triangles, patches) = (elements.triangles(), elements.patches());
        let packet = |first: usize| {
            let patch = |lane: usize| &patches[(first + lane).min(patches.len() - 1)];
            let triangle = |lane: usize| &triangles[(first + lane).min(patches.len() - 1)];
            let mut ranks = [[0; LANES]; PATCH];
            for lane in 0..LANES {
                for (rank, place) in ascending(patch(lane)).into_iter().enumerate() {
                    ranks[place][lane] = rank as u8;
                }
            }
            Packet {
                particles: std::array::from_fn(|k| std::array::from_fn(|lane| patch(lane)[k])),
                ranks,
                angles: std::array::from_fn(|fold| {
                    std::array::from_fn(|lane| T::from_f64(triangle(lane).angles[fold]))
                }),
            }
        };
        Self {
            packets: (0..patches.len()).step_by(LANES).map(packet).collect(),
            plates: (0..patches.len()).step_by(LANES).map(|at| Plate::new(model, at)).collect(),
            tangents: Vec::new(),
            count: patches.len(),
        }
    }

    /// Linearises all folds for a substep of `length` \[s\].
    pub(super) fn linearise(
        &mut self,
        motion: &Motion<T>,
        (length, start): (T, NewtonStart),
        arch: pulp::Arch,
    ) {
        self.tangents.resize(self.count, PatchTangent::ZERO);
        let packets = self.packets.par_iter().zip(&self.plates);
        let all = packets.zip(self.tangents.par_chunks_mut(LANES));
        all.with_min_len(TASK).for_each(|(packet, tangents)| {
            let from_start = start == NewtonStart::StepStart;
            let motion = view(motion);
            arch.dispatch(LineariseTask { packet, motion, length, from_start, tangents });
        });
    }

    /// Energy of each patch \[J\].
    pub(super) fn energies(&self, motion: &Motion<T>, arch: pulp::Arch) -> Vec<T> {
        let of_packet = |packet| arch.dispatch(EnergyTask { packet, motion: view(motion) });
        let mut energies: Vec<Lanes<T>> = Vec::new();
        let packets = self.packets.par_iter().zip(&self.plates);
        let all = packets.with_min_len(TASK).map(of_packet);
        all.collect_into_vec(&mut energies);
        let mut energies = energies.into_flattened();
        energies.truncate(self.count);
        energies
    }

    /// What the packets of patches make of their folds.
    pub(super) fn plates(&self) -> &[Plate<T>] {
        &self.plates
    }

    pub(super) fn tangent(&self, patch: usize) -> &PatchTangent<T> {
        &self.tangents[patch]
    }
}

/// Positions and velocities.
pub(super) type MotionView<'a, T> = [FieldView<'a, T>; 2];

pub(super) fn view<T: Real>(motion: &Motion<T>) -> MotionView<'_, T> {
    [FieldView::new(&motion.position), FieldView::new(&motion.velocity)]
}

/// The folds of a packet at one time.
struct LaneFolds<T> {
    /// Folds beyond those at rest \[rad\].
    differences: [Lanes<T>; FOLDS],
    /// Rates of the folds \[rad/s\].
    rates: [Lanes<T>; FOLDS],
    /// Derivatives of each by its four vertices \[1/m\].
    gradients: [[LaneVector<T>; 4]; FOLDS],
}

impl<T: Real> Packet<T> {
    #[inline(always)]
    fn folds(&self, [position, velocity]: MotionView<'_, T>) -> LaneFolds<T> {
        let zero = [[T::ZERO; LANES]; 3];
        let (mut x, mut v) = ([zero; PATCH], [zero; PATCH]);
        for place in 0..PATCH {
            x[place] = position.gather(&self.particles[place]);
            v[place] = velocity.gather(&self.particles[place]);
        }
        let mut folds = LaneFolds {
            differences: [[T::ZERO; LANES]; FOLDS],
            rates: [[T::ZERO; LANES]; FOLDS],
            gradients: [[zero; 4]; FOLDS],
        };
        for (fold, places) in FOLD_PLACES.iter().enumerate() {
            let [a, b, c, d] = [&x[places[0]], &x[places[1]], &x[places[2]], &x[places[3]]];
            let gradients = &mut folds.gradients[fold];
            let differences = &mut folds.differences[fold];
            for lane in 0..LANES {
                let fold_of_lane = hinge::fold([
                    [a[0][lane], a[1][lane], a[2][lane]],
                    [b[0][lane], b[1][lane], b[2][lane]],
                    [c[0][lane], c[1][lane], c[2][lane]],
                    [d[0][lane], d[1][lane], d[2][lane]],
                ]);
                let angle = self.angles[fold][lane];
                differences[lane] = hinge::difference_of_angles(fold_of_lane.angle, angle);
                for vertex in 0..4 {
                    for axis in 0..3 {
                        gradients[vertex][axis][lane] = fold_of_lane.gradient[vertex][axis];
                    }
                }
            }
            let rates = &mut folds.rates[fold];
            for (vertex, &place) in places.iter().enumerate() {
                let ([gx, gy, gz], [vx, vy, vz]) = (&gradients[vertex], &v[place]);
                for lane in 0..LANES {
                    let rate = gx[lane] * vx[lane] + gy[lane] * vy[lane] + gz[lane] * vz[lane];
                    rates[lane] = if vertex == 0 { rate } else { rates[lane] + rate };
                }
            }
        }
        folds
    }
}

impl<T: Real> Plate<T> {
    /// Of the patches from `first` on.
    pub(super) fn new(model: &Model, first: usize) -> Self {
        let elements = model.elements();
        let triangles = elements.triangles();
        let triangle = |lane: usize| &triangles[(first + lane).min(triangles.len() - 1)];
        let lanes = |of: &dyn Fn(usize) -> f64| std::array::from_fn(|lane| T::from_f64(of(lane)));
        let fabric = |lane: usize| &elements.fabrics()[triangle(lane).fabric as usize];
        Self {
            map: std::array::from_fn(|row| {
                let of = |fold, lane| triangle(lane).bending.map[row][fold];
                std::array::from_fn(|fold| lanes(&|lane| of(fold, lane)))
            }),
            rigidity: std::array::from_fn(|k| lanes(&|lane| triangle(lane).bending.plate[k])),
            damping: lanes(&|lane| fabric(lane).damping[1]),
        }
    }

    /// Curvatures \[1/m\] for the differences of folds from rest \[rad\].
    #[inline(always)]
    fn curvature(&self, bent: &[Lanes<T>; FOLDS]) -> [Lanes<T>; 3] {
        let mut curvature = [[T::ZERO; LANES]; 3];
        for (row, sum) in curvature.iter_mut().enumerate() {
            for (fold, bent) in bent.iter().enumerate() {
                let share = &self.map[row][fold];
                for lane in 0..LANES {
                    let product = share[lane] * bent[lane];
                    sum[lane] = if fold == 0 { product } else { sum[lane] + product };
                }
            }
        }
        curvature
    }

    /// Moments of a curvature, times the area \[N m^2\].
    #[inline(always)]
    fn stress(&self, [a, b, c]: &[Lanes<T>; 3], lane: usize) -> [T; 3] {
        let [d11, d22, d12, d66] = &self.rigidity;
        [
            d11[lane] * a[lane] + d12[lane] * b[lane],
            d12[lane] * a[lane] + d22[lane] * b[lane],
            d66[lane] * c[lane],
        ]
    }

    /// Moments of the folds \[N m\] for their differences from rest \[rad\].
    #[inline(always)]
    pub(super) fn moments(&self, bent: &[Lanes<T>; FOLDS]) -> [Lanes<T>; FOLDS] {
        let curvature = self.curvature(bent);
        let mut moments = [[T::ZERO; LANES]; FOLDS];
        for lane in 0..LANES {
            let stress = self.stress(&curvature, lane);
            for fold in 0..FOLDS {
                moments[fold][lane] = self.map[0][fold][lane] * stress[0]
                    + self.map[1][fold][lane] * stress[1]
                    + self.map[2][fold][lane] * stress[2];
            }
        }
        moments
    }
}

impl<T: Real> LaneFolds<T> {
    /// For each vertex of the patch the sum of its derivatives, each times the share of its fold.
    #[inline(always)]
    fn sums(&self, shares: &[Lanes<T>; FOLDS], sign: T) -> [LaneVector<T>; PATCH] {
        let mut sums = [[[T::ZERO; LANES]; 3]; PATCH];
        for (fold, places) in FOLD_PLACES.iter().enumerate() {
            let share = &shares[fold];
            for (vertex, &place) in places.iter().enumerate() {
                for axis in 0..3 {
                    let (sum, gradient) =
                        (&mut sums[place][axis], &self.gradients[fold][vertex][axis]);
                    for lane in 0..LANES {
                        sum[lane] += gradient[lane] * (sign * share[lane]);
                    }
                }
            }
        }
        sums
    }
}

/// Energies of a packet, compiled for each instruction set.
struct EnergyTask<'a, T> {
    packet: (&'a Packet<T>, &'a Plate<T>),
    motion: MotionView<'a, T>,
}

impl<T: Real> NullaryFnOnce for EnergyTask<'_, T> {
    type Output = Lanes<T>;

    #[inline(always)]
    fn call(self) -> Lanes<T> {
        let (packet, plate) = self.packet;
        let k = plate.curvature(&packet.folds(self.motion).differences);
        let mut energies = [T::ZERO; LANES];
        for lane in 0..LANES {
            let m = plate.stress(&k, lane);
            let twice = m[0] * k[0][lane] + m[1] * k[1][lane] + m[2] * k[2][lane];
            energies[lane] = T::from_f64(0.5) * twice;
        }
        energies
    }
}

/// `bending_linearise` of a packet, compiled for each instruction set.
struct LineariseTask<'a, T> {
    packet: (&'a Packet<T>, &'a Plate<T>),
    motion: MotionView<'a, T>,
    length: T,
    from_start: bool,
    tangents: &'a mut [PatchTangent<T>],
}

impl<T: Real> NullaryFnOnce for LineariseTask<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { packet: (packet, plate), motion, length, from_start, tangents } = self;
        let folds = packet.folds(motion);
        let mut bent = [[T::ZERO; LANES]; FOLDS];
        let mut weight = [T::ZERO; LANES];
        for lane in 0..LANES {
            let damped = length * plate.damping[lane];
            weight[lane] = length * length + damped;
            let along = if from_start { weight[lane] } else { damped };
            for fold in 0..FOLDS {
                bent[fold][lane] =
                    length * folds.differences[fold][lane] + along * folds.rates[fold][lane];
            }
        }
        let impulses = folds.sums(&plate.moments(&bent), -T::ONE);
        let gradients = [0, 1, 2].map(|row| folds.sums(&plate.map[row], T::ONE));
        for (lane, tangent) in tangents.iter_mut().enumerate() {
            for (entry, rigidity) in tangent.plate.iter_mut().zip(&plate.rigidity) {
                *entry = weight[lane] * rigidity[lane];
            }
            for place in 0..PATCH {
                let rank = packet.ranks[place][lane] as usize;
                for axis in 0..3 {
                    for row in 0..3 {
                        tangent.gradients[row][rank][axis] = gradients[row][place][axis][lane];
                    }
                    tangent.impulses[rank][axis] = impulses[place][axis][lane];
                }
            }
        }
    }
}
