//! Pipelines and what they bind.

use cloth::{StrainMeasure, wgpu::wgpu};

use super::{
    SAMPLES,
    solids::SolidVertex,
    target::{DEPTH_FORMAT, FORMAT},
    view::ShadowMap,
};

/// Everything that is compiled.
pub(super) struct Pipelines {
    view_layout: wgpu::BindGroupLayout,
    light_layout: wgpu::BindGroupLayout,
    pub(super) surface_layout: wgpu::BindGroupLayout,
    pub(super) positions_layout: wgpu::BindGroupLayout,
    /// One for each measure, in the order of [`StrainMeasure::ALL`].
    pub(super) strain: [wgpu::ComputePipeline; StrainMeasure::ALL.len()],
    pub(super) shadow_cloth: wgpu::RenderPipeline,
    pub(super) shadow_solid: wgpu::RenderPipeline,
    pub(super) sky: wgpu::RenderPipeline,
    pub(super) solid: wgpu::RenderPipeline,
    pub(super) cloth: wgpu::RenderPipeline,
    pub(super) line_particle: wgpu::RenderPipeline,
    pub(super) line_place: wgpu::RenderPipeline,
    pub(super) thread: wgpu::RenderPipeline,
    pub(super) point: wgpu::RenderPipeline,
}

/// How a pipeline of the pass that is seen differs from the others.
struct PictureStage<'a> {
    label: &'a str,
    shader: &'a wgpu::ShaderModule,
    entry: &'a str,
    groups: &'a [Option<&'a wgpu::BindGroupLayout>],
    buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    topology: wgpu::PrimitiveTopology,
    /// Whether it is drawn behind everything.
    behind: bool,
    depth_write: bool,
}

impl Pipelines {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let view_layout = layout(
            device,
            "view",
            &[
                uniform_entry(0),
                wgpu::BindGroupLayoutEntry {
                    binding: 1,
                    visibility: wgpu::ShaderStages::FRAGMENT,
                    ty: wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Depth,
                        view_dimension: wgpu::TextureViewDimension::D2,
                        multisampled: false,
                    },
                    count: None,
                },
                wgpu::BindGroupLayoutEntry {
                    binding: 2,
                    visibility: wgpu::ShaderStages::FRAGMENT,
                    ty: wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison),
                    count: None,
                },
            ],
        );
        let light_layout = layout(device, "light", &[uniform_entry(0)]);
        let surface_layout = layout(device, "surface", &[0, 1, 2, 3].map(storage_entry));
        let positions_layout = layout(device, "positions", &[storage_entry(0)]);

        let shader = |label: &str, parts: &[&str]| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(parts.concat().into()),
            })
        };
        const VIEW: &str = include_str!("shaders/view.wgsl");
        const LIGHT: &str = include_str!("shaders/light.wgsl");
        let cloth = shader("cloth", &[VIEW, LIGHT, include_str!("shaders/cloth.wgsl")]);
        let solid = shader("solid", &[VIEW, LIGHT, include_str!("shaders/solid.wgsl")]);
        let sky = shader("sky", &[VIEW, LIGHT, include_str!("shaders/sky.wgsl")]);
        let line = shader("line", &[VIEW, include_str!("shaders/line.wgsl")]);
        let thread = shader("thread", &[VIEW, include_str!("shaders/thread.wgsl")]);
        let point = shader("point", &[VIEW, include_str!("shaders/point.wgsl")]);
        let shadow_cloth = shader("shadow", &[VIEW, include_str!("shaders/shadow_cloth.wgsl")]);
        let shadow_solid = shader("shadow", &[VIEW, include_str!("shaders/shadow_solid.wgsl")]);
        let strain = shader("strain", &[include_str!("shaders/strain.wgsl")]);

        let solid_attributes = wgpu::vertex_attr_array![
            0 => Float32x3, 1 => Float32x3, 2 => Float32x3, 3 => Unorm8x4
        ];
        let solid_buffer = vertices(SolidVertex::SIZE, &solid_attributes);
        let particle_attributes = wgpu::vertex_attr_array![0 => Uint32, 1 => Unorm8x4];
        let place_attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Uint32, 2 => Unorm8x4];
        let disc_attributes = wgpu::vertex_attr_array![
            0 => Float32x3, 1 => Uint32, 2 => Unorm8x4, 3 => Float32
        ];
        let thread_attributes = wgpu::vertex_attr_array![
            0 => Uint32x3, 1 => Float32x3, 2 => Float32x3, 3 => Unorm8x4
        ];
        let thread_buffer = wgpu::VertexBufferLayout {
            step_mode: wgpu::VertexStepMode::Instance,
            ..vertices(40, &thread_attributes)
        };
        let disc_buffer = wgpu::VertexBufferLayout {
            step_mode: wgpu::VertexStepMode::Instance,
            ..vertices(24, &disc_attributes)
        };

        let triangles = wgpu::PrimitiveTopology::TriangleList;
        let lines = wgpu::PrimitiveTopology::LineList;
        let stage = PictureStage {
            label: "sky",
            shader: &sky,
            entry: "vertex",
            groups: &[Some(&view_layout)],
            buffers: &[],
            topology: triangles,
            behind: true,
            depth_write: false,
        };
        let with_positions = [Some(&view_layout), Some(&positions_layout)];
        let line_stage = PictureStage {
            label: "line",
            shader: &line,
            groups: &with_positions,
            topology: lines,
            behind: false,
            ..stage
        };
        Self {
            strain: StrainMeasure::ALL.map(|measure| {
                let constants = [("MEASURE", f64::from(measure as u32))];
                device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some("strain"),
                    layout: None,
                    module: &strain,
                    entry_point: None,
                    compilation_options: wgpu::PipelineCompilationOptions {
                        constants: &constants,
                        ..Default::default()
                    },
                    cache: None,
                })
            }),
            shadow_cloth: shadow(
                device,
                &shadow_cloth,
                &[Some(&light_layout), Some(&positions_layout)],
                &[],
            ),
            shadow_solid: shadow(
                device,
                &shadow_solid,
                &[Some(&light_layout)],
                &[Some(vertices(SolidVertex::SIZE, &solid_attributes[..1]))],
            ),
            solid: picture(
                device,
                &PictureStage {
                    label: "solid",
                    shader: &solid,
                    buffers: &[Some(solid_buffer)],
                    behind: false,
                    depth_write: true,
                    ..stage
                },
            ),
            cloth: picture(
                device,
                &PictureStage {
                    label: "cloth",
                    shader: &cloth,
                    groups: &[Some(&view_layout), Some(&surface_layout)],
                    behind: false,
                    depth_write: true,
                    ..stage
                },
            ),
            line_particle: picture(
                device,
                &PictureStage {
                    entry: "vertex_particle",
                    buffers: &[Some(vertices(8, &particle_attributes))],
                    ..line_stage
                },
            ),
            line_place: picture(
                device,
                &PictureStage {
                    entry: "vertex_place",
                    buffers: &[Some(vertices(20, &place_attributes))],
                    ..line_stage
                },
            ),
            thread: picture(
                device,
                &PictureStage {
                    label: "thread",
                    shader: &thread,
                    groups: &with_positions,
                    buffers: &[Some(thread_buffer)],
                    topology: wgpu::PrimitiveTopology::TriangleStrip,
                    behind: false,
                    ..stage
                },
            ),
            point: picture(
                device,
                &PictureStage {
                    label: "point",
                    shader: &point,
                    groups: &with_positions,
                    buffers: &[Some(disc_buffer)],
                    topology: wgpu::PrimitiveTopology::TriangleStrip,
                    behind: false,
                    ..stage
                },
            ),
            sky: picture(device, &stage),
            view_layout,
            light_layout,
            surface_layout,
            positions_layout,
        }
    }

    pub(super) fn view_group(
        &self,
        device: &wgpu::Device,
        uniform: &wgpu::Buffer,
        shadow: &ShadowMap,
    ) -> wgpu::BindGroup {
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("view"),
            layout: &self.view_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::TextureView(&shadow.view),
                },
                wgpu::BindGroupEntry {
                    binding: 2,
                    resource: wgpu::BindingResource::Sampler(&shadow.sampler),
                },
            ],
        })
    }

    pub(super) fn light_group(
        &self,
        device: &wgpu::Device,
        uniform: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        self.group(device, &self.light_layout, &[uniform])
    }

    /// Buffers by their place in the list.
    pub(super) fn group(
        &self,
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        buffers: &[&wgpu::Buffer],
    ) -> wgpu::BindGroup {
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout,
            entries: &entries,
        })
    }
}

