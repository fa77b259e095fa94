//! How the walls are drawn, and copied into the window.

use eframe::wgpu;

use super::data::{GpuVertex, Shown};

pub(super) const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
pub(super) const SAMPLES: u32 = 4;

pub(super) struct Pipelines {
    pub(super) whole: wgpu::RenderPipeline,
    /// The walls that face away, and those that face the eye drawn over them.
    pub(super) away: wgpu::RenderPipeline,
    pub(super) ghost: wgpu::RenderPipeline,
    /// Rims and sharp edges, over the walls.
    pub(super) edges: wgpu::RenderPipeline,
    pub(super) blit: wgpu::RenderPipeline,
}

/// Bindings of the scene (uniforms, map, sampler) or of the blit (picture).
pub(super) fn layout(device: &wgpu::Device, scene: bool) -> wgpu::BindGroupLayout {
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let uniforms = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let kinds = if scene {
        vec![uniforms, texture, sampler]
    } else {
        vec![texture]
    };
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
        .zip(kinds)
        .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty,
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &entries,
    })
}

/// Which walls a pipeline draws.
#[derive(Clone, Copy, PartialEq)]
enum WallPass {
    /// Both sides: through the windows the inside is seen.
    All,
    FacingAway,
    /// Those that face the eye, over what is behind them.
    Ghost,
    /// No walls: the lines where they end or turn.
    Edges,
}

impl Pipelines {
    pub(super) fn new(
        device: &wgpu::Device,
        scene: &wgpu::BindGroupLayout,
        blit: &wgpu::BindGroupLayout,
        window: wgpu::TextureFormat,
    ) -> Self {
        let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("limb"),
            source: wgpu::ShaderSource::Wgsl(include_str!("../../../shaders/limb.wgsl").into()),
        });
        let of = |walls| scene_pipeline(device, scene, &shader, walls);
        Self {
            whole: of(WallPass::All),
            away: of(WallPass::FacingAway),
            ghost: of(WallPass::Ghost),
            edges: of(WallPass::Edges),
            blit: blit_pipeline(device, blit, window),
        }
    }
}

fn scene_pipeline(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    shader: &wgpu::ShaderModule,
    walls: WallPass,
) -> wgpu::RenderPipeline {
    let edges = walls == WallPass::Edges;
    let blends = edges || walls == WallPass::Ghost;
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("limb"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let fixed = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 5 => Float32];
    let changing = wgpu::vertex_attr_array![2 => Float32x3, 3 => Float32, 4 => Unorm8x4];
    let buffer = |stride, attributes| {
        Some(wgpu::VertexBufferLayout {
            array_stride: stride,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes,
        })
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("limb"),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some(if edges { "vs_edge" } else { "vs" }),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[
                buffer(size_of::<GpuVertex>() as u64, &fixed),
                buffer(size_of::<Shown>() as u64, &changing),
            ],
        },
        primitive: wgpu::PrimitiveState {
            topology: if edges {
                wgpu::PrimitiveTopology::LineList
            } else {
                wgpu::PrimitiveTopology::TriangleList
            },
            cull_mode: match walls {
                WallPass::All | WallPass::Edges => None,
                WallPass::FacingAway => Some(wgpu::Face::Front),
                WallPass::Ghost => Some(wgpu::Face::Back),
            },
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(!blends),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState {
            count: SAMPLES,
            ..Default::default()
        },
        fragment: Some(wgpu::FragmentState {
            module: shader,
            entry_point: Some(match walls {
                WallPass::All | WallPass::FacingAway => "fs",
                WallPass::Ghost => "fs_ghost",
                WallPass::Edges => "fs_edge",
            }),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: COLOR,
                blend: blends.then_some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

fn blit_pipeline(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    window: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("blit"),
        source: wgpu::ShaderSource::Wgsl(include_str!("../../../shaders/blit.wgsl").into()),
    });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("blit"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("blit"),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: &shader,
            entry_point: Some("vs"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &shader,
            entry_point: Some("fs"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(window.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
