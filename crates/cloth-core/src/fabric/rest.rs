//! The shape that a cloth has without forces, apart from where it starts.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{
    BendingRigidity, CurvatureStiffness, FabricError, HingeGeometry, RestWarning,
    bending::{FOLD_PLACES, PATCH},
    curvature::{FOLDS, Fit},
    hinge,
    membrane::{self, RestState},
    rest_warning,
};
use crate::{
    ModelError, NONE, PanelFabrics, TextureMap, TriangleMesh, WingedEdge, WingedEdges, field::hash,
};

/// In the matrix of an implicit step folds stand for bending, each on its own, with this share of the sum of the absolute values of its row in the stiffness
/// of bending by angles. All of these sums are more than the stiffness in every motion (Gershgorin); with less than half of it a step could grow
/// without bound. On regular meshes this share has the stiffness of cylinders.
const IN_MATRIX: f64 = 0.6;

/// Triangles in a task.
const TASK: usize = 1024;

/// What a cloth of triangles is at rest: pattern coordinates of each triangle, rest angles and stiffness of each hinge.
///
/// Edges of one triangle are borders and have no hinge. At an edge of three and more triangles a hinge for each pair would be a cloth several
/// times as stiff, whose sides have no inside: where a pattern says that they are sewn together there, only neighbours in the pattern have one, and what
/// is sewn to them moves freely around the seam; else they are refused.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RestShape {
    /// One for each triangle of the mesh.
    pub triangles: Vec<RestTriangle>,
    /// The edges with two triangles, ascending by their vertices.
    pub hinges: Vec<RestHinge>,
    /// What is allowed but looks like a slip.
    pub warnings: Vec<RestWarning>,
}

/// A triangle at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestTriangle {
    /// Its vertices.
    pub vertices: [u32; 3],
    /// D_m^-1 and area.
    pub state: RestState<f64>,
    /// Hinges of its edges ab, bc, ca; [`NONE`] on a border.
    pub hinges: [u32; 3],
    /// Its patch, as the folds of [`bending`](super::bending) take it: its vertices, those beyond its edges, and those beyond the other edges of its neighbours. Where
    /// there is none a corner stands there, whose fold has no stiffness.
    pub patch: [u32; PATCH],
    /// The hinges of the folds of its patch; [`NONE`] where there is none.
    pub folds: [u32; FOLDS],
    /// How it resists these folds.
    pub bending: CurvatureStiffness<f64>,
    /// How much each of these folds changes by a motion out of the plane, of the flat triangle \[1/m\]: at the edge's start and end in the
    /// direction of the triangle, at the third corner, and at the vertex beyond. Zero for a border.
    pub fold_weights: [[f64; 4]; 3],
}

/// An edge between two triangles at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestHinge {
    /// The edge 0-1 and the opposite vertices 2 and 3, as [`hinge::fold`] takes them.
    pub vertices: [u32; 4],
    /// The triangles with vertex 2 and with vertex 3.
    pub triangles: [u32; 2],
    /// Fold at rest \[rad\].
    pub angle: f64,
    /// Stiffness of the hinge on its own \[N m\], B |e|^2 / (A1 + A2). Its energy depends on the mesh, that of [`RestTriangle::bending`] does not: tests
    /// compare the two. The matrix has [`FabricFold::stiffness`](crate::FabricFold::stiffness).
    pub stiffness: f64,
}

impl RestTriangle {
    /// Takes the folds that say nothing of this triangle, which are a third on regular meshes, and the vertices beyond them out of its patch.
    fn leave_idle(&mut self) {
        let [a, b, c] = self.vertices;
        for (far, corner) in [b, a, c, b, a, c].into_iter().enumerate() {
            let fold = 3 + far;
            if self.bending.map.iter().all(|row| row[fold] == 0.0) {
                (self.patch[6 + far], self.folds[fold]) = (corner, NONE);
            }
        }
    }
}

