//! Pictures of the limb and plots, drawn as SVG text: a report needs no graphics adapter.

use std::fmt::Write as _;

use glam::{DMat3, DVec2, DVec3};

use crate::colormap::ColorMap;
use crate::gauge::Gauge;
use crate::mesh::TriMesh;
use crate::mesh::flatten::Flat;
use crate::mesh::stance::Stance;
use crate::mesh::stretch::KEPT;
use crate::plain;

/// A gauge to be drawn, with its number; its normal is from the inside to the outside.
#[derive(Clone, Copy, Debug)]
pub struct Marker {
    pub number: usize,
    pub gauge: Gauge,
}

/// A side to look from: towards the viewer, and up.
#[derive(Clone, Copy, Debug)]
pub struct ViewSide {
    pub name: &'static str,
    pub toward: DVec3,
    pub up: DVec3,
}

/// The sides a report shows, named as in the window.
#[must_use]
pub fn standard_views(stance: Stance) -> [ViewSide; 4] {
    let (up, front, right) = (stance.up(), stance.front(), stance.right());
    [
        ("front", front),
        ("right", right),
        ("back", -front),
        ("left", -right),
    ]
    .map(|(name, toward)| ViewSide {
        name,
        toward: (toward + up * 0.25).normalize(),
        up,
    })
}

const ACCENT: &str = "#d55e00";

/// The limb from one side: facets painted from the back, coloured by `paint`, the gauges
/// numbered. Gauges on the far side are drawn hollow.
#[must_use]
pub fn limb(
    mesh: &TriMesh,
    paint: Paint,
    markers: &[Marker],
    view: &ViewSide,
    width: f64,
) -> String {
    let right = view.up.cross(view.toward).normalize();
    let frame = DMat3::from_cols(right, view.toward.cross(right), view.toward).transpose();
    let seen: Vec<DVec3> = mesh.positions().iter().map(|&p| frame * p).collect();
    let (lower, upper) = bounds(seen.iter().map(|p| p.truncate()));
    let canvas = SvgCanvas::new(lower, upper, width);
    let mut svg = canvas.open(&format!("The limb from the {}", view.name));
    for t in from_behind(mesh.triangles(), &seen) {
        let tri = mesh.triangles()[t];
        let facing = mesh.facet_normal(t as u32).dot(view.toward);
        let points = tri.map(|v| canvas.place(seen[v as usize].truncate()));
        let _ = write!(
            svg,
            "<path d=\"{}\" fill=\"{}\"/>",
            path(&points),
            paint.facet(tri, facing)
        );
    }
    for marker in markers {
        let at = canvas.place((frame * marker.gauge.position).truncate());
        let tip = (frame * marker.gauge.direction).truncate();
        let near = marker.gauge.normal.dot(view.toward) > 0.0;
        draw_marker(&mut svg, at, DVec2::new(tip.x, -tip.y), marker.number, near);
    }
    svg.push_str("</g></svg>");
    svg
}

/// Facets in the order in which they are painted over each other: those with the least z first.
#[must_use]
pub fn from_behind(triangles: &[[u32; 3]], positions: &[DVec3]) -> Vec<usize> {
    let depth = |t: usize| -> f64 {
        let corners = triangles[t].iter();
        corners.map(|&v| positions[v as usize].z).sum()
    };
    let mut order: Vec<usize> = (0..triangles.len()).collect();
    order.sort_by(|&a, &b| depth(a).total_cmp(&depth(b)).then(a.cmp(&b)));
    order
}

