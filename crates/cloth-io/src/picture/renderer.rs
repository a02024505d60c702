//! Renders the pictures of a clip.

use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

use glam::Vec3;
use image::RgbImage;
use rayon::prelude::*;

use super::camera::View;
use super::dust::Dust;
use super::floor::Floor;
use super::geometry::{Cloths, Mesh, Plane, Stage, linear, planes, solids};
use super::plane_light::PlaneLight;
use super::raster::{BAND, Band, Screen};
use super::shade::{Room, Shader};
use super::shadow::{ShadowMap, key_direction, key_size};
use super::sky::{Sky, SkyMaps};
use super::tone::EncodeTable;
use super::{
    Camera, PICTURE_SIDE_LIMIT, PictureError, PictureScene, PictureShape, PictureSolid,
    PictureStyle,
};

/// Renders pictures with one camera and one size. It keeps what is the same in all of them, and can
/// be used by several threads at once; a picture depends on its scene alone, not on those before.
pub struct PictureRenderer {
    view: View,
    /// Background at the upper and the lower edge in linear light.
    background: [Vec3; 2],
    bytes: EncodeTable,
    floor: Mutex<Option<Arc<Floor>>>,
    solids: Mutex<Option<Arc<Solids>>>,
    /// Room for the lights of pictures that are being made: new memory for each would take as long as to fill it.
    spare: Mutex<Vec<Lights>>,
}

/// Solids of a picture, with what the lights see of them.
struct Solids {
    shapes: Vec<PictureSolid>,
    mesh: Mesh,
    /// Colour of each in linear light.
    colors: Vec<Vec3>,
    lights: Mutex<Option<Arc<Lights>>>,
}

/// What the strong light and the sky see.
struct Lights {
    stage: Stage,
    key: ShadowMap,
    sky: SkyMaps,
}

impl Clone for Lights {
    fn clone(&self) -> Self {
        Self { stage: self.stage, key: self.key.clone(), sky: self.sky.clone() }
    }

    /// Into the same memory.
    fn clone_from(&mut self, other: &Self) {
        self.stage = other.stage;
        self.key.clone_from(&other.key);
        self.sky.clone_from(&other.sky);
    }
}

impl Lights {
    fn cast(&mut self, mesh: &Mesh) {
        rayon::join(|| self.key.cast(mesh), || self.sky.cast(mesh));
    }
}

impl PictureRenderer {
    /// A renderer for pictures that `camera` sees, with the size and background of `style` (its
    /// camera, shapes and cloth colours belong to animations and are not used here).
    ///
    /// # Errors
    ///
    /// [`PictureError::Size`] if the size is zero or above [`PICTURE_SIDE_LIMIT`],
    /// [`PictureError::Camera`] if the camera is degenerate.
    pub fn new(camera: &Camera, style: &PictureStyle) -> Result<Self, PictureError> {
        let (width, height) = (style.width, style.height);
        if ![width, height].iter().all(|side| (1..=PICTURE_SIDE_LIMIT).contains(side)) {
            return Err(PictureError::Size { width, height });
        }
        Ok(Self {
            view: View::new(camera, width, height)?,
            background: style.background.map(linear),
            bytes: EncodeTable::new(),
            floor: Mutex::new(None),
            solids: Mutex::new(None),
            spare: Mutex::new(Vec::new()),
        })
    }

    /// Renders `scene`.
    ///
    /// # Errors
    ///
    /// [`PictureError::Index`] if an index is out of range, [`PictureError::Position`] if a position
    /// is not finite.
    pub fn render(&self, scene: &PictureScene<'_>) -> Result<RgbImage, PictureError> {
        let view = &self.view;
        let cloths = Cloths::new(scene, view)?;
        let solids = self.solids(scene.shapes)?;
        let floor = self.floor(scene.shapes);
        let meshes = [&solids.mesh, &cloths.mesh];
        let stage = Stage::of(meshes, view);
        let mut lights = self.spare_lights(&solids.lights(stage, view));
        lights.cast(&cloths.mesh);
        let (sky, screen) = rayon::join(
            || Sky::new(&lights.sky, meshes, &floor.planes, &stage, view.eye),
            || Screen::new(meshes, view),
        );
        let dust = Dust::new(scene.dust, view);
        let plane_light = |(number, plane): (usize, &Plane)| {
            PlaneLight::new(number, plane, view, &lights.key, &sky)
        };
        let shader = Shader {
            planes: floor.planes.iter().enumerate().map(plane_light).collect(),
            view,
            screen: &screen,
            floor: &floor,
            solids: &solids.mesh,
            solid_colors: &solids.colors,
            cloths: &cloths,
            key: &lights.key,
            sky: &sky,
            dust: &dust,
            background: self.background,
            bytes: &self.bytes,
        };
        let mut image = RgbImage::new(view.width, view.height);
        let row_size = 3 * view.width as usize;
        let bands = image.par_chunks_mut(BAND * row_size).enumerate();
        bands.for_each_init(
            || (Band::new(view), Room::default()),
            |(band, room), (number, pixels)| {
                let rows = pixels.len() / row_size;
                band.fill(&screen, &floor, view, number, rows);
                for (row, pixels) in pixels.chunks_exact_mut(row_size).enumerate() {
                    shader.row(band, [number, row], pixels, room);
                }
            },
        );
        self.spare.lock().unwrap_or_else(PoisonError::into_inner).push(lights);
        Ok(image)
    }

    /// Lights that are the same as these, and can be changed.
    fn spare_lights(&self, lights: &Lights) -> Lights {
        let spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let Some(mut spare) = spare else { return lights.clone() };
        spare.clone_from(lights);
        spare
    }

