//! `hapdef study collect`: tables, a front and a report of what was computed so far.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use serde_json::{Value, json};

use crate::cli::out;
use crate::io::scatter::{Dot, scatter};
use crate::io::study_folder::{Outcome, StudyFolder, in_a_cell, plain};
use crate::io::svg::escape;
use crate::io::table::Writing;
use crate::io::together::Together;
use crate::io::{FileError, atomic};
use crate::parameter_study::{Points, front};
use crate::plain as words;

#[derive(Args, Debug, Clone)]
pub struct CollectArgs {
    /// The study's folder, as `hapdef study plan` wrote it.
    pub folder: PathBuf,
    /// Print one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Runs the command.
///
/// # Errors
/// A message in the user's terms.
pub(super) fn run(args: &CollectArgs) -> anyhow::Result<()> {
    let folder = StudyFolder::open(&args.folder)?;
    let collected = Collected::of(&folder)?;
    let together = Together::claim(&args.folder)?;
    let costs = costs_csv(&folder);
    together.replace(|into| {
        let write = |name: &str, text: &str| atomic::write(&into.join(name), text.as_bytes());
        write("results.csv", &collected.csv())?;
        write("results.json", &collected.json().to_string())?;
        write("study.html", &collected.page())?;
        write("costs.csv", &costs)
    })?;
    let [done, failed, missing] = collected.counts();
    let said = format!(
        "{} of {} computed, {failed} failed, {missing} missing",
        done + failed,
        words::count(folder.plan.units, "unit")
    );
    if args.json {
        let on_front = collected.on_front();
        let said = json!({ "units": folder.plan.units, "done": done, "failed": failed, "missing": missing, "front": on_front });
        return out::line(&said.to_string());
    }
    out::line(&said)?;
    for unit in collected.on_front() {
        out::line(&format!(
            "on the front: unit {unit}, {}",
            collected.in_words(unit)
        ))?;
    }
    for name in ["results.csv", "results.json", "costs.csv", "study.html"] {
        out::say(&format!("wrote {}", args.folder.join(name).display()));
    }
    Ok(())
}

/// What units took: beside the results, which are the same whoever computes them.
fn costs_csv(folder: &StudyFolder) -> String {
    let mut table = Writing::new(["unit", "cpu_seconds", "seconds", "shared"]);
    for cost in (0..folder.plan.units).filter_map(|unit| folder.cost(unit)) {
        table.row([
            cost.unit.to_string(),
            format!("{:.2}", cost.cpu_seconds),
            format!("{:.2}", cost.seconds),
            u8::from(cost.shared).to_string(),
        ]);
    }
    table.text()
}

/// One unit with what came of it.
struct Row {
    values: Vec<Value>,
    outcome: Option<Outcome>,
    figures: BTreeMap<String, f64>,
    /// Whether it keeps all that is required.
    allowed: bool,
    on_front: bool,
}

impl Row {
    fn state(&self) -> &'static str {
        match &self.outcome {
            None => "missing",
            Some(outcome) if outcome.error.is_some() => "failed",
            Some(_) => "done",
        }
    }
}

struct Collected<'a> {
    folder: &'a StudyFolder,
    /// Names of the figures, in the order in which units have them.
    names: Vec<String>,
    rows: Vec<Row>,
}

impl<'a> Collected<'a> {
    fn of(folder: &'a StudyFolder) -> anyhow::Result<Self> {
        let points =
            Points::of(&folder.study).map_err(|why| FileError::broken(&folder.folder, why))?;
        let mut names: Vec<String> = Vec::new();
        let mut rows = Vec::with_capacity(folder.plan.units);
        for unit in 0..folder.plan.units {
            let outcome = folder.outcome(unit)?;
            let all = outcome.iter().flat_map(|o| &o.figures);
            for (name, _) in all.clone() {
                if !names.contains(name) {
                    names.push(name.clone());
                }
            }
            let figures = all.filter_map(|(name, value)| Some((name.clone(), (*value)?)));
            rows.push(Row {
                values: points.values(unit).iter().map(plain).collect(),
                figures: figures.collect(),
                outcome,
                allowed: false,
                on_front: false,
            });
        }
        let mut collected = Self {
            folder,
            names,
            rows,
        };
        collected.judge()?;
        Ok(collected)
    }

