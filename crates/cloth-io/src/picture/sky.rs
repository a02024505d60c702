//! Light of the sky, which darkens folds and the floor below the cloth.
//!
//! The sky is a few directions, each with a map of depths. What a surface sees of them changes
//! slowly, so it is computed at the vertices and on a grid of the floor and interpolated, which is
//! fast and hides that the directions are few.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::geometry::{Mesh, Plane, Stage};
use super::shadow::ShadowMap;

/// Side of the map of each direction \[texel\].
const MAP_SIZE: usize = 96;
/// Directions of the sky.
const DIRECTION_COUNT: usize = 20;
/// Side of the square of texels that soften the edge of a shadow.
const TAPS: usize = 2;
/// Points along the side of the grid of a floor.
const GRID_SIDE: usize = 80;
/// Half of the side of the grid of a floor, in radii of the stage.
const GRID_REACH: f32 = 2.5;
/// Points that one task computes: their coordinates stay in the nearest cache.
const CHUNK: usize = 128;
/// Points of a row of the grid of a floor that are looked at together.
const RUN: usize = 8;

/// The maps of all directions.
pub(super) struct SkyMaps {
    maps: Vec<ShadowMap>,
    /// Light of the whole sky on a surface that faces up.
    full: f32,
}

impl Clone for SkyMaps {
    fn clone(&self) -> Self {
        Self { maps: self.maps.clone(), full: self.full }
    }

    /// Into the same memory.
    fn clone_from(&mut self, other: &Self) {
        self.maps.clone_from(&other.maps);
        self.full = other.full;
    }
}

impl SkyMaps {
    /// Maps of nothing.
    pub(super) fn new(stage: &Stage) -> Self {
        let map = |number| ShadowMap::new(stage, direction(number), MAP_SIZE);
        let maps: Vec<_> = (0..DIRECTION_COUNT).map(map).collect();
        let full = maps.iter().map(|map| map.direction.z).sum();
        Self { maps, full }
    }

    /// Enters everything in `mesh` into each map.
    pub(super) fn cast(&mut self, mesh: &Mesh) {
        self.maps.par_iter_mut().for_each(|map| map.cast(mesh));
    }

    /// Light at the vertices of `mesh`, on the front and on the back; none where `eye` sees no triangle from that side.
    fn both_sides(&self, mesh: &Mesh, eye: Vec3) -> Vec<[f32; 2]> {
        let seen = seen_sides(mesh, eye);
        let mut light = vec![[0.0; 2]; mesh.positions.len()];
        let chunks = light.par_chunks_mut(CHUNK).zip(seen.par_chunks(CHUNK));
        let vertices = mesh.positions.par_chunks(CHUNK).zip(mesh.normals.par_chunks(CHUNK));
        chunks.zip(vertices).for_each(|((light, seen), (positions, normals))| {
            let points = Points::of(positions, normals);
            for map in &self.maps {
                points.light(map, seen, light);
            }
            for light in light {
                *light = light.map(|light| light / self.full);
            }
        });
        light
    }

    /// Light on `grid` of a plane with that unit normal, by rows.
    fn on_grid(&self, grid: &SkyGrid, normal: Vec3) -> Vec<f32> {
        let mut light = vec![0.0; GRID_SIDE * GRID_SIDE];
        light.par_chunks_mut(GRID_SIDE).enumerate().for_each(|(row, light)| {
            for map in &self.maps {
                let facing = normal.dot(map.direction) / self.full;
                if facing > 0.0 {
                    grid.light_row(map, row, facing, normal, light);
                }
            }
        });
        light
    }
}

/// Whether `eye` sees the front and the back of a triangle at each vertex; both where it sees one nearly from
/// its edge.
fn seen_sides(mesh: &Mesh, eye: Vec3) -> Vec<[bool; 2]> {
    const EDGE_ON: f32 = 0.02;
    let mut seen = vec![[false; 2]; mesh.positions.len()];
    for (corners, flat) in mesh.triangles.iter().zip(&mesh.flat_normals) {
        let toward = eye - mesh.positions[corners[0] as usize];
        let facing = flat.dot(toward);
        let edge = EDGE_ON * EDGE_ON * flat.length_squared() * toward.length_squared();
        let is_edge = facing * facing <= edge;
        for &corner in corners {
            let [front, back] = &mut seen[corner as usize];
            *front |= facing >= 0.0 || is_edge;
            *back |= facing < 0.0 || is_edge;
        }
    }
    seen
}

