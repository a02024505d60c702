//! Triangles and planes of a picture, in the coordinates of its view.

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::camera::View;
use super::strain::heat;
use super::tessellation::Tessellation;
use super::{
    PictureError, PictureOverlays, PictureScene, PictureShape, PictureSolid, ThreadDirection,
};

/// Triangles with everything that shading needs, relative to the origin of the view.
#[derive(Default)]
pub(super) struct Mesh {
    /// Positions \[m\].
    pub(super) positions: Vec<Vec3>,
    /// Unit normals of the vertices.
    pub(super) normals: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Normal of each triangle, with the length of twice its area.
    pub(super) flat_normals: Vec<Vec3>,
    /// The cloth or the solid that each triangle belongs to.
    pub(super) surface_of_triangle: Vec<u32>,
}

impl Mesh {
    fn add_vertices(&mut self, positions: &[[f64; 3]], view: &View) -> Result<(), PictureError> {
        for (particle, &position) in positions.iter().enumerate() {
            let position = view.local(position);
            if !position.is_finite() {
                return Err(PictureError::Position { particle });
            }
            self.positions.push(position);
        }
        Ok(())
    }

    fn flatten(&mut self) {
        let normal = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|index| self.positions[index as usize]);
            (b - a).cross(c - a)
        };
        self.flat_normals = self.triangles.iter().map(normal).collect();
    }

    /// Positions of all corners \[m\].
    fn corners(&self) -> impl Iterator<Item = Vec3> + Clone + '_ {
        self.triangles.iter().flatten().map(|&index| self.positions[index as usize])
    }
}

/// All solids of a picture. Planes are none: they have no end, and nothing is in their shadow.
pub(super) fn solids(shapes: &[PictureSolid], view: &View) -> Result<Mesh, PictureError> {
    let mut mesh = Mesh::default();
    for (number, shape) in shapes.iter().enumerate() {
        let solid = Tessellation::of(&shape.shape);
        let start = mesh.positions.len() as u32;
        let count = solid.positions.len();
        for (triangle, corners) in solid.triangles.iter().enumerate() {
            if corners.iter().any(|&index| index as usize >= count) {
                return Err(PictureError::Index { triangle });
            }
            mesh.triangles.push(corners.map(|index| start + index));
        }
        mesh.surface_of_triangle.resize(mesh.triangles.len(), number as u32);
        mesh.add_vertices(&solid.positions, view)?;
        mesh.normals.extend(solid.normals.iter().map(|n| Vec3::from(n.map(|x| x as f32))));
    }
    mesh.flatten();
    Ok(mesh)
}

/// The cloths of a picture.
pub(super) struct Cloths {
    pub(super) mesh: Mesh,
    /// Colour of each cloth in linear light.
    pub(super) colors: Vec<Vec3>,
    /// Texture coordinates of the corners of each triangle, counted in checks, if there are any.
    pub(super) checks: Vec<[Vec2; 3]>,
    /// Elongation of each particle as a share of what is shown in red, if that is to be seen; vertices that are no particles have none.
    strains: Vec<f32>,
    /// Corners of each triangle along warp and weft, counted in distances of threads, if these are to be seen.
    threads: Vec<Option<[Vec2; 3]>>,
}

impl Cloths {
    pub(super) fn new(scene: &PictureScene<'_>, view: &View) -> Result<Self, PictureError> {
        let mut mesh = Mesh::default();
        let mut checks = Vec::new();
        let check_size = check_size(scene);
        for (number, cloth) in scene.cloths.iter().enumerate() {
            let triangles = scene.triangles.get(cloth.triangles.clone());
            let out_of_range = || PictureError::Index { triangle: cloth.triangles.start };
            mesh.triangles.extend_from_slice(triangles.ok_or_else(out_of_range)?);
            mesh.surface_of_triangle.resize(mesh.triangles.len(), number as u32);
            let Some((texture, size)) = scene.texture.zip(check_size) else { continue };
            for number in cloth.triangles.clone() {
                let corner = |index: u32| {
                    let coordinate = texture.coordinates.get(index as usize)?;
                    Some(Vec2::from(coordinate.map(|x| (x / size) as f32)))
                };
                let triangle = texture.triangles.get(number).map(|t| t.map(corner));
                let Some([Some(a), Some(b), Some(c)]) = triangle else {
                    return Err(PictureError::Index { triangle: number });
                };
                checks.push([a, b, c]);
            }
        }
        let count = scene.positions.len();
        let beyond = |t: &[u32; 3]| t.iter().any(|&index| index as usize >= count);
        if let Some(triangle) = mesh.triangles.iter().position(beyond) {
            return Err(PictureError::Index { triangle });
        }
        mesh.add_vertices(scene.positions, view)?;
        let normals = crate::frame::vertex_normals(scene.positions, &mesh.triangles);
        mesh.normals = normals.into_iter().map(|n| Vec3::from(n.map(|x| x as f32))).collect();
        mesh.flatten();
        let colors = scene.cloths.iter().map(|cloth| linear(cloth.color)).collect();
        let (strains, threads) = match scene.overlays {
            Some(overlays) => (strains(overlays, scene)?, threads(overlays, scene)?),
            None => (Vec::new(), Vec::new()),
        };
        Ok(Self { mesh, colors, checks, strains, threads })
    }

