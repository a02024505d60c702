//! Frames that are kept, to look back at them and to go on from them.
//!
//! What a solver on the processor computes is kept in its memory, what one on the device computes stays on the device: each frame
//! with all that is needed to go on from it.

use std::{sync::Arc, time::Duration};

use cloth::{State, StepReport, io::vertex_normals, rigid::RigidMotion, wgpu::wgpu};

use crate::{FrameBuffers, Gpu, Overlays, Snapshot, ViewerError};

use super::{Engine, EngineSolver};
use crate::simulation::kept::{KeptFrames, KeptView};

/// A frame that is kept.
pub(super) struct PastFrame {
    /// Without positions and velocities if they are on the device.
    state: State,
    device: Option<DeviceMotion>,
    bodies: Vec<RigidMotion>,
    /// Stitches that are broken and edges that are torn.
    gone: [Vec<u32>; 2],
    report: StepReport,
    duration: Duration,
}

/// Positions, normals and velocities on the device.
struct DeviceMotion {
    buffers: Arc<FrameBuffers>,
    velocities: wgpu::Buffer,
}

/// The frames that are kept, and buffers for more.
pub(super) struct Past {
    frames: KeptFrames<PastFrame>,
    spare: Vec<wgpu::Buffer>,
}

impl Past {
    /// Keeps a frame; buffers of those that went are used again.
    fn push(&mut self, number: u64, frame: PastFrame, bytes: u64) {
        let gone = self.frames.push(number, frame, bytes);
        self.recycle(gone);
    }

    fn recycle(&mut self, gone: Vec<PastFrame>) {
        self.spare.extend(gone.into_iter().filter_map(|frame| Some(frame.device?.velocities)));
    }
}

impl PastFrame {
    /// The whole state, fetched from the device if it is there.
    fn state(&self, gpu: &Gpu) -> Result<State, ViewerError> {
        let mut state = self.state.clone();
        if let Some(DeviceMotion { buffers, velocities }) = &self.device {
            let count = state.held.len();
            state.positions = gpu.vectors_read(buffers.positions(), count)?;
            state.velocities = gpu.vectors_read(velocities, count)?;
        }
        Ok(state)
    }

    /// Buffers with positions and normals, if they are on the device.
    pub(super) fn buffers(&self) -> Option<&Arc<FrameBuffers>> {
        self.device.as_ref().map(|device| &device.buffers)
    }
}

impl Engine {
    /// Keeps frames from now on, the present one included, in at most so many bytes of memory: the oldest make room.
    ///
    /// # Errors
    /// What the device reports.
    pub fn keep_frames(&mut self, budget: u64) -> Result<(), ViewerError> {
        self.past = Some(Past { frames: KeptFrames::new(budget), spare: Vec::new() });
        self.keep()
    }

    /// Which frames are kept, if any are to be.
    #[must_use]
    pub fn kept(&self) -> Option<KeptView> {
        self.past.as_ref().map(|past| past.frames.view())
    }

    pub(super) fn past_frame(&self, number: u64) -> Option<&PastFrame> {
        self.past.as_ref()?.frames.get(number)
    }

    /// Keeps the present frame.
    pub(super) fn keep(&mut self) -> Result<(), ViewerError> {
        if self.past.is_none() {
            return Ok(());
        }
        let colliders = self.solver.get().colliders().to_vec();
        let particles = self.compiled.model.particle_count();
        let (state, device) = if let EngineSolver::Shared(solver) = &mut self.solver {
            let (mut slips, mut ghosts) = (Vec::new(), Vec::new());
            solver.slips_read(&mut slips);
            solver.ghosts_read(&mut ghosts);
            let state = State {
                time: self.time,
                step: self.substeps,
                time_step_halvings: 0,
                time_step_good: 0,
                positions: Vec::new(),
                velocities: Vec::new(),
                held: self.held.clone(),
                colliders,
                slips,
                ghosts,
            };
            let source = solver.device_buffers()?;
            let buffers = self.pool.take(&self.gpu, particles);
            buffers.copy(&source);
            let spare = self.past.as_mut().and_then(|past| past.spare.pop());
            let size = 16 * particles as u64;
            let spare = spare.filter(|spare| spare.size() >= size);
            let usage = wgpu::BufferUsages::COPY_SRC;
            let velocities =
                spare.unwrap_or_else(|| self.gpu.empty_buffer("velocities", size, usage));
            let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(&source.velocities, 0, &velocities, 0, size);
            self.gpu.queue.submit([encoder.finish()]);
            (state, Some(DeviceMotion { buffers, velocities }))
        } else {
            (self.state()?.clone(), None)
        };
        let bodies = self.rigid.as_ref().map_or_else(Vec::new, |rigid| rigid.world().motions());
        let numbers =
            48 * particles + state.held.len() + 56 * state.colliders.len() + 36 * state.slips.len();
        let bytes = (numbers + 104 * bodies.len()) as u64;
        let (report, duration) = (self.report.clone(), self.duration);
        let gone = self.solver.gone();
        let frame = PastFrame { state, device, bodies, gone, report, duration };
        if let Some(past) = &mut self.past {
            past.push(self.frame, frame, bytes);
        }
        Ok(())
    }

