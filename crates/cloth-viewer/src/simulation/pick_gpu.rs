//! The same question as in `pick`, answered on the device: a few words come back.

use cloth::{Model, wgpu::wgpu};

use crate::{Gpu, Ray, ViewerError};

use super::pick::Pick;

/// The parameters of a pass, as in `pick.wgsl`.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Parameters {
    origin: [f32; 3],
    reach: f32,
    direction: [f32; 3],
    pass_number: u32,
    triangle_count: u32,
    particle_count: u32,
    padding: [u32; 2],
}

/// Words of the answer, all NOTHING at first, and that of them which are read.
const FOUND_WORDS: usize = 6;
const ANSWER: std::ops::Range<u64> = 16..24;
const NOTHING: u32 = u32::MAX;

/// The triangles of a model on a device, and the kernel that looks through them.
pub(super) struct GpuPick {
    gpu: Gpu,
    pipeline: wgpu::ComputePipeline,
    triangles: wgpu::Buffer,
    found: wgpu::Buffer,
    answer: wgpu::Buffer,
    triangle_count: u32,
    particle_count: u32,
}

impl GpuPick {
    pub(super) fn new(gpu: &Gpu, model: &Model) -> Self {
        let device = &gpu.device;
        let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("pick"),
            source: wgpu::ShaderSource::Wgsl(include_str!("../renderer/shaders/pick.wgsl").into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("pick"),
            layout: None,
            module: &shader,
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        });
        let storage = wgpu::BufferUsages::STORAGE;
        Self {
            pipeline,
            triangles: gpu.buffer("triangles of a pick", model.triangles(), storage),
            found: gpu.empty_buffer(
                "pick",
                4 * FOUND_WORDS as u64,
                storage | wgpu::BufferUsages::COPY_SRC,
            ),
            answer: gpu.empty_buffer("picked", 16, wgpu::BufferUsages::MAP_READ),
            triangle_count: model.triangles().len() as u32,
            particle_count: model.particle_count() as u32,
            gpu: gpu.clone(),
        }
    }

    /// What `pick` says of these positions, `vec4<f32>` each.
    pub(super) fn pick(
        &self,
        positions: &wgpu::Buffer,
        ray: &Ray,
        reach: f64,
    ) -> Result<Option<Pick>, ViewerError> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        queue.write_buffer(&self.found, 0, bytemuck::cast_slice(&[NOTHING; FOUND_WORDS]));
        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.pipeline);
            for pass_number in 0..3 {
                let parameters = Parameters {
                    origin: ray.origin.map(|x| x as f32),
                    reach: reach as f32,
                    direction: ray.direction.map(|x| x as f32),
                    pass_number,
                    triangle_count: self.triangle_count,
                    particle_count: self.particle_count,
                    padding: [0; 2],
                };
                let uniform = wgpu::BufferUsages::UNIFORM;
                let parameters = self.gpu.buffer("parameters of a pick", &[parameters], uniform);
                let buffers = [&parameters, positions, &self.triangles, &self.found];
                let entries: Vec<_> = (0..)
                    .zip(buffers)
                    .map(|(binding, buffer)| wgpu::BindGroupEntry {
                        binding,
                        resource: buffer.as_entire_binding(),
                    })
                    .collect();
                let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("pick"),
                    layout: &self.pipeline.get_bind_group_layout(0),
                    entries: &entries,
                });
                pass.set_bind_group(0, &group, &[]);
                let items =
                    if pass_number == 2 { 1 } else { self.triangle_count.max(self.particle_count) };
                let groups = items.div_ceil(64).max(1);
                let rows = groups.div_ceil(32_768);
                pass.dispatch_workgroups(groups.div_ceil(rows), rows, 1);
            }
        }
        let size = ANSWER.end - ANSWER.start;
        encoder.copy_buffer_to_buffer(&self.found, ANSWER.start, &self.answer, 0, size);
        queue.submit([encoder.finish()]);
        let slice = self.answer.slice(..size);
        let (mapped, outcome) = std::sync::mpsc::channel();
        // The receiver waits below.
        slice.map_async(wgpu::MapMode::Read, move |result| _ = mapped.send(result));
        let lost = |reason: String| {
            ViewerError::Simulation(cloth::Error::DeviceLost { backend: "wgpu", reason })
        };
        device
            .poll(wgpu::PollType::wait_indefinitely())
            .map_err(|error| lost(error.to_string()))?;
        match outcome.recv() {
            Ok(Ok(())) => {}
            Ok(Err(error)) => return Err(lost(error.to_string())),
            Err(error) => return Err(lost(error.to_string())),
        }
        let view = slice.get_mapped_range().map_err(|error| lost(error.to_string()))?;
        let [particle, distance]: [u32; 2] = bytemuck::pod_read_unaligned(&view);
        drop(view);
        self.answer.unmap();
        let distance = f64::from(f32::from_bits(distance));
        Ok((particle != NOTHING).then_some(Pick { particle, distance }))
    }
}

