//! A scatter plot: many points of two figures, and a few of them joined to a front.

use std::fmt::Write as _;

use super::svg::{PALETTE, escape};

/// A point with what is said of it where the pointer rests on it.
pub struct Dot {
    pub at: [f64; 2],
    pub words: String,
    /// Whether no other point beats it.
    pub on_front: bool,
    /// Whether it keeps what is required.
    pub allowed: bool,
}

/// Room for the numbers of the axes.
const LEFT: f64 = 66.0;
const TOP: f64 = 14.0;
const RIGHT: f64 = 16.0;
const BOTTOM: f64 = 46.0;

/// An axis from one number to another, and where its numbers stand.
struct LinearAxis {
    from: f64,
    to: f64,
    ticks: Vec<f64>,
}

impl LinearAxis {
    fn over(values: impl Iterator<Item = f64> + Clone) -> Self {
        let low = values.clone().fold(f64::INFINITY, f64::min);
        let high = values.fold(f64::NEG_INFINITY, f64::max);
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        let span = (high - low).max(1e-9 * high.abs()).max(1e-12);
        let rough = span / 5.0;
        let power = 10_f64.powf(rough.log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|s| s * power);
        let step = steps.into_iter().find(|s| *s >= rough).unwrap_or(rough);
        let (from, to) = ((low / step).floor(), (high / step).ceil());
        let to = if to > from { to } else { from + 1.0 };
        let ticks = (0..=(to - from) as usize).map(|k| step * (from + k as f64));
        Self {
            from: step * from,
            to: step * to,
            ticks: ticks.collect(),
        }
    }

    fn share(&self, value: f64) -> f64 {
        (value - self.from) / (self.to - self.from)
    }
}

/// Draws them over two labelled axes.
#[must_use]
pub fn scatter(title: &str, [x_label, y_label]: [&str; 2], dots: &[Dot], width: f64) -> String {
    let height = 0.6 * width;
    let [x, y] = [0, 1].map(|k| LinearAxis::over(dots.iter().map(move |d| d.at[k])));
    let px = |v: f64| LEFT + x.share(v) * (width - LEFT - RIGHT);
    let py = |v: f64| TOP + (1.0 - y.share(v)) * (height - TOP - BOTTOM);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" role=\"img\" aria-label=\"{0}\" class=\"plot\"><title>{0}</title>",
        escape(title)
    );
    for tick in &y.ticks {
        let at = py(*tick);
        let _ = write!(
            svg,
            "<path d=\"M{LEFT} {at:.1}H{:.1}\" class=\"grid\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            width - RIGHT,
            LEFT - 6.0,
            at + 4.0,
            tidy(*tick)
        );
    }
    for tick in &x.ticks {
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            px(*tick),
            height - BOTTOM + 18.0,
            tidy(*tick)
        );
    }
    let _ = write!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text><text transform=\"translate(14 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        f64::midpoint(LEFT, width),
        height - 8.0,
        escape(x_label),
        height / 2.0,
        escape(y_label)
    );
    front(&mut svg, dots, &px, &py);
    for dot in dots {
        mark(&mut svg, dot, &px, &py);
    }
    svg.push_str("</svg>");
    svg
}

/// One dot, with its words for whoever rests on it.
fn mark(svg: &mut String, dot: &Dot, px: &dyn Fn(f64) -> f64, py: &dyn Fn(f64) -> f64) {
    let colour = match (dot.on_front, dot.allowed) {
        (true, _) => PALETTE[1],
        (false, true) => PALETTE[0],
        (false, false) => "#b8bec8",
    };
    let _ = write!(
        svg,
        "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{}\" fill=\"{colour}\" fill-opacity=\".8\"><title>{}</title></circle>",
        px(dot.at[0]),
        py(dot.at[1]),
        if dot.on_front { 5 } else { 3 },
        escape(&dot.words)
    );
}

/// The front as steps: between two of its points nothing better was found.
fn front(svg: &mut String, dots: &[Dot], px: &dyn Fn(f64) -> f64, py: &dyn Fn(f64) -> f64) {
    let mut on: Vec<[f64; 2]> = dots.iter().filter(|d| d.on_front).map(|d| d.at).collect();
    on.sort_by(|a, b| a[0].total_cmp(&b[0]).then(b[1].total_cmp(&a[1])));
    let mut d = String::new();
    for (k, [x, y]) in on.iter().enumerate() {
        let _ = if k == 0 {
            write!(d, "M{:.1} {:.1}", px(*x), py(*y))
        } else {
            write!(d, "H{:.1}V{:.1}", px(*x), py(*y))
        };
    }
    if !d.is_empty() {
        let _ = write!(
            svg,
            "<path d=\"{d}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/>",
            PALETTE[1]
        );
    }
}

/// A number of an axis without the dust of its making.
fn tidy(value: f64) -> String {
    let rounded = format!("{value:.9}");
    let text = rounded.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" {
        "0".into()
    } else {
        text.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_hold_all_points_and_have_round_numbers() {
        let axis = LinearAxis::over([0.93, 2.31, 1.4].into_iter());
        assert!(axis.from <= 0.93 && axis.to >= 2.31);
        assert_eq!(
            axis.ticks.iter().map(|t| tidy(*t)).collect::<Vec<_>>(),
            ["0.5", "1", "1.5", "2", "2.5"]
        );
        let one = LinearAxis::over([3.0].into_iter());
        assert!(one.from <= 3.0 && one.to >= 3.0 && one.share(3.0).is_finite());
        assert!(LinearAxis::over(std::iter::empty()).share(0.5).is_finite());
    }
}
