//! Triangles of fabric, in the form of `shared/fabric.wgsl`, `shared/fabric_gather.wgsl` and `shared/fold_tables.wgsl`.

use cloth_core::{
    FOLD_PLACES_MAX, FabricTriangle, Incidence, InteractionKind, Model, NONE, fabric::FOLDS,
};

/// Entries of `fabric_elements` for a triangle: three, and one for each fold.
const ELEMENT_WORDS: usize = 3 + FOLDS;

/// Contents of the buffers of fabric; empty without any.
#[derive(Debug, Default)]
pub(crate) struct FabricTables {
    /// `fabric_elements`.
    pub(crate) elements: Vec<[[u32; 4]; ELEMENT_WORDS]>,
    /// `fabric_laws`.
    pub(crate) laws: Vec<[[f32; 4]; 3]>,
    /// `fabric_rows`.
    pub(crate) rows: Vec<u32>,
    /// `fold_tables`.
    pub(crate) folds: Vec<u32>,
}

impl FabricTables {
    pub(super) fn new(model: &Model) -> Self {
        let elements = model.elements();
        if elements.is_empty() {
            return Self::default();
        }
        let element = |triangle: &FabricTriangle| {
            let rest = triangle.rest.rounded::<f32>();
            let damping = elements.fabrics()[triangle.fabric as usize].damping[1] as f32;
            let [p, q, r] = triangle.bending.rooted::<f32>();
            let mut words = [[0; 4]; ELEMENT_WORDS];
            let [i, j, k] = triangle.particles;
            words[0] = [i, j, k, triangle.fabric];
            let [[a, b], [c, d]] = rest.inverse;
            words[1] = [a, b, c, d].map(f32::to_bits);
            words[2] = [rest.area, damping, 0.0, 0.0].map(f32::to_bits);
            for (fold, words) in words[3..].iter_mut().enumerate() {
                *words = [p[fold], q[fold], r[fold], 0.0].map(f32::to_bits);
            }
            words
        };
        let law = |fabric: &cloth_core::fabric::Fabric| {
            let curve = |curve: cloth_core::fabric::TensileCurve, more: f64| {
                [curve.linear, curve.cubic, curve.end, more].map(|number| number as f32)
            };
            let cloth_core::fabric::Locking { onset, range, rise } = fabric.locking();
            let damping = [fabric.damping[0], onset, range, rise].map(|number| number as f32);
            [curve(fabric.warp, fabric.coupling), curve(fabric.weft, fabric.shear), damping]
        };
        Self {
            elements: elements.triangles().iter().map(element).collect(),
            laws: elements.fabrics().iter().map(law).collect(),
            rows: rows(model),
            folds: folds(model),
        }
    }
}

/// Vertices, angles at rest, stiffness, damping and places of moments of folds, and the folds of patches.
fn folds(model: &Model) -> Vec<u32> {
    let elements = model.elements();
    let (folds, patches) = (elements.folds(), elements.patch_folds());
    let count = folds.len() as u32;
    let places = elements.fold_places();
    let first = 2 * (count + 1);
    let place = |place: u32| {
        let (triangles, arity) = (patches.len() as u32, FOLDS as u32);
        let none = place == NONE;
        first + if none { arity * triangles } else { place % arity * triangles + place / arity }
    };
    let mut words = Vec::new();
    for vertex in 0..4 {
        words.extend(folds.iter().map(|fold| fold.particles[vertex]));
    }
    let numbers = folds.iter().map(|fold| [fold.angle, fold.stiffness, fold.damping]);
    for k in 0..3 {
        words.extend(numbers.clone().map(|numbers| (numbers[k] as f32).to_bits()));
    }
    for k in 0..FOLD_PLACES_MAX {
        words.extend(places.iter().map(|places| place(places[k])));
    }
    for k in 0..FOLDS {
        words.extend(patches.iter().map(|patch| if patch[k] == NONE { count } else { patch[k] }));
    }
    words
}

/// Where the rows of every particle start among those of triangles and of folds; then the rows themselves.
fn rows(model: &Model) -> Vec<u32> {
    let count = model.particle_count();
    let interactions = model.interactions();
    let triangles = interactions.list(InteractionKind::Membrane);
    let triangles = triangles.map_or_else(Incidence::default, |list| Incidence::new(list, count));
    let vertices: Vec<_> = model.elements().folds().iter().map(|fold| fold.particles).collect();
    let folds = Incidence::of(&vertices, count);
    let corners = triangles.entries().len() as u32;
    let mut start = 2 * (count as u32 + 1);
    let mut rows = Vec::new();
    for list in [&triangles, &folds] {
        rows.extend(list.offsets().iter().map(|at| start + at));
        start += list.entries().len() as u32;
    }
    rows.extend(triangles.entries());
    // What stands at folds comes behind the corners.
    rows.extend(folds.entries().iter().map(|place| corners + place));
    rows
}
