//! What light does around the limb once it is drawn: corners that it does not get into, and the shadow on the floor.

use std::sync::Arc;

use eframe::wgpu::{self, util::DeviceExt as _};

use super::pipelines::COLOR;
use crate::render::floor::{CELLS, FloorShadow};

/// How much light is left in corners and how far away that is, of every second pixel each way.
const LEFT: wgpu::TextureFormat = wgpu::TextureFormat::Rg16Float;

/// The uniforms of the shader, as it names them.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ShadeUniforms {
    /// From clip space to relative units.
    pub inverse: [[f32; 4]; 4],
    /// xyz: the eye (relative units); w: pixels of one unit at the distance one.
    pub eye: [f32; 4],
    /// x: how far off walls take light (relative units); y: how much of it, 0 for none; z: what falls on the floor;
    /// w: no more pixels are looked over than these.
    pub ambient: [f32; 4],
    /// Premultiplied with alpha.
    pub background: [f32; 4],
    /// xyz: the middle of the floor (relative units); w: how dark its shadow is, 0 for none.
    pub floor_middle: [f32; 4],
    /// xyz: along the floor's map, a unit over half of its side, and to its front; w of the second: how many places around a
    /// pixel are looked at for its corners.
    pub floor_right: [f32; 4],
    pub floor_front: [f32; 4],
    pub up: [f32; 4],
}

impl ShadeUniforms {
    /// Whether there is nothing to do: what is drawn is the picture then, and not drawn over nothing.
    pub(super) fn is_plain(&self) -> bool {
        self.ambient[1] <= 0.0 && self.floor_middle[3] <= 0.0
    }
}

/// How a picture is shaded.
pub struct Shading {
    pub uniforms: ShadeUniforms,
    pub floor: Arc<FloorShadow>,
}

/// What shades pictures.
pub(super) struct ShadePipelines {
    corners_layout: wgpu::BindGroupLayout,
    finish_layout: wgpu::BindGroupLayout,
    corners: wgpu::RenderPipeline,
    finish: wgpu::RenderPipeline,
}

impl ShadePipelines {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("shade"),
            source: wgpu::ShaderSource::Wgsl(include_str!("../../../shaders/shade.wgsl").into()),
        });
        let [corners_layout, finish_layout] = [2, 6].map(|count| layout(device, count));
        Self {
            corners: pipeline(device, &shader, (&corners_layout, "fs_obscurance", LEFT)),
            finish: pipeline(device, &shader, (&finish_layout, "fs_finish", COLOR)),
            corners_layout,
            finish_layout,
        }
    }
}

/// The first of what the shader binds: all, or what finds the corners.
fn layout(device: &wgpu::Device, count: usize) -> wgpu::BindGroupLayout {
    let texture = |sample_type, multisampled| wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled,
    };
    let float = |filterable| wgpu::TextureSampleType::Float { filterable };
    let kinds = [
        wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        texture(wgpu::TextureSampleType::Depth, true),
        texture(float(false), false),
        texture(float(false), false),
        texture(float(true), false),
        wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
    ];
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
        .zip(kinds.into_iter().take(count))
        .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("shade"),
        entries: &entries,
    })
}

fn pipeline(
    device: &wgpu::Device,
    shader: &wgpu::ShaderModule,
    (layout, entry, format): (&wgpu::BindGroupLayout, &str, wgpu::TextureFormat),
) -> wgpu::RenderPipeline {
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(entry),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(entry),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some("vs"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: shader,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// What one picture is shaded with, as large as it is.
pub(super) struct ShadeTargets {
    uniforms: wgpu::Buffer,
    left: wgpu::TextureView,
    finished: wgpu::TextureView,
    corners_bind: wgpu::BindGroup,
    finish_bind: wgpu::BindGroup,
    floor: Arc<FloorShadow>,
}

impl ShadeTargets {
    /// For a picture that is drawn with such depths into such colours.
    pub(super) fn new(
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        pipelines: &ShadePipelines,
        (depth, lit): (&wgpu::TextureView, &wgpu::TextureView),
        (left, finished): (wgpu::TextureView, wgpu::TextureView),
        floor: &Arc<FloorShadow>,
    ) -> Self {
        let uniforms = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("shade uniforms"),
            size: size_of::<ShadeUniforms>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let map = floor_map(device, queue, floor);
        let resources = [
            uniforms.as_entire_binding(),
            wgpu::BindingResource::TextureView(depth),
            wgpu::BindingResource::TextureView(lit),
            wgpu::BindingResource::TextureView(&left),
            wgpu::BindingResource::TextureView(&map),
            wgpu::BindingResource::Sampler(&sampler),
        ];
        let bind = |layout, count: usize| {
            let entries: Vec<wgpu::BindGroupEntry> = (0..)
                .zip(resources.iter().take(count).cloned())
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
                .collect();
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("shade"),
                layout,
                entries: &entries,
            })
        };
        Self {
            corners_bind: bind(&pipelines.corners_layout, 2),
            finish_bind: bind(&pipelines.finish_layout, 6),
            uniforms,
            left,
            finished,
            floor: Arc::clone(floor),
        }
    }

    /// Of which textures they are made, and how many of the picture's pixels one of theirs stands for, each way.
    pub(super) const TEXTURES: [(wgpu::TextureFormat, u32); 2] = [(LEFT, 2), (COLOR, 1)];

    /// Whether they are of this floor.
    pub(super) fn stands_on(&self, floor: &Arc<FloorShadow>) -> bool {
        Arc::ptr_eq(&self.floor, floor)
    }

    /// The finished picture.
    pub(super) fn finished(&self) -> &wgpu::TextureView {
        &self.finished
    }

    /// Shades what was drawn; nothing where there is nothing to do.
    pub(super) fn shade(
        &self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        pipelines: &ShadePipelines,
        uniforms: &ShadeUniforms,
    ) -> bool {
        if uniforms.is_plain() {
            return false;
        }
        queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(uniforms));
        if uniforms.ambient[1] > 0.0 {
            full(encoder, &self.left, &pipelines.corners, &self.corners_bind);
        }
        full(
            encoder,
            &self.finished,
            &pipelines.finish,
            &self.finish_bind,
        );
        true
    }
}

/// Draws over all of a texture.
fn full(
    encoder: &mut wgpu::CommandEncoder,
    view: &wgpu::TextureView,
    pipeline: &wgpu::RenderPipeline,
    bind: &wgpu::BindGroup,
) {
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("shade"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::WHITE),
                store: wgpu::StoreOp::Store,
            },
        })],
        ..wgpu::RenderPassDescriptor::default()
    });
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, bind, &[]);
    pass.draw(0..3, 0..1);
}

fn floor_map(device: &wgpu::Device, queue: &wgpu::Queue, floor: &FloorShadow) -> wgpu::TextureView {
    let texture = device.create_texture_with_data(
        queue,
        &wgpu::TextureDescriptor {
            label: Some("floor"),
            size: wgpu::Extent3d {
                width: CELLS as u32,
                height: CELLS as u32,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::R8Unorm,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        &floor.dark,
    );
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
