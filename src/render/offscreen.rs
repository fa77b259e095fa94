//! A graphics adapter without a window, and what was drawn on it read back.

use std::iter;
use std::sync::mpsc::channel;
use std::time::Duration;

use eframe::egui_wgpu::{
    self, RenderState, RendererOptions, ScreenDescriptor, WgpuConfiguration, WgpuSetup,
    WgpuSetupCreateNew,
};
use eframe::wgpu;
use egui::{Context, FullOutput};

/// Bytes of a pixel: red, green, blue, alpha.
const PIXEL: usize = 4;
/// A software adapter may take its time; a lost one never answers.
const PATIENCE: Duration = Duration::from_mins(1);

/// An adapter that draws into memory.
///
/// # Errors
/// A message with the remedy, where there is none.
pub fn adapter() -> Result<RenderState, String> {
    let setup = WgpuSetup::CreateNew(WgpuSetupCreateNew::without_display_handle());
    let instance = pollster::block_on(setup.new_instance());
    let configuration = WgpuConfiguration {
        wgpu_setup: setup,
        ..WgpuConfiguration::default()
    };
    pollster::block_on(RenderState::create(
        &configuration,
        &instance,
        None,
        RendererOptions::PREDICTABLE,
    ))
    .map_err(|e| {
        format!(
            "no graphics adapter was found ({e}). Install a Vulkan driver (Debian: mesa-vulkan-drivers)"
        )
    })
}

/// Draws one pass of a context over nothing: rows of pixels from the top, colours premultiplied with alpha.
///
/// # Errors
/// A message where the adapter cannot hold or does not finish the picture.
pub fn draw(
    state: &RenderState,
    ctx: &Context,
    mut output: FullOutput,
    size: [u32; 2],
) -> Result<Vec<u8>, String> {
    // It must not be dropped full.
    let canvas = Canvas::new(state, size).inspect_err(|_| output.textures_delta.clear())?;
    canvas.paint(ctx, output)?;
    read_back(&state.device, &state.queue, &canvas.texture)
}

/// Something to draw on, as large as a window.
pub struct Canvas<'a> {
    state: &'a RenderState,
    texture: wgpu::Texture,
    size: [u32; 2],
}

impl<'a> Canvas<'a> {
    /// # Errors
    /// A message where the adapter cannot hold it.
    pub fn new(state: &'a RenderState, size: [u32; 2]) -> Result<Self, String> {
        let most = state.device.limits().max_texture_dimension_2d;
        if size.iter().any(|&s| s == 0 || s > most) {
            return Err(format!(
                "a picture of {} × {} pixels cannot be drawn here: both sides must lie between 1 and {most}",
                size[0], size[1]
            ));
        }
        Ok(Self {
            texture: target(state, size),
            state,
            size,
        })
    }

    /// Draws one pass of a context over nothing, and waits until it is there.
    ///
    /// # Errors
    /// A message where the adapter does not finish.
    pub fn paint(&self, ctx: &Context, mut output: FullOutput) -> Result<(), String> {
        let (device, queue) = (&self.state.device, &self.state.queue);
        let mut renderer = self.state.renderer.write();
        update_textures(self.state, &mut renderer, &mut output);
        let screen = ScreenDescriptor {
            pixels_per_point: ctx.pixels_per_point(),
            size_in_pixels: self.size,
        };
        let shapes = ctx.tessellate(std::mem::take(&mut output.shapes), ctx.pixels_per_point());
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let before = renderer.update_buffers(device, queue, &mut encoder, &shapes, &screen);
        let view = self
            .texture
            .create_view(&wgpu::TextureViewDescriptor::default());
        {
            let mut pass = encoder
                .begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("picture"),
                    color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                        view: &view,
                        resolve_target: None,
                        depth_slice: None,
                        ops: wgpu::Operations {
                            load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                            store: wgpu::StoreOp::Store,
                        },
                    })],
                    ..wgpu::RenderPassDescriptor::default()
                })
                .forget_lifetime();
            renderer.render(&mut pass, &shapes, &screen);
        }
        let submission = queue.submit(before.into_iter().chain(iter::once(encoder.finish())));
        wait_for(device, submission)
    }
}

fn wait_for(device: &wgpu::Device, submission: wgpu::SubmissionIndex) -> Result<(), String> {
    let wait = wgpu::PollType::Wait {
        submission_index: Some(submission),
        timeout: Some(PATIENCE),
    };
    device.poll(wait).map(drop).map_err(|e| unfinished(&e))
}

fn unfinished(error: &dyn std::fmt::Display) -> String {
    format!("the graphics adapter did not finish the picture: {error}")
}

/// Fonts and other textures of the context.
fn update_textures(
    state: &RenderState,
    renderer: &mut egui_wgpu::Renderer,
    output: &mut FullOutput,
) {
    let mut set: Vec<_> = output.textures_delta.set.drain().collect();
    set.sort_by_key(|(id, _)| *id);
    for (id, images) in set {
        for image in images {
            renderer.update_texture(&state.device, &state.queue, id, &image);
        }
    }
}

fn target(state: &RenderState, [width, height]: [u32; 2]) -> wgpu::Texture {
    state.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: state.target_format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

fn read_back(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
) -> Result<Vec<u8>, String> {
    let row = texture.width() as usize * PIXEL;
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as usize);
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("picture"),
        size: (padded * texture.height() as usize) as u64,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded as u32),
                rows_per_image: None,
            },
        },
        texture.size(),
    );
    let submission = queue.submit(iter::once(encoder.finish()));
    let (sender, receiver) = channel();
    buffer
        .slice(..)
        .map_async(wgpu::MapMode::Read, move |mapped| {
            let _ = sender.send(mapped);
        });
    wait_for(device, submission)?;
    receiver
        .recv()
        .map_err(|e| unfinished(&e))?
        .map_err(|e| unfinished(&e))?;
    let bytes = buffer
        .slice(..)
        .get_mapped_range()
        .map_err(|e| unfinished(&e))?;
    Ok(bytes
        .chunks_exact(padded)
        .flat_map(|r| &r[..row])
        .copied()
        .collect())
}
