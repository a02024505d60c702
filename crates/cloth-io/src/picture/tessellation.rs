//! Turns shapes into triangles with smooth normals.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};

use super::PictureShape;

/// Triangles of a shape.
#[derive(Default)]
pub(crate) struct Tessellation {
    /// Positions \[m\].
    pub(crate) positions: Vec<[f64; 3]>,
    /// Unit normals.
    pub(crate) normals: Vec<[f64; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
}

/// Segments around a ball.
const AROUND: usize = 64;
/// Segments from pole to pole of a ball; even, so that a capsule can be parted at the equator.
const ALONG: usize = 32;
/// Squares along the edge of a box; its light changes from square to square.
const FACE_STEPS: u32 = 16;

impl Tessellation {
    /// The triangles of `shape`; a plane, which has no end, gives none.
    pub(crate) fn of(shape: &PictureShape) -> Self {
        match shape {
            PictureShape::Sphere { center, radius } => {
                round(DVec3::from(*center), DVec3::from(*center), *radius)
            }
            PictureShape::Capsule { a, b, radius } => round((*a).into(), (*b).into(), *radius),
            PictureShape::Cuboid { center, rotation, half_extents } => cuboid(
                DVec3::from(*center),
                DMat3::from_cols_array_2d(rotation).transpose(),
                DVec3::from(*half_extents),
            ),
            PictureShape::Plane { .. } => Self::default(),
            PictureShape::Mesh { positions, triangles } => Self {
                positions: positions.to_vec(),
                normals: crate::frame::vertex_normals(positions, triangles),
                triangles: triangles.to_vec(),
            },
        }
    }
}

/// A capsule from `a` to `b`, or a ball if they are the same.
fn round(a: DVec3, b: DVec3, radius: f64) -> Tessellation {
    let axis = (b - a).try_normalize().unwrap_or(DVec3::Z);
    let (side, other) = axis.any_orthonormal_pair();
    let mut shape = Tessellation::default();
    // The ring at the equator is there twice, once for each end.
    for (ring, along) in (0..=ALONG / 2).chain(ALONG / 2..=ALONG).enumerate() {
        let center = if ring <= ALONG / 2 { a } else { b };
        let angle = PI * along as f64 / ALONG as f64;
        for segment in 0..=AROUND {
            let around = TAU * segment as f64 / AROUND as f64;
            let outward = around.cos() * side + around.sin() * other;
            let normal = angle.sin() * outward - angle.cos() * axis;
            shape.positions.push((center + radius * normal).to_array());
            shape.normals.push(normal.to_array());
        }
    }
    let row = AROUND as u32 + 1;
    for ring in 0..=ALONG as u32 {
        for segment in 0..AROUND as u32 {
            let corner = ring * row + segment;
            shape.triangles.push([corner, corner + 1, corner + row + 1]);
            shape.triangles.push([corner, corner + row + 1, corner + row]);
        }
    }
    shape
}

fn cuboid(center: DVec3, rotation: DMat3, half: DVec3) -> Tessellation {
    let mut shape = Tessellation::default();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let mut normal = DVec3::ZERO;
            normal[axis] = sign;
            let mut first = DVec3::ZERO;
            first[(axis + 1) % 3] = half[(axis + 1) % 3];
            let mut second = DVec3::ZERO;
            second[(axis + 2) % 3] = sign * half[(axis + 2) % 3];
            let start = shape.positions.len() as u32;
            let part = |step: u32| 2.0 * f64::from(step) / f64::from(FACE_STEPS) - 1.0;
            for row in 0..=FACE_STEPS {
                for column in 0..=FACE_STEPS {
                    let corner = normal * half[axis] + part(column) * first + part(row) * second;
                    shape.positions.push((center + rotation * corner).to_array());
                    shape.normals.push((rotation * normal).to_array());
                }
            }
            let width = FACE_STEPS + 1;
            for row in 0..FACE_STEPS {
                for column in 0..FACE_STEPS {
                    let corner = start + row * width + column;
                    shape.triangles.push([corner, corner + 1, corner + width + 1]);
                    shape.triangles.push([corner, corner + width + 1, corner + width]);
                }
            }
        }
    }
    shape
}

#[cfg(test)]
mod tests {
    use super::*;

    fn enclosed_volume(shape: &PictureShape) -> f64 {
        let shape = Tessellation::of(shape);
        let corner = |index: u32| DVec3::from(shape.positions[index as usize]);
        let volume = |t: &[u32; 3]| corner(t[0]).dot(corner(t[1]).cross(corner(t[2]))) / 6.0;
        shape.triangles.iter().map(volume).sum()
    }

    #[test]
    fn shapes_enclose_their_volume_with_triangles_that_face_out() {
        let sphere = PictureShape::Sphere { center: [1.0, 2.0, 3.0], radius: 0.5 };
        let expected = 4.0 / 3.0 * PI * 0.125;
        assert!((enclosed_volume(&sphere) / expected - 1.0).abs() < 0.01);
        let capsule = PictureShape::Capsule { a: [0.0, 1.0, 0.0], b: [0.0, 1.0, 2.0], radius: 0.5 };
        let expected = expected + 2.0 * PI * 0.25;
        assert!((enclosed_volume(&capsule) / expected - 1.0).abs() < 0.01);
        let cuboid = PictureShape::Cuboid {
            center: [0.0, 5.0, 0.0],
            rotation: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
            half_extents: [1.0, 2.0, 3.0],
        };
        assert!((enclosed_volume(&cuboid) - 48.0).abs() < 1e-9);
        // Turned by a right angle about Z, the long edges change places.
        assert_eq!(cuboid.bounds().min, [-2.0, 4.0, -3.0]);
    }
}
