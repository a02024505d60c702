//! The part of triangles of fabric in h^2 K + 2 h C (NUMERICS §4, §11, §12).

use rayon::prelude::*;

use super::operators::Pair;
use crate::{
    FabricElements, FabricTriangle, Model, Neighbours,
    fabric::{
        FOLDS, Fabric,
        bending::{BendingRest, Folds, PATCH},
        membrane::{self, Law, Tangent},
    },
};

/// Green strain up to which a cloth may be stretched, where its measured curve goes farther.
const STRAIN_MAX: f64 = 0.2;

/// Rows in a task.
const ROWS: usize = 2048;

/// A matrix with one number for each pair of particles that no state of the fabric exceeds, up to a strain. Many products with it follow, so that
/// what all triangles give is added once.
pub(super) struct AnyFabric {
    neighbours: Neighbours,
    /// Entries of each particle for itself.
    own: Vec<Pair>,
    /// Those of rows, in the order of the neighbours, and where each row begins.
    entries: Vec<Pair>,
    starts: Vec<usize>,
    /// Both for one h.
    weights: [Vec<f64>; 2],
    length: f64,
}

impl AnyFabric {
    pub(super) fn new(model: &Model) -> Self {
        let elements = model.elements();
        let neighbours = Neighbours::new(&model.interactions().of_fabric());
        let count = model.particle_count();
        let mut starts = Vec::with_capacity(count + 1);
        starts.push(0);
        for i in 0..count {
            starts.push(starts[i] + neighbours.row(i).len());
        }
        let mut own = vec![Pair::default(); count];
        let mut entries = vec![Pair::default(); starts[count]];
        let threads: Vec<_> = elements.fabrics().iter().map(threads).collect();
        for (triangle, patch) in elements.triangles().iter().zip(elements.patches()) {
            let fabric = triangle.fabric as usize;
            let [u, v] = threads[fabric];
            let corners = membrane::corner_gradients(&triangle.rest);
            let damping = elements.fabrics()[fabric].damping[1];
            let weights = triangle.patch_weights();
            for (a, &row) in patch.iter().enumerate() {
                let moments = triangle.bending.moments(weights.map(|fold| fold[a]));
                for (b, &column) in patch.iter().enumerate() {
                    let bending: f64 =
                        (0..FOLDS).map(|fold| weights[fold][b] * moments[fold]).sum();
                    let mut sum = Pair { stiffness: bending, damping: damping * bending };
                    if a < 3 && b < 3 {
                        let share =
                            |axis: usize| triangle.rest.area * corners[a][axis] * corners[b][axis];
                        sum.stiffness += share(0) * u.stiffness + share(1) * v.stiffness;
                        sum.damping += share(0) * u.damping + share(1) * v.damping;
                    }
                    let entry = if row == column {
                        &mut own[row as usize]
                    } else {
                        // Where a patch has no neighbour, its weights are zero.
                        let Ok(place) = neighbours.row(row as usize).binary_search(&column) else {
                            continue;
                        };
                        &mut entries[starts[row as usize] + place]
                    };
                    entry.stiffness += sum.stiffness;
                    entry.damping += sum.damping;
                }
            }
        }
        let weights = [vec![0.0; own.len()], vec![0.0; entries.len()]];
        Self { neighbours, own, entries, starts, weights, length: f64::NAN }
    }

    /// y += (h^2 K + 2 h C) x.
    pub(super) fn add(&mut self, h: f64, x: &[f64], y: &mut [f64]) {
        let Self { neighbours, own, entries, starts, weights, length } = self;
        if *length != h {
            *length = h;
            for (weights, pairs) in weights.iter_mut().zip([&*own, &*entries]) {
                weights.iter_mut().zip(pairs).for_each(|(weight, pair)| *weight = pair.at(h));
            }
        }
        let [own, entries] = &*weights;
        y.par_iter_mut().enumerate().with_min_len(ROWS).for_each(|(i, y)| {
            let row = neighbours.row(i).iter().zip(&entries[starts[i]..starts[i + 1]]);
            *y += own[i] * x[i] + row.map(|(&j, weight)| weight * x[j as usize]).sum::<f64>();
        });
    }
}