impl RestShape {
    /// From pattern coordinates \[m\], u along the warp. Rest angles are zero: the cloth was cut from flat fabric.
    ///
    /// Panels may be mirrored as a whole; neighbours within a panel may not lie on each other. `mesh` gives the triangles, and with
    /// its positions the size to which that of the pattern is compared.
    ///
    /// # Errors
    /// A defect of the mesh as a surface, a pattern that lacks triangles or coordinates, triangles without area in the pattern or
    /// turned over in it, a rigidity that is no number.
    pub fn from_pattern(
        mesh: &TriangleMesh,
        pattern: &TextureMap,
        bending: &BendingRigidity,
        cloth: &str,
    ) -> Result<Self, FabricError> {
        if pattern.triangles.len() != mesh.triangles.len() {
            return Err(FabricError::PatternLength {
                cloth: cloth.into(),
                found: pattern.triangles.len(),
                expected: mesh.triangles.len(),
            });
        }
        let mut corners = Vec::with_capacity(mesh.triangles.len());
        for (triangle, names) in pattern.triangles.iter().enumerate() {
            let mut uv = [[0.0; 2]; 3];
            for (uv, &name) in uv.iter_mut().zip(names) {
                *uv = *pattern.coordinates.get(name as usize).ok_or_else(|| {
                    FabricError::PatternOutOfRange {
                        cloth: cloth.into(),
                        triangle,
                        coordinate: name,
                        coordinates: pattern.coordinates.len(),
                    }
                })?;
                crate::error::finite_all(
                    || format!("pattern coordinate {name} of cloth {cloth:?}"),
                    uv,
                )?;
            }
            corners.push(uv);
        }
        let vertices = mesh.positions.len();
        let both = (&*mesh.triangles, &*corners);
        let edges = WingedEdges::of_pattern(vertices, both, mesh.is_sewn_in_part, cloth)?;
        flips_check(&edges, &mesh.triangles, &corners, cloth)?;
        let overlap = rest_warning::overlap(&corners);
        grain_apply(&mut corners, &mesh.grain, cloth)?;
        let mut shape = Self::new(mesh, &edges, &corners, bending, cloth)?;
        shape.scale_check(mesh);
        shape.warnings.extend(overlap);
        shape.fold(mesh, cloth)?;
        Ok(shape)
    }

    /// From the shape of a mesh in space \[m\], with the warp along `warp` as it lies in each triangle; without one along the axis of the world along
    /// which the mesh is longest, or the next one in triangles on which that stands up by more than 60 degrees. It keeps its folds: rest angles are
    /// those of the mesh.
    ///
    /// # Errors
    /// A defect of the mesh as a surface, a direction that stands upright on a triangle, a rigidity that is no number.
    pub fn from_mesh(
        mesh: &TriangleMesh,
        warp: Option<[f64; 3]>,
        bending: &BendingRigidity,
        cloth: &str,
    ) -> Result<Self, FabricError> {
        let name = || format!("warp direction of cloth {cloth:?}");
        crate::error::finite_all(name, warp.as_ref().map_or(&[], |warp| warp))?;
        for (i, position) in mesh.positions.iter().enumerate() {
            crate::error::finite_all(
                || format!("position of vertex {i} of cloth {cloth:?}"),
                position,
            )?;
        }
        let edges = WingedEdges::build(mesh, cloth)?;
        // Below a thousandth the direction within the plane is that of the rounding of what was given. No triangle has two axes of the world within 30
        // degrees of its normal.
        let (warps, least) =
            warp.map_or_else(|| (axes_by_length(mesh).to_vec(), 0.5), |warp| (vec![warp], 1e-3));
        let mut corners = Vec::with_capacity(mesh.triangles.len());
        for (triangle, vertices) in mesh.triangles.iter().enumerate() {
            let places = vertices.map(|vertex| mesh.positions[vertex as usize]);
            let flat = warps.iter().find_map(|&warp| membrane::flattened(places, warp, least));
            corners.push(
                flat.ok_or_else(|| FabricError::WarpUpright { cloth: cloth.into(), triangle })?,
            );
        }
        grain_apply(&mut corners, &mesh.grain, cloth)?;
        let mut shape = Self::new(mesh, &edges, &corners, bending, cloth)?;
        for rest in &mut shape.hinges {
            let places = rest.vertices.map(|vertex| mesh.positions[vertex as usize]);
            rest.angle = hinge::fold(places).angle;
        }
        shape.fold(mesh, cloth)?;
        Ok(shape)
    }

    /// Adds to the fold of each hinge at rest a number from -`most` to `most` \[rad\], the same ones for the same mesh.
    pub fn imperfection_add(&mut self, most: f64) {
        for hinge in &mut self.hinges {
            let [a, b, ..] = hinge.vertices;
            let random =
                f64::from(hash([a.min(b) as i32, a.max(b) as i32, 0])) / f64::from(u32::MAX);
            hinge.angle += most * (2.0 * random - 1.0);
        }
    }

