//! Positions and normals of one frame on the device.

use cloth::wgpu::{DeviceBuffers, wgpu};

use super::{ClothMesh, pipelines::Pipelines};
use crate::Gpu;

/// Positions and normals of all particles: length n, `vec4<f32>` each.
#[derive(Clone, Debug)]
pub struct FrameBuffers {
    pub(super) positions: wgpu::Buffer,
    pub(super) normals: wgpu::Buffer,
}

/// What the shaders bind of a frame.
pub(super) struct FrameGroups {
    /// Positions, normals, colours, strain.
    pub(super) surface: wgpu::BindGroup,
    /// Positions alone.
    pub(super) positions: wgpu::BindGroup,
}

impl FrameBuffers {
    /// Room for this many particles.
    #[must_use]
    pub fn new(gpu: &Gpu, particle_count: usize) -> Self {
        let buffer = |label| {
            // Frames that are kept are read again by whoever goes on from them.
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
            gpu.empty_buffer(label, 16 * particle_count as u64, usage)
        };
        Self { positions: buffer("positions"), normals: buffer("normals") }
    }

    /// Fills the buffers from host memory.
    pub fn upload(&self, gpu: &Gpu, positions: &[[f64; 3]], normals: &[[f64; 3]]) {
        let fill = |buffer: &wgpu::Buffer, values: &[[f64; 3]]| {
            let values: Vec<[f32; 4]> =
                values.iter().map(|v| [v[0] as f32, v[1] as f32, v[2] as f32, 0.0]).collect();
            let room = (buffer.size() / 16) as usize;
            let count = values.len().min(room);
            gpu.queue.write_buffer(buffer, 0, bytemuck::cast_slice(&values[..count]));
        };
        fill(&self.positions, positions);
        fill(&self.normals, normals);
    }

    /// Fills the buffers from those of a solver, on the device.
    pub fn copy(&self, source: &DeviceBuffers) {
        let mut encoder = source.device.create_command_encoder(&Default::default());
        for (from, to) in [(&source.positions, &self.positions), (&source.normals, &self.normals)] {
            encoder.copy_buffer_to_buffer(from, 0, to, 0, from.size().min(to.size()));
        }
        source.queue.submit([encoder.finish()]);
    }

    /// The buffers of a solver themselves, which change with its next frame.
    #[must_use]
    pub fn of_solver(source: &DeviceBuffers) -> Self {
        Self { positions: source.positions.clone(), normals: source.normals.clone() }
    }

    /// The positions.
    pub(crate) const fn positions(&self) -> &wgpu::Buffer {
        &self.positions
    }

    pub(super) fn groups(
        &self,
        device: &wgpu::Device,
        pipelines: &Pipelines,
        mesh: &ClothMesh,
    ) -> FrameGroups {
        let (colours, strains) = (mesh.colours(), mesh.strains());
        FrameGroups {
            surface: pipelines.group(
                device,
                &pipelines.surface_layout,
                &[&self.positions, &self.normals, colours, strains],
            ),
            positions: pipelines.group(device, &pipelines.positions_layout, &[&self.positions]),
        }
    }
}
