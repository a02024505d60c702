//! Triangles of colliders and floors.

use std::f64::consts::{PI, TAU};

use cloth::{
    io::{PictureShape, PictureSolid},
    wgpu::wgpu,
};
use glam::{DMat3, DVec3};

use super::{
    cloth_mesh::SceneSphere,
    overlay::{colour_bytes, colour_linear, fill},
};
use crate::Gpu;

/// `Vertex` of solid.wgsl.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct SolidVertex {
    position: [f32; 3],
    normal: [f32; 3],
    plane: [f32; 3],
    /// In linear light, of solids.
    colour: [u8; 4],
}

impl SolidVertex {
    /// Bytes from one to the next.
    pub(super) const SIZE: u64 = size_of::<Self>() as u64;
}

/// Colour of solids that are given none.
fn grey() -> [u8; 4] {
    colour_bytes(PictureSolid::GREY.map(|light| (255.0 * light).round() as u8))
}

/// Kinds of surface, as solid.wgsl knows them.
const SOLID: f32 = 0.0;
const FLOOR: f32 = 1.0;
const GRID: f32 = 2.0;

/// Segments around balls and capsules.
const AROUND: usize = 64;
/// Segments from pole to pole.
const ALONG: usize = 32;

/// The solids of the last picture; kept while they do not move.
#[derive(Default)]
pub(super) struct SolidBuffers {
    shapes: Option<Vec<PictureSolid>>,
    solids: Option<wgpu::Buffer>,
    solid_count: u32,
    floors: Option<wgpu::Buffer>,
    floor_count: u32,
}

impl SolidBuffers {
    pub(super) fn update(&mut self, gpu: &Gpu, shapes: &[PictureSolid], scene: &SceneSphere) {
        if self.shapes.as_deref() == Some(shapes) {
            return;
        }
        let (mut solids, mut floors) = (Vec::new(), Vec::new());
        for solid in shapes {
            let first = solids.len();
            shape_triangles(&solid.shape, scene, &mut solids, &mut floors);
            let colour = solid.color.map_or_else(grey, colour_linear);
            solids[first..].iter_mut().for_each(|vertex: &mut SolidVertex| vertex.colour = colour);
        }
        if floors.is_empty() {
            // Something to see up and down by.
            let height = scene.center.z - scene.radius;
            plane(DVec3::Z, height, GRID, scene, &mut floors);
        }
        self.solid_count = fill(gpu, &mut self.solids, "solids", &solids);
        self.floor_count = fill(gpu, &mut self.floors, "floors", &floors);
        self.shapes = Some(shapes.to_vec());
    }

    pub(super) fn draw_solids(&self, pass: &mut wgpu::RenderPass<'_>) {
        draw(pass, self.solids.as_ref(), self.solid_count);
    }

    pub(super) fn draw_floors(&self, pass: &mut wgpu::RenderPass<'_>) {
        draw(pass, self.floors.as_ref(), self.floor_count);
    }
}

fn draw(pass: &mut wgpu::RenderPass<'_>, buffer: Option<&wgpu::Buffer>, count: u32) {
    if let Some(buffer) = buffer.filter(|_| count > 0) {
        pass.set_vertex_buffer(0, buffer.slice(..));
        pass.draw(0..count, 0..1);
    }
}

fn shape_triangles(
    shape: &PictureShape,
    scene: &SceneSphere,
    solids: &mut Vec<SolidVertex>,
    floors: &mut Vec<SolidVertex>,
) {
    match shape {
        PictureShape::Sphere { center, radius } => {
            round(DVec3::from(*center), DVec3::from(*center), *radius, solids);
        }
        PictureShape::Capsule { a, b, radius } => {
            round(DVec3::from(*a), DVec3::from(*b), *radius, solids);
        }
        PictureShape::Cuboid { center, rotation, half_extents } => {
            let rotation = DMat3::from_cols_array_2d(rotation).transpose();
            cuboid(DVec3::from(*center), rotation, DVec3::from(*half_extents), solids);
        }
        PictureShape::Plane { normal, offset } => {
            let normal = DVec3::from(*normal).normalize_or(DVec3::Z);
            plane(normal, *offset, FLOOR, scene, floors);
        }
        PictureShape::Mesh { positions, triangles } => mesh(positions, triangles, solids),
        // Shapes of later versions are not drawn.
        _ => {}
    }
}

fn vertex(position: DVec3, normal: DVec3, kind: f32) -> SolidVertex {
    SolidVertex {
        position: position.as_vec3().to_array(),
        normal: normal.as_vec3().to_array(),
        plane: [0.0, 0.0, kind],
        colour: [0; 4],
    }
}