    /// Who keeps what is required, and whom of these no other beats.
    fn judge(&mut self) -> anyhow::Result<()> {
        let aim = &self.folder.study.aim;
        let asked = aim
            .minimize
            .iter()
            .chain(aim.require.iter().map(|b| &b.figure));
        if let Some(unknown) = asked.clone().find(|f| !self.names.contains(f))
            && !self.names.is_empty()
        {
            bail!(
                "[aim] names the figure {}, which no unit has. There are {}",
                words::quote(unknown),
                self.names.join(", ")
            );
        }
        for row in &mut self.rows {
            let value = |name: &str| row.figures.get(name).copied();
            let keeps = aim
                .require
                .iter()
                .all(|bound| bound.holds(value(&bound.figure)));
            row.allowed = keeps && row.state() == "done";
        }
        if aim.minimize.is_empty() {
            return Ok(());
        }
        let numbers = |row: &Row| -> Vec<f64> {
            let value = |name: &String| row.figures.get(name).copied();
            let all = aim.minimize.iter().map(value);
            all.map(|v| v.filter(|_| row.allowed).unwrap_or(f64::NAN))
                .collect()
        };
        let numbers: Vec<Vec<f64>> = self.rows.iter().map(numbers).collect();
        for (row, on_front) in self.rows.iter_mut().zip(front(&numbers)) {
            row.on_front = on_front;
        }
        Ok(())
    }

    /// Units that were computed, those that failed by themselves, and those that are missing.
    fn counts(&self) -> [usize; 3] {
        ["done", "failed", "missing"].map(|s| self.rows.iter().filter(|r| r.state() == s).count())
    }

    fn on_front(&self) -> Vec<usize> {
        let all = self.rows.iter().enumerate();
        all.filter(|(_, row)| row.on_front)
            .map(|(unit, _)| unit)
            .collect()
    }

    fn keys(&self) -> impl Iterator<Item = &str> {
        self.folder.study.axes.iter().map(|a| a.key.as_str())
    }

    /// The values of a unit's axes and what is to be small.
    fn in_words(&self, unit: usize) -> String {
        let row = &self.rows[unit];
        let axes = self.keys().zip(&row.values);
        let axes = axes.map(|(key, value)| format!("{key} = {}", in_a_cell(value)));
        let small = self.folder.study.aim.minimize.iter();
        let small = small.filter_map(|name| Some(format!("{name} {:.4}", row.figures.get(name)?)));
        axes.chain(small).collect::<Vec<_>>().join(", ")
    }

    fn csv(&self) -> String {
        let fixed = ["state"]
            .into_iter()
            .chain(self.names.iter().map(String::as_str));
        let columns = ["unit"].into_iter().chain(self.keys()).chain(fixed);
        let mut table = Writing::new(columns.chain(["front", "error"]));
        for (unit, row) in self.rows.iter().enumerate() {
            let figure =
                |name: &String| row.figures.get(name).map_or(String::new(), f64::to_string);
            let error = row
                .outcome
                .as_ref()
                .and_then(|o| o.error.clone())
                .unwrap_or_default();
            let cells = [unit.to_string()].into_iter();
            let cells = cells.chain(row.values.iter().map(in_a_cell));
            let cells = cells.chain([row.state().to_owned()]);
            let cells = cells.chain(self.names.iter().map(figure));
            table.row(cells.chain([u8::from(row.on_front).to_string(), error]));
        }
        table.text()
    }

