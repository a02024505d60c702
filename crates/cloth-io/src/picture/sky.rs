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
/// Points that one task computes.
const CHUNK: usize = 256;

/// The maps of all directions.
#[derive(Clone)]
pub(super) struct SkyMaps {
    maps: Vec<ShadowMap>,
    /// Light of the whole sky on a surface that faces up.
    full: f32,
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

    /// Light at points with unit normals, on the front and on the back.
    fn both_sides(&self, positions: &[Vec3], normals: &[Vec3]) -> Vec<[f32; 2]> {
        let mut light = vec![[0.0; 2]; positions.len()];
        let chunks = light.par_chunks_mut(CHUNK).zip(positions.par_chunks(CHUNK));
        chunks.zip(normals.par_chunks(CHUNK)).for_each(|((light, positions), normals)| {
            for map in &self.maps {
                for ((light, &point), &normal) in light.iter_mut().zip(positions).zip(normals) {
                    let facing = normal.dot(map.direction);
                    let (side, normal) = if facing > 0.0 { (0, normal) } else { (1, -normal) };
                    light[side] += facing.abs() * map.lit::<TAPS>(point, normal) / self.full;
                }
            }
        });
        light
    }

    /// Light at points that share one unit normal.
    fn on_points(&self, points: &[Vec3], normal: Vec3) -> Vec<f32> {
        let mut light = vec![0.0; points.len()];
        let chunks = light.par_chunks_mut(CHUNK).zip(points.par_chunks(CHUNK));
        chunks.for_each(|(light, points)| {
            for map in &self.maps {
                let facing = normal.dot(map.direction) / self.full;
                if facing > 0.0 {
                    for (light, &point) in light.iter_mut().zip(points) {
                        *light += facing * map.lit::<TAPS>(point, normal);
                    }
                }
            }
        });
        light
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
    pub(super) fn new(maps: &SkyMaps, meshes: [&Mesh; 2], planes: &[Plane], stage: &Stage) -> Self {
        let grid = |plane: &Plane| SkyGrid::new(maps, plane, stage);
        Self {
            meshes: meshes.map(|mesh| maps.both_sides(&mesh.positions, &mesh.normals)),
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

    /// Light on plane number `plane` at `point`.
    pub(super) fn on_plane(&self, plane: usize, point: Vec3) -> f32 {
        self.grids.get(plane).map_or(1.0, |grid| grid.at(point))
    }
}

/// Light on a square of a plane.
struct SkyGrid {
    corner: Vec3,
    first: Vec3,
    second: Vec3,
    /// Distance between points \[m\].
    step: f32,
    light: Vec<f32>,
}

impl SkyGrid {
    fn new(maps: &SkyMaps, plane: &Plane, stage: &Stage) -> Self {
        let normal = plane.normal;
        let (first, second) = normal.any_orthonormal_pair();
        let reach = GRID_REACH * stage.radius;
        let step = 2.0 * reach / (GRID_SIDE - 1) as f32;
        let middle = stage.center - normal * plane.distance(stage.center);
        let corner = middle - reach * (first + second);
        let point = |index: usize| {
            let (column, row) = (index % GRID_SIDE, index / GRID_SIDE);
            corner + step * (column as f32 * first + row as f32 * second)
        };
        let points: Vec<Vec3> = (0..GRID_SIDE * GRID_SIDE).map(point).collect();
        Self { corner, first, second, step, light: maps.on_points(&points, normal) }
    }

    /// The light at `point`; beyond the grid that of an open floor.
    fn at(&self, point: Vec3) -> f32 {
        let from_corner = (point - self.corner) / self.step;
        let place = Vec2::new(from_corner.dot(self.first), from_corner.dot(self.second));
        let last = (GRID_SIDE - 1) as f32;
        if !(place.min_element() >= 0.0 && place.max_element() < last) {
            return 1.0;
        }
        let (column, row) = (place.x as usize, place.y as usize);
        let part = place - Vec2::new(column as f32, row as f32);
        let light = |column: usize, row: usize| self.light[row * GRID_SIDE + column];
        let mix = |a: f32, b: f32, part: f32| a + (b - a) * part;
        mix(
            mix(light(column, row), light(column + 1, row), part.x),
            mix(light(column, row + 1), light(column + 1, row + 1), part.x),
            part.y,
        )
    }
}