    /// Gives the hinges their rest angles that a mesh says are folded.
    fn fold(&mut self, mesh: &TriangleMesh, cloth: &str) -> Result<(), FabricError> {
        for (number, fold) in mesh.folds.iter().enumerate() {
            let name = || format!("angle of fold {number} of cloth {cloth:?}");
            crate::error::finite_all(name, &[fold.angle])?;
        }
        let ends = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        let mut folds: Vec<_> = mesh.folds.iter().map(|f| (ends(f.edge), f.angle)).collect();
        folds.sort_by_key(|(edge, _)| *edge);
        for hinge in &mut self.hinges {
            let [a, b, ..] = hinge.vertices;
            if let Ok(found) = folds.binary_search_by_key(&ends([a, b]), |(edge, _)| *edge) {
                hinge.angle = folds[found].1;
            }
        }
        Ok(())
    }

    fn new(
        mesh: &TriangleMesh,
        edges: &WingedEdges,
        corners: &[[[f64; 2]; 3]],
        bending: &BendingRigidity,
        cloth: &str,
    ) -> Result<Self, FabricError> {
        let triangles = &*mesh.triangles;
        bending.validate(&format!("cloth {cloth:?}"))?;
        panels_check(mesh, cloth)?;
        // That of the cloth, and those of its panels.
        let others = mesh.panels.fabrics.iter().map(|fabric| fabric.bending.plate());
        let plates: Vec<_> = std::iter::once(bending.plate()).chain(others).collect();
        let plate = |t: usize| {
            let number = mesh.panels.triangles.get(t).copied().unwrap_or_default();
            &plates[number as usize]
        };
        let mut hinge_of_edge = vec![NONE; edges.edges.len()];
        let mut hinges = Vec::new();
        for (edge, place) in edges.edges.iter().zip(&mut hinge_of_edge) {
            let WingedEdge { vertices: [a, b], triangles: sides, opposite } = *edge;
            if sides.contains(&NONE) {
                continue;
            }
            *place = hinges.len() as u32;
            hinges.push(RestHinge {
                vertices: [a, b, opposite[0], opposite[1]],
                triangles: sides,
                angle: 0.0,
                stiffness: 0.0,
            });
        }
        let side = |hinge: &RestHinge, k: usize| {
            let triangle = hinge.triangles[k] as usize;
            Side::new(triangles[triangle], corners[triangle], hinge.vertices[0], hinge.vertices[1])
        };
        let state = |(triangle, &own): (usize, &[[f64; 2]; 3])| {
            membrane::rest_state(own)
                .ok_or_else(|| FabricError::PatternDegenerate { cloth: cloth.into(), triangle })
        };
        let states: Vec<_> = corners.iter().enumerate().map(state).collect::<Result<_, _>>()?;
        let rest = |(t, state): (usize, RestState<f64>)| {
            let vertices = triangles[t];
            let own = edges.triangle_edges[t].map(|edge| hinge_of_edge[edge as usize]);
            let geometry = own.map(|h| {
                let rest: &RestHinge = hinges.get(h as usize)?;
                let own = usize::from(rest.triangles[1] == t as u32);
                Some(side(rest, own).beside(&side(rest, 1 - own)))
            });
            let fold_weights = std::array::from_fn(|edge| {
                let Some(geometry) = &geometry[edge] else { return [0.0; 4] };
                let [start, end, own, beyond] = geometry.weights();
                // The hinge runs from the smaller vertex to the larger one.
                let runs_back = vertices[edge] > vertices[(edge + 1) % 3];
                if runs_back { [end, start, own, beyond] } else { [start, end, own, beyond] }
            });
            let triangle = RestTriangle {
                vertices,
                state,
                hinges: own,
                patch: [0; PATCH],
                folds: [NONE; FOLDS],
                bending: CurvatureStiffness::default(),
                fold_weights,
            };
            (triangle, Fit::new(plate(t), &geometry))
        };
        let all = states.into_par_iter().enumerate();
        let mut shape = Self::default();
        let mut fits = Vec::new();
        all.with_min_len(TASK).map(rest).unzip_into_vecs(&mut shape.triangles, &mut fits);
        let limited = fits.iter().filter(|fit| fit.is_limited).count();
        let patch = |t: usize| {
            let neighbours = [0, 1, 2].map(|edge| shape.beyond(&hinges, t, edge));
            let sides = [0, 1, 2].map(|k| {
                let side =
                    Side::new(triangles[t], corners[t], triangles[t][k], triangles[t][(k + 1) % 3]);
                (side.normal.into(), side.length)
            });
            let beyond = neighbours.map(|n| n.map(|(other, edge)| (fits[other], edge)));
            let area = shape.triangles[t].state.area;
            let bending = CurvatureStiffness::new(area, plate(t), &fits[t], &sides, &beyond);
            (shape.patch(&hinges, t, &neighbours), bending)
        };
        let mut patches = Vec::new();
        let all = (0..triangles.len()).into_par_iter().with_min_len(TASK);
        all.map(patch).collect_into_vec(&mut patches);
        for (triangle, ((patch, folds), bending)) in shape.triangles.iter_mut().zip(patches) {
            (triangle.patch, triangle.folds, triangle.bending) = (patch, folds, bending);
            triangle.leave_idle();
        }
        for rest in &mut hinges {
            let sides = [side(rest, 0), side(rest, 1)];
            // Across a seam the two panels may have the warp in different directions.
            let rigidity =
                [0, 1].map(|k| plate(rest.triangles[k] as usize).cylinder(sides[k].normal.into()));
            let geometry = sides[0].beside(&sides[1]);
            rest.stiffness = geometry.lone_stiffness(0.5 * (rigidity[0] + rigidity[1]));
        }
        shape.warnings.extend(rest_warning::needles(corners));
        if limited > 0 {
            shape.warnings.push(RestWarning::Limited { triangles: limited });
        }
        shape.hinges = hinges;
        Ok(shape)
    }

