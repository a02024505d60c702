//! A solver that lends its buffers.

use std::sync::Arc;

use cloth_core::{
    ColliderImpulse, Control, Frame, Model, Pose, Result, Solver, State, StepReport,
    stepper::SteppedSolver,
};

use crate::WgpuKernels;

/// A solver on a GPU. Beside what every [`Solver`] does, it gives a renderer on the same device the
/// buffers that it needs to draw: no byte leaves the device.
pub struct WgpuSolver {
    inner: SteppedSolver<WgpuKernels>,
}

/// The present state in device memory.
///
/// Handles are cheap to clone. The contents of the three arrays stay as they are until the
/// solver is used again; which buffer holds the positions changes from frame to frame, so ask anew for
/// each one. All have the usages `STORAGE`, `COPY_SRC` and `COPY_DST`: a renderer reads them as storage
/// buffers in a vertex shader, at `vertex_index`.
#[derive(Clone, Debug)]
pub struct DeviceBuffers {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue. Work submitted to it comes after that of the solver.
    pub queue: wgpu::Queue,
    /// Length n, 16 bytes each: position x, y, z \[m\] as f32, then the inverse mass \[1/kg\], 0 while
    /// the particle is held. In WGSL `array<vec4<f32>>`.
    pub positions: wgpu::Buffer,
    /// Length n, 16 bytes each: velocity x, y, z \[m/s\] as f32, then the mass \[kg\]. In WGSL `array<vec4<f32>>`.
    pub velocities: wgpu::Buffer,
    /// Length n, 16 bytes each: unit normal x, y, z as f32, zero for a particle without triangles, then
    /// zero. In WGSL `array<vec4<f32>>`.
    pub normals: wgpu::Buffer,
}

impl WgpuSolver {
    pub(crate) const fn new(inner: SteppedSolver<WgpuKernels>) -> Self {
        Self { inner }
    }

    /// The present positions and their normals, which are computed now. Waits for the frame only if it
    /// has contact between cloths and was not synchronised.
    ///
    /// # Errors
    /// What the device reports.
    pub fn device_buffers(&mut self) -> Result<DeviceBuffers> {
        self.inner.kernels_mut().stages_mut().device_buffers()
    }

    /// What friction between triangles remembers, as in [`State::slips`]. `out` is resized.
    pub fn slips_read(&mut self, out: &mut Vec<cloth_core::contact::ContactSlip>) {
        self.inner.kernels_mut().stages_mut().slips_read(out);
    }

    /// What bodies have pinched, as in [`State::ghosts`]. `out` is resized.
    pub fn ghosts_read(&mut self, out: &mut Vec<cloth_core::contact::Ghost>) {
        self.inner.kernels_mut().stages_mut().ghosts_read(out);
    }
}

impl Solver for WgpuSolver {
    fn model(&self) -> &Arc<Model> {
        self.inner.model()
    }

    fn colliders(&self) -> &[Pose] {
        self.inner.colliders()
    }

    fn upload(&mut self, state: &State) -> Result<()> {
        self.inner.upload(state)
    }

    fn particle_position(&mut self, particle: u32) -> Result<[f64; 3]> {
        self.inner.particle_position(particle)
    }

    fn set_control(&mut self, control: &Control) -> Result<()> {
        self.inner.set_control(control)
    }

    fn advance(&mut self, frame: Frame) -> Result<()> {
        self.inner.advance(frame)
    }

    fn synchronize(&mut self) -> Result<StepReport> {
        self.inner.synchronize()
    }

    fn download(&mut self, out: &mut State) -> Result<()> {
        self.inner.download(out)
    }

    fn collider_impulses(&mut self, out: &mut Vec<ColliderImpulse>) -> Result<()> {
        self.inner.collider_impulses(out)
    }

    fn normals(&mut self, out: &mut Vec<[f64; 3]>) -> Result<()> {
        self.inner.normals(out)
    }

    fn stitches_set(&mut self, model: &Arc<Model>) -> Result<bool> {
        self.inner.stitches_set(model)
    }

    fn contacts_read(&mut self, out: &mut cloth_core::contact::Contacts) -> Result<()> {
        self.inner.contacts_read(out)
    }
}
