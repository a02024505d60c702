//! Light of the sky, which darkens folds and the floor below the cloth.
//!
//! The sky is a few directions, each with a map of depths. What a surface sees of them changes
//! slowly, so it is computed at the vertices and on a grid of the floor and interpolated, which is
//! fast and hides that the directions are few.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::geometry::{Geometry, Surface};
use super::shadow::ShadowMap;

/// Side of the map of each direction \[texel\].
const MAP_SIZE: usize = 192;
/// Directions of the sky.
const DIRECTION_COUNT: usize = 20;
/// Points along the side of the grid of a floor.
const GRID_SIDE: usize = 96;
/// Half of the side of the grid of a floor, in radii of the scene.
const GRID_REACH: f32 = 3.0;

/// Light of the sky on all surfaces, from 0 to 1, the light on an open floor.
pub(super) struct Sky {
    /// Light at each vertex, on its front and on its back.
    vertices: Vec<[f32; 2]>,
    /// Light on planes, with the numbers of their surfaces.
    grids: Vec<(usize, SkyGrid)>,
}

impl Sky {
    pub(super) fn new(geometry: &Geometry) -> Self {
        let maps = SkyMaps::new(geometry);
        let vertices = geometry
            .positions
            .par_iter()
            .zip(&geometry.normals)
            .map(|(&point, &normal)| [maps.light(point, normal), maps.light(point, -normal)])
            .collect();
        let grid = |(number, surface): (usize, &Surface)| match surface {
            Surface::Plane { point, normal } => {
                let grid = SkyGrid::new(&maps, *point, *normal, GRID_REACH * geometry.radius);
                Some((number, grid))
            }
            _ => None,
        };
        let grids = geometry.surfaces.iter().enumerate().filter_map(grid).collect();
        Self { vertices, grids }
    }

    /// Light at the point of a triangle with the vertices `corners` and their `weights`.
    pub(super) fn on_triangle(&self, corners: [usize; 3], weights: [f32; 3], front: bool) -> f32 {
        let side = usize::from(!front);
        let parts = corners.into_iter().zip(weights);
        parts.map(|(corner, weight)| weight * self.vertices[corner][side]).sum()
    }

    /// Light on the plane with the number `surface` at `point`.
    pub(super) fn on_plane(&self, surface: usize, point: Vec3) -> f32 {
        let grid = self.grids.iter().find(|(number, _)| *number == surface);
        grid.map_or(1.0, |(_, grid)| grid.at(point))
    }
}

struct SkyMaps {
    maps: Vec<ShadowMap>,
    /// Light of the whole sky on a surface that faces up.
    full: f32,
}

impl SkyMaps {
    fn new(geometry: &Geometry) -> Self {
        let maps: Vec<_> = (0..DIRECTION_COUNT)
            .into_par_iter()
            .map(|number| ShadowMap::new(geometry, direction(number), MAP_SIZE))
            .collect();
        let full = maps.iter().map(|map| map.direction.z).sum();
        Self { maps, full }
    }

    fn light(&self, point: Vec3, normal: Vec3) -> f32 {
        let light = |map: &ShadowMap| {
            let facing = normal.dot(map.direction);
            if facing <= 0.0 {
                return 0.0;
            }
            facing * map.lit(point, normal)
        };
        self.maps.iter().map(light).sum::<f32>() / self.full
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
    fn new(maps: &SkyMaps, point: Vec3, normal: Vec3, reach: f32) -> Self {
        let (first, second) = normal.any_orthonormal_pair();
        let step = 2.0 * reach / (GRID_SIDE - 1) as f32;
        let corner = point - reach * (first + second);
        let light = (0..GRID_SIDE * GRID_SIDE)
            .into_par_iter()
            .map(|index| {
                let (column, row) = (index % GRID_SIDE, index / GRID_SIDE);
                let along = column as f32 * first + row as f32 * second;
                maps.light(corner + step * along, normal)
            })
            .collect();
        Self { corner, first, second, step, light }
    }

    /// The light at `point`, which fades to that of an open floor at the edge of the grid.
    fn at(&self, point: Vec3) -> f32 {
        let from_corner = (point - self.corner) / self.step;
        let place = Vec2::new(from_corner.dot(self.first), from_corner.dot(self.second));
        let last = (GRID_SIDE - 1) as f32;
        if !(place.min_element() >= 0.0 && place.max_element() < last) {
            return 1.0;
        }
        let (column, row) = (place.x as usize, place.y as usize);
        let part = place - place.floor();
        let light = |column: usize, row: usize| self.light[row * GRID_SIDE + column];
        let mix = |a: f32, b: f32, part: f32| a + (b - a) * part;
        mix(
            mix(light(column, row), light(column + 1, row), part.x),
            mix(light(column, row + 1), light(column + 1, row + 1), part.x),
            part.y,
        )
    }
}
