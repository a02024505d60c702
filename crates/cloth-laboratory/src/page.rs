//! Outcomes as a page.

mod plot;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use crate::{Experiment, Outcome, outcome::number};

/// A page in HTML with tables and plots of all outcomes; `device` says what computed them.
#[must_use]
pub fn page(device: &str, outcomes: &[(&Experiment, Outcome)]) -> String {
    let failed = outcomes.iter().filter(|(_, outcome)| !outcome.passes()).count();
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                title { "Laboratory tests of cloth" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { "Laboratory tests of cloth" }
                p { (device) ". " (outcomes.len()) " experiments, " (failed) " of them failed." }
                table {
                    tr { th { "experiment" } th { "numbers" } th { "failed" } th { "largest error" } }
                    @for (experiment, outcome) in outcomes { (summary(experiment, outcome)) }
                }
                @for (experiment, outcome) in outcomes { (section(experiment, outcome)) }
            }
        }
    };
    page.into_string()
}

const STYLE: &str = "body{font-family:sans-serif;max-width:75em;margin:2em auto;padding:0 1em}\
    table{border-collapse:collapse;margin:1em 0}td,th{padding:.15em .8em;text-align:right;border-bottom:1px solid #ddd}\
    td:first-child,th:first-child{text-align:left}.failed{background:#fbb}svg{max-width:100%}";

fn summary(experiment: &Experiment, outcome: &Outcome) -> Markup {
    let failed = outcome.measurements.iter().filter(|row| !row.passes()).count();
    let errors = outcome.measurements.iter().map(|row| row.error().abs());
    let largest = errors.fold(0.0, |a: f64, b| if b.is_nan() { b } else { a.max(b) });
    html! {
        tr class=(if failed == 0 { "" } else { "failed" }) {
            td { a href={ "#" (experiment.name) } { (experiment.name) } }
            td { (outcome.measurements.len()) }
            td { (failed) }
            td { (if largest.is_nan() { "no rest".into() } else { format!("{:.2} %", 100.0 * largest) }) }
        }
    }
}

fn section(experiment: &Experiment, outcome: &Outcome) -> Markup {
    let trends = outcome.trends();
    let most = trends.iter().map(Vec::len).max().unwrap_or(0);
    html! {
        h2 id=(experiment.name) { (experiment.name) @if !outcome.passes() { " (failed)" } }
        p { (experiment.title) ". Expected: " (experiment.source) "." }
        @for plot in &outcome.plots { (PreEscaped(plot::svg(plot).unwrap_or_default())) }
        table {
            tr {
                th { "case" } th { "mesh" } th { "expected" }
                @for _ in 0..most { th { "cells" } th { "measured" } th { "error" } }
            }
            @for trend in trends {
                tr {
                    td { (trend[0].case) }
                    td { (trend[0].mesh.name()) }
                    td { (trend[0].expected) " " (trend[0].unit) }
                    @for row in trend {
                        @let class = if row.passes() { "" } else { "failed" };
                        td { (row.cells) }
                        td class=(class) { (number(row.measured)) }
                        td class=(class) { (row.deviation()) }
                    }
                }
            }
        }
    }
}
