//! Triangles of fabric, as `shared/fabric.cuh` lays them out.

use bytemuck::{Pod, Zeroable};
use cloth_core::{
    FOLD_PLACES_MAX, FabricTriangle, Incidence, InteractionKind, Model, NONE, fabric::FOLDS,
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

/// Numbers of what a patch makes of its folds: its map, damping.
const PLATE: usize = 3 * FOLDS + 1;

// SAFETY: numbers alone, without padding in either precision (tested below).
unsafe impl<T: CudaReal> Zeroable for MembraneData<T> {}
// SAFETY: as above.
unsafe impl<T: CudaReal> Pod for MembraneData<T> {}

/// Numbers of a law: curves of warp and weft, coupling, shear, damping; how threads jam.
const LAW: usize = 12;

/// All triangles of a model.
#[derive(Debug)]
pub(crate) struct FabricTables<T> {
    pub(crate) laws: Vec<[T; LAW]>,
    pub(crate) membranes: Vec<MembraneData<T>>,
    /// For all patches the first of their [`PLATE`] numbers, then the second ones.
    pub(crate) plates: Vec<T>,
    /// Triangles around each particle.
    pub(crate) rows: Incidence,
    pub(crate) folds: FoldTables<T>,
}

/// All folds, each once.
#[derive(Debug)]
pub(crate) struct FoldTables<T> {
    pub(crate) particles: Vec<[u32; 4]>,
    pub(crate) angles: Vec<T>,
    /// For all patches the first of their folds, then the second ones; the number of folds where there is none.
    pub(crate) of_patches: Vec<u32>,
    /// For all folds the first of the places of their moments, which stand as `of_patches` do, then the second ones; that behind all moments where
    /// there is none.
    pub(crate) moment_places: Vec<u32>,
    /// Folds around each particle.
    pub(crate) rows: Incidence,
}

impl<T: CudaReal> FoldTables<T> {
    fn new(model: &Model) -> Self {
        let elements = model.elements();
        let (folds, patches) = (elements.folds(), elements.patch_folds());
        let particles: Vec<_> = folds.iter().map(|fold| fold.particles).collect();
        let places = elements.fold_places();
        let place = |place: u32| {
            let (patch, fold) = (place as usize / FOLDS, place as usize % FOLDS);
            let none = place == NONE;
            (if none { FOLDS * patches.len() } else { fold * patches.len() + patch }) as u32
        };
        let moment_places = (0..FOLD_PLACES_MAX).flat_map(|k| places.iter().map(move |of| of[k]));
        let none = folds.len() as u32;
        let of_patches = (0..FOLDS).flat_map(|k| patches.iter().map(move |patch| patch[k]));
        Self {
            angles: folds.iter().map(|fold| T::from_f64(fold.angle)).collect(),
            of_patches: of_patches.map(|fold| if fold == NONE { none } else { fold }).collect(),
            moment_places: moment_places.map(place).collect(),
            rows: Incidence::of(&particles, model.particle_count()),
            particles,
        }
    }
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
        let plate = |triangle: &FabricTriangle| -> [T; PLATE] {
            let damping = elements.fabrics()[triangle.fabric as usize].damping[1];
            let mut numbers = [T::from_f64(damping); PLATE];
            numbers[..3 * FOLDS].copy_from_slice(triangle.bending.rooted().as_flattened());
            numbers
        };
        let plates: Vec<_> = triangles.iter().map(plate).collect();
        let (interactions, count) = (model.interactions(), model.particle_count());
        let membranes = interactions.list(InteractionKind::Membrane);
        let rows = membranes.map_or_else(Incidence::default, |list| Incidence::new(list, count));
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
            plates: (0..PLATE).flat_map(|k| plates.iter().map(move |plate| plate[k])).collect(),
            folds: FoldTables::new(model),
            rows,
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
    }
}
