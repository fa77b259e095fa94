//! The picture of a trade-off.

use std::fmt::Write as _;

use crate::io::svg::escape;
use crate::project::Project;
use crate::trade::{Measured, TradePoint, front};

/// Of the picture.
const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 430.0;

/// Error over CPU time, both by their logarithms: all points, and the front as a line of steps.
pub(super) fn plot(project: &Project, points: &[TradePoint]) -> String {
    let own = |p: &&TradePoint| p.setting.answers(project);
    let measured: Vec<(&TradePoint, &Measured)> = (points.iter())
        .filter(own)
        .filter_map(|p| Some((p, p.measured()?)))
        .filter(|(_, m)| m.error_mm > 0.0 && m.cpu_seconds > 0.0)
        .collect();
    let best: Vec<&Measured> = front(project, points)
        .into_iter()
        .filter_map(TradePoint::measured)
        .collect();
    let [x, y] = [
        LogAxis::of(
            measured.iter().map(|(_, m)| m.cpu_seconds),
            62.0,
            WIDTH - 18.0,
        ),
        LogAxis::of(
            measured.iter().map(|(_, m)| m.error_mm),
            HEIGHT - 46.0,
            34.0,
        ),
    ];
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" font-family=\"sans-serif\" font-size=\"12\"><title>Localization error against processor time</title><rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#fff\"/><text x=\"62\" y=\"20\" font-weight=\"bold\">Localization error against processor time</text>"
    );
    grid(&mut svg, &x, &y);
    let _ = write!(
        svg,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">CPU time up to the judged answer (s)</text><text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">mean error (mm)</text>",
        WIDTH / 2.0,
        HEIGHT - 8.0,
        HEIGHT / 2.0
    );
    for (point, measured) in measured {
        dot(&mut svg, &x, &y, point, measured);
    }
    steps(&mut svg, &x, &y, &best);
    svg
}

/// Lines at round values, with those beside them.
fn grid(svg: &mut String, x: &LogAxis, y: &LogAxis) {
    for value in x.ticks() {
        let at = x.at(value);
        let _ = write!(
            svg,
            "<path d=\"M{at:.1} 34V{}\" stroke=\"#ddd\"/><text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{value}</text>",
            HEIGHT - 46.0,
            HEIGHT - 30.0
        );
    }
    for value in y.ticks() {
        let at = y.at(value);
        let _ = write!(
            svg,
            "<path d=\"M62 {at:.1}H{}\" stroke=\"#ddd\"/><text x=\"56\" y=\"{:.1}\" text-anchor=\"end\">{value}</text>",
            WIDTH - 18.0,
            at + 4.0
        );
    }
}

/// One setting; the named qualities with their names.
fn dot(svg: &mut String, x: &LogAxis, y: &LogAxis, point: &TradePoint, m: &Measured) {
    let (cx, cy) = (x.at(m.cpu_seconds), y.at(m.error_mm));
    let label = escape(&format!(
        "{:.1} s, {:.2} mm: {}",
        m.cpu_seconds,
        m.error_mm,
        point.setting.in_words()
    ));
    let _ = write!(
        svg,
        "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"3.5\" fill=\"#9aa5b1\"><title>{label}</title></circle>"
    );
    if point.setting.limits.is_none() {
        let _ = write!(
            svg,
            "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"6\" fill=\"none\" stroke=\"#d55e00\" stroke-width=\"2\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#a34700\">{}</text>",
            cx - 10.0,
            cy + 4.0,
            point.setting.quality.name()
        );
    }
}

/// The front as a line of steps.
fn steps(svg: &mut String, x: &LogAxis, y: &LogAxis, best: &[&Measured]) {
    let mut line = String::new();
    for (k, m) in best.iter().enumerate() {
        let (cx, cy) = (x.at(m.cpu_seconds), y.at(m.error_mm));
        let _ = if k == 0 {
            write!(line, "M{cx:.1} {cy:.1}")
        } else {
            write!(line, "H{cx:.1}V{cy:.1}")
        };
        let _ = write!(
            svg,
            "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"4.5\" fill=\"#0072b2\"/>"
        );
    }
    let _ = write!(
        svg,
        "<path d=\"{line}\" fill=\"none\" stroke=\"#0072b2\" stroke-width=\"2\"/></svg>"
    );
}

/// A logarithmic axis.
struct LogAxis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl LogAxis {
    fn of(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let (low, high) = values
            .filter(|v| v.is_finite() && *v > 0.0)
            .fold((f64::INFINITY, 0.0), |(l, h): (f64, f64), v| {
                (l.min(v), h.max(v))
            });
        let (low, high) = if high > 0.0 { (low, high) } else { (1.0, 10.0) };
        Self {
            low: low / 1.15,
            high: high * 1.15,
            from,
            to,
        }
    }

    fn at(&self, value: f64) -> f64 {
        let share = (value / self.low).ln() / (self.high / self.low).ln();
        self.from + share * (self.to - self.from)
    }

    /// Round values on it.
    fn ticks(&self) -> Vec<f64> {
        let round = [1.0, 1.5, 2.0, 3.0, 5.0, 7.0];
        (-3..7)
            .flat_map(|decade| round.map(|r| r * 10f64.powi(decade)))
            .filter(|v| (self.low..=self.high).contains(v))
            .map(|v| (v * 1e4).round() / 1e4)
            .collect()
    }
}