fn quad(corners: [SolidVertex; 4], out: &mut Vec<SolidVertex>) {
    let [a, b, c, d] = corners;
    out.extend([a, b, c, a, c, d]);
}

/// All points at `radius` from the segment between two points, which may be the same.
fn round(a: DVec3, b: DVec3, radius: f64, out: &mut Vec<SolidVertex>) {
    let axis = (b - a).normalize_or(DVec3::Z);
    let side = axis.any_orthonormal_vector();
    let other = axis.cross(side);
    let point = |row: usize, column: usize| {
        // The row in the middle is there twice, once for each end.
        let end = if row <= ALONG / 2 { a } else { b };
        let row = if row <= ALONG / 2 { row } else { row - 1 };
        let down = PI * row as f64 / ALONG as f64;
        let turn = TAU * column as f64 / AROUND as f64;
        let normal = down.sin() * (turn.cos() * side + turn.sin() * other) - down.cos() * axis;
        vertex(end + radius * normal, normal, SOLID)
    };
    for row in 0..=ALONG {
        for column in 0..AROUND {
            let next = (column + 1) % AROUND;
            quad(
                [
                    point(row, column),
                    point(row, next),
                    point(row + 1, next),
                    point(row + 1, column),
                ],
                out,
            );
        }
    }
}

fn cuboid(center: DVec3, rotation: DMat3, half: DVec3, out: &mut Vec<SolidVertex>) {
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let mut normal = DVec3::ZERO;
            normal[axis] = sign;
            let corner = |u: f64, v: f64| {
                let mut local = DVec3::ZERO;
                local[axis] = sign * half[axis];
                local[(axis + 1) % 3] = u * half[(axis + 1) % 3];
                local[(axis + 2) % 3] = v * sign * half[(axis + 2) % 3];
                vertex(center + rotation * local, rotation * normal, SOLID)
            };
            quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], out);
        }
    }
}

/// A large square of the plane below the scene.
fn plane(normal: DVec3, offset: f64, kind: f32, scene: &SceneSphere, out: &mut Vec<SolidVertex>) {
    let side = if normal.z.abs() > 0.99 { DVec3::X } else { DVec3::Z.cross(normal).normalize() };
    let other = normal.cross(side);
    let middle = scene.center + (offset - scene.center.dot(normal)) * normal;
    let reach = 10.0 * scene.radius;
    let corner = |u: f64, v: f64| {
        let place = middle + reach * (u * side + v * other);
        let along = [place.dot(side) as f32, place.dot(other) as f32, kind];
        SolidVertex { plane: along, ..vertex(place, normal, kind) }
    };
    quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)], out);
}

fn mesh(positions: &[[f64; 3]], triangles: &[[u32; 3]], out: &mut Vec<SolidVertex>) {
    let normals = cloth::io::vertex_normals(positions, triangles);
    for &particle in triangles.iter().flatten() {
        let (Some(&position), Some(&normal)) =
            (positions.get(particle as usize), normals.get(particle as usize))
        else {
            continue;
        };
        out.push(vertex(position.into(), normal.into(), SOLID));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: SceneSphere = SceneSphere { center: DVec3::ZERO, radius: 1.0 };

    fn solids(shape: &PictureShape) -> Vec<SolidVertex> {
        let (mut solids, mut floors) = (Vec::new(), Vec::new());
        shape_triangles(shape, &SCENE, &mut solids, &mut floors);
        assert!(floors.is_empty());
        solids
    }

    #[test]
    fn every_vertex_of_a_capsule_is_at_its_radius() {
        let (a, b) = ([0.1, 0.2, 0.3], [0.5, -0.4, 0.9]);
        let vertices = solids(&PictureShape::Capsule { a, b, radius: 0.25 });
        let (a, b) = (DVec3::from(a), DVec3::from(b));
        for vertex in &vertices {
            let point = DVec3::from(vertex.position.map(f64::from));
            let along = ((point - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            let distance = point.distance(a + along * (b - a));
            assert!((distance - 0.25).abs() < 1e-6, "{distance}");
        }
    }

    #[test]
    fn normals_agree_with_the_order_of_the_corners() {
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for shape in [
            PictureShape::Sphere { center: [0.3; 3], radius: 0.7 },
            PictureShape::Cuboid {
                center: [0.1; 3],
                rotation: identity,
                half_extents: [0.1, 0.2, 0.3],
            },
        ] {
            for triangle in solids(&shape).chunks(3) {
                let [a, b, c] = [0, 1, 2].map(|k| DVec3::from(triangle[k].position.map(f64::from)));
                let normal = DVec3::from(triangle[0].normal.map(f64::from));
                // Triangles at the poles have no area.
                assert!((b - a).cross(c - a).dot(normal) > -1e-12, "{shape:?}");
            }
        }
    }
}
