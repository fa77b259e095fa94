//! The placement report: one HTML file that needs nothing else.

mod certificate;
mod matched;
pub mod part;
mod regression;
pub mod settings;
mod words;

use std::fmt::Write as _;

use self::settings::settings;
use super::run::{Provenance, range, signal_to_noise, signal_unit};
use super::svg::{self, Marker, Paint, PlotSeries, escape};
use crate::colormap::ColorMap;
use crate::design::InnerFace;
use crate::design::curves::{curve, failure_curve, failure_ways};
use crate::design::{BLIND, Design, Inputs};
use crate::evaluation::EstimatorKind;
use crate::gauge::Gauge;
use crate::gaussian_process::GpTrial;
use crate::mesh::flatten::Flat;
use crate::placement::candidates::Candidates;
use crate::plain::{count, robust_top};

const STYLE: &str = "
:root{color-scheme:light}body{font:15px/1.5 system-ui,sans-serif;color:#1d2430;background:#fff;max-width:1080px;margin:32px auto;padding:0 20px}
h1{font-size:26px;margin:0 0 4px}h2{font-size:19px;margin:36px 0 10px;border-bottom:1px solid #d8dce3;padding-bottom:4px}
p.lead{color:#4a5568;margin-top:0}table{border-collapse:collapse;font-variant-numeric:tabular-nums;width:100%}
th,td{padding:5px 10px;text-align:right;white-space:nowrap;border-bottom:1px solid #e7eaef}th{font-weight:600;color:#4a5568;white-space:normal;vertical-align:bottom}th:first-child,td:first-child{text-align:left}
.views{display:grid;grid-template-columns:repeat(auto-fit,minmax(220px,1fr));gap:14px}figure{margin:0}figcaption{text-align:center;color:#4a5568;font-size:13px}
svg{width:100%;height:auto;display:block}svg text{font:12px system-ui,sans-serif;fill:#1d2430}svg text.n{font:bold 10px system-ui,sans-serif}svg text.t{font-weight:600}svg .grid{stroke:#e1e5ea;fill:none}
svg.limb path{stroke-width:.4}.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(420px,1fr));gap:18px}
div.doubts{background:#fdecea;border-left:4px solid #b3261e;padding:10px 18px;margin:12px 0}div.doubts ul{margin:6px 0}
ul.notes{background:#fff7e6;border-left:4px solid #d9a441;padding:10px 28px;margin:12px 0}
.numbers{display:flex;flex-wrap:wrap;gap:10px 34px;margin:14px 0}.numbers b{display:block;font-size:21px}.numbers span{color:#4a5568;font-size:13px}
details{overflow-x:auto;margin:10px 0}summary{cursor:pointer;color:#0072b2}table.map td{text-align:center}
@media print{body{margin:0;max-width:none}h2{break-after:avoid}figure{break-inside:avoid}}
";

/// The whole report.
#[must_use]
pub fn html(inputs: &Inputs, design: &Design, provenance: &Provenance) -> String {
    let mut page = String::new();
    let name = provenance
        .mesh_path
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    let _ = write!(
        page,
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\"><title>Gauge placement for {0}</title><style>{STYLE}</style></head><body><h1>Gauge placement for {0}</h1>",
        escape(&name)
    );
    head(&mut page, inputs, design);
    pictures(&mut page, inputs, design);
    sites(&mut page, inputs, design);
    regression::comparison(&mut page, design);
    plots(&mut page, design);
    errors(&mut page, design);
    error_map(&mut page, inputs, design);
    failures(&mut page, design);
    kernel_search(&mut page, design);
    part::section(&mut page, inputs, design, provenance);
    settings(&mut page, inputs, design, provenance);
    page.push_str("</body></html>\n");
    page
}

fn head(page: &mut String, inputs: &Inputs, design: &Design) {
    let dataset = &design.simulated.dataset;
    let chosen = design.chosen().len();
    let selector = inputs.project.selection.selector;
    let _ = write!(
        page,
        "<p class=\"lead\">{chosen} strain gauges, chosen by {} on {}{}, to find where a touch of {} N lands.</p><div class=\"numbers\">",
        design
            .chosen_selection()
            .map_or(selector.title(), |s| s.selector.title()),
        dataset.signal.name(),
        if design.by_hand {
            " and moved by hand"
        } else {
            ""
        },
        compared_n(inputs, design)
    );
    let at_force =
        (design.evaluation.judging.middle_n()).map_or(String::new(), |f| format!(", at {f} N"));
    for row in design.evaluation.of(design.chosen_id()) {
        number(
            page,
            &format!("{:.2} mm", row.error_mm),
            &format!("mean error as drawn, {}{at_force}", row.region),
        );
        number(page, &format!("{:.2} mm", row.median_mm), "median");
    }
    let inside = design.simulated.lattice.to_string();
    number(page, &inside, "inside sites");
    let feasible = design.reduced.feasible.len().to_string();
    match &design.candidates {
        Some(candidates) => {
            number(page, &feasible, "feasible");
            number(page, &candidates.rows.len().to_string(), "candidates");
        }
        None => number(page, &feasible, "feasible, all of them candidates"),
    }
    page.push_str("</div>");
    matched::by_force(page, design);
    certificate::line(page, design);
    let doubts = design.doubts();
    if !doubts.is_empty() {
        page.push_str("<div class=\"doubts\"><b>Numbers here that cannot be trusted</b><ul>");
        for doubt in &doubts {
            let _ = write!(page, "<li>{}</li>", escape(&doubt.words));
        }
        page.push_str("</ul></div>");
    }
    let words = design.words();
    list(page, "notes", &words.open);
    if !words.folded.is_empty() {
        let _ = write!(
            page,
            "<details><summary>How this came about: {}</summary>",
            count(words.folded.len(), "note")
        );
        list(page, "more", &words.folded);
        page.push_str("</details>");
    }
}

fn list(page: &mut String, class: &str, items: &[String]) {
    if items.is_empty() {
        return;
    }
    let _ = write!(page, "<ul class=\"{class}\">");
    for item in items {
        let _ = write!(page, "<li>{}</li>", escape(item));
    }
    page.push_str("</ul>");
}

/// The force (N) that figures without one of their own are of.
pub(super) fn compared_n(inputs: &Inputs, design: &Design) -> f64 {
    let judged = design.evaluation.judging.middle_n();
    judged.unwrap_or(inputs.project.touch.force_n)
}

fn number(page: &mut String, value: &str, label: &str) {
    let _ = write!(
        page,
        "<div><b>{}</b><span>{}</span></div>",
        escape(value),
        escape(label)
    );
}

/// The chosen gauges as markers, which face as their wall does from outside.
#[must_use]
pub fn markers(inputs: &Inputs, design: &Design) -> Vec<Marker> {
    let sites = &design.simulated.dataset.sites;
    let face = InnerFace::of(&inputs.project.part);
    (1..)
        .zip(design.chosen())
        .map(|(number, &s)| Marker {
            number,
            gauge: Gauge {
                normal: face.out(sites[s].gauge.normal),
                ..sites[s].gauge
            },
        })
        .collect()
}

/// Share of the sites around each vertex that are feasible: what tints the pictures.
#[must_use]
pub fn feasible_tint(design: &Design) -> Vec<f64> {
    let mesh = &design.simulated.mesh;
    let (mut sum, mut count) = (
        vec![0.0; mesh.positions().len()],
        vec![0.0; mesh.positions().len()],
    );
    for (at, verdict) in design
        .simulated
        .points
        .iter()
        .zip(&design.feasibility.verdicts)
    {
        for (k, v) in mesh.triangles()[at.triangle as usize]
            .into_iter()
            .enumerate()
        {
            sum[v as usize] += at.barycentric[k] * f64::from(u8::from(verdict.is_none()));
            count[v as usize] += at.barycentric[k];
        }
    }
    sum.iter()
        .zip(&count)
        .map(|(s, &c)| if c > 0.0 { s / c } else { 0.0 })
        .collect()
}

fn pictures(page: &mut String, inputs: &Inputs, design: &Design) {
    let mesh = &design.simulated.mesh;
    let tint = feasible_tint(design);
    let markers = markers(inputs, design);
    let stance = inputs.stance();
    let flat = Flat::of(mesh, stance);
    page.push_str("<h2>Where the gauges go</h2><p>Green: feasible for a gauge. Each bar shows the gauge's direction; hollow gauges are on the far wall. All gauges are glued to the inside. Up is the part's axis.</p><div class=\"views\">");
    for view in svg::standard_views(stance) {
        let _ = write!(
            page,
            "<figure>{}<figcaption>{}</figcaption></figure>",
            svg::limb(mesh, Paint::Tint(&tint), &markers, &view, 300.0),
            view.name
        );
    }
    let _ = write!(
        page,
        "</div><figure>{}<figcaption>unrolled, seen from outside. {}</figcaption></figure>",
        svg::unrolled(&flat, Paint::Tint(&tint), &markers, 900.0),
        flat.stretch.words()
    );
}

fn sites(page: &mut String, inputs: &Inputs, design: &Design) {
    let dataset = &design.simulated.dataset;
    let unit = signal_unit(dataset.signal);
    let _ = write!(
        page,
        "<h2>Sites</h2><table><tr><th>Gauge</th><th>x (mm)</th><th>y (mm)</th><th>z (mm)</th><th>Direction (x, y, z)</th><th>{} ({unit})</th><th>Rms strain (microstrain)</th><th>Signal to noise</th></tr>",
        match dataset.signal {
            crate::dataset::Signal::Strain => "Strain, from – to",
            _ => "Displacement, from – to",
        },
    );
    for (k, &s) in design.chosen().iter().enumerate() {
        let site = &dataset.sites[s];
        let (p, d) = (site.gauge.position * 1000.0, site.gauge.direction);
        let (low, high) = range(dataset, s);
        let ratio =
            signal_to_noise(inputs, site.rms_strain).map_or("–".into(), |r| format!("{r:.0}"));
        let decimals = if unit == "mm" { 3 } else { 0 };
        let _ = write!(
            page,
            "<tr><td>{}</td><td>{:.2}</td><td>{:.2}</td><td>{:.2}</td><td>{:+.3} {:+.3} {:+.3}</td><td>{low:.decimals$} – {high:.decimals$}</td><td>{:.0}</td><td>{ratio}</td></tr>",
            k + 1,
            p.x,
            p.y,
            p.z,
            d.x,
            d.y,
            d.z,
            site.rms_strain * 1e6
        );
    }
    let _ = write!(
        page,
        "</table><p>Places and directions are in the coordinates of the mesh file, in millimetres. Strains and signals are those under touches of {} N anywhere on the part.</p>",
        inputs.project.touch.force_n
    );
}

fn plots(page: &mut String, design: &Design) {
    page.push_str("<h2>Error against number of gauges</h2><div class=\"plots\">");
    let mut regions: Vec<&str> = design
        .evaluation
        .rows
        .iter()
        .map(|r| r.region.as_str())
        .collect();
    regions.dedup();
    let mut seen = Vec::new();
    for region in regions {
        if seen.contains(&region) {
            continue;
        }
        seen.push(region);
        let series: Vec<PlotSeries> = design
            .selections
            .iter()
            .map(|s| PlotSeries {
                name: s.selector.title(),
                points: curve(design, s.selector, region),
            })
            .chain(baseline(design, region))
            .collect();
        page.push_str(&svg::plot(
            &format!("Mean error, {region}"),
            "gauges",
            "mm",
            &series,
            520.0,
        ));
    }
    if let Some(candidates) = &design.candidates {
        reduction(page, candidates);
    }
    page.push_str("</div>");
}

/// What the feasible sites were reduced by.
fn reduction(page: &mut String, candidates: &Candidates) {
    let points = (candidates.curve.iter()).map(|p| (p.sites as f64, 100.0 * p.unexplained));
    page.push_str(&svg::plot(
        "Variance of all feasible sites left unexplained",
        "sites kept",
        "%",
        &[PlotSeries {
            name: "held-out touches",
            points: points.collect(),
        }],
        520.0,
    ));
}

/// Where on the part touches are found well and where not.
fn error_map(page: &mut String, inputs: &Inputs, design: &Design) {
    let mesh = &design.simulated.mesh;
    let Some(errors) = design.error_map(mesh) else {
        return;
    };
    let top = robust_top(&errors);
    let markers = markers(inputs, design);
    let shares: Vec<f64> = errors.iter().map(|e| e / top).collect();
    let flat = Flat::of(mesh, inputs.stance());
    let map = ColorMap::Viridis;
    let _ = write!(
        page,
        "<h2>Where the error is</h2><p>Mean error around each place, of the chosen gauges on unseen touches of {} N.</p>{}<figure>{}<figcaption>unrolled, seen from outside. {}</figcaption></figure>",
        compared_n(inputs, design),
        svg::legend(map, "error (mm)", 0.0, top),
        svg::unrolled(&flat, Paint::Map(map, &shares), &markers, 900.0),
        flat.stretch.words()
    );
    let Some((force, blind)) = design.blind_map(mesh) else {
        return;
    };
    let _ = write!(
        page,
        "<h2>Where nothing is felt</h2><p>Share of the touches of {force} N around each place that move none of the gauges by more than {BLIND} times its noise.</p>{}<figure>{}<figcaption>unrolled, seen from outside.</figcaption></figure>",
        svg::legend(map, "not felt (%)", 0.0, 100.0),
        svg::unrolled(&flat, Paint::Map(map, &blind), &markers, 900.0),
    );
}

/// The cross-validated search that the Gaussian process took its kernel from.
fn kernel_search(page: &mut String, design: &Design) {
    let Some(geometry) = design.reduced.geometry().filter(|g| !g.map.is_empty()) else {
        return;
    };
    let of = |f: fn(&GpTrial) -> f64| {
        let mut all: Vec<f64> = geometry.map.iter().map(f).collect();
        all.retain(|v| v.is_finite());
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    };
    let (lengths, powers) = (of(|t| t.kernel.length_m), of(|t| t.kernel.power));
    let scores = of(|t| t.error);
    let (Some(&low), Some(&high)) = (scores.first(), scores.last()) else {
        return;
    };
    page.push_str("<h2>The kernel of the Gaussian process</h2><p>Rms error of predicting sites that were left out, as a share of the signals, for every length and power that was tried; entropy and mutual information use the outlined one. A dash: no covariance.</p><table class=\"map\"><tr><th>Power \\ length (mm)</th>");
    for length in &lengths {
        let _ = write!(page, "<th>{:.1}</th>", length * 1e3);
    }
    page.push_str("</tr>");
    for power in &powers {
        let _ = write!(page, "<tr><th>{power}</th>");
        for length in &lengths {
            let found = (geometry.map.iter())
                .find(|t| t.kernel.length_m == *length && t.kernel.power == *power)
                .filter(|t| t.error.is_finite());
            let Some(trial) = found else {
                page.push_str("<td>–</td>");
                continue;
            };
            let used = trial.kernel == geometry.kernel;
            let [r, g, b] = ColorMap::Viridis
                .at((trial.error - low) / (high - low).max(f64::MIN_POSITIVE))
                .map(|c| (255.0 * c).round() as u8);
            let dark = f64::from(r) * 0.3 + f64::from(g) * 0.6 + f64::from(b) * 0.1 < 130.0;
            let _ = write!(
                page,
                "<td style=\"background:#{r:02x}{g:02x}{b:02x};color:{}{}\">{:.3}</td>",
                if dark { "#fff" } else { "#111" },
                if used {
                    ";outline:3px solid #d55e00;outline-offset:-3px;font-weight:700"
                } else {
                    ""
                },
                trial.error
            );
        }
        page.push_str("</tr>");
    }
    page.push_str("</table>");
}

fn failures(page: &mut String, design: &Design) {
    page.push_str("<h2>When gauges fail</h2><div class=\"plots\">");
    for &(retrained, title) in failure_ways(design.evaluation.judging.estimator()) {
        let series: Vec<PlotSeries> = design
            .evaluation
            .failures
            .iter()
            .map(|set| PlotSeries {
                name: set.set.chooser.title(),
                points: failure_curve(set, retrained),
            })
            .collect();
        page.push_str(&svg::plot(title, "failed gauges", "mm", &series, 520.0));
    }
    page.push_str("</div><details><summary>Every figure</summary><table><tr><th>Selector</th><th>Gauges</th><th>Failed</th><th>Trained anew</th><th>Mean (mm)</th><th>Worst (mm)</th><th>Subsets</th></tr>");
    for set in &design.evaluation.failures {
        for r in &set.rows {
            let _ = write!(
                page,
                "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.2}</td><td>{:.2}</td><td>{} of {}</td></tr>",
                escape(set.set.chooser.title()),
                set.set.sensors,
                r.failed,
                if r.retrained { "yes" } else { "no" },
                r.error_mm,
                r.worst_mm,
                r.subsets,
                r.of
            );
        }
    }
    page.push_str("</table></details>");
}

fn baseline<'a>(design: &Design, region: &str) -> Option<PlotSeries<'a>> {
    let row = design.evaluation.baseline(region)?;
    let most = design.selections.iter().map(|s| s.sets.len()).max()? as f64;
    Some(PlotSeries {
        name: row.set.chooser.title(),
        points: vec![(1.0, row.error_mm), (most, row.error_mm)],
    })
}

/// How sets were judged, and every figure.
fn errors(page: &mut String, design: &Design) {
    match design.evaluation.judging.estimator() {
        EstimatorKind::Matching => matched::errors(page, design),
        EstimatorKind::Svr => regression::errors(page, design),
    }
}
