//! Pictures and clips without a window.

use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use cloth::{io::PictureStyle, scene::CompiledScene, wgpu::wgpu};
use image::RgbImage;

use crate::{
    ClipFormat, ClothMesh, Engine, FrameBuffers, FrameContents, Gpu, OrbitCamera, Overlays,
    Playback, RenderTarget, Renderer, Snapshot, Source, ViewerError, clip::Clip,
    renderer::dust_lines,
};

/// What to draw, and how.
#[derive(Clone, Debug)]
pub struct ClipOptions {
    /// Width and height \[pixel\].
    pub size: [u32; 2],
    /// What is drawn; what the scene says if `None`.
    pub overlays: Option<Overlays>,
    /// Name of the backend that simulates.
    pub backend: String,
    /// Frames to draw; those of the scene or the run if `None`.
    pub frames: Option<u64>,
    /// Draw every so many frames.
    pub stride: u64,
    /// The last frame alone, as a single picture.
    pub still: bool,
}

/// Sessions without a window.
enum Subject {
    Live(Box<Engine>),
    Recorded(Box<Playback>),
}

/// A scene and all that draws it.
pub struct Studio {
    subject: Subject,
    renderer: Renderer,
    mesh: ClothMesh,
    camera: OrbitCamera,
    target: RenderTarget,
    overlays: Overlays,
}

impl Studio {
    /// Makes ready to draw `source`.
    ///
    /// # Errors
    /// What is wrong with the scene, the backend, or the size.
    pub fn new(gpu: &Gpu, source: Source, options: &ClipOptions) -> Result<Self, ViewerError> {
        let subject = match source {
            Source::Scene(scene, compile) => {
                let engine = Engine::new(gpu, *scene, compile, &options.backend)?;
                Subject::Live(Box::new(engine))
            }
            Source::Run { scene, options, store } => {
                Subject::Recorded(Box::new(Playback::of_store(gpu, &scene, &options, &store)?))
            }
            Source::Files(files) => Subject::Recorded(Box::new(Playback::of_files(gpu, files)?)),
        };
        let (model, style) = match &subject {
            Subject::Live(engine) => (&engine.scene().model, engine.style()),
            Subject::Recorded(playback) => (playback.model(), playback.style()),
        };
        let mut overlays = options.overlays.unwrap_or_else(|| Overlays::of_style(style));
        overlays.threads &= !model.elements().is_empty();
        Ok(Self {
            mesh: ClothMesh::new(gpu, model, style),
            camera: camera(style),
            target: RenderTarget::new(gpu, options.size)?,
            renderer: Renderer::new(gpu),
            overlays,
            subject,
        })
    }

    /// Where it is seen from; may be changed.
    pub const fn camera_mut(&mut self) -> &mut OrbitCamera {
        &mut self.camera
    }

    /// The scene in progress, unless it is a recorded one.
    pub fn engine_mut(&mut self) -> Option<&mut Engine> {
        match &mut self.subject {
            Subject::Live(engine) => Some(engine),
            Subject::Recorded(_) => None,
        }
    }

    /// Number of frames after the first.
    #[must_use]
    pub fn frames(&self) -> u64 {
        match &self.subject {
            Subject::Live(engine) => u64::from(engine.scene().frames),
            Subject::Recorded(playback) => playback.len() as u64 - 1,
        }
    }

    /// Frames in a second \[Hz\].
    #[must_use]
    pub fn frames_per_second(&self) -> f64 {
        match &self.subject {
            Subject::Live(engine) => engine.scene().frames_per_second,
            Subject::Recorded(playback) => playback.frames_per_second(),
        }
    }

    /// Goes to the next frame.
    ///
    /// # Errors
    /// What the solver reports.
    pub fn step(&mut self) -> Result<(), ViewerError> {
        match &mut self.subject {
            Subject::Live(engine) => engine.step()?,
            Subject::Recorded(playback) => playback.step(),
        }
        Ok(())
    }

    /// Draws the present frame and hands it to the device.
    ///
    /// # Errors
    /// What the device reports.
    pub fn draw(&mut self) -> Result<Snapshot, ViewerError> {
        let snapshot = match &mut self.subject {
            Subject::Live(engine) => engine.snapshot(self.overlays)?,
            Subject::Recorded(playback) => playback.snapshot(self.overlays)?,
        };
        self.renderer.render(
            &self.target,
            &self.camera,
            &mut self.mesh,
            &snapshot.buffers,
            &snapshot.contents(self.overlays),
        );
        Ok(snapshot)
    }

    /// Draws the present frame with its legend and gives it back.
    ///
    /// # Errors
    /// What the device reports.
    pub fn picture(&mut self) -> Result<RgbImage, ViewerError> {
        self.draw()?;
        let mut picture = self.target.read(self.renderer.gpu())?;
        self.overlays.legend().draw(&mut picture);
        Ok(picture)
    }

