//! Pictures of cloth and colliders, rendered on the CPU.
//!
//! A picture is made in three steps: render depth from the light (`shadow`) and from parts of the sky
//! (`sky`), find what is visible at four samples of every pixel (`raster`), and compute the colour of
//! it (`shade`), veiled by the dust before it (`dust`). What does not change from one picture of a clip to the next is made once: the floor
//! as the camera sees it, and solids that stand still with their depths.

mod camera;
mod dust;
mod error;
mod floor;
mod geometry;
mod legend;
mod overlays;
mod plane_light;
mod raster;
mod renderer;
mod scan;
mod shade;
mod shadow;
mod shape;
mod sky;
mod strain;
mod style;
mod tessellation;
mod threads;
mod tone;

use std::ops::Range;

use cloth_core::TextureMap;
use image::RgbImage;

pub use camera::{Bounds, Camera};
pub use dust::{PictureDust, PictureGrain};
pub use error::PictureError;
pub use legend::PictureLegend;
pub use overlays::{PictureOverlays, PictureStrain};
pub use renderer::PictureRenderer;
pub use shape::{PictureShape, PictureShapes, PictureSolid};
pub use strain::StrainMap;
pub use style::{PictureStyle, picture_palette};
pub(crate) use tessellation::Tessellation;
pub use threads::{ThreadDirection, ThreadMap, ThreadSegment};

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
    pub shapes: &'a [PictureSolid],
    /// Dust in the air.
    pub dust: &'a [PictureGrain],
    /// What is shown on the cloths, of the model whose triangles are the first ones.
    pub overlays: Option<&'a PictureOverlays>,
}

/// One cloth of a [`PictureScene`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureCloth {
    /// Its triangles.
    pub triangles: Range<usize>,
    /// Its colour as sRGB.
    pub color: [u8; 3],
}

/// Renders single pictures; a [`PictureRenderer`] is faster for several with one camera.
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
        PictureRenderer::new(camera, style)?.render(scene)
    }
}
