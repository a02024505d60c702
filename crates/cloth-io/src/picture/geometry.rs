//! All triangles of a picture in one list.

use glam::{Vec2, Vec3};

use super::camera::View;
use super::tessellation::Tessellation;
use super::{PictureError, PictureScene, PictureShape};

/// Half of the side of the square that stands for a plane, in radii of the scene.
const PLANE_REACH: f32 = 400.0;

/// What a triangle belongs to.
pub(super) enum Surface {
    /// A cloth of a colour (linear).
    Cloth { color: Vec3 },
    /// A solid collider.
    Solid,
    /// A plane through a point with a unit normal.
    Plane { point: Vec3, normal: Vec3 },
}

/// Triangles with everything that shading needs, relative to the origin of the view.
pub(super) struct Geometry {
    /// Positions \[m\].
    pub(super) positions: Vec<Vec3>,
    /// Unit normals of the vertices.
    pub(super) normals: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Index into `surfaces` of each triangle.
    pub(super) surface_of_triangle: Vec<u32>,
    pub(super) surfaces: Vec<Surface>,
    /// Texture coordinates of the corners of the first triangles, counted in checks.
    pub(super) checks: Vec<[Vec2; 3]>,
    /// Number of triangles that cast shadows; planes come after them.
    pub(super) caster_count: usize,
    /// Middle of the casters \[m\].
    pub(super) center: Vec3,
    /// Distance from the middle to the farthest caster \[m\].
    pub(super) radius: f32,
}

impl Geometry {
    pub(super) fn new(scene: &PictureScene<'_>, view: &View) -> Result<Self, PictureError> {
        let mut geometry = Self {
            positions: Vec::new(),
            normals: Vec::new(),
            triangles: Vec::new(),
            surface_of_triangle: Vec::new(),
            surfaces: Vec::new(),
            checks: Vec::new(),
            caster_count: 0,
            center: Vec3::ZERO,
            radius: 0.0,
        };
        geometry.add_cloths(scene, view)?;
        for shape in scene.shapes {
            let solid = Tessellation::of(shape);
            if !solid.triangles.is_empty() {
                geometry.surfaces.push(Surface::Solid);
                geometry.add(&solid, view)?;
            }
        }
        geometry.caster_count = geometry.triangles.len();
        geometry.measure(view);
        for shape in scene.shapes {
            if let PictureShape::Plane { normal, offset } = shape {
                geometry.add_plane(*normal, *offset, view);
            }
        }
        Ok(geometry)
    }

    /// The normal of a triangle, with the length of twice its area.
    pub(super) fn flat_normal(&self, triangle: usize) -> Vec3 {
        let corners = self.triangles[triangle].map(|index| self.positions[index as usize]);
        let [a, b, c] = corners;
        (b - a).cross(c - a)
    }

    fn add_cloths(&mut self, scene: &PictureScene<'_>, view: &View) -> Result<(), PictureError> {
        let check_size = check_size(scene);
        for cloth in &scene.cloths {
            let out_of_range = || PictureError::Index { triangle: cloth.triangles.start };
            let triangles = scene.triangles.get(cloth.triangles.clone());
            let triangles = triangles.ok_or_else(out_of_range)?;
            self.triangles.extend_from_slice(triangles);
            let surface = self.surfaces.len() as u32;
            self.surface_of_triangle.resize(self.triangles.len(), surface);
            self.surfaces.push(Surface::Cloth { color: linear(cloth.color) });
            let Some((texture, size)) = scene.texture.zip(check_size) else {
                continue;
            };
            for number in cloth.triangles.clone() {
                let corner = |index: u32| {
                    let coordinate = texture.coordinates.get(index as usize)?;
                    Some(Vec2::from(coordinate.map(|x| (x / size) as f32)))
                };
                let triangle = texture.triangles.get(number).map(|t| t.map(corner));
                let Some([Some(a), Some(b), Some(c)]) = triangle else {
                    return Err(PictureError::Index { triangle: number });
                };
                self.checks.push([a, b, c]);
            }
        }
        let count = scene.positions.len();
        let beyond = |t: &[u32; 3]| t.iter().any(|&index| index as usize >= count);
        if let Some(triangle) = self.triangles.iter().position(beyond) {
            return Err(PictureError::Index { triangle });
        }
        self.add_vertices(scene.positions, view)?;
        let normals = crate::frame::vertex_normals(scene.positions, &self.triangles);
        let normal = |n: [f64; 3]| Vec3::from(n.map(|x| x as f32));
        self.normals.extend(normals.into_iter().map(normal));
        Ok(())
    }

    /// Adds triangles of the last surface.
    fn add(&mut self, shape: &Tessellation, view: &View) -> Result<(), PictureError> {
        let start = self.positions.len() as u32;
        let count = shape.positions.len();
        for (triangle, corners) in shape.triangles.iter().enumerate() {
            if corners.iter().any(|&index| index as usize >= count) {
                return Err(PictureError::Index { triangle });
            }
            self.triangles.push(corners.map(|index| start + index));
        }
        self.add_vertices(&shape.positions, view)?;
        let normals = shape.normals.iter();
        self.normals.extend(normals.map(|n| Vec3::from(n.map(|x| x as f32))));
        let surface = self.surfaces.len() as u32 - 1;
        self.surface_of_triangle.resize(self.triangles.len(), surface);
        Ok(())
    }

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

    fn measure(&mut self, view: &View) {
        let corners = self.triangles.iter().flatten();
        let points = corners.map(|&index| self.positions[index as usize]);
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for point in points.clone() {
            min = min.min(point);
            max = max.max(point);
        }
        if !min.is_finite() {
            self.radius = 0.3 * view.eye.length();
            return;
        }
        let center = 0.5 * (min + max);
        let farthest = points.map(|point| point.distance_squared(center)).fold(0.0, f32::max);
        self.center = center;
        self.radius = farthest.sqrt().max(1e-6);
    }

    /// Adds a square that reaches to where the haze hides everything.
    fn add_plane(&mut self, normal: [f64; 3], offset: f64, view: &View) {
        let Some(normal) = glam::DVec3::from(normal).try_normalize() else {
            return;
        };
        let distance = (normal.dot(view.origin) - offset) as f32;
        let normal = normal.as_vec3();
        let point = self.center - normal * (normal.dot(self.center) + distance);
        let (first, second) = normal.any_orthonormal_pair();
        let reach = PLANE_REACH * self.radius.max(0.1 * view.eye.length());
        let start = self.positions.len() as u32;
        for (u, v) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            self.positions.push(point + reach * (u * first + v * second));
            self.normals.push(normal);
        }
        self.triangles.push([start, start + 1, start + 2]);
        self.triangles.push([start, start + 2, start + 3]);
        self.surfaces.push(Surface::Plane { point, normal });
        let surface = self.surfaces.len() as u32 - 1;
        self.surface_of_triangle.resize(self.triangles.len(), surface);
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
