//! The wgpu side: draws the limb into a target of its own (4× anti-aliased, with depth), which the window
//! then copies. Nothing is uploaded or drawn again that has not changed.

use std::sync::Arc;

use eframe::egui_wgpu::{CallbackResources, CallbackTrait, RenderState, ScreenDescriptor};
use eframe::wgpu::{self, util::DeviceExt};

use crate::colormap::{ColorMap, TABLE};
use crate::mesh::TriMesh;
use crate::tally::{self, Done};

const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
const SAMPLES: u32 = 4;

/// A vertex of a [`Solid`].
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    /// m.
    pub position: [f32; 3],
    pub normal: [f32; 3],
    /// The share that lengths are off by as it is drawn.
    pub stretch: f32,
}

/// Triangles to be drawn.
pub struct Solid {
    pub vertices: Vec<Vertex>,
    pub triangles: Vec<[u32; 3]>,
}

impl Solid {
    #[must_use]
    pub fn of(mesh: &TriMesh) -> Self {
        let vertices = mesh.positions().iter().zip(mesh.vertex_normals());
        Self {
            vertices: vertices
                .map(|(p, n)| Vertex {
                    position: p.as_vec3().to_array(),
                    normal: n.as_vec3().to_array(),
                    stretch: 0.0,
                })
                .collect(),
            triangles: mesh.triangles().to_vec(),
        }
    }
}

/// Pictures that a window shows side by side, each with a target of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    Limb,
    Unrolled,
}

/// What changes with field and region, a vertex.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Shown {
    /// Displacement (m).
    pub displacement: [f32; 3],
    /// Field, 0–1 over the legend's range.
    pub value: f32,
    /// 255 where a layer is: gauges may go (or what is blind, where that is marked), touches come, held, gauges
    /// must not go.
    pub region: [u8; 4],
}

/// The uniforms of the shader, as it names them.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Uniforms {
    pub matrix: [[f32; 4]; 4],
    pub eye: [f32; 4],
    pub target_scale: [f32; 4],
    pub deform: [f32; 4],
    /// A plane: what lies on its positive side is cut away.
    pub section: [f32; 4],
    /// x: how much of the wall that faces the eye covers what is behind it, 1 for all; y: 1 where the first layer
    /// marks what is blind.
    pub look: [f32; 4],
    /// xyz: the direction up; w: the stretch above which lengths are marked as off, 0 for none.
    pub up: [f32; 4],
}

/// One frame to be drawn.
pub struct Frame3d {
    pub slot: Slot,
    pub solid: Arc<Solid>,
    /// One a vertex.
    pub shown: Arc<Vec<Shown>>,
    pub map: ColorMap,
    pub uniforms: Uniforms,
    /// Red, green, blue, alpha, 0–1.
    pub background: [f64; 4],
    /// In pixels.
    pub size: [u32; 2],
}

/// Everything on the graphics adapter.
pub struct SceneGpu {
    pipelines: Pipelines,
    scene_layout: wgpu::BindGroupLayout,
    blit_layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    slots: [SlotGpu; 2],
}

struct Pipelines {
    whole: wgpu::RenderPipeline,
    /// The walls that face away, and those that face the eye drawn over them.
    away: wgpu::RenderPipeline,
    ghost: wgpu::RenderPipeline,
    blit: wgpu::RenderPipeline,
}

/// What a picture that lies in a target was drawn with, beside its buffers.
type Signature = (Uniforms, ColorMap, [u32; 2], [f64; 4]);

/// One picture.
struct SlotGpu {
    uniforms: wgpu::Buffer,
    mesh: Option<MeshGpu>,
    map: Option<(ColorMap, wgpu::BindGroup)>,
    targets: Option<Targets>,
    drawn: Option<Signature>,
}

struct MeshGpu {
    // Held, so that "the same" below compares living allocations.
    solid: Arc<Solid>,
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
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self {
            pipelines: Pipelines::new(device, &scene_layout, &blit_layout, window),
            scene_layout,
            blit_layout,
            sampler,
            slots: [SlotGpu::new(device), SlotGpu::new(device)],
        }
    }

    /// Draws a frame into its target, if anything in it changed.
    pub fn draw(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        frame: &Frame3d,
    ) {
        let slot = &mut self.slots[frame.slot as usize];
        let uploaded = slot.upload(device, queue, frame);
        tally::count(Done::Upload, usize::from(uploaded));
        let signature = (frame.uniforms, frame.map, frame.size, frame.background);
        if !uploaded && slot.drawn == Some(signature) {
            return;
        }
        if slot.targets.as_ref().is_none_or(|t| t.size != frame.size) {
            let targets = Targets::new(device, &self.blit_layout, frame.size);
            slot.targets = Some(targets);
        }
        if slot
            .map
            .as_ref()
            .is_none_or(|(known, _)| *known != frame.map)
        {
            let bind = bind_map(
                device,
                queue,
                frame.map,
                &self.scene_layout,
                &slot.uniforms,
                &self.sampler,
            );
            slot.map = Some((frame.map, bind));
        }
        queue.write_buffer(&slot.uniforms, 0, bytemuck::bytes_of(&frame.uniforms));
        let through = frame.uniforms.look[0] < 1.0;
        slot.pass(encoder, &self.pipelines, frame.background, through);
        slot.drawn = Some(signature);
        tally::count(Done::Redraw, 1);
    }
}

