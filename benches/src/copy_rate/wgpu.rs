//! What copies in the memory of a GPU reach, through wgpu.

use std::time::Instant;

use cloth::wgpu::{WgpuBackend, wgpu};

/// A kernel that copies.
const COPY: &str = "
@group(0) @binding(0) var<storage, read> source: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> copied: array<vec4f>;

@compute @workgroup_size(256)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let at = id.x + id.y * groups.x * 256u;
    copied[at] = source[at];
}
";

/// GB/s, read and written counted.
///
/// # Errors
/// If the device does not answer.
pub fn copy_rate_wgpu(backend: &WgpuBackend) -> Result<f64, String> {
    let (device, queue) = (backend.device(), backend.queue());
    let rows: u32 = if backend.is_processor() { 1 } else { 32 };
    let [columns, copies] = [1 << 11, 32];
    let size = u64::from(columns * rows) * 256 * 16;
    let descriptor = wgpu::BufferDescriptor {
        label: None,
        size,
        usage: wgpu::BufferUsages::STORAGE,
        mapped_at_creation: false,
    };
    let buffers = [0, 1].map(|_| device.create_buffer(&descriptor));
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(COPY.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: None,
        compilation_options: Default::default(),
        cache: None,
    });
    let entries = [0, 1].map(|binding| wgpu::BindGroupEntry {
        binding,
        resource: buffers[binding as usize].as_entire_binding(),
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    });
    let mut rates = Vec::new();
    for _ in 0..4 {
        let mut encoder = device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        for _ in 0..copies {
            pass.dispatch_workgroups(columns, rows, 1);
        }
        drop(pass);
        let start = Instant::now();
        queue.submit([encoder.finish()]);
        device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| error.to_string())?;
        rates.push(2.0 * f64::from(copies) * size as f64 / start.elapsed().as_secs_f64() / 1e9);
    }
    Ok(rates.into_iter().fold(0.0, f64::max))
}