    /// The colour of the strain at a place of a triangle, if it is known.
    pub(super) fn heat(&self, triangle: usize, weights: &[f32; 3]) -> Option<Vec3> {
        let corners = self.mesh.triangles[triangle].map(|index| self.strains.get(index as usize));
        let parts = corners.into_iter().zip(weights);
        let share: f32 = parts.map(|(share, weight)| Some(share? * weight)).sum::<Option<f32>>()?;
        Some(heat(share))
    }

    /// Where the corners of a triangle lie among the threads, if it has any.
    pub(super) fn thread_corners(&self, triangle: usize) -> Option<&[Vec2; 3]> {
        self.threads.get(triangle)?.as_ref()
    }
}

/// Shares of the hottest strain at the particles.
fn strains(overlays: &PictureOverlays, scene: &PictureScene<'_>) -> Result<Vec<f32>, PictureError> {
    let Some(strain) = &overlays.strain else { return Ok(Vec::new()) };
    let particles = scene.positions.get(..strain.map.particle_count());
    if strain.map.triangle_count() > scene.triangles.len() {
        return Err(PictureError::Overlays);
    }
    let strains = strain.map.at_particles(particles.ok_or(PictureError::Overlays)?, strain.measure);
    Ok(strains.into_iter().map(|own| (own / strain.scale) as f32).collect())
}

/// Places among the threads of the triangles of all cloths of a scene, one cloth after the other.
fn threads(
    overlays: &PictureOverlays,
    scene: &PictureScene<'_>,
) -> Result<Vec<Option<[Vec2; 3]>>, PictureError> {
    let Some(map) = overlays.threads.as_ref().filter(|map| !map.is_empty()) else {
        return Ok(Vec::new());
    };
    if map.triangle_count() > scene.triangles.len() {
        return Err(PictureError::Overlays);
    }
    let triangles = scene.cloths.iter().flat_map(|cloth| cloth.triangles.clone());
    let corners = |place: [[f64; 2]; 3]| place.map(|corner| Vec2::from(corner.map(|x| x as f32)));
    Ok(triangles.map(|triangle| map.place(triangle).map(corners)).collect())
}

/// How the threads colour a cloth of `color` at a `place` among them, where a pixel is as wide as `footprint`; all counted in distances of
/// threads. Threads are at least as wide as a pixel, and vanish where they would run into each other.
pub(super) fn thread_color(color: Vec3, place: Vec2, footprint: Vec2) -> Vec3 {
    /// Half of the width of a thread, and of the least one \[pixel\].
    const HALF: f32 = 0.035;
    const HALF_PIXEL: f32 = 0.65;
    let mut color = color;
    for direction in ThreadDirection::ALL {
        let pixel = footprint[direction.across()].max(1e-6);
        let level = place[direction.across()];
        // Threads lie in the middle between whole numbers.
        let distance = (level - level.floor() - 0.5).abs();
        let covered = ((HALF.max(HALF_PIXEL * pixel) - distance) / pixel + 0.5).clamp(0.0, 1.0);
        let apart = (2.0 - 5.0 * pixel).clamp(0.0, 1.0);
        color = color.lerp(linear(direction.colour()), covered * apart);
    }
    color
}

/// A plane through a point with a unit normal.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plane {
    pub(super) point: Vec3,
    pub(super) normal: Vec3,
    /// Unit vectors along the tiles.
    pub(super) axes: [Vec3; 2],
    /// Where the point lies along them in the scene \[m\].
    pub(super) place: DVec2,
}