/// Points with unit normals; each coordinate lies beside that of the next point, as processors read them together.
struct Points {
    count: usize,
    places: [[f32; CHUNK]; 3],
    normals: [[f32; CHUNK]; 3],
}

impl Points {
    /// At most [`CHUNK`] points.
    fn of(positions: &[Vec3], normals: &[Vec3]) -> Self {
        let split = |vectors: &[Vec3]| {
            let mut split = [[0.0; CHUNK]; 3];
            for (index, vector) in vectors.iter().enumerate().take(CHUNK) {
                for (axis, split) in split.iter_mut().enumerate() {
                    split[index] = vector[axis];
                }
            }
            split
        };
        let count = positions.len().min(CHUNK);
        Self { count, places: split(positions), normals: split(normals) }
    }

    /// Adds the light that comes from the direction of `map`.
    fn light(&self, map: &ShadowMap, seen: &[[bool; 2]], light: &mut [[f32; 2]]) {
        let (direction, clearance) = (map.direction, map.clearance::<TAPS>());
        let (steps, origin) = map.affine();
        let [x, y, z] = &self.places;
        let [nx, ny, nz] = &self.normals;
        let mut facing = [0.0; CHUNK];
        let mut texels = [[0.0; CHUNK]; 3];
        for i in 0..CHUNK {
            let dot = nx[i] * direction.x + ny[i] * direction.y + nz[i] * direction.z;
            // Out of the side that the light meets.
            let step = if dot > 0.0 { clearance } else { -clearance };
            let [px, py, pz] = [x[i] + step * nx[i], y[i] + step * ny[i], z[i] + step * nz[i]];
            facing[i] = dot;
            for axis in 0..3 {
                texels[axis][i] = origin[axis]
                    + (px * steps[0][axis] + py * steps[1][axis] + pz * steps[2][axis]);
            }
        }
        for (i, (light, seen)) in light.iter_mut().zip(seen).enumerate().take(self.count) {
            let side = usize::from(facing[i] <= 0.0);
            if seen[side] {
                let place = Vec3::new(texels[0][i], texels[1][i], texels[2][i]);
                light[side] += facing[i].abs() * map.lit_at::<TAPS>(place);
            }
        }
    }
}

/// Directions spread over the upper half of the sphere along a spiral.
fn direction(number: usize) -> Vec3 {
    const GOLDEN_ANGLE: f32 = 2.399_963_2;
    let height = 0.12 + 0.86 * (number as f32 + 0.5) / DIRECTION_COUNT as f32;
    let angle = GOLDEN_ANGLE * number as f32;
    let level = (1.0 - height * height).sqrt();
    Vec3::new(level * angle.cos(), level * angle.sin(), height)
}

/// Light of the sky on all surfaces, from 0 to 1, the light on an open floor.
pub(super) struct Sky {
    /// Light at each vertex of the solids and of the cloth, on its front and on its back.
    meshes: [Vec<[f32; 2]>; 2],
    /// Light on the planes.
    grids: Vec<SkyGrid>,
}

impl Sky {
    pub(super) fn new(
        maps: &SkyMaps,
        meshes: [&Mesh; 2],
        planes: &[Plane],
        stage: &Stage,
        eye: Vec3,
    ) -> Self {
        let grid = |plane: &Plane| SkyGrid::new(maps, plane, stage);
        Self {
            meshes: meshes.map(|mesh| maps.both_sides(mesh, eye)),
            grids: planes.iter().map(grid).collect(),
        }
    }

    /// Light at the point of a triangle of mesh number `mesh` with the vertices `corners` and their
    /// `weights`.
    pub(super) fn on_triangle(
        &self,
        mesh: usize,
        corners: [usize; 3],
        weights: [f32; 3],
        front: bool,
    ) -> f32 {
        let side = usize::from(!front);
        let parts = corners.into_iter().zip(weights);
        parts.map(|(corner, weight)| weight * self.meshes[mesh][corner][side]).sum()
    }

    /// Light on plane number `plane`, if it has any to tell apart.
    pub(super) fn grid(&self, plane: usize) -> Option<&SkyGrid> {
        self.grids.get(plane)
    }
}

