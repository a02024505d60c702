//! The triangles of the cloths that are made of fabric, in the composite model (NUMERICS §11, §12).

use rayon::prelude::*;

use crate::{
    NONE, PanelFabrics, Real,
    fabric::{
        CurvatureStiffness, FOLDS, Fabric, RestShape, RestTriangle,
        bending::{FOLD_PLACES, PATCH},
        membrane::RestState,
    },
};

/// Places of patches that one fold can have.
pub const FOLD_PLACES_MAX: usize = 6;

/// All triangles of fabric of a model. A cloth of springs has none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FabricElements {
    fabrics: Vec<Fabric>,
    triangles: Vec<FabricTriangle>,
    patches: Vec<[u32; PATCH]>,
    folds: Vec<FabricFold>,
    patch_folds: Vec<[u32; FOLDS]>,
    /// Edges of all triangles, sorted, the smaller particle first.
    edges: Vec<[u32; 2]>,
}

/// An edge between two triangles of fabric, about which they fold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FabricFold {
    /// Both ends of the edge and the third corners of both triangles, as [`hinge::fold`](crate::fabric::hinge::fold) takes them.
    pub particles: [u32; 4],
    /// Angle at rest \[rad\].
    pub angle: f64,
    /// What stands in the matrix for the stiffness of bending \[N m\] (NUMERICS §12).
    pub stiffness: f64,
    /// The same for damping \[N m s\].
    pub damping: f64,
    /// How much it changes by a motion of each particle out of the plane, of the flat fold \[1/m\].
    pub weights: [f64; 4],
}

impl FabricFold {
    /// h^2 k + h d \[kg m^2\], what its derivatives are multiplied by in the matrix of a substep of `h` \[s\].
    #[inline(always)]
    #[must_use]
    pub fn weight<T: Real>([stiffness, damping]: [T; 2], h: T) -> T {
        (h * h) * stiffness + h * damping
    }
}

/// One triangle of fabric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FabricTriangle {
    /// Its corners a, b, c as particles.
    pub particles: [u32; 3],
    /// Index of its fabric.
    pub fabric: u32,
    /// D_m^-1 and area.
    pub rest: RestState<f64>,
    /// Angles at rest \[rad\] of the folds of its patch; zero where there is none.
    pub angles: [f64; FOLDS],
    /// How it resists these folds.
    pub bending: CurvatureStiffness<f64>,
    /// How much each of these folds changes by a motion out of the plane, of the flat triangle \[1/m\]: at the edge's start and end in the
    /// direction of the triangle, at the third corner, and at the vertex beyond. Zero for a border.
    pub fold_weights: [[f64; 4]; FOLDS],
}

impl FabricTriangle {
    /// The same by the vertices of the patch.
    #[must_use]
    pub fn patch_weights(&self) -> [[f64; PATCH]; FOLDS] {
        let mut weights = [[0.0; PATCH]; FOLDS];
        for ((row, places), own) in weights.iter_mut().zip(FOLD_PLACES).zip(self.fold_weights) {
            places.into_iter().zip(own).for_each(|(place, weight)| row[place] = weight);
        }
        weights
    }
}

impl FabricElements {
    /// The fabrics: one for each cloth that is made of one, and behind it those of its panels.
    #[must_use]
    pub fn fabrics(&self) -> &[Fabric] {
        &self.fabrics
    }

    /// The triangles, in the order of the model's triangles.
    #[must_use]
    pub fn triangles(&self) -> &[FabricTriangle] {
        &self.triangles
    }

    /// For each triangle its corners a, b, c, the vertices opposite to its edges ab, bc, ca beyond them, and those beyond the other edges of these
    /// neighbours. Where there is none a corner stands there, whose fold has no stiffness.
    #[must_use]
    pub fn patches(&self) -> &[[u32; PATCH]] {
        &self.patches
    }

    /// The folds, one for each edge between two triangles.
    #[must_use]
    pub fn folds(&self) -> &[FabricFold] {
        &self.folds
    }

    /// For each triangle the folds that tell its curvature, in the order of its patch; [`NONE`] where there is none or it says nothing.
    #[must_use]
    pub fn patch_folds(&self) -> &[[u32; FOLDS]] {
        &self.patch_folds
    }

