//! What stays the same from frame to frame: triangles, springs, colours.

use std::{collections::HashSet, sync::Arc};

use cloth::{
    Model, SpringClass, cloth_lines,
    io::{PictureStyle, ThreadMap},
    wgpu::wgpu,
};
use glam::DVec3;

use super::{
    FrameBuffers, Overlays,
    overlay::{colour_bytes, colour_linear},
    pipelines::Pipelines,
};
use crate::Gpu;

/// A sphere around all that moves and all that throws shadows.
#[derive(Clone, Copy, Debug)]
pub(super) struct SceneSphere {
    pub(super) center: DVec3,
    pub(super) radius: f64,
}

/// End of a line at a particle.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct LineEnd {
    particle: u32,
    colour: [u8; 4],
}

/// A triangle of fabric as `strain.wgsl` has it.
#[derive(Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct FabricTriangle {
    corners: [u32; 4],
    inverse: [f32; 4],
}

/// A piece of a thread as `thread.wgsl` has it.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Thread {
    corners: [u32; 3],
    weights: [[f32; 3]; 2],
    colour: [u8; 4],
}

/// Colours of wires and of the springs of each class: sRGB and opacity.
const WIRE: [u8; 4] = [16, 18, 22, 150];
const STRETCH: [u8; 4] = [222, 74, 52, 220];
const SHEAR: [u8; 4] = [44, 132, 210, 200];
const BEND: [u8; 4] = [88, 176, 72, 180];

/// The cloths of a model, ready to be drawn at any positions.
pub struct ClothMesh {
    model: Arc<Model>,
    bounds: SceneSphere,
    triangles: wgpu::Buffer,
    colours: wgpu::Buffer,
    strains: wgpu::Buffer,
    /// Offsets, columns and rest lengths of the springs of each particle.
    spring_rows: Option<[wgpu::Buffer; 3]>,
    /// Offsets of each particle and its triangles of fabric.
    fabric_rows: Option<[wgpu::Buffer; 2]>,
    /// Cloths without triangles.
    strands: Option<Lines>,
    wires: Option<Lines>,
    /// Pieces of threads of fabric.
    threads: Option<Lines>,
    springs: [Option<Lines>; 3],
}

struct Lines {
    ends: wgpu::Buffer,
    count: u32,
}

impl ClothMesh {
    /// The cloths of `model` in the colours of `style`, whose shapes tell the size of the scene.
    #[must_use]
    pub fn new(gpu: &Gpu, model: &Arc<Model>, style: &PictureStyle) -> Self {
        let mut colours = vec![[0_u8; 4]; model.particle_count()];
        let mut strands = Vec::new();
        for (number, cloth) in model.cloths().iter().enumerate() {
            let srgb = style.cloth_colors.get(number).copied();
            let srgb = srgb.unwrap_or_else(|| cloth::io::picture_palette(number));
            colours[cloth.particles.start as usize..cloth.particles.end as usize]
                .fill(colour_linear(srgb));
            if cloth.triangles.is_empty() {
                let colour = colour_bytes(srgb);
                let ends = cloth_lines(model, cloth).into_iter().flatten();
                strands.extend(ends.map(|particle| LineEnd { particle, colour }));
            }
        }
        let storage = wgpu::BufferUsages::STORAGE;
        Self {
            model: Arc::clone(model),
            bounds: bounds(model, style),
            triangles: gpu.buffer("triangles", model.triangles(), wgpu::BufferUsages::INDEX),
            colours: gpu.buffer("colours", &colours, storage),
            strains: gpu.empty_buffer("strains", 4 * model.particle_count() as u64, storage),
            spring_rows: None,
            fabric_rows: None,
            strands: (!strands.is_empty()).then(|| Lines::new(gpu, &strands)),
            wires: None,
            threads: None,
            springs: [const { None }; 3],
        }
    }

    /// Number of particles.
    #[must_use]
    pub fn particle_count(&self) -> usize {
        self.model.particle_count()
    }

    pub(super) const fn bounds(&self) -> &SceneSphere {
        &self.bounds
    }

    pub(super) const fn colours(&self) -> &wgpu::Buffer {
        &self.colours
    }

    pub(super) const fn strains(&self) -> &wgpu::Buffer {
        &self.strains
    }

    /// Makes what the overlays need, the first time that they are asked for.
    pub(super) fn prepare(&mut self, gpu: &Gpu, overlays: Overlays) {
        if overlays.strain && self.spring_rows.is_none() {
            let rows = self.model.springs().gather_rows();
            let kinds = self.model.springs().kinds();
            let rest: Vec<f32> =
                rows.kinds.iter().map(|&kind| kinds[kind as usize].rest_length as f32).collect();
            let storage = wgpu::BufferUsages::STORAGE;
            self.spring_rows = Some([
                gpu.buffer("spring offsets", &rows.offsets, storage),
                gpu.buffer("spring columns", &rows.columns, storage),
                gpu.buffer("spring rest lengths", &rest, storage),
            ]);
            self.fabric_rows = Some(self.fabric_rows(gpu));
        }
        if overlays.wires && self.wires.is_none() {
            self.wires = Some(self.edge_lines(gpu));
        }
        if overlays.threads && self.threads.is_none() {
            self.threads = Some(self.thread_lines(gpu));
        }
        for (slot, class, colour) in [
            (0, SpringClass::Stretch, STRETCH),
            (1, SpringClass::Shear, SHEAR),
            (2, SpringClass::Bend, BEND),
        ] {
            if overlays.springs[slot] && self.springs[slot].is_none() {
                self.springs[slot] = Some(self.spring_lines(gpu, class, colour));
            }
        }
    }

