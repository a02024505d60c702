//! The table and the plot of the README.

use std::{
    error::Error,
    fs,
    path::{Path, PathBuf},
};

use super::{
    linear, page,
    plots::{self, Labels},
    read, tables,
};
use crate::{
    record::{Record, Results},
    suite::group,
};

const MARKS: [&str; 2] = ["<!-- benchmark:begin -->", "<!-- benchmark:end -->"];

/// Groups and sizes that have a row.
const ROWS: [(&str, &str, [u32; 3]); 4] = [
    (group::EXPLICIT, "explicit, a frame of 17 substeps", [160, 512, 1024]),
    (group::CONTACT, "the same with self-contact", [160, 512, 1024]),
    (group::IMPLICIT, "implicit, a step of 30 iterations", [60, 160, 1024]),
    (group::SEMI_IMPLICIT, "semi-implicit, a step", [33, 60, 256]),
];

/// Writes both, of one file of results for each machine, and of later ones of some of its backends.
///
/// # Errors
/// If a file cannot be read or written, or the README has no marks.
pub(crate) fn write(results: &[PathBuf], into: &Path, plot: &Path) -> Result<(), Box<dyn Error>> {
    let results = results.iter().map(|path| read(path)).collect::<Result<Vec<_>, _>>()?;
    let text = fs::read_to_string(into).map_err(|error| format!("{}: {error}", into.display()))?;
    let replaced = replace(&text, &section(&results, plot)).ok_or_else(|| {
        format!("{}: the marks {} and {} are missing", into.display(), MARKS[0], MARKS[1])
    })?;
    if let Some(folder) = plot.parent() {
        fs::create_dir_all(folder)?;
    }
    fs::write(plot, picture(&results)?).map_err(|error| format!("{}: {error}", plot.display()))?;
    if let Some(picture) = linear::picture(&results)? {
        let path = linear_plot(plot);
        fs::write(&path, picture).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    fs::write(into, replaced).map_err(|error| format!("{}: {error}", into.display()))?;
    Ok(())
}

/// Where the plot of linear solvers goes: beside the other one.
fn linear_plot(plot: &Path) -> PathBuf {
    plot.with_file_name("linear.svg")
}

/// The text with what stands between the marks replaced.
fn replace(text: &str, section: &str) -> Option<String> {
    let (before, rest) = text.split_once(MARKS[0])?;
    let (_, after) = rest.split_once(MARKS[1])?;
    Some(format!("{before}{}\n{section}\n{}{after}", MARKS[0], MARKS[1]))
}

/// A backend on a machine: a column of the table.
struct Column<'a> {
    title: String,
    backend: &'a str,
    results: &'a Results,
}

fn columns(results: &[Results]) -> Vec<Column<'_>> {
    let mut columns = Vec::new();
    for results in results {
        for engine in &results.engines {
            // The device of the processor is its threads and instructions; its name is the machine's.
            let device = match engine.backend.as_str() {
                "cpu" => {
                    format!("{}, {} threads", results.machine.processor, results.machine.threads)
                }
                _ => engine.device.clone(),
            };
            let title = format!("{}: {device}", engine.backend);
            let column = Column { title, backend: &engine.backend, results };
            // A GPU that the processor plays has none of these sizes.
            if !ROWS.iter().any(|(group, _, sides)| {
                sides.iter().any(|&side| cell(&column, group, side).is_some())
            }) {
                continue;
            }
            // Of the same device the later results count.
            match columns.iter_mut().find(|older: &&mut Column<'_>| older.title == column.title) {
                Some(older) => *older = column,
                None => columns.push(column),
            }
        }
    }
    columns
}

fn section(results: &[Results], plot: &Path) -> String {
    let columns = columns(results);
    let mut lines = vec!["| ms | particles |".to_owned(), "|---|---|".to_owned()];
    for column in &columns {
        lines[0] += &format!(" {} |", column.title.replace('|', "/"));
        lines[1] += "---:|";
    }
    for (group, title, sides) in ROWS {
        for side in sides {
            let cells: Vec<_> = columns.iter().map(|column| cell(column, group, side)).collect();
            if cells.iter().any(Option::is_some) {
                let cells: Vec<_> =
                    cells.into_iter().map(|cell| cell.unwrap_or_else(|| "-".into())).collect();
                lines.push(format!("| {title} | {side} x {side} | {} |", cells.join(" | ")));
            }
        }
    }
    let dates: Vec<_> = results
        .iter()
        .filter(|r| !r.records.is_empty())
        .map(|r| format!("{} ({}, revision {})", r.date, r.machine.system, r.revision))
        .collect();
    lines.push(String::new());
    lines.push(format!(
        "Medians by `cargo xtask bench --suite full`, {}. Every result was compared with that of the CPU in double precision.",
        dates.join(", ")
    ));
    lines.push(String::new());
    lines.push(format!("![Time of a frame against particles]({})", plot.display()));
    if results.iter().any(|results| !results.linear.is_empty()) {
        lines.push(String::new());
        let plot = linear_plot(plot);
        lines.push(
            "By `cargo xtask bench --suite linear`, whose page has iterations, stiffness, time steps and layers in contact beside this:"
                .into(),
        );
        lines.push(String::new());
        lines.push(format!("![Time of a linear solve against particles]({})", plot.display()));
    }
    lines.join("\n")
}

fn cell(column: &Column<'_>, group: &str, side: u32) -> Option<String> {
    let is_it = |record: &&Record| {
        record.group == group && record.backend == column.backend && record.columns == side
    };
    column.results.records.iter().find(is_it).map(tables::time)
}

fn picture(results: &[Results]) -> Result<String, Box<dyn Error>> {
    let mut lines = Vec::new();
    for column in columns(results) {
        for (group, title) in [(group::EXPLICIT, "explicit"), (group::CONTACT, "self-contact")] {
            let particles = |record: &Record| record.particles() as f64;
            let series = page::series(column.results, group, particles, Record::time);
            for mut line in series.into_iter().filter(|line| line.name == column.backend) {
                let engine = column.results.engines.iter().find(|e| e.backend == column.backend);
                let device = engine.map_or("", |engine| &engine.device);
                line.name = format!("{}, {device}: {title}", column.backend);
                lines.push(line);
            }
        }
    }
    let labels = Labels {
        title: "A patch falls onto a sphere",
        x: "particles",
        y: "ms of a frame (1/60 s)",
    };
    plots::lines(&labels, &lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_stands_between_the_marks_is_replaced() {
        let text = format!("a\n{}\nold\n{}\nb", MARKS[0], MARKS[1]);
        let expected = format!("a\n{}\nnew\n{}\nb", MARKS[0], MARKS[1]);
        assert_eq!(replace(&text, "new"), Some(expected));
        assert_eq!(replace("no marks", "new"), None);
    }

    #[test]
    fn later_results_of_a_backend_take_the_place_of_earlier_ones() {
        let published = |name: &str| {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("results");
            read(&folder.join(name)).expect("it is in the repository")
        };
        let results = [published("h200.json"), published("h200_cuda.json")];
        let columns = columns(&results);
        let found = columns.iter().map(|column| (column.backend, &*column.results.revision));
        let [all, cuda] = results.each_ref().map(|results| &*results.revision);
        assert_eq!(found.collect::<Vec<_>>(), [("cpu", all), ("wgpu", all), ("cuda", cuda)]);
    }
}