#[cfg(test)]
mod tests {
    use cloth::scene::{CompileOptions, Scene};
    use glam::DVec3;

    use super::*;
    use crate::{FrameBuffers, simulation::pick::pick};

    /// Rays through and beside a crumpled sheet: the answer of the processor, but where two answers are as good.
    #[test]
    fn the_device_picks_what_the_processor_picks() {
        let model =
            Scene::builtin("drape").unwrap().compile(&CompileOptions::default()).unwrap().model;
        let gpu = Gpu::headless(None).unwrap();
        let picker = GpuPick::new(&gpu, &model);
        let positions: Vec<[f64; 3]> = model
            .positions()
            .iter()
            .map(|&[x, y, z]| {
                let crumpled =
                    [x + 0.02 * (31.0 * y).sin(), y, z + 0.05 * (23.0 * x + 11.0 * y).sin()];
                crumpled.map(|c| f64::from(c as f32))
            })
            .collect();
        let buffers = FrameBuffers::new(&gpu, positions.len());
        buffers.upload(&gpu, &positions, &[]);
        let bounds = cloth::io::Bounds::of(&positions);
        let size = DVec3::from(bounds.max) - DVec3::from(bounds.min);
        let (mut met, mut near, mut missed) = (0, 0, 0);
        for number in 0..300_u32 {
            // A low-discrepancy sequence over a frame a tenth larger than the sheet.
            let share = |base: f64| (f64::from(number) * base).fract() * 1.1 - 0.05;
            let aim = DVec3::from(bounds.min)
                + size * DVec3::new(share(0.618_033_988_75), share(0.754_877_666_25), 0.5);
            let origin = aim + DVec3::new(0.3, -1.5, 2.0);
            let direction = (aim - origin).normalize().to_array();
            let ray = Ray { origin: origin.to_array(), direction };
            let expected = pick(&model, &positions, &ray, 0.02);
            let found = picker.pick(buffers.positions(), &ray, 0.02).unwrap();
            match (expected, found) {
                (None, None) => missed += 1,
                (Some(expected), Some(found)) => {
                    let of = |pick: Pick| DVec3::from(positions[pick.particle as usize]);
                    let hit = DVec3::from(ray.at(expected.distance));
                    let worse = of(found).distance(hit) - of(expected).distance(hit);
                    assert!(
                        found.particle == expected.particle || worse.abs() < 1e-5,
                        "{number}: {expected:?}, {found:?}"
                    );
                    assert!((found.distance - expected.distance).abs() < 1e-4, "{found:?}");
                    let is_beside = of(expected).distance(hit) > 1e-12
                        && (0..3).all(|k| aim[k] < bounds.min[k] || aim[k] > bounds.max[k]);
                    if is_beside { near += 1 } else { met += 1 }
                }
                (expected, found) => panic!("{number}: {expected:?}, {found:?}"),
            }
        }
        assert!(met > 100 && missed > 5, "{met} met, {near} near, {missed} missed");
    }
}
