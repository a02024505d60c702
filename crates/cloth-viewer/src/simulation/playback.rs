//! The frames of a run, shown again.

use std::{
    path::Path,
    time::{Duration, Instant},
};

use cloth::{
    StepReport,
    io::{FrameStore, PictureStyle, Topology, vertex_normals},
    picture_style,
    scene::{CompileOptions, CompiledScene, Scene},
    topology,
};

use crate::{Gpu, Overlays, ViewerError};

use super::{Snapshot, contacts, snapshot::FramePool};

/// Recorded frames and the place in them.
pub struct Playback {
    gpu: Gpu,
    compiled: CompiledScene,
    topology: Topology,
    style: PictureStyle,
    store: FrameStore,
    index: usize,
    pool: FramePool,
}

impl Playback {
    /// Opens the frame store of a run of `scene`, at its first frame.
    ///
    /// # Errors
    /// [`ViewerError::Scene`]; [`ViewerError::Frames`] if the store is of another scene or empty.
    pub fn new(
        gpu: &Gpu,
        scene: &Scene,
        options: &CompileOptions,
        store: &Path,
    ) -> Result<Self, ViewerError> {
        let compiled = scene.compile(options)?;
        let topology = topology(&compiled);
        let store = FrameStore::open_read_only(store, &topology)?;
        if store.is_empty() {
            return Err(cloth::io::FrameError::FrameNone { file: store.path().to_owned() }.into());
        }
        Ok(Self {
            gpu: gpu.clone(),
            style: picture_style(&compiled),
            compiled,
            topology,
            store,
            index: 0,
            pool: FramePool::default(),
        })
    }

    /// The scene.
    #[must_use]
    pub const fn scene(&self) -> &CompiledScene {
        &self.compiled
    }

    /// How pictures of it look.
    #[must_use]
    pub const fn style(&self) -> &PictureStyle {
        &self.style
    }

    /// Number of frames.
    #[must_use]
    pub fn len(&self) -> usize {
        self.store.len()
    }

    /// Whether there are none; never, as that cannot be opened.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.store.is_empty()
    }

    /// Number of the present frame.
    #[must_use]
    pub const fn index(&self) -> usize {
        self.index
    }

    /// Goes to a frame, or to the last one if there are fewer.
    pub fn seek(&mut self, index: usize) {
        self.index = index.min(self.store.len() - 1);
    }

    /// Goes to the next frame, from the last one to the first.
    pub fn step(&mut self) {
        self.index = (self.index + 1) % self.store.len();
    }

    /// The present frame for the window.
    ///
    /// # Errors
    /// [`ViewerError::Frames`] if the store cannot be read.
    pub fn snapshot(&mut self, overlays: Overlays) -> Result<Snapshot, ViewerError> {
        let start = Instant::now();
        let frame = self.store.frame(self.index)?;
        let positions = frame.positions_f64();
        let normals = vertex_normals(&positions, &self.topology.triangles);
        let buffers = self.pool.take(&self.gpu, positions.len());
        buffers.upload(&self.gpu, &positions, &normals);
        let model = &self.compiled.model;
        let contacts = if overlays.contacts {
            let state = cloth::State { positions, ..model.initial_state() };
            contacts::contact_particles(model, &state)
        } else {
            Vec::new()
        };
        Ok(Snapshot {
            frame: self.index as u64,
            time: frame.time,
            buffers,
            shapes: self.style.shapes.at(frame.time),
            held: Vec::new(),
            contacts,
            bins: Vec::new(),
            grab: None,
            report: StepReport::default(),
            duration: start.elapsed(),
            real_time_factor: 0.0,
            paused: false,
            recorded: Some(self.store.len()),
        })
    }
}

/// Time between frames of recorded scenes, at least.
pub(super) fn frame_time(scene: &CompiledScene) -> Duration {
    Duration::try_from_secs_f64(1.0 / scene.frames_per_second).unwrap_or(Duration::from_secs(1))
}
