//! How the pictures of a run look.

use super::{Camera, PictureDust, PictureOverlays, PictureShapes};

/// Size, view and colours of pictures.
#[derive(Clone, Debug)]
pub struct PictureStyle {
    /// Width \[pixel\].
    pub width: u32,
    /// Height \[pixel\].
    pub height: u32,
    /// The camera; `None` shows everything.
    pub camera: Option<Camera>,
    /// Colour of each cloth as sRGB; those that are missing come from [`picture_palette`].
    pub cloth_colors: Vec<[u8; 3]>,
    /// Colliders and floor in the pictures.
    pub shapes: PictureShapes,
    /// Dust in the air of the pictures.
    pub dust: PictureDust,
    /// What is shown on the cloths of a model.
    pub overlays: PictureOverlays,
    /// Background as sRGB, at the upper and the lower edge.
    pub background: [[u8; 3]; 2],
}

impl Default for PictureStyle {
    fn default() -> Self {
        Self {
            width: 1280,
            height: 720,
            camera: None,
            cloth_colors: Vec::new(),
            shapes: PictureShapes::default(),
            dust: PictureDust::default(),
            overlays: PictureOverlays::default(),
            background: [[186, 200, 214], [238, 240, 242]],
        }
    }
}

impl PictureStyle {
    /// Width divided by height.
    #[must_use]
    pub fn aspect(&self) -> f64 {
        f64::from(self.width.max(1)) / f64::from(self.height.max(1))
    }
}

/// The colour, as sRGB, of the cloth with that `number`, zero based; the colours repeat after eight.
#[must_use]
pub fn picture_palette(number: usize) -> [u8; 3] {
    const COLORS: [[u8; 3]; 8] = [
        [196, 58, 62],
        [46, 110, 172],
        [228, 166, 58],
        [74, 146, 104],
        [132, 92, 164],
        [54, 156, 162],
        [218, 116, 148],
        [132, 112, 92],
    ];
    COLORS[number % COLORS.len()]
}
