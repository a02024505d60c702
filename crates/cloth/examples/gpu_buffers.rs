//! A renderer that draws from the buffers of the solver, on the same GPU: no position ever leaves it.
//! `cargo run -p cloth --features wgpu --example gpu_buffers`. The picture is drawn with letters, as this renderer has no window.

use std::error::Error;

use cloth::{
    Cloth, Control, GridPatch, ImplicitSettings, Integrator, MaterialPreset, Model, ModelBuilder,
    ModelSimulation, SolverConfig,
    wgpu::{DeviceBuffers, WgpuBackend, wgpu},
};

/// Width and height of the picture \[pixel\]. Rows of copies are whole multiples of 256 bytes.
const SIZE: [u32; 2] = [64, 32];
const SIDE: u32 = 25;

/// Vertices are looked up by their number, as the solver keeps them. Seen from the side, y away from the eye.
const SHADER: &str = "
@group(0) @binding(0) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read> normals: array<vec4<f32>>;

struct Corner { @builtin(position) place: vec4<f32>, @location(0) light: f32 }

@vertex fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let at = positions[index].xyz;
    let light = 0.3 + 0.7 * abs(dot(normals[index].xyz, vec3(0.5, -0.6, 0.6)));
    return Corner(vec4(1.6 * at.x, 1.6 * at.z + 0.6, 0.5, 1.0), light);
}

@fragment fn colour(corner: Corner) -> @location(0) vec4<f32> {
    return vec4(vec3(corner.light), 1.0);
}
";

struct Renderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::RenderPipeline,
    triangles: wgpu::Buffer,
    corners: u32,
    picture: wgpu::Texture,
}

impl Renderer {
    fn new(device: wgpu::Device, queue: wgpu::Queue, model: &Model) -> Self {
        let format = wgpu::TextureFormat::Rgba8Unorm;
        let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &shader,
                entry_point: None,
                compilation_options: Default::default(),
                buffers: &[],
            },
            fragment: Some(wgpu::FragmentState {
                module: &shader,
                entry_point: None,
                compilation_options: Default::default(),
                targets: &[Some(format.into())],
            }),
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            multiview_mask: None,
            cache: None,
        });
        let indices: Vec<u8> =
            model.triangles().iter().flatten().flat_map(|index| index.to_ne_bytes()).collect();
        let triangles = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: indices.len() as u64,
            usage: wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        queue.write_buffer(&triangles, 0, &indices);
        let picture = device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let corners = 3 * model.triangles().len() as u32;
        Self { device, queue, pipeline, triangles, corners, picture }
    }

    /// Draws the present state. Its buffers change from frame to frame, so that they are bound anew.
    fn draw(&self, buffers: &DeviceBuffers) {
        let bound = [(0, &buffers.positions), (1, &buffers.normals)];
        let entries = bound.map(|(binding, buffer)| wgpu::BindGroupEntry {
            binding,
            resource: buffer.as_entire_binding(),
        });
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let view = self.picture.create_view(&Default::default());
        let mut encoder = self.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Store,
                },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.set_index_buffer(self.triangles.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.corners, 0, 0..1);
        drop(pass);
        // It comes after the work of the solver, which has the same queue.
        self.queue.submit([encoder.finish()]);
    }

    /// Brightness of every pixel, row by row; waits for the GPU.
    fn read(&self) -> Result<Vec<u8>, Box<dyn Error>> {
        let [width, height] = SIZE;
        let copy = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(4 * width * height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            self.picture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &copy,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(4 * width),
                    rows_per_image: None,
                },
            },
            self.picture.size(),
        );
        self.queue.submit([encoder.finish()]);
        copy.slice(..).map_async(wgpu::MapMode::Read, |_| {});
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(copy.slice(..).get_mapped_range()?.chunks_exact(4).map(|pixel| pixel[0]).collect())
    }
}

/// The last picture of a sheet that hangs from two corners, and what the solver copied to the host in one frame \[byte\].
fn last_picture(frames: u32) -> Result<(Vec<u8>, u64), Box<dyn Error>> {
    let patch = GridPatch::new([SIDE, SIDE], 0.04);
    let sheet = Cloth::grid("sheet", patch, &MaterialPreset::JERSEY).with_pins([0, SIDE - 1]);
    let model = std::sync::Arc::new(ModelBuilder::new().cloth(sheet).build()?);
    let config = SolverConfig {
        integrator: Integrator::Implicit(ImplicitSettings::default()),
        time_step: 1.0 / 60.0,
        ..SolverConfig::default()
    };
    // A game has a device already; this opens one the short way.
    let opened = WgpuBackend::new(None)?;
    let (device, queue) = (opened.device().clone(), opened.queue().clone());
    let backend = WgpuBackend::from_device(device.clone(), queue.clone());
    let renderer = Renderer::new(device, queue, &model);
    let solver = backend.create_wgpu_solver(model, &config)?;
    let mut simulation = ModelSimulation::of_solver(solver, 60.0);
    let mut copied = 0;
    for _ in 0..frames {
        let before = backend.bytes_read();
        simulation.step(&Control::default())?;
        renderer.draw(&simulation.solver_mut().device_buffers()?);
        copied = backend.bytes_read() - before;
    }
    Ok((renderer.read()?, copied))
}

fn main() -> Result<(), Box<dyn Error>> {
    let (picture, copied) = last_picture(40)?;
    for row in picture.chunks_exact(SIZE[0] as usize) {
        let letter = |&light: &u8| char::from(b" .:-=+*#%@"[usize::from(light) * 9 / 255]);
        println!("{}", row.iter().map(letter).collect::<String>());
    }
    println!("bytes that came to the host in the last frame: {copied}");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sheet_is_in_the_picture_and_stays_on_the_gpu() {
        let [early, late] = [1, 20].map(|frames| last_picture(frames).expect("the example runs"));
        let lit = |picture: &[u8]| picture.iter().filter(|&&light| light > 0).count();
        let [early_lit, late_lit] = [lit(&early.0), lit(&late.0)];
        assert!(
            late_lit > 200 && late_lit > 2 * early_lit,
            "it hangs down: {early_lit}, {late_lit}"
        );
        assert!(late.1 < u64::from(16 * SIDE * SIDE), "{} bytes", late.1);
    }
}
