//! Colliders and floor in pictures.

use std::fmt;
use std::sync::Arc;

use super::Bounds;

/// A solid in a picture. Lengths in metres, the Z axis points up.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PictureShape {
    /// A ball.
    Sphere {
        /// Middle \[m\].
        center: [f64; 3],
        /// Radius \[m\].
        radius: f64,
    },
    /// A cylinder with half balls at its ends.
    Capsule {
        /// Middle of one half ball \[m\].
        a: [f64; 3],
        /// Middle of the other half ball \[m\].
        b: [f64; 3],
        /// Radius \[m\].
        radius: f64,
    },
    /// A box.
    Cuboid {
        /// Middle \[m\].
        center: [f64; 3],
        /// The rotation matrix by rows: a point p of the unturned box comes to `rotation` p.
        rotation: [[f64; 3]; 3],
        /// Half of the length of each edge \[m\].
        half_extents: [f64; 3],
    },
    /// An endless plane of all points p with `normal` · p = `offset`, shown as a floor of tiles.
    Plane {
        /// Direction away from the solid side; its length does not matter.
        normal: [f64; 3],
        /// Distance from the origin along the unit normal \[m\].
        offset: f64,
    },
    /// A triangle mesh.
    Mesh {
        /// Positions of the vertices \[m\].
        positions: Arc<[[f64; 3]]>,
        /// Vertex indices of each triangle.
        triangles: Arc<[[u32; 3]]>,
    },
}

impl PictureShape {
    /// The box around the shape; empty for planes, which have no end.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        let ball = |center: &[f64; 3], radius: f64| Bounds {
            min: center.map(|x| x - radius),
            max: center.map(|x| x + radius),
        };
        match self {
            Self::Sphere { center, radius } => ball(center, *radius),
            Self::Capsule { a, b, radius } => ball(a, *radius).union(&ball(b, *radius)),
            Self::Cuboid { center, rotation, half_extents } => {
                let reach = |row: &[f64; 3]| -> f64 {
                    row.iter().zip(half_extents).map(|(r, h)| (r * h).abs()).sum()
                };
                let mut bounds = ball(center, 0.0);
                for (axis, row) in rotation.iter().enumerate() {
                    bounds.min[axis] -= reach(row);
                    bounds.max[axis] += reach(row);
                }
                bounds
            }
            Self::Plane { .. } => Bounds::EMPTY,
            Self::Mesh { positions, .. } => Bounds::of(positions),
        }
    }
}

/// A solid, and how it looks.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureSolid {
    /// Where it is.
    pub shape: PictureShape,
    /// Its colour as sRGB; light grey without. Planes are shown as floors of tiles, whatever it is.
    pub color: Option<[u8; 3]>,
}

impl PictureSolid {
    /// Colour of what is given none, in linear light.
    pub const GREY: [f32; 3] = [0.5, 0.48, 0.45];
}

impl From<PictureShape> for PictureSolid {
    fn from(shape: PictureShape) -> Self {
        Self { shape, color: None }
    }
}

/// The solids of a scene over time.
#[derive(Clone)]
pub struct PictureShapes(Arc<dyn Fn(f64) -> Vec<PictureSolid> + Send + Sync>);

impl PictureShapes {
    /// Solids that do not move.
    #[must_use]
    pub fn fixed(solids: Vec<PictureSolid>) -> Self {
        Self(Arc::new(move |_| solids.clone()))
    }

    /// Solids as a function of time \[s\].
    #[must_use]
    pub fn moving(solids: impl Fn(f64) -> Vec<PictureSolid> + Send + Sync + 'static) -> Self {
        Self(Arc::new(solids))
    }

    /// The solids at `time` \[s\].
    #[must_use]
    pub fn at(&self, time: f64) -> Vec<PictureSolid> {
        (self.0)(time)
    }
}

impl Default for PictureShapes {
    fn default() -> Self {
        Self::fixed(Vec::new())
    }
}

impl fmt::Debug for PictureShapes {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("PictureShapes").finish_non_exhaustive()
    }
}
