//! The run: engines, cases, results. Results are written after every group of cases, so that nothing is lost if the
//! machine gives up in the middle.

use std::{error::Error, path::Path};

use indicatif::{ProgressBar, ProgressStyle};

use crate::{
    arguments::{Arguments, BackendName, Suite},
    case::{Case, CaseError},
    engine::{Engine, Engines},
    linear, machine, measure,
    output::{self, compare::Comparison},
    record::{FORMAT, Failure, Results},
    suite::{self, group},
};

/// Runs all that the arguments ask for.
///
/// # Errors
/// For a folder that cannot be written, older results that cannot be read, and if no backend is here.
pub(crate) fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    // Whatever can be wrong with files is found before hours of work.
    output::prepare(&arguments.out)?;
    let older = arguments.compare.as_deref().map(output::read).transpose()?;
    let (engines, absent) = open(arguments);
    for (name, reason) in &absent {
        eprintln!("{name} is absent: {reason}");
    }
    if engines.all.is_empty() {
        return Err("none of the backends is here: nothing to measure".into());
    }
    let mut run = Run {
        results: Results {
            format: FORMAT,
            date: machine::date(),
            revision: machine::revision(),
            suite: arguments.suite.name().into(),
            machine: machine::machine(),
            engines: engines.all.iter().map(Engine::facts).collect(),
            absent,
            records: Vec::new(),
            stiffness: Vec::new(),
            linear: Vec::new(),
            failures: Vec::new(),
        },
        out: &arguments.out,
        engines,
    };
    run.cases(arguments.suite)?;
    if matches!(arguments.suite, Suite::Full | Suite::Tables) {
        run.stiffness()?;
        run.ladder()?;
    }
    if matches!(arguments.suite, Suite::Full | Suite::Linear) {
        run.linear()?;
    }
    output::summary::print(&run.results);
    if let Some(older) = older {
        Comparison::new(&older, &run.results).print();
    }
    println!("\n{}: index.html, results.json, results.csv", arguments.out.display());
    Ok(())
}

fn open(arguments: &Arguments) -> (Engines, Vec<(String, String)>) {
    let (mut engines, mut absent) = (Vec::new(), Vec::new());
    let mut names: Vec<BackendName> = Vec::new();
    for &name in &arguments.backends {
        if names.contains(&name) {
            continue;
        }
        names.push(name);
        match Engine::open(name, arguments.adapter.as_deref()) {
            Ok(engine) => engines.push(engine),
            Err(reason) => absent.push((name.name().to_owned(), reason)),
        }
    }
    (Engines::new(engines), absent)
}

struct Run<'a> {
    engines: Engines,
    results: Results,
    out: &'a Path,
}

impl Run<'_> {
    fn cases(&mut self, suite: Suite) -> Result<(), Box<dyn Error>> {
        let reference = cloth::backend_create("cpu", None)?;
        for number in 0..self.engines.all.len() {
            let cases = suite::cases(suite, &self.engines.all[number])?;
            let bar = ProgressBar::new(cases.len() as u64);
            bar.set_style(ProgressStyle::with_template("{wide_bar} {pos}/{len} {msg}")?);
            let mut group = "";
            for case in &cases {
                let engine = &self.engines.all[number];
                let name = engine.name();
                if self.engines.is_lost(name) {
                    break;
                }
                bar.set_message(format!("{name} {}", title(case)));
                match measure::measure(engine, &*reference, case) {
                    Ok(record) => self.results.records.push(record),
                    Err(error) => {
                        if let CaseError::Solver(error) = &error {
                            self.engines.report(name, error);
                        }
                        bar.suspend(|| eprintln!("{name} {}: {error}", title(case)));
                        let failure = failure(case.group, name, title(case), &error);
                        self.results.failures.push(failure);
                    }
                }
                bar.inc(1);
                if group != case.group {
                    group = case.group;
                    self.write()?;
                }
            }
            bar.finish_and_clear();
            self.write()?;
        }
        Ok(())
    }

    /// Solvers of linear systems by themselves.
    fn linear(&mut self) -> Result<(), Box<dyn Error>> {
        for number in 0..self.engines.all.len() {
            let systems = linear::systems(&self.engines.all[number]);
            let bar = ProgressBar::new(systems.len() as u64);
            bar.set_style(ProgressStyle::with_template("{wide_bar} {pos}/{len} {msg}")?);
            let mut known = linear::Known::new();
            for system in systems {
                let engine = &self.engines.all[number];
                let name = engine.name();
                if self.engines.is_lost(name) {
                    break;
                }
                let (sweep, x, workload) = system;
                let title = format!("{} {x}, {} particles", sweep.name(), workload.particles());
                bar.set_message(format!("{name} {title}"));
                let records = &mut self.results.linear;
                if let Err(error) = linear::measure(engine, system, &mut known, records) {
                    if let CaseError::Solver(error) = &error {
                        self.engines.report(name, error);
                    }
                    bar.suspend(|| eprintln!("{name} {title}: {error}"));
                    self.results.failures.push(failure("linear systems", name, title, &error));
                }
                bar.inc(1);
                self.write()?;
            }
            bar.finish_and_clear();
        }
        Ok(())
    }

    /// How far stiffness can be raised, on every engine.
    fn stiffness(&mut self) -> Result<(), Box<dyn Error>> {
        for engine in self.engines.present() {
            match suite::stiffness_bounds(engine.backend()) {
                Ok(bounds) => self.results.stiffness.push((
                    engine.name().into(),
                    bounds.iter().map(|(name, exponent)| ((*name).into(), *exponent)).collect(),
                )),
                Err(error) => self.results.failures.push(failure(
                    group::TABLE_STIFFNESS,
                    engine.name(),
                    "stiffness".into(),
                    &error,
                )),
            }
        }
        self.write()
    }

    fn ladder(&mut self) -> Result<(), Box<dyn Error>> {
        let has_gpu = self.engines.present().any(|engine| engine.name() == "cuda");
        let records = &mut self.results.records;
        if let Err(error) = suite::ladder::measure(has_gpu, |found| records.extend(found)) {
            let failure = failure(group::TABLE_LADDER, "cuda", "ladder".into(), &error);
            self.results.failures.push(failure);
        }
        self.write()
    }

    fn write(&self) -> Result<(), Box<dyn Error>> {
        output::write(self.out, &self.results)
    }
}

fn failure(group: &str, backend: &str, case: String, error: &dyn Error) -> Failure {
    Failure { group: group.into(), backend: backend.into(), case, error: error.to_string() }
}

fn title(case: &Case) -> String {
    let [columns, rows] = case.size();
    let label = if case.label.is_empty() { String::new() } else { format!(", {}", case.label) };
    format!("{}{label}, {columns} x {rows}", case.group)
}
