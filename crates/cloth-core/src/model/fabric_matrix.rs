//! One number for each pair of particles that stands for the stiffness of fabric in all directions (NUMERICS §4, §6).

use super::{FabricFold, InteractionKind, Model, Neighbours, SlicedRows};
use crate::{
    Real,
    fabric::{FOLDS, Fabric, bending::PATCH, membrane},
};

/// Green strain up to which a cloth may be stretched, where its measured curve goes farther.
const STRAIN_MAX: f64 = 0.2;

/// A stiffness \[N/m\] and a damping \[N s/m\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ScalarEntry {
    /// Of K \[N/m\].
    pub stiffness: f64,
    /// Of C \[N s/m\].
    pub damping: f64,
}

impl ScalarEntry {
    /// Entry of h^2 K + h C \[kg\] for a substep of `h` \[s\].
    #[must_use]
    pub fn weight(self, h: f64) -> f64 {
        h * (h * self.stiffness + self.damping)
    }

    /// Entry of h^2 K + 2 h C \[kg\].
    pub(super) fn at(self, h: f64) -> f64 {
        h * (h * self.stiffness + 2.0 * self.damping)
    }
}

/// K and C of all triangles of fabric, the same in each direction of space: symmetric, without negative eigenvalues, and zero for
/// translations.
#[derive(Clone, Debug)]
pub struct FabricMatrix {
    neighbours: Neighbours,
    own: Vec<ScalarEntry>,
    entries: Vec<ScalarEntry>,
    starts: Vec<usize>,
}

impl FabricMatrix {
    /// The constant one of the semi-implicit integrator: the stiffness at rest, or half of what no shape exceeds if that is more.
    #[must_use]
    pub fn constant(model: &Model) -> Self {
        let threads = |fabric: &Fabric| {
            let [rest, any] = [threads_at_rest(fabric), threads_at_most(fabric)];
            [0, 1].map(|k| ScalarEntry {
                stiffness: rest[k].stiffness.max(0.5 * any[k].stiffness),
                damping: rest[k].damping.max(0.5 * any[k].damping),
            })
        };
        Self::new(model, Neighbours::new(&model.interactions().of_fabric()), threads, |matrix| {
            for fold in model.elements().folds() {
                let FabricFold { particles, stiffness, damping, weights, angle: _ } = *fold;
                matrix.add(particles, |a, b| {
                    let share = weights[a] * weights[b];
                    ScalarEntry { stiffness: share * stiffness, damping: share * damping }
                });
            }
        })
    }

    /// What no state of the fabric exceeds, up to a strain.
    pub(super) fn at_most(model: &Model) -> Self {
        let mut interactions = model.interactions();
        let kinds = [InteractionKind::Membrane, InteractionKind::Bending];
        interactions.retain(|kind| kinds.contains(&kind));
        Self::new(model, Neighbours::new(&interactions), threads_at_most, |matrix| {
            let elements = model.elements();
            for (triangle, patch) in elements.triangles().iter().zip(elements.patches()) {
                let damping = elements.fabrics()[triangle.fabric as usize].damping[1];
                let weights = triangle.patch_weights();
                let moments: [_; PATCH] =
                    std::array::from_fn(|a| triangle.bending.moments(weights.map(|fold| fold[a])));
                matrix.add(*patch, |a, b| {
                    let bending: f64 =
                        (0..FOLDS).map(|fold| weights[fold][b] * moments[a][fold]).sum();
                    ScalarEntry { stiffness: bending, damping: damping * bending }
                });
            }
        })
    }

    /// Adds up what all triangles give, with these bounds of the second derivative of the energy by f_u and f_v, and by `add_bending` what resists folds.
    fn new(
        model: &Model,
        neighbours: Neighbours,
        threads: impl Fn(&Fabric) -> [ScalarEntry; 2],
        add_bending: impl Fn(&mut Self),
    ) -> Self {
        let elements = model.elements();
        let count = model.particle_count();
        let mut starts = Vec::with_capacity(count + 1);
        starts.push(0);
        for i in 0..count {
            starts.push(starts[i] + neighbours.row(i).len());
        }
        let mut matrix = Self {
            own: vec![ScalarEntry::default(); count],
            entries: vec![ScalarEntry::default(); starts[count]],
            neighbours,
            starts,
        };
        let threads: Vec<_> = elements.fabrics().iter().map(threads).collect();
        for triangle in elements.triangles() {
            let [u, v] = threads[triangle.fabric as usize];
            let corners = membrane::corner_gradients(&triangle.rest);
            matrix.add(triangle.particles, |a, b| {
                let share = |axis: usize| triangle.rest.area * corners[a][axis] * corners[b][axis];
                ScalarEntry {
                    stiffness: share(0) * u.stiffness + share(1) * v.stiffness,
                    damping: share(0) * u.damping + share(1) * v.damping,
                }
            });
        }
        add_bending(&mut matrix);
        matrix
    }