/// The limb laid flat, its axis up, with its size in millimetres; hatched where lengths are not kept.
#[must_use]
pub fn unrolled(flat: &Flat, paint: Paint, markers: &[Marker], width: f64) -> String {
    let canvas = SvgCanvas::new(flat.lower, flat.upper, width);
    let mut svg = canvas.open("The limb unrolled, with numbered gauges");
    let corners = |tri: &[u32; 3]| tri.map(|v| canvas.place(flat.positions[v as usize].truncate()));
    for t in from_behind(&flat.triangles, &flat.positions) {
        let tri = &flat.triangles[t];
        let of_part = tri.map(|v| flat.vertices[v as usize]);
        let _ = write!(
            svg,
            "<path d=\"{}\" fill=\"{}\"/>",
            path(&corners(tri)),
            paint.facet(of_part, 0.85)
        );
    }
    let stretched = (flat.triangles.iter().zip(&flat.stretch.facets))
        .filter(|&(_, &off)| off > KEPT)
        .map(|(tri, _)| path(&corners(tri)));
    hatch(&mut svg, &stretched.collect::<String>());
    for marker in markers {
        let at = canvas.place(flat.place(marker.gauge.position));
        let direction = flat.turn(marker.gauge.position, marker.gauge.direction);
        let direction = direction.normalize_or_zero();
        let direction = DVec2::new(direction.x, -direction.y);
        draw_marker(&mut svg, at, direction, marker.number, true);
    }
    let size = (flat.upper - flat.lower) * 1000.0;
    let _ = write!(
        svg,
        "</g><text x=\"{PAD:.0}\" y=\"{:.0}\">across, {:.0} mm →  ·  up, {:.0} mm ↑</text></svg>",
        canvas.height + 2.0 * PAD + 14.0,
        size.x,
        size.y
    );
    svg
}

/// Stripes over what a path encloses.
fn hatch(svg: &mut String, outlines: &str) {
    if outlines.is_empty() {
        return;
    }
    let _ = write!(
        svg,
        "<defs><pattern id=\"stretched\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(45)\"><path d=\"M0 0V6\" stroke=\"#1d2430\" stroke-opacity=\".45\" style=\"stroke-width:1.2\"/></pattern></defs><path class=\"stretched\" d=\"{outlines}\" fill=\"url(#stretched)\"/>"
    );
}

/// One line of a plot: name, colour-blind-safe colour and points.
pub struct PlotSeries<'a> {
    pub name: &'a str,
    pub points: Vec<(f64, f64)>,
}

/// Okabe and Ito's colours: told apart by everybody.
pub const PALETTE: [&str; 6] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#666666",
];

