//! The wgpu side: draws the limb into a target of its own (4× anti-aliased, with depth), which the window
//! then copies. Nothing is uploaded or drawn again that has not changed.

mod corners;
mod data;
mod pipelines;
mod shade;

use std::sync::Arc;

use eframe::egui_wgpu::{CallbackResources, CallbackTrait, RenderState, ScreenDescriptor};
use eframe::wgpu::{self, util::DeviceExt};

pub use self::data::{GpuVertex, Shown, Solid, Uniforms};
use self::pipelines::{COLOR, DEPTH, Pipelines, SAMPLES, layout};
use self::shade::{ShadePipelines, ShadeTargets};
pub use self::shade::{ShadeUniforms, Shading};
use crate::colormap::{ColorMap, TABLE};
use crate::render::floor::FloorShadow;
use crate::tally::{self, Done};

/// Pictures that a window shows side by side, each with a target of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureSlot {
    Limb,
    Unrolled,
}

/// One frame to be drawn.
pub struct Frame3d {
    pub slot: PictureSlot,
    pub solid: Arc<Solid>,
    /// One a vertex.
    pub shown: Arc<Vec<Shown>>,
    pub map: ColorMap,
    pub uniforms: Uniforms,
    pub shading: Shading,
    /// Whether what is seen moves: where pictures are computed by the processor, none is shaded then.
    pub hurried: bool,
    /// Red, green, blue, alpha, 0–1.
    pub background: [f64; 4],
    /// In pixels.
    pub size: [u32; 2],
}

/// Everything on the graphics adapter.
pub struct SceneGpu {
    pipelines: Pipelines,
    shades: ShadePipelines,
    scene_layout: wgpu::BindGroupLayout,
    blit_layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    /// Whether pictures are computed by the processor, which shades none while a hand waits for the next.
    software: bool,
    slots: [SlotGpu; 2],
}

/// What a picture that lies in a target was drawn with, beside its buffers.
type Signature = (Uniforms, ShadeUniforms, ColorMap, [u32; 2], [f64; 4]);

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
    /// Of the edges, and how many ends they have.
    edges: Option<(wgpu::Buffer, u32)>,
}

struct Targets {
    size: [u32; 2],
    color: wgpu::TextureView,
    depth: wgpu::TextureView,
    resolved: wgpu::TextureView,
    shade: ShadeTargets,
    /// The picture as it was drawn, and as it is shaded.
    binds: [wgpu::BindGroup; 2],
    /// Whether it is the shaded one that is shown.
    shaded: bool,
}

/// Makes the pipelines once, where the window's callbacks find them.
pub fn install(state: &RenderState) {
    let software = state.adapter.get_info().device_type == wgpu::DeviceType::Cpu;
    let scene = SceneGpu::new(&state.device, state.target_format, software);
    state.renderer.write().callback_resources.insert(scene);
}

impl SceneGpu {
    #[must_use]
    pub fn new(device: &wgpu::Device, window: wgpu::TextureFormat, software: bool) -> Self {
        let scene_layout = layout(device, true);
        let blit_layout = layout(device, false);
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self {
            pipelines: Pipelines::new(device, &scene_layout, &blit_layout, window),
            shades: ShadePipelines::new(device),
            scene_layout,
            blit_layout,
            sampler,
            software,
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
        let shading = &frame.shading;
        let shades = if self.software && frame.hurried {
            bytemuck::Zeroable::zeroed()
        } else {
            shading.uniforms
        };
        let looks = (frame.uniforms, shades);
        let signature = (looks.0, looks.1, frame.map, frame.size, frame.background);
        let fits = |t: &Targets| t.size == frame.size && t.shade.stands_on(&shading.floor);
        let fits = slot.targets.as_ref().is_some_and(fits);
        if !uploaded && fits && slot.drawn == Some(signature) {
            return;
        }
        if !fits {
            let with = (&self.shades, &shading.floor);
            let targets = Targets::new((device, queue), &self.blit_layout, with, frame.size);
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
        let plain = shades.is_plain();
        let behind = if plain { frame.background } else { [0.0; 4] };
        slot.pass(encoder, &self.pipelines, behind, (through, plain));
        if let Some(targets) = &mut slot.targets {
            let shade = &targets.shade;
            targets.shaded = shade.shade(queue, encoder, &self.shades, &shades);
        }
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
                queue.write_buffer(
                    &known.changing,
                    0,
                    bytemuck::cast_slice(&frame.solid.spread(&frame.shown)),
                );
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
        (through, plain): (bool, bool),
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
                    // Corners are found by it.
                    store: if plain {
                        wgpu::StoreOp::Discard
                    } else {
                        wgpu::StoreOp::Store
                    },
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
        if let Some((edges, count)) = &mesh.edges {
            pass.set_index_buffer(edges.slice(..), wgpu::IndexFormat::Uint32);
            pass.set_pipeline(&pipelines.edges);
            pass.draw_indexed(0..*count, 0, 0..1);
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
                bytemuck::cast_slice(&solid.spread(&frame.shown)),
                wgpu::BufferUsages::VERTEX,
            ),
            indices: buffer(
                "limb triangles",
                bytemuck::cast_slice(&solid.triangles),
                wgpu::BufferUsages::INDEX,
            ),
            count: 3 * solid.triangles.len() as u32,
            edges: (!solid.edges.is_empty()).then(|| {
                let ends = bytemuck::cast_slice(&solid.edges);
                let buffer = buffer("limb edges", ends, wgpu::BufferUsages::INDEX);
                (buffer, 2 * solid.edges.len() as u32)
            }),
            solid: Arc::clone(solid),
            shown: Arc::clone(&frame.shown),
        }
    }
}

impl Targets {
    fn new(
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        layout: &wgpu::BindGroupLayout,
        (shades, floor): (&ShadePipelines, &Arc<FloorShadow>),
        size: [u32; 2],
    ) -> Self {
        let view = |format, sample_count, usage, share: u32| {
            device
                .create_texture(&wgpu::TextureDescriptor {
                    label: Some("limb target"),
                    size: wgpu::Extent3d {
                        width: size[0].max(1).div_ceil(share),
                        height: size[1].max(1).div_ceil(share),
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
        let bound = wgpu::TextureUsages::TEXTURE_BINDING;
        let resolved = view(COLOR, 1, bound, 1);
        let depth = view(DEPTH, SAMPLES, bound, 1);
        let of = |(format, share)| view(format, 1, bound, share);
        let [left, finished] = ShadeTargets::TEXTURES.map(of);
        let drawn = (&depth, &resolved);
        let shade = ShadeTargets::new((device, queue), shades, drawn, (left, finished), floor);
        let binds = [&resolved, shade.finished()].map(|picture| {
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("limb picture"),
                layout,
                entries: &[wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(picture),
                }],
            })
        });
        Self {
            size,
            color: view(COLOR, SAMPLES, none, 1),
            depth,
            resolved,
            shade,
            binds,
            shaded: false,
        }
    }
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
            pass.set_bind_group(0, &targets.binds[usize::from(targets.shaded)], &[]);
            pass.draw(0..3, 0..1);
        }
    }
}