    /// How much each fold of the patch of a triangle changes by a motion out of the plane \[1/m\], as in [`RestTriangle::fold_weights`].
    pub(crate) fn fold_weights(&self, triangle: &RestTriangle) -> [[f64; 4]; FOLDS] {
        std::array::from_fn(|fold| {
            let [start, _, own, _] = FOLD_PLACES[fold].map(|place| triangle.patch[place]);
            let Some(hinge) = self.hinges.get(triangle.folds[fold] as usize) else {
                return [0.0; 4];
            };
            let has_own = |&&t: &&u32| self.triangles[t as usize].vertices.contains(&own);
            let Some(&t) = hinge.triangles.iter().find(has_own) else { return [0.0; 4] };
            let side = &self.triangles[t as usize];
            let edge = side.vertices.iter().position(|&vertex| vertex == start);
            edge.map_or([0.0; 4], |edge| side.fold_weights[edge])
        })
    }

    /// How much a hinge changes by a motion of each of its vertices out of the plane \[1/m\].
    pub(crate) fn hinge_weights(&self, hinge: &RestHinge) -> [f64; 4] {
        let triangle = &self.triangles[hinge.triangles[0] as usize];
        let start = triangle.vertices.iter().position(|&vertex| vertex == hinge.vertices[0]);
        let end = triangle.vertices.iter().position(|&vertex| vertex == hinge.vertices[1]);
        let (Some(start), Some(end)) = (start, end) else { return [0.0; 4] };
        let runs_along = (start + 1) % 3 == end;
        let [a, b, own, beyond] = triangle.fold_weights[if runs_along { start } else { end }];
        if runs_along { [a, b, own, beyond] } else { [b, a, own, beyond] }
    }

    /// What each hinge on its own has for the stiffness of bending in the matrix of an implicit step \[N m\], and the same for damping, of which
    /// each triangle has its own \[s\] (NUMERICS §12).
    pub(crate) fn matrix_stiffness(&self, damping: impl Fn(usize) -> f64 + Sync) -> Vec<[f64; 2]> {
        let mut places = vec![Vec::new(); self.hinges.len()];
        for (t, triangle) in self.triangles.iter().enumerate() {
            for (place, &hinge) in triangle.folds.iter().enumerate() {
                if let Some(places) = places.get_mut(hinge as usize) {
                    places.push((t, place));
                }
            }
        }
        // Row of a hinge in the stiffness of bending by the angles of all hinges.
        let row = |places: Vec<(usize, usize)>| {
            let mut row: Vec<(u32, [f64; 2])> = Vec::new();
            for (t, place) in places {
                let RestTriangle { folds, bending, .. } = &self.triangles[t];
                let unit = std::array::from_fn(|fold| if fold == place { 1.0 } else { 0.0 });
                let damping = damping(t);
                for (&hinge, moment) in folds.iter().zip(bending.moments(unit)) {
                    let entry = match row.iter_mut().find(|(other, _)| *other == hinge) {
                        Some((_, entry)) => entry,
                        None => &mut row.push_mut((hinge, [0.0; 2])).1,
                    };
                    entry[0] += moment;
                    entry[1] += damping * moment;
                }
            }
            let sum = |which: usize| row.iter().map(|(_, entry)| entry[which].abs()).sum::<f64>();
            [IN_MATRIX * sum(0), IN_MATRIX * sum(1)]
        };
        places.into_par_iter().with_min_len(TASK).map(row).collect()
    }