/// A line plot with axes, ticks and a legend.
#[must_use]
pub fn plot(
    title: &str,
    x_label: &str,
    y_label: &str,
    series: &[PlotSeries],
    width: f64,
) -> String {
    let (height, left, bottom) = (0.55 * width, 58.0, 44.0);
    let all = || {
        series
            .iter()
            .flat_map(|s| &s.points)
            .filter(|p| p.0.is_finite() && p.1.is_finite())
    };
    let x_max = all().map(|p| p.0).fold(1.0, f64::max);
    let x_min = all().map(|p| p.0).fold(x_max, f64::min);
    let (y_step, y_top) = ticks(all().map(|p| p.1).fold(0.0, f64::max));
    let px = |x: f64| left + (x - x_min) / (x_max - x_min).max(1e-12) * (width - left - 16.0);
    let py = |y: f64| 30.0 + (1.0 - y / y_top) * (height - 30.0 - bottom);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" role=\"img\" aria-label=\"{0}\" class=\"plot\"><title>{0}</title><text x=\"{left}\" y=\"16\" class=\"t\">{0}</text>",
        escape(title)
    );
    let mut y = 0.0;
    while y <= y_top * 1.0001 {
        let _ = write!(
            svg,
            "<path d=\"M{left} {1:.1}H{2:.1}\" class=\"grid\"/><text x=\"{3:.1}\" y=\"{4:.1}\" text-anchor=\"end\">{0}</text>",
            tidy(y),
            py(y),
            width - 16.0,
            left - 6.0,
            py(y) + 4.0
        );
        y += y_step;
    }
    let (x_step, _) = ticks(x_max - x_min);
    let mut x = (x_min / x_step.max(1.0)).ceil() * x_step.max(1.0);
    while x <= x_max * 1.0001 {
        let _ = write!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            px(x),
            height - bottom + 16.0,
            tidy(x)
        );
        x += x_step.max(1.0);
    }
    let _ = write!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text><text transform=\"translate(14 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        f64::midpoint(left, width),
        height - 8.0,
        escape(x_label),
        height / 2.0,
        escape(y_label)
    );
    // The legend stands on the right, where the lines are not.
    let right: Vec<f64> = all()
        .filter(|p| p.0 > f64::midpoint(x_min, x_max))
        .map(|p| p.1)
        .collect();
    let high = right.iter().sum::<f64>() > 0.5 * y_top * right.len() as f64;
    let legend = if high {
        height - bottom - 18.0 * series.len() as f64
    } else {
        40.0
    };
    for (k, line) in series.iter().enumerate() {
        let colour = PALETTE[k % PALETTE.len()];
        let mut d = String::new();
        for (i, p) in line.points.iter().enumerate() {
            let _ = write!(
                d,
                "{}{:.1} {:.1}",
                if i == 0 { 'M' } else { 'L' },
                px(p.0),
                py(p.1)
            );
            let _ = write!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\" fill=\"{colour}\"/>",
                px(p.0),
                py(p.1)
            );
        }
        let _ = write!(
            svg,
            "<path d=\"{d}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>"
        );
        let ly = legend + 18.0 * k as f64;
        let _ = write!(
            svg,
            "<path d=\"M{0:.1} {1:.1}h20\" stroke=\"{colour}\" stroke-width=\"2\"/><text x=\"{2:.1}\" y=\"{3:.1}\">{4}</text>",
            width - 190.0,
            ly,
            width - 164.0,
            ly + 4.0,
            escape(line.name)
        );
    }
    svg.push_str("</svg>");
    svg
}

/// Text that is safe inside SVG and HTML.
#[must_use]
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

const PAD: f64 = 14.0;

struct SvgCanvas {
    lower: DVec2,
    scale: f64,
    width: f64,
    height: f64,
}

impl SvgCanvas {
    fn new(lower: DVec2, upper: DVec2, width: f64) -> Self {
        let size = (upper - lower).max(DVec2::splat(1e-9));
        let scale = (width / size.x).min(1.4 * width / size.y);
        Self {
            lower,
            scale,
            width: size.x * scale,
            height: size.y * scale,
        }
    }

    fn open(&self, label: &str) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0} {:.0}\" role=\"img\" aria-label=\"{label}\" class=\"limb\"><title>{label}</title><g transform=\"translate({PAD} {PAD})\">",
            self.width + 2.0 * PAD,
            self.height + 2.0 * PAD + 20.0
        )
    }

    fn place(&self, p: DVec2) -> DVec2 {
        let q = (p - self.lower) * self.scale;
        DVec2::new(q.x, self.height - q.y)
    }
}

/// The smallest box around points.
pub(super) fn bounds(points: impl Iterator<Item = DVec2>) -> (DVec2, DVec2) {
    points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, u), p| {
        (l.min(p), u.max(p))
    })
}

fn path(points: &[DVec2; 3]) -> String {
    let [a, b, c] = points;
    format!(
        "M{:.1} {:.1}L{:.1} {:.1} {:.1} {:.1}z",
        a.x, a.y, b.x, b.y, c.x, c.y
    )
}