    fn json(&self) -> Value {
        let rows: Vec<Value> = (self.rows.iter().enumerate())
            .map(|(unit, row)| {
                let values: serde_json::Map<String, Value> = self
                    .keys()
                    .map(String::from)
                    .zip(row.values.iter().cloned())
                    .collect();
                let outcome = row.outcome.as_ref();
                json!({
                    "unit": unit,
                    "values": values,
                    "state": row.state(),
                    "figures": row.figures,
                    "front": row.on_front,
                    "error": outcome.and_then(|o| o.error.as_ref()),
                    "cautions": outcome.map_or(&[][..], |o| &o.cautions),
                })
            })
            .collect();
        let [done, failed, missing] = self.counts();
        let aim = &self.folder.study.aim;
        json!({
            "version": self.folder.plan.version,
            "study": self.folder.plan.study,
            "base": self.folder.plan.base,
            "done": done, "failed": failed, "missing": missing,
            "minimize": aim.minimize,
            "figures": self.names,
            "rows": rows,
        })
    }

    fn page(&self) -> String {
        const STYLE: &str = ":root{color-scheme:light}body{font:15px/1.5 system-ui,sans-serif;color:#1d2430;background:#fff;max-width:1080px;margin:32px auto;padding:0 20px}table{border-collapse:collapse;font-variant-numeric:tabular-nums}th,td{padding:4px 10px;text-align:right;border-bottom:1px solid #e7eaef}svg{width:100%;height:auto}svg text{font:12px system-ui,sans-serif;fill:#1d2430}svg .grid{stroke:#e1e5ea;fill:none}div.wide{overflow-x:auto}";
        let [done, failed, missing] = self.counts();
        let mut page = format!(
            "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>Study</title><style>{STYLE}</style></head><body><h1>Study of {} designs</h1><p>{done} computed, {failed} failed by themselves, {missing} missing.</p>",
            self.rows.len()
        );
        let aim = &self.folder.study.aim;
        for pair in aim.minimize.windows(2) {
            let dots: Vec<Dot> = (0..self.rows.len())
                .filter_map(|u| self.dot(u, pair))
                .collect();
            let title = format!("{} against {}", pair[1], pair[0]);
            let _ = write!(
                page,
                "<h2>{}</h2><p>Orange: no other design is as small in all that is to be small. Grey: does not keep what is required.</p>{}",
                escape(&title),
                scatter(&title, [&pair[0], &pair[1]], &dots, 900.0)
            );
        }
        let units = self.on_front();
        if !units.is_empty() {
            self.table(&mut page, "On the front", &units);
        }
        let failed: Vec<usize> = (0..self.rows.len())
            .filter(|&u| self.rows[u].state() == "failed")
            .collect();
        if !failed.is_empty() {
            page.push_str("<h2>Failed</h2><ul>");
            for unit in failed {
                let why = self.rows[unit]
                    .outcome
                    .as_ref()
                    .and_then(|o| o.error.as_deref());
                let _ = write!(
                    page,
                    "<li>unit {unit}: {}</li>",
                    escape(why.unwrap_or_default())
                );
            }
            page.push_str("</ul>");
        }
        page.push_str("<p>Every figure of every unit stands in results.csv.</p></body></html>\n");
        page
    }

    fn dot(&self, unit: usize, names: &[String]) -> Option<Dot> {
        let row = &self.rows[unit];
        Some(Dot {
            at: [*row.figures.get(&names[0])?, *row.figures.get(&names[1])?],
            words: format!("unit {unit}: {}", self.in_words(unit)),
            on_front: row.on_front,
            allowed: row.allowed,
        })
    }

    fn table(&self, page: &mut String, title: &str, units: &[usize]) {
        let _ = write!(
            page,
            "<h2>{title}</h2><div class=\"wide\"><table><tr><th>unit</th>"
        );
        let shown = &self.folder.study.aim.minimize;
        for name in self.keys().chain(shown.iter().map(String::as_str)) {
            let _ = write!(page, "<th>{}</th>", escape(name));
        }
        page.push_str("</tr>");
        for &unit in units {
            let row = &self.rows[unit];
            let _ = write!(page, "<tr><td>{unit}</td>");
            for value in &row.values {
                let _ = write!(page, "<td>{}</td>", escape(&in_a_cell(value)));
            }
            for name in shown {
                let figure = row
                    .figures
                    .get(name)
                    .map_or("–".into(), |v| words::digits(*v));
                let _ = write!(page, "<td>{figure}</td>");
            }
            page.push_str("</tr>");
        }
        page.push_str("</table></div>");
    }
}