    /// Adds what these particles give each other, by their places.
    fn add<const N: usize>(
        &mut self,
        particles: [u32; N],
        of: impl Fn(usize, usize) -> ScalarEntry,
    ) {
        for (a, &row) in particles.iter().enumerate() {
            for (b, &column) in particles.iter().enumerate() {
                let entry = if row == column {
                    &mut self.own[row as usize]
                } else {
                    // Where a patch has no neighbour, its weights are zero.
                    let columns = self.neighbours.row(row as usize);
                    let Ok(place) = columns.binary_search(&column) else { continue };
                    &mut self.entries[self.starts[row as usize] + place]
                };
                let ScalarEntry { stiffness, damping } = of(a, b);
                entry.stiffness += stiffness;
                entry.damping += damping;
            }
        }
    }

    /// Who is coupled: the columns of rows.
    #[must_use]
    pub const fn neighbours(&self) -> &Neighbours {
        &self.neighbours
    }

    /// Entries of each particle for itself.
    #[must_use]
    pub fn own(&self) -> &[ScalarEntry] {
        &self.own
    }

    /// The entries of all rows one after the other, in the order of the neighbours.
    #[must_use]
    pub fn entries(&self) -> &[ScalarEntry] {
        &self.entries
    }

    /// Where a row is among the entries.
    #[must_use]
    pub fn row(&self, i: usize) -> std::ops::Range<usize> {
        self.starts[i]..self.starts[i + 1]
    }

    /// The largest entry of h^2 K + h C \[kg\], which is on the diagonal.
    #[must_use]
    pub fn weight_max(&self, h: f64) -> f64 {
        self.own.iter().map(|own| own.weight(h)).fold(0.0, f64::max)
    }

    /// A number of each entry in the places of `rows`, which are those of the neighbours; zero where there is none.
    #[must_use]
    pub fn sliced<T: Real>(&self, rows: &SlicedRows, of: impl Fn(ScalarEntry) -> f64) -> Vec<T> {
        let mut numbers = vec![T::ZERO; rows.columns.len()];
        for i in 0..self.own.len() {
            for ((entry, _), &number) in rows.row(i).zip(&self.entries[self.row(i)]) {
                numbers[entry * SlicedRows::SLICE + i % SlicedRows::SLICE] =
                    T::from_f64(of(number));
            }
        }
        numbers
    }
}

/// Bounds at rest: |f| is 1, 2 a b at most a^2 + b^2 for the terms that have both, and there is no stress.
fn threads_at_rest(fabric: &Fabric) -> [ScalarEntry; 2] {
    [fabric.warp, fabric.weft].map(|curve| {
        let elastic = curve.linear + fabric.coupling.abs() + 2.0 * fabric.shear;
        ScalarEntry { stiffness: elastic, damping: fabric.damping[0] * elastic }
    })
}

/// Bounds in any shape: with |f|^2 at most 1 + 2 E, and stresses at E.
fn threads_at_most(fabric: &Fabric) -> [ScalarEntry; 2] {
    let strain = fabric.warp.end.max(fabric.weft.end).min(STRAIN_MAX);
    let square = 1.0 + 2.0 * strain;
    // Threads that jam by stretching, and by shear, of which half counts as much as G.
    let jammed = fabric.locking().steepest();
    [fabric.warp, fabric.weft].map(|curve| {
        let steepest = curve.linear + 3.0 * curve.cubic * curve.end.min(strain).powi(2);
        let all = steepest + fabric.coupling.abs() + 2.0 * fabric.shear + 2.0 * jammed;
        let elastic = square * all;
        let stress = all * strain;
        ScalarEntry { stiffness: elastic + stress, damping: fabric.damping[0] * elastic }
    })
}
