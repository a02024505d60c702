//! The frames of a run, shown again.

use std::{
    path::Path,
    sync::Arc,
    time::{Duration, Instant},
};

use cloth::{
    Cloth, Geometry, Mass, Material, MaterialPreset, Model, ModelBuilder, PoseLog, StepReport,
    io::{Bounds, Camera, FrameStore, PictureStyle, vertex_normals},
    picture_style, picture_style_moving,
    scene::{CompileOptions, Scene},
    topology,
};

use crate::{Gpu, Overlays, ViewerError};

use super::{
    FrameFiles, Snapshot, contacts,
    frame_files::FRAMES_PER_SECOND,
    snapshot::{FramePool, cell_side},
};

/// Recorded frames and the place in them.
pub struct Playback {
    gpu: Gpu,
    name: String,
    model: Arc<Model>,
    style: PictureStyle,
    frames_per_second: f64,
    frames: Frames,
    index: usize,
    pool: FramePool,
}

/// Where the frames are.
enum Frames {
    Store(FrameStore),
    Files(FrameFiles),
}

impl Playback {
    /// Opens the frame store of a run of `scene`, at its first frame.
    ///
    /// # Errors
    /// [`ViewerError::Scene`]; [`ViewerError::Frames`] if the store is of another scene or empty;
    /// [`ViewerError::Poses`] if what is beside it cannot tell where rigid bodies were.
    pub fn of_store(
        gpu: &Gpu,
        scene: &Scene,
        options: &CompileOptions,
        store: &Path,
    ) -> Result<Self, ViewerError> {
        let compiled = scene.compile(options)?;
        let store = FrameStore::open_read_only(store, &topology(&compiled))?;
        if store.is_empty() {
            return Err(cloth::io::FrameError::FrameNone { file: store.path().to_owned() }.into());
        }
        // Rigid bodies of a run that kept no poses stay where they began.
        let poses = store.path().with_file_name("poses.txt");
        let style = if !compiled.rigids.is_empty() && poses.exists() {
            let poses = PoseLog::read(&poses, compiled.model.colliders().len())?;
            picture_style_moving(&compiled, poses)
        } else {
            picture_style(&compiled)
        };
        Ok(Self {
            gpu: gpu.clone(),
            name: compiled.name.clone(),
            style,
            frames_per_second: compiled.frames_per_second,
            model: compiled.model,
            frames: Frames::Store(store),
            index: 0,
            pool: FramePool::default(),
        })
    }

    /// Opens frames in files, at the first. They do not tell what the cloth is made of, nor what
    /// else there was.
    ///
    /// # Errors
    /// [`ViewerError::Source`], [`ViewerError::Simulation`] for a mesh that can be no cloth.
    pub fn of_files(gpu: &Gpu, files: FrameFiles) -> Result<Self, ViewerError> {
        let cloth = Cloth {
            name: files.name().to_owned(),
            geometry: Geometry::Mesh(files.mesh()?),
            // Nothing is simulated; the springs are for the eye.
            material: Material {
                mass: Mass::PerParticle(1e-3),
                ..MaterialPreset::ALL[0].material(0.01)
            }
            .into(),
            pins: Vec::new(),
            velocity: [0.0; 3],
        };
        let model = ModelBuilder::new().cloth(cloth).build().map_err(cloth::Error::from)?;
        let last = files.frame(files.len() - 1, model.particle_count())?;
        let bounds = Bounds::of(model.positions()).union(&Bounds::of(&last));
        let style = PictureStyle::default();
        let camera = Some(Camera::fit(&bounds, style.aspect()));
        Ok(Self {
            gpu: gpu.clone(),
            name: files.name().to_owned(),
            style: PictureStyle { camera, ..style },
            frames_per_second: FRAMES_PER_SECOND,
            model: Arc::new(model),
            frames: Frames::Files(files),
            index: 0,
            pool: FramePool::default(),
        })
    }

    /// Name of the scene.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The model, which does not move.
    #[must_use]
    pub const fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Frames in a second \[Hz\].
    #[must_use]
    pub const fn frames_per_second(&self) -> f64 {
        self.frames_per_second
    }

    /// How pictures of it look.
    #[must_use]
    pub const fn style(&self) -> &PictureStyle {
        &self.style
    }

    /// Number of frames.
    #[must_use]
    pub fn len(&self) -> usize {
        match &self.frames {
            Frames::Store(store) => store.len(),
            Frames::Files(files) => files.len(),
        }
    }

    /// Whether there are none; never, as that cannot be opened.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of the present frame.
    #[must_use]
    pub const fn index(&self) -> usize {
        self.index
    }

    /// Goes to a frame, or to the last one if there are fewer.
    pub fn seek(&mut self, index: usize) {
        self.index = index.min(self.len() - 1);
    }

    /// Goes to the frame before, from the first one to the last.
    pub fn step_back(&mut self) {
        self.index = (self.index + self.len() - 1) % self.len();
    }

    /// Goes to the next frame, from the last one to the first.
    pub fn step(&mut self) {
        self.index = (self.index + 1) % self.len();
    }

    /// Time \[s\] and positions \[m\] of the present frame.
    fn frame(&self) -> Result<(f64, Vec<[f64; 3]>), ViewerError> {
        match &self.frames {
            Frames::Store(store) => {
                let frame = store.frame(self.index)?;
                Ok((frame.time, frame.positions_f64()))
            }
            Frames::Files(files) => {
                let time = self.index as f64 / self.frames_per_second;
                Ok((time, files.frame(self.index, self.model.particle_count())?))
            }
        }
    }

    /// The present frame for the window.
    ///
    /// # Errors
    /// [`ViewerError::Frames`] or [`ViewerError::Source`] if it cannot be read.
    pub fn snapshot(&mut self, overlays: Overlays) -> Result<Snapshot, ViewerError> {
        let start = Instant::now();
        let (time, positions) = self.frame()?;
        let normals = vertex_normals(&positions, self.model.triangles());
        let buffers = self.pool.take(&self.gpu, positions.len());
        buffers.upload(&self.gpu, &positions, &normals);
        let bins = if overlays.bins {
            contacts::bin_lines(&positions, cell_side(&self.model))
        } else {
            Vec::new()
        };
        let contacts = if overlays.contacts {
            let state = cloth::State { positions, ..self.model.initial_state() };
            contacts::contact_particles(&self.model, &state)
        } else {
            Vec::new()
        };
        Ok(Snapshot {
            frame: self.index as u64,
            time,
            buffers,
            shapes: self.style.shapes.at(time),
            dust: self.style.dust.at(time),
            held: Vec::new(),
            contacts,
            bins,
            grab: None,
            report: StepReport::default(),
            duration: start.elapsed(),
            real_time_factor: 0.0,
            paused: false,
            recorded: Some(self.len()),
            kept: None,
            is_past: false,
        })
    }
}

/// Time between frames at this rate \[Hz\].
pub(super) fn frame_time(frames_per_second: f64) -> Duration {
    Duration::try_from_secs_f64(1.0 / frames_per_second).unwrap_or(Duration::from_secs(1))
}
