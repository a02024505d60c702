//! Plots and table of solvers of linear systems.

use std::error::Error;

use super::plots::{self, Labels, Series};
use crate::{
    linear::{GOALS, Sweep},
    record::{LinearRecord, Results},
};

/// For every sweep and goal iterations and time, a line for each backend and preconditioner; solves that did not get there are
/// left out.
pub(super) fn plots(results: &Results) -> Result<Vec<String>, Box<dyn Error>> {
    let iterations = |record: &LinearRecord| f64::from(record.iterations);
    let solve = |record: &LinearRecord| record.solve;
    let build = |record: &LinearRecord| record.build;
    let mut all = Vec::new();
    for sweep in Sweep::ALL {
        for (goal, ..) in GOALS {
            for (y, value) in [
                ("iterations", &iterations as &dyn Fn(&LinearRecord) -> f64),
                ("ms of a solve", &solve),
            ] {
                let title = format!("{goal}: {y}");
                let labels = Labels { title: &title, x: sweep.name(), y };
                all.push(plots::lines(&labels, &series(results, (sweep.name(), goal), value))?);
            }
        }
    }
    let lines = series(results, (Sweep::Particles.name(), GOALS[0].0), &build);
    let labels =
        Labels { title: "building the preconditioner", x: Sweep::Particles.name(), y: "ms" };
    all.push(plots::lines(&labels, &lines)?);
    Ok(all)
}

fn series(
    results: &Results,
    (sweep, goal): (&str, &str),
    y: &dyn Fn(&LinearRecord) -> f64,
) -> Vec<Series> {
    let mut lines: Vec<Series> = Vec::new();
    let wanted = |record: &&LinearRecord| record.sweep == sweep && record.goal == goal;
    for record in results.linear.iter().filter(wanted).filter(|record| record.is_reached) {
        let name = format!("{}, {}", record.backend, record.preconditioner);
        let point = (record.x, y(record));
        match lines.iter_mut().find(|line| line.name == name) {
            Some(line) => line.points.push(point),
            None => lines.push(Series { name, points: vec![point] }),
        }
    }
    lines
}

/// Time to the first goal against particles, of all results that have it.
///
/// # Errors
/// If it cannot be drawn.
pub(super) fn picture(results: &[Results]) -> Result<Option<String>, Box<dyn Error>> {
    let mut lines = Vec::new();
    let of = (Sweep::Particles.name(), GOALS[0].0);
    for results in results {
        for mut line in series(results, of, &|record| record.solve) {
            if line.name.ends_with("diagonal") {
                continue;
            }
            let engine = results.engines.iter().find(|e| line.name.starts_with(&e.backend));
            line.name += &engine.map_or_else(String::new, |engine| format!(": {}", engine.device));
            lines.push(line);
        }
    }
    let labels = Labels {
        title: "An implicit system of stiff fabric, to a hundredth of the energy",
        x: Sweep::Particles.name(),
        y: "ms of a solve",
    };
    Ok(Some(plots::lines(&labels, &lines)?).filter(|picture| !picture.is_empty()))
}

/// One line for every solve.
pub(super) fn csv(results: &Results) -> Result<String, Box<dyn Error>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for record in &results.linear {
        writer.serialize(record)?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}
