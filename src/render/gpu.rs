//! The wgpu side: draws the limb into a target of its own (4× anti-aliased, with depth), which the window
//! then copies. Nothing is uploaded or drawn again that has not changed.

use crate::colormap::{ColorMap, TABLE};
use std::sync::Arc;

use eframe::egui_wgpu::{CallbackResources, CallbackTrait, RenderState, ScreenDescriptor};
use eframe::wgpu::{self, util::DeviceExt};

use crate::mesh::TriMesh;

const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
const SAMPLES: u32 = 4;

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Fixed {
    position: [f32; 3],
    normal: [f32; 3],
}

/// What changes with field and region, a vertex.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Shown {
    /// Displacement (m).
    pub displacement: [f32; 3],
    /// Field, 0–1 over the legend's range.
    pub value: f32,
    /// 1 in the feasible region.
    pub region: f32,
}

/// The uniforms of the shader, as it names them.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Uniforms {
    pub matrix: [[f32; 4]; 4],
    pub eye: [f32; 4],
    pub target_scale: [f32; 4],
    pub deform: [f32; 4],
}

/// One frame to be drawn.
pub struct Frame3d {
    pub mesh: Arc<TriMesh>,
    pub shown: Arc<Vec<Shown>>,
    pub map: ColorMap,
    pub uniforms: Uniforms,
    /// Red, green, blue, alpha, 0–1.
    pub background: [f64; 4],
    /// In pixels.
    pub size: [u32; 2],
}

/// Counts of what was done, for tests: an unchanged scene costs nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GpuWork {
    pub uploads: u64,
    pub redraws: u64,
}

/// Everything on the graphics adapter.
pub struct SceneGpu {
    scene_pipeline: wgpu::RenderPipeline,
    scene_layout: wgpu::BindGroupLayout,
    blit_pipeline: wgpu::RenderPipeline,
    blit_layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    uniforms: wgpu::Buffer,
    mesh: Option<MeshGpu>,
    maps: Option<(ColorMap, wgpu::BindGroup)>,
    targets: Option<Targets>,
    drawn: Option<(Uniforms, ColorMap, [u32; 2])>,
    pub work: GpuWork,
}

struct MeshGpu {
    // Held, so that "the same" below compares living allocations.
    mesh: Arc<TriMesh>,
    shown: Arc<Vec<Shown>>,
    fixed: wgpu::Buffer,
    changing: wgpu::Buffer,
    indices: wgpu::Buffer,
    count: u32,
}

struct Targets {
    size: [u32; 2],
    color: wgpu::TextureView,
    depth: wgpu::TextureView,
    resolved: wgpu::TextureView,
    bind: wgpu::BindGroup,
}

/// Makes the pipelines once, where the window's callbacks find them.
pub fn install(state: &RenderState) {
    let scene = SceneGpu::new(&state.device, state.target_format);
    state.renderer.write().callback_resources.insert(scene);
}

impl SceneGpu {
    #[must_use]
    pub fn new(device: &wgpu::Device, window: wgpu::TextureFormat) -> Self {
        let scene_layout = layout(device, true);
        let blit_layout = layout(device, false);
        let uniforms = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("limb uniforms"),
            size: size_of::<Uniforms>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self {
            scene_pipeline: scene_pipeline(device, &scene_layout),
            blit_pipeline: blit_pipeline(device, &blit_layout, window),
            scene_layout,
            blit_layout,
            sampler,
            uniforms,
            mesh: None,
            maps: None,
            targets: None,
            drawn: None,
            work: GpuWork::default(),
        }
    }

    /// Draws a frame into the target, if anything in it changed.
    pub fn draw(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        frame: &Frame3d,
    ) {
        let uploaded = self.upload(device, queue, frame);
        let signature = (frame.uniforms, frame.map, frame.size);
        if !uploaded && self.drawn == Some(signature) {
            return;
        }
        self.retarget(device, frame.size);
        self.remap(device, queue, frame.map);
        queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&frame.uniforms));
        self.pass(encoder, frame.background);
        self.drawn = Some(signature);
        self.work.redraws += 1;
    }

    fn upload(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, frame: &Frame3d) -> bool {
        match &mut self.mesh {
            Some(known) if Arc::ptr_eq(&known.mesh, &frame.mesh) => {
                if Arc::ptr_eq(&known.shown, &frame.shown) {
                    return false;
                }
                queue.write_buffer(&known.changing, 0, bytemuck::cast_slice(&frame.shown));
                known.shown = Arc::clone(&frame.shown);
            }
            _ => self.mesh = Some(MeshGpu::new(device, frame)),
        }
        self.work.uploads += 1;
        true
    }

    fn retarget(&mut self, device: &wgpu::Device, size: [u32; 2]) {
        if self.targets.as_ref().is_none_or(|t| t.size != size) {
            self.targets = Some(Targets::new(device, &self.blit_layout, &self.sampler, size));
        }
    }

    fn remap(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, map: ColorMap) {
        if self.maps.as_ref().is_some_and(|(known, _)| *known == map) {
            return;
        }
        let table: Vec<u8> = map.table().into_iter().flatten().collect();
        let texture = device.create_texture_with_data(
            queue,
            &wgpu::TextureDescriptor {
                label: Some("colour map"),
                size: wgpu::Extent3d {
                    width: TABLE as u32,
                    height: 1,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: COLOR,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            },
            wgpu::util::TextureDataOrder::LayerMajor,
            &table,
        );
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let bind = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("limb"),
            layout: &self.scene_layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: self.uniforms.as_entire_binding(),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::TextureView(&view),
                },
                wgpu::BindGroupEntry {
                    binding: 2,
                    resource: wgpu::BindingResource::Sampler(&self.sampler),
                },
            ],
        });
        self.maps = Some((map, bind));
    }

    fn pass(&self, encoder: &mut wgpu::CommandEncoder, [r, g, b, a]: [f64; 4]) {
        let (Some(targets), Some(mesh), Some((_, bind))) = (&self.targets, &self.mesh, &self.maps)
        else {
            return;
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("limb"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &targets.color,
                depth_slice: None,
                resolve_target: Some(&targets.resolved),
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
                    store: wgpu::StoreOp::Discard,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &targets.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(&self.scene_pipeline);
        pass.set_bind_group(0, bind, &[]);
        pass.set_vertex_buffer(0, mesh.fixed.slice(..));
        pass.set_vertex_buffer(1, mesh.changing.slice(..));
        pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..mesh.count, 0, 0..1);
    }
}