impl Plane {
    /// Distance of `point` from the plane \[m\].
    pub(super) fn distance(&self, point: Vec3) -> f32 {
        self.normal.dot(point - self.point)
    }
}

/// The planes among `shapes`, in their order.
pub(super) fn planes(shapes: &[PictureSolid], view: &View) -> Vec<Plane> {
    let plane = |solid: &PictureSolid| {
        let PictureShape::Plane { normal, offset } = &solid.shape else { return None };
        let normal = DVec3::from(*normal).try_normalize()?;
        let point = -normal * (normal.dot(view.origin) - offset);
        let (first, second) = normal.any_orthonormal_pair();
        let in_scene = view.origin + point;
        let place = DVec2::new(first.dot(in_scene), second.dot(in_scene));
        let axes = [first.as_vec3(), second.as_vec3()];
        let plane = Plane { point: point.as_vec3(), normal: normal.as_vec3(), axes, place };
        plane.point.is_finite().then_some(plane)
    };
    shapes.iter().filter_map(plane).collect()
}

/// The ball that holds all that casts a shadow. Its middle and its radius take few values, so that
/// from one picture of a clip to the next the maps of the lights mostly stay where they are, and
/// edges of shadows with them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stage {
    /// Middle \[m\].
    pub(super) center: Vec3,
    /// Radius \[m\].
    pub(super) radius: f32,
}

impl Stage {
    /// Ratio of one radius to the next smaller one.
    const STEP: f32 = 1.25;
    /// Steps of the middle in a radius.
    const CELLS: f32 = 8.0;

    pub(super) fn of(meshes: [&Mesh; 2], view: &View) -> Self {
        let corners = || meshes.into_iter().flat_map(Mesh::corners);
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for point in corners() {
            min = min.min(point);
            max = max.max(point);
        }
        if !min.is_finite() {
            return Self { center: Vec3::ZERO, radius: 0.3 * view.eye.length() };
        }
        let center = 0.5 * (min + max);
        let farthest = corners().map(|point| point.distance_squared(center)).fold(0.0, f32::max);
        let needed = farthest.sqrt().max(1e-6);
        let mut radius = Self::STEP.powi((needed.ln() / Self::STEP.ln()).floor() as i32);
        while radius < needed {
            radius *= Self::STEP;
        }
        let cell = radius / Self::CELLS;
        // The middle moves by at most half of the diagonal of a cell.
        let stage = Self { center: (center / cell).round() * cell, radius: radius + 0.9 * cell };
        let is_finite = stage.center.is_finite() && stage.radius.is_finite();
        if is_finite { stage } else { Self { center, radius: needed } }
    }
}

/// The size of a check in texture coordinates: the texture has about 20 of them along its longer
/// side.
fn check_size(scene: &PictureScene<'_>) -> Option<f64> {
    let coordinates = &scene.texture?.coordinates;
    let extent = |axis: usize| {
        let values = coordinates.iter().map(|coordinate| coordinate[axis]);
        values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
    };
    let extent = extent(0).max(extent(1));
    (extent.is_finite() && extent > 0.0).then_some(extent / 20.0)
}

/// A colour from sRGB to linear light.
pub(super) fn linear(color: [u8; 3]) -> Vec3 {
    let channel = |channel: u8| {
        let value = f32::from(channel) / 255.0;
        if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
    };
    Vec3::from(color.map(channel))
}

#[cfg(test)]
mod tests {
    use super::super::{Bounds, Camera};
    use super::*;

    /// A stage holds everything, and a small motion does not move it.
    #[test]
    fn a_stage_holds_all_and_stays_while_the_cloth_moves_a_little() {
        let camera = Camera::fit(&Bounds::of(&[[-1.0; 3], [1.0; 3]]), 1.5);
        let view = View::new(&camera, 32, 32).unwrap();
        let mut stages = Vec::new();
        for step in 0..50 {
            let shift = 0.001 * step as f32;
            let corners = [[0.1, 0.2, 0.3], [1.0, 0.5, 0.2], [0.4, 0.9, -0.6]];
            let positions = corners.map(|corner| Vec3::from(corner) + shift).to_vec();
            let mesh = Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() };
            let stage = Stage::of([&mesh, &Mesh::default()], &view);
            for point in &mesh.positions {
                assert!(point.distance(stage.center) <= stage.radius);
            }
            stages.push(stage);
        }
        stages.dedup();
        assert!(stages.len() <= 3, "{stages:?}");
    }
}
