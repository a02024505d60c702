//! Renders the frames of a run with one camera and one style.

use image::RgbImage;

use super::{FrameError, FrameStore, Topology};
use crate::picture::{
    Bounds, Camera, Picture, PictureCloth, PictureError, PictureScene, PictureStyle,
    picture_palette,
};

/// The renderer of a run.
pub(super) struct PictureAnimation<'a> {
    topology: &'a Topology,
    style: PictureStyle,
    camera: Camera,
}

impl<'a> PictureAnimation<'a> {
    /// Prepares to render; without a camera in `style`, the view shows all of `samples`, which are
    /// times \[s\] and positions \[m\].
    pub(super) fn new<'p>(
        topology: &'a Topology,
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
                        bounds = bounds.union(&shape.bounds());
                    }
                }
                Camera::fit(&bounds, style.aspect())
            }
        };
        Ok(Self { topology, style, camera })
    }

    /// Prepares to render frames of `store`; without a camera, the view shows the whole run.
    pub(super) fn of_store(
        topology: &'a Topology,
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
        Ok(Self::new(topology, style.clone(), samples)?)
    }

    /// Renders the cloth at `positions` \[m\] and the shapes at `time` \[s\].
    pub(super) fn render(
        &self,
        time: f64,
        positions: &[[f64; 3]],
    ) -> Result<RgbImage, PictureError> {
        let cloth = |(number, cloth): (usize, &super::TopologyCloth)| PictureCloth {
            triangles: cloth.triangles.clone(),
            color: match self.style.cloth_colors.get(number) {
                Some(&color) => color,
                None => picture_palette(number),
            },
        };
        let scene = PictureScene {
            positions,
            triangles: &self.topology.triangles,
            texture: self.topology.texture.as_ref(),
            cloths: self.topology.cloths.iter().enumerate().map(cloth).collect(),
            shapes: &self.style.shapes.at(time),
        };
        Picture::render(&scene, &self.camera, &self.style)
    }

    /// Renders frame `index` of `store`.
    pub(super) fn render_stored(
        &self,
        store: &FrameStore,
        index: usize,
    ) -> Result<RgbImage, FrameError> {
        let frame = store.frame(index)?;
        Ok(self.render(frame.time, &frame.positions_f64())?)
    }
}