    /// The triangle beyond an edge of one, and which of its edges that is.
    fn beyond(&self, hinges: &[RestHinge], t: usize, edge: usize) -> Option<(usize, usize)> {
        let hinge = self.triangles[t].hinges[edge];
        let [one, other] = hinges.get(hinge as usize)?.triangles;
        let other = if one as usize == t { other } else { one } as usize;
        let own = self.triangles.get(other)?.hinges.iter().position(|&h| h == hinge)?;
        Some((other, own))
    }

    /// The vertices and hinges of the patch of a triangle.
    fn patch(
        &self,
        hinges: &[RestHinge],
        t: usize,
        neighbours: &[Option<(usize, usize)>; 3],
    ) -> ([u32; PATCH], [u32; FOLDS]) {
        let triangle = &self.triangles[t];
        let [a, b, c] = triangle.vertices;
        let mut patch = [a, b, c, c, a, b, b, a, c, b, a, c];
        let mut folds = [NONE; FOLDS];
        for (edge, neighbour) in neighbours.iter().enumerate() {
            let &Some((other, own)) = neighbour else { continue };
            folds[edge] = triangle.hinges[edge];
            let beyond = &self.triangles[other];
            patch[3 + edge] = beyond.vertices[(own + 2) % 3];
            for step in [0, 1] {
                let place = (own + 1 + step) % 3;
                folds[3 + 2 * edge + step] = beyond.hinges[place];
                if let Some((farther, their)) = self.beyond(hinges, other, place) {
                    patch[6 + 2 * edge + step] = self.triangles[farther].vertices[(their + 2) % 3];
                }
            }
        }
        (patch, folds)
    }

    fn scale_check(&mut self, mesh: &TriangleMesh) {
        let pattern: f64 = self.triangles.iter().map(|triangle| triangle.state.area).sum();
        let place = |vertex: u32| DVec3::from(mesh.positions[vertex as usize]);
        let areas = mesh
            .triangles
            .iter()
            .map(|&[a, b, c]| 0.5 * (place(b) - place(a)).cross(place(c) - place(a)).length());
        self.warnings.extend(RestWarning::of_scale((pattern / areas.sum::<f64>()).sqrt()));
    }

    /// Masses of the vertices \[kg\] from the mass per area \[kg/m^2\] of each triangle: it gives a third of its mass at rest to each corner.
    #[must_use]
    pub fn masses(&self, area_density: impl Fn(usize) -> f64, vertices: usize) -> Vec<f64> {
        let mut masses = vec![0.0; vertices];
        for (t, triangle) in self.triangles.iter().enumerate() {
            let density = area_density(t);
            for vertex in triangle.vertices {
                masses[vertex as usize] += density * triangle.state.area / 3.0;
            }
        }
        masses
    }
}

/// Checks the fabrics of panels.
fn panels_check(mesh: &TriangleMesh, cloth: &str) -> Result<(), FabricError> {
    let PanelFabrics { fabrics, triangles } = &mesh.panels;
    for (number, fabric) in fabrics.iter().enumerate() {
        fabric.validate(&format!("panel fabric {number} of cloth {cloth:?}"))?;
    }
    if !triangles.is_empty() && triangles.len() != mesh.triangles.len() {
        let (what, found, expected) = ("fabrics of panels", triangles.len(), mesh.triangles.len());
        return Err(ModelError::LengthMismatch { what, found, expected }.into());
    }
    match triangles.iter().position(|&number| number as usize > fabrics.len()) {
        Some(triangle) => {
            let (fabric, fabrics) = (triangles[triangle], fabrics.len());
            Err(FabricError::PanelOutOfRange { cloth: cloth.into(), triangle, fabric, fabrics })
        }
        None => Ok(()),
    }
}

