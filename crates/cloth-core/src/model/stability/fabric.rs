//! The part of triangles of fabric in h^2 K + 2 h C (NUMERICS §4, §11, §12).

use rayon::prelude::*;

use super::super::fabric_matrix::FabricMatrix;
use crate::{
    FabricElements, FabricTriangle, Model,
    fabric::{
        bending::{BendingRest, Folds, PATCH},
        membrane::{self, Law, Tangent},
    },
};

/// Rows in a task.
const ROWS: usize = 2048;

/// A matrix with one number for each pair of particles that no state of the fabric exceeds, up to a strain. Many products with it follow, so that
/// what all triangles give is added once.
pub(super) struct AnyFabric {
    matrix: FabricMatrix,
    /// Numbers of particles for themselves, then of entries, for one h.
    weights: [Vec<f64>; 2],
    length: f64,
}

impl AnyFabric {
    pub(super) fn new(model: &Model) -> Self {
        let matrix = FabricMatrix::at_most(model);
        let weights = [vec![0.0; matrix.own().len()], vec![0.0; matrix.entries().len()]];
        Self { matrix, weights, length: f64::NAN }
    }

    /// y += (h^2 K + 2 h C) x.
    pub(super) fn add(&mut self, h: f64, x: &[f64], y: &mut [f64]) {
        let Self { matrix, weights, length } = self;
        if *length != h {
            *length = h;
            for (weights, pairs) in weights.iter_mut().zip([matrix.own(), matrix.entries()]) {
                weights.iter_mut().zip(pairs).for_each(|(weight, pair)| *weight = pair.at(h));
            }
        }
        let [own, entries] = &*weights;
        y.par_iter_mut().enumerate().with_min_len(ROWS).for_each(|(i, y)| {
            let row = matrix.neighbours().row(i).iter().zip(&entries[matrix.row(i)]);
            *y += own[i] * x[i] + row.map(|(&j, weight)| weight * x[j as usize]).sum::<f64>();
        });
    }
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
