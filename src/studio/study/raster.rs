//! A picture of very many marks, drawn once and shown until it has to be another.

use egui::{Color32, ColorImage, Context, Rect, TextureHandle, TextureOptions, Vec2};

/// What a picture of a study is of: it is drawn anew when that changes.
pub type RasterKey = ([usize; 2], Vec<(usize, [u64; 2])>, Vec<usize>, bool);

/// A picture, and what it is of.
#[derive(Default)]
pub struct Raster {
    known: Option<(RasterKey, TextureHandle)>,
}

impl Raster {
    /// The picture of a key: the one that is known, or a new one.
    pub fn of(
        &mut self,
        key: RasterKey,
        ctx: &Context,
        draw: impl FnOnce(&mut PixelCanvas),
    ) -> &TextureHandle {
        let known = self.known.take().filter(|(known, _)| *known == key);
        let (key, picture) = known.unwrap_or_else(|| {
            let mut canvas = PixelCanvas::new(key.0);
            draw(&mut canvas);
            let picture = ctx.load_texture("study", canvas.image, TextureOptions::LINEAR);
            (key, picture)
        });
        &self.known.insert((key, picture)).1
    }
}

/// Of a rectangle in pixels of the screen.
pub fn pixels(ctx: &Context, size: Vec2) -> [usize; 2] {
    let scale = ctx.pixels_per_point();
    [size.x, size.y].map(|v| ((v * scale).round() as usize).clamp(1, 8192))
}

/// Pixels that are drawn on.
pub struct PixelCanvas {
    image: ColorImage,
}

impl PixelCanvas {
    fn new(size: [usize; 2]) -> Self {
        Self {
            image: ColorImage::filled(size, Color32::TRANSPARENT),
        }
    }

    /// Its size in pixels.
    pub fn size(&self) -> Vec2 {
        let [width, height] = self.image.size;
        egui::vec2(width as f32, height as f32)
    }

    fn blend(&mut self, x: i64, y: i64, colour: Color32) {
        let [width, height] = self.image.size;
        if (0..width as i64).contains(&x) && (0..height as i64).contains(&y) {
            let at = &mut self.image.pixels[y as usize * width + x as usize];
            *at = at.blend(colour);
        }
    }

    /// A filled circle; places in pixels.
    pub fn dot(&mut self, at: Vec2, radius: f32, colour: Color32) {
        let reach = radius.ceil() as i64;
        let (x, y) = (at.x.round() as i64, at.y.round() as i64);
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let away = ((dx * dx + dy * dy) as f32).sqrt();
                let cover = (radius + 0.5 - away).clamp(0.0, 1.0);
                if cover > 0.0 {
                    self.blend(x + dx, y + dy, colour.gamma_multiply(cover));
                }
            }
        }
    }

    /// A line, a pixel wide, and wider by as many as are asked for.
    pub fn line(&mut self, from: Vec2, to: Vec2, wider: i64, colour: Color32) {
        let steps = (to - from).abs().max_elem().ceil().max(1.0) as usize;
        for k in 0..=steps {
            let at = from + (to - from) * (k as f32 / steps as f32);
            for more in 0..=wider {
                self.blend(at.x.round() as i64, at.y.round() as i64 + more, colour);
            }
        }
    }
}

/// Shows a picture in a rectangle.
pub fn show(painter: &egui::Painter, picture: &TextureHandle, rect: Rect) {
    let all = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
    painter.image(picture.id(), rect, all, Color32::WHITE);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_stay_within_the_picture() {
        let mut canvas = PixelCanvas::new([20, 10]);
        canvas.dot(egui::vec2(0.0, 0.0), 3.0, Color32::RED);
        canvas.line(
            egui::vec2(-50.0, 5.0),
            egui::vec2(80.0, 5.0),
            1,
            Color32::BLUE,
        );
        let lit = |x: usize, y: usize| canvas.image.pixels[y * 20 + x];
        assert_eq!(lit(0, 0), Color32::RED);
        assert_eq!([lit(0, 5), lit(19, 6)], [Color32::BLUE; 2]);
        assert_eq!(lit(10, 8), Color32::TRANSPARENT);
    }

    #[test]
    fn a_picture_is_drawn_once_for_what_it_is_of() {
        let ctx = Context::default();
        let mut raster = Raster::default();
        let key = |range: u64| ([4, 4], vec![(0, [range; 2])], vec![0], false);
        let mut drawn = 0;
        for range in [0, 0, 1, 1, 0] {
            raster.of(key(range), &ctx, |_| drawn += 1);
        }
        assert_eq!(drawn, 3);
    }
}
