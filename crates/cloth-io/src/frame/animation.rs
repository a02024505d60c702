//! Renders the frames of a run with one camera and one style.

use std::ops::Range;
use std::path::Path;

use image::RgbImage;
use image::imageops::{FilterType, resize};
use rayon::prelude::*;

use super::container::ContainerSource;
use super::strands::PictureMesh;
use super::{FrameError, FrameStore, Topology};
use crate::picture::{
    Bounds, Camera, PictureCloth, PictureError, PictureRenderer, PictureScene, PictureStyle,
    picture_palette,
};

/// Pixels of the pictures that are made at the same time, which limits the memory that they take.
const BATCH_PIXELS: usize = 8 << 20;

/// How many pictures of that size \[pixel\] are made at the same time.
pub(super) fn batch_limit(size: [u32; 2]) -> usize {
    let pixels = size[0] as usize * size[1] as usize;
    (BATCH_PIXELS / pixels.max(1)).clamp(1, 2 * rayon::current_num_threads())
}

/// The renderer of a run.
#[derive(Debug)]
pub(super) struct PictureAnimation {
    style: PictureStyle,
    renderer: PictureRenderer,
}

impl PictureAnimation {
    /// Prepares to render; without a camera in `style`, the view shows all of `samples`, which are
    /// times \[s\] and positions \[m\].
    pub(super) fn new<'p>(
        style: PictureStyle,
        samples: impl IntoIterator<Item = (f64, &'p [[f64; 3]])>,
    ) -> Result<Self, PictureError> {
        let camera = match style.camera {
            Some(camera) => camera,
            None => {
                let mut bounds = Bounds::EMPTY;
                for (time, positions) in samples {
                    bounds = bounds.union(&Bounds::of(positions));
                    for shape in style.shapes.at(time) {
                        bounds = bounds.union(&shape.shape.bounds());
                    }
                }
                Camera::fit(&bounds, style.aspect())
            }
        };
        let renderer = PictureRenderer::new(&camera, &style)?;
        Ok(Self { style, renderer })
    }

    /// Prepares to render frames of `store`; without a camera, the view shows the whole run.
    pub(super) fn of_store(
        style: &PictureStyle,
        store: &FrameStore,
        frames: &[usize],
    ) -> Result<Self, FrameError> {
        // A few moments are enough to know where the cloth goes.
        let step = frames.len().div_ceil(16).max(1);
        let mut samples = Vec::new();
        if style.camera.is_none() {
            for &index in frames.iter().step_by(step).chain(frames.last()) {
                let frame = store.frame(index)?;
                samples.push((frame.time, frame.positions_f64()));
            }
        }
        let samples = samples.iter().map(|(time, positions)| (*time, positions.as_slice()));
        Ok(Self::new(style.clone(), samples)?)
    }

    /// Renders the cloth at `positions` \[m\] and the shapes at `time` \[s\].
    pub(super) fn render(
        &self,
        topology: &Topology,
        time: f64,
        positions: &[[f64; 3]],
    ) -> Result<RgbImage, PictureError> {
        let mesh = PictureMesh::of(topology, positions);
        let cloth = |(number, triangles): &(usize, Range<usize>)| PictureCloth {
            triangles: triangles.clone(),
            color: match self.style.cloth_colors.get(*number) {
                Some(&color) => color,
                None => picture_palette(*number),
            },
        };
        let scene = PictureScene {
            positions: &mesh.positions,
            triangles: &mesh.triangles,
            texture: mesh.texture.as_deref(),
            cloths: mesh.cloths.iter().map(cloth).collect(),
            shapes: &self.style.shapes.at(time),
            dust: &self.style.dust.at(time),
            overlays: Some(&self.style.overlays),
        };
        let mut image = self.renderer.render(&scene)?;
        self.style.overlays.legend().draw(&mut image);
        Ok(image)
    }

    /// Makes the pictures of the frames of `source`, several at a time, and hands what `prepare`
    /// makes of each to `take`, in batches and in their order; `take` is told the number of the
    /// first one.
    pub(super) fn each<T: Send>(
        &self,
        source: &ContainerSource<'_>,
        prepare: impl Fn(RgbImage) -> T + Sync,
        mut take: impl FnMut(usize, Vec<T>) -> Result<(), FrameError>,
    ) -> Result<(), FrameError> {
        let limit = batch_limit([self.style.width, self.style.height]);
        for (batch, frames) in source.frames.chunks(limit).enumerate() {
            let picture = |&index: &usize| self.stored(source, index).map(&prepare);
            let pictures: Result<Vec<T>, FrameError> = frames.par_iter().map(picture).collect();
            take(batch * limit, pictures?)?;
        }
        Ok(())
    }

    /// The picture of frame `index` of the store of `source`, from a file if there is one.
    pub(super) fn stored(
        &self,
        source: &ContainerSource<'_>,
        index: usize,
    ) -> Result<RgbImage, FrameError> {
        let sequence = source.options.picture_sequence.as_ref();
        if let Some(image) = sequence.and_then(|sequence| self.read(&sequence.file(index))) {
            return Ok(image);
        }
        let frame = source.store.frame(index)?;
        Ok(self.render(source.topology, frame.time, &frame.positions_f64())?)
    }

    /// The picture in `file`, scaled down, if it can be read and is large enough.
    fn read(&self, file: &Path) -> Option<RgbImage> {
        let image = image::open(file).ok()?.into_rgb8();
        let PictureStyle { width, height, .. } = self.style;
        let is_larger = image.width() >= width && image.height() >= height;
        is_larger.then(|| scaled(image, [width, height]))
    }
}

/// `image` in another size \[pixel\].
pub(super) fn scaled(image: RgbImage, [width, height]: [u32; 2]) -> RgbImage {
    if image.dimensions() == (width, height) {
        return image;
    }
    resize(&image, width, height, FilterType::Triangle)
}
