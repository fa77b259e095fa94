//! A picture of very many marks, drawn once and shown until there is another. One of a few marks is drawn at once, one of
//! many beside the window, which shows the one before meanwhile.

use egui::{Color32, ColorImage, Context, Rect, TextureHandle, TextureOptions, Vec2};

use crate::session::{Latest, LatestDesk, Wake};

/// What a picture of a study is of: it is drawn anew when that changes.
pub type RasterKey = ([usize; 2], Vec<(usize, [u64; 2])>, Vec<usize>, bool);

/// Marks that are drawn within a frame.
const AT_ONCE: usize = 5000;

/// A picture, and what it is of.
#[derive(Default)]
pub struct Raster {
    shown: Option<(RasterKey, TextureHandle)>,
    /// What was last asked of the worker.
    asked: Option<RasterKey>,
    worker: Option<Latest<RasterOrder, (RasterKey, ColorImage)>>,
}

/// A picture that is to be drawn.
struct RasterOrder {
    key: RasterKey,
    draw: Box<dyn FnOnce(&mut PixelCanvas) + Send>,
}

impl Raster {
    /// The picture of a key, of so many marks. While one of many is drawn it is the one before, nothing where there was none.
    pub fn of(
        &mut self,
        key: RasterKey,
        ctx: &Context,
        marks: usize,
        draw: impl FnOnce(&mut PixelCanvas) + Send + 'static,
    ) -> Option<&TextureHandle> {
        self.take_drawn(&key, ctx);
        let (columns, draw) = (key.2.clone(), Box::new(draw));
        if !self.is_shown(&key) {
            let order = RasterOrder { key, draw };
            if marks <= AT_ONCE {
                let (key, image) = order.drawn();
                self.show(key, image, ctx);
            } else if self.asked.as_ref() != Some(&order.key) {
                self.ask(order, ctx);
            }
        }
        // Other columns would be read by the axes of these.
        let shown = self.shown.as_ref().filter(|(key, _)| key.2 == columns);
        shown.map(|(_, picture)| picture)
    }

    fn is_shown(&self, key: &RasterKey) -> bool {
        self.shown.as_ref().is_some_and(|(known, _)| known == key)
    }

    fn ask(&mut self, order: RasterOrder, ctx: &Context) {
        let waker = ctx.clone();
        let start = || {
            let wake = Wake::new(move |wait| waker.request_repaint_after(wait));
            Latest::start(&wake, "The picture of the designs cannot be drawn", serve)
        };
        self.asked = Some(order.key.clone());
        self.worker.get_or_insert_with(start).ask(order);
    }

    fn take_drawn(&mut self, wanted: &RasterKey, ctx: &Context) {
        if self.is_shown(wanted) {
            // What was asked for is not wanted any more, and comes too late.
            self.asked = None;
        }
        let drawn = self.worker.iter().flat_map(Latest::answers);
        // What broke says nothing of the picture before, which stays.
        let newest = drawn.filter_map(Result::ok).last();
        if let Some((key, image)) = newest
            && self.asked.is_some()
        {
            self.show(key, image, ctx);
        }
    }

    fn show(&mut self, key: RasterKey, image: ColorImage, ctx: &Context) {
        let picture = match self.shown.take() {
            Some((_, mut picture)) => {
                picture.set(image, TextureOptions::LINEAR);
                picture
            }
            None => ctx.load_texture("study", image, TextureOptions::LINEAR),
        };
        self.shown = Some((key, picture));
    }
}

impl RasterOrder {
    fn drawn(self) -> (RasterKey, ColorImage) {
        let mut canvas = PixelCanvas::new(self.key.0);
        (self.draw)(&mut canvas);
        (self.key, canvas.image)
    }
}

/// Draws the latest that was asked for.
fn serve(
    order: RasterOrder,
    desk: &LatestDesk<RasterOrder, (RasterKey, ColorImage)>,
) -> Option<RasterOrder> {
    let order = desk.latest(order);
    desk.answer(Ok(order.drawn()));
    desk.wait()
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
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::{Duration, Instant};

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

    fn key(range: u64) -> RasterKey {
        ([4, 4], vec![(0, [range; 2])], vec![0], false)
    }

    #[test]
    fn a_picture_is_drawn_once_for_what_it_is_of() {
        let ctx = Context::default();
        let mut raster = Raster::default();
        let drawn = Arc::new(AtomicUsize::new(0));
        for range in [0, 0, 1, 1, 0] {
            let drawn = Arc::clone(&drawn);
            let draw = move |_: &mut PixelCanvas| {
                drawn.fetch_add(1, Ordering::Relaxed);
            };
            assert!(raster.of(key(range), &ctx, AT_ONCE, draw).is_some());
        }
        assert_eq!(drawn.load(Ordering::Relaxed), 3);
    }

    #[test]
    fn one_of_many_marks_comes_later_and_the_one_before_stays() {
        let ctx = Context::default();
        let mut raster = Raster::default();
        let (gate, open) = std::sync::mpsc::channel();
        let draw = move |_: &mut PixelCanvas| open.recv().unwrap();
        // Nothing yet, however often it is looked at.
        assert!(raster.of(key(0), &ctx, AT_ONCE + 1, draw).is_none());
        assert!(raster.of(key(0), &ctx, AT_ONCE + 1, |_| ()).is_none());
        gate.send(()).unwrap();
        let until = Instant::now() + Duration::from_secs(20);
        let shown = |raster: &mut Raster, of: u64| {
            raster.of(key(of), &ctx, AT_ONCE + 1, |_| ());
            raster.shown.as_ref().map(|(key, _)| key.clone())
        };
        while shown(&mut raster, 0) != Some(key(0)) {
            assert!(Instant::now() < until);
        }
        // One that cannot be drawn leaves it, and the next is drawn.
        let (begun, begins) = std::sync::mpsc::channel();
        let breaks = move |_: &mut PixelCanvas| {
            begun.send(()).unwrap();
            panic!("nothing can be drawn")
        };
        assert!(raster.of(key(7), &ctx, AT_ONCE + 1, breaks).is_some());
        begins.recv().unwrap();
        assert!(raster.of(key(1), &ctx, AT_ONCE + 1, |_| ()).is_some());
        while shown(&mut raster, 1) != Some(key(1)) {
            assert!(Instant::now() < until);
        }
        // Other columns have other axes.
        let others = ([4, 4], Vec::new(), vec![1], false);
        assert!(raster.of(others, &ctx, AT_ONCE + 1, |_| ()).is_none());
        // What comes after one has gone back to what is shown is not shown.
        assert_eq!(shown(&mut raster, 1), Some(key(1)));
        for _ in 0..50 {
            std::thread::sleep(Duration::from_millis(1));
            assert_eq!(shown(&mut raster, 1), Some(key(1)));
        }
    }
}
