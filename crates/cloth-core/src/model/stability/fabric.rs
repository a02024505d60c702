//! The part of triangles of fabric in h^2 K + 2 h C (NUMERICS §4, §11, §12).

use super::operators::Pair;
use crate::{
    FabricElements, FabricTriangle,
    fabric::{
        FOLDS, Fabric,
        bending::{BendingRest, Folds, PATCH},
        membrane::{self, Law, Tangent},
    },
};

/// Green strain up to which a cloth may be stretched, where its measured curve goes farther.
const STRAIN_MAX: f64 = 0.2;

/// A matrix with one number for each pair of particles that no state of the fabric exceeds, up to a strain.
pub(super) struct AnyFabric<'a> {
    elements: &'a FabricElements,
    /// For each fabric what stretching along warp and weft meets at most, per area.
    threads: Vec<[Pair; 2]>,
}

impl<'a> AnyFabric<'a> {
    pub(super) fn new(elements: &'a FabricElements) -> Self {
        let threads = elements.fabrics().iter().map(threads).collect();
        Self { elements, threads }
    }

    /// y += (h^2 K + 2 h C) x.
    pub(super) fn add(&self, h: f64, x: &[f64], y: &mut [f64]) {
        let elements = self.elements.triangles().iter().zip(self.elements.patches());
        for (triangle, patch) in elements {
            let [u, v] = self.threads[triangle.fabric as usize].map(|pair| pair.at(h));
            let corners = membrane::corner_gradients(&triangle.rest);
            let at = patch.map(|particle| x[particle as usize]);
            let along = |axis: usize| (0..3).map(|k| corners[k][axis] * at[k]).sum::<f64>();
            let pull = [u * along(0), v * along(1)].map(|pull| triangle.rest.area * pull);
            for (corner, &particle) in corners.iter().zip(patch) {
                y[particle as usize] += corner[0] * pull[0] + corner[1] * pull[1];
            }
            let damping = self.elements.fabrics()[triangle.fabric as usize].damping[1];
            let weights = triangle.patch_weights();
            let fold = weights.map(|row| row.iter().zip(at).map(|(w, x)| w * x).sum::<f64>());
            let moments =
                triangle.bending.moments(fold).map(|moment| h * (h + 2.0 * damping) * moment);
            for (place, &particle) in patch.iter().enumerate() {
                let force: f64 = (0..FOLDS).map(|fold| weights[fold][place] * moments[fold]).sum();
                y[particle as usize] += force;
            }
        }
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