    /// Time of each of `count` frames from the start of its simulation until its picture is done,
    /// after a few that are not counted.
    ///
    /// # Errors
    /// What the solver and the device report.
    pub fn frame_times(&mut self, count: usize) -> Result<Vec<Duration>, ViewerError> {
        const WARM_UP: usize = 5;
        let mut times = Vec::with_capacity(count);
        for number in 0..WARM_UP + count {
            let start = Instant::now();
            self.step()?;
            self.draw()?;
            let device = &self.renderer.gpu().device;
            device
                .poll(wgpu::PollType::wait_indefinitely())
                .map_err(|error| ViewerError::Device { reason: error.to_string() })?;
            if number >= WARM_UP {
                times.push(start.elapsed());
            }
        }
        Ok(times)
    }
}

/// Draws frames that somebody else computes.
pub struct FramePainter {
    renderer: Renderer,
    mesh: ClothMesh,
    style: PictureStyle,
    target: RenderTarget,
    buffers: FrameBuffers,
}

impl FramePainter {
    /// Makes ready to draw frames of `scene` in the look of `style`, which also says the size.
    ///
    /// # Errors
    /// [`ViewerError::PictureSize`].
    pub fn new(
        gpu: &Gpu,
        scene: &CompiledScene,
        style: &PictureStyle,
    ) -> Result<Self, ViewerError> {
        Ok(Self {
            renderer: Renderer::new(gpu),
            mesh: ClothMesh::new(gpu, &scene.model, style),
            target: RenderTarget::new(gpu, [style.width, style.height])?,
            buffers: FrameBuffers::new(gpu, scene.model.particle_count()),
            style: style.clone(),
        })
    }

    /// The picture at this time \[s\], with these positions \[m\] and unit normals, each of length n.
    ///
    /// # Errors
    /// [`ViewerError::Device`].
    pub fn picture(
        &mut self,
        time: f64,
        positions: &[[f64; 3]],
        normals: &[[f64; 3]],
    ) -> Result<RgbImage, ViewerError> {
        self.buffers.upload(self.renderer.gpu(), positions, normals);
        let contents = FrameContents {
            shapes: self.style.shapes.at(time),
            lines: dust_lines(&self.style.dust.at(time)).collect(),
            overlays: Overlays::of_style(&self.style),
            ..FrameContents::default()
        };
        let camera = camera(&self.style);
        self.renderer.render(&self.target, &camera, &mut self.mesh, &self.buffers, &contents);
        let mut picture = self.target.read(self.renderer.gpu())?;
        contents.overlays.legend().draw(&mut picture);
        Ok(picture)
    }
}

/// The camera of a style, or one that fits.
pub(crate) fn camera(style: &PictureStyle) -> OrbitCamera {
    let fallback = || {
        let unit = cloth::io::Bounds { min: [-1.0; 3], max: [1.0; 3] };
        cloth::io::Camera::fit(&unit, style.aspect())
    };
    OrbitCamera::from_camera(&style.camera.unwrap_or_else(fallback))
}

/// Draws all frames of `source` into the file `path`, whose extension says the format.
/// `progress` is told each frame that is done, and how many there are.
///
/// # Errors
/// [`ViewerError::Output`] for an unknown format, before anything is computed; what is wrong with the
/// scene, the solver, the device or the file.
pub fn clip_render(
    gpu: &Gpu,
    source: Source,
    path: &Path,
    options: &ClipOptions,
    mut progress: impl FnMut(u64, u64),
) -> Result<PathBuf, ViewerError> {
    let format = ClipFormat::of_path(path)?;
    let mut studio = Studio::new(gpu, source, options)?;
    let frames = options.frames.unwrap_or_else(|| studio.frames());
    if options.still {
        if format != ClipFormat::Apng {
            return Err(ViewerError::Output {
                path: path.to_owned(),
                problem: "a still picture is a PNG".into(),
                mend: "name it still.png",
            });
        }
        for frame in 0..frames {
            studio.step()?;
            progress(frame + 1, frames);
        }
        let written = studio.picture()?.save(path);
        written.map_err(|error| ViewerError::Output {
            path: path.to_owned(),
            problem: error.to_string(),
            mend: "check free space and permissions, and name a still picture .png",
        })?;
        return Ok(path.to_owned());
    }
    let stride = options.stride.max(1);
    let rate = studio.frames_per_second() / stride as f64;
    let mut clip = Clip::new(format, path, rate)?;
    for frame in 0..=frames {
        if frame > 0 {
            studio.step()?;
        }
        if frame.is_multiple_of(stride) {
            clip.push(&studio.picture()?)?;
        }
        progress(frame, frames);
    }
    clip.finish()
}