    /// A kept frame for the window, or `None` if it is not kept. The simulation stays where it is.
    ///
    /// # Errors
    /// What the device reports.
    pub fn snapshot_past(
        &mut self,
        number: u64,
        overlays: Overlays,
    ) -> Result<Option<Snapshot>, ViewerError> {
        let Some(past) = &self.past else { return Ok(None) };
        let Some(frame) = past.frames.get(number) else { return Ok(None) };
        let buffers = match frame.buffers() {
            Some(buffers) => Arc::clone(buffers),
            None => {
                let positions = &frame.state.positions;
                let normals = vertex_normals(positions, self.compiled.model.triangles());
                let buffers = self.pool.take(&self.gpu, positions.len());
                buffers.upload(&self.gpu, positions, &normals);
                buffers
            }
        };
        let (contacts, bins) = if overlays.contacts || overlays.bins {
            self.found(&frame.state(&self.gpu)?, overlays)
        } else {
            Default::default()
        };
        let State { time, held, colliders, .. } = &frame.state;
        Ok(Some(Snapshot {
            frame: number,
            time: *time,
            buffers,
            shapes: self.shapes_at(colliders, *time),
            dust: self.style.dust.at(*time),
            held: held_particles(held),
            contacts,
            bins,
            grab: None,
            report: frame.report.clone(),
            duration: frame.duration,
            real_time_factor: 0.0,
            paused: true,
            recorded: None,
            kept: self.kept(),
            is_past: number != self.frame,
        }))
    }

    /// Goes back to a kept frame, with its pins; settings stay, and what came after it is forgotten. Whether it was kept.
    ///
    /// # Errors
    /// What the device reports.
    pub fn restore(&mut self, number: u64) -> Result<bool, ViewerError> {
        let Some(frame) = self.past_frame(number) else { return Ok(false) };
        // Halvings count from a time step that may have been another one.
        let state = State { time_step_halvings: 0, time_step_good: 0, ..frame.state(&self.gpu)? };
        let (bodies, gone) = (frame.bodies.clone(), frame.gone.clone());
        let (report, duration) = (frame.report.clone(), frame.duration);
        self.solver.restore((number, &state), &gone)?;
        if let Some(rigid) = &mut self.rigid {
            rigid.motions_take(&state.colliders, &bodies);
        }
        self.held.clone_from(&state.held);
        self.frame = number;
        self.time = state.time;
        self.substeps = state.step;
        self.state = state;
        self.state_is_current = true;
        self.pins.clear();
        self.grab = None;
        // A solver keeps its springs until it is told that they end.
        self.forces = Some(Vec::new());
        self.report = report;
        self.duration = duration;
        if let Some(past) = &mut self.past {
            let gone = past.frames.truncate(number + 1);
            past.recycle(gone);
        }
        Ok(true)
    }

    /// After an error: back to the last frame that is kept, or to the start.
    pub(super) fn retreat(&mut self) -> Result<(), ViewerError> {
        match self.kept().and_then(|kept| kept.range) {
            Some([_, last]) if self.restore(last)? => Ok(()),
            _ => self.reset(),
        }
    }

    /// Forgets all kept frames.
    pub(super) fn past_clear(&mut self) {
        if let Some(past) = &mut self.past {
            let gone = past.frames.clear();
            past.recycle(gone);
        }
    }
}

/// The numbers of the particles that are held.
pub(super) fn held_particles(held: &[u8]) -> Vec<u32> {
    (0..).zip(held).filter_map(|(particle, &held)| (held == 1).then_some(particle)).collect()
}