/// Light on a square of a plane.
pub(super) struct SkyGrid {
    corner: Vec3,
    /// Unit vectors along its sides.
    axes: [Vec3; 2],
    /// Distance between points \[m\].
    step: f32,
    /// Where the point of the plane lies in it, counted in steps.
    place: Vec2,
    light: Vec<f32>,
}

impl SkyGrid {
    fn new(maps: &SkyMaps, plane: &Plane, stage: &Stage) -> Self {
        let (normal, axes) = (plane.normal, plane.axes);
        let reach = GRID_REACH * stage.radius;
        let step = 2.0 * reach / (GRID_SIDE - 1) as f32;
        let middle = stage.center - normal * plane.distance(stage.center);
        let corner = middle - reach * (axes[0] + axes[1]);
        let from_corner = (plane.point - corner) / step;
        let place = Vec2::new(from_corner.dot(axes[0]), from_corner.dot(axes[1]));
        let mut grid = Self { corner, axes, step, place, light: Vec::new() };
        grid.light = maps.on_grid(&grid, normal);
        grid
    }

    fn point(&self, column: f32, row: f32) -> Vec3 {
        self.corner + self.step * (column * self.axes[0] + row * self.axes[1])
    }

    /// Adds the light to a row that comes from the direction of `map`, which meets the plane with the unit `normal` so
    /// squarely.
    fn light_row(&self, map: &ShadowMap, row: usize, facing: f32, normal: Vec3, light: &mut [f32]) {
        let clear = map.clearance::<TAPS>() * normal;
        let start = map.texel(self.point(0.0, row as f32) + clear);
        let step = map.along(self.step * self.axes[0]);
        for (run, light) in light.chunks_mut(RUN).enumerate() {
            let first = run * RUN;
            let at = |column: usize| start + column as i32 as f32 * step;
            let [from, to] = [at(first), at(first + light.len() - 1)];
            if map.is_open::<TAPS>(from.min(to), from.max(to)) {
                light.iter_mut().for_each(|light| *light += facing);
                continue;
            }
            for (column, light) in (first..).zip(light) {
                *light += facing * map.lit_at::<TAPS>(at(column));
            }
        }
    }

    /// Columns and rows to a metre.
    pub(super) fn density(&self) -> f32 {
        self.step.recip()
    }

    /// Column and row of the point of the plane.
    pub(super) fn place(&self) -> Vec2 {
        self.place
    }

    /// The light at columns and rows; beyond the grid that of an open floor.
    #[inline]
    pub(super) fn at<const N: usize>(&self, columns: [f32; N], rows: [f32; N]) -> [f32; N] {
        const LAST: f32 = (GRID_SIDE - 1) as f32;
        let mut starts = [0; N];
        let mut parts = [[0.0; N]; 2];
        for i in 0..N {
            // The square that holds the place, or the nearest one; the conversion makes zero of what is no number.
            let whole = [columns[i], rows[i]].map(|x| x.clamp(0.0, LAST - 1.0) as i32 as f32);
            starts[i] = (whole[1] * GRID_SIDE as f32 + whole[0]) as i32;
            (parts[0][i], parts[1][i]) = (columns[i] - whole[0], rows[i] - whole[1]);
        }
        let mut corners = [[1.0; N]; 4];
        for i in 0..N {
            let pair = |start: usize| self.light.get(start..).and_then(<[f32]>::first_chunk);
            let start = starts[i] as usize;
            if let (Some(&[a, b]), Some(&[c, d])) = (pair(start), pair(start + GRID_SIDE)) {
                (corners[0][i], corners[1][i], corners[2][i], corners[3][i]) = (a, b, c, d);
            }
        }
        let [a, b, c, d] = corners;
        let mut light = [0.0; N];
        for i in 0..N {
            let (x, y) = (parts[0][i], parts[1][i]);
            let (upper, lower) = (a[i] + (b[i] - a[i]) * x, c[i] + (d[i] - c[i]) * x);
            let is_inside = (x >= 0.0) & (y >= 0.0) & (x < 1.0) & (y < 1.0);
            light[i] = if is_inside { upper + (lower - upper) * y } else { 1.0 };
        }
        light
    }
}