/// Bounds of the second derivative of the energy by f_u and f_v: with |f|^2 at most 1 + 2 E, 2 a b at most a^2 + b^2 for the terms that have
/// both, and stresses at E.
fn threads(fabric: &Fabric) -> [Pair; 2] {
    let strain = fabric.warp.end.max(fabric.weft.end).min(STRAIN_MAX);
    let square = 1.0 + 2.0 * strain;
    // Threads that jam by stretching, and by shear, of which half counts as much as G.
    let jammed = fabric.locking().steepest();
    [fabric.warp, fabric.weft].map(|curve| {
        let steepest = curve.linear + 3.0 * curve.cubic * curve.end.min(strain).powi(2);
        let all = steepest + fabric.coupling.abs() + 2.0 * fabric.shear + 2.0 * jammed;
        let elastic = square * all;
        let stress = all * strain;
        Pair { stiffness: elastic + stress, damping: fabric.damping[0] * elastic }
    })
}

/// The matrix in the shape at the start.
pub(super) struct FabricAtStart<'a> {
    elements: &'a FabricElements,
    triangles: Vec<AtStart>,
}

struct AtStart {
    tangent: Tangent<f64>,
    folds: Folds<f64>,
    damping: [f64; 2],
}

impl<'a> FabricAtStart<'a> {
    pub(super) fn new(elements: &'a FabricElements, positions: &[[f64; 3]]) -> Self {
        let at_start = |(triangle, patch): (&FabricTriangle, &[u32; PATCH])| {
            let fabric = &elements.fabrics()[triangle.fabric as usize];
            // Fabrics of a model are valid.
            let law = Law::new(fabric, "").ok()?;
            let patch = patch.map(|particle| positions[particle as usize]);
            let gradient = membrane::deformation([patch[0], patch[1], patch[2]], &triangle.rest);
            let response = law.response(membrane::strain(gradient));
            let rest = BendingRest {
                angles: triangle.angles,
                stiffness: triangle.bending,
                damping: fabric.damping[1],
            };
            Some(AtStart {
                tangent: Tangent::new(gradient, &law, &response, &triangle.rest),
                folds: Folds::new(patch, &rest),
                damping: fabric.damping,
            })
        };
        let all = elements.triangles().iter().zip(elements.patches());
        Self { elements, triangles: all.filter_map(at_start).collect() }
    }

    /// Adds (h^2 K + 2 h C) x by `add`, which takes a particle and a vector.
    pub(super) fn add(
        &self,
        h: f64,
        x: impl Fn(u32) -> [f64; 3],
        mut add: impl FnMut(u32, [f64; 3]),
    ) {
        let elements = self.elements.triangles().iter().zip(self.elements.patches());
        for ((triangle, patch), AtStart { tangent, folds, damping }) in
            elements.zip(&self.triangles)
        {
            let at = patch.map(&x);
            let mut tangent = *tangent;
            tangent.stiffness = tangent.stiffness.map(|k| h * (h + 2.0 * damping[0]) * k);
            tangent.stress = tangent.stress.map(|s| h * h * s);
            for (a, &particle) in patch[..3].iter().enumerate() {
                let mut sum = [0.0; 3];
                for (b, x) in at[..3].iter().enumerate() {
                    for (sum, row) in sum.iter_mut().zip(tangent.block(a, b)) {
                        *sum += row[0] * x[0] + row[1] * x[1] + row[2] * x[2];
                    }
                }
                add(particle, sum);
            }
            let moments = triangle.bending.moments(folds.rates(at));
            let forces = folds.forces(moments.map(|m| -h * (h + 2.0 * damping[1]) * m));
            patch.iter().zip(forces).for_each(|(&particle, force)| add(particle, force));
        }
    }
}
