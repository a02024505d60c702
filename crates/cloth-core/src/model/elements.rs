//! The triangles of the cloths that are made of fabric, in the composite model (NUMERICS §11, §12).

use crate::fabric::{
    CurvatureStiffness, Fabric, RestShape, RestTriangle, bending::FOLD_PLACES, membrane::RestState,
};

/// All triangles of fabric of a model. A cloth of springs has none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FabricElements {
    fabrics: Vec<Fabric>,
    triangles: Vec<FabricTriangle>,
    patches: Vec<[u32; 6]>,
    /// Edges of all triangles, sorted, the smaller particle first.
    edges: Vec<[u32; 2]>,
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
    /// Angles at rest \[rad\] of the folds of its edges ab, bc and ca; zero on a border.
    pub angles: [f64; 3],
    /// How it resists the folds of these edges; zero for a border.
    pub bending: CurvatureStiffness<f64>,
    /// How much each of these folds changes by a motion out of the plane, of the flat triangle \[1/m\]: at the edge's start and end in the
    /// direction of the triangle, at the third corner, and at the vertex beyond. Zero for a border.
    pub fold_weights: [[f64; 4]; 3],
}

impl FabricTriangle {
    /// The same by the six vertices of the patch.
    #[must_use]
    pub fn patch_weights(&self) -> [[f64; 6]; 3] {
        let mut weights = [[0.0; 6]; 3];
        for ((row, places), own) in weights.iter_mut().zip(FOLD_PLACES).zip(self.fold_weights) {
            places.into_iter().zip(own).for_each(|(place, weight)| row[place] = weight);
        }
        weights
    }
}

impl FabricElements {
    /// The fabrics, one for each cloth that is made of one.
    #[must_use]
    pub fn fabrics(&self) -> &[Fabric] {
        &self.fabrics
    }

    /// The triangles, in the order of the model's triangles.
    #[must_use]
    pub fn triangles(&self) -> &[FabricTriangle] {
        &self.triangles
    }

    /// For each triangle its corners a, b, c, and the vertices opposite to its edges ab, bc, ca beyond them. On a border the third
    /// corner stands there, whose fold has no stiffness.
    #[must_use]
    pub fn patches(&self) -> &[[u32; 6]] {
        &self.patches
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

    /// Adds a cloth whose particles begin at `first`.
    pub(super) fn add(&mut self, fabric: Fabric, shape: &RestShape, first: u32) {
        let number = self.fabrics.len() as u32;
        self.fabrics.push(fabric);
        for triangle in &shape.triangles {
            let hinge = |edge: usize| shape.hinges.get(triangle.hinges[edge] as usize);
            let corner = |place: usize| triangle.vertices[place % 3];
            let apex = |edge: usize| {
                let own = corner(edge + 2);
                let Some(hinge) = hinge(edge) else { return own };
                let [_, _, one, other] = hinge.vertices;
                if one == own { other } else { one }
            };
            let [a, b, c] = triangle.vertices;
            self.patches.push([a, b, c, apex(0), apex(1), apex(2)].map(|v| v + first));
            self.triangles.push(FabricTriangle {
                particles: triangle.vertices.map(|vertex| vertex + first),
                fabric: number,
                rest: triangle.state,
                angles: [0, 1, 2].map(|edge| hinge(edge).map_or(0.0, |hinge| hinge.angle)),
                bending: triangle.bending,
                fold_weights: triangle.fold_weights,
            });
        }
        // Particles of later cloths are larger, and so are their edges.
        let start = self.edges.len();
        let sides = |t: &RestTriangle| {
            let [a, b, c] = t.vertices.map(|vertex| vertex + first);
            [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)])
        };
        self.edges.extend(shape.triangles.iter().flat_map(sides));
        self.edges[start..].sort_unstable();
        self.edges.dedup();
    }
}
