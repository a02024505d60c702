//! Pictures of cloth and colliders, rendered on the CPU.
//!
//! A picture is made in three steps: find which triangle is visible at four samples of every
//! pixel (`raster`), render depth from the light (`shadow`) and from parts of the sky (`sky`), and
//! compute the colour of what is visible (`shade`).

mod camera;
mod error;
mod floor;
mod geometry;
mod raster;
mod shade;
mod shadow;
mod shape;
mod sky;
mod style;
mod tessellation;

use std::ops::Range;

use cloth_core::TextureMap;
use image::RgbImage;

pub use camera::{Bounds, Camera};
pub use error::PictureError;
pub use shape::{PictureShape, PictureShapes};
pub use style::{PictureStyle, picture_palette};
pub(crate) use tessellation::Tessellation;

/// Largest width and height of a picture \[pixel\].
pub const PICTURE_SIDE_LIMIT: u32 = 8192;

/// What is in a picture. The Z axis points up; lengths in metres.
#[derive(Clone, Debug)]
pub struct PictureScene<'a> {
    /// Positions of all particles \[m\].
    pub positions: &'a [[f64; 3]],
    /// Particle indices of each triangle, counter-clockwise seen from the front.
    pub triangles: &'a [[u32; 3]],
    /// Texture coordinates of the triangles; they carry a checked pattern.
    pub texture: Option<&'a TextureMap>,
    /// The cloths to show.
    pub cloths: Vec<PictureCloth>,
    /// Colliders and the floor.
    pub shapes: &'a [PictureShape],
}

/// One cloth of a [`PictureScene`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureCloth {
    /// Its triangles.
    pub triangles: Range<usize>,
    /// Its colour as sRGB.
    pub color: [u8; 3],
}

/// The renderer.
#[derive(Debug)]
pub struct Picture;

impl Picture {
    /// Renders `scene` as `camera` sees it, with the size and background of `style` (its camera,
    /// shapes and cloth colours belong to animations and are not used here).
    ///
    /// # Errors
    ///
    /// [`PictureError`] if the size is zero or above [`PICTURE_SIDE_LIMIT`], the camera is
    /// degenerate, an index is out of range, or a position is not finite.
    pub fn render(
        scene: &PictureScene<'_>,
        camera: &Camera,
        style: &PictureStyle,
    ) -> Result<RgbImage, PictureError> {
        let (width, height) = (style.width, style.height);
        if ![width, height].iter().all(|side| (1..=PICTURE_SIDE_LIMIT).contains(side)) {
            return Err(PictureError::Size { width, height });
        }
        let view = camera::View::new(camera, width, height)?;
        let geometry = geometry::Geometry::new(scene, &view)?;
        let key = shadow::ShadowMap::of_key_light(&geometry, &view);
        let sky = sky::Sky::new(&geometry);
        let visibility = raster::Visibility::of_view(&geometry, &view);
        let shader = shade::Shader::new(&geometry, &view, &key, &sky, style);
        Ok(shader.image(&visibility))
    }
}