    /// The planes among `shapes`, as they were in the picture before if they stand still.
    fn floor(&self, shapes: &[PictureSolid]) -> Arc<Floor> {
        let planes: Vec<Plane> = planes(shapes, &self.view);
        kept(&self.floor, |floor| floor.planes == planes, || Floor::new(planes.clone(), &self.view))
    }

    /// The solids among `shapes`, as they were in the picture before if they stand still.
    fn solids(&self, shapes: &[PictureSolid]) -> Result<Arc<Solids>, PictureError> {
        let is_solid = |solid: &&PictureSolid| !matches!(solid.shape, PictureShape::Plane { .. });
        let lock = self.solids.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(solids) = &*lock
            && solids.shapes.iter().eq(shapes.iter().filter(is_solid))
        {
            return Ok(Arc::clone(solids));
        }
        drop(lock);
        let shapes: Vec<_> = shapes.iter().filter(is_solid).cloned().collect();
        let mesh = solids(&shapes, &self.view)?;
        let colors = shapes
            .iter()
            .map(|solid| solid.color.map_or(PictureSolid::GREY.into(), linear))
            .collect();
        Ok(kept(
            &self.solids,
            |solids| solids.shapes == shapes,
            || Solids { shapes: shapes.clone(), mesh, colors, lights: Mutex::new(None) },
        ))
    }
}

impl Solids {
    /// What the lights see of the solids on `stage`.
    fn lights(&self, stage: Stage, view: &View) -> Arc<Lights> {
        let make = || {
            let key = ShadowMap::new(&stage, key_direction(view), key_size(view));
            let mut lights = Lights { stage, key, sky: SkyMaps::new(&stage) };
            lights.cast(&self.mesh);
            lights
        };
        kept(&self.lights, |lights| lights.stage == stage, make)
    }
}

/// What is kept if it `fits`, else what `make` makes, which is kept from then on.
fn kept<T>(
    place: &Mutex<Option<Arc<T>>>,
    fits: impl Fn(&T) -> bool,
    make: impl FnOnce() -> T,
) -> Arc<T> {
    let lock = || place.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(value) = &*lock()
        && fits(value)
    {
        return Arc::clone(value);
    }
    // Not under the lock: others that need something else must not wait, and a thread that waits for
    // its own tasks may be given one that comes here.
    let value = Arc::new(make());
    *lock() = Some(Arc::clone(&value));
    value
}

impl fmt::Debug for PictureRenderer {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = [self.view.width, self.view.height];
        formatter.debug_struct("PictureRenderer").field("size", &size).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Bounds, PictureCloth};
    use super::*;

    fn renderer() -> PictureRenderer {
        let camera = Camera::fit(&Bounds { min: [-1.0; 3], max: [1.0; 3] }, 1.5);
        let style = PictureStyle { width: 48, height: 32, ..PictureStyle::default() };
        PictureRenderer::new(&camera, &style).unwrap()
    }

    fn shapes(x: f64) -> [PictureSolid; 2] {
        [
            PictureShape::Plane { normal: [0.0, 0.0, 1.0], offset: -1.0 }.into(),
            PictureShape::Sphere { center: [x, 0.0, -0.5], radius: 0.5 }.into(),
        ]
    }

    fn render(renderer: &PictureRenderer, height: f64, shapes: &[PictureSolid]) -> RgbImage {
        let positions = [[-0.5, -0.5, height], [0.5, -0.5, height], [0.0, 0.5, height]];
        let cloths = vec![PictureCloth { triangles: 0..1, color: [200, 20, 20] }];
        let triangles = &[[0, 1, 2]];
        let scene = PictureScene {
            positions: &positions,
            triangles,
            texture: None,
            cloths,
            shapes,
            dust: &[],
            overlays: None,
        };
        renderer.render(&scene).unwrap()
    }

    /// The floor, the triangles of solids and their depths in the light of the sky do not change
    /// while only the cloth moves.
    #[test]
    fn what_stands_still_is_made_once() {
        let renderer = renderer();
        let kept = || {
            let floor = renderer.floor.lock().unwrap().clone().unwrap();
            let solids = renderer.solids.lock().unwrap().clone().unwrap();
            let lights = solids.lights.lock().unwrap().clone().unwrap();
            (floor, solids, lights)
        };
        render(&renderer, 0.3, &shapes(0.0));
        let first = kept();
        for step in 0..10 {
            render(&renderer, 0.3 + 1e-4 * f64::from(step), &shapes(0.0));
            let next = kept();
            assert!(Arc::ptr_eq(&first.0, &next.0), "floor, step {step}");
            assert!(Arc::ptr_eq(&first.1, &next.1), "solids, step {step}");
            assert!(Arc::ptr_eq(&first.2, &next.2), "maps of the sky, step {step}");
        }
        render(&renderer, 0.3, &shapes(0.1));
        let next = kept();
        assert!(Arc::ptr_eq(&first.0, &next.0), "the floor did not move");
        assert!(!Arc::ptr_eq(&first.1, &next.1), "the ball did");
    }

    #[test]
    fn a_picture_does_not_depend_on_those_before() {
        let used = renderer();
        for (height, x) in [(0.9, 0.0), (0.1, 0.4), (0.5, -0.3)] {
            render(&used, height, &shapes(x));
        }
        assert_eq!(render(&used, 0.3, &shapes(0.2)), render(&renderer(), 0.3, &shapes(0.2)));
    }

    #[test]
    fn a_picture_does_not_depend_on_the_number_of_threads() {
        let with_threads = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| render(&renderer(), 0.3, &shapes(0.2)))
        };
        assert_eq!(with_threads(1), with_threads(3));
    }
}