/// What colours the facets: one value a vertex, 0–1.
#[derive(Clone, Copy)]
pub enum Paint<'a> {
    /// Grey to blue-green, browner on the inside.
    Tint(&'a [f64]),
    Map(ColorMap, &'a [f64]),
}

impl Paint<'_> {
    /// Fill and stroke of a facet, darker when turned away.
    fn facet(self, tri: [u32; 3], facing: f64) -> String {
        stroked(self.ink(tri, facing))
    }

    /// Red, green and blue of a facet, darker when turned away.
    #[must_use]
    pub fn ink(self, tri: [u32; 3], facing: f64) -> [u8; 3] {
        let level = |values: &[f64]| tri.iter().map(|&v| values[v as usize]).sum::<f64>() / 3.0;
        let rgb = match self {
            Self::Tint(values) => shade(facing, level(values)),
            Self::Map(map, values) => {
                let light = 0.6 + 0.4 * facing.abs();
                map.at(level(values)).map(|c| 255.0 * c * light)
            }
        };
        rgb.map(|c| c.round() as u8)
    }
}

/// A bar of a colour map with its ends, for beside a picture.
#[must_use]
pub fn legend(map: ColorMap, title: &str, low: f64, high: f64) -> String {
    const STEPS: usize = 64;
    let mut svg = format!(
        "<svg viewBox=\"0 0 420 44\" style=\"max-width:420px\" role=\"img\" aria-label=\"{}\">",
        escape(title)
    );
    for k in 0..STEPS {
        let [r, g, b] = (map.at(k as f64 / (STEPS - 1) as f64)).map(|c| (255.0 * c).round() as u8);
        let _ = write!(
            svg,
            "<rect x=\"{}\" y=\"22\" width=\"4.2\" height=\"12\" fill=\"#{r:02x}{g:02x}{b:02x}\"/>",
            70 + 4 * k
        );
    }
    let _ = write!(
        svg,
        "<text x=\"198\" y=\"14\" text-anchor=\"middle\">{}</text><text x=\"64\" y=\"33\" text-anchor=\"end\">{low}</text><text x=\"332\" y=\"33\">{high}</text></svg>",
        escape(title)
    );
    svg
}

/// A stroke of the same colour closes the hairlines between facets.
fn stroked([r, g, b]: [u8; 3]) -> String {
    let colour = format!("#{r:02x}{g:02x}{b:02x}");
    format!("{colour}\" stroke=\"{colour}")
}

/// Grey to blue-green by tint, darker when turned away, browner on the inside.
fn shade(facing: f64, tint: f64) -> [f64; 3] {
    let light = 0.45 + 0.55 * facing.abs();
    let base = if facing > 0.0 {
        [222.0, 224.0, 228.0]
    } else {
        [176.0, 170.0, 160.0]
    };
    let tinted = if facing > 0.0 {
        [126.0, 190.0, 178.0]
    } else {
        [96.0, 150.0, 140.0]
    };
    let mix = |k: usize| light * (base[k] + (tinted[k] - base[k]) * tint.clamp(0.0, 1.0));
    [mix(0), mix(1), mix(2)]
}

fn draw_marker(svg: &mut String, at: DVec2, direction: DVec2, number: usize, near: bool) {
    let (a, b) = (at - direction * 17.0, at + direction * 17.0);
    let (fill, ink, dash) = if near {
        (ACCENT, "#fff", "")
    } else {
        ("#fff", ACCENT, " stroke-dasharray=\"3 2\"")
    };
    let _ = write!(
        svg,
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{ACCENT}\" stroke-width=\"4.5\"{dash}/><circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"8\" fill=\"{fill}\" stroke=\"{ACCENT}\"/><text x=\"{:.1}\" y=\"{:.1}\" style=\"fill:{ink}\" text-anchor=\"middle\" class=\"n\">{number}</text>",
        a.x,
        a.y,
        b.x,
        b.y,
        at.x,
        at.y,
        at.x,
        at.y + 3.6
    );
}

/// A round step and a round top for values from zero.
fn ticks(top: f64) -> (f64, f64) {
    if !(top > 0.0 && top.is_finite()) {
        return (1.0, 1.0);
    }
    let raw = top / 5.0;
    let step = plain::next_round(raw, &[1.0, 2.0, 5.0, 10.0]);
    (step, (top / step).ceil() * step)
}

fn tidy(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