/// A colour map with the uniforms, as the shader sees them.
fn bind_map(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    map: ColorMap,
    layout: &wgpu::BindGroupLayout,
    uniforms: &wgpu::Buffer,
    sampler: &wgpu::Sampler,
) -> wgpu::BindGroup {
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
    let resources = [
        uniforms.as_entire_binding(),
        wgpu::BindingResource::TextureView(&view),
        wgpu::BindingResource::Sampler(sampler),
    ];
    let entries: Vec<wgpu::BindGroupEntry> = (0..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("limb"),
        layout,
        entries: &entries,
    })
}

impl SlotGpu {
    fn new(device: &wgpu::Device) -> Self {
        Self {
            uniforms: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("limb uniforms"),
                size: size_of::<Uniforms>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            mesh: None,
            map: None,
            targets: None,
            drawn: None,
        }
    }

    fn upload(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, frame: &Frame3d) -> bool {
        match &mut self.mesh {
            Some(known) if Arc::ptr_eq(&known.solid, &frame.solid) => {
                if Arc::ptr_eq(&known.shown, &frame.shown) {
                    return false;
                }
                queue.write_buffer(&known.changing, 0, bytemuck::cast_slice(&frame.shown));
                known.shown = Arc::clone(&frame.shown);
            }
            _ => self.mesh = Some(MeshGpu::new(device, frame)),
        }
        true
    }

    fn pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pipelines: &Pipelines,
        [r, g, b, a]: [f64; 4],
        through: bool,
    ) {
        let (Some(targets), Some(mesh), Some((_, bind))) = (&self.targets, &self.mesh, &self.map)
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
        pass.set_bind_group(0, bind, &[]);
        pass.set_vertex_buffer(0, mesh.fixed.slice(..));
        pass.set_vertex_buffer(1, mesh.changing.slice(..));
        pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
        let layers = if through {
            vec![&pipelines.away, &pipelines.ghost]
        } else {
            vec![&pipelines.whole]
        };
        for pipeline in layers {
            pass.set_pipeline(pipeline);
            pass.draw_indexed(0..mesh.count, 0, 0..1);
        }
    }
}

impl MeshGpu {
    fn new(device: &wgpu::Device, frame: &Frame3d) -> Self {
        let buffer = |label, contents: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage: usage | wgpu::BufferUsages::COPY_DST,
            })
        };
        let solid = &frame.solid;
        Self {
            fixed: buffer(
                "limb vertices",
                bytemuck::cast_slice(&solid.vertices),
                wgpu::BufferUsages::VERTEX,
            ),
            changing: buffer(
                "limb fields",
                bytemuck::cast_slice(&frame.shown),
                wgpu::BufferUsages::VERTEX,
            ),
            indices: buffer(
                "limb triangles",
                bytemuck::cast_slice(&solid.triangles),
                wgpu::BufferUsages::INDEX,
            ),
            count: 3 * solid.triangles.len() as u32,
            solid: Arc::clone(solid),
            shown: Arc::clone(&frame.shown),
        }
    }
}

impl Targets {
    fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, size: [u32; 2]) -> Self {
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
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&resolved),
            }],
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

/// Bindings of the scene (uniforms, map, sampler) or of the blit (picture).
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
enum Walls {
    /// Both sides: through the windows the inside is seen.
    All,
    FacingAway,
    /// Those that face the eye, over what is behind them.
    Ghost,
}

impl Pipelines {
    fn new(
        device: &wgpu::Device,
        scene: &wgpu::BindGroupLayout,
        blit: &wgpu::BindGroupLayout,
        window: wgpu::TextureFormat,
    ) -> Self {
        let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("limb"),
            source: wgpu::ShaderSource::Wgsl(include_str!("../../shaders/limb.wgsl").into()),
        });
        let of = |walls| scene_pipeline(device, scene, &shader, walls);
        Self {
            whole: of(Walls::All),
            away: of(Walls::FacingAway),
            ghost: of(Walls::Ghost),
            blit: blit_pipeline(device, blit, window),
        }
    }
}

fn scene_pipeline(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    shader: &wgpu::ShaderModule,
    walls: Walls,
) -> wgpu::RenderPipeline {
    let ghost = walls == Walls::Ghost;
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
            entry_point: Some("vs"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[
                buffer(size_of::<Vertex>() as u64, &fixed),
                buffer(size_of::<Shown>() as u64, &changing),
            ],
        },
        primitive: wgpu::PrimitiveState {
            cull_mode: match walls {
                Walls::All => None,
                Walls::FacingAway => Some(wgpu::Face::Front),
                Walls::Ghost => Some(wgpu::Face::Back),
            },
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(!ghost),
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
            entry_point: Some(if ghost { "fs_ghost" } else { "fs" }),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: COLOR,
                blend: ghost.then_some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
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
        if let Some(targets) = &scene.slots[self.slot as usize].targets {
            pass.set_pipeline(&scene.pipelines.blit);
            pass.set_bind_group(0, &targets.bind, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}