    /// The triangles of fabric around each particle.
    fn fabric_rows(&self, gpu: &Gpu) -> [wgpu::Buffer; 2] {
        let triangles = self.model.elements().triangles();
        let mut offsets = vec![0_u32; self.model.particle_count() + 1];
        for particle in triangles.iter().flat_map(|triangle| triangle.particles) {
            offsets[particle as usize + 1] += 1;
        }
        for place in 1..offsets.len() {
            offsets[place] += offsets[place - 1];
        }
        // One at least, as a shader wants it.
        let mut entries = vec![FabricTriangle::default(); (3 * triangles.len()).max(1)];
        let mut next = offsets.clone();
        for triangle in triangles {
            let [a, b, c] = triangle.particles;
            let inverse = triangle.rest.inverse.as_flattened();
            let entry = FabricTriangle {
                corners: [a, b, c, 0],
                inverse: std::array::from_fn(|k| inverse[k] as f32),
            };
            for particle in triangle.particles {
                entries[next[particle as usize] as usize] = entry;
                next[particle as usize] += 1;
            }
        }
        let storage = wgpu::BufferUsages::STORAGE;
        [
            gpu.buffer("fabric offsets", &offsets, storage),
            gpu.buffer("fabric triangles", &entries, storage),
        ]
    }

    fn edge_lines(&self, gpu: &Gpu) -> Lines {
        let mut seen = HashSet::new();
        let mut ends = Vec::new();
        for &[a, b, c] in self.model.triangles() {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                if seen.insert([from.min(to), from.max(to)]) {
                    ends.extend([from, to].map(|particle| LineEnd { particle, colour: WIRE }));
                }
            }
        }
        Lines::new(gpu, &ends)
    }

    fn thread_lines(&self, gpu: &Gpu) -> Lines {
        let threads: Vec<Thread> = ThreadMap::new(&self.model)
            .segments()
            .map(|segment| Thread {
                corners: self.model.triangles()[segment.triangle as usize],
                weights: segment.ends.map(|weights| weights.map(|weight| weight as f32)),
                colour: colour_bytes(segment.direction.colour()),
            })
            .collect();
        let buffer = gpu.buffer("threads", &threads, wgpu::BufferUsages::VERTEX);
        Lines { ends: buffer, count: threads.len() as u32 }
    }

    fn spring_lines(&self, gpu: &Gpu, class: SpringClass, colour: [u8; 4]) -> Lines {
        let springs = self.model.springs();
        let of_class = springs.iter().filter(|s| springs.kinds()[s.kind as usize].class == class);
        let ends: Vec<LineEnd> = of_class
            .flat_map(|spring| spring.particles.map(|particle| LineEnd { particle, colour }))
            .collect();
        Lines::new(gpu, &ends)
    }

    pub(super) fn strain_group(
        &self,
        device: &wgpu::Device,
        (pipelines, pipeline): (&Pipelines, &wgpu::ComputePipeline),
        frame: &FrameBuffers,
    ) -> Option<wgpu::BindGroup> {
        let [offsets, columns, rest] = self.spring_rows.as_ref()?;
        let [fabric_offsets, fabric] = self.fabric_rows.as_ref()?;
        let buffers =
            [&frame.positions, offsets, columns, rest, &self.strains, fabric_offsets, fabric];
        Some(pipelines.group(device, &pipeline.get_bind_group_layout(0), &buffers))
    }

    pub(super) fn draw_surface(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_index_buffer(self.triangles.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..3 * self.model.triangles().len() as u32, 0, 0..1);
    }

    pub(super) fn draw_threads(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(threads) = self.threads.as_ref().filter(|threads| threads.count > 0) {
            pass.set_vertex_buffer(0, threads.ends.slice(..));
            pass.draw(0..4, 0..threads.count);
        }
    }

    pub(super) fn draw_lines(&self, pass: &mut wgpu::RenderPass<'_>, overlays: Overlays) {
        let springs = self.springs.iter().zip(overlays.springs);
        let others = [(&self.strands, overlays.surface), (&self.wires, overlays.wires)];
        let shown = springs.chain(others).filter(|(_, shown)| *shown);
        for lines in shown.filter_map(|(lines, _)| lines.as_ref()) {
            pass.set_vertex_buffer(0, lines.ends.slice(..));
            pass.draw(0..lines.count, 0..1);
        }
    }
}

impl Lines {
    fn new(gpu: &Gpu, ends: &[LineEnd]) -> Self {
        let buffer = gpu.buffer("lines", ends, wgpu::BufferUsages::VERTEX);
        Self { ends: buffer, count: ends.len() as u32 }
    }
}

/// The start, the colliders, and room to fall to the floor or to swing.
fn bounds(model: &Model, style: &PictureStyle) -> SceneSphere {
    use cloth::io::{Bounds, PictureShape};
    let cloth = Bounds::of(model.positions());
    let shapes = style.shapes.at(0.0);
    let mut all = shapes.iter().fold(cloth, |bounds, solid| bounds.union(&solid.shape.bounds()));
    let width = (0..2).map(|k| cloth.max[k] - cloth.min[k]).fold(0.0, f64::max);
    let floor = shapes.iter().find_map(|solid| match &solid.shape {
        PictureShape::Plane { normal, offset } if normal[2] > 0.5 => Some(offset / normal[2]),
        _ => None,
    });
    all.min[2] = all.min[2].min(floor.unwrap_or(cloth.min[2] - 0.7 * width));
    let (min, max) = (DVec3::from(all.min), DVec3::from(all.max));
    SceneSphere { center: 0.5 * (min + max), radius: (0.55 * (max - min).length()).max(1e-3) }
}