impl MeshGpu {
    fn new(device: &wgpu::Device, frame: &Frame3d) -> Self {
        let mesh = &frame.mesh;
        let fixed: Vec<Fixed> = mesh
            .positions()
            .iter()
            .zip(mesh.vertex_normals())
            .map(|(p, n)| Fixed {
                position: p.as_vec3().to_array(),
                normal: n.as_vec3().to_array(),
            })
            .collect();
        let indices: Vec<u32> = mesh.triangles().iter().flatten().copied().collect();
        let buffer = |label, contents: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage: usage | wgpu::BufferUsages::COPY_DST,
            })
        };
        Self {
            fixed: buffer(
                "limb vertices",
                bytemuck::cast_slice(&fixed),
                wgpu::BufferUsages::VERTEX,
            ),
            changing: buffer(
                "limb fields",
                bytemuck::cast_slice(&frame.shown),
                wgpu::BufferUsages::VERTEX,
            ),
            indices: buffer(
                "limb triangles",
                bytemuck::cast_slice(&indices),
                wgpu::BufferUsages::INDEX,
            ),
            count: indices.len() as u32,
            mesh: Arc::clone(mesh),
            shown: Arc::clone(&frame.shown),
        }
    }
}

impl Targets {
    fn new(
        device: &wgpu::Device,
        layout: &wgpu::BindGroupLayout,
        sampler: &wgpu::Sampler,
        size: [u32; 2],
    ) -> Self {
        let view = |format, sample_count, usage| {
            device
                .create_texture(&wgpu::TextureDescriptor {
                    label: Some("limb target"),
                    size: wgpu::Extent3d {
                        width: size[0].max(1),
                        height: size[1].max(1),
                        depth_or_array_layers: 1,
                    },
                    mip_level_count: 1,
                    sample_count,
                    dimension: wgpu::TextureDimension::D2,
                    format,
                    usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
                    view_formats: &[],
                })
                .create_view(&wgpu::TextureViewDescriptor::default())
        };
        let none = wgpu::TextureUsages::empty();
        let resolved = view(COLOR, 1, wgpu::TextureUsages::TEXTURE_BINDING);
        let bind = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("limb picture"),
            layout,
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&resolved),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::Sampler(sampler),
                },
            ],
        });
        Self {
            size,
            color: view(COLOR, SAMPLES, none),
            depth: view(DEPTH, SAMPLES, none),
            resolved,
            bind,
        }
    }
}

/// Bindings of the scene (uniforms, map, sampler) or of the blit (picture, sampler).
fn layout(device: &wgpu::Device, scene: bool) -> wgpu::BindGroupLayout {
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
        vec![texture, sampler]
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

fn scene_pipeline(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> wgpu::RenderPipeline {
    let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("limb"),
        source: wgpu::ShaderSource::Wgsl(include_str!("../../shaders/limb.wgsl").into()),
    });
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("limb"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let fixed = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];
    let changing = wgpu::vertex_attr_array![2 => Float32x3, 3 => Float32, 4 => Float32];
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
            module: &shader,
            entry_point: Some("vs"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[
                buffer(size_of::<Fixed>() as u64, &fixed),
                buffer(size_of::<Shown>() as u64, &changing),
            ],
        },
        // Both sides: through the windows the inside is seen.
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState {
            count: SAMPLES,
            ..Default::default()
        },
        fragment: Some(wgpu::FragmentState {
            module: &shader,
            entry_point: Some("fs"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(COLOR.into())],
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
        source: wgpu::ShaderSource::Wgsl(include_str!("../../shaders/blit.wgsl").into()),
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

impl CallbackTrait for Frame3d {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        _screen: &ScreenDescriptor,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        if let Some(scene) = resources.get_mut::<SceneGpu>() {
            scene.draw(device, queue, encoder, self);
        }
        Vec::new()
    }

    fn paint(
        &self,
        _info: egui::PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        let Some(scene) = resources.get::<SceneGpu>() else {
            return;
        };
        if let Some(targets) = &scene.targets {
            pass.set_pipeline(&scene.blit_pipeline);
            pass.set_bind_group(0, &targets.bind, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}