fn layout(
    device: &wgpu::Device,
    label: &str,
    entries: &[wgpu::BindGroupLayoutEntry],
) -> wgpu::BindGroupLayout {
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
}

const fn uniform_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    buffer_entry(binding, wgpu::ShaderStages::VERTEX_FRAGMENT, wgpu::BufferBindingType::Uniform)
}

const fn storage_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    buffer_entry(
        binding,
        wgpu::ShaderStages::VERTEX,
        wgpu::BufferBindingType::Storage { read_only: true },
    )
}

const fn buffer_entry(
    binding: u32,
    visibility: wgpu::ShaderStages,
    ty: wgpu::BufferBindingType,
) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}

const fn vertices(
    stride: u64,
    attributes: &[wgpu::VertexAttribute],
) -> wgpu::VertexBufferLayout<'_> {
    wgpu::VertexBufferLayout {
        array_stride: stride,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes,
    }
}

/// A pipeline of the shadow pass. Depth is 0 at the light.
fn shadow(
    device: &wgpu::Device,
    shader: &wgpu::ShaderModule,
    groups: &[Option<&wgpu::BindGroupLayout>],
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
) -> wgpu::RenderPipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("shadow"),
        bind_group_layouts: groups,
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("shadow"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers,
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: wgpu::DepthBiasState { constant: 2, slope_scale: 2.0, clamp: 0.0 },
        }),
        multisample: Default::default(),
        fragment: None,
        multiview_mask: None,
        cache: None,
    })
}

/// A pipeline of the pass that is seen. Depth is 0 at infinity and grows towards the eye.
fn picture(device: &wgpu::Device, stage: &PictureStage<'_>) -> wgpu::RenderPipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(stage.label),
        bind_group_layouts: stage.groups,
        immediate_size: 0,
    });
    let compare = if stage.behind {
        wgpu::CompareFunction::Always
    } else {
        wgpu::CompareFunction::GreaterEqual
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(stage.label),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: stage.shader,
            entry_point: Some(stage.entry),
            compilation_options: Default::default(),
            buffers: stage.buffers,
        },
        primitive: wgpu::PrimitiveState { topology: stage.topology, ..Default::default() },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(stage.depth_write),
            depth_compare: Some(compare),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState { count: SAMPLES, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: stage.shader,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: FORMAT,
                blend: Some(wgpu::BlendState::ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