/// A triangle as seen from one of its edges, in its pattern.
#[derive(Clone, Copy, Debug)]
struct Side {
    tangent: DVec2,
    normal: DVec2,
    length: f64,
    height: f64,
    foot: f64,
}

impl Side {
    /// From the edge that runs from vertex `a` to vertex `b` of the triangle.
    fn new(vertices: [u32; 3], corners: [[f64; 2]; 3], a: u32, b: u32) -> Self {
        let apex = vertices.into_iter().position(|vertex| vertex != a && vertex != b);
        let at = |wanted: u32| vertices.into_iter().position(|vertex| vertex == wanted);
        let corner = |place: Option<usize>| DVec2::from(corners[place.unwrap_or(0)]);
        let [a, b, apex] = [corner(at(a)), corner(at(b)), corner(apex)];
        let length = (b - a).length();
        let tangent = (b - a) / length;
        let foot = (apex - a).dot(tangent);
        let up = tangent.perp() * tangent.perp_dot(apex - a).signum();
        Self { tangent, normal: up, length, height: (apex - a).dot(up), foot }
    }

    /// The hinge of this triangle with its neighbour, whose side of a seam may be a little longer or shorter.
    fn beside(&self, neighbour: &Self) -> HingeGeometry {
        HingeGeometry {
            tangent: self.tangent.into(),
            normal: self.normal.into(),
            length: self.length,
            heights: [self.height, neighbour.height],
            feet: [self.foot, neighbour.foot * self.length / neighbour.length],
        }
    }
}

/// The axes of the world, that along which a mesh is longest first.
fn axes_by_length(mesh: &TriangleMesh) -> [[f64; 3]; 3] {
    let mut axes = [0, 1, 2].map(|axis| {
        let places = || mesh.positions.iter().map(|place| place[axis]);
        let length = places().fold(f64::MIN, f64::max) - places().fold(f64::MAX, f64::min);
        (length, std::array::from_fn(|k| f64::from(u8::from(k == axis))))
    });
    axes.sort_by(|(one, _), (other, _)| other.total_cmp(one));
    axes.map(|(_, axis)| axis)
}

/// Turns the corners of each triangle so that u runs along the warp.
fn grain_apply(
    corners: &mut [[[f64; 2]; 3]],
    grain: &[f64],
    cloth: &str,
) -> Result<(), FabricError> {
    if grain.is_empty() {
        return Ok(());
    }
    if grain.len() != corners.len() {
        let [found, expected] = [grain.len(), corners.len()];
        return Err(FabricError::GrainLength { cloth: cloth.into(), found, expected });
    }
    for ((triangle, corners), &angle) in corners.iter_mut().enumerate().zip(grain) {
        crate::error::finite(
            || format!("angle of the warp of triangle {triangle} of cloth {cloth:?}"),
            angle,
        )?;
        let (sine, cosine) = angle.sin_cos();
        for [u, v] in corners {
            [*u, *v] = [cosine * *u + sine * *v, cosine * *v - sine * *u];
        }
    }
    Ok(())
}

/// Refuses neighbours that share an edge of the pattern and lie on the same side of it.
fn flips_check(
    edges: &WingedEdges,
    triangles: &[[u32; 3]],
    corners: &[[[f64; 2]; 3]],
    cloth: &str,
) -> Result<(), FabricError> {
    let corner = |t: u32, vertex: u32| {
        let place = triangles[t as usize].iter().position(|&other| other == vertex).unwrap_or(0);
        corners[t as usize][place]
    };
    let turn = |t: u32| {
        let [a, b, c] = corners[t as usize].map(DVec2::from);
        (b - a).perp_dot(c - a)
    };
    for edge in &edges.edges {
        let [first, second] = edge.triangles;
        if edge.triangles.contains(&NONE) {
            continue;
        }
        let is_shared = edge.vertices.iter().all(|&v| corner(first, v) == corner(second, v));
        if is_shared && turn(first) * turn(second) < 0.0 {
            return Err(FabricError::PatternFlipped {
                cloth: cloth.into(),
                triangles: edge.triangles,
            });
        }
    }
    Ok(())
}
