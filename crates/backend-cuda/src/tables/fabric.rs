//! Triangles of fabric, as `shared/fabric.cuh` lays them out.

use bytemuck::{Pod, Zeroable};
use cloth_core::{
    Incidence, InteractionKind, Model,
    fabric::{FOLDS, bending::PATCH},
};

use crate::layout::CudaReal;

/// A triangle that stretches.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct MembraneData<T> {
    particles: [u32; 3],
    fabric: u32,
    inverse: [T; 4],
    area: T,
}

/// The same triangle with its folds.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct BendingData<T> {
    particles: [u32; PATCH],
    angles: [T; FOLDS],
    map: [[T; FOLDS]; 3],
    plate: [T; 4],
    damping: T,
}

// SAFETY: numbers alone, without padding in either precision (tested below).
unsafe impl<T: CudaReal> Zeroable for MembraneData<T> {}
// SAFETY: as above.
unsafe impl<T: CudaReal> Pod for MembraneData<T> {}
// SAFETY: as above.
unsafe impl<T: CudaReal> Zeroable for BendingData<T> {}
// SAFETY: as above.
unsafe impl<T: CudaReal> Pod for BendingData<T> {}

/// Numbers of a law: curves of warp and weft, coupling, shear, damping; how threads jam.
const LAW: usize = 12;

/// All triangles of a model.
#[derive(Debug)]
pub(crate) struct FabricTables<T> {
    pub(crate) laws: Vec<[T; LAW]>,
    pub(crate) membranes: Vec<MembraneData<T>>,
    pub(crate) patches: Vec<BendingData<T>>,
    /// Triangles, then patches, around each particle.
    pub(crate) rows: [Incidence; 2],
}

impl<T: CudaReal> FabricTables<T> {
    /// The tables of a model; empty without fabric.
    pub(crate) fn new(model: &Model) -> Self {
        let elements = model.elements();
        let law = |fabric: &cloth_core::fabric::Fabric| {
            let curve =
                |curve: cloth_core::fabric::TensileCurve| [curve.linear, curve.cubic, curve.end];
            let ([a, b, c], [d, e, f]) = (curve(fabric.warp), curve(fabric.weft));
            let cloth_core::fabric::Locking { onset, range, rise } = fabric.locking();
            let [coupling, shear, damping] = [fabric.coupling, fabric.shear, fabric.damping[0]];
            [a, b, c, d, e, f, coupling, shear, damping, onset, range, rise].map(T::from_f64)
        };
        let triangles = elements.triangles();
        let (interactions, count) = (model.interactions(), model.particle_count());
        let rows = |kind| {
            let list = interactions.list(kind);
            list.map_or_else(Incidence::default, |list| Incidence::new(list, count))
        };
        Self {
            laws: elements.fabrics().iter().map(law).collect(),
            membranes: triangles
                .iter()
                .map(|triangle| {
                    let rest = triangle.rest.rounded();
                    let [[a, b], [c, d]] = rest.inverse;
                    MembraneData {
                        particles: triangle.particles,
                        fabric: triangle.fabric,
                        inverse: [a, b, c, d],
                        area: rest.area,
                    }
                })
                .collect(),
            patches: triangles
                .iter()
                .zip(elements.patches())
                .map(|(triangle, &particles)| {
                    let stiffness = triangle.bending.rounded();
                    let damping = elements.fabrics()[triangle.fabric as usize].damping[1];
                    BendingData {
                        particles,
                        angles: triangle.angles.map(T::from_f64),
                        map: stiffness.map,
                        plate: stiffness.plate,
                        damping: T::from_f64(damping),
                    }
                })
                .collect(),
            rows: [rows(InteractionKind::Membrane), rows(InteractionKind::Bending)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_is_copied_has_padding() {
        assert_eq!(size_of::<MembraneData<f32>>(), 16 + 5 * 4);
        assert_eq!(size_of::<MembraneData<f64>>(), 16 + 5 * 8);
        assert_eq!(size_of::<BendingData<f32>>(), 48 + 41 * 4);
        assert_eq!(size_of::<BendingData<f64>>(), 48 + 41 * 8);
    }
}
