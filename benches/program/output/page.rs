//! The page.

use std::error::Error;

use maud::{DOCTYPE, PreEscaped, html};

use super::{
    plots::{self, Labels, Series},
    summary,
    tables::{self, Table},
};
use crate::{
    record::{Record, Results, Verdict},
    suite::group,
};

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1200px;margin:2em auto;padding:0 1em;color:#222}\
table{border-collapse:collapse;font-size:13px;margin:.5em 0 2em}th,td{padding:.2em .7em;text-align:right;border-bottom:1px solid #ddd}\
th:first-child,td:first-child{text-align:left}.scroll{overflow-x:auto}.plots{display:flex;flex-wrap:wrap;gap:1em}svg{width:calc(50% - .5em);min-width:420px;height:auto}";

pub(super) fn html(results: &Results) -> Result<String, Box<dyn Error>> {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                title { "cloth: benchmark of " (results.date) }
                style { (STYLE) }
            }
            body {
                h1 { "cloth: benchmark" }
                p { (summary::heading(results)) }
                p {
                    "Times are medians. Every result has been compared with that of the CPU in double precision, both \
                     going on for a frame from the state in which the measurement ended: the column "
                    em { "difference" }
                    " is the root of the mean square of the distances in units of the spacing. A run that differs is \
                     marked invalid. Bytes are those that a frame cannot do without."
                }
                div class="plots" {
                    @for plot in plots(results)? { (PreEscaped(plot)) }
                }
                @for table in tables::tables(results) { (table_html(&table)) }
            }
        }
    };
    Ok(page.into_string())
}

fn table_html(table: &Table) -> PreEscaped<String> {
    html! {
        h2 { (table.title) }
        p { (table.note) }
        div class="scroll" {
            table {
                thead { tr { @for word in &table.heading { th { (word) } } } }
                tbody { @for row in &table.rows { tr { @for cell in row { td { (cell) } } } } }
            }
        }
    }
}

fn plots(results: &Results) -> Result<Vec<String>, Box<dyn Error>> {
    let particles = |record: &Record| record.particles() as f64;
    let mut plots = Vec::new();
    for group in
        [group::EXPLICIT, group::CONTACT, group::IMPLICIT, group::JACOBI, group::SEMI_IMPLICIT]
    {
        let labels = Labels { title: group, x: "particles", y: "ms of a frame" };
        plots.push(plots::lines(&labels, &series(results, group, particles, Record::time))?);
    }
    let mut rates = Vec::new();
    for group in [group::EXPLICIT, group::CONTACT, group::IMPLICIT] {
        for mut line in series(results, group, particles, |record| record.rate().unwrap_or(0.0)) {
            line.name = format!("{}, {group}", line.name);
            rates.push(line);
        }
    }
    for engine in &results.engines {
        let name = format!("{}, copies", engine.backend);
        let points = vec![(1e3, engine.copy_rate), (4e6, engine.copy_rate)];
        rates.push(Series { name, points });
    }
    let labels =
        Labels { title: "bytes that a frame needs, against copies", x: "particles", y: "GB/s" };
    plots.push(plots::lines(&labels, &rates)?);
    let threads = |record: &Record| record.threads.unwrap_or(0) as f64;
    let labels =
        Labels { title: "strong scaling, 256 x 256 particles", x: "threads", y: "ms of a frame" };
    plots.push(plots::lines(&labels, &series(results, group::SCALING, threads, Record::time))?);
    let labels = Labels { title: "linear solvers", x: "ms of a step", y: "relative residual" };
    let residual = |record: &Record| record.quality.residual;
    plots.push(plots::lines(&labels, &series(results, group::RESIDUAL, Record::time, residual))?);
    for group in [group::EXPLICIT, group::CONTACT, group::IMPLICIT] {
        let staged = results.records.iter().filter(|r| r.group == group && r.columns == 160);
        let bars: Vec<_> = staged.map(|r| (r.backend.clone(), r.stages.clone())).collect();
        if !bars.is_empty() {
            plots.push(plots::shares(&format!("stages of {group}, 160 x 160 particles"), &bars)?);
        }
    }
    plots.extend(super::linear::plots(results)?);
    plots.retain(|plot| !plot.is_empty());
    Ok(plots)
}

/// The valid records of a group as lines, one for each backend and label.
pub(super) fn series(
    results: &Results,
    group: &str,
    x: impl Fn(&Record) -> f64,
    y: impl Fn(&Record) -> f64,
) -> Vec<Series> {
    let mut lines: Vec<Series> = Vec::new();
    for record in &results.records {
        if record.group != group || record.verdict == Verdict::Invalid {
            continue;
        }
        let name = match record.label.as_str() {
            "" => record.backend.clone(),
            label => format!("{}, {label}", record.backend),
        };
        let point = (x(record), y(record));
        match lines.iter_mut().find(|line| line.name == name) {
            Some(line) => line.points.push(point),
            None => lines.push(Series { name, points: vec![point] }),
        }
    }
    lines
}