    /// For each fold where it stands in the patches of triangles, ascending: [`FOLDS`] times the triangle plus the place; [`NONE`] behind the last one.
    /// It is between two triangles, and beyond another edge of the four others around these.
    #[must_use]
    pub fn fold_places(&self) -> Vec<[u32; FOLD_PLACES_MAX]> {
        let mut places = vec![[NONE; FOLD_PLACES_MAX]; self.folds.len()];
        for (place, &fold) in self.patch_folds.as_flattened().iter().enumerate() {
            let of_fold = places.get_mut(fold as usize).into_iter().flatten();
            if let Some(free) = of_fold.into_iter().find(|free| **free == NONE) {
                *free = place as u32;
            }
        }
        places
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Whether an edge of a triangle joins two particles.
    #[must_use]
    pub fn joins(&self, a: u32, b: u32) -> bool {
        self.edges.binary_search(&[a.min(b), a.max(b)]).is_ok()
    }

    /// The edges of all triangles, sorted, the smaller particle first.
    #[must_use]
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// Makes all triangles bend so many times as stiff.
    pub(super) fn bending_scale(&mut self, times: f64) {
        for triangle in &mut self.triangles {
            triangle.bending.plate = triangle.bending.plate.map(|rigidity| times * rigidity);
        }
        for fold in &mut self.folds {
            fold.stiffness *= times;
            fold.damping *= times;
        }
    }

    /// Adds a cloth whose particles begin at `first`.
    pub(super) fn add(
        &mut self,
        fabric: Fabric,
        panels: &PanelFabrics,
        shape: &RestShape,
        first: u32,
    ) {
        let number = self.fabrics.len() as u32;
        self.fabrics.push(fabric);
        self.fabrics.extend(&panels.fabrics);
        let first_fold = self.folds.len() as u32;
        let fabric_of = |triangle: usize| panels.triangles.get(triangle).copied().unwrap_or(0);
        let fabrics = &self.fabrics;
        let damping = |t: usize| fabrics[(number + fabric_of(t)) as usize].damping[1];
        let in_matrix = shape.matrix_stiffness(damping);
        let folds = shape.hinges.iter().zip(in_matrix);
        self.folds.extend(folds.map(|(hinge, [stiffness, damping])| FabricFold {
            particles: hinge.vertices.map(|vertex| vertex + first),
            angle: hinge.angle,
            stiffness,
            damping,
            weights: shape.hinge_weights(hinge),
        }));
        let patches = shape.triangles.iter().map(|triangle| triangle.patch);
        self.patches.extend(patches.map(|patch| patch.map(|vertex| vertex + first)));
        let fold = |fold: u32| if fold == NONE { NONE } else { fold + first_fold };
        self.patch_folds.extend(shape.triangles.iter().map(|triangle| triangle.folds.map(fold)));
        let angle = |hinge: u32| shape.hinges.get(hinge as usize).map_or(0.0, |h| h.angle);
        self.triangles.extend(shape.triangles.iter().enumerate().map(|(t, triangle)| {
            FabricTriangle {
                particles: triangle.vertices.map(|vertex| vertex + first),
                fabric: number + fabric_of(t),
                rest: triangle.state,
                angles: triangle.folds.map(angle),
                bending: triangle.bending,
                fold_weights: shape.fold_weights(triangle),
            }
        }));
        // Particles of later cloths are larger, and so are their edges.
        let start = self.edges.len();
        let sides = |t: &RestTriangle| {
            let [a, b, c] = t.vertices.map(|vertex| vertex + first);
            [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)])
        };
        self.edges.extend(shape.triangles.iter().flat_map(sides));
        self.edges[start..].par_sort_unstable();
        self.edges.dedup();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::sheet;

    #[test]
    fn each_fold_knows_all_places_that_it_has_in_patches() {
        let model = sheet(7, 1.1);
        let elements = model.elements();
        let places = elements.fold_places();
        let of_patches = elements.patch_folds().as_flattened();
        let mut found = vec![false; of_patches.len()];
        for (fold, places) in places.iter().enumerate() {
            let there: Vec<_> = places.iter().filter(|&&place| place != NONE).collect();
            assert!(there.is_sorted() && there.len() >= 2, "between two triangles");
            for &&place in &there {
                assert_eq!(of_patches[place as usize], fold as u32);
                found[place as usize] = true;
            }
        }
        assert!(found.iter().zip(of_patches).all(|(found, fold)| *found == (*fold != NONE)));
        // The fold of a patch has the vertices that its places say, whichever of both triangles sees it.
        for (patch, folds) in elements.patches().iter().zip(elements.patch_folds()) {
            for (&fold, places) in folds.iter().zip(FOLD_PLACES).filter(|(fold, _)| **fold != NONE)
            {
                let [a, b, c, d] = elements.folds()[fold as usize].particles;
                let seen = places.map(|place| patch[place]);
                assert!(seen == [a, b, c, d] || seen == [b, a, d, c], "{seen:?}");
            }
        }
    }
}
