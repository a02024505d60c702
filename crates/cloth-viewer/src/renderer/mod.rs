//! Draws cloth, colliders and overlays into a texture.
//!
//! The surface of the cloths is drawn straight from two storage buffers, positions and normals, each an
//! array of `vec4<f32>`: those of the wgpu backend or an upload from any other. A picture takes up to
//! three passes: `strain` computes the heat map, `shadow` depth from the light, and the last one all
//! that is seen, with four samples a pixel.

mod cloth_mesh;
mod frame_buffers;
mod orbit;
mod overlay;
mod pipelines;
mod solids;
mod target;
mod view;

use cloth::{io::PictureSolid, wgpu::wgpu};

pub use cloth_mesh::ClothMesh;
pub use frame_buffers::FrameBuffers;
pub use orbit::{OrbitCamera, Ray};
pub use overlay::{Disc, LineEnd, Overlays, PlaceLine};
pub(crate) use overlay::{colour_bytes, dust_lines};
pub use target::RenderTarget;

use crate::Gpu;
use overlay::OverlayBuffers;
use pipelines::Pipelines;
use view::{ShadowMap, ViewUniform};

/// Samples of a pixel.
pub(crate) const SAMPLES: u32 = 4;

/// The renderer: pipelines and what they share.
pub struct Renderer {
    gpu: Gpu,
    pipelines: Pipelines,
    uniform: wgpu::Buffer,
    shadow: ShadowMap,
    /// View and shadow map, for the pass that is seen.
    view_group: wgpu::BindGroup,
    /// The view alone, for the shadow pass.
    light_group: wgpu::BindGroup,
    solids: solids::SolidBuffers,
    overlays: OverlayBuffers,
}

/// What is in one picture beside the surface of the cloths.
#[derive(Clone, Debug, Default)]
pub struct FrameContents {
    /// Colliders and floors.
    pub shapes: Vec<PictureSolid>,
    /// Discs: pins, contacts, the particle that is grabbed.
    pub discs: Vec<Disc>,
    /// Lines in space: bins, dust, the spring of the pointer.
    pub lines: Vec<PlaceLine>,
    /// Which overlays to draw.
    pub overlays: Overlays,
}

impl Renderer {
    /// Compiles the shaders.
    #[must_use]
    pub fn new(gpu: &Gpu) -> Self {
        let pipelines = Pipelines::new(&gpu.device);
        let uniform =
            gpu.empty_buffer("view", size_of::<ViewUniform>() as u64, wgpu::BufferUsages::UNIFORM);
        let shadow = ShadowMap::new(&gpu.device);
        let view_group = pipelines.view_group(&gpu.device, &uniform, &shadow);
        let light_group = pipelines.light_group(&gpu.device, &uniform);
        Self {
            gpu: gpu.clone(),
            pipelines,
            uniform,
            shadow,
            view_group,
            light_group,
            solids: solids::SolidBuffers::default(),
            overlays: OverlayBuffers::default(),
        }
    }

    /// The device.
    #[must_use]
    pub const fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Draws a picture of `mesh` at the positions in `frame` into `target`, and submits it.
    pub fn render(
        &mut self,
        target: &RenderTarget,
        camera: &OrbitCamera,
        mesh: &mut ClothMesh,
        frame: &FrameBuffers,
        contents: &FrameContents,
    ) {
        let overlays = contents.overlays;
        let uniform = ViewUniform::new(camera, mesh, target.size(), overlays);
        self.gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        self.solids.update(&self.gpu, &contents.shapes, mesh.bounds());
        self.overlays.update(&self.gpu, contents);
        mesh.prepare(&self.gpu, overlays);
        let groups = frame.groups(&self.gpu.device, &self.pipelines, mesh);

        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        if overlays.strain {
            self.strain_pass(&mut encoder, mesh, frame, overlays);
        }
        self.shadow_pass(&mut encoder, mesh, &groups);
        self.picture_pass(&mut encoder, target, mesh, &groups, overlays);
        self.gpu.queue.submit([encoder.finish()]);
    }

    fn strain_pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        mesh: &ClothMesh,
        frame: &FrameBuffers,
        overlays: Overlays,
    ) {
        let pipeline = &self.pipelines.strain[overlays.strain_measure as usize];
        let Some(group) = mesh.strain_group(&self.gpu.device, (&self.pipelines, pipeline), frame)
        else {
            return;
        };
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        let groups = (mesh.particle_count() as u32).div_ceil(64).max(1);
        let rows = groups.div_ceil(32_768);
        pass.dispatch_workgroups(groups.div_ceil(rows), rows, 1);
    }

    fn shadow_pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        mesh: &ClothMesh,
        groups: &frame_buffers::FrameGroups,
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("shadow"),
            depth_stencil_attachment: Some(depth_attachment(
                &self.shadow.view,
                1.0,
                wgpu::StoreOp::Store,
            )),
            ..Default::default()
        });
        pass.set_bind_group(0, &self.light_group, &[]);
        pass.set_bind_group(1, &groups.positions, &[]);
        pass.set_pipeline(&self.pipelines.shadow_cloth);
        mesh.draw_surface(&mut pass);
        pass.set_pipeline(&self.pipelines.shadow_solid);
        self.solids.draw_solids(&mut pass);
    }

    fn picture_pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &RenderTarget,
        mesh: &ClothMesh,
        groups: &frame_buffers::FrameGroups,
        overlays: Overlays,
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("picture"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target.samples(),
                depth_slice: None,
                resolve_target: Some(target.view()),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Discard,
                },
            })],
            depth_stencil_attachment: Some(depth_attachment(
                target.depth(),
                0.0,
                wgpu::StoreOp::Discard,
            )),
            ..Default::default()
        });
        pass.set_bind_group(0, &self.view_group, &[]);
        pass.set_pipeline(&self.pipelines.sky);
        pass.draw(0..3, 0..1);
        pass.set_pipeline(&self.pipelines.solid);
        self.solids.draw_solids(&mut pass);
        if overlays.surface {
            pass.set_bind_group(1, &groups.surface, &[]);
            pass.set_pipeline(&self.pipelines.cloth);
            mesh.draw_surface(&mut pass);
        }
        // Floors let the sky through where they end, so they come after what is behind them.
        pass.set_pipeline(&self.pipelines.solid);
        self.solids.draw_floors(&mut pass);
        pass.set_bind_group(1, &groups.positions, &[]);
        if overlays.threads {
            pass.set_pipeline(&self.pipelines.thread);
            mesh.draw_threads(&mut pass);
        }
        pass.set_pipeline(&self.pipelines.line_particle);
        mesh.draw_lines(&mut pass, overlays);
        pass.set_pipeline(&self.pipelines.line_place);
        self.overlays.draw_lines(&mut pass);
        pass.set_pipeline(&self.pipelines.point);
        self.overlays.draw_discs(&mut pass);
    }
}

fn depth_attachment(
    view: &wgpu::TextureView,
    far: f32,
    store: wgpu::StoreOp,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(far), store }),
        stencil_ops: None,
    }
}
