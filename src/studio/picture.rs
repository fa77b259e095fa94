//! Pictures of the limb at any size, without a window.

use std::path::PathBuf;

use eframe::egui_wgpu::RenderState;
use egui::{Context, FullOutput, Pos2, RawInput, Rect, vec2};

use super::paint::LimbLook;
use super::scene::PartScene;
use super::view::ViewState;
use super::{layout, theme};
use crate::document::Document;
use crate::io::atomic;
use crate::io::project_file::LoadedProject;
use crate::job::{Reporter, Stop};
use crate::mesh::TriMesh;
use crate::render::camera::Camera;
use crate::render::{gpu, offscreen};
use crate::session::{Session, Task, Wake};

pub use super::view::{Backdrop, Floor, Picture};

/// Height of the window, in points, that a picture is drawn like: gauges and letters grow with the pixels.
const POINTS: f32 = 720.0;

/// A picture of a project with its gauges, as a PNG file.
///
/// # Errors
/// A message in the user's terms.
pub fn png(loaded: LoadedProject, picture: &Picture) -> Result<Vec<u8>, String> {
    let mut easel = Easel::new(loaded, picture)?;
    encode(easel.frame(picture, 0.0)?, picture.size)
}

/// The limb with its gauges as it turns once about its axis, as an animated PNG that goes on for ever.
///
/// # Errors
/// A message in the user's terms.
pub fn turning(
    loaded: LoadedProject,
    picture: &Picture,
    seconds: f64,
    mut tell: impl FnMut(usize, usize),
) -> Result<Vec<u8>, String> {
    /// Frames a second.
    const RATE: u16 = 12;
    let frames = (seconds * f64::from(RATE)).round().max(2.0) as u32;
    let mut easel = Easel::new(loaded, picture)?;
    let [width, height] = picture.size;
    let mut bytes = Vec::new();
    let failed = |e: png::EncodingError| format!("the animation could not be written: {e}");
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_animated(frames, 0).map_err(failed)?;
    encoder.set_frame_delay(1, RATE).map_err(failed)?;
    let mut writer = encoder.write_header().map_err(failed)?;
    for k in 0..frames {
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(frames);
        let pixels = easel.frame(picture, angle)?;
        writer.write_image_data(&pixels).map_err(failed)?;
        tell(k as usize + 1, frames as usize);
    }
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

/// What pictures of a project are drawn with.
struct Easel {
    state: RenderState,
    ctx: Context,
    session: Session,
    view: ViewState,
    scene: PartScene,
}

impl Easel {
    fn new(loaded: LoadedProject, picture: &Picture) -> Result<Self, String> {
        let state = offscreen::adapter()?;
        gpu::install(&state);
        let ctx = Context::default();
        theme::apply(&ctx);
        let session = Session::new(Document::new(loaded, None), Wake::default());
        let mut view = ViewState::of(&session.document);
        view.floor = picture.floor;
        let scene = PartScene::of(&session.document, &session.shape);
        if let Some(preset) = picture.view {
            view.camera.look_from(preset);
        }
        let [width, height] = picture.size.map(|s| s as f32);
        fit(&mut view.camera, &session.document.part, width / height);
        Ok(Self {
            state,
            ctx,
            session,
            view,
            scene,
        })
    }

    /// Pixels, the camera being turned about the limb's axis by an angle (radians).
    fn frame(&mut self, picture: &Picture, angle: f64) -> Result<Vec<u8>, String> {
        let mut view = self.view.clone();
        view.camera.yaw += angle;
        let output = drawn(&self.session, &view, &mut self.scene, &self.ctx, picture);
        pixels(&self.state, &self.ctx, output, picture.size)
    }
}

/// What was drawn, as a PNG file.
fn finish(
    state: &RenderState,
    ctx: &Context,
    output: FullOutput,
    size: [u32; 2],
) -> Result<Vec<u8>, String> {
    encode(pixels(state, ctx, output, size)?, size)
}

/// What was drawn: red, green, blue and alpha of each pixel.
fn pixels(
    state: &RenderState,
    ctx: &Context,
    output: FullOutput,
    size: [u32; 2],
) -> Result<Vec<u8>, String> {
    let mut pixels = offscreen::draw(state, ctx, output, size)?;
    straighten(&mut pixels);
    Ok(pixels)
}

/// The 3D view as it would be in a window of a picture's size, on a context of its own.
fn drawn(
    session: &Session,
    view: &ViewState,
    scene: &mut PartScene,
    ctx: &Context,
    picture: &Picture,
) -> FullOutput {
    let [width, height] = picture.size.map(|s| s as f32);
    let points = vec2(width, height) * (POINTS / height.max(1.0));
    let mut input = RawInput {
        screen_rect: Some(Rect::from_min_size(Pos2::ZERO, points)),
        ..RawInput::default()
    };
    for viewport in input.viewports.values_mut() {
        viewport.native_pixels_per_point = Some(height / POINTS);
    }
    let mut view = view.clone();
    ctx.run_ui(input, |ui| {
        let rect = ui.ctx().content_rect();
        view.rect = rect;
        scene.build(session, &view);
        let look = LimbLook {
            session,
            view: &view,
            scene,
        };
        layout::picture(look, ui, rect, picture.backdrop);
    })
}

/// Writes what the 3D view shows into a PNG file, in the background.
pub(super) fn save(
    session: &mut Session,
    view: &ViewState,
    scene: &mut PartScene,
    ctx: &Context,
    path: PathBuf,
    picture: &Picture,
) {
    // On a context and an adapter of its own: the window goes on meanwhile.
    let own = Context::default();
    own.set_theme(ctx.theme());
    let mut output = drawn(session, view, scene, &own, picture);
    let size = picture.size;
    let work = move |_: &Reporter| {
        let state = offscreen::adapter().inspect_err(|_| output.textures_delta.clear());
        let state = state.map_err(Stop::Failed)?;
        gpu::install(&state);
        let png = finish(&state, &own, output, size).map_err(Stop::Failed)?;
        atomic::write(&path, &png).map_err(|e| Stop::Failed(e.to_string()))?;
        Ok(path)
    };
    (session.jobs).start(Task::Picture, (), work, |s, (), path| {
        s.tell(format!("The picture is in {}", path.display()));
    });
}

/// Comes as near as shows all of the limb.
fn fit(camera: &mut Camera, part: &TriMesh, aspect: f32) {
    /// Of half the picture.
    const FILLED: f64 = 0.9;
    // Perspective: what is nearer grows more, so the second time corrects the first.
    for _ in 0..4 {
        let projection = camera.projection(aspect);
        let reach = (part.positions().iter())
            .filter_map(|&p| projection.place(p))
            .map(|(at, _)| 2.0 * (at - 0.5).abs().max_element())
            .fold(0.0, f64::max);
        if reach > 0.0 {
            camera.distance *= reach / FILLED;
        }
    }
}

/// From premultiplied colours to those that PNG keeps.
fn straighten(pixels: &mut [u8]) {
    for pixel in pixels.chunks_exact_mut(4) {
        let alpha = u32::from(pixel[3]);
        if alpha != 0 && alpha != 255 {
            for c in &mut pixel[..3] {
                *c = ((u32::from(*c) * 255 + alpha / 2) / alpha).min(255) as u8;
            }
        }
    }
}

fn encode(pixels: Vec<u8>, [width, height]: [u32; 2]) -> Result<Vec<u8>, String> {
    let image = image::RgbaImage::from_raw(width, height, pixels)
        .ok_or("the picture came back with another size")?;
    let mut bytes = std::io::Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, image::ImageFormat::Png)
        .map_err(|e| format!("the picture could not be written as PNG: {e}"))?;
    Ok(bytes.into_inner())
}
