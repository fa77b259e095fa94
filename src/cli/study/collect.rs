//! `hapdef study collect`: tables, a front and a report of what was computed so far.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use crate::budget::unwatched;
use crate::cli::out;
use crate::io::atomic;
#[cfg(feature = "parquet")]
use crate::io::parquet_table::{ParquetColumn, parquet_table};
use crate::io::scatter::{Dot, scatter};
use crate::io::study_folder::{StudyFolder, in_a_cell};
use crate::io::svg::escape;
use crate::io::table::Writing;
use crate::io::together::Together;
use crate::plain as words;
use crate::varied::CollectedUnits;
#[cfg(feature = "parquet")]
use crate::varied::UnitRow;

#[derive(Args, Debug, Clone)]
pub struct StudyCollectArgs {
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
pub(super) fn run(args: &StudyCollectArgs) -> anyhow::Result<()> {
    let collected = CollectedUnits::of(StudyFolder::open(&args.folder)?, &unwatched)?;
    let folder = &collected.folder;
    let together = Together::claim(&args.folder)?;
    let costs = costs_csv(folder);
    #[cfg(feature = "parquet")]
    let columns = parquet_table(&columns(&collected)).map_err(anyhow::Error::msg)?;
    together.replace(|into| {
        let write = |name: &str, text: &str| atomic::write(&into.join(name), text.as_bytes());
        write("results.csv", &csv(&collected))?;
        write("results.json", &json(&collected).to_string())?;
        write("study.html", &page(&collected))?;
        #[cfg(feature = "parquet")]
        atomic::write(&into.join("results.parquet"), &columns)?;
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
    let mut written = vec!["results.csv", "results.json", "costs.csv", "study.html"];
    if cfg!(feature = "parquet") {
        written.insert(2, "results.parquet");
    }
    for name in written {
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

fn csv(collected: &CollectedUnits) -> String {
    let fixed = ["state"]
        .into_iter()
        .chain(collected.names.iter().map(String::as_str));
    let columns = ["unit"].into_iter().chain(collected.keys()).chain(fixed);
    let mut table = Writing::new(columns.chain(["front", "error"]));
    for (unit, row) in collected.rows.iter().enumerate() {
        let figure = |name: &String| row.figures.get(name).map_or(String::new(), f64::to_string);
        let error = row
            .outcome
            .as_ref()
            .and_then(|o| o.error.clone())
            .unwrap_or_default();
        let cells = [unit.to_string()].into_iter();
        let cells = cells.chain(row.values.iter().map(in_a_cell));
        let cells = cells.chain([row.state().to_owned()]);
        let cells = cells.chain(collected.names.iter().map(figure));
        table.row(cells.chain([u8::from(row.on_front).to_string(), error]));
    }
    table.text()
}

/// The columns of `results.csv`, each of one kind: whole numbers, numbers, yes or no, or text.
#[cfg(feature = "parquet")]
fn columns(collected: &CollectedUnits) -> Vec<(String, ParquetColumn)> {
    let rows = &collected.rows;
    let text = |of: &dyn Fn(&UnitRow) -> Option<String>| {
        ParquetColumn::Texts(rows.iter().map(of).collect())
    };
    let units = (0..rows.len() as i64).map(Some).collect();
    let mut columns = vec![("unit".to_owned(), ParquetColumn::Integers(units))];
    for (k, key) in collected.keys().enumerate() {
        let values: Vec<&Value> = rows.iter().map(|row| &row.values[k]).collect();
        columns.push((key.to_owned(), of_axis(&values)));
    }
    let state = text(&|row| Some(row.state().to_owned()));
    columns.push(("state".to_owned(), state));
    for name in &collected.names {
        let figures = rows.iter().map(|row| row.figures.get(name).copied());
        columns.push((name.clone(), ParquetColumn::Numbers(figures.collect())));
    }
    let front = rows.iter().map(|row| Some(row.on_front)).collect();
    columns.push(("front".to_owned(), ParquetColumn::Flags(front)));
    let error = text(&|row| row.outcome.as_ref().and_then(|o| o.error.clone()));
    columns.push(("error".to_owned(), error));
    columns
}

/// Values of an axis, as what all of them are.
#[cfg(feature = "parquet")]
fn of_axis(values: &[&Value]) -> ParquetColumn {
    if values.iter().all(|v| v.is_i64()) {
        ParquetColumn::Integers(values.iter().map(|v| v.as_i64()).collect())
    } else if values.iter().all(|v| v.is_number()) {
        ParquetColumn::Numbers(values.iter().map(|v| v.as_f64()).collect())
    } else if values.iter().all(|v| v.is_boolean()) {
        ParquetColumn::Flags(values.iter().map(|v| v.as_bool()).collect())
    } else {
        ParquetColumn::Texts(values.iter().map(|v| Some(in_a_cell(v))).collect())
    }
}

fn json(collected: &CollectedUnits) -> Value {
    let rows: Vec<Value> = (collected.rows.iter().enumerate())
        .map(|(unit, row)| {
            let values: serde_json::Map<String, Value> = collected
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
    let [done, failed, missing] = collected.counts();
    let aim = &collected.folder.study.aim;
    json!({
        "version": collected.folder.plan.version,
        "study": collected.folder.plan.study,
        "base": collected.folder.plan.base,
        "done": done, "failed": failed, "missing": missing,
        "minimize": aim.minimize,
        "figures": collected.names,
        "rows": rows,
    })
}

fn page(collected: &CollectedUnits) -> String {
    const STYLE: &str = ":root{color-scheme:light}body{font:15px/1.5 system-ui,sans-serif;color:#1d2430;background:#fff;max-width:1080px;margin:32px auto;padding:0 20px}table{border-collapse:collapse;font-variant-numeric:tabular-nums}th,td{padding:4px 10px;text-align:right;border-bottom:1px solid #e7eaef}svg{width:100%;height:auto}svg text{font:12px system-ui,sans-serif;fill:#1d2430}svg .grid{stroke:#e1e5ea;fill:none}div.wide{overflow-x:auto}";
    let [done, failed, missing] = collected.counts();
    let mut page = format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>Study</title><style>{STYLE}</style></head><body><h1>Study of {} designs</h1><p>{done} computed, {failed} failed by themselves, {missing} missing.</p>",
        collected.rows.len()
    );
    let aim = &collected.folder.study.aim;
    for pair in aim.minimize.windows(2) {
        let dots: Vec<Dot> = (0..collected.rows.len())
            .filter_map(|u| dot(collected, u, pair))
            .collect();
        let title = format!("{} against {}", pair[1], pair[0]);
        let _ = write!(
            page,
            "<h2>{}</h2><p>Orange: no other design is as small in all that is to be small. Grey: does not keep what is required.</p>{}",
            escape(&title),
            scatter(&title, [&pair[0], &pair[1]], &dots, 900.0)
        );
    }
    let units = collected.on_front();
    if !units.is_empty() {
        table(collected, &mut page, "On the front", &units);
    }
    let failed: Vec<usize> = (0..collected.rows.len())
        .filter(|&u| collected.rows[u].state() == "failed")
        .collect();
    if !failed.is_empty() {
        page.push_str("<h2>Failed</h2><ul>");
        for unit in failed {
            let why = collected.rows[unit]
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

fn dot(collected: &CollectedUnits, unit: usize, names: &[String]) -> Option<Dot> {
    let row = &collected.rows[unit];
    Some(Dot {
        at: [*row.figures.get(&names[0])?, *row.figures.get(&names[1])?],
        words: format!("unit {unit}: {}", collected.in_words(unit)),
        on_front: row.on_front,
        allowed: row.allowed,
    })
}

fn table(collected: &CollectedUnits, page: &mut String, title: &str, units: &[usize]) {
    let _ = write!(
        page,
        "<h2>{title}</h2><div class=\"wide\"><table><tr><th>unit</th>"
    );
    let shown = &collected.folder.study.aim.minimize;
    for name in collected.keys().chain(shown.iter().map(String::as_str)) {
        let _ = write!(page, "<th>{}</th>", escape(name));
    }
    page.push_str("</tr>");
    for &unit in units {
        let row = &collected.rows[unit];
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
